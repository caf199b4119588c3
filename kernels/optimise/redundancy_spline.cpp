#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/core/contract.h"
#include "kernels/optimise/redundancy.h"
#include "kernels/spline/gauss_rule.h"
#include "kernels/spline/spline_jets.h"

namespace smoothpost {

namespace {

constexpr int kPoints = 4;              // Gauss points a piece
constexpr double kDifference = 1e-4;    // rad or mm, of σ and σ'
constexpr double kNearLimit = 0.5;      // share of a limit from which on it is a row
constexpr double kNearPosition = 0.35;  // rad or, times 100, mm: likewise
constexpr double kSettled = 1e-4;       // relative decrease of the objective
constexpr int kMostHalvings = 6;
constexpr double kFitCurve = 1e-9;  // weight of ∫ σ'''² in the fit of the seed
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// What the joints' derivatives of orders 0 … 3 are at a place, and by σ … σ''' (order r by the
/// k-th: by[r].col(k)).
struct Linear {
  JointJet q;
  std::array<Eigen::Matrix<double, Eigen::Dynamic, 4, 0, kMaxJoints, 4>, 4> by;
};

class SplineSearch {
 public:
  SplineSearch(const RedundantPath& path, const FreeProfile& seed, const JointVector& near,
               const SmoothFreeSettings& settings)
      : path_(path), seed_(seed), near_(near), settings_(settings) {
    const Eigen::Index n = near.size();
    require(settings.velocity_weight.size() == n && settings.jerk_weight.size() == n &&
                settings.lower.size() == n && settings.upper.size() == n &&
                (settings.limits.empty() || settings.limits.size() == static_cast<std::size_t>(n)),
            "one weight and limit a joint");
    require(settings.spacing > 0.0 && settings.least_spacing > 0.0 && seed.s.size() >= 2,
            "a seed and a spacing");
    make_knots();
  }

  SmoothFree run() {
    SmoothFree out;
    out.scale = scale_;
    out.first = path_.first;
    if (!fit_seed(out)) return out;
    out.before = cost_of(out.free);
    out.after = out.before;
    if (!out.before.ok) return out;
    out.ok = true;
    start_ = out.free.at(0.0)[0];
    end_ = out.free.at(knots_.last())[0];
    const double unit = std::max(merit(out.before), 1e-300);
    for (int pass = 0; pass < settings_.most_passes; ++pass) {
      const auto linear = linearise(out.free);
      if (linear.empty()) break;
      QpSolution solution =
          solve_qp(programme(linear, out.free, out.after, unit), settings_.solver);
      const bool usable =
          solution.status == QpStatus::optimal ||
          (solution.certificate.violation < 1e-6 && solution.certificate.kkt() < 1e-4);
      if (!usable) break;
      const Eigen::MatrixXd step =
          controls_of(spline_layout(knots_, 3, 1), solution.x) - out.free.controls;
      ++out.passes;
      const double before = merit(out.after);
      if (!take(step, linear, out)) break;
      out.solution = std::move(solution);
      if (before - merit(out.after) < kSettled * before) break;
    }
    return out;
  }

 private:
  double u_of(double s) const { return (s - path_.first) / scale_; }
  double s_of(double u) const { return path_.first + scale_ * u; }

  void make_knots() {
    std::vector<double> places{path_.first};
    for (const double b : path_.breaks) {
      const double gap = b - places.back();
      const bool last = b == path_.breaks.back();
      if (gap <= 0.0 ||
          (!last && (gap < settings_.least_spacing || path_.last - b < settings_.least_spacing)))
        continue;
      const int count = std::max(1, static_cast<int>(std::ceil(gap / settings_.spacing - 1e-9)));
      const double from = places.back();
      for (int k = 1; k <= count; ++k) places.push_back(k == count ? b : from + gap * k / count);
    }
    scale_ = (path_.last - path_.first) / static_cast<double>(places.size() - 1);
    knots_.degree = 5;
    knots_.values.assign(5, 0.0);
    for (const double s : places) knots_.values.push_back(u_of(s));
    knots_.values.insert(knots_.values.end(), 5, knots_.values.back());
    // Gauss points of every piece between two breaks or knots.
    places_ = places;
    for (const double b : path_.breaks) places_.push_back(b);
    std::sort(places_.begin(), places_.end());
    places_.erase(std::unique(places_.begin(), places_.end(),
                              [](double a, double b) { return b - a < 1e-9; }),
                  places_.end());
  }

