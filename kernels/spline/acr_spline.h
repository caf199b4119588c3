#pragma once

#include <array>
#include <span>

#include "kernels/core/pose.h"
#include "kernels/spline/acr_basis.h"

namespace smoothpost {

/// Point of an ACR spline through control points, or its derivative by the parameter.
///
/// Parameter: x ∈ [1, n − 2] for n points; span i runs from point i to point i + 1 while t = x − i
/// runs from 0 to 1, whatever the distance of the points. Same κ and λ on every span.
/// Guarantees (tests): passes through the points 1 … n − 2; C³ in x at every knot; invariant under
/// rigid motion (every coordinate is treated alike).
/// Units of the points.   Cost: O(1), no allocation.
/// @pre n ≥ 4, 1 ≤ x ≤ n − 2, 0 ≤ order ≤ 3   @throws ContractViolation if not.
/// Implements [Cai2025] Eq. (5)–(12).
/// Differences from the paper: Eq. (5) and (13) read as graphs y(x) are not C¹ where the spacing
/// changes and x is not monotone on its corners; the spline is parametric in t.
Vec3 acr_spline(std::span<const Vec3> points, const AcrShape& shape, double x, int order = 0);

/// The eleven control points Q0 … Q10 of a corner.
///
/// Q_j = P − a_j·h·T0 + a_(10−j)·h·T1 with a = (5/2, 2, 3/2, 1, 3/5, 1/4, 1/15, 0, 0, 0, 0): Q0 …
/// Q3 lie on the leg that comes in along the unit vector T0, Q7 … Q10 on the one that leaves along
/// T1, at 1, 3/2, 2, 5/2 times h. The curve runs from Q1 to Q9 and leaves the legs between Q2 and
/// Q8; Q5 is its nearest point to the vertex P, h/4·|T1 − T0| away. Guarantee (test): golden
/// control points of the paper's corners.
/// @param half_width  h > 0, mm   @pre T0, T1 unit vectors   @throws ContractViolation if not.
/// Implements [Cai2025] Eq. (14), h = 2L/sin(θ/2) with L the distance of Q5 from the vertex by
/// cos(θ/2).
std::array<Vec3, 11> acr_corner_points(const Vec3& vertex, const Vec3& incoming,
                                       const Vec3& outgoing, double half_width);

/// The weights a_j above.
inline constexpr std::array<double, 11> kAcrCornerWeights = {2.5,        2.0, 1.5, 1.0, 0.6, 0.25,
                                                             1.0 / 15.0, 0.0, 0.0, 0.0, 0.0};

}  // namespace smoothpost
