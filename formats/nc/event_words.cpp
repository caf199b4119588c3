#include "formats/nc/event_words.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "formats/nc/number.h"
#include "formats/nc/number_text.h"

namespace smoothpost::nc {
namespace {

char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; }
bool is_letter(char c) { return upper(c) >= 'A' && upper(c) <= 'Z'; }

Diagnostic bad_row(const EventWords& words, const std::string& why) {
  return {Severity::error,
          "PR111",
          "process event \"" + words.event + "\" = \"" + words.text + "\": " + why +
              "; write words such as M3 S{rpm} or a comment such as (MSG, {text})",
          {}};
}

/// Reads the text of one row; problems end in `diagnostics`.
class RowReader {
 public:
  RowReader(const EventWords& words, Diagnostics& diagnostics)
      : words_(words), text_(words.text), diagnostics_(diagnostics) {}

  EventRow read() {
    row_.event = words_.event;
    row_.readable = true;
    while (good_ && at_ < text_.size()) item();
    if (row_.m.empty() && row_.words.empty()) row_.readable = false;
    return row_;
  }

 private:
  void fail(const std::string& why) {
    diagnostics_.push_back(bad_row(words_, why));
    good_ = row_.readable = false;
  }

  void item() {
    const char c = text_[at_];
    if (detail::is_blank(c)) {
      ++at_;
    } else if (c == '\n' || c == '\r') {
      row_.readable = false;
      ++at_;
    } else if (c == '(') {
      row_.readable = false;
      const std::size_t close = text_.find(')', at_);
      if (close == std::string_view::npos) return fail("a comment is not closed");
      at_ = close + 1;
    } else if (is_call()) {
      row_.readable = false;
      at_ = text_.size();
    } else if (is_letter(c)) {
      word();
    } else {
      fail(std::string("\"") + c + "\" begins no word");
    }
  }

  /// MSG("{text}"), CYCLE832(...), $A_OUT[1]=1, M1=3 of a Sinumerik: written only, to the row's
  /// end.
  bool is_call() const {
    const std::string_view rest = text_.substr(at_);
    if (rest.front() == '$' || rest.front() == '_') return true;
    if (!is_letter(rest.front()) || rest.size() < 2) return false;
    if (is_letter(rest[1]) || rest[1] == '_') {
      const std::size_t end = rest.find_first_of("(=[ ");
      return end != std::string_view::npos && rest[end] != ' ' && end > 1 &&
             std::all_of(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(end), in_name);
    }
    const std::size_t end = rest.find_first_not_of("0123456789", 1);
    return end != std::string_view::npos && end > 1 && rest[end] == '=';
  }
  static bool in_name(char c) { return is_letter(c) || detail::is_digit(c) || c == '_'; }

  /// The = and the quotes of T="{tool}" say nothing here.
  void skip_signs() {
    while (at_ < text_.size() && (text_[at_] == '=' || text_[at_] == '"')) ++at_;
  }

  void word() {
    RowWord word;
    word.letter = upper(text_[at_++]);
    skip_signs();
    if (at_ < text_.size() && text_[at_] == '{') {
      const std::size_t close = text_.find('}', at_);
      if (close == std::string_view::npos || close == at_ + 1) {
        return fail("a value in braces needs a name and a }");
      }
      word.name = std::string(text_.substr(at_ + 1, close - at_ - 1));
      at_ = close + 1;
      if (word.letter == 'M') return fail("an M word needs a number");
    } else {
      const char* begin = text_.data() + at_;
      const ScannedNumber number = scan_number(begin, text_.data() + text_.size());
      if (!number.ok) return fail(std::string("the word ") + word.letter + " has no number");
      word.value = number.value;
      at_ += static_cast<std::size_t>(number.next - begin);
    }
    skip_signs();
    if (word.letter == 'G' || word.letter == 'N' || word.letter == 'O') {
      row_.readable = false;
    } else if (word.letter == 'M') {
      row_.m.push_back(static_cast<int>(std::lround(std::clamp(word.value, 0.0, 32767.0))));
    } else {
      row_.words.push_back(std::move(word));
    }
  }

