#include "formats/heidenhain/variables.h"

#include <array>
#include <cmath>
#include <utility>

#include "kernels/core/units.h"

namespace smoothpost::conversational {
namespace {

constexpr long kLargestNumber = 1999;
constexpr int kDeepest = 64;

using Function = double (*)(double);

double sine(double x) { return std::sin(radians_from_degrees(x)); }
double cosine(double x) { return std::cos(radians_from_degrees(x)); }
double tangent(double x) { return std::tan(radians_from_degrees(x)); }
double arc_sine(double x) { return degrees_from_radians(std::asin(x)); }
double arc_cosine(double x) { return degrees_from_radians(std::acos(x)); }
double arc_tangent(double x) { return degrees_from_radians(std::atan(x)); }
double root(double x) { return std::sqrt(x); }
double square(double x) { return x * x; }
double magnitude(double x) { return std::abs(x); }
double whole_part(double x) { return std::trunc(x); }
double fraction(double x) { return x - std::trunc(x); }
double negated(double x) { return -x; }
double sign_of(double x) { return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : 0.0; }
double natural_log(double x) { return std::log(x); }
double decimal_log(double x) { return std::log10(x); }
double exponential(double x) { return std::exp(x); }

constexpr std::array<std::pair<std::string_view, Function>, 16> kFunctions = {{
    {"SIN", sine},
    {"COS", cosine},
    {"TAN", tangent},
    {"ASIN", arc_sine},
    {"ACOS", arc_cosine},
    {"ATAN", arc_tangent},
    {"SQRT", root},
    {"SQ", square},
    {"ABS", magnitude},
    {"INT", whole_part},
    {"FRAC", fraction},
    {"NEG", negated},
    {"SGN", sign_of},
    {"LN", natural_log},
    {"LOG", decimal_log},
    {"EXP", exponential},
}};

double angle_of(double opposite, double adjacent) {
  const double angle = degrees_from_radians(std::atan2(opposite, adjacent));
  return angle < 0.0 ? angle + 360.0 : angle;
}

/// Recursive descent over one formula.
class Formula {
 public:
  Formula(Scanner& scanner, const Variables& variables)
      : scanner_(scanner), variables_(variables) {}

  Value run() {
    out_.value = sum();
    if (out_.ok() && !std::isfinite(out_.value))
      fail(
          "the result is not a number (a division by 0, or a root, logarithm or arc function "
          "outside of its range)");
    return std::move(out_);
  }

 private:
  double fail(std::string problem) {
    if (out_.ok()) {
      out_.problem = std::move(problem);
      out_.offset = scanner_.offset();
    }
    return 0.0;
  }

  double sum() {
    double value = product();
    while (out_.ok()) {
      if (scanner_.take_byte('+')) {
        value += product();
      } else if (scanner_.take_byte('-')) {
        value -= product();
      } else if (scanner_.take("LEN")) {
        value = std::hypot(value, product());
      } else if (scanner_.take("ANG")) {
        value = angle_of(value, product());
      } else {
        break;
      }
    }
    return value;
  }

  double product() {
    double value = power();
    while (out_.ok()) {
      if (scanner_.take_byte('*')) {
        value *= power();
      } else if (scanner_.take_byte('/') || scanner_.take("DIV")) {
        value /= power();
      } else {
        break;
      }
    }
    return value;
  }

  double power() {
    double value = unary();
    while (out_.ok() && scanner_.take_byte('^')) value = std::pow(value, unary());
    return value;
  }

  double unary() {
    if (++depth_ > kDeepest) return fail("a formula of more than 64 levels");
    const double value = signed_value();
    --depth_;
    return value;
  }

  double signed_value() {
    if (scanner_.take_byte('+')) return unary();
    if (scanner_.take_byte('-')) return -unary();
    for (const auto& [name, function] : kFunctions)
      if (scanner_.take(name)) return function(unary());
    if (scanner_.take("PI")) return kPi;
    if (scanner_.take_byte('(')) {
      const double value = sum();
      if (out_.ok() && !scanner_.take_byte(')')) return fail("a ) is missing");
      return value;
    }
    const Value value = variables_.factor(scanner_);
    if (!value.ok() && out_.ok()) {
      out_.problem = value.problem;
      out_.offset = value.offset;
    }
    return value.value;
  }

  Scanner& scanner_;
  const Variables& variables_;
  Value out_;
  int depth_ = 0;
};

}  // namespace

std::string VariableName::text() const {
  return "Q" + (kind == 0 ? std::string() : std::string(1, kind)) + std::to_string(number);
}

std::optional<VariableName> Variables::take_name(Scanner& scanner) {
  if (scanner.peek() != 'Q') return {};
  const char second = scanner.peek(1);
  const bool kind = second == 'L' || second == 'R';
  const char digit = kind ? scanner.peek(2) : second;
  if (digit < '0' || digit > '9') return {};
  Scanner ahead = scanner;
  ahead.take_byte('Q');
  VariableName name;
  if (kind) {
    name.kind = second;
    ahead.take_byte(second);
  }
  const auto number = ahead.whole();
  if (!number || *number > kLargestNumber) return {};
  name.number = *number;
  scanner = ahead;
  return name;
}

std::uint32_t Variables::key(const VariableName& name) {
  return static_cast<std::uint32_t>(name.number) | static_cast<std::uint32_t>(name.kind) << 16;
}

std::optional<double> Variables::find(const VariableName& name) const {
  const auto found = values_.find(key(name));
  if (found == values_.end()) return {};
  return found->second;
}

Value Variables::factor(Scanner& scanner) const {
  Value out;
  const bool minus = scanner.take_byte('-');
  if (!minus) scanner.take_byte('+');
  out.offset = scanner.offset();
  if (const auto number = scanner.number()) {
    out.value = minus && *number != 0.0 ? -*number : *number;
    return out;
  }
  const auto name = take_name(scanner);
  if (!name) {
    out.problem = scanner.at_end()
                      ? "a value is missing"
                      : "`" + scanner.token() + "` is neither a number nor a Q parameter";
    return out;
  }
  const auto value = find(*name);
  if (!value) {
    out.problem = name->text() + " has no value here: the program does not set it before";
    return out;
  }
  out.value = minus ? -*value : *value;
  return out;
}

Value Variables::formula(Scanner& scanner) const { return Formula(scanner, *this).run(); }

}  // namespace smoothpost::conversational
