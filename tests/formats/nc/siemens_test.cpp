#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "formats/nc/number_text.h"
#include "tests/formats/nc/recording.h"
#include "tests/support/support.h"

namespace smoothpost::test {
namespace {

Run siemens(const std::string& lines, nc::InterpreterSettings settings = mill_settings()) {
  return run(lines + "\nM30\n", settings, nc::InputDialect::siemens);
}

CanonicalMotion last(const Run& r) {
  INFO(r.all_text());
  REQUIRE(r.ok);
  REQUIRE_FALSE(r.sink.motions.empty());
  return r.sink.motions.back();
}

}  // namespace

TEST_CASE("siemens: words with and without =", "[formats][nc][siemens]") {
  const auto& m = last(siemens("N10 G0 X10 Y=2.5 Z=-1.5EX1 U = 3 A=30 ; comment"));
  CHECK(m.end[0] == 10.0);
  CHECK(m.end[1] == 2.5);
  CHECK(m.end[2] == Approx(-15.0));
  CHECK(m.end[6] == 3.0);
  CHECK(degrees(m.end[3]) == Approx(30.0));
  CHECK(last(siemens("R1=5 R2=R1*2\nG0 X=R1+R2 Y=(R1-1)/2 Z=-R1")).end[0] == 15.0);
  CHECK(last(siemens("DEF REAL _A, _B=2\n_A=3\nG0 X=_A*_B")).end[0] == 6.0);
  CHECK(last(siemens("R1=30\nG0 X=100*SIN(R1) Y=SQRT(16)")).end[0] == Approx(50.0));
  CHECK(last(siemens("G0 X=7 DIV 2 Y=7 MOD 4")).end[0] == 3.0);
}

TEST_CASE("siemens: G90, G91, AC and IC", "[formats][nc][siemens]") {
  const Run r = siemens("G90 G0 X10 Y10\nG1 X=IC(5) Y20 F100\nG91 X1 Y=AC(7)\nX1");
  const auto& m = r.sink.motions;
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(m[1].end[0] == 15.0);
  CHECK(m[1].end[1] == 20.0);
  CHECK(m[2].end[0] == 16.0);
  CHECK(m[2].end[1] == 7.0);
  CHECK(m[3].end[0] == 17.0);
}

TEST_CASE("siemens: motion starts in G1", "[formats][nc][siemens]") {
  CHECK(siemens("X10 F1000").sink.motions.front().kind == MotionKind::feed);
  CHECK(siemens("X10").errors() == std::vector<std::string>{"NC213"});
}

TEST_CASE("siemens: arcs by I J, I=AC, CR and TURN", "[formats][nc][siemens]") {
  const auto& a = last(siemens("G0 X10 Y0 Z0\nG3 X0 Y10 I-10 J0 F100"));
  CHECK(degrees(a.arc.sweep) == Approx(90.0));
  CHECK(a.arc.centre.norm() == Approx(0.0).margin(1e-12));
  const auto& b = last(siemens("G0 X10 Y0 Z0\nG2 X0 Y10 I=AC(0) J=AC(0) F100"));
  CHECK(degrees(b.arc.sweep) == Approx(-270.0));
  const auto& c = last(siemens("G0 X10 Y0 Z0\nG3 X0 Y10 CR=10 F100"));
  CHECK(c.arc.centre.norm() == Approx(0.0).margin(1e-9));
  const auto& d = last(siemens("G0 X10 Y0 Z0\nG3 X0 Y10 CR=-10 F100"));
  CHECK(degrees(d.arc.sweep) == Approx(270.0));
  const auto& e = last(siemens("G0 X10 Y0 Z0\nG3 X0 Y10 Z-5 I-10 J0 TURN=2 F100"));
  CHECK(degrees(e.arc.sweep) == Approx(810.0));
  CHECK(siemens("G0 X0 Y0\nG2 X5 F10").errors() == std::vector<std::string>{"NC220"});
}

TEST_CASE("siemens: TRAORI with vectors", "[formats][nc][siemens]") {
  const Run r = siemens(
      "TRAORI\nORIWKS ORIVECT\nG0 X0 Y0 Z50 A3=0 B3=0 C3=2\nG1 X10 Z1 A3=1 C3=1 F600\nX20\n"
      "A3=0 B3=1 C3=0\nTRAFOOF\nG0 X1");
  INFO(r.all_text());
  REQUIRE(r.ok);
  const auto& m = r.sink.motions;
  REQUIRE(m.size() == 5);
  CHECK(m[0].tcp);
  CHECK(m[0].axis_vector);
  CHECK(m[0].start_axis.isZero());
  CHECK(m[0].end_axis == Vec3(Vec3::UnitZ()));
  CHECK((m[0].unknown_start & 0x38) == 0x38);
  CHECK((m[0].unknown_end & 0x3f) == 0);
  CHECK(m[1].start_axis == m[0].end_axis);
  CHECK(m[1].end_axis.isApprox(Vec3(1, 0, 1).normalized()));
  CHECK(m[2].axis_vector);  // the axis stays
  CHECK(m[2].start_axis == m[2].end_axis);
  CHECK(m[3].axis_vector);  // a turn about the tip
  CHECK(m[3].end_axis == Vec3(Vec3::UnitY()));
  CHECK(m[3].duration == Approx(90.0 / 600.0 * 60.0));
  CHECK_FALSE(m[4].tcp);
  CHECK_FALSE(m[4].axis_vector);
  CHECK(r.summary.uses_tcp);
  CHECK_FALSE(r.summary.uses_rotary);
}

TEST_CASE("siemens: vectors need no input machine and rotary words do", "[formats][nc][siemens]") {
  nc::InterpreterSettings settings = mill_settings();
  settings.any_axis_needs_machine = true;
  CHECK(siemens("TRAORI\nG0 X0 Y0 Z0 A3=0 B3=0 C3=1", settings).ok);
  CHECK(siemens("TRAORI\nG0 X0 Y0 Z0 B=5", settings).errors() == std::vector<std::string>{"US110"});
}

TEST_CASE("siemens: TRAORI with rotary words", "[formats][nc][siemens]") {
  const Run r = siemens("TRAORI\nG0 X0 Y0 Z50 B=10 C=20\nG1 X5 B=15 F100\nA3=1 B3=0 C3=1");
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.sink.motions[1].tcp);
  CHECK_FALSE(r.sink.motions[1].axis_vector);
  CHECK(degrees(r.sink.motions[1].end[4]) == Approx(15.0));
  CHECK(r.sink.motions[2].start_axis.isZero());  // known to the machine only
}

