#include "kernels/schedule/feed_solver.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/schedule/band_cholesky.h"
#include "kernels/schedule/feed_passes.h"

namespace smoothpost {
namespace {

constexpr double kToBoundary = 0.99;
constexpr double kStartSlack = 0.02;  // of rows that the start breaks
constexpr double kStartGap = 0.3;     // of T, at least: less hugs the rows far from the optimum

/// The iteration on one grid.
class FeedIteration {
 public:
  FeedIteration(const FeedProgram& program, std::vector<double> start)
      : program_(program), grid_(*program.grid), x_(std::move(start)), dx_(x_.size(), 0.0) {
    const std::size_t points = grid_.points();
    slack_.resize(4 * width() * points);
    multiplier_.resize(4 * width() * points);
    cap_slack_.resize(points);
    cap_multiplier_.resize(points);
    inv_cap_.resize(points);
    weight_.resize(points);
    basis_.resize(12 * points);
    mean_weight_ = grid_.elements.back().end / static_cast<double>(points);
    for_points([&](std::size_t i, std::size_t e, int node) {
      const double f = program_.factors[i].velocity;
      inv_cap_[i] = f * f / grid_.cap[i];
      const FeedElement& element = grid_.elements[e];
      weight_[i] = grid_.rule.weights[node] * (element.end - element.begin) / mean_weight_;
      const double d = grid_.place(element, grid_.rule.nodes[node]) - element.begin;
      const auto& b = grid_.basis[e];
      for (int j = 0; j < 4; ++j) {
        basis_[12 * i + j] = b[j] + d * (b[4 + j] + d * (b[8 + j] + d * b[12 + j]));
        basis_[12 * i + 4 + j] = b[4 + j] + d * (2.0 * b[8 + j] + 3.0 * d * b[12 + j]);
        basis_[12 * i + 8 + j] = 2.0 * b[8 + j] + 6.0 * d * b[12 + j];
      }
    });
  }

  FeedSolution solve(const FeedSolverSettings& settings) {
    begin();
    FeedSolution solution;
    double share = 0.3, before = 0.0;
    const double rows = row_count();
    for (int n = 0;; ++n) {
      solution.iterations = n;
      solution.feasible = lack_ > -1e-8;
      const bool near = gap_ < settings.tolerance * objective_ && solution.feasible;
      const bool rests =
          n > 0 && std::abs(objective_ - before) < 0.03 * settings.tolerance * objective_;
      solution.converged = near && (residual() < 1e-3 || rests);
      if (solution.converged || n >= settings.iterations) break;
      if (program_.going && !(*program_.going)()) break;
      before = objective_;
      FeedStep step;
      step.centre = std::max(share * gap_ / rows, 0.2 * settings.tolerance * objective_ / rows);
      if (!newton(step.centre)) break;
      const FeedFalls falls = largest_falls(step.centre);
      step.primal = std::min(1.0, kToBoundary / std::max(falls.primal, 1e-300));
      step.dual = std::min(1.0, kToBoundary / std::max(falls.dual, 1e-300));
      const double least = std::min(step.primal, step.dual);
      share = least > 0.9    ? 0.05
              : least > 0.7  ? 0.15
              : least > 0.4  ? 0.35
              : least > 0.15 ? 0.6
                             : 0.9;
      advance(step);
    }
    solution.controls = x_;
    solution.time = objective_ * mean_weight_;
    return solution;
  }

  /// Largest ratios at the points of every element.
  std::vector<FeedProgram::Factors> ratios() {
    std::vector<FeedProgram::Factors> worst(grid_.elements.size(), {0.0, 0.0, 0.0});
    std::vector<double> c(4 * width() * grid_.rule.nodes.size());
    for (std::size_t e = 0; e < worst.size(); ++e) {
      element_slacks(grid_.width, rows(e), &x_[e], c.data());
      for (std::size_t node = 0; node < grid_.rule.nodes.size(); ++node)
        add_ratios(e, node, &c[4 * width() * node], worst[e]);
    }
    return worst;
  }

 private:
  std::size_t width() const { return static_cast<std::size_t>(grid_.width); }

  double row_count() const { return static_cast<double>((4 * width() + 1) * grid_.points()); }

  template <class Visit>
  void for_points(const Visit& visit) const {
    const int nodes = grid_.points_per_element();
    std::size_t i = 0;
    for (std::size_t e = 0; e < grid_.elements.size(); ++e)
      for (int node = 0; node < nodes; ++node, ++i) visit(i, e, node);
  }

