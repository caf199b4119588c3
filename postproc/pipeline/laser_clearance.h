#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "kernels/collision/feasible_domain.h"
#include "kernels/collision/via_points.h"
#include "kernels/optimise/rotary_jerk.h"
#include "machines/definition/machine.h"
#include "postproc/pipeline/joint_plan.h"

// What a stretch of a laser's cut keeps its distance by: the places where it does not, the wrist
// coordinates that would, and the conditions that lead there.
namespace smoothpost {

/// A cutter location of a stretch, at which conditions for its splines are put.
struct LaserStation {
  double u = 0.0;                      ///< of the splines
  Vec3 tip = Vec3::Zero();             ///< mm, W
  OrientationWindow window;            ///< of the tolerances alone
  std::array<double, 2> programmed{};  ///< rotaries of the programmed axis, rad, unwound
  double standoff = 0.0;               ///< of the programmed path, mm
  std::uint32_t line = 0;              ///< of the input
  bool fixed = false;                  ///< its joints are those of the programmed path
};

/// What the programmes of a stretch keep beside tolerances and limits.
struct ClearanceConditions {
  std::vector<OrientationWindow> windows;  ///< by station; empty: the stations' own
  std::vector<StandoffBound> bounds;
  std::vector<RotaryVia> via;  ///< ascending u, for an orientation by via points
  std::optional<SplineCurve> start = std::nullopt;  ///< rotaries that the programmes start from
};

/// A stretch and what it must not meet. What is referred to outlives it.
struct ClearanceTask {
  const Scene* scene = nullptr;  ///< nullptr: nothing is met
  const MachineDefinition& machine;
  const RotaryPair& pair;
  std::vector<LaserStation> stations = {};  ///< ascending u
  JointVector held = {};                    ///< the standoff among them: the programmed path's
  double standoff_low = 0.0, standoff_high = 0.0;  ///< mm; equal: it is held
  double tool_length = 0.0;
};

/// Lead, tilt and standoff of a grid.
struct GridSize {
  int leads = 13, tilts = 9, standoffs = 7;
};

/// The task's domain at its stations: a direction without freedom has one row.
/// The task outlives the result.
DomainProblem domain_problem(const ClearanceTask& task, const GridSize& size, double margin);
DomainPlace domain_place(const ClearanceTask& task, std::size_t station);

/// Rotaries and standoff of a path.
struct WristState {
  std::array<double, 2> rotary{};
  double standoff = 0.0;
};
WristState wrist_of(const ClearanceTask& task, const JointVector& q);
WristWeights wrist_weights(const ClearanceTask& task, std::size_t station);
Vec3 tool_axis_of(const ClearanceTask& task, const WristState& wrist);
/// The joints there, and whether they keep every clearance and `margin` mm more.
std::optional<JointVector> joints_of(const ClearanceTask& task, std::size_t station,
                                     const WristState& wrist);
bool is_free(const ClearanceTask& task, const JointVector& q, double margin);

/// A place of a path that is not proven to keep its distance.
struct PathHit {
  double u = 0.0;
  std::size_t pair = 0;
  JointVector q;
};

struct PathCheck {
  std::vector<PathHit> hits;  ///< one a motion, in order
  double least = 0.0;         ///< mm beyond the clearance, at the samples; as far as below 100 mm
  std::size_t least_pair = Clearance::kNoPair;
  double least_u = 0.0;
  std::size_t queries = 0;
};

/// Every motion from sample to sample, straight in the joints, with some µm to spare for the digits
/// that are printed.   @pre a scene
PathCheck check_path(const ClearanceTask& task, const std::vector<JointSample>& samples,
                     const std::vector<double>& u);

/// Wrist coordinates that keep every clearance and `margin` mm at a station, near to those of a
/// path: by another standoff alone where that is nearer than half of what turning takes.
struct FreeWrist {
  Vec3 axis = Vec3::UnitZ();
  WristState wrist;
  double margin = 0.0;  ///< mm
};
/// @param domain  of the station, with `margin`
std::optional<FreeWrist> nearest_free(const ClearanceTask& task, std::size_t station,
                                      const WristState& now, const FeasibleDomain& domain,
                                      double margin);

/// A condition at the edge of what is free, on the way from `now` to `target`.
struct ClearanceCut {
  std::optional<AxisCut> axis;
  Vec3 contact = Vec3::Zero();  ///< unit, W: from what is met to the head; 0: unknown
  double arm = 0.0;             ///< mm: what the condition loses on a tip that moves by −contact
  std::optional<double> lower, upper;  ///< of the standoff
};

/// The half-space of the tool axis (and the bound of the standoff) whose border goes through the
/// place where the way from `now` to `target` becomes free.
///
/// With the contact's normal n (from what is met to the head), the head's point x there, the tip C
/// and the axis O: x = C + dO + ρ, ρ at right angles to O, moves by d δO − (ρ·δO)O when the axis
/// turns by δO. So the distance grows by a·δO with a = d n − (n·O)ρ, and the condition is a·O' ≥
/// a·O for the part of a at right angles to O. Where the contact says nothing of turning it is the
/// direction to the target.
ClearanceCut cut_towards(const ClearanceTask& task, std::size_t station, const WristState& now,
                         const FreeWrist& target, double margin);

/// Why a station has no admissible cell, and what would give one: "casing and part come too near
/// ... --lead 24 deg would free it".
std::string why_blocked(const ClearanceTask& task, std::size_t station);

/// The domain of a station as a picture: a row of text for every lead, a letter for every tilt, a
/// block for every standoff. '.' free on some branch, '#' collision, 'g' gap, 'r' range of a joint,
/// 'x' out of reach.
struct DomainMap {
  std::uint32_t line = 0;                       ///< of the input
  std::vector<double> leads, tilts, standoffs;  ///< rad, rad, mm
  std::vector<std::vector<std::string>> cells;  ///< [standoff][lead], as long as tilts
  std::array<double, 2> programmed{};           ///< lead and tilt, rad
  std::optional<std::array<double, 2>> chosen;  ///< of the path that was found clear
};
DomainMap domain_map(const ClearanceTask& task, std::size_t station);
/// Lead and tilt of an axis in a station's frame, rad.
std::array<double, 2> lead_tilt_of(const LaserStation& station, const Vec3& axis);

}  // namespace smoothpost
