#pragma once

#include <string>
#include <string_view>

#include "formats/nc/flow_words.h"

namespace smoothpost::nc {

/// Whether a name begins a line of program flow that is read: IF ELSE ENDIF WHILE ENDWHILE FOR
/// ENDFOR LOOP ENDLOOP REPEAT REPEATB UNTIL CASE GOTO GOTOF GOTOB GOTOC CALL EXTCALL. Any case.
bool is_siemens_flow(std::string_view name);

/// Whether a name may be that of a subprogram: two letters or _ first, or L and digits.
bool is_program_name(std::string_view name);

/// Reads such a line, from its first word to its end without comment: `IF condition`, `ELSE`,
/// `ENDIF`, `WHILE condition`, `ENDWHILE`, `FOR R1=a TO b`, `ENDFOR`, `LOOP`, `ENDLOOP`, `REPEAT`,
/// `UNTIL condition`, `[IF condition] GOTOF label`, `CASE value OF constant GOTOF label ...
/// [DEFAULT GOTOF label]`, `REPEAT label [label] [P=n]`, `REPEATB label [P=n]`, `L100 [P=n]`,
/// `NAME[(values)] [P=n]`, `CALL "NAME"`. A label is a name or a block number such as N100.
/// Labels and names are kept in upper case. Cost: linear.
FlowText read_siemens_flow(std::string_view text);

}  // namespace smoothpost::nc
