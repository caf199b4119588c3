#include "formats/siemens/mpf_reader.h"

#include <algorithm>
#include <charconv>

namespace smoothpost::siemens {

namespace {

constexpr std::size_t kLongestBlock = 512;

bool is_letter(char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_blank(char c) { return c == ' ' || c == '\t'; }

std::string upper(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 32);
  return out;
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

/// Length of the name at the start of `text`: a letter, then letters and digits.
std::size_t name_length(std::string_view text) {
  std::size_t n = 0;
  if (text.empty() || !is_letter(text[0])) return 0;
  while (n < text.size() && (is_letter(text[n]) || is_digit(text[n]))) ++n;
  return n;
}

/// Length of the decimal number at the start of `text`, 0 when there is none.
std::size_t number_length(std::string_view text) {
  std::size_t n = 0, digits = 0;
  bool point = false;
  if (n < text.size() && (text[n] == '-' || text[n] == '+')) ++n;
  for (; n < text.size() && (is_digit(text[n]) || (text[n] == '.' && !point)); ++n) {
    point = point || text[n] == '.';
    digits += is_digit(text[n]) ? 1 : 0;
  }
  return digits > 0 && digits <= 30 ? n : 0;
}

double number_of(std::string_view text) {
  const bool negative = text.front() == '-';
  if (text.front() == '-' || text.front() == '+') text.remove_prefix(1);
  double value = 0.0;
  std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
  return negative && value != 0.0 ? -value : value;
}

/// Reads "10,0.5,-2)" into `word` and returns its length, 0 when it is something else.
std::size_t take_coefficients(std::string_view text, MpfWord& word) {
  word.polynomial = true;
  word.value.reset();
  word.higher.clear();
  std::size_t used = 0;
  while (true) {
    const std::size_t length = number_length(text.substr(used));
    if (length == 0 || used + length >= text.size()) return 0;
    const double number = number_of(text.substr(used, length));
    if (word.value)
      word.higher.push_back(number);
    else
      word.value = number;
    used += length + 1;
    if (text[used - 1] == ')') return used;
    if (text[used - 1] != ',') return 0;
  }
}

/// PO[X]=(..) or X=PO(..): its length at the start of `text`, 0 when it is something else.
std::size_t take_polynomial(std::string_view text, MpfWord& word) {
  constexpr std::size_t kCubic = 2, kQuintic = 4;  // higher coefficients
  const std::string head = upper(text.substr(0, 3));
  std::size_t before = 0, most = kCubic;
  if (head == "PO[") {
    const std::size_t name = name_length(text.substr(3));
    word.address = upper(text.substr(3, name));
    before = 3 + name;
    if (name == 0 || text.substr(before, 3) != "]=(") return 0;
    before += 3;
  } else {
    const std::size_t name = name_length(text);
    word.address = upper(text.substr(0, name));
    if (name == 0 || upper(text.substr(name, 4)) != "=PO(") return 0;
    before = name + 4;
    most = kQuintic;
  }
  const std::size_t length = take_coefficients(text.substr(before), word);
  return length == 0 || word.higher.size() > most ? 0 : before + length;
}

/// Takes one word from the front of `text`; false when it is something else.
bool take_word(std::string_view& text, MpfWord& word) {
  const std::size_t name = name_length(text);
  if (name == 0) return false;
  if (const std::size_t length = take_polynomial(text, word); length > 0) {
    if (length < text.size() && !is_blank(text[length])) return false;
    text = trimmed(text.substr(length));
    return true;
  }
  word = {};
  // X10.5: one letter, then its number. A3=1: the digits belong to the address.
  std::size_t used = name;
  if (used < text.size() && text[used] == '=') {
    const auto number = trimmed(text.substr(used + 1));
    const std::size_t length = number_length(number);
    if (length == 0) return false;
    word.address = upper(text.substr(0, name));
    word.value = number_of(number.substr(0, length));
    used = static_cast<std::size_t>(number.data() - text.data()) + length;
  } else if (const std::size_t length = number_length(text.substr(1)); length > 0) {
    if (name > 1 && is_letter(text[1])) return false;
    word.address = upper(text.substr(0, 1));
    word.value = number_of(text.substr(1, length));
    used = 1 + length;
  } else {
    for (std::size_t i = 0; i < name; ++i)
      if (is_digit(text[i]) && i == 1) return false;
    word.address = upper(text.substr(0, name));
    word.value.reset();
  }
  if (used < text.size() && !is_blank(text[used])) return false;
  text = trimmed(text.substr(used));
  return true;
}

/// Quotes and brackets of a block match.
bool is_closed(std::string_view text) {
  int depth = 0;
  bool quoted = false;
  for (const char c : text) {
    if (c == '"') quoted = !quoted;
    if (quoted) continue;
    if (c == '(' || c == '[') ++depth;
    if ((c == ')' || c == ']') && --depth < 0) return false;
  }
  return depth == 0 && !quoted;
}

class Reader {
 public:
  Reader(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  ParsedMpf run() {
    std::size_t at = 0;
    while (at < text_.size()) {
      auto end = text_.find('\n', at);
      if (end == std::string_view::npos) end = text_.size();
      std::string_view line = text_.substr(at, end - at);
      if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
      ++line_;
      read_line(line);
      at = end + 1;
    }
    out_.program.line_count = line_;
    if (out_.program.end_line == 0) error("NC325", "the program has no M30, M2 or M17", 1);
    check_jumps();
    return std::move(out_);
  }

 private:
  struct Jump {
    std::uint32_t line;
    std::string label;
    bool forward;
  };

  void error(const char* code, const std::string& text, std::size_t column) {
    error_at(code, text, line_, column);
  }
  void error_at(const char* code, const std::string& text, std::uint32_t line, std::size_t column) {
    constexpr std::size_t kMostErrors = 100;
    if (out_.diagnostics.size() >= kMostErrors) return;
    Diagnostic d;
    d.code = code;
    d.text = text;
    d.where = {file_, static_cast<int>(line), static_cast<int>(column)};
    out_.diagnostics.push_back(std::move(d));
  }

  void read_line(std::string_view line) {
    if (line.size() > kLongestBlock) error("NC325", "the block is longer than 512 characters", 1);
    for (std::size_t i = 0; i < line.size(); ++i)
      if (static_cast<unsigned char>(line[i]) < 0x20U && line[i] != '\t')
        return error("NC325", "a control character stands in the block", i + 1);
    if (!line.empty() && line.front() == '%' && out_.program.blocks.empty()) return;
    std::string_view text = trimmed(without_comment(line));
    if (text.empty()) return;
    MpfBlock block;
    block.line = line_;
    block.column = static_cast<std::uint32_t>(text.data() - line.data()) + 1;
    take_block_number(text, block.column);
    take_label(text, block);
    block.text = std::string(text);
    if (out_.program.end_line != 0)
      error("NC325", "a block stands behind the end of the program", block.column);
    if (!is_closed(text))
      error("NC326", "quotes or brackets of the block do not match", block.column);
    block.is_words = true;
    while (!text.empty() && block.is_words) {
      MpfWord word;
      block.is_words = take_word(text, word);
      if (block.is_words) block.words.push_back(std::move(word));
    }
    note_jump(block);
    check_words(block);
    check_mode(block);
    out_.program.blocks.push_back(std::move(block));
  }

  static std::string_view without_comment(std::string_view line) {
    bool quoted = false;
    for (std::size_t i = 0; i < line.size(); ++i) {
      if (line[i] == '"') quoted = !quoted;
      if (line[i] == ';' && !quoted) return line.substr(0, i);
    }
    return line;
  }

  void take_block_number(std::string_view& text, std::size_t column) {
    if ((text[0] != 'N' && text[0] != 'n') || text.size() < 2 || !is_digit(text[1])) return;
    std::size_t end = 1;
    while (end < text.size() && is_digit(text[end])) ++end;
    if (end < text.size() && !is_blank(text[end])) return;
    const double number = number_of(text.substr(1, end - 1));
    if (number <= last_number_)
      error("NC325", "the block number does not rise: N" + std::string(text.substr(1, end - 1)),
            column);
    last_number_ = number;
    text = trimmed(text.substr(end));
  }

  void take_label(std::string_view& text, MpfBlock& block) {
    const std::size_t name = name_length(text);
    if (name < 2 || name >= text.size() || text[name] != ':') return;
    block.label = upper(text.substr(0, name));
    if (name > 32) error("NC326", "the label is longer than 32 characters", block.column);
    if (!is_letter(text[1]))
      error("NC326", "a label begins with two letters or underscores", block.column);
    for (const auto& [label, line] : labels_)
      if (label == block.label)
        error("NC326", "label " + label + " stands in line " + std::to_string(line) + " too",
              block.column);
    labels_.emplace_back(block.label, line_);
    text = trimmed(text.substr(name + 1));
  }

  void note_jump(const MpfBlock& block) {
    const std::string text = upper(block.text);
    for (const char* word : {"GOTOF ", "GOTOB "}) {
      const auto at = text.rfind(word);
      if (at == std::string::npos || (at > 0 && !is_blank(text[at - 1]))) continue;
      const std::string label(trimmed(std::string_view(text).substr(at + 6)));
      jumps_.push_back({line_, label, word[4] == 'F'});
    }
  }

  void check_jumps() {
    for (const auto& jump : jumps_) {
      const bool found = std::any_of(labels_.begin(), labels_.end(), [&](const auto& label) {
        return label.first == jump.label &&
               (jump.forward ? label.second > jump.line : label.second <= jump.line);
      });
      if (!found)
        error_at("NC326", "no label " + jump.label.substr(0, 32) + " in the direction of the jump",
                 jump.line, 1);
    }
  }

  void check_words(const MpfBlock& block) {
    if (!block.is_words) return check_not_words(block);
    int motions = 0;
    for (std::size_t i = 0; i < block.words.size(); ++i) {
      const auto& word = block.words[i];
      if (word.address == "G" && word.value >= 0.0 && word.value <= 3.0) ++motions;
      if (word.address == "POLY" && !word.value) ++motions;
      const bool many = word.address == "G" || word.address == "M";
      for (std::size_t j = 0; j < i; ++j)
        if (block.words[j].address == word.address && (!many || block.words[j].value == word.value))
          error("NC326", "word " + word.address + " stands twice in the block", block.column);
      if (word.address.size() == 1 && !word.value)
        error("NC326", "word " + word.address + " has no number", block.column);
    }
    if (motions > 1) error("NC326", "two of G0, G1, G2, G3, POLY stand in one block", block.column);
    check_polynomials(block);
  }

  void check_polynomials(const MpfBlock& block) {
    const bool any = std::any_of(block.words.begin(), block.words.end(),
                                 [](const MpfWord& w) { return w.polynomial; });
    const MpfWord* length = block.find("PL");
    const bool poly = block.has("POLY");
    if (!poly && (any || length != nullptr))
      error("NC326", "PO and PL= stand in a block without POLY", block.column);
    if (poly && !any) error("NC326", "POLY stands in a block without PO", block.column);
    if (!poly) return;
    if (length == nullptr || !length->value || length->polynomial)
      return error("NC326", "POLY stands in a block without PL=, the length of its parameter",
                   block.column);
    if (*length->value < 0.0001 || *length->value > 99999.9999)
      error("NC326", "PL= has to lie between 0.0001 and 99999.9999", block.column);
  }

  // A statement is a name with something behind it, or IF.
  void check_not_words(const MpfBlock& block) {
    const std::size_t name = name_length(block.text);
    const std::string first = upper(std::string_view(block.text).substr(0, name));
    const bool call = name > 1 && name < block.text.size() &&
                      (block.text[name] == '(' || block.text[name] == '=');
    const bool text_word =
        name == 1 && block.text.size() > 2 && block.text[1] == '=' && block.text[2] == '"';
    if (first != "IF" && !call && !text_word)
      error("NC326", "the block is neither words nor a statement: " + block.text.substr(0, 32),
            block.column);
  }

  void check_mode(const MpfBlock& block) {
    if (block.has("TRAORI")) transformation_ = true;
    if (block.has("TRAFOOF")) transformation_ = false;
    double length = 0.0;
    bool vector = false;
    for (const char* address : {"A3", "B3", "C3"})
      if (const auto* word = block.find(address)) {
        vector = true;
        length += word->value ? *word->value * *word->value : 0.0;
      }
    if (vector && !transformation_)
      error("NC327", "A3= B3= C3= stand where TRAORI is not on", block.column);
    if (vector && length == 0.0) error("NC327", "the vector A3= B3= C3= is 0", block.column);
    for (const double end : {30.0, 2.0, 17.0}) {
      if (!block.is_words || !block.has('M', end)) continue;
      out_.program.end_line = line_;
      if (transformation_)
        error("NC327", "TRAORI is on at the end: TRAFOOF is missing", block.column);
    }
  }

  std::string_view text_;
  const std::string& file_;
  std::uint32_t line_ = 0;
  double last_number_ = -1.0;
  bool transformation_ = false;
  std::vector<std::pair<std::string, std::uint32_t>> labels_;
  std::vector<Jump> jumps_;
  ParsedMpf out_;
};

}  // namespace

const MpfWord* MpfBlock::find(std::string_view address) const {
  for (const auto& word : words)
    if (word.address == address) return &word;
  return nullptr;
}

bool MpfBlock::has(std::string_view keyword) const {
  const auto* word = find(keyword);
  return word != nullptr && !word->value;
}

bool MpfBlock::has(char letter, double value) const {
  for (const auto& word : words)
    if (word.address.size() == 1 && word.address[0] == letter && word.value == value) return true;
  return false;
}

ParsedMpf parse_mpf(std::string_view text, const std::string& file_name) {
  return Reader(text, file_name).run();
}

}  // namespace smoothpost::siemens
