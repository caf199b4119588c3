#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "tests/formats/nc/recording.h"

// Loops, repeated parts and subprograms of Sinumerik programs.
namespace smoothpost::test {
namespace {

namespace fs = std::filesystem;

Run siemens(const std::string& text, const nc::InterpreterSettings& settings = mill_settings()) {
  return run(text, settings, nc::InputDialect::siemens);
}

using Ends = std::vector<double>;
using Codes = std::vector<std::string>;

/// The X of the motions' ends.
Ends ends(const std::string& text, const nc::InterpreterSettings& settings = mill_settings()) {
  const Run r = siemens(text, settings);
  INFO(text << "\n" << r.all_text());
  REQUIRE(r.ok);
  Ends out;
  for (const CanonicalMotion& m : r.sink.motions) out.push_back(m.end[0]);
  return out;
}

Ends main_ends(const std::string& lines) { return ends(lines + "\nM30\n"); }

Codes errors(const std::string& lines) { return siemens(lines + "\nM30\n").errors(); }

/// A folder that is removed with its files.
struct Folder {
  fs::path path;
  explicit Folder(const std::string& name)
      : path(fs::temp_directory_path() / ("smoothpost_" + name)) {
    fs::remove_all(path);
    fs::create_directories(path);
  }
  ~Folder() { fs::remove_all(path); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(path / name, std::ios::binary) << text;
  }
  nc::InterpreterSettings settings() const {
    nc::InterpreterSettings s = mill_settings();
    s.subroutine_folders = {path.string()};
    return s;
  }
};

}  // namespace

TEST_CASE("siemens flow: FOR counts up to its end", "[formats][nc][siemens]") {
  CHECK(main_ends("FOR R1=1 TO 4\nG0 X=R1\nENDFOR\nX9") == Ends{1, 2, 3, 4, 9});
  CHECK(main_ends("FOR R1=-1 TO 2-1\nG0 X=R1\nENDFOR") == Ends{-1, 0, 1});
  CHECK(main_ends("DEF INT I, J\nFOR I=1 TO 2\nFOR J=I TO 2\nG0 X=10*I+J\nENDFOR\nENDFOR") ==
        Ends{11, 12, 22});
  CHECK(main_ends("FOR R1=3 TO 3\nG0 X=R1\nENDFOR") == Ends{3});
  // A jump out keeps the counter; the loop can be begun again.
  CHECK(main_ends("AGAIN: R3=R3+1\nFOR R1=1 TO 5\nIF R1==2 GOTOF OUT\nENDFOR\nOUT: G0 X=R1\n"
                  "IF R3<2 GOTOB AGAIN") == Ends{2, 2});
}

TEST_CASE("siemens flow: FOR is refused where its meaning is not stated",
          "[formats][nc][siemens]") {
  CHECK(errors("FOR R1=5 TO 1\nENDFOR") == Codes{"NC250"});
  CHECK(errors("R2=3\nFOR R1=1 TO R2\nR2=4\nENDFOR") == Codes{"NC250"});
  CHECK(errors("FOR R1=1 TO 2\nENDFOR\nG0 X=R1") == Codes{"NC131"});
  CHECK(main_ends("FOR R1=1 TO 2\nENDFOR\nR1=7\nG0 X=R1") == Ends{7});
  CHECK(errors("FOR R1=0.5 TO 2\nENDFOR") == Codes{"NC254"});
  CHECK(errors("FOR R1=1 TO 2.5\nENDFOR") == Codes{"NC254"});
  CHECK(errors("GOTOF A\nFOR R1=1 TO 2\nA: R1=1\nENDFOR") == Codes{"NC250"});
  CHECK(errors("FOR R1=1 TO 2\nG0 X1") == Codes{"NC250"});
  CHECK(errors("FOR R1=1 2\nENDFOR") == Codes{"NC150", "NC200", "NC250"});
  CHECK(errors("FOR R1=1 TO 2000000\nENDFOR") == Codes{"NC252"});
  CHECK(errors("FOR R1=1 TO 2\nENDLOOP\nENDFOR") == Codes{"NC250"});
}

TEST_CASE("siemens flow: labels and block numbers that stand often", "[formats][nc][siemens]") {
  // GOTOF: the next one, GOTOB: the last before, GOTO: the next one first.
  CHECK(main_ends("A: G0 X1\nR1=R1+1\nIF R1<3 GOTOB A\nGOTOF A\nX5\nA: X6\nA: X7") ==
        Ends{1, 1, 1, 6, 7});
  CHECK(main_ends("N10 G0 X1\nR1=R1+1\nIF R1<3 GOTOB N10\nGOTOF N10\nX5\nN10 X6\nN10 X7") ==
        Ends{1, 1, 1, 6, 7});
  CHECK(main_ends("GOTO N20\nN30 G0 X1\nN20 G0 X2\nR1=R1+1\nIF R1==1 GOTO N30") == Ends{2, 1, 2});
  CHECK(errors("GOTO N020\nN20 G0 X2") == Codes{"NC250"});
  // Many equal labels cost nothing: half a million jumps among ten thousand of them.
  std::string many = "AGAIN: R1=R1+1\nIF R1<250000 GOTOB AGAIN\n";
  for (int i = 0; i < 10000; ++i) many += "AGAIN: R2=0\n";
  CHECK(siemens(many + "G0 X1\nM30\n").ok);
}

TEST_CASE("siemens flow: LOOP, REPEAT and CASE", "[formats][nc][siemens]") {
  CHECK(main_ends("LOOP\nR1=R1+1\nIF R1>3 GOTOF OUT\nG0 X=R1\nENDLOOP\nOUT: X9") ==
        Ends{1, 2, 3, 9});
  CHECK(errors("LOOP\nG0 X1\nENDLOOP") == Codes{"NC252"});
  CHECK(main_ends("REPEAT\nR1=R1+1\nG0 X=R1\nUNTIL R1>=3\nX9") == Ends{1, 2, 3, 9});
  CHECK(main_ends("R1=8\nREPEAT\nG0 X=R1\nUNTIL TRUE") == Ends{8});
  CHECK(errors("REPEAT\nG0 X1") == Codes{"NC250"});
  const std::string lines =
      "CASE (R1) OF 1 GOTOF ONE 2 GOTOF TWO DEFAULT GOTOF REST\nG0 X0\n"
      "ONE: G0 X1\nTWO: G0 X2\nREST: G0 X3";
  CHECK(main_ends("R1=1\n" + lines) == Ends{1, 2, 3});
  CHECK(main_ends("R1=2\n" + lines) == Ends{2, 3});
  CHECK(main_ends("R1=5\n" + lines) == Ends{3});
  CHECK(main_ends("R1=5\nCASE R1-1 OF 1 GOTOF A\nG0 X1\nA: X2 F5") == Ends{1, 2});
  CHECK(errors("CASE (R1) OF 1 X5") == Codes{"NC150", "NC200"});
}

TEST_CASE("siemens flow: parts of the program run again", "[formats][nc][siemens]") {
  CHECK(main_ends("POS: G0 X=IC(1)\nX10\nREPEATB POS P=3\nX20").size() == 6);
  CHECK(main_ends("G0 X0\nA: X=IC(1)\nX=IC(1)\nREPEAT A P2\nX0") == Ends{0, 1, 2, 3, 4, 5, 6, 0});
  CHECK(main_ends("G0 X0\nA: X=IC(1)\nX=IC(1)\nB: X=IC(10)\nX100\nREPEAT A B\nX0") ==
        Ends{0, 1, 2, 12, 100, 101, 102, 112, 0});
  CHECK(main_ends("G0 X0\nA: X=IC(1)\nENDLABEL: X=IC(1)\nX50\nREPEAT A P=1\nX0") ==
        Ends{0, 1, 2, 50, 51, 52, 0});
  // A part that stands behind.
  CHECK(main_ends("G0 X0\nREPEAT A B\nX50\nA: X=IC(1)\nB: X=IC(1)") == Ends{0, 1, 2, 50, 51, 52});
  // Parts within parts, and calls within them.
  CHECK(main_ends("G0 X0\nA: X=IC(1)\nREPEATB A\nREPEAT A P=2\nX0") ==
        Ends{0, 1, 2, 3, 4, 5, 6, 0});
  CHECK(main_ends("A: G0 X1\nREPEATB A P=0\nX2") == Ends{1, 2});
  CHECK(errors("REPEATB A") == Codes{"NC250"});
  CHECK(errors("A: G0 X1\nA: X2\nREPEATB A") == Codes{"NC250"});
  CHECK(errors("REPEAT A\nA: G0 X1") == Codes{"NC250"});           // no end
  CHECK(errors("A: G0 X1\nREPEAT A B\nB: X2") == Codes{"NC250"});  // itself
  CHECK(errors("A: G0 X1\nGOTOF B\nX2\nREPEAT A\nB: X3\n") == Codes{});
  CHECK(errors("R1=0\nA: R1=R1+1\nIF R1>1 GOTOF B\nX2 F5\nREPEAT A\nB: X3\n") == Codes{"NC250"});
  CHECK(errors("A: G0 X1\nREPEAT A P=1000000000") == Codes{"NC252"});
}

TEST_CASE("siemens flow: subprograms behind the program", "[formats][nc][siemens]") {
  const std::string sub = "M30\n%_N_L100_SPF\n;$PATH=/_N_SPF_DIR\nX=IC(1)\nM17\n";
  CHECK(ends("%_N_PART_MPF\nG0 X0\nL100\nX5\nL100 P2\n" + sub) == Ends{0, 1, 5, 6, 7});
  CHECK(ends("G0 X0\nN10 L100 P=2 ; twice\n" + sub) == Ends{0, 1, 2});
  CHECK(ends("G0 X0\nCALL \"L100\"\nEXTCALL(\"L100.SPF\")\n" + sub) == Ends{0, 1, 2});
  CHECK(ends("G0 X0\nA: L100\nREPEATB A\n" + sub) == Ends{0, 1, 2});
  // M30 of a called program is its end only; RET and a jump within it.
  CHECK(ends("G0 X0\nSUB_A\nX9\nM30\n%_N_SUB_A_SPF\nGOTOF A\nX1\nA: X2\nRET\nX3\nM30\n"
             "%_N_SUB_B_SPF\nA: X4\nM17\n") == Ends{0, 2, 9});
  // M17 in a block with a motion comes behind it.
  CHECK(ends("G0 X0\nSUB_A\nX9\nM30\n%_N_SUB_A_SPF\nX3 M17\n") == Ends{0, 3, 9});
  CHECK(ends("G0 X0\nSUB_A\nX9\nM30\nPROC SUB_A\nX3\nM17\nPROC SUB_B\nX4\nRET\n") == Ends{0, 3, 9});
  // Modes of the subprogram stay; R parameters are those of all.
  CHECK(ends("G0 X1 R1=5\nSUB_A\nX1\nX=R1\nM30\n%_N_SUB_A_SPF\nG91 R1=R1+1\nM17\n") ==
        Ends{1, 2, 8});
  CHECK(ends("G0 X0\nLOOP\nSUB_A\nIF R1>2 GOTOF OUT\nENDLOOP\nOUT: X9\nM30\n"
             "%_N_SUB_A_SPF\nR1=R1+1\nX=R1\nM17\n") == Ends{0, 1, 2, 3, 9});
  const Run r = siemens("G0 X0\nL100\n" + sub);
  CHECK(r.sink.motions.back().line == 6);
  CHECK(r.sink.of("program_end").size() == 1);
  CHECK(r.codes(Severity::note).empty());
}

TEST_CASE("siemens flow: values of a call", "[formats][nc][siemens]") {
  const std::string sub =
      "M30\n%_N_HOLE_SPF\nPROC HOLE(REAL _X, INT _N=4, BOOL _B) DISPLOF\n"
      "G0 X=_X*_N+100*_B\nM17\n";
  CHECK(ends("HOLE(2.5,2)\n" + sub) == Ends{5});
  CHECK(ends("EXTERN HOLE(REAL,INT,BOOL)\nHOLE(2.5)\n" + sub) == Ends{10});
  CHECK(ends("HOLE(2.5,1.6,7) P=2\n" + sub) == Ends{105, 105});
  CHECK(ends("R1=3\nHOLE(R1+1,,TRUE)\n" + sub) == Ends{116});
  CHECK(siemens("HOLE(1,2,3,4)\n" + sub).errors() == Codes{"NC132"});
  // Variables of the caller are not seen, those of the subprogram end with it.
  CHECK(siemens("DEF REAL A1X=5\nSUB_A\nM30\n%_N_SUB_A_SPF\nG0 X=A1X\nM17\n").errors() ==
        Codes{"NC131"});
  CHECK(
      ends(
          "DEF REAL VAL=5\nSUB_A\nG0 X=VAL\nM30\n%_N_SUB_A_SPF\nDEF REAL VAL=7\nG0 X=VAL\nM17\n") ==
      Ends{7, 5});
  CHECK(siemens("SUB_A(1)\nM30\n%_N_SUB_A_SPF\nG0 X1\nM17\n").errors() == Codes{"NC256"});
  CHECK(siemens("PROC SUB_A(REAL _A)\nG0 X1\nM17\n").errors() == Codes{"NC132"});
}

TEST_CASE("siemens flow: calls that are refused", "[formats][nc][siemens]") {
  CHECK(siemens("NOWHERE\nM30\n").errors() == Codes{"NC251"});
  CHECK(siemens("L7 P0\nM30\n%_N_L7_SPF\nM17\n").errors() == Codes{"NC254"});
  CHECK(siemens("SUB_A\nM30\n%_N_SUB_A_SPF\nSUB_A\nM17\n").errors() == Codes{"NC253"});
  CHECK(siemens("SUB_A\nM30\n%_N_SUB_A_SPF\nG0 X1\n").errors() == Codes{"NC257"});
  CHECK(siemens("SUB_A\nM30\n%_N_SUB_A_SPF\nM17\n%_N_SUB_A_SPF\nM17\n").errors() == Codes{"NC250"});
  CHECK(siemens("%_N_SUB_A_SPF\nM17\n%_N_PART_MPF\nM30\n").errors() == Codes{"NC250"});
  CHECK(siemens("G0 X1 L100\nM30\n").errors() == Codes{"NC141", "NC200"});
  CHECK(siemens("CALL \"/_N_WKS_DIR/A\"\nM30\n").errors() == Codes{"NC150", "NC200"});
  CHECK(siemens("G0 X1\nPROC SUB_A\nM30\n").errors() == Codes{"NC140", "NC200"});
  CHECK(siemens("PROC SUB_A(VAR REAL _A)\nM30\n").errors() == Codes{"NC140", "NC200"});
  CHECK(siemens("PROC SUB_A SAVE\nM30\n").errors() == Codes{"NC140", "NC200"});
  // Faults of a subprogram are told when it is called, with its line.
  const std::string text = "G0 X1\nM30\n%_N_SUB_A_SPF\nG0 X\nM17\n";
  CHECK(siemens(text).ok);
  const Run r = siemens("SUB_A\n" + text);
  REQUIRE(r.errors() == Codes{"NC104"});
  CHECK(r.diagnostics.front().where.line == 5);
  // Labels, loops and block numbers are those of one program of the text.
  CHECK(siemens("GOTOF A\nM30\n%_N_SUB_A_SPF\nA: G0 X1\nM17\n").errors() == Codes{"NC250"});
  CHECK(siemens("GOTOF N50\nM30\n%_N_SUB_A_SPF\nN50 G0 X1\nM17\n").errors() == Codes{"NC250"});
  CHECK(siemens("IF R1==0\nM30\n%_N_SUB_A_SPF\nENDIF\nM17\n").errors() == Codes{"NC250"});
  nc::InterpreterSettings plain = mill_settings();
  plain.plain_blocks = true;
  CHECK(siemens("L100\nM30\n%_N_L100_SPF\nM17\n", plain).errors() == Codes{"NC255"});
}

TEST_CASE("siemens flow: subprograms in files", "[formats][nc][siemens]") {
  const Folder folder("siemens_files");
  const nc::InterpreterSettings settings = folder.settings();
  folder.write("L100.SPF", "X=IC(1)\nM17\n");
  folder.write("pocket_a.spf", "X1\nM17\n");
  folder.write("OTHER.MPF", "X40\nM30\n");
  folder.write("BAD.SPF", "X\nM17\n");
  folder.write("OPEN.SPF", "X1\n");
  CHECK(ends("G0 X0\nL100\nX5\nM30\n", settings) == Ends{0, 1, 5});
  const Run r = siemens("G0 X0\nPOCKET_A(10)\nM30\n", settings);
  CHECK(r.errors() == Codes{"NC140", "NC200"});  // POCKET.. is a name of the control's own cycles
  folder.write("part_a.spf", "%_N_PART_A_SPF\nPROC PART_A(REAL _D)\nX=IC(_D)\nL100\nM17\n");
  const Run good = siemens("G0 X0\nother\nPart_A(10)\nM30\n", settings);
  INFO(good.all_text());
  REQUIRE(good.ok);
  Ends x;
  for (const CanonicalMotion& m : good.sink.motions) x.push_back(m.end[0]);
  CHECK(x == Ends{0, 40, 50, 51});
  CHECK(good.sink.motions[3].line == 3);  // the line of the call
  REQUIRE(good.summary.files.size() == 3);
  CHECK(good.summary.files[0].name == "OTHER.MPF");
  CHECK(good.summary.files[1].name == "part_a.spf");
  CHECK(siemens("G0 X0\nBAD\nM30\n", settings).errors() == Codes{"NC104"});
  CHECK(siemens("G0 X0\nOPEN\nM30\n", settings).errors() == Codes{"NC257"});
  // Names that lead out of the folder are no names of programs.
  const Folder outside("siemens_outside");
  outside.write("SECRET.SPF", "X1\nM17\n");
  for (const char* call : {"CALL \"../smoothpost_siemens_outside/SECRET\"", "CALL \"..\"",
                           "CALL \"A/../L100\"", "CALL \"A\\\\B\""}) {
    CHECK(siemens(std::string(call) + "\nM30\n", settings).errors() == Codes{"NC150", "NC200"});
  }
  fs::create_symlink(outside.path / "SECRET.SPF", folder.path / "LINKED.SPF");
  fs::create_directory(folder.path / "FOLDER.SPF");
  CHECK(siemens("LINKED\nM30\n", settings).errors() == Codes{"NC251"});
  CHECK(siemens("FOLDER\nM30\n", settings).errors() == Codes{"NC251"});
}

TEST_CASE("siemens flow: arrays, kinds of variables and texts", "[formats][nc][siemens]") {
  CHECK(main_ends("DEF REAL A_[3]=SET(1,2,3), B_[2,2]\nB_[1,0]=7\nG0 X=A_[0]+A_[2]\nX=B_[1,0]") ==
        Ends{4, 7});
  CHECK(main_ends("DEF INT I\nDEF REAL A_[4]\nFOR I=0 TO 3\nA_[I]=I*I\nENDFOR\nG0 X=A_[3]") ==
        Ends{9});
  CHECK(main_ends("R[2+1]=5\nG0 X=R3\nX=R[3]*2") == Ends{5, 10});
  CHECK(main_ends("DEF REAL A_[3]\nA_[1]=REP(5)\nG0 X=A_[0]+10*A_[1]+100*A_[2]") == Ends{550});
  CHECK(main_ends("DEF INT I=2.5, J=2.4\nDEF BOOL B_=TRUE\nG0 X=I*10+J\nX=B_") == Ends{32, 1});
  CHECK(errors("DEF REAL A_[3]\nA_[3]=1") == Codes{"NC132"});
  CHECK(errors("DEF REAL A_[3]\nG0 X=A_[-1]") == Codes{"NC131"});
  CHECK(errors("DEF REAL A_[3]\nG0 X=A_") == Codes{"NC131"});
  CHECK(errors("DEF REAL A_[3]\nA_[0]=SET(1,2,3,4)") == Codes{"NC132"});
  CHECK(errors("DEF REAL A_[1000,1000]") == Codes{"NC132"});
  std::string many = "DEF REAL VA_[10000]";
  for (int i = 1; i <= 100; ++i) many += "\nDEF REAL VA_" + std::to_string(i) + "[10000]";
  CHECK(errors(many) == Codes{"NC132"});
  CHECK(errors("G0 X=$AA_IM[X]") == Codes{"NC142", "NC200"});
  CHECK(errors("G0 X=$P_TOOLR") == Codes{"NC131"});
  const Run r = siemens(
      "DEF STRING[20] NAME_=\"lid\"\nR1=2.5\nMSG(\"part \"<<NAME_<<\", \"<<R1<<\" mm\")\nM30\n");
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.sink.event_texts() == Codes{"message text=part lid, 2.5 mm"});
}

