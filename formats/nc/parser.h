#pragma once

#include <string>

#include "formats/nc/program.h"
#include "kernels/core/result.h"

namespace smoothpost::nc {

/// A parsed program and what is wrong with its text. The program is complete even when there are
/// errors.
struct ParsedProgram {
  Program program;
  Diagnostics diagnostics;
};

/// Splits NC text of a dialect into blocks and pieces. Linear in the text, never throws on content.
ParsedProgram parse(std::string text, std::string file_name, InputDialect dialect);

/// The same for LinuxCNC (RS274NGC).
ParsedProgram parse(std::string text, std::string file_name);

}  // namespace smoothpost::nc
