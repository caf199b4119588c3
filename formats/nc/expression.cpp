#include "formats/nc/expression.h"

#include <array>
#include <cmath>
#include <optional>

#include "formats/nc/number.h"
#include "formats/nc/number_text.h"
#include "kernels/core/units.h"

namespace smoothpost::nc {
namespace {

constexpr double kEqual = 1e-4;    // TOLERANCE_EQUAL of LinuxCNC 2.9
constexpr double kWhole = 1e-4;    // how far an index may be from a whole number
constexpr int kDeepest = 100;      // nested brackets and parameters
constexpr int kParameters = 5602;  // first number that is none

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; }
bool is_letter(char c) { return lower(c) >= 'a' && lower(c) <= 'z'; }

enum class Operator {
  close,
  power,
  times,
  divide,
  modulo,
  plus,
  minus,
  eq,
  ne,
  gt,
  ge,
  lt,
  le,
  logical_and,
  logical_or,
  logical_xor
};

int precedence(Operator op, ExpressionRules rules) {
  if (rules == ExpressionRules::fanuc) {
    if (op == Operator::logical_and) return 5;
    if (op == Operator::logical_or || op == Operator::logical_xor) return 4;
  }
  switch (op) {
    case Operator::close:
      return 1;
    case Operator::logical_and:
    case Operator::logical_or:
    case Operator::logical_xor:
      return 2;
    case Operator::eq:
    case Operator::ne:
    case Operator::gt:
    case Operator::ge:
    case Operator::lt:
    case Operator::le:
      return 3;
    case Operator::plus:
    case Operator::minus:
      return 4;
    case Operator::times:
    case Operator::divide:
    case Operator::modulo:
      return 5;
    case Operator::power:
      return 6;
  }
  return 1;
}

constexpr std::array<std::string_view, 14> kFunctions = {"abs", "acos", "asin", "atan",  "cos",
                                                         "exp", "fix",  "fup",  "ln",    "round",
                                                         "sin", "sqrt", "tan",  "exists"};
constexpr std::size_t kLongestFunction = 6;

/// A vacant variable counts as 0 in every computation.
double filled(double value) { return std::isnan(value) ? 0.0 : value; }

/// Recursive reader of one value. The first fault stops it.
class Reader {
 public:
  Reader(std::string_view text, const ParameterValues* values, ExpressionRules rules)
      : text_(text), values_(values), fanuc_(rules == ExpressionRules::fanuc), rules_(rules) {}

  Evaluated value() {
    out_.value = read_value();
    out_.length = at_;
    return std::move(out_);
  }

  EvaluatedAssignment assignment() {
    EvaluatedAssignment result;
    take();  // #
    if (peek() == '<' && !fanuc_) {
      result.name = read_name();
    } else {
      result.index = read_index();
      if (fanuc_ && values_ != nullptr && result.index == 0) fail("#0 cannot be assigned");
    }
    if (out_.ok() && peek() != '=') fail("= and a value are missing behind the parameter");
    if (out_.ok()) {
      take();
      out_.value = fanuc_ ? read_chain(at_, false) : read_value();
    }
    out_.length = at_;
    result.value = std::move(out_);
    return result;
  }

 private:
  /// The next character that is no blank, in lower case; 0 at the end.
  char peek() {
    while (at_ < text_.size() && detail::is_blank(text_[at_])) ++at_;
    return at_ < text_.size() ? lower(text_[at_]) : '\0';
  }
  char take() {
    const char c = peek();
    if (c != '\0') ++at_;
    return c;
  }
  bool take_if(char c) {
    if (peek() != c) return false;
    ++at_;
    return true;
  }

  double fail(std::string problem) { return fail_at(std::move(problem), at_); }
  double fail_at(std::string problem, std::size_t at) {
    if (out_.ok()) {
      out_.problem = std::move(problem);
      out_.at = at;
    }
    return 0.0;
  }

  double finite(double value, std::size_t begin) {
    if (!out_.ok() || values_ == nullptr || std::isfinite(value)) return value;
    if (fanuc_ && std::isnan(value)) return value;  // vacant
    return fail_at("the result is not a finite number", begin);
  }

