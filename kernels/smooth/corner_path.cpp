#include "kernels/smooth/corner_path.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

constexpr double kNoMotion = 1e-9;    // mm
constexpr double kNoTurn = 1e-12;     // rad
constexpr double kStraight = 1e-9;    // of |T1 − T0|: no corner
constexpr double kJoined = 1e-6;      // mm and rad: legs lead from node to node
constexpr double kSameBreak = 1e-13;  // of a leg
constexpr int kBisections = 40;
constexpr double kMostSlope = 1.1;  // of a blend function, see blend_function.h

/// 1, x, x², …
template <std::size_t N>
std::array<double, N> powers(double x) {
  std::array<double, N> all;
  all[0] = 1.0;
  for (std::size_t k = 1; k < N; ++k) all[k] = x * all[k - 1];
  return all;
}

/// sin(y)/y and (cos(y) − 1)/y with three derivatives by y, without cancellation.
struct Circular {
  std::array<double, 4> sine;
  std::array<double, 4> cosine;
};

// Σ over k of the r-th derivative of sign·y^power/factorial, for both series at once.
Circular circular_series(double y) {
  constexpr int kTerms = 26;
  const std::array<double, kTerms> power = powers<kTerms>(y);
  Circular c{};
  double coefficient = 1.0;  // 1/(n+1)!
  for (int n = 0; n < kTerms; ++n) {
    coefficient /= n + 1.0;
    const double sign = (n / 2) % 2 == 0 ? 1.0 : -1.0;
    auto& series = n % 2 == 0 ? c.sine : c.cosine;
    double factor = n % 2 == 0 ? sign * coefficient : -sign * coefficient;
    for (int r = 0; r <= 3 && r <= n; ++r) {
      series[static_cast<std::size_t>(r)] += factor * power[static_cast<std::size_t>(n - r)];
      factor *= n - r;
    }
  }
  return c;
}

Circular circular(double y) {
  if (std::abs(y) < 2.0) return circular_series(y);
  const double s = std::sin(y);
  const double c = std::cos(y);
  const auto divided = [y](double f0, double f1, double f2, double f3) {
    std::array<double, 4> q{};
    q[0] = f0 / y;
    q[1] = (f1 - q[0]) / y;
    q[2] = (f2 - 2.0 * q[1]) / y;
    q[3] = (f3 - 3.0 * q[2]) / y;
    return q;
  };
  return {divided(s, c, -s, -c), divided(c - 1.0, -s, -c, s)};
}

/// cos(y/2) and sin(y/2)/y with three derivatives by s = y²; entire in s.
struct HalfAngle {
  std::array<double, 4> cosine{};
  std::array<double, 4> sine{};
};

HalfAngle half_angle(double s) {
  HalfAngle h;
  if (s < 1.0) {
    constexpr int kTerms = 12;
    const std::array<double, kTerms> power = powers<kTerms>(s);
    double coefficient = 0.5;  // (−1/4)^k / (2 (2k + 1)!)
    for (int k = 0; k < kTerms; ++k) {
      double term = coefficient;
      for (int r = 0; r <= 3 && r <= k; ++r) {
        h.sine[static_cast<std::size_t>(r)] += term * power[static_cast<std::size_t>(k - r)];
        term *= k - r;
      }
      coefficient *= -0.25 / ((2.0 * k + 2.0) * (2.0 * k + 3.0));
    }
    h.cosine[0] = std::cos(0.5 * std::sqrt(s));
  } else {
    // 2s·g' + g = f/2 and f' = −g/4, differentiated.
    const double y = std::sqrt(s);
    h.cosine[0] = std::cos(0.5 * y);
    h.sine[0] = std::sin(0.5 * y) / y;
    h.sine[1] = (0.5 * h.cosine[0] - h.sine[0]) / (2.0 * s);
    h.sine[2] = (-0.125 * h.sine[0] - 3.0 * h.sine[1]) / (2.0 * s);
    h.sine[3] = (-0.125 * h.sine[1] - 5.0 * h.sine[2]) / (2.0 * s);
  }
  for (std::size_t r = 0; r < 3; ++r) h.cosine[r + 1] = -0.25 * h.sine[r];
  return h;
}

