// Whole conversions with smoothing, rotations about the tool, and whole rotations.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <optional>
#include <regex>
#include <sstream>

#include "kernels/core/units.h"
#include "postproc/pipeline/convert.h"
#include "postproc/pipeline/registry.h"
#include "tests/postproc/pipeline/paths.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

using Overrides = std::vector<MachineOverride>;

// Lines, an arc, dense points and a zigzag; tool upright.
const std::string kZigzag =
    "%\nM428\nG21 G17 G90 G94 G40\nT1 M6\nG54\nS1000 M3\nG0 X0 Y0 A0 C0\nG43 H1 Z30\nG0 Z2\n"
    "G1 Z0 F600\nG1 X40 F1200\nG1 Y5\nG1 X0\nM8\nG1 Y10\nG1 X40\nG3 X40 Y30 I0 J10\nG1 X30 Y30.2\n"
    "G1 X29.9 Y30.2005\nG1 X29.8 Y30.201\nG1 X29.7 Y30.2015\nG1 X0 Y31 Z2\nG4 P0.3\nG1 X-10 Y0\n"
    "G0 Z30\nM9\nM5\nM429\nM30\n%\n";

// Both rotaries move on lines and on an arc.
const std::string kFiveAxis =
    "%\nM428\nG21 G17 G90 G94 G40\nT1 M6\nG54\nS1000 M3\nG0 X-20 Y-10 A0 C0\nG43 H1 Z30\nG0 Z2\n"
    "G1 Z0 F600\nG1 X20 A-8 C5 F1200\nG1 X22 Y5 A-10 C12\nG1 X5 Y8 Z2 A-14 C20\n"
    "G3 X5 Y28 I0 J10 C28\nG1 X-20 Y30 Z1 A-5 C10\nM8\nG1 X-25 Y0 Z0 A-12 C0\nG0 Z40\n"
    "G0 X0 Y0 A-10 C30\nG0 Z10\nG1 Z2 F300\nG1 X10 Y5 Z1 A-15 C40\nG1 X-5 Y9 Z3 A-6 C20\nG0 Z40\n"
    "M9\nM5\nM429\nM30\n%\n";

const std::string kLaser =
    "%\nM428\nG21 G90 G17 G94\nG54\nG0 X0 Y0 Z50 C0 B0\nG0 Z1\nM62 P0\nG1 X30 F3000\nG1 Y20 B5 C8\n"
    "G1 X10 Y22 B9 C12\nG2 X0 Y12 I0 J-10 B5 C4\nG1 X0 Y0 B0 C0\nM63 P0\nG0 Z50\nM429\nM30\n%\n";

ConvertInput prepare(const std::string& text, const char* from, const char* to,
                     const Overrides& overrides) {
  ConvertInput in;
  in.input = read_program(text, from);
  in.machine = shipped_machine(to, overrides);
  in.input_name = "part.ngc";
  return in;
}

const Check* find(const Conversion& c, const std::string& name) {
  for (const auto& check : c.checks)
    if (check.name == name) return &check;
  return nullptr;
}

double value(const Conversion& c, const std::string& name) {
  const Check* check = find(c, name);
  INFO(name);
  REQUIRE(check != nullptr);
  return check->value;
}

/// The pose of the tip in the part during block i of the text, as the control makes it.
class Output {
 public:
  Output(const ConvertInput& in, const Conversion& c, double tool_length)
      : chain_(chain_of(in.machine, tool_length)) {
    chain_.workpiece_home = chain_.workpiece_home * in.placement;
    const Dialect* dialect = find_dialect(in.machine.dialect.name);
    REQUIRE(dialect != nullptr);
    auto read = dialect->read_back(in.machine, c.program, "output");
    REQUIRE(read.ok());
    moves_ = std::move(read.value().moves);
    turn_ = dialect->tool_turn;
    REQUIRE(c.line_map.size() == moves_.size());
  }
  const ReadBackMove& move(std::size_t i) const { return moves_[i]; }
  Vec3 axis(const Pose& p) const { return p.linear() * chain_.tool_axis; }
  Pose end(std::size_t i) const {
    const ReadBackMove& m = moves_[i];
    return m.interpolation == MoveInterpolation::tool ? m.tool : forward(chain_, m.to);
  }
  CutterLocation at(std::size_t i, double t) const {
    const ReadBackMove& m = moves_[i];
    if (m.interpolation == MoveInterpolation::joints && t == 1.0) return location(end(i));
    if (m.interpolation == MoveInterpolation::joints)
      return location(forward(chain_, moves_[i - 1].to + t * (m.to - moves_[i - 1].to)));
    const Pose a = end(i - 1), b = end(i);
    const Vec3 tip = a.translation() + t * (b.translation() - a.translation());
    if (turn_ == ToolTurn::great_circle) return {tip, great_circle(axis(a), axis(b), t)};
    return {tip, rotation(i, t) * chain_.tool_axis};
  }
  /// Of a block of straight tip and slerp.
  Mat3 rotation(std::size_t i, double t) const {
    const Mat3 a = end(i - 1).linear(), b = end(i).linear();
    return a * rotation_exp(t * rotation_log(a.transpose() * b));
  }