  double read_value() {
    if (depth_ >= kDeepest) return fail("an expression nests deeper than 100 levels");
    ++depth_;
    const char c = peek();
    const std::size_t begin = at_;
    double value = 0.0;
    if (c == '[') {
      value = read_expression();
    } else if (c == '#') {
      value = read_parameter();
    } else if (is_letter(c)) {
      value = read_function();
    } else if ((c == '+' || c == '-') && signs_more()) {
      take();
      value = read_value();
      if (c == '-') value = fanuc_ ? -filled(value) : -value;
    } else {
      value = read_number();
    }
    --depth_;
    return finite(value, begin);
  }

  /// A sign stands before something else than a number.
  bool signs_more() {
    std::size_t next = at_ + 1;
    while (next < text_.size() && detail::is_blank(text_[next])) ++next;
    return next < text_.size() && !detail::is_digit(text_[next]) && text_[next] != '.';
  }

  double read_number() {
    const char* begin = text_.data() + at_;
    const ScannedNumber number = scan_number(begin, text_.data() + text_.size());
    if (!number.ok) {
      return fail(peek() == '\0' ? "a value is missing at the end of the line"
                                 : joined({"\"", text_.substr(at_, 1), "\" begins no value"}));
    }
    at_ += static_cast<std::size_t>(number.next - begin);
    if (at_ < text_.size() && text_[at_] == '.') return fail("a number with two points");
    return number.value;
  }

  double read_expression() {
    const std::size_t open = at_;
    take();
    return read_chain(open, true);
  }

  /// Values and operators up to ], or as far as operators go.
  double read_chain(std::size_t open, bool bracketed) {
    std::array<double, 7> values{};
    std::array<Operator, 7> operators{};
    std::array<std::size_t, 7> places{};  // of the right operands
    std::size_t top = 0;
    values[0] = read_value();
    operators[0] = next_operator(open, bracketed);
    while (out_.ok() && operators[0] != Operator::close) {
      ++top;
      peek();
      places[top] = at_;
      values[top] = read_value();
      operators[top] = next_operator(open, bracketed);
      while (out_.ok() && top > 0 &&
             precedence(operators[top], rules_) <= precedence(operators[top - 1], rules_)) {
        values[top - 1] = apply(operators[top - 1], values[top - 1], values[top], places[top]);
        operators[top - 1] = operators[top];
        --top;
      }
    }
    return values[0];
  }

  Operator next_operator(std::size_t open, bool bracketed) {
    if (bracketed || !out_.ok()) return read_operator(open);
    const char c = peek();
    if (c == '+' || c == '-' || c == '*' || c == '/') return read_operator(open);
    const std::size_t begin = at_;
    if (is_letter(c)) {
      take();
      const Operator named = find_operator_name(c);
      if (named != Operator::close) return named;
    }
    at_ = begin;
    return Operator::close;
  }

  Operator read_operator(std::size_t open) {
    if (!out_.ok()) return Operator::close;
    peek();
    const std::size_t begin = at_;
    switch (const char c = take(); c) {
      case ']':
        return Operator::close;
      case '+':
        return Operator::plus;
      case '-':
        return Operator::minus;
      case '/':
        return Operator::divide;
      case '*':
        return !fanuc_ && take_if('*') ? Operator::power : Operator::times;
      case '\0':
        fail_at("the bracket is not closed", open);
        return Operator::close;
      default:
        return read_operator_name(c, begin);
    }
  }

  Operator read_operator_name(char first, std::size_t begin) {
    const Operator found = find_operator_name(first);
    if (found == Operator::close) fail_at("an operator or ] is missing", begin);
    return found;
  }

  /// The operator whose name begins with `first`, which is taken; close: there is none.
  Operator find_operator_name(char first) {
    struct Name {
      std::string_view text;
      Operator op;
    };
    static constexpr std::array<Name, 10> kNames = {{{"and", Operator::logical_and},
                                                     {"eq", Operator::eq},
                                                     {"ge", Operator::ge},
                                                     {"gt", Operator::gt},
                                                     {"le", Operator::le},
                                                     {"lt", Operator::lt},
                                                     {"mod", Operator::modulo},
                                                     {"ne", Operator::ne},
                                                     {"or", Operator::logical_or},
                                                     {"xor", Operator::logical_xor}}};
    std::string word(1, first);
    while (word.size() < 3 && is_letter(peek())) {
      for (const Name& name : kNames) {
        if (name.text == word) return name.op;
      }
      word.push_back(take());
    }
    for (const Name& name : kNames) {
      if (name.text == word) return name.op;
    }
    return Operator::close;
  }

