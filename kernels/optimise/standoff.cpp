#include "kernels/optimise/standoff.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "kernels/core/contract.h"
#include "kernels/qp/hybrid_solver.h"
#include "kernels/spline/gauss_rule.h"

namespace smoothpost {
namespace {

constexpr int kDegree = 5;
constexpr int kLevels = 3;
constexpr int kGaussPoints = 5;
constexpr double kBinomial[4][4] = {{1, 0, 0, 0}, {1, 1, 0, 0}, {1, 2, 1, 0}, {1, 3, 3, 1}};
// How many times the linears' jerk that of q6 is taken to be, for the size of the variables.
constexpr double kJerks = 10.0;
constexpr double kTiny = 1e-300;
// The objective is divided by the held standoff's, but by no less than this share of what a jerk
// of the size of the variables would make: a straight path has 0.
constexpr double kLeastObjective = 1e-6;
// The time factor is known when its bracket is this narrow, or after so many programmes.
constexpr double kTimeAccuracy = 5e-5;
constexpr int kMaxSolves = 20;
// A least τ above this is no rounding: the limits are too narrow.
constexpr double kFeasible = 1e-8;
// Places a piece where the linears are looked at between the rows, how far a limit may be exceeded
// there, by how much more than the excess it is narrowed, and how often.
constexpr int kBetween = 12;
constexpr double kExceeded = 1e-9;
constexpr double kTighter = 2e-4;
constexpr int kMostTightenings = 3;

constexpr std::string_view kRowNames[3][3] = {
    {"velocity of the first linear", "acceleration of the first linear",
     "jerk of the first linear"},
    {"velocity of the second linear", "acceleration of the second linear",
     "jerk of the second linear"},
    {"velocity of the third linear", "acceleration of the third linear",
     "jerk of the third linear"}};

constexpr std::string_view kBoundName = "clearance";

double limit_of(const RateLimits& limits, int order) {
  if (order == 1) return limits.velocity;
  return order == 2 ? limits.acceleration : limits.jerk;
}

/// The limits when each piece takes t times as long.
RateLimits slowed(const RateLimits& limits, double t) {
  return {limits.velocity * t, limits.acceleration * t * t, limits.jerk * t * t * t};
}

StandoffOptions slowed(StandoffOptions settings, double t) {
  settings.standoff = slowed(settings.standoff, t);
  for (RateLimits& limits : settings.linear) limits = slowed(limits, t);
  return settings;
}

/// A place of the path with the linears as functions of what q6 is off the middle of its range.
struct Place {
  double u = 0.0;
  double weight = 0.0;  ///< of the quadrature
  LinearsByStandoff linears;
  PathSpeed speed = {};  ///< of the law; without one derivatives by time are those by u
};

/// What does not change with the limits.
struct Task {
  SplineKnots knots;
  double middle = 0.0;
  double half = 0.0;
  std::vector<Place> quadrature;
  std::vector<Place> row_places;
  double held_jerk = 0.0;  ///< Σ ∫ (q_i''')² du with q6 in the middle; with a law by time
  double fastest = 1.0;    ///< du/dt
  double time = 0.0;       ///< the length without a law

