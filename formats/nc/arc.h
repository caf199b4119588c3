#pragma once

#include <string>

#include "kernels/core/pose.h"

namespace smoothpost::nc {

/// A point of the active plane: coordinates along its first and second axis (G17 X Y, G18 Z X, G19
/// Y Z).
struct PlanePoint {
  double first = 0.0;
  double second = 0.0;
};

/// What a G2 or G3 block says, in program coordinates, mm.
struct ArcWords {
  PlanePoint start;
  PlanePoint end;
  bool clockwise = false;
  int turns = 1;                  ///< P: full circles begun, at least 1
  double centre_tolerance = 0.0;  ///< centre form: largest difference of the two radii
  double radius_tolerance =
      0.0;  ///< smallest radius; radius form: how far half a chord may exceed it
};

/// The arc in its plane. `problem` says why there is none; it is empty when there is one.
struct PlaneArc {
  PlanePoint centre;
  double sweep = 0.0;   ///< rad, counter-clockwise positive, with all turns
  double radius = 0.0;  ///< mm, mean of the radii at start and end
  std::string problem;
};

/// Arc by its centre. Refused when a radius is below the radius tolerance, or when the radii r1 and
/// r2 at start and end differ by more than 100 centre tolerances, or by more than one and by one
/// thousandth of the larger (the rule of LinuxCNC 2.9). Within it the controller lets the radius go
/// linearly from r1 to r2. An end within 1e-6 rad of the start is a full circle.
PlaneArc arc_by_centre(const ArcWords& words, const PlanePoint& centre);

/// Arc by its radius: positive below half a circle, negative above. A radius that is too short by
/// at most the radius tolerance is taken as half the chord; start and end in one point are refused.
PlaneArc arc_by_radius(const ArcWords& words, double radius);

}  // namespace smoothpost::nc
