#include "postproc/pipeline/controller_motion.h"

#include <algorithm>
#include <cmath>

#include "kernels/collision/chain_motion.h"
#include "kernels/core/contract.h"
#include "kernels/core/units.h"
#include "kernels/spline/bent_move.h"

namespace smoothpost {

namespace {

constexpr int kMostHalvings = 16;
constexpr double kMostBendSteps = 4096.0;
constexpr double kJump = 20.0 * kRadiansPerDegree;  // a rotary step that halving does not shorten

bool is_tool_move(const ReadBackMove& m) { return m.interpolation == MoveInterpolation::tool; }

bool goes_straight(const ReadBackMove& m) {
  return !is_tool_move(m) && m.bend.rows() == 0 && m.arc.turn == 0;
}

class Follower {
 public:
  Follower(const ScrewChain& chain, const Inverse* inverse, const FollowSettings& settings)
      : chain_(chain), inverse_(inverse), settings_(settings) {}

  Result<ControllerMotion> run(ReadBack read) {
    std::vector<ReadBackMove> moves = std::move(read.moves);
    std::vector<ReadBackEvent> events = std::move(read.events);
    out_.steps = read;  // everything else
    read.moves = std::move(moves);
    read.events = std::move(events);
    out_.steps->moves.reserve(read.moves.size() + read.moves.size() / 2);
    const JointMask all = (1U << chain_.size()) - 1U;
    JointMask known = 0;
    std::size_t event = 0;
    for (std::size_t i = 0; i < read.moves.size(); ++i) {
      for (; event < read.events.size() && read.events[event].before <= i; ++event)
        copy(read.events[event]);
      ReadBackMove& move = read.moves[i];
      if (move.interpolation == MoveInterpolation::joints) {
        known |= move.known;
        for (int j = 0; j < chain_.size(); ++j)
          if (!(move.known >> j & 1U) && here_.size() > 0) move.to[j] = here_[j];
        if (!goes_straight(move))
          add_bend_steps(move);
        else
          out_.steps->moves.push_back(move);
        here_ = move.to;
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

  void add_bend_steps(const ReadBackMove& move) {
    const BentMove bent{here_, move.to, move.bend, move.arc};
    const double spread = arc_spread(bent);
    const BendBounds bounds = bend_bounds(bent);
    double share = 1.0;
    for (int j = 0; j < chain_.size(); ++j) {
      const bool rotary = chain_.joints[static_cast<std::size_t>(j)].kind == JointKind::rotary;
      share = std::max(share, bounds.second[j] / (8.0 * (rotary ? settings_.axis_tolerance
                                                                : settings_.tip_tolerance)));
    }
    const double steps = std::min(std::ceil(std::sqrt(share)), kMostBendSteps);
    for (double k = 1.0; k <= steps; k += 1.0) {
      ReadBackMove step = move;
      step.bend.resize(0, 4);
      step.arc = {};
      step.to = k == steps ? move.to : joints_at(bent, k / steps);
      step.duration = move.duration / steps;
      step.deviation = bounds.second / (8.0 * steps * steps);
      step.spread = spread;
      if (move.arc.turn != 0)
        for (const int j : {move.arc.first, move.arc.second}) step.deviation[j] += spread;
      out_.steps->moves.push_back(std::move(step));
    }
  }

  bool tool_move(std::size_t i, ReadBackMove& move) {
    length_ = settings_.tool_length ? settings_.tool_length(i) : 0.0;
    from_ = tip_pose(chain_, here_, length_);
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
      step.known = (1U << chain_.size()) - 1U;
      step.duration = move.duration * (share - last);
      last = share;
      out_.steps->moves.push_back(std::move(step));
    }
    here_ = steps_.back().second;
    move.to = here_;
    return true;
  }

  Pose pose(double share) const {
    return tool_motion(from_, to_, share, settings_.turn, chain_.tool_axis);
  }

  std::optional<JointVector> at(double share, const JointVector& near) const {
    return inverse_->nearest(holder_pose(chain_, pose(share), length_), near);
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
    const auto& joints = chain_.joints;
    for (std::size_t j = 0; j < joints.size(); ++j) {
      const auto i = static_cast<Eigen::Index>(j);
      if (joints[j].kind == JointKind::rotary && std::abs(end[i] - q[i]) > kJump) return false;
    }
    for (const double t : {0.25, 0.5, 0.75}) {
      const Pose wanted = pose(from + t * (to - from));
      const Pose got = tip_pose(chain_, q + t * (end - q), length_);
      if ((wanted.translation() - got.translation()).norm() > settings_.tip_tolerance) return false;
      const Vec3& axis = chain_.tool_axis;
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

  const ScrewChain& chain_;
  const Inverse* inverse_;
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
  if (std::all_of(read.moves.begin(), read.moves.end(), goes_straight))
    return Result<ControllerMotion>(ControllerMotion{std::move(read), {}});
  return Follower(inverse.chain(), &inverse, settings).run(std::move(read));
}

ControllerMotion follow_joints(ReadBack read, const ScrewChain& chain,
                               const FollowSettings& settings) {
  require(std::none_of(read.moves.begin(), read.moves.end(), is_tool_move),
          "follow_joints: moves of joints");
  if (std::all_of(read.moves.begin(), read.moves.end(), goes_straight))
    return {std::move(read), {}};
  return std::move(Follower(chain, nullptr, settings).run(std::move(read)).value());
}

StepAllowance step_allowance(const ReadBack& steps, const ScrewChain& chain, double longest_tool) {
  StepAllowance out;
  int tool = -1, workpiece = -1;
  for (int j = 0; j < chain.size(); ++j)
    (chain.joints[static_cast<std::size_t>(j)].side == ChainSide::tool ? tool : workpiece) = j;
  const ChainPath path = path_between(chain, tool, workpiece);
  const std::vector<Ball> holder = {{chain.tool_home.translation(), longest_tool}};
  for (std::size_t i = 1; i < steps.moves.size(); ++i) {
    const ReadBackMove& move = steps.moves[i];
    if (move.deviation.size() == 0) continue;
    const JointVector lever =
        movement_bound(chain, path, holder, steps.moves[i - 1].to, move.to).lever;
    out.tip = std::max(out.tip, lever.dot(move.deviation));
    double turn = 0.0;
    for (int j = 0; j < chain.size(); ++j)
      if (chain.joints[static_cast<std::size_t>(j)].kind == JointKind::rotary)
        turn += move.deviation[j];
    out.axis = std::max(out.axis, turn);
  }
  return out;
}

}  // namespace smoothpost
