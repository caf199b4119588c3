#include "postproc/pipeline/curve_blocks.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "kernels/core/units.h"
#include "kernels/spline/bent_move.h"
#include "postproc/pipeline/clearance_check.h"
#include "postproc/pipeline/controller_motion.h"
#include "postproc/pipeline/convert.h"
#include "postproc/pipeline/cuts.h"
#include "postproc/pipeline/tool_motion.h"
#include "postproc/pipeline/verify.h"
#include "tests/postproc/pipeline/certified_program.h"
#include "tests/postproc/pipeline/paths.h"

// Bent moves: planned, printed, read back and verified.
using namespace smoothpost;
using namespace smoothpost::test;

namespace {

// Lines and an arc with both rotaries moving, a coolant event inside of the cut.
const std::string kMill =
    "%\nM428\nG21 G17 G90 G94 G40\nT1 M6\nG54\nS1000 M3\nG0 X-20 Y-10 A0 C0\nG43 H1 Z30\nG0 Z2\n"
    "G1 Z0 F600\nG1 X20 A-8 C5 F1200\nG1 X22 Y5 A-10 C12\nG1 X5 Y8 Z2 A-14 C20\n"
    "G3 X5 Y28 I0 J10 C28\nG1 X-20 Y30 Z1 A-5 C10\nM8\nG1 X-25 Y0 Z0 A-12 C0\nG0 Z40\n"
    "M9\nM5\nM429\nM30\n%\n";

ConvertInput prepare(const char* curves, const char* to = "head_table_bc") {
  ConvertInput in;
  in.input = read_program(kMill, "table_table_ac");
  in.machine = shipped_machine(to, {{"dialect.name", "siemens_840d"},
                                    {"dialect.mode", "joint"},
                                    {"dialect.curves", curves},
                                    {"recipe.smoothing", "acr"}});
  in.input_name = "part.ngc";
  return in;
}

}  // namespace

TEST_CASE("curve_blocks: fewer blocks, the same path and time", "[postproc][pipeline][curves]") {
  const Conversion lines = converted(prepare("lines"));
  for (const char* curves : {"cubic", "quintic"}) {
    INFO(curves);
    const ConvertInput in = prepare(curves);
    const Conversion c = converted(in);
    const ReadBack back = read_text(in, c.program);
    std::size_t bent = 0;
    for (const auto& move : back.moves) bent += move.bend.rows() > 0 ? 1 : 0;
    CAPTURE(lines.blocks, c.blocks, bent);
    CHECK(bent > 10);
    CHECK(3 * c.blocks < lines.blocks);
    CHECK(c.scheduled_time == Approx(lines.scheduled_time).epsilon(1e-4));
    CHECK(c.program.find("UPATH") != std::string::npos);
    const ReadBack straight = read_text(prepare("lines"), lines.program);
    check_same_events(back, straight, 1e-4);
  }
}

TEST_CASE("curve_blocks: the certified deviation bounds an independent dense comparison",
          "[postproc][pipeline][curves]") {
  for (const char* curves : {"cubic", "quintic"}) {
    const ConvertInput in = prepare(curves);
    const Conversion c = converted(in);
    const ReadBack back = read_text(in, c.program);
    ToolPath path = in.input.path;
    find_cuts(path, {});
    const ReferencePath reference(path, in.input.frames);
    const ScrewChain chain = chain_of(in.machine, 60.0);
    double tip = 0.0, axis = 0.0;
    int samples = 0;
    for (std::size_t i = 1; i < back.moves.size(); ++i) {
      const auto& e = c.line_map[i];
      if (e.role != MoveRole::path || e.from_segment != e.segment || back.moves[i].bend.rows() == 0)
        continue;
      const JointVector &q0 = back.moves[i - 1].to, &q1 = back.moves[i].to;
      const JointBend& b = back.moves[i].bend;
      for (int k = 0; k <= 200; ++k) {
        const double t = k / 200.0;
        // a0 + a1 t + a2 t² + ... with a1 from the end.
        const JointVector a1 = q1 - q0 - b.rowwise().sum();
        const JointVector q =
            q0 + t * (a1 + t * (b.col(0) + t * (b.col(1) + t * (b.col(2) + t * b.col(3)))));
        const CutterLocation out = forward_location(chain, q);
        const auto wanted = reference.at(e.segment, e.from_share + t * (e.to_share - e.from_share));
        tip = std::max(tip, (out.tip - wanted.tip).norm());
        axis = std::max(axis, angle_between(out.axis, wanted.axis));
        ++samples;
      }
    }
    CAPTURE(curves, tip, axis, samples);
    CHECK(samples > 1000);
    CHECK(tip <= find(c.checks, "tip_deviation").value);
    CHECK(degrees_from_radians(axis) <= find(c.checks, "axis_deviation").value);
  }
}