/// exp of half the rotation vector φ(σ) as a quaternion (w, x, y, z) with three derivatives.
std::array<Eigen::Vector4d, 4> exponential(const std::array<Vec3, 4>& phi) {
  const double s = phi[0].squaredNorm();
  const auto [f, g] = half_angle(s);
  const double s1 = 2.0 * phi[0].dot(phi[1]);
  const double s2 = 2.0 * (phi[1].squaredNorm() + phi[0].dot(phi[2]));
  const double s3 = 2.0 * (3.0 * phi[1].dot(phi[2]) + phi[0].dot(phi[3]));
  const auto chained = [&](const std::array<double, 4>& h) {
    return std::array<double, 4>{h[0], h[1] * s1, h[2] * s1 * s1 + h[1] * s2,
                                 h[3] * s1 * s1 * s1 + 3.0 * h[2] * s1 * s2 + h[1] * s3};
  };
  const auto w = chained(f);
  const auto n = chained(g);
  const std::array<Vec3, 4> v = {
      n[0] * phi[0], n[1] * phi[0] + n[0] * phi[1],
      n[2] * phi[0] + 2.0 * n[1] * phi[1] + n[0] * phi[2],
      n[3] * phi[0] + 3.0 * n[2] * phi[1] + 3.0 * n[1] * phi[2] + n[0] * phi[3]};
  std::array<Eigen::Vector4d, 4> q;
  for (std::size_t r = 0; r < 4; ++r) q[r] << w[r], v[r];
  return q;
}

Eigen::Quaterniond exponential(const Vec3& phi) {
  const double angle = phi.norm();
  const double half = angle < 1e-8 ? 0.5 : std::sin(0.5 * angle) / angle;
  return {std::cos(0.5 * angle), half * phi.x(), half * phi.y(), half * phi.z()};
}

/// a·b of quaternions as vectors (w, x, y, z).
Eigen::Vector4d product(const Eigen::Quaterniond& a, const Eigen::Vector4d& b) {
  const Vec3 av = a.vec();
  const Vec3 bv = b.tail<3>();
  Eigen::Vector4d q;
  q[0] = a.w() * b[0] - av.dot(bv);
  q.tail<3>() = a.w() * bv + b[0] * av + av.cross(bv);
  return q;
}

}  // namespace

CornerPath::CornerPath(std::vector<PathNode> nodes, std::vector<PathLeg> legs,
                       std::vector<ArcGeometry> arcs, const CornerSettings& settings)
    : settings_(settings),
      nodes_(std::move(nodes)),
      legs_(std::move(legs)),
      arcs_(std::move(arcs)),
      rotation_blend_(settings.kind == BlendKind::ramp ? BlendFunction::ramp(0.0)
                      : settings.paper_shape           ? BlendFunction::acr({})
                                                       : BlendFunction::acr(settings.shape)) {
  require(nodes_.size() >= 2 && legs_.size() + 1 == nodes_.size(),
          "corner_path: one leg between two nodes");
  require(settings_.tip_tolerance > 0.0 && settings_.rotation_tolerance > 0.0,
          "corner_path: tolerances above 0");
  measure_legs();
  check_legs();
  corners_.resize(nodes_.size());
  plan_tip();
  plan_rotation();
  if (settings_.closed) corners_.back() = corners_.front();
}

void CornerPath::measure_legs() {
  const double mm_per_radian = settings_.tip_tolerance / settings_.rotation_tolerance;
  lengths_.reserve(legs_.size());
  for (std::size_t i = 0; i < legs_.size(); ++i) {
    const Vec3 chord = nodes_[i + 1].tip - nodes_[i].tip;
    double length = chord.norm();
    if (legs_[i].arc >= 0) {
      const ArcGeometry& arc = arcs_[static_cast<std::size_t>(legs_[i].arc)];
      const double radius = arc.normal.cross(nodes_[i].tip - arc.centre).norm();
      length = std::hypot(radius * arc.sweep, arc.normal.dot(chord));
    }
    tip_moves_.push_back(length >= kNoMotion);
    if (length < kNoMotion) length = mm_per_radian * legs_[i].turn.norm();
    lengths_.push_back(length);
  }
}

