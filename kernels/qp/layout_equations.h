#pragma once

#include <vector>

#include "kernels/qp/qp_solver.h"

// Internal to kernels/qp.
namespace smoothpost {

/// One equation of a layout:   x[next] − x[last] − step·x[rate] = 0.
struct LayoutEquation {
  int next = 0;  ///< index of x^{l−1}_{j+1}
  int last = 0;  ///< index of x^{l−1}_j
  int rate = 0;  ///< index of x^l_j
  double step = 0.0;
};

/// All of them, channel by channel, level by level: a layout of C channels, L levels and n control
/// points has C·(n·L − L·(L + 1)/2).
std::vector<LayoutEquation> layout_equations(const SplineLayout& layout);

/// Gradient of the Lagrangian without the terms of the layout's equations:
///   Hx + g − (z_lower − z_upper) − rowsᵀ(y_lower − y_upper).
struct LagrangianGradient {
  Eigen::VectorXd value;
  double scale = 1.0;  ///< 1 + the largest of the four terms
};
LagrangianGradient lagrangian_gradient(const QuadraticProgram& qp, const QpSolution& solution);

/// Multipliers λ of the layout's equations, in their order, that make gradient + Eᵀλ least in the
/// sense of least squares.
///
/// E has one row an equation. Following the multipliers from one stationarity to the next would
/// integrate rounding once a level (errors grow as controls()^levels), and solving level by level
/// from the top divides by step^levels; least squares does neither, and leaves no more (in the
/// Euclidean norm) than the multipliers that any solver ended with.
/// Cost: linear; a band Cholesky of half width `levels`, one step of refinement.
Eigen::VectorXd equation_multipliers(const SplineLayout& layout, const Eigen::VectorXd& gradient);

/// gradient + Eᵀλ.
Eigen::VectorXd with_equation_terms(const SplineLayout& layout, const Eigen::VectorXd& multipliers,
                                    const Eigen::VectorXd& gradient);

}  // namespace smoothpost
