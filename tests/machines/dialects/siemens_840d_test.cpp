#include "machines/dialects/siemens_840d.h"

#include <catch2/catch.hpp>
#include <random>

#include "kernels/core/units.h"
#include "tests/support/machines.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

JointVector random_joints(const MachineDefinition& machine, std::mt19937& rng) {
  JointVector q(machine.size());
  for (int j = 0; j < machine.size(); ++j) {
    const auto& joint = machine.axes[static_cast<std::size_t>(j)].joint;
    q[j] = std::uniform_real_distribution<double>(joint.lower, joint.upper)(rng);
  }
  return q;
}

Mat3 random_rotation(std::mt19937& rng) {
  std::normal_distribution<double> normal;
  Eigen::Quaterniond q(normal(rng), normal(rng), normal(rng), normal(rng));
  return q.normalized().toRotationMatrix();
}

MachineProgram random_program(const MachineDefinition& machine, std::mt19937& rng, int moves,
                              bool poses) {
  MachineProgram program;
  program.title = {"a title; with a semicolon \"and a quote"};
  if (poses) {
    program.part.translation() = Vec3(120.5, -20.25, 60.125);
    program.part.linear() = rotation_from_rpy(0.1, -0.2, 2.5);
    program.tool_length = 87.5;
  }
  std::bernoulli_distribution tool(0.7), rapid(0.2), same(0.2);
  std::uniform_real_distribution<double> seconds(0.004, 30.0), place(-200.0, 200.0);
  for (int i = 0; i < moves; ++i) {
    MachineMove move;
    move.to = random_joints(machine, rng);
    move.joints = (1U << machine.size()) - 1U;
    move.rapid = i == 0 || rapid(rng);
    move.duration = move.rapid ? 0.0 : seconds(rng);
    move.input_line = static_cast<std::uint32_t>(i + 1);
    if (poses && i > 0 && tool(rng)) {
      move.interpolation = MoveInterpolation::tool;
      move.tool.translation() = Vec3(place(rng), place(rng), place(rng));
      move.tool.linear() = random_rotation(rng);
      const auto& last = program.moves.back();
      if (last.interpolation == MoveInterpolation::tool && same(rng))
        move.tool.linear() = last.tool.linear();
      if (last.interpolation == MoveInterpolation::tool && same(rng))
        move.tool.translation() = last.tool.translation();
    }
    program.moves.push_back(std::move(move));
  }
  return program;
}

MachineAction action(MachineAction::Kind kind, std::size_t before, std::string text = "") {
  MachineAction a;
  a.kind = kind;
  a.before = before;
  a.input_line = 7;
  if (kind == MachineAction::Kind::event)
    a.event.name = text;
  else
    a.text = text;
  a.seconds = 0.25;
  return a;
}

