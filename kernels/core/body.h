#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "kernels/core/mesh.h"
#include "kernels/core/pose.h"

namespace smoothpost {

enum class BodyShape { frustum, cylinder, capsule, box, hull, mesh };

/// A collision shape fixed to a link, mm in M with every joint at 0.
///
/// frustum, cylinder: between the flat ends `from` and `to` of its centre line, radii there.
/// capsule: all points within `radius_from` (= `radius_to`) of the line from `from` to `to`.
/// box: `from` and `to` are opposite corners, edges along the axes of M.
/// hull: convex hull of `points`.   mesh: the triangles of `mesh`.
struct Body {
  std::string link;  ///< name of an axis, "base", or "workpiece": fixed to what carries the part
  std::string name;  ///< unique; never "part", which is the part itself
  BodyShape shape = BodyShape::cylinder;
  Vec3 from = Vec3::Zero();
  Vec3 to = Vec3::Zero();
  double radius_from = 0.0;
  double radius_to = 0.0;
  std::vector<Vec3> points;                  ///< of a hull: at least 4, not in a plane
  std::string mesh_file;                     ///< of a mesh: path of its STL file
  double mesh_scale = 1.0;                   ///< mm per unit of the file
  Pose mesh_frame = Pose::Identity();        ///< of the file's coordinates (scaled to mm) in M
  std::shared_ptr<const TriangleMesh> mesh;  ///< in M; null until somebody has loaded mesh_file
  double clearance = 0.0;                    ///< least distance to any other body and to the part
};

/// Two bodies that have to stay at least `clearance` mm apart: places in a list of bodies, `first`
/// before `second`; `second` may be kPart.
struct BodyPair {
  static constexpr std::size_t kPart = std::numeric_limits<std::size_t>::max();
  std::size_t first = 0;
  std::size_t second = kPart;
  double clearance = 0.0;
};

}  // namespace smoothpost
