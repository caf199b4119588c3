#pragma once

#include <string>
#include <string_view>

// Text of users, made safe for HTML and SVG, and numbers for people.
namespace smoothpost {

/// `text` as the content of an element or of an attribute in double quotes: & < > " ' become
/// entities, bytes that are no UTF-8 and control characters become U+FFFD (newline and tab blanks).
std::string escape_html(std::string_view text);

/// `digits` significant digits in fixed notation without trailing zeros, "1.5e-9" below 1e-6 and
/// from 1e9 on; "no bound" for infinity, "unknown" for NaN. Never "-0".   @pre 1 ≤ digits ≤ 9
std::string short_number(double value, int digits = 4);

/// Bytes in base64, with padding.
std::string base64(std::string_view bytes);

}  // namespace smoothpost
