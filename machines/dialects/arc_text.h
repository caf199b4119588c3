#pragma once

#include <string>
#include <vector>

#include "machines/dialects/dialect.h"

// Arcs in programs of joint words: planes by the letters of the axes, centres from the start. What
// is the same on every control.
namespace smoothpost {

/// G17, G18 or G19 of a machine that has both of its axes: a positive turn (G3) goes from the first
/// joint to the second.
struct ArcPlane {
  int code = 17;
  int first = 0, second = 0;  ///< joints X Y, Z X or Y Z
  int third = -1;             ///< the one that is left of X Y Z; −1: the machine has none
  char first_centre = 'I', second_centre = 'J';
};

/// The planes that two linear axes of X Y Z span, in the order of their codes.
std::vector<ArcPlane> arc_planes(const MachineDefinition& machine);

/// The value that a block has of joint j (mm or rad) after rounding to the dialect's digits.
double printed_joint(const MachineDefinition& machine, int j, double value);

/// The words of an arc in the program's unit: centre minus the start as it is printed. With the
/// digits of lengths the centre as read is within half a digit of `arc`.
struct ArcWords {
  ArcPlane plane;
  bool clockwise = false;  ///< G2
  double first = 0.0, second = 0.0;
};
/// @pre arc.turn is not 0 and first and second are those of one of arc_planes().
ArcWords arc_words(const MachineDefinition& machine, const JointArc& arc, const JointVector& from);

/// What a block says: plane, sense, centre from the start in mm.
struct ArcBlock {
  int code = 17;
  bool clockwise = false;
  double first = 0.0, second = 0.0;
};

/// Sets `move.arc` for a block that goes from `from` to `move.to`, or says why it does not:
///  - the plane has an axis that the machine has not or that turns, or an axis has no position yet;
///  - a joint moves that is none of X Y Z (how controls share an arc's feed with it differs);
///  - the radius is below kLeastRadius or above kMostRadius, or the radii at start and end differ
///  by
///    more than kRadiusAgreement (what is between them is known to twice that: arc_spread());
///  - the sweep is below kLeastSweep, which a control may take for a full circle, or above
///    kMostSweep.
/// Empty: it is set.
std::string set_arc(const MachineDefinition& machine, const ArcBlock& block,
                    const JointVector& from, JointMask known, ReadBackMove& move);

inline constexpr double kLeastRadius = 0.01, kMostRadius = 1e5;  // mm
inline constexpr double kRadiusAgreement = 0.005;                // mm
inline constexpr double kLeastSweep = 1e-3;                      // rad

}  // namespace smoothpost
