#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "formats/nc/flow_index.h"
#include "formats/nc/subroutine_files.h"
#include "tests/formats/nc/recording.h"
#include "tests/support/support.h"

namespace smoothpost::test {
namespace {

namespace fs = std::filesystem;

/// What the comments of the program show.
std::vector<std::string> shown(const Run& r) {
  INFO(r.all_text());
  REQUIRE(r.ok);
  std::vector<std::string> out;
  for (const std::string& text : r.sink.comments) {
    if (text.starts_with("PRINT,")) out.push_back(text.substr(6));
  }
  return out;
}

using Lines = std::vector<std::string>;

std::vector<double> places(const Run& r) {
  INFO(r.all_text());
  REQUIRE(r.ok);
  std::vector<double> x;
  for (const auto& m : r.sink.motions) x.push_back(m.end[0]);
  return x;
}

using Places = std::vector<double>;

/// A folder with files of subroutines, removed at the end.
class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / ("smoothpost_subs_" + unique_name())) {
    fs::create_directories(path_ / "inside");
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  void put(const std::string& name, const std::string& text) const {
    std::ofstream(path_ / name, std::ios::binary) << text;
  }
  nc::InterpreterSettings settings() const {
    nc::InterpreterSettings s = mill_settings();
    s.subroutine_folders = {(path_ / "inside").string()};
    return s;
  }
  const fs::path& path() const { return path_; }

 private:
  static std::string unique_name() {
    static int count = 0;
    return std::to_string(reinterpret_cast<std::uintptr_t>(&count)) + "_" + std::to_string(++count);
  }
  fs::path path_;
};

}  // namespace

TEST_CASE("flow: while do repeat if with break and continue", "[formats][nc][flow]") {
  CHECK(places(run_lines("#1=0\no1 while [#1 lt 4]\n#1=[#1+1]\no2 if [#1 eq 2]\no1 continue\n"
                         "o2 endif\nG0 X#1\no1 endwhile\nG0 X9")) == Places{1, 3, 4, 9});
  CHECK(places(run_lines("#1=0\no1 do\n#1=[#1+1]\nG0 X#1\no2 if [#1 eq 2]\no1 break\no2 endif\n"
                         "o1 while [#1 lt 9]\nG0 X9")) == Places{1, 2, 9});
  // In do ... while continue goes to the condition.
  CHECK(places(run_lines("#1=0\no1 do\n#1=[#1+1]\no2 if [#1 eq 2]\no1 continue\no2 endif\nG0 X#1\n"
                         "o1 while [#1 lt 3]")) == Places{1, 3});
  // The count of repeat is rounded; below 1 it is none.
  CHECK(places(run_lines("G91 G0 X1\no1 repeat [2.5]\nX1\no1 endrepeat\no2 repeat [-3]\nX100\n"
                         "o2 endrepeat\nG90 X9")) == Places{1, 2, 3, 4, 9});
  // Loops within loops count anew.
  CHECK(places(run_lines("G91 G0 X0\no1 repeat [2]\no2 repeat [2]\nX1\no2 endrepeat\n"
                         "o1 endrepeat")) == Places{0, 1, 2, 3, 4});
  for (const auto& [value, x] : {std::pair{1, 10.0}, {2, 20.0}, {3, 30.0}, {4, 40.0}}) {
    CHECK(places(run_lines(
              "#1=" + std::to_string(value) +
              "\nO<pick> IF [#1 EQ 1]\nG0 X10\nO<pick> ELSEIF [#1 EQ 2]\nG0 X20\n"
              "O<pick> else if [#1 eq 3]\nG0 X30\nO<pi ck> ELSE\nG0 X40\nO<pick> END IF")) ==
          Places{x});
  }
}

