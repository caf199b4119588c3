#include "postproc/pipeline/links.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "kernels/core/units.h"
#include "tests/postproc/pipeline/paths.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

class Dice {
 public:
  explicit Dice(unsigned seed) : rng_(seed) {}
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(rng_);
  }
  Vec3 vector(double size) {
    return Vec3(between(-size, size), between(-size, size), between(-size, size));
  }

 private:
  std::mt19937 rng_;
};

/// Height of the tip over the box along the tool axis: the box's farthest corner decides.
double height(const ScrewChain& chain, const JointVector& q, double length, const PartBox& box) {
  CutterLocation at = forward_location(chain, q);
  at.tip -= length * at.axis;
  double least = INFINITY;
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 v;
    for (int i = 0; i < 3; ++i) v[i] = corner >> i & 1 ? box.upper[i] : box.lower[i];
    least = std::min(least, at.axis.dot(at.tip - v));
  }
  return least;
}

double dense_height(const ScrewChain& chain, const std::vector<LinkEnd>& ways, const PartBox& box,
                    int samples) {
  double least = INFINITY;
  for (std::size_t i = 0; i + 1 < ways.size(); ++i)
    for (int k = 0; k <= samples; ++k)
      least = std::min(least,
                       height(chain, ways[i].q + double(k) / samples * (ways[i + 1].q - ways[i].q),
                              ways[i].tool_length, box));
  return least;
}

ScrewChain placed(const MachineDefinition& machine, const Pose& at) {
  ScrewChain chain = chain_of(machine);
  chain.workpiece_home = chain.workpiece_home * at;
  return chain;
}

struct Bench {
  MachineDefinition machine;
  ScrewChain chain;
  PartBox box;
  double retract = 0.0;
  LinkPlanner planner(bool with_part = true) const {
    return LinkPlanner(machine, chain, retract,
                       with_part ? std::optional<PartBox>(box) : std::nullopt);
  }
};

Bench bench(const char* name, RapidMotion rapid = RapidMotion::linear) {
  Bench b;
  b.machine = shipped_machine(name);
  b.machine.links.rapid = rapid;
  const bool laser = std::string(name).rfind("laser", 0) == 0;
  b.chain = placed(b.machine, laser ? shifted(700, 600, 1000) : Pose::Identity());
  b.box = {Vec3(-60, -60, -20), Vec3(60, 60, 10)};
  b.retract = b.machine.links.retract;
  return b;
}

/// A link end with its tip on the box's top, tilted, inside the limits.
std::optional<LinkEnd> random_end(const Bench& b, Dice& dice, double tilt,
                                  const JointVector& near) {
  const auto inverse = Inverse::from(b.chain);
  REQUIRE(inverse);
  Pose pose = Pose::Identity();
  pose.linear() = forward(b.chain, home_of(b.machine)).linear();
  const Vec3 axis = (Vec3::UnitZ() + tilt * dice.vector(1.0)).normalized();
  pose.linear() = Eigen::Quaterniond::FromTwoVectors(pose.linear() * b.chain.tool_axis, axis)
                      .toRotationMatrix() *
                  pose.linear();
  pose.translation() = Vec3(dice.between(-60, 60), dice.between(-60, 60), 10.5);
  const auto q = inverse->nearest(pose, near);
  if (!q) return {};
  for (int j = 0; j < b.machine.size(); ++j) {
    const auto& joint = b.machine.axes[static_cast<std::size_t>(j)].joint;
    if ((*q)[j] < joint.lower || (*q)[j] > joint.upper) return {};
  }
  return LinkEnd{*q, 0.0};
}

/// The joints at the end of every move, commanded joints only.
std::vector<JointVector> run(const std::vector<MachineMove>& moves, JointVector q) {
  std::vector<JointVector> out;
  for (const auto& move : moves) {
    for (Eigen::Index j = 0; j < q.size(); ++j)
      if (move.interpolation == MoveInterpolation::tool || move.joints >> j & 1U) q[j] = move.to[j];
    out.push_back(q);
  }
  return out;
}

std::vector<MachineMove> all_moves(const Link& link) {
  std::vector<MachineMove> moves = link.away;
  moves.insert(moves.end(), link.approach.begin(), link.approach.end());
  return moves;
}

int moving_axes(const JointVector& from, const JointVector& to) {
  int n = 0;
  for (Eigen::Index j = 0; j < from.size(); ++j) n += std::abs(to[j] - from[j]) > 1e-9;
  return n;
}

}  // namespace

