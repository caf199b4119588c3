#include "postproc/pipeline/joint_stream.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "kernels/core/units.h"
#include "postproc/pipeline/convert.h"
#include "tests/support/machines.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

const std::string kMill =
    "%\nM428\nG21 G17 G90 G94 G40\nT1 M6\nG54\nS1000 M3\nG0 X-20 Y-10 A0 C0\nG43 H1 Z30\n"
    "G0 Z2\nG1 Z0 F300\nG1 X20 F600\nG4 P0.25\nG2 X20 Y10 I0 J10\nG1 X0 Y5 A-20 C30\nG0 Z40\n"
    "M5\nM429\nM30\n%\n";
// A micro-joint on the fly, a pierce that waits, a corner.
const std::string kLaser =
    "%\nM428\nG21 G90 G17 G94\nG54\nG0 X0 Y0 Z50 C0 B0\nG0 Z1\nM62 P0\nG1 X20 F3000\nG1 X30 Y5\n"
    "M63 P0\nG1 X30.5\nM62 P0\nG1 X60 Y10 C20 B10\nM63 P0\nG0 Z50\nM429\nM30\n%\n";
// Onto a pole of the head and off it: exactly, nearly, with the first rotary turned there.
const std::string kPole =
    "%\nM428\nG21 G90 G17 G94\nG54\nG0 X0 Y0 Z50 C0 B0\nG0 Z1\nM62 P0\nG1 X10 Z0.5 C4 B6 F3000\n"
    "G1 X20 Z0 C5 B8\nG1 X30 C6 B0\nG1 X40 C9 B0\nG1 X50 C20 B5\nG1 X60 C24 B0.006\n"
    "G1 X70 C20 B0\nG1 X80 C-10\nG1 X90 C-10 B-6\nM63 P0\nG0 Z50\nM429\nM30\n%\n";

struct Made {
  ConvertInput in;
  Conversion conversion;
};

Made made(const std::string& text, const char* from, const char* to) {
  Made m;
  InputSettings settings;
  settings.file_name = "part.ngc";
  settings.machine = shipped_machine(from);
  settings.tool_lengths = {{1, 60.0}};
  auto read = interpret_nc(text, settings);
  for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(read.ok());
  m.in.input = std::move(read.value());
  m.in.machine = shipped_machine(to);
  m.in.input_name = "part.ngc";
  if (std::string(to).rfind("laser", 0) == 0) {
    m.in.placement.translation() = Vec3(700, 600, 1000);
    m.in.machine.power.min_cut_speed = 0.0;  // the micro-joint's corners are slow
  }
  m.in.timed = m.in.stream = true;
  m.conversion = convert(m.in, false, {});
  for (const auto& d : m.conversion.diagnostics) UNSCOPED_INFO(to_string(d));
  REQUIRE(m.conversion.verdict == Verdict::certified);
  REQUIRE(m.conversion.stream.has_value());
  return m;
}

const Check* find(const Checks& checks, const std::string& name) {
  for (const Check& c : checks)
    if (c.name == name) return &c;
  return nullptr;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const auto end = text.find('\n', at);
    lines.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const auto& line : lines) text += line + "\n";
  return text;
}

/// The names of the checks that fail for a text, or the code of what cannot be read.
std::set<std::string> failures(const Made& m, const std::string& text) {
  ScrewChain chain = chain_of(m.in.machine);
  chain.workpiece_home = chain.workpiece_home * m.in.placement;
  const ReferencePath reference(m.conversion.path, m.in.input.frames);
  const MachineProgram none;
  const DeviationInput deviation{reference, m.conversion.line_map, none, chain};
  const auto checked = check_stream(text, {m.conversion.timeline, m.in.machine, deviation}, {});
  std::set<std::string> names;
  if (!checked.ok()) return {checked.diagnostics().front().code};
  for (const Check& c : checked.value().checks)
    if (!c.ok) names.insert(c.name);
  return names;
}

/// `field` of a row moved by `by`, with the digits of the row kept.
std::string moved(const std::string& row, int field, double by) {
  std::size_t at = 0;
  for (int k = 0; k < field; ++k) at = row.find(',', at) + 1;
  const auto end = row.find(',', at);
  return row.substr(0, at) + std::to_string(std::stod(row.substr(at, end - at)) + by) +
         row.substr(end);
}

}  // namespace