TEST_CASE("siemens: units of lengths and of the feed", "[formats][nc][siemens]") {
  const auto duration = [](const std::string& unit) {
    return last(siemens("G0 X0 Y0 Z0\n" + unit + "\nG1 X10 F10")).duration;
  };
  CHECK(duration("G71") == Approx(60.0));
  CHECK(duration("G710") == Approx(60.0));
  CHECK(duration("G700") == Approx(60.0));        // 10 inch at 10 inch/min
  CHECK(duration("G70") == Approx(60.0 * 25.4));  // 10 inch at 10 mm/min
  CHECK(last(siemens("G700\nG2 G17 X1 Y0 CR=1 F10")).end[0] == Approx(25.4));
}

TEST_CASE("siemens: frames", "[formats][nc][siemens]") {
  const auto end = [](const std::string& lines) {
    const auto& m = last(siemens(lines));
    return Vec3(m.end[0], m.end[1], m.end[2]);
  };
  CHECK(end("TRANS X10 Y20\nG0 X1 Y2 Z3").isApprox(Vec3(11, 22, 3)));
  CHECK(end("TRANS X10\nATRANS X5\nG0 X1 Y2 Z3").isApprox(Vec3(16, 2, 3)));
  CHECK(end("TRANS X10\nTRANS Y5\nG0 X1 Y2 Z3").isApprox(Vec3(1, 7, 3)));
  CHECK(end("TRANS X10\nTRANS\nG0 X1 Y2 Z3").isApprox(Vec3(1, 2, 3)));
  CHECK(end("ROT Z90\nG0 X1 Y0 Z3").isApprox(Vec3(0, 1, 3)));
  CHECK(end("G18\nROT RPL=90\nG0 X1 Y0 Z0").isApprox(Vec3(0, 0, -1)));
  CHECK(end("TRANS X10\nAROT Z90\nATRANS X5\nG0 X1 Y0 Z0").isApprox(Vec3(10, 6, 0)));
  // Z first, then the new Y, then the new X.
  CHECK(end("ROT X90 Z90\nG0 X0 Y1 Z0").isApprox(Vec3(0, 0, 1)));
  const Run r = siemens("ROT Y90\nTRAORI\nG0 X1 Y0 Z0 A3=0 B3=0 C3=1\nG3 X0 Y1 Z0 I-1 J0 F10");
  const auto& m = last(r);
  CHECK(m.end_axis.isApprox(Vec3::UnitX()));
  CHECK(m.arc.normal.isApprox(Vec3::UnitX()));
  CHECK(siemens("TRANS X1 G0").errors() == std::vector<std::string>{"NC211"});
  CHECK(end("G500\nG0 X1 Y1 Z1").isApprox(Vec3(1, 1, 1)));
}

