#include <catch2/catch.hpp>
#include <random>

#include "machines/dialects/siemens_840d.h"
#include "tests/machines/dialects/random_programs.h"

// Blocks of joints along polynomials.
using namespace smoothpost;
using namespace smoothpost::test;

namespace {

/// Some of the feeds become polynomials, of degree 3 or 5, some joints of them straight.
void bend_some(MachineProgram& program, std::mt19937& rng, int degree) {
  std::bernoulli_distribution half(0.5);
  std::normal_distribution<double> normal;
  for (std::size_t i = 1; i < program.moves.size(); ++i) {
    MachineMove& move = program.moves[i];
    if (move.rapid || half(rng)) continue;
    move.bend = JointBend::Zero(move.to.size(), 4);
    for (Eigen::Index j = 0; j < move.to.size(); ++j)
      for (Eigen::Index k = 0; k < degree - 1; ++k)
        if (half(rng)) move.bend(j, k) = normal(rng);
  }
}

const std::string kHead = "TRAFOOF\nG17 G710 G90 G94 G40 G60 G601 RTLION\n";

}  // namespace

TEST_CASE("siemens_840d: read_back(emit(x)) is x to the printed digits along polynomials",
          "[machines][dialects]") {
  std::mt19937 rng(52);
  std::size_t bent = 0;
  for (const char* name : {"head_table_bc", "laser_5p1"})
    for (const char* units : {"mm", "inch"})
      for (const int degree : {3, 5}) {
        const auto machine = shipped_machine(name, {{"dialect.units", units}});
        for (int round = 0; round < 100; ++round) {
          auto program = random_joint_program(machine, rng, 8);
          bend_some(program, rng, degree);
          const auto out = emitted(siemens_840d::kDialect, machine, program);
          CHECK((out.text.find("=PO(") == std::string::npos || degree == 5));
          const auto back = read_back(siemens_840d::kDialect, machine, out.text);
          REQUIRE(back.offset_guard);
          REQUIRE(back.moves.size() == program.moves.size());
          for (std::size_t i = 0; i < program.moves.size(); ++i) {
            const MachineMove& planned = program.moves[i];
            const ReadBackMove& found = back.moves[i];
            REQUIRE(found.line == out.move_lines[i]);
            require_same_joints(machine, planned, found);
            if (!planned.rapid) REQUIRE(found.duration == Approx(planned.duration).epsilon(1e-5));
            if (planned.bend.rows() == 0 || planned.bend.isZero()) {
              REQUIRE(found.bend.rows() == 0);
              continue;
            }
            REQUIRE(found.bend.rows() == machine.size());
            ++bent;
            for (int j = 0; j < machine.size(); ++j)
              REQUIRE((planned.bend.row(j) - found.bend.row(j)).cwiseAbs().maxCoeff() <=
                      half_digit(machine, j));
          }
        }
      }
  CHECK(bent > 1000);
}

TEST_CASE("siemens_840d: a polynomial says where the axis is on the way", "[machines][dialects]") {
  const auto machine = shipped_machine("head_table_bc", {{"dialect.offset_guard", "false"}});
  // The manual's example in X, over 0 to 2: f = 10 + a1 p − 2.5 p² with f(2) = 0.
  const auto back = read_back(siemens_840d::kDialect, machine,
                              kHead +
                                  "UPATH\nG500 D0\nG0 X10 Y0 Z0 B0 C0\nG93\n"
                                  "POLY PO[X]=(0,-2.5) C=PO(30,1,2,3,4) PL=2 F60\nG94\nM30\n");
  REQUIRE(back.moves.size() == 2);
  const JointBend& bend = back.moves[1].bend;
  REQUIRE(bend.rows() == machine.size());
  const int x = machine.axis_by_letter('X'), c = machine.axis_by_letter('C');
  CHECK(back.moves[1].to[x] == 0.0);
  CHECK(bend(x, 0) == Approx(-10.0));
  CHECK(bend.row(x).tail(3).isZero());
  for (int k = 0; k < 4; ++k)
    CHECK(bend(c, k) == Approx(radians_from_degrees((k + 1) * std::pow(2.0, k + 2))));
  CHECK(bend.row(machine.axis_by_letter('Y')).isZero());
}

