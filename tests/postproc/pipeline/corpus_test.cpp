// Real programs of others, where the shared corpus lies beside the checkout.

#include <catch2/catch.hpp>
#include <map>

#include "kernels/core/units.h"
#include "postproc/pipeline/convert.h"
#include "tests/support/machines.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

const std::string kDemos =
    "corpus/1_five_axis/LinuxCNC/configs/sim/axis/vismach/5axis/table-rotary-tilting/demos/";

std::optional<InterpretedInput> boat(const char* name, const char* machine) {
  const auto path = shared_path(kDemos + name);
  if (!path) return {};
  InputSettings settings;
  settings.file_name = name;
  settings.machine = shipped_machine(machine);
  settings.tool_lengths = {{1, 50.0}};
  auto read = interpret_nc(read_bytes(*path), settings);
  for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(read.ok());
  return std::move(read.value());
}

/// Of the boat, with both rotaries moving. The whole boat is [slow].
const CutRange kTwoCuts{11, 12};

Conversion to_bc(InterpretedInput input, const char* name, std::optional<CutRange> cuts = {}) {
  ConvertInput in;
  in.collision_check = false;  // nobody has placed these parts among our bodies
  in.cuts = cuts;
  in.input = std::move(input);
  in.machine = shipped_machine("table_table_bc");
  in.input_name = name;
  return convert(in, false, {});
}

/// Cutting points of a path, every 0.2 mm at most, in a grid of 1 mm cells.
struct Cloud {
  std::vector<CutterLocation> points;
  std::map<std::array<int, 3>, std::vector<std::size_t>> cells;

  static std::array<int, 3> cell(const Vec3& p) {
    return {static_cast<int>(std::floor(p.x())), static_cast<int>(std::floor(p.y())),
            static_cast<int>(std::floor(p.z()))};
  }

  explicit Cloud(const InterpretedInput& input, double step) {
    const ReferencePath path(input.path, input.frames);
    for (std::size_t k = 1; k <= path.segments(); ++k) {
      if (input.path.points[k].kind != MotionKind::feed) continue;
      const int n = std::max(1, static_cast<int>(std::ceil(path.length(k) / step)));
      for (int i = 0; i <= n; ++i) points.push_back(path.at(k, static_cast<double>(i) / n));
    }
    for (std::size_t i = 0; i < points.size(); ++i) cells[cell(points[i].tip)].push_back(i);
  }

  /// Smallest distance of tip (mm) plus axis (degrees / 10) to a point of the cloud, and that
  /// point.
  std::pair<double, std::size_t> nearest(const CutterLocation& l) const {
    std::pair<double, std::size_t> best{1e9, 0};
    const auto c = cell(l.tip);
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z) {
          const auto found = cells.find({c[0] + x, c[1] + y, c[2] + z});
          if (found == cells.end()) continue;
          for (const std::size_t i : found->second) {
            const double d = (points[i].tip - l.tip).norm() +
                             0.1 * degrees_from_radians(angle_between(points[i].axis, l.axis));
            if (d < best.first) best = {d, i};
          }
        }
    return best;
  }
};

void boats_on_the_table(std::optional<CutRange> cuts) {
  for (const auto& [name, machine] :
       {std::pair{"boat-xyzac.ngc", "table_table_ac"}, {"boat-xyzbc.ngc", "table_table_bc"}}) {
    auto input = boat(name, machine);
    if (!input) {
      WARN("no corpus: skipped");
      return;
    }
    // the second cut of the B/C program is long
    if (cuts && std::string(machine) == "table_table_bc") cuts = CutRange{11, 11};
    const Conversion c = to_bc(std::move(*input), name, cuts);
    for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
    CHECK(c.verdict == Verdict::certified);
  }
}

void boats_on_other_machines(std::optional<CutRange> cuts) {
  for (const auto& [name, from] :
       {std::pair{"boat-xyzac.ngc", "table_table_ac"}, {"boat-xyzbc.ngc", "table_table_bc"}}) {
    if (cuts && std::string(from) == "table_table_bc") continue;  // its cuts are others
    for (const char* to : {"robot_6r", "head_table_bc", "laser_5p1_offset"}) {
      auto input = boat(name, from);
      if (!input) {
        WARN("no corpus: skipped");
        return;
      }
      ConvertInput in;
      in.collision_check = false;  // nobody has placed these parts among our bodies
      in.input = std::move(*input);
      in.machine = shipped_machine(to);
      in.input_name = name;
      in.cuts = cuts;
      const bool laser = std::string(to) == "laser_5p1_offset";
      if (laser) in.placement.translation() = Vec3(700, 600, 1000);
      const Conversion c = convert(in, false, {});
      INFO(name << " to " << to);
      for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
      if (!laser) {
        CHECK(c.verdict == Verdict::certified);
        CHECK(c.checks_ok());
        continue;
      }
      // A laser has no words for a mill's spindle: refused by name, with the input's line.
      CHECK(c.verdict == Verdict::refused);
      const auto spindle =
          std::find_if(c.diagnostics.begin(), c.diagnostics.end(), [](const Diagnostic& d) {
            return d.code == "PR201" && d.text.find("spindle_on") != std::string::npos;
          });
      REQUIRE(spindle != c.diagnostics.end());
      CHECK(spindle->where.line > 0);
    }
  }
}

}  // namespace

