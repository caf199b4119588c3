#include "machines/dialects/zyx_angles.h"

#include <algorithm>
#include <cmath>

namespace smoothpost {

ZyxAngles zyx_angles(const Mat3& rotation, double held_z) {
  constexpr double kGimbal = 1e-9;
  ZyxAngles angles;
  const bool free_z = std::hypot(rotation(0, 0), rotation(1, 0)) < kGimbal;
  angles.z = free_z ? held_z : std::atan2(rotation(1, 0), rotation(0, 0));
  const Mat3 rest = rotation_about(Vec3::UnitZ(), -angles.z) * rotation;  // Ry(y)·Rx(x)
  angles.y = std::atan2(-rest(2, 0), std::max(rest(0, 0), 0.0));
  angles.x = std::atan2(-rest(1, 2), rest(1, 1));
  return angles;
}

}  // namespace smoothpost
