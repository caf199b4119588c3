#include "machines/definition/body_pairs.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

const char* const kWorkpiece = "workpiece";

/// The joint that comes before joint `index` of the same chain, or −1.
int parent_of(const MachineDefinition& machine, int index) {
  const auto side = machine.axes[static_cast<std::size_t>(index)].joint.side;
  for (int i = index - 1; i >= 0; --i)
    if (machine.axes[static_cast<std::size_t>(i)].joint.side == side) return i;
  return -1;
}

/// What is stated in [collision], by places in the list of bodies.
class StatedPairs {
 public:
  explicit StatedPairs(const MachineDefinition& machine) {
    for (std::size_t i = 0; i < machine.bodies.size(); ++i) places_[machine.bodies[i].name] = i;
    for (const auto& pair : machine.collision.allowed)
      allowed_.insert(key(pair.first, pair.second));
    for (const auto& pair : machine.collision.pairs)
      clearance_[key(pair.first, pair.second)] = pair.clearance;
  }

  bool allowed(std::size_t first, std::size_t second) const {
    return allowed_.count({first, second}) > 0;
  }
  std::optional<double> clearance(std::size_t first, std::size_t second) const {
    const auto found = clearance_.find({first, second});
    return found != clearance_.end() ? std::optional<double>(found->second) : std::nullopt;
  }

 private:
  using Key = std::pair<std::size_t, std::size_t>;

  std::size_t place(const std::string& name) const {
    const auto found = places_.find(name);
    return found != places_.end() ? found->second : BodyPair::kPart;
  }
  Key key(const std::string& a, const std::string& b) const {
    return std::minmax({place(a), place(b)});
  }

  std::map<std::string, std::size_t> places_;
  std::set<Key> allowed_;
  std::map<Key, double> clearance_;
};

}  // namespace

int joint_carrying(const MachineDefinition& machine, const std::string& link) {
  if (link == "base") return -1;
  if (link == kWorkpiece) {
    for (int i = machine.size() - 1; i >= 0; --i)
      if (machine.axes[static_cast<std::size_t>(i)].joint.side == ChainSide::workpiece) return i;
    return -1;
  }
  const int index = machine.axis_by_name(link);
  require(index >= 0, "a link is an axis, base or workpiece");
  return index;
}

std::vector<BodyPair> checked_pairs(const MachineDefinition& machine) {
  const auto& bodies = machine.bodies;
  const StatedPairs stated(machine);
  std::vector<int> joint;
  for (const Body& body : bodies) joint.push_back(joint_carrying(machine, body.link));
  joint.push_back(joint_carrying(machine, kWorkpiece));  // the part
  const auto meet_at_joint = [&](int a, int b) {
    return (a >= 0 && parent_of(machine, a) == b) || (b >= 0 && parent_of(machine, b) == a);
  };
  std::vector<BodyPair> pairs;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    for (std::size_t j = i + 1; j <= bodies.size(); ++j) {
      const bool is_part = j == bodies.size();
      const std::size_t second = is_part ? BodyPair::kPart : j;
      if (joint[i] == joint[j]) continue;
      if (const auto clearance = stated.clearance(i, second)) {
        pairs.push_back({i, second, *clearance});
        continue;
      }
      if (stated.allowed(i, second)) continue;
      const bool clamped = is_part || bodies[i].link == kWorkpiece || bodies[j].link == kWorkpiece;
      if (!clamped && meet_at_joint(joint[i], joint[j])) continue;
      pairs.push_back(
          {i, second,
           is_part ? bodies[i].clearance : std::max(bodies[i].clearance, bodies[j].clearance)});
    }
  }
  return pairs;
}

}  // namespace smoothpost
