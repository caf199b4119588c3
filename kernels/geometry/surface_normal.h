#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kernels/geometry/oriented_surface.h"

namespace smoothpost {

struct SurfaceNormalSettings {
  double crease = 0.52359877559829887;  ///< rad (30°): sides that bend more part the surface
  int rings = 1;           ///< of vertices around a triangle that are fitted; 2 and more for scans
  double noise = 0.0;      ///< mm, of vertices: how much a fit may miss them besides its own error
  double condition = 1e4;  ///< largest condition number of the fit's six columns
  double extent_share = 0.5;     ///< largest radius of the ring, of the least radius of curvature
  double residual_share = 1e-3;  ///< largest weighted rms residual, of the ring's radius
};

/// The surface that a mesh stands for, at a point.
struct SurfaceSample {
  enum class Source : std::uint8_t { quadric, interpolated, face };
  Vec3 point = Vec3::Zero();  ///< mm: on the quadric, else the point that was asked for
  Vec3 normal =
      Vec3::UnitZ();  ///< unit, on the side from which the triangles run counter-clockwise
  Source source = Source::face;
  double residual = 0.0;  ///< mm, weighted rms of the fit, also of one that was not taken
  /// Of a quadric, 1/mm; positive where the surface is hollow on the normal's side. Ascending.
  std::array<double, 2> curvature{};
};

/// Normals, points and curvatures of the smooth surface that a mesh was made from.
///
/// Definition. The vertices of the triangle at the query p and their neighbours, `rings` times
/// (with more than one ring also what else is as near), in the frame with origin p and third axis
/// n0, the interpolated normal; h is their largest distance from p across n0. The quadric
///   z = c0 + c1·x + c2·y + c3·x² + c4·x·y + c5·y²,   weights exp(−(x² + y²)/h²),
/// fitted to them by least squares gives the point p + c0·n0 and the normal (−c1, −c2, 1). p itself
/// is no data: it lies on a chord. A fit does not count with fewer than 6 vertices, a condition
/// number of its columns (x, y over h) above `condition`, h above extent_share of the least radius
/// of curvature, or a residual above residual_share·h + 3·noise. Then n0 and p stand.
///
/// n0: the vertices' normals at the barycentric share of p. A vertex' normal is the sum of its
/// faces' by angle, times (a/2a_min)² for a face whose area a (with that of its neighbours in the
/// same plane) is more than twice the smallest: where a plane passes into a tessellated round its
/// normal is the plane's. Sides that bend by more than `crease`, and open ones, part the surface:
/// beyond them nothing is averaged or fitted.
///
/// Guarantees (tests): cylinder of 0.8 mm edges 0.15 mrad and 0.1 µm; prisms of two rings 0.3 mrad;
///   0.8 mm edges with 5 µm of noise and 2 rings 4 mrad; an edge of a box has the faces' own
///   normals; a plane beside a round keeps its normal; curvatures of sphere, cylinder and saddle.
/// Units: mm, rad.   Cost: about 7 µs a point; 100 bytes a triangle. Queries are const and may run
///   from several threads.
/// Differences from the usual fit of jets: weighted, and the query is not among the data.
class SurfaceNormals {
 public:
  /// @pre as orient_surface(); settings.rings ≥ 1; the surface outlives it
  explicit SurfaceNormals(const OrientedSurface& surface, SurfaceNormalSettings settings = {});

  /// @param triangle  of surface.mesh, that holds `point` (mm, nearly on it)
  /// @pre triangle < triangles of the mesh, point finite   @throws ContractViolation if not.
  SurfaceSample at(std::uint32_t triangle, const Vec3& point) const;

  /// The median residual, in mm, of fits over so many rings at up to `count` triangles spread
  /// evenly over the mesh, those whose fit is well conditioned; 0 when there are none. Of a scan it
  /// is about the noise, whatever the rings; of an exact mesh it grows with the rings' radius.
  double typical_residual(int rings, std::size_t count = 400) const;

  const SurfaceNormalSettings& settings() const { return settings_; }

 private:
  struct Fit {
    Eigen::Matrix<double, 6, 1> c = Eigen::Matrix<double, 6, 1>::Zero();
    double radius = 0.0, residual = 0.0, condition = 0.0;
    std::array<double, 2> curvature{};
    bool good = false;  ///< but for the residual
  };
  void make_fans();
  void make_normals();
  std::vector<double> face_weights(std::uint32_t first, std::uint32_t last) const;
  Vec3 interpolated(std::uint32_t triangle, const Vec3& point) const;
  std::vector<std::uint32_t> ring(std::uint32_t triangle, const Vec3& point, int rings) const;
  Fit fit(std::uint32_t triangle, const Vec3& point, const Mat3& frame, int rings) const;

  const OrientedSurface& surface_;
  SurfaceNormalSettings settings_;
  std::vector<Vec3> face_normal_;
  std::vector<std::array<std::uint32_t, 3>> fan_;  ///< of each corner: smooth vertices
  std::vector<std::uint32_t> fan_vertex_;          ///< of the mesh
  std::vector<Vec3> fan_normal_;
  std::vector<std::uint32_t> fan_first_, fan_triangle_;  ///< triangles around each
};

}  // namespace smoothpost
