#include "kernels/qp/hybrid_solver.h"

#include <cmath>

#include "kernels/qp/ipopt_solver.h"
#include "kernels/qp/ipopt_windows.h"

namespace smoothpost {

namespace {

constexpr double kNear = 1e-3;      // slack of a row that is kept
constexpr double kWeighty = 1e-7;   // multiplier of a row that is kept
constexpr double kViolated = 1e-9;  // a row that was left out and has to be added
constexpr int kMostRounds = 6;
constexpr double kAccurate = 100.0;  // certificate of an optimum, in tolerances
constexpr int kOverlap = 64;         // control points that a window has of its neighbour

/// The programme with the rows of `kept` alone, and which rows those are.
QuadraticProgram with_rows(const QuadraticProgram& qp, const std::vector<bool>& kept,
                           std::vector<int>& which) {
  which.clear();
  for (int r = 0; r < qp.row_count(); ++r)
    if (kept[static_cast<std::size_t>(r)]) which.push_back(r);
  const Eigen::Index n = static_cast<Eigen::Index>(which.size());
  QuadraticProgram out = qp;
  out.rows.resize(qp.rows.rows(), n);
  out.row_lower.resize(n);
  out.row_upper.resize(n);
  out.row_span.clear();
  out.row_name.clear();
  out.row_place.clear();
  for (Eigen::Index k = 0; k < n; ++k) {
    const int r = which[static_cast<std::size_t>(k)];
    out.rows.col(k) = qp.rows.col(r);
    out.row_lower[k] = qp.row_lower[r];
    out.row_upper[k] = qp.row_upper[r];
    out.row_span.push_back(qp.row_span[static_cast<std::size_t>(r)]);
    out.row_name.push_back(qp.row_name[static_cast<std::size_t>(r)]);
    out.row_place.push_back(qp.row_place[static_cast<std::size_t>(r)]);
  }
  return out;
}

std::vector<bool> near_rows(const QuadraticProgram& qp, const QpSolution& banded) {
  const Eigen::VectorXd value = row_values(qp, banded.x);
  std::vector<bool> kept(static_cast<std::size_t>(qp.row_count()));
  for (int r = 0; r < qp.row_count(); ++r)
    kept[static_cast<std::size_t>(r)] =
        value[r] - qp.row_lower[r] < kNear || qp.row_upper[r] - value[r] < kNear ||
        banded.row_lower[r] > kWeighty || banded.row_upper[r] > kWeighty;
  return kept;
}

QpSolution restricted(const QpSolution& s, const std::vector<int>& which) {
  QpSolution out = s;
  out.row_lower.resize(static_cast<Eigen::Index>(which.size()));
  out.row_upper.resize(static_cast<Eigen::Index>(which.size()));
  for (std::size_t k = 0; k < which.size(); ++k) {
    out.row_lower[static_cast<Eigen::Index>(k)] = s.row_lower[which[k]];
    out.row_upper[static_cast<Eigen::Index>(k)] = s.row_upper[which[k]];
  }
  return out;
}

QpSolution extended(QpSolution s, const std::vector<int>& which, int rows) {
  const Eigen::VectorXd lower = s.row_lower, upper = s.row_upper;
  s.row_lower = s.row_upper = Eigen::VectorXd::Zero(rows);
  for (std::size_t k = 0; k < which.size(); ++k) {
    s.row_lower[which[k]] = lower[static_cast<Eigen::Index>(k)];
    s.row_upper[which[k]] = upper[static_cast<Eigen::Index>(k)];
  }
  return s;
}

QpSolution solve_rows(const QuadraticProgram& qp, const QpSettings& settings,
                      const QpSolution& start, int most) {
  const int controls = qp.layout.channels * qp.layout.controls();
  if (controls <= most || qp.relaxation) return solve_by_ipopt(qp, settings);
  return solve_by_windows(qp, settings, start, {most / (2 * qp.layout.channels), kOverlap});
}

QpSolution solve_near(const QuadraticProgram& qp, const QpSettings& settings,
                      const QpSolution& banded, int most) {
  std::vector<bool> kept = near_rows(qp, banded);
  QpSolution out;
  int iterations = 0;
  for (int round = 0; round < kMostRounds; ++round) {
    std::vector<int> which;
    const QuadraticProgram part = with_rows(qp, kept, which);
    const QpSolution from = restricted(banded, which);
    QpSettings s = settings;
    s.solver = QpSolver::ipopt;
    s.start = &from;
    out = solve_rows(part, s, from, most);
    iterations += out.iterations;
    out.iterations = iterations;
    if (out.status != QpStatus::optimal) return extended(std::move(out), which, qp.row_count());
    out = extended(std::move(out), which, qp.row_count());
    const Eigen::VectorXd value = row_values(qp, out.x);
    bool added = false;
    for (int r = 0; r < qp.row_count(); ++r) {
      const double miss = std::max(qp.row_lower[r] - value[r], value[r] - qp.row_upper[r]);
      if (miss <= kViolated || kept[static_cast<std::size_t>(r)]) continue;
      kept[static_cast<std::size_t>(r)] = added = true;
    }
    if (!added) break;
  }
  out.certificate = certify(qp, out);
  if (out.certificate.kkt() > kAccurate * settings.tolerance) out.status = QpStatus::failed;
  return out;
}

}  // namespace

QpSolution solve_by_hybrid(const QuadraticProgram& qp, const QpSettings& settings,
                           const QpSolution& banded, int most) {
  if (!ipopt_available()) return banded;
  return solve_near(qp, settings, banded, most);
}

}  // namespace smoothpost
