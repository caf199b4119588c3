#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <random>
#include <set>

#include "kernels/core/units.h"
#include "machines/definition/body_pairs.h"
#include "machines/definition/machine_file.h"
#include "tests/support/support.h"

// The bodies of the shipped machines, seen with point samples only: an oracle that shares nothing
// with the collision kernels.
using namespace smoothpost;

namespace {

MachineDefinition shipped(const std::string& name) {
  const auto path = test::source_path("machines/" + name + "/machine.toml");
  auto result = parse_machine_file(test::read_bytes(path), path.string());
  REQUIRE(result.ok());
  return std::move(result.value());
}

const Body& body(const MachineDefinition& machine, const std::string& name) {
  const auto found = std::find_if(machine.bodies.begin(), machine.bodies.end(),
                                  [&](const Body& b) { return b.name == name; });
  REQUIRE(found != machine.bodies.end());
  return *found;
}

bool inside_hull(const std::vector<Vec3>& points, const Vec3& p) {
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = i + 1; j < points.size(); ++j)
      for (std::size_t k = j + 1; k < points.size(); ++k) {
        const Vec3 n = (points[j] - points[i]).cross(points[k] - points[i]);
        double lo = 0.0;
        double hi = 0.0;
        for (const Vec3& q : points) {
          lo = std::min(lo, n.dot(q - points[i]));
          hi = std::max(hi, n.dot(q - points[i]));
        }
        const double at = n.dot(p - points[i]);
        const double round_off = 1e-9 * (hi - lo);
        if (-lo <= round_off && at < 0.0) return false;  // a face with all points above it
        if (hi <= round_off && at > 0.0) return false;
      }
  return true;
}

/// Whether `p`, in M with every joint at 0, is inside the body.
bool inside(const Body& b, const Vec3& p) {
  if (b.shape == BodyShape::hull) return inside_hull(b.points, p);
  if (b.shape == BodyShape::box) {
    const Vec3 lo = b.from.cwiseMin(b.to);
    const Vec3 hi = b.from.cwiseMax(b.to);
    return (p - lo).minCoeff() > 0.0 && (hi - p).minCoeff() > 0.0;
  }
  const Vec3 along = b.to - b.from;
  const double t = (p - b.from).dot(along) / along.squaredNorm();
  if (b.shape == BodyShape::capsule)
    return (p - b.from - std::clamp(t, 0.0, 1.0) * along).norm() < b.radius_from;
  if (t <= 0.0 || t >= 1.0) return false;
  return (p - b.from - t * along).norm() < b.radius_from + t * (b.radius_to - b.radius_from);
}

/// Points inside the body by rejection from its box, up to its skin.
std::vector<Vec3> samples(const Body& b, int count, std::mt19937& random) {
  std::vector<Vec3> spread = b.points;
  if (spread.empty()) spread = {b.from, b.to};
  const double radius = b.shape == BodyShape::box || b.shape == BodyShape::hull
                            ? 0.0
                            : std::max(b.radius_from, b.radius_to);
  Vec3 lo = spread.front();
  Vec3 hi = lo;
  for (const Vec3& p : spread) {
    lo = lo.cwiseMin(p);
    hi = hi.cwiseMax(p);
  }
  lo.array() -= radius;
  hi.array() += radius;
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<Vec3> out;
  for (int tries = 0; tries < 200 * count && static_cast<int>(out.size()) < count; ++tries) {
    const Vec3 share(uniform(random), uniform(random), uniform(random));
    const Vec3 p = lo + share.cwiseProduct(hi - lo);
    if (inside(b, p)) out.push_back(p);
  }
  REQUIRE(static_cast<int>(out.size()) == count);
  return out;
}

