#pragma once

#include <functional>
#include <string>

#include "formats/toml/toml.h"
#include "kernels/core/result.h"
#include "postproc/pipeline/options.h"

namespace smoothpost {

/// Options from a table of a job or case file: the command line's names with `-` or `_` between
/// words, strings for one value, arrays of strings for repeated options, booleans for switches. An
/// unknown name or a wrong type is an error with its place [US152]. What the table does not name
/// stays as in `start`.
Result<Options> options_from_toml(const TomlTable& table, Options start = {});

/// Every option of such a table that is given, by name, each with its length: equal texts are equal
/// options.
std::string options_text(const Options& options);

/// `change` for the text of every option that takes text, lists' items too.
void for_each_text(Options& options, const std::function<void(std::string&)>& change);

}  // namespace smoothpost
