#pragma once

// Needs SMOOTHPOST_WITH_IPOPT and Ipopt's headers.
#include <IpIpoptApplication.hpp>
#include <IpSolveStatistics.hpp>
#include <IpTNLP.hpp>
#include <ctime>

#include "tests/kernels/schedule/feed_transcription.h"

namespace smoothpost::test {

/// What Ipopt asks about a FeedTranscription, with exact first and second derivatives.
class FeedNlp : public Ipopt::TNLP {
 public:
  FeedNlp(const FeedTranscription& problem, std::vector<double> start)
      : problem_(problem), n_(problem.controls()), x_(std::move(start)) {}

  const std::vector<double>& controls() const { return x_; }

  bool get_nlp_info(int& n, int& m, int& jacobian, int& hessian, IndexStyleEnum& style) override {
    n = n_;
    m = static_cast<int>(problem_.rows.size());
    jacobian = 4 * m;
    hessian = 4 * n_ - 6;
    style = C_STYLE;
    return true;
  }

  bool get_bounds_info(int n, double* lower, double* upper, int m, double* row_lower,
                       double* row_upper) override {
    std::fill(lower, lower + n, -1e20);
    std::fill(upper, upper + n, 1e20);
    std::fill(row_lower, row_lower + m, -1.0);
    std::fill(row_upper, row_upper + m, 1.0);
    return true;
  }

  bool get_starting_point(int, bool, double* x, bool, double*, double*, int, bool,
                          double*) override {
    std::copy(x_.begin(), x_.end(), x);
    return true;
  }

  bool eval_f(int, const double* x, bool, double& value) override {
    value = 0.0;
    for (const auto& point : problem_.points) {
      const double b = point.of(x)[0];
      if (!(b > 0.0)) return false;
      value += point.weight / std::sqrt(b);
    }
    return true;
  }

  bool eval_grad_f(int n, const double* x, bool, double* gradient) override {
    std::fill(gradient, gradient + n, 0.0);
    for (const auto& point : problem_.points) {
      const double b = point.of(x)[0];
      if (!(b > 0.0)) return false;
      for (int j = 0; j < 4; ++j)
        gradient[point.first + j] -= 0.5 * point.weight * point.basis[0][j] / (b * std::sqrt(b));
    }
    return true;
  }

  bool eval_g(int, const double* x, bool, int m, double* values) override {
    for (int r = 0; r < m; ++r) {
      const auto& row = problem_.rows[r];
      const auto v = problem_.points[row.point].of(x);
      if (!(v[0] > 0.0)) return false;
      values[r] = row.at(v);
    }
    return true;
  }

  bool eval_jac_g(int, const double* x, bool, int m, int, int* rows, int* columns,
                  double* values) override {
    for (int r = 0; r < m; ++r) {
      const auto& row = problem_.rows[r];
      const auto& point = problem_.points[row.point];
      std::array<double, 3> g{};
      if (values) {
        const auto v = point.of(x);
        if (!(v[0] > 0.0)) return false;
        g = row.gradient(v);
      }
      for (int j = 0; j < 4; ++j) {
        if (values) {
          values[4 * r + j] =
              g[0] * point.basis[0][j] + g[1] * point.basis[1][j] + g[2] * point.basis[2][j];
        } else {
          rows[4 * r + j] = r;
          columns[4 * r + j] = point.first + j;
        }
      }
    }
    return true;
  }

  bool eval_h(int n, const double* x, bool, double factor, int m, const double* lambda, bool,
              int size, int* rows, int* columns, double* values) override {
    if (!values) {
      for (int i = 0, at = 0; i < n; ++i)
        for (int d = 0; d <= std::min(i, 3); ++d, ++at) {
          rows[at] = i;
          columns[at] = i - d;
        }
      return true;
    }
    std::fill(values, values + size, 0.0);
    std::vector<std::array<double, 3>> bends(problem_.points.size());
    for (int r = 0; r < m; ++r) {
      const auto& row = problem_.rows[r];
      const auto bend = row.bend(problem_.points[row.point].of(x));
      for (int k = 0; k < 3; ++k) bends[row.point][k] += lambda[r] * bend[k];
    }
    for (std::size_t p = 0; p < bends.size(); ++p) {
      const auto& point = problem_.points[p];
      const double b = point.of(x)[0];
      bends[p][0] += factor * 0.75 * point.weight / (b * b * std::sqrt(b));
      for (int j = 0; j < 4; ++j)
        for (int k = 0; k <= j; ++k) {
          const auto& m0 = point.basis[0];
          double h = bends[p][0] * m0[j] * m0[k];
          for (int order = 1; order < 3; ++order) {
            const auto& mo = point.basis[order];
            h += bends[p][order] * (m0[j] * mo[k] + mo[j] * m0[k]);
          }
          values[entry(point.first + j, j - k)] += h;
        }
    }
    return true;
  }

  void finalize_solution(Ipopt::SolverReturn, int n, const double* x, const double*, const double*,
                         int, const double*, const double*, double, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {
    x_.assign(x, x + n);
  }

 private:
  /// The place of (i, i − d) among the entries of the lower band.
  static int entry(int i, int d) { return i < 4 ? i * (i + 1) / 2 + d : 4 * i - 6 + d; }

  const FeedTranscription& problem_;
  int n_;
  std::vector<double> x_;
};

struct IpoptLaw {
  bool solved = false;
  double time = 0.0;  ///< ∫ b^{−1/2} dw
  std::vector<double> controls;
  int iterations = 0;
  double seconds = 0.0;  ///< of processor time
};

struct IpoptLawSettings {
  double tolerance = 1e-10;  ///< scaled; the gap is this times the rows
  double barrier = 0.1;      ///< at the start; small for a start near the solution
};

inline IpoptLaw solve_by_ipopt(const FeedTranscription& problem, std::vector<double> start,
                               const IpoptLawSettings& settings) {
  IpoptLaw law;
  const std::clock_t begin = std::clock();
  Ipopt::SmartPtr<FeedNlp> nlp = new FeedNlp(problem, std::move(start));
  Ipopt::SmartPtr<Ipopt::IpoptApplication> application = new Ipopt::IpoptApplication(false);
  const auto options = application->Options();
  options->SetIntegerValue("print_level", 0);
  options->SetStringValue("sb", "yes");
  options->SetStringValue("linear_solver", "mumps");
  options->SetIntegerValue("mumps_pivot_order", 6);  // the same digits every time
  options->SetNumericValue("tol", settings.tolerance);
  options->SetNumericValue("mu_init", settings.barrier);
  options->SetNumericValue("bound_relax_factor", 0.0);
  options->SetIntegerValue("max_iter", 500);
  application->Initialize("");  // an empty name: no option file
  const auto status = application->OptimizeTNLP(GetRawPtr(nlp));
  law.seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  law.solved = status == Ipopt::Solve_Succeeded;
  law.controls = nlp->controls();
  law.time = problem.time(law.controls);
  if (IsValid(application->Statistics()))
    law.iterations = application->Statistics()->IterationCount();
  return law;
}

}  // namespace smoothpost::test
