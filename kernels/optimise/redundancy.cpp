#include "kernels/optimise/redundancy.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"
#include "kernels/spline/gauss_rule.h"

namespace smoothpost {

namespace {

constexpr int kStages = 4;           // of the collocation
constexpr int kMostIterations = 60;  // of its fixed point
constexpr double kSettled = 1e-15;   // relative
constexpr int kMostSecants = 40;
constexpr double kClosed = 1e-12;

/// Gauss collocation on [0, 1]: weights of ∫₀^{c_i} and of ∫₀¹ of the interpolant at the nodes.
struct Collocation {
  std::array<double, kStages> node{}, weight{};
  std::array<std::array<double, kStages>, kStages> inner{};

  Collocation() {
    const GaussRule& rule = gauss_rule(kStages);
    for (std::size_t i = 0; i < kStages; ++i) {
      node[i] = rule.nodes[i];
      weight[i] = rule.weights[i];
    }
    for (std::size_t i = 0; i < kStages; ++i)
      for (std::size_t j = 0; j < kStages; ++j)
        for (std::size_t g = 0; g < kStages; ++g)
          inner[i][j] += node[i] * weight[g] * lagrange(j, node[i] * node[g]);
  }

 private:
  double lagrange(std::size_t j, double x) const {
    double value = 1.0;
    for (std::size_t m = 0; m < kStages; ++m)
      if (m != j) value *= (x - node[m]) / (node[j] - node[m]);
    return value;
  }
};

/// What the rate of σ is made of at one place.
struct Terms {
  double wanted = 0.0;     ///< −Σ w n a / Σ w n²
  double stiffness = 1.0;  ///< Σ w n²
  double held_cost = 0.0;  ///< Σ w a²
  double cost(double rate) const {
    return held_cost + stiffness * rate * rate - 2.0 * stiffness * wanted * rate;
  }
};

class MinimumNormSolver {
 public:
  MinimumNormSolver(const RedundantPath& path, const MinimumNormSettings& settings)
      : path_(path), settings_(settings) {
    require(settings.weight.size() == settings.near.size() && settings.weight.size() > 0 &&
                settings.weight.minCoeff() > 0.0,
            "a positive weight for every joint");
    require(settings.step > 0.0 && path.last > path.first && path.breaks.size() >= 2,
            "a path with length and a step");
  }

  MinimumNorm run() {
    MinimumNorm out = integrate(0.0);
    if (!out.ok || !settings_.change) return out;
    // Linear in λ where the rate does not depend on σ: then the first step is the answer.
    double before = 0.0;
    double miss_before = *settings_.change - out.change;
    double lambda = miss_before / softness_;
    for (int i = 0; i < kMostSecants; ++i) {
      out = integrate(lambda);
      if (!out.ok) return out;
      const double miss = *settings_.change - out.change;
      if (std::abs(miss) <= kClosed || miss == miss_before) break;
      const double next = lambda + miss * (lambda - before) / (miss_before - miss);
      before = lambda;
      miss_before = miss;
      lambda = next;
    }
    return out;
  }

 private:
  std::optional<Terms> terms(double s, double free) {
    const auto held = path_.jet(s, {free, 0.0, 0.0, 0.0}, near_);
    if (!held) return {};
    const auto moved = path_.jet(s, {free, 1.0, 0.0, 0.0}, held->col(0));
    if (!moved) return {};
    near_ = held->col(0);
    const JointVector a = held->col(1);
    const JointVector n = moved->col(1) - a;
    Terms t;
    double mixed = 0.0;
    t.stiffness = 0.0;
    for (Eigen::Index j = 0; j < a.size(); ++j) {
      t.held_cost += settings_.weight[j] * a[j] * a[j];
      mixed += settings_.weight[j] * n[j] * a[j];
      t.stiffness += settings_.weight[j] * n[j] * n[j];
    }
    if (!(t.stiffness > 0.0)) return {};
    t.wanted = -mixed / t.stiffness;
    return t;
  }

