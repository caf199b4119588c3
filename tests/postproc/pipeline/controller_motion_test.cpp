#include "postproc/pipeline/controller_motion.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "kernels/core/units.h"
#include "tests/postproc/pipeline/paths.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

ReadBackMove joint_move(const JointVector& q, std::uint32_t line, JointMask known) {
  ReadBackMove m;
  m.to = q;
  m.known = known;
  m.rapid = true;
  m.line = line;
  return m;
}

ReadBackMove tool_move(const Pose& tool, std::uint32_t line, double seconds = 2.0) {
  ReadBackMove m;
  m.interpolation = MoveInterpolation::tool;
  m.tool = tool;
  m.duration = seconds;
  m.line = line;
  return m;
}

struct Bench {
  MachineDefinition machine;
  Inverse inverse;
  ToolTurn turn;
  JointVector start;
  JointMask all() const { return (1U << machine.size()) - 1U; }
  FollowSettings settings(double length) const {
    FollowSettings s;
    s.turn = turn;
    s.tip_tolerance = 1e-3;
    s.axis_tolerance = 1e-5;
    s.tool_length = [length](std::size_t) { return length; };
    return s;
  }
};

Bench bench(const std::string& name) {
  MachineDefinition machine = shipped_machine(name);
  auto inverse = Inverse::from(chain_of(machine));
  REQUIRE(inverse);
  JointVector start = home_of(machine);
  if (name == "head_table_bc") start[machine.axis_by_name("B")] = 0.3;
  return {machine, std::move(*inverse),
          name == "robot_6r" ? ToolTurn::slerp : ToolTurn::great_circle, start};
}

/// Tool poses around the start.
std::vector<Pose> poses(const Bench& b, double length, unsigned seed, int count) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::vector<Pose> out;
  const Pose first = tip_pose(b.inverse.chain(), b.start, length);
  for (int i = 0; i < count; ++i) {
    Pose p = first;
    p.translation() += 60.0 * Vec3(u(rng), u(rng), u(rng));
    p.linear() = rotation_exp(0.15 * Vec3(u(rng), u(rng), u(rng))) * first.linear();
    out.push_back(p);
  }
  return out;
}

bool has_failed(const Result<ControllerMotion>& r, const std::string& code, int line) {
  if (r.ok()) return false;
  for (const auto& d : r.diagnostics())
    if (d.code == code && d.where.line == line) return true;
  return false;
}

}  // namespace

TEST_CASE("controller_motion: steps stay on the tool's own way",
          "[postproc][pipeline][controller]") {
  for (const char* name : {"robot_6r", "head_table_bc"}) {
    const Bench b = bench(name);
    const ScrewChain& chain = b.inverse.chain();
    for (const double length : {0.0, 80.0}) {
      ReadBack read;
      read.moves.push_back(joint_move(b.start, 1, b.all()));
      const auto way = poses(b, length, 3, 25);
      for (const Pose& p : way)
        read.moves.push_back(tool_move(p, static_cast<std::uint32_t>(read.moves.size() + 1)));
      const auto result = follow_controller(read, b.inverse, b.settings(length));
      for (const auto& d : result.diagnostics()) UNSCOPED_INFO(to_string(d));
      REQUIRE(result.ok());
      const ControllerMotion& motion = result.value();
      REQUIRE(motion.steps);
      CHECK(&motion.joints() == &*motion.steps);
      REQUIRE(motion.read.moves.size() == read.moves.size());
      double tip = 0.0, axis = 0.0;
      std::size_t k = 1;
      for (std::size_t i = 1; i < read.moves.size(); ++i) {
        const Pose from = tip_pose(chain, motion.read.moves[i - 1].to, length);
        CHECK(motion.read.moves[i].known == b.all());
        double done = 0.0;
        for (; k < motion.steps->moves.size() && motion.steps->moves[k].line == read.moves[i].line;
             ++k) {
          const auto& step = motion.steps->moves[k];
          CHECK(step.interpolation == MoveInterpolation::joints);
          CHECK(step.known == b.all());
          const JointVector& q0 = motion.steps->moves[k - 1].to;
          for (int n = 0; n <= 10; ++n) {
            const double share = (done + 0.1 * n * step.duration) / read.moves[i].duration;
            const Pose wanted = tool_motion(from, way[i - 1], share, b.turn, chain.tool_axis);
            const Pose got = tip_pose(chain, q0 + 0.1 * n * (step.to - q0), length);
            tip = std::max(tip, (wanted.translation() - got.translation()).norm());
            axis = std::max(axis, angle_between(wanted.linear() * chain.tool_axis,
                                                got.linear() * chain.tool_axis));
          }
          done += step.duration;
        }
        CHECK(done == Approx(read.moves[i].duration));
        CHECK((motion.steps->moves[k - 1].to - motion.read.moves[i].to).norm() == 0.0);
      }
      CHECK(k == motion.steps->moves.size());
      INFO(name << " tip " << tip << " axis " << axis << " in " << k << " steps");
      CHECK(tip <= 1e-3);
      CHECK(axis <= 1e-5);
      CHECK(tip > 1e-5);
    }
  }
}