TEST_CASE("flow: subroutines have arguments names and a result", "[formats][nc][flow]") {
  CHECK(shown(run_lines("o<f> sub\n(print,#1 #2 #3)\n#1=9 #31=7 #<own>=1 #<_all>=#2\n"
                        "o<f> endsub [#1*2]\n#1=5 #2=6\no<f> call [1+1] [3]\n"
                        "(print,#1 #2 #31 #<own> #<_all> #<_value> #<_value_returned>)")) ==
        Lines{"2.000000 3.000000 0.000000",
              "5.000000 6.000000 7.000000 ###### 3.000000 18.000000 1.000000"});
  CHECK(shown(run_lines(
            "o1 sub\no2 if [#1 gt 5]\no1 return [7]\no2 endif\no1 endsub\no1 call [6]\n"
            "(print,%d#<_value>)\no1 call [1]\n(print,%d#<_value> #<_value_returned>)")) ==
        Lines{"7", "0 0"});
  // Forward, by a computed label, within loops; the same labels in the subroutine and outside.
  CHECK(places(run("G0 X0\n#7=12\no1 repeat [2]\no#7 call [#<_x>+1]\no1 endrepeat\n"
                   "o[6*2] call [9]\nM2\no12 sub\no1 if [1]\nG0 X#1\no1 endif\no12 endsub\n")) ==
        Places{0, 1, 2, 9});
  // A subroutine that is not called is passed over; motion mode and units stay after the call.
  CHECK(places(run_lines("o1 sub\nX5\no1 endsub\nG20 G0 X0\nG21\nG0 X1\no1 call\nX6")) ==
        Places{0, 1, 5, 6});
  CHECK(shown(run_lines("o<f> sub\no1 if [#1 gt 0]\no<f> call [#1-1]\no1 endif\n(print,%d#1)\n"
                        "o<f> endsub\no<f> call [3]")) == Lines{"0", "1", "2", "3"});
  const Run r = run_lines("o1 sub\n(print,%d#<_call_level> #<_line>)\no1 endsub\no1 call");
  CHECK(shown(r) == Lines{"1 2"});
}

TEST_CASE("flow: faults are named where they stand", "[formats][nc][flow]") {
  struct Row {
    const char* text;
    const char* code;
    int line;
    int column;
  };
  const Row rows[] = {
      {"o1 while [1]\nG0 X1\nM2\n", "NC250", 1, 1},
      {"o1 if [1]\no1 elseif [1]\no1 else\nM2\n", "NC250", 3, 1},
      {"o1 endwhile\nM2\n", "NC250", 1, 1},
      {"o1 if [1]\no2 while [0]\no1 endif\no2 endwhile\nM2\n", "NC250", 1, 1},
      {"o1 sub\no2 sub\no2 endsub\no1 endsub\nM2\n", "NC250", 2, 1},
      {"o1 if [1]\no2 sub\no2 endsub\no1 endif\nM2\n", "NC250", 2, 1},
      {"o1 if [1]\no1 endif\no1 if [1]\no1 endif\nM2\n", "NC250", 3, 1},
      {"o1 sub\no1 endsub\no1 sub\no1 endsub\nM2\n", "NC250", 3, 1},
      {"o1 return\nM2\n", "NC250", 1, 1},
      {"o1 repeat [3]\no1 break\no1 endrepeat\nM2\n", "NC250", 2, 1},
      // LinuxCNC would go on with the count of the first run.
      {"#1=0\no1 while [#1 LT 2]\n#1=[#1+1]\no2 repeat [3]\no1 continue\no2 endrepeat\n"
       "o1 endwhile\nM2\n",
       "NC250", 4, 1},
      {"o1 if [1]\no1 continue\no1 endif\nM2\n", "NC250", 2, 1},
      {"N5 o1 if [1/0]\no1 endif\nM2\n", "NC254", 1, 13},
      {"o1 if [0]\no1 elseif [#<a>]\no1 endif\nM2\n", "NC254", 2, 12},
      {"o1 call [#<a>]\nM2\no1 sub\no1 endsub\n", "NC254", 1, 10},
      {"o<nowhere> call\nM2\n", "NC251", 1, 1},
      {"o1 sub\nG0 X1\nM98 P1\no1 endsub\no1 call\nM2\n", "NC251", 3, 1},
      {"o[0.5] call\nM2\n", "NC251", 1, 1},
      {"o1 if 1\nM2\n", "NC150", 1, 7},
      {"o1 iff [1]\nM2\n", "NC150", 1, 4},
      {"o1 if [1] G0 X1\nM2\n", "NC150", 1, 11},
      {"o1.5 sub\nM2\n", "NC150", 1, 3},
      {"o#1 sub\nM2\n", "NC150", 1, 5},
      {"o sub\nM2\n", "NC150", 1, 3},
      {"o1 call [1][2][3][4][5][6][7][8][9][10][11][12][13][14][15][16][17][18][19][20][21][22]"
       "[23][24][25][26][27][28][29][30][31]\nM2\n",
       "NC150", 1, 120},
      {"o1 sub\nG0 X1\nM2\no1 endsub\no1 call\n$$\n", "", 0, 0},
      {"o1 call\nM2\no1 sub\n$$ G0 X1\no1 endsub\n", "NC127", 4, 1},
      {"o1 call\nM2\no1 sub\nG0 X1\n", "NC250", 1, 1},
      {"o1 if [0]\n$$\no1 endif\nM2\n", "NC200", 2, 1},  // though the flow never comes there
      {"(ABORT, x is #1)\nM2\n", "NC263", 1, 1},
      {"G0 X1 O5\nM2\n", "NC122", 1, 7}};
  for (const Row& row : rows) {
    const Run r = run(row.text);
    INFO(row.text << "\n" << r.all_text());
    if (row.line == 0) {
      CHECK(r.ok);
      continue;
    }
    REQUIRE_FALSE(r.ok);
    bool told = false;
    for (const Diagnostic& d : r.diagnostics) {
      told = told || (d.code == row.code && d.where.line == row.line &&
                      (d.where.column == row.column || row.column == 120));
    }
    CHECK(told);
  }
}

