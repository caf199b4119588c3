#include "formats/nc/parser.h"

#include <array>
#include <cstring>
#include <limits>
#include <string_view>
#include <utility>

#include "formats/nc/constructs.h"
#include "formats/nc/diagnostic_log.h"
#include "formats/nc/number.h"

namespace smoothpost::nc {
namespace {

enum class Class : std::uint8_t { foreign, blank, letter, open, semicolon, slash, percent };

constexpr std::array<Class, 256> make_classes() {
  std::array<Class, 256> table{};
  for (int c = 'a'; c <= 'z'; ++c) table[static_cast<std::size_t>(c)] = Class::letter;
  for (int c = 'A'; c <= 'Z'; ++c) table[static_cast<std::size_t>(c)] = Class::letter;
  table[' '] = table['\t'] = Class::blank;
  table['('] = Class::open;
  table[';'] = Class::semicolon;
  table['/'] = Class::slash;
  table['%'] = Class::percent;
  return table;
}
constexpr std::array<Class, 256> kClasses = make_classes();

Class class_of(char c) { return kClasses[static_cast<unsigned char>(c)]; }

/// Builds the tree in one pass. Lines are separated first, so that nothing reaches over a line end.
class TreeBuilder {
 public:
  TreeBuilder(Program& program, DiagnosticLog& log)
      : program_(program),
        log_(log),
        base_(program.text.data()),
        text_end_(base_ + program.text.size()) {}

  void build() {
    program_.blocks.reserve(program_.text.size() / 24 + 1);
    program_.pieces.reserve(program_.text.size() / 3 + 4);
    const char* p = base_;
    if (program_.text.starts_with("\xEF\xBB\xBF")) bom_ = 3;  // byte order mark of some editors
    while (p != text_end_) p = line(p);
  }