TEST_CASE("siemens_840d: polynomials that could move differently are refused",
          "[machines][dialects]") {
  const auto machine = shipped_machine("head_table_bc", {{"dialect.offset_guard", "false"}});
  const std::string start = "G500 D0\nG0 X10 Y0 Z0 B0 C0\nG93\n", upath = kHead + "UPATH\n";
  const std::string poly = "POLY PO[X]=(0,-2.5) PL=1 F60\n", end = "G94\nM30\n";
  REQUIRE(siemens_840d::read_back(machine, upath + start + poly + end, "p").ok());
  REQUIRE(siemens_840d::read_back(machine, upath + start + "G1 X5 F60\n" + end, "p").ok());
  const std::string bad[] = {
      upath + start + "G1 G91 X5 F60\n" + end,  // a G word that a motion has nothing to do with
      kHead + start + poly + end,               // no UPATH
      kHead + "SPATH\n" + start + poly + end,   // along the length
      upath + start + "SPATH\n" + poly + end,   // back to it
      upath + start + "POLYPATH(\"VECT\")\n" + poly + end,     // axes straight
      upath + start + "FGROUP(X,Y)\n" + poly + end,            // another length
      upath + start + "G94\n" + poly + end,                    // F is no time
      upath + start + "POLY PO[X]=(0,-2.5) PL=1\n" + end,      // no F
      upath + "G500 D0\nG93\n" + poly + end,                   // from nowhere
      upath + "G500 D0\nG0 X10 Y0 Z0 B0\nG93\n" + poly + end,  // C unknown
      upath + start + "POLY SUPA PO[X]=(0,-2.5) PL=1 F60\n" + end,
      upath + start + "D1\n" + poly + end,                     // a tool length
      upath + start + "POLY PO[U]=(0,-2.5) PL=1 F60\n" + end,  // no such axis
      upath + start + "POLY PO[F]=(60,1) PO[X]=(0,1) PL=1\n" + end,
      upath + start + "D1\nTRAORI\nG54\nORIWKS ORIVECT\n" +
          "POLY PO[X]=(0,-2.5) Y0 Z0 A3=0 B3=0 C3=1 PL=1 F60\nTRAFOOF\n" + end};
  for (const std::string& text : bad) {
    INFO(text);
    CHECK_FALSE(siemens_840d::read_back(machine, text, "p").ok());
  }
  // An event's words neither.
  auto with_event = machine;
  with_event.process.events.push_back({"gas_on", "SPATH", true, 0.0, 0.0});
  CHECK_FALSE(
      siemens_840d::read_back(with_event, upath + start + "SPATH\n" + poly + end, "p").ok());
}

TEST_CASE("siemens_840d: polynomials that have no words are not printed", "[machines][dialects]") {
  const auto machine = shipped_machine("head_table_bc");
  std::mt19937 rng(53);
  auto program = random_joint_program(machine, rng, 3);
  for (auto& move : program.moves) {
    move.rapid = false;
    move.duration = 1.0;
  }
  program.moves[1].bend = JointBend::Ones(machine.size(), 4);
  REQUIRE(siemens_840d::emit(machine, program).ok());
  auto rapid = program;
  rapid.moves[1].rapid = true;
  auto tool = program;
  tool.moves[2].interpolation = MoveInterpolation::tool;
  for (const auto& refused : {rapid, tool}) {
    const auto out = siemens_840d::emit(machine, refused);
    REQUIRE_FALSE(out.ok());
    CHECK(out.diagnostics()[0].code == "PR203");
  }
  // What no digit is left of is a straight block.
  program.moves[1].bend *= 1e-9;
  const auto text = emitted(siemens_840d::kDialect, machine, program).text;
  CHECK(text.find("POLY") == std::string::npos);
  CHECK(read_back(siemens_840d::kDialect, machine, text).moves[1].bend.rows() == 0);
}

TEST_CASE("siemens_840d: prefixes and mutations of polynomials end in a value or diagnostics",
          "[machines][dialects]") {
  std::mt19937 rng(54);
  const auto machine = shipped_machine("head_table_bc");
  auto program = random_joint_program(machine, rng, 8);
  bend_some(program, rng, 5);
  const auto text = emitted(siemens_840d::kDialect, machine, program).text;
  REQUIRE(text.find("POLY") != std::string::npos);
  for (std::size_t n = 0; n + 4 < text.size(); n += 5)
    CHECK_FALSE(siemens_840d::read_back(machine, text.substr(0, n), "p").ok());
  const auto from = text.find("POLY");
  std::uniform_int_distribution<int> byte(32, 126);
  std::uniform_int_distribution<std::size_t> place(from, text.size() - 1);
  for (int i = 0; i < 4000; ++i) {
    std::string changed = text;
    changed[place(rng)] = static_cast<char>(byte(rng));
    const auto back = siemens_840d::read_back(machine, changed, "p");
    CHECK((back.ok() || has_error(back.diagnostics())));
  }
}
