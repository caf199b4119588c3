#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "kernels/core/units.h"
#include "kernels/kinematics/joint_jet.h"
#include "kernels/kinematics/screw_chain.h"
#include "kernels/spline/gauss_rule.h"

// The machine and the contours of paper C, over arc length and with derivatives.
namespace smoothpost::paper_c {

/// A plane contour at z = 10, counter-clockwise from (x, 0); the axis is its outward normal.
struct Contour {
  std::vector<double> breaks;             ///< mm of arc length: where the curvature jumps
  std::function<LocationJet(double)> at;  ///< tip and axis with derivatives by arc length
  double length() const { return breaks.back(); }
};

inline constexpr double kHeight = 10.0;

/// Reading A of the machine: its joints are fsX, fsY, yaw, pitch, bedZ, bedC; the bed's angle is
/// −θ2. `wrist` (Le) is the distance from the wrist to the tip, mm.
inline ScrewChain machine(double wrist = 80.0) {
  const auto joint = [](JointKind kind, ChainSide side, const Vec3& direction, const Vec3& origin,
                        double lower, double upper) {
    ChainJoint j;
    j.kind = kind;
    j.side = side;
    j.direction = direction;
    j.origin = origin;
    j.lower = lower;
    j.upper = upper;
    return j;
  };
  const Vec3 at(-300.0, 0.0, 0.0);
  ScrewChain chain;
  chain.joints = {
      joint(JointKind::linear, ChainSide::tool, Vec3::UnitX(), Vec3::Zero(), 0.0, 280.0),
      joint(JointKind::linear, ChainSide::tool, Vec3::UnitY(), Vec3::Zero(), -130.0, 130.0),
      joint(JointKind::rotary, ChainSide::tool, Vec3::UnitZ(), at, -2.0, 2.0),
      joint(JointKind::rotary, ChainSide::tool, Vec3::UnitY(), at, -1.4, 1.4),
      joint(JointKind::linear, ChainSide::workpiece, Vec3::UnitZ(), Vec3::Zero(), -400.0, 0.0),
      joint(JointKind::rotary, ChainSide::workpiece, Vec3::UnitZ(), Vec3::Zero(), -7.0, 7.0)};
  chain.joints.back().redundant = true;
  chain.tool_home.translation() = Vec3(-300.0 + wrist, 0.0, 0.0);
  chain.tool_axis = Vec3(-1.0, 0.0, 0.0);
  return chain;
}

/// A line, or an arc: tip = centre + side·R·n, n = (cos φ, sin φ), dφ/ds = side/R.
struct Segment {
  bool arc = false;
  Vec3 from = Vec3::Zero(), direction = Vec3::UnitX();  ///< line
  Vec3 normal = Vec3::UnitX();                          ///< line
  Vec3 centre = Vec3::Zero();                           ///< arc
  double radius = 0.0, start = 0.0, side = 1.0;         ///< side −1: concave
};

inline LocationJet on_segment(const Segment& g, double s) {
  LocationJet jet{VectorJet::Zero(), VectorJet::Zero()};
  if (!g.arc) {
    jet.tip.col(0) = g.from + s * g.direction;
    jet.tip.col(1) = g.direction;
    jet.axis.col(0) = g.normal;
    return jet;
  }
  const double k = g.side / g.radius;
  const double angle = g.start + k * s;
  const Vec3 n(std::cos(angle), std::sin(angle), 0.0), t(-n.y(), n.x(), 0.0);
  jet.axis.col(0) = n;
  jet.axis.col(1) = k * t;
  jet.axis.col(2) = -k * k * n;
  jet.axis.col(3) = -k * k * k * t;
  jet.tip = g.side * g.radius * jet.axis;
  jet.tip.col(0) += g.centre;
  return jet;
}

inline Contour from_segments(std::vector<Segment> segments, const std::vector<double>& lengths) {
  Contour contour;
  contour.breaks = {0.0};
  for (const double l : lengths) contour.breaks.push_back(contour.breaks.back() + l);
  contour.at = [segments = std::move(segments), breaks = contour.breaks](double s) {
    const auto next = std::upper_bound(breaks.begin(), breaks.end(), s);
    const auto i = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(
        next - breaks.begin() - 1, 0, static_cast<std::ptrdiff_t>(segments.size()) - 1));
    return on_segment(segments[i], s - breaks[i]);
  };
  return contour;
}

