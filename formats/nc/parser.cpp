#include "formats/nc/parser.h"

#include <array>
#include <limits>
#include <string_view>
#include <utility>

#include "formats/nc/expression.h"
#include "formats/nc/flow_words.h"
#include "formats/nc/siemens_builder.h"
#include "formats/nc/tree_builder.h"

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

/// RS274NGC, and the Fanuc family, whose text differs in little.
class Rs274Builder final : public TreeBuilder {
 public:
  using TreeBuilder::TreeBuilder;
  std::unique_ptr<TreeBuilder> clone() const override {
    return std::make_unique<Rs274Builder>(*this);
  }

 protected:
  void content(const char* p) override {
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

 private:
  bool is_linuxcnc() const { return program_.dialect == InputDialect::linuxcnc; }
  ExpressionRules rules() const {
    return is_linuxcnc() ? ExpressionRules::linuxcnc : ExpressionRules::fanuc;
  }

  const char* word(const char* begin) {
    const char letter = static_cast<char>(*begin & ~0x20);
    const char* number = begin + 1;
    while (number != line_end_ && detail::is_blank(*number)) ++number;
    const ScannedNumber scanned = scan_number(number, line_end_);
    if (!scanned.ok) return no_number(letter, begin, number);
    const char* next = scanned.next;
    if (next != line_end_ && (*next == '.' || *next == ',' || *next == '=' || *next == '_')) {
      return construct(begin);
    }
    if (letter == 'O' || letter == 'N') return program_or_line_number(begin, scanned);
    push_word(letter, begin, scanned);
    if (letter == 'M') {
      if ((scanned.value == 2.0 || scanned.value == 30.0) && !deleted_) ended_ = true;
      if (scanned.value > 96.5 && scanned.value < 99.5) program_.has_calls = true;
    } else if (letter == 'G' && scanned.value > 64.5 && scanned.value < 65.5) {
      program_.has_calls = true;
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

  const char* no_number(char letter, const char* begin, const char* value) {
    if (letter == 'O') return o_word(begin);
    if (!is_linuxcnc() && begins_macro(rest_of_line(begin))) return macro(begin);
    return expression_word(letter, begin, value);
  }

  const char* o_word(const char* begin) {
    const std::string_view text(begin, length_to_comment(rest_of_line(begin)));
    if (!is_linuxcnc() || words_besides_n()) {
      return push_construct({Construct::o_word, static_cast<std::uint32_t>(text.size())}, begin);
    }
    return flow(read_o_line(text), text);
  }

  const char* macro(const char* begin) {
    const std::string_view text(begin, length_to_comment(rest_of_line(begin)));
    if (words_besides_n()) {
      return push_construct({Construct::name, static_cast<std::uint32_t>(text.size())}, begin);
    }
    return flow(read_macro_line(text), text);
  }

  const char* flow(const FlowText& read, std::string_view text) {
    if (!read.ok()) {
      error("NC150", "the line of program flow cannot be read: " + read.problem,
            text.data() + read.at);
    }
    push(read.ok() ? PieceKind::flow : PieceKind::construct, text.data(),
         text.data() + text.size());
    program_.pieces.back().detail = static_cast<std::uint8_t>(read.kind);
    program_.has_flow = program_.has_flow || read.ok();
    words_in_line_ = words_seen_ = true;
    return text.data() + text.size();
  }

  /// X[1+2], X#5, X-SIN[30]: a word whose value is computed when its block runs.
  const char* expression_word(char letter, const char* begin, const char* value) {
    const std::string_view rest = rest_of_line(value);
    if (letter == 'N' || !begins_expression(rest)) return construct(begin);
    const Evaluated found = evaluate_value(rest, nullptr, rules());
    if (!found.ok()) return refuse_expression(begin, value, found);
    ScannedNumber span;
    span.next = value + found.length;
    program_.has_calls = program_.has_calls || letter == 'G' || letter == 'M';
    push_word(letter, begin, span, WordForm::expression);
    return span.next;
  }

  const char* assignment(const char* begin) {
    const Evaluated found = evaluate_assignment(rest_of_line(begin), nullptr, rules()).value;
    if (!found.ok()) return refuse_expression(begin, begin, found);
    push(PieceKind::assignment, begin, begin + found.length);
    words_in_line_ = words_seen_ = true;
    return begin + found.length;
  }

  const char* refuse_expression(const char* begin, const char* value, const Evaluated& found) {
    error("NC130", "the expression cannot be read: " + found.problem, value + found.at);
    const char* end = begin + length_to_comment(rest_of_line(begin));
    push(PieceKind::construct, begin, end);
    words_in_line_ = words_seen_ = true;
    return end;
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
    const char* end = begin + 1;
    // Skip levels /1 to /9.
    if (!is_linuxcnc() && end != line_end_ && detail::is_digit(*end)) ++end;
    push(PieceKind::block_delete, begin, end);
    return end;
  }

  const char* percent(const char* begin) {
    const char* rest = begin + 1;
    while (rest != line_end_ && detail::is_blank(*rest)) ++rest;
    if (!only_blanks_ || rest != line_end_) return construct(begin);
    const bool opens = !percent_seen_ && !words_seen_;
    if (!opens && !percent_seen_ && !ended_ && !again_ && is_linuxcnc()) {
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

  const char* construct(const char* begin) {
    if (*begin == '#') return assignment(begin);
    return push_construct(measure_construct(rest_of_line(begin)), begin);
  }

  bool percent_seen_ = false;
};

}  // namespace

ParsedProgram parse(std::string text, std::string file_name) {
  return parse(std::move(text), std::move(file_name), InputDialect::linuxcnc);
}

ParsedProgram parse(std::string text, std::string file_name, InputDialect dialect) {
  DiagnosticLog log(file_name);
  ParsedProgram parsed;
  parsed.program = program_of(std::move(text), std::move(file_name), dialect, log);
  make_builder(parsed.program, log)->read_all();
  parsed.diagnostics = log.take();
  return parsed;
}

Program program_of(std::string text, std::string file_name, InputDialect dialect,
                   DiagnosticLog& log) {
  Program program;
  program.dialect = dialect;
  program.file_name = std::move(file_name);
  program.text = std::move(text);
  if (program.text.size() >= std::numeric_limits<std::uint32_t>::max()) {
    log.error("NC111",
              "the file has " + std::to_string(program.text.size()) +
                  " bytes; at most 4294967294 are read: split the program",
              {});
    program.text.clear();
  }
  return program;
}

std::unique_ptr<TreeBuilder> make_builder(Program& program, DiagnosticLog& log) {
  if (program.dialect == InputDialect::siemens)
    return std::make_unique<SiemensBuilder>(program, log);
  return std::make_unique<Rs274Builder>(program, log);
}

}  // namespace smoothpost::nc
