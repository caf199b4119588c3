#include "postproc/pipeline/cutting_frame.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"

namespace smoothpost {

namespace {

constexpr double kNoWay = 1e-9;     // mm, of a chord without direction
constexpr double kNoAngle = 1e-9;   // sine of an angle below which two directions are one
constexpr double kStandsOff = 0.1;  // mm, from where the way to the part says its normal

Vec3 any_perpendicular(const Vec3& n) {
  const Vec3 least = std::abs(n.x()) < 0.6 ? Vec3::UnitX() : Vec3::UnitY();
  return (least - n.dot(least) * n).normalized();
}

/// Unit, the part of `way` at right angles to `normal`; zero where there is none.
Vec3 across(const Vec3& way, const Vec3& normal) {
  const double length = way.norm();
  if (length <= kNoWay) return Vec3::Zero();
  const Vec3 direction = way / length;
  const Vec3 rest = direction - normal.dot(direction) * normal;
  return rest.norm() > kNoAngle ? Vec3(rest.normalized()) : Vec3(Vec3::Zero());
}

Vec3 part_normal(const TriangleTree& part, const CutterLocation& at) {
  const ClosestPoint closest = part.closest(at.tip);
  Vec3 normal = closest.normal;
  // Above the edge of two facets the way to it turns from one face's normal to the other's; the
  // pseudo-normal would be half a right angle off at the rim of a sheet.
  const Vec3 way = at.tip - closest.point;
  if (way.norm() >= kStandsOff) normal = way.normalized();
  return normal.dot(at.axis) < 0.0 ? Vec3(-normal) : normal;
}

}  // namespace

LeadTilt CuttingFrame::angles(const Vec3& axis) const {
  const double up = axis.dot(normal);
  return {std::atan2(axis.dot(tangent), up), std::atan2(axis.dot(binormal), up)};
}

CuttingFrames::CuttingFrames(const ReferencePath& reference, std::uint32_t first,
                             std::uint32_t last, const TriangleTree* part, double window)
    : reference_(reference), part_(part), window_(window), first_(first), last_(last) {
  require(first >= 1 && first <= last && last <= reference.segments(), "segments of the path");
  require(window > 0.0, "a window has a length");
  start_.reserve(last - first + 2);
  start_.push_back(0.0);
  for (std::uint32_t k = first; k <= last; ++k)
    start_.push_back(start_.back() + reference.length(k));
}

CuttingFrame CuttingFrames::at(const PathPlace& place) const {
  require(place.segment >= first_ && place.segment <= last_, "a place of the cut");
  const CutterLocation here = reference_.at(place.segment, place.s);
  CuttingFrame frame;
  frame.normal = part_ != nullptr ? part_normal(*part_, here) : here.axis;
  const auto tip = [this](const PathPlace& p) { return reference_.at(p.segment, p.s).tip; };
  const Vec3 behind = tip(moved(place, window_));
  const Vec3 before = tip(moved(place, -window_));
  // A tip that turns back has no chord: the last direction, or at the start the next one.
  for (const Vec3& way :
       {Vec3(behind - before), Vec3(here.tip - before), Vec3(behind - here.tip)}) {
    frame.tangent = across(way, frame.normal);
    if (!frame.tangent.isZero()) break;
  }
  if (frame.tangent.isZero()) frame.tangent = any_perpendicular(frame.normal);
  frame.binormal = frame.normal.cross(frame.tangent);
  if (part_ != nullptr) frame.programmed = frame.angles(here.axis);
  return frame;
}

PathPlace CuttingFrames::moved(const PathPlace& place, double length) const {
  const std::size_t here = place.segment - first_;
  const double way = start_[here] + place.s * (start_[here + 1] - start_[here]);
  const double target = std::clamp(way + length, 0.0, start_.back());
  const auto behind = std::upper_bound(start_.begin() + 1, start_.end() - 1, target);
  const auto k = static_cast<std::size_t>(behind - start_.begin()) - 1;
  const double of_segment = start_[k + 1] - start_[k];
  PathPlace found;
  found.segment = first_ + static_cast<std::uint32_t>(k);
  found.s = of_segment > 0.0 ? std::min(1.0, (target - start_[k]) / of_segment) : 1.0;
  return found;
}

double largest_beam_angle(double gap, double land_radius, double min_gap) {
  const double reach = std::hypot(gap, land_radius);
  if (reach <= 0.0) return 0.5 * kPi;
  const double angle =
      std::acos(std::clamp(min_gap / reach, 0.0, 1.0)) - std::atan2(land_radius, gap);
  return std::max(0.0, angle);
}

double tilted_gap(double gap, double land_radius, double angle) {
  return gap * std::cos(angle) - land_radius * std::sin(angle);
}

}  // namespace smoothpost
