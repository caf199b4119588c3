#pragma once

#include <vector>

#include "kernels/spline/bspline_basis.h"

namespace smoothpost {

/// The spline whose control points are the values of a polygon at the Greville places
/// ξ_j = (u_{j+1} + … + u_{j+k})/k (Schoenberg's operator).
///
/// Guarantees (tests): straight polygons are reproduced; every value lies in the hull of the k + 1
/// control points of its piece; with ever shorter pieces the curve comes as near to the polygon as
/// one likes.   Cost: linear.
/// @param u  ascending places of the polygon's corners, at least 2   @param values  a column each
/// @pre knots clamped, as many columns as places   @throws ContractViolation if not.
SplineCurve polygon_curve(const SplineKnots& knots, const std::vector<double>& u,
                          const Eigen::MatrixXd& values);

}  // namespace smoothpost