  Jet jet_of(const SplineJets<1>& free, double s) const {
    const auto jet = free.jet(u_of(s), scale_);
    return {jet(0), jet(1), jet(2), jet(3)};
  }

  FreeCost cost_of(const SplineCurve& free) const {
    const SplineJets<1> jets(free);
    return free_cost(
        path_, [&](double s) { return jet_of(jets, s); }, places_, settings_.velocity_weight,
        settings_.jerk_weight, near_, kPoints);
  }
  double merit(const FreeCost& cost) const {
    return cost.jerk + settings_.velocity_share * cost.velocity;
  }

  void pin_ends(QuadraticProgram& qp, double start, double end) const {
    const int last = qp.layout.count(0) - 1;
    if (settings_.fixed_start) qp.lower[0] = qp.upper[0] = start;
    if (settings_.fixed_end) qp.lower[last] = qp.upper[last] = end;
  }

  /// Adds weight·(row·x − target)².
  static void add_square(QuadraticProgram& qp, const LocalRow& row, double target, double weight) {
    const int local = qp.layout.local_size();
    qp.hessian.middleCols(row.span * local, local) +=
        2.0 * weight * row.weights * row.weights.transpose();
    qp.gradient.col(row.span) -= 2.0 * weight * target * row.weights;
    qp.constant += weight * target * target;
  }

  // The spline nearest to the seed.
  bool fit_seed(SmoothFree& out) const {
    QuadraticProgram qp = empty_program(spline_layout(knots_, 3, 1));
    add_derivative_cost(qp, 0, 3, kFitCurve);
    const GaussRule& rule = gauss_rule(kPoints);
    for (std::size_t i = 1; i < places_.size(); ++i)
      for (std::size_t g = 0; g < kPoints; ++g) {
        const double h = places_[i] - places_[i - 1];
        const double s = places_[i - 1] + h * rule.nodes[g];
        add_square(qp, local_row(qp.layout, 0, u_of(s), 0), seed_.at(s),
                   h / scale_ * rule.weights[g]);
      }
    pin_ends(qp, seed_.at(path_.first), seed_.at(path_.last));
    const QpSolution fitted = solve_qp(qp, settings_.solver);
    if (fitted.status != QpStatus::optimal && !(fitted.certificate.kkt() < 1e-5)) return false;
    out.free = {knots_, controls_of(qp.layout, fitted.x)};
    return true;
  }

  // With q = F(s, σ):  q' = ... + F_σ·σ',  q'' = ... + F_σ·σ'',  and q''' = ... + 3·N·σ'' +
  // F_σ·σ''' with N = F_sσ + F_σσ·σ', which also is what q' changes by with σ, and half of what q''
  // does with σ'. So a step of σ'' alone, in which all is linear, tells all but three columns.
  std::optional<Linear> linear_at(double s, const Jet& free, const JointVector& last) const {
    Linear out;
    const auto q = path_.jet(s, free, last);
    if (!q) return {};
    out.q = *q;
    const auto moved = [&](std::size_t k, double step) -> std::optional<JointJet> {
      Jet there = free;
      there[k] += step;
      auto jet = path_.jet(s, there, q->col(0));
      if (jet) *jet = (*jet - *q) / step;
      return jet;
    };
    const auto by_second = moved(2, 1.0);
    const auto by_first = moved(1, kDifference);
    const auto by_value = moved(0, kDifference);
    if (!by_second || !by_first || !by_value) return {};
    for (auto& m : out.by) m.setZero(q->rows(), 4);
    for (std::size_t r = 0; r < 4; ++r)
      out.by[r].col(static_cast<Eigen::Index>(r)) = by_second->col(2);
    out.by[1].col(0) = by_second->col(3) / 3.0;
    out.by[2].col(1) = by_second->col(3) * (2.0 / 3.0);
    out.by[3].col(2) = by_second->col(3);
    out.by[3].col(1) = by_first->col(3);
    out.by[2].col(0) = by_value->col(2);
    out.by[3].col(0) = by_value->col(3);
    return out;
  }

