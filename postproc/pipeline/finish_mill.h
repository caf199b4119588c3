#pragma once

#include <limits>
#include <vector>

#include "kernels/geometry/triangle_tree.h"
#include "postproc/pipeline/contour_pieces.h"

// What the end mill itself does to the part and how much it takes.
namespace smoothpost {

/// A ball of `radius` that touches the tip and a cylinder as wide behind it, `length` mm long from
/// the tip: what is in front of the machine's bodies.
struct EndMill {
  double radius = 1.5;   ///< mm
  double length = 30.0;  ///< mm
};

/// How the mill lies to a part.
class MillFit {
 public:
  /// `part` outlives it.   @pre radius > 0, length > radius
  MillFit(const TriangleTree& part, const EndMill& mill) : part_(part), mill_(mill) {}

  /// How far the part stays outside of the mill with tip and axis at a place, mm; negative: the
  /// mill cuts into it. Measured about points of the mill's middle that are a quarter of its radius
  /// apart where the part is near; the search ends at the first place a quarter of the radius
  /// inside. Of open parts the side of the nearest triangle counts.   Cost: 8 queries on an open
  /// wall.
  double room(const SurfacePoint& at) const;
  const EndMill& mill() const { return mill_; }

 private:
  const TriangleTree& part_;
  EndMill mill_;
};

/// Least, mean and greatest depth of cut over measured points.
struct DepthOfCut {
  double least = std::numeric_limits<double>::infinity();
  double greatest = -std::numeric_limits<double>::infinity();
  double sum = 0.0;
  std::size_t count = 0;

  void add(double depth);
  double mean() const { return count > 0 ? sum / static_cast<double>(count) : 0.0; }
};

/// Whether a point of a surface is inside of another body of the mesh: what is a little outside of
/// it is enclosed (way_out()), of an open mesh as most of three directions have it.
bool buried(const TriangleTree& mesh, const SurfacePoint& at);

/// How deep the tip lies in the stock along its axis, mm: the way out of it (way_out()); negative
/// outside, by the distance of its surface.
double depth_in(const TriangleTree& stock, const Vec3& tip, const Vec3& axis);

}  // namespace smoothpost
