#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "kernels/core/units.h"
#include "kernels/kinematics/inverse.h"
#include "postproc/pipeline/convert.h"
#include "postproc/pipeline/cuts.h"

// Whether a program still does what its input asks for. It says so in another way than the checker:
// all that both share is the dialect's reader, forward and inverse kinematics, and the input's own
// path.
//
// A mutant is equivalent when
//  - it makes as many cuts as the input, in its order: runs of feeds (on a laser: with the beam
//    on) between rapids;
//  - of each cut the discrete Fréchet distance to the input's, over samples an eighth of the
//    tolerances apart, is at most the tolerances plus that eighth: tip and axis within them at
//    equal place, nowhere back;
//  - spindle, coolant, gas, tool and beam change in each cut as in the unchanged program, in the
//    same order, each no farther off along the cut than tolerance.event_mm;
//  - every axis stays in its range and, on feeds, below its velocity; no rapid has the beam on.
// Not asked: the feed itself, values of events, waits, and how the machine gets from cut to cut.
namespace smoothpost::test {

/// One place of a cut.
struct CutSample {
  Vec3 tip = Vec3::Zero();
  Vec3 axis = Vec3::UnitZ();
};

using States = std::map<std::string, std::string>;

/// From where on a cut's process is as stated, mm from its start.
struct StateChange {
  double at = 0.0;
  States states;
};

struct CutTrace {
  std::vector<CutSample> samples;
  std::vector<StateChange> changes;  ///< the first at 0
  double length = 0.0;               ///< mm
};

struct OracleMachine {
  MachineDefinition machine;
  Pose placement = Pose::Identity();
  double tool_length = 0.0;
  ToolTurn turn = ToolTurn::none;
};

namespace oracle_detail {

constexpr double kShare = 0.125;  // of the tolerances, between samples

inline Pose with_tool(const ScrewChain& chain, const JointVector& q, double length) {
  Pose pose = forward(chain, q);
  pose.translation() -= length * (pose.linear() * chain.tool_axis);
  return pose;
}

/// A pose between two: the tip on the line, the rotation about one axis.
inline Pose between(const Pose& from, const Pose& to, double t, ToolTurn turn, const Vec3& axis) {
  Pose pose = Pose::Identity();
  pose.translation() = (1.0 - t) * from.translation() + t * to.translation();
  if (turn == ToolTurn::great_circle) {
    const Eigen::Quaterniond whole =
        Eigen::Quaterniond::FromTwoVectors(from.linear() * axis, to.linear() * axis);
    pose.linear() =
        (Eigen::Quaterniond::Identity().slerp(t, whole)).toRotationMatrix() * from.linear();
    return pose;
  }
  const Eigen::Quaterniond a(from.linear()), b(to.linear());
  pose.linear() = a.slerp(t, b).toRotationMatrix();
  return pose;
}

/// Follows a program's moves with the real part and the real tool.
class Tracer {
 public:
  Tracer(const OracleMachine& m, bool beam)
      : m_(m), beam_(beam), chain_(chain_of(m.machine)), inverse_(Inverse::from(chain_)) {
    chain_.workpiece_home = chain_.workpiece_home * m.placement;
    inverse_ = Inverse::from(chain_);
  }

  std::vector<CutTrace> run(const ReadBack& read) {
    const JointMask all = (1U << chain_.size()) - 1U;
    JointMask known = 0;
    std::size_t event = 0;
    bool in_cut = false;
    for (std::size_t i = 0; i < read.moves.size(); ++i) {
      for (; event < read.events.size() && read.events[event].before <= i; ++event)
        note(read.events[event].name);
      const ReadBackMove& move = read.moves[i];
      const bool link = move.rapid || (beam_ && !move.beam);
      if (link) in_cut = false;
      // A cut begins where the tool stands.
      if (!link && !in_cut) {
        cuts_.emplace_back();
        if (known == all) cuts_.back().samples.push_back(sample(here_));
        in_cut = true;
      }
      if (!link) add_state(move.beam);
      known |= move.known;
      if (move.interpolation == MoveInterpolation::tool)
        tool_move(read, move, link);
      else
        joint_move(move, known == all, link);
    }
    return std::move(cuts_);
  }