TEST_CASE("curve_blocks: neighbours meet in tangent, of degree 5 in curvature too",
          "[postproc][pipeline][curves]") {
  for (const char* curves : {"cubic", "quintic"}) {
    const ConvertInput in = prepare(curves);
    const ReadBack back = read_text(in, converted(in).program);
    const bool quintic = curves[0] == 'q';
    int met = 0;
    double turn = 0.0, jump = 0.0, bent = 0.0;
    for (std::size_t i = 2; i < back.moves.size(); ++i) {
      const ReadBackMove &a = back.moves[i - 1], &b = back.moves[i];
      if (a.bend.rows() == 0 || b.bend.rows() == 0) continue;
      const bool event = std::any_of(back.events.begin(), back.events.end(),
                                     [i](const ReadBackEvent& e) { return e.before == i; });
      if (event) continue;
      const BentMove one{back.moves[i - 2].to, a.to, a.bend}, two{a.to, b.to, b.bend};
      const JointVector v = rates_at(one, 1.0), w = rates_at(two, 0.0);
      // Where the path stops at a corner nothing is to meet.
      const double angle = (v.normalized() - w.normalized()).norm();
      if (angle > 0.02) continue;
      turn = std::max(turn, angle);
      const auto curvature = [](const JointVector& first, const JointVector& second) {
        const JointVector t = first.normalized();
        return JointVector((second - second.dot(t) * t) / first.squaredNorm());
      };
      const JointVector k = curvature(v, second_at(one, 1.0)), l = curvature(w, second_at(two, 0));
      jump = std::max(jump, (k - l).norm());
      bent = std::max(bent, k.norm());
      ++met;
    }
    CAPTURE(curves, met, turn, jump, bent);
    CHECK(met > 5);
    // What five decimals leave of blocks of some millimetres.
    CHECK(turn < 1e-3);
    if (quintic) CHECK(jump < 0.02 * bent);
  }
}

namespace {

ReadBackMove move_to(const JointVector& q, double seconds, std::uint32_t line) {
  ReadBackMove move;
  move.to = q;
  move.known = (JointMask{1} << q.size()) - 1U;
  move.duration = seconds;
  move.rapid = !(seconds > 0.0);
  move.line = line;
  return move;
}

/// From home and back to it; joint `j` goes out by `out` in the middle.
ReadBack bulge(const JointVector& home, int j, double out) {
  ReadBack read;
  read.exact_path = true;
  read.moves = {move_to(home, 0.0, 1), move_to(home, 2.0, 2)};
  read.moves[1].bend = JointBend::Zero(home.size(), 4);
  read.moves[1].bend(j, 0) = -4.0 * out;
  return read;
}

FollowSettings close_steps() {
  FollowSettings settings;
  settings.tip_tolerance = 1e-3;
  settings.axis_tolerance = 1e-5;
  return settings;
}

}  // namespace

