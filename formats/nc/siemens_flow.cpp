#include "formats/nc/siemens_flow.h"

#include <algorithm>
#include <array>

#include "formats/nc/number.h"
#include "formats/nc/siemens_expression.h"
#include "formats/nc/siemens_words.h"

namespace smoothpost::nc {
namespace {

struct Word {
  std::string_view name;
  FlowKind kind;
  int direction;
};

constexpr std::array<Word, 9> kWords = {{{"IF", FlowKind::branch_if, 0},
                                         {"ELSE", FlowKind::otherwise, 0},
                                         {"ENDIF", FlowKind::endif, 0},
                                         {"WHILE", FlowKind::loop_while, 0},
                                         {"ENDWHILE", FlowKind::endwhile, 0},
                                         {"GOTO", FlowKind::label_goto, 0},
                                         {"GOTOC", FlowKind::label_goto, 0},
                                         {"GOTOF", FlowKind::label_goto, 1},
                                         {"GOTOB", FlowKind::label_goto, -1}}};

const Word* find_word(std::string_view name) {
  const std::string upper = upper_text(name);
  for (const Word& word : kWords)
    if (word.name == upper) return &word;
  return nullptr;
}

bool in_name(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || detail::is_digit(c);
}

class LineReader {
 public:
  explicit LineReader(std::string_view text) : text_(text) {}

  FlowText read() {
    const Word* word = find_word(name());
    if (word == nullptr) {
      fail("no word of program flow");
      return std::move(out_);
    }
    out_.kind = word->kind;
    if (word->kind == FlowKind::branch_if || word->kind == FlowKind::loop_while) read_condition();
    if (word->kind == FlowKind::branch_if && out_.ok() && !at_end()) {
      word = find_word(name());
      if (word == nullptr || word->kind != FlowKind::label_goto) {
        fail("behind the condition GOTO, GOTOF or GOTOB is expected, or nothing");
      } else {
        out_.kind = FlowKind::label_if_goto;
      }
    }
    if (out_.ok() && word->kind == FlowKind::label_goto) read_label(word->direction);
    if (out_.ok() && !at_end()) fail("nothing else may stand on this line");
    out_.length = text_.size();
    return std::move(out_);
  }

 private:
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

  void fail(std::string problem) {
    out_.problem = std::move(problem);
    out_.at = std::min(at_, text_.empty() ? 0 : text_.size() - 1);
  }

  void read_condition() {
    at_end();
    const Evaluated found = evaluate_siemens_condition(text_.substr(at_), nullptr);
    if (!found.ok()) {
      at_ += found.at;
      return fail(found.problem);
    }
    out_.values.push_back(at_);
    at_ += found.length;
  }

  void read_label(int direction) {
    out_.label = upper_text(name());
    out_.direction = direction;
    if (out_.label.empty()) fail("a label or block number is missing");
  }

  std::string_view text_;
  std::size_t at_ = 0;
  FlowText out_;
};

}  // namespace

bool is_siemens_flow(std::string_view name) { return find_word(name) != nullptr; }

FlowText read_siemens_flow(std::string_view text) { return LineReader(text).read(); }

}  // namespace smoothpost::nc