TEST_CASE("links: the proven height is never above the height at dense samples",
          "[postproc][pipeline][links]") {
  int cases = 0, useful = 0;
  for (const char* name : {"laser_5p1", "table_table_bc", "head_table_bc"}) {
    const Bench b = bench(name);
    Dice dice(7);
    for (int round = 0; round < 667; ++round) {
      const double size = round % 3 == 0 ? 1.0 : 0.05;  // long and short moves
      const double length = dice.between(0, 120);
      std::vector<LinkEnd> ways;
      for (int w = 0; w < 3; ++w) {
        LinkEnd end{home_of(b.machine), length};
        for (int j = 0; j < b.machine.size(); ++j) {
          const auto& joint = b.machine.axes[static_cast<std::size_t>(j)].joint;
          const bool linear = joint.kind == JointKind::linear;
          if (w == 0)
            end.q[j] = dice.between(joint.lower, joint.upper);
          else
            end.q[j] = ways.back().q[j] + size * dice.between(-1, 1) * (linear ? 300 : 2.0);
        }
        ways.push_back(end);
      }
      const Vec3 a = dice.vector(300), d = dice.vector(200).cwiseAbs();
      const PartBox box{a - d, a + d};
      const double proven = proven_height(b.chain, ways, box);
      const double dense = dense_height(b.chain, ways, box, 60);
      INFO(name << " round " << round);
      REQUIRE(proven <= dense + 1e-9);
      ++cases;
      if (size < 0.1 && dense - proven < 40.0) ++useful;
    }
  }
  CHECK(cases == 2001);
  CHECK(useful > 1200);  // of the 1334 short moves
}

TEST_CASE("links: the proven height of moves of linear axes is exact",
          "[postproc][pipeline][links]") {
  const Bench b = bench("laser_5p1");
  LinkEnd from{home_of(b.machine), 0.0}, to = from;
  to.q[0] -= 300;
  to.q[2] -= 200;
  CHECK(proven_height(b.chain, {from, to}, b.box) ==
        Approx(dense_height(b.chain, {from, to}, b.box, 10)).margin(1e-9));
}

TEST_CASE("links: what every link of a machine with linear axes keeps",
          "[postproc][pipeline][links]") {
  for (const char* name : {"laser_5p1", "table_table_bc", "head_table_bc"})
    for (const RapidMotion rapid : {RapidMotion::linear, RapidMotion::independent}) {
      const Bench b = bench(name, rapid);
      const LinkPlanner with = b.planner(), without = b.planner(false);
      const int retract = b.machine.axis_by_name(b.machine.links.retract_axis);
      Dice dice(11);
      int low = 0, over = 0;
      for (int round = 0; round < 300; ++round) {
        const double tilt = round % 2 == 0 ? 0.02 : 0.4;
        const auto from = random_end(b, dice, tilt, home_of(b.machine));
        if (!from) continue;
        const auto to = random_end(b, dice, tilt, from->q);
        if (!to) continue;
        INFO(name << " round " << round);
        CHECK_FALSE(without.between(*from, *to, false).low);
        CHECK_FALSE(with.between(*from, *to, true).low);
        const Link link = with.between(*from, *to, false);
        const auto moves = all_moves(link);
        const auto ends = run(moves, from->q);
        REQUIRE_FALSE(ends.empty());
        CHECK((ends.back() - to->q).norm() < 1e-9);
        // From a retracted machine: over the plane the retract axis alone first; a low link has it
        // up already and turns first.
        if (link.low) {
          // Restarted with the retract axis up it stays up until the tool is above the end.
          for (const auto& move : link.approach) {
            if ((move.joints >> retract & 1U) == 0) continue;
            CHECK(move.to == (link.approach.end() - 2)->to);
            break;
          }
          CHECK(link.away.back().joints == 1U << retract);
          for (int j = 0; j < b.machine.size(); ++j)
            if (b.machine.axes[static_cast<std::size_t>(j)].joint.kind == JointKind::linear)
              CHECK_FALSE((link.approach.front().joints >> j & 1U) != 0);
        } else {
          CHECK(link.approach.front().joints == 1U << retract);
        }
        CHECK(link.approach.front().rapid);
        for (std::size_t i = 0; i < moves.size(); ++i) {
          CHECK(moves[i].role == MoveRole::link);
          for (int j = 0; j < b.machine.size(); ++j) {
            const auto& joint = b.machine.axes[static_cast<std::size_t>(j)].joint;
            CHECK(ends[i][j] >= joint.lower - 1e-9);
            CHECK(ends[i][j] <= joint.upper + 1e-9);
          }
        }
        const double turn = angle_between(forward_location(b.chain, from->q).axis,
                                          forward_location(b.chain, to->q).axis);
        if (!link.low) {
          ++over;
          CHECK(ends[link.away.size()][retract] == Approx(b.retract));
          continue;
        }
        ++low;
        CHECK(turn <= b.machine.links.rotation + 1e-12);
        CHECK(link.away.front().rapid == (rapid == RapidMotion::linear));
        CHECK(link.approach.back().rapid == (rapid == RapidMotion::linear));
        JointVector before = from->q;
        std::vector<LinkEnd> ways;
        for (std::size_t i = 0; i < moves.size(); ++i) {
          if (rapid == RapidMotion::independent && moves[i].rapid)
            CHECK(moving_axes(before, ends[i]) <= 1);
          if (i + 1 < moves.size()) ways.push_back({ends[i], 0.0});
          if (!moves[i].rapid) CHECK(moves[i].duration > 0.0);
          before = ends[i];
        }
        CHECK(dense_height(b.chain, ways, b.box, 100) >= 0.5 * b.machine.links.clearance - 1e-9);
      }
      INFO(name << ": " << low << " low, " << over << " over the plane");
      CHECK(low > 10);
      CHECK(over > 50);
    }
}

