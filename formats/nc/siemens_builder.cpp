#include "formats/nc/siemens_builder.h"

#include <algorithm>
#include <cstring>

#include "formats/nc/codes.h"
#include "formats/nc/number_text.h"
#include "formats/nc/siemens_flow.h"

namespace smoothpost::nc {
namespace {

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool begins_name(char c) { return is_letter(c) || c == '_' || c == '$'; }
bool begins_number(char c) { return detail::is_digit(c) || c == '.' || c == '+' || c == '-'; }
char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; }

/// Whether an expression goes on behind a number: an operator, or DIV and MOD.
bool goes_on(std::string_view rest) {
  if (rest.empty()) return false;
  if (std::strchr("+-*/<>=(", rest.front()) != nullptr) return true;
  const std::string word = upper_text(rest.substr(0, 3));
  return word == "DIV" || word == "MOD";
}

}  // namespace

void SiemensBuilder::content(const char* p) {
  first_piece_ = program_.pieces.size();
  header_ = false;
  while (p != line_end_) {
    p = detail::is_blank(*p) ? blanks(p) : item(p);
  }
  program_began_ = program_began_ || (words_in_line_ && !header_);
}

const char* SiemensBuilder::item(const char* begin) {
  const char c = *begin;
  if (is_letter(c)) return letter(begin);
  if (begins_name(c)) return name(begin, behind_name(begin));
  if (c == ';') {
    push(PieceKind::comment, begin, line_end_);
    return line_end_;
  }
  if (c == '%' && only_blanks_) return header(begin);
  if (c == '/' && only_blanks_) {
    const char* end = begin + 1;
    if (end != line_end_ && detail::is_digit(*end)) ++end;
    deleted_ = true;
    push(PieceKind::block_delete, begin, end);
    return end;
  }
  if (c == ':' && !words_in_line_) {
    const ScannedNumber scanned = scan_number(begin + 1, line_end_);
    if (scanned.ok) {
      push_word('N', begin, scanned);
      return scanned.next;
    }
  }
  if (c == '(' || c == ')' || c == '"' || c == '=' || c == '[' || c == ']' || c == '#') {
    return push_refused("NC143", std::string("\"") + c + "\" begins no word of a Sinumerik program",
                        {begin, static_cast<std::size_t>(end_of_statement(begin) - begin)});
  }
  return push_construct(measure_construct(rest_of_line(begin)), begin);
}

/// A word such as X10, an address or name behind which = or ( stands, or a name alone.
const char* SiemensBuilder::letter(const char* begin) {
  const char* second = skip_blanks(begin + 1);
  if (second != line_end_ && *second == '=' && (second + 1 == line_end_ || second[1] != '=')) {
    return assigned(begin, begin + 1, second);
  }
  if (begin + 1 == line_end_ || !begins_number(begin[1])) return name(begin, behind_name(begin));
  const ScannedNumber scanned = scan_number(begin + 1, line_end_);
  if (!scanned.ok) return push_construct(measure_construct(rest_of_line(begin)), begin);
  const char* behind = skip_blanks(scanned.next);
  if (behind != line_end_ && *behind == '=' && detail::is_digit(begin[1])) {
    return assigned(begin, behind_name(begin), behind);
  }
  const char* next = scanned.next;
  if (next != line_end_ && (*next == '_' || *next == '(' || *next == '[')) {
    return name(begin, behind_name(begin));
  }
  return word_end(begin, upper(*begin), scanned);
}

const char* SiemensBuilder::word_end(const char* begin, char letter, const ScannedNumber& scanned) {
  const std::string_view text(begin, static_cast<std::size_t>(scanned.next - begin));
  const std::string_view rest = rest_of_line(scanned.next);
  const bool exponent = rest.size() > 2 && upper_text(rest.substr(0, 2)) == "EX";
  if (text.find_first_of(" \t") != std::string_view::npos ||
      (!rest.empty() && (rest[0] == '.' || rest[0] == ','))) {
    return push_construct({Construct::bad_number, static_cast<std::uint32_t>(text.size())}, begin);
  }
  if (exponent) return address(begin, letter, begin + 1);
  if (letter == 'N') {
    if (words_in_line_) {
      return push_construct(
          {Construct::misplaced_line_number, static_cast<std::uint32_t>(text.size())}, begin);
    }
  } else if (letter == 'L' && begins_line()) {
    return program_call(begin, scanned.next);
  } else if (letter == 'R' || letter == 'O' || letter == 'L' || letter == 'P' || letter == 'E' ||
             letter == 'Q') {
    const std::string why =
        letter == 'L' || letter == 'P'
            ? ": a call of a subprogram is a line of its own: L100 P3 or NAME P3"
            : ": no address of this control; R parameters are written R1=5, a circle's radius CR=5";
    return push_refused("NC141", std::string(text) + why, text);
  } else if (letter == 'G' && scanned.value > kMostSiemensCode) {
    return push_refused("NC141", std::string(text) + ": no G code of this control", text);
  }
  push_word(letter, begin, scanned);
  if (letter == 'M' && !deleted_ &&
      (scanned.value == 2.0 || scanned.value == 17.0 || scanned.value == 30.0)) {
    ended_ = true;
  }
  return scanned.next;
}