TEST_CASE("siemens: tools, edges and lengths", "[formats][nc][siemens]") {
  const Run r = siemens("T1\nM6\nG0 X0 Y0 Z0\nD0\nD1\nT=\"DRILL\" M6\nT2 M6");
  INFO(r.all_text());
  REQUIRE(r.ok);
  std::vector<std::string> lengths;
  for (const Call& call : r.sink.of("tool_length")) {
    lengths.push_back(std::to_string(call.integer) + ":" + std::to_string(int(call.number)));
  }
  CHECK(lengths == std::vector<std::string>{"1:50", "0:0", "1:50", "0:0", "2:20"});
  CHECK(r.sink.event_texts() == std::vector<std::string>{"tool_change tool=1",
                                                         "tool_change tool=DRILL",
                                                         "tool_change tool=2"});
  CHECK(r.has("NC244"));  // the length of DRILL
}

TEST_CASE("siemens: process words and messages", "[formats][nc][siemens]") {
  const Run r = siemens("MSG(\"a (b)\")\nM3 S500\nG4 F2.5\nM8\nMSG()\nM5");
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.sink.event_texts() == std::vector<std::string>{"message text=a (b)", "spindle_on rpm=500",
                                                         "coolant_on", "spindle_off"});
  CHECK(r.sink.of("dwell").front().number == 2.5);
  nc::InterpreterSettings settings;
  const std::pair<const char*, const char*> rows[] = {{"tool_change", "T=\"{tool}\" M6"},
                                                      {"message", "MSG(\"{text}\")"},
                                                      {"port", "$A_OUT[1]=1"},
                                                      {"power", "H1={percent}"}};
  for (const auto& [event, text] : rows) {
    EventWords words;
    words.event = event;
    words.text = text;
    settings.process.events.push_back(words);
  }
  const Run named = siemens("T=\"LASER\" M6\nH1=30", settings);
  // H1= is an extended address, which is not read.
  CHECK(named.errors() == std::vector<std::string>{"NC140", "NC200"});
  CHECK(named.sink.event_texts() == std::vector<std::string>{"tool_change tool=LASER"});
}

TEST_CASE("siemens: words of the path mode have no effect", "[formats][nc][siemens]") {
  const Run r = siemens(
      "%_N_PART_MPF\n;$PATH=/_N_MPF_DIR\nN10 G60 G601 G9 SOFT FFWON BRISK FFWOF FNORM\n"
      "N20 COMPCAD G642 CTOL=0.02 OTOL=0.1 ADIS=0.5 G641 STOPRE\nN30 G0 X1 G64\n/1 N40 Y2\n"
      "LABEL: Z3\nUPATH COMPOF",
      mill_settings());
  CHECK(r.errors() == std::vector<std::string>{"NC204"});  // G642 and G641
  const Run good = siemens(
      "WORKPIECE(,\"\",,\"BOX\",112,0,-20,-80,0,0,100,100)\n"
      "GROUP_BEGIN(0,\"finish\",0,0)\nGROUP_END(0,0)\nG642 COMPCAD SOFT\nG60 G601 G9\nSUPA G0 Z=5 "
      "D0\nG1 X1 F5");
  INFO(good.all_text());
  REQUIRE(good.ok);
  CHECK(good.sink.motions.front().machine_position);
  CHECK_FALSE(good.sink.motions.back().machine_position);
}

