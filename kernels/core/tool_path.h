#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kernels/core/canonical_motion.h"
#include "kernels/core/pose.h"

namespace smoothpost {

/// Tool tip point (mm) and unit tool axis (from tip to holder), both in the workpiece frame W.
struct CutterLocation {
  Vec3 tip = Vec3::Zero();
  Vec3 axis = Vec3::UnitZ();
};

/// How the cutter location moves between two path points, as the input's controller would do it.
enum class PathInterpolation : std::uint8_t {
  great_circle,   ///< tip on the line or arc, axis on the great circle (CSV, direction vectors)
  slerp,          ///< tip on the line, the whole rotation about one fixed axis (full_pose)
  rotary_linear,  ///< tip on the line or arc, the input machine's rotary joints linear (TCP mode)
  joint_linear    ///< every joint of the input machine linear (no TCP mode; arcs in joint space)
};

/// The pose at the end of one motion, where it came from, and how it is to be reached.
struct PathPoint {
  CutterLocation location;
  Eigen::Quaterniond rotation =
      Eigen::Quaterniond::Identity();   ///< of the tool frame, its Z along the axis; full_pose only
  MotionKind kind = MotionKind::rapid;  ///< of the segment that ends here; the first point has none
  PathInterpolation interpolation = PathInterpolation::great_circle;
  bool is_arc = false;
  bool beam = false;  ///< beam on during the segment that ends here
  bool replanned =
      false;  ///< the way here is a link of ours: the input's own way has no meaning elsewhere
  std::uint32_t line = 0;
  double duration = 0.0;      ///< s at the programmed feed, 0 for a rapid
  AxisWords words{};          ///< input axis words at this point (rotary_linear, joint_linear)
  std::int32_t arc = -1;      ///< index into ToolPath::arcs when is_arc
  double compensation = 0.0;  ///< mm, the tool length that the input's controller has active
  double tip_offset =
      0.0;  ///< mm from the controlled point of `words` to the tip, against the axis
  double tool_length = 0.0;  ///< mm, of the tool in use: from the holder's reference to the tip
  std::int32_t tool = 0;     ///< its number; 0: the machine's fixed tool
};

/// A process event, dwell or comment that happens when the path has reached `point`
/// (0: before the first segment).
struct PathEvent {
  enum class Kind : std::uint8_t { process, dwell, comment } kind = Kind::process;
  std::size_t point = 0;
  bool before_start = false;  ///< stands before the motion to point 0 in the input
  ProcessEvent event;         ///< kind process
  double seconds = 0.0;       ///< kind dwell
  std::string text;           ///< kind comment
  std::uint32_t line = 0;
};

/// Ordered path points in W with the events between them. Segment i goes from point i−1 to point i.
struct ToolPath {
  std::vector<PathPoint> points;
  std::vector<ArcGeometry> arcs;  ///< in the coordinates of `words`
  std::vector<PathEvent> events;  ///< sorted by point, program order within a point
  bool full_pose = false;         ///< the input gives whole rotations, not only tool axes
};

}  // namespace smoothpost