  double length() const { return knots.last() - knots.first(); }
};

Place place_at(const HeadGeometry& head, const SplineCurve& tip, const SplineCurve& rotary,
               double u) {
  VectorJet tip_jet;
  Jet q4;
  Jet q5;
  for (int r = 0; r < 4; ++r) {
    tip_jet.col(r) = tip.at(u, r);
    const Eigen::VectorXd angles = rotary.at(u, r);
    q4[r] = angles[0];
    q5[r] = angles[1];
  }
  return {u, 0.0, linears_by_standoff(head, tip_jet, q4, q5)};
}

/// Weights of the derivatives by u, orders 1 to 3, in that by time of an order.
std::array<double, 3> time_weights_of(const Place& place, int order) {
  const TimeWeights w = time_weights(place.speed, order);
  return {w.first, w.second, w.third};
}

/// The derivative by time of that order of the linears with q6 in the middle.
Vec3 held_motion(const Place& place, int order) {
  const auto weights = time_weights_of(place, order);
  Vec3 motion = Vec3::Zero();
  for (int n = 1; n <= order; ++n)
    if (weights[n - 1] != 0.0) motion += weights[n - 1] * place.linears.a.col(n);
  return motion;
}

void check(const SplineCurve& tip, const SplineCurve& rotary, const StandoffOptions& settings) {
  require(tip.controls.rows() == 3 && rotary.controls.rows() == 2,
          "optimise_standoff: a tip of 3 components, 2 rotaries");
  require(rotary.knots.degree == kDegree, "optimise_standoff: quintic rotaries");
  require(tip.knots.first() == rotary.knots.first() && tip.knots.last() == rotary.knots.last(),
          "optimise_standoff: tip and rotaries over the same range");
  require(settings.lower < settings.upper, "optimise_standoff: a range of the standoff");
  require(settings.rows_per_span >= 1, "optimise_standoff: at least one place a piece");
  require(settings.regularisation >= 0.0 && settings.pull >= 0.0,
          "optimise_standoff: weights that are not negative");
  for (int order = 1; order <= kLevels; ++order) {
    require(limit_of(settings.standoff, order) > 0.0, "optimise_standoff: positive limits");
    for (const RateLimits& limits : settings.linear)
      require(limit_of(limits, order) > 0.0, "optimise_standoff: positive limits");
  }
  for (const StandoffBound& bound : settings.bounds)
    require(
        bound.lower <= bound.upper && tip.knots.first() <= bound.u && bound.u <= tip.knots.last(),
        "optimise_standoff: bounds on the path that are not crossed");
  const auto in_range = [&](double q6) { return settings.lower <= q6 && q6 <= settings.upper; };
  require((!settings.fixed_start || in_range(settings.start)) &&
              (!settings.fixed_end || in_range(settings.end)),
          "optimise_standoff: ends in range");
}

Task task_of(const HeadGeometry& head, const SplineCurve& tip, const SplineCurve& rotary,
             const StandoffOptions& settings) {
  check(tip, rotary, settings);
  Task task;
  task.knots = rotary.knots;
  task.middle = 0.5 * (settings.lower + settings.upper);
  task.half = 0.5 * (settings.upper - settings.lower);
  const auto add = [&](std::vector<Place>& places, double u, double weight) {
    places.push_back(place_at(head, tip, rotary, u));
    Place& place = places.back();
    place.weight = weight;
    place.linears.a += task.middle * place.linears.b;
    if (!settings.law) return;
    place.speed = settings.law->at(u);
    require(weight == 0.0 || place.speed.first > 0.0,
            "optimise_standoff: a law that goes on between its ends");
    if (weight > 0.0) place.weight /= place.speed.first;
  };
  const GaussRule& rule = gauss_rule(kGaussPoints);
  for (int span = 0; span < task.knots.spans(); ++span) {
    const double first = task.knots.values[span + kDegree];
    const double length = task.knots.values[span + kDegree + 1] - first;
    for (int g = 0; g < rule.points; ++g)
      add(task.quadrature, first + length * rule.nodes[g], length * rule.weights[g]);
    for (int n = 0; n < settings.rows_per_span && !settings.law; ++n)
      add(task.row_places, first + length * n / settings.rows_per_span, 0.0);
  }
  if (!settings.law) add(task.row_places, task.knots.last(), 0.0);
  task.time = settings.law ? settings.law->duration : task.length();
  if (settings.law) task.fastest = 0.0;
  for (const Place& place : task.quadrature) {
    task.held_jerk += place.weight * held_motion(place, 3).squaredNorm();
    task.fastest = std::max(task.fastest, place.speed.first);
  }
  return task;
}

/// The derivative by time of that order of the linears with q6 = middle + offset.
Vec3 linear_motion(const Place& place, const SplineCurve& offset, int order) {
  Vec3 motion = held_motion(place, order);
  const auto weights = time_weights_of(place, order);
  for (int n = 1; n <= order; ++n) {
    if (weights[n - 1] == 0.0) continue;
    for (int s = 0; s <= n; ++s)
      motion +=
          weights[n - 1] * kBinomial[n][s] * offset.at(place.u, s)[0] * place.linears.b.col(n - s);
  }
  return motion;
}

/// Σ ∫ (q_i''')² du with q6 = middle + offset; with a law by time.
double jerk_integral(const Task& task, const SplineCurve& offset) {
  double sum = 0.0;
  for (const Place& place : task.quadrature)
    sum += place.weight * linear_motion(place, offset, 3).squaredNorm();
  return sum;
}

/// A constant.
SplineCurve held_at(const SplineKnots& knots, double value) {
  return {knots, Eigen::MatrixXd::Constant(1, knots.controls(), value)};
}

/// Weights of the piece's variables in q6 and its derivatives at a place.
struct LocalBasis {
  int span = 0;
  Eigen::Matrix<double, kDegree + 1, 4> weights;  ///< column s: the s-th derivative
};

LocalBasis local_basis(const SplineLayout& layout, double u) {
  LocalBasis basis;
  for (int s = 0; s < 4; ++s) {
    const LocalRow row = local_row(layout, 0, u, s);
    basis.span = row.span;
    basis.weights.col(s) = row.weights;
  }
  return basis;
}

using LinearWeights = Eigen::Matrix<double, kDegree + 1, 3>;

/// Weights of the piece's variables in the derivative by time of that order of the linears
/// (columns).
LinearWeights linear_weights(const LocalBasis& basis, const Place& place, int order) {
  LinearWeights weights = LinearWeights::Zero();
  const auto of = time_weights_of(place, order);
  for (int n = 1; n <= order; ++n) {
    if (of[n - 1] == 0.0) continue;
    for (int s = 0; s <= n; ++s)
      weights += of[n - 1] * kBinomial[n][s] * basis.weights.col(s) *
                 place.linears.b.col(n - s).transpose();
  }
  return weights;
}

/// A derivative's variables are of the size of its limit, or less: of a q6 that goes from one end
/// of its range to the other with kJerks times the jerk that the linears have with it held.
SplineLayout layout_of(const Task& task, const RateLimits& limits) {
  SplineLayout layout = spline_layout(task.knots, kLevels, 1);
  const double rms = std::sqrt(task.held_jerk / task.time) / std::pow(task.fastest, 3);
  const double travel = std::clamp(std::cbrt(task.half / std::max(kJerks * rms, kTiny)),
                                   task.length() / layout.spans(), task.length());
  const RateLimits by_parameter = slowed(limits, 1.0 / task.fastest);
  for (int level = 0; level <= kLevels; ++level) {
    const double size = task.half / std::pow(travel, level);
    layout.scale(0, level) = level == 0 ? size : std::min(limit_of(by_parameter, level), size);
  }
  return layout;
}

/// Places where the limits of the linears are looked at between those of the rows.
std::vector<Place> places_between(const HeadGeometry& head, const SplineCurve& tip,
                                  const SplineCurve& rotary, const Task& task) {
  std::vector<Place> places;
  const int count = kBetween * task.knots.spans();
  for (int k = 0; k <= count; ++k) {
    const double share = static_cast<double>(k) / count;
    places.push_back(
        place_at(head, tip, rotary,
                 k == count ? task.knots.last() : task.knots.first() + share * task.length()));
    places.back().linears.a += task.middle * places.back().linears.b;
  }
  return places;
}

/// The largest magnitude of a curve through equally spaced values, by the parabola at each one.
double peak_of(const std::vector<double>& values) {
  double peak = 0.0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    double here = std::abs(values[k]);
    if (k > 0 && k + 1 < values.size()) {
      const double before = std::copysign(1.0, values[k]) * values[k - 1];
      const double behind = std::copysign(1.0, values[k]) * values[k + 1];
      const double bend = 2.0 * here - before - behind;
      if (here >= before && here >= behind && bend > kTiny)
        here += (behind - before) * (behind - before) / (8.0 * bend);
    }
    peak = std::max(peak, here);
  }
  return peak;
}

double& limit_of(RateLimits& limits, int order) {
  if (order == 1) return limits.velocity;
  return order == 2 ? limits.acceleration : limits.jerk;
}

/// Narrows those limits of the linears in `tight` that a solution exceeds between the rows' places;
/// false: none is exceeded.
bool tighten(const std::vector<Place>& between, const SplineCurve& offset,
             const StandoffOptions& settings, StandoffOptions& tight) {
  std::array<std::array<std::vector<double>, 3>, 3> values;  // of joint and order
  for (const Place& place : between)
    for (int order = 1; order <= 3; ++order) {
      const Vec3 value = linear_motion(place, offset, order);
      for (int i = 0; i < 3; ++i) values[i][order - 1].push_back(value[i]);
    }
  bool exceeded = false;
  for (int i = 0; i < 3; ++i)
    for (int order = 1; order <= 3; ++order) {
      const double ratio =
          peak_of(values[i][order - 1]) / limit_of(std::as_const(settings.linear[i]), order);
      if (ratio <= 1.0 + kExceeded) continue;
      limit_of(tight.linear[i], order) /= ratio * (1.0 + kTighter);
      exceeded = true;
    }
  return exceeded;
}

/// What the objective is divided by.
double objective_scale(const Task& task, const SplineLayout& layout) {
  const double jerk = layout.scale(0, kLevels) * std::pow(task.fastest, 3);
  return std::max(task.held_jerk, kLeastObjective * jerk * jerk * task.time);
}

void add_objective(QuadraticProgram& qp, const Task& task, const StandoffOptions& settings) {
  const double scale = objective_scale(task, qp.layout);
  for (const Place& place : task.quadrature) {
    const LocalBasis basis = local_basis(qp.layout, place.u);
    const LinearWeights weights = linear_weights(basis, place, 3);
    const Vec3 jerk = held_motion(place, 3);
    const double share = place.weight / scale;
    qp.hessian.middleCols(basis.span * (kDegree + 1), kDegree + 1) +=
        2.0 * share * weights * weights.transpose();
    qp.gradient.col(basis.span) += 2.0 * share * weights * jerk;
    qp.constant += share * jerk.squaredNorm();
  }
  const double mean = task.length() / task.time;  // 1 without a law
  add_derivative_cost(qp, 0, 3, 2.0 * settings.regularisation * std::pow(mean, 5) / scale);
  add_derivative_cost(qp, 0, 0, 2.0 * settings.pull / (task.length() * task.half * task.half));
}

void fix(QuadraticProgram& qp, int level, int j, double value) {
  const int i = qp.layout.index(0, level, j);
  qp.lower[i] = qp.upper[i] = value / qp.layout.scale(0, level);
}

void add_bounds(QuadraticProgram& qp, const Task& task, const StandoffOptions& settings) {
  limit_level(qp, 0, 0, task.half);
  for (int level = 1; level <= kLevels && !settings.law; ++level)
    limit_level(qp, 0, level, limit_of(settings.standoff, level));
  const auto last = [&](int level) { return qp.layout.count(level) - 1; };
  for (int level = 1; settings.rest_at_ends && level <= 2; ++level) {
    fix(qp, level, 0, 0.0);
    fix(qp, level, last(level), 0.0);
  }
  if (settings.fixed_start) fix(qp, 0, 0, settings.start - task.middle);
  if (settings.fixed_end) fix(qp, 0, last(0), settings.end - task.middle);
}

/// Bounds of q6 at places of their own, divided by half the range.
void add_place_rows(std::vector<NewRow>& rows, const SplineLayout& layout, const Task& task,
                    const StandoffOptions& settings) {
  for (const StandoffBound& bound : settings.bounds) {
    LocalRow row = local_row(layout, 0, bound.u, 0);
    row.weights /= task.half;
    rows.push_back({std::move(row), (bound.lower - task.middle) / task.half,
                    (bound.upper - task.middle) / task.half, kBoundName, bound.u});
  }
}

/// Limits of the linears at the places, each divided by the limit; none with a law.
void add_rows(QuadraticProgram& qp, const Task& task, const StandoffOptions& settings) {
  std::vector<NewRow> rows;
  add_place_rows(rows, qp.layout, task, settings);
  for (const Place& place : task.row_places) {
    const LocalBasis basis = local_basis(qp.layout, place.u);
    for (int order = 1; order <= 3; ++order) {
      const LinearWeights weights = linear_weights(basis, place, order);
      const Vec3 of_held = held_motion(place, order);
      for (int i = 0; i < 3; ++i) {
        const double limit = limit_of(settings.linear[i], order);
        if (!std::isfinite(limit)) continue;
        const double held = of_held[i] / limit;
        rows.push_back({{basis.span, weights.col(i) / limit},
                        -1.0 - held,
                        1.0 - held,
                        kRowNames[i][order - 1],
                        place.u});
      }
    }
  }
  set_rows(qp, rows);
}

QuadraticProgram programme(const Task& task, const StandoffOptions& settings) {
  QuadraticProgram qp = empty_program(layout_of(task, settings.standoff));
  add_objective(qp, task, settings);
  add_bounds(qp, task, settings);
  add_rows(qp, task, settings);
  return qp;
}

struct RowLimit {
  int linear = 0;
  int order = 0;
};

/// What a row limits, by its name; nothing for a bound.
std::optional<RowLimit> row_limit(std::string_view name) {
  for (int i = 0; i < 3; ++i)
    for (int order = 1; order <= 3; ++order)
      if (name == kRowNames[i][order - 1]) return RowLimit{i, order};
  return std::nullopt;
}

/// Every limit of the derivative l gives way by l·τ of itself; the range and the ends do not.
Relaxation time_relaxation(const QuadraticProgram& qp, const StandoffOptions& settings) {
  Relaxation relaxation;
  relaxation.bound_weight = Eigen::VectorXd::Zero(qp.layout.size());
  for (int level = 1; level <= kLevels; ++level) {
    const double bound = limit_of(settings.standoff, level) / qp.layout.scale(0, level);
    if (std::isfinite(bound))
      relaxation.bound_weight.segment(qp.layout.index(0, level, 0), qp.layout.count(level))
          .setConstant(level * bound);
  }
  relaxation.bound_weight =
      (qp.lower.array() < qp.upper.array()).select(relaxation.bound_weight, 0.0).eval();
  relaxation.row_weight.resize(qp.row_count());
  for (int n = 0; n < qp.row_count(); ++n) {
    const std::optional<RowLimit> limit = row_limit(qp.row_name[n]);
    relaxation.row_weight[n] = limit ? limit->order : 0;  // bounds at places do not give way
  }
  relaxation.lower = -1.0 / kLevels;
  return relaxation;
}

QpFeasibility ask_feasibility(QuadraticProgram qp, const StandoffOptions& settings) {
  qp.relaxation = time_relaxation(qp, settings);
  QpSettings solver = settings.solver;
  solver.start = nullptr;
  return feasibility(qp, solver);
}

/// An elastic programme that rounding has kept from its full certificate still says its τ well
/// enough.
bool near_enough(const QpSolution& s) {
  return s.status == QpStatus::optimal ||
         (s.certificate.violation < 1e-7 && s.certificate.kkt() < 1e-5);
}

/// Where the time factor lies, as far as the programmes so far say.
struct Bracket {
  double below = 1.0;
  double above = std::numeric_limits<double>::infinity();

