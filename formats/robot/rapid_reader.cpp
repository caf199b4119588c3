#include "formats/robot/rapid_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

#include "formats/robot/rapid_tokens.h"

namespace smoothpost::rapid {

namespace {

constexpr double kUnitLength = 1e-4;
constexpr int kMostNesting = 8;
using Kind = Value::Kind;

// How the values of a data type are nested: n number, b boolean, s text, p three, c four, x six
// numbers in [ ], q four numbers that are a unit quaternion.
struct Shape {
  const char* type;
  const char* shape;
  const char* words;
};
constexpr std::array<Shape, 7> kShapes = {{
    {"TOOLDATA", "[b[pq][npqnnn]]", "[TRUE,[pos,orient],[mass,pos,orient,ix,iy,iz]]"},
    {"WOBJDATA", "[bbs[pq][pq]]", "[FALSE,TRUE,\"\",[pos,orient],[pos,orient]]"},
    {"LOADDATA", "[npqnnn]", "[mass,pos,orient,ix,iy,iz]"},
    {"SPEEDDATA", "[nnnn]", "four numbers"},
    {"ZONEDATA", "[bnnnnnn]", "a boolean and six numbers"},
    {"ROBTARGET", "[pqcx]", "[pos,orient,[cf1,cf4,cf6,cfx],[six axes]]"},
    {"JOINTTARGET", "[xx]", "[[six axes],[six axes]]"},
}};

const Shape* shape_of(std::string_view type) {
  for (const auto& row : kShapes)
    if (row.type == type) return &row;
  return nullptr;
}

bool is_numbers(const Value& value, std::size_t count) {
  return value.kind == Kind::aggregate && value.items.size() == count &&
         std::all_of(value.items.begin(), value.items.end(),
                     [](const Value& v) { return v.kind == Kind::number; });
}

bool is_unit(const Value& q) {
  double sum = 0.0;
  for (const auto& v : q.items) sum += v.number * v.number;
  return std::abs(std::sqrt(sum) - 1.0) < kUnitLength;
}

// The first place where `value` has not the shape that begins at `shape`, which moves behind it.
const Value* misfit(const Value& value, std::string_view& shape) {
  const char wanted = shape.front();
  shape.remove_prefix(1);
  switch (wanted) {
    case 'n':
      return value.kind == Kind::number ? nullptr : &value;
    case 'b':
      return value.kind == Kind::boolean ? nullptr : &value;
    case 's':
      return value.kind == Kind::text ? nullptr : &value;
    case 'p':
      return is_numbers(value, 3) ? nullptr : &value;
    case 'x':
      return is_numbers(value, 6) ? nullptr : &value;
    case 'c':
    case 'q':
      return is_numbers(value, 4) ? nullptr : &value;
    default:
      break;
  }
  if (value.kind != Kind::aggregate) return &value;
  for (const auto& item : value.items) {
    if (shape.front() == ']') return &item;
    if (const Value* fault = misfit(item, shape)) return fault;
  }
  if (shape.front() != ']') return &value;
  shape.remove_prefix(1);
  return nullptr;
}

// The first quaternion of a value of that shape that is not one. Its walk is misfit()'s.
const Value* not_unit(const Value& value, std::string_view& shape) {
  const char wanted = shape.front();
  shape.remove_prefix(1);
  if (wanted == 'q') return is_unit(value) ? nullptr : &value;
  if (wanted != '[') return nullptr;
  for (const auto& item : value.items)
    if (const Value* fault = not_unit(item, shape)) return fault;
  shape.remove_prefix(1);
  return nullptr;
}

/// Reads one module; a class because every function tells faults with their place.
class Reader {
 public:
  Reader(std::string_view text, const std::string& file) : tokens_(text), file_(file) {
    step();
    const auto ends = static_cast<std::uint32_t>(std::count(text.begin(), text.end(), '\n'));
    out_.program.line_count = ends + (text.empty() || text.back() == '\n' ? 0U : 1U);
  }

  ParsedRapid run() {
    read_module();
    return std::move(out_);
  }

 private:
  struct Place {
    std::uint32_t line;
    std::uint32_t column;
  };
  Place here() const { return {now_.line, now_.column}; }

  void step() {
    if (now_.blank_before && !text_.empty()) text_ += ' ';
    text_ += now_.source;
    now_ = tokens_.next();
  }

  bool take(std::string_view expected) {
    if (!now_.is(expected)) return false;
    step();
    return true;
  }

  bool error(const char* code, std::string text, const Place& at) {
    constexpr std::size_t kMostErrors = 100;
    if (out_.diagnostics.size() >= kMostErrors) return false;
    Diagnostic d;
    d.code = code;
    d.text = std::move(text);
    d.where = {file_, static_cast<int>(at.line), static_cast<int>(at.column)};
    out_.diagnostics.push_back(std::move(d));
    return false;
  }

