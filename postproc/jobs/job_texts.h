#pragma once

#include <string>
#include <vector>

#include "postproc/pipeline/convert.h"

// What a run says about itself: the program's first comments and the line on the terminal.
namespace smoothpost {

/// Lines of the program's title: version and machine, input and its hash, where the part is, tools.
/// None longer than 118 characters unless a word is: comments of some controls end at 120.
/// @param input name of the input's file without folder
std::vector<std::string> program_title(const ConvertInput& in, const std::string& input,
                                       const std::string& input_sha256);

/// Verdict, level, checks, the largest deviations, blocks and time in one line.
std::string summary_text(const Conversion& conversion);

}  // namespace smoothpost
