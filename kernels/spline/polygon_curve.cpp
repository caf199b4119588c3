#include "kernels/spline/polygon_curve.h"

#include <algorithm>

#include "kernels/core/contract.h"

namespace smoothpost {

SplineCurve polygon_curve(const SplineKnots& knots, const std::vector<double>& u,
                          const Eigen::MatrixXd& values) {
  require(u.size() >= 2 && static_cast<Eigen::Index>(u.size()) == values.cols(),
          "a polygon of at least two corners");
  SplineCurve out{knots, Eigen::MatrixXd(values.rows(), knots.controls())};
  std::size_t k = 1;
  for (int j = 0; j < knots.controls(); ++j) {
    double place = 0.0;
    for (int r = 1; r <= knots.degree; ++r)
      place += knots.values[static_cast<std::size_t>(j + r)] / knots.degree;
    while (k + 1 < u.size() && u[k] < place) ++k;
    const double t = std::clamp((place - u[k - 1]) / (u[k] - u[k - 1]), 0.0, 1.0);
    const auto to = static_cast<Eigen::Index>(k);
    out.controls.col(j) = (1.0 - t) * values.col(to - 1) + t * values.col(to);
  }
  return out;
}

}  // namespace smoothpost