  // A fault at the current token, which may be one that could not be read.
  bool fault(const char* code, const std::string& text) {
    return error(code, now_.kind == Token::Kind::bad ? now_.text : text, here());
  }

  std::string take_name() {
    if (now_.kind != Token::Kind::word) return "";
    std::string name = now_.text;
    step();
    return name;
  }

  void read_module() {
    if (!take("MODULE")) {
      fault("NC330", "the file has to begin with MODULE name");
      return;
    }
    out_.program.name = take_name();
    if (out_.program.name.empty()) fault("NC330", "MODULE has no name");
    while (now_.is("CONST") || now_.is("PERS") || now_.is("VAR")) {
      if (!read_declaration()) skip_statement();
    }
    while (now_.is("PROC")) read_procedure();
    out_.program.end_line = now_.line;
    if (!take("ENDMODULE")) {
      fault("NC330", out_.program.procedures.empty() ? "a declaration or PROC is missing here"
                                                     : "PROC or ENDMODULE is missing here");
      return;
    }
    if (now_.kind != Token::Kind::end) fault("NC330", "text stands behind ENDMODULE");
    if (out_.program.procedures.empty())
      error("NC330", "the module has no PROC", {out_.program.end_line, 1});
  }

  // Behind the next ; or in front of a word that ends or begins something larger.
  void skip_statement() {
    while (now_.kind != Token::Kind::end && !now_.is("ENDPROC") && !now_.is("ENDMODULE") &&
           !now_.is("PROC")) {
      if (take(";")) return;
      step();
    }
  }

  bool is_new(const std::string& name, const Place& at) {
    if (names_.insert(name).second) return true;
    return error("NC330", "the name " + name + " is taken", at);
  }

  bool read_declaration() {
    Declaration d;
    d.line = now_.line;
    d.column = now_.column;
    d.storage = take_name();
    d.type = take_name();
    if (shape_of(d.type) == nullptr && d.type != "TRIGGDATA")
      return error("NC331", "data type " + d.type + " is not read here", {d.line, d.column});
    const Place at = here();
    d.name = take_name();
    if (d.name.empty()) return fault("NC331", "a declaration has no name");
    if (!is_new(d.name, at)) return false;
    if (d.type == "TRIGGDATA") {
      if (now_.is(":=")) return fault("NC331", "triggdata is set by TriggIO, not by a value");
    } else {
      if (!take(":=")) return fault("NC331", "a declaration needs := and its value");
      d.value = read_value(0);
      if (!d.value || !check_shape(*d.value, d.type)) return false;
    }
    if (!take(";")) return fault("NC331", "a ; is missing");
    out_.program.declarations.push_back(std::move(d));
    return true;
  }

  bool check_shape(const Value& value, const std::string& type) {
    const Shape& row = *shape_of(type);
    std::string_view shape = row.shape;
    if (const Value* v = misfit(value, shape))
      return error("NC332", "a " + type + " is " + row.words, {v->line, v->column});
    shape = row.shape;
    if (const Value* v = not_unit(value, shape))
      return error("NC332", "a quaternion has to have the length 1", {v->line, v->column});
    return true;
  }

  std::optional<Value> read_value(int depth) {
    Value value;
    value.line = now_.line;
    value.column = now_.column;
    if (now_.kind == Token::Kind::number) {
      value.number = now_.number;
      step();
      return value;
    }
    if (now_.kind == Token::Kind::text) {
      value.kind = Kind::text;
      value.text = now_.text;
      step();
      return value;
    }
    if (now_.kind == Token::Kind::word) {
      value.text = take_name();
      value.kind = value.text == "TRUE" || value.text == "FALSE" ? Kind::boolean : Kind::name;
      value.number = value.text == "TRUE" ? 1.0 : 0.0;
      return value;
    }
    if (now_.is("[")) return read_aggregate(std::move(value), depth);
    fault("NC331", "a value is missing here");
    return std::nullopt;
  }

  std::optional<Value> read_aggregate(Value value, int depth) {
    value.kind = Kind::aggregate;
    if (depth == kMostNesting) {
      fault("NC332", "[ ] are nested too deep");
      return std::nullopt;
    }
    step();
    do {
      auto item = read_value(depth + 1);
      if (!item) return std::nullopt;
      value.items.push_back(std::move(*item));
    } while (take(","));
    if (take("]")) return value;
    fault("NC332", "a ] or , is missing");
    return std::nullopt;
  }