  double apply(Operator op, double left, double right, std::size_t place) {
    if (values_ == nullptr) return 0.0;
    if (fanuc_) {
      if (op == Operator::eq || op == Operator::ne) {
        const bool vacant = std::isnan(left) || std::isnan(right);
        const bool same = vacant ? std::isnan(left) && std::isnan(right) : left == right;
        return same == (op == Operator::eq) ? 1.0 : 0.0;
      }
      left = filled(left);
      right = filled(right);
      if (op == Operator::logical_and || op == Operator::logical_or ||
          op == Operator::logical_xor) {
        const auto is_bit = [](double x) { return x == 0.0 || x == 1.0; };
        if (!is_bit(left) || !is_bit(right)) {
          return fail_at("AND, OR and XOR are read between conditions (0 and 1) only", place);
        }
      }
      if (op == Operator::modulo) return std::fmod(left, right);
    }
    switch (op) {
      case Operator::power:
        if (left < 0.0 && std::floor(right) != right) {
          return fail_at("a negative number to a power that is no whole number", place);
        }
        return std::pow(left, right);
      case Operator::times:
        return left * right;
      case Operator::divide:
        if (right == 0.0) return fail_at("a division by zero", place);
        return left / right;
      case Operator::modulo: {
        const double rest = std::fmod(left, right);
        return rest < 0.0 ? rest + std::abs(right) : rest;
      }
      case Operator::plus:
        return left + right;
      case Operator::minus:
        return left - right;
      case Operator::eq:
        return std::abs(left - right) < kEqual ? 1.0 : 0.0;
      case Operator::ne:
        return std::abs(left - right) >= kEqual ? 1.0 : 0.0;
      case Operator::gt:
        return left > right ? 1.0 : 0.0;
      case Operator::ge:
        return left >= right ? 1.0 : 0.0;
      case Operator::lt:
        return left < right ? 1.0 : 0.0;
      case Operator::le:
        return left <= right ? 1.0 : 0.0;
      case Operator::logical_and:
        return left != 0.0 && right != 0.0 ? 1.0 : 0.0;
      case Operator::logical_or:
        return left != 0.0 || right != 0.0 ? 1.0 : 0.0;
      case Operator::logical_xor:
        return (left != 0.0) != (right != 0.0) ? 1.0 : 0.0;
      case Operator::close:
        break;
    }
    return left;
  }

  double read_function() {
    const std::size_t begin = at_;
    std::string name;
    while (is_letter(peek()) && name.size() <= kLongestFunction) name.push_back(take());
    bool known = false;
    for (const std::string_view function : kFunctions) known = known || function == name;
    if (fanuc_ && name == "exists") known = false;
    if (!known) return fail_at("\"" + name + "\" is no function", begin);
    if (peek() != '[') return fail(name + " needs its argument in brackets");
    if (name == "exists") return read_exists();
    const double argument = read_expression();
    if (name == "atan") {
      if (!take_if('/')) return fail("atan needs two arguments: ATAN[y]/[x]");
      if (peek() != '[') return fail("atan needs its second argument in brackets");
      const double second = read_expression();
      return degrees_from_radians(fanuc_ ? std::atan2(filled(argument), filled(second))
                                         : std::atan2(argument, second));
    }
    if (!out_.ok() || values_ == nullptr) return 0.0;
    return call(name, fanuc_ ? filled(argument) : argument, begin);
  }

