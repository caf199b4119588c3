#pragma once

#include "kernels/core/pose.h"

namespace smoothpost {

/// R = Rz(z)·Ry(y)·Rx(x) in rad, x and z in (−π, π], y in [−π/2, π/2]: KUKA's A, B, C are z, y, x;
/// RT of a SINUMERIK frame about X, Y, Z are x, y, z.
struct ZyxAngles {
  double z = 0.0;
  double y = 0.0;
  double x = 0.0;
};

/// The angles of a rotation. Where |y| is π/2 within 1e-9, z and x are not unique: then z is
/// `held_z`.   Guarantee (test): the rotation comes back within 1e-8 rad, near the gimbal too.
ZyxAngles zyx_angles(const Mat3& rotation, double held_z = 0.0);

}  // namespace smoothpost
