#include "kernels/qp/sparse_program.h"

#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/qp/layout_equations.h"

namespace smoothpost {
namespace {

using Kind = SparseRowOrigin::Kind;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Limits {
  double lower = -kInfinity;
  double upper = kInfinity;
};

void add_row(SparseProgram& sparse, Limits limits, SparseRowOrigin origin) {
  sparse.row_lower.push_back(limits.lower);
  sparse.row_upper.push_back(limits.upper);
  sparse.origin.push_back(origin);
}

void add_entry(SparseProgram& sparse, int column, double value) {
  if (value != 0.0) sparse.matrix.push_back({sparse.rows() - 1, column, value});
}

void add_equations(SparseProgram& sparse, const SplineLayout& layout) {
  int index = 0;
  for (const LayoutEquation& e : layout_equations(layout)) {
    add_row(sparse, {0.0, 0.0}, {Kind::equation, index++});
    add_entry(sparse, e.next, 1.0);
    add_entry(sparse, e.last, -1.0);
    add_entry(sparse, e.rate, -e.step);
  }
}

/// The copy of τ that limits of a piece hang on.
int tau_of(const SplineLayout& layout, int span) { return layout.size() + span; }

/// All copies of τ are one: copy i + 1 = copy i.
void add_chain(SparseProgram& sparse, const SplineLayout& layout) {
  for (int i = 0; i + 1 < layout.spans(); ++i) {
    add_row(sparse, {0.0, 0.0}, {Kind::chain, i});
    add_entry(sparse, tau_of(layout, i + 1), 1.0);
    add_entry(sparse, tau_of(layout, i), -1.0);
  }
}

void add_relaxed_bounds(SparseProgram& sparse, const QuadraticProgram& qp, int i, int tau) {
  const double weight = qp.relaxation->bound_weight(i);
  if (weight == 0.0) return;
  sparse.lower(i) = -kInfinity;
  sparse.upper(i) = kInfinity;
  if (std::isfinite(qp.lower(i))) {
    add_row(sparse, {qp.lower(i), kInfinity}, {Kind::bound_lower, i});
    add_entry(sparse, i, 1.0);
    add_entry(sparse, tau, weight);
  }
  if (std::isfinite(qp.upper(i))) {
    add_row(sparse, {-kInfinity, qp.upper(i)}, {Kind::bound_upper, i});
    add_entry(sparse, i, 1.0);
    add_entry(sparse, tau, -weight);
  }
}

/// Plain bounds, or with a weight rows  x + weight·τ ≥ lower  and  x − weight·τ ≤ upper.
void add_bounds(SparseProgram& sparse, const QuadraticProgram& qp) {
  const SplineLayout& layout = qp.layout;
  sparse.lower.head(layout.size()) = qp.lower;
  sparse.upper.head(layout.size()) = qp.upper;
  if (!qp.relaxation) return;
  for (int c = 0; c < layout.channels; ++c) {
    for (int l = 0; l <= layout.levels; ++l) {
      for (int j = 0; j < layout.count(l); ++j) {
        add_relaxed_bounds(sparse, qp, layout.index(c, l, j),
                           tau_of(layout, std::min(j, layout.spans() - 1)));
      }
    }
  }
}

void add_program_row(SparseProgram& sparse, const QuadraticProgram& qp, int r, Limits limits) {
  add_row(sparse, limits, {Kind::row, r});
  for (int p = 0; p < qp.layout.local_size(); ++p) {
    add_entry(sparse, qp.layout.local_index(qp.row_span[r], p), qp.rows(p, r));
  }
}

void add_program_rows(SparseProgram& sparse, const QuadraticProgram& qp) {
  for (int r = 0; r < qp.row_count(); ++r) {
    const Limits limits{qp.row_lower(r), qp.row_upper(r)};
    const double weight = qp.relaxation ? qp.relaxation->row_weight(r) : 0.0;
    if (!std::isfinite(limits.lower) && !std::isfinite(limits.upper)) continue;
    if (weight == 0.0) {
      add_program_row(sparse, qp, r, limits);
      continue;
    }
    if (std::isfinite(limits.lower)) {
      add_program_row(sparse, qp, r, {limits.lower, kInfinity});
      add_entry(sparse, tau_of(qp.layout, qp.row_span[r]), weight);
    }
    if (std::isfinite(limits.upper)) {
      add_program_row(sparse, qp, r, {-kInfinity, limits.upper});
      add_entry(sparse, tau_of(qp.layout, qp.row_span[r]), -weight);
    }
  }
}

void add_objective(SparseProgram& sparse, const QuadraticProgram& qp) {
  const SplineLayout& layout = qp.layout;
  const int local = layout.local_size();
  std::vector<Eigen::Triplet<double>> triplets;
  for (int i = 0; i < layout.spans(); ++i) {
    for (int p = 0; p < local; ++p) {
      const int row = layout.local_index(i, p);
      sparse.gradient(row) += qp.gradient(p, i);
      for (int q = 0; q < local; ++q) {
        const int column = layout.local_index(i, q);
        const double value = qp.hessian(p, i * local + q);
        if (value != 0.0 && row >= column) triplets.emplace_back(row, column, value);
      }
    }
  }
  Eigen::SparseMatrix<double> sum(sparse.variables(), sparse.variables());
  sum.setFromTriplets(triplets.begin(), triplets.end());
  for (int column = 0; column < sum.outerSize(); ++column) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(sum, column); it; ++it) {
      sparse.hessian.push_back({static_cast<int>(it.row()), column, it.value()});
    }
  }
}

