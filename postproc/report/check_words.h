#pragma once

#include <string>
#include <string_view>

namespace smoothpost {

/// One sentence for people that says what a check of that name compares (docs/guarantees.md has the
/// whole of it); empty for a name that is not known. "position_limit.X" is known by its part before
/// the point.
std::string check_words(std::string_view name);

/// What it means that something of that name (ReportContext's not_checked) was not checked.
std::string unchecked_words(std::string_view name);

}  // namespace smoothpost
