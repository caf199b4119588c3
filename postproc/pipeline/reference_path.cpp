#include "postproc/pipeline/reference_path.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

double rotary_turn(const AxisWords& from, const AxisWords& to) {
  double turn = 0.0;
  for (std::size_t i = 3; i < 6; ++i) turn += std::abs(to[i] - from[i]);
  return turn;
}

bool by_words(PathInterpolation interpolation) {
  return interpolation == PathInterpolation::rotary_linear ||
         interpolation == PathInterpolation::joint_linear;
}

Vec3 xyz(const AxisWords& words) { return Vec3(words[0], words[1], words[2]); }

}  // namespace

ReferencePath::ReferencePath(const ToolPath& path, Frames frames)
    : path_(path), frames_(std::move(frames)), part_from_world_(frames_.world_from_part.inverse()) {
  if (frames_.input_machine) chain_ = chain_of(*frames_.input_machine);
}

JointVector ReferencePath::joints_of(const AxisWords& words, double compensation) const {
  const auto& axes = frames_.input_machine->axes;
  JointVector q(static_cast<Eigen::Index>(axes.size()));
  for (std::size_t j = 0; j < axes.size(); ++j) {
    const auto w = kAxisLetters.find(axes[j].letter);
    double value = w == std::string_view::npos ? axes[j].joint.home : words[w];
    if (axes[j].letter == 'Z') value += compensation;
    q[static_cast<Eigen::Index>(j)] = value;
  }
  return q;
}

CutterLocation ReferencePath::location_of_words(const AxisWords& words,
                                                const PathPoint& like) const {
  require(by_words(like.interpolation), "words need an interpolation by words");
  CutterLocation location;
  if (!chain_) {  // a program without rotary words and without an input machine: the axis is Z
    location.axis = part_from_world_.linear() * Vec3::UnitZ();
    location.tip = part_from_world_ * xyz(words) - like.tip_offset * location.axis;
    return location;
  }
  const CutterLocation of_chain = forward_location(*chain_, joints_of(words, like.compensation));
  location.axis = part_from_world_.linear() * of_chain.axis;
  const Vec3 controlled = like.interpolation == PathInterpolation::joint_linear
                              ? Vec3(of_chain.tip - like.compensation * of_chain.axis)
                              : xyz(words);
  location.tip = part_from_world_ * controlled - like.tip_offset * location.axis;
  return location;
}

AxisWords ReferencePath::words_at(std::size_t segment, double s) const {
  const PathPoint& from = path_.points[segment - 1];
  const PathPoint& to = path_.points[segment];
  AxisWords words;
  for (std::size_t i = 0; i < words.size(); ++i)
    words[i] = s == 1.0 ? to.words[i] : from.words[i] + s * (to.words[i] - from.words[i]);
  if (to.is_arc) {
    const ArcGeometry& arc = path_.arcs[static_cast<std::size_t>(to.arc)];
    const Vec3 start = xyz(from.words);
    const double rise = arc.normal.dot(xyz(to.words) - start);
    // The end may miss the circle of the start by the controller's centre tolerance: the radius
    // goes linearly from one to the other.
    const Vec3 spoke = start - arc.centre - arc.normal * arc.normal.dot(start - arc.centre);
    const Vec3 end_offset = xyz(to.words) - arc.centre;
    const double end_radius = (end_offset - arc.normal * arc.normal.dot(end_offset)).norm();
    const double radius = spoke.norm();
    const double scale = radius > 0.0 ? 1.0 + s * (end_radius / radius - 1.0) : 1.0;
    const Vec3 p = arc.centre + scale * (rotation_about(arc.normal, s * arc.sweep) * spoke) +
                   arc.normal * (arc.normal.dot(start - arc.centre) + s * rise);
    for (std::size_t i = 0; i < 3; ++i) words[i] = p[static_cast<Eigen::Index>(i)];
  }
  return words;
}

CutterLocation ReferencePath::at(std::size_t segment, double s) const {
  require(segment >= 1 && segment <= segments(), "segment of the path");
  const PathPoint& from = path_.points[segment - 1];
  const PathPoint& to = path_.points[segment];
  if (!by_words(to.interpolation)) {
    const Vec3 axis = to.interpolation == PathInterpolation::slerp
                          ? rotation_at(segment, s) * Vec3::UnitZ()
                          : great_circle(from.location.axis, to.location.axis, s);
    if (to.is_arc)
      return {part_from_world_ * xyz(words_at(segment, s)) - to.tip_offset * axis, axis};
    return {from.location.tip + s * (to.location.tip - from.location.tip), axis};
  }
  return location_of_words(words_at(segment, s), to);
}

Eigen::Quaterniond ReferencePath::rotation_at(std::size_t segment, double s) const {
  require(path_.full_pose, "the path has whole rotations");
  return path_.points[segment - 1].rotation.slerp(s, path_.points[segment].rotation);
}