  double value(std::size_t i, std::size_t e) const {
    const double* m = &basis_[12 * i];
    return m[0] * x_[e] + m[1] * x_[e + 1] + m[2] * x_[e + 2] + m[3] * x_[e + 3];
  }

  ElementRows rows(std::size_t e) {
    const std::size_t i = e * grid_.rule.nodes.size(), lanes = 4 * width() * i;
    return {grid_.points_per_element(),
            &grid_.rows[3 * width() * i],
            &basis_[12 * i],
            &inv_cap_[i],
            &weight_[i],
            &program_.factors[i],
            program_.lanes,
            &slack_[lanes],
            &multiplier_[lanes],
            &cap_slack_[i],
            &cap_multiplier_[i]};
  }

  void add_ratios(std::size_t e, std::size_t node, const double* c,
                  FeedProgram::Factors& most) const {
    const std::size_t i = e * grid_.rule.nodes.size() + node, n = width();
    const double b = value(i, e), root = std::sqrt(b);
    most.velocity = std::max(most.velocity, std::sqrt(b * inv_cap_[i]));
    for (std::size_t l = 0; l < n; ++l) {
      most.acceleration = std::max(most.acceleration, std::abs(c[l] - c[n + l]) * 0.5);
      most.jerk = std::max(most.jerk, std::abs(c[2 * n + l] - c[3 * n + l]) * 0.5 * root);
    }
  }

  /// Slacks at the start, multipliers on the central path by least squares.
  void begin() {
    for_points([&](std::size_t i, std::size_t e, int) {
      const double b = value(i, e);
      require(b > 0.0, "solve_feed: b > 0 at the start");
      cap_slack_[i] = std::max(1.0 - b * inv_cap_[i], kStartSlack);
    });
    for (std::size_t e = 0; e < grid_.elements.size(); ++e)
      element_slacks(grid_.width, rows(e), &x_[e], rows(e).s);
    for (double& s : slack_) s = std::max(s, kStartSlack);
    std::fill(multiplier_.begin(), multiplier_.end(), 0.0);
    std::fill(cap_multiplier_.begin(), cap_multiplier_.end(), 0.0);
    assemble();  // with multipliers 0: dual_ is the gradient, centre_ Σ g/s
    double fit = 0.0, norm = 0.0;
    for (std::size_t k = 0; k < x_.size(); ++k) {
      fit += dual_[k] * centre_[k];
      norm += centre_[k] * centre_[k];
    }
    const double least = kStartGap * objective_ / row_count();
    const double mu = norm > 0.0 ? std::clamp(fit / norm, least, 1e3) : 1.0;
    for (std::size_t k = 0; k < slack_.size(); ++k) multiplier_[k] = mu / slack_[k];
    for (std::size_t i = 0; i < cap_slack_.size(); ++i) cap_multiplier_[i] = mu / cap_slack_[i];
    assemble();
  }

  /// Everything that the Newton system and the stopping test need, at x, s and z.
  void assemble() {
    clear();
    for (std::size_t e = 0; e < grid_.elements.size(); ++e)
      add(e, element_sums(grid_.width, rows(e), {&x_[e], &dx_[e]}));
    hold_fixed();
  }

  void clear() {
    band_.assign(x_.size(), {});
    dual_.assign(x_.size(), 0.0);
    drift_.assign(x_.size(), 0.0);
    centre_.assign(x_.size(), 0.0);
    objective_ = gap_ = lack_ = 0.0;
  }

  void add(std::size_t e, const ElementSums& sums) {
    for (std::size_t j = 0; j < 4; ++j) {
      for (std::size_t k = 0; k <= j; ++k) band_[e + j][j - k] += sums.hessian[4 * k + j];
      dual_[e + j] += sums.dual[j];
      drift_[e + j] += sums.drift[j];
      centre_[e + j] += sums.centre[j];
    }
    objective_ += sums.objective;
    gap_ += sums.gap;
    lack_ = std::min(lack_, sums.lack);
  }

  void hold_fixed() {
    const std::size_t n = x_.size();
    const auto hold = [&](std::size_t k) {
      band_[k] = {1.0, 0.0, 0.0, 0.0};
      for (std::size_t d = 1; d < 4 && k + d < n; ++d) band_[k + d][d] = 0.0;
      dual_[k] = drift_[k] = centre_[k] = 0.0;
    };
    for (int k = 0; k < program_.fixed_first; ++k) hold(k);
    for (int k = 0; k < program_.fixed_last; ++k) hold(n - 1 - k);
  }