 private:
  const char* line(const char* begin) {
    const auto first = static_cast<std::uint32_t>(program_.pieces.size());
    line_begin_ = begin;
    line_end_ = find_line_end(begin);
    ++line_number_;
    words_in_line_ = false;
    only_blanks_ = true;
    deleted_ = false;
    quiet_ = ended_;
    if (in_trailer_) {
      if (begin != line_end_) push(PieceKind::trailer, begin, line_end_);
    } else {
      content(begin);
    }
    const char* next = line_end_;
    if (next != text_end_) {
      next += *next == '\r' && next + 1 != text_end_ && next[1] == '\n' ? 2 : 1;
      push(PieceKind::line_end, line_end_, next);
    }
    program_.blocks.push_back({first, static_cast<std::uint32_t>(program_.pieces.size()) - first});
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

  void content(const char* p) {
    if (bom_ > 0) {
      push(PieceKind::space, p, p + bom_);
      p += bom_;
      bom_ = 0;
    }
    while (p != line_end_) {
      switch (class_of(*p)) {
        case Class::letter:
          p = word(p);
          break;
        case Class::blank:
          p = blanks(p);
          break;
        case Class::open:
          p = comment(p);
          break;
        case Class::semicolon:
          push(PieceKind::comment, p, line_end_);
          p = line_end_;
          break;
        case Class::slash:
          p = slash(p);
          break;
        case Class::percent:
          p = percent(p);
          break;
        case Class::foreign:
          p = construct(p);
          break;
      }
    }
  }

  const char* word(const char* begin) {
    const char letter = static_cast<char>(*begin & ~0x20);
    const char* number = begin + 1;
    while (number != line_end_ && detail::is_blank(*number)) ++number;
    const ScannedNumber scanned = scan_number(number, line_end_);
    if (!scanned.ok) return letter == 'O' ? o_word(begin) : construct(begin);
    const char* next = scanned.next;
    if (next != line_end_ && (*next == '.' || *next == ',' || *next == '=' || *next == '_')) {
      return construct(begin);
    }
    if (letter == 'O' || letter == 'N') return program_or_line_number(begin, scanned);
    push_word(letter, begin, scanned);
    if (letter == 'M' && (scanned.value == 2.0 || scanned.value == 30.0) && !deleted_) {
      ended_ = true;
    }
    return next;
  }

  /// N stands first; O with a number stands alone but for N before and comments behind it.
  const char* program_or_line_number(const char* begin, const ScannedNumber& scanned) {
    if (*begin == 'N' || *begin == 'n') {
      if (words_in_line_) {
        return push_construct(
            {Construct::misplaced_line_number, static_cast<std::uint32_t>(scanned.next - begin)},
            begin);
      }
      push_word('N', begin, scanned);
      return scanned.next;
    }
    const char* rest = scanned.next;
    while (rest != line_end_ && detail::is_blank(*rest)) ++rest;
    const bool alone = rest == line_end_ || *rest == ';' || *rest == '(';
    if (!alone || words_besides_n()) return o_word(begin);
    push_word('O', begin, scanned);
    return scanned.next;
  }

  bool words_besides_n() const {
    return words_in_line_ && program_.pieces.back().letter != 'N' &&
           !(program_.pieces.back().kind == PieceKind::space && program_.pieces.size() > 1 &&
             program_.pieces[program_.pieces.size() - 2].letter == 'N');
  }

  const char* o_word(const char* begin) {
    return push_construct({Construct::o_word, length_to_comment(rest_of_line(begin))}, begin);
  }

  const char* blanks(const char* begin) {
    const char* p = begin + 1;
    while (p != line_end_ && detail::is_blank(*p)) ++p;
    push(PieceKind::space, begin, p);
    return p;
  }

  const char* comment(const char* begin) {
    const char* p = begin + 1;
    while (p != line_end_ && *p != ')' && *p != '(') ++p;
    if (p == line_end_ || *p == '(') return construct(begin);
    push(PieceKind::comment, begin, p + 1);
    return p + 1;
  }

  const char* slash(const char* begin) {
    if (!only_blanks_) return construct(begin);
    deleted_ = true;
    push(PieceKind::block_delete, begin, begin + 1);
    return begin + 1;
  }

  const char* percent(const char* begin) {
    const char* rest = begin + 1;
    while (rest != line_end_ && detail::is_blank(*rest)) ++rest;
    if (!only_blanks_ || rest != line_end_) return construct(begin);
    const bool opens = !percent_seen_ && !words_seen_;
    if (!opens && !percent_seen_ && !ended_) {
      log_.warning("NC112",
                   "this % closes a program that no % opened: it is read as the end of the "
                   "program, but LinuxCNC refuses it; write a % on the first line too",
                   place(begin));
    }
    percent_seen_ = true;
    percent_closes_ = !opens;
    push(PieceKind::percent, begin, begin + 1);
    return begin + 1;
  }

  std::string_view rest_of_line(const char* begin) const {
    return {begin, static_cast<std::size_t>(line_end_ - begin)};
  }

  const char* construct(const char* begin) {
    return push_construct(measure_construct(rest_of_line(begin)), begin);
  }

  const char* push_construct(ConstructSpan span, const char* begin) {
    const char* end = begin + span.length;
    if (!quiet_) {
      log_.error(code_of(span.kind), describe(span.kind, {begin, span.length}), place(begin));
    }
    push(PieceKind::construct, begin, end);
    words_in_line_ = words_seen_ = true;
    return end;
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

  void push_word(char letter, const char* begin, const ScannedNumber& scanned) {
    Piece piece;
    piece.kind = PieceKind::word;
    piece.letter = letter;
    piece.begin = static_cast<std::uint32_t>(begin - base_);
    piece.length = static_cast<std::uint32_t>(scanned.next - begin);
    piece.value = scanned.value;
    program_.pieces.push_back(piece);
    only_blanks_ = false;
    words_in_line_ = words_seen_ = true;
  }

  Program& program_;
  DiagnosticLog& log_;
  const char* base_;
  const char* text_end_;
  const char* line_begin_ = nullptr;
  const char* line_end_ = nullptr;
  std::uint32_t line_number_ = 0;
  int bom_ = 0;
  const char* next_line_feed_ = nullptr;
  bool only_blanks_ = true;
  bool words_in_line_ = false;
  bool words_seen_ = false;
  bool deleted_ = false;
  bool percent_seen_ = false;
  bool percent_closes_ = false;
  bool in_trailer_ = false;
  bool ended_ = false;  ///< an M2 or M30 stands in a line before or in this one
  bool quiet_ = false;  ///< this line is behind the end of the program: controllers do not read it
};

}  // namespace

ParsedProgram parse(std::string text, std::string file_name) {
  ParsedProgram parsed;
  parsed.program.file_name = std::move(file_name);
  parsed.program.text = std::move(text);
  DiagnosticLog log(parsed.program.file_name);
  if (parsed.program.text.size() >= std::numeric_limits<std::uint32_t>::max()) {
    log.error("NC111",
              "the file has " + std::to_string(parsed.program.text.size()) +
                  " bytes; at most 4294967294 are read: split the program",
              {});
    parsed.program.text.clear();
  }
  TreeBuilder(parsed.program, log).build();
  parsed.diagnostics = log.take();
  return parsed;
}

}  // namespace smoothpost::nc