 private:
  CutterLocation location(const Pose& p) const { return {p.translation(), axis(p)}; }
  ScrewChain chain_;
  std::vector<ReadBackMove> moves_;
  ToolTurn turn_ = ToolTurn::none;
};

struct Dense {
  double tip = 0.0, axis = 0.0, rotation = 0.0;  // mm, deg, deg
  std::size_t samples = 0;
};

/// Every path block against the input at the line map's places. The rotations may differ by one
/// constant rotation about the tool.
Dense compare(const ConvertInput& in, const Conversion& c, double tool_length, bool ends_only) {
  const ReferencePath reference(in.input.path, in.input.frames);
  const Output output(in, c, tool_length);
  Dense d;
  std::optional<Mat3> offset;
  for (std::size_t i = 1; i < c.line_map.size(); ++i) {
    const LineMapEntry& e = c.line_map[i];
    if (e.role != MoveRole::path) continue;
    for (int k = ends_only ? 16 : 0; k <= 16; ++k) {
      const double t = k / 16.0;
      const PathPlace p =
          place_between(reference, {e.from_segment, e.from_share}, {e.segment, e.to_share}, t);
      if (p.segment == 0) continue;
      const CutterLocation wanted = reference.at(p.segment, p.s);
      const CutterLocation got = output.at(i, t);
      d.tip = std::max(d.tip, (got.tip - wanted.tip).norm());
      d.axis = std::max(d.axis, degrees_from_radians(angle_between(got.axis, wanted.axis)));
      ++d.samples;
      if (!in.input.path.full_pose || output.move(i).interpolation == MoveInterpolation::joints)
        continue;
      const Mat3 r = reference.rotation_at(p.segment, p.s).toRotationMatrix();
      const Mat3 turned = output.rotation(i, t);
      if (!offset) offset = r.transpose() * turned;
      d.rotation =
          std::max(d.rotation,
                   degrees_from_radians(rotation_log((r * *offset).transpose() * turned).norm()));
    }
  }
  return d;
}

void check_certified(const ConvertInput& in, const Conversion& c, double tool_length,
                     bool ends_only) {
  for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
  for (const auto& k : c.checks)
    if (!k.ok) UNSCOPED_INFO(k.name << " " << k.value << " > " << k.limit);
  REQUIRE(c.verdict == Verdict::certified);
  CHECK(c.checks_ok());
  const Dense d = compare(in, c, tool_length, ends_only);
  INFO(d.samples << " samples, tip " << d.tip << " mm, axis " << d.axis << " deg");
  CHECK(d.samples > 30);
  // The text states its own frames with their digits, which count; here they are exact.
  CHECK(d.tip <= value(c, "tip_deviation") + 2e-5);
  CHECK(d.axis <= value(c, "axis_deviation") + 2e-5);
  const Check* tip = find(c, "tip_deviation");
  CHECK(tip->value <= tip->limit);
}

void check_corners(const Conversion& c, const MachineDefinition& machine) {
  const std::string& method = machine.recipe.smoothing;
  const ToleranceBudget& budget = machine.tolerance.budget;
  if (method == "none") {
    CHECK(c.corners.empty());
    CHECK(c.merged_points == 0);
    return;
  }
  CHECK_FALSE(c.corners.empty());
  for (const SmoothedCorner& k : c.corners) {
    CHECK(k.method == (k.stop ? "stop" : method));
    CHECK(k.input_line > 0);
    CHECK(k.tip_deviation <= (budget.smoothing + budget.merge) * machine.tolerance.tip + 1e-9);
    CHECK(k.axis_deviation <= (budget.smoothing + budget.merge) * machine.tolerance.axis + 1e-9);
    CHECK((k.half_width > 0.0 || k.rotation_half_width > 0.0 || k.stop));
  }
}