SecondDerivativeBound ReferencePath::second_derivative_bound(std::size_t segment) const {
  const PathPoint& from = path_.points[segment - 1];
  const PathPoint& to = path_.points[segment];
  SecondDerivativeBound bound;
  if (!by_words(to.interpolation)) {
    const double angle = to.interpolation == PathInterpolation::slerp
                             ? from.rotation.angularDistance(to.rotation)
                             : angle_between(from.location.axis, to.location.axis);
    bound.axis = angle * angle;
    if (!to.is_arc) return bound;
  }
  double arc_second = 0.0;
  double arc_speed = 0.0;
  if (to.is_arc) {
    const ArcGeometry& arc = path_.arcs[static_cast<std::size_t>(to.arc)];
    const Vec3 offset = xyz(from.words) - arc.centre;
    const double radius = (offset - arc.normal * arc.normal.dot(offset)).norm();
    const Vec3 end_offset = xyz(to.words) - arc.centre;
    const double end_radius = (end_offset - arc.normal * arc.normal.dot(end_offset)).norm();
    // r(s)·e(φs): |p''| ≤ r φ² + 2 |r'| φ.
    arc_second = std::max(radius, end_radius) * arc.sweep * arc.sweep +
                 2.0 * std::abs(end_radius - radius) * std::abs(arc.sweep);
    arc_speed = std::max(radius, end_radius) * std::abs(arc.sweep) + std::abs(end_radius - radius) +
                std::abs(arc.normal.dot(xyz(to.words) - xyz(from.words)));
  }
  if (!by_words(to.interpolation)) {
    bound.tip = arc_second + std::abs(to.tip_offset) * bound.axis;
    return bound;
  }
  const double turn = rotary_turn(from.words, to.words);
  bound.axis = chain_ ? turn * turn : 0.0;
  if (to.interpolation == PathInterpolation::rotary_linear || !chain_) {
    bound.tip = arc_second + std::abs(to.tip_offset) * bound.axis;
    return bound;
  }
  const JointVector q0 = joints_of(from.words, to.compensation);
  JointVector q1 = joints_of(to.words, to.compensation);
  if (to.is_arc) {
    // A straight motion that covers the arc's speed in every linear joint bounds the mixed terms.
    for (Eigen::Index j = 0; j < q1.size(); ++j)
      if (chain_->joints[static_cast<std::size_t>(j)].kind == JointKind::linear)
        q1[j] = q0[j] + std::max(arc_speed, std::abs(q1[j] - q0[j]));
  }
  const SecondDerivativeBound straight = smoothpost::second_derivative_bound(*chain_, q0, q1);
  // The arc moves two linear joints, unit directions each: |Σ d_j q_j''| ≤ √2 |p''|.
  bound.tip = straight.tip + std::sqrt(2.0) * arc_second +
              (std::abs(to.compensation) + std::abs(to.tip_offset)) * straight.axis;
  bound.axis = straight.axis;
  return bound;
}

double ReferencePath::length(std::size_t segment) const {
  const PathPoint& from = path_.points[segment - 1];
  const PathPoint& to = path_.points[segment];
  if (to.interpolation != PathInterpolation::joint_linear && !to.is_arc)
    return (to.location.tip - from.location.tip).norm();
  // Chords that leave the curve by 1 µm at most; the length is for reports and sampling steps.
  const double bend = second_derivative_bound(segment).tip;
  const int chords = static_cast<int>(std::clamp(std::ceil(std::sqrt(bend / 8e-3)), 1.0, 256.0));
  double length = 0.0;
  Vec3 last = at(segment, 0.0).tip;
  for (int i = 1; i <= chords; ++i) {
    const Vec3 next = at(segment, static_cast<double>(i) / chords).tip;
    length += (next - last).norm();
    last = next;
  }
  return length;
}

double ReferencePath::feed(std::size_t segment) const {
  const double duration = path_.points[segment].duration;
  return duration > 0.0 ? length(segment) / duration : 0.0;
}

PathPlace place_between(const ReferencePath& reference, const PathPlace& from, const PathPlace& to,
                        double t) {
  const bool next = from.s == 1.0 && from.segment + 1 == to.segment;
  if (from.segment == to.segment || next) {
    const double start = next ? 0.0 : from.s;
    return {to.segment, t >= 1.0 ? to.s : start + t * (to.s - start)};
  }
  double length = 0.0;
  const auto part = [&](std::uint32_t k) {
    if (k == 0) return 0.0;  // the first point
    const double first = k == from.segment ? from.s : 0.0;
    const double last = k == to.segment ? to.s : 1.0;
    return reference.length(k) * (last - first);
  };
  for (std::uint32_t k = from.segment; k <= to.segment; ++k) length += part(k);
  double left = t * length;
  for (std::uint32_t k = from.segment; k <= to.segment; ++k) {
    const double here = part(k);
    const double first = k == from.segment ? from.s : 0.0;
    const double last = k == to.segment ? to.s : 1.0;
    if ((left < here || (t < 1.0 && k == to.segment)) && here > 0.0)
      return {k, std::min(last, first + left / here * (last - first))};
    left -= here;
  }
  return to;
}

}  // namespace smoothpost