  std::vector<Linear> linearise(const SplineCurve& free) const {
    const GaussRule& rule = gauss_rule(kPoints);
    const SplineJets<1> jets(free);
    std::vector<Linear> out;
    JointVector last = near_;
    for (std::size_t i = 1; i < places_.size(); ++i)
      for (std::size_t g = 0; g < kPoints; ++g) {
        const double s = places_[i - 1] + (places_[i] - places_[i - 1]) * rule.nodes[g];
        auto here = linear_at(s, jet_of(jets, s), last);
        if (!here) return {};
        last = here->q.col(0);
        out.push_back(std::move(*here));
      }
    return out;
  }

  double limit_of(std::size_t joint, int order) const {
    const RateLimits& l = settings_.limits[joint];
    return order == 1 ? l.velocity : order == 2 ? l.acceleration : l.jerk;
  }

  /// The programme in σ itself about `free`.
  QuadraticProgram programme(const std::vector<Linear>& linear, const SplineCurve& free,
                             const FreeCost& now, double unit) const {
    QuadraticProgram qp = empty_program(spline_layout(knots_, 3, 1));
    add_derivative_cost(qp, 0, 3, 1e-9);
    for (int j = 0; j < qp.layout.count(0); ++j) {
      const double at = free.controls(0, j);
      qp.lower[j] = std::min(at, std::max(settings_.free_lower, at - settings_.trust));
      qp.upper[j] = std::max(at, std::min(settings_.free_upper, at + settings_.trust));
    }
    pin_ends(qp, start_, end_);
    const GaussRule& rule = gauss_rule(kPoints);
    const SplineJets<1> jets(free);
    std::vector<NewRow> rows;
    std::size_t place = 0;
    for (std::size_t i = 1; i < places_.size(); ++i)
      for (std::size_t g = 0; g < kPoints; ++g, ++place) {
        const double h = places_[i] - places_[i - 1];
        const double s = places_[i - 1] + h * rule.nodes[g];
        add_place(qp, linear[place], jet_of(jets, s), s, h * rule.weights[g] / unit, now, rows);
      }
    set_rows(qp, rows);
    return qp;
  }

  void add_place(QuadraticProgram& qp, const Linear& linear, const Jet& free, double s,
                 double share, const FreeCost& now, std::vector<NewRow>& rows) const {
    std::array<LocalRow, 4> derivative;
    double factor = 1.0;
    for (int r = 0; r < 4; ++r, factor /= scale_) {
      derivative[static_cast<std::size_t>(r)] = local_row(qp.layout, 0, u_of(s), r);
      derivative[static_cast<std::size_t>(r)].weights *= factor;
    }
    // q^(r) = value + Σ by_k (σ^(k) − σ_k): row·x + rest.
    const auto row_of = [&](int joint, std::size_t order, double& rest) {
      LocalRow row{derivative[0].span, Eigen::VectorXd::Zero(qp.layout.local_size())};
      rest = linear.q(joint, static_cast<Eigen::Index>(order));
      for (std::size_t k = 0; k <= order; ++k) {
        const double by = linear.by[order](joint, static_cast<Eigen::Index>(k));
        row.weights += by * derivative[k].weights;
        rest -= by * free[k];
      }
      return row;
    };
    for (int j = 0; j < linear.q.rows(); ++j) {
      double rest = 0.0;
      const LocalRow jerk = row_of(j, 3, rest);
      add_square(qp, jerk, -rest, share * settings_.jerk_weight[j]);
      if (settings_.velocity_share > 0.0) {
        const LocalRow velocity = row_of(j, 1, rest);
        add_square(qp, velocity, -rest,
                   share * settings_.velocity_share * settings_.velocity_weight[j]);
      }
      const double q = linear.q(j, 0);
      const double by = std::max(std::abs(linear.by[0](j, 0)), 1e-12);
      if (std::min(q - settings_.lower[j], settings_.upper[j] - q) < kNearPosition * by) {
        const LocalRow position = row_of(j, 0, rest);
        rows.push_back({{position.span, position.weights / by},
                        (std::min(settings_.lower[j], q) - rest) / by,
                        (std::max(settings_.upper[j], q) - rest) / by,
                        "position",
                        u_of(s)});
      }
      for (int order = 1; order <= 3 && !settings_.limits.empty(); ++order) {
        const FreeCost& n = now;
        const double most = order == 1   ? n.most_velocity[j]
                            : order == 2 ? n.most_acceleration[j]
                                         : n.most_jerk[j];
        const double limit = std::max(limit_of(static_cast<std::size_t>(j), order), most);
        if (!std::isfinite(limit) || !(limit > 0.0) ||
            std::abs(linear.q(j, order)) < kNearLimit * limit)
          continue;
        const LocalRow rate = row_of(j, static_cast<std::size_t>(order), rest);
        rows.push_back({{rate.span, rate.weights / limit},
                        -1.0 - rest / limit,
                        1.0 - rest / limit,
                        order == 1   ? "velocity"
                        : order == 2 ? "acceleration"
                                     : "jerk",
                        u_of(s)});
      }
    }
  }

