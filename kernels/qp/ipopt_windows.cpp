#include "kernels/qp/ipopt_windows.h"

#include <algorithm>

#include "kernels/core/contract.h"
#include "kernels/qp/ipopt_solver.h"
#include "kernels/qp/layout_equations.h"

namespace smoothpost {

namespace {

constexpr int kLeast = 16;           // control points of a window
constexpr double kSharper = 1e-3;    // than the tolerance of the whole: windows have to fit
constexpr double kAccurate = 100.0;  // certificate of an optimum, in tolerances

/// Control points first … last − 1 of every channel.
struct Range {
  int first = 0, last = 0;
};

/// Place of every variable along the spline, in control points.
std::vector<double> places_of_variables(const SplineLayout& layout) {
  std::vector<double> place(static_cast<std::size_t>(layout.size()));
  for (int c = 0; c < layout.channels; ++c)
    for (int l = 0; l <= layout.levels; ++l)
      for (int j = 0; j < layout.count(l); ++j)
        place[static_cast<std::size_t>(layout.index(c, l, j))] = j + 0.5 * l;
  return place;
}

/// T^l_j hangs on control points j … j + l: free where one of them is.
std::vector<int> free_variables(const SplineLayout& layout, const Range& window) {
  std::vector<int> list;
  for (int c = 0; c < layout.channels; ++c)
    for (int l = 0; l <= layout.levels; ++l)
      for (int j = std::max(0, window.first - l); j < std::min(layout.count(l), window.last); ++j)
        list.push_back(layout.index(c, l, j));
  std::sort(list.begin(), list.end());
  return list;
}

/// A sparse programme with all but some variables held.
struct HeldProgram {
  SparseProgram program;
  std::vector<int> variables, rows;  ///< of the whole programme
};

/// Entries of the whole programme by column (matrix) or by either index (hessian).
struct Entries {
  std::vector<std::vector<SparseEntry>> hessian, matrix_rows;
  std::vector<std::vector<int>> rows_of_column;