/// The comment behind `p` or the line's end, without the blanks before it.
const char* SiemensBuilder::end_of_statement(const char* begin) const {
  const char* end = begin + 1;
  for (bool quoted = false; end != line_end_ && (quoted || *end != ';'); ++end) {
    if (*end == '"') quoted = !quoted;
  }
  while (end > begin + 1 && detail::is_blank(end[-1])) --end;
  return end;
}

const char* SiemensBuilder::behind_name(const char* p) const {
  while (p != line_end_ && (begins_name(*p) || detail::is_digit(*p))) ++p;
  return p;
}

/// Behind the parenthesis or bracket that closes the one at `open`, quoted text passed over; the
/// line's end when there is none.
const char* SiemensBuilder::behind_group(const char* open, char close) const {
  int depth = 0;
  bool quoted = false;
  for (const char* p = open; p != line_end_; ++p) {
    if (*p == '"') quoted = !quoted;
    if (quoted) continue;
    if (*p == *open) ++depth;
    if (*p == close && --depth == 0) return p + 1;
  }
  return line_end_;
}

const char* SiemensBuilder::statement(SiemensWord word, const char* begin, const char* end) {
  push(PieceKind::statement, begin, end);
  program_.pieces.back().detail = static_cast<std::uint8_t>(word);
  words_in_line_ = words_seen_ = true;
  if (word == SiemensWord::program_end && !deleted_) ended_ = true;
  return end;
}

const char* SiemensBuilder::refuse_name(const char* begin, const char* name_end, const char* end) {
  const std::string_view name(begin, static_cast<std::size_t>(name_end - begin));
  return push_refused("NC140", siemens_refusal(name.substr(0, 60)),
                      {begin, static_cast<std::size_t>(end - begin)});
}

const char* SiemensBuilder::refuse_value(const char* begin, const char* value,
                                         const Evaluated& found) {
  error("NC142", "the expression cannot be read: " + found.problem, value + found.at);
  const char* end = end_of_statement(begin);
  push(PieceKind::construct, begin, end);
  words_in_line_ = words_seen_ = true;
  return end;
}

const char* SiemensBuilder::name(const char* begin, const char* name_end) {
  const std::string_view text(begin, static_cast<std::size_t>(name_end - begin));
  const char* behind = skip_blanks(name_end);
  const char next = behind == line_end_ ? '\0' : *behind;
  if (next == '=' && (behind + 1 == line_end_ || behind[1] != '=')) {
    return assigned(begin, name_end, behind);
  }
  if (is_siemens_flow(text)) return flow(begin);
  if (upper_text(text) == "MCALL") return modal_call(begin, name_end);
  if (const int motion = siemens_motion(text); motion != 0) {
    ScannedNumber code;
    code.value = motion / 10.0;
    code.next = name_end;
    push_word('G', begin, code);
    return name_end;
  }
  if (next == '(') return call(begin, name_end);
  if (next == '[') return array(begin, behind);
  if (next == ':' && !words_besides_n())
    return statement(SiemensWord::no_effect, begin, behind + 1);
  if (upper_text(text) == "DEF") return declaration(begin);
  if (upper_text(text) == "PROC") return procedure(begin);
  // What is called is checked at the call.
  if (upper_text(text) == "EXTERN" && begins_line())
    return statement(SiemensWord::no_effect, begin, end_of_statement(begin));
  const SiemensWord word = siemens_keyword(text);
  if (word != SiemensWord::none) return statement(word, begin, name_end);
  if (text.size() == 1) return push_construct({Construct::letter_alone, 1}, begin);
  // What follows the first word of a command or jump belongs to it.
  return program_call(begin, end_of_statement(begin));
}

