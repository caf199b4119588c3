#include "kernels/spline/bent_move.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"

namespace smoothpost {

namespace {

void check(const BentMove& move) {
  require(move.from.size() == move.to.size() &&
              (move.bend.rows() == 0 || move.bend.rows() == move.from.size()),
          "a bent move has one value and one row per joint");
  const JointArc& arc = move.arc;
  require(arc.turn == 0 || (arc.first != arc.second && std::min(arc.first, arc.second) >= 0 &&
                            std::max(arc.first, arc.second) < move.from.size()),
          "an arc is of two different joints");
}

/// An arc's two joints in polar coordinates about its centre.
struct Polar {
  ArcShape shape;
  double from_angle = 0.0;
};

Polar polar(const BentMove& move) {
  const JointArc& arc = move.arc;
  const double x0 = move.from[arc.first] - arc.centre_first;
  const double y0 = move.from[arc.second] - arc.centre_second;
  const double x1 = move.to[arc.first] - arc.centre_first;
  const double y1 = move.to[arc.second] - arc.centre_second;
  double turned = arc.turn * std::atan2(x0 * y1 - y0 * x1, x0 * x1 + y0 * y1);
  if (turned <= 0.0) turned += 2.0 * kPi;
  return {{std::hypot(x0, y0), std::hypot(x1, y1), arc.turn * turned}, std::atan2(y0, x0)};
}

/// Sets the two joints of `out` to the derivative of this order (0 to 2) of the arc at τ.
void set_arc(const BentMove& move, double tau, int order, JointVector& out) {
  const Polar p = polar(move);
  const double change = p.shape.to_radius - p.shape.from_radius, sweep = p.shape.sweep;
  const double radius = p.shape.from_radius + tau * change;
  const double angle = p.from_angle + tau * sweep;
  // ρ e(φ) by τ: along e and across.
  const double along = order == 0 ? radius : order == 1 ? change : -radius * sweep * sweep;
  const double across = order == 0 ? 0.0 : order == 1 ? radius * sweep : 2.0 * change * sweep;
  const double c = std::cos(angle), s = std::sin(angle);
  out[move.arc.first] = along * c - across * s;
  out[move.arc.second] = along * s + across * c;
  if (order > 0) return;
  out[move.arc.first] += move.arc.centre_first;
  out[move.arc.second] += move.arc.centre_second;
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
  if (move.arc.turn != 0) set_arc(move, tau, 0, q);
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
  if (move.arc.turn != 0) set_arc(move, tau, 1, rate);
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
  if (move.arc.turn != 0) set_arc(move, tau, 2, second);
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
  // A hair more than the arithmetic's own rounding.
  constexpr double kRoundOff = 1.0 + 1e-12;
  if (move.arc.turn != 0) {
    const ArcShape shape = arc_shape(move);
    const double change = std::abs(shape.to_radius - shape.from_radius);
    const double radius = std::max(shape.from_radius, shape.to_radius);
    const double sweep = std::abs(shape.sweep);
    for (const int j : {move.arc.first, move.arc.second}) {
      out.rate[j] = kRoundOff * (change + radius * sweep);
      out.second[j] = kRoundOff * (2.0 * change + radius * sweep) * sweep;
    }
  }
  if (move.bend.rows() == 0) return out;
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

ArcShape arc_shape(const BentMove& move) {
  check(move);
  require(move.arc.turn != 0, "arc_shape: an arc");
  return polar(move).shape;
}

double arc_spread(const BentMove& move) {
  if (move.arc.turn == 0) return 0.0;
  const ArcShape shape = arc_shape(move);
  return 2.0 * std::abs(shape.to_radius - shape.from_radius);
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