TEST_CASE("controller_motion: a move goes to the nearest solution",
          "[postproc][pipeline][controller]") {
  // The table has wound C up by a turn: it stays there.
  const Bench b = bench("head_table_bc");
  const int c = b.machine.axis_by_name("C");
  JointVector q = b.start;
  q[c] += 2.0 * kPi;
  ReadBack read;
  read.moves.push_back(joint_move(q, 1, b.all()));
  JointVector to = q;
  to[c] += 0.2;
  read.moves.push_back(tool_move(tip_pose(b.inverse.chain(), to, 0.0), 2));
  const auto result = follow_controller(read, b.inverse, b.settings(0.0));
  REQUIRE(result.ok());
  CHECK((result.value().read.moves[1].to - to).norm() < 1e-8);
}

TEST_CASE("controller_motion: joint programs pass unchanged", "[postproc][pipeline][controller]") {
  const Bench b = bench("robot_6r");
  ReadBack read;
  read.moves.push_back(joint_move(b.start, 1, b.all()));
  JointVector q = b.start;
  q[2] += 3.0;
  read.moves.push_back(joint_move(q, 2, b.all()));
  read.events.push_back({1, "beam_on", 0.0, true, 2});
  const auto result = follow_controller(read, b.inverse, b.settings(0.0));
  REQUIRE(result.ok());
  CHECK_FALSE(result.value().steps);
  CHECK(&result.value().joints() == &result.value().read);
  CHECK((result.value().read.moves[1].to - q).norm() == 0.0);
}