TEST_CASE("siemens flow: any damage of a text ends in diagnostics or motions",
          "[formats][nc][siemens]") {
  const std::string text =
      "%_N_PART_MPF\nDEF INT I\nDEF REAL A_[2,3]=SET(1,2)\nEXTERN HOLE(REAL)\n"
      "$P_UIFR[1]=CTRANS(X,5):CROT(Z,30) $P_UIFR[2,X,TR]=R[1]\nG54 G17 G0 X0 Y0 Z5 F500\n"
      "FOR I=0 TO 2\nHOLE(A_[0,I]) P=2\nENDFOR\nA: L7 P2\nREPEAT A P=2\n"
      "CASE (R1) OF 1 GOTOF A DEFAULT GOTOF B\nB: REPEAT\nR1=R1+1\nUNTIL R1>2\nLOOP\nGOTOF C\n"
      "ENDLOOP\nC: MCALL CYCLE83(9,0,2,-9,,-4,,1,0.1,0,1,1)\nHOLES2(0,0,5,0,0,3)\nMCALL\n"
      "MIRROR X0\nASCALE X2 Y2\nTRANS\nG58 X1\nTRANS\nG111 X1 Y1\nG0 AP=0 RP=1\nG3 AP=90 RP=1\nG1 "
      "X0 Y0\nCT X5 Y5\n"
      "G2 I5 J0 AR=90\nPOLY PO[X]=(9,1,2) PO[Y]=(2,3) PL=2\nTRAORI\nORIEULER\nG1 X1 A2=10 B2=5\n"
      "CALL \"HOLE\"\nM30\n%_N_L7_SPF\nX=IC(1) M17\nPROC HOLE(REAL _D=1) DISPLOF\nX=_D\nRET\n";
  nc::InterpreterSettings settings = mill_settings();
  settings.run_budget = 2000;
  INFO(siemens(text, settings).all_text());
  REQUIRE(siemens(text, settings).ok);
  std::size_t read = 0, refused = 0;
  const auto check = [&](const std::string& damaged) {
    const nc::ParsedProgram parsed = nc::parse(damaged, "t", nc::InputDialect::siemens);
    REQUIRE(nc::print(parsed.program) == damaged);
    const Run r = siemens(damaged, settings);
    ++(r.ok ? read : refused);
    REQUIRE((r.ok || !r.errors().empty()));
  };
  for (std::size_t i = 0; i < text.size(); ++i) {
    check(text.substr(0, i));
    std::string without = text;
    check(without.erase(i, 1));
    for (const char c : {'(', ')', '[', ']', '"', ',', '=', 'P', '9', '-', ' ', '\n'}) {
      std::string other = text;
      other[i] = c;
      check(other);
    }
  }
  CHECK(read > 100);
  CHECK(refused > 1000);
}

}  // namespace smoothpost::test