TEST_CASE("corpus: cuts of both boat programs are certified on the B/C table",
          "[postproc][pipeline][corpus]") {
  boats_on_the_table(kTwoCuts);
}

TEST_CASE("corpus: both boat programs are certified on the B/C table",
          "[.slow][slow][postproc][pipeline][corpus]") {
  boats_on_the_table({});
}

TEST_CASE("corpus: cuts of a boat on a robot, a head-table machine and an offset laser",
          "[postproc][pipeline][corpus]") {
  boats_on_other_machines(kTwoCuts);
}

TEST_CASE("corpus: both boat programs on a robot, a head-table machine and an offset laser",
          "[.slow][slow][postproc][pipeline][corpus]") {
  boats_on_other_machines({});
}

TEST_CASE("corpus: a SINUMERIK program with TRAORI and frames",
          "[.slow][slow][postproc][pipeline][corpus]") {
  const auto path = shared_path(
      "corpus/1_five_axis/ElMoe/NC_code/Coordinate_system_representation_Achskreuz/"
      "Coordinate_system_representation_Achskreuz.mpf");
  if (!path) {
    WARN("no corpus: skipped");
    return;
  }
  const std::string text = read_bytes(*path);
  InputSettings settings;
  settings.file_name = "Achskreuz.mpf";
  // Rotary words, spindle and coolant need the machine that it was posted for: each named once.
  const auto refused = interpret_nc(text, settings);
  REQUIRE_FALSE(refused.ok());
  bool rotary = false;
  for (const auto& d : refused.diagnostics())
    if (d.severity == Severity::error) {
      CHECK(d.where.line > 0);
      CHECK(d.where.column > 0);
      rotary = rotary || d.text.find("--input-machine") != std::string::npos;
    }
  CHECK(rotary);

  settings.machine = shipped_machine("head_table_bc");
  settings.process = settings.machine->process;
  settings.process->unmapped = UnmappedWords::comment;
  auto read = interpret_nc(text, settings);
  for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(read.ok());
  CHECK(read.value().dialect == "siemens");
  // Tools by name: a control with T numbers has to be told them.
  {
    ConvertInput in;
    in.collision_check = false;  // nobody has placed these parts among our bodies
    in.input = read.value();
    in.machine = shipped_machine("table_table_bc");
    const Conversion c = convert(in, false, {});
    CHECK(c.verdict == Verdict::refused);
    CHECK(std::any_of(c.diagnostics.begin(), c.diagnostics.end(),
                      [](const Diagnostic& d) { return d.code == "PR112" && d.where.line > 0; }));
  }
  settings.tool_numbers = {{"PLAN_D50_N_AP4", 1},
                           {"SCHAFT_D12_N_AP30", 2},
                           {"SCHAFT_D6_N_AP15", 3},
                           {"ENTFRAESER_D8_N_90GRAD", 4}};
  const auto numbered = interpret_nc(text, settings);
  REQUIRE(numbered.ok());
  for (const char* to : {"head_table_bc", "table_table_bc"}) {
    ConvertInput in;
    in.collision_check = false;  // nobody has placed these parts among our bodies
    in.input = std::string(to) == "table_table_bc" ? numbered.value() : read.value();
    in.machine = shipped_machine(to);
    in.input_name = "Achskreuz.mpf";
    const Conversion c = convert(in, false, {});
    for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
    CHECK(c.verdict == Verdict::certified);
  }
}

