#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "kernels/core/pose.h"
#include "kernels/smooth/corner_path.h"

// Paths to blend, and what they are measured by: code of its own, from the definitions.
namespace smoothpost::test {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  /// Evenly spread in the logarithm.
  double scale(double low, double high) { return low * std::exp(between(0, std::log(high / low))); }
  bool chance(double p) { return between(0.0, 1.0) < p; }
  int below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(engine_); }
  Vec3 unit() {
    const double z = between(-1.0, 1.0);
    const double a = between(-M_PI, M_PI);
    const double r = std::sqrt(1.0 - z * z);
    return Vec3(r * std::cos(a), r * std::sin(a), z).normalized();
  }

 private:
  std::mt19937_64 engine_;
};

/// A path leg by leg.
struct PathText {
  std::vector<PathNode> nodes = {PathNode{}};
  std::vector<PathLeg> legs;
  std::vector<ArcGeometry> arcs;

  static Eigen::Quaterniond turned(const Vec3& turn) {
    const double angle = turn.norm();
    if (angle == 0.0) return Eigen::Quaterniond::Identity();
    return Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle));
  }
  PathText& line(const Vec3& step, const Vec3& turn = Vec3::Zero()) {
    nodes.push_back({nodes.back().tip + step, nodes.back().rotation * turned(turn)});
    legs.push_back({turn, -1});
    return *this;
  }
  /// From the last node about `axis` through the point `from_node` away from it.
  PathText& arc(const Vec3& from_node, const Vec3& axis, double sweep, double rise,
                const Vec3& turn = Vec3::Zero()) {
    const Vec3 normal = axis.normalized();
    const Vec3 centre = nodes.back().tip + from_node;
    const Vec3 spoke = -from_node;
    const Vec3 end = centre + Eigen::AngleAxisd(sweep, normal) * spoke + rise * normal;
    legs.push_back({turn, static_cast<std::int32_t>(arcs.size())});
    arcs.push_back({centre, normal, sweep});
    nodes.push_back({end, nodes.back().rotation * turned(turn)});
    return *this;
  }
  CornerPath blended(const CornerSettings& settings) const {
    return CornerPath(nodes, legs, arcs, settings);
  }
  /// The pose before smoothing at the share t of a leg.
  Pose pose(std::size_t leg, double t) const {
    Pose p = Pose::Identity();
    const PathNode& from = nodes[leg];
    const PathNode& to = nodes[leg + 1];
    p.translation() = from.tip + t * (to.tip - from.tip);
    if (legs[leg].arc >= 0) {
      const ArcGeometry& arc = arcs[static_cast<std::size_t>(legs[leg].arc)];
      const double rise = arc.normal.dot(to.tip - from.tip);
      p.translation() = arc.centre +
                        Eigen::AngleAxisd(arc.sweep * t, arc.normal) * (from.tip - arc.centre) +
                        t * rise * arc.normal;
    }
    p.linear() = (from.rotation * turned(t * legs[leg].turn)).toRotationMatrix();
    return p;
  }
};

struct Deviation {
  double tip = 0.0;
  double rotation = 0.0;
  double axis = 0.0;
};

/// Largest deviations at equal parameter: `samples` places on each leg, and everywhere close to the
/// nodes, where it is largest.
inline Deviation deviation(const PathText& text, const CornerPath& path, int samples,
                           const Vec3& axis = Vec3::UnitZ()) {
  Deviation worst;
  for (std::size_t leg = 0; leg < path.legs(); ++leg) {
    const double length = path.length(leg);
    const auto measure = [&](double x) {
      const Pose a = path.at(leg, x);
      const Pose b = text.pose(leg, x / length);
      worst.tip = std::max(worst.tip, (a.translation() - b.translation()).norm());
      const Eigen::Quaterniond d(Mat3(a.linear().transpose() * b.linear()));
      worst.rotation = std::max(worst.rotation, 2.0 * std::atan2(d.vec().norm(), std::abs(d.w())));
      worst.axis = std::max(worst.axis, angle_between(a.linear() * axis, b.linear() * axis));
    };
    for (int i = 0; i <= samples; ++i) measure(length * i / samples);
    const auto breaks = path.breaks(leg);
    for (std::size_t k = 0; k + 1 < breaks.size(); ++k)
      for (int i = 0; i < 4; ++i) measure(breaks[k] + (breaks[k + 1] - breaks[k]) * i / 4.0);
  }
  return worst;
}