  // ∫ dσ of one step; false: out of reach.
  bool step(double from, double h, double lambda, MinimumNorm& out) {
    const double start = out.free.free.back();
    std::array<double, kStages> rate{};
    rate.fill(out.free.rate.empty() ? 0.0 : out.free.rate.back());
    std::array<Terms, kStages> at;
    for (int iteration = 0; iteration < kMostIterations; ++iteration) {
      double change = 0.0;
      std::array<double, kStages> next{};
      for (std::size_t i = 0; i < kStages; ++i) {
        double free = start;
        for (std::size_t j = 0; j < kStages; ++j) free += h * table_.inner[i][j] * rate[j];
        const auto found = terms(from + h * table_.node[i], free);
        if (!found) {
          out.failed = from + h * table_.node[i];
          return false;
        }
        at[i] = *found;
        next[i] = found->wanted + lambda / found->stiffness;
        change = std::max(change, std::abs(next[i] - rate[i]));
      }
      rate = next;
      if (iteration > 0 && h * change <= kSettled * (1.0 + std::abs(start))) break;
    }
    double total = 0.0;
    for (std::size_t i = 0; i < kStages; ++i) {
      total += h * table_.weight[i] * rate[i];
      out.cost += h * table_.weight[i] * at[i].cost(rate[i]);
      softness_ += h * table_.weight[i] / at[i].stiffness;
    }
    out.free.s.push_back(from + h);
    out.free.free.push_back(start + total);
    return true;
  }

  MinimumNorm integrate(double lambda) {
    MinimumNorm out;
    out.multiplier = lambda;
    softness_ = 0.0;
    near_ = settings_.near;
    out.free.s.push_back(path_.first);
    out.free.free.push_back(settings_.start);
    for (std::size_t b = 1; b < path_.breaks.size(); ++b) {
      const double from = path_.breaks[b - 1];
      const double length = path_.breaks[b] - from;
      if (!(length > 0.0)) continue;
      const int count = std::max(1, static_cast<int>(std::ceil(length / settings_.step - 1e-9)));
      const double h = length / count;
      for (int k = 0; k < count; ++k) {
        const double at = from + h * k;
        if (!step(at, h, lambda, out)) return out;
        // The slope behind the step's start: of this side of a break.
        const std::size_t n = out.free.s.size();
        const auto behind = terms(at + 1e-9 * h, out.free.free[n - 2]);
        if (!behind) {
          out.failed = at;
          return out;
        }
        out.free.rate.push_back(behind->wanted + lambda / behind->stiffness);
      }
      out.free.s.back() = path_.breaks[b];
    }
    const auto end = terms(path_.last, out.free.free.back());
    out.free.rate.push_back(end ? end->wanted + lambda / end->stiffness : out.free.rate.back());
    out.change = out.free.free.back() - settings_.start;
    out.ok = true;
    return out;
  }

