#include "formats/nc/siemens_flow.h"

#include <algorithm>
#include <array>

#include "formats/nc/number.h"
#include "formats/nc/siemens_expression.h"
#include "formats/nc/siemens_words.h"

namespace smoothpost::nc {
namespace {

using Kind = FlowKind;

struct Word {
  std::string_view name;
  Kind kind;
  int direction;
};

constexpr std::array<Word, 19> kWords = {{{"IF", Kind::branch_if, 0},
                                          {"ELSE", Kind::otherwise, 0},
                                          {"ENDIF", Kind::endif, 0},
                                          {"WHILE", Kind::loop_while, 0},
                                          {"ENDWHILE", Kind::endwhile, 0},
                                          {"FOR", Kind::counted_for, 0},
                                          {"ENDFOR", Kind::endfor, 0},
                                          {"LOOP", Kind::endless_loop, 0},
                                          {"ENDLOOP", Kind::endloop, 0},
                                          {"REPEAT", Kind::repeat_until, 0},
                                          {"REPEATB", Kind::repeat_part, 0},
                                          {"UNTIL", Kind::until, 0},
                                          {"CASE", Kind::label_case, 0},
                                          {"GOTO", Kind::label_goto, 0},
                                          {"GOTOC", Kind::label_goto, 0},
                                          {"GOTOF", Kind::label_goto, 1},
                                          {"GOTOB", Kind::label_goto, -1},
                                          {"CALL", Kind::program_call, 0},
                                          {"EXTCALL", Kind::program_call, 0}}};

const Word* find_word(std::string_view name) {
  const std::string upper = upper_text(name);
  for (const Word& word : kWords)
    if (word.name == upper) return &word;
  return nullptr;
}

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool in_name(char c) { return is_letter(c) || detail::is_digit(c); }

/// P5 or P, behind which = stands.
bool is_count(std::string_view name) {
  return !name.empty() && (name[0] == 'P' || name[0] == 'p') &&
         std::all_of(name.begin() + 1, name.end(), [](char c) { return detail::is_digit(c); });
}

class LineReader {
 public:
  explicit LineReader(std::string_view text) : text_(text) {}

  FlowText read() {
    at_end();
    const std::size_t begin = at_;
    const std::string_view first = name();
    const Word* word = find_word(first);
    if (word == nullptr) {
      at_ = begin;
      read_call();
    } else {
      out_.kind = word->kind;
      read_rest(*word);
    }
    if (out_.ok() && !at_end()) fail("nothing else may stand on this line");
    out_.length = text_.size();
    return std::move(out_);
  }

 private:
  void read_rest(const Word& word) {
    switch (word.kind) {
      case Kind::branch_if:
        return read_if();
      case Kind::loop_while:
      case Kind::until:
        return read_condition();
      case Kind::counted_for:
        return read_for();
      case Kind::label_case:
        return read_case();
      case Kind::label_goto:
        return read_label(word.direction);
      case Kind::repeat_until:
        if (!at_end()) read_part();
        return;
      case Kind::repeat_part:
        out_.one_block = true;
        return read_part();
      case Kind::program_call:
        return read_quoted_call();
      default:
        return;
    }
  }

  bool at_end() {
    while (at_ < text_.size() && detail::is_blank(text_[at_])) ++at_;
    return at_ == text_.size();
  }

  std::string_view name() {
    at_end();
    const std::size_t begin = at_;
    while (at_ < text_.size() && in_name(text_[at_])) ++at_;
    return text_.substr(begin, at_ - begin);
  }

  bool take(char c) {
    if (at_end() || text_[at_] != c) return false;
    ++at_;
    return true;
  }

  void fail(std::string problem) {
    if (!out_.ok()) return;
    out_.problem = std::move(problem);
    out_.at = std::min(at_, text_.empty() ? 0 : text_.size() - 1);
  }

  /// Steps over a value and gives where it began.
  std::size_t value() {
    at_end();
    const std::size_t begin = at_;
    const Evaluated found = evaluate_siemens_condition(text_.substr(at_), nullptr);
    if (!found.ok()) {
      at_ += found.at;
      fail(found.problem);
    } else {
      at_ += found.length;
    }
    return begin;
  }

  void read_condition() { out_.values.push_back(value()); }

  void read_if() {
    read_condition();
    if (!out_.ok() || at_end()) return;
    const Word* word = find_word(name());
    if (word == nullptr || word->kind != Kind::label_goto) {
      return fail("behind the condition GOTO, GOTOF or GOTOB is expected, or nothing");
    }
    out_.kind = Kind::label_if_goto;
    read_label(word->direction);
  }

