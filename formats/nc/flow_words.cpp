#include "formats/nc/flow_words.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "formats/nc/number.h"
#include "formats/nc/number_text.h"

namespace smoothpost::nc {
namespace {

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; }
bool is_letter(char c) { return lower(c) >= 'a' && lower(c) <= 'z'; }

struct Keyword {
  std::string_view text;
  FlowKind kind;
};

constexpr std::array<Keyword, 15> kOWords = {{{"sub", FlowKind::sub},
                                              {"endsub", FlowKind::endsub},
                                              {"call", FlowKind::call},
                                              {"return", FlowKind::give_back},
                                              {"while", FlowKind::loop_while},
                                              {"endwhile", FlowKind::endwhile},
                                              {"do", FlowKind::loop_do},
                                              {"repeat", FlowKind::repeat},
                                              {"endrepeat", FlowKind::endrepeat},
                                              {"if", FlowKind::branch_if},
                                              {"elseif", FlowKind::elseif},
                                              {"else", FlowKind::otherwise},
                                              {"endif", FlowKind::endif},
                                              {"break", FlowKind::leave},
                                              {"continue", FlowKind::next}}};

/// How many bracketed values stand behind a keyword.
struct ValueCount {
  std::size_t least;
  std::size_t most;
};

ValueCount values_of(FlowKind kind) {
  switch (kind) {
    case FlowKind::call:
      return {0, kMostArguments};
    case FlowKind::loop_while:
    case FlowKind::repeat:
    case FlowKind::branch_if:
    case FlowKind::elseif:
      return {1, 1};
    case FlowKind::give_back:
    case FlowKind::endsub:
      return {0, 1};
    default:
      return {0, 0};
  }
}

class Scanner {
 public:
  Scanner(std::string_view text, ExpressionRules rules) : text_(text), rules_(rules) {}

  FlowText o_line() {
    take();  // O
    read_label();
    if (out_.ok()) read_keyword();
    if (out_.ok()) read_values();
    if (out_.ok() && peek() != '\0') {
      fail("nothing else may stand on the line of an O word");
    }
    return finish();
  }

  FlowText macro_line() {
    const std::string word = letters();
    if (word == "goto") {
      out_.kind = FlowKind::macro_goto;
      read_target();
    } else if (word == "do" || word == "end") {
      out_.kind = word == "do" ? FlowKind::macro_do : FlowKind::macro_end;
      read_loop_number();
    } else {
      read_condition(word);
    }
    if (out_.ok() && peek() != '\0') fail("text behind the statement");
    return finish();
  }

 private:
  char peek() {
    while (at_ < text_.size() && detail::is_blank(text_[at_])) ++at_;
    return at_ < text_.size() ? lower(text_[at_]) : '\0';
  }
  char take() {
    const char c = peek();
    if (c != '\0') ++at_;
    return c;
  }
  std::string letters() {
    std::string word;
    while (is_letter(peek()) && word.size() < 12) word.push_back(take());
    return word;
  }
  std::string digits() {
    std::string number;
    while (detail::is_digit(peek())) number.push_back(take());
    const std::size_t first = number.find_first_not_of('0');
    if (!number.empty()) number.erase(0, std::min(first, number.size() - 1));
    return number;
  }
  void fail(std::string problem) {
    if (!out_.ok()) return;
    out_.problem = std::move(problem);
    out_.at = std::min(at_, text_.empty() ? 0 : text_.size() - 1);
  }
  FlowText finish() {
    out_.length = text_.size();
    return std::move(out_);
  }

  /// Steps over one value and keeps where it began.
  std::size_t read_value() {
    peek();
    const std::size_t begin = at_;
    const Evaluated found = evaluate_value(text_.substr(at_), nullptr, rules_);
    if (!found.ok()) {
      at_ += found.at;
      fail(found.problem);
    } else {
      at_ += found.length;
    }
    return begin;
  }

