#include "machines/dialects/linuxcnc.h"

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

MachineProgram random_program(const MachineDefinition& machine, std::mt19937& rng, int moves) {
  MachineProgram program;
  program.title = {"a title (with parentheses)"};
  std::bernoulli_distribution rapid(0.2);
  std::uniform_real_distribution<double> seconds(0.004, 30.0);
  for (int i = 0; i < moves; ++i) {
    MachineMove move;
    move.to = random_joints(machine, rng);
    move.joints = (1U << machine.size()) - 1U;
    move.rapid = i == 0 || rapid(rng);
    move.duration = move.rapid ? 0.0 : seconds(rng);
    move.input_line = static_cast<std::uint32_t>(i + 1);
    program.moves.push_back(std::move(move));
  }
  return program;
}

MachineAction event(const char* name, std::size_t before) {
  MachineAction action;
  action.before = before;
  action.event.name = name;
  action.input_line = 7;
  return action;
}

}  // namespace

TEST_CASE("linuxcnc: read_back(emit(x)) is x to the printed digits, mm and inch",
          "[machines][dialects]") {
  std::mt19937 rng(2);
  for (const auto& name : shipped_machine_names())
    for (const char* units : {"mm", "inch"}) {
      const auto machine = shipped_machine(name, {{"dialect.units", units}});
      const double length_digit = std::pow(10.0, -machine.dialect.digits_length) *
                                  (std::string(units) == "inch" ? kMillimetresPerInch : 1.0);
      const double angle_digit =
          radians_from_degrees(std::pow(10.0, -machine.dialect.digits_angle));
      for (int round = 0; round < 20; ++round) {
        const MachineProgram program = random_program(machine, rng, 100);
        const auto emitted = linuxcnc::emit(machine, program);
        REQUIRE(emitted.ok());
        const auto read = linuxcnc::read_back(machine, emitted.value().text, "out.ngc");
        for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
        REQUIRE(read.ok());
        REQUIRE(read.value().offset_guard);
        REQUIRE(read.value().exact_path);
        REQUIRE(read.value().moves.size() == program.moves.size());
        for (std::size_t i = 0; i < program.moves.size(); ++i) {
          const auto& planned = program.moves[i];
          const auto& back = read.value().moves[i];
          REQUIRE(back.line == emitted.value().move_lines[i]);
          REQUIRE(back.rapid == planned.rapid);
          if (!planned.rapid) REQUIRE(back.duration == Approx(planned.duration).epsilon(1e-5));
          for (int j = 0; j < machine.size(); ++j) {
            const bool rotary =
                machine.axes[static_cast<std::size_t>(j)].joint.kind == JointKind::rotary;
            REQUIRE(std::abs(back.to[j] - planned.to[j]) <=
                    0.5 * (rotary ? angle_digit : length_digit) * (1 + 1e-6));
          }
        }
      }
    }
}

TEST_CASE("linuxcnc: lines are short enough for the interpreter and carry the input's line",
          "[machines][dialects]") {
  std::mt19937 rng(3);
  const auto machine = shipped_machine("laser_5p1");
  MachineProgram program = random_program(machine, rng, 5);
  MachineAction comment;
  comment.kind = MachineAction::Kind::comment;
  comment.text = std::string(500, 'x') + "(nested) \n second line";
  program.actions.push_back(comment);
  const auto emitted = linuxcnc::emit(machine, program);
  REQUIRE(emitted.ok());
  std::size_t at = 0, numbered = 0;
  const std::string& text = emitted.value().text;
  while (at < text.size()) {
    const auto end = text.find('\n', at);
    REQUIRE(end != std::string::npos);
    REQUIRE(end - at <= 250);
    if (text[at] == 'N') ++numbered;
    at = end + 1;
  }
  CHECK(numbered == 5);
  CHECK(text.find("N3 G") != std::string::npos);
}

TEST_CASE("linuxcnc: an event without words is refused with its line, and never dropped",
          "[machines][dialects]") {
  const auto laser = shipped_machine("laser_5p1");
  MachineProgram program;
  program.actions.push_back(event("spindle_on", 0));
  const auto refused = linuxcnc::emit(laser, program);
  REQUIRE_FALSE(refused.ok());
  REQUIRE(refused.diagnostics().size() == 1);
  CHECK(refused.diagnostics()[0].code == "PR201");
  CHECK(refused.diagnostics()[0].where.line == 7);
  CHECK(refused.diagnostics()[0].text.find("spindle_on") != std::string::npos);
  const auto commented =
      linuxcnc::emit(shipped_machine("laser_5p1", {{"process.unmapped", "comment"}}), program);
  REQUIRE(commented.ok());
  CHECK(commented.value().text.find("(unmapped event: spindle_on)") != std::string::npos);
}