  // Joints inside their positions, or no further outside than the linearised ones were.
  bool positions_hold(const SplineCurve& free, const std::vector<Linear>& before) const {
    const std::vector<Linear>& b = before;
    const SplineJets<1> jets(free);
    const GaussRule& rule = gauss_rule(kPoints);
    JointVector last = near_;
    std::size_t place = 0;
    for (std::size_t i = 1; i < places_.size(); ++i)
      for (std::size_t g = 0; g < kPoints; ++g, ++place) {
        const double s = places_[i - 1] + (places_[i] - places_[i - 1]) * rule.nodes[g];
        const auto q = path_.joints(s, jet_of(jets, s)[0], last);
        if (!q) return false;
        last = *q;
        for (Eigen::Index j = 0; j < q->size(); ++j) {
          const double was = b[place].q(j, 0);
          if ((*q)[j] < std::min(settings_.lower[j], was) - 1e-9 ||
              (*q)[j] > std::max(settings_.upper[j], was) + 1e-9)
            return false;
        }
      }
    return true;
  }

  bool rates_hold(const FreeCost& cost, const FreeCost& before) const {
    const auto holds = [](double value, double limit, double was) {
      return value <= std::max(limit, was) * (1.0 + 1e-6);
    };
    for (std::size_t j = 0; j < settings_.limits.size(); ++j) {
      const auto i = static_cast<Eigen::Index>(j);
      const RateLimits& l = settings_.limits[j];
      if (!holds(cost.most_velocity[i], l.velocity, before.most_velocity[i]) ||
          !holds(cost.most_acceleration[i], l.acceleration, before.most_acceleration[i]) ||
          !holds(cost.most_jerk[i], l.jerk, before.most_jerk[i]))
        return false;
    }
    return true;
  }

  // The longest of the step, half of it … that lowers the objective and keeps the limits.
  bool take(const Eigen::MatrixXd& step, const std::vector<Linear>& linear, SmoothFree& out) const {
    double share = 1.0;
    for (int halving = 0; halving < kMostHalvings; ++halving, share *= 0.5) {
      SplineCurve next{knots_, out.free.controls + share * step};
      if (!positions_hold(next, linear)) continue;
      FreeCost cost = cost_of(next);
      if (!cost.ok || merit(cost) >= merit(out.after) || !rates_hold(cost, out.after)) continue;
      out.free = std::move(next);
      out.after = std::move(cost);
      return true;
    }
    return false;
  }

  const RedundantPath& path_;
  const FreeProfile& seed_;
  const JointVector& near_;
  const SmoothFreeSettings& settings_;
  SplineKnots knots_;
  double scale_ = 1.0;
  double start_ = 0.0, end_ = 0.0;
  std::vector<double> places_;
};

}  // namespace

Jet SmoothFree::jet(double s) const {
  const double u = std::clamp((s - first) / scale, 0.0, free.knots.last());
  Jet out;
  double factor = 1.0;
  for (int r = 0; r < 4; ++r, factor /= scale)
    out[static_cast<std::size_t>(r)] = factor * free.at(u, r)[0];
  return out;
}

SmoothFree smooth_free(const RedundantPath& path, const FreeProfile& seed, const JointVector& near,
                       const SmoothFreeSettings& settings) {
  return SplineSearch(path, seed, near, settings).run();
}

}  // namespace smoothpost
