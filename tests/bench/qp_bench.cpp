#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>

#include "kernels/core/contract.h"
#include "kernels/qp/hybrid_solver.h"
#include "kernels/qp/qp_solver.h"
#include "kernels/spline/bspline_jerk.h"

#ifdef SMOOTHPOST_WITH_IPOPT
#include <IpIpoptApplication.hpp>
#include <IpSolveStatistics.hpp>
#include <IpTNLP.hpp>
#endif

// The Hessian of the squared jerk, and minimum jerk through twelve points under limits of every
// derivative by each solver. Argument: control points. Counters: iterations, the largest residual
// of the optimality conditions, and the objective in (unit of the points)²/s⁵ to compare answers.
namespace smoothpost {
namespace {

constexpr int kVia = 12;  // points, 1 s apart
constexpr double kDuration = kVia - 1;

/// The limits of the control points of every level, by u on unit spans.
using Limits = std::array<double, 4>;

/// Programmes and the numbers they were made of.
struct Problem {
  SplineKnots knots;
  std::vector<double> via;
  double seconds_a_span = 1.0;
  Limits limits{};
  QuadraticProgram limited;

  double via_place(int i) const {
    return i == kVia - 1 ? knots.last() : knots.last() * i / (kVia - 1);
  }
  /// Objective in (unit of the points)²/s⁵ from that of the programme.
  double physical(double objective) const {
    return objective * limits[3] * limits[3] * knots.spans() / std::pow(seconds_a_span, 5);
  }
};

/// Minimum jerk through the points from rest to rest, variables divided by `scale`, objective by
/// scale[3]²·spans, without limits.
QuadraticProgram unlimited(const Problem& problem, const Limits& scale) {
  SplineLayout layout = spline_layout(problem.knots, 3, 1);
  for (int level = 0; level <= 3; ++level) layout.scale(0, level) = scale[level];
  QuadraticProgram qp = empty_program(layout);
  add_derivative_cost(qp, 0, 3, 1.0 / (scale[3] * scale[3] * layout.spans()));
  for (int level = 1; level <= 2; ++level)
    for (int j : {0, layout.count(level) - 1})
      qp.lower[layout.index(0, level, j)] = qp.upper[layout.index(0, level, j)] = 0.0;
  std::vector<NewRow> rows;
  for (int i = 0; i < kVia; ++i) {
    NewRow row{local_row(layout, 0, problem.via_place(i), 0), 0.0, 0.0, "via",
               problem.via_place(i)};
    row.row.weights /= scale[0];
    row.lower = row.upper = problem.via[i] / scale[0];
    rows.push_back(std::move(row));
  }
  set_rows(qp, rows);
  return qp;
}

/// Twelve points uniform in ±100; velocity, acceleration and jerk at 0.92, 0.85 and 0.85 of the
/// largest control points without limits, positions within max(101, 0.97 of their largest).
Problem make_problem(int controls) {
  Problem problem;
  problem.knots = clamped_knots(5, controls - 5);
  problem.seconds_a_span = kDuration / problem.knots.spans();
  std::mt19937 random(1);
  for (int i = 0; i < kVia; ++i) problem.via.push_back(200.0 * (random() / 4294967296.0) - 100.0);
  Limits guess;
  for (int level = 0; level <= 3; ++level)
    guess[level] = 100.0 * std::pow(problem.seconds_a_span, level);
  const QuadraticProgram free = unlimited(problem, guess);
  const QpSolution optimum = solve_qp(free);
  require(optimum.status == QpStatus::optimal, "qp_bench: the programme without limits is solved");
  const Eigen::VectorXd& x = optimum.x;
  for (int level = 0; level <= 3; ++level)
    problem.limits[level] =
        x.segment(free.layout.index(0, level, 0), free.layout.count(level)).cwiseAbs().maxCoeff() *
        guess[level] *
        (level == 0   ? 0.97
         : level == 1 ? 0.92
                      : 0.85);
  problem.limits[0] = std::max(101.0, problem.limits[0]);
  problem.limited = unlimited(problem, problem.limits);
  for (int level = 0; level <= 3; ++level)
    limit_level(problem.limited, 0, level, problem.limits[level]);
  return problem;
}

const Problem& problem_of(std::int64_t controls) {
  static std::map<std::int64_t, Problem> problems;
  const auto [at, is_new] = problems.try_emplace(controls);
  if (is_new) at->second = make_problem(static_cast<int>(controls));
  return at->second;
}

void bm_hessian_any_spans(benchmark::State& state) {
  SplineKnots knots = clamped_knots(5, static_cast<int>(state.range(0)) - 5);
  std::mt19937 random(1);
  for (int i = 1; i < knots.spans(); ++i) knots.values[5 + i] += 0.5 * (random() / 4294967296.0);
  for (auto _ : state) benchmark::DoNotOptimize(derivative_gram(knots, 3).band.data());
}
BENCHMARK(bm_hessian_any_spans)
    ->Arg(100)
    ->Arg(628)
    ->Arg(5000)
    ->Arg(50000)
    ->Unit(benchmark::kMicrosecond);

void bm_hessian_quadrature(benchmark::State& state) {
  const SplineKnots knots = clamped_knots(5, static_cast<int>(state.range(0)) - 5);
  for (auto _ : state) benchmark::DoNotOptimize(derivative_gram(knots, 3).band.data());
}
BENCHMARK(bm_hessian_quadrature)
    ->Arg(100)
    ->Arg(628)
    ->Arg(5000)
    ->Arg(50000)
    ->Unit(benchmark::kMicrosecond);

void bm_hessian_unit_spans(benchmark::State& state) {
  const SplineKnots knots = clamped_knots(5, static_cast<int>(state.range(0)) - 5);
  for (auto _ : state) benchmark::DoNotOptimize(jerk_gram_unit_spans(knots).band.data());
}
BENCHMARK(bm_hessian_unit_spans)
    ->Arg(100)
    ->Arg(628)
    ->Arg(5000)
    ->Arg(50000)
    ->Unit(benchmark::kMicrosecond);

/// Making the programme: rows, costs and bounds.
void bm_programme(benchmark::State& state) {
  const Problem& problem = problem_of(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(unlimited(problem, problem.limits).hessian.data());
}
BENCHMARK(bm_programme)->Arg(100)->Arg(628)->Arg(5000)->Arg(50000)->Unit(benchmark::kMillisecond);

void solve(benchmark::State& state, QpSolver solver) {
  const Problem& problem = problem_of(state.range(0));
  QpSettings settings;
  settings.solver = solver;
  QpSolution solution;
  for (auto _ : state) {
    solution = solve_qp(problem.limited, settings);
    benchmark::DoNotOptimize(solution.x.data());
  }
  state.SetLabel(to_string(solution.status));
  state.counters["iterations"] = solution.iterations;
  state.counters["kkt"] = solution.certificate.kkt();
  state.counters["violation"] = solution.certificate.violation;
  state.counters["objective"] = problem.physical(solution.objective);
}

void bm_banded(benchmark::State& state) { solve(state, QpSolver::banded); }
BENCHMARK(bm_banded)->Arg(100)->Arg(628)->Arg(5000)->Arg(50000)->Unit(benchmark::kMillisecond);

#ifdef SMOOTHPOST_WITH_IPOPT

void bm_ipopt(benchmark::State& state) { solve(state, QpSolver::ipopt); }
BENCHMARK(bm_ipopt)->Arg(100)->Arg(628)->Arg(5000)->Unit(benchmark::kMillisecond);

// Ipopt's last word on what the banded solver has found; above kMostIpoptControls by windows.
void bm_hybrid(benchmark::State& state) {
  const Problem& problem = problem_of(state.range(0));
  const QpSolution banded = solve_qp(problem.limited);
  QpSolution solution;
  for (auto _ : state) solution = solve_by_hybrid(problem.limited, {}, banded);
  if (solution.status != QpStatus::optimal) state.SkipWithError("not optimal");
  state.counters["iterations"] = solution.iterations;
  state.counters["windows"] = solution.windows;
  state.counters["kkt"] = solution.certificate.kkt();
  state.counters["gain"] = banded.objective - solution.objective;
}
BENCHMARK(bm_hybrid)->Arg(628)->Arg(5000)->Arg(50000)->Unit(benchmark::kMillisecond);

/// The same programme written for Ipopt alone: x, v, a, j divided by their limits, the differences
/// as equations, limits as bounds, the Gram matrix of the quadratic basis as Hessian.
class BareNlp : public Ipopt::TNLP {
 public:
  explicit BareNlp(const Problem& problem)
      : n_(problem.knots.controls()),
        gram_(derivative_gram(derivative_knots(problem.knots, 3), 0)),
        weight_(1.0 / problem.knots.spans()),
        lower_(Eigen::VectorXd::Constant(4 * n_ - 6, -1.0)),
        upper_(Eigen::VectorXd::Constant(4 * n_ - 6, 1.0)) {
    for (int level : {1, 2})
      for (int j : {0, n_ - level - 1}) lower_[at(level, j)] = upper_[at(level, j)] = 0.0;
    for (int level = 1; level <= 3; ++level) {
      const std::vector<double> steps = derivative_steps(problem.knots, level);
      for (int j = 0; j < n_ - level; ++j) {
        entries_.push_back({rows_, at(level - 1, j + 1), 1.0});
        entries_.push_back({rows_, at(level - 1, j), -1.0});
        entries_.push_back(
            {rows_++, at(level, j), -steps[j] * problem.limits[level] / problem.limits[level - 1]});
      }
    }
    right_ = Eigen::VectorXd::Zero(rows_ + kVia);
    for (int i = 0; i < kVia; ++i) {
      const BasisRow row = bspline_basis(problem.knots, problem.via_place(i));
      right_[rows_] = problem.via[i] / problem.limits[0];
      for (int p = 0; p < row.weights.size(); ++p)
        entries_.push_back({rows_, row.first + p, row.weights[p]});
      ++rows_;
    }
  }

  double objective() const { return objective_; }

  bool get_nlp_info(int& n, int& m, int& jacobian, int& hessian, IndexStyleEnum& style) override {
    n = static_cast<int>(lower_.size());
    m = rows_;
    jacobian = static_cast<int>(entries_.size());
    hessian = 3 * (n_ - 3) - 3;
    style = C_STYLE;
    return true;
  }

  bool get_bounds_info(int, double* lower, double* upper, int, double* row_lower,
                       double* row_upper) override {
    std::copy(lower_.begin(), lower_.end(), lower);
    std::copy(upper_.begin(), upper_.end(), upper);
    std::copy(right_.begin(), right_.end(), row_lower);
    std::copy(right_.begin(), right_.end(), row_upper);
    return true;
  }

  bool get_starting_point(int n, bool, double* x, bool, double*, double*, int, bool,
                          double*) override {
    std::fill(x, x + n, 0.0);
    return true;
  }

  bool eval_f(int, const double* x, bool, double& value) override {
    const Eigen::Map<const Eigen::VectorXd> jerk(x + at(3, 0), n_ - 3);
    value = 0.5 * weight_ * jerk.dot(gram_.times(jerk));
    return true;
  }

  bool eval_grad_f(int n, const double* x, bool, double* gradient) override {
    std::fill(gradient, gradient + n, 0.0);
    const Eigen::Map<const Eigen::VectorXd> jerk(x + at(3, 0), n_ - 3);
    Eigen::Map<Eigen::VectorXd>(gradient + at(3, 0), n_ - 3) = weight_ * gram_.times(jerk);
    return true;
  }

  bool eval_g(int, const double* x, bool, int m, double* values) override {
    std::fill(values, values + m, 0.0);
    for (const Entry& e : entries_) values[e.row] += e.value * x[e.column];
    return true;
  }

  bool eval_jac_g(int, const double*, bool, int, int, int* rows, int* columns,
                  double* values) override {
    for (std::size_t e = 0; e < entries_.size(); ++e) {
      if (values) {
        values[e] = entries_[e].value;
      } else {
        rows[e] = entries_[e].row;
        columns[e] = entries_[e].column;
      }
    }
    return true;
  }

  bool eval_h(int, const double*, bool, double factor, int, const double*, bool, int, int* rows,
              int* columns, double* values) override {
    int e = 0;
    for (int j = 0; j < n_ - 3; ++j)
      for (int d = 0; d <= 2 && j + d < n_ - 3; ++d, ++e) {
        if (values) {
          values[e] = factor * weight_ * gram_.band(d, j);
        } else {
          rows[e] = at(3, j + d);
          columns[e] = at(3, j);
        }
      }
    return true;
  }

  void finalize_solution(Ipopt::SolverReturn, int, const double*, const double*, const double*, int,
                         const double*, const double*, double objective, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {
    objective_ = objective;
  }

 private:
  struct Entry {
    int row = 0;
    int column = 0;
    double value = 0.0;
  };

  int at(int level, int j) const { return level * n_ - level * (level - 1) / 2 + j; }

  int n_ = 0;
  SymmetricBand gram_;
  double weight_ = 1.0;
  Eigen::VectorXd lower_, upper_, right_;
  std::vector<Entry> entries_;
  int rows_ = 0;
  double objective_ = 0.0;
};

void bm_ipopt_bare(benchmark::State& state) {
  const Problem& problem = problem_of(state.range(0));
  double objective = 0.0;
  int iterations = 0;
  for (auto _ : state) {
    Ipopt::SmartPtr<BareNlp> nlp = new BareNlp(problem);
    Ipopt::SmartPtr<Ipopt::IpoptApplication> application = new Ipopt::IpoptApplication(false);
    application->Options()->SetIntegerValue("print_level", 0);
    application->Options()->SetStringValue("sb", "yes");
    application->Options()->SetStringValue("linear_solver", "mumps");
    application->Options()->SetStringValue("mehrotra_algorithm", "yes");
    application->Options()->SetStringValue("hessian_constant", "yes");
    application->Options()->SetStringValue("jac_c_constant", "yes");
    application->Options()->SetStringValue("jac_d_constant", "yes");
    application->Options()->SetNumericValue("bound_relax_factor", 0.0);
    application->Options()->SetNumericValue("tol", 1e-9);
    application->Initialize("");
    if (application->OptimizeTNLP(GetRawPtr(nlp)) != Ipopt::Solve_Succeeded) {
      state.SkipWithError("Ipopt did not succeed");
      return;
    }
    objective = nlp->objective();
    iterations = application->Statistics()->IterationCount();
  }
  state.counters["iterations"] = iterations;
  state.counters["objective"] = problem.physical(objective);
}
BENCHMARK(bm_ipopt_bare)->Arg(100)->Arg(628)->Arg(5000)->Unit(benchmark::kMillisecond);

#endif

}  // namespace
}  // namespace smoothpost

BENCHMARK_MAIN();
