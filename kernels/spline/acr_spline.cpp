#include "kernels/spline/acr_spline.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"

namespace smoothpost {

Vec3 acr_spline(std::span<const Vec3> points, const AcrShape& shape, double x, int order) {
  require(points.size() >= 4, "acr_spline: at least four points");
  const double last = static_cast<double>(points.size()) - 2.0;
  require(x >= 1.0 && x <= last, "acr_spline: parameter between the second and the last but one");
  const double first = std::min(std::floor(x), last - 1.0);
  const Eigen::Vector4d b = acr_basis(shape, x - first, order);
  Vec3 value = Vec3::Zero();
  const auto i = static_cast<std::size_t>(first);
  for (std::size_t k = 0; k < 4; ++k) value += b[static_cast<Eigen::Index>(k)] * points[i - 1 + k];
  return value;
}

std::array<Vec3, 11> acr_corner_points(const Vec3& vertex, const Vec3& incoming,
                                       const Vec3& outgoing, double half_width) {
  require(half_width > 0.0, "acr_corner_points: half width above 0");
  require(std::abs(incoming.norm() - 1.0) < 1e-9 && std::abs(outgoing.norm() - 1.0) < 1e-9,
          "acr_corner_points: unit vectors");
  std::array<Vec3, 11> q;
  for (std::size_t j = 0; j < q.size(); ++j)
    q[j] = vertex +
           half_width * (kAcrCornerWeights[10 - j] * outgoing - kAcrCornerWeights[j] * incoming);
  return q;
}

}  // namespace smoothpost
