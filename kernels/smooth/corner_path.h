#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "kernels/core/canonical_motion.h"
#include "kernels/core/pose.h"
#include "kernels/smooth/blend_function.h"

// Corners of a tool path, blended in tip position and tool rotation over one parameter.
namespace smoothpost {

/// A pose that the path comes through before smoothing: tip in mm, rotation of the tool frame.
struct PathNode {
  Vec3 tip = Vec3::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  bool exact = false;  ///< the smoothed path comes through this pose: its corner stays as it is
};

/// The way from one node to the next: the tip on the straight line, or on an arc or helix of
/// `corner_arcs`; the rotation at a constant rate about an axis fixed in the tool.
struct PathLeg {
  Vec3 turn =
      Vec3::Zero();       ///< rotation vector in the tool frame, rad; may be more than half a turn
  std::int32_t arc = -1;  ///< index of the arc, −1: a line
};

enum class BlendKind : std::uint8_t { acr, ramp };

struct CornerSettings {
  BlendKind kind = BlendKind::acr;
  AcrShape shape;            ///< of acr
  bool paper_shape = false;  ///< of acr: κ and λ of each corner by acr_fit() instead of `shape`
  std::optional<double> ramp_c1;    ///< of ramp; nothing: ramp_c1(turn) for each corner
  double tip_tolerance = 0.0;       ///< mm, at equal parameter
  double rotation_tolerance = 0.0;  ///< rad, at equal parameter
  /// Unit, in the tool frame. Given: rotation_tolerance is for this axis alone, rotation about it
  /// does not count.
  std::optional<Vec3> tool_axis;
  double stop_angle = 3.05432619099;  ///< rad (175°): corners that turn more are exact stops
  bool closed = false;  ///< the last node is the first again: its corner is smoothed too
};

/// What became of one node.
struct Corner {
  double half_width = 0.0;                         ///< h of the tip in σ, mm; 0: not blended
  double rotation_half_width = 0.0;                ///< h of the rotation in σ, mm; 0: not blended
  double turn = 0.0;                               ///< rad, of the tip's direction
  BlendFunction blend = BlendFunction::ramp(0.0);  ///< of the tip
  bool stop = false;                               ///< a reversal: the tip has to come to rest here
};

/// Value and the first three derivatives by σ: tip, and the quaternion (w, x, y, z), whose sign may
/// change from window to window (that of the window's node).
struct PoseDerivatives {
  std::array<Vec3, 4> tip;
  std::array<Eigen::Vector4d, 4> rotation;
};

/// A path of legs whose corners are blended, C³ in tip and rotation over one parameter.
///
/// The parameter σ is the length along the path BEFORE smoothing, one for tip and rotation, so that
/// they are synchronous by construction: there are no links to build and equal σ pairs every pose
/// with the one that it replaces. On a leg without motion of the tip (< 1e-9 mm) σ counts
/// ρ·|rotation| with ρ = tip_tolerance / rotation_tolerance.
///
/// At a node with legs A (before) and B (after), both extended as the line, circle or helix that
/// they are, and x = σ − σ_node:
///   tip       r(σ) = A(x) + h·g(x/h)·(B(x) − A(x))/x            for |x| ≤ reach·h, the legs
///   elsewhere rotation  R(σ) = R_node·exp[ x·w0 + h'·g(x/h')·(w1 − w0) ]  for |x| ≤ reach·h', w
///   the leg's turn
///                                                               over its length
/// g is C³ with g = 0 before and g(u) = u behind, so both join the legs C³. With lines the first is
/// x·T0 + h·g·(T1 − T0), the paper's curve when g is acr.
///
/// Half widths: h·g(0)·(|T1 − T0| + reach·h·K/2) = tip_tolerance with K the sum of the legs'
/// curvatures, h'·g(0)·|w1 − w0| = rotation_tolerance (tool_axis: of the part of w1 − w0 across
/// it, less where turns about the tool and across it together would move the axis further). Two
/// neighbours that want more of a leg than there is share it by √k, k = sin(θ/2)/cos²(θ/2)
/// (rotation: |w1 − w0|), so that their third derivatives, ~ k/h², are alike: each takes at least
/// its share, at most what the other leaves, never more than the leg together. Tip and rotation do
/// so apart from each other: their windows may overlap in any order, at one corner and between
/// neighbours, because they are two functions of σ that do not know of each other.
///
/// Guarantees (tests): distance of the tips and angle of the rotations at equal σ never above the
/// tolerances; C³ in σ everywhere but at stops and exact corners; the tip never stops where its leg
/// moves; straight corner, repeated points (merge_points.h), motion without rotation, rotation
/// without motion, axis-aligned legs, first and last leg, closed contour, more than half a turn.
/// Immutable after construction; any number of threads may read it.
///
/// Implements [Cai2025] §3.2–3.4 with the differences below, and the ramp (docs/equations.md).
/// Differences from the paper:
///  - Rotation by the rotation vector at the node, not by Euler angles: no gimbal, the tolerance is
///    on the whole angle (Eq. (28) bounds the axis to first order only).
///  - No links between corners (Eq. (38)–(40)): they are not synchronous as printed.
///  - No reserved third of each leg (Eq. (16)). Shared by k itself (equal curvatures), a corner
///  that
///    hardly turns between sharp ones would get a window of nanometres and all the jerk.
class CornerPath {
 public:
  /// Cost: O(nodes), no search; 1 million corners a second on one core. Memory: nodes and legs as
  /// given plus less than 100 bytes a corner.
  /// @pre legs.size() + 1 == nodes.size() ≥ 2; every leg moves (1e-9 mm or 1e-12 rad); turns and
  /// arcs lead from node to node (1e-6); tolerances above 0; closed: last pose equals first pose.
  /// @throws ContractViolation if not.
  CornerPath(std::vector<PathNode> nodes, std::vector<PathLeg> legs, std::vector<ArcGeometry> arcs,
             const CornerSettings& settings);

