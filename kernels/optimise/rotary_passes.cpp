#include "kernels/optimise/rotary_passes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"
#include "kernels/spline/gauss_rule.h"

namespace smoothpost {

namespace {

constexpr double kStill = 1e-7;  // rad: rotaries of two passes are the same
constexpr double kSameObjective = 1e-5;
// rad-like: half-spaces of a gap farther away than this are left out
constexpr double kNear = 0.15;
constexpr double kDifference = 1e-5;  // rad, for the curvature of the tool axis

// With a law: Gauss points a piece, and the share of the jerk at the mean speed that keeps the
// programme definite where the path hardly moves.
constexpr int kLawPoints = 5;
constexpr double kMeanSpeed = 1e-6;

double finite_or_one(double value) { return std::isfinite(value) ? value : 1.0; }

double limit_of(const RateLimits& limits, int order) {
  if (order == 1) return limits.velocity;
  return order == 2 ? limits.acceleration : limits.jerk;
}

/// The jerk by time as a row, for a limit of size 1.
LocalRow jerk_row(const SplineLayout& layout, int channel, double u, const PathSpeed& speed,
                  double limit) {
  const TimeWeights w = time_weights(speed, 3);
  LocalRow row = local_row(layout, channel, u, 3);
  row.weights = (w.first * local_row(layout, channel, u, 1).weights +
                 w.second * local_row(layout, channel, u, 2).weights + w.third * row.weights) /
                limit;
  return row;
}

double smallest_jerk(const std::array<RateLimits, 2>& limits) {
  return finite_or_one(std::min(limits[0].jerk, limits[1].jerk));
}

/// Places of a Gauss rule over every piece with their weights in ∫ du.
template <class Take>
void for_gauss(const SplineKnots& knots, int points, const Take& take) {
  const GaussRule& rule = gauss_rule(points);
  for (int span = 0; span < knots.spans(); ++span) {
    const std::size_t at = static_cast<std::size_t>(span + knots.degree);
    const double first = knots.values[at], length = knots.values[at + 1] - first;
    for (int g = 0; g < rule.points; ++g)
      take(first + length * rule.nodes[g], length * rule.weights[g]);
  }
}

}  // namespace

std::vector<HalfSpace> half_spaces(const OrientationWindow& w) {
  constexpr int kSides = 16;
  const double lead[] = {std::tan(w.lead_low), std::tan(w.lead_high)};
  const double tilt[] = {std::tan(w.tilt_low), std::tan(w.tilt_high)};
  std::vector<HalfSpace> list;
  list.push_back({(lead[1] * w.normal - w.tangent).normalized(), "lead"});
  list.push_back({(w.tangent - lead[0] * w.normal).normalized(), "lead"});
  list.push_back({(tilt[1] * w.normal - w.binormal).normalized(), "tilt"});
  list.push_back({(w.binormal - tilt[0] * w.normal).normalized(), "tilt"});
  const double reach = std::tan(w.widest) * std::cos(kPi / kSides);
  for (int k = 0; k < kSides; ++k) {
    const double turn = 2.0 * kPi * (k + 0.5) / kSides;
    const double c = std::cos(turn), s = std::sin(turn);
    const double corner = std::max(c * lead[0], c * lead[1]) + std::max(s * tilt[0], s * tilt[1]);
    if (corner > reach)
      list.push_back({(reach * w.normal - c * w.tangent - s * w.binormal).normalized(), "gap"});
  }
  for (const AxisCut& cut : w.cuts) list.push_back({cut.normal, "clearance", cut.least});
  return list;
}

RotaryPasses::RotaryPasses(const RotaryProblem& problem, const RotarySettings& settings)
    : in_(problem), settings_(settings), joints_(problem.held) {
  require(in_.chain != nullptr && in_.held.size() == in_.chain->size(), "a chain and its joints");
  require(in_.knots.degree == 5, "quintic splines");
  require(in_.seed.size() == in_.windows.size(), "a seed for every window");
  at_ = in_.seed;
  pull_.assign(at_.size(), Vec3::Zero());
  if (in_.law) find_law_places();
}

void RotaryPasses::find_law_places() {
  require(in_.law->duration > 0.0 && in_.law->at, "a law with a time");
  require(!in_.monotone, "no law for monotone rotaries");
  fastest_ = 0.0;
  for_gauss(in_.knots, kLawPoints, [&](double u, double weight) {
    const PathSpeed speed = in_.law->at(u);
    require(speed.first > 0.0, "a law that goes on between its ends");
    quadrature_.push_back({u, weight / speed.first, speed});
    fastest_ = std::max(fastest_, speed.first);
  });
}

SplineLayout RotaryPasses::layout_at(double t) const {
  SplineLayout layout = spline_layout(in_.knots, 3, 2);
  for (int c = 0; c < 2; ++c) {
    const RateLimits l =
        slowed(in_.limits[static_cast<std::size_t>(c)], in_.law ? 1.0 / fastest_ : t);
    for (int level = 1; level <= 3; ++level)
      layout.scale(c, level) = finite_or_one(limit_of(l, level));
  }
  return layout;
}

QuadraticProgram RotaryPasses::programme(double t) {
  QuadraticProgram qp = empty_program(layout_at(t));
  add_cost(qp, t);
  add_limits(qp, t);
  if (in_.monotone) add_monotone(qp);
  set_rows(qp, rows(qp.layout));
  for (std::size_t i = 0; i < at_.size(); ++i)
    if (!pull_[i].isZero()) add_curvature(qp, i);
  return qp;
}

// Such that the objective is of the order of 1 when a rotary is at its jerk limit.
void RotaryPasses::add_cost(QuadraticProgram& qp, double t) const {
  if (in_.law) return add_law_cost(qp);
  const double jerk = smallest_jerk(in_.limits) * t * t * t;
  for (int c = 0; c < 2; ++c)
    add_derivative_cost(qp, c, 3, 2.0 / (jerk * jerk * in_.knots.spans()));
}

void RotaryPasses::add_law_cost(QuadraticProgram& qp) const {
  const int local = qp.layout.local_size();
  const double whole = in_.law->duration;
  const double mean = (in_.knots.last() - in_.knots.first()) / whole;
  for (int c = 0; c < 2; ++c) {
    const double jerk = finite_or_one(in_.limits[static_cast<std::size_t>(c)].jerk);
    for (const LawPlace& place : quadrature_) {
      const LocalRow row = jerk_row(qp.layout, c, place.u, place.speed, jerk);
      qp.hessian.middleCols(row.span * local, local) +=
          2.0 * place.time / whole * row.weights * row.weights.transpose();
    }
    add_derivative_cost(qp, c, 3, 2.0 * kMeanSpeed * std::pow(mean, 5) / (jerk * jerk * whole));
  }
}

void RotaryPasses::add_limits(QuadraticProgram& qp, double t) const {
  for (int c = 0; c < 2; ++c) {
    const std::size_t at = static_cast<std::size_t>(c);
    const RateLimits l = slowed(in_.limits[at], t);
    for (int level = 1; level <= 3 && !in_.law; ++level)
      if (std::isfinite(limit_of(l, level))) limit_level(qp, c, level, limit_of(l, level));
    for (int j = 0; j < qp.layout.count(0); ++j) {
      qp.lower[qp.layout.index(c, 0, j)] = in_.lower[at];
      qp.upper[qp.layout.index(c, 0, j)] = in_.upper[at];
    }
    if (in_.rest_at_ends)
      for (const int level : {1, 2})
        for (const int j : {0, qp.layout.count(level) - 1})
          qp.lower[qp.layout.index(c, level, j)] = qp.upper[qp.layout.index(c, level, j)] = 0.0;
  }
}

void RotaryPasses::learn(const QpSolution& solution) {
  std::fill(pull_.begin(), pull_.end(), Vec3::Zero());
  learned_ = solution;
  held_.assign(at_.size(), {});
  other_held_.clear();
  for (std::size_t r = 0; r < window_rows_.size(); ++r) {
    const WindowRow& row = window_rows_[r];
    const auto at = static_cast<Eigen::Index>(r);
    if (row.window < 0) {
      other_held_.push_back({solution.row_lower[at], solution.row_upper[at]});
      continue;
    }
    const auto window = static_cast<std::size_t>(row.window);
    pull_[window] += solution.row_lower[at] * row.normal;
    if (held_[window].size() <= row.side) held_[window].resize(row.side + 1, 0.0);
    held_[window][row.side] = solution.row_lower[at];
  }
}

const QpSolution* RotaryPasses::start() {
  if (!learned_) return nullptr;
  const auto count = static_cast<Eigen::Index>(window_rows_.size());
  learned_->row_lower = learned_->row_upper = Eigen::VectorXd::Zero(count);
  std::size_t other = 0;
  for (Eigen::Index r = 0; r < count; ++r) {
    const WindowRow& row = window_rows_[static_cast<std::size_t>(r)];
    if (row.window < 0) {
      learned_->row_lower[r] = other_held_[other][0];
      learned_->row_upper[r] = other_held_[other++][1];
      continue;
    }
    const std::vector<double>& held = held_[static_cast<std::size_t>(row.window)];
    if (row.side < held.size()) learned_->row_lower[r] = held[row.side];
  }
  return &*learned_;
}

void RotaryPasses::follow(const SplineCurve& q) {
  std::vector<std::array<double, 2>> next(at_.size());
  double worst = 0.0, change = 0.0;
  for (std::size_t i = 0; i < at_.size(); ++i) {
    const Eigen::VectorXd value = q.at(in_.windows[i].u);
    next[i] = {value[0], value[1]};
    change = std::max({change, std::abs(value[0] - at_[i][0]), std::abs(value[1] - at_[i][1])});
    worst = std::max(worst, in_.windows[i].outside(axis_at(next[i])));
  }
  const bool half = passes_ > 0 && worst > 1e-3 && worst > 1.5 * outside_;
  if (half) learned_.reset();
  if (half)
    for (std::size_t i = 0; i < at_.size(); ++i)
      for (std::size_t c = 0; c < 2; ++c) next[i][c] = 0.5 * (next[i][c] + at_[i][c]);
  at_ = std::move(next);
  outside_ = worst;
  change_ = change;
  ++passes_;
}

bool RotaryPasses::settled(double objective) {
  const bool same =
      std::abs(objective - objective_) <= kSameObjective * std::abs(objective) + 1e-12;
  objective_ = objective;
  return outside_ <= kHolds && (change_ <= kStill || same);
}

Vec3 RotaryPasses::axis_at(const std::array<double, 2>& q) const {
  joints_[in_.joints[0]] = q[0];
  joints_[in_.joints[1]] = q[1];
  return forward_location(*in_.chain, joints_).axis;
}

std::vector<NewRow> RotaryPasses::rows(const SplineLayout& layout) {
  window_rows_.clear();
  for (const RotaryVia& via : in_.via)
    for (int c = 0; c < 2; ++c) {
      const double value = via.q[static_cast<std::size_t>(c)];
      window_rows_.push_back({-1,
                              0,
                              Vec3::Zero(),
                              {local_row(layout, c, via.u, 0), value, value, "via point", via.u}});
    }
  for (std::size_t i = 0; i < in_.windows.size(); ++i) add_window(layout, i);
  std::stable_sort(
      window_rows_.begin(), window_rows_.end(),
      [](const WindowRow& a, const WindowRow& b) { return a.row.row.span < b.row.row.span; });
  std::vector<NewRow> list;
  for (const WindowRow& row : window_rows_) list.push_back(row.row);
  return list;
}

std::array<Vec3, 2> RotaryPasses::slopes_at(const std::array<double, 2>& q) const {
  const Vec3 axis = axis_at(q);
  const Jacobian jac = jacobian(*in_.chain, joints_);
  return {Vec3(jac.col(in_.joints[0]).head<3>()).cross(axis),
          Vec3(jac.col(in_.joints[1]).head<3>()).cross(axis)};
}

// Half-spaces that are far away cannot matter to this pass. Without a law only those of the gap
// are left out, as the seed may be anywhere.
void RotaryPasses::add_window(const SplineLayout& layout, std::size_t i) {
  const OrientationWindow& w = in_.windows[i];
  const Vec3 axis = axis_at(at_[i]);
  const std::array<Vec3, 2> slope = slopes_at(at_[i]);
  const LocalRow first = local_row(layout, 0, w.u, 0);
  const LocalRow second = local_row(layout, 1, w.u, 0);
  const std::vector<HalfSpace> sides = half_spaces(w);
  for (std::size_t side = 0; side < sides.size(); ++side) {
    const HalfSpace& h = sides[side];
    const double slack = h.normal.dot(axis) - h.least;
    if (slack > kNear && (in_.law || h.name == "gap")) continue;
    const double a = h.normal.dot(slope[0]), b = h.normal.dot(slope[1]);
    NewRow row;
    row.row = first;
    row.row.weights = a * first.weights + b * second.weights;
    row.lower = settings_.cone_margin - slack + a * at_[i][0] + b * at_[i][1];
    row.upper = std::numeric_limits<double>::infinity();
    row.name = h.name;
    row.place = w.u;
    window_rows_.push_back({static_cast<int>(i), side, h.normal, std::move(row)});
  }
}

// The Lagrangian's second derivative by the two rotaries at a window, as far as it is convex:
// without it passes swing where the objective is flat.
void RotaryPasses::add_curvature(QuadraticProgram& qp, std::size_t i) const {
  const std::array<Vec3, 2> here = slopes_at(at_[i]);
  Eigen::Matrix2d m;
  for (std::size_t k = 0; k < 2; ++k) {
    std::array<double, 2> moved = at_[i];
    moved[k] += kDifference;
    const std::array<Vec3, 2> there = slopes_at(moved);
    for (std::size_t c = 0; c < 2; ++c)
      m(static_cast<int>(c), static_cast<int>(k)) = -pull_[i].dot(there[c] - here[c]) / kDifference;
  }
  m = 0.5 * (m + m.transpose()).eval();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(m);
  m = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() *
      eigen.eigenvectors().transpose();
  const Eigen::Vector2d at(at_[i][0], at_[i][1]);
  const LocalRow first = local_row(qp.layout, 0, in_.windows[i].u, 0);
  Eigen::MatrixXd weights(first.weights.size(), 2);
  weights << first.weights, local_row(qp.layout, 1, in_.windows[i].u, 0).weights;
  const int local = qp.layout.local_size();
  qp.hessian.middleCols(first.span * local, local) += weights * m * weights.transpose();
  qp.gradient.col(first.span) -= weights * (m * at);
  qp.constant += 0.5 * at.dot(m * at);
}

// Control points of the first derivative that reach between two vias have the sign of the step;
// where it turns around they are 0.
void RotaryPasses::add_monotone(QuadraticProgram& qp) const {
  const std::vector<double>& knots = qp.layout.knots.values;
  for (int c = 0; c < 2; ++c)
    for (int j = 0; j < qp.layout.count(1); ++j) {
      const double first = knots[static_cast<std::size_t>(j + 1)];
      const double last = knots[static_cast<std::size_t>(j + 1 + qp.layout.knots.degree)];
      const int k = qp.layout.index(c, 1, j);
      for (std::size_t v = 1; v < in_.via.size(); ++v) {
        if (in_.via[v].u <= first || in_.via[v - 1].u >= last) continue;
        const double step = in_.via[v].q[static_cast<std::size_t>(c)] -
                            in_.via[v - 1].q[static_cast<std::size_t>(c)];
        if (step >= 0.0) qp.lower[k] = std::max(qp.lower[k], 0.0);
        if (step <= 0.0) qp.upper[k] = std::min(qp.upper[k], 0.0);
      }
    }
}

double rotary_objective(const RotaryProblem& problem, const SplineCurve& q) {
  double sum = 0.0;
  if (!problem.law) {
    // Exactly: the integrand has degree 4.
    for_gauss(q.knots, 3,
              [&](double u, double weight) { sum += weight * q.at(u, 3).squaredNorm(); });
    return sum;
  }
  for_gauss(q.knots, kLawPoints, [&](double u, double weight) {
    const PathSpeed speed = problem.law->at(u);
    const TimeWeights w = time_weights(speed, 3);
    const Eigen::VectorXd jerk =
        w.first * q.at(u, 1) + w.second * q.at(u, 2) + w.third * q.at(u, 3);
    for (int c = 0; c < 2; ++c) {
      const double share =
          jerk[c] / finite_or_one(problem.limits[static_cast<std::size_t>(c)].jerk);
      sum += weight / speed.first / problem.law->duration * share * share;
    }
  });
  return sum;
}

}  // namespace smoothpost
