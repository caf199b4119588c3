#pragma once

#include <span>
#include <string_view>

#include "machines/dialects/dialect.h"
#include "postproc/pipeline/interpret.h"

// The explicit tables of what this version reads and writes, sorted by name. A new format or
// dialect is one row.
namespace smoothpost {

struct InputFormat {
  const char* name;  ///< --input-format
  const char* description;
  const char* extensions;  ///< lower case, separated by blanks
  bool has_words;          ///< axis words of a machine: needs --input-machine when rotary
  Result<InterpretedInput> (*read)(std::string text, const InputSettings& settings);
};

std::span<const InputFormat> input_formats();
std::span<const Dialect> dialects();

/// Row of that name, or nullptr.
const InputFormat* find_input_format(std::string_view name);
const Dialect* find_dialect(std::string_view name);

/// The format that a file name's extension stands for, or nullptr.
const InputFormat* format_by_extension(std::string_view file_name);

}  // namespace smoothpost