/// Motion of a link: the product of the screws of its chain up to the joint that carries it.
Pose motion_of(const MachineDefinition& machine, const std::string& link, const JointVector& q) {
  Pose motion = Pose::Identity();
  const int last = joint_carrying(machine, link);
  for (int i = 0; i <= last; ++i) {
    const ChainJoint& joint = machine.axes[static_cast<std::size_t>(i)].joint;
    if (joint.side != machine.axes[static_cast<std::size_t>(last)].joint.side) continue;
    Pose step = Pose::Identity();
    if (joint.kind == JointKind::linear) {
      step.translation() = q[i] * joint.direction;
    } else {
      step.linear() = rotation_about(joint.direction, q[i]);
      step.translation() = joint.origin - step.linear() * joint.origin;
    }
    motion = motion * step;
  }
  return motion;
}

/// Names of the checked pairs with a sampled point in both bodies.
std::vector<std::string> overlaps(const MachineDefinition& machine, const JointVector& q,
                                  std::mt19937& random, int count) {
  std::vector<std::string> out;
  for (const BodyPair& pair : checked_pairs(machine)) {
    if (pair.second == BodyPair::kPart) continue;
    const Body& a = machine.bodies[pair.first];
    const Body& b = machine.bodies[pair.second];
    const Pose b_from_a = motion_of(machine, b.link, q).inverse() * motion_of(machine, a.link, q);
    bool meet = false;
    for (const Vec3& p : samples(a, count, random)) meet = meet || inside(b, b_from_a * p);
    for (const Vec3& p : samples(b, count, random))
      meet = meet || inside(a, b_from_a.inverse() * p);
    if (meet) out.push_back(a.name + " in " + b.name);
  }
  return out;
}

const char* const kMachines[] = {"laser_5p1",      "laser_5p1_offset", "robot_6r",
                                 "table_table_ac", "table_table_bc",   "table_table_b45c",
                                 "head_table_bc",  "head_head_ca",     "finish_2p2r_1p1r"};

}  // namespace

TEST_CASE("shipped bodies: every machine has some that are checked against the part",
          "[machines][definition]") {
  for (const char* name : kMachines) {
    INFO(name);
    const MachineDefinition machine = shipped(name);
    CHECK(machine.bodies.size() >= 2);
    CHECK(machine.tolerance.clearance > 0.0);
    const auto pairs = checked_pairs(machine);
    const auto with_part = std::count_if(pairs.begin(), pairs.end(), [](const BodyPair& pair) {
      return pair.second == BodyPair::kPart;
    });
    CHECK(with_part >= 2);
    // The tip of a tool of length 0 is outside of all of them.
    for (const Body& b : machine.bodies) {
      INFO(b.name);
      if (b.link != "base" && b.link != "workpiece" && joint_carrying(machine, b.link) >= 0 &&
          machine.axes[static_cast<std::size_t>(joint_carrying(machine, b.link))].joint.side ==
              ChainSide::tool)
        CHECK_FALSE(inside(b, machine.tool.tip));
    }
  }
}

TEST_CASE("shipped bodies: no checked pair meets at home", "[machines][definition]") {
  std::mt19937 random(3);
  for (const char* name : kMachines) {
    const MachineDefinition machine = shipped(name);
    const auto found = overlaps(machine, home_of(machine), random, 2000);
    INFO(name);
    for (const auto& pair : found) UNSCOPED_INFO(pair);
    CHECK(found.empty());
  }
}

TEST_CASE("shipped bodies: tables turn freely while the head is at home",
          "[machines][definition]") {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  int poses = 0;
  for (const char* name : {"table_table_ac", "table_table_bc", "table_table_b45c", "head_table_bc",
                           "finish_2p2r_1p1r"}) {
    const MachineDefinition machine = shipped(name);
    for (int i = 0; i < 60; ++i) {
      JointVector q = home_of(machine);
      for (int j = 0; j < machine.size(); ++j) {
        const ChainJoint& joint = machine.axes[static_cast<std::size_t>(j)].joint;
        if (joint.side == ChainSide::workpiece)
          q[j] = joint.lower + uniform(random) * (joint.upper - joint.lower);
      }
      const auto found = overlaps(machine, q, random, 300);
      INFO(name << " " << q.transpose());
      for (const auto& pair : found) UNSCOPED_INFO(pair);
      CHECK(found.empty());
      ++poses;
    }
  }
  CHECK(poses == 300);
}