/// Rows of a path with whole rotations, upright within about 20 deg.
std::string pose_rows() {
  std::ostringstream out;
  out.precision(12);
  out << "x_mm,y_mm,z_mm,qw,qx,qy,qz,feed_mm_per_min\n";
  for (int i = 0; i <= 24; ++i) {
    const double u = i / 24.0;
    const Vec3 p(60 * std::cos(4 * u), 60 * std::sin(4 * u), 10 * u);
    const Eigen::Quaterniond q(rotation_about(Vec3::UnitZ(), 0.6 * u) *
                               rotation_exp(Vec3(0.2 * std::sin(5 * u), 0.15 * u, 0.0)));
    out << p.x() << "," << p.y() << "," << p.z() << "," << q.w() << "," << q.x() << "," << q.y()
        << "," << q.z() << ",1800\n";
  }
  return out.str();
}

ConvertInput prepare_rows(const std::string& rows, const Overrides& overrides) {
  InputSettings settings;
  settings.file_name = "part.csv";
  auto read = interpret_csv(rows, settings);
  for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(read.ok());
  ConvertInput in;
  in.input = std::move(read.value());
  in.machine = shipped_machine("robot_6r", overrides);
  in.input_name = "part.csv";
  return in;
}

}  // namespace

TEST_CASE("smoothing_convert: a robot's programs are certified with every setting",
          "[postproc][pipeline][smooth]") {
  const std::vector<Overrides> cases = {
      {},
      {{"recipe.smoothing", "ramp"}},
      {{"recipe.smoothing", "none"}},
      {{"recipe.shape", "paper"}},
      {{"dialect.path_mode", "exact"}},
      {{"dialect.path_mode", "spline"}},
      {{"dialect.path_mode", "spline"}, {"recipe.smoothing", "none"}},
      {{"recipe.spin", "tangent"}},
      {{"recipe.spin", "optimised"}},
      {{"recipe.spin", "optimised"}, {"recipe.smoothing", "ramp"}, {"dialect.path_mode", "exact"}},
      {{"dialect.name", "rapid"}}};
  for (const auto& overrides : cases)
    for (const std::string* program : {&kZigzag, &kFiveAxis}) {
      std::string name = program == &kZigzag ? "zigzag" : "five axes";
      for (const auto& o : overrides) name += " " + o.key + "=" + o.value;
      INFO(name);
      const auto in = prepare(*program, "table_table_ac", "robot_6r", overrides);
      const Conversion c = convert(in, false, {});
      check_certified(in, c, 60.0, in.machine.dialect.path_mode == "spline");
      check_corners(c, in.machine);
    }
}

TEST_CASE("smoothing_convert: other machines are certified with smoothing",
          "[postproc][pipeline][smooth]") {
  for (const char* smoothing : {"acr", "ramp"}) {
    const Overrides overrides = {{"recipe.smoothing", smoothing}};
    for (const char* to : {"head_table_bc", "table_table_bc"})
      for (const std::string* program : {&kZigzag, &kFiveAxis}) {
        INFO(to << " " << smoothing << (program == &kZigzag ? " zigzag" : " five axes"));
        const auto in = prepare(*program, "table_table_ac", to, overrides);
        const Conversion c = convert(in, false, {});
        check_certified(in, c, 60.0, false);
        check_corners(c, in.machine);
      }
    INFO("laser " << smoothing);
    // Corners as they are for every machine, in place of the laser's own splines.
    const Overrides by_corners = {{"recipe.smoothing", smoothing},
                                  {"recipe.optimise", "none"},
                                  {"recipe.orientation", "programmed"},
                                  {"recipe.schedule", "jerk"}};
    auto in = prepare(kLaser, "laser_5p1", "laser_5p1", by_corners);
    in.placement = shifted(700, 600, 1000);
    in.machine.power.min_cut_speed = 0.0;  // its sharp corners are slower
    const Conversion c = convert(in, false, {});
    check_certified(in, c, 0.0, false);
    check_corners(c, in.machine);
  }
}