 private:
  CutSample sample(const Pose& pose) const {
    return {pose.translation(), pose.linear() * chain_.tool_axis};
  }

  void note(const std::string& name) {
    const auto ends = [&name](const char* tail) {
      const std::string t = tail;
      return name.size() > t.size() && name.compare(name.size() - t.size(), t.size(), t) == 0;
    };
    if (name == "tool_change") states_["tool"] = name;
    for (const char* tail : {"_on_reverse", "_on", "_off"})
      if (ends(tail) && name.rfind("beam", 0) != 0) {
        const std::string group = name.substr(0, name.size() - std::string(tail).size());
        if (std::string(tail) == "_off")
          states_.erase(group);
        else
          states_[group] = name;
        return;
      }
  }

  void add_state(bool beam) {
    CutTrace& cut = cuts_.back();
    States now = states_;
    if (beam) now["beam"] = "on";
    if (!cut.changes.empty() && cut.changes.back().states == now) return;
    if (!cut.changes.empty() && cut.length - cut.changes.back().at < 1e-9) {
      cut.changes.back().states = now;
      const std::size_t n = cut.changes.size();
      if (n > 1 && cut.changes[n - 2].states == now) cut.changes.pop_back();
      return;
    }
    cut.changes.push_back({cut.length, std::move(now)});
  }

  template <class PoseAt>
  void add_samples(const PoseAt& pose_at) {
    CutTrace& cut = cuts_.back();
    const auto& tolerance = m_.machine.tolerance;
    double way = 0.0, turn = 0.0;
    CutSample last = sample(pose_at(0.0));
    for (int k = 1; k <= 16; ++k) {
      const CutSample next = sample(pose_at(k / 16.0));
      way += (next.tip - last.tip).norm();
      turn += std::atan2(next.axis.cross(last.axis).norm(), next.axis.dot(last.axis));
      last = next;
    }
    const double steps = std::ceil(
        1.02 * std::max(way / (kShare * tolerance.tip), turn / (kShare * tolerance.axis)));
    const int n = static_cast<int>(std::clamp(steps, 1.0, 200000.0));
    for (int k = 1; k <= n; ++k) {
      const CutSample next = sample(pose_at(static_cast<double>(k) / n));
      if (!cut.samples.empty()) cut.length += (next.tip - cut.samples.back().tip).norm();
      cut.samples.push_back(next);
    }
  }

  void joint_move(const ReadBackMove& move, bool known, bool link) {
    JointVector to = move.to;
    if (q_.size() > 0 && after_tool_)
      for (int j = 0; j < chain_.size(); ++j)
        if (!(move.known >> j & 1U)) to[j] = q_[j];
    if (!link && known && q_.size() > 0)
      add_samples(
          [&](double t) { return with_tool(chain_, joints_on(move, to, t), m_.tool_length); });
    q_ = to;
    if (known) here_ = with_tool(chain_, q_, m_.tool_length);
  }

  // On the straight way, or round the centre of an arc at the start's distance from it.
  JointVector joints_on(const ReadBackMove& move, const JointVector& to, double t) const {
    JointVector q = q_ + t * (to - q_);
    const JointArc& arc = move.arc;
    if (arc.turn == 0) return q;
    const Eigen::Vector2d centre(arc.centre_first, arc.centre_second);
    const Eigen::Vector2d a = Eigen::Vector2d(q_[arc.first], q_[arc.second]) - centre;
    const Eigen::Vector2d b = Eigen::Vector2d(to[arc.first], to[arc.second]) - centre;
    double turn = std::atan2(b.y(), b.x()) - std::atan2(a.y(), a.x());
    while (arc.turn * turn <= 0.0) turn += arc.turn * 2.0 * std::acos(-1.0);
    while (std::abs(turn) > 2.0 * std::acos(-1.0)) turn -= arc.turn * 2.0 * std::acos(-1.0);
    const Eigen::Vector2d now = centre + Eigen::Rotation2Dd(t * turn) * a;
    q[arc.first] = now.x();
    q[arc.second] = now.y();
    return q;
  }

