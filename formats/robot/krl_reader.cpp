#include "formats/robot/krl_reader.h"

#include <algorithm>
#include <array>
#include <charconv>

namespace smoothpost::krl {

namespace {

bool is_letter(char c) {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '_' || c == '$';
}
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_blank(char c) { return c == ' ' || c == '\t'; }
char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; }

std::string upper(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = upper(c);
  return out;
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

/// Walks over the statement of one line.
class Cursor {
 public:
  explicit Cursor(std::string_view text) : text_(text) {}

  void blanks() {
    while (at_ < text_.size() && is_blank(text_[at_])) ++at_;
  }
  bool done() {
    blanks();
    return at_ == text_.size();
  }
  bool take(char c) {
    blanks();
    if (at_ == text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }
  char peek() {
    blanks();
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  /// A name, in upper case; empty when there is none.
  std::string word() {
    blanks();
    const auto begin = at_;
    if (at_ < text_.size() && is_letter(text_[at_]))
      while (at_ < text_.size() && (is_letter(text_[at_]) || is_digit(text_[at_]))) ++at_;
    return upper(text_.substr(begin, at_ - begin));
  }
  bool keyword(std::string_view expected) {
    const auto before = at_;
    if (word() == expected) return true;
    at_ = before;
    return false;
  }
  /// A decimal number without exponent.
  std::optional<double> number() {
    blanks();
    auto end = at_;
    if (end < text_.size() && (text_[end] == '-' || text_[end] == '+')) ++end;
    const auto digits = end;
    bool point = false;
    std::size_t count = 0;
    for (; end < text_.size() && (is_digit(text_[end]) || (text_[end] == '.' && !point)); ++end) {
      point = point || text_[end] == '.';
      count += is_digit(text_[end]) ? 1 : 0;
    }
    if (count == 0 || count > 30) return std::nullopt;
    if (end < text_.size() && is_letter(text_[end])) return std::nullopt;
    double value = 0.0;
    std::from_chars(text_.data() + digits, text_.data() + end, value, std::chars_format::fixed);
    const bool negative = text_[at_] == '-' && value != 0.0;
    at_ = end;
    return negative ? -value : value;
  }
  std::string_view rest() {
    blanks();
    return trimmed(text_.substr(at_));
  }
  std::size_t at() const { return at_; }
  void back(std::size_t at) { at_ = at; }

 private:
  std::string_view text_;
  std::size_t at_ = 0;
};

enum class KeyFamily { axis, pose, external, none };

KeyFamily family_of(std::string_view key) {
  if (key.size() == 2 && key[1] >= '1' && key[1] <= '6') {
    if (key[0] == 'A') return KeyFamily::axis;
    if (key[0] == 'E') return KeyFamily::external;
  }
  static constexpr std::string_view kPose = "XYZABCST";
  if (key.size() == 1 && kPose.find(key[0]) != std::string_view::npos) return KeyFamily::pose;
  return KeyFamily::none;
}

/// Reads one file; a class because every function tells faults with their place.
class Reader {
 public:
  Reader(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  ParsedKrl run() {
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
    if (state_ == State::head) error("NC320", "the file has no DEF", 1);
    if (state_ == State::body) error("NC320", "the program has no END", 1);
    return std::move(out_);
  }

 private:
  enum class State { head, body, done };

  void error(const char* code, const std::string& text, std::size_t column) {
    constexpr std::size_t kMostErrors = 100;
    if (out_.diagnostics.size() >= kMostErrors) return;
    Diagnostic d;
    d.code = code;
    d.text = text;
    d.where = {file_, static_cast<int>(line_), static_cast<int>(column)};
    out_.diagnostics.push_back(std::move(d));
  }

  void read_line(std::string_view line) {
    for (std::size_t i = 0; i < line.size(); ++i)
      if (static_cast<unsigned char>(line[i]) < 0x20U && line[i] != '\t')
        return error("NC320", "a control character stands in the line", i + 1);
    const std::string_view code = without_comment(line);
    const std::string_view text = trimmed(code);
    if (text.empty()) return;
    column_ = static_cast<std::size_t>(text.data() - line.data());
    if (state_ == State::done) return error("NC320", "text stands behind END", column_ + 1);
    if (state_ == State::head) return read_head(text);
    if (upper(text) == "END") {
      if (in_spline_) error("NC320", "the program ends within a SPLINE", column_ + 1);
      state_ = State::done;
      out_.program.end_line = line_;
      return;
    }
    Statement statement;
    statement.line = line_;
    statement.column = static_cast<std::uint32_t>(column_ + 1);
    statement.text = std::string(text);
    if (read_statement(text, statement)) out_.program.statements.push_back(std::move(statement));
  }

  // A ; inside double quotes belongs to the text.
  std::string_view without_comment(std::string_view line) {
    bool quoted = false;
    for (std::size_t i = 0; i < line.size(); ++i) {
      if (line[i] == '"') quoted = !quoted;
      if (line[i] == ';' && !quoted) return line.substr(0, i);
    }
    if (quoted) error("NC321", "a text is not closed by \"", line.size());
    return line;
  }

  void read_head(std::string_view text) {
    if (text.front() == '&') return;
    Cursor cursor(text);
    if (!cursor.keyword("DEF"))
      return error("NC320", "the file has to begin with & lines and DEF name( )", column_ + 1);
    out_.program.name = cursor.word();
    if (out_.program.name.empty() || !cursor.take('(') || !cursor.take(')') || !cursor.done())
      error("NC320", "DEF needs a name and ( )", column_ + 1);
    state_ = State::body;
  }

  bool fault(const char* code, const std::string& text, Cursor& cursor) {
    error(code, text, column_ + cursor.at() + 1);
    return false;
  }

  bool read_statement(std::string_view text, Statement& out) {
    Cursor cursor(text);
    const std::string first = cursor.word();
    if (first.empty()) return fault("NC321", "no statement begins like this", cursor);
    if (first == "SPLINE" || first == "ENDSPLINE" || first == "SPL" || in_spline_)
      return read_in_spline(cursor, first, out);
    if (first == "PTP" || first == "LIN") {
      out.kind = Statement::Kind::motion;
      out.name = first;
      return read_motion(cursor, out);
    }
    if (first == "TRIGGER") return read_trigger(cursor, out);
    if (first == "WAIT") return read_wait(cursor, out);
    if (first == "HALT") {
      out.kind = Statement::Kind::halt;
      return cursor.done() || fault("NC321", "text stands behind HALT", cursor);
    }
    if (first == "INTERRUPT" || first == "GLOBAL") {
      out.kind = Statement::Kind::interrupt;
      return !cursor.done() || fault("NC321", "an interrupt statement ends too early", cursor);
    }
    if (first == "DECL") return read_declaration(cursor, out);
    static constexpr std::array<std::string_view, 15> kOther = {
        "CIRC", "SPTP",   "SLIN",   "SCIRC", "IF",     "FOR",    "WHILE", "LOOP",
        "GOTO", "REPEAT", "SWITCH", "DEF",   "RETURN", "DEFFCT", "DEFDAT"};
    if (std::find(kOther.begin(), kOther.end(), first) != kOther.end())
      return fault("NC321", first + " is not read here", cursor);
    return read_assignment_or_call(cursor, first, out);
  }

  // SPLINE, what may stand in its block, ENDSPLINE.
  bool read_in_spline(Cursor& cursor, const std::string& first, Statement& out) {
    if (first == "SPLINE") {
      if (in_spline_) return fault("NC321", "SPLINE stands within a SPLINE", cursor);
      in_spline_ = true;
      spline_points_ = 0;
      out.kind = Statement::Kind::spline_begin;
      return read_with(cursor, out);
    }
    if (!in_spline_) return fault("NC321", first + " stands outside SPLINE ... ENDSPLINE", cursor);
    if (first == "ENDSPLINE") {
      in_spline_ = false;
      out.kind = Statement::Kind::spline_end;
      if (spline_points_ == 0) return fault("NC321", "a SPLINE has no SPL", cursor);
      return cursor.done() || fault("NC321", "text stands behind ENDSPLINE", cursor);
    }
    if (first == "TRIGGER") {
      if (!read_trigger(cursor, out)) return false;
      return out.by_path || fault("NC321", "TRIGGER within a SPLINE needs PATH", cursor);
    }
    if (first != "SPL") return fault("NC321", first + " cannot stand within a SPLINE", cursor);
    ++spline_points_;
    out.kind = Statement::Kind::motion;
    out.name = first;
    return read_target(cursor, out) && read_with(cursor, out);
  }

  bool read_with(Cursor& cursor, Statement& out) {
    if (cursor.done()) return true;
    if (!cursor.keyword("WITH") || !cursor.keyword("$VEL") || !cursor.take('.') ||
        !cursor.keyword("CP") || !cursor.take('='))
      return fault("NC321", "only WITH $VEL.CP= may follow", cursor);
    out.speed = cursor.number();
    if (!out.speed || !(*out.speed > 0.0) || !cursor.done())
      return fault("NC321", "WITH $VEL.CP= needs one number above 0", cursor);
    return true;
  }

  bool read_target(Cursor& cursor, Statement& out) {
    if (!read_aggregate(cursor, out.aggregate)) return false;
    KeyFamily family = KeyFamily::none;
    for (const auto& [key, value] : out.aggregate.values) {
      const auto f = family_of(key);
      if (f != KeyFamily::external && family == KeyFamily::none) family = f;
      if (f != KeyFamily::external && f != family)
        return fault("NC322", "keys of joints and of a pose stand in one target", cursor);
    }
    if (out.name != "PTP") {
      if (family != KeyFamily::pose) return fault("NC322", out.name + " needs a pose", cursor);
      for (const char* key : {"X", "Y", "Z", "A", "B", "C"})
        if (!out.aggregate.find(key))
          return fault("NC322", out.name + " has no value " + key, cursor);
    } else if (family == KeyFamily::pose) {
      return fault("NC322", "PTP to a pose is not read here: write its joints", cursor);
    }
    return true;
  }

  bool read_motion(Cursor& cursor, Statement& out) {
    if (!read_target(cursor, out)) return false;
    if (cursor.done()) return true;
    out.blend = cursor.word();
    const bool fits = out.name == "PTP"
                          ? out.blend == "C_PTP" || out.blend == "C_DIS"
                          : out.blend == "C_DIS" || out.blend == "C_VEL" || out.blend == "C_ORI";
    if (!fits || !cursor.done())
      return fault("NC321", "only one approximation word (C_DIS ...) may follow a target", cursor);
    return true;
  }

  bool read_aggregate(Cursor& cursor, Aggregate& out) {
    if (!cursor.take('{')) return fault("NC322", "a { is missing", cursor);
    do {
      std::string key = cursor.word();
      if (family_of(key) == KeyFamily::none)
        return fault("NC322", "a key such as X, A or A1 is missing", cursor);
      if (out.find(key)) return fault("NC322", "key " + key + " stands twice", cursor);
      const auto value = cursor.number();
      if (!value) return fault("NC322", "key " + key + " has no decimal number", cursor);
      out.values.emplace_back(std::move(key), *value);
    } while (cursor.take(','));
    return cursor.take('}') || fault("NC322", "a } or , is missing", cursor);
  }

  bool read_trigger(Cursor& cursor, Statement& out) {
    out.kind = Statement::Kind::trigger;
    if (!cursor.keyword("WHEN")) return fault("NC321", "TRIGGER needs WHEN", cursor);
    if (!read_place(cursor, out)) return false;
    if (!cursor.keyword("DELAY") || !cursor.take('='))
      return fault("NC321", "TRIGGER needs DELAY=", cursor);
    out.number = cursor.number();
    if (!out.number) return fault("NC321", "DELAY has no number", cursor);
    if (!cursor.keyword("DO")) return fault("NC321", "TRIGGER needs DO", cursor);
    out.body = std::string(cursor.rest());
    Cursor body(out.body);
    const std::string name = body.word();
    Statement inner;
    static constexpr std::array<std::string_view, 8> kNotInDo = {
        "PTP", "LIN", "SPL", "SPLINE", "ENDSPLINE", "TRIGGER", "WAIT", "HALT"};
    if (name.empty() || std::find(kNotInDo.begin(), kNotInDo.end(), name) != kNotInDo.end())
      return fault("NC321", "DO needs an assignment or a call", cursor);
    return read_assignment_or_call(body, name, inner);
  }

  bool read_place(Cursor& cursor, Statement& out) {
    out.by_path = cursor.keyword("PATH");
    if (!out.by_path && !cursor.keyword("DISTANCE"))
      return fault("NC321", "TRIGGER needs WHEN DISTANCE= or WHEN PATH=", cursor);
    if (!cursor.take('=')) return fault("NC321", "a = is missing", cursor);
    const auto number = cursor.number();
    if (out.by_path) {
      if (!number) return fault("NC321", "PATH has no number", cursor);
      out.path = *number;
      out.distance = cursor.keyword("ONSTART") ? 0 : 1;
      return true;
    }
    if (number != 0.0 && number != 1.0)
      return fault("NC321", "DISTANCE is 0 (start) or 1 (end)", cursor);
    out.distance = *number == 0.0 ? 0 : 1;
    return true;
  }

  bool read_wait(Cursor& cursor, Statement& out) {
    out.kind = Statement::Kind::wait_seconds;
    if (!cursor.keyword("SEC")) return fault("NC321", "only WAIT SEC is read here", cursor);
    out.number = cursor.number();
    if (!out.number || *out.number < 0.0 || !cursor.done())
      return fault("NC321", "WAIT SEC needs a number of seconds", cursor);
    return true;
  }

  bool read_declaration(Cursor& cursor, Statement& out) {
    out.kind = Statement::Kind::declaration;
    if (!cursor.keyword("REAL")) return fault("NC321", "only DECL REAL is read here", cursor);
    out.name = cursor.word();
    if (out.name.empty() || !cursor.done()) return fault("NC321", "DECL REAL needs a name", cursor);
    return true;
  }

  bool read_assignment_or_call(Cursor& cursor, std::string name, Statement& out) {
    while (cursor.peek() == '.' || cursor.peek() == '[') {
      if (cursor.take('.')) {
        const std::string member = cursor.word();
        if (member.empty()) return fault("NC321", "a component's name is missing", cursor);
        name += "." + member;
      } else {
        cursor.take('[');
        const auto index = cursor.number();
        if (!index || *index < 1.0 || *index != static_cast<int>(std::min(*index, 1e6)) ||
            !cursor.take(']'))
          return fault("NC321", "an index has to be a whole number from 1 in [ ]", cursor);
        name += "[" + std::to_string(static_cast<int>(*index)) + "]";
      }
    }
    out.name = std::move(name);
    if (cursor.take('=')) return read_value(cursor, out);
    if (cursor.take('(')) return read_call(cursor, out);
    return fault("NC321", "neither an assignment nor a call", cursor);
  }

  bool read_value(Cursor& cursor, Statement& out) {
    out.kind = Statement::Kind::assignment;
    out.value = std::string(cursor.rest());
    if (out.value.empty()) return fault("NC321", "an assignment has no right side", cursor);
    if (cursor.peek() == '{') {
      if (!read_aggregate(cursor, out.aggregate)) return false;
      return cursor.done() || fault("NC322", "text stands behind }", cursor);
    }
    const auto before = cursor.at();
    out.number = cursor.number();
    if (out.number && cursor.done()) return true;
    out.number.reset();
    cursor.back(before);
    return is_balanced(out.value) || fault("NC321", "parentheses do not match", cursor);
  }

  bool read_call(Cursor& cursor, Statement& out) {
    out.kind = Statement::Kind::call;
    const std::string_view rest = cursor.rest();
    const auto close = rest.rfind(')');
    if (close == std::string_view::npos || !is_balanced("(" + std::string(rest)))
      return fault("NC321", "parentheses do not match", cursor);
    out.value = std::string(trimmed(rest.substr(0, close)));
    Cursor behind(trimmed(rest.substr(close + 1)));
    if (behind.done()) return true;
    if (behind.keyword("PRIO") && behind.take('=') && behind.number() && behind.done()) return true;
    return fault("NC321", "text stands behind the call", cursor);
  }

  static bool is_balanced(std::string_view text) {
    int depth = 0;
    bool quoted = false;
    for (const char c : text) {
      if (c == '"') quoted = !quoted;
      if (quoted) continue;
      if (c == '(' || c == '[') ++depth;
      if ((c == ')' || c == ']') && --depth < 0) return false;
    }
    return depth == 0;
  }

  std::string_view text_;
  const std::string& file_;
  State state_ = State::head;
  std::uint32_t line_ = 0;
  std::size_t column_ = 0;
  bool in_spline_ = false;
  std::size_t spline_points_ = 0;
  ParsedKrl out_;
};

}  // namespace

std::optional<double> Aggregate::find(std::string_view key) const {
  for (const auto& [k, v] : values)
    if (k == key) return v;
  return std::nullopt;
}

ParsedKrl parse(std::string_view text, const std::string& file_name) {
  return Reader(text, file_name).run();
}

}  // namespace smoothpost::krl