TEST_CASE("smoothing_convert: an event on a corner is where the input has it",
          "[postproc][pipeline][smooth]") {
  for (const auto& [program, corner] :
       {std::pair{&kZigzag, Vec3(0, 5, 0)}, {&kFiveAxis, Vec3(-20, 30, 1)}}) {
    const auto in = prepare(*program, "table_table_ac", "robot_6r", {});
    const Conversion c = convert(in, false, {});
    REQUIRE(c.verdict == Verdict::certified);
    std::istringstream text(c.program);
    std::string line, last;
    bool found = false;
    while (std::getline(text, line) && !found) {
      if (line.find("$OUT[2]=TRUE") != std::string::npos) found = true;
      if (line.rfind("LIN", 0) == 0 || line.find(" LIN ") != std::string::npos) last = line;
    }
    REQUIRE(found);
    std::smatch m;
    REQUIRE(
        std::regex_search(last, m, std::regex("X ?(-?[0-9.]+), ?Y ?(-?[0-9.]+), ?Z ?(-?[0-9.]+)")));
    INFO(last);
    CHECK((Vec3(std::stod(m[1]), std::stod(m[2]), std::stod(m[3])) - corner).norm() < 2e-4);
    CHECK(last.find("C_DIS") == std::string::npos);
  }
}

TEST_CASE("smoothing_convert: whole rotations are followed and certified",
          "[postproc][pipeline][smooth]") {
  for (const char* dialect : {"krl", "rapid"})
    for (const char* smoothing : {"acr", "ramp", "none"}) {
      INFO(dialect << " " << smoothing);
      const auto in = prepare_rows(
          pose_rows(),
          {{"recipe.task", "pose"}, {"recipe.smoothing", smoothing}, {"dialect.name", dialect}});
      const Conversion c = convert(in, false, {});
      check_certified(in, c, 0.0, false);
      const Check* rotation = find(c, "rotation_deviation");
      REQUIRE(rotation != nullptr);
      CHECK(rotation->ok);
      CHECK(rotation->limit == Approx(degrees_from_radians(in.machine.tolerance.axis)));
      CHECK(rotation->unit == "deg");
      const Dense d = compare(in, c, 0.0, false);
      // The constant between the frames is measured at one place, with that place's deviation.
      CHECK(d.rotation <= 2.0 * rotation->value + 1e-6);
      CHECK(rotation->value >= value(c, "axis_deviation") - 1e-9);
      for (const SmoothedCorner& k : c.corners)
        CHECK(k.rotation_deviation <= 0.5 * in.machine.tolerance.axis + 1e-9);
    }
}

TEST_CASE("smoothing_convert: check finds a rotation about the tool that is wrong",
          "[postproc][pipeline][smooth]") {
  const auto in = prepare_rows(pose_rows(), {{"recipe.task", "pose"}});
  const Conversion c = convert(in, false, {});
  REQUIRE(c.verdict == Verdict::certified);
  const Output output(in, c, 0.0);
  // Every block's rotation once more about the tool axis, KUKA's A B C: R = Rz(A) Ry(B) Rx(C).
  const auto turned = [&](double angle) {
    std::istringstream text(c.program);
    std::ostringstream out;
    std::string line;
    const std::regex words("A ?(-?[0-9.]+), ?B ?(-?[0-9.]+), ?C ?(-?[0-9.]+)");
    std::size_t number = 0, count = 0;
    while (std::getline(text, line)) {
      ++number;
      const auto entry = std::find_if(c.line_map.begin(), c.line_map.end(),
                                      [&](const auto& e) { return e.output_line == number; });
      std::smatch m;
      if (entry != c.line_map.end() && std::regex_search(line, m, words)) {
        const auto i = static_cast<std::size_t>(entry - c.line_map.begin());
        if (output.move(i).interpolation == MoveInterpolation::tool) {
          const auto rad = [&](int k) { return radians_from_degrees(std::stod(m[k])); };
          const Mat3 r = rotation_about(output.axis(output.end(i)), angle) *
                         rotation_from_rpy(rad(3), rad(2), rad(1));
          char abc[120];
          std::snprintf(abc, sizeof abc, "A %.5f,B %.5f,C %.5f",
                        degrees_from_radians(std::atan2(r(1, 0), r(0, 0))),
                        degrees_from_radians(-std::asin(std::clamp(r(2, 0), -1.0, 1.0))),
                        degrees_from_radians(std::atan2(r(2, 1), r(2, 2))));
          line = m.prefix().str() + abc + m.suffix().str();
          ++count;
        }
      }
      out << line << "\n";
    }
    CHECK(count > 20);
    return out.str();
  };
  for (const double angle : {0.0, 0.02}) {
    CheckInput check;
    check.text = turned(angle);
    check.file_name = "part.src";
    check.machine = in.machine;
    check.against = in.input;
    const Conversion found = check_program(check, {});
    for (const auto& d : found.diagnostics) UNSCOPED_INFO(to_string(d));
    for (const auto& k : found.checks)
      UNSCOPED_INFO(k.name << " " << k.value << " limit " << k.limit << (k.ok ? "" : " FAILED"));
    INFO("angle " << angle);
    const Check* axis = find(found, "axis_deviation");
    if (axis != nullptr) CHECK(axis->ok);
    const Check* rotation = find(found, "rotation_deviation");
    CHECK((found.verdict == Verdict::certified) == (angle == 0.0));
    CHECK(rotation != nullptr);
    if (rotation == nullptr) continue;
    CHECK(rotation->ok == (angle == 0.0));
    if (angle > 0.0) CHECK_FALSE(rotation->value <= rotation->limit);  // no matching: no bound
  }
}