TEST_CASE("shipped bodies: heads turn freely at home", "[machines][definition]") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  int poses = 0;
  for (const char* name :
       {"laser_5p1", "laser_5p1_offset", "head_head_ca", "head_table_bc", "finish_2p2r_1p1r"}) {
    const MachineDefinition machine = shipped(name);
    for (int i = 0; i < 60; ++i) {
      JointVector q = home_of(machine);
      for (int j = 0; j < machine.size(); ++j) {
        const ChainJoint& joint = machine.axes[static_cast<std::size_t>(j)].joint;
        if (joint.side == ChainSide::tool && (joint.kind == JointKind::rotary || joint.redundant))
          q[j] = joint.lower + uniform(random) * (joint.upper - joint.lower);
      }
      const auto found = overlaps(machine, q, random, 300);
      INFO(name << " " << q.transpose());
      for (const auto& pair : found) UNSCOPED_INFO(pair);
      CHECK(found.empty());
      ++poses;
    }
  }
  CHECK(poses == 300);
}

TEST_CASE("shipped bodies: a laser's nozzle ends in its land at the tip and passes the casing",
          "[machines][definition]") {
  for (const char* name : {"laser_5p1", "laser_5p1_offset"}) {
    INFO(name);
    const MachineDefinition machine = shipped(name);
    const Body& nozzle = body(machine, "nozzle");
    const Body& casing = body(machine, "casing");
    CHECK(nozzle.link == "W");
    CHECK(casing.link == "B");
    CHECK(nozzle.from == machine.tool.tip);
    CHECK(nozzle.radius_from == machine.tool.land_radius);
    CHECK((nozzle.to - nozzle.from).normalized() == machine.tool.axis);
    // Over the whole stroke of W.
    const double highest = machine.axes[5].joint.upper;
    CHECK((casing.from - nozzle.to).dot(machine.tool.axis) - highest == Approx(80.0));
    const auto pairs = checked_pairs(machine);
    REQUIRE(pairs.size() == 2);
    for (const BodyPair& pair : pairs) {
      CHECK(pair.second == BodyPair::kPart);
      const bool of_nozzle = machine.bodies[pair.first].name == "nozzle";
      CHECK(pair.clearance == (of_nozzle ? 0.2 : machine.tolerance.clearance));
      if (of_nozzle) CHECK(pair.clearance < machine.tool.min_gap);
    }
  }
  const MachineDefinition plain = shipped("laser_5p1");
  const MachineDefinition offset = shipped("laser_5p1_offset");
  for (const char* name : {"nozzle", "casing"}) {
    CHECK(body(offset, name).from == body(plain, name).from - Vec3(0, 0, 200));
    CHECK(body(offset, name).to == body(plain, name).to - Vec3(0, 0, 200));
  }
}

TEST_CASE("shipped bodies: those of the robot lie between the axes of its data sheet",
          "[machines][definition]") {
  const MachineDefinition machine = shipped("robot_6r");
  const auto origin = [&](const char* axis) {
    return machine.axes[static_cast<std::size_t>(machine.axis_by_name(axis))].joint.origin;
  };
  CHECK(body(machine, "carousel").to == origin("A2"));
  CHECK(body(machine, "link_arm").from == origin("A2"));
  CHECK(body(machine, "link_arm").to == origin("A3"));
  CHECK(body(machine, "forearm").to == origin("A4"));
  CHECK(body(machine, "forearm").from.x() == origin("A3").x());
  CHECK(body(machine, "forearm_tube").from == origin("A4"));
  CHECK(body(machine, "wrist").from == origin("A5"));
  CHECK(body(machine, "spindle").from == machine.tool.tip);
  const Vec3 along = body(machine, "spindle").to - body(machine, "spindle").from;
  CHECK((along - 300.0 * machine.tool.axis).norm() < 1e-3);
  std::set<std::string> links;
  for (const Body& b : machine.bodies) links.insert(b.link);
  for (const char* link : {"base", "A1", "A2", "A3", "A4", "A5", "A6", "workpiece"})
    CHECK(links.count(link));
}
