#pragma once

#include <string>
#include <vector>

#include "machines/definition/machine.h"

namespace smoothpost {

/// Index of the joint whose motion carries `link` ("base", "workpiece" or the name of an axis), or
/// −1 for the base. The workpiece is carried by the last axis of the workpiece chain.
/// @pre `link` is one of those   @throws ContractViolation if not.
int joint_carrying(const MachineDefinition& machine, const std::string& link);

/// The pairs of bodies, and of body and part, whose distance has to be checked, with the distance
/// that is required of them (mm), sorted by their places in machine.bodies.
///
/// Definition. Links form a tree: base, then the axes of either chain one after the other; bodies
/// of link "workpiece", and the part, are fixed to the last axis of the workpiece chain. A pair is
///  - left out when nothing moves one against the other (same carrying joint);
///  - checked with its own clearance when [[collision.pair]] names it;
///  - left out when collision.allowed names it;
///  - left out when one joint connects their links: shapes of such links meet at that joint. What
///  is
///    clamped on the table (link "workpiece") and the part belong to no joint: they are checked
///    against all links but their own;
///  - else checked with the larger clearance of the two bodies (the part has none of its own).
///
/// Guarantees: every pair at most once; first < second.   Cost: O(bodies²).
std::vector<BodyPair> checked_pairs(const MachineDefinition& machine);

}  // namespace smoothpost
