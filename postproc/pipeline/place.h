#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "kernels/core/progress.h"
#include "kernels/core/result.h"
#include "kernels/optimise/placement.h"
#include "machines/definition/machine.h"
#include "postproc/pipeline/cuts.h"
#include "postproc/pipeline/interpret.h"

// Where to put the part: the search of kernels/optimise on a program and a machine.
namespace smoothpost {

struct PlaceInput {
  const InterpretedInput& input;
  const MachineDefinition& machine;
  Pose start = Pose::Identity();  ///< X_FW, F the machine's workpiece frame
  LinkChoice links;               ///< which motions count: those of the cuts
  /// Of the program's zero, mm in F; nothing: of the middle of the path, all that the machine
  /// reaches
  std::optional<ReachBox> box;
  double turn = 3.14159265358979323846;  ///< rad, largest turn about the vertical either way
};

/// A margin with its input line: 1 in the middle, 0 at the border, negative beyond.
struct PlaceMargin {
  std::string name;  ///< an axis, "singularity" (arms), "reach"
  double value = 1.0;
  std::uint32_t line = 0;
};

struct PlaceMargins {
  std::vector<PlaceMargin> all;  ///< in the order of the machine file, then singularity, reach
  /// The least one; the first of several.   @pre !all.empty()
  const PlaceMargin& tightest() const;
};

/// A place in numbers that can be typed in: 0.1 mm, and 0.1 deg (0.0001 deg of a tilted part).
struct FoundPlace {
  Vec3 position = Vec3::Zero();       ///< mm, of the program's zero in F
  Vec3 turn = Vec3::Zero();           ///< rad, about X, Y, Z in the order Rz Ry Rx
  Pose placement = Pose::Identity();  ///< X_FW of exactly these numbers
  PlaceMargins margins;
};

struct Places {
  PlaceMargins before;           ///< at the start
  std::vector<FoundPlace> best;  ///< by least margin, the best first
  int evaluations = 0;
};

/// Places for the part with the most room on the path (PlacementMeasure, place_path), best first.
///
/// The search looks at 150 locations of the path and those farthest out; margins of the result are
/// those of 4000, rounded places included. Where links go over a plane (links.retract_mm of an arm)
/// and there is no box, the path stays below the plane by links.clearance_mm. Margins know neither
/// links nor continuity beyond a stretch of a cut: whether a program can be made at a place,
/// convert() says. The same input gives the same places.
/// Failures: KN110 (no closed form), KN140 (no cut to place), US120 (task = "pose"), US190
/// (cancelled). Cost: 3500 evaluations on about 170 locations; a second or two for an arm.
Result<Places> find_places(const PlaceInput& in, const Progress& progress);

/// Angles a, b, c (rad) with rotation_from_rpy(a, b, c) = R; a = 0 where b = ±π/2.
Vec3 rpy_of(const Mat3& rotation);

}  // namespace smoothpost
