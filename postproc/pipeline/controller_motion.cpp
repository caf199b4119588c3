#include "postproc/pipeline/controller_motion.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/units.h"

namespace smoothpost {

namespace {

constexpr int kMostHalvings = 16;
constexpr double kJump = 20.0 * kRadiansPerDegree;  // a rotary step that halving does not shorten

class Follower {
 public:
  Follower(const Inverse& inverse, const FollowSettings& settings)
      : inverse_(inverse), settings_(settings) {}

  Result<ControllerMotion> run(ReadBack read) {
    std::vector<ReadBackMove> moves = std::move(read.moves);
    std::vector<ReadBackEvent> events = std::move(read.events);
    out_.steps = read;  // everything else
    read.moves = std::move(moves);
    read.events = std::move(events);
    out_.steps->moves.reserve(read.moves.size() + read.moves.size() / 2);
    const JointMask all = (1U << inverse_.chain().size()) - 1U;
    JointMask known = 0;
    std::size_t event = 0;
    for (std::size_t i = 0; i < read.moves.size(); ++i) {
      for (; event < read.events.size() && read.events[event].before <= i; ++event)
        copy(read.events[event]);
      ReadBackMove& move = read.moves[i];
      if (move.interpolation == MoveInterpolation::joints) {
        known |= move.known;
        for (int j = 0; j < inverse_.chain().size(); ++j)
          if (!(move.known >> j & 1U) && here_.size() > 0) move.to[j] = here_[j];
        here_ = move.to;
        out_.steps->moves.push_back(move);
        continue;
      }
      if (known != all) {
        fail("KN120", move,
             "the tool is to move on a line before every axis has been told its "
             "position: a move in joints has to come first");
        break;
      }
      if (!tool_move(i, move)) break;
      move.known = all;
    }
    for (; event < read.events.size(); ++event) copy(read.events[event]);
    if (has_error(diagnostics_)) return Result<ControllerMotion>::failure(std::move(diagnostics_));
    out_.read = std::move(read);
    return Result<ControllerMotion>(std::move(out_));
  }

 private:
  void copy(ReadBackEvent event) {
    event.before = out_.steps->moves.size();
    out_.steps->events.push_back(std::move(event));
  }

  bool tool_move(std::size_t i, ReadBackMove& move) {
    length_ = settings_.tool_length ? settings_.tool_length(i) : 0.0;
    from_ = tip_pose(inverse_.chain(), here_, length_);
    to_ = move.tool;
    move_ = &move;
    steps_.clear();
    const auto end = at(1.0, here_);
    if (!end || !halve(0.0, here_, 1.0, 0)) {
      if (diagnostics_.empty())
        fail("KN121", move, "the machine cannot follow the tool to the end of this move");
      return false;
    }
    double last = 0.0;
    for (const auto& [share, q] : steps_) {
      ReadBackMove step = move;
      step.interpolation = MoveInterpolation::joints;
      step.to = q;
      step.known = (1U << inverse_.chain().size()) - 1U;
      step.duration = move.duration * (share - last);
      last = share;
      out_.steps->moves.push_back(std::move(step));
    }
    here_ = steps_.back().second;
    move.to = here_;
    return true;
  }

  Pose pose(double share) const {
    return tool_motion(from_, to_, share, settings_.turn, inverse_.chain().tool_axis);
  }

  std::optional<JointVector> at(double share, const JointVector& near) const {
    return inverse_.nearest(holder_pose(inverse_.chain(), pose(share), length_), near);
  }

  /// Appends steps from `from` (joints q) to share `to`.
  bool halve(double from, const JointVector& q, double to, int depth) {
    const auto end = at(to, q);
    if (!end) {
      fail("KN121", *move_, "a place on the way of this move is out of the machine's reach");
      return false;
    }
    if (is_straight(from, q, to, *end)) {
      steps_.emplace_back(to, *end);
      return true;
    }
    if (depth >= kMostHalvings) {
      fail("KN122", *move_,
           "the axes would have to jump on this move: the machine passes a "
           "singular posture");
      return false;
    }
    const double mid = 0.5 * (from + to);
    if (!halve(from, q, mid, depth + 1)) return false;
    const JointVector middle = steps_.back().second;
    return halve(mid, middle, to, depth + 1);
  }

  bool is_straight(double from, const JointVector& q, double to, const JointVector& end) const {
    const auto& joints = inverse_.chain().joints;
    for (std::size_t j = 0; j < joints.size(); ++j) {
      const auto i = static_cast<Eigen::Index>(j);
      if (joints[j].kind == JointKind::rotary && std::abs(end[i] - q[i]) > kJump) return false;
    }
    for (const double t : {0.25, 0.5, 0.75}) {
      const Pose wanted = pose(from + t * (to - from));
      const Pose got = tip_pose(inverse_.chain(), q + t * (end - q), length_);
      if ((wanted.translation() - got.translation()).norm() > settings_.tip_tolerance) return false;
      const Vec3& axis = inverse_.chain().tool_axis;
      if ((wanted.linear() * axis - got.linear() * axis).norm() > settings_.axis_tolerance)
        return false;
    }
    return true;
  }

  void fail(const char* code, const ReadBackMove& move, std::string text) {
    Diagnostic d;
    d.code = code;
    d.where.line = static_cast<int>(move.line);
    d.text = std::move(text);
    diagnostics_.push_back(std::move(d));
  }

  const Inverse& inverse_;
  const FollowSettings& settings_;
  ControllerMotion out_;
  Diagnostics diagnostics_;
  JointVector here_;
  Pose from_ = Pose::Identity();
  Pose to_ = Pose::Identity();
  double length_ = 0.0;
  const ReadBackMove* move_ = nullptr;
  std::vector<std::pair<double, JointVector>> steps_;
};

}  // namespace

Result<ControllerMotion> follow_controller(ReadBack read, const Inverse& inverse,
                                           const FollowSettings& settings) {
  const bool any = std::any_of(read.moves.begin(), read.moves.end(), [](const ReadBackMove& m) {
    return m.interpolation == MoveInterpolation::tool;
  });
  if (!any) return Result<ControllerMotion>(ControllerMotion{std::move(read), {}});
  return Follower(inverse, settings).run(std::move(read));
}

}  // namespace smoothpost
