#pragma once

#include <string_view>
#include <vector>

#include "formats/nc/program.h"

namespace smoothpost::nc {

/// The dialects whose unambiguous marks stand in the text, in the order of InputDialect:
/// linuxcnc: M428, M429, #<name>, O-word subroutines and loops, (MSG, ..), (DEBUG, ..);
/// fanuc: G43.4, G43.5, G05.1, G5.1 Q, IF[, WHILE[, GOTO, G65 P;  haas: G234, G187;
/// siemens: TRAORI, A3=, MSG(", CYCLE832(, DEF REAL, %_N_.., R1=..
/// None: the text fits every dialect that knows plain words. G43.4 and G234 in one text: haas.
/// Cost: one pass.
std::vector<InputDialect> fitting_dialects(std::string_view text);

/// The text is a Heidenhain conversational program (BEGIN PGM), which no dialect here reads.
bool is_heidenhain(std::string_view text);

}  // namespace smoothpost::nc
