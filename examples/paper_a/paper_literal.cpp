#include "examples/paper_a/paper_literal.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"

namespace smoothpost::paper_a {

const std::array<Vec3, 5> kTips = {Vec3(240, 200, 220), Vec3(230, 240, 250), Vec3(270, 230, 252.2),
                                   Vec3(250, 210, 242), Vec3(255, 230, 246.8)};
const std::array<Vec3, 5> kAngles = {Vec3(0.6283, 0.5236, 0.3142), Vec3(1.0472, 0.7854, 0.3927),
                                     Vec3(0.3142, 0.1571, 0.2094), Vec3(0.6283, 0.7854, 0.5236),
                                     Vec3(0.3142, 0.3927, 0.5236)};

namespace {

constexpr double kPrintedSpan = 12.0;

LiteralCorner corner_of(std::span<const Vec3> nodes, std::size_t i) {
  require(i >= 1 && i + 1 < nodes.size(), "paper_a: corner 1 to 3");
  LiteralCorner c;
  c.vertex = nodes[i];
  c.incoming = (nodes[i] - nodes[i - 1]).normalized();
  c.outgoing = (nodes[i + 1] - nodes[i]).normalized();
  return c;
}

void place(LiteralCorner& c, std::span<const Vec3> nodes, std::size_t i, double eps) {
  const double sine = 0.5 * (c.outgoing - c.incoming).norm();
  const double before = (nodes[i] - nodes[i - 1]).norm();
  const double after = (nodes[i + 1] - nodes[i]).norm();
  c.length = std::min(eps, std::min(before, after) * sine / kPrintedSpan);
  c.points = acr_corner_points(c.vertex, c.incoming, c.outgoing, 2.0 * c.length / sine);
}

/// Eq. (7), lowest power first.
const Septic kL0{0, -1, 0, 0, 20, -45, 36, -10};
const Septic kL1{0, 0, 0, 0, 15, -39, 34, -10};
const Septic kM0{0, 0, 1, 0, -10, 20, -15, 4};
const Septic kM1{0, 0, -2, 0, 25, -54, 43, -12};
const Septic kM2{0, 0, 1, 0, -20, 48, -41, 12};
const Septic kN1{1, 0, 0, 0, -35, 84, -70, 20};

double integral(const Septic& f, const Septic& g) {
  double sum = 0.0;
  for (Eigen::Index i = 0; i < 8; ++i)
    for (Eigen::Index j = 0; j < 8; ++j) sum += f[i] * g[j] / static_cast<double>(i + j + 1);
  return sum;
}

}  // namespace

Vec3 tool_axis(const Vec3& e) {
  const double sa = std::sin(e.x()), ca = std::cos(e.x());
  const double sb = std::sin(e.y()), cb = std::cos(e.y());
  const double sg = std::sin(e.z()), cg = std::cos(e.z());
  return {sa * sg + ca * sb * cg, -ca * sg + sa * sb * cg, cb * cg};
}

Mat3 tool_axis_jacobian(const Vec3& e) {
  const double sa = std::sin(e.x()), ca = std::cos(e.x());
  const double sb = std::sin(e.y()), cb = std::cos(e.y());
  const double sg = std::sin(e.z()), cg = std::cos(e.z());
  Mat3 j;
  j << ca * sg - sa * sb * cg, ca * cb * cg, sa * cg - ca * sb * sg,  //
      sa * sg + ca * sb * cg, sa * cb * cg, -ca * cg - sa * sb * sg,  //
      0.0, -sb * cg, -cb * sg;
  return j;
}

LiteralCorner tip_corner(std::size_t corner, double eps) {
  LiteralCorner c = corner_of(kTips, corner);
  place(c, kTips, corner, eps);
  return c;
}

LiteralCorner angle_corner(std::size_t corner, double eps) {
  LiteralCorner c = corner_of(kAngles, corner);
  const Vec3 middle = (c.outgoing - c.incoming).normalized();
  const double rate = (tool_axis_jacobian(c.vertex) * middle).norm();
  place(c, kAngles, corner, 2.0 * std::sin(0.5 * eps) / rate);
  return c;
}

LiteralFit literal_fit(const LiteralCorner& corner, SignOfM2 sign) {
  const auto& q = corner.points;
  const double m2 = sign == SignOfM2::printed ? 1.0 : -1.0;
  double d1 = 0.0, d2 = 0.0, d3 = 0.0, d4 = 0.0, d5 = 0.0, d6 = 0.0;
  for (Eigen::Index c = 1; c < 3; ++c) {  // the second and third coordinate over the first
    const double y1 = q[1][c], y2 = q[2][c], y3 = q[3][c], y4 = q[4][c];
    const Septic a = kL0 * y1 + kL1 * y2 - kL0 * y3 - kL1 * y4;
    const Septic b = kM0 * y1 + kM1 * y2 + m2 * kM2 * y3 - (kM0 + kM1 + kM2) * y4;
    Septic rest = kN1 * y2 - kN1 * y3;
    rest[0] += y3 - y2;
    rest[1] -= y3 - y2;
    d1 += integral(a, a);
    d2 += integral(b, b);
    d3 += integral(a, b);
    d4 += integral(a, rest);
    d5 += integral(b, rest);
    d6 += integral(rest, rest);
  }
  const double det = d1 * d2 - d3 * d3;
  LiteralFit fit;
  fit.shape = {(d3 * d5 - d2 * d4) / det, (d3 * d4 - d1 * d5) / det};
  const auto [k, l] = fit.shape;
  fit.error = std::abs((q[3].x() - q[2].x()) * (d1 * k * k + d2 * l * l + 2.0 * d3 * k * l +
                                                2.0 * d4 * k + 2.0 * d5 * l + d6));
  return fit;
}

}  // namespace smoothpost::paper_a
