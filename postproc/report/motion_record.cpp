#include "postproc/report/motion_record.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/core/units.h"
#include "kernels/kinematics/inverse.h"
#include "postproc/pipeline/tool_motion.h"

namespace smoothpost {

namespace {

constexpr double kMostSamples = 150000.0;
constexpr double kDifference = 0.004;  // s
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

double unit_of(const MachineDefinition& machine, std::size_t axis) {
  return machine.axes[axis].joint.kind == JointKind::rotary ? kDegreesPerRadian : 1.0;
}

MotionRecord record_of(const MachineDefinition& machine, int orders) {
  MotionRecord r;
  r.orders = orders;
  for (int order = 0; order < orders; ++order)
    r.axes[static_cast<std::size_t>(order)].resize(machine.axes.size());
  return r;
}

void add_gap(MotionRecord& r) {
  r.time.push_back(r.time.empty() ? 0.0 : r.time.back());
  for (auto& order : r.axes)
    for (auto& axis : order) axis.push_back(kNaN);
  r.tip_speed.push_back(kNaN);
  r.programmed_speed.push_back(kNaN);
  r.cutting.push_back(false);
}

/// Joints of the output machine along the input.
class InputFollower {
 public:
  InputFollower(const PageInput& in, const ReferencePath& reference, const ScrewChain& chain,
                const Inverse& inverse, const ProgramMotion& motion)
      : in_(in), reference_(reference), chain_(chain), inverse_(inverse), blocks_(motion.blocks) {
    if (in.machine->recipe.task == "pose" && reference.path().full_pose)
      whole_ = input_tool_rotation(chain.tool_axis, in.machine->recipe.spin);
  }

  /// Places have to ascend from call to call.
  std::optional<JointVector> joints_at(const PathPlace& place) {
    while (at_ + 1 < blocks_.size() && before(blocks_[at_].to, place)) ++at_;
    const ProgramBlock& block = blocks_[at_];
    if (place.segment < block.from.segment || place.segment > block.to.segment) return {};
    JointVector near = block.start + share(block, place) * (block.end - block.start);
    const Pose there = forward(chain_, near);
    for (std::size_t j = 0; j < in_.machine->axes.size(); ++j)
      if (in_.machine->axes[j].joint.redundant)
        near[static_cast<int>(j)] = in_.machine->axes[j].joint.home;
    const CutterLocation wanted = reference_.at(place.segment, place.s);
    Pose tip = Pose::Identity();
    tip.translation() = wanted.tip;
    if (whole_) {
      tip.linear() = reference_.rotation_at(place.segment, place.s).toRotationMatrix() * *whole_;
    } else {
      const Vec3 axis = there.linear() * chain_.tool_axis;
      tip.linear() =
          Eigen::Quaterniond::FromTwoVectors(axis, wanted.axis).toRotationMatrix() * there.linear();
    }
    const double length = reference_.path().points[place.segment].tool_length;
    return inverse_.nearest(holder_pose(chain_, tip, length), near);
  }

  /// When the program reaches the start of a segment; nothing: it does not.
  std::optional<double> start_of(std::uint32_t segment) {
    while (at_ + 1 < blocks_.size() && blocks_[at_].to.segment < segment) ++at_;
    if (at_ >= blocks_.size() || blocks_[at_].to.segment < segment) return {};
    return blocks_[at_].time;
  }

 private:
  static bool before(const PathPlace& a, const PathPlace& b) {
    return a.segment < b.segment || (a.segment == b.segment && a.s < b.s);
  }
  static double share(const ProgramBlock& b, const PathPlace& p) {
    if (b.from.segment != b.to.segment) return 0.5;  // merged points lie close together
    const double span = b.to.s - b.from.s;
    return span > 0.0 ? std::clamp((p.s - b.from.s) / span, 0.0, 1.0) : 1.0;
  }

