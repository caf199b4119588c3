#pragma once

#include <cstring>
#include <memory>
#include <string>
#include <string_view>

#include "formats/nc/constructs.h"
#include "formats/nc/diagnostic_log.h"
#include "formats/nc/number.h"
#include "formats/nc/program.h"

namespace smoothpost::nc {

/// Builds the tree line by line: what all dialects share. Lines are separated first, so that
/// nothing reaches over a line end; `content` of a dialect then pushes pieces that tile the line.
/// What is known of a line does not depend on the pieces of lines before it.
class TreeBuilder {
 public:
  TreeBuilder(Program& program, DiagnosticLog& log)
      : program_(program),
        log_(log),
        base_(program.text.data()),
        text_end_(base_ + program.text.size()),
        next_(base_) {
    if (program.text.starts_with("\xEF\xBB\xBF")) bom_ = 3;  // byte order mark of some editors
  }
  virtual ~TreeBuilder() = default;
  /// At the same place of the same program.
  virtual std::unique_ptr<TreeBuilder> clone() const = 0;

  /// From now on lines are read that another has read before: their faults are told.
  void read_again() { again_ = true; }

  /// Appends all further lines.
  void read_all() {
    const auto left = static_cast<std::size_t>(text_end_ - next_);
    program_.blocks.reserve(program_.blocks.size() + left / 24 + 1);
    program_.pieces.reserve(program_.pieces.size() + left / 3 + 4);
    while (next_ != text_end_) next_ = line(next_);
  }

  /// Appends one further line, or up to `most`, but no more when they have kBytes of text a line.
  void read_some(std::size_t most) {
    constexpr std::size_t kBytes = 64;
    const char* const begin = next_;
    for (std::size_t i = 0; i < most && next_ != text_end_; ++i) {
      next_ = line(next_);
      if (static_cast<std::size_t>(next_ - begin) / kBytes >= most) return;
    }
  }

  bool at_end() const { return next_ == text_end_; }

 protected:
  TreeBuilder(const TreeBuilder&) = default;
  /// Pushes the pieces of one line from `begin` to line_end_.
  virtual void content(const char* begin) = 0;

  std::string_view rest_of_line(const char* begin) const {
    return {begin, static_cast<std::size_t>(line_end_ - begin)};
  }

  const char* skip_blanks(const char* p) const {
    while (p != line_end_ && detail::is_blank(*p)) ++p;
    return p;
  }

  const char* blanks(const char* begin) {
    const char* p = skip_blanks(begin + 1);
    push(PieceKind::space, begin, p);
    return p;
  }

  const char* push_construct(ConstructSpan span, const char* begin) {
    const std::string_view text(begin, span.length);
    return push_refused(code_of(span.kind), describe(span.kind, text), text);
  }

  /// Text that is kept and cannot be read, with its reason.
  const char* push_refused(const char* code, std::string why, std::string_view text) {
    const char* end = text.data() + text.size();
    error(code, std::move(why), text.data());
    push(PieceKind::construct, text.data(), end);
    words_in_line_ = words_seen_ = true;
    return end;
  }

  void error(const char* code, std::string why, const char* where) {
    if (again_) return;
    if (!quiet_) {
      if (program_.first_fault == 0) program_.first_fault = line_number_;
      return log_.error(code, std::move(why), place(where));
    }
    if (program_.late_faults.size() < Program::kLateFaults) {
      const TextPlace at = place(where);
      program_.late_faults.push_back({at.line, at.column, code, std::move(why)});
    }
  }

  TextPlace place(const char* p) const {
    return {line_number_, static_cast<std::uint32_t>(p - line_begin_) + 1};
  }

  void push(PieceKind kind, const char* begin, const char* end) {
    Piece piece;
    piece.kind = kind;
    piece.begin = static_cast<std::uint32_t>(begin - base_);
    piece.length = static_cast<std::uint32_t>(end - begin);
    program_.pieces.push_back(piece);
    if (kind != PieceKind::space) only_blanks_ = false;
  }