  void narrow(double t, double tau) {
    below = std::max(below, t * std::cbrt(std::max(0.0, 1.0 + 3.0 * tau)));
    above = std::max(below, std::min(above, t * (1.0 + tau)));  // they may cross by rounding
  }
  bool narrow_enough() const { return above <= below * (1.0 + kTimeAccuracy); }
  /// The factor if nothing but that derivative counts.
  double guess(double t, double tau, int derivative) const {
    const double l = std::clamp(derivative, 1, kLevels);
    return std::clamp(t * std::pow(std::max(0.0, 1.0 + l * tau), 1.0 / l), below, above);
  }
};

}  // namespace

StandoffResult optimise_standoff(const HeadGeometry& head, const SplineCurve& tip,
                                 const SplineCurve& rotary, const StandoffOptions& settings) {
  const Task task = task_of(head, tip, rotary, settings);
  const std::vector<Place> between = places_between(head, tip, rotary, task);
  QpSettings solver = settings.solver;
  if (settings.hybrid) solver.solver = QpSolver::banded;
  StandoffResult result;
  result.q6 = held_at(task.knots, settings.fixed_start ? settings.start - task.middle : 0.0);
  result.jerk_before = result.jerk_after = jerk_integral(task, result.q6);
  StandoffOptions tight = settings;
  QuadraticProgram qp;
  for (int round = 0;; ++round) {
    qp = programme(task, tight);
    result.solution = solve_qp(qp, solver);
    if (result.solution.status != QpStatus::optimal || settings.law || round == kMostTightenings)
      break;
    if (!tighten(between, {qp.layout.knots, controls_of(qp.layout, result.solution.x)}, settings,
                 tight))
      break;
  }
  if (settings.hybrid && result.solution.status == QpStatus::optimal)
    result.solution = solve_by_hybrid(qp, settings.solver, result.solution);
  result.solution.objective *= objective_scale(task, qp.layout);
  if (result.solution.status == QpStatus::optimal) {
    result.q6.controls = controls_of(qp.layout, result.solution.x);
    result.jerk_after = jerk_integral(task, result.q6);
  } else if (!settings.law) {
    result.feasibility = ask_feasibility(qp, settings);
    if (result.feasibility.shortfall > kFeasible &&
        result.feasibility.solution.status == QpStatus::optimal)
      result.solution.status = QpStatus::infeasible;
  }
  result.q6.controls.array() += task.middle;
  return result;
}

StandoffTimeFactor least_standoff_time(const HeadGeometry& head, const SplineCurve& tip,
                                       const SplineCurve& rotary, const StandoffOptions& settings) {
  require(!settings.law, "least_standoff_time: limits by u");
  const Task task = task_of(head, tip, rotary, settings);
  StandoffTimeFactor out;
  Bracket bracket;
  double t = 1.0;
  while (out.solves < kMaxSolves && !bracket.narrow_enough()) {
    const StandoffOptions slow = slowed(settings, t);
    const QpFeasibility answer = ask_feasibility(programme(task, slow), slow);
    ++out.solves;
    if (!near_enough(answer.solution)) return out;
    if (t == 1.0 && answer.shortfall <= kFeasible) return {true, 1.0, -1, 0, 0.0, out.solves};
    const std::optional<RowLimit> row = row_limit(answer.name);
    out.joint = row ? head.linear[row->linear] : head.standoff;
    out.derivative = row ? row->order : answer.level;
    out.place = answer.place;
    bracket.narrow(t, answer.shortfall);
    t = bracket.guess(t, answer.shortfall, out.derivative);
  }
  out.factor = bracket.above;
  out.found = bracket.narrow_enough();
  return out;
}

}  // namespace smoothpost