std::string emitted_text(const MachineDefinition& machine, const MachineProgram& program) {
  const auto emitted = siemens_840d::emit(machine, program);
  for (const auto& d : emitted.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(emitted.ok());
  return emitted.value().text;
}

ReadBack read(const MachineDefinition& machine, const std::string& text) {
  const auto back = siemens_840d::read_back(machine, text, "out.mpf");
  for (const auto& d : back.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(back.ok());
  return back.value();
}

void check_same(const MachineDefinition& machine, const MachineProgram& program) {
  const auto emitted = siemens_840d::emit(machine, program);
  REQUIRE(emitted.ok());
  const auto back = read(machine, emitted.value().text);
  REQUIRE(back.moves.size() == program.moves.size());
  REQUIRE(back.offset_guard);
  REQUIRE(back.exact_path);
  const double inch = machine.dialect.units == "inch" ? kMillimetresPerInch : 1.0;
  const double half_length =
      0.5 * inch * std::pow(10.0, -machine.dialect.digits_length) * (1 + 1e-6);
  const double half_angle =
      radians_from_degrees(0.5 * std::pow(10.0, -machine.dialect.digits_angle)) * (1 + 1e-6);
  for (std::size_t i = 0; i < program.moves.size(); ++i) {
    const auto& planned = program.moves[i];
    const auto& found = back.moves[i];
    REQUIRE(found.line == emitted.value().move_lines[i]);
    REQUIRE(found.interpolation == planned.interpolation);
    REQUIRE(found.rapid == planned.rapid);
    if (!planned.rapid) REQUIRE(found.duration == Approx(planned.duration).epsilon(1e-5));
    if (planned.interpolation == MoveInterpolation::tool) {
      REQUIRE((found.tool.translation() - planned.tool.translation()).cwiseAbs().maxCoeff() <=
              half_length);
      const Vec3 axis = machine.tool.axis;
      REQUIRE(angle_between(found.tool.linear() * axis, planned.tool.linear() * axis) <=
              radians_from_degrees(1e-4));
      REQUIRE(found.known == 0);
      continue;
    }
    REQUIRE(found.known == planned.joints);
    for (int j = 0; j < machine.size(); ++j) {
      const bool rotary = machine.axes[static_cast<std::size_t>(j)].joint.kind == JointKind::rotary;
      REQUIRE(std::abs(found.to[j] - planned.to[j]) <= (rotary ? half_angle : half_length));
    }
  }
}

}  // namespace

TEST_CASE("siemens_840d: read_back(emit(x)) is x to the printed digits with TRAORI",
          "[machines][dialects]") {
  std::mt19937 rng(41);
  for (const char* units : {"mm", "inch"}) {
    const auto machine = shipped_machine("head_table_bc", {{"dialect.units", units}});
    for (int round = 0; round < 1000; ++round)
      check_same(machine, random_program(machine, rng, 8, true));
  }
}

TEST_CASE("siemens_840d: read_back(emit(x)) is x to the printed digits in joints",
          "[machines][dialects]") {
  std::mt19937 rng(42);
  for (const char* name : {"head_table_bc", "table_table_bc", "laser_5p1"})
    for (const char* units : {"mm", "inch"}) {
      const auto machine =
          shipped_machine(name, {{"dialect.units", units},
                                 {"dialect.start", "[\"G17 G90 G40\", \"SOFT FFWON\"]"},
                                 {"dialect.end", "[\"M30\"]"}});
      for (int round = 0; round < 350; ++round)
        check_same(machine, random_program(machine, rng, 8, false));
    }
}

TEST_CASE("siemens_840d: modes change only where the interpolation does", "[machines][dialects]") {
  std::mt19937 rng(43);
  const auto machine = shipped_machine("head_table_bc");
  auto program = random_program(machine, rng, 1, true);
  const auto joints = program.moves[0];
  auto tool = joints;
  tool.interpolation = MoveInterpolation::tool;
  tool.rapid = false;
  tool.duration = 1.0;
  program.moves = {joints, joints, tool, tool, tool, joints, tool};
  const auto text = emitted_text(machine, program);
  const auto count = [&text](const std::string& word) {
    std::size_t n = 0;
    for (auto at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++n;
    return n;
  };
  CHECK(count(" TRAORI\n") == 2);
  CHECK(count(" TRAFOOF\n") == 3);  // at the head, before the joints, at the end
  CHECK(count(" SUPA D0 ") == 3);
  // Behind TRAORI the frame is set anew, then all words.
  const auto at = text.find("TRAORI\n");
  CHECK(text.find("G54\n", at) < text.find("A3=", at));
  CHECK(text.rfind("D1\n", at) != std::string::npos);
}

TEST_CASE("siemens_840d: the guard demands the part and the tool", "[machines][dialects]") {
  std::mt19937 rng(44);
  const auto machine = shipped_machine("head_table_bc");
  auto program = random_program(machine, rng, 4, true);
  program.moves.push_back(program.moves.back());
  program.moves.back().interpolation = MoveInterpolation::tool;
  program.moves.back().tool.translation() = Vec3(1, 2, 3);
  const auto text = emitted_text(machine, program);
  CHECK(text.find("IF ABS($P_ACTFRAME[X,TR]+$P_ACTFRAME[X,FI]-(120.5))>0.0005 GOTOF "
                  "SP_WRONG_OFFSET\n") != std::string::npos);
  CHECK(text.find("IF ABS($P_TOOLL[1]-(87.5))>0.0005 GOTOF SP_WRONG_TOOL\n") != std::string::npos);
  CHECK(text.find("SP_START:") < text.find("G0 "));
  const auto back = read(machine, text);
  REQUIRE(back.part);
  CHECK((back.part->translation() - program.part.translation()).norm() < 1e-4);
  CHECK(rotation_log(back.part->linear().transpose() * program.part.linear()).norm() < 1e-6);
  // Without a guard nothing is demanded.
  const auto open = shipped_machine("head_table_bc", {{"dialect.offset_guard", "false"}});
  const auto unguarded = read(open, emitted_text(open, program));
  CHECK_FALSE(unguarded.offset_guard);
  CHECK_FALSE(unguarded.part);
}

TEST_CASE("siemens_840d: a changed guard is not taken for the guard", "[machines][dialects]") {
  std::mt19937 rng(45);
  const auto machine = shipped_machine("head_table_bc");
  const auto text = emitted_text(machine, random_program(machine, rng, 6, true));
  const std::pair<const char*, const char*> changes[] = {
      {">0.0005 GOTOF SP_WRONG_O", ">9.0005 GOTOF SP_WRONG_O"},
      {"ABS($P_ACTFRAME[Y,TR]", "ABS($P_ACTFRAME[X,TR]"},
      {"$P_ACTFRAME[Z,FI]", "$P_ACTFRAME[X,FI]"},
      {"M0\n", "M8\n"},
      {"GOTOB SP_WRONG_OFFSET", "GOTOF SP_START"},
      {"[X,MI]<>0", "[X,MI]<>1"},
      {"$P_TOOLL[1]", "$P_TOOLL[2]"},
      {"IF ABS($P_ACTFRAME[C,TR]", "; IF ABS($P_ACTFRAME[C,TR]"},
      {"G54 D1", "G54 D0"},
      {"GOTOF SP_START", "GOTOF SP_START ; "},  // a comment changes nothing
  };
  for (const auto& [from, to] : changes) {
    INFO(from);
    std::string changed = text;
    const auto at = changed.find(from);
    REQUIRE(at != std::string::npos);
    changed.replace(at, std::string(from).size(), to);
    const auto back = siemens_840d::read_back(machine, changed, "p");
    const bool comment_only = std::string(to).find("START ; ") != std::string::npos;
    CHECK((back.ok() && back.value().offset_guard) == comment_only);
  }
}

TEST_CASE("siemens_840d: events in order, beam and dwell", "[machines][dialects]") {
  std::mt19937 rng(46);
  auto machine = shipped_machine("head_table_bc");
  machine.process.events.push_back({"beam_on", "LASER_ON({percent})", true, 0.0, 0.0});
  machine.process.events.push_back({"beam_off", "LASER_OFF()", true, 0.0, 0.0});
  machine.process.events.push_back({"pierce", "PIERCE()", false, 0.5, 0.0});
  auto program = random_program(machine, rng, 5, true);
  using Kind = MachineAction::Kind;
  auto on = action(Kind::event, 2, "beam_on");
  on.event.parameters = {{"percent", "45.5"}};
  auto message = action(Kind::event, 3, "message");
  message.event.parameters = {{"text", "x\") G0 X1 ;\n"}};
  program.actions = {action(Kind::event, 1, "pierce"), on, message,
                     action(Kind::event, 4, "beam_off"), action(Kind::dwell, 5)};
  const auto back = read(machine, emitted_text(machine, program));
  const std::vector<std::pair<std::string, std::size_t>> expected = {
      {"pierce", 1}, {"dwell", 1}, {"beam_on", 2}, {"message", 3}, {"beam_off", 4}, {"dwell", 5},
  };
  REQUIRE(back.events.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    CHECK(back.events[i].name == expected[i].first);
    CHECK(back.events[i].before == expected[i].second);
  }
  CHECK(back.events[1].seconds == 0.5);
  CHECK_FALSE(back.moves[0].beam);
  CHECK(back.moves[2].beam);
  CHECK_FALSE(back.moves[4].beam);
  program.actions = {action(Kind::event, 1, "gas_on")};
  const auto refused = siemens_840d::emit(machine, program);
  REQUIRE_FALSE(refused.ok());
  CHECK(refused.diagnostics()[0].code == "PR201");
}

TEST_CASE("siemens_840d: behind a tool change the tool length is stated anew",
          "[machines][dialects]") {
  std::mt19937 rng(51);
  const auto machine = shipped_machine("head_table_bc");
  for (const bool poses : {true, false}) {
    auto program = random_program(machine, rng, 6, poses);
    if (poses)
      program.moves[3].interpolation = program.moves[2].interpolation = MoveInterpolation::tool;
    auto change = action(MachineAction::Kind::event, 3, "tool_change");
    change.event.parameters = {{"tool", "5"}};
    program.actions = {change};
    const auto text = emitted_text(machine, program);
    const auto at = text.find("T=\"5\" M6");
    REQUIRE(at != std::string::npos);
    CHECK(text.find(poses ? " D1\n" : " D0\n", at) < text.find(" X", at));
    CHECK(read(machine, text).moves.size() == 6);
    if (poses) continue;
    std::string changed = text;
    changed.replace(text.find(" D0\n", at), 4, " G90\n");
    CHECK_FALSE(siemens_840d::read_back(machine, changed, "p").ok());
  }
}

TEST_CASE("siemens_840d: labels are unique and restate the modal words", "[machines][dialects]") {
  std::mt19937 rng(47);
  const auto machine = shipped_machine("head_table_bc");
  auto program = random_program(machine, rng, 12, true);
  using Kind = MachineAction::Kind;
  program.actions = {action(Kind::cut_label, 2, "CUT 7 from input line 12"),
                     action(Kind::cut_label, 4, "PATH from input line 20"),
                     action(Kind::cut_label, 6, "PATH from input line 30"),
                     action(Kind::cut_label, 8, "CUT 7 goes on after a rewind from input line 31")};
  const auto text = emitted_text(machine, program);
  for (const char* label :
       {" CUT_7: ; CUT 7 from input line 12\n", " PATH: ", " PATH_2: ", " CUT_7_2: "})
    CHECK(text.find(label) != std::string::npos);
  const auto at = text.find("CUT_7:");
  CHECK(text.find("G17 G710 G90 G94 G40 G60 G601 RTLION", at) != std::string::npos);
  CHECK(read(machine, text).moves.size() == 12);
}

TEST_CASE("siemens_840d: options", "[machines][dialects]") {
  std::mt19937 rng(48);
  const auto machine = shipped_machine("head_table_bc");
  auto program = random_program(machine, rng, 4, true);
  program.certified = false;
  const auto text = emitted_text(machine, program);
  CHECK(text.rfind("; NOT CERTIFIED", 0) == 0);
  CHECK(text.find(" M0\nN", text.find("SP_START:")) < text.find("G0 "));
  CHECK(text == emitted_text(machine, program));
  const auto bare = shipped_machine(
      "head_table_bc", {{"dialect.line_numbers", "false"}, {"links.rapid", "independent"}});
  const auto plain = emitted_text(bare, program);
  CHECK(plain.find("\nN") == std::string::npos);
  CHECK(plain.find(" RTLIOF\n") != std::string::npos);
  CHECK(read(bare, plain).moves.size() == 4);
  const auto blend = shipped_machine("head_table_bc", {{"dialect.path_mode", "blend"}});
  const auto refused = siemens_840d::emit(blend, program);
  REQUIRE_FALSE(refused.ok());
  CHECK(refused.diagnostics()[0].code == "PR203");
}

TEST_CASE("siemens_840d: what could move differently than certified is refused",
          "[machines][dialects]") {
  std::mt19937 rng(49);
  const auto machine = shipped_machine("head_table_bc", {{"dialect.start", "[]"}});
  auto program = random_program(machine, rng, 1, true);
  auto tool = program.moves[0];
  tool.interpolation = MoveInterpolation::tool;
  tool.tool.translation() = Vec3(1, 2, 3);
  tool.rapid = false;
  tool.duration = 1.0;
  program.moves = {program.moves[0], tool};
  const auto good = emitted_text(machine, program);
  read(machine, good);
  const std::pair<const char*, const char*> changes[] = {
      {"G0 SUPA", "G0"},       // an offset may be live
      {"SUPA D0", "SUPA D1"},  // a tool length too
      {"SUPA D0", "SUPA"},
      {"G1 X1", "G2 X1"},  // an arc
      {"G1 X1", "G1 Q1"},  // no such axis
      {" F60", ""},        // no time
      {" G93\n", " G95\n"},
      {"ORIWKS ORIVECT", "ORIMKS ORIAXES"},
      {"ORIWKS ORIVECT", "ORIWKS"},
      {"G60 G601", "G64"},  // blends
      {" G90 ", " G91 "},
      {"RTLION\n", "RTLION CYCLE832(0.1)\n"},
      {" G710 ", " "},
      {"TRANS\n", "TRANS X5\n"},
      {" TRAORI\n", " TRAORI(2)\n"},
      {"Y2 ", ""},  // tip unknown behind TRAORI
      {" G1 X1", " M3 S100 G1 X1"},
      {" G1 X1", " ROT Z5\n G1 X1"},
  };
  for (const auto& [from, to] : changes) {
    INFO(from << " -> " << to);
    std::string changed = good;
    auto at = changed.find(from, std::string(from) == "TRANS\n" ? 0 : changed.find("TRAFOOF"));
    REQUIRE(at != std::string::npos);
    changed.replace(at, std::string(from).size(), to);
    CHECK_FALSE(siemens_840d::read_back(machine, changed, "p").ok());
  }
}

TEST_CASE("siemens_840d: every prefix and mutation ends in a value or diagnostics",
          "[machines][dialects]") {
  std::mt19937 rng(50);
  const auto machine = shipped_machine("head_table_bc");
  const auto text = emitted_text(machine, random_program(machine, rng, 4, true));
  std::size_t refused = 0;
  for (std::size_t n = 0; n < text.size(); n += 7)
    refused += siemens_840d::read_back(machine, text.substr(0, n), "p").ok() ? 0 : 1;
  CHECK(refused > text.size() / 8);
  std::uniform_int_distribution<int> byte(0, 255);
  for (int i = 0; i < 1000; ++i) {
    std::string changed = text;
    changed[std::uniform_int_distribution<std::size_t>(0, text.size() - 1)(rng)] =
        static_cast<char>(byte(rng));
    const auto back = siemens_840d::read_back(machine, changed, "p");
    CHECK((back.ok() || has_error(back.diagnostics())));
  }
}
