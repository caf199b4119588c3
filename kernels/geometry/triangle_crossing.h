#pragma once

#include <array>

#include "kernels/core/pose.h"

namespace smoothpost {

/// True when the relative interiors of two triangles have a point in common (report_surface()).
/// Exact for any coordinates. Corners in any order, mm.
/// @pre both triangles have area; not checked
bool triangles_cross(const std::array<Vec3, 3>& a, const std::array<Vec3, 3>& b);

}  // namespace smoothpost