TEST_CASE("curve_blocks: limits hold between the ends of a bent move",
          "[postproc][pipeline][curves]") {
  const MachineDefinition machine = shipped_machine("head_table_bc");
  const ScrewChain chain = chain_of(machine);
  for (int j = 0; j < machine.size(); ++j) {
    const AxisDefinition& axis = machine.axes[static_cast<std::size_t>(j)];
    const double scale = axis.joint.kind == JointKind::rotary ? kDegreesPerRadian : 1.0;
    const JointVector home = home_of(machine);
    const double room = axis.joint.upper - home[j];
    const double reach = std::min(room, 0.2 * axis.velocity);
    for (const double share : {0.99, 1.01}) {
      CAPTURE(axis.name, share);
      const auto motion = follow_joints(bulge(home, j, share * room), chain, close_steps());
      const Verification v = verify_machine(motion.joints(), machine);
      CHECK(find(v.checks, "position_limit." + axis.name).ok == (share < 1.0));
    }
    // q' = −4 out (2τ − 1) over 2 s: 2·out mm/s at the ends, 0 on the whole.
    const auto motion = follow_joints(bulge(home, j, reach), chain, close_steps());
    const double peak =
        verify_machine(motion.joints(), machine).axes[static_cast<std::size_t>(j)].peak_velocity;
    CHECK(peak >= 2.0 * reach * scale * (1.0 - 1e-12));
    CHECK(peak <= 1.1 * 2.0 * reach * scale);
  }
}

TEST_CASE("curve_blocks: straight steps of a bent move and how far it is from them",
          "[postproc][pipeline][curves]") {
  const MachineDefinition machine = shipped_machine("laser_5p1");
  const ScrewChain chain = chain_of(machine);
  std::mt19937 rng(5);
  std::normal_distribution<double> normal;
  double tip_off = 0.0, axis_off = 0.0, tip_said = 0.0, axis_said = 0.0;
  for (int n = 0; n < 60; ++n) {
    ReadBack read;
    JointVector from = home_of(machine), to = from;
    for (int j = 0; j < machine.size(); ++j)
      to[j] += 20.0 * normal(rng) * (j == 3 || j == 4 ? 0.01 : 1.0);
    read.moves = {move_to(from, 0.0, 1), move_to(to, 0.5, 2), move_to(from, 0.25, 3)};
    JointBend& bend = read.moves[1].bend;
    bend = JointBend::NullaryExpr(machine.size(), 4, [&](Eigen::Index j, Eigen::Index) {
      return 5.0 * normal(rng) * (j == 3 || j == 4 ? 0.02 : 1.0);
    });
    read.events.push_back({2, "dwell", 1.0, false, 3});
    const BentMove bent{from, to, bend};
    const ControllerMotion motion = follow_joints(read, chain, close_steps());
    REQUIRE(motion.steps);
    CHECK(motion.read.moves.size() == 3);
    const auto& steps = motion.steps->moves;
    const std::size_t count = steps.size() - 2;
    REQUIRE(count > 3);
    CHECK(motion.steps->events[0].before == count + 1);
    CHECK((steps[count].to - to).norm() == 0.0);
    const StepAllowance said = step_allowance(*motion.steps, chain, 80.0);
    double time = 0.0;
    for (std::size_t k = 1; k <= count; ++k) {
      time += steps[k].duration;
      for (int m = 0; m <= 8; ++m) {
        const double share = m / 8.0;
        const double tau = (static_cast<double>(k - 1) + share) / static_cast<double>(count);
        const JointVector q = joints_at(bent, tau);
        const JointVector step = steps[k - 1].to + share * (steps[k].to - steps[k - 1].to);
        for (int j = 0; j < machine.size(); ++j) {
          REQUIRE(std::abs(q[j] - step[j]) <= steps[k].deviation[j] + 1e-12);
          const bool rotary = j == 3 || j == 4;
          REQUIRE(steps[k].deviation[j] <= (rotary ? 1e-5 : 1e-3));
        }
        const Pose a = tip_pose(chain, q, 80.0), b = tip_pose(chain, step, 80.0);
        const double off = (a.translation() - b.translation()).norm();
        const double turn =
            angle_between(a.linear() * chain.tool_axis, b.linear() * chain.tool_axis);
        REQUIRE(off <= said.tip + 1e-9);
        REQUIRE(turn <= said.axis + 1e-9);
        tip_off = std::max(tip_off, off);
        axis_off = std::max(axis_off, turn);
      }
      tip_said = std::max(tip_said, said.tip);
      axis_said = std::max(axis_said, said.axis);
    }
    CHECK(time == Approx(0.5));
  }
  CAPTURE(tip_off, tip_said, axis_off, axis_said);
  CHECK(tip_off > 0.1 * tip_said);
  CHECK(axis_off > 0.1 * axis_said);
}

