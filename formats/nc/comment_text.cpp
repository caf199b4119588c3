#include "formats/nc/comment_text.h"

#include <array>
#include <charconv>

#include "formats/nc/number.h"

namespace smoothpost::nc {
namespace {

/// The format at `at`, such as %d or %.3f: how many bytes, 0 for none, and its decimals.
struct Format {
  std::size_t length = 0;
  int decimals = 6;
};

Format read_format(std::string_view text) {
  if (text.size() < 2) return {};
  if (text[1] == 'd') return {2, 0};
  if (text[1] == 'f') return {2, 6};
  if (text.size() >= 4 && text[1] == '.' && detail::is_digit(text[2]) && text[3] == 'f') {
    return {4, text[2] - '0'};
  }
  return {};
}

std::string fixed(double value, int decimals) {
  std::array<char, 400> buffer;
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                    std::chars_format::fixed, decimals);
  std::string text(buffer.data(), result.ptr);
  return text.find_first_of("123456789") == std::string::npos && text.front() == '-'
             ? text.substr(1)
             : text;
}

/// Whether a parameter begins here that a comment may show: digits, a name or another #.
/// @param named  a > stands somewhere behind it
bool begins_parameter(std::string_view text, bool named) {
  constexpr std::size_t kDeepest = 100;
  const std::size_t behind = text.substr(0, kDeepest).find_first_not_of('#');
  if (behind == std::string_view::npos) return false;
  return detail::is_digit(text[behind]) || (named && text[behind] == '<');
}

}  // namespace

std::string with_values(std::string_view text, const ParameterValues& values) {
  std::string out;
  int decimals = 6;
  const std::size_t last_name = text.rfind('>');
  for (std::size_t i = 0; i < text.size();) {
    if (text[i] == '%') {
      const Format format = read_format(text.substr(i));
      if (format.length > 0) {
        decimals = format.decimals;
        i += format.length;
        continue;
      }
    }
    if (text[i] == '#' &&
        begins_parameter(text.substr(i), last_name != text.npos && i < last_name)) {
      const std::string_view rest = text.substr(i);
      const Evaluated length = evaluate_value(rest, nullptr);
      if (length.ok()) {
        const Evaluated found = evaluate_value(rest, &values);
        out += found.ok() ? fixed(found.value, decimals) : "######";
        i += length.length;
        continue;
      }
    }
    out.push_back(text[i++]);
  }
  return out;
}

}  // namespace smoothpost::nc
