#include "postproc/pipeline/beam_power.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <sstream>

#include "kernels/core/units.h"
#include "postproc/pipeline/convert.h"
#include "tests/support/machines.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

// Straight, a right angle, an arc: the speed changes much.
std::string program(const std::string& power) {
  return "%\nM428\nG21 G90 G17 G94\nG54\nG0 X0 Y0 Z50 C0 B0\nG0 Z1\n" + power +
         "M62 P0\nG1 X60 F9000\nG1 Y20\nG3 X50 Y30 I-10 J0\nG1 X0\nM63 P0\nG0 Z50\nM429\nM30\n%\n";
}

ConvertInput prepare(const std::string& text, const std::vector<MachineOverride>& overrides) {
  InputSettings settings;
  settings.file_name = "part.ngc";
  settings.machine = shipped_machine("laser_5p1");
  auto read = interpret_nc(text, settings);
  for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(read.ok());
  ConvertInput in;
  in.input = std::move(read.value());
  in.machine = shipped_machine("laser_5p1", overrides);
  in.machine.power.min_cut_speed = 0.0;  // the right angle is a stop
  in.placement.translation() = Vec3(700, 600, 1000);
  in.input_name = "part.ngc";
  return in;
}

/// A block of the text with the beam on: mean speed of the tip (mm/s) and power in force (percent).
struct Block {
  double speed = 0.0, percent = -1.0;
};

/// Read from the words alone: this machine's tool stands upright in these programs, so that the
/// linear words are the tip's.
std::vector<Block> beam_blocks(const std::string& text) {
  std::vector<Block> blocks;
  std::istringstream lines(text);
  double at[3] = {0, 0, 0}, power = -1.0, feed = 0.0;
  bool beam = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.find("M62 P0") != std::string::npos) beam = true;
    if (line.find("M63 P0") != std::string::npos) beam = false;
    if (const auto k = line.find("M67 E0 Q"); k != std::string::npos)
      power = std::stod(line.substr(k + 8));
    if (line.find('(') != std::string::npos) line = line.substr(0, line.find('('));
    double to[3] = {at[0], at[1], at[2]};
    bool moves = false;
    const auto word = [&line](char letter) -> std::optional<double> {
      const auto k = line.find(letter);
      if (k == std::string::npos || k + 1 >= line.size()) return {};
      const char next = line[k + 1];
      if (next != '-' && next != '.' && (next < '0' || next > '9')) return {};
      return std::stod(line.substr(k + 1));
    };
    for (int i = 0; i < 3; ++i)
      if (const auto v = word("XYZ"[i])) {
        to[i] = *v;
        moves = true;
      }
    if (const auto f = word('F')) feed = *f;
    const double way = std::hypot(to[0] - at[0], to[1] - at[1], to[2] - at[2]);
    if (beam && moves && feed > 0.0) blocks.push_back({way * feed / 60.0, power});  // G93
    std::copy(to, to + 3, at);
  }
  return blocks;
}

const Check* find(const Conversion& c, const std::string& name) {
  for (const auto& check : c.checks)
    if (check.name == name) return &check;
  return nullptr;
}

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (auto k = text.find(what); k != std::string::npos; k = text.find(what, k + 1)) ++n;
  return n;
}

Conversion certified(const ConvertInput& in) {
  Conversion c = convert(in, false, {});
  for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
  REQUIRE(c.verdict == Verdict::certified);
  return c;
}

}  // namespace

TEST_CASE("beam_power: the power in force is that of the speed on every block of the text",
          "[postproc][pipeline][schedule]") {
  for (const double error : {4.0, 25.0}) {
    ConvertInput in = prepare(program(""), {});
    in.machine.power.error = error;
    const Conversion c = convert(in, false, {});
    const Check* check = find(c, "power_follows_speed");
    REQUIRE(check != nullptr);
    CHECK(check->limit == error);
    CHECK(check->ok == (check->value <= error));
    CHECK((c.verdict == Verdict::certified) == check->ok);
    REQUIRE_FALSE(c.program.empty());  // made all the same, for --force
    const auto blocks = beam_blocks(c.program);
    REQUIRE(blocks.size() > 20);
    double slowest = INFINITY, fastest = 0.0;
    for (const Block& b : blocks) {
      // The mean speed of a block lies between the least and the largest.
      CHECK(std::abs(b.percent - in.machine.power.at(b.speed)) <= check->value + 0.5);
      slowest = std::min(slowest, b.percent);
      fastest = std::max(fastest, b.percent);
    }
    CHECK(fastest - slowest > 20.0);
  }
}

TEST_CASE("beam_power: a power of the input is scaled with the speed",
          "[postproc][pipeline][schedule]") {
  const ConvertInput in = prepare(program("M67 E0 Q60\n"), {});
  const Conversion c = certified(in);
  const double scale = 60.0 / in.machine.power.at(150.0);  // F9000
  const Check* check = find(c, "power_follows_speed");
  REQUIRE(check != nullptr);
  double most = 0.0;
  for (const Block& b : beam_blocks(c.program)) {
    CHECK(std::abs(b.percent - scale * in.machine.power.at(b.speed)) <= check->value + 0.5);
    most = std::max(most, b.percent);
  }
  CHECK(most <= 60.0 + check->value);
}

TEST_CASE("beam_power: looser means fewer commands and control means none",
          "[postproc][pipeline][schedule]") {
  ConvertInput in = prepare(program(""), {});
  in.machine.power.error = 45.0;
  const std::size_t few = count(certified(in).program, "M67 E0");
  in.machine.power.error = 25.0;
  const std::size_t many = count(certified(in).program, "M67 E0");
  CHECK(few > 0);
  CHECK(few < many);
  in = prepare(program(""), {});
  in.machine.power.by_program = false;
  const Conversion c = certified(in);
  CHECK(count(c.program, "M67 E0") == 0);
  CHECK(find(c, "power_follows_speed") == nullptr);
  bool told = false;
  for (const auto& text : c.assumes)
    told = told || text.find("[process.power]") != std::string::npos;
  CHECK(told);
}
