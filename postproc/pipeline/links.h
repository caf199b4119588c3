#pragma once

#include <optional>
#include <string>
#include <vector>

#include "kernels/kinematics/inverse.h"
#include "kernels/kinematics/screw_chain.h"
#include "machines/definition/machine.h"
#include "machines/dialects/dialect.h"

// The motion between cuts. All of it is planned here for the output machine; nothing of the input's
// own rapids is left in it.
namespace smoothpost {

/// A box in W, mm, that holds the part.
struct PartBox {
  Vec3 lower = Vec3::Zero();
  Vec3 upper = Vec3::Zero();
};

/// A place on the path of the tool and what tool is in the holder.
struct LinkEnd {
  JointVector q;
  double tool_length = 0.0;  ///< mm
};

/// The moves of one link, in order. `approach` stands alone: it can be run from a retracted
/// machine, whose retract axis (of an arm: whose tip) is at its retract place or, behind `away`, as
/// high.
struct Link {
  std::vector<MachineMove> away;
  std::vector<MachineMove> approach;
  bool low = false;      ///< passes the part at its clearance height, not over the retract plane
  bool cramped = false;  ///< an end had no room for the whole clearance along the tool axis
  std::size_t retracted = 0;  ///< moves of `approach` up to where tools may be changed
};

/// A lower bound (mm) of the height of the tool over the part on straight joint motion along
/// `waypoints`: at every moment the whole box lies at least this far behind the plane through the
/// tip across the tool axis, so that nothing on the holder's side of that plane can touch it.
///
/// With chord values at both ends of a step and second-derivative bounds t, a of tip and axis, the
/// step loses t/8 + r·a/8 at most, r the largest distance from the tip to the box.
/// Guarantee (test): never above the height at dense samples.   Cost: O(waypoints · joints).
double proven_height(const ScrewChain& chain, const std::vector<LinkEnd>& waypoints,
                     const PartBox& part);

/// Plans links. For machines with two rotaries and three linear axes:
///  - away: along the tool axis by links.clearance (or as far as there is room: `cramped`);
///  - over the part: the retract axis alone to its retract position; rotaries; the other linears;
///  - approach: the retract axis down to a point on the tool axis above the end; along the tool
///  axis.
/// A link is low when neither the tool axis nor a rotary turns by more than links.rotation, the
/// tool is the same, the part is known and proven_height() of the whole traverse is at least half
/// the clearance: then it goes only as high as that needs, the retract axis last in `away`. With
/// links.rapid = independent a low link moves its axes one after the other, and moves along the
/// tool axis are feeds: a rapid would leave the line.
///
/// For six-axis arms: straight along the tool axis, straight up to the retract plane
/// (links.retract_mm, in M, when there is one), joints to the same place above the end, straight
/// down, straight along the tool axis. Straight moves are tool moves where the dialect has them,
/// otherwise short joint moves.
class LinkPlanner {
 public:
  /// `chain`: output machine, tool length 0, part placed. `retract`: position of the retract axis
  /// for this program, at or beyond links.retract.
  LinkPlanner(const MachineDefinition& machine, const ScrewChain& chain, double retract,
              std::optional<PartBox> part);

  Link between(const LinkEnd& from, const LinkEnd& to, bool must_retract) const;
  /// From anywhere to the first cut: no `away`.
  Link first(const LinkEnd& to) const;
  /// From the last cut home: no `approach`.
  Link last(const LinkEnd& from) const;

 private:
  MachineMove move(JointMask joints, const JointVector& to) const;
  void add(std::vector<MachineMove>& moves, JointMask joints, const JointVector& to) const;
  void add_straight(std::vector<MachineMove>& moves, const JointVector& from,
                    const JointVector& to) const;
  /// The joints with the tip `distance` further out along the tool axis; nothing outside limits.
  /// Arms: the joints with the tip moved by `step` (W), at the nearest solution inside the limits.
  std::optional<JointVector> moved_tip(const LinkEnd& at, const Vec3& step) const;
  JointVector arm_clear_of(const LinkEnd& at) const;
  JointVector arm_above(const LinkEnd& at) const;
  void add_arm_straight(std::vector<MachineMove>& moves, const LinkEnd& from,
                        const JointVector& to) const;
  Link arm_approach(const LinkEnd& to) const;
  std::vector<MachineMove> arm_away(const LinkEnd& from) const;
  std::optional<JointVector> along_tool(const JointVector& q, double distance) const;
  JointVector clear_of(const JointVector& q) const;
  bool is_cramped(const JointVector& q, const JointVector& clear) const;
  Link over_plane(const LinkEnd& to) const;
  std::optional<Link> low(const LinkEnd& from, const LinkEnd& to) const;
  double needed_distance(const LinkEnd& at, const Vec3& axis, const Vec3& other) const;
  JointMask retract_bit() const { return retract_axis_ < 0 ? 0U : 1U << retract_axis_; }

  const MachineDefinition& machine_;
  const ScrewChain& chain_;
  std::optional<PartBox> part_;
  int retract_axis_ = -1;
  double retract_ = 0.0;
  std::optional<Inverse> arm_;
  JointMask rotary_ = 0;
  JointMask linear_ = 0;
};

}  // namespace smoothpost