/// Derivatives of the rotation's quaternion by the arc length of the tip, orders 1 to 3.
inline std::array<Eigen::Vector4d, 3> by_arc_length(const PoseDerivatives& d) {
  const double s1 = d.tip[1].norm();
  const double s2 = d.tip[1].dot(d.tip[2]) / s1;
  const double s3 = (d.tip[2].squaredNorm() + d.tip[1].dot(d.tip[3]) - s2 * s2) / s1;
  std::array<Eigen::Vector4d, 3> q;
  q[0] = d.rotation[1] / s1;
  q[1] = (d.rotation[2] - s2 * q[0]) / (s1 * s1);
  q[2] = (d.rotation[3] - s3 * q[0] - 3.0 * s1 * s2 * q[1]) / (s1 * s1 * s1);
  return q;
}

inline std::array<Vec3, 3> tip_by_arc_length(const PoseDerivatives& d) {
  const double s1 = d.tip[1].norm();
  const double s2 = d.tip[1].dot(d.tip[2]) / s1;
  const double s3 = (d.tip[2].squaredNorm() + d.tip[1].dot(d.tip[3]) - s2 * s2) / s1;
  std::array<Vec3, 3> r;
  r[0] = d.tip[1] / s1;
  r[1] = (d.tip[2] - s2 * r[0]) / (s1 * s1);
  r[2] = (d.tip[3] - s3 * r[0] - 3.0 * s1 * s2 * r[1]) / (s1 * s1 * s1);
  return r;
}

/// Differences of one-sided derivatives at all breaks and nodes, each over the peak of the same
/// derivative on the two neighbouring legs, less what the rounding of the parameter changes
/// (σ has a resolution of 1e-16 of the leg). Index 0 is the value (absolute).
struct Jumps {
  std::array<double, 4> tip{};       ///< by σ
  std::array<double, 4> rotation{};  ///< by σ
  std::array<double, 4> tip_arc{};   ///< by arc length, where the tip moves on both sides
  /// The synchronisation error: dᵏ(rotation)/dsᵏ on one side less the same on the other side.
  std::array<double, 4> rotation_arc{};
  double slowest = 1e300;  ///< least |dr/dσ| on legs where the tip moves
  std::size_t junctions = 0;
};

/// Derivatives of orders 0 to 3 of one quantity, as columns.
using Derivatives = std::array<Eigen::Vector4d, 4>;

inline Derivatives tip_of(const PoseDerivatives& d, bool arc) {
  Derivatives v;
  const auto by_arc = arc ? tip_by_arc_length(d) : std::array<Vec3, 3>{};
  for (std::size_t k = 0; k < 4; ++k) v[k] << (arc && k > 0 ? by_arc[k - 1] : d.tip[k]), 0.0;
  return v;
}

inline Derivatives rotation_of(const PoseDerivatives& d, bool arc) {
  Derivatives v = d.rotation;
  if (!arc) return v;
  const auto by_arc = by_arc_length(d);
  for (std::size_t k = 1; k < 4; ++k) v[k] = by_arc[k - 1];
  return v;
}

/// One side of a junction: derivatives there and at samples of the stretch and the leg it belongs
/// to.
struct Side {
  PoseDerivatives here;
  std::vector<PoseDerivatives> stretch;
  std::vector<PoseDerivatives> leg;  ///< samples of the whole leg
  double step = 0.0;                 ///< of the samples
  double inside = 0.0;               ///< how far `here` is from the junction
  bool moves = false;
};

inline Side side(const CornerPath& path, std::size_t leg, std::array<double, 2> range,
                 bool at_end) {
  Side s;
  const double width = range[1] - range[0];
  const bool node = at_end ? range[1] == path.length(leg) : range[0] == 0.0;
  if (!node) s.inside = std::min(4e-16 * (at_end ? range[1] : path.length(leg)), 0.25 * width);
  s.here = path.derivatives(leg, at_end ? range[1] - s.inside : range[0] + s.inside);
  for (int i = 0; i <= 16; ++i)
    s.stretch.push_back(path.derivatives(leg, range[0] + width * (0.01 + 0.98 * i / 16.0)));
  s.step = 0.98 * width / 16.0;
  const auto breaks = path.breaks(leg);
  for (std::size_t k = 0; k + 1 < breaks.size(); ++k)
    for (int i = 0; i <= 8; ++i)
      s.leg.push_back(path.derivatives(leg, breaks[k] + (breaks[k + 1] - breaks[k]) * i / 8.0));
  s.moves = path.tip_moves(leg);
  return s;
}

