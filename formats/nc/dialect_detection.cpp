#include "formats/nc/dialect_detection.h"

#include <algorithm>
#include <array>
#include <string>

#include "formats/nc/number.h"
#include "formats/nc/siemens_words.h"

namespace smoothpost::nc {
namespace {

/// A line in upper case without blanks, line number and block delete.
std::string compact(std::string_view line) {
  std::string out;
  for (const char c : line) {
    if (detail::is_blank(c)) continue;
    out.push_back(c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c);
  }
  std::size_t i = !out.empty() && out[0] == '/' ? 1 : 0;
  if (i < out.size() && out[i] == 'N' && i + 1 < out.size() && detail::is_digit(out[i + 1])) {
    ++i;
    while (i < out.size() && (detail::is_digit(out[i]) || out[i] == '.')) ++i;
  }
  return out.substr(i);
}

/// Whether the word stands in the text and no digit or point goes on behind it.
bool has_word(std::string_view line, std::string_view word) {
  for (std::size_t at = line.find(word); at != std::string_view::npos;
       at = line.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    const bool whole = end == line.size() || !(detail::is_digit(line[end]) || line[end] == '.');
    const bool starts = at == 0 || line[at - 1] < 'A' || line[at - 1] > 'Z';
    if (whole && starts) return true;
  }
  return false;
}

bool has(std::string_view line, std::string_view text) {
  return line.find(text) != std::string_view::npos;
}

/// The words of the line: its text without ( ) comments and what stands behind a ;.
std::string without_comments(std::string_view line) {
  std::string out;
  bool inside = false;
  for (const char c : line) {
    if (c == ';' && !inside) break;
    if (c == '(') inside = true;
    if (!inside) out.push_back(c);
    if (c == ')') inside = false;
  }
  return out;
}

bool is_linuxcnc(std::string_view line, std::string_view words) {
  if (has(line, "(MSG,") || has(line, "(DEBUG,") || has(line, "(PRINT,")) return true;
  if (has_word(words, "M428") || has_word(words, "M429") || has(words, "#<")) return true;
  if (words.empty() || words[0] != 'O') return false;
  static constexpr std::array<std::string_view, 10> kFlow = {
      "SUB", "ENDSUB", "CALL", "IF", "WHILE", "DO", "REPEAT", "ENDIF", "ENDWHILE", "RETURN"};
  std::size_t end = words.find('>');
  end = end == std::string_view::npos ? words.find_first_not_of("0123456789", 1) : end + 1;
  if (end >= words.size()) return false;
  for (const std::string_view flow : kFlow) {
    if (words.substr(end).starts_with(flow)) return true;
  }
  return false;
}

/// Statements of custom macro B.
bool is_macro(std::string_view words) {
  if (words.starts_with("IF[") || words.starts_with("WHILE[")) return true;
  if (words.starts_with("GOTO") && words.size() > 4) {
    return detail::is_digit(words[4]) || words[4] == '#' || words[4] == '[';
  }
  return words.starts_with("G65P");
}

bool is_siemens(std::string_view line, std::string_view words) {
  if (line.starts_with("%_N_") || line.starts_with("MSG(\"") || line.starts_with("DEFREAL")) {
    return true;
  }
  if (has_word(words, "TRAORI") || has_word(words, "TRAFOOF") || has(words, "CYCLE832") ||
      has(words, "CYCLE800")) {
    return true;
  }
  for (const std::string_view address : {"A3=", "B3=", "C3=", "=AC(", "=IC("}) {
    if (has(line, address)) return true;
  }
  const std::size_t equals = words.find('=');
  return equals != std::string_view::npos && is_r_parameter(words.substr(0, equals));
}

}  // namespace

std::vector<InputDialect> fitting_dialects(std::string_view text) {
  bool linuxcnc = false, fanuc = false, haas = false, siemens = false;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
    const std::string line = compact(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::string words = without_comments(line);
    linuxcnc = linuxcnc || is_linuxcnc(line, words);
    siemens = siemens || is_siemens(line, words);
    haas = haas || has_word(words, "G234") || has_word(words, "G187");
    fanuc = fanuc || is_macro(words) || has_word(words, "G43.4") || has_word(words, "G43.5") ||
            has_word(words, "G05.1") || has(words, "G5.1Q");
  }
  std::vector<InputDialect> out;
  if (linuxcnc) out.push_back(InputDialect::linuxcnc);
  if (fanuc && !haas) out.push_back(InputDialect::fanuc);
  if (haas) out.push_back(InputDialect::haas);
  if (siemens) out.push_back(InputDialect::siemens);
  return out;
}

bool is_heidenhain(std::string_view text) {
  for (int line = 0; line < 20 && !text.empty(); ++line) {
    const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
    if (compact(text.substr(0, end)).find("BEGINPGM") != std::string::npos) return true;
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return false;
}

}  // namespace smoothpost::nc
