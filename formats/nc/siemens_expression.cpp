#include "formats/nc/siemens_expression.h"

#include <cmath>

#include "formats/nc/number.h"
#include "formats/nc/number_text.h"
#include "formats/nc/siemens_words.h"
#include "kernels/core/units.h"

namespace smoothpost::nc {
namespace {

constexpr int kDeepest = 100;

bool begins_name(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == '$';
}
bool in_name(char c) { return begins_name(c) || detail::is_digit(c); }

class Reader {
 public:
  Reader(std::string_view text, const SiemensVariables* values, bool condition)
      : text_(text), values_(values), condition_(condition) {}

  SiemensIndices indices() {
    SiemensIndices out;
    out.values = read_indices();
    out_.length = at_;
    out.end = std::move(out_);
    return out;
  }

  Evaluated value() {
    out_.value = whole();
    out_.length = end_;
    if (out_.ok() && values_ != nullptr && !std::isfinite(out_.value)) {
      fail("the result is not a finite number", 0);
    }
    return std::move(out_);
  }

 private:
  std::vector<double> read_indices() {
    std::vector<double> out;
    const std::size_t open = at_++;
    while (out_.ok()) {
      out.push_back(sum());
      const char c = peek();
      if (c == ',' && out.size() < 3) {
        ++at_;
      } else if (c == ']') {
        ++at_;
        break;
      } else {
        fail("the bracket is not closed, or has more than three indices", open);
      }
    }
    return out;
  }

  char peek() {
    while (at_ < text_.size() && detail::is_blank(text_[at_])) ++at_;
    return at_ < text_.size() ? text_[at_] : '\0';
  }

  double fail(std::string problem, std::size_t at) {
    if (out_.ok()) {
      out_.problem = std::move(problem);
      out_.at = at;
    }
    return 0.0;
  }

  std::string name() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && in_name(text_[at_])) ++at_;
    return upper_text(text_.substr(begin, at_ - begin));
  }

  double whole() { return condition_ ? comparison() : sum(); }

  double comparison() {
    double left = logic(0);
    while (out_.ok()) {
      const char c = peek();
      const char next = at_ + 1 < text_.size() ? text_[at_ + 1] : '\0';
      const bool two = (c == '=' && next == '=') || (c == '<' && (next == '=' || next == '>')) ||
                       (c == '>' && next == '=');
      if (!two && c != '<' && c != '>') break;
      at_ += two ? 2 : 1;
      const double right = logic(0);
      const bool less = left < right;
      const bool equal = left == right;
      left = c == '='                  ? equal
             : c == '<' && next == '>' ? !equal
             : c == '<'                ? less || (two && equal)
                                       : (!less && !equal) || (two && equal);
    }
    return left;
  }

  /// 0: OR, 1: XOR, 2: AND, then sums.
  double logic(int level) {
    constexpr std::string_view kNames[] = {"OR", "XOR", "AND"};
    if (level == 3) return sum();
    double left = logic(level + 1);
    while (out_.ok()) {
      const char c = peek();
      const std::size_t begin = at_;
      if (!begins_name(c) || name() != kNames[level]) {
        at_ = begin;
        break;
      }
      const bool a = left != 0.0;
      const bool b = logic(level + 1) != 0.0;
      left = level == 0 ? a || b : level == 1 ? a != b : a && b;
    }
    return left;
  }

  double sum() {
    double left = product();
    while (out_.ok()) {
      const char c = peek();
      if (c != '+' && c != '-') break;
      ++at_;
      const double right = product();
      left = c == '+' ? left + right : left - right;
    }
    return left;
  }

  double product() {
    double left = operand();
    while (out_.ok()) {
      const char c = peek();
      const std::size_t begin = at_;
      bool whole = false, rest = false;
      if (c == '*' || c == '/') {
        ++at_;
      } else if (begins_name(c)) {
        const std::string word = name();
        whole = word == "DIV";
        rest = word == "MOD";
        if (!whole && !rest) {
          at_ = begin;
          break;
        }
      } else {
        break;
      }
      const double right = operand();
      if (!out_.ok() || values_ == nullptr) continue;
      if (c != '*' && right == 0.0) return fail("a division by zero", begin);
      left = rest       ? std::fmod(left, right)
             : whole    ? std::trunc(left / right)
             : c == '*' ? left * right
                        : left / right;
    }
    return left;
  }

  double operand() {
    if (++depth_ > kDeepest) return fail("an expression nests deeper than 100 levels", at_);
    const char c = peek();
    const std::size_t begin = at_;
    double value = 0.0;
    if (c == '(') {
      ++at_;
      value = whole();
      close(begin);
    } else if (c == '+' || c == '-') {
      ++at_;
      value = c == '-' ? -operand() : operand();
    } else if (begins_name(c)) {
      value = name_or_call(begin);
    } else {
      value = number();
    }
    --depth_;
    if (out_.ok()) end_ = at_;
    return value;
  }