namespace {

TriangleMesh box(const Vec3& low, const Vec3& high) {
  TriangleMesh mesh;
  for (int k = 0; k < 8; ++k)
    mesh.vertices.emplace_back(k & 1 ? high.x() : low.x(), k & 2 ? high.y() : low.y(),
                               k & 4 ? high.z() : low.z());
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

}  // namespace

TEST_CASE("curve_blocks: a bent move that runs into the part is not free",
          "[postproc][pipeline][curves][collision]") {
  const MachineDefinition machine = shipped_machine("laser_5p1");
  const ScrewChain chain = chain_of(machine);
  // The casing, 60 mm round the tool from 160 mm above the tip, passes a post at y 690 to 700.
  const TriangleMesh post = box({795, 690, 0}, {815, 700, 500});
  auto scene = machine_scene({machine, chain, &post, nullptr, 0.0});
  REQUIRE(scene.ok());
  REQUIRE(scene.value());
  JointVector from = JointVector::Zero(machine.size());
  from.head<3>() = Vec3(700, 500, 200);
  JointVector to = from;
  to[0] = 900;
  for (const double out : {0.0, 110.0, 150.0}) {
    ReadBack read;
    read.moves = {move_to(from, 0.0, 1), move_to(to, 1.0, 2)};
    if (out > 0.0) {
      read.moves[1].bend = JointBend::Zero(machine.size(), 4);
      read.moves[1].bend(1, 0) = -4.0 * out;
    }
    const auto motion = follow_joints(read, chain, close_steps());
    const ClearanceReport report = check_clearance(*scene.value(), motion.joints(), machine, {});
    INFO(out);
    CHECK((report.moves == 0) == (out < 120.0));
  }
}

TEST_CASE("curve_blocks: check reads polynomials, and finds one that was changed",
          "[postproc][pipeline][curves]") {
  const ConvertInput in = prepare("quintic");
  const Conversion c = converted(in);
  const auto checked = [&](const std::string& text) {
    CheckInput check;
    check.text = text;
    check.file_name = "part.mpf";
    check.machine = in.machine;
    check.against = in.input;
    check.tool_length = 60.0;
    return check_program(check, {});
  };
  const Conversion good = checked(c.program);
  for (const auto& d : good.diagnostics) UNSCOPED_INFO(to_string(d));
  CHECK(good.verdict == Verdict::certified);
  // The second power of the first axis by 0.2 mm: 0.05 mm in the middle, nothing at the ends.
  const auto at = c.program.find(" X=PO(");
  REQUIRE(at != std::string::npos);
  const auto from = c.program.find(',', at) + 1;
  const auto to = c.program.find_first_of(",)", from);
  const double value = std::stod(c.program.substr(from, to - from));
  std::string changed = c.program;
  changed.replace(from, to - from, std::to_string(value + 0.2));
  CHECK(checked(changed).verdict == Verdict::refused);
}

TEST_CASE("curve_blocks: the joints by time are the same", "[postproc][pipeline][curves]") {
  ConvertInput lines = prepare("lines"), curves = prepare("quintic");
  lines.timed = curves.timed = true;
  const Conversion a = converted(lines), b = converted(curves);
  REQUIRE(a.timeline.duration() == Approx(b.timeline.duration()).epsilon(1e-9));
  double off = 0.0;
  std::size_t i = 0, k = 0;
  for (double t = 0.0; t < a.timeline.duration(); t += 0.01) {
    i = a.timeline.item_at(t, i);
    k = b.timeline.item_at(t, k);
    off = std::max(off, (a.timeline.at(a.timeline.items[i], t).position -
                         b.timeline.at(b.timeline.items[k], t).position)
                            .cwiseAbs()
                            .maxCoeff());
  }
  CHECK(off < 1e-9);
}
