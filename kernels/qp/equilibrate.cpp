#include "kernels/qp/equilibrate.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace smoothpost {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLeftAlone = 32.0;

/// The power of two next to a size; 1 near 1, and where there is no size.
double power_near(double size) {
  if (!(size > 0.0) || !std::isfinite(size)) return 1.0;
  if (size <= kLeftAlone && size * kLeftAlone >= 1.0) return 1.0;
  return std::exp2(std::round(std::log2(size)));
}

/// Of the values of every level of a channel, unscaled; infinity: nothing says.
std::vector<double> level_sizes(const QuadraticProgram& qp, int channel) {
  const SplineLayout& layout = qp.layout;
  std::vector<double> sizes;
  for (int level = 0; level <= layout.levels; ++level) {
    double most = 0.0;
    for (int j = 0; j < layout.count(level); ++j) {
      const int k = layout.index(channel, level, j);
      for (const double bound : {qp.lower[k], qp.upper[k]})
        if (std::isfinite(bound)) most = std::max(most, std::abs(bound));
    }
    sizes.push_back(most > 0.0 ? most * layout.scale(channel, level) : kInfinity);
  }
  const double pieces = layout.spans();
  const double step = (layout.knots.last() - layout.knots.first()) / pieces;
  for (std::size_t l = sizes.size() - 1; l-- > 0;)
    sizes[l] = std::min(sizes[l], pieces * step * sizes[l + 1]);
  for (std::size_t l = 1; l < sizes.size(); ++l)
    sizes[l] = std::min(sizes[l], 2.0 / step * sizes[l - 1]);
  return sizes;
}

Eigen::VectorXd variable_sizes(const QuadraticProgram& qp) {
  const SplineLayout& layout = qp.layout;
  Eigen::VectorXd size = Eigen::VectorXd::Ones(layout.size());
  for (int c = 0; c < layout.channels; ++c) {
    const std::vector<double> sizes = level_sizes(qp, c);
    for (int level = 0; level <= layout.levels; ++level)
      size.segment(layout.index(c, level, 0), layout.count(level))
          .setConstant(power_near(sizes[static_cast<std::size_t>(level)] / layout.scale(c, level)));
  }
  return size;
}

/// Sizes of the local variables: the same for every piece.
Eigen::VectorXd local_sizes(const SplineLayout& layout, const Eigen::VectorXd& size) {
  Eigen::VectorXd local(layout.local_size());
  for (int p = 0; p < local.size(); ++p) local[p] = size[layout.local_index(0, p)];
  return local;
}

}  // namespace

Equilibrated equilibrated(const QuadraticProgram& qp) {
  Equilibrated out{qp, variable_sizes(qp), Eigen::VectorXd::Ones(qp.row_count())};
  QuadraticProgram& to = out.qp;
  const int local = qp.layout.local_size();
  const Eigen::VectorXd sizes = local_sizes(qp.layout, out.size);
  for (int c = 0; c < qp.layout.channels; ++c)
    for (int level = 0; level <= qp.layout.levels; ++level)
      to.layout.scale(c, level) *= out.size[qp.layout.index(c, level, 0)];
  for (int span = 0; span < qp.layout.spans(); ++span)
    to.hessian.middleCols(span * local, local) =
        sizes.asDiagonal() * qp.hessian.middleCols(span * local, local) * sizes.asDiagonal();
  to.gradient = sizes.asDiagonal() * qp.gradient;
  to.lower = qp.lower.cwiseQuotient(out.size);
  to.upper = qp.upper.cwiseQuotient(out.size);
  for (int r = 0; r < qp.row_count(); ++r) {
    to.rows.col(r) = qp.rows.col(r).cwiseProduct(sizes);
    out.factor[r] = 1.0 / power_near(to.rows.col(r).cwiseAbs().maxCoeff());
    to.rows.col(r) *= out.factor[r];
  }
  to.row_lower = qp.row_lower.cwiseProduct(out.factor);
  to.row_upper = qp.row_upper.cwiseProduct(out.factor);
  if (!qp.relaxation) return out;
  to.relaxation->bound_weight = qp.relaxation->bound_weight.cwiseQuotient(out.size);
  to.relaxation->row_weight = qp.relaxation->row_weight.cwiseProduct(out.factor);
  return out;
}

QpSolution in_given_units(const Equilibrated& scaled, QpSolution solution) {
  solution.x = solution.x.cwiseProduct(scaled.size);
  solution.bound_lower = solution.bound_lower.cwiseQuotient(scaled.size);
  solution.bound_upper = solution.bound_upper.cwiseQuotient(scaled.size);
  solution.row_lower = solution.row_lower.cwiseProduct(scaled.factor);
  solution.row_upper = solution.row_upper.cwiseProduct(scaled.factor);
  return solution;
}

}  // namespace smoothpost
