#include <catch2/catch.hpp>

#include "tests/formats/nc/recording.h"
#include "tests/formats/nc/rs274_oracle.h"

// G7, G8: X words as diameters; G38.2 to G38.5: probing.
namespace smoothpost::test {
namespace {

std::vector<double> ends(const Run& r, std::size_t axis) {
  std::vector<double> out;
  for (const CanonicalMotion& m : r.sink.motions) out.push_back(m.end[axis]);
  return out;
}

/// The motions against those of rs274.
void agree(const std::string& text) {
  INFO(text);
  const Run ours = run(text, oracle_settings());
  INFO(ours.all_text());
  REQUIRE(ours.ok);
  REQUIRE(!ours.sink.motions.empty());
  if (!oracle_present()) return;
  const OracleRun oracle = run_oracle(text);
  INFO(oracle.message);
  REQUIRE(oracle.accepted);
  const Comparison result = compare(ours.sink.motions, oracle);
  INFO(result.problem);
  CHECK(result.problem.empty());
  const std::optional<OracleRun> fine = run_fine_oracle();
  if (!fine) return;
  nc::InterpreterSettings settings = oracle_settings();
  for (auto& [tool, length] : settings.tool_lengths) length = 0.0;
  const Comparison exact = compare(run(text, settings).sink.motions, *fine);
  INFO("nine decimals: " << exact.problem);
  CHECK(exact.problem.empty());
}

}  // namespace

TEST_CASE("lathe: G7 makes X words diameters, G8 radii", "[formats][nc][lathe]") {
  using List = std::vector<double>;
  CHECK(ends(run_lines("G0 X10\nG7\nX10\nG8\nX10"), 0) == List{10.0, 5.0, 10.0});
  // Wherever they stand in the block.
  CHECK(ends(run_lines("G7 G0 X10\nG8 X10\nX10 G7\nX10 G8"), 0) == List{5.0, 10.0, 5.0, 10.0});
  CHECK(ends(run_lines("G7 G0 X10\nG91 X10\nG20 X1"), 0) == List{5.0, 10.0, 22.7});
  CHECK(ends(run_lines("G7 G0 X[4+6] Y10"), 1) == List{10.0});
  CHECK(ends(run_lines("G7 G0 X10\nG53 X8\nG52 X4\nX10"), 0) == List{5.0, 4.0, 7.0});
  CHECK(ends(run_lines("G10 L2 P1 X4 G7\nG0 X10"), 0) == List{7.0});
  CHECK(run_lines("G7 G8").errors() == std::vector<std::string>{"NC204"});
}

TEST_CASE("lathe: radii and centres stay radii, positions of parameters too",
          "[formats][nc][lathe]") {
  const Run r = run_lines("G7 G18 G0 X10 Z0\nG3 X20 Z-5 I5 K0 F100\nG0 X[#5420] Z[#<_x>]");
  INFO(r.all_text());
  REQUIRE(r.ok);
  REQUIRE(r.sink.motions.size() == 3);
  CHECK(r.sink.motions[1].arc.centre.isApprox(Vec3(10.0, 0.0, 0.0)));
  CHECK(r.sink.motions[1].end[0] == Approx(10.0));
  CHECK(r.sink.motions[2].end[0] == Approx(5.0));
  CHECK(r.sink.motions[2].end[2] == Approx(10.0));
  CHECK(ends(run_lines("G0 Y[#<_lathe_diameter_mode>+2*#<_lathe_radius_mode>]\n"
                       "G7\nY[#<_lathe_diameter_mode>+2*#<_lathe_radius_mode>]"),
             1) == std::vector<double>{2.0, 1.0});
}

TEST_CASE("lathe: M70 keeps the mode, M73 until the call ends", "[formats][nc][lathe]") {
  using List = std::vector<double>;
  CHECK(ends(run_lines("G7\nM70\nG8\nM72\nG0 X10"), 0) == List{5.0});
  CHECK(ends(run_lines("o1 sub\nM73\nG7 G0 X10\no1 endsub\no1 call\nX10"), 0) == List{5.0, 10.0});
  // After a refused block the mode is that of the block.
  CHECK(run_lines("G7 X1 X2\nG0 X10").sink.motions.front().end[0] == 5.0);
}

TEST_CASE("lathe: G7 is another code in other dialects", "[formats][nc][lathe]") {
  for (const auto dialect : {nc::InputDialect::fanuc, nc::InputDialect::haas}) {
    CHECK(run("G7\nM30\n", {}, dialect).errors() == std::vector<std::string>{"NC202"});
    CHECK(run("G31.\nG38.2\nM30\n", {}, dialect).errors() ==
          std::vector<std::string>{"NC202", "NC202"});
  }
}

TEST_CASE("probing: a marked feed to the programmed end, a result without a touch",
          "[formats][nc][probe]") {
  const Run r = run_lines(
      "G0 X1 Y2 Z9 A4\nF60\nG38.2 Z3\nG38.3 X[#5061+#5062+#5063+#5064] Y[#5070]\nX20\nG1 X0");
  INFO(r.all_text());
  REQUIRE(r.ok);
  const auto& m = r.sink.motions;
  REQUIRE(m.size() == 5);
  for (std::size_t i = 0; i < 5; ++i) {
    CHECK(m[i].probe == (i >= 1 && i <= 3));
    CHECK(m[i].kind == (i == 0 ? MotionKind::rapid : MotionKind::feed));
  }
  CHECK(m[1].end[2] == 3.0);
  CHECK(m[1].duration == Approx(6.0));
  CHECK(m[2].end[0] == Approx(1.0 + 2.0 + 3.0 + 4.0));
  CHECK(m[2].end[1] == 0.0);
  CHECK(m[3].end[0] == 20.0);
}

TEST_CASE("probing: results are known behind a probe only, and of axes that are known",
          "[formats][nc][probe]") {
  using List = std::vector<std::string>;
  CHECK(run_lines("G0 X[#5061]").errors() == List{"NC131"});
  CHECK(run_lines("F9 G38.2 Z1\nG0 X[#5063] Y[#5070]").ok);
  CHECK(run_lines("F9 G38.2 Z1\nG0 X[#5062]").errors() == List{"NC131"});
  CHECK(run_lines("#5062=7\nF9 G38.2 Z1\nG0 X[#5062]").errors() == List{"NC131"});
}

TEST_CASE("probing: what LinuxCNC refuses is refused", "[formats][nc][probe][oracle]") {
  const std::pair<const char*, const char*> rows[] = {{"F100 G38.2", "NC267"},
                                                      {"G93\nF1 G38.2 X5", "NC267"},
                                                      {"M3 S9 G95\nF1 G38.2 X5", "NC267"},
                                                      {"F100 G38.2 X0", "NC267"},
                                                      {"F100 G38.4 X0", "NC267"},
                                                      {"F100 G1 X5 G41 D1\nX9\nG38.2 X20", "NC264"},
                                                      {"G38.2 X5", "NC213"},
                                                      {"F100 G38.2 X5 I3", "NC215"},
                                                      {"F100 G38.2 X5 R3", "NC215"},
                                                      {"F100 G38.2 X5 P3", "NC215"},
                                                      {"F100 G53 G38.2 X5", "NC216"},
                                                      {"F100 G38.6 X5", "NC201"}};
  for (const auto& [line, code] : rows) {
    const std::string text = std::string("G0 X0 Y0 Z0\n") + line + "\nM2\n";
    INFO(text);
    nc::InterpreterSettings settings = oracle_settings();
    settings.tool_diameters[1] = 2.54;
    CHECK(run(text, settings).has(code));
    if (oracle_present()) CHECK_FALSE(run_oracle(text).accepted);
  }
  nc::InterpreterSettings plain;
  plain.plain_blocks = true;
  const Run r = run_lines("F100 G38.2 X5", plain);
  CHECK(r.errors() == std::vector<std::string>{"NC202"});
  CHECK(r.all_text().find("where the probe says") != std::string::npos);
}

TEST_CASE("lathe and probing against rs274", "[formats][nc][lathe][oracle]") {
  const char* programs[] = {
      "G21 G18 F100\nG7 G0 X10 Z1\nG1 X20 Z2\nG91 X10\nG90 G2 X20 Z10 R50\nG8 X4 R9\nG53 G0 X40",
      "G21 G7 G0 X10 Y1\nG52 X10\nX10\nG52 X0\nG92 X20\nX10\nG92.1\nX10\nG10 L2 P1 X10\nX10\n"
      "G10 L20 P1 X30\nX10",
      "G21 G7 F100 G0 X10 Z5\nG81 X20 Y3 Z1 R5\nG80\nG0 X20 G8\nG7\nM70\nG8\nM72\nX40\nG28.1\n"
      "G0 X1\nG28 X10",
      "G21 S100 M3\nG7 G0 X20 Z0\nG76 P1 Z-20 I-2 J0.5 K1 E4 L3 Q30 R1 H1",
      "G21 F10\nG19 G7 G0 X20 Y0 Z0\nG83 X-4 R6 Q4\nG80\nG91 G81 X-4 R6 L2",
      "G20 F9 G7 G0 X1 Y1\nG1 X#5420\nY[#<_lathe_diameter_mode>]\nG21 G1 X40 G8",
      "G21 S100 M3\nG7 G0 X10 Z0\nG76 P1 Z-10 I-2 J0.5 K1\nG33 Z-20 X12 K1",
      "G21 F100 G0 X0 Y0 Z10\nG38.2 Z-5\nG0 Z10\nG38.3 X[#5063] Y-7\nG0 X0 Y0 Z[#5070]\n"
      "G38.5 Z-3\nZ8\nG0 X1 Y1 Z1",
      "G21 F100 G0 X0 Y0 Z10\nG38.3 Z10\nG38.5 X0\nG0 X[1+#5070]",
      "G21 F100 G10 L2 P1 X5 R90\nG0 X1 Y1 Z0\nG38.2 X2\nG0 X[#5061+1] Y[#5062] Z0"};
  for (const char* program : programs) agree(std::string(program) + "\nM2\n");
}

}  // namespace smoothpost::test