  void read_procedure() {
    Procedure procedure;
    procedure.line = now_.line;
    step();
    const Place at = here();
    procedure.name = take_name();
    if (procedure.name.empty() || !take("(") || !take(")"))
      fault("NC330", "PROC needs a name and ( )");
    else
      is_new(procedure.name, at);
    labels_.clear();
    while (now_.kind != Token::Kind::end && !now_.is("ENDPROC") && !now_.is("ENDMODULE") &&
           !now_.is("PROC")) {
      Statement statement;
      if (read_statement(statement))
        procedure.statements.push_back(std::move(statement));
      else
        skip_statement();
    }
    if (!take("ENDPROC")) fault("NC330", "ENDPROC is missing");
    out_.program.procedures.push_back(std::move(procedure));
  }

  bool read_statement(Statement& out) {
    if (!read_head(out)) return false;
    static constexpr std::array<std::string_view, 18> kOther = {
        "IF",   "FOR",    "WHILE", "TEST",    "GOTO",  "RETURN", "RAISE", "CONNECT", "EXIT",
        "ELSE", "ELSEIF", "CASE",  "DEFAULT", "ENDIF", "ENDFOR", "TRAP",  "FUNC",    "LOCAL"};
    const bool motion = out.name.rfind("MOVE", 0) == 0 || out.name.rfind("TRIGG", 0) == 0 ||
                        out.name.rfind("SEARCH", 0) == 0;
    if (motion && !is_ours(out.name))
      return error("NC331", out.name + " is not read here", {out.line, out.column});
    if (std::find(kOther.begin(), kOther.end(), out.name) != kOther.end())
      return error("NC331", out.name + " is not read here", {out.line, out.column});
    if (now_.is(":=")) return fault("NC331", "an assignment is not read here");
    if (!read_arguments(out)) return false;
    out.text = text_;
    step();
    return check(out);
  }

  // The name and the labels in front of it.
  bool read_head(Statement& out) {
    for (;;) {
      if (now_.kind != Token::Kind::word) return fault("NC331", "no statement begins like this");
      const Place at = here();
      out.line = at.line;
      out.column = at.column;
      out.name = now_.text;
      text_.clear();
      step();
      if (!now_.is(":")) return true;
      if (!out.label.empty()) return error("NC331", "two labels stand at one statement", at);
      if (!labels_.insert(out.name).second)
        return error("NC330", "label " + out.name + " stands twice", at);
      out.label = out.name;
      step();
    }
  }

  static bool is_ours(std::string_view name) {
    return name == "MOVEL" || name == "MOVEABSJ" || name == "TRIGGL" || name == "TRIGGIO" ||
           name == "TRIGGEQUIP";
  }

  bool read_arguments(Statement& out) {
    bool value_may_follow = true;
    while (!now_.is(";")) {
      Argument argument;
      if (take("\\")) {
        argument.option = take_name();
        if (argument.option.empty()) return fault("NC331", "\\ needs the name of an option");
        if (take(":=")) {
          argument.value = read_value(0);
          if (!argument.value) return false;
        }
        value_may_follow = false;
      } else {
        if (!value_may_follow && !take(",")) return fault("NC331", "a ; or , is missing");
        argument.value = read_value(0);
        if (!argument.value) return false;
        value_may_follow = false;
      }
      out.arguments.push_back(std::move(argument));
    }
    return true;
  }

  // ---- what each instruction needs

  bool wrong(const Statement& s, const std::string& text) {
    return error("NC331", text, {s.line, s.column});
  }

  bool check(Statement& s) {
    if (s.name == "MOVEL" || s.name == "MOVEABSJ" || s.name == "TRIGGL") return check_move(s);
    if (s.name == "TRIGGIO" || s.name == "TRIGGEQUIP") return check_trigger(s);
    if (s.name == "CONFL" || s.name == "CONFJ")
      return check_mode(s, {"ON", "OFF"}, "needs \\On or \\Off");
    if (s.name == "SINGAREA") return check_mode(s, {"WRIST", "OFF"}, "needs \\Wrist or \\Off");
    if (s.name == "WAITTIME") return check_wait(s);
    if (s.name != "STOP") return true;
    s.kind = Statement::Kind::stop;
    return s.arguments.empty() || wrong(s, "Stop has no arguments here");
  }

  // Options that `s` may have, in front of argument n (n = count: behind the last).
  bool options_fit(const Statement& s, const std::vector<std::pair<std::size_t, std::string>>& fit,
                   bool (*good)(const Argument&)) {
    std::size_t n = 0;
    std::set<std::string> seen;
    for (const auto& a : s.arguments) {
      if (a.option.empty()) {
        ++n;
        continue;
      }
      if (std::find(fit.begin(), fit.end(), std::pair(n, a.option)) == fit.end())
        return wrong(s, s.name + " has no option \\" + a.option + " in this place");
      if (!seen.insert(a.option).second) return wrong(s, "\\" + a.option + " stands twice");
      if (!good(a)) return wrong(s, "\\" + a.option + " has not the value that it needs");
    }
    return true;
  }

  static bool is_name_value(const Argument& a) { return a.value && a.value->kind == Kind::name; }

