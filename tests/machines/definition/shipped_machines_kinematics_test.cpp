#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "kernels/core/units.h"
#include "kernels/kinematics/rotary_pair.h"
#include "kernels/kinematics/screw_chain.h"
#include "kernels/kinematics/six_r.h"
#include "machines/definition/machine_file.h"
#include "tests/kernels/kinematics/reference_machines.h"
#include "tests/support/support.h"

namespace smoothpost {
namespace {

std::vector<std::filesystem::path> shipped_machine_files() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(test::source_path("machines"))) {
    const auto file = entry.path() / "machine.toml";
    if (std::filesystem::exists(file)) files.push_back(file);
  }
  std::sort(files.begin(), files.end());
  return files;
}

JointVector random_joints(const ScrewChain& chain, std::mt19937_64& engine) {
  JointVector q(chain.size());
  for (int j = 0; j < chain.size(); ++j)
    q[j] = std::uniform_real_distribution<double>(chain.joints[j].lower,
                                                  chain.joints[j].upper)(engine);
  return q;
}

/// Largest difference of two joint vectors, rotary joints modulo a turn and by 1000 mm.
double difference(const ScrewChain& chain, const JointVector& a, const JointVector& b) {
  double worst = 0.0;
  for (int j = 0; j < chain.size(); ++j) {
    const bool rotary = chain.joints[j].kind == JointKind::rotary;
    const double d = rotary ? 1000.0 * std::remainder(a[j] - b[j], 2.0 * M_PI) : a[j] - b[j];
    worst = std::max(worst, std::abs(d));
  }
  return worst;
}

MachineDefinition load(const std::filesystem::path& file) {
  const auto machine = parse_machine_file(test::read_bytes(file), file.filename().string());
  REQUIRE(machine.ok());
  return machine.value();
}

MachineDefinition shipped(const std::string& name) {
  return load(test::source_path("machines/" + name + "/machine.toml"));
}

struct WorstError {
  double tip = 0.0;       ///< mm
  double rotation = 0.0;  ///< rad
};

WorstError round_trip(const RotaryPair& pair) {
  WorstError worst;
  std::mt19937_64 engine(41);
  for (int n = 0; n < 20000; ++n) {
    const JointVector q = random_joints(pair.chain(), engine);
    const CutterLocation x = forward_location(pair.chain(), q);
    const RotaryPairSolutions solutions = pair.solve(x, q);
    bool own = false;
    for (int b = 0; b < 2; ++b) {
      REQUIRE(solutions.valid[b]);
      const CutterLocation back = forward_location(pair.chain(), solutions.q[b]);
      worst.tip = std::max(worst.tip, (back.tip - x.tip).norm());
      worst.rotation = std::max(worst.rotation, (back.axis - x.axis).norm());
      own = own || difference(pair.chain(), solutions.q[b], q) < 1e-3;
    }
    REQUIRE(own);
  }
  return worst;
}

WorstError round_trip(const SixR& arm) {
  WorstError worst;
  std::mt19937_64 engine(43);
  for (int n = 0; n < 20000; ++n) {
    const JointVector q = random_joints(arm.chain(), engine);
    const Pose x = forward(arm.chain(), q);
    const SixRSolutions solutions = arm.solve(x, q);
    const int own = arm.branch_of(q);
    REQUIRE(solutions.valid[own]);
    REQUIRE(difference(arm.chain(), solutions.q[own], q) < 1e-3);
    for (int b = 0; b < 8; ++b) {
      if (!solutions.valid[b]) continue;
      const Pose back = forward(arm.chain(), solutions.q[b]);
      worst.tip = std::max(worst.tip, (back.translation() - x.translation()).norm());
      worst.rotation =
          std::max(worst.rotation, rotation_log(back.linear().transpose() * x.linear()).norm());
    }
  }
  return worst;
}

TEST_CASE("shipped machines: FK(IK(x)) = x on 20,000 poses by a closed form",
          "[machines][definition][kinematics]") {
  int five_axis = 0;
  int robots = 0;
  for (const auto& file : shipped_machine_files()) {
    CAPTURE(file.parent_path().filename().string());
    const MachineDefinition machine = load(file);
    const ScrewChain chain = chain_of(machine, 37.5);
    REQUIRE(chain.size() == machine.size());
    const auto pair = RotaryPair::from(chain);
    const auto arm = SixR::from(chain);
    REQUIRE((pair.has_value() || arm.has_value()));
    five_axis += pair ? 1 : 0;
    robots += arm ? 1 : 0;
    const WorstError worst = pair ? round_trip(*pair) : round_trip(*arm);
    CAPTURE(worst.tip, worst.rotation);
    CHECK(worst.tip <= 1e-9);
    CHECK(worst.rotation <= 1e-12);
  }
  CHECK(five_axis >= 8);
  CHECK(robots >= 1);
}