TEST_CASE("controller_motion: joint moves and events between tool moves",
          "[postproc][pipeline][controller]") {
  const Bench b = bench("head_table_bc");
  const auto way = poses(b, 0.0, 8, 4);
  ReadBack read;
  read.moves = {joint_move(b.start, 1, b.all()), tool_move(way[0], 2), tool_move(way[1], 3)};
  JointVector q = b.start;
  q[2] += 5.0;
  read.moves.push_back(joint_move(q, 4, 1U << 2));  // names one axis: the others stay
  read.moves.push_back(tool_move(way[2], 5));
  read.moves[2].beam = true;
  read.events = {{0, "gas_on", 0.0, false, 1},
                 {2, "beam_on", 0.0, true, 3},
                 {3, "beam_off", 0.0, false, 4},
                 {5, "gas_off", 0.0, false, 6}};
  const auto result = follow_controller(read, b.inverse, b.settings(0.0));
  for (const auto& d : result.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(result.ok());
  const ReadBack& steps = *result.value().steps;
  const ReadBack& moves = result.value().read;
  for (int j = 0; j < b.machine.size(); ++j)
    CHECK(moves.moves[3].to[j] == (j == 2 ? q[2] : moves.moves[2].to[j]));
  REQUIRE(steps.events.size() == 4);
  const auto first_of = [&](std::uint32_t line) {
    std::size_t i = 0;
    while (i < steps.moves.size() && steps.moves[i].line < line) ++i;
    return i;
  };
  CHECK(steps.events[0].before == 0);
  CHECK(steps.events[1].before == first_of(3));
  CHECK(steps.events[2].before == first_of(4));
  CHECK(steps.events[3].before == steps.moves.size());
  for (const auto& m : steps.moves) CHECK(m.beam == (m.line == 3));
}

TEST_CASE("controller_motion: what cannot be followed is refused with its line",
          "[postproc][pipeline][controller]") {
  const Bench b = bench("head_table_bc");
  const Pose here = tip_pose(b.inverse.chain(), b.start, 0.0);
  ReadBack read;
  read.moves = {tool_move(here, 7)};
  CHECK(has_failed(follow_controller(read, b.inverse, b.settings(0.0)), "KN120", 7));
  read.moves = {joint_move(b.start, 1, b.all() & ~2U), tool_move(here, 8)};
  CHECK(has_failed(follow_controller(read, b.inverse, b.settings(0.0)), "KN120", 8));

  const Bench arm = bench("robot_6r");
  const Pose at = tip_pose(arm.inverse.chain(), arm.start, 0.0);
  Pose far = at;
  far.translation() += Vec3(5000, 0, 0);
  read.moves = {joint_move(arm.start, 1, arm.all()), tool_move(at, 2), tool_move(far, 3)};
  CHECK(has_failed(follow_controller(read, arm.inverse, arm.settings(0.0)), "KN121", 3));
  // Both ends can be reached, but between them the wrist swings out too far.
  const ScrewChain& chain = arm.inverse.chain();
  const Vec3 wrist(-390, 0, 120);  // from the tip, in T
  const Mat3 outward = Eigen::Quaterniond::FromTwoVectors(wrist, Vec3::UnitX()).toRotationMatrix();
  Pose from = Pose::Identity();
  from.translation() =
      chain.workpiece_home.inverse() * Vec3(350 + 1682.7 + 20 - wrist.norm(), 0, 815);
  Pose to = from;
  from.linear() = rotation_about(Vec3::UnitZ(), -0.9) * outward;
  to.linear() = rotation_about(Vec3::UnitZ(), 0.9) * outward;
  const auto begin = arm.inverse.nearest(from, arm.start);
  REQUIRE(begin);
  REQUIRE(arm.inverse.nearest(to, arm.start));
  read.moves = {joint_move(*begin, 1, arm.all()), tool_move(to, 4)};
  CHECK(has_failed(follow_controller(read, arm.inverse, arm.settings(0.0)), "KN121", 4));
}

TEST_CASE("controller_motion: past a pole the axes would have to jump",
          "[postproc][pipeline][controller]") {
  const Bench b = bench("head_table_bc");
  const int bb = b.machine.axis_by_name("B");
  const ScrewChain& chain = b.inverse.chain();
  JointVector q = b.start;
  for (const double beside : {0.02, 1e-9}) {  // rad that the axis passes beside the pole
    q[bb] = 0.1;
    const Pose from = tip_pose(chain, q, 0.0);
    Pose to = from;
    const Vec3 a = from.linear() * chain.tool_axis;
    Vec3 side = Vec3::UnitZ().cross(a).normalized();
    const Vec3 over = Vec3(-a.x(), -a.y(), a.z()) + 2.0 * beside * side;
    to.linear() =
        Eigen::Quaterniond::FromTwoVectors(a, over.normalized()).toRotationMatrix() * from.linear();
    ReadBack read;
    read.moves = {joint_move(q, 1, b.all()), tool_move(to, 2)};
    const auto result = follow_controller(read, b.inverse, b.settings(0.0));
    INFO(beside);
    if (beside > 1e-3)
      CHECK(result.ok());
    else
      CHECK((result.ok() || has_failed(result, "KN122", 2)));
    if (!result.ok()) continue;
    // Whatever was found has no step that is a jump.
    const auto& moves = result.value().joints().moves;
    for (std::size_t i = 1; i < moves.size(); ++i)
      CHECK((moves[i].to - moves[i - 1].to).tail(2).lpNorm<Eigen::Infinity>() < 0.36);
  }
}

TEST_CASE("tool_motion: slerp and great circle", "[postproc][pipeline][controller]") {
  std::mt19937 rng(2);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  const Vec3 axis = Vec3(0.3, -0.2, 1).normalized();
  for (int round = 0; round < 200; ++round) {
    Pose a = Pose::Identity(), b = Pose::Identity();
    a.linear() = rotation_exp(Vec3(u(rng), u(rng), u(rng)));
    b.linear() = rotation_exp(Vec3(u(rng), u(rng), u(rng))) * a.linear();
    a.translation() = 100.0 * Vec3(u(rng), u(rng), u(rng));
    b.translation() = 100.0 * Vec3(u(rng), u(rng), u(rng));
    const Eigen::Quaterniond qa(a.linear()), qb(b.linear());
    const auto slerp_bound = tool_motion_bound(a, b, ToolTurn::slerp, axis);
    const auto circle_bound = tool_motion_bound(a, b, ToolTurn::great_circle, axis);
    CHECK(slerp_bound.tip == 0.0);
    const double h = 1e-4;
    for (int k = 1; k < 10; ++k) {
      const double t = 0.1 * k;
      const Pose s = tool_motion(a, b, t, ToolTurn::slerp, axis);
      CHECK((s.linear() - qa.slerp(t, qb).toRotationMatrix()).norm() < 1e-9);
      CHECK((s.translation() - (a.translation() + t * (b.translation() - a.translation()))).norm() <
            1e-12);
      const Pose g = tool_motion(a, b, t, ToolTurn::great_circle, axis);
      CHECK((g.linear() * axis - great_circle(a.linear() * axis, b.linear() * axis, t)).norm() <
            1e-9);
      for (const ToolTurn turn : {ToolTurn::slerp, ToolTurn::great_circle}) {
        const auto at = [&](double x) {
          return Vec3(tool_motion(a, b, x, turn, axis).linear() * axis);
        };
        const double second = (at(t + h) - 2.0 * at(t) + at(t - h)).norm() / (h * h);
        CHECK(second <= (turn == ToolTurn::slerp ? slerp_bound : circle_bound).axis + 1e-6);
      }
    }
  }
}

TEST_CASE("tool_motion: tip and holder poses undo each other", "[postproc][pipeline][controller]") {
  const auto machine = shipped_machine("robot_6r");
  const ScrewChain bare = chain_of(machine), with_tool = chain_of(machine, 73.0);
  const JointVector q = home_of(machine);
  const Pose tip = tip_pose(bare, q, 73.0);
  CHECK((tip.translation() - forward(with_tool, q).translation()).norm() < 1e-9);
  CHECK(holder_pose(bare, tip, 73.0).isApprox(forward(bare, q), 1e-12));
}