  explicit Entries(const SparseProgram& p)
      : hessian(static_cast<std::size_t>(p.variables())),
        matrix_rows(static_cast<std::size_t>(p.rows())),
        rows_of_column(static_cast<std::size_t>(p.variables())) {
    for (const SparseEntry& e : p.hessian) {
      hessian[static_cast<std::size_t>(e.column)].push_back(e);
      if (e.row != e.column)
        hessian[static_cast<std::size_t>(e.row)].push_back({e.column, e.row, e.value});
    }
    for (const SparseEntry& e : p.matrix) {
      matrix_rows[static_cast<std::size_t>(e.row)].push_back(e);
      rows_of_column[static_cast<std::size_t>(e.column)].push_back(e.row);
    }
  }
};

HeldProgram held_outside(const SparseProgram& whole, const Entries& entries,
                         const Eigen::VectorXd& x, const std::vector<int>& variables) {
  HeldProgram out;
  out.variables = variables;
  const auto n = static_cast<Eigen::Index>(variables.size());
  out.program.gradient.resize(n);
  out.program.lower.resize(n);
  out.program.upper.resize(n);
  const auto own = [&](int variable) {
    const auto at = std::lower_bound(variables.begin(), variables.end(), variable);
    return at != variables.end() && *at == variable ? static_cast<int>(at - variables.begin()) : -1;
  };
  for (int k = 0; k < static_cast<int>(n); ++k) {
    const int i = variables[static_cast<std::size_t>(k)];
    out.program.gradient[k] = whole.gradient[i];
    out.program.lower[k] = whole.lower[i];
    out.program.upper[k] = whole.upper[i];
    for (const SparseEntry& e : entries.hessian[static_cast<std::size_t>(i)]) {
      const int row = own(e.row);
      if (row < 0)
        out.program.gradient[k] += e.value * x[e.row];
      else if (row >= k)
        out.program.hessian.push_back({row, k, e.value});
    }
    for (const int r : entries.rows_of_column[static_cast<std::size_t>(i)]) out.rows.push_back(r);
  }
  std::sort(out.rows.begin(), out.rows.end());
  out.rows.erase(std::unique(out.rows.begin(), out.rows.end()), out.rows.end());
  for (const int r : out.rows) {
    const auto at = static_cast<std::size_t>(r);
    double held = 0.0;
    for (const SparseEntry& e : entries.matrix_rows[at]) {
      const int column = own(e.column);
      if (column < 0)
        held += e.value * x[e.column];
      else
        out.program.matrix.push_back({out.program.rows(), column, e.value});
    }
    out.program.row_lower.push_back(whole.row_lower[at] - held);
    out.program.row_upper.push_back(whole.row_upper[at] - held);
    out.program.origin.push_back(whole.origin[at]);
  }
  return out;
}

SparsePoint part_of(const SparsePoint& whole, const HeldProgram& held) {
  const auto n = static_cast<Eigen::Index>(held.variables.size());
  const auto m = static_cast<Eigen::Index>(held.rows.size());
  SparsePoint out{Eigen::VectorXd(n), Eigen::VectorXd(n), Eigen::VectorXd(n), Eigen::VectorXd(m)};
  for (Eigen::Index k = 0; k < n; ++k) {
    const int i = held.variables[static_cast<std::size_t>(k)];
    out.x[k] = whole.x[i];
    out.z_lower[k] = whole.z_lower[i];
    out.z_upper[k] = whole.z_upper[i];
  }
  for (Eigen::Index k = 0; k < m; ++k)
    out.lambda[k] = whole.lambda[held.rows[static_cast<std::size_t>(k)]];
  return out;
}

}  // namespace

QpSolution solve_by_windows(const QuadraticProgram& qp, const QpSettings& settings,
                            const QpSolution& start, const QpWindows& windows) {
  require(!qp.relaxation, "windows: no relaxation");
  require(windows.controls >= kLeast && windows.overlap >= 0, "windows of 16 control points");
  const SparseProgram whole = sparse_program(qp);
  const Entries entries(whole);
  const std::vector<double> place = places_of_variables(qp.layout);
  SparsePoint point = to_sparse(qp, whole, start);
  QpSettings sharp = settings;
  sharp.tolerance *= kSharper;
  const int controls = qp.layout.controls();
  const int count = (controls + windows.controls - 1) / windows.controls;
  QpSolution out;
  out.windows = count;
  std::string told;
  // A row of the sparse programme lies where its last variable does.
  std::vector<double> row_place(static_cast<std::size_t>(whole.rows()), 0.0);
  for (const SparseEntry& e : whole.matrix) {
    double& at = row_place[static_cast<std::size_t>(e.row)];
    at = std::max(at, place[static_cast<std::size_t>(e.column)]);
  }
  const auto edge = [&](int k) {
    return static_cast<int>(static_cast<long long>(controls) * k / count);
  };
  for (int k = 0; k < count; ++k) {
    const Range own{edge(k), edge(k + 1)};
    const Range window{std::max(0, own.first - windows.overlap),
                       std::min(controls, own.last + windows.overlap)};
    const HeldProgram held =
        held_outside(whole, entries, point.x, free_variables(qp.layout, window));
    const SparsePoint from = part_of(point, held);
    const IpoptAnswer answer = ask_ipopt(held.program, &from, sharp);
    out.iterations += answer.iterations;
    if (!answer.point || answer.status == QpStatus::infeasible ||
        answer.status == QpStatus::failed) {
      out.status = answer.status;
      told = "window " + std::to_string(k + 1) + " of " + std::to_string(count) +
             ": Ipopt: " + answer.word;
      break;
    }
    // Around where its own part starts it takes over from the window before, bit by bit: rigid ends
    // bend the multipliers beside them.
    const auto share = [&](double at) {
      if (k == 0) return 1.0;
      return std::clamp(0.5 + (at - own.first) / std::max(1, windows.overlap), 0.0, 1.0);
    };
    const auto take = [](double& value, double next, double weight) {
      value += weight * (next - value);
    };
    for (std::size_t v = 0; v < held.variables.size(); ++v) {
      const int i = held.variables[v];
      const auto e = static_cast<Eigen::Index>(v);
      const double weight = share(place[static_cast<std::size_t>(i)]);
      take(point.x[i], answer.point->x[e], weight);
      take(point.z_lower[i], answer.point->z_lower[e], weight);
      take(point.z_upper[i], answer.point->z_upper[e], weight);
    }
    for (std::size_t r = 0; r < held.rows.size(); ++r)
      take(point.lambda[held.rows[r]], answer.point->lambda[static_cast<Eigen::Index>(r)],
           share(row_place[static_cast<std::size_t>(held.rows[r])]));
  }
  const int iterations = out.iterations, number = out.windows;
  const QpStatus failed = out.status;
  out = from_sparse(qp, whole, point);
  out.solver = QpSolver::ipopt;
  out.iterations = iterations;
  out.windows = number;
  out.objective = objective_value(qp, out.x);
  out.certificate = certify(qp, out);
  const bool certified = told.empty() && out.certificate.kkt() <= kAccurate * settings.tolerance;
  out.status = certified ? QpStatus::optimal : told.empty() ? QpStatus::iteration_limit : failed;
  out.message = told;
  return out;
}

}  // namespace smoothpost
