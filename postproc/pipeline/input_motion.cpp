#include "postproc/pipeline/input_motion.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace smoothpost {

namespace {

constexpr double kStep = 0.004;      // s
constexpr double kDiverges = 1.3;    // peak at half the step over the peak
constexpr double kLongest = 4000.0;  // s
constexpr double kLeast = 1e-9;      // peaks below it are rounding

struct Peaks {
  std::vector<std::array<double, 3>> most;  // of each joint: velocity, acceleration, jerk
  std::vector<double> jerk_squares;
  std::size_t count = 0;  // of jerks
};

/// Feed legs that follow each other.
struct Run {
  std::size_t first = 0, last = 0;
  double time = 0.0;
};

class InputSampler {
 public:
  InputSampler(const SmoothedPath& path, const JointPlan& plan, int joints)
      : path_(path), plan_(plan), joints_(joints), by_joints_(path.legs() + 1, false) {
    for (const JointSample& sample : plan.samples)
      if (sample.by_joints) by_joints_[sample.leg] = true;
  }

  std::vector<Run> runs() const {
    std::vector<Run> out;
    bool open = false;
    for (std::size_t leg = 1; leg <= path_.legs(); ++leg) {
      const PathPoint& point = path_.point(leg);
      const bool feeds = point.kind == MotionKind::feed && point.duration > 0.0 &&
                         !point.replanned && !by_joints_[leg];
      if (feeds && open) out.back().last = leg;
      if (feeds && !open) out.push_back({leg, leg, 0.0});
      if (feeds) out.back().time += point.duration;
      open = feeds;
    }
    return out;
  }

  Peaks peaks(const std::vector<Run>& runs, double step) const {
    Peaks out;
    out.most.assign(static_cast<std::size_t>(joints_), {0.0, 0.0, 0.0});
    out.jerk_squares.assign(static_cast<std::size_t>(joints_), 0.0);
    for (const Run& run : runs) see(run, step, out);
    return out;
  }

 private:
  std::optional<JointVector> start_of(std::size_t leg) const {
    const auto& samples = plan_.samples;
    const auto at = std::lower_bound(samples.begin(), samples.end(), leg,
                                     [](const JointSample& s, std::size_t l) { return s.leg < l; });
    if (at == samples.begin() || at == samples.end()) return {};
    return std::prev(at)->q;
  }

  void see(const Run& run, double step, Peaks& out) const {
    auto near = start_of(run.first);
    std::array<JointVector, 4> last;  // newest first
    std::size_t count = 0, leg = run.first;
    double leg_start = 0.0;
    const auto samples = static_cast<std::size_t>(run.time / step);
    for (std::size_t k = 0; near && k <= samples; ++k) {
      const double t = static_cast<double>(k) * step;
      while (leg < run.last && t >= leg_start + path_.point(leg).duration)
        leg_start += path_.point(leg++).duration;
      const double share = std::clamp((t - leg_start) / path_.point(leg).duration, 0.0, 1.0);
      near = plan_.joints_on_leg(leg, share, *near);
      if (!near) return;
      std::rotate(last.begin(), last.end() - 1, last.end());
      last[0] = *near;
      take(last, ++count, step, out);
    }
  }

  void take(const std::array<JointVector, 4>& q, std::size_t count, double h, Peaks& out) const {
    const auto see = [&](int order, const JointVector& value) {
      for (int j = 0; j < joints_; ++j) {
        double& most = out.most[static_cast<std::size_t>(j)][static_cast<std::size_t>(order)];
        most = std::max(most, std::abs(value[j]));
      }
    };
    if (count >= 2) see(0, (q[0] - q[1]) / h);
    if (count >= 3) see(1, (q[0] - 2.0 * q[1] + q[2]) / (h * h));
    if (count < 4) return;
    const JointVector jerk = (q[0] - 3.0 * q[1] + 3.0 * q[2] - q[3]) / (h * h * h);
    see(2, jerk);
    for (int j = 0; j < joints_; ++j)
      out.jerk_squares[static_cast<std::size_t>(j)] += jerk[j] * jerk[j];
    ++out.count;
  }

  const SmoothedPath& path_;
  const JointPlan& plan_;
  int joints_;
  std::vector<bool> by_joints_;
};

}  // namespace

std::vector<InputMotion> input_motion(const SmoothedPath& path, const JointPlan& plan, int joints) {
  const InputSampler sampler(path, plan, joints);
  const std::vector<Run> runs = sampler.runs();
  double time = 0.0;
  for (const Run& run : runs) time += run.time;
  if (!plan.joints_on_leg || time > kLongest) return {};
  const Peaks coarse = sampler.peaks(runs, kStep), fine = sampler.peaks(runs, 0.5 * kStep);
  if (coarse.count == 0) return {};
  std::vector<InputMotion> out(static_cast<std::size_t>(joints));
  for (std::size_t j = 0; j < out.size(); ++j) {
    const auto settled = [&](std::size_t order) -> std::optional<double> {
      const double most = coarse.most[j][order];
      if (fine.most[j][order] > kDiverges * most + kLeast / std::pow(kStep, order + 1.0)) return {};
      return most;
    };
    out[j].velocity = coarse.most[j][0];
    out[j].acceleration = settled(1);
    if (out[j].acceleration) out[j].jerk = settled(2);
    if (out[j].jerk)
      out[j].rms_jerk = std::sqrt(coarse.jerk_squares[j] / static_cast<double>(coarse.count));
  }
  return out;
}

}  // namespace smoothpost
