#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "kernels/qp/quadratic_program.h"

// Programmes for the tests of the solvers.
namespace smoothpost::test {

struct ProgrammeSize {
  int degree = 5;
  int spans = 20;
  int channels = 1;
};

class ProgrammeRandom {
 public:
  explicit ProgrammeRandom(unsigned seed) : engine_(seed) {}
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  int below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(engine_); }

 private:
  std::mt19937 engine_;
};

/// Clamped knots with spans between 0.5 and 1.5.
inline SplineKnots uneven_knots(int degree, int spans, ProgrammeRandom& random) {
  SplineKnots knots = clamped_knots(degree, spans);
  double u = 0.0;
  for (int i = 1; i <= spans; ++i) {
    u += random.between(0.5, 1.5);
    const std::size_t at = static_cast<std::size_t>(degree + i);
    if (i < spans) knots.values[at] = u;
  }
  for (int k = 0; k <= degree; ++k) knots.values[static_cast<std::size_t>(degree + spans + k)] = u;
  return knots;
}

/// A programme of which `inside` satisfies the equations and every limit with room.
struct KnownProgramme {
  QuadraticProgram qp;
  Eigen::VectorXd inside;
};

/// Waves at rest at both ends, one a channel.
inline Eigen::MatrixXd resting_waves(const SplineLayout& layout, ProgrammeRandom& random) {
  const int n = layout.controls();
  Eigen::MatrixXd controls(layout.channels, n);
  for (int c = 0; c < layout.channels; ++c) {
    const double slow = random.between(0.05, 0.2), fast = random.between(0.2, 0.7);
    const double phase = random.between(-3.0, 3.0);
    for (int j = 0; j < n; ++j) {
      const double u = std::clamp(j, 2, n - 3);
      controls(c, j) = std::sin(slow * u + phase) + 0.3 * std::sin(fast * u);
    }
  }
  return controls;
}

/// Limits of a share more than the known spline needs on every level, rows of values (two channels
/// mixed where there are), one-sided rows, equations every few pieces and rest at the ends.
/// Spread: rows are at most this wide on each side.
inline KnownProgramme known_programme(const ProgrammeSize& size, ProgrammeRandom& random,
                                      double spread = 0.1) {
  const int levels = size.degree == 5 ? 3 : 2;
  SplineLayout layout =
      spline_layout(uneven_knots(size.degree, size.spans, random), levels, size.channels);
  const Eigen::MatrixXd waves = resting_waves(layout, random);
  for (int c = 0; c < size.channels; ++c)
    for (int level = 0; level <= levels; ++level)
      layout.scale(c, level) =
          random.between(1.0, 1.2) * 1.001 *
          derivative_controls(layout.knots, waves.row(c), level).cwiseAbs().maxCoeff();
  KnownProgramme out{empty_program(layout), lift(layout, waves)};
  QuadraticProgram& qp = out.qp;
  for (int c = 0; c < size.channels; ++c) {
    const Eigen::VectorXd top = derivative_controls(layout.knots, waves.row(c), levels);
    add_derivative_cost(qp, c, 3, 1.0 / (top.squaredNorm() * size.channels));
    for (int level = 0; level <= levels; ++level) limit_level(qp, c, level, layout.scale(c, level));
    for (const int level : {1, 2})
      for (const int j : {0, layout.count(level) - 1})
        qp.lower[layout.index(c, level, j)] = qp.upper[layout.index(c, level, j)] = 0.0;
  }
  std::vector<NewRow> rows;
  const auto value = [&](const LocalRow& row) {
    double sum = 0.0;
    for (int p = 0; p < layout.local_size(); ++p)
      sum += row.weights[p] * out.inside[layout.local_index(row.span, p)];
    return sum;
  };
  for (int k = 0; k < size.spans; ++k) {
    const double u = random.between(layout.knots.first(), layout.knots.last());
    NewRow row{local_row(layout, 0, u, 0), 0.0, 0.0, "corridor", u};
    for (int c = 1; c < size.channels; ++c)
      row.row.weights += random.between(-1.0, 1.0) * local_row(layout, c, u, 0).weights;
    const double at = value(row.row);
    row.lower = at - random.between(0.1, 1.0) * spread;
    row.upper = at + random.between(0.1, 1.0) * spread;
    if (k % 3 == 1) row.lower = -std::numeric_limits<double>::infinity();
    if (k % 3 == 2) row.upper = std::numeric_limits<double>::infinity();
    rows.push_back(row);
  }
  for (int i = 0; i <= size.spans; i += 12)
    for (int c = 0; c < size.channels; ++c) {
      const double u = layout.knots.values[static_cast<std::size_t>(size.degree + i)];
      NewRow row{local_row(layout, c, u, 0), 0.0, 0.0, "via point", u};
      row.lower = row.upper = value(row.row);
      rows.push_back(row);
    }
  set_rows(qp, rows);
  return out;
}

/// Every two-sided bound of a derivative multiplied by that share.
inline QuadraticProgram with_shares(QuadraticProgram qp, ProgrammeRandom& random, double least) {
  for (int c = 0; c < qp.layout.channels; ++c)
    for (int level = 1; level <= qp.layout.levels; ++level) {
      const double share = random.between(least, 1.0);
      for (int j = 0; j < qp.layout.count(level); ++j) {
        qp.lower[qp.layout.index(c, level, j)] *= share;
        qp.upper[qp.layout.index(c, level, j)] *= share;
      }
    }
  return qp;
}

/// Quintic, one channel: minimise ½∫(q''')² through via points (u, value), q' = q'' = 0 at the
/// ends; `scale` of the levels 0 … 3.
inline QuadraticProgram via_programme(int spans, const std::vector<std::pair<double, double>>& via,
                                      const Eigen::Vector4d& scale = Eigen::Vector4d::Ones()) {
  SplineLayout layout = spline_layout(clamped_knots(5, spans), 3, 1);
  layout.scale.row(0) = scale;
  QuadraticProgram qp = empty_program(layout);
  add_derivative_cost(qp, 0, 3, 1.0);
  std::vector<NewRow> rows;
  for (const auto& [u, value] : via) {
    NewRow row{local_row(layout, 0, u, 0), value / scale[0], value / scale[0], "via point", u};
    row.row.weights /= scale[0];
    rows.push_back(row);
  }
  set_rows(qp, rows);
  for (const int level : {1, 2})
    for (const int j : {0, layout.count(level) - 1})
      qp.lower[layout.index(0, level, j)] = qp.upper[layout.index(0, level, j)] = 0.0;
  return qp;
}

/// qp_eq of paper_b.json.
inline QuadraticProgram golden_programme() {
  return via_programme(20, {{0.0, 0.0}, {5.0, 1.0}, {10.0, -0.5}, {15.0, 0.7}, {20.0, 0.2}});
}

}  // namespace smoothpost::test
