#pragma once

#include "kernels/qp/qp_solver.h"

// Internal to kernels/qp.
namespace smoothpost {

/// A programme in units in which its variables and rows are of the order of 1.
///
/// The size of a level is its largest bound, or less where a neighbouring level leaves less: a
/// level cannot change by more than its derivative allows over all pieces, and needs no more
/// derivative than crosses its range within one. Rows are divided by their largest weight in those
/// units. Sizes within 32 times of 1 are left alone, others are changed by powers of two: no value
/// is rounded, and a programme that is well scaled keeps every bit.
struct Equilibrated {
  QuadraticProgram qp;
  Eigen::VectorXd size;    ///< x = size·x' for every variable x' of `qp`
  Eigen::VectorXd factor;  ///< every row of `qp` is factor·(the given one)
};
/// A relaxation's weights come along, so that τ is the same; the objective does not change.
Equilibrated equilibrated(const QuadraticProgram& qp);

/// The solution of `scaled.qp` in the units that were given; certificate and status stay those of
/// `scaled.qp`.
QpSolution in_given_units(const Equilibrated& scaled, QpSolution solution);

}  // namespace smoothpost