void CornerPath::check_legs() const {
  const auto same_rotation = [](const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
    return a.angularDistance(b) < kJoined;
  };
  for (std::size_t i = 0; i < legs_.size(); ++i) {
    require(tip_moves_[i] || legs_[i].turn.norm() >= kNoTurn, "corner_path: every leg moves");
    require(same_rotation(nodes_[i].rotation * exponential(legs_[i].turn), nodes_[i + 1].rotation),
            "corner_path: turns lead from node to node");
    require((leg_tip(i, lengths_[i]) - nodes_[i + 1].tip).norm() < kJoined,
            "corner_path: arcs lead from node to node");
  }
  if (!settings_.closed) return;
  require((nodes_.front().tip - nodes_.back().tip).norm() < kJoined &&
              same_rotation(nodes_.front().rotation, nodes_.back().rotation),
          "corner_path: a closed path ends where it starts");
}

double CornerPath::curvature(std::size_t leg) const {
  if (legs_[leg].arc < 0 || !tip_moves_[leg]) return 0.0;
  const ArcGeometry& arc = arcs_[static_cast<std::size_t>(legs_[leg].arc)];
  const double radius = arc.normal.cross(nodes_[leg].tip - arc.centre).norm();
  const double rate = arc.sweep / lengths_[leg];
  return radius * rate * rate;
}

CornerPath::Mean CornerPath::mean(std::size_t leg, bool from_end, double x) const {
  Mean m = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
  if (!tip_moves_[leg]) return m;
  const Vec3 chord = nodes_[leg + 1].tip - nodes_[leg].tip;
  if (legs_[leg].arc < 0) {
    m[0] = chord / lengths_[leg];
    return m;
  }
  const ArcGeometry& arc = arcs_[static_cast<std::size_t>(legs_[leg].arc)];
  const Vec3 from = nodes_[leg + (from_end ? 1 : 0)].tip - arc.centre;
  const Vec3 spoke = from - arc.normal * arc.normal.dot(from);
  const Vec3 across = arc.normal.cross(spoke);
  const double rate = arc.sweep / lengths_[leg];
  const Circular c = circular(rate * x);
  double factor = rate;
  for (std::size_t r = 0; r < 4; ++r) {
    m[r] = factor * (c.sine[r] * across + c.cosine[r] * spoke);
    factor *= rate;
  }
  m[0] += arc.normal * (arc.normal.dot(chord) / lengths_[leg]);
  return m;
}

bool CornerPath::can_blend(std::size_t node) const {
  if (nodes_[node].exact) return false;
  const bool end = node == 0 || node + 1 == nodes_.size();
  return !end || (settings_.closed && node == 0);
}

// Wanted extents become such that no two windows of one leg overlap.
void CornerPath::share(std::vector<double>& extents, const std::vector<double>& weights) const {
  const std::vector<double> wanted = extents;
  for (std::size_t leg = 0; leg < legs_.size(); ++leg) {
    const std::size_t a = leg;
    const std::size_t b = settings_.closed && leg + 1 == legs_.size() ? 0 : leg + 1;
    const double length = lengths_[leg];
    if (wanted[a] + wanted[b] <= length) continue;
    const double of_a = std::sqrt(weights[a]);
    const double sum = of_a + std::sqrt(weights[b]);
    const double part = sum > 0.0 ? length * of_a / sum : 0.5 * length;
    extents[a] = std::min(extents[a], std::max(part, length - wanted[b]));
    extents[b] = std::min(extents[b], std::max(length - part, length - wanted[a]));
    extents[b] = std::max(0.0, std::min(extents[b], length - extents[a]));
  }
}

