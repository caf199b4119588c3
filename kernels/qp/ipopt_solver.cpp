#include "kernels/qp/ipopt_solver.h"

#ifdef SMOOTHPOST_WITH_IPOPT

#include <IpIpoptApplication.hpp>
#include <IpSolveStatistics.hpp>
#include <IpTNLP.hpp>
#include <algorithm>
#include <mutex>

namespace smoothpost {
namespace {

using Ipopt::Index;
using Ipopt::Number;

/// What Ipopt asks about a SparseProgram. Lives as long as Ipopt's pointer to it; the programme and
/// the point outlive it.
class SparseNlp : public Ipopt::TNLP {
 public:
  SparseNlp(const SparseProgram& program, const SparsePoint* start)
      : program_(program), start_(start) {}

  const SparsePoint& point() const { return point_; }
  bool ended() const { return point_.x.size() > 0; }

  bool get_nlp_info(Index& n, Index& m, Index& jacobian_size, Index& hessian_size,
                    IndexStyleEnum& style) override {
    n = program_.variables();
    m = program_.rows();
    jacobian_size = static_cast<Index>(program_.matrix.size());
    hessian_size = static_cast<Index>(program_.hessian.size());
    style = C_STYLE;
    return true;
  }

  bool get_bounds_info(Index, Number* lower, Number* upper, Index, Number* row_lower,
                       Number* row_upper) override {
    const auto limited = [](double value) { return std::clamp(value, -kNoLimit, kNoLimit); };
    std::transform(program_.lower.begin(), program_.lower.end(), lower, limited);
    std::transform(program_.upper.begin(), program_.upper.end(), upper, limited);
    std::transform(program_.row_lower.begin(), program_.row_lower.end(), row_lower, limited);
    std::transform(program_.row_upper.begin(), program_.row_upper.end(), row_upper, limited);
    return true;
  }

  bool get_starting_point(Index, bool, Number* x, bool wants_z, Number* z_lower, Number* z_upper,
                          Index, bool wants_lambda, Number* lambda) override {
    if (!start_) {
      for (Index i = 0; i < program_.variables(); ++i) {
        x[i] = std::min(std::max(0.0, program_.lower(i)), program_.upper(i));
      }
      return !wants_z && !wants_lambda;
    }
    std::copy(start_->x.begin(), start_->x.end(), x);
    if (wants_z) {
      std::copy(start_->z_lower.begin(), start_->z_lower.end(), z_lower);
      std::copy(start_->z_upper.begin(), start_->z_upper.end(), z_upper);
    }
    if (wants_lambda) std::copy(start_->lambda.begin(), start_->lambda.end(), lambda);
    return true;
  }

  bool eval_f(Index, const Number* x, bool, Number& value) override {
    value = 0.0;
    for (Index i = 0; i < program_.variables(); ++i) value += program_.gradient(i) * x[i];
    for (const SparseEntry& e : program_.hessian) {
      value += (e.row == e.column ? 0.5 : 1.0) * e.value * x[e.row] * x[e.column];
    }
    return true;
  }

  bool eval_grad_f(Index, const Number* x, bool, Number* gradient) override {
    std::copy(program_.gradient.begin(), program_.gradient.end(), gradient);
    for (const SparseEntry& e : program_.hessian) {
      gradient[e.row] += e.value * x[e.column];
      if (e.row != e.column) gradient[e.column] += e.value * x[e.row];
    }
    return true;
  }

  bool eval_g(Index, const Number* x, bool, Index m, Number* values) override {
    std::fill(values, values + m, 0.0);
    for (const SparseEntry& e : program_.matrix) values[e.row] += e.value * x[e.column];
    return true;
  }

  bool eval_jac_g(Index, const Number*, bool, Index, Index, Index* rows, Index* columns,
                  Number* values) override {
    write(program_.matrix, rows, columns, values, 1.0);
    return true;
  }

  bool eval_h(Index, const Number*, bool, Number factor, Index, const Number*, bool, Index,
              Index* rows, Index* columns, Number* values) override {
    write(program_.hessian, rows, columns, values, factor);
    return true;
  }