TEST_CASE("smoothing_convert: a rotation about the tool that is wrong fails whole rotations only",
          "[postproc][pipeline][smooth]") {
  const auto in = prepare_rows(pose_rows(), {{"recipe.task", "pose"}});
  const Conversion c = convert(in, false, {});
  REQUIRE(c.verdict == Verdict::certified);
  const ReferencePath reference(in.input.path, in.input.frames);
  const ScrewChain chain = chain_of(in.machine);
  const ReadBack printed = find_dialect("krl")->read_back(in.machine, c.program, "output").value();
  REQUIRE(printed.moves.size() == c.line_map.size());
  const auto checks_of = [&](const ReadBack& read, const Mat3& whole) {
    MachineProgram planned;  // as read: only the rotation can show
    for (const auto& move : read.moves) {
      MachineMove m;
      m.to = move.to;
      m.tool = move.tool;
      m.interpolation = move.interpolation;
      planned.moves.push_back(m);
    }
    DeviationInput against{reference, c.line_map, planned, chain, ToolTurn::slerp};
    against.whole_rotation = whole;
    std::map<std::string, Check> checks;
    for (const Check& k : verify_deviation(read, in.machine, against, {})) {
      UNSCOPED_INFO(k.name << " " << k.value << " limit " << k.limit);
      checks[k.name] = k;
    }
    return checks;
  };
  // The constant rotation between the frames, from a block in the middle.
  std::size_t block = c.line_map.size() / 2;
  while (c.line_map[block].role != MoveRole::path) ++block;
  REQUIRE(printed.moves[block].interpolation == MoveInterpolation::tool);
  const Mat3 whole = printed.moves[block].tool.linear().transpose() *
                     reference.rotation_at(c.line_map[block].segment, c.line_map[block].to_share)
                         .toRotationMatrix();
  auto good = checks_of(printed, whole);
  CHECK(good["rotation_deviation"].ok);
  CHECK(good["rotation_deviation"].value > 0.0);
  for (const double angle : {-0.02, 0.02}) {  // rad
    ReadBack read = printed;
    read.moves[block].tool.linear() =
        read.moves[block].tool.linear() * rotation_about(chain.tool_axis, angle);
    auto bad = checks_of(read, whole);
    CHECK_FALSE(bad["rotation_deviation"].ok);
    CHECK(bad["rotation_deviation"].value == Approx(degrees_from_radians(0.02)).margin(0.05));
    CHECK(bad["rotation_deviation"].input_line > 0);
    CHECK(bad["axis_deviation"].ok);
    CHECK(bad["tip_deviation"].ok);
  }
}

TEST_CASE("smoothing_convert: whole rotations of an input without them are refused by name",
          "[postproc][pipeline][smooth]") {
  InputSettings settings;
  settings.file_name = "part.ngc";
  auto read = interpret_nc("G21 G90 G94\nG0 X0 Y0 Z20\nG1 Z0 F600\nG1 X30\nG1 Y30\nG0 Z20\nM30\n",
                           settings);
  REQUIRE(read.ok());
  ConvertInput in;
  in.input = std::move(read.value());
  in.input_name = "part.ngc";
  in.machine = shipped_machine("robot_6r", {{"recipe.task", "pose"}});
  for (const bool force : {false, true}) {
    const Conversion c = convert(in, force, {});
    CHECK(c.verdict == Verdict::refused);
    CHECK(c.program.empty());
    std::string said;
    for (const auto& d : c.diagnostics)
      if (d.severity == Severity::error) said += to_string(d);
    INFO(said);
    CHECK(said.find("pose") != std::string::npos);
    CHECK(said.find("rotation") != std::string::npos);
  }
  in.machine = shipped_machine("robot_6r");
  CHECK(convert(in, false, {}).verdict == Verdict::certified);
}

