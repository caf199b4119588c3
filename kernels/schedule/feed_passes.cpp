#include "kernels/schedule/feed_passes.h"

#include <algorithm>
#include <cmath>

#include "kernels/schedule/lane_clones.h"

namespace smoothpost {
namespace {

constexpr double kMostFall = 0.9;  // of b in a step, of what a row's slack may fall
constexpr double kLeastSlack = 1e-14;
constexpr double kLeastMultiplier = 1e-40;
constexpr double kLeastCurvature = 0.05;

struct Local {
  double b, b1, b2;  // b, b', b'' at a point, or their change
};

/// The rows of one point.
struct Point {
  const double* q;
  const double* inv_a;
  const double* inv_j;
  double factor_a, factor_j;
  double* s;
  double* z;
};

template <int P>
SMOOTHPOST_INLINE Point point_of(const ElementRows& rows, int node) {
  const FeedProgram::Factors& f = rows.factors[node];
  return {rows.q + 3 * P * node,
          rows.lanes->acceleration.data(),
          rows.lanes->jerk.data(),
          f.acceleration,
          f.jerk,
          rows.s + 4 * P * node,
          rows.z + 4 * P * node};
}

SMOOTHPOST_INLINE Local local_of(const double* m, const double* c) {
  return {(m[0] * c[0] + m[1] * c[1]) + (m[2] * c[2] + m[3] * c[3]),
          (m[4] * c[0] + m[5] * c[1]) + (m[6] * c[2] + m[7] * c[3]),
          (m[8] * c[0] + m[9] * c[1]) + (m[10] * c[2] + m[11] * c[3])};
}

/// AR·v and JR·v of every lane.
template <int P>
SMOOTHPOST_INLINE void lane_values(const Point& p, const Local& v, double* __restrict a,
                                   double* __restrict j) {
  const double slope = 0.5 * v.b1, half = 0.5 * v.b2, more = 1.5 * v.b1;
  for (int l = 0; l < P; ++l) {
    const double q1 = p.q[l], q2 = p.q[P + l], q3 = p.q[2 * P + l];
    a[l] = (q2 * v.b + q1 * slope) * (p.factor_a * p.inv_a[l]);
    j[l] = (q3 * v.b + q2 * more + q1 * half) * (p.factor_j * p.inv_j[l]);
  }
}

/// c of every row, `root` for b^{−1/2}.
template <int P>
SMOOTHPOST_INLINE void lane_slacks(const Point& p, const Local& v, double root,
                                   double* __restrict c) {
  double a[P], j[P];
  lane_values<P>(p, v, a, j);
  for (int l = 0; l < P; ++l) {
    c[l] = 1.0 - a[l];
    c[P + l] = 1.0 + a[l];
    c[2 * P + l] = root - j[l];
    c[3 * P + l] = root + j[l];
  }
}

/// Four reciprocals by one division.
struct Four {
  double i0, i1, i2, i3;
};

SMOOTHPOST_INLINE Four reciprocals(double x0, double x1, double x2, double x3) {
  const double low = x0 * x1, high = x2 * x3, all = 1.0 / (low * high);
  const double inv_low = all * high, inv_high = all * low;
  return {inv_low * x1, inv_low * x0, inv_high * x3, inv_high * x2};
}

SMOOTHPOST_INLINE double larger(double a, double b) { return a > b ? a : b; }

using Quad = double __attribute__((vector_size(32)));

using QuadAt = double __attribute__((vector_size(32), aligned(8), may_alias));

SMOOTHPOST_INLINE const QuadAt& quad(const double* from) {
  return *reinterpret_cast<const QuadAt*>(from);
}
SMOOTHPOST_INLINE QuadAt& quad(double* to) { return *reinterpret_cast<QuadAt*>(to); }

/// The four sums over P numbers each.
template <int P>
SMOOTHPOST_INLINE void totals(const double (*v)[P], Quad& out) {
  Quad h[4];
  for (int k = 0; k < 4; ++k) {
    h[k] = quad(v[k]) + quad(v[k] + 4);
    for (int l = 8; l < P; l += 4) h[k] += quad(v[k] + l);
  }
  const Quad low = __builtin_shufflevector(h[0], h[1], 0, 4, 2, 6) +
                   __builtin_shufflevector(h[0], h[1], 1, 5, 3, 7);
  const Quad high = __builtin_shufflevector(h[2], h[3], 0, 4, 2, 6) +
                    __builtin_shufflevector(h[2], h[3], 1, 5, 3, 7);
  out = __builtin_shufflevector(low, high, 0, 1, 4, 5) +
        __builtin_shufflevector(low, high, 2, 3, 6, 7);
}

template <int P>
SMOOTHPOST_INLINE double largest(const double* v) {
  double most = v[0];
  for (int l = 1; l < P; ++l) most = larger(most, v[l]);
  return most;
}

template <int P>
SMOOTHPOST_INLINE FeedFalls falls(const ElementRows& rows, const ElementControls& at,
                                  double centre) {
  double primal[P] = {}, dual[P] = {};
  FeedFalls worst;
  for (int node = 0; node < rows.nodes; ++node) {
    const Point p = point_of<P>(rows, node);
    const double* m = rows.basis + 12 * node;
    const Local v = local_of(m, at.x), dv = local_of(m, at.dx);
    const double r = 1.0 / std::sqrt(v.b);
    double c[4 * P];
    lane_slacks<P>(p, {v.b + dv.b, v.b1 + dv.b1, v.b2 + dv.b2}, r - 0.5 * r * r * r * dv.b, c);
    for (int l = 0; l < P; ++l) {
      const double s0 = p.s[l], s1 = p.s[P + l], s2 = p.s[2 * P + l], s3 = p.s[3 * P + l];
      const double z0 = p.z[l], z1 = p.z[P + l], z2 = p.z[2 * P + l], z3 = p.z[3 * P + l];
      const Four both = reciprocals(s0 * z0, s1 * z1, s2 * z2, s3 * z3);
      const double f0 = (s0 - c[l]) * z0 * both.i0, f1 = (s1 - c[P + l]) * z1 * both.i1;
      const double f2 = (s2 - c[2 * P + l]) * z2 * both.i2, f3 = (s3 - c[3 * P + l]) * z3 * both.i3;
      primal[l] = larger(primal[l], larger(larger(f0, f1), larger(f2, f3)));
      const double d0 = f0 + centre * both.i0, d1 = f1 + centre * both.i1,
                   d2 = f2 + centre * both.i2, d3 = f3 + centre * both.i3;
      const double least = 1.0 + larger(larger(-d0, -d1), larger(-d2, -d3));
      dual[l] = larger(dual[l], least);
    }
    const double s = rows.cap_s[node], z = rows.cap_z[node];
    const double fall = (s - 1.0 + rows.inv_cap[node] * (v.b + dv.b)) / s;
    worst.primal = larger(worst.primal, larger(fall, -dv.b * (r * r) * (1.0 / kMostFall)));
    worst.dual = larger(worst.dual, 1.0 - fall - centre / (s * z));
  }
  worst.primal = larger(worst.primal, largest<P>(primal));
  worst.dual = larger(worst.dual, largest<P>(dual));
  return worst;
}

/// s and z of a point after a step; `linear` are the linearised slacks after a whole step, `c` the
/// true ones at the new place.
template <int P>
SMOOTHPOST_INLINE void update(const Point& p, const double* linear, const double* c,
                              const FeedStep& step) {
  double inverse[4 * P];
  for (int l = 0; l < P; ++l) {
    const Four i = reciprocals(p.s[l], p.s[P + l], p.s[2 * P + l], p.s[3 * P + l]);
    inverse[l] = i.i0;
    inverse[P + l] = i.i1;
    inverse[2 * P + l] = i.i2;
    inverse[3 * P + l] = i.i3;
  }
  double* __restrict s = p.s;
  double* __restrict z = p.z;
  for (int i = 0; i < 4 * P; ++i) {
    const double ds = linear[i] - s[i];
    const double dz = (step.centre - z[i] * ds) * inverse[i] - z[i];
    z[i] = larger(z[i] + step.dual * dz, kLeastMultiplier);
    s[i] = larger(larger(s[i] + step.primal * ds, c[i]), kLeastSlack);
  }
}

/// What the lanes of a point give to the Newton system, by (b, b', b'').
struct PointSums {
  Quad low, high;            // Hessian 00 01 02 11; 12 22, multipliers of the jerk rows, gap
  Quad centre, drift, dual;  // [3] is not read
  double lack;
};

template <int P>
SMOOTHPOST_INLINE PointSums point_sums(const Point& p, const Local& v, double r) {
  double sum[20][P], lack[P];
  for (int l = 0; l < P; ++l) sum[11][l] = sum[15][l] = sum[19][l] = 0.0;
  const double r1 = -0.5 * r * r * r;
  for (int l = 0; l < P; ++l) {
    const double ia = p.factor_a * p.inv_a[l], ij = p.factor_j * p.inv_j[l];
    const double q1 = 0.5 * p.q[l], q2 = p.q[P + l], q3 = p.q[2 * P + l];
    const double a0 = q2 * ia, a1 = q1 * ia;
    const double j0 = q3 * ij, j1 = 1.5 * q2 * ij, j2 = q1 * ij;
    const double s0 = p.s[l], s1 = p.s[P + l], s2 = p.s[2 * P + l], s3 = p.s[3 * P + l];
    const double z0 = p.z[l], z1 = p.z[P + l], z2 = p.z[2 * P + l], z3 = p.z[3 * P + l];
    const Four i = reciprocals(s0, s1, s2, s3);
    const double d0 = z0 * i.i0, d1 = z1 * i.i1, d2 = z2 * i.i2, d3 = z3 * i.i3;
    const double a = a0 * v.b + a1 * v.b1, j = j0 * v.b + j1 * v.b1 + j2 * v.b2;
    const double rho0 = 1.0 - a - s0, rho1 = 1.0 + a - s1, rho2 = r - j - s2, rho3 = r + j - s3;
    const double da = d0 + d1, dj = d2 + d3, ej = (d3 - d2) * r1;
    const double ca = i.i1 - i.i0, cj = i.i3 - i.i2, za = z1 - z0, zj = z3 - z2;
    const double ej2 = d2 * rho2, ej3 = d3 * rho3;
    const double ra = d1 * rho1 - d0 * rho0, rj = ej3 - ej2;
    const double daa = da * a1, djj = dj * j0 + ej, dj1 = dj * j1;
    sum[0][l] = da * a0 * a0 + dj * (r1 * r1) + (djj + ej) * j0;
    sum[1][l] = daa * a0 + djj * j1;
    sum[2][l] = djj * j2;
    sum[3][l] = daa * a1 + dj1 * j1;
    sum[4][l] = dj1 * j2;
    sum[5][l] = dj * j2 * j2;
    sum[6][l] = z2 + z3;
    sum[7][l] = (s0 * z0 + s1 * z1) + (s2 * z2 + s3 * z3);
    sum[8][l] = a0 * ca + r1 * (i.i2 + i.i3) + j0 * cj;
    sum[9][l] = a1 * ca + j1 * cj;
    sum[10][l] = j2 * cj;
    sum[12][l] = a0 * ra + r1 * (ej2 + ej3) + j0 * rj;
    sum[13][l] = a1 * ra + j1 * rj;
    sum[14][l] = j2 * rj;
    sum[16][l] = a0 * za + r1 * (z2 + z3) + j0 * zj;
    sum[17][l] = a1 * za + j1 * zj;
    sum[18][l] = j2 * zj;
    lack[l] = larger(larger(-rho0, -rho1), larger(-rho2, -rho3));
  }
  PointSums out;
  totals<P>(sum, out.low);
  totals<P>(sum + 4, out.high);
  totals<P>(sum + 8, out.centre);
  totals<P>(sum + 12, out.drift);
  totals<P>(sum + 16, out.dual);
  out.lack = -largest<P>(lack);
  return out;
}

/// ElementSums on the way.
struct Gathered {
  Quad hessian[4] = {}, dual = {}, drift = {}, centre = {};
  double objective = 0.0, gap = 0.0, lack = 0.0;
};

/// Sums of a point go to the four controls.
SMOOTHPOST_INLINE void gather(const double* m, const PointSums& p, double gradient, Gathered& out) {
  const Quad m0 = quad(m), m1 = quad(m + 4), m2 = quad(m + 8);
  const Quad h0 = p.low[0] * m0 + p.low[1] * m1 + p.low[2] * m2;
  const Quad h1 = p.low[1] * m0 + p.low[3] * m1 + p.high[0] * m2;
  const Quad h2 = p.low[2] * m0 + p.high[0] * m1 + p.high[1] * m2;
  for (int k = 0; k < 4; ++k) out.hessian[k] += h0 * m[k] + h1 * m[4 + k] + h2 * m[8 + k];
  out.dual += m0 * (gradient - p.dual[0]) - m1 * p.dual[1] - m2 * p.dual[2];
  out.drift -= m0 * (gradient + p.drift[0]) + m1 * p.drift[1] + m2 * p.drift[2];
  out.centre += m0 * p.centre[0] + m1 * p.centre[1] + m2 * p.centre[2];
}

SMOOTHPOST_INLINE void give(const Gathered& g, ElementSums& out) {
  for (int k = 0; k < 4; ++k) quad(&out.hessian[4 * k]) = g.hessian[k];
  quad(out.dual.data()) = g.dual;
  quad(out.drift.data()) = g.drift;
  quad(out.centre.data()) = g.centre;
  out.objective = g.objective;
  out.gap = g.gap;
  out.lack = g.lack;
}

template <int P>
SMOOTHPOST_INLINE void add_point(const ElementRows& rows, int node, const Local& v, double r,
                                 Gathered& out) {
  PointSums sums = point_sums<P>(point_of<P>(rows, node), v, r);
  const double s = rows.cap_s[node], z = rows.cap_z[node], g = -rows.inv_cap[node];
  const double inv_s = 1.0 / s, weight = rows.weight[node];
  const double rho = 1.0 + g * v.b - s, r1 = -0.5 * r * r * r, r2 = -1.5 * r1 * r * r;
  sums.low[0] += z * inv_s * g * g + r2 * larger(weight - sums.high[2], kLeastCurvature * weight);
  sums.centre[0] += g * inv_s;
  sums.drift[0] += g * z * inv_s * rho;
  sums.dual[0] += g * z;
  out.objective += weight * r;
  out.gap += sums.high[3] + z * s;
  out.lack = std::min({out.lack, sums.lack, rho});
  gather(rows.basis + 12 * node, sums, weight * r1, out);
}

template <int P>
SMOOTHPOST_INLINE ElementSums step_sums(const ElementRows& rows, const ElementControls& at,
                                        const FeedStep& step) {
  Gathered out;
  for (int node = 0; node < rows.nodes; ++node) {
    const Point p = point_of<P>(rows, node);
    const double* m = rows.basis + 12 * node;
    const Local v = local_of(m, at.x), dv = local_of(m, at.dx);
    const Local now{v.b + step.primal * dv.b, v.b1 + step.primal * dv.b1,
                    v.b2 + step.primal * dv.b2};
    const double r = 1.0 / std::sqrt(v.b), r_now = 1.0 / std::sqrt(now.b);
    double linear[4 * P], c[4 * P];
    lane_slacks<P>(p, {v.b + dv.b, v.b1 + dv.b1, v.b2 + dv.b2}, r - 0.5 * r * r * r * dv.b, linear);
    lane_slacks<P>(p, now, r_now, c);
    update<P>(p, linear, c, step);
    double& s = rows.cap_s[node];
    double& z = rows.cap_z[node];
    const double ds = 1.0 - rows.inv_cap[node] * (v.b + dv.b) - s;
    z = larger(z + step.dual * ((step.centre - z * ds) / s - z), kLeastMultiplier);
    s = larger(larger(s + step.primal * ds, 1.0 - rows.inv_cap[node] * now.b), kLeastSlack);
    add_point<P>(rows, node, now, r_now, out);
  }
  ElementSums sums;
  give(out, sums);
  return sums;
}

template <int P>
SMOOTHPOST_INLINE ElementSums sums(const ElementRows& rows, const ElementControls& at) {
  Gathered out;
  for (int node = 0; node < rows.nodes; ++node) {
    const Local v = local_of(rows.basis + 12 * node, at.x);
    add_point<P>(rows, node, v, 1.0 / std::sqrt(v.b), out);
  }
  ElementSums sums;
  give(out, sums);
  return sums;
}

template <int P>
SMOOTHPOST_INLINE void slacks(const ElementRows& rows, const double* x, double* c) {
  for (int node = 0; node < rows.nodes; ++node) {
    const Local v = local_of(rows.basis + 12 * node, x);
    lane_slacks<P>(point_of<P>(rows, node), v, 1.0 / std::sqrt(v.b), c + 4 * P * node);
  }
}

template <int P>
struct Width {};

#define SMOOTHPOST_PASSES(P)                                                                       \
  SMOOTHPOST_LANES FeedFalls falls_of(Width<P>, const ElementRows& rows,                           \
                                      const ElementControls& at, double centre) {                  \
    return falls<P>(rows, at, centre);                                                             \
  }                                                                                                \
  SMOOTHPOST_LANES ElementSums step_of(Width<P>, const ElementRows& rows,                          \
                                       const ElementControls& at, const FeedStep& step) {          \
    return step_sums<P>(rows, at, step);                                                           \
  }                                                                                                \
  SMOOTHPOST_LANES ElementSums sums_of(Width<P>, const ElementRows& rows,                          \
                                       const ElementControls& at) {                                \
    return sums<P>(rows, at);                                                                      \
  }                                                                                                \
  SMOOTHPOST_LANES void slacks_of(Width<P>, const ElementRows& rows, const double* x, double* c) { \
    slacks<P>(rows, x, c);                                                                         \
  }
SMOOTHPOST_PASSES(8)
SMOOTHPOST_PASSES(16)
#undef SMOOTHPOST_PASSES

}  // namespace

FeedFalls element_falls(int width, const ElementRows& rows, const ElementControls& at,
                        double centre) {
  return width == 8 ? falls_of(Width<8>{}, rows, at, centre)
                    : falls_of(Width<16>{}, rows, at, centre);
}

ElementSums element_step(int width, const ElementRows& rows, const ElementControls& at,
                         const FeedStep& step) {
  return width == 8 ? step_of(Width<8>{}, rows, at, step) : step_of(Width<16>{}, rows, at, step);
}

ElementSums element_sums(int width, const ElementRows& rows, const ElementControls& at) {
  return width == 8 ? sums_of(Width<8>{}, rows, at) : sums_of(Width<16>{}, rows, at);
}

void element_slacks(int width, const ElementRows& rows, const double* x, double* c) {
  if (width == 8)
    slacks_of(Width<8>{}, rows, x, c);
  else
    slacks_of(Width<16>{}, rows, x, c);
}

}  // namespace smoothpost