void CornerPath::plan_tip() {
  std::vector<double> extents(nodes_.size(), 0.0);
  std::vector<double> weights(nodes_.size(), 0.0);
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    Corner& corner = corners_[i];
    if (i > 0 || settings_.closed) {
      if (i + 1 == nodes_.size()) break;
      const Vec3 in = direction(leg_before(i), true);
      const Vec3 out = direction(leg_after(i), false);
      const double jump = (out - in).norm();
      const bool moves = tip_moves_[leg_before(i)] && tip_moves_[leg_after(i)];
      corner.turn = moves ? 2.0 * std::asin(std::min(1.0, 0.5 * jump)) : 0.0;
      corner.stop = moves && corner.turn > settings_.stop_angle;
      if (settings_.kind == BlendKind::ramp)
        corner.blend = BlendFunction::ramp(settings_.ramp_c1.value_or(ramp_c1(corner.turn)));
      else if (settings_.paper_shape && corner.turn > kStraight && !corner.stop)
        corner.blend = BlendFunction::acr(acr_fit(corner.turn));
      else
        corner.blend = rotation_blend_;
      if (corner.stop || !can_blend(i)) continue;
      const double bend = curvature(leg_before(i)) + curvature(leg_after(i));
      const double reach = corner.blend.reach();
      const double room = settings_.tip_tolerance / corner.blend.at_zero();
      if (jump < kStraight && bend <= 0.0) continue;
      // h·(jump + reach·h·bend/2) = room, the root without cancellation.
      const double half = 2.0 * room / (jump + std::sqrt(jump * jump + 2.0 * reach * bend * room));
      extents[i] = reach * half;
      const double sine = std::min(0.9999, 0.5 * (jump + extents[i] * bend / 2.0));
      weights[i] = sine / (1.0 - sine * sine);
    }
  }
  share(extents, weights);
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    corners_[i].half_width = extents[i] / corners_[i].blend.reach();
}

// Where only an axis counts: with δ = h·g·(w1 − w0) the axis turns by at most
// ∫|across(J·δ)| ≤ |across δ| + |across(φ × δ)|/2 + |φ|·|φ × δ|/6, and φ × δ = x·h·g·(w0 × w1). As
// g(−u) ≤ g(0)(1 − u/reach), that is at most h·g(0)·max over v ∈ [0, 1] of (1 − v)(A + D·v).
double CornerPath::axis_deviation(std::size_t node, double half_width) const {
  const Vec3 in = rate(leg_before(node));
  const Vec3 out = rate(leg_after(node));
  const Vec3 jump = out - in;
  const auto across = [this](const Vec3& v) { return settings_.tool_axis->cross(v).norm(); };
  const double turned = half_width * rotation_blend_.at_zero();
  const double extent = half_width * rotation_blend_.reach();
  const Vec3 twist = in.cross(out);
  const double most_turn = extent * std::max(in.norm(), out.norm()) + turned * jump.norm();
  const double a = across(jump);
  const double d = extent * (across(twist) / 2.0 + most_turn * twist.norm() / 6.0);
  const double rate_bound = d <= a ? a : (a + d) * (a + d) / (4.0 * d);
  return turned * std::min(jump.norm(), rate_bound);
}

double CornerPath::rotation_extent(std::size_t node) const {
  const double shorter = std::min(lengths_[leg_before(node)], lengths_[leg_after(node)]);
  const double reach = rotation_blend_.reach();
  const double room = settings_.rotation_tolerance / rotation_blend_.at_zero();
  const Vec3 jump = rate(leg_after(node)) - rate(leg_before(node));
  double low = room / jump.norm();
  if (!settings_.tool_axis || low * reach >= shorter) return std::min(reach * low, shorter);
  // Rotation about the tool alone may be blended as far as the legs go.
  const double across = settings_.tool_axis->cross(jump).norm();
  double high = across * shorter > room * reach ? room / across : shorter / reach;
  if (axis_deviation(node, high) <= settings_.rotation_tolerance * (1.0 + 1e-14))
    return reach * high;
  for (int i = 0; i < kBisections; ++i) {
    const double middle = 0.5 * (low + high);
    (axis_deviation(node, middle) <= settings_.rotation_tolerance ? low : high) = middle;
  }
  return reach * low;
}