/// Cross of size S, arm width w, all corners of radius R.   @pre 2R ≤ w ≤ S − 4R
inline Contour cross(double size, double width, double radius) {
  const double h = 0.5 * size, a = 0.5 * width, r = radius;
  std::vector<Segment> segments;
  std::vector<double> lengths;
  for (int quarter = 0; quarter < 4; ++quarter) {
    const double turn = 0.5 * kPi * quarter;
    const Mat3 rot = rotation_about(Vec3::UnitZ(), turn);
    const auto line = [&](const Vec3& from, const Vec3& to, const Vec3& normal) {
      Segment g;
      const Vec3 up(0, 0, kHeight);
      g.from = rot * from + up;
      g.direction = rot * (to - from).normalized();
      g.normal = rot * normal;
      segments.push_back(g);
      lengths.push_back((to - from).norm());
    };
    const auto arc = [&](const Vec3& centre, double start, double side) {
      Segment g;
      g.arc = true;
      g.centre = rot * centre + Vec3(0, 0, kHeight);
      g.radius = r;
      g.start = start + turn;
      g.side = side;
      segments.push_back(g);
      lengths.push_back(0.5 * kPi * r);
    };
    line({h, 0, 0}, {h, a - r, 0}, Vec3::UnitX());
    arc({h - r, a - r, 0}, 0.0, 1.0);
    line({h - r, a, 0}, {a + r, a, 0}, Vec3::UnitY());
    arc({a + r, a + r, 0}, 0.5 * kPi, -1.0);
    line({a, a + r, 0}, {a, h - r, 0}, Vec3::UnitX());
    arc({a - r, h - r, 0}, 0.0, 1.0);
    line({a - r, h, 0}, {0, h, 0}, Vec3::UnitY());
  }
  return from_segments(std::move(segments), lengths);
}

/// f(t(s)) by s, from derivatives of f by t and of t by s.
inline VectorJet composed(const VectorJet& f, const Jet& t) {
  VectorJet out;
  out.col(0) = f.col(0);
  out.col(1) = f.col(1) * t[1];
  out.col(2) = f.col(2) * t[1] * t[1] + f.col(1) * t[2];
  out.col(3) = f.col(3) * t[1] * t[1] * t[1] + 3.0 * f.col(2) * t[1] * t[2] + f.col(1) * t[3];
  return out;
}

/// Ellipse of semi-axes a, b over its arc length.
inline Contour ellipse(double a, double b) {
  const auto speed = [a, b](double t) { return std::hypot(a * std::sin(t), b * std::cos(t)); };
  const auto between = [speed](double from, double to) {
    const GaussRule& rule = gauss_rule(12);
    double sum = 0.0;
    for (std::size_t g = 0; g < 12; ++g)
      sum += (to - from) * rule.weights[g] * speed(from + (to - from) * rule.nodes[g]);
    return sum;
  };
  constexpr int kNodes = 256;
  std::vector<double> length{0.0};
  for (int i = 0; i < kNodes; ++i)
    length.push_back(length.back() + between(2.0 * kPi * i / kNodes, 2.0 * kPi * (i + 1) / kNodes));
  Contour contour;
  contour.breaks = {0.0, length.back()};
  contour.at = [=](double s) {
    const auto next = std::upper_bound(length.begin(), length.end(), s);
    const auto i = std::clamp<std::ptrdiff_t>(next - length.begin() - 1, 0, kNodes - 1);
    const double from = 2.0 * kPi * static_cast<double>(i) / kNodes;
    double t = from + (s - length[static_cast<std::size_t>(i)]) / speed(from);
    for (int k = 0; k < 8; ++k)
      t -= (length[static_cast<std::size_t>(i)] + between(from, t) - s) / speed(t);
    const SineCosine sc = sine_cosine({t, 1.0, 0.0, 0.0});
    VectorJet tip = VectorJet::Zero(), slope = VectorJet::Zero();
    Jet square{};
    for (std::size_t r = 0; r < 4; ++r) {
      const auto c = static_cast<Eigen::Index>(r);
      tip.col(c) = Vec3(a * sc.cosine[r], b * sc.sine[r], r == 0 ? kHeight : 0.0);
      slope.col(c) = Vec3(b * sc.cosine[r], a * sc.sine[r], 0.0);  // v·n
    }
    const Jet sine = product(sc.sine, sc.sine), cosine = product(sc.cosine, sc.cosine);
    for (std::size_t r = 0; r < 4; ++r) square[r] = a * a * sine[r] + b * b * cosine[r];
    Jet v{};  // the square root, order by order
    v[0] = std::sqrt(square[0]);
    v[1] = square[1] / (2.0 * v[0]);
    v[2] = (square[2] - 2.0 * v[1] * v[1]) / (2.0 * v[0]);
    v[3] = (square[3] - 6.0 * v[1] * v[2]) / (2.0 * v[0]);
    const Jet inverse = reciprocal(v);
    const Jet by_length{t, inverse[0], inverse[0] * inverse[1],
                        inverse[0] * (inverse[1] * inverse[1] + inverse[0] * inverse[2])};
    return LocationJet{composed(tip, by_length), composed(product(inverse, slope), by_length)};
  };
  return contour;
}

}  // namespace smoothpost::paper_c