/// The sum of the sizes of the chain rule's terms for dᵏ/dsᵏ: what its rounding is relative to.
inline double arc_scale(const PoseDerivatives& d, const Derivatives& plain, const Derivatives& now,
                        std::size_t k) {
  const double s1 = d.tip[1].norm();
  const double s2 = d.tip[2].norm();
  const double s3 = d.tip[3].norm() + s2 * s2 / s1;
  if (k == 1) return plain[1].norm() / s1;
  if (k == 2) return (plain[2].norm() + now[1].norm() * s2) / (s1 * s1);
  return (plain[3].norm() + now[1].norm() * s3 + 3.0 * now[2].norm() * s1 * s2) / (s1 * s1 * s1);
}

enum class By : std::uint8_t { parameter, arc_length };

/// Jumps of one quantity; of(d, by arc length) gives its derivatives.
template <typename Of>
void compare(const Side& a, const Side& b, By by, Of of, std::array<double, 4>& jumps) {
  const bool arc = by == By::arc_length;
  std::array<double, 4> peak{1.0, 1e-9, 1e-9, 1e-9};
  std::array<double, 4> resolution{};
  for (const Side* s : {&a, &b}) {
    Derivatives before = of(s->stretch.front(), arc);
    for (const PoseDerivatives& d : s->leg) {
      const Derivatives plain = of(d, false);
      const Derivatives now = of(d, arc);
      for (std::size_t k = 1; k < 4; ++k)
        peak[k] = std::max(peak[k], arc ? arc_scale(d, plain, now, k) : plain[k].norm());
    }
    for (const PoseDerivatives& d : s->stretch) {
      const Derivatives now = of(d, arc);
      for (std::size_t k = 0; k < 4; ++k) {
        resolution[k] =
            std::max(resolution[k], 6.0 * s->inside * (now[k] - before[k]).norm() / s->step);
      }
      before = now;
    }
  }
  const Derivatives left = of(a.here, arc);
  const Derivatives right = of(b.here, arc);
  // A quaternion may change its sign (not so a tip, which is close to itself).
  const bool flipped = (left[0] + right[0]).norm() < 1e-6 && left[0].norm() > 0.5;
  for (std::size_t k = 0; k < 4; ++k) {
    const double jump = (left[k] - (flipped ? -1.0 : 1.0) * right[k]).norm();
    jumps[k] = std::max(jumps[k], (jump - resolution[k]) / peak[k]);
  }
}

inline void compare(const Side& a, const Side& b, Jumps& jumps) {
  ++jumps.junctions;
  compare(a, b, By::parameter, tip_of, jumps.tip);
  compare(a, b, By::parameter, rotation_of, jumps.rotation);
  for (const Side* s : {&a, &b})
    for (const PoseDerivatives& d : s->leg)
      if (s->moves) jumps.slowest = std::min(jumps.slowest, d.tip[1].norm());
  if (!a.moves || !b.moves) return;
  compare(a, b, By::arc_length, tip_of, jumps.tip_arc);
  compare(a, b, By::arc_length, rotation_of, jumps.rotation_arc);
}

/// All junctions of a path but stops and exact corners.
inline void measure_jumps(const CornerPath& path, bool closed, Jumps& jumps) {
  for (std::size_t leg = 0; leg < path.legs(); ++leg) {
    const auto b = path.breaks(leg);
    for (std::size_t k = 1; k + 1 < b.size(); ++k)
      compare(side(path, leg, {b[k - 1], b[k]}, true), side(path, leg, {b[k], b[k + 1]}, false),
              jumps);
    const std::size_t next = leg + 1 < path.legs() ? leg + 1 : 0;
    if (next == 0 && !closed) continue;
    if (path.corners()[leg + 1].stop || path.nodes()[leg + 1].exact) continue;
    const auto c = path.breaks(next);
    compare(side(path, leg, {b[b.size() - 2], b.back()}, true),
            side(path, next, {c[0], c[1]}, false), jumps);
  }
}

}  // namespace smoothpost::test