  const PageInput& in_;
  const ReferencePath& reference_;
  const ScrewChain& chain_;
  const Inverse& inverse_;
  const std::vector<ProgramBlock>& blocks_;
  std::optional<Mat3> whole_;
  std::size_t at_ = 0;
};

/// Segments that follow each other without a link between.
struct Run {
  std::uint32_t first = 0, last = 0;
};

std::vector<Run> runs_of(const ToolPath& path) {
  std::vector<Run> runs;
  for (std::uint32_t k = 1; k < path.points.size(); ++k) {
    if (path.points[k].replanned || !(path.points[k].duration > 0.0)) continue;
    if (!runs.empty() && runs.back().last + 1 == k)
      runs.back().last = k;
    else
      runs.push_back({k, k});
  }
  return runs;
}

/// Positions of a run into `r`, then their differences.
void add_run(const MachineDefinition& machine, double start, const std::vector<JointVector>& joints,
             MotionRecord& r) {
  const std::size_t n = joints.size();
  const double dt = r.step;
  if (n < 4) return;
  const auto at = [&](std::size_t i, std::size_t j) { return joints[i][static_cast<int>(j)]; };
  for (std::size_t j = 0; j < machine.axes.size(); ++j) {
    const double unit = unit_of(machine, j);
    for (std::size_t i = 0; i < n; ++i) {
      const bool inner = i > 0 && i + 2 < n;
      r.axes[0][j].push_back(unit * at(i, j));
      r.axes[1][j].push_back(inner ? unit * (at(i + 1, j) - at(i, j)) / dt : kNaN);
      r.axes[2][j].push_back(
          inner ? unit * (at(i + 1, j) - 2.0 * at(i, j) + at(i - 1, j)) / (dt * dt) : kNaN);
      r.axes[3][j].push_back(
          inner ? unit * (at(i + 2, j) - 3.0 * at(i + 1, j) + 3.0 * at(i, j) - at(i - 1, j)) /
                      (dt * dt * dt)
                : kNaN);
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    r.time.push_back(start + static_cast<double>(i) * dt);
    r.tip_speed.push_back(kNaN);
    r.programmed_speed.push_back(kNaN);
    r.cutting.push_back(true);
  }
  add_gap(r);
}

}  // namespace

MotionRecord planned_record(const PageInput& in) {
  if (!in.machine || in.conversion.timeline.items.empty()) return {};
  const MachineDefinition& machine = *in.machine;
  const Timeline& timeline = in.conversion.timeline;
  const double end = timeline.duration();
  MotionRecord r = record_of(machine, 4);
  r.step = std::max(machine.cycle.time, end / kMostSamples);
  std::size_t at = 0;
  for (long long k = 0;; ++k) {
    const double t = std::min(static_cast<double>(k) * r.step, end);
    at = timeline.item_at(t, at);
    const TimelineItem& item = timeline.items[at];
    const ScheduledStretch::Motion m = timeline.at(item, t);
    const std::array<const JointVector*, 4> values = {&m.position, &m.velocity, &m.acceleration,
                                                      &m.jerk};
    for (std::size_t order = 0; order < 4; ++order)
      for (std::size_t j = 0; j < machine.axes.size(); ++j)
        r.axes[order][j].push_back(unit_of(machine, j) * (*values[order])[static_cast<int>(j)]);
    r.time.push_back(t);
    r.cutting.push_back(item.segment > 0);
    double speed = 0.0, programmed = kNaN;
    if (item.law >= 0) {
      const ScheduledStretch& law = timeline.laws[static_cast<std::size_t>(item.law)];
      const double own = item.from + t - item.start;
      speed = law.tip_speed(own);
      const double s = law.profile.at(own / law.slowing).s;
      const double feed = law.joints.feed[law.joints.piece_at(s)];
      if (std::isfinite(feed)) programmed = feed;
    }
    r.tip_speed.push_back(speed);
    r.programmed_speed.push_back(item.segment > 0 ? programmed : kNaN);
    if (t >= end) break;
  }
  return r;
}

MotionRecord printed_record(const PageInput& in, const ProgramMotion& motion) {
  if (!in.machine || motion.points.size() < 2) return {};
  const MachineDefinition& machine = *in.machine;
  MotionRecord r = record_of(machine, 2);
  const auto add = [&](const ProgramPoint& p, const ProgramPoint& a, const ProgramPoint& b) {
    const double dt = b.time - a.time;
    for (std::size_t j = 0; j < machine.axes.size(); ++j) {
      const int i = static_cast<int>(j);
      r.axes[0][j].push_back(unit_of(machine, j) * p.joints[i]);
      r.axes[1][j].push_back(dt > 0.0 ? unit_of(machine, j) * (b.joints[i] - a.joints[i]) / dt
                                      : 0.0);
    }
    r.time.push_back(p.time);
    r.tip_speed.push_back(dt > 0.0 ? (b.tip - a.tip).norm() / dt : 0.0);
    r.programmed_speed.push_back(kNaN);
    r.cutting.push_back(!b.link);
  };
  const ProgramPoint* last = &motion.points.front();
  for (const ProgramPoint& p : motion.points) {
    if (&p == last || !(p.time > last->time)) continue;
    add(*last, *last, p);
    add(p, *last, p);
    last = &p;
  }
  return r;
}

MotionRecord input_record(const PageInput& in, const ReferencePath* reference,
                          const ScrewChain& chain, const ProgramMotion& motion) {
  if (!in.machine || !reference || motion.blocks.empty()) return {};
  const auto inverse = Inverse::from(chain);
  if (!inverse) return {};
  const ToolPath& path = reference->path();
  double whole = 0.0;
  for (const PathPoint& p : path.points) whole += p.replanned ? 0.0 : p.duration;
  MotionRecord r = record_of(*in.machine, 4);
  r.step = std::max(kDifference, whole / kMostSamples);
  InputFollower follower(in, *reference, chain, *inverse, motion);
  for (const Run& run : runs_of(path)) {
    const auto start = follower.start_of(run.first);
    if (!start) continue;
    std::vector<JointVector> joints;
    double reached = 0.0;  // s, at the start of segment k
    double t = 0.0;
    for (std::uint32_t k = run.first; k <= run.last; ++k) {
      const double own = path.points[k].duration;
      for (; t <= reached + own; t += r.step) {
        const auto q = follower.joints_at({k, std::clamp((t - reached) / own, 0.0, 1.0)});
        if (!q) {
          add_run(*in.machine, *start + t - r.step * static_cast<double>(joints.size()), joints, r);
          joints.clear();
          continue;
        }
        joints.push_back(*q);
      }
      reached += own;
    }
    add_run(*in.machine, *start + t - r.step * static_cast<double>(joints.size()), joints, r);
  }
  return r.time.empty() ? MotionRecord{} : r;
}

}  // namespace smoothpost
