#pragma once

#include <vector>

#include "kernels/qp/qp_solver.h"

// Internal to kernels/qp.
namespace smoothpost {

struct SparseEntry {
  int row = 0;
  int column = 0;
  double value = 0.0;
};

/// What a row of a SparseProgram stands for, and with it whose multiplier its own is.
struct SparseRowOrigin {
  enum class Kind { equation, chain, bound_lower, bound_upper, row };
  Kind kind = Kind::equation;
  int index = 0;  ///< of the equation of the layout, the piece, the variable or the row
};

/// A quadratic programme in the form that general solvers take:
///   minimise ½ xᵀHx + gᵀx,   lower ≤ x ≤ upper,   row_lower ≤ Ax ≤ row_upper.
///
/// Variables: those of the layout; with a relaxation one copy of τ a piece, each equal to the one
/// before: a single τ would be a dense column, with which a factorisation fills and slows down by
/// an order. Rows: the equations of the layout (in the order of layout_equations()), the chain of
/// the copies, the bounds that give way to τ, the rows; a row with two limits that give way is two
/// rows here. Rows and bounds without a limit are left out.
struct SparseProgram {
  std::vector<SparseEntry> hessian;  ///< lower triangle, column by column
  Eigen::VectorXd gradient, lower, upper;
  std::vector<SparseEntry> matrix;  ///< A, row by row
  std::vector<double> row_lower, row_upper;
  std::vector<SparseRowOrigin> origin;  ///< one a row

  int variables() const { return static_cast<int>(gradient.size()); }
  int rows() const { return static_cast<int>(origin.size()); }
};
SparseProgram sparse_program(const QuadraticProgram& qp);

/// A point of a SparseProgram; Lagrangian ½ xᵀHx + gᵀx + λᵀAx − z_lowerᵀx + z_upperᵀx.
struct SparsePoint {
  Eigen::VectorXd x, z_lower, z_upper, lambda;
};
/// The solution that a point stands for: x, τ and multipliers. Those of variables that are fixed
/// are computed here from stationarity, as solvers leave them out.
QpSolution from_sparse(const QuadraticProgram& qp, const SparseProgram& sparse,
                       const SparsePoint& point);
/// The reverse; multipliers of equations of the layout by equation_multipliers().
SparsePoint to_sparse(const QuadraticProgram& qp, const SparseProgram& sparse,
                      const QpSolution& solution);

}  // namespace smoothpost