  // The pose of the real tool in the real part, when the text's frames are others.
  Pose real(const ReadBack& read, const Pose& stated) const {
    Pose pose = stated;
    if (read.part) pose = chain_.workpiece_home.inverse() * *read.part * pose;
    if (read.tool_frame) {
      Pose tip = Pose::Identity();
      tip.translation() = m_.machine.tool.tip - m_.tool_length * m_.machine.tool.axis;
      pose = pose * read.tool_frame->inverse() * m_.machine.tool.flange.inverse() * tip;
    }
    return pose;
  }

  void tool_move(const ReadBack& read, const ReadBackMove& move, bool link) {
    const Pose from = here_;
    const Pose to = real(read, move.tool);
    const auto pose_at = [&](double t) { return between(from, to, t, m_.turn, chain_.tool_axis); };
    if (!link) add_samples(pose_at);
    for (int k = 1; k <= 8 && inverse_; ++k) {
      Pose holder = pose_at(k / 8.0);
      holder.translation() += m_.tool_length * (holder.linear() * chain_.tool_axis);
      if (const auto q = inverse_->nearest(holder, q_)) q_ = *q;
    }
    after_tool_ = true;
    here_ = to;
  }

  const OracleMachine& m_;
  bool beam_ = false;
  ScrewChain chain_;
  std::optional<Inverse> inverse_;
  JointVector q_;
  Pose here_ = Pose::Identity();
  bool after_tool_ = false;
  States states_;
  std::vector<CutTrace> cuts_;
};

/// The first and the last sample where a program's cut may begin and end that may leave out `free`
/// mm at either end.
inline std::pair<std::size_t, std::size_t> free_ends(const std::vector<CutSample>& samples,
                                                     double free) {
  std::size_t first = 0, last = samples.size() - 1;
  for (double way = 0.0; first < last; ++first)
    if ((way += (samples[first + 1].tip - samples[first].tip).norm()) > free) break;
  for (double way = 0.0; last > 0; --last)
    if ((way += (samples[last].tip - samples[last - 1].tip).norm()) > free) break;
  return {first, last};
}

/// Whether a coupling of both, in order and never back, keeps every pair within the tolerances;
/// `free` mm at either end of b may be without a pair.
inline bool close(const std::vector<CutSample>& a, const std::vector<CutSample>& b,
                  const ToleranceSettings& tolerance, double free) {
  const double most = 1.0 + kShare;
  const auto [latest_start, earliest_end] = free_ends(b, free);
  const auto near = [&](std::size_t i, std::size_t j) {
    return (a[i].tip - b[j].tip).norm() <= most * tolerance.tip &&
           std::atan2(a[i].axis.cross(b[j].axis).norm(), a[i].axis.dot(b[j].axis)) <=
               most * tolerance.axis;
  };
  // Of every row, the columns from `first` on that can be reached.
  std::size_t first = 0;
  std::vector<char> row;
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::vector<char> next;
    std::size_t next_first = 0;
    for (std::size_t j = first; j < b.size(); ++j) {
      const auto old = [&](std::size_t k) {
        return k >= first && k < first + row.size() && row[k - first] != 0;
      };
      const bool left = !next.empty() && next.back() != 0;
      bool reached = old(j) || (j > 0 && old(j - 1)) || left || (i == 0 && j <= latest_start);
      reached = reached && near(i, j);
      if (next.empty() && !reached) {
        if (i > 0 && j >= first + row.size()) break;
        continue;
      }
      if (next.empty()) next_first = j;
      if (i > 0 && !reached && j > first + row.size()) break;
      next.push_back(reached ? 1 : 0);
    }
    if (next.empty()) return false;
    row = std::move(next);
    first = next_first;
  }
  for (std::size_t j = std::max(first, earliest_end); j < first + row.size(); ++j)
    if (row[j - first] != 0) return true;
  return false;
}

}  // namespace oracle_detail

/// The cuts of a program on a machine with its part and tool. `beam`: the input turns a beam on.
inline std::vector<CutTrace> trace_program(const ReadBack& read, const OracleMachine& machine,
                                           bool beam) {
  return oracle_detail::Tracer(machine, beam).run(read);
}