TEST_CASE("shipped machines: the geometry of the reference machines",
          "[machines][definition][kinematics][paper]") {
  const auto references = test::reference_machines();
  if (references.empty()) {
    WARN("no shared reference material: skipped");
    return;
  }
  const std::map<std::string, std::string> pairs = {{"laser_5p1", "laser_5p1"},
                                                    {"finish_2p2r_1p1r", "fsbs"},
                                                    {"head_table_bc", "head_table_BC"},
                                                    {"head_head_ca", "head_head_CA"},
                                                    {"table_table_b45c", "table_table_B45C"}};
  for (const auto& [name, reference_name] : pairs) {
    CAPTURE(name);
    const ScrewChain chain = chain_of(shipped(name));
    const ScrewChain& reference = references.at(reference_name).chain;
    REQUIRE(chain.size() == reference.size());
    std::mt19937_64 engine(44);
    for (int n = 0; n < 1000; ++n) {
      const JointVector q = random_joints(reference, engine);
      const CutterLocation here = forward_location(chain, q);
      const CutterLocation there = forward_location(reference, q);
      REQUIRE((here.tip - there.tip).norm() <= 1e-9);
      REQUIRE((here.axis - there.axis).norm() <= 1e-12);
      REQUIRE((jacobian(chain, q) - jacobian(reference, q)).cwiseAbs().maxCoeff() <= 1e-9);
    }
  }
}

TEST_CASE("shipped machines: a rotary direction is the physical motion of the moving side",
          "[machines][definition][kinematics]") {
  int rotaries = 0;
  for (const auto& file : shipped_machine_files()) {
    const MachineDefinition machine = load(file);
    const ScrewChain chain = chain_of(machine);
    CAPTURE(machine.name);
    for (int j = 0; j < chain.size(); ++j) {
      const ChainJoint& joint = chain.joints[j];
      if (joint.kind != JointKind::rotary) continue;
      CAPTURE(machine.axes[static_cast<std::size_t>(j)].name);
      JointVector q = JointVector::Zero(chain.size());
      q[j] = 0.3;
      // A point of the moving side, carried by the right-hand turn about the axis.
      const auto moved = [&](const Vec3& point) -> Vec3 {
        return joint.origin + rotation_about(joint.direction, 0.3) * (point - joint.origin);
      };
      const CutterLocation seen = forward_location(chain, q);
      const Vec3 in_base = chain.workpiece_home * seen.tip;
      if (joint.side == ChainSide::tool)
        CHECK((in_base - moved(chain.tool_home.translation())).norm() < 1e-9);
      else  // the part has turned: the place where its point is now is where the tip still is
        CHECK((moved(in_base) - chain.tool_home.translation()).norm() < 1e-9);
      ++rotaries;
    }
  }
  CHECK(rotaries >= 20);
}

bool rotary_in_range(const ChainJoint& joint, double value) {
  const double turn = 2.0 * kPi;
  const double first = value + turn * std::ceil((joint.lower - value) / turn);
  return first <= joint.upper;
}

bool in_range(const ScrewChain& chain, const JointVector& q) {
  for (int j = 0; j < chain.size(); ++j) {
    const ChainJoint& joint = chain.joints[j];
    if (joint.kind == JointKind::rotary ? !rotary_in_range(joint, q[j])
                                        : q[j] < joint.lower || q[j] > joint.upper)
      return false;
  }
  return true;
}

/// A unit vector within `tilt` rad of +Z.
Vec3 tilted(std::mt19937_64& engine, double tilt) {
  std::uniform_real_distribution<double> share(0.0, 1.0);
  const double z = 1.0 - share(engine) * (1.0 - std::cos(tilt));
  const double azimuth = 2.0 * kPi * share(engine);
  const double r = std::sqrt(std::max(0.0, 1.0 - z * z));
  return Vec3(r * std::cos(azimuth), r * std::sin(azimuth), z);
}

