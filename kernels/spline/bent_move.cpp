#include "kernels/spline/bent_move.h"

#include <cmath>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

void check(const BentMove& move) {
  require(move.from.size() == move.to.size() &&
              (move.bend.rows() == 0 || move.bend.rows() == move.from.size()),
          "a bent move has one value and one row per joint");
}

/// Largest |p| on [0, 1] by the Bernstein coefficients b_i = Σ_{k≤i} C(i,k)/C(n,k) a_k of
/// p = Σ a_k τ^k.
template <int n>
double bernstein_bound(const double (&a)[n + 1]) {
  double most = 0.0;
  for (int i = 0; i <= n; ++i) {
    double share = 1.0, b = 0.0;
    for (int k = 0; k <= i; ++k) {
      b += share * a[k];
      share *= static_cast<double>(i - k) / static_cast<double>(n - k == 0 ? 1 : n - k);
    }
    most = std::max(most, std::abs(b));
  }
  return most;
}

}  // namespace

JointVector joints_at(const BentMove& move, double tau) {
  check(move);
  JointVector q = move.from + tau * (move.to - move.from);
  if (move.bend.rows() == 0) return q;
  double power = tau;
  for (Eigen::Index k = 0; k < 4; ++k) {
    power *= tau;
    q += (power - tau) * move.bend.col(k);
  }
  return q;
}

JointVector rates_at(const BentMove& move, double tau) {
  check(move);
  JointVector rate = move.to - move.from;
  if (move.bend.rows() == 0) return rate;
  double power = 1.0;
  for (Eigen::Index k = 0; k < 4; ++k) {
    power *= tau;
    rate += (static_cast<double>(k + 2) * power - 1.0) * move.bend.col(k);
  }
  return rate;
}

JointVector second_at(const BentMove& move, double tau) {
  check(move);
  JointVector second = JointVector::Zero(move.from.size());
  if (move.bend.rows() == 0) return second;
  double power = 1.0;
  for (Eigen::Index k = 0; k < 4; ++k) {
    second += static_cast<double>((k + 2) * (k + 1)) * power * move.bend.col(k);
    power *= tau;
  }
  return second;
}

BendBounds bend_bounds(const BentMove& move) {
  check(move);
  BendBounds out;
  out.rate = (move.to - move.from).cwiseAbs();
  out.second = JointVector::Zero(move.from.size());
  if (move.bend.rows() == 0) return out;
  // A hair more than the arithmetic's own rounding.
  constexpr double kRoundOff = 1.0 + 1e-12;
  for (Eigen::Index j = 0; j < move.from.size(); ++j) {
    const auto c = move.bend.row(j);
    const double first = move.to[j] - move.from[j] - c.sum();
    out.rate[j] =
        kRoundOff * bernstein_bound<4>({first, 2.0 * c[0], 3.0 * c[1], 4.0 * c[2], 5.0 * c[3]});
    out.second[j] =
        kRoundOff * bernstein_bound<3>({2.0 * c[0], 6.0 * c[1], 12.0 * c[2], 20.0 * c[3]});
  }
  return out;
}

JointBend hermite_bend(const PathEnd& from, const PathEnd& to, double length, int degree) {
  const Eigen::Index n = from.joints.size();
  require((degree == 3 || degree == 5) && length > 0.0 && to.joints.size() == n &&
              from.first.size() == n && to.first.size() == n,
          "hermite_bend: degree 3 or 5 between two ends of a path");
  const JointVector d = to.joints - from.joints;
  const JointVector d0 = length * from.first, d1 = length * to.first;
  JointBend bend = JointBend::Zero(n, 4);
  if (degree == 3) {
    bend.col(0) = 3.0 * d - 2.0 * d0 - d1;
    bend.col(1) = -2.0 * d + d0 + d1;
    return bend;
  }
  require(from.second.size() == n && to.second.size() == n, "hermite_bend: second derivatives");
  const JointVector k0 = length * length * from.second, k1 = length * length * to.second;
  bend.col(0) = 0.5 * k0;
  bend.col(1) = 10.0 * d - 6.0 * d0 - 4.0 * d1 - 1.5 * k0 + 0.5 * k1;
  bend.col(2) = -15.0 * d + 8.0 * d0 + 7.0 * d1 + 1.5 * k0 - k1;
  bend.col(3) = 6.0 * d - 3.0 * d0 - 3.0 * d1 - 0.5 * k0 + 0.5 * k1;
  return bend;
}

}  // namespace smoothpost
