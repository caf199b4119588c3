#include "formats/nc/parameters.h"

#include <catch2/catch.hpp>

#include "tests/formats/nc/recording.h"

namespace smoothpost::test {
namespace {

/// X of the last motion.
double last_x(const Run& r) {
  INFO(r.all_text());
  REQUIRE(r.ok);
  return r.sink.motions.back().end[0];
}

}  // namespace

TEST_CASE("parameters: words take the values from before their line", "[formats][nc][parameters]") {
  CHECK(last_x(run_lines("#1=3\nG0 X#1")) == 3.0);
  CHECK(last_x(run_lines("#1=3\n#1=5 G0 X#1")) == 3.0);
  CHECK(last_x(run_lines("#1=3\n#1=5\nG0 X#1")) == 5.0);
  CHECK(last_x(run_lines("#1=3\n#1=4 #1=[#1+5]\nG0 X#1")) == 8.0);  // the last one counts
  CHECK(last_x(run_lines("#<depth>=[2*3] #<_G>=1\nG0 X[#<De Pth>+#<_g>]")) == 7.0);
  CHECK(last_x(run_lines("G0 X#77")) == 0.0);  // never assigned
  CHECK(last_x(run_lines("#1=20 #2=1\nG#1\nG[#2-1] X1")) == Approx(25.4));
}

TEST_CASE("parameters: a refused line assigns nothing", "[formats][nc][parameters]") {
  const Run r = run_lines("#1=3\n#1=5 G0 X[1/0]\nG0 X#1");
  CHECK(r.errors() == std::vector<std::string>{"NC131"});
  CHECK(r.sink.motions.back().end[0] == 3.0);
}

TEST_CASE("parameters: position, offsets, tool and modes", "[formats][nc][parameters]") {
  nc::InterpreterSettings settings = mill_settings();
  const std::string start = "T1 M6\nG10 L2 P2 X10 R90\nG55\nG0 X1 Y2 Z3 A4 B5 C6\n";
  const auto x = [&](const std::string& expression) {
    return last_x(run_lines(
        start + "G90 G0 X[" + expression + "+10]\nG10 L2 P2 X0 R0\nG0 X" + "[" + expression + "]",
        settings));
  };
  CHECK(x("#5422") == 3.0);
  CHECK(x("#5424") == Approx(5.0));
  CHECK(x("#<_c>") == Approx(6.0));
  CHECK(x("#5220") == 2.0);
  CHECK(x("#5400") == 1.0);
  CHECK(x("#<_metric>") == 1.0);
  CHECK(x("#<_absolute>") == 1.0);
  CHECK(x("#<_coord_system>") == 550.0);
  CHECK(last_x(run_lines("G10 L2 P3 X7 R30\nG0 X[#5261+#5270]")) == Approx(37.0));
  CHECK(last_x(run_lines("G0 X3\nG92 X5\nG0 X[#5210*100+#5211]")) == Approx(98.0 - 2.0));
  // The tool table's length, whatever length is in force.
  CHECK(last_x(run_lines("T1 M6\nG43.1 Z12\nG0 X#5403", settings)) == 50.0);
  CHECK(last_x(run_lines("T7 M6\nG10 L1 P7 Z30 R2\nG0 X[#5403+#5410]", settings)) == 34.0);
  CHECK(last_x(run_lines("G0 X1\nG92 X5\nG53 G0 X7\nG91 G0 X#<_abs_x>")) == 14.0);
  CHECK(last_x(run_lines("G20 G0 X1\nG0 X[#5420*2]")) == Approx(50.8));
  CHECK(last_x(run_lines("G0 X4\nG28.1\nG0 X[#5161+1]")) == 5.0);
}

TEST_CASE("parameters: ten faults with line and column", "[formats][nc][parameters]") {
  struct Row {
    const char* line;
    const char* code;
    int column;
  };
  const Row rows[] = {{"G0 X[1/0]", "NC131", 8},        {"G0 X#<a>", "NC131", 5},
                      {"G0 X1 Y#0", "NC131", 9},        {"#5420=1", "NC132", 1},
                      {"#5221=1", "NC132", 1},          {"#<_x>=1", "NC132", 1},
                      {"G0 X#<_hal[pin]>", "NC131", 5}, {"G0 X#5421", "NC131", 5},
                      {"#1=[SQRT[-1]]", "NC132", 5},    {"G0 X#5410", "NC131", 5},
                      {"G0 X#5403", "NC131", 5},        {"G0 X#5399", "NC131", 5},
                      {"G0 X#<_task>", "NC131", 5},     {"#<_line>=1", "NC132", 1},
                      {"G[1.5] X1", "NC201", 1},        {"G0 X[2", "NC130", 5}};
  for (const Row& row : rows) {
    const Run r = run(std::string(row.line) + "\nM2\n");
    INFO(row.line << "\n" << r.all_text());
    REQUIRE_FALSE(r.ok);
    CHECK(r.diagnostics.front().code == row.code);
    CHECK(r.diagnostics.front().where.line == 1);
    CHECK(r.diagnostics.front().where.column == row.column);
  }
}

TEST_CASE("parameters: assignments and expressions print as they were written",
          "[formats][nc][parameters]") {
  for (const char* text : {"#1 = [ 2 * 3 ] (c)\n", "G1X#1Y[#2 + 3]F#<f eed>\n", "#1=2#2=3\n"}) {
    CHECK(nc::print(nc::parse(text, "t").program) == text);
    CHECK(nc::parse(text, "t").diagnostics.empty());
  }
}

}  // namespace smoothpost::test