/// %_N_NAME_MPF and %_N_NAME_SPF begin a program; other such lines have no effect.
const char* SiemensBuilder::header(const char* begin) {
  const char* end = end_of_statement(begin);
  const std::string text = upper_text({begin, static_cast<std::size_t>(end - begin)});
  const bool names = text.size() > 8 && text.starts_with("%_N_") &&
                     (text.ends_with("_MPF") || text.ends_with("_SPF"));
  if (!names) return statement(SiemensWord::no_effect, begin, line_end_);
  program_.has_flow = program_.has_flow || words_seen_;
  forget_declared();
  program_began_ = false;
  header_ = true;
  return statement(SiemensWord::program_name, begin, end);
}

/// NAME(args), L100: a line of its own. What stands to `refused_end` is refused when it is none.
const char* SiemensBuilder::program_call(const char* begin, const char* refused_end) {
  const char* name_end = behind_name(begin);
  const std::string_view name(begin, static_cast<std::size_t>(name_end - begin));
  const char* end = end_of_statement(begin);
  const bool may = begins_line() && is_program_name(name) && !is_siemens_reserved(name);
  const FlowText read =
      may ? read_siemens_flow({begin, static_cast<std::size_t>(end - begin)}) : FlowText{};
  if (may && read.ok()) return flow(begin);
  return refuse_name(begin, name_end, refused_end);
}

/// Only the block's number, its skip level and a label stand before.
bool SiemensBuilder::begins_line() const {
  for (std::size_t i = first_piece_; i < program_.pieces.size(); ++i) {
    const Piece& piece = program_.pieces[i];
    const bool label =
        piece.kind == PieceKind::statement && program_.text[piece.begin + piece.length - 1] == ':';
    const bool number = piece.kind == PieceKind::word && piece.letter == 'N';
    if (piece.kind != PieceKind::space && piece.kind != PieceKind::block_delete && !label &&
        !number)
      return false;
  }
  return true;
}

/// IF, ELSE, WHILE, GOTOF, L100 ...: a line of its own but for its number and a label.
const char* SiemensBuilder::flow(const char* begin) {
  const char* end = end_of_statement(begin);
  const std::string_view text(begin, static_cast<std::size_t>(end - begin));
  if (!begins_line()) {
    return push_refused("NC150", "a line of program flow has other words before it", text);
  }
  const FlowText read = read_siemens_flow(text);
  if (!read.ok()) {
    error("NC150", "the line of program flow cannot be read: " + read.problem, begin + read.at);
  }
  push(read.ok() ? PieceKind::flow : PieceKind::construct, begin, end);
  program_.pieces.back().detail = static_cast<std::uint8_t>(read.kind);
  program_.has_flow = program_.has_flow || read.ok();
  words_in_line_ = words_seen_ = true;
  return end;
}

/// MCALL alone, or before a cycle.
const char* SiemensBuilder::modal_call(const char* begin, const char* name_end) {
  const char* cycle = skip_blanks(name_end);
  if (cycle == line_end_ || *cycle == ';')
    return statement(SiemensWord::modal_call, begin, name_end);
  const char* cycle_end = behind_name(cycle);
  const char* open = skip_blanks(cycle_end);
  const std::string_view name(cycle, static_cast<std::size_t>(cycle_end - cycle));
  const char* end = open != line_end_ && *open == '(' ? behind_group(open, ')') : cycle_end;
  const bool closed = end > cycle && end[-1] == ')';
  const bool pattern = upper_text(name).starts_with("HOLES");
  if (!closed || pattern || siemens_call(name, "0") != SiemensWord::single_call) {
    const char* const refused = end > cycle_end ? end : end_of_statement(begin);
    const std::string_view cycle_name(cycle, static_cast<std::size_t>(cycle_end - cycle));
    error("NC140", siemens_refusal(cycle_name.substr(0, 60)), cycle);
    push(PieceKind::construct, begin, refused);
    words_in_line_ = words_seen_ = true;
    return refused;
  }
  return statement(SiemensWord::modal_call, begin, end);
}