TEST_CASE("siemens: what is refused is named with line and column", "[formats][nc][siemens]") {
  struct Row {
    const char* line;
    const char* code;
    int column;
    const char* says;
  };
  const Row rows[] = {{"G1 X1 F1 A4=5", "NC140", 10, "A3="},
                      {"N5 BSPLINE X1", "NC140", 4, "splines"},
                      {"POLY PO[PHI]=5", "NC140", 6, "PO[X]"},
                      {"IF R1>5 GOTOF", "NC150", 13, "label"},
                      {"FOR R1=1 5", "NC150", 10, "TO"},
                      {"FOR R1=1 TO 5", "NC250", 1, "no end"},
                      {"G1 X1 GOTOB A", "NC150", 7, "before it"},
                      {"MCALL SLOT1(1,2)", "NC140", 7, "CYCLE81"},
                      {"MCALL CYCLE84(1,2)", "NC260", 1, "spindle"},
                      {"MCALL CYCLE81(1,2)", "NC260", 1, "DP"},
                      {"CYCLE800(1,\"T\",0)", "NC245", 1, "MODE 57"},
                      {"TOFRAME", "NC140", 1, "frame"},
                      {"TRANSMIT", "NC140", 1, "transformation"},
                      {"G0 X=DC(30)", "NC141", 4, "DC()"},
                      {"L100", "NC251", 1, "L100.SPF"},
                      {"N10 NO_SUCH(5)", "NC251", 5, "NO_SUCH.SPF"},
                      {"G1 X1 NO_SUCH", "NC140", 7, "no word"},
                      {"PCALL /_N_A", "NC140", 1, "channels"},
                      {"G999.8 X1", "NC141", 1, "G code"},
                      {"G0 X=_UNKNOWN", "NC131", 6, "_UNKNOWN"},
                      {"_UNKNOWN=5", "NC140", 1, "variable"},
                      {"G0 X=(1+2", "NC142", 6, "not closed"},
                      {"R1=1/0", "NC132", 5, "zero"},
                      {"MSG(\"x", "NC143", 1, "closed"},
                      {"T=\"x", "NC143", 1, "closed"},
                      {"G0 X1 (comment)", "NC143", 7, "begins no word"},
                      {"G0 A3=1", "NC243", 4, "TRAORI"},
                      {"G41 X1", "NC202", 1, "compensation"},
                      {"G81 X1", "NC201", 1, "G81"},
                      {"G0 X1.2.3", "NC105", 4, "X1.2"},
                      {"DEF AXIS A", "NC140", 1, "DEF"},
                      {"INVCW X1 Y1", "NC140", 1, "arc"},
                      {"GOTOF NOWHERE", "NC250", 1, "NOWHERE"},
                      {"G4 S3", "NC217", 1, "seconds"}};
  for (const Row& row : rows) {
    const std::string text = std::string(row.line) + "\nM30\n";
    const Run r = run(text, mill_settings(), nc::InputDialect::siemens);
    INFO(row.line << "\n" << r.all_text());
    REQUIRE_FALSE(r.ok);
    const Diagnostic& d = r.diagnostics.front();
    CHECK(d.code == row.code);
    CHECK(d.where.line == 1);
    CHECK(d.where.column == row.column);
    CHECK(d.text.find(row.says) != std::string::npos);
    CHECK(nc::print(nc::parse(text, "t", nc::InputDialect::siemens).program) == text);
  }
}

