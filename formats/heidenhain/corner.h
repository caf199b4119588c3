#pragma once

#include <string>

#include "kernels/core/pose.h"

namespace smoothpost::conversational {

/// What RND or CHF puts between two straight lines of the working plane. `problem` says why there
/// is none.
struct Corner {
  Vec3 begin = Vec3::Zero();  ///< the first line ends here
  Vec3 end = Vec3::Zero();    ///< the second one begins here
  Vec3 centre = Vec3::Zero();
  double sweep = 0.0;  ///< rad about Z, right-hand; 0: a straight chamfer
  std::string problem;
};

/// The corner that lines meet in; mm.
struct CornerLines {
  Vec3 start = Vec3::Zero();
  Vec3 corner = Vec3::Zero();
  Vec3 end = Vec3::Zero();
};

/// RND: the arc of `radius` that touches both lines.  Guarantees: it begins and ends on the lines,
/// tangentially (test "corners: RND touches both lines").
Corner rounded_corner(const CornerLines& lines, double radius);

/// CHF: `length` is cut off each line.
Corner chamfered_corner(const CornerLines& lines, double length);

}  // namespace smoothpost::conversational