TEST_CASE("joint_stream: the text keeps limits and path by its own rows",
          "[postproc][pipeline][schedule]") {
  const struct {
    const std::string& text;
    const char *from, *to;
  } cases[] = {{kMill, "table_table_ac", "table_table_bc"},
               {kMill, "table_table_ac", "robot_6r"},
               {kLaser, "laser_5p1", "laser_5p1"},
               {kPole, "laser_5p1", "laser_5p1"},
               {kPole, "laser_5p1", "laser_5p1_offset"}};
  for (const auto& each : cases) {
    INFO(each.to);
    const Made m = made(each.text, each.from, each.to);
    const JointStream& stream = *m.conversion.stream;
    CHECK(stream.ok());
    for (const Check& c : stream.checks) {
      INFO(c.name << " " << c.value << " of " << c.limit);
      CHECK(c.ok);
      CHECK_FALSE(c.planned);
    }
    for (const auto& axis : m.in.machine.axes)
      for (const char* name : {"position_limit.", "velocity_limit.", "acceleration_limit.",
                               "jerk_limit.", "round_trip."})
        CHECK(find(stream.checks, name + axis.name) != nullptr);
    for (const char* name : {"tip_deviation", "axis_deviation", "path_complete", "stream_cycle"})
      CHECK(find(stream.checks, name) != nullptr);
    // By hand, from the text: whole cycles, and third differences of every axis.
    const std::vector<std::string> lines = lines_of(stream.text);
    CHECK(stream.rows + 1 == lines.size());
    const double h = m.in.machine.cycle.time;
    CHECK(stream.duration / h == Approx(std::round(stream.duration / h)).margin(1e-6));
    std::vector<std::vector<double>> rows;
    for (std::size_t k = 1; k < lines.size(); ++k) {
      std::vector<double> row;
      for (std::size_t at = 0; at != std::string::npos;) {
        row.push_back(std::stod(lines[k].substr(at)));
        at = lines[k].find(',', at);
        if (at != std::string::npos) ++at;
      }
      rows.push_back(row);
    }
    for (std::size_t j = 0; j < m.in.machine.axes.size(); ++j) {
      double most = 0.0;
      for (std::size_t k = 3; k < rows.size(); ++k)
        most = std::max(most, std::abs(rows[k][j + 1] - 3.0 * rows[k - 1][j + 1] +
                                       3.0 * rows[k - 2][j + 1] - rows[k - 3][j + 1]) /
                                  (h * h * h));
      const Check* jerk = find(stream.checks, "jerk_limit." + m.in.machine.axes[j].name);
      REQUIRE(jerk != nullptr);
      CHECK(jerk->value >= most * (1.0 - 1e-6) - 1e-3);
      const bool rotary = m.in.machine.axes[j].joint.kind == JointKind::rotary;
      CHECK(most <= m.in.machine.axes[j].jerk * (rotary ? kDegreesPerRadian : 1.0));
    }
  }
}

TEST_CASE("joint_stream: a row that is changed or missing or doubled or late is found",
          "[postproc][pipeline][schedule]") {
  const Made m = made(kLaser, "laser_5p1", "laser_5p1");
  const std::string& text = m.conversion.stream->text;
  const std::vector<std::string> lines = lines_of(text);
  REQUIRE(failures(m, text).empty());
  const std::size_t middle = lines.size() / 2;

  auto changed = lines;
  changed[middle] = moved(lines[middle], 2, 0.01);  // a hundredth of Y
  const auto one = failures(m, joined(changed));
  CHECK(one.count("round_trip.Y") == 1);
  CHECK(one.count("jerk_limit.Y") == 1);

  // The whole path beside the input: smooth, in time, and wrong.
  changed = lines;
  for (std::size_t k = 1; k < changed.size(); ++k) changed[k] = moved(changed[k], 1, 0.5);
  const auto beside = failures(m, joined(changed));
  CHECK(beside.count("tip_deviation") == 1);
  CHECK(beside.count("round_trip.X") == 1);
  CHECK(beside.count("jerk_limit.X") == 0);

  changed = lines;
  changed.erase(changed.begin() + static_cast<std::ptrdiff_t>(middle));
  const auto missing = failures(m, joined(changed));
  CHECK(missing.count("stream_rows") == 1);
  CHECK(missing.count("stream_cycle") == 1);

  changed = lines;
  changed.insert(changed.begin() + static_cast<std::ptrdiff_t>(middle), lines[middle]);
  CHECK(failures(m, joined(changed)).count("stream_cycle") == 1);

  changed = lines;
  changed[middle].replace(0, changed[middle].find(','), "99.5");
  CHECK(failures(m, joined(changed)) == std::set<std::string>{"stream_cycle"});

  changed = lines;  // the beam on from the first row, on the way to the part
  changed[1].back() = '1';
  CHECK(failures(m, joined(changed)).count("beam_off_in_link") == 1);
  changed = lines;
  changed.back().back() = '1';
  CHECK(failures(m, joined(changed)).count("beam_off_at_start_and_end") == 1);

  for (const std::string& broken :
       {text.substr(0, text.size() - 1), text.substr(10), std::string(), lines[0] + "\n",
        text + "1,2,3\n", text + "nan" + lines.back().substr(lines.back().find(',')) + "\n"})
    CHECK(failures(m, broken) == std::set<std::string>{"IN111"});
}

TEST_CASE("joint_stream: digits keep rounding below a twentieth of the jerk",
          "[postproc][pipeline][schedule]") {
  AxisDefinition axis = shipped_machine("table_table_bc").axes.front();
  axis.joint.kind = JointKind::linear;
  axis.jerk = 1e5;
  CHECK(stream_decimals(axis, 0.001) == 7);
  axis.jerk = 5e3;  // 4e-7/1e-9 = 400 is more than 250
  CHECK(stream_decimals(axis, 0.001) == 8);
  CHECK(stream_decimals(axis, 0.004) == 7);
}
