#include "machines/dialects/gcode_text.h"

#include <algorithm>

#include "kernels/core/units.h"
#include "machines/dialects/program_printer.h"

namespace smoothpost::gcode {

namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }
char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; }

/// Length of the number at the start of `text`, 0 when there is none.
std::size_t number_length(std::string_view text) {
  std::size_t n = !text.empty() && (text[0] == '-' || text[0] == '+') ? 1 : 0;
  while (n < text.size() && (is_digit(text[n]) || text[n] == '.')) ++n;
  return whole_number(text.substr(0, n)) ? n : 0;
}

/// All of `text` as words; false when it is something else.
bool take_words(std::string_view text, std::vector<Word>& words) {
  while (!(text = trimmed(text)).empty()) {
    const char letter = upper(text.front());
    if (letter < 'A' || letter > 'Z') return false;
    const std::string_view rest = text.substr(1);
    const std::size_t length = number_length(rest);
    if (length == 0) return false;
    words.push_back({letter, *whole_number(rest.substr(0, length))});
    text = rest.substr(length);
    if (!text.empty() && (text.front() == '.' || text.front() == '=')) return false;
  }
  return !words.empty();
}

class Reader {
 public:
  Reader(const std::string& file, const Syntax& syntax) : file_(file), syntax_(syntax) {}

  Parsed run(std::string_view text) {
    for (const auto line : text_lines(text)) {
      ++out_.line_count;
      read(line);
    }
    return std::move(out_);
  }

 private:
  void error(std::size_t column, std::string text) {
    constexpr std::size_t kMost = 100;
    if (out_.diagnostics.size() >= kMost) return;
    Diagnostic d;
    d.code = "NC340";
    d.text = std::move(text);
    d.where = {file_, static_cast<int>(out_.line_count), static_cast<int>(column)};
    out_.diagnostics.push_back(std::move(d));
  }

  void read(std::string_view line) {
    if (line.size() > syntax_.longest)
      return error(1, "the line is longer than " + std::to_string(syntax_.longest) +
                          " characters, which is more than this control takes");
    for (std::size_t i = 0; i < line.size(); ++i) {
      const auto byte = static_cast<unsigned char>(line[i]);
      if ((byte < 0x20U && byte != '\t') || byte > 0x7EU)
        return error(i + 1, "a character outside printable ASCII");
    }
    std::string_view rest = trimmed(line);
    if (rest.empty() || !take_number(rest)) return;
    Block block;
    block.at = {out_.line_count, static_cast<std::uint32_t>(rest.data() - line.data()) + 1};
    block.raw = rest;
    if (!without_comments(rest, block.text)) return;
    block.is_words = take_words(block.text, block.words);
    if (block.is_words) check_words(block);
    out_.blocks.push_back(std::move(block));
  }

  // Takes the N word from the front.
  bool take_number(std::string_view& rest) {
    if (upper(rest.front()) != 'N' || rest.size() < 2 || !is_digit(rest[1])) return true;
    std::size_t n = 1;
    while (n < rest.size() && is_digit(rest[n])) ++n;
    const auto number = whole_number(rest.substr(1, n - 1));
    if (n > 10 || !number || (n < rest.size() && rest[n] == '.'))
      return error(1, "N needs a whole number of at most nine digits"), false;
    if (syntax_.rising && *number <= last_number_)
      return error(1, "N does not rise from the block before"), false;
    last_number_ = *number;
    rest = trimmed(rest.substr(n));
    return !rest.empty();
  }

  bool without_comments(std::string_view line, std::string& text) {
    bool open = false;
    for (const char c : line) {
      if (!open && syntax_.semicolon && c == ';') break;
      if (c == '(' && open) return error(1, "a comment inside a comment"), false;
      if (c == ')' && !open) return error(1, "a ) without its ("), false;
      if (c == '(' || c == ')')
        open = c == '(';
      else if (!open)
        text += c;
    }
    if (open) return error(1, "a comment without its )"), false;
    text = trimmed(text);
    return true;
  }

  void check_words(const Block& block) {
    int motions = 0;
    std::string seen;
    for (const auto& word : block.words) {
      motions += word.letter == 'G' && word.value >= 0.0 && word.value <= 3.0 ? 1 : 0;
      if (word.letter == 'G' || word.letter == 'M') continue;
      if (seen.find(word.letter) != std::string::npos)
        error(block.at.column, std::string("the word ") + word.letter + " stands twice in a block");
      seen += word.letter;
    }
    if (motions > 1) error(block.at.column, "two of G0 to G3 in a block");
  }

  const std::string& file_;
  const Syntax& syntax_;
  double last_number_ = -1.0;
  Parsed out_;
};

}  // namespace

const Word* Block::find(char letter) const {
  for (const auto& word : words)
    if (word.letter == letter) return &word;
  return nullptr;
}

bool Block::has(char letter, double value) const {
  return std::any_of(words.begin(), words.end(), [letter, value](const Word& w) {
    return w.letter == letter && w.value == value;
  });
}

Parsed parse(std::string_view text, const std::string& file, const Syntax& syntax) {
  return Reader(file, syntax).run(text);
}

AxisWords::AxisWords(const MachineDefinition& machine, Style style)
    : machine_(machine),
      style_(style),
      length_scale_(machine.dialect.units == "inch" ? 1.0 / kMillimetresPerInch : 1.0) {}

std::string AxisWords::number(double value, int decimals) const {
  std::string text = decimal_text(value, decimals);
  if (style_.point && text.find('.') == std::string::npos) text += '.';
  if (style_.plus && text.front() != '-') text.insert(0, 1, '+');
  return text;
}

std::string AxisWords::length(double value) const {
  return number(value * length_scale_, machine_.dialect.digits_length);
}

std::string AxisWords::angle(double value) const {
  return number(degrees_from_radians(value), machine_.dialect.digits_angle);
}

std::string AxisWords::joint(int j, double value) const {
  const auto& axis = machine_.axes[static_cast<std::size_t>(j)];
  return axis.letter + (axis.joint.kind == JointKind::rotary ? angle(value) : length(value));
}

void AxisWords::put(std::string& words, const std::string& address, const std::string& word) {
  std::string& last = printed_[address];
  if (last == word) return;
  words += " " + word;
  last = word;
}

std::string AxisWords::joints(JointMask mask, const JointVector& to, const Vec3& shift) {
  static constexpr std::string_view kShifted = "XYZ";
  std::string words, one;
  for (int j = 0; j < machine_.size(); ++j) {
    if (!(mask >> j & 1U)) continue;
    const char letter = machine_.axes[static_cast<std::size_t>(j)].letter;
    const auto k = kShifted.find(letter);
    const double off = k == std::string_view::npos ? 0.0 : shift[static_cast<Eigen::Index>(k)];
    const std::string word = joint(j, to[j] - off);
    if (one.empty()) one = " " + word;
    put(words, std::string(1, letter), word);
  }
  return words.empty() ? one : words;
}

}  // namespace smoothpost::gcode