  void finalize_solution(Ipopt::SolverReturn, Index n, const Number* x, const Number* z_lower,
                         const Number* z_upper, Index m, const Number*, const Number* lambda,
                         Number, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {
    using Values = Eigen::Map<const Eigen::VectorXd>;
    point_ = {Values(x, n), Values(z_lower, n), Values(z_upper, n), Values(lambda, m)};
  }

 private:
  static constexpr double kNoLimit = 1e20;  // Ipopt: 1e19 and beyond is no limit

  // Structure when Ipopt asks for it, else values.
  static void write(const std::vector<SparseEntry>& entries, Index* rows, Index* columns,
                    Number* values, double factor) {
    for (std::size_t k = 0; k < entries.size(); ++k) {
      if (values) {
        values[k] = factor * entries[k].value;
      } else {
        rows[k] = entries[k].row;
        columns[k] = entries[k].column;
      }
    }
  }

  const SparseProgram& program_;
  const SparsePoint* start_;
  SparsePoint point_;
};

void set_options(Ipopt::OptionsList& options, const QpSettings& settings, bool warm) {
  options.SetIntegerValue("print_level", 0);
  options.SetStringValue("sb", "yes");
  options.SetStringValue("linear_solver", "mumps");
  // MUMPS's own choice of an ordering takes twice the time from some thousand control points on,
  // and where it chooses SCOTCH or METIS a second run in the same process gives other digits. QAMD
  // is deterministic. docs/performance.md has the numbers.
  options.SetIntegerValue("mumps_pivot_order", 6);
  // In per cent of MUMPS's estimate; Ipopt's 1000 costs first touches of memory. It doubles at
  // need.
  options.SetIntegerValue("mumps_mem_percent", 100);
  options.SetStringValue("mehrotra_algorithm", "yes");
  options.SetStringValue("hessian_constant", "yes");
  options.SetStringValue("jac_c_constant", "yes");
  options.SetStringValue("jac_d_constant", "yes");
  options.SetNumericValue("bound_relax_factor", 0.0);
  options.SetStringValue("honor_original_bounds", "yes");
  options.SetNumericValue("tol", settings.tolerance);
  options.SetIntegerValue("max_iter", settings.max_iterations);
  if (warm) options.SetStringValue("warm_start_init_point", "yes");
}

const char* name_of(Ipopt::ApplicationReturnStatus status) {
  switch (status) {
    case Ipopt::Solve_Succeeded:
      return "Solve_Succeeded";
    case Ipopt::Solved_To_Acceptable_Level:
      return "Solved_To_Acceptable_Level";
    case Ipopt::Infeasible_Problem_Detected:
      return "Infeasible_Problem_Detected";
    case Ipopt::Search_Direction_Becomes_Too_Small:
      return "Search_Direction_Becomes_Too_Small";
    case Ipopt::Diverging_Iterates:
      return "Diverging_Iterates";
    case Ipopt::Maximum_Iterations_Exceeded:
      return "Maximum_Iterations_Exceeded";
    case Ipopt::Restoration_Failed:
      return "Restoration_Failed";
    case Ipopt::Error_In_Step_Computation:
      return "Error_In_Step_Computation";
    case Ipopt::Not_Enough_Degrees_Of_Freedom:
      return "Not_Enough_Degrees_Of_Freedom";
    case Ipopt::Invalid_Problem_Definition:
      return "Invalid_Problem_Definition";
    case Ipopt::Invalid_Number_Detected:
      return "Invalid_Number_Detected";
    case Ipopt::Insufficient_Memory:
      return "Insufficient_Memory";
    default:
      return "Internal_Error";
  }
}

QpStatus status_of(Ipopt::ApplicationReturnStatus status) {
  switch (status) {
    case Ipopt::Solve_Succeeded:
      return QpStatus::optimal;
    case Ipopt::Infeasible_Problem_Detected:
      return QpStatus::infeasible;
    case Ipopt::Solved_To_Acceptable_Level:
    case Ipopt::Search_Direction_Becomes_Too_Small:
    case Ipopt::Maximum_Iterations_Exceeded:
      return QpStatus::iteration_limit;
    default:
      return QpStatus::failed;
  }
}

}  // namespace

// Its own exceptions and those of its libraries end as a message.
IpoptAnswer ask_ipopt(const SparseProgram& program, const SparsePoint* start,
                      const QpSettings& settings) {
  Ipopt::SmartPtr<SparseNlp> nlp = new SparseNlp(program, start);
  Ipopt::ApplicationReturnStatus status = Ipopt::Internal_Error;
  IpoptAnswer out;
  // Ipopt 3.11 and MUMPS keep state of the process: one solve at a time, whichever thread asks.
  static std::mutex one_at_a_time;
  const std::lock_guard<std::mutex> alone(one_at_a_time);
  try {
    Ipopt::SmartPtr<Ipopt::IpoptApplication> application = new Ipopt::IpoptApplication(false);
    set_options(*application->Options(), settings, start != nullptr);
    status = application->Initialize("");  // an empty name: no option file
    if (status == Ipopt::Solve_Succeeded) status = application->OptimizeTNLP(GetRawPtr(nlp));
    out.word = name_of(status);
    if (IsValid(application->Statistics())) {
      out.iterations = application->Statistics()->IterationCount();
    }
  } catch (const std::exception& error) {
    out.word = error.what();
  } catch (const Ipopt::IpoptException& error) {
    out.word = error.Message();
  } catch (...) {
    out.word = "unknown exception";
  }
  out.status = status_of(status);
  if (nlp->ended()) out.point = nlp->point();
  return out;
}

bool ipopt_available() { return true; }

}  // namespace smoothpost

#else

namespace smoothpost {

bool ipopt_available() { return false; }

IpoptAnswer ask_ipopt(const SparseProgram&, const SparsePoint*, const QpSettings&) {
  IpoptAnswer out;
  out.word = "built without Ipopt (SMOOTHPOST_WITH_IPOPT=OFF); use the banded solver";
  return out;
}

}  // namespace smoothpost

#endif

namespace smoothpost {
namespace {

SparsePoint zero_point(const SparseProgram& program) {
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(program.variables());
  return {zero, zero, zero, Eigen::VectorXd::Zero(program.rows())};
}

}  // namespace

QpSolution solve_by_ipopt(const QuadraticProgram& qp, const QpSettings& settings) {
  const SparseProgram program = sparse_program(qp);
  SparsePoint start;
  if (settings.start) start = to_sparse(qp, program, *settings.start);
  const IpoptAnswer answer = ask_ipopt(program, settings.start ? &start : nullptr, settings);
  QpSolution solution = from_sparse(qp, program, answer.point.value_or(zero_point(program)));
  solution.certificate = certify(qp, solution);
  const bool certified = answer.point && solution.certificate.kkt() <= 100.0 * settings.tolerance;
  const bool unsure = answer.status == QpStatus::optimal && !certified;
  solution.status = certified ? QpStatus::optimal
                    : unsure  ? QpStatus::iteration_limit
                              : answer.status;
  solution.iterations = answer.iterations;
  if (!certified) solution.message = "Ipopt: " + answer.word;
  solution.solver = QpSolver::ipopt;
  solution.objective = objective_value(qp, solution.x);
  return solution;
}

}  // namespace smoothpost