/// Hx + g + Aᵀλ.
Eigen::VectorXd gradient_at(const SparseProgram& sparse, const SparsePoint& point) {
  Eigen::VectorXd gradient = sparse.gradient;
  for (const SparseEntry& e : sparse.hessian) {
    gradient(e.row) += e.value * point.x(e.column);
    if (e.row != e.column) gradient(e.column) += e.value * point.x(e.row);
  }
  for (const SparseEntry& e : sparse.matrix) gradient(e.column) += e.value * point.lambda(e.row);
  return gradient;
}

}  // namespace

SparseProgram sparse_program(const QuadraticProgram& qp) {
  const int size = qp.layout.size();
  SparseProgram sparse;
  const int variables = size + (qp.relaxation ? qp.layout.spans() : 0);
  sparse.gradient = Eigen::VectorXd::Zero(variables);
  sparse.lower = Eigen::VectorXd::Constant(variables, -kInfinity);
  sparse.upper = Eigen::VectorXd::Constant(variables, kInfinity);
  add_objective(sparse, qp);
  if (qp.relaxation) {
    sparse.gradient(size) = qp.relaxation->cost;
    sparse.lower(size) = qp.relaxation->lower;
  }
  add_equations(sparse, qp.layout);
  if (qp.relaxation) add_chain(sparse, qp.layout);
  add_bounds(sparse, qp);
  add_program_rows(sparse, qp);
  return sparse;
}

QpSolution from_sparse(const QuadraticProgram& qp, const SparseProgram& sparse,
                       const SparsePoint& point) {
  const int size = qp.layout.size();
  QpSolution solution;
  solution.x = point.x.head(size);
  if (qp.relaxation) solution.tau = point.x(size);
  solution.bound_lower = point.z_lower.head(size);
  solution.bound_upper = point.z_upper.head(size);
  solution.row_lower = Eigen::VectorXd::Zero(qp.row_count());
  solution.row_upper = Eigen::VectorXd::Zero(qp.row_count());
  const Eigen::VectorXd gradient = gradient_at(sparse, point);
  for (int i = 0; i < size; ++i) {
    if (sparse.lower(i) != sparse.upper(i)) continue;
    solution.bound_lower(i) = std::max(0.0, gradient(i));
    solution.bound_upper(i) = std::max(0.0, -gradient(i));
  }
  for (int r = 0; r < sparse.rows(); ++r) {
    const double at_lower = std::max(0.0, -point.lambda(r));
    const double at_upper = std::max(0.0, point.lambda(r));
    const int index = sparse.origin[r].index;
    if (sparse.origin[r].kind == Kind::bound_lower) solution.bound_lower(index) = at_lower;
    if (sparse.origin[r].kind == Kind::bound_upper) solution.bound_upper(index) = at_upper;
    if (sparse.origin[r].kind != Kind::row) continue;
    solution.row_lower(index) += at_lower;
    solution.row_upper(index) += at_upper;
  }
  return solution;
}

SparsePoint to_sparse(const QuadraticProgram& qp, const SparseProgram& sparse,
                      const QpSolution& solution) {
  const int size = qp.layout.size();
  SparsePoint point;
  point.x = Eigen::VectorXd::Zero(sparse.variables());
  point.x.head(size) = solution.x;
  point.z_lower = Eigen::VectorXd::Zero(sparse.variables());
  point.z_upper = Eigen::VectorXd::Zero(sparse.variables());
  point.z_lower.head(size) = solution.bound_lower;
  point.z_upper.head(size) = solution.bound_upper;
  if (qp.relaxation) point.x.tail(qp.layout.spans()).setConstant(solution.tau);
  const Eigen::VectorXd multipliers =
      equation_multipliers(qp.layout, lagrangian_gradient(qp, solution).value);
  point.lambda = Eigen::VectorXd::Zero(sparse.rows());
  for (int r = 0; r < sparse.rows(); ++r) {
    const int index = sparse.origin[r].index;
    switch (sparse.origin[r].kind) {
      case Kind::equation:
        point.lambda(r) = multipliers(index);
        break;
      case Kind::chain:
        break;
      case Kind::bound_lower:
        point.lambda(r) = -solution.bound_lower(index);
        point.z_lower(index) = 0.0;
        break;
      case Kind::bound_upper:
        point.lambda(r) = solution.bound_upper(index);
        point.z_upper(index) = 0.0;
        break;
      case Kind::row:
        point.lambda(r) = (std::isfinite(sparse.row_upper[r]) ? solution.row_upper(index) : 0.0) -
                          (std::isfinite(sparse.row_lower[r]) ? solution.row_lower(index) : 0.0);
        break;
    }
  }
  return point;
}

}  // namespace smoothpost
