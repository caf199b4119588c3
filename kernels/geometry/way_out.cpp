#include "kernels/geometry/way_out.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

/// A ray along the third axis after a shear: x and y of a point that it passes through are 0.
class Ray {
 public:
  Ray(const Vec3& from, const Vec3& direction) : from_(from), direction_(direction) {
    direction.cwiseAbs().maxCoeff(&kz_);
    kx_ = (kz_ + 1) % 3;
    ky_ = (kz_ + 2) % 3;
    shear_x_ = direction[kx_] / direction[kz_];
    shear_y_ = direction[ky_] / direction[kz_];
  }

  bool meets(const MeshBox& box) const {
    double first = 0.0, last = INFINITY;
    for (int k = 0; k < 3; ++k) {
      const double low = box.centre[k] - box.half[k] - kMargin - from_[k];
      const double high = box.centre[k] + box.half[k] + kMargin - from_[k];
      if (std::abs(direction_[k]) < 1e-14) {
        if (low > 1e-9 || high < -1e-9) return false;
        continue;
      }
      const double a = low / direction_[k], b = high / direction_[k];
      first = std::max(first, std::min(a, b));
      last = std::min(last, std::max(a, b));
    }
    return first <= last;
  }

  /// Where and to which side it crosses a triangle: (mm, +1: outwards).
  std::optional<std::pair<double, int>> crossing(const std::array<Vec3, 3>& corners) const {
    std::array<double, 3> x, y, z;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 d = corners[k] - from_;
      x[k] = d[kx_] - shear_x_ * d[kz_];
      y[k] = d[ky_] - shear_y_ * d[kz_];
      z[k] = d[kz_] / direction_[kz_];
    }
    std::array<double, 3> w;
    int positive = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t a = (k + 1) % 3, b = (k + 2) % 3;
      w[k] = x[a] * y[b] - y[a] * x[b];
      // A ray through a side or a corner is taken as one a little beside it, in x and less in y: so
      // all triangles there agree.
      positive += w[k] > 0.0 || (w[k] == 0.0 && (y[a] > y[b] || (y[a] == y[b] && x[b] > x[a])));
    }
    if (positive != 0 && positive != 3) return {};
    const double sum = w[0] + w[1] + w[2];
    if (!(std::abs(sum) > 0.0)) return {};
    const double at = (w[0] * z[0] + w[1] * z[1] + w[2] * z[2]) / sum;
    if (at < 0.0) return {};
    // Counter-clockwise about the third axis: the outer side is the one that axis points to.
    const bool turned = direction_[kz_] < 0.0;
    return std::pair{at, (positive == 3) == turned ? -1 : 1};
  }

 private:
  static constexpr double kMargin = 1e-9;

  Vec3 from_, direction_;
  int kx_ = 0, ky_ = 1, kz_ = 2;
  double shear_x_ = 0.0, shear_y_ = 0.0;
};

}  // namespace

std::optional<double> way_out(const TriangleTree& tree, const Vec3& from, const Vec3& direction) {
  require(from.allFinite() && std::abs(direction.norm() - 1.0) < 1e-9,
          "a finite point and a unit direction");
  const Ray ray(from, direction);
  std::vector<std::pair<double, int>> crossings;
  std::vector<TreePart> open{tree.whole()};
  while (!open.empty()) {
    const TreePart part = open.back();
    open.pop_back();
    if (!ray.meets(tree.box(part))) continue;
    if (part.size() == 1) {
      if (const auto found = ray.crossing(tree.corners(part))) crossings.push_back(*found);
      continue;
    }
    const auto halves = tree.halves(part);
    open.push_back(halves.first);
    open.push_back(halves.second);
  }
  int winding = 0;
  for (const auto& c : crossings) winding += c.second;
  if (winding <= 0) return {};
  std::sort(crossings.begin(), crossings.end());
  for (const auto& [at, side] : crossings) {
    winding -= side;
    if (winding <= 0) return at;
  }
  return {};
}

}  // namespace smoothpost
