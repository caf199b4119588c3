#include "kernels/optimise/spin.h"

#include <nlopt.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"

namespace smoothpost {

namespace {

constexpr double kJerkWeight = 0.05;
constexpr double kFirstStep = 0.25;  // rad, of the search

/// The basis functions of a degree ≤ 5 that are not 0 on a span, at share t of it.
std::array<double, 6> uniform_basis(double t, int degree) {
  std::array<double, 6> b{1.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  // De Boor's recurrence on unit spans.
  for (int order = 1; order <= degree; ++order) {
    std::array<double, 6> next{};
    for (int i = 0; i < order; ++i) {
      const double left = (t + order - 1 - i) / order;
      next[static_cast<std::size_t>(i)] += (1.0 - left) * b[static_cast<std::size_t>(i)];
      next[static_cast<std::size_t>(i) + 1] += left * b[static_cast<std::size_t>(i)];
    }
    b = next;
  }
  return b;
}

struct Place {
  std::size_t span = 0;
  double t = 0.0;
};

Place place_of(double x, double length, std::size_t coefficients) {
  const double spans = static_cast<double>(coefficients) - 5.0;
  const double at = std::clamp(x / length, 0.0, 1.0) * spans;
  const double first = std::min(std::floor(at), spans - 1.0);
  return {static_cast<std::size_t>(first), at - first};
}

/// One branch along the points.
struct Walk {
  double margin = 1.0;
  std::size_t missing = 0;
  double jerk = 0.0;
  std::size_t jerks = 0;
  std::array<JointVector, 4> q;
  std::array<double, 4> x{};
  int known = 0;
};

double range_margin(const ScrewChain& chain, const JointVector& q) {
  double least = 1.0;
  for (int j = 0; j < 6; ++j) {
    const ChainJoint& joint = chain.joints[static_cast<std::size_t>(j)];
    const double half = 0.5 * (joint.upper - joint.lower);
    least = std::min(least, 1.0 - std::abs(q[j] - 0.5 * (joint.upper + joint.lower)) / half);
  }
  return least;
}

void keep_turns(const ScrewChain& chain, const Walk& walk, JointVector& q) {
  for (int j = 0; j < 6; ++j) {
    const ChainJoint& joint = chain.joints[static_cast<std::size_t>(j)];
    const double near = walk.known > 0 ? walk.q[0][j] : 0.5 * (joint.lower + joint.upper);
    q[j] += 2.0 * kPi * std::round((near - q[j]) / (2.0 * kPi));
  }
}

void step(const ScrewChain& chain, const ArmReach& reach, JointVector q, double x, Walk& walk) {
  keep_turns(chain, walk, q);
  walk.margin = std::min({walk.margin, range_margin(chain, q), reach.singular(q)});
  if (walk.known > 0 && x - walk.x[0] < 1e-9) return;
  for (std::size_t k = 3; k > 0; --k) {
    walk.q[k] = walk.q[k - 1];
    walk.x[k] = walk.x[k - 1];
  }
  walk.q[0] = q;
  walk.x[0] = x;
  walk.known = std::min(walk.known + 1, 4);
  if (walk.known < 4) return;
  // 3! times the third divided difference.
  JointVector third = JointVector::Zero(6);
  for (std::size_t i = 0; i < 4; ++i) {
    double weight = 6.0;
    for (std::size_t k = 0; k < 4; ++k)
      if (k != i) weight /= walk.x[i] - walk.x[k];
    third += weight * walk.q[i];
  }
  walk.jerk += third.squaredNorm();
  ++walk.jerks;
}

struct Search {
  const SixR& arm;
  const std::vector<SpinPoint>& points;
  double length;
  double jerk_before;
  int evaluations = 0;

  double cost(const SpinMeasure& m) const {
    return -m.margin + kJerkWeight * std::log10(1.0 + m.jerk / jerk_before);
  }
};

double objective(unsigned n, const double* c, double* /*gradient*/, void* data) {
  auto& search = *static_cast<Search*>(data);
  ++search.evaluations;
  return search.cost(measure_spin(search.arm, search.points,
                                  SpinProfile(std::vector<double>(c, c + n), search.length)));
}

}  // namespace

SpinProfile::SpinProfile(std::vector<double> coefficients, double length)
    : coefficients_(std::move(coefficients)), length_(length) {
  require(coefficients_.size() == 1 || coefficients_.size() >= 6,
          "spin: one coefficient or at least six");
  require(length_ > 0.0, "spin: a length above 0");
}

double SpinProfile::at(double x) const {
  if (coefficients_.size() == 1) return coefficients_.front();
  const Place place = place_of(x, length_, coefficients_.size());
  const auto b = uniform_basis(place.t, 5);
  double value = 0.0;
  for (std::size_t i = 0; i < 6; ++i) value += b[i] * coefficients_[place.span + i];
  return value;
}

Jet SpinProfile::jet(double x) const {
  Jet out{at(x), 0.0, 0.0, 0.0};
  if (coefficients_.size() == 1 || x < 0.0 || x > length_) return out;
  const Place place = place_of(x, length_, coefficients_.size());
  const double spans_per_mm = (static_cast<double>(coefficients_.size()) - 5.0) / length_;
  std::array<double, 6> c{};
  for (std::size_t i = 0; i < 6; ++i) c[i] = coefficients_[place.span + i];
  double scale = 1.0;
  for (std::size_t r = 1; r < 4; ++r) {
    scale *= spans_per_mm;
    const auto b = uniform_basis(place.t, 5 - static_cast<int>(r));
    for (std::size_t i = 0; i + r < 6; ++i) {
      c[i] = c[i + 1] - c[i];
      out[r] += scale * b[i] * c[i];
    }
  }
  return out;
}

SpinMeasure measure_spin(const SixR& arm, const std::vector<SpinPoint>& points,
                         const SpinProfile& profile) {
  const ArmReach reach(arm);
  const ScrewChain& chain = arm.chain();
  std::array<Walk, 8> walks;
  for (const SpinPoint& point : points) {
    Pose tool = point.tool;
    tool.linear() = tool.linear() * rotation_about(chain.tool_axis, profile.at(point.length));
    const SixRSolutions solved = arm.solve(tool);
    for (std::size_t b = 0; b < 8; ++b) {
      if (!point.cut) walks[b].known = 0;
      if (solved.valid[b])
        step(chain, reach, solved.q[b], point.length, walks[b]);
      else
        ++walks[b].missing;
    }
  }
  SpinMeasure best;
  best.margin = -INFINITY;
  for (const Walk& walk : walks) {
    SpinMeasure m;
    m.margin = walk.missing == 0
                   ? walk.margin
                   : std::min(walk.margin, 0.0) -
                         static_cast<double>(walk.missing) / static_cast<double>(points.size());
    m.jerk = walk.jerks > 0 ? std::sqrt(walk.jerk / static_cast<double>(walk.jerks)) : 0.0;
    if (m.margin > best.margin) best = m;
  }
  return best;
}

SpinResult optimise_spin(const SixR& arm, const std::vector<SpinPoint>& points, double start,
                         int coefficients, int evaluations) {
  require(!points.empty() && coefficients >= 6 && evaluations > 0,
          "spin: points, six coefficients, an evaluation");
  const double length = std::max(points.back().length, 1e-9);
  const auto n = static_cast<unsigned>(coefficients);
  std::vector<double> c(n, start);
  SpinResult result;
  result.profile = SpinProfile(c, length);
  result.before = result.after = measure_spin(arm, points, result.profile);
  Search search{arm, points, length, std::max(result.before.jerk, 1e-12)};
  nlopt_opt opt = nlopt_create(NLOPT_LN_SBPLX, n);
  nlopt_set_min_objective(opt, &objective, &search);
  nlopt_set_initial_step1(opt, kFirstStep);
  nlopt_set_maxeval(opt, evaluations);
  nlopt_set_xtol_abs1(opt, 1e-3);
  double value = 0.0;
  nlopt_optimize(opt, c.data(), &value);
  nlopt_destroy(opt);
  result.evaluations = search.evaluations;
  SpinProfile found(c, length);
  const SpinMeasure after = measure_spin(arm, points, found);
  // The jerk's share must not buy margin away.
  if (search.cost(after) < search.cost(result.before) && after.margin >= result.before.margin) {
    result.profile = std::move(found);
    result.after = after;
  }
  return result;
}

SpinProfile spin_near(const std::vector<double>& lengths, const std::vector<double>& angles,
                      int coefficients) {
  require(!lengths.empty() && lengths.size() == angles.size() && coefficients >= 6,
          "spin: an angle for each length, six coefficients");
  const auto n = static_cast<std::size_t>(coefficients);
  const double length = std::max(lengths.back(), 1e-9);
  std::vector<double> sum(n, 0.0), weight(n, 0.0);
  for (std::size_t k = 0; k < lengths.size(); ++k) {
    const Place place = place_of(lengths[k], length, n);
    const auto b = uniform_basis(place.t, 5);
    // A point stands for the way around it.
    const double before = k > 0 ? lengths[k] - lengths[k - 1] : 0.0;
    const double behind = k + 1 < lengths.size() ? lengths[k + 1] - lengths[k] : 0.0;
    const double way = before + behind + 1e-12 * length;
    for (std::size_t i = 0; i < 6; ++i) {
      sum[place.span + i] += way * b[i] * angles[k];
      weight[place.span + i] += way * b[i];
    }
  }
  std::vector<double> c(n, angles.front());
  for (std::size_t i = 0; i < n; ++i) {
    if (weight[i] > 0.0)
      c[i] = sum[i] / weight[i];
    else if (i > 0)
      c[i] = c[i - 1];
  }
  return SpinProfile(std::move(c), length);
}

}  // namespace smoothpost