  const EventWords& words_;
  std::string_view text_;
  Diagnostics& diagnostics_;
  EventRow row_;
  std::size_t at_ = 0;
  bool good_ = true;
};

bool may_be_modal(char letter) { return letter == 'S' || letter == 'T'; }

struct Fit {
  bool fits = true;
  char missing = 0;
  int fixed = 0;
  int present = 0;
  LetterMask used = 0;
};

Fit fit_row(const EventRow& row, const BlockWords& block) {
  Fit fit;
  for (const int m : row.m) fit.fits = fit.fits && block.has_m(m);
  fit.fixed = static_cast<int>(row.m.size());
  for (const RowWord& word : row.words) {
    const bool written = block.has(word.letter);
    if (written) fit.used |= letter_bit(word.letter);
    if (!word.name.empty()) {
      fit.present += written ? 1 : 0;
      if (!written && !may_be_modal(word.letter)) {
        fit.fits = false;
        fit.missing = word.letter;
      }
      continue;
    }
    ++fit.fixed;
    if (!written || std::abs(block[word.letter] - word.value) > 1e-9) {
      fit.fits = false;
      if (!written) fit.missing = word.letter;
    }
  }
  return fit;
}

/// Keeps the better of the best match so far and `row`.
void consider(const EventRow& row, const BlockWords& block, EventMatch& best, Fit& best_fit) {
  const Fit fit = fit_row(row, block);
  if (!fit.fits) {
    if (best.near_row == nullptr || (best.missing == 0 && fit.missing != 0)) {
      best.near_row = &row;
      best.missing = fit.missing;
    }
    return;
  }
  if (best.row != nullptr && (fit.fixed < best_fit.fixed ||
                              (fit.fixed == best_fit.fixed && fit.present <= best_fit.present))) {
    return;
  }
  best.row = &row;
  best.used = fit.used;
  best_fit = fit;
}

}  // namespace

Result<std::string> render_event(const EventWords& words, const EventParameters& parameters) {
  std::string out;
  const std::string_view text = words.text;
  for (std::size_t i = 0; i < text.size();) {
    if (text[i] != '{') {
      out.push_back(text[i++]);
      continue;
    }
    const std::size_t close = text.find('}', i);
    if (close == std::string_view::npos) {
      return Result<std::string>::failure(bad_row(words, "a { has no }"));
    }
    const std::string_view name = text.substr(i + 1, close - i - 1);
    const auto found = std::find_if(parameters.begin(), parameters.end(),
                                    [&](const auto& parameter) { return parameter.first == name; });
    if (found == parameters.end()) {
      return Result<std::string>::failure(
          Diagnostic{Severity::error,
                     "PR110",
                     "process event \"" + words.event + "\" is written \"" + words.text +
                         "\", but the program gives no value \"" + std::string(name) +
                         "\"; let the input machine's row name it, or write a number in this row",
                     {}});
    }
    // X{value} is an address and its number; a name there would be another command.
    const bool address = i > 0 && std::isalpha(static_cast<unsigned char>(text[i - 1])) != 0 &&
                         (i < 2 || std::isalpha(static_cast<unsigned char>(text[i - 2])) == 0);
    const char* const value_end = found->second.data() + found->second.size();
    const ScannedNumber number = scan_number(found->second.data(), value_end);
    if (address && (!number.ok || number.next != value_end)) {
      return Result<std::string>::failure(
          Diagnostic{Severity::error,
                     "PR112",
                     "process event \"" + words.event + "\" is written \"" + words.text +
                         "\" with a number, but the program gives " + std::string(name) + " = \"" +
                         found->second +
                         "\"; for a tool say its number with --tool NAME:N=length, or let the row "
                         "take a name",
                     {}});
    }
    out += found->second;
    i = close + 1;
  }
  return out;
}

Result<EventMatcher> EventMatcher::compile(const ProcessTable& table) {
  EventMatcher matcher;
  Diagnostics diagnostics;
  for (const EventWords& words : table.events) {
    EventRow row = RowReader(words, diagnostics).read();
    // Axis words, feed and arc centres have their own meaning and cannot begin an event.
    static constexpr std::string_view kTaken = "XYZABCUVWFIJK";
    if (row.readable && row.m.empty() &&
        kTaken.find(row.words.front().letter) != std::string_view::npos) {
      row.readable = false;
    }
    if (row.readable && row.m.empty()) matcher.letters_ |= letter_bit(row.words.front().letter);
    matcher.rows_.push_back(std::move(row));
  }
  if (has_error(diagnostics)) return Result<EventMatcher>::failure(std::move(diagnostics));
  return matcher;
}

EventMatch EventMatcher::match_m(int m, const BlockWords& block) const {
  EventMatch best;
  Fit best_fit;
  for (const EventRow& row : rows_) {
    if (row.readable && !row.m.empty() && row.m.front() == m) {
      consider(row, block, best, best_fit);
    }
  }
  return best;
}

EventMatch EventMatcher::match_letter(char letter, const BlockWords& block) const {
  EventMatch best;
  Fit best_fit;
  for (const EventRow& row : rows_) {
    if (row.readable && row.m.empty() && row.words.front().letter == letter) {
      consider(row, block, best, best_fit);
    }
  }
  return best;
}

EventParameters EventMatcher::values(const EventRow& row, const BlockWords& block,
                                     const ModalWords& modal) {
  EventParameters values;
  for (const RowWord& word : row.words) {
    if (word.name.empty()) continue;
    if (word.letter == 'T' && !modal.tool_name.empty()) {
      values.emplace_back(word.name, modal.tool_name);
      continue;
    }
    double value = 0.0;
    if (block.has(word.letter)) {
      value = block[word.letter];
    } else {
      value = word.letter == 'S' ? modal.speed : modal.tool;
    }
    values.emplace_back(word.name, shortest_text(value));
  }
  return values;
}

}  // namespace smoothpost::nc