TEST_CASE("flow: endless programs end with the budget or the depth", "[formats][nc][flow]") {
  nc::InterpreterSettings settings;
  settings.run_budget = 1000;
  for (const char* text :
       {"o1 while [1]\no1 endwhile\nM2\n", "o1 do\nG91 G0 X1\no1 while [1]\nM2\n",
        "o1 repeat [1000000000000000000]\nG91 G0 X1\no1 endrepeat\nM2\n",
        "o1 sub\no1 endsub\no2 while [1]\no1 call\no2 endwhile\nM2\n",
        "O5\nM98 P6 L999999999\nM2\nO6\nG91 G0 X1\nM99\n",
        "G0 X0 Y0 Z5 F1\nG83 X1 Z-1 R1 Q0.000000001\nM2\n",
        "G0 X0 Y0 Z5 F1\nG91 G81 X1 Z-1 R1 L100000\nM2\n"}) {
    const Run r = run(text, settings);
    INFO(text << r.all_text());
    CHECK(r.has("NC252"));
    CHECK(r.sink.motions.size() <= 1001);
    for (const Diagnostic& d : r.diagnostics) CHECK(d.where.line > 0);
  }
  const char* recursion = "o1 sub\no1 call\no1 endsub\no1 call\nM2\n";
  CHECK(run(recursion).errors() == Lines{"NC253"});
  // As LinuxCNC: nine calls within each other.
  const auto depth = [](int n) {
    return run_lines(
               "o<f> sub\no1 if [#1 gt 0]\no<f> call [#1-1]\no1 endif\no<f> endsub\no<f> call [" +
               std::to_string(n) + "]")
        .ok;
  };
  CHECK(depth(8));
  CHECK_FALSE(depth(9));
  // The program's own length is no part of the budget.
  std::string longer;
  for (int i = 0; i < 5000; ++i) longer += "G0 X" + std::to_string(i) + "\n";
  settings.run_budget = 1;
  CHECK(run(longer + "M2\n", settings).ok);
}

TEST_CASE("flow: M98 and M99", "[formats][nc][flow]") {
  CHECK(places(run("O1000\nG90 G0 X0\nM98 P7 L3\nM98 P7 L0\nG90 X9\nM30\nO7\nG91 G0 X1\nM99\n")) ==
        Places{0, 1, 2, 3, 9});
  // M98 shares the parameters of its caller, but not its names.
  CHECK(shown(run("#1=4 #<a>=1\nM98 P7\n(print,%d#1)\nM2\nO7\n(print,#<a>)\n#1=[#1+1]\nM99\n")) ==
        Lines{"######", "5"});
  // A program number on the way does nothing.
  CHECK(places(run("G0 X1\nO5\nG0 X2\nM2\n")) == Places{1, 2});
  struct Row {
    const char* text;
    const char* code;
  };
  const Row rows[] = {{"M98\nM2\n", "NC256"},
                      {"M98 P1.5\nM2\n", "NC256"},
                      {"M98 P9\nM2\n", "NC251"},
                      {"G0 X1 M98 P5\nM2\nO5\nM99\n", "NC256"},
                      {"G0 X1\nM99\n", "NC256"},
                      {"M98 P5\nM2\nO5\nG0 X1 M99\n", "NC256"},
                      {"M98 P5\nM2\nO5\nG0 X1\n", "NC257"},
                      {"M98 P5\nM2\nO5\nM99\nO5\nM99\n", "NC250"},
                      {"M98 P1\n\nO1 sub\nO1 endsub\nM2\n", "NC251"},
                      {"O1 call\n\nO1\nM99\n", "NC251"},
                      {"O1 call\n\nO1 sub\nG0 X1\nM99\no1 endsub\n", "NC256"},
                      {"M98 P1\nM2\nO1\nG0 X1\nO1 endsub\n", "NC250"}};
  for (const Row& row : rows) {
    const Run r = run(row.text);
    INFO(row.text << "\n" << r.all_text());
    CHECK(r.has(row.code));
  }
}

