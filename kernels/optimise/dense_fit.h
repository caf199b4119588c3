#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "kernels/smooth/pose_curve.h"

// Polylines so dense that they stand for a smooth curve, as a CAM system samples a surface.
namespace smoothpost {

/// A node of a polyline: between two of them the tip goes straight, the rotation at a constant rate
/// about an axis fixed in the tool, by less than half a turn.
struct DenseNode {
  Vec3 tip = Vec3::Zero();  ///< mm
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  double sigma = 0.0;  ///< mm, strictly ascending
  bool keep = false;   ///< a span of the curve ends here
  bool exact = false;  ///< the curve comes through this pose
};

struct DenseSettings {
  double tip_tolerance = 0.0;       ///< mm, at equal σ
  double rotation_tolerance = 0.0;  ///< rad, at equal σ
  bool whole_rotation = false;      ///< else it is for the tool's Z axis alone
};

/// How far the polyline cuts a corner's smooth curve at its node, as a share of the tolerances: the
/// larger of |T1 − T0|·l²/(8·l̄) for the tip and the same for the rotation's rate, l the longer
/// leg, l̄ the mean of both.   @pre σ ascends strictly
double dense_bulge(const DenseNode& before, const DenseNode& node, const DenseNode& after,
                   const DenseSettings& settings);

struct DenseFit {
  PoseCurve curve;
  std::vector<std::uint32_t> ends;  ///< node where each span ends; the first one starts at node 0
};

/// The smoothest curve (least ∫ of the squared third derivative, fit_near) that stays within the
/// tolerances of a polyline at equal σ and has the given pose and derivatives at its ends; at a
/// free end (nothing given) it comes through the node. Spans of four nodes, shorter ones near given
/// ends; of two or one everywhere where those are too stiff.
///
/// What a shop knows as a compressor or as smoothing of small blocks: blending such corners one by
/// one turns a gentle curve into a row of bends with straight pieces between, whose jerk is that of
/// the sampling and not that of the curve.
/// Guarantees (tests): tolerances at equal σ, on a dense grid; ends with three derivatives; exact
/// nodes; kept nodes end a span; points of a circle give its curvature to 5 %, rounded to 1 µm too.
/// Not in a paper.   Cost: seven programmes of one channel, linear in the nodes.
/// @return nothing when there is no such curve.   @pre at least two nodes
std::optional<DenseFit> fit_dense(std::span<const DenseNode> nodes,
                                  const std::optional<PoseDerivatives>& start,
                                  const std::optional<PoseDerivatives>& end,
                                  const DenseSettings& settings);

}  // namespace smoothpost