  const RedundantPath& path_;
  const MinimumNormSettings& settings_;
  const Collocation table_;
  JointVector near_;
  double softness_ = 0.0;  // ∫ 1/stiffness
};

}  // namespace

int redundant_joint(const ScrewChain& chain) {
  int found = -1;
  for (int j = 0; j < chain.size(); ++j) {
    if (!chain.joints[static_cast<std::size_t>(j)].redundant) continue;
    if (found >= 0) return -1;
    found = j;
  }
  return found;
}

RedundantPath redundant_path(const RotaryPair& pair, const LocationOnPath& location,
                             std::vector<double> breaks) {
  const int joint = redundant_joint(pair.chain());
  require(joint >= 0, "exactly one redundant joint");
  require(breaks.size() >= 2 && std::is_sorted(breaks.begin(), breaks.end()) &&
              breaks.back() > breaks.front(),
          "breaks ascend");
  RedundantPath path;
  path.first = breaks.front();
  path.last = breaks.back();
  path.breaks = std::move(breaks);
  const auto solve = [&pair, joint](const CutterLocation& at, double free,
                                    const JointVector& near) -> std::optional<JointVector> {
    JointVector held = near;
    held[joint] = free;
    const RotaryPairSolutions solutions = pair.solve(at, held);
    std::optional<JointVector> best;
    double least = INFINITY;
    for (std::size_t b = 0; b < 2; ++b) {
      if (!solutions.valid[b]) continue;
      JointVector q = solutions.q[b];
      double distance = 0.0;
      for (const int j : {pair.first_rotary(), pair.second_rotary()}) {
        q[j] += 2.0 * kPi * std::round((near[j] - q[j]) / (2.0 * kPi));
        distance += std::abs(q[j] - near[j]);
      }
      if (distance >= least) continue;
      least = distance;
      best = q;
    }
    return best;
  };
  path.joints = [location, solve](double s, double free, const JointVector& near) {
    const LocationJet at = location(s);
    return solve({at.tip.col(0), at.axis.col(0)}, free, near);
  };
  FreeJoints others{};
  for (std::size_t j = 0; j < pair.chain().joints.size(); ++j)
    others[j] = static_cast<int>(j) != joint;
  path.jet = [&pair, location, solve, joint, others](
                 double s, const Jet& free, const JointVector& near) -> std::optional<JointJet> {
    const LocationJet at = location(s);
    const auto here = solve({at.tip.col(0), at.axis.col(0)}, free[0], near);
    if (!here) return {};
    JointJet q = JointJet::Zero(here->size(), 4);
    q.col(0) = *here;
    for (std::size_t r = 1; r < 4; ++r) q(joint, static_cast<Eigen::Index>(r)) = free[r];
    return joint_jet(pair.chain(), q, others, at);
  };
  return path;
}

double FreeProfile::at(double place) const {
  const auto next = std::upper_bound(s.begin(), s.end(), place);
  const auto i = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(
      next - s.begin() - 1, 0, static_cast<std::ptrdiff_t>(s.size()) - 2));
  const double h = s[i + 1] - s[i];
  if (!(h > 0.0)) return free[i];
  const double t = (place - s[i]) / h;
  // The slope that a cubic through both values has at the end is free: that of the next step's
  // start may belong to another side of a break.
  const double step = free[i + 1] - free[i];
  const double slope = h * rate[i];
  return free[i] + slope * t + (step - slope) * t * t;
}

MinimumNorm minimum_norm(const RedundantPath& path, const MinimumNormSettings& settings) {
  return MinimumNormSolver(path, settings).run();
}

FreeCost free_cost(const RedundantPath& path, const std::function<Jet(double)>& free,
                   const std::vector<double>& places, const JointVector& velocity_weight,
                   const JointVector& jerk_weight, const JointVector& near, int points) {
  const GaussRule& rule = gauss_rule(points);
  FreeCost out;
  out.most_velocity = out.most_acceleration = out.most_jerk = JointVector::Zero(near.size());
  JointVector last = near;
  for (std::size_t i = 1; i < places.size(); ++i) {
    const double h = places[i] - places[i - 1];
    for (std::size_t g = 0; g < static_cast<std::size_t>(points); ++g) {
      const double s = places[i - 1] + h * rule.nodes[g];
      const auto q = path.jet(s, free(s), last);
      if (!q) return out;
      last = q->col(0);
      for (Eigen::Index j = 0; j < near.size(); ++j) {
        out.velocity += h * rule.weights[g] * velocity_weight[j] * (*q)(j, 1) * (*q)(j, 1);
        out.jerk += h * rule.weights[g] * jerk_weight[j] * (*q)(j, 3) * (*q)(j, 3);
      }
      out.most_velocity = out.most_velocity.cwiseMax(q->col(1).cwiseAbs());
      out.most_acceleration = out.most_acceleration.cwiseMax(q->col(2).cwiseAbs());
      out.most_jerk = out.most_jerk.cwiseMax(q->col(3).cwiseAbs());
    }
  }
  out.ok = true;
  return out;
}

}  // namespace smoothpost