  void read_label(int direction) {
    out_.label = upper_text(name());
    out_.direction = direction;
    if (out_.label.empty()) fail("a label or block number is missing");
  }

  void read_for() {
    at_end();
    out_.consequence = at_;
    out_.name = upper_text(name());
    if (out_.name.empty() || !take('=')) return fail("FOR needs a counter: FOR R1=1 TO 5");
    value();
    if (!out_.ok()) return;
    if (upper_text(name()) != "TO") return fail("TO is missing behind the first value of FOR");
    out_.target = value();
  }

  void read_case() {
    read_condition();
    if (!out_.ok()) return;
    if (upper_text(name()) != "OF") return fail("OF is missing behind the value of CASE");
    while (out_.ok() && !at_end()) {
      CaseJump jump;
      const std::size_t begin = at_;
      const bool otherwise = upper_text(name()) == "DEFAULT";
      if (!otherwise) {
        at_ = begin;
        jump.value = value();
      }
      if (!out_.ok()) return;
      const Word* word = find_word(name());
      if (word == nullptr || word->kind != Kind::label_goto) {
        return fail("GOTO, GOTOF or GOTOB is missing behind the constant of CASE");
      }
      jump.direction = word->direction;
      jump.label = upper_text(name());
      if (jump.label.empty()) return fail("a label or block number is missing");
      out_.cases.push_back(std::move(jump));
      if (otherwise) return;
    }
    if (out_.cases.empty()) fail("CASE has no jump");
  }

  /// Labels, then the count.
  void read_part() {
    out_.kind = Kind::repeat_part;
    out_.label = upper_text(name());
    if (out_.label.empty() || is_count(out_.label)) return fail("a label is missing");
    at_end();
    const std::size_t begin = at_;
    const std::string_view second = name();
    if (second.empty() || is_count(second)) {
      at_ = begin;
    } else if (out_.one_block) {
      at_ = begin;
      return fail("REPEATB has one label");
    } else {
      out_.name = upper_text(second);
    }
    read_count();
  }

  /// Nothing, P5 or P=5.
  void read_count() {
    if (at_end()) return;
    if (text_[at_] != 'P' && text_[at_] != 'p') {
      return fail("here nothing may stand but P with a count");
    }
    ++at_;
    take('=');
    out_.target = value();
  }

  void read_call() {
    out_.kind = Kind::program_call;
    out_.name = upper_text(name());
    if (!is_program_name(out_.name)) return fail("no word of program flow");
    if (take('(')) read_arguments();
    if (out_.ok()) read_count();
  }

  void read_arguments() {
    if (take(')')) return;
    while (out_.ok()) {
      const bool none = !at_end() && (text_[at_] == ',' || text_[at_] == ')');
      out_.values.push_back(none ? FlowText::kNone : value());
      if (!out_.ok() || take(')')) return;
      if (!take(',')) return fail("a comma or ) is missing in the call");
    }
  }

  /// CALL "NAME", EXTCALL("NAME.SPF"): a name without folder.
  void read_quoted_call() {
    const bool parenthesis = take('(');
    if (!take('"')) return fail("a program's name in quotes is missing");
    const std::size_t close = text_.find('"', at_);
    if (close == std::string_view::npos) return fail("the name has no closing quote");
    std::string program = upper_text(text_.substr(at_, close - at_));
    for (const std::string_view ending : {".SPF", ".MPF", "_SPF", "_MPF"}) {
      if (program.size() > 4 && program.ends_with(ending)) {
        program.resize(program.size() - 4);
        break;
      }
    }
    if (program.starts_with("_N_")) program.erase(0, 3);
    if (!is_program_name(program)) {
      return fail(
          "a program is called by its plain name, without a path; put its file beside the "
          "program");
    }
    out_.name = std::move(program);
    at_ = close + 1;
    if (parenthesis && !take(')')) return fail("the parenthesis is not closed");
    read_count();
  }

  std::string_view text_;
  std::size_t at_ = 0;
  FlowText out_;
};

}  // namespace

bool is_siemens_flow(std::string_view name) { return find_word(name) != nullptr; }

bool is_program_name(std::string_view name) {
  if (name.size() < 2 || name.size() > 100) return false;
  const auto digit = [](char c) { return detail::is_digit(c); };
  if (!std::all_of(name.begin(), name.end(), in_name)) return false;
  if (name[0] == 'L' || name[0] == 'l') {
    if (std::all_of(name.begin() + 1, name.end(), digit)) return true;
  }
  return is_letter(name[0]) && is_letter(name[1]);
}

FlowText read_siemens_flow(std::string_view text) { return LineReader(text).read(); }

}  // namespace smoothpost::nc
