#include "postproc/pipeline/executed_time.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels/core/units.h"

namespace smoothpost {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kStands = 1e-9;     // mm or rad
constexpr double kKinkShare = 0.25;  // of an axis' acceleration, for a step of its speed in a cycle

/// One block as the planner sees it, over x from 0 to 1.
struct PlannedBlock {
  JointVector step;
  double speed = 0.0;         ///< 1/s, most
  double acceleration = 0.0;  ///< 1/s²
  bool rotary = false;        ///< a rotary moves
};

class StopAndGo {
 public:
  StopAndGo(const ReadBack& read, const MachineDefinition& machine)
      : read_(read), machine_(machine) {}

  double run() {
    double time = 0.0;
    const JointMask all = (1U << machine_.size()) - 1U;
    std::size_t event = 0;
    for (std::size_t i = 0; i < read_.moves.size(); ++i) {
      const bool started = i > 0 && (read_.moves[i - 1].known & all) == all;
      for (; event < read_.events.size() && read_.events[event].before <= i; ++event) {
        if (read_.events[event].seconds > 0.0) time += end_chain();
        if (started) time += read_.events[event].seconds;
      }
      if (started) time += add(i);
    }
    time += end_chain();
    for (; event < read_.events.size(); ++event) time += read_.events[event].seconds;
    return time;
  }

 private:
  // Blocks that the planner joins are timed together; returns the time of a chain that has ended.
  double add(std::size_t i) {
    PlannedBlock block = block_of(i);
    if (!(block.step.cwiseAbs().maxCoeff() > kStands)) return end_chain() + read_.moves[i].duration;
    double time = 0.0;
    if (!chain_.empty() && (block.rotary || chain_.back().rotary)) time = end_chain();
    chain_.push_back(std::move(block));
    return time;
  }

  PlannedBlock block_of(std::size_t i) const {
    const ReadBackMove& move = read_.moves[i];
    PlannedBlock block;
    block.step = move.to - read_.moves[i - 1].to;
    block.speed = !move.rapid && move.duration > 0.0 ? 1.0 / move.duration : kInfinity;
    block.acceleration = kInfinity;
    for (int j = 0; j < machine_.size(); ++j) {
      const AxisDefinition& axis = machine_.axes[static_cast<std::size_t>(j)];
      const double way = std::abs(block.step[j]);
      if (!(way > kStands)) continue;
      block.speed = std::min(block.speed, axis.velocity / way);
      block.acceleration = std::min(block.acceleration, axis.acceleration / way);
      block.rotary = block.rotary || axis.joint.kind == JointKind::rotary;
    }
    return block;
  }

  // Share of `before`'s speed v (1/s of its own x) at which the corner is passed; the same way per
  // second on the other side.
  double corner_speed(const PlannedBlock& before, const PlannedBlock& after) const {
    const double length = before.step.norm(), next = after.step.norm();
    double way = std::min(before.speed * length, after.speed * next);  // mm/s
    for (int j = 0; j < machine_.size(); ++j) {
      const double turn = std::abs(after.step[j] / next - before.step[j] / length);
      const double step = kKinkShare * machine_.cycle.time *
                          machine_.axes[static_cast<std::size_t>(j)].acceleration;
      if (turn > kStands) way = std::min(way, step / turn);
    }
    return way;
  }

  // Forwards and backwards over the corners, then a trapezoid for each block.
  double end_chain() {
    if (chain_.empty()) return 0.0;
    const std::size_t n = chain_.size();
    std::vector<double> corner(n + 1, 0.0);  // mm/s, or the norm of what moves
    for (std::size_t k = 1; k < n; ++k) corner[k] = corner_speed(chain_[k - 1], chain_[k]);
    const auto reach = [&](double from, std::size_t k) {
      const double length = chain_[k].step.norm();
      return std::sqrt(from * from + 2.0 * chain_[k].acceleration * length * length);
    };
    for (std::size_t k = 0; k < n; ++k)
      corner[k + 1] = std::min(corner[k + 1], reach(corner[k], k));
    for (std::size_t k = n; k-- > 0;) corner[k] = std::min(corner[k], reach(corner[k + 1], k));
    double time = 0.0;
    for (std::size_t k = 0; k < n; ++k) {
      const double length = chain_[k].step.norm();
      time += trapezoid(chain_[k], corner[k] / length, corner[k + 1] / length);
    }
    chain_.clear();
    return machine_.cycle.time * std::ceil(time / machine_.cycle.time - 1e-6);
  }

  // From speed v0 over x = 0 .. 1 to v1.
  static double trapezoid(const PlannedBlock& block, double v0, double v1) {
    const double a = block.acceleration;
    const double top = std::min(block.speed, std::sqrt(a + 0.5 * (v0 * v0 + v1 * v1)));
    const double ramps = (2.0 * top * top - v0 * v0 - v1 * v1) / (2.0 * a);
    return (2.0 * top - v0 - v1) / a + std::max(0.0, 1.0 - ramps) / top;
  }

  const ReadBack& read_;
  const MachineDefinition& machine_;
  std::vector<PlannedBlock> chain_;
};

}  // namespace

ExecutedTime executed_time(const ReadBack& joints, const MachineDefinition& machine) {
  if (machine.dialect.name != "linuxcnc")
    return {{},
            "none: how this control slows down between blocks was not measured; scheduled is what "
            "the program asks for"};
  if (machine.dialect.path_mode != "exact")
    return {{}, "none: only path_mode = \"exact\" was measured well enough"};
  return {StopAndGo(joints, machine).run(),
          "LinuxCNC 2.9, exact path: blocks that move a rotary end at rest, ramps at the axes' "
          "accelerations without a limit of jerk"};
}

}  // namespace smoothpost