void CornerPath::plan_rotation() {
  std::vector<double> extents(nodes_.size(), 0.0);
  std::vector<double> weights(nodes_.size(), 0.0);
  for (std::size_t i = settings_.closed ? 0 : 1; i + 1 < nodes_.size(); ++i) {
    if (corners_[i].stop || !can_blend(i)) continue;
    const Vec3 jump = rate(leg_after(i)) - rate(leg_before(i));
    weights[i] = jump.norm();
    if (weights[i] < kNoTurn) continue;
    extents[i] = rotation_extent(i);
  }
  share(extents, weights);
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    corners_[i].rotation_half_width = extents[i] / rotation_blend_.reach();
}

CornerPath::Place CornerPath::place(std::size_t leg, double x, double start_extent,
                                    double end_extent) const {
  if (start_extent > 0.0 && x <= start_extent) return {leg, x, true};
  if (end_extent > 0.0 && x >= lengths_[leg] - end_extent)
    return {leg + 1, x - lengths_[leg], true};
  return {leg, x, false};
}

CornerPath::Place CornerPath::tip_place(std::size_t leg, double x) const {
  const Corner& a = corners_[leg];
  const Corner& b = corners_[leg + 1];
  return place(leg, x, a.half_width * a.blend.reach(), b.half_width * b.blend.reach());
}

CornerPath::Place CornerPath::rotation_place(std::size_t leg, double x) const {
  const double reach = rotation_blend_.reach();
  return place(leg, x, corners_[leg].rotation_half_width * reach,
               corners_[leg + 1].rotation_half_width * reach);
}

Vec3 CornerPath::leg_tip(std::size_t leg, double x) const {
  return nodes_[leg].tip + x * mean(leg, false, x)[0];
}

std::array<Vec3, 4> CornerPath::tip_derivatives(std::size_t leg, double x) const {
  const Place at = tip_place(leg, x);
  const std::size_t before = at.blended ? leg_before(at.node) : leg;
  const Mean m = mean(before, at.blended, at.x);
  std::array<Vec3, 4> r = {nodes_[at.node].tip + at.x * m[0], m[0] + at.x * m[1],
                           2.0 * m[1] + at.x * m[2], 3.0 * m[2] + at.x * m[3]};
  if (!at.blended) return r;
  const Mean n = mean(leg_after(at.node), false, at.x);
  const Corner& corner = corners_[at.node];
  const double h = corner.half_width;
  const BlendValue g = corner.blend.at(at.x / h);
  const std::array<double, 4> f = {h * g.value, g.d1, g.d2 / h, g.d3 / (h * h)};
  Mean e;
  for (std::size_t k = 0; k < 4; ++k) e[k] = n[k] - m[k];
  r[0] += f[0] * e[0];
  r[1] += f[1] * e[0] + f[0] * e[1];
  r[2] += f[2] * e[0] + 2.0 * f[1] * e[1] + f[0] * e[2];
  r[3] += f[3] * e[0] + 3.0 * f[2] * e[1] + 3.0 * f[1] * e[2] + f[0] * e[3];
  return r;
}

// The rotation vector from the place's node, with derivatives.
std::array<Vec3, 4> CornerPath::chart(const Place& at, std::size_t leg) const {
  if (!at.blended) return {at.x * rate(leg), rate(leg), Vec3::Zero(), Vec3::Zero()};
  const Vec3 in = rate(leg_before(at.node));
  const Vec3 jump = rate(leg_after(at.node)) - in;
  const double h = corners_[at.node].rotation_half_width;
  const BlendValue g = rotation_blend_.at(at.x / h);
  return {at.x * in + h * g.value * jump, in + g.d1 * jump, g.d2 / h * jump, g.d3 / (h * h) * jump};
}