TEST_CASE("linuxcnc: a changed guard is not taken for the guard", "[machines][dialects]") {
  std::mt19937 rng(4);
  const auto machine = shipped_machine("table_table_bc");
  const auto emitted = linuxcnc::emit(machine, random_program(machine, rng, 3));
  REQUIRE(emitted.ok());
  std::string text = emitted.value().text;
  const auto at = text.find("GT 0.0000001]");
  REQUIRE(at != std::string::npos);
  text.replace(at, 12, "GT 9.0000000");
  CHECK_FALSE(linuxcnc::read_back(machine, text, "out.ngc").ok());
}

TEST_CASE("linuxcnc: what could move differently than certified is not read as certified",
          "[machines][dialects]") {
  const auto machine = shipped_machine("table_table_bc");
  const auto reads = [&](const std::string& body) {
    const auto read =
        linuxcnc::read_back(machine, "%\nG21 G90 G49 G54\nG61\n" + body + "\nM2\n%\n", "p");
    return read.ok() ? (read.value().exact_path ? "exact" : "blends") : "refused";
  };
  CHECK(std::string(reads("G0 X1 Y2 Z3 B0 C0")) == "exact");
  CHECK(std::string(reads("G64 P0.1\nG0 X1")) == "blends");
  CHECK(std::string(reads("G0 X1\nG64\nG0 X2")) == "blends");
  CHECK(std::string(reads("G92 X5\nG0 X1")) == "refused");
  CHECK(std::string(reads("G10 L2 P1 X5\nG0 X1")) == "refused");
  CHECK(std::string(reads("G55\nG0 X1")) == "refused");
  CHECK(std::string(reads("G43.1 Z10\nG0 X1")) == "refused");
  CHECK(std::string(reads("G0 X0 Y0\nG2 X1 Y1 I0.5 J0.5 F100")) == "refused");
  CHECK(std::string(reads("M428\nG0 X1")) == "refused");
  CHECK(std::string(reads("G0 A1")) == "refused");
  CHECK(std::string(reads("G0 X#1")) == "refused");
}

TEST_CASE("linuxcnc: the beam is followed through events", "[machines][dialects]") {
  std::mt19937 rng(6);
  const auto machine = shipped_machine("laser_5p1");
  MachineProgram program = random_program(machine, rng, 4);
  program.actions.push_back(event("beam_on", 1));
  program.actions.push_back(event("beam_off", 3));
  const auto emitted = linuxcnc::emit(machine, program);
  REQUIRE(emitted.ok());
  const auto read = linuxcnc::read_back(machine, emitted.value().text, "p");
  REQUIRE(read.ok());
  const auto& moves = read.value().moves;
  CHECK_FALSE(moves[0].beam);
  CHECK(moves[1].beam);
  CHECK(moves[2].beam);
  CHECK_FALSE(moves[3].beam);
}

TEST_CASE("linuxcnc: an uncertified program says so first and stops", "[machines][dialects]") {
  std::mt19937 rng(8);
  const auto machine = shipped_machine("table_table_bc");
  MachineProgram program = random_program(machine, rng, 2);
  program.certified = false;
  const auto emitted = linuxcnc::emit(machine, program);
  REQUIRE(emitted.ok());
  const auto& text = emitted.value().text;
  CHECK(text.rfind("%\n(NOT CERTIFIED", 0) == 0);
  CHECK(text.find("\nM0\n") < text.find("G0 "));
}

TEST_CASE("linuxcnc: a value of the input never becomes a command", "[machines][dialects]") {
  const auto machine = shipped_machine("table_table_bc");
  for (const std::string text :
       {"door open) M3 S9000 (", "a\nM3 S9000", "x; M3 S9000", "\"M3 S9000"}) {
    MachineProgram program;
    MachineMove move;
    move.to = home_of(machine);
    move.joints = (1U << machine.size()) - 1U;
    move.rapid = true;
    program.moves = {move};
    MachineAction message;
    message.event.name = "message";
    message.event.parameters = {{"text", text}};
    program.actions = {message};
    const auto emitted = linuxcnc::emit(machine, program);
    REQUIRE(emitted.ok());
    const auto read = linuxcnc::read_back(machine, emitted.value().text, "p");
    INFO(emitted.value().text);
    REQUIRE(read.ok());
    for (const auto& e : read.value().events) CHECK(e.name != "spindle_on");
  }
}