  std::size_t legs() const { return legs_.size(); }
  const std::vector<PathNode>& nodes() const { return nodes_; }
  /// One for each node; the last of a closed path repeats the first.
  const std::vector<Corner>& corners() const { return corners_; }
  /// Extent of leg `leg` in σ, mm.   @pre leg < legs()
  double length(std::size_t leg) const { return lengths_[leg]; }
  bool tip_moves(std::size_t leg) const { return tip_moves_[leg]; }
  const Vec3& turn(std::size_t leg) const { return legs_[leg].turn; }

  /// The smoothed pose at x ∈ [0, length(leg)] behind the start of leg `leg`.
  Pose at(std::size_t leg, double x) const;
  /// The same before smoothing.
  Pose original(std::size_t leg, double x) const;
  /// Value and derivatives by σ. One-sided at nodes and window ends: x belongs to `leg`.
  /// Guarantee (test): equals central differences.
  PoseDerivatives derivatives(std::size_t leg, double x) const;

  /// The windows' ends and the blends' knots inside leg `leg`, ascending, with 0 and length(leg):
  /// between two of them tip and rotation are analytic.
  std::vector<double> breaks(std::size_t leg) const;

  /// A bound of |d²tip/dσ²| (1/mm) and of |d²axis/dσ²| for any axis fixed in the tool (1/mm²),
  /// between two neighbouring breaks.
  struct Bend {
    double tip = 0.0;
    double axis = 0.0;
  };
  Bend bend_bound(std::size_t leg, double from, double to) const;

  BlendFunction rotation_blend() const { return rotation_blend_; }

 private:
  /// Displacement from a node along a leg, over x, with three derivatives.
  using Mean = std::array<Vec3, 4>;
  Mean mean(std::size_t leg, bool from_end, double x) const;
  Vec3 direction(std::size_t leg, bool from_end) const { return mean(leg, from_end, 0.0)[0]; }
  double curvature(std::size_t leg) const;
  Vec3 rate(std::size_t leg) const { return legs_[leg].turn / lengths_[leg]; }
  std::size_t leg_before(std::size_t node) const {
    return (node > 0 ? node : nodes_.size() - 1) - 1;
  }
  std::size_t leg_after(std::size_t node) const { return node < legs_.size() ? node : 0; }
  bool can_blend(std::size_t node) const;
  void measure_legs();
  void check_legs() const;
  void plan_tip();
  void plan_rotation();
  double axis_deviation(std::size_t node, double half_width) const;
  double rotation_extent(std::size_t node) const;
  void share(std::vector<double>& extents, const std::vector<double>& weights) const;

  /// Where x of a leg lies: the node whose window it is in or whose leg it is on, x from there.
  struct Place {
    std::size_t node = 0;
    double x = 0.0;
    bool blended = false;
  };
  Place place(std::size_t leg, double x, double start_extent, double end_extent) const;
  Place tip_place(std::size_t leg, double x) const;
  Place rotation_place(std::size_t leg, double x) const;
  Vec3 leg_tip(std::size_t leg, double x) const;
  std::array<Vec3, 4> tip_derivatives(std::size_t leg, double x) const;
  std::array<Vec3, 4> chart(const Place& place, std::size_t leg) const;

  CornerSettings settings_;
  std::vector<PathNode> nodes_;
  std::vector<PathLeg> legs_;
  std::vector<ArcGeometry> arcs_;
  std::vector<double> lengths_;
  std::vector<bool> tip_moves_;
  std::vector<Corner> corners_;
  BlendFunction rotation_blend_;
};

}  // namespace smoothpost
