#include "kernels/schedule/rest_map.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"

namespace smoothpost {
namespace {

constexpr double kRampShare = 0.6;        // r(1)
constexpr double kLooseRamp = 0.02;       // of L/v, where nothing asks for a ramp
constexpr double kFirstJerk = 12.0;       // r'''(0)
constexpr double kMostBend = 16.0 / 9.0;  // max r''

/// r, r', r'', r''' at u.
std::array<double, 4> ramp_values(double u) {
  const double rest = 1.0 - u;
  return {u * u * u * (2.0 + u * (-2.0 + 0.6 * u)), u * u * (6.0 + u * (-8.0 + 3.0 * u)),
          12.0 * u * rest * rest, 12.0 * rest * (1.0 - 3.0 * u)};
}

/// u in [0, 1] with r(u) = y. r is convex, so Newton's steps from the right descend to the root.
double ramp_inverse(double y) {
  if (y <= 0.0) return 0.0;
  if (y >= kRampShare) return 1.0;
  double u = std::min(1.0, std::cbrt(0.5 * y));  // r(u) ≤ 2u³: not right of the root
  for (int step = 0; step < 30; ++step) {
    const auto r = ramp_values(u);
    const double next = std::min(1.0, u - (r[0] - y) / r[1]);
    if (step > 0 && next >= u) break;
    u = next;
  }
  return u;
}

double ramp_time(double speed, const RestGrading& g) {
  return std::max(std::sqrt(kFirstJerk * speed / g.jerk), kMostBend * speed / g.acceleration);
}

/// The v for which `share` = v τ(v), or infinity.
double speed_of_share(double share, const RestGrading& g) {
  return std::min(std::cbrt(share * share * g.jerk / kFirstJerk),
                  std::sqrt(share * g.acceleration / kMostBend));
}

}  // namespace

RestMap::RestMap(double length, const RestGrading& grading, RestEnds ends)
    : length_(length), ends_(ends) {
  require(length > 0.0, "RestMap: length > 0");
  require(grading.speed > 0.0 && grading.acceleration > 0.0 && grading.jerk > 0.0,
          "RestMap: grading > 0");
  const int ramps = ends.count();
  speed_ = grading.speed;
  if (ramps > 0) {
    speed_ = std::min(speed_, speed_of_share(length / (kRampShare * ramps), grading));
    require(std::isfinite(speed_), "RestMap: something finite");
    ramp_ = ramp_time(speed_, grading);
    if (ramp_ == 0.0) ramp_ = kLooseRamp * length / speed_;
  }
  require(std::isfinite(speed_), "RestMap: a finite speed");
  const double cruise = std::max(0.0, length - kRampShare * ramps * speed_ * ramp_);
  extent_ = cruise > 1e-9 * length ? cruise / speed_ + ramps * ramp_ : ramps * ramp_;
  if (ramps > 0 && extent_ == ramps * ramp_) speed_ = length / (kRampShare * ramps * ramp_);
}

MapZone RestMap::zone(double w) const {
  if (ends_.start && w < ramp_) return MapZone::start_ramp;
  if (ends_.end && w > extent_ - ramp_) return MapZone::end_ramp;
  return MapZone::cruise;
}

std::array<double, 4> RestMap::at(double w, MapZone zone) const {
  const double scale = speed_ * ramp_;
  if (zone == MapZone::cruise) {
    const double before = ends_.start ? kRampShare * scale + speed_ * (w - ramp_) : speed_ * w;
    return {before, speed_, 0.0, 0.0};
  }
  const bool start = zone == MapZone::start_ramp;
  const auto r = ramp_values((start ? w : extent_ - w) / ramp_);
  const double second = speed_ * r[2] / ramp_;
  return {start ? scale * r[0] : length_ - scale * r[0], speed_ * r[1], start ? second : -second,
          speed_ * r[3] / (ramp_ * ramp_)};
}

double RestMap::inverse(double s) const {
  if (s <= 0.0) return 0.0;
  if (s >= length_) return extent_;
  const double scale = speed_ * ramp_;
  if (ends_.start && s < kRampShare * scale) return ramp_ * ramp_inverse(s / scale);
  if (ends_.end && length_ - s < kRampShare * scale)
    return extent_ - ramp_ * ramp_inverse((length_ - s) / scale);
  const double w = ends_.start ? ramp_ + (s - kRampShare * scale) / speed_ : s / speed_;
  return std::clamp(w, 0.0, extent_);
}

std::vector<double> RestMap::kinks() const {
  std::vector<double> places;
  if (ends_.start && ramp_ < extent_) places.push_back(ramp_);
  if (ends_.end && extent_ - ramp_ > (places.empty() ? 0.0 : ramp_ * (1.0 + 1e-9)))
    places.push_back(extent_ - ramp_);
  return places;
}

}  // namespace smoothpost
