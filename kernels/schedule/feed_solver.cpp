#include "kernels/schedule/feed_solver.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/schedule/band_cholesky.h"

namespace smoothpost {
namespace {

constexpr double kToBoundary = 0.99;
constexpr double kMostFall = 0.9 * kToBoundary;  // of b in one step
constexpr double kLeastSlack = 1e-14;
constexpr double kStartSlack = 0.02;  // of rows that the start breaks
constexpr double kLeastCurvature = 0.05;
constexpr double kStartGap = 0.3;  // of T, at least: less hugs the rows far from the optimum

// The lane loops are compiled twice: with four lanes an instruction where the processor has AVX2,
// the same operations in the same order, so the same bits. Sanitizers do not bear the dispatch.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define SMOOTHPOST_LANES __attribute__((target_clones("avx2", "default")))
#else
#define SMOOTHPOST_LANES
#endif
#define SMOOTHPOST_INLINE inline __attribute__((always_inline))

using Local = std::array<double, 3>;  // b, b', b'' at a point, or their change

/// What the lanes of a point give to the Newton system, summed over lanes. Gradients and Hessian by
/// (b, b', b'').
struct PointSums {
  std::array<double, 6> hessian;  // 00 01 02 11 12 22
  std::array<double, 3> centre, drift, dual;
  double jerk_multipliers, gap, lack;
};

/// One point as the lane loops see it.
struct PointView {
  const double* q;      // rows, 3·width
  const double* inv_a;  // reciprocal limits of the lanes
  const double* inv_j;
  double* s;  // four rows a lane: acc +, acc −, jerk +, jerk −
  double* z;
  double factor_a, factor_j;
};

double slope_of(double b) { return -0.5 / (b * std::sqrt(b)); }  // of b^{−1/2}

/// c(v) of every row of a point.
template <int P>
SMOOTHPOST_INLINE void lane_slacks(const PointView& p, const Local& v, double* __restrict c) {
  const double r = 1.0 / std::sqrt(v[0]);
  for (int l = 0; l < P; ++l) {
    const double ia = p.factor_a * p.inv_a[l], ij = p.factor_j * p.inv_j[l];
    const double a = (p.q[P + l] * v[0] + 0.5 * p.q[l] * v[1]) * ia;
    const double j = (p.q[2 * P + l] * v[0] + 1.5 * p.q[P + l] * v[1] + 0.5 * p.q[l] * v[2]) * ij;
    c[l] = 1.0 - a;
    c[P + l] = 1.0 + a;
    c[2 * P + l] = r - j;
    c[3 * P + l] = r + j;
  }
}

/// ds of every row: g·dx + ρ.
template <int P>
SMOOTHPOST_INLINE void lane_changes(const PointView& p, const Local& v, const Local& dv,
                                    double* __restrict ds) {
  const double r = 1.0 / std::sqrt(v[0]), bend = slope_of(v[0]) * dv[0];
  const Local sum{v[0] + dv[0], v[1] + dv[1], v[2] + dv[2]};
  const double root = r + bend;
  for (int l = 0; l < P; ++l) {
    const double ia = p.factor_a * p.inv_a[l], ij = p.factor_j * p.inv_j[l];
    const double a = (p.q[P + l] * sum[0] + 0.5 * p.q[l] * sum[1]) * ia;
    const double j =
        (p.q[2 * P + l] * sum[0] + 1.5 * p.q[P + l] * sum[1] + 0.5 * p.q[l] * sum[2]) * ij;
    ds[l] = 1.0 - a - p.s[l];
    ds[P + l] = 1.0 + a - p.s[P + l];
    ds[2 * P + l] = root - j - p.s[2 * P + l];
    ds[3 * P + l] = root + j - p.s[3 * P + l];
  }
}

/// The largest −ds/s and −dz/z.
struct Ratios {
  double primal = 0.0, dual = 0.0;
};

template <int P>
SMOOTHPOST_INLINE Ratios lane_ratios(const PointView& p, const double* ds, double centre) {
  std::array<double, P> primal{}, dual{};
  for (int row = 0; row < 4; ++row) {
    const double* s = p.s + row * P;
    const double* z = p.z + row * P;
    const double* change = ds + row * P;
    for (int l = 0; l < P; ++l) {
      const double both = 1.0 / (s[l] * z[l]);
      const double fall = -change[l] * z[l] * both;
      const double dual_fall = 1.0 - fall - centre * both;
      primal[l] = fall > primal[l] ? fall : primal[l];
      dual[l] = dual_fall > dual[l] ? dual_fall : dual[l];
    }
  }
  return {*std::max_element(primal.begin(), primal.end()),
          *std::max_element(dual.begin(), dual.end())};
}

struct Step {
  double centre = 0.0, primal = 0.0, dual = 0.0;
};

/// s and z after a step; `c` are the true slacks at the new place.
template <int P>
SMOOTHPOST_INLINE void lane_update(const PointView& p, const double* ds, const double* c,
                                   const Step& step) {
  for (int i = 0; i < 4 * P; ++i) {
    const double s = p.s[i], z = p.z[i];
    const double dz = (step.centre - z * ds[i]) / s - z;
    const double linear = s + step.primal * ds[i];
    const double next = c[i] > linear ? c[i] : linear;
    p.z[i] = z + step.dual * dz;
    p.s[i] = next > kLeastSlack ? next : kLeastSlack;
  }
}

template <int P>
SMOOTHPOST_INLINE double lane_total(const double* values) {
  double total = 0.0;
  for (int l = 0; l < P; ++l) total += values[l];
  return total;
}

template <int P>
SMOOTHPOST_INLINE PointSums lane_sums(const PointView& p, const Local& v) {
  constexpr int kSums = 18;
  alignas(64) double sum[kSums][P];
  const double r = 1.0 / std::sqrt(v[0]), r1 = slope_of(v[0]);
  for (int l = 0; l < P; ++l) {
    const double ia = p.factor_a * p.inv_a[l], ij = p.factor_j * p.inv_j[l];
    const double q1 = 0.5 * p.q[l], q2 = p.q[P + l], q3 = p.q[2 * P + l];
    const double a0 = q2 * ia, a1 = q1 * ia;
    const double j0 = q3 * ij, j1 = 1.5 * q2 * ij, j2 = q1 * ij;
    const double s0 = p.s[l], s1 = p.s[P + l], s2 = p.s[2 * P + l], s3 = p.s[3 * P + l];
    const double z0 = p.z[l], z1 = p.z[P + l], z2 = p.z[2 * P + l], z3 = p.z[3 * P + l];
    const double i0 = 1.0 / s0, i1 = 1.0 / s1, i2 = 1.0 / s2, i3 = 1.0 / s3;
    const double d0 = z0 * i0, d1 = z1 * i1, d2 = z2 * i2, d3 = z3 * i3;
    const double a = a0 * v[0] + a1 * v[1], j = j0 * v[0] + j1 * v[1] + j2 * v[2];
    const double rho0 = 1.0 - a - s0, rho1 = 1.0 + a - s1, rho2 = r - j - s2, rho3 = r + j - s3;
    const double da = d0 + d1, dj = d2 + d3, ej = (d3 - d2) * r1;
    const double ca = i1 - i0, cj = i3 - i2, za = z1 - z0, zj = z3 - z2;
    const double ea0 = d0 * rho0, ea1 = d1 * rho1, ej2 = d2 * rho2, ej3 = d3 * rho3;
    const double ra = ea1 - ea0, rj = ej3 - ej2;
    sum[0][l] = da * a0 * a0 + dj * (r1 * r1 + j0 * j0) + 2.0 * ej * j0;
    sum[1][l] = da * a0 * a1 + dj * j0 * j1 + ej * j1;
    sum[2][l] = dj * j0 * j2 + ej * j2;
    sum[3][l] = da * a1 * a1 + dj * j1 * j1;
    sum[4][l] = dj * j1 * j2;
    sum[5][l] = dj * j2 * j2;
    sum[6][l] = a0 * ca + r1 * (i2 + i3) + j0 * cj;
    sum[7][l] = a1 * ca + j1 * cj;
    sum[8][l] = j2 * cj;
    sum[9][l] = a0 * ra + r1 * (ej2 + ej3) + j0 * rj;
    sum[10][l] = a1 * ra + j1 * rj;
    sum[11][l] = j2 * rj;
    sum[12][l] = a0 * za + r1 * (z2 + z3) + j0 * zj;
    sum[13][l] = a1 * za + j1 * zj;
    sum[14][l] = j2 * zj;
    sum[15][l] = z2 + z3;
    sum[16][l] = s0 * z0 + s1 * z1 + s2 * z2 + s3 * z3;
    const double most_a = rho0 < rho1 ? rho0 : rho1, most_j = rho2 < rho3 ? rho2 : rho3;
    sum[17][l] = most_a < most_j ? most_a : most_j;
  }
  PointSums out;
  for (int k = 0; k < 6; ++k) out.hessian[k] = lane_total<P>(sum[k]);
  for (int k = 0; k < 3; ++k) {
    out.centre[k] = lane_total<P>(sum[6 + k]);
    out.drift[k] = lane_total<P>(sum[9 + k]);
    out.dual[k] = lane_total<P>(sum[12 + k]);
  }
  out.jerk_multipliers = lane_total<P>(sum[15]);
  out.gap = lane_total<P>(sum[16]);
  out.lack = *std::min_element(sum[17], sum[17] + P);
  return out;
}

template <int P>
struct Width {};

// Each of these is a whole pass over the lanes of a point.
#define SMOOTHPOST_PASSES(P)                                                                   \
  SMOOTHPOST_LANES PointSums sums(Width<P>, const PointView& p, const Local& v) {              \
    return lane_sums<P>(p, v);                                                                 \
  }                                                                                            \
  SMOOTHPOST_LANES Ratios falls(Width<P>, const PointView& p, const Local& v, const Local& dv, \
                                double centre) {                                               \
    alignas(64) double ds[4 * P];                                                              \
    lane_changes<P>(p, v, dv, ds);                                                             \
    return lane_ratios<P>(p, ds, centre);                                                      \
  }                                                                                            \
  SMOOTHPOST_LANES void update(Width<P>, const PointView& p, const Local& v, const Local& dv,  \
                               const Local& now, const Step& step) {                           \
    alignas(64) double ds[4 * P], c[4 * P];                                                    \
    lane_changes<P>(p, v, dv, ds);                                                             \
    lane_slacks<P>(p, now, c);                                                                 \
    lane_update<P>(p, ds, c, step);                                                            \
  }
SMOOTHPOST_PASSES(8)
SMOOTHPOST_PASSES(16)
#undef SMOOTHPOST_PASSES

/// The iteration for P lanes.
template <int P>
class FeedIteration {
 public:
  FeedIteration(const FeedProgram& program, std::vector<double> start)
      : program_(program), grid_(*program.grid), x_(std::move(start)), dx_(x_.size(), 0.0) {
    const std::size_t points = grid_.points();
    slack_.resize(4 * P * points);
    multiplier_.resize(4 * P * points);
    cap_slack_.resize(points);
    cap_multiplier_.resize(points);
    inv_cap_.resize(points);
    weight_.resize(points);
    const double mean = grid_.elements.back().end / static_cast<double>(points);
    for_points([&](std::size_t i, std::size_t e, int node) {
      const double f = program_.factors[i].velocity;
      inv_cap_[i] = f * f / grid_.cap[i];
      const FeedElement& element = grid_.elements[e];
      weight_[i] = grid_.rule.weights[node] * (element.end - element.begin) / mean;
    });
    mean_weight_ = mean;
    basis_.resize(12 * points);
    for_points([&](std::size_t i, std::size_t e, int node) {
      const FeedElement& element = grid_.elements[e];
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
    const double rows = static_cast<double>((4 * P + 1) * grid_.points());
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
      Step step;
      step.centre = std::max(share * gap_ / rows, 0.2 * settings.tolerance * objective_ / rows);
      if (!newton(step.centre)) break;
      const Ratios ratios = largest_falls(step.centre);
      step.primal = std::min(1.0, kToBoundary / std::max(ratios.primal, 1e-300));
      step.dual = std::min(1.0, kToBoundary / std::max(ratios.dual, 1e-300));
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
    alignas(64) double c[4 * P];
    for_points([&](std::size_t i, std::size_t e, int) {
      const Local v = local(x_, i, e);
      lane_slacks<P>(view(i), v, c);
      const double root = std::sqrt(v[0]);
      FeedProgram::Factors& most = worst[e];
      most.velocity = std::max(most.velocity, std::sqrt(v[0] * inv_cap_[i]));
      for (int l = 0; l < P; ++l) {
        most.acceleration = std::max(most.acceleration, std::abs(c[l] - c[P + l]) * 0.5);
        most.jerk = std::max(most.jerk, std::abs(c[2 * P + l] - c[3 * P + l]) * 0.5 * root);
      }
    });
    return worst;
  }

 private:
  template <class Visit>
  void for_points(const Visit& visit) const {
    const int nodes = grid_.points_per_element();
    std::size_t i = 0;
    for (std::size_t e = 0; e < grid_.elements.size(); ++e)
      for (int node = 0; node < nodes; ++node, ++i) visit(i, e, node);
  }

  Local local(const std::vector<double>& x, std::size_t i, std::size_t e) const {
    const double* m = &basis_[12 * i];
    const double* c = &x[e];
    return {m[0] * c[0] + m[1] * c[1] + m[2] * c[2] + m[3] * c[3],
            m[4] * c[0] + m[5] * c[1] + m[6] * c[2] + m[7] * c[3],
            m[8] * c[0] + m[9] * c[1] + m[10] * c[2] + m[11] * c[3]};
  }

  PointView view(std::size_t i) {
    const FeedProgram::Factors& f = program_.factors[i];
    return {&grid_.rows[3 * P * i],
            program_.lanes->acceleration.data(),
            program_.lanes->jerk.data(),
            &slack_[4 * P * i],
            &multiplier_[4 * P * i],
            f.acceleration,
            f.jerk};
  }

  /// Slacks at the start, multipliers on the central path by least squares.
  void begin() {
    for_points([&](std::size_t i, std::size_t e, int) {
      const Local v = local(x_, i, e);
      require(v[0] > 0.0, "solve_feed: b > 0 at the start");
      double* s = &slack_[4 * P * i];
      lane_slacks<P>(view(i), v, s);
      for (int k = 0; k < 4 * P; ++k) s[k] = std::max(s[k], kStartSlack);
      cap_slack_[i] = std::max(1.0 - v[0] * inv_cap_[i], kStartSlack);
    });
    std::fill(multiplier_.begin(), multiplier_.end(), 0.0);
    std::fill(cap_multiplier_.begin(), cap_multiplier_.end(), 0.0);
    assemble();  // with multipliers 0: dual_ is the gradient, centre_ Σ g/s
    double fit = 0.0, norm = 0.0;
    for (std::size_t k = 0; k < x_.size(); ++k) {
      fit += dual_[k] * centre_[k];
      norm += centre_[k] * centre_[k];
    }
    const double rows = static_cast<double>((4 * P + 1) * grid_.points());
    const double mu = norm > 0.0 ? std::clamp(fit / norm, kStartGap * objective_ / rows, 1e3) : 1.0;
    for (std::size_t k = 0; k < slack_.size(); ++k) multiplier_[k] = mu / slack_[k];
    for (std::size_t i = 0; i < cap_slack_.size(); ++i) cap_multiplier_[i] = mu / cap_slack_[i];
    assemble();
  }

  /// Everything that the Newton system and the stopping test need, at x, s and z.
  void assemble() {
    clear();
    const int nodes = grid_.points_per_element();
    for (std::size_t e = 0; e < grid_.elements.size(); ++e)
      for (int node = 0; node < nodes; ++node) add_point(e * nodes + node, e);
    hold_fixed();
  }

  void clear() {
    band_.assign(x_.size(), {});
    dual_.assign(x_.size(), 0.0);
    drift_.assign(x_.size(), 0.0);
    centre_.assign(x_.size(), 0.0);
    objective_ = gap_ = lack_ = 0.0;
  }

  void add_point(std::size_t i, std::size_t e) {
    const Local v = local(x_, i, e);
    const double r = 1.0 / std::sqrt(v[0]), r1 = slope_of(v[0]), r2 = -1.5 * r1 / v[0];
    PointSums sums = smoothpost::sums(Width<P>{}, view(i), v);
    const double inv_s = 1.0 / cap_slack_[i], z = cap_multiplier_[i], g = -inv_cap_[i];
    const double rho = 1.0 + g * v[0] - cap_slack_[i];
    sums.hessian[0] += z * inv_s * g * g;
    sums.centre[0] += g * inv_s;
    sums.drift[0] += g * z * inv_s * rho;
    sums.dual[0] += g * z;
    sums.hessian[0] +=
        r2 * std::max(weight_[i] - sums.jerk_multipliers, kLeastCurvature * weight_[i]);
    objective_ += weight_[i] * r;
    gap_ += sums.gap + z * cap_slack_[i];
    lack_ = std::min({lack_, sums.lack, rho});
    const double gradient = weight_[i] * r1;
    scatter(i, e, sums, gradient);
  }

  void scatter(std::size_t i, std::size_t e, const PointSums& sums, double gradient) {
    const double* m = &basis_[12 * i];
    const auto& h = sums.hessian;
    for (int j = 0; j < 4; ++j) {
      const double m0 = m[j], m1 = m[4 + j], m2 = m[8 + j];
      const double h0 = h[0] * m0 + h[1] * m1 + h[2] * m2;
      const double h1 = h[1] * m0 + h[3] * m1 + h[4] * m2;
      const double h2 = h[2] * m0 + h[4] * m1 + h[5] * m2;
      for (int k = 0; k <= j; ++k) band_[e + j][j - k] += h0 * m[k] + h1 * m[4 + k] + h2 * m[8 + k];
      dual_[e + j] += m0 * (gradient - sums.dual[0]) - m1 * sums.dual[1] - m2 * sums.dual[2];
      drift_[e + j] -= m0 * (gradient + sums.drift[0]) + m1 * sums.drift[1] + m2 * sums.drift[2];
      centre_[e + j] += m0 * sums.centre[0] + m1 * sums.centre[1] + m2 * sums.centre[2];
    }
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

  Ratios largest_falls(double centre) {
    Ratios worst;
    for_points([&](std::size_t i, std::size_t e, int) {
      const Local v = local(x_, i, e), dv = local(dx_, i, e);
      const Ratios here = falls(Width<P>{}, view(i), v, dv, centre);
      const double change = 1.0 - inv_cap_[i] * (v[0] + dv[0]) - cap_slack_[i];
      const double fall = -change / cap_slack_[i];
      const double dual = 1.0 - fall - centre / (cap_slack_[i] * cap_multiplier_[i]);
      const double of_b = -dv[0] / v[0] * (kToBoundary / kMostFall);
      worst.primal = std::max({worst.primal, here.primal, fall, of_b});
      worst.dual = std::max({worst.dual, here.dual, dual});
    });
    return worst;
  }

  void advance(const Step& step) {
    old_ = x_;
    for (std::size_t k = 0; k < x_.size(); ++k) x_[k] += step.primal * dx_[k];
    clear();
    for_points([&](std::size_t i, std::size_t e, int) {
      const Local v = local(old_, i, e), dv = local(dx_, i, e), now = local(x_, i, e);
      update(Width<P>{}, view(i), v, dv, now, step);
      const double s = cap_slack_[i], z = cap_multiplier_[i];
      const double change = 1.0 - inv_cap_[i] * (v[0] + dv[0]) - s;
      cap_multiplier_[i] += step.dual * ((step.centre - z * change) / s - z);
      cap_slack_[i] = std::max({s + step.primal * change, 1.0 - inv_cap_[i] * now[0], kLeastSlack});
      add_point(i, e);
    });
    hold_fixed();
  }

  const FeedProgram& program_;
  const FeedGrid& grid_;
  std::vector<double> x_, dx_, old_;
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
  if (program.grid->width == 8) return FeedIteration<8>(program, std::move(start)).solve(settings);
  return FeedIteration<16>(program, std::move(start)).solve(settings);
}

namespace {

std::vector<FeedProgram::Factors> element_ratios(const FeedProgram& program,
                                                 const std::vector<double>& controls) {
  check(program, controls);
  if (program.grid->width == 8) return FeedIteration<8>(program, controls).ratios();
  return FeedIteration<16>(program, controls).ratios();
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
