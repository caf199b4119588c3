#pragma once

#include <span>
#include <string_view>

#include "machines/dialects/dialect.h"

// The explicit table of the dialects that this version writes and reads back, sorted by name. A new
// dialect is one row.
namespace smoothpost {

std::span<const Dialect> dialects();

/// Row of that name, or nullptr.
const Dialect* find_dialect(std::string_view name);

}  // namespace smoothpost