TEST_CASE("links: away and the end of an approach are along the tool axis",
          "[postproc][pipeline][links]") {
  const Bench b = bench("table_table_bc");
  Dice dice(3);
  const LinkPlanner planner = b.planner();
  for (int round = 0; round < 100; ++round) {
    const auto from = random_end(b, dice, 0.4, home_of(b.machine));
    const auto to = random_end(b, dice, 0.4, home_of(b.machine));
    if (!from || !to) continue;
    const Link link = planner.between(*from, *to, false);
    const auto ends = run(all_moves(link), from->q);
    REQUIRE(link.away.size() == (link.low ? 2U : 1U));
    const auto leaves = [&](const JointVector& low, const JointVector& high) {
      const auto a = forward_location(b.chain, low);
      const auto c = forward_location(b.chain, high);
      const Vec3 way = c.tip - a.tip;
      CHECK((a.axis - c.axis).norm() < 1e-12);
      CHECK(way.cross(a.axis).norm() < 1e-9);
      CHECK(way.dot(a.axis) >= 0.99 * b.machine.links.clearance);
    };
    leaves(from->q, ends.front());
    leaves(to->q, ends[ends.size() - 2]);
  }
}

TEST_CASE("links: first and last", "[postproc][pipeline][links]") {
  const Bench b = bench("laser_5p1");
  Dice dice(5);
  const int retract = b.machine.axis_by_name("Z");
  const auto end = random_end(b, dice, 0.3, home_of(b.machine));
  REQUIRE(end);
  const Link first = b.planner().first(*end);
  CHECK(first.away.empty());
  CHECK(first.approach.front().joints == 1U << retract);
  CHECK(first.approach.front().machine_coordinates);
  const Link last = b.planner().last(*end);
  CHECK(last.approach.empty());
  const auto ends = run(last.away, end->q);
  CHECK(ends[1][retract] == b.retract);
  for (int j = 0; j < b.machine.size(); ++j)
    if (j != retract) CHECK(ends.back()[j] == home_of(b.machine)[j]);
}

TEST_CASE("links: a six-axis arm goes straight where it says so", "[postproc][pipeline][links]") {
  for (const char* mode : {"tcp", "joint"})
    for (const bool plane : {false, true}) {
      Bench b = bench("robot_6r");
      b.machine.dialect.mode = mode;
      b.machine.links.has_plane = plane;
      b.machine.links.retract = 800.0;  // the part's zero is at 600
      const LinkPlanner planner = b.planner(false);
      Dice dice(9);
      int looked = 0;
      for (int round = 0; round < 60; ++round) {
        const auto from = random_end(b, dice, 0.3, home_of(b.machine));
        const auto to = random_end(b, dice, 0.3, home_of(b.machine));
        if (!from || !to) continue;
        const Link link = planner.between(*from, *to, false);
        REQUIRE(link.approach.size() >= 2);
        CHECK(link.approach.front().interpolation == MoveInterpolation::joints);
        CHECK(link.approach.front().joints == 0x3fU);
        CHECK(planner.first(*to).approach.front().interpolation == MoveInterpolation::joints);
        const auto moves = all_moves(link);
        const auto ends = run(moves, from->q);
        CHECK((ends.back() - to->q).norm() < 1e-9);
        // Every move but the one in joints leaves the tool's direction alone; the tip goes along
        // the tool axis or straight up.
        JointVector before = from->q;
        for (std::size_t i = 0; i < moves.size(); ++i) {
          const Pose a = forward(b.chain, before), c = forward(b.chain, ends[i]);
          before = ends[i];
          for (int j = 0; j < 6; ++j) {
            CHECK(ends[i][j] >= b.chain.joints[static_cast<std::size_t>(j)].lower - 1e-9);
            CHECK(ends[i][j] <= b.chain.joints[static_cast<std::size_t>(j)].upper + 1e-9);
          }
          if (i == link.away.size()) {
            if (plane) CHECK((b.chain.workpiece_home * c.translation()).z() == Approx(800.0));
            continue;
          }
          CHECK((a.linear() - c.linear()).norm() < 1e-9);
          const Vec3 way = (c.translation() - a.translation()).normalized();
          const Vec3 axis = a.linear() * b.chain.tool_axis;
          CHECK(std::min(way.cross(axis).norm(), way.cross(Vec3::UnitZ()).norm()) < 1e-6);
          if (moves[i].interpolation == MoveInterpolation::tool) continue;
          const JointVector& start = i == 0 ? from->q : ends[i - 1];
          const Pose half = forward(b.chain, 0.5 * (start + ends[i]));
          CHECK((half.translation() - 0.5 * (a.translation() + c.translation())).norm() < 0.06);
          ++looked;
        }
      }
      if (std::string(mode) == "joint") CHECK(looked > 200);
    }
}
