#include "postproc/pipeline/standoff_retreat.h"

#include <algorithm>

#include "postproc/pipeline/clearance_check.h"

namespace smoothpost {

namespace {

constexpr double kFirstRetreat = 10.0;  // mm
constexpr double kLeastStroke = 10.0;   // mm, that is left of the standoff's

/// Whether samples are free with a standoff that is longer by `retreat`.
bool free_at(const Scene& scene, const MachineDefinition& machine, const RotaryPair& pair,
             const std::vector<JointSample>& samples, double retreat, SceneCache& cache) {
  const int standoff = standoff_joint(machine);
  for (const JointSample& s : samples) {
    JointVector q = s.q;
    q[standoff] = retreated(machine, q[standoff], retreat);
    const auto moved = pair.with_linears(forward_location(pair.chain(), s.q).tip, q);
    if (!moved || !scene.free(*moved, &cache)) return false;
  }
  return true;
}

}  // namespace

double retreated(const MachineDefinition& machine, double standoff, double retreat) {
  const ChainJoint& joint = machine.axes[static_cast<std::size_t>(standoff_joint(machine))].joint;
  const double reserve = machine.standoff.reserve;
  return std::clamp(standoff - towards_wrist(machine) * retreat, joint.lower + reserve,
                    joint.upper - reserve);
}

double base_retreat(const Scene& scene, const MachineDefinition& machine, const RotaryPair& pair,
                    const std::vector<JointSample>& samples) {
  const int standoff = standoff_joint(machine);
  if (standoff < 0) return 0.0;
  SceneCache cache;
  if (free_at(scene, machine, pair, samples, 0.0, cache)) return 0.0;
  const ChainJoint& joint = machine.axes[static_cast<std::size_t>(standoff)].joint;
  const double room = joint.upper - joint.lower - 2.0 * machine.standoff.reserve - kLeastStroke;
  for (double retreat = 0.0; retreat < room;) {
    retreat = std::min(std::max(kFirstRetreat, 1.5 * retreat + 5.0), room);
    if (free_at(scene, machine, pair, samples, retreat, cache)) return retreat;
  }
  return 0.0;
}

}  // namespace smoothpost