/// NAME[..]=..: an element of an array, PO[X]=(..), $P_UIFR[1,X,TR]=.. .
const char* SiemensBuilder::array(const char* begin, const char* bracket) {
  const char* end = behind_group(bracket, ']');
  const char* behind = skip_blanks(end);
  const char* name_end = behind_name(begin);
  const std::string name = upper_text({begin, static_cast<std::size_t>(name_end - begin)});
  const bool assigns = behind != line_end_ && *behind == '=';
  const char* value = assigns ? skip_blanks(behind + 1) : line_end_;
  if (assigns && (is_declared(name) || name == "R")) {
    const Evaluated found = assign_siemens(rest_of_line(begin), nullptr);
    if (!found.ok()) return refuse_value(begin, begin, found);
    push(PieceKind::assignment, begin, begin + found.length);
    words_in_line_ = words_seen_ = true;
    return begin + found.length;
  }
  if (name == "PO" && value != line_end_ && *value == '(') {
    const char* close = behind_group(value, ')');
    if (close[-1] == ')') return statement(SiemensWord::polynomial, begin, close);
  }
  if (name == "$P_UIFR" && assigns) {
    const char* close = value;
    if (value != line_end_ && (*value == 'C' || *value == 'c')) {
      close = behind_frame(value);
    } else {
      const Evaluated number = evaluate_siemens(rest_of_line(value), nullptr);
      if (!number.ok()) return refuse_value(begin, value, number);
      close = value + number.length;
    }
    return statement(SiemensWord::offset_data, begin, close);
  }
  if (assigns) {
    const Evaluated number = evaluate_siemens(rest_of_line(behind + 1), nullptr);
    end = number.ok() ? behind + 1 + number.length : end_of_statement(begin);
  }
  return refuse_name(begin, name_end, end);
}

/// CTRANS(..) or CTRANS(..):CROT(..).
const char* SiemensBuilder::behind_frame(const char* begin) const {
  const char* end = begin;
  while (true) {
    const char* open = skip_blanks(behind_name(end));
    if (open == line_end_ || *open != '(') return open;
    end = behind_group(open, ')');
    const char* colon = skip_blanks(end);
    if (colon == line_end_ || *colon != ':') return end;
    end = skip_blanks(colon + 1);
  }
}

const char* SiemensBuilder::call(const char* begin, const char* name_end) {
  const char* open = skip_blanks(name_end);
  const char* end = behind_group(open, ')');
  const std::string_view text(begin, static_cast<std::size_t>(end - begin));
  if (end[-1] != ')') {
    return push_refused("NC143", "a parenthesis or quoted text is not closed on its line", text);
  }
  const std::string_view name(begin, static_cast<std::size_t>(name_end - begin));
  const std::string_view arguments(open + 1, static_cast<std::size_t>(end - open) - 2);
  const SiemensWord word = siemens_call(name, arguments);
  if (word == SiemensWord::none) return program_call(begin, end);
  return statement(word, begin, end);
}

const char* SiemensBuilder::assigned(const char* begin, const char* name_end, const char* equals) {
  const std::string_view text(begin, static_cast<std::size_t>(name_end - begin));
  const char* value = skip_blanks(equals + 1);
  if (const char known = siemens_address(text)) return address(begin, known, value);
  const std::string name = upper_text(text);
  const bool variable = is_r_parameter(name) || is_declared(name);
  const bool tolerance = is_siemens_tolerance(name);
  if (variable && !tolerance) {
    const Evaluated found = assign_siemens(rest_of_line(begin), nullptr);
    if (!found.ok()) return refuse_value(begin, begin, found);
    push(PieceKind::assignment, begin, begin + found.length);
    words_in_line_ = words_seen_ = true;
    return begin + found.length;
  }
  const Evaluated found = evaluate_siemens(rest_of_line(value), nullptr);
  if (!tolerance) {
    return refuse_name(begin, name_end,
                       found.ok() ? value + found.length : end_of_statement(begin));
  }
  if (!found.ok()) return refuse_value(begin, value, found);
  return statement(SiemensWord::no_effect, begin, value + found.length);
}

