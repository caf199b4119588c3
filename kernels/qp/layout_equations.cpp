#include "kernels/qp/layout_equations.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"

namespace smoothpost {
namespace {

/// Band Cholesky: column j of `band` holds the elements (j + d, j), d = 0 … half width.
void factorise(Eigen::MatrixXd& band) {
  const Eigen::Index size = band.cols();
  const Eigen::Index width = band.rows() - 1;
  for (Eigen::Index j = 0; j < size; ++j) {
    band.col(j) /= std::sqrt(band(0, j));
    const Eigen::Index last = std::min(width, size - 1 - j);
    for (Eigen::Index i = 1; i <= last; ++i) {
      for (Eigen::Index d = i; d <= last; ++d) {
        band(d - i, j + i) -= band(i, j) * band(d, j);
      }
    }
  }
}

void solve_in_place(const Eigen::MatrixXd& band, Eigen::VectorXd& x) {
  const Eigen::Index size = band.cols();
  const Eigen::Index width = band.rows() - 1;
  for (Eigen::Index j = 0; j < size; ++j) {
    x(j) /= band(0, j);
    const Eigen::Index last = std::min(width, size - 1 - j);
    for (Eigen::Index d = 1; d <= last; ++d) x(j + d) -= band(d, j) * x(j);
  }
  for (Eigen::Index j = size; j-- > 0;) {
    const Eigen::Index last = std::min(width, size - 1 - j);
    for (Eigen::Index d = 1; d <= last; ++d) x(j) -= band(d, j) * x(j + d);
    x(j) /= band(0, j);
  }
}

/// The equations of one channel in the order of their control points, levels side by side: equation
/// (level l, control point j) at j·levels + l − 1. Places without an equation hold −1.
struct ChannelOrder {
  int levels = 0;
  std::vector<int> equation;
};

std::vector<ChannelOrder> channel_orders(const SplineLayout& layout) {
  std::vector<ChannelOrder> orders;
  int next = 0;
  for (int c = 0; c < layout.channels; ++c) {
    ChannelOrder order{layout.levels, std::vector<int>(layout.controls() * layout.levels, -1)};
    for (int l = 1; l <= layout.levels; ++l) {
      for (int j = 0; j < layout.count(l); ++j) order.equation[j * layout.levels + l - 1] = next++;
    }
    orders.push_back(std::move(order));
  }
  return orders;
}

/// The band of E·Eᵀ of one channel; 1 on the diagonal where there is no equation.
Eigen::MatrixXd normal_matrix(const ChannelOrder& order,
                              const std::vector<LayoutEquation>& equations) {
  const int levels = order.levels;
  const int size = static_cast<int>(order.equation.size());
  Eigen::MatrixXd band = Eigen::MatrixXd::Zero(levels + 1, size);
  for (int q = 0; q < size; ++q) {
    band(0, q) = 1.0;
    if (order.equation[q] < 0) continue;
    const double step = equations[order.equation[q]].step;
    band(0, q) = 2.0 + step * step;
    // The same level's next equation shares x[next].
    if (q + levels < size && order.equation[q + levels] >= 0) band(levels, q) -= 1.0;
    if (q % levels == levels - 1) continue;
    // x[rate] is x[last] of the next level's equation here and x[next] of its one before.
    if (order.equation[q + 1] >= 0) band(1, q) += step;
    const int before = q + 1 - levels;
    if (before >= 0 && order.equation[before] >= 0) band(levels - 1, before) -= step;
  }
  return band;
}

Eigen::VectorXd add_terms(const std::vector<LayoutEquation>& equations,
                          const Eigen::VectorXd& multipliers, Eigen::VectorXd gradient) {
  for (std::size_t e = 0; e < equations.size(); ++e) {
    const double multiplier = multipliers(static_cast<Eigen::Index>(e));
    gradient(equations[e].next) += multiplier;
    gradient(equations[e].last) -= multiplier;
    gradient(equations[e].rate) -= equations[e].step * multiplier;
  }
  return gradient;
}

double largest(const Eigen::VectorXd& x) { return x.size() ? x.lpNorm<Eigen::Infinity>() : 0.0; }

}  // namespace

std::vector<LayoutEquation> layout_equations(const SplineLayout& layout) {
  std::vector<LayoutEquation> equations;
  for (int c = 0; c < layout.channels; ++c) {
    for (int l = 1; l <= layout.levels; ++l) {
      const std::vector<double> steps = derivative_steps(layout.knots, l);
      const double scale = layout.scale(c, l) / layout.scale(c, l - 1);
      for (int j = 0; j < layout.count(l); ++j) {
        equations.push_back({layout.index(c, l - 1, j + 1), layout.index(c, l - 1, j),
                             layout.index(c, l, j), steps[j] * scale});
      }
    }
  }
  return equations;
}

LagrangianGradient lagrangian_gradient(const QuadraticProgram& qp, const QpSolution& solution) {
  const SplineLayout& layout = qp.layout;
  const int local = layout.local_size();
  require(solution.x.size() == layout.size() && solution.bound_lower.size() == layout.size() &&
              solution.bound_upper.size() == layout.size() &&
              solution.row_lower.size() == qp.row_count() &&
              solution.row_upper.size() == qp.row_count(),
          "the solution belongs to this programme");
  Eigen::VectorXd curvature = Eigen::VectorXd::Zero(layout.size());
  Eigen::VectorXd linear = Eigen::VectorXd::Zero(layout.size());
  Eigen::VectorXd piece(local), product(local);
  std::vector<int> first(static_cast<std::size_t>(local));  // the next piece's are one further
  for (int p = 0; p < local; ++p) first[static_cast<std::size_t>(p)] = layout.local_index(0, p);
  for (int i = 0; i < layout.spans(); ++i) {
    for (int p = 0; p < local; ++p) piece(p) = solution.x(first[static_cast<std::size_t>(p)] + i);
    product.noalias() = qp.hessian.middleCols(i * local, local) * piece;
    for (int p = 0; p < local; ++p) {
      const int at = first[static_cast<std::size_t>(p)] + i;
      curvature(at) += product(p);
      linear(at) += qp.gradient(p, i);
    }
  }
  Eigen::VectorXd rows = Eigen::VectorXd::Zero(layout.size());
  for (int r = 0; r < qp.row_count(); ++r) {
    const double multiplier = solution.row_lower(r) - solution.row_upper(r);
    const int span = qp.row_span[static_cast<std::size_t>(r)];
    for (int p = 0; p < local; ++p)
      rows(first[static_cast<std::size_t>(p)] + span) += multiplier * qp.rows(p, r);
  }
  const Eigen::VectorXd bounds = solution.bound_lower - solution.bound_upper;
  return {curvature + linear - bounds - rows,
          1.0 + std::max({largest(curvature), largest(linear), largest(bounds), largest(rows)})};
}

Eigen::VectorXd equation_multipliers(const SplineLayout& layout, const Eigen::VectorXd& gradient) {
  const std::vector<LayoutEquation> equations = layout_equations(layout);
  Eigen::VectorXd multipliers = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(equations.size()));
  for (const ChannelOrder& order : channel_orders(layout)) {
    Eigen::MatrixXd band = normal_matrix(order, equations);
    factorise(band);
    for (int pass = 0; pass < 2; ++pass) {
      const Eigen::VectorXd left = add_terms(equations, multipliers, gradient);
      Eigen::VectorXd step = Eigen::VectorXd::Zero(band.cols());
      for (Eigen::Index q = 0; q < band.cols(); ++q) {
        if (order.equation[q] < 0) continue;
        const LayoutEquation& e = equations[order.equation[q]];
        step(q) = left(e.last) + e.step * left(e.rate) - left(e.next);
      }
      solve_in_place(band, step);
      for (Eigen::Index q = 0; q < band.cols(); ++q) {
        if (order.equation[q] >= 0) multipliers(order.equation[q]) += step(q);
      }
    }
  }
  return multipliers;
}

Eigen::VectorXd with_equation_terms(const SplineLayout& layout, const Eigen::VectorXd& multipliers,
                                    const Eigen::VectorXd& gradient) {
  return add_terms(layout_equations(layout), multipliers, gradient);
}

}  // namespace smoothpost
