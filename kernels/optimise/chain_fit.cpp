#include "kernels/optimise/chain_fit.h"

#include <nlopt.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

constexpr double kStepLength = 1e-4;  // mm, of the central differences
constexpr double kStepAngle = 1e-6;   // rad
constexpr double kLastStep = 1e-10;   // mm in the scaled coordinates
constexpr double kSmallGradient = 1e-6;
constexpr double kHiddenComponent = 0.1;
constexpr int kMostEvaluations = 300;

/// Two unit vectors at right angles to `d` and each other; axes of M where d is one.
std::pair<Vec3, Vec3> across(const Vec3& d) {
  Eigen::Index least = 0;
  d.cwiseAbs().minCoeff(&least);
  Vec3 first = Vec3::Unit(least);
  first = (first - d * d.dot(first)).normalized();
  Vec3 second = d.cross(first);
  Eigen::Index largest = 0;
  second.cwiseAbs().maxCoeff(&largest);
  if (second[largest] < 0.0) second = -second;
  return {first, second};
}

std::vector<FitUnknown> unknowns_of(const ScrewChain& chain,
                                    const std::vector<FitParameter>& parameters) {
  std::vector<FitUnknown> out;
  for (const FitParameter& p : parameters) {
    if (p.kind == FitParameter::Kind::tip) {
      for (int i = 0; i < 3; ++i) out.push_back({p, Vec3::Unit(i), 0.0, 0.0});
      continue;
    }
    require(p.joint >= 0 && p.joint < chain.size(), "a parameter's joint exists");
    const ChainJoint& joint = chain.joints[static_cast<std::size_t>(p.joint)];
    require(p.kind == FitParameter::Kind::direction || joint.kind == JointKind::rotary,
            "only rotary joints have an origin");
    const auto [first, second] = across(joint.direction);
    out.push_back({p, first, 0.0, 0.0});
    out.push_back({p, second, 0.0, 0.0});
  }
  return out;
}

ScrewChain changed(ScrewChain chain, const std::vector<FitUnknown>& unknowns, const Vector& by) {
  std::vector<Vec3> turn(static_cast<std::size_t>(chain.size()), Vec3::Zero());
  for (std::size_t k = 0; k < unknowns.size(); ++k) {
    const FitUnknown& u = unknowns[k];
    const Vec3 move = by[static_cast<Eigen::Index>(k)] * u.along;
    if (u.parameter.kind == FitParameter::Kind::tip) {
      chain.tool_home.translation() += move;
      continue;
    }
    const auto j = static_cast<std::size_t>(u.parameter.joint);
    if (u.parameter.kind == FitParameter::Kind::origin)
      chain.joints[j].origin += move;
    else
      turn[j] += move;
  }
  for (std::size_t j = 0; j < turn.size(); ++j)
    if (!turn[j].isZero(0.0))
      chain.joints[j].direction = (chain.joints[j].direction + turn[j]).normalized();
  return chain;
}

/// The problem: residuals with the spheres' centres taken out, and their Jacobian.
class Problem {
 public:
  Problem(const ScrewChain& chain, const std::vector<TipReading>& readings,
          std::vector<FitUnknown> unknowns)
      : chain_(chain), readings_(readings), unknowns_(std::move(unknowns)) {
    for (const TipReading& r : readings_) {
      require(r.q.size() == chain.size(), "one value per joint");
      if (r.sphere >= 0)
        count_.resize(std::max(count_.size(), static_cast<std::size_t>(r.sphere) + 1));
    }
    for (const TipReading& r : readings_)
      if (r.sphere >= 0) ++count_[static_cast<std::size_t>(r.sphere)];
  }

  const std::vector<FitUnknown>& unknowns() const { return unknowns_; }
  Eigen::Index rows() const { return 3 * static_cast<Eigen::Index>(readings_.size()); }
  Eigen::Index size() const { return static_cast<Eigen::Index>(unknowns_.size()); }
  int sphere_count() const {
    return static_cast<int>(
        std::count_if(count_.begin(), count_.end(), [](int n) { return n > 0; }));
  }

