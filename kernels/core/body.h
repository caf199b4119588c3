#pragma once

#include <string>

#include "kernels/core/pose.h"

namespace smoothpost {

enum class BodyShape { frustum, cylinder, capsule, box };

/// A collision shape fixed to a link. `from` and `to` are the ends of its centre line (or opposite
/// corners of a box), mm in M at the home pose; radii in mm at the two ends.
struct Body {
  std::string link;
  std::string name;
  BodyShape shape = BodyShape::cylinder;
  Vec3 from = Vec3::Zero();
  Vec3 to = Vec3::Zero();
  double radius_from = 0.0;
  double radius_to = 0.0;
};

}  // namespace smoothpost
