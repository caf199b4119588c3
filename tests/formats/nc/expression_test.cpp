#include "formats/nc/expression.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <map>

#include "tests/formats/nc/recording.h"

namespace smoothpost::nc {
namespace {

/// #1 is 4, #2 is -2.5, #<a> is 7; nothing else has a value.
class Values final : public ParameterValues {
 public:
  ParameterValue numbered(int index) const override {
    if (index == 1) return {4.0, {}};
    if (index == 2) return {-2.5, {}};
    return {0.0, index == 99 ? "no value" : ""};
  }
  ParameterValue named(std::string_view name) const override {
    return name == "a" ? ParameterValue{7.0, {}} : ParameterValue{0.0, "no such name"};
  }
};

double value(std::string_view text) {
  static const Values values;
  const Evaluated found = evaluate_value(text, &values);
  INFO(text << ": " << found.problem);
  REQUIRE(found.ok());
  CHECK(found.length == text.size());
  return found.value;
}

}  // namespace

TEST_CASE("expression: operators, precedence and association", "[formats][nc][expression]") {
  CHECK(value("[1+2*3]") == 7.0);
  CHECK(value("[[1+2]*3]") == 9.0);
  CHECK(value("[2**3**2]") == 64.0);  // from left to right
  CHECK(value("[-2**2]") == 4.0);     // the sign belongs to the number
  CHECK(value("[8/4/2]") == 1.0);
  CHECK(value("[-7 MOD 3]") == 2.0);
  CHECK(value("[7 mod -3]") == 1.0);
  CHECK(value("[1 + 1 EQ 2]") == 1.0);
  CHECK(value("[1 EQ 1.00005]") == 1.0);
  CHECK(value("[1 NE 1.0002]") == 1.0);
  CHECK(value("[1 LT 2 AND 3 LT 2]") == 0.0);
  CHECK(value("[1 OR 0 AND 0]") == 0.0);  // one rank, from left to right
  CHECK(value("[1 XOR 1]") == 0.0);
  CHECK(value("[3 - -2]") == 5.0);
}

TEST_CASE("expression: functions in degrees", "[formats][nc][expression]") {
  CHECK(value("sin[30]") == Approx(0.5));
  CHECK(value("C O S[60]") == Approx(0.5));
  CHECK(value("TAN[45]") == Approx(1.0));
  CHECK(value("ASIN[0.5]") == Approx(30.0));
  CHECK(value("ACOS[0.5]") == Approx(60.0));
  CHECK(value("ATAN[1]/[-1]") == Approx(135.0));
  CHECK(value("ABS[-3]") == 3.0);
  CHECK(value("FIX[-2.5]") == -3.0);
  CHECK(value("FUP[2.1]") == 3.0);
  CHECK(value("ROUND[2.5]") == 3.0);
  CHECK(value("ROUND[-2.5]") == -3.0);
  CHECK(value("LN[EXP[2]]") == Approx(2.0));
  CHECK(value("SQRT[16]") == 4.0);
  CHECK(value("EXISTS[#<a>]") == 1.0);
  CHECK(value("EXISTS[#<b>]") == 0.0);
}

TEST_CASE("expression: parameters", "[formats][nc][expression]") {
  CHECK(value("#1") == 4.0);
  CHECK(value("-#2") == 2.5);
  CHECK(value("#[3 - 2]") == 4.0);
  CHECK(value("#< A >") == 7.0);
  CHECK(value("##1") == 0.0);
}

TEST_CASE("expression: faults are told with their place", "[formats][nc][expression]") {
  struct Row {
    const char* text;
    std::size_t at;
    const char* says;
  };
  const Row rows[] = {{"[1/0]", 3, "zero"},           {"[1+SQRT[-1]]", 3, "SQRT"},
                      {"[LN[0]]", 1, "LN"},           {"[2 #1]", 3, "missing"},
                      {"[1+]", 3, "begins no value"}, {"[1+2", 0, "not closed"},
                      {"FOO[1]", 0, "no function"},   {"ATAN[1]", 7, "two arguments"},
                      {"#0", 1, "no parameter"},      {"#5602", 1, "5601"},
                      {"#1.5", 1, "whole"},           {"#<b>", 0, "no such name"},
                      {"#99", 0, "no value"},         {"[[-8]**0.5]", 7, "power"},
                      {"ASIN[2]", 0, "-1 to 1"},      {"[1.2.3]", 4, "two points"},
                      {"[7 MOD 0]", 0, "finite"},     {"[EXP[1000]]", 1, "finite"}};
  const Values values;
  for (const Row& row : rows) {
    const Evaluated found = evaluate_value(row.text, &values);
    INFO(row.text << ": " << found.problem << " at " << found.at);
    CHECK_FALSE(found.ok());
    CHECK(found.problem.find(row.says) != std::string::npos);
    CHECK(found.at == row.at);
  }
}

TEST_CASE("expression: deep nesting ends in a fault", "[formats][nc][expression]") {
  const std::string text(100'000, '[');
  CHECK_FALSE(evaluate_value(text, nullptr).ok());
  CHECK_FALSE(evaluate_value(std::string(100'000, '#'), nullptr).ok());
}

}  // namespace smoothpost::nc