  /// tip − place for every reading, centres not taken out.
  Vector raw(const Vector& theta) const {
    const ScrewChain chain = changed(chain_, unknowns_, theta);
    Vector out(rows());
    Eigen::Index row = 0;
    for (const TipReading& r : readings_) {
      const CutterLocation at = forward_location(chain, r.q);
      out.segment<3>(row) = at.tip - r.tool_length * at.axis - r.place;
      row += 3;
    }
    return out;
  }

  std::vector<Vec3> centres(const Vector& raw) const {
    std::vector<Vec3> sum(count_.size(), Vec3::Zero());
    for (std::size_t i = 0; i < readings_.size(); ++i)
      if (readings_[i].sphere >= 0)
        sum[static_cast<std::size_t>(readings_[i].sphere)] +=
            raw.segment<3>(3 * static_cast<Eigen::Index>(i));
    for (std::size_t s = 0; s < sum.size(); ++s)
      if (count_[s] > 0) sum[s] /= count_[s];
    return sum;
  }

  Vector without_centres(Vector raw) const {
    const auto centre = centres(raw);
    for (std::size_t i = 0; i < readings_.size(); ++i)
      if (readings_[i].sphere >= 0)
        raw.segment<3>(3 * static_cast<Eigen::Index>(i)) -=
            centre[static_cast<std::size_t>(readings_[i].sphere)];
    return raw;
  }

  Vector residuals(const Vector& theta) const { return without_centres(raw(theta)); }

  Matrix jacobian(const Vector& theta) const {
    Matrix out(rows(), size());
    for (Eigen::Index k = 0; k < size(); ++k) {
      const bool angle =
          unknowns_[static_cast<std::size_t>(k)].parameter.kind == FitParameter::Kind::direction;
      const double step = angle ? kStepAngle : kStepLength;
      Vector ahead = theta, back = theta;
      ahead[k] += step;
      back[k] -= step;
      out.col(k) = without_centres((raw(ahead) - raw(back)) / (2.0 * step));
    }
    return out;
  }

  /// Unknown to mm: a direction counts with the largest distance of a tip from its axis.
  Vector lengths() const {
    Vector out = Vector::Ones(size());
    double lever = 1.0;
    for (const TipReading& r : readings_) {
      lever = std::max(lever, (forward_location(chain_, r.q).tip).norm());
      for (int j = 0; j < chain_.size(); ++j)
        if (chain_.joints[static_cast<std::size_t>(j)].kind == JointKind::linear)
          lever = std::max(lever, std::abs(r.q[j]));
    }
    for (Eigen::Index k = 0; k < size(); ++k)
      if (unknowns_[static_cast<std::size_t>(k)].parameter.kind == FitParameter::Kind::direction)
        out[k] = lever;
    return out;
  }

 private:
  const ScrewChain& chain_;
  const std::vector<TipReading>& readings_;
  std::vector<FitUnknown> unknowns_;
  std::vector<int> count_;  ///< readings by sphere
};

/// Half the sum of squares in the coordinates y with θ = basis · y.
struct Search {
  const Problem& problem;
  const Matrix& basis;
  double gradient_norm = 0.0;

  static double value(unsigned n, const double* y, double* gradient, void* self) {
    Search& s = *static_cast<Search*>(self);
    const Vector theta = s.basis * Eigen::Map<const Vector>(y, static_cast<Eigen::Index>(n));
    const Vector r = s.problem.residuals(theta);
    if (gradient != nullptr) {
      const Vector g = (s.problem.jacobian(theta) * s.basis).transpose() * r;
      Eigen::Map<Vector>(gradient, g.size()) = g;
    }
    return 0.5 * r.squaredNorm();
  }
};