  void push_word(char letter, const char* begin, const ScannedNumber& scanned,
                 WordForm form = WordForm::number) {
    Piece piece;
    piece.kind = PieceKind::word;
    piece.letter = letter;
    piece.detail = static_cast<std::uint8_t>(form);
    piece.begin = static_cast<std::uint32_t>(begin - base_);
    piece.length = static_cast<std::uint32_t>(scanned.next - begin);
    piece.value = scanned.value;
    program_.pieces.push_back(piece);
    only_blanks_ = false;
    words_in_line_ = words_seen_ = true;
  }

  /// On this line, but for its number.
  bool words_besides_n() const {
    return words_in_line_ && program_.pieces.back().letter != 'N' &&
           !(program_.pieces.back().kind == PieceKind::space && program_.pieces.size() > 1 &&
             program_.pieces[program_.pieces.size() - 2].letter == 'N');
  }

  Program& program_;
  DiagnosticLog& log_;
  const char* base_;
  const char* text_end_;
  const char* line_begin_ = nullptr;
  const char* line_end_ = nullptr;
  std::uint32_t line_number_ = 0;
  bool only_blanks_ = true;
  bool words_in_line_ = false;
  bool words_seen_ = false;
  bool deleted_ = false;
  bool percent_closes_ = false;
  bool ended_ = false;  ///< the end of the program stands in a line before or in this one
  bool quiet_ = false;  ///< this line is behind the end of the program
  bool again_ = false;  ///< this line was read before

 private:
  const char* line(const char* begin) {
    const auto first = static_cast<std::uint32_t>(program_.pieces.size());
    line_begin_ = begin;
    line_end_ = find_line_end(begin);
    ++line_number_;
    words_in_line_ = false;
    only_blanks_ = true;
    deleted_ = false;
    if (ended_ && !quiet_) program_.end_block = line_number_ - 1;
    quiet_ = ended_;
    if (in_trailer_) {
      if (begin != line_end_) push(PieceKind::trailer, begin, line_end_);
    } else {
      if (bom_ > 0) {
        push(PieceKind::space, begin, begin + bom_);
        begin += bom_;
        bom_ = 0;
      }
      content(begin);
    }
    const char* next = line_end_;
    if (next != text_end_) {
      next += *next == '\r' && next + 1 != text_end_ && next[1] == '\n' ? 2 : 1;
      push(PieceKind::line_end, line_end_, next);
    }
    program_.blocks.push_back({first, static_cast<std::uint32_t>(program_.pieces.size()) - first});
    program_.block_count = line_number_;
    if (percent_closes_) in_trailer_ = true;
    return next;
  }

  /// First LF or CR at or behind `p`, or the end. Each byte is looked at once for each of the two.
  const char* find_line_end(const char* p) {
    if (next_line_feed_ == nullptr || next_line_feed_ < p) {
      const auto left = static_cast<std::size_t>(text_end_ - p);
      const auto* found = static_cast<const char*>(std::memchr(p, '\n', left));
      next_line_feed_ = found ? found : text_end_;
    }
    const auto left = static_cast<std::size_t>(next_line_feed_ - p);
    const auto* found = static_cast<const char*>(std::memchr(p, '\r', left));
    return found ? found : next_line_feed_;
  }

  const char* next_;  ///< begin of the next line
  int bom_ = 0;
  const char* next_line_feed_ = nullptr;
  bool in_trailer_ = false;
};

/// The builder of the program's dialect. `program`, with its text, and `log` outlive it.
std::unique_ptr<TreeBuilder> make_builder(Program& program, DiagnosticLog& log);

/// An empty program of that text; a text that is too long is refused and left out.
Program program_of(std::string text, std::string file_name, InputDialect dialect,
                   DiagnosticLog& log);

}  // namespace smoothpost::nc
