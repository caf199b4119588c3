#include <catch2/catch.hpp>

#include "formats/nc/dialect_detection.h"
#include "formats/nc/flow_words.h"
#include "tests/formats/nc/recording.h"

// Custom macro B and subprograms of the Fanuc family.
namespace smoothpost::test {
namespace {

using Places = std::vector<double>;
using Codes = std::vector<std::string>;

Run fanuc(const std::string& text, nc::InputDialect dialect = nc::InputDialect::fanuc) {
  return run("%\nO1000 (TEST)\n" + text + "%\n", mill_settings(), dialect);
}

Places places(const Run& r) {
  INFO(r.all_text());
  REQUIRE(r.ok);
  Places x;
  for (const auto& m : r.sink.motions) x.push_back(m.end[0]);
  return x;
}

}  // namespace

TEST_CASE("macro: IF GOTO THEN and WHILE DO", "[formats][nc][macro]") {
  // Assignments take values without brackets.
  CHECK(places(fanuc("#100=2\n#100=#100+1*4-SQRT[4] (C)\nG0 X#100\nM30\n")) == Places{4});
  CHECK(
      places(fanuc("#100=0\nN10 #100=[#100+1]\nG0 X#100\nIF [#100 LT 3] GOTO 10\nG0 X9.\nM30\n")) ==
      Places{1, 2, 3, 9});
  CHECK(places(fanuc("#1=0\nWHILE[#1LT3]DO1\n#2=0\nWHILE [#2 LT 2] DO 2\nG0 X[#1*10+#2]\n"
                     "#2=[#2+1]\nEND2\n#1=[#1+1]\nEND 1\nM30\n")) == Places{0, 1, 10, 11, 20, 21});
  CHECK(places(
            fanuc("#1=5\nIF [#1 EQ 5] THEN #1=7\nIF [#1 EQ 5] THEN #1=8\nG0 X#1\nGOTO 20\nG0 X99.\n"
                  "N20 G0 X1.\nM30\n")) == Places{7, 1});
  CHECK(places(fanuc("#1=0\nDO1\n#1=[#1+1]\nIF [#1 GT 4] GOTO 5\nG0 X#1\nEND1\nN5 M30\n")) ==
        Places{1, 2, 3, 4});
  // Loop numbers are used again one after the other.
  CHECK(places(fanuc("#1=0\nWHILE [#1 LT 1] DO1\n#1=1\nG0 X1.\nEND1\nWHILE [#1 LT 2] DO1\n#1=2\n"
                     "G0 X2.\nEND1\nM30\n")) == Places{1, 2});
}

TEST_CASE("macro: expressions of the Fanuc family", "[formats][nc][macro]") {
  const auto x = [](const std::string& expression) {
    return places(fanuc("#1=2\n#2=-2.5\nG0 X[" + expression + "]\nM30\n")).front();
  };
  CHECK(x("#1+3*4") == 14.0);
  CHECK(x("FIX[#2]") == -2.0);
  CHECK(x("FUP[#2]") == -3.0);
  CHECK(x("[-7] MOD 3") == -1.0);
  CHECK(x("ATAN[1]/[1]") == Approx(45.0));
  CHECK(x("#9+1") == 1.0);  // vacant counts as 0
  CHECK(x("[#9 EQ #0]*10+[#9 EQ 0]") == 10.0);
  CHECK(x("[#1 NE #0]*10+[#9 NE #0]") == 10.0);
  CHECK(x("[1 EQ 1] AND [2 EQ 2]") == 1.0);
  CHECK(x("[1 EQ 2] OR [2 EQ 2] AND [1 EQ 2]") == 0.0);
  CHECK(fanuc("G0 X#9\nM30\n").errors() == Codes{"NC131"});  // the control passes over the word
  CHECK(fanuc("G0 X[3 AND 5]\nM30\n").errors() == Codes{"NC131"});
  CHECK(fanuc("G0 X[2**3]\nM30\n").has("NC130"));
  CHECK(fanuc("#<a>=1\nM30\n").has("NC130"));
  CHECK(fanuc("#0=1\nM30\n").errors() == Codes{"NC132"});
  CHECK(fanuc("#3000=1\nM30\n").errors() == Codes{"NC132"});
  CHECK(fanuc("G0 X#5021\nM30\n").errors() == Codes{"NC131"});
  CHECK(places(fanuc("G0 X3.\nX[#5041+#5001+#4003/90]\nM30\n")).size() == 2);
}

TEST_CASE("macro: subprograms and macro calls", "[formats][nc][macro]") {
  CHECK(places(
            fanuc("G90 G0 X0\nM98 P2000 L2\nM98 P32000\nG90 X9.\nM30\nO2000\nG91 G0 X1.\nM99\n")) ==
        Places{0, 1, 2, 3, 4, 5, 9});
  // The motion of the block comes before its call.
  CHECK(places(fanuc("G90 G0 X5. M98 P2000\nM30\nO2000\nG91 G0 X1.\nM99\n")) == Places{5, 6});
  // G65 has variables of its own; M98 has those of its caller.
  CHECK(places(fanuc("#1=3\n#100=50\nG65 P2000 L2 A7. X2. F4.\nM98 P2001\nG0 X#1\nM30\n"
                     "O2000\nG0 X[#1+#24*10+#9*100+#100*1000]\n#1=99\nM99\n"
                     "O2001\n#1=[#1+1]\nM99\n")) == Places{50427, 50427, 4});
  CHECK(places(fanuc("M98 P2000\nG0 X1.\nN7 G0 X2.\nM30\nO2000\nG0 X5.\nM99 P7\n")) ==
        Places{5, 2});
  CHECK(places(fanuc("M97 P50 L2\nG90 G0 X9.\nM30\nN50 G91 G0 X1.\nM99\n", nc::InputDialect::haas))
            .size() == 3);
  struct Row {
    const char* text;
    const char* code;
  };
  const Row rows[] = {{"G0 X1.\nM99\n", "NC256"},
                      {"GOTO 5\nM30\n", "NC250"},
                      {"GOTO 5\nN5 G0 X1.\nN5 M30\n", "NC250"},
                      {"GOTO 5\nM30\nO2000\nN5 M99\n", "NC250"},  // of another program
                      {"WHILE [1 EQ 1] DO1\nM30\n", "NC250"},
                      {"END1\nM30\n", "NC250"},
                      {"WHILE [1 EQ 1] DO1\nWHILE [1 EQ 1] DO1\nEND1\nEND1\nM30\n", "NC250"},
                      {"IF [1 EQ 1]\nM30\n", "NC150"},
                      {"IF 1 GOTO 5\nM30\n", "NC150"},
                      {"WHILE [1 EQ 1]\nM30\n", "NC150"},
                      {"GOTO\nM30\n", "NC150"},
                      {"G0 X1. GOTO 5\nM30\n", "NC125"},
                      {"G65 A1.\nM30\n", "NC256"},
                      {"G65 P1 M3\nM30\n", "NC256"},
                      {"N1 GOTO 1\nM30\n", "NC252"},
                      {"G65 P2000\nM30\nO2000\nG65 P2000\nM99\n", "NC253"}};
  for (const Row& row : rows) {
    const Run r = fanuc(row.text);
    INFO(row.text << "\n" << r.all_text());
    CHECK(r.has(row.code));
    for (const Diagnostic& d : r.diagnostics) CHECK(d.where.line >= 3);
  }
}

TEST_CASE("macro: statements tell the dialect", "[formats][nc][macro]") {
  using nc::InputDialect;
  CHECK(nc::fitting_dialects("IF [#1 EQ 2] GOTO 5\n") == std::vector{InputDialect::fanuc});
  CHECK(nc::fitting_dialects("N5 WHILE[#1LT2]DO1\n") == std::vector{InputDialect::fanuc});
  CHECK(nc::fitting_dialects("G65 P9000 A1.\n") == std::vector{InputDialect::fanuc});
  CHECK(nc::fitting_dialects("o1 if [1]\n(IF [1] GOTO 2)\n") ==
        std::vector{InputDialect::linuxcnc});
}

}  // namespace smoothpost::test