TEST_CASE("flow: files of subroutines from the stated folders only", "[formats][nc][flow]") {
  const Folder folder;
  folder.put("inside/step.ngc", "o<step> sub\nG91 G0 X#1\nG90\no<step> endsub\nM2\n");
  folder.put("inside/bad.ngc", "o<bad> sub\nG0 X1 $$\no<bad> endsub\n");
  folder.put("inside/other.ngc", "o<else> sub\no<else> endsub\n");
  folder.put("inside/7.ngc", "O7\nG0 X70\nM99\n");
  folder.put("inside/fault.ngc", "o<fault> sub\n\nG0 X[1/0]\no<fault> endsub\n");
  folder.put("outside.ngc", "o<outside> sub\nG0 X666\no<outside> endsub\n");
  std::error_code failed;
  fs::create_symlink(folder.path() / "outside.ngc", folder.path() / "inside/link.ngc", failed);
  fs::create_directory(folder.path() / "inside/folder.ngc");
  const auto with = [&](const std::string& lines) { return run_lines(lines, folder.settings()); };

  const Run r = with("G0 X0\n\no<step> call [2]\no<step> call [3]\nM98 P7");
  CHECK(places(r) == Places{0, 2, 5, 70});
  // What a file does has the line of its call.
  CHECK(r.sink.motions[1].line == 3);
  CHECK(r.sink.motions[2].line == 4);
  CHECK(run_lines("o<step> call [2]").errors() == Lines{"NC251"});  // no folder was stated
  for (const char* name : {"../outside", "/etc/passwd", "..", ".step", "a/b", "step.ngc/x"}) {
    INFO(name);
    CHECK(with("o<" + std::string(name) + "> call").errors() == Lines{"NC251"});
    CHECK_FALSE(
        nc::find_subroutine(folder.settings().subroutine_folders, name, nc::InputDialect::linuxcnc)
            .found());
  }
  const Run link = with("o<link> call");
  CHECK(link.errors() == Lines{"NC251"});
  CHECK(link.all_text().find("leads out") != std::string::npos);
  CHECK(with("o<folder> call").errors() == Lines{"NC251"});
  CHECK(with("o<other> call").all_text().find("has no subroutine") != std::string::npos);
  CHECK(with("o<bad> call").all_text().find("bad.ngc:2:7") != std::string::npos);
  CHECK(with("G0 X0\no<fault> call").all_text().find("fault.ngc:3:") != std::string::npos);
}

TEST_CASE("flow: the saved modal state comes back", "[formats][nc][flow]") {
  const Run r = run_lines(
      "G21 G90 G17 F100 S500 G54\nM70\nG20 G91 G18 F7 S9 M3 G55 G43.1 Z1\nM8\nM72\nG1 X5\n"
      "o1 sub\nM73\nG20 G91\no1 endsub\no1 call\nX6",
      mill_settings());
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.sink.motions[0].end[0] == 5.0);
  CHECK(r.sink.motions[1].end[0] == 6.0);
  CHECK(r.sink.motions[1].duration == Approx(0.6));
  CHECK(r.sink.event_texts() ==
        Lines{"spindle_on rpm=9", "coolant_on", "spindle_off", "coolant_off"});
  CHECK(r.sink.of("tool_length").back().number == 0.0);
  CHECK(run_lines("M72").errors() == Lines{"NC258"});
  CHECK(run_lines("M70\nM71\nM72").errors() == Lines{"NC258"});
  // The state belongs to its level.
  CHECK(run_lines("M70\no1 sub\nM72\no1 endsub\no1 call").errors() == Lines{"NC258"});
}

TEST_CASE("flow: a machine program has none", "[formats][nc][flow]") {
  nc::InterpreterSettings settings;
  settings.plain_blocks = true;
  for (const char* lines :
       {"o1 if [1]\no1 endif", "M98 P1", "M70", "G81 X1 Z-1 R1 F1", "G5 X1", "G10 L1 P1 Z1"}) {
    const Run r = run_lines(lines, settings);
    INFO(lines << r.all_text());
    CHECK_FALSE(r.ok);
    CHECK(r.sink.motions.empty());
  }
}

TEST_CASE("flow: print gives the text back", "[formats][nc][flow]") {
  for (const char* text : {"o<a b> WHILE [ #1 LT 2 ] (c)\nN5 O1 call [1] [2] ; x\n", "o1 iff\n"}) {
    CHECK(nc::print(nc::parse(text, "t").program) == text);
  }
}

}  // namespace smoothpost::test
