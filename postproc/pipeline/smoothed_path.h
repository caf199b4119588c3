#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "kernels/kinematics/joint_jet.h"
#include "kernels/smooth/corner_path.h"
#include "kernels/smooth/pose_curve.h"
#include "postproc/pipeline/cuts.h"
#include "postproc/pipeline/reference_path.h"

// The path that a machine is to follow, and where on the input each of its places belongs.
namespace smoothpost {

struct SmoothingSettings {
  BlendKind kind = BlendKind::acr;
  AcrShape shape;
  bool paper_shape = false;
  std::optional<double> ramp_c1;
  double merge_tip = 0.0;       ///< mm, for points that are merged and for legs in place of curves
  double merge_axis = 0.0;      ///< rad
  double corner_tip = 0.0;      ///< mm, for corners
  double corner_axis = 0.0;     ///< rad
  bool whole_rotation = false;  ///< corner_axis is for the whole rotation (task = "pose")
  bool fit_dense = false;       ///< dense points become curves (dense_runs.h), not corners
};

/// The same for one CornerPath.
CornerSettings corner_settings(const SmoothingSettings& settings);

/// What smoothing did at one corner, measured against the input at equal path parameter.
struct SmoothedCorner {
  std::uint32_t input_line = 0;
  double turn = 0.0;                 ///< rad
  std::string method;                ///< acr | ramp | stop
  AcrShape shape;                    ///< acr
  double c1 = 0.0;                   ///< ramp
  double half_width = 0.0;           ///< mm
  double rotation_half_width = 0.0;  ///< mm
  double tip_deviation = 0.0;        ///< mm
  double rotation_deviation = 0.0;   ///< rad; 0 unless the path has whole rotations
  double axis_deviation = 0.0;       ///< rad
  double speed = 0.0;                ///< mm/s of the tip at the corner, at the programmed feed
  bool stop = false;
};

/// The input's path with its cuts smoothed: points so dense that they stand for a curve become that
/// curve (dense_runs.h), others are merged where they lie in line, corners blended (CornerPath),
/// arcs kept as arcs. Without settings it is the input's path itself.
///
/// It consists of legs, counted from 1; leg 0 stands for the first point. A leg is one segment of
/// the input, a part of one (of a long arc, of a curve that is neither line nor arc), or several
/// whose points were merged or lie near one span of a curve. The share s ∈ [0, 1] of a leg is the
/// parameter σ of CornerPath or PoseCurve: at equal s a smoothed pose stands for the input's pose
/// at place(leg, s).
///
/// Never blended and never merged: points with a process event or a dwell, where the tool or its
/// length changes, the ends of cuts; never merged: where the feed changes. Segments outside of cuts
/// pass unchanged. The rotation that is blended is the input's where it has one, else the tool
/// axis' frame carried along without turning about the axis. Immutable; the reference outlives it.
/// Cost: linear in the segments (48 checks a point when they merge).
class SmoothedPath {
 public:
  /// The reference itself: leg k is segment k.
  explicit SmoothedPath(const ReferencePath& reference);
  SmoothedPath(const ReferencePath& reference, const std::vector<Cut>& cuts,
               const SmoothingSettings& settings);

  std::size_t legs() const { return legs_.size() - 1; }
  /// The point of the input where the leg ends or that ends the segment which it is part of.
  const PathPoint& point(std::size_t leg) const;
  const ReferencePath& reference() const { return reference_; }
  bool full_pose() const { return reference_.path().full_pose; }

  CutterLocation at(std::size_t leg, double s) const;
  /// @pre full_pose()
  Mat3 rotation_at(std::size_t leg, double s) const;
  /// Tip and rotation with their derivatives by s, of the formula that holds at s; the rotation's Z
  /// is the tool axis, and only that means something unless full_pose(). Nothing on a leg that is
  /// the input's own.
  std::optional<PoseJet> jet(std::size_t leg, double s) const;
  PathPlace place(std::size_t leg, double s) const;
  /// Extent of a leg in the parameter σ, mm; 0 for leg 0.
  double length(std::size_t leg) const;
  /// Programmed feed, mm/s, 0: none; on a span of a curve the least of the segments that it stands
  /// for, which differ by 5 % at most from one to the next.
  double feed(std::size_t leg) const;
  /// Ascending shares with 0 and 1: between two of them the leg has one formula.
  std::vector<double> breaks(std::size_t leg) const;
  /// Bounds of |d²/ds²| of tip and axis between two neighbouring breaks.
  SecondDerivativeBound second_derivative_bound(std::size_t leg, double from, double to) const;

  const std::vector<CornerPath>& runs() const { return runs_; }
  std::uint32_t merged_points() const { return merged_points_; }
  /// Points of the input that curves took the place of.
  std::uint32_t fitted_points() const { return fitted_points_; }
  /// Points of the input that were blended or that stop the tool, in path order. Measured on a
  /// dense grid of their windows, against ReferencePath.   Cost: about 10 µs a corner.
  std::vector<SmoothedCorner> corners() const;

 private:
  friend class PathSmoother;
  struct Leg {
    PathPlace from, to;
    std::int32_t run = -1;    ///< index of the CornerPath, −1: none
    std::uint32_t index = 0;  ///< leg of the run, span of the curve
    std::int32_t curve = -1;  ///< index of the PoseCurve; −1 and no run: the input's own
  };
  SmoothedCorner measure(const CornerPath& run, std::size_t first_leg, std::size_t node) const;

  const ReferencePath& reference_;
  std::vector<Leg> legs_;  ///< [0] is the first point
  std::vector<CornerPath> runs_;
  std::vector<std::uint32_t> first_leg_;  ///< of each run
  std::vector<PoseCurve> curves_;
  std::uint32_t merged_points_ = 0;
  std::uint32_t fitted_points_ = 0;
};

}  // namespace smoothpost
