#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kernels/core/pose.h"

namespace smoothpost {

/// Indexed triangles, vertices in mm, counter-clockwise seen from outside.
struct TriangleMesh {
  std::vector<Vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

}  // namespace smoothpost
