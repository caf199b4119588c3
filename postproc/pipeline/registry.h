#pragma once

#include <span>
#include <string_view>

#include "machines/dialects/dialect_table.h"
#include "postproc/pipeline/interpret.h"

// The explicit table of what this version reads, sorted by name; that of what it writes stands in
// machines/dialects. A new format is one row.
namespace smoothpost {

struct InputFormat {
  const char* name;  ///< --input-format
  const char* description;
  const char* extensions;  ///< lower case, separated by blanks
  bool has_words;          ///< axis words of a machine: needs --input-machine when rotary
  Result<InterpretedInput> (*read)(std::string text, const InputSettings& settings);
};

std::span<const InputFormat> input_formats();

/// Row of that name, or nullptr.
const InputFormat* find_input_format(std::string_view name);

/// The format that a file name's extension stands for, or nullptr.
const InputFormat* format_by_extension(std::string_view file_name);

}  // namespace smoothpost
