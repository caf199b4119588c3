#include "machines/dialects/heidenhain_text.h"

#include <algorithm>
#include <cmath>

namespace smoothpost::heidenhain {

namespace {

constexpr std::size_t kLongest = 200;
constexpr double kLargest = 99999.9999;

/// The next word of `text`, which ends at a blank; taken from its front.
std::string_view take_word(std::string_view& text) {
  text = trimmed(text);
  const auto end = std::min(text.find(' '), text.size());
  const auto word = text.substr(0, end);
  text.remove_prefix(end);
  return word;
}

bool is_address(std::string_view text) {
  static constexpr std::string_view kAxes = "XYZABCUVW";
  if (text.size() == 2 && (text[0] == 'T' || text[0] == 'N')) text.remove_prefix(1);
  return text.size() == 1 && kAxes.find(text[0]) != std::string_view::npos;
}

class Reader {
 public:
  explicit Reader(const std::string& file) : file_(file) {}

  Parsed run(std::string_view text) {
    for (const auto line : text_lines(text)) {
      ++out_.line_count;
      if (!failed_) read(line);
    }
    if (out_.end_line == 0) error(1, "the program has no END PGM");
    return std::move(out_);
  }

 private:
  bool error(std::size_t column, std::string text) {
    constexpr std::size_t kMost = 100;
    if (out_.diagnostics.size() >= kMost) return false;
    Diagnostic d;
    d.code = "NC343";
    d.text = std::move(text);
    d.where = {file_, static_cast<int>(std::max(1U, out_.line_count)), static_cast<int>(column)};
    out_.diagnostics.push_back(std::move(d));
    return false;
  }

  void read(std::string_view line) {
    if (line.size() > kLongest) {
      error(1, "the line is longer than 200 characters");
      return;
    }
    for (std::size_t i = 0; i < line.size(); ++i) {
      const auto byte = static_cast<unsigned char>(line[i]);
      if (byte < 0x20U || byte > 0x7EU) {
        error(i + 1, "a character outside printable ASCII");
        return;
      }
    }
    std::string_view rest = line;
    const auto number = whole_number(take_word(rest));
    if (!number || *number != static_cast<double>(out_.line_count) - 1.0) {
      failed_ = !error(1, "block numbers have to be 0, 1, 2 and so on");
      return;
    }
    rest = trimmed(rest);
    const auto column = static_cast<std::uint32_t>(rest.data() - line.data()) + 1;
    if (out_.end_line > 0) {
      error(column, "text behind END PGM");
    } else if (out_.line_count == 1) {
      read_frame(rest, "BEGIN PGM ");
    } else if (rest.substr(0, 8) == "END PGM ") {
      read_frame(rest, "END PGM ");
    } else if (!rest.empty() && rest[0] != ';' && rest[0] != '*') {
      read_block(rest, column);
    } else if (rest.empty()) {
      error(1, "a block without text");
    }
  }

  void read_frame(std::string_view rest, std::string_view head) {
    const std::string name(rest.substr(std::min(head.size(), rest.size())));
    const bool good = rest.substr(0, head.size()) == head && name.size() > 3 &&
                      (name.substr(name.size() - 3) == " MM" ||
                       (name.size() > 5 && name.substr(name.size() - 5) == " INCH"));
    if (!good) {
      error(1, "the program has to begin with 0 BEGIN PGM name MM (or INCH)");
      return;
    }
    if (out_.line_count == 1) {
      name_ = name;
      out_.inch = name.back() == 'H';
      return;
    }
    out_.end_line = out_.line_count;
    if (name != name_) error(1, "END PGM has another name or unit than BEGIN PGM");
  }

  void read_block(std::string_view rest, std::uint32_t column) {
    Block block;
    block.at = {out_.line_count, column};
    block.text = rest;
    std::string_view words = rest;
    const auto first = take_word(words);
    if (first == "L" || first == "LN") {
      block.is_line = true;
      block.is_vector = first == "LN";
      if (!read_words(block, words, column)) return;
    }
    out_.blocks.push_back(std::move(block));
  }

  bool read_words(Block& block, std::string_view rest, std::uint32_t column) {
    bool feed = false;
    while (!(rest = trimmed(rest)).empty()) {
      const auto word = take_word(rest);
      if (word == "R0") continue;
      if (word == "M91") {
        block.machine_words = true;
      } else if (word == "FMAX") {
        block.rapid = true;
      } else if (word[0] == 'F') {
        const auto value = whole_number(word.substr(1));
        if (!value || *value <= 0.0 || *value > kLargest || feed)
          return error(column, "F needs one number above 0");
        block.words.push_back({"F", *value});
        feed = true;
      } else if (!read_coordinate(block, word, column)) {
        return false;
      }
    }
    if (feed && block.rapid) return error(column, "F and FMAX in one block");
    return true;
  }

  bool read_coordinate(Block& block, std::string_view word, std::uint32_t column) {
    const auto sign = word.find_first_of("+-");
    const auto text = std::string(word.substr(0, 32));
    if (sign == std::string_view::npos || !is_address(word.substr(0, sign)))
      return error(column, "the word " + text + " has no sign, or is none of L and LN");
    const auto value = whole_number(word.substr(sign));
    if (!value || std::abs(*value) > kLargest)
      return error(column, "the word " + text + " has no number up to 99999.9999");
    const std::string address(word.substr(0, sign));
    if (block.find(address)) return error(column, "the word " + address + " stands twice");
    block.words.push_back({address, *value});
    return true;
  }

  const std::string& file_;
  bool failed_ = false;  // numbers are lost
  std::string name_;
  Parsed out_;
};

}  // namespace

std::optional<double> Block::find(std::string_view address) const {
  for (const auto& word : words)
    if (word.address == address) return word.value;
  return std::nullopt;
}

Parsed parse(std::string_view text, const std::string& file) { return Reader(file).run(text); }

}  // namespace smoothpost::heidenhain
