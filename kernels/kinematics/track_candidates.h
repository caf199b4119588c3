#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "kernels/kinematics/branch_tracking.h"

// What track_branches() chooses from: for each point the rotary values without turns.
namespace smoothpost {

/// One way to have the rotaries at a point.
struct TrackCandidate {
  double first = 0.0;   ///< rad in (−π, π]
  double second = 0.0;  ///< rad in (−π, π]
  std::uint8_t branch = 0;
  std::uint8_t track = 0;  ///< in a pole run: candidates of one track continue each other
  bool valid = false;      ///< reachable, free linears within their limits
  bool ahead = false;      ///< in a pole run: the first rotary already has the value behind the run
  bool through = false;    ///< in a pole run: the first rotary turns along the run
};

/// The candidates of one point.
struct TrackLayer {
  std::size_t begin = 0;
  std::uint8_t count = 0;
  bool pole = false;  ///< the point is in a pole run
};

/// A joint value that breaks its limit.
struct LimitBreach {
  int joint = 0;
  double value = 0.0;
};

struct TrackCandidates {
  std::vector<TrackCandidate> candidates;
  std::vector<TrackLayer> layers;
  BranchTracking failure;  ///< status other than ok: the first point without any candidate
};

/// Candidates of every point: both branches, or the tracks through its pole run (see
/// track_branches()). Cost: one closed form a point; at most 12 linear solves a point in a pole
/// run.
TrackCandidates track_candidates(const RotaryPair& pair, const std::vector<TrackingPoint>& points,
                                 const BranchTrackingSettings& settings);

/// Whole turns n with lower ≤ angle + 2πn ≤ upper (1e-9 of slack); empty when last < first.
struct TurnRange {
  int first = 0;
  int last = -1;
};
TurnRange turns_within(double angle, double lower, double upper);

/// The first free linear joint whose value in `q` breaks its limit, if any.
std::optional<LimitBreach> linear_breach(const ScrewChain& chain, const JointVector& q);

/// "joint 3 would be at 812.300 mm, its upper limit is 800.000 mm" (degrees for a rotary).
std::string describe_breach(const ScrewChain& chain, const LimitBreach& breach);

/// An angle (rad) in degrees, or a length, with three decimals, for a person.
std::string describe_number(double value);

}  // namespace smoothpost