TEST_CASE("shipped machines: mills reach a part of 100 mm around the zero with tools up to 150 mm",
          "[machines][definition][kinematics]") {
  for (const char* name :
       {"head_table_bc", "head_head_ca", "table_table_b45c", "table_table_ac", "table_table_bc"}) {
    CAPTURE(name);
    const MachineDefinition machine = shipped(name);
    std::mt19937_64 engine(45);
    std::uniform_real_distribution<double> share(-1.0, 1.0);
    for (int n = 0; n < 5000; ++n) {
      const double length = 75.0 * (1.0 + share(engine));
      const ScrewChain chain = chain_of(machine, length);
      const auto pair = RotaryPair::from(chain);
      REQUIRE(pair);
      CutterLocation location;
      location.tip = 100.0 * Vec3(share(engine), share(engine), share(engine));
      location.axis = tilted(engine, 0.5 * kPi);
      const auto solutions = pair->solve(location, JointVector::Zero(chain.size()));
      int reached = 0;
      for (int b = 0; b < 2; ++b)
        reached += solutions.valid[b] && in_range(chain, solutions.q[b]) ? 1 : 0;
      if (reached == 0)
        FAIL("tip " << location.tip.transpose() << " axis " << location.axis.transpose()
                    << " length " << length << "\nq " << solutions.q[0].transpose() << "\nor "
                    << solutions.q[1].transpose());
    }
    CHECK(in_range(chain_of(machine), home_of(machine)));
  }
}

TEST_CASE("shipped machines: the robot reaches its part with tools up to 150 mm",
          "[machines][definition][kinematics]") {
  const MachineDefinition machine = shipped("robot_6r");
  std::mt19937_64 engine(46);
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  int narrow = 0;
  for (int n = 0; n < 2000; ++n) {
    const ScrewChain chain = chain_of(machine, 75.0 * (1.0 + share(engine)));
    const auto arm = SixR::from(chain);
    REQUIRE(arm);
    const Vec3 axis = tilted(engine, radians_from_degrees(30.0));
    const Vec3 tip(150.0 * share(engine), 150.0 * share(engine), 100.0 * (1.0 + share(engine)));
    const Mat3 upright =
        Eigen::Quaterniond::FromTwoVectors(chain.tool_axis, axis).toRotationMatrix();
    int reached = 0;
    for (int spin = 0; spin < 24; ++spin) {
      Pose pose = Pose::Identity();
      pose.linear() = rotation_about(axis.normalized(), spin * kPi / 12.0) * upright;
      pose.translation() = tip;
      const SixRSolutions solutions = arm->solve(pose);
      bool any = false;
      for (int b = 0; b < 8; ++b)
        any = any || (solutions.valid[b] && in_range(chain, solutions.q[b]));
      reached += any ? 1 : 0;
    }
    if (reached == 0) FAIL("tip " << tip.transpose() << " axis " << axis.transpose());
    narrow += reached < 6 ? 1 : 0;
  }
  CHECK(narrow < 20);
}

TEST_CASE("robot_6r: home and lengths of the arm as its data sheet draws them",
          "[machines][definition][kinematics]") {
  const MachineDefinition machine = shipped("robot_6r");
  const ScrewChain chain = chain_of(machine);
  const Pose home = forward(chain, home_of(machine));
  CHECK((home.linear() * chain.tool_axis - Vec3::UnitZ()).norm() < 1e-12);
  const Vec3 nose = chain.workpiece_home * home.translation();
  CHECK((nose - Vec3(1360.919, 0.0, 1449.376)).norm() < 1e-3);
  const auto arm = SixR::from(chain);
  REQUIRE(arm);
  CHECK(arm->branch_of(home_of(machine)) == 0);
  // Reach to the wrist centre: upper arm, forearm with its offset, and the second axis' distance.
  const Vec3 second = chain.joints[1].origin;
  const Vec3 third = chain.joints[2].origin;
  const Vec3 wrist = chain.joints[4].origin;
  CHECK(std::round(second.x() + (third - second).norm() + (wrist - third).norm()) == 2033.0);
}

TEST_CASE("shipped machines: tool length moves the tip along the tool axis",
          "[machines][definition][kinematics]") {
  for (const auto& file : shipped_machine_files()) {
    CAPTURE(file.parent_path().filename().string());
    const MachineDefinition machine = load(file);
    std::mt19937_64 engine(42);
    for (int n = 0; n < 50; ++n) {
      const JointVector q = random_joints(chain_of(machine), engine);
      const CutterLocation bare = forward_location(chain_of(machine, 0.0), q);
      const CutterLocation longer = forward_location(chain_of(machine, 80.0), q);
      CHECK((longer.axis - bare.axis).norm() < 1e-14);
      CHECK((bare.tip - 80.0 * bare.axis - longer.tip).norm() < 1e-9);
    }
  }
}

}  // namespace
}  // namespace smoothpost
