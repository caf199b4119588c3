#pragma once

#include "kernels/geometry/triangle_tree.h"
#include "postproc/pipeline/reference_path.h"

namespace smoothpost {

/// Angles of a tool axis in a cutting frame, rad: lead in the plane of normal and tangent, positive
/// when the axis leans forward; tilt in the plane of normal and binormal.
struct LeadTilt {
  double lead = 0.0;
  double tilt = 0.0;
};

/// The frame in which a beam's orientation is judged at one place of the input.
struct CuttingFrame {
  Vec3 normal = Vec3::UnitZ();    ///< N, unit: of the part, or the programmed tool axis
  Vec3 tangent = Vec3::UnitX();   ///< T, unit, along the tip's way, at right angles to N
  Vec3 binormal = Vec3::UnitY();  ///< B = N × T
  LeadTilt programmed;            ///< of the programmed tool axis; 0 when it is N

  /// lead = atan2(O·T, O·N), tilt = atan2(O·B, O·N).   @pre axis unit
  LeadTilt angles(const Vec3& axis) const;
};

/// Cutting frames along an input. N comes from the part where there is one (the way to the closest
/// point, or the pseudo-normal there where the tip is nearer than 0.1 mm, on the side of the
/// programmed axis), else it is the programmed axis. T is the direction of the tip from `window` mm
/// before the place to `window` mm behind it along the same cut (one-sided at its ends), made
/// orthogonal to N; where the tip stands, the last direction. Immutable; reference and part outlive
/// it.   Cost: linear to build, a closest point query a call.
class CuttingFrames {
 public:
  /// @param first, last  segments of the cut   @param part  in W; nullptr: none
  CuttingFrames(const ReferencePath& reference, std::uint32_t first, std::uint32_t last,
                const TriangleTree* part, double window = 0.5);

  CuttingFrame at(const PathPlace& place) const;
  bool from_part() const { return part_ != nullptr; }
  std::uint32_t first() const { return first_; }
  std::uint32_t last() const { return last_; }

 private:
  PathPlace moved(const PathPlace& place, double length) const;

  const ReferencePath& reference_;
  const TriangleTree* part_;
  double window_;
  std::uint32_t first_, last_;
  std::vector<double> start_;  ///< length of the tip's way at the start of each segment
};

/// Largest angle between beam and surface normal at which a nozzle land of radius r stays min_gap
/// above the part at nominal gap g: g·cos t − r·sin t = min_gap (rad); π/2 when min_gap is 0 and r
/// 0.
double largest_beam_angle(double gap, double land_radius, double min_gap);
/// The gap that is left at angle t: g·cos t − r·sin t.
double tilted_gap(double gap, double land_radius, double angle);

}  // namespace smoothpost
