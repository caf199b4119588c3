#pragma once

#include <charconv>
#include <string_view>

namespace smoothpost {

/// std::from_chars of the number at the front of `text`, which may have a plus in place of its
/// minus: it takes "+1" and "-1", and nothing of "+-1", "++1" or " 1".
inline std::from_chars_result from_signed(std::string_view text, double& value) {
  const char* const end = text.data() + text.size();
  if (text.size() < 2 || text.front() != '+') return std::from_chars(text.data(), end, value);
  if (text[1] == '-') return {text.data(), std::errc::invalid_argument};
  return std::from_chars(text.data() + 1, end, value);
}

}  // namespace smoothpost