  static bool is_move_option(const Argument& a) {
    if (a.option == "NOEOFFS") return !a.value;
    if (a.option == "T") return a.value && a.value->kind == Kind::number && a.value->number > 0.0;
    return is_name_value(a);
  }

  bool check_data(const Statement& s, const Value& value, const char* type) {
    if (value.kind == Kind::name) return true;
    if (value.kind == Kind::aggregate && shape_of(type) != nullptr) return check_shape(value, type);
    return wrong(s, s.name + " needs a " + type + " here");
  }

  bool check_move(Statement& s) {
    s.kind = Statement::Kind::move;
    const bool trigger = s.name == "TRIGGL";
    const bool joints = s.name == "MOVEABSJ";
    std::vector<const char*> types = {joints ? "JOINTTARGET" : "ROBTARGET", "SPEEDDATA"};
    if (trigger) types.push_back("TRIGGDATA");
    types.push_back("ZONEDATA");
    types.push_back("tool's name");
    for (std::size_t i = 0; i < types.size(); ++i) {
      const Value* value = s.positional(i);
      if (value == nullptr) return wrong(s, s.name + " has too few arguments");
      if (!check_data(s, *value, types[i])) return false;
    }
    if (s.positional(types.size()) != nullptr) return wrong(s, s.name + " has too many arguments");
    std::vector<std::pair<std::size_t, std::string>> options = {{2, "T"}, {types.size(), "WOBJ"}};
    if (joints) options.emplace_back(1, "NOEOFFS");
    if (trigger)
      for (const char* name : {"T2", "T3", "T4", "T5", "T6", "T7", "T8"})
        options.emplace_back(3, name);
    return options_fit(s, options, &is_move_option);
  }

  static bool is_trigger_option(const Argument& a) {
    if (a.option == "START" || a.option == "TIME") return !a.value;
    return is_name_value(a);
  }

  bool check_trigger(Statement& s) {
    s.kind = Statement::Kind::trigger;
    const std::size_t count = s.name == "TRIGGIO" ? 3 : 4;
    for (std::size_t i = 0; i < count; ++i) {
      const Value* value = s.positional(i);
      if (value == nullptr) return wrong(s, s.name + " has too few arguments");
      if (value->kind != (i == 0 ? Kind::name : Kind::number))
        return wrong(s, s.name + " has the name of a triggdata, then numbers");
    }
    if (s.positional(count) != nullptr) return wrong(s, s.name + " has too many arguments");
    std::vector<std::pair<std::size_t, std::string>> options = {{2, "START"}};
    if (count == 3) options.emplace_back(2, "TIME");
    for (const char* name : {"DOP", "GOP", "AOP"}) options.emplace_back(count - 1, name);
    if (!options_fit(s, options, &is_trigger_option)) return false;
    if (s.has("START") && s.has("TIME")) return wrong(s, "\\Start and \\Time exclude each other");
    const int signals = int{s.has("DOP")} + int{s.has("GOP")} + int{s.has("AOP")};
    return signals == 1 || wrong(s, s.name + " needs one of \\DOp, \\GOp and \\AOp");
  }

  bool check_mode(Statement& s, const std::vector<std::string>& words, const char* needs) {
    s.kind = Statement::Kind::mode;
    const bool good = s.arguments.size() == 1 && !s.arguments[0].value &&
                      std::find(words.begin(), words.end(), s.arguments[0].option) != words.end();
    return good || wrong(s, s.name + " " + needs);
  }

  bool check_wait(Statement& s) {
    s.kind = Statement::Kind::wait;
    const Value* seconds = s.positional(0);
    const bool good = seconds != nullptr && s.positional(1) == nullptr &&
                      seconds->kind == Kind::number && seconds->number >= 0.0;
    if (!good) return wrong(s, "WaitTime needs a number of seconds");
    return options_fit(s, {{0, "INPOS"}}, [](const Argument& a) { return !a.value; });
  }

  Tokens tokens_;
  const std::string& file_;
  Token now_;
  std::string text_;  // of the statement, up to the token before now_
  std::set<std::string> names_;
  std::set<std::string> labels_;  // of the procedure
  ParsedRapid out_;
};

}  // namespace

bool Statement::has(std::string_view option) const {
  return std::any_of(arguments.begin(), arguments.end(),
                     [option](const Argument& a) { return a.option == option; });
}

const Value* Statement::find(std::string_view option) const {
  for (const auto& a : arguments)
    if (a.option == option && a.value) return &*a.value;
  return nullptr;
}

const Value* Statement::positional(std::size_t n) const {
  for (const auto& a : arguments)
    if (a.option.empty() && n-- == 0) return &*a.value;
  return nullptr;
}

ParsedRapid parse(std::string_view text, const std::string& file_name) {
  return Reader(text, file_name).run();
}

}  // namespace smoothpost::rapid
