#pragma once

#include "formats/toml/toml.h"
#include "kernels/core/result.h"
#include "postproc/pipeline/options.h"

namespace smoothpost {

/// Options from a table of a job or case file: the command line's names with `-` or `_` between
/// words, strings for one value, arrays of strings for repeated options, booleans for switches. An
/// unknown name or a wrong type is an error with its place [US152].
Result<Options> options_from_toml(const TomlTable& table);

}  // namespace smoothpost