Vector minimise(const Problem& problem, const Matrix& basis) {
  const auto n = static_cast<unsigned>(basis.cols());
  const std::unique_ptr<nlopt_opt_s, void (*)(nlopt_opt)> opt(nlopt_create(NLOPT_LD_LBFGS, n),
                                                              nlopt_destroy);
  Search search{problem, basis};
  nlopt_set_min_objective(opt.get(), &Search::value, &search);
  nlopt_set_xtol_abs1(opt.get(), kLastStep);
  nlopt_set_maxeval(opt.get(), kMostEvaluations);
  Vector y = Vector::Zero(basis.cols());
  double least = 0.0;
  nlopt_optimize(opt.get(), y.data(), &least);
  return basis * y;
}

std::vector<Vec3> by_reading(const Vector& r) {
  std::vector<Vec3> out;
  for (Eigen::Index i = 0; i < r.size(); i += 3) out.emplace_back(r.segment<3>(i));
  return out;
}

}  // namespace

ChainFit fit_chain(const ScrewChain& chain, const std::vector<TipReading>& readings,
                   const std::vector<FitParameter>& parameters) {
  require(!parameters.empty(), "at least one parameter");
  const Problem problem(chain, readings, unknowns_of(chain, parameters));
  ChainFit fit;
  fit.unknowns = problem.unknowns();
  const Eigen::Index n = problem.size();
  const Eigen::Index freedom = problem.rows() - 3 * problem.sphere_count() - n;
  const Vector start = Vector::Zero(n);
  fit.before = by_reading(problem.residuals(start));
  if (freedom <= 0) return fit;

  const Vector length = problem.lengths();
  const Matrix scaled = problem.jacobian(start) * length.cwiseInverse().asDiagonal();
  const Eigen::JacobiSVD<Matrix> svd(scaled.transpose() * scaled, Eigen::ComputeFullV);
  const Vector sigma = svd.singularValues().cwiseSqrt();
  fit.condition = sigma[n - 1] > 0.0 ? sigma[0] / sigma[n - 1] : INFINITY;
  const double least = kLeastEffect * std::sqrt(static_cast<double>(problem.rows()));
  std::vector<bool> hidden(static_cast<std::size_t>(n), false);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index k = 0; sigma[i] < least && k < n; ++k)
      if (std::abs(svd.matrixV()(k, i)) >= kHiddenComponent)
        hidden[static_cast<std::size_t>(k)] = true;
  for (std::size_t k = 0; k < hidden.size(); ++k)
    if (hidden[k]) fit.hidden.push_back(static_cast<int>(k));
  if (sigma[n - 1] < least) {
    fit.status = ChainFit::Status::not_observable;
    return fit;
  }

  const Matrix basis =
      length.cwiseInverse().asDiagonal() * svd.matrixV() * sigma.cwiseInverse().asDiagonal();
  const Vector theta = minimise(problem, basis);
  const Vector raw = problem.raw(theta);
  const Vector left = problem.without_centres(raw);
  const Matrix jacobian = problem.jacobian(theta);
  // The gradient against the residual: their angle is a right one at a minimum.
  const double slope = ((jacobian * basis).transpose() * left).norm();
  fit.status = slope <= kSmallGradient * std::max(left.norm(), 1.0)
                   ? ChainFit::Status::ok
                   : ChainFit::Status::not_converged;
  const Matrix covariance = (jacobian.transpose() * jacobian).ldlt().solve(Matrix::Identity(n, n));
  const double variance = left.squaredNorm() / static_cast<double>(freedom);
  for (Eigen::Index k = 0; k < n; ++k) {
    fit.unknowns[static_cast<std::size_t>(k)].change = theta[k];
    fit.unknowns[static_cast<std::size_t>(k)].deviation =
        std::sqrt(std::max(0.0, covariance(k, k) * variance));
  }
  fit.chain = changed(chain, fit.unknowns, theta);
  fit.spheres = problem.centres(raw);
  fit.after = by_reading(left);
  return fit;
}

}  // namespace smoothpost
