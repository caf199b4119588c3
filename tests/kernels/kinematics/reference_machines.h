#pragma once

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "kernels/kinematics/screw_chain.h"
#include "tests/support/support.h"

// Chains of the reference machines: read from the shared golden files (in their own key names), and
// a few written out here so that most tests run without those files.
namespace smoothpost::test {

struct ReferenceMachine {
  ScrewChain chain;
  std::vector<std::string> names;
};

inline Vec3 vector_from(const nlohmann::json& j) {
  return Vec3(j.at(0).get<double>(), j.at(1).get<double>(), j.at(2).get<double>());
}

inline Pose pose_from(const nlohmann::json& j) {
  Pose pose = Pose::Identity();
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) pose.matrix()(r, c) = j.at(r).at(c);
  return pose;
}

inline ReferenceMachine machine_from(const nlohmann::json& j) {
  ReferenceMachine machine;
  for (const char* side : {"tool_chain", "workpiece_chain"}) {
    for (const auto& entry : j.at(side)) {
      ChainJoint joint;
      joint.kind = entry.at("type") == "revolute" ? JointKind::rotary : JointKind::linear;
      joint.side = std::string(side) == "tool_chain" ? ChainSide::tool : ChainSide::workpiece;
      joint.direction = vector_from(entry.at("axis"));
      joint.origin = vector_from(entry.at("origin"));
      joint.lower = entry.at("lower");
      joint.upper = entry.at("upper");
      joint.home = entry.at("home");
      joint.redundant = entry.at("redundant");
      machine.chain.joints.push_back(joint);
      machine.names.push_back(entry.at("name"));
    }
  }
  machine.chain.tool_home = pose_from(j.at("home_tool"));
  machine.chain.tool_axis = vector_from(j.at("tool_axis"));
  return machine;
}

inline std::optional<nlohmann::json> reference_json(const std::string& name) {
  const auto path = shared_path("reference/" + name);
  if (!path) return std::nullopt;
  return nlohmann::json::parse(read_bytes(*path));
}

/// The machines of machines.json by name; empty when the shared files are absent.
inline std::map<std::string, ReferenceMachine> reference_machines() {
  std::map<std::string, ReferenceMachine> machines;
  const auto json = reference_json("machines.json");
  if (!json) return machines;
  for (const auto& [name, entry] : json->items())
    if (name[0] != '_') machines[name] = machine_from(entry);
  return machines;
}

struct JointText {
  char letter = 'X';
  ChainSide side = ChainSide::tool;
  double lower = 0.0;
  double upper = 0.0;
  Vec3 origin = Vec3::Zero();
};

/// X Y Z linear, A B C rotary about the axis of that name.
inline ChainJoint joint(const JointText& text) {
  ChainJoint out;
  const bool rotary = text.letter < 'X';
  out.kind = rotary ? JointKind::rotary : JointKind::linear;
  out.side = text.side;
  out.direction = Vec3::Unit(rotary ? text.letter - 'A' : text.letter - 'X');
  out.lower = text.lower;
  out.upper = text.upper;
  out.origin = text.origin;
  return out;
}

/// Paper B, Table 2 (mm): X Y Z, C then B in the head, standoff along the tool, held.
inline ScrewChain laser(double l0 = 0.0) {
  ScrewChain chain;
  chain.joints = {joint({'X', ChainSide::tool, 0, 1600}),
                  joint({'Y', ChainSide::tool, 0, 1400}),
                  joint({'Z', ChainSide::tool, 0, 3000}),
                  joint({'C', ChainSide::tool, -2 * M_PI, 2 * M_PI}),
                  joint({'B', ChainSide::tool, -M_PI_2, M_PI_2}),
                  joint({'Z', ChainSide::tool, -100, 20})};
  chain.joints.back().redundant = true;
  chain.tool_home.translation() = Vec3(0, 0, -l0);
  return chain;
}

/// X Y Z in the head, C on A in the table.
inline ScrewChain table_table_ac() {
  ScrewChain chain;
  chain.joints = {joint({'X', ChainSide::tool, -400, 400}),
                  joint({'Y', ChainSide::tool, -400, 400}),
                  joint({'Z', ChainSide::tool, -400, 400}),
                  joint({'A', ChainSide::workpiece, -2.1, 0.6, Vec3(0, 0, -50)}),
                  joint({'C', ChainSide::workpiece, -10, 10, Vec3(0, 30, 0)})};
  return chain;
}

/// The same with a nutating B axis at 45 degrees between Y and Z.
inline ScrewChain table_table_b45c() {
  ScrewChain chain = table_table_ac();
  chain.joints[3].direction = Vec3(0, M_SQRT1_2, M_SQRT1_2);
  chain.joints[3].lower = -M_PI;
  chain.joints[3].upper = M_PI;
  chain.joints[4].origin.setZero();
  return chain;
}

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  int below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(engine_); }
  Vec3 unit() {
    const double z = between(-1.0, 1.0);
    const double angle = between(-M_PI, M_PI);
    const double r = std::sqrt(1.0 - z * z);
    return Vec3(r * std::cos(angle), r * std::sin(angle), z).normalized();
  }
  /// Joint values within the limits of the chain.
  JointVector joints(const ScrewChain& chain) {
    JointVector q(chain.size());
    for (int i = 0; i < chain.size(); ++i)
      q[i] = between(chain.joints[i].lower, chain.joints[i].upper);
    return q;
  }

 private:
  std::mt19937_64 engine_;
};

inline double angle_difference(double a, double b) {
  return std::abs(std::remainder(a - b, 2.0 * M_PI));
}

/// A chain with any mixture of joints on both sides, frames and a tool that are nowhere aligned.
inline ScrewChain random_chain(Random& random, int joints) {
  ScrewChain chain;
  for (int i = 0; i < joints; ++i) {
    ChainJoint joint;
    joint.kind = random.below(2) == 0 ? JointKind::linear : JointKind::rotary;
    joint.side = random.below(2) == 0 ? ChainSide::tool : ChainSide::workpiece;
    joint.direction = random.unit();
    joint.origin = 300.0 * random.unit();
    const double range = joint.kind == JointKind::linear ? 500.0 : 3.0;
    joint.lower = -range;
    joint.upper = range;
    chain.joints.push_back(joint);
  }
  chain.workpiece_home.linear() = rotation_exp(random.between(0.0, 3.0) * random.unit());
  chain.workpiece_home.translation() = 100.0 * random.unit();
  chain.tool_home.linear() = rotation_exp(random.between(0.0, 3.0) * random.unit());
  chain.tool_home.translation() = 200.0 * random.unit();
  chain.tool_axis = random.unit();
  return chain;
}

}  // namespace smoothpost::test