  double residual() const {
    double most = 0.0;
    for (double value : dual_) most = std::max(most, std::abs(value));
    return most;
  }

  /// dx; false when the system has no finite solution.
  bool newton(double centre) {
    for (std::size_t k = 0; k < x_.size(); ++k) dx_[k] = drift_[k] + centre * centre_[k];
    if (!factor_band(band_)) return false;
    solve_band(band_, dx_);
    double total = 0.0;
    for (double value : dx_) total += value;
    return std::isfinite(total);
  }

  FeedFalls largest_falls(double centre) {
    FeedFalls worst;
    for (std::size_t e = 0; e < grid_.elements.size(); ++e) {
      const FeedFalls here = element_falls(grid_.width, rows(e), {&x_[e], &dx_[e]}, centre);
      worst = {std::max(worst.primal, here.primal), std::max(worst.dual, here.dual)};
    }
    return worst;
  }

  void advance(const FeedStep& step) {
    clear();
    for (std::size_t e = 0; e < grid_.elements.size(); ++e)
      add(e, element_step(grid_.width, rows(e), {&x_[e], &dx_[e]}, step));
    for (std::size_t k = 0; k < x_.size(); ++k) x_[k] += step.primal * dx_[k];
    hold_fixed();
  }

  const FeedProgram& program_;
  const FeedGrid& grid_;
  std::vector<double> x_, dx_;
  std::vector<double> slack_, multiplier_, cap_slack_, cap_multiplier_;
  std::vector<double> inv_cap_, weight_, basis_;
  double mean_weight_ = 1.0;
  std::vector<BandRow> band_;
  std::vector<double> dual_, drift_, centre_;
  double objective_ = 0.0, gap_ = 0.0, lack_ = 0.0;
};

void check(const FeedProgram& program, const std::vector<double>& controls) {
  require(program.grid && program.lanes && program.grid->width == program.lanes->width,
          "FeedProgram: grid and lanes of one width");
  require(program.factors.size() == program.grid->points(), "FeedProgram: factors of every point");
  require(controls.size() == static_cast<std::size_t>(program.grid->controls()),
          "FeedProgram: controls fit the grid");
}

}  // namespace

FeedSolution solve_feed(const FeedProgram& program, std::vector<double> start,
                        const FeedSolverSettings& settings) {
  check(program, start);
  return FeedIteration(program, std::move(start)).solve(settings);
}

namespace {

std::vector<FeedProgram::Factors> element_ratios(const FeedProgram& program,
                                                 const std::vector<double>& controls) {
  check(program, controls);
  return FeedIteration(program, controls).ratios();
}

}  // namespace

FeedProgram::Factors point_ratios(const FeedProgram& program, const std::vector<double>& controls) {
  FeedProgram::Factors worst{0.0, 0.0, 0.0};
  for (const FeedProgram::Factors& r : element_ratios(program, controls))
    worst = {std::max(worst.velocity, r.velocity), std::max(worst.acceleration, r.acceleration),
             std::max(worst.jerk, r.jerk)};
  return worst;
}

std::vector<double> element_dilations(const FeedProgram& program,
                                      const std::vector<double>& controls) {
  std::vector<double> out;
  for (const FeedProgram::Factors& r : element_ratios(program, controls))
    out.push_back(std::max({r.velocity, std::sqrt(r.acceleration), std::cbrt(r.jerk)}));
  return out;
}

double constant_law(const FeedProgram& program) {
  const FeedGrid& grid = *program.grid;
  const FeedLanes& lanes = *program.lanes;
  const int width = grid.width;
  double least = kNoCap;
  for (std::size_t i = 0; i < grid.points(); ++i) {
    const FeedProgram::Factors& f = program.factors[i];
    const double* q = &grid.rows[3 * static_cast<std::size_t>(width) * i];
    least = std::min(least, grid.cap[i] / (f.velocity * f.velocity));
    for (int l = 0; l < width; ++l) {
      const double a = std::abs(q[width + l]) * lanes.acceleration[l] * f.acceleration;
      const double j = std::abs(q[2 * width + l]) * lanes.jerk[l] * f.jerk;
      if (a > 0.0) least = std::min(least, 1.0 / a);
      if (j > 0.0) least = std::min(least, 1.0 / std::cbrt(j * j));
    }
  }
  return least;
}

}  // namespace smoothpost
