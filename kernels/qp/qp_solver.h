#pragma once

#include <string>

#include "kernels/qp/quadratic_program.h"

namespace smoothpost {

enum class QpSolver { banded, ipopt };
enum class QpStatus {
  optimal,          ///< the certificate is within the tolerance
  infeasible,       ///< no x satisfies the equations, bounds and rows: shown by feasibility(), or
                    ///< Ipopt's Infeasible_Problem_Detected
  iteration_limit,  ///< stopped before the certificate was within the tolerance
  failed            ///< the solver broke down (numerically, or Ipopt's own error)
};
std::string to_string(QpStatus status);
std::string to_string(QpSolver solver);
/// Whether `ipopt` is in this build (SMOOTHPOST_WITH_IPOPT).
bool ipopt_available();

/// How far a point with multipliers is from satisfying the optimality conditions; computed from the
/// programme alone, by none of the solvers. All numbers in the programme's scaled units; all
/// infinite when the solution is not finite.
struct QpCertificate {
  double stationarity = 0.0;  ///< largest |gradient of the Lagrangian| / (1 + largest |its terms|)
  double violation = 0.0;     ///< largest violation of an equation, bound or row
  double complementarity = 0.0;  ///< largest multiplier · slack / (1 + |objective|)
  double sign = 0.0;             ///< largest wrong-signed multiplier
  double kkt() const;            ///< the largest of the four
};

struct QpSolution {
  QpStatus status = QpStatus::failed;
  QpSolver solver = QpSolver::banded;
  Eigen::VectorXd x;                         ///< lifted variables, scaled
  double tau = 0.0;                          ///< with a relaxation
  Eigen::VectorXd bound_lower, bound_upper;  ///< multipliers ≥ 0, one a variable
  Eigen::VectorXd row_lower, row_upper;      ///< multipliers ≥ 0, one a row
  double objective = 0.0;                    ///< with the constant, without cost·τ
  int iterations = 0;
  int windows = 1;  ///< that it was solved in (hybrid_solver.h)
  QpCertificate certificate;
  std::string message;  ///< the solver's own word when it failed
};

struct QpSettings {
  QpSolver solver = QpSolver::banded;
  double tolerance = 1e-9;  ///< of the certificate
  int max_iterations = 100;
  const QpSolution* start =
      nullptr;  ///< x and multipliers to start from, of the same layout and rows
};

/// Solves a programme.
///
/// `banded`: Mehrotra's predictor-corrector interior point whose linear systems are solved by a
/// recursion along the spline's pieces (O(spans·local³), no fill, no pivoting).
/// `ipopt`: the same programme as a sparse NLP with constant derivatives, Ipopt's Mehrotra mode.
/// Deterministic. Not for two threads at once with `ipopt` (MUMPS is not thread-safe).
///
/// @return the solution with its certificate recomputed by certify(); status optimal only when
/// certificate.kkt() ≤ 10·tolerance for banded, ≤ 100·tolerance for ipopt.
QpSolution solve_qp(const QuadraticProgram& qp, const QpSettings& settings = {});

/// Recomputes how far x and the multipliers of a solution are from optimal. The multipliers of the
/// layout's equations are eliminated: those that fit stationarity best (least squares). Lower equal
/// to upper and giving way by no weight: any difference of its two multipliers is right.
/// Cost: linear, about 0.8 µs a control point.   @throws ContractViolation when sizes differ.
QpCertificate certify(const QuadraticProgram& qp, const QpSolution& solution);

/// What keeps a programme from being feasible.
struct QpFeasibility {
  bool feasible = false;
  double shortfall = 0.0;  ///< least τ with every limit relaxed by weight·τ; ≤ 0: feasible
  std::string_view name;   ///< of the row that counts most at the least τ; "bound" for a bound
  int channel = 0;         ///< of that bound
  int level = 0;           ///< of that bound: 0 position, 1 velocity, 2 acceleration, 3 jerk
  double place = 0.0;      ///< u of it
  /// At the least τ: strictly inside when feasible with room. Its certificate is that of the
  /// elastic programme in the units in which it was solved.
  QpSolution solution;
};

/// Decides feasibility by the elastic form: least τ with every row and bound that is no equation
/// relaxed by τ (row_weight, bound_weight of qp.relaxation, or 1). Always by the banded solver.
/// Levels and rows may be in any units: the programme is solved in units in which its limits are of
/// the order of 1 (equilibrate.h). Weights that are not given are 1 in those units, which are the
/// given ones as far as these are within 32 times of them. Where the solver has no answer in those
/// units it is asked again in the given ones.
QpFeasibility feasibility(const QuadraticProgram& qp, const QpSettings& settings = {});

}  // namespace smoothpost