  void read_label() {
    const char c = peek();
    if (c == '<') {
      take();
      while (peek() != '>' && peek() != '\0') out_.label.push_back(take());
      if (take() != '>') return fail("the name has no >");
      if (out_.label.empty()) fail("the name is empty");
    } else if (c == '#' || c == '[') {
      out_.computed_label = read_value();
    } else if (detail::is_digit(c)) {
      out_.label = digits();
      if (peek() == '.') fail("the label is no whole number");
    } else {
      fail("a label is missing behind O: a number or <name>");
    }
  }

  void read_keyword() {
    peek();
    const std::size_t begin = at_;
    const std::string word = letters();
    for (const Keyword& keyword : kOWords) {
      if (keyword.text != word) continue;
      out_.kind = keyword.kind;
      if (out_.computed_label != FlowText::kNone && keyword.kind != FlowKind::call) {
        at_ = begin;
        fail("a computed label stands before call only");
      }
      return;
    }
    at_ = begin;
    fail(word.empty() ? "a keyword is missing behind the label: sub, call, while, if ..."
                      : "\"" + word + "\" is no O-word keyword");
  }

  void read_values() {
    const ValueCount count = values_of(out_.kind);
    while (out_.ok() && peek() == '[') {
      if (out_.values.size() == count.most) {
        return fail(count.most == kMostArguments ? "more than 30 arguments"
                                                 : "a value that the keyword does not take");
      }
      out_.values.push_back(read_value());
    }
    if (out_.ok() && out_.values.size() < count.least) {
      fail("the keyword needs a value in brackets");
    }
  }

  void read_condition(const std::string& word) {
    if (peek() != '[') return fail("a condition in brackets is missing");
    out_.values.push_back(read_value());
    if (!out_.ok()) return;
    peek();
    const std::size_t begin = at_;
    const std::string next = letters();
    if (word == "while" && next == "do") {
      out_.kind = FlowKind::macro_while;
      return read_loop_number();
    }
    if (word == "if" && next == "goto") {
      out_.kind = FlowKind::macro_if_goto;
      return read_target();
    }
    if (word == "if" && next == "then") {
      out_.kind = FlowKind::macro_if_then;
      return read_consequence();
    }
    at_ = begin;
    fail(word == "while" ? "DO is missing behind the condition"
                         : "GOTO or THEN is missing behind the condition");
  }

  void read_target() {
    if (peek() == '\0') return fail("the block number is missing behind GOTO");
    out_.target = read_value();
  }

  void read_loop_number() {
    out_.label = digits();
    if (out_.label.empty()) fail("the number of the loop is missing");
  }

  void read_consequence() {
    if (peek() != '#') return fail("an assignment is missing behind THEN");
    out_.consequence = at_;
    const EvaluatedAssignment found = evaluate_assignment(text_.substr(at_), nullptr, rules_);
    if (!found.value.ok()) {
      at_ += found.value.at;
      return fail(found.value.problem);
    }
    at_ += found.value.length;
  }

  std::string_view text_;
  ExpressionRules rules_;
  std::size_t at_ = 0;
  FlowText out_;
};

}  // namespace

FlowText read_o_line(std::string_view text) {
  return Scanner(text, ExpressionRules::linuxcnc).o_line();
}

bool begins_macro(std::string_view text) {
  std::string word;
  std::size_t i = 0;
  for (; i < text.size() && word.size() < 6; ++i) {
    if (detail::is_blank(text[i])) continue;
    if (!is_letter(text[i])) break;
    word.push_back(lower(text[i]));
  }
  return word == "if" || word == "while" || word == "goto" || word == "do" || word == "end";
}

FlowText read_macro_line(std::string_view text) {
  return Scanner(text, ExpressionRules::fanuc).macro_line();
}

long label_number(double value) {
  const double nearest = std::round(value);
  if (!(value > -0.5 && value < 1e9) || std::abs(value - nearest) > 1e-4) return -1;
  return std::lround(nearest);
}

}  // namespace smoothpost::nc