Pose CornerPath::at(std::size_t leg, double x) const {
  const Place tip = tip_place(leg, x);
  Pose pose = Pose::Identity();
  const std::size_t before = tip.blended ? leg_before(tip.node) : leg;
  const Vec3 in = mean(before, tip.blended, tip.x)[0];
  pose.translation() = nodes_[tip.node].tip + tip.x * in;
  if (tip.blended) {
    const Corner& corner = corners_[tip.node];
    const double blended = corner.half_width * corner.blend.at(tip.x / corner.half_width).value;
    pose.translation() += blended * (mean(leg_after(tip.node), false, tip.x)[0] - in);
  }
  const Place turn = rotation_place(leg, x);
  Vec3 phi = turn.x * rate(leg);
  if (turn.blended) {
    const Vec3 rate_in = rate(leg_before(turn.node));
    const double h = corners_[turn.node].rotation_half_width;
    phi = turn.x * rate_in +
          h * rotation_blend_.at(turn.x / h).value * (rate(leg_after(turn.node)) - rate_in);
  }
  pose.linear() = (nodes_[turn.node].rotation * exponential(phi)).normalized().toRotationMatrix();
  return pose;
}

Pose CornerPath::original(std::size_t leg, double x) const {
  Pose pose = Pose::Identity();
  pose.translation() = leg_tip(leg, x);
  pose.linear() =
      (nodes_[leg].rotation * exponential(Vec3(x * rate(leg)))).normalized().toRotationMatrix();
  return pose;
}

PoseDerivatives CornerPath::derivatives(std::size_t leg, double x) const {
  PoseDerivatives d;
  d.tip = tip_derivatives(leg, x);
  const Place turn = rotation_place(leg, x);
  const auto q = exponential(chart(turn, leg));
  for (std::size_t r = 0; r < 4; ++r) d.rotation[r] = product(nodes_[turn.node].rotation, q[r]);
  return d;
}

std::vector<double> CornerPath::breaks(std::size_t leg) const {
  const double length = lengths_[leg];
  std::vector<double> at = {0.0};
  const auto add = [&at, length](double x) {
    if (x > 0.0 && x < length) at.push_back(x);
  };
  const Corner& a = corners_[leg];
  const Corner& b = corners_[leg + 1];
  const auto add_window = [&](double width, const BlendFunction& blend, bool at_end) {
    std::vector<double> places = blend.knots();
    places.push_back(blend.reach());
    for (const double u : places) add(at_end ? length - width * u : width * u);
  };
  add_window(a.half_width, a.blend, false);
  add_window(b.half_width, b.blend, true);
  add_window(a.rotation_half_width, rotation_blend_, false);
  add_window(b.rotation_half_width, rotation_blend_, true);
  std::sort(at.begin(), at.end());
  const auto same = [length](double x, double y) { return y - x <= kSameBreak * length; };
  at.erase(std::unique(at.begin(), at.end(), same), at.end());
  if (at.size() > 1 && same(at.back(), length)) at.pop_back();
  at.push_back(length);
  return at;
}

CornerPath::Bend CornerPath::bend_bound(std::size_t leg, double from, double to) const {
  Bend bound;
  const double middle = 0.5 * (from + to);
  const Place tip = tip_place(leg, middle);
  bound.tip = curvature(leg);
  if (tip.blended) {
    const Corner& corner = corners_[tip.node];
    const std::size_t in = leg_before(tip.node);
    const std::size_t out = leg_after(tip.node);
    const double bend = curvature(in) + curvature(out);
    const double jump = (direction(out, false) - direction(in, true)).norm();
    const double extent = corner.half_width * corner.blend.reach();
    bound.tip =
        curvature(in) + 2.0 * kMostSlope * bend + bend +
        corner.blend.second_derivative_bound() / corner.half_width * (jump + 0.5 * extent * bend);
  }
  const Place turn = rotation_place(leg, middle);
  double rate_bound = rate(leg).norm();
  if (turn.blended) {
    const Vec3 in = rate(leg_before(turn.node));
    const double jump = (rate(leg_after(turn.node)) - in).norm();
    rate_bound = in.norm() + kMostSlope * jump;
    bound.axis =
        rotation_blend_.second_derivative_bound() / corners_[turn.node].rotation_half_width * jump;
  }
  // |axis''| ≤ |ω|² + |ω'|, and ω' leaves φ'' by the chart's own bending, at most |φ'|²/2.
  bound.axis += 1.5 * rate_bound * rate_bound;
  return bound;
}

}  // namespace smoothpost