TEST_CASE("siemens: CIP through a point in space", "[formats][nc][siemens]") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-40.0, 40.0);
  const auto point = [&] {
    return Vec3(std::round(place(random)), std::round(place(random)), std::round(place(random)));
  };
  const auto words = [](const Vec3& p, const char* x, const char* y, const char* z) {
    return std::string(x) + nc::decimal_text(p.x(), 0) + " " + y + nc::decimal_text(p.y(), 0) +
           " " + z + nc::decimal_text(p.z(), 0) + " ";
  };
  int arcs = 0;
  for (int i = 0; i < 60; ++i) {
    const Vec3 start = point(), through = point(), end = point();
    if ((through - start).cross(end - start).norm() < 1.0) continue;
    ++arcs;
    const CanonicalMotion m =
        last(siemens("G0 " + words(start, "X", "Y", "Z") + "\nCIP " + words(end, "X", "Y", "Z") +
                     words(through, "I1=", "J1=", "K1=") + "F600"));
    REQUIRE(m.is_arc);
    const auto at = [&](double s) -> Vec3 {
      return m.arc.centre + rotation_about(m.arc.normal, s * m.arc.sweep) * (start - m.arc.centre);
    };
    CHECK((at(1.0) - end).norm() < 1e-8);
    CHECK(std::abs(m.arc.normal.dot(through - start)) < 1e-9);
    double nearest = 1e9;
    for (int k = 0; k <= 20000; ++k)
      nearest = std::min(nearest, (at(k / 20000.0) - through).norm());
    CHECK(nearest < 0.1);
    CHECK(m.duration == Approx((start - m.arc.centre).norm() * m.arc.sweep / 10.0));
  }
  CHECK(arcs > 50);
  const CanonicalMotion incremental =
      last(siemens("G0 X10 Y0 Z0\nG91 CIP X-20 Y0 I1=-10 J1=AC(10) F100"));
  CHECK(degrees(incremental.arc.sweep) == Approx(180.0));
  CHECK(incremental.arc.normal == Vec3(Vec3::UnitZ()));
  CHECK(siemens("G0 X0 Y0 Z0\nCIP X2 Y0 I1=1 F1").errors() == std::vector<std::string>{"NC221"});
}

TEST_CASE("siemens: rotary positions by a sense", "[formats][nc][siemens]") {
  const Run r = siemens("G0 C=350\nC=DC(10)\nC=ACP(0)\nC=ACN(350)\nC=ACP(350)\nC=10");
  INFO(r.all_text());
  REQUIRE(r.ok);
  const double expected[] = {350.0, 370.0, 720.0, 710.0, 710.0, 10.0};
  for (std::size_t i = 0; i < 6; ++i)
    CHECK(degrees(r.sink.motions[i].end[5]) == Approx(expected[i]));
}

TEST_CASE("siemens: jumps and branches and loops", "[formats][nc][siemens]") {
  const auto ends = [](const std::string& lines) {
    const Run r = siemens(lines);
    INFO(lines << "\n" << r.all_text());
    REQUIRE(r.ok);
    std::vector<double> out;
    for (const CanonicalMotion& m : r.sink.motions) out.push_back(m.end[0]);
    return out;
  };
  using Ends = std::vector<double>;
  CHECK(ends("R1=0\nAGAIN: R1=R1+1\nG0 X=R1\nIF R1<3 GOTOB AGAIN\nX9") == Ends{1, 2, 3, 9});
  CHECK(ends("GOTOF OVER\nG0 X1\nOVER:\nG0 X2") == Ends{2});
  CHECK(ends("N10 GOTO N40\nN20 G0 X1\nN40 G0 X2") == Ends{2});
  CHECK(ends("R1=2\nIF R1==1\nG0 X1\nELSE\nIF R1<>1\nG0 X2\nENDIF\nENDIF\nG0 X3") == Ends{2, 3});
  CHECK(ends("WHILE R1<2\nWHILE R2<2\nR2=R2+1\nG0 X=10*R1+R2\nENDWHILE\nR2=0 R1=R1+1\nENDWHILE") ==
        Ends{1, 2, 11, 12});
  CHECK(ends("IF (R1==0) AND NOT (R2>5) OR FALSE GOTOF A\nG0 X1\nA: G0 X2") == Ends{2});
  CHECK(ends("IF 1 XOR 1 GOTOF A\nG0 X1\nA: G0 X2") == Ends{1, 2});
  const auto errors = [](const std::string& lines) { return siemens(lines).errors(); };
  using Codes = std::vector<std::string>;
  CHECK(errors("A: G0 X1\nGOTOB A") == Codes{"NC252"});
  CHECK(errors("GOTOB A\nA: G0 X1") == Codes{"NC250"});
  CHECK(errors("IF R1==0\nG0 X1") == Codes{"NC250"});
  CHECK(errors("ENDWHILE") == Codes{"NC250"});
  CHECK(errors("IF _A>1 GOTOF B\nB: G0 X1") == Codes{"NC254"});
}