/// The cuts of the input, as its own controller would make them.
inline std::vector<CutTrace> trace_input(const InterpretedInput& input,
                                         const ToleranceSettings& tolerance, bool beam) {
  const ReferencePath reference(input.path, input.frames);
  std::vector<CutTrace> cuts;
  bool in_cut = false;
  for (std::size_t k = 1; k < input.path.points.size(); ++k) {
    const PathPoint& point = input.path.points[k];
    const bool link = point.replanned || (beam ? !point.beam : point.kind == MotionKind::rapid);
    if (link) {
      in_cut = false;
      continue;
    }
    const auto at = [&](double s) {
      const CutterLocation c = reference.at(k, s);
      return CutSample{c.tip, c.axis};
    };
    if (!in_cut) {
      cuts.emplace_back();
      cuts.back().samples.push_back(at(0.0));
    }
    in_cut = true;
    double way = 0.0, turn = 0.0;
    for (int i = 1; i <= 32; ++i) {
      const CutSample a = at((i - 1) / 32.0), b = at(i / 32.0);
      way += (a.tip - b.tip).norm();
      turn += std::atan2(a.axis.cross(b.axis).norm(), a.axis.dot(b.axis));
    }
    const double share = oracle_detail::kShare;
    const int n =
        std::max(1, static_cast<int>(std::ceil(1.02 * std::max(way / (share * tolerance.tip),
                                                               turn / (share * tolerance.axis)))));
    for (int i = 1; i <= n; ++i) cuts.back().samples.push_back(at(static_cast<double>(i) / n));
  }
  return cuts;
}

/// Why a program that was read is not equivalent; empty when it is. `wanted`: trace_input();
/// `unchanged`: trace_program() of the right program, whose states count. `in_joints`: the
/// program's motion in joint steps, for the axes.
struct OracleQuestion {
  const ReadBack& read;
  const ReadBack& in_joints;
  const OracleMachine& machine;
  bool beam = false;
  const std::vector<CutTrace>& wanted;
  const std::vector<CutTrace>& unchanged;
};

inline std::string axes_fault(const ReadBack& read, const MachineDefinition& machine) {
  for (std::size_t i = 0; i < read.moves.size(); ++i) {
    const ReadBackMove& move = read.moves[i];
    if (move.rapid && move.beam) return "rapid with the beam on, line " + std::to_string(move.line);
    for (int j = 0; j < machine.size(); ++j) {
      if (!(move.known >> j & 1U)) continue;
      const AxisDefinition& axis = machine.axes[static_cast<std::size_t>(j)];
      const double q = move.to[j];
      const std::string where = " of " + axis.name + ", line " + std::to_string(move.line);
      if (q < axis.joint.lower - 1e-9 || q > axis.joint.upper + 1e-9) return "range" + where;
      if (move.rapid || i == 0 || !(read.moves[i - 1].known >> j & 1U)) continue;
      const double step = std::abs(q - read.moves[i - 1].to[j]);
      if (step > 1e-12 && step > move.duration * axis.velocity * (1.0 + 1e-9))
        return "velocity" + where;
    }
  }
  return {};
}

inline std::string oracle_fault(const OracleQuestion& q) {
  if (const std::string fault = axes_fault(q.in_joints, q.machine.machine); !fault.empty())
    return fault;
  const std::vector<CutTrace> cuts = trace_program(q.read, q.machine, q.beam);
  if (cuts.size() != q.wanted.size())
    return std::to_string(cuts.size()) + " cuts, " + std::to_string(q.wanted.size()) + " wanted";
  const double event = q.machine.machine.tolerance.event + q.machine.machine.tolerance.tip;
  for (std::size_t k = 0; k < cuts.size(); ++k) {
    const std::string which = "cut " + std::to_string(k + 1) + ": ";
    if (!oracle_detail::close(cuts[k].samples, q.wanted[k].samples, q.machine.machine.tolerance,
                              q.beam ? q.machine.machine.tolerance.event : 0.0))
      return which + "another path";
    const auto& got = cuts[k].changes;
    const auto& right = q.unchanged[k].changes;
    if (got.size() != right.size()) return which + "another number of process changes";
    for (std::size_t i = 0; i < got.size(); ++i) {
      if (got[i].states != right[i].states) return which + "another process";
      if (std::abs(got[i].at - right[i].at) > event) return which + "the process changes elsewhere";
    }
  }
  return {};
}

}  // namespace smoothpost::test