  double call(std::string_view name, double x, std::size_t begin) {
    if (name == "abs") return std::abs(x);
    if (name == "cos") return std::cos(radians_from_degrees(x));
    if (name == "sin") return std::sin(radians_from_degrees(x));
    if (name == "tan") return std::tan(radians_from_degrees(x));
    if (name == "exp") return std::exp(x);
    if (name == "fix") return fanuc_ ? std::trunc(x) : std::floor(x);
    if (name == "fup") return fanuc_ && x < 0.0 ? std::floor(x) : std::ceil(x);
    if (name == "round") return std::trunc(x + (x < 0.0 ? -0.5 : 0.5));
    if (name == "ln") {
      return x > 0.0 ? std::log(x) : fail_at("LN of a number that is not above 0", begin);
    }
    if (name == "sqrt") {
      return x >= 0.0 ? std::sqrt(x) : fail_at("SQRT of a negative number", begin);
    }
    if (x < -1.0 || x > 1.0) {
      return fail_at("the arc function of a number outside of -1 to 1", begin);
    }
    return degrees_from_radians(name == "acos" ? std::acos(x) : std::asin(x));
  }

  double read_exists() {
    take();  // [
    if (!take_if('#')) return fail("EXISTS needs a parameter in its brackets");
    bool exists = false;
    if (peek() == '<') {
      const std::string name = read_name();
      exists = values_ != nullptr && out_.ok() && values_->named(name).problem.empty();
    } else {
      const std::size_t begin = at_;
      const double index = read_value();
      if (std::abs(index - std::round(index)) > kWhole) return fail_at(kNotWhole, begin);
      exists = index > 0.5 && index < kParameters - 0.5;
    }
    if (out_.ok() && !take_if(']')) return fail("the bracket of EXISTS is not closed");
    return exists ? 1.0 : 0.0;
  }

  int read_index() {
    const std::size_t begin = at_;
    const double index = read_value();
    if (!out_.ok() || values_ == nullptr) return 0;
    if (std::abs(index - std::round(index)) > kWhole) {
      fail_at(kNotWhole, begin);
      return 0;
    }
    if (fanuc_ && std::abs(index) < 0.5) return 0;
    const int last = fanuc_ ? 99999 : kParameters - 1;
    if (!(index > 0.5 && index < last + 0.5)) {
      fail_at("there is no parameter #" + shortest_text(std::round(index)) + "; they go to #" +
                  std::to_string(last),
              begin);
      return 0;
    }
    return static_cast<int>(std::lround(index));
  }

  std::string read_name() {
    const std::size_t begin = at_;
    take();  // <
    std::string name;
    for (char c = take(); c != '>'; c = take()) {
      if (c == '\0') {
        fail_at("the name of the parameter has no >", begin);
        return {};
      }
      name.push_back(c);
    }
    return name;
  }

  double read_parameter() {
    const std::size_t begin = at_;
    take();  // #
    const bool named = peek() == '<';
    if (named && fanuc_) return fail("a named parameter is one of LinuxCNC");
    const std::string name = named ? read_name() : std::string();
    const int index = named ? 0 : read_index();
    if (!out_.ok() || values_ == nullptr) return 0.0;
    ParameterValue found = named ? values_->named(name) : values_->numbered(index);
    if (!found.problem.empty()) return fail_at(std::move(found.problem), begin);
    return found.value;
  }

  static constexpr const char* kNotWhole = "the number of a parameter is no whole number";

  std::string_view text_;
  const ParameterValues* values_;
  bool fanuc_;
  ExpressionRules rules_;
  std::size_t at_ = 0;
  int depth_ = 0;
  Evaluated out_;
};

}  // namespace

Evaluated evaluate_value(std::string_view text, const ParameterValues* values,
                         ExpressionRules rules) {
  return Reader(text, values, rules).value();
}

EvaluatedAssignment evaluate_assignment(std::string_view text, const ParameterValues* values,
                                        ExpressionRules rules) {
  return Reader(text, values, rules).assignment();
}

bool begins_expression(std::string_view text) {
  std::size_t i = 0;
  const auto skip = [&](bool signs) {
    while (i < text.size() &&
           (detail::is_blank(text[i]) || (signs && (text[i] == '+' || text[i] == '-')))) {
      ++i;
    }
  };
  skip(true);
  if (i < text.size() && (text[i] == '[' || text[i] == '#')) return true;
  std::string name;
  while (i < text.size() && is_letter(text[i]) && name.size() <= kLongestFunction) {
    name.push_back(lower(text[i++]));
    skip(false);
  }
  if (i >= text.size() || text[i] != '[') return false;
  for (const std::string_view function : kFunctions) {
    if (function == name) return true;
  }
  return false;
}

}  // namespace smoothpost::nc
