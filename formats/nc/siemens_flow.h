#pragma once

#include <string>
#include <string_view>

#include "formats/nc/flow_words.h"

namespace smoothpost::nc {

/// Whether a name begins a line of program flow that is read: IF ELSE ENDIF WHILE ENDWHILE GOTO
/// GOTOF GOTOB GOTOC. Any case.
bool is_siemens_flow(std::string_view name);

/// Reads such a line, from its first word to its end without comment: `IF condition`, `ELSE`,
/// `ENDIF`, `WHILE condition`, `ENDWHILE`, `[IF condition] GOTOF label`. A label is a name or a
/// block number such as N100; it is kept in FlowText::label, upper case.
FlowText read_siemens_flow(std::string_view text);

}  // namespace smoothpost::nc