TEST_CASE("smoothing_convert: smoothing without a share of the tolerance is refused",
          "[postproc][pipeline][smooth]") {
  const Overrides nothing = {{"tolerance.budget.smoothing", "0.0"},
                             {"tolerance.budget.merge", "0.0"},
                             {"tolerance.budget.chord", "0.65"},
                             {"tolerance.budget.rounding", "0.05"},
                             {"tolerance.budget.controller", "0.30"}};
  const std::string text = read_bytes(source_path("machines/robot_6r/machine.toml"));
  const auto machine = parse_machine_file(text, "robot_6r", nothing);
  std::string said;
  for (const auto& d : machine.diagnostics()) said += to_string(d);
  if (machine.ok()) {
    ConvertInput in;
    in.input = read_program(kZigzag, "table_table_ac");
    in.machine = machine.value();
    in.input_name = "part.ngc";
    const Conversion c = convert(in, false, {});
    CHECK(c.verdict == Verdict::refused);
    for (const auto& d : c.diagnostics) said += to_string(d);
  }
  INFO(said);
  CHECK(said.find("smoothing") != std::string::npos);
  auto without = nothing;
  without.push_back({"recipe.smoothing", "none"});
  CHECK(parse_machine_file(text, "robot_6r", without).ok());
}

namespace {

/// The path's first `rows` poses by KRL and by RAPID.
void waypoints_on_an_arm(std::size_t krl_rows, std::size_t rapid_rows) {
  const auto path =
      shared_path("corpus/4_robot/Mnenmenth/testToolpaths/f2/f1_Kuka_APT210T03S10.SRC.gz");
  if (!path) {
    WARN("no corpus: skipped");
    return;
  }
  std::istringstream text(read_bytes(*path));
  std::ostringstream rows;
  rows << "x_mm,y_mm,z_mm,rz_deg,ry_deg,rx_deg,feed_mm_per_min\n";
  std::string line;
  std::size_t count = 0;
  while (std::getline(text, line)) {
    char x[32], y[32], z[32], a[32], b[32], c[32];
    if (std::sscanf(
            line.c_str(),
            "LIN {X %31[-0-9.],Y %31[-0-9.],Z %31[-0-9.],A %31[-0-9.],B %31[-0-9.],C %31[-0-9.]", x,
            y, z, a, b, c) != 6)
      continue;
    rows << x << "," << y << "," << z << "," << a << "," << b << "," << c << ",3000\n";
    ++count;
  }
  REQUIRE(count == 6000);
  for (const char* dialect : {"krl", "rapid"}) {
    INFO(dialect);
    std::string path_rows = rows.str();
    const std::size_t wanted = std::string(dialect) == "rapid" ? rapid_rows : krl_rows;
    if (wanted < count) {
      std::size_t end = 0;
      for (std::size_t i = 0; i <= wanted; ++i) end = path_rows.find('\n', end) + 1;
      path_rows.resize(end);
    }
    auto in = prepare_rows(path_rows, {{"recipe.task", "pose"}, {"dialect.name", dialect}});
    in.placement = shifted(0, 0, -600);
    in.collision_check = false;  // nobody has placed this path above our table
    const Conversion c = convert(in, false, {});
    check_certified(in, c, 0.0, false);
    REQUIRE(find(c, "rotation_deviation") != nullptr);
    CHECK(find(c, "rotation_deviation")->ok);
    check_corners(c, in.machine);
    CHECK(c.blocks > 100);
  }
}

}  // namespace

TEST_CASE("smoothing_convert: a part of a waypoint path of whole rotations on an arm",
          "[postproc][pipeline][smooth][corpus]") {
  waypoints_on_an_arm(200, 150);
}

TEST_CASE("smoothing_convert: a waypoint path of six thousand whole rotations on an arm",
          "[.slow][slow][postproc][pipeline][smooth][corpus]") {
  waypoints_on_an_arm(6000, 1500);
}