  void close(std::size_t open) {
    if (!out_.ok()) return;
    if (peek() != ')') {
      fail("the parenthesis is not closed", open);
      return;
    }
    ++at_;
  }

  double number() {
    std::size_t end = at_;
    while (end < text_.size() && (detail::is_digit(text_[end]) || text_[end] == '.')) ++end;
    const char* begin = text_.data() + at_;
    const ScannedNumber scanned = scan_number(begin, text_.data() + end);
    if (!scanned.ok || scanned.next != text_.data() + end) {
      return fail(end == at_ ? "a value is missing" : "a number with two points", at_);
    }
    at_ = end;
    const std::string_view rest = text_.substr(end);
    if (rest.size() < 2 || upper_text(rest.substr(0, 2)) != "EX") return scanned.value;
    const char* exponent = rest.data() + 2;
    const ScannedNumber power = scan_number(exponent, text_.data() + text_.size());
    if (!power.ok || std::abs(power.value) > 300.0 || power.value != std::trunc(power.value)) {
      return fail("EX needs a whole number", end);
    }
    at_ = static_cast<std::size_t>(power.next - text_.data());
    return scanned.value * std::pow(10.0, power.value);
  }

  double name_or_call(std::size_t begin) {
    const std::string word = name();
    if (condition_ && word == "NOT") return operand() == 0.0 ? 1.0 : 0.0;
    if (word == "TRUE" || word == "FALSE") return word == "TRUE" ? 1.0 : 0.0;
    if (word == "$PI") return kPi;
    if (at_ < text_.size() && text_[at_] == '(') return call(word, begin);
    std::vector<double> indices;
    if (at_ < text_.size() && text_[at_] == '[') {
      if (word[0] == '$') return fail(word + " is a system variable, which is not read", begin);
      indices = read_indices();
    }
    if (values_ == nullptr || !out_.ok()) return 0.0;
    ParameterValue found = values_->value(word, indices);
    if (!found.problem.empty()) return fail(std::move(found.problem), begin);
    return found.value;
  }

  double call(const std::string& word, std::size_t begin) {
    ++at_;  // (
    const double x = sum();
    double y = 0.0;
    if (word == "ATAN2" && out_.ok()) {
      if (peek() != ',') return fail("ATAN2 needs two arguments", begin);
      ++at_;
      y = sum();
    }
    close(begin);
    if (!out_.ok()) return 0.0;
    if (word == "SIN") return std::sin(radians_from_degrees(x));
    if (word == "COS") return std::cos(radians_from_degrees(x));
    if (word == "TAN") return std::tan(radians_from_degrees(x));
    if (word == "ATAN2") return degrees_from_radians(std::atan2(x, y));
    if (word == "ABS") return std::abs(x);
    if (word == "POT") return x * x;
    if (word == "TRUNC") return std::trunc(x);
    if (word == "ROUND") return std::floor(x + 0.5);
    if (word == "EXP") return std::exp(x);
    return domain_call(word, x, begin);
  }

  double domain_call(const std::string& word, double x, std::size_t begin) {
    const bool check = values_ != nullptr;
    if (word == "SQRT") {
      return check && x < 0.0 ? fail("SQRT of a negative number", begin) : std::sqrt(std::abs(x));
    }
    if (word == "LN") {
      if (check && !(x > 0.0)) return fail("LN of a number that is not above 0", begin);
      return check ? std::log(x) : 0.0;
    }
    if (word == "ASIN" || word == "ACOS") {
      if (check && std::abs(x) > 1.0) {
        return fail("the arc function of a number outside of -1 to 1", begin);
      }
      return check ? degrees_from_radians(word == "ASIN" ? std::asin(x) : std::acos(x)) : 0.0;
    }
    return fail("\"" + word + "\" is no function that is read", begin);
  }

  std::string_view text_;
  const SiemensVariables* values_;
  bool condition_;
  std::size_t at_ = 0;
  std::size_t end_ = 0;  ///< behind the last operand
  int depth_ = 0;
  Evaluated out_;
};

}  // namespace

Evaluated evaluate_siemens(std::string_view text, const SiemensVariables* values) {
  return Reader(text, values, false).value();
}

Evaluated evaluate_siemens_condition(std::string_view text, const SiemensVariables* values) {
  return Reader(text, values, true).value();
}

SiemensIndices siemens_indices(std::string_view text, const SiemensVariables* values) {
  return Reader(text, values, false).indices();
}

}  // namespace smoothpost::nc