TEST_CASE("corpus: the boat posted for A/C and for B/C is one tool path",
          "[postproc][pipeline][corpus]") {
  const auto ac = boat("boat-xyzac.ngc", "table_table_ac");
  const auto bc = boat("boat-xyzbc.ngc", "table_table_bc");
  if (!ac || !bc) {
    WARN("no corpus: skipped");
    return;
  }
  // Finely sampled, so that the nearest sample is near the nearest point of the path.
  const Cloud reference(*ac, 0.02);
  const Cloud other(*bc, 0.5);
  std::vector<double> tips, axes;
  for (const auto& l : other.points) {
    const auto [d, i] = reference.nearest(l);
    if (d > 0.1) continue;  // passes that only the B/C program has
    tips.push_back((reference.points[i].tip - l.tip).norm());
    axes.push_back(degrees_from_radians(angle_between(reference.points[i].axis, l.axis)));
  }
  std::sort(tips.begin(), tips.end());
  std::sort(axes.begin(), axes.end());
  const double share = static_cast<double>(tips.size()) / static_cast<double>(other.points.size());
  WARN("boat A/C against B/C: " << 100 * share
                                << " % of the B/C path lies on the A/C path; there tip median "
                                << tips[tips.size() / 2] << " mm (samples every 0.02), axis median "
                                << axes[axes.size() / 2] << " deg, 99 % "
                                << axes[axes.size() * 99 / 100] << " deg");
  CHECK(share > 0.9);
  CHECK(tips[tips.size() / 2] < 0.011);
  CHECK(axes[axes.size() * 99 / 100] < 0.1);
}

namespace {

/// The first lines of a text.
std::string head_of(const std::string& text, int lines) {
  std::size_t end = 0;
  while (lines-- > 0 && end != std::string::npos) end = text.find('\n', end + 1);
  return text.substr(0, end);
}

void printer_on_the_table(int lines, std::size_t least_blocks) {
  const auto path = shared_path("corpus/1_five_axis/zhangty019/DataSet/Gcode/model_1_Gcode.txt.gz");
  if (!path) {
    WARN("no corpus: skipped");
    return;
  }
  InputSettings settings;
  settings.file_name = "model_1_Gcode.txt";
  settings.machine = shipped_machine("table_table_bc");
  const std::string text = read_bytes(*path);
  const auto refused = interpret_nc(text, settings);
  REQUIRE_FALSE(refused.ok());
  CHECK(refused.diagnostics().front().code == "PR101");
  CHECK(refused.diagnostics().front().where.line == 2);

  settings.process = settings.machine->process;
  settings.process->unmapped = UnmappedWords::comment;
  auto read = interpret_nc(head_of(text, lines), settings);
  REQUIRE(read.ok());
  const bool stated = std::any_of(
      read.value().assumes.begin(), read.value().assumes.end(),
      [](const std::string& a) { return a.find("without a mapping") != std::string::npos; });
  CHECK(stated);
  const Conversion c = to_bc(std::move(read.value()), "model_1_Gcode.txt");
  for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
  CHECK(c.verdict == Verdict::certified);
  CHECK(c.blocks > least_blocks);
}

}  // namespace

TEST_CASE("corpus: the beginning of the B/C program of a printer", "[postproc][pipeline][corpus]") {
  printer_on_the_table(60, 35);
}

TEST_CASE("corpus: the 34,000 line B/C program of a printer",
          "[.slow][slow][postproc][pipeline][corpus]") {
  printer_on_the_table(1000000, 20000);
}

TEST_CASE("corpus: the 34,000 line program on a robot, a head-table machine and an offset laser",
          "[.slow][slow][postproc][pipeline][corpus]") {
  const auto path = shared_path("corpus/1_five_axis/zhangty019/DataSet/Gcode/model_1_Gcode.txt.gz");
  if (!path) {
    WARN("no corpus: skipped");
    return;
  }
  InputSettings settings;
  settings.file_name = "model_1_Gcode.txt";
  settings.machine = shipped_machine("table_table_bc");
  settings.process = settings.machine->process;
  settings.process->unmapped = UnmappedWords::comment;
  const auto read = interpret_nc(read_bytes(*path), settings);
  REQUIRE(read.ok());
  for (const char* to : {"robot_6r", "head_table_bc", "laser_5p1_offset"}) {
    ConvertInput in;
    in.collision_check = false;  // nobody has placed these parts among our bodies
    in.input = read.value();
    in.machine = shipped_machine(to);
    in.input_name = "model_1_Gcode.txt";
    if (std::string(to) == "laser_5p1_offset") {
      in.placement.translation() = Vec3(700, 600, 1000);
      // Its C winds on in one cut: refused unless the cut may be split.
      const Conversion refused = convert(in, false, {});
      CHECK(refused.verdict == Verdict::refused);
      CHECK(std::any_of(refused.diagnostics.begin(), refused.diagnostics.end(),
                        [](const Diagnostic& d) { return d.code == "KN103"; }));
      in.machine.links.rewind_in_cut = true;
    }
    const Conversion c = convert(in, false, {});
    INFO(to);
    for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
    CHECK(c.verdict == Verdict::certified);
    CHECK(c.blocks > 20000);
  }
}
