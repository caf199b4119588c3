#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <utility>

// How the example generators write an NC program.
namespace smoothpost::examples {

/// A number with fixed decimals, never −0, with its trailing zeros.
inline std::string fixed(double value, int decimals) {
  const double step = std::pow(10.0, -decimals);
  if (std::abs(value) < 0.5 * step) value = 0.0;
  std::array<char, 64> buffer;
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                 std::chars_format::fixed, decimals);
  return std::string(buffer.data(), end.ptr);
}

/// A word of a block: its letter, its value, its decimals.
struct NcWord {
  char letter;
  double value;
  int decimals;
};

/// An NC program in the making; words that have not changed are left out.
class NcText {
 public:
  void line(const std::string& text) { text_ += text + '\n'; }
  void comment(const std::string& text) { line("(" + text + ")"); }

  /// `head` and the words whose printed value differs from the last one of their letter.
  void block(const std::string& head, std::initializer_list<NcWord> words) {
    std::string out = head;
    for (const NcWord& word : words) {
      const std::string text = word.letter + fixed(word.value, word.decimals);
      std::string& last = last_[static_cast<std::size_t>(word.letter - 'A')];
      if (text == last) continue;
      last = text;
      out += ' ' + text;
    }
    if (out != head) line(out);
  }
  /// Every word is written at its next use.
  void forget() { last_ = {}; }

  void write(const std::string& path) const {
    std::ofstream out(path, std::ios::binary);
    out << text_;
    out.close();
    if (!out) throw std::runtime_error("cannot write " + path);
  }

 private:
  std::string text_;
  std::array<std::string, 26> last_;
};

}  // namespace smoothpost::examples