/// A word with =, or with an exponent; `value` is where its value begins.
const char* SiemensBuilder::address(const char* begin, char address, const char* value) {
  const std::string_view rest = rest_of_line(value);
  if (address == 'T' && !rest.empty() && rest.front() == '"') return tool_name(begin, value);
  const ScannedNumber number = scan_number(value, line_end_);
  if (number.ok && (number.next == line_end_ || detail::is_blank(*number.next)) &&
      !goes_on(rest_of_line(skip_blanks(number.next))) &&
      std::memchr(value, ' ', static_cast<std::size_t>(number.next - value)) == nullptr) {
    push_word(address, begin, number);
    return number.next;
  }
  WordForm form = WordForm::expression;
  std::size_t offset = 0;
  const char* name_end = behind_name(value);
  const char* open = skip_blanks(name_end);
  if (open != line_end_ && *open == '(') {
    const std::string mode = upper_text({value, static_cast<std::size_t>(name_end - value)});
    const bool rotary = address >= 'A' && address <= 'C';
    const bool sense = mode == "DC" || mode == "ACP" || mode == "ACN";
    if ((sense && !rotary) || mode == "CDC" || mode == "CIC" || mode == "CAC" || mode == "CACP" ||
        mode == "CACN") {
      const char* end = behind_group(open, ')');
      return push_refused("NC141",
                          mode +
                              "(): a position by an index, or a sense of an axis other than A, B "
                              "and C, is not read; let the CAM post write plain positions",
                          {begin, static_cast<std::size_t>(end - begin)});
    }
    if (mode == "AC" || mode == "IC" || sense) {
      form = mode == "AC"    ? WordForm::absolute
             : mode == "IC"  ? WordForm::incremental
             : mode == "DC"  ? WordForm::shortest
             : mode == "ACP" ? WordForm::upwards
                             : WordForm::downwards;
      offset = static_cast<std::size_t>(open - value);
    }
  }
  const Evaluated found = evaluate_siemens(rest.substr(offset), nullptr);
  if (!found.ok()) return refuse_value(begin, value + offset, found);
  ScannedNumber span;
  span.next = value + offset + found.length;
  push_word(address, begin, span, form);
  return span.next;
}

const char* SiemensBuilder::tool_name(const char* begin, const char* quote) {
  const char* close = quote + 1;
  while (close != line_end_ && *close != '"') ++close;
  if (close == line_end_) {
    return push_refused("NC143", "a parenthesis or quoted text is not closed on its line",
                        rest_of_line(begin));
  }
  ScannedNumber span;
  span.next = close + 1;
  push_word('T', begin, span, WordForm::name);
  return span.next;
}

void SiemensBuilder::declare(const std::string& name) {
  if (!again_) (*declarations_)[name].push_back(declared_);
  ++declared_;
}

bool SiemensBuilder::is_declared(const std::string& name) const {
  const auto known = declarations_->find(name);
  if (known == declarations_->end()) return false;
  const std::vector<std::uint32_t>& numbers = known->second;
  const auto found = std::lower_bound(numbers.begin(), numbers.end(), first_declared_);
  return found != numbers.end() && *found < declared_;
}

/// DEF REAL a, b=2.5, c[5]
const char* SiemensBuilder::declaration(const char* begin) {
  const char* end = end_of_statement(begin);
  const std::string_view text(begin, static_cast<std::size_t>(end - begin));
  std::vector<std::string> names;
  const Evaluated found = declare_siemens(text, nullptr, &names);
  for (const std::string& name : names) declare(name);
  if (!found.ok() || found.length != text.size()) {
    return push_refused("NC140",
                        "DEF: " + (found.ok() ? "text behind the variables" : found.problem) +
                            "; variables are REAL, INT, BOOL or STRING[n], with a plain value or "
                            "as arrays",
                        text);
  }
  return statement(SiemensWord::declaration, begin, end);
}

/// PROC NAME(REAL A, INT B): the head of the program that it stands in, or behind an end that of a
/// further one.
const char* SiemensBuilder::procedure(const char* begin) {
  const char* end = end_of_statement(begin);
  const std::string_view text(begin, static_cast<std::size_t>(end - begin));
  const SiemensProcedure head = read_siemens_procedure(text);
  const bool further = program_began_ && ended_ && quiet_;
  std::string problem = head.problem;
  if (!begins_line() || (program_began_ && !further)) {
    problem = "it stands first in a program, alone on its line";
  }
  if (!problem.empty()) {
    return push_refused("NC140", "PROC: " + problem + "; call the subprogram with plain values",
                        text);
  }
  if (further) {
    forget_declared();
    program_.has_flow = true;
  }
  for (const auto& parameter : head.parameters) declare(parameter.first);
  return statement(further ? SiemensWord::further_procedure : SiemensWord::procedure, begin, end);
}

}  // namespace smoothpost::nc