TEST_CASE("siemens: drilling by CYCLE81 and CYCLE82", "[formats][nc][siemens]") {
  const auto heights = [](const std::string& lines) {
    const Run r = siemens("G17 G0 X0 Y0 Z50 F600\n" + lines);
    INFO(lines << "\n" << r.all_text());
    REQUIRE(r.ok);
    std::vector<std::string> out;
    for (const CanonicalMotion& m : r.sink.motions)
      out.push_back((m.kind == MotionKind::feed ? "f" : "r") + nc::decimal_text(m.end[0], 3) + " " +
                    nc::decimal_text(m.end[2], 3));
    return out;
  };
  using Heights = std::vector<std::string>;
  CHECK(heights("MCALL CYCLE81(20,1,2,-5)\nG0 X10\nX30\nMCALL\nX40") ==
        Heights{"r0 50", "r10 50", "r10 3", "f10 -5", "r10 20", "r30 20", "r30 3", "f30 -5",
                "r30 20", "r40 20"});
  CHECK(heights("R1=4\nCYCLE82(20,1,2,,R1+2,0.5)") == Heights{"r0 50", "r0 3", "f0 -5", "r0 20"});
  CHECK(siemens("G0 X0 Y0 Z50 F600\nCYCLE82(20,1,2,,6,0.5)").sink.of("dwell").size() == 1);
  const auto errors = [](const std::string& lines) { return siemens(lines).errors(); };
  using Codes = std::vector<std::string>;
  CHECK(errors("G0 X0 Y0 Z50\nCYCLE81(20,1,2,-5)") == Codes{"NC261"});        // no feed
  CHECK(errors("G0 X0 F5\nCYCLE81(20,1,2,-5)") == Codes{"NC261"});            // Y Z unknown
  CHECK(errors("G0 X0 Y0 Z50 F5\nCYCLE81(20,1,2,5)") == Codes{"NC260"});      // above
  CHECK(errors("G0 X0 Y0 Z50 F5\nCYCLE81(20,1,2,-5,,1)") == Codes{"NC260"});  // another meaning
}

TEST_CASE("siemens: vectors are refused where they have no meaning", "[formats][nc][siemens]") {
  const auto code = [](const std::string& lines) { return siemens(lines).errors(); };
  const auto one = std::vector<std::string>{"NC243"};
  CHECK(code("TRAORI\nORIMKS\nG0 X0 A3=1") == one);
  CHECK(code("TRAORI\nG0 X0 A3=0 B3=0 C3=0") == one);
  CHECK(code("TRAORI\nG0 X0 A3=1 B=5") == one);
}

TEST_CASE("siemens: corpus programs", "[formats][nc][siemens][corpus]") {
  const auto folder = shared_path("corpus/1_five_axis/ElMoe/NC_code");
  if (!folder) {
    WARN("no corpus beside the checkout: skipped");
    return;
  }
  nc::InterpreterSettings settings = mill_settings();
  settings.process.unmapped = UnmappedWords::comment;
  const std::string cross = read_bytes(*folder / "Coordinate_system_representation_Achskreuz" /
                                       "Coordinate_system_representation_Achskreuz.mpf");
  const Run r = run(cross, settings, nc::InputDialect::siemens);
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.sink.motions.size() == 2606);
  CHECK(r.summary.uses_tcp);
  CHECK(r.summary.ended);
  const Run keys =
      run(read_bytes(*folder / "Keychain_Schluesselanhaenger" / "Keychain_Schluesselanhaenger.mpf"),
          settings, nc::InputDialect::siemens);
  INFO(keys.all_text());
  CHECK(keys.ok);
  std::size_t drilled = 0;  // by MCALL CYCLE81 in line 632
  for (const CanonicalMotion& m : keys.sink.motions) drilled += m.line == 633 ? 1 : 0;
  CHECK(drilled == 4);
}

}  // namespace smoothpost::test
