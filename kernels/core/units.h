#pragma once

#include <numbers>

// Millimetre, radian and second are the only units inside kernels/. These factors are for the
// floors above, which meet degrees, inches, minutes and metres in files.
namespace smoothpost {

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kRadiansPerDegree = kPi / 180.0;
inline constexpr double kDegreesPerRadian = 180.0 / kPi;
inline constexpr double kMillimetresPerInch = 25.4;
inline constexpr double kSecondsPerMinute = 60.0;

constexpr double radians_from_degrees(double degrees) { return degrees * kRadiansPerDegree; }
constexpr double degrees_from_radians(double radians) { return radians * kDegreesPerRadian; }

}  // namespace smoothpost
