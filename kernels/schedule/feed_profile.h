#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "kernels/core/progress.h"
#include "kernels/schedule/feed_path.h"

namespace smoothpost {

/// Which limit a place of a path meets, or why a path has no time law.
struct FeedWitness {
  enum class Kind : std::uint8_t {
    none,
    velocity,
    acceleration,
    jerk,
    feed,
    turn_rate
  } kind = Kind::none;
  int joint = -1;  ///< −1: the tool tip
  double s = 0.0;
  std::size_t piece = 0;
  double value = 0.0, limit = 0.0;  ///< of what the status or the kind names
};

enum class FeedStatus : std::uint8_t {
  solved,
  constant_map,       ///< the optimiser failed: b = const, feasible but slower
  empty,              ///< nothing moves: no time
  no_limit,           ///< witness: a joint that moves has a limit ≤ 0, or a piece a feed ≤ 0
  not_finite,         ///< witness: a derivative is NaN or infinite
  not_smooth,         ///< witness: q' or q'' jumps at s by `value`: a stop is needed there
  not_regular,        ///< witness: nothing moves at s though s does
  cannot_keep_speed,  ///< the given speed at an end leaves a limit, or no stop was found from it
  cancelled           ///< by Progress
};

/// Time at one place of a profile.
struct FeedState {
  double s = 0.0, first = 0.0, second = 0.0, third = 0.0;  ///< s(t) and its derivatives by t
};

/// A stretch of a path on which one limit is met (load ≥ 99 % of it), neighbours joined.
struct FeedBinding {
  FeedWitness::Kind kind = FeedWitness::Kind::none;
  int joint = -1;               ///< −1: the tool tip
  double from = 0.0, to = 0.0;  ///< s
};

struct FeedLaw;  // internal to kernels/schedule

/// A time law s(t) of one stretch; see schedule_feed. Immutable, cheap to copy.
class FeedProfile {
 public:
  FeedProfile() = default;  ///< duration 0, at s = 0
  explicit FeedProfile(std::shared_ptr<const FeedLaw> law);

  double duration() const;
  /// t is clamped to [0, duration()].   Cost: O(log elements) and a few Newton steps.
  FeedState at(double t) const;
  /// The time at which the path is at s, clamped to the path.   at(time(s)).s == s to 1e-12 of the
  /// path's extent.
  double time(double s) const;

 private:
  std::shared_ptr<const FeedLaw> law_;
};

struct FeedSettings {
  double element_time = 0.007;  ///< s of motion per spline element of the last grid
  int least_elements = 40;
  bool tighten = true;         ///< the law is mended up to six times where it overshoots (from a
                               ///< given speed: solved again up to two times)
  double margin = 3e-5;        ///< relative, by which the last dilation goes beyond the check
  double smooth_share = 1e-4;  ///< relative jump of q', q'' at a break that counts as smooth
  std::size_t window_points = 600000;  ///< above this many collocation points: windows
  double look_ahead = 0.4;             ///< s, of a window
};

/// Largest share of a limit that the law uses, over a dense grid.
struct FeedLoad {
  double velocity = 0.0;  ///< of joints, feed and turn rate
  double acceleration = 0.0, jerk = 0.0;
  double largest() const;
};

struct FeedResult {
  FeedStatus status = FeedStatus::empty;
  FeedWitness witness;    ///< unless solved
  FeedProfile profile;    ///< of solved and constant_map; duration 0 else
  FeedLoad load;          ///< ≤ 1: of the law that is returned, on 44 places an element
  FeedLoad raw;           ///< before the last dilation
  double dilation = 1.0;  ///< by which all times were stretched last
  int elements = 0, iterations = 0, windows = 0;
  std::vector<FeedBinding> bindings;  ///< ascending, may overlap
};

/// The fastest time law along a path under limits, from end to end.
///
/// Definition: with s = φ(w) (RestMap) and b(w) = (dw/dt)² > 0 a cubic spline, least
///   T = ∫ b^{−1/2} dw   such that for every joint, and for the tip's arc length in place of q,
///   |q_w| √b ≤ V,   |q_ww b + q_w b'/2| ≤ A,   √b |q_www b + 3/2 q_ww b' + q_w b''/2| ≤ J,
/// and feed, rate and turn rate cap b. The rest at an end lies in φ ~ w³ and holds for any b.
/// One interior point (solve_feed, in overlapping parts: solve_in_parts) on a coarse grid, then on
/// one that is even in time and finer where the path's own jerk goes up and down; elements that
/// overshoot are drawn in, up to six times; at last all times are stretched by the least factor
/// that brings 44 places an element below every limit, times 1 + margin. Above `window_points`:
/// windows of 8 look-aheads. Each starts from a state of the one before, ends at rest (so there is
/// always a stop), and has limits that sink by 0.3 % to its end; it is kept up to a look-ahead
/// before its stop. Where no window is found from there the old plan runs on, at last to its stop.
/// From or to a given speed nothing is stretched; limits are lowered by 1e-4 instead, so the given
/// state has to be that far inside, and where the solver does not find a law that keeps the limits
/// the answer is cannot_keep_speed, although there may be one.
///
/// Guarantees (tests): never below seven phases on a line and within 1.002 of it at 400 elements;
/// no limit exceeded on an independent grid on 1000 random C3 paths, none refused; looser limits
/// are not slower beyond 0.1 %; golden times of the reference; windows lose at most 0.3 %; the same
/// bits twice.
/// Rest to rest there is always a law (b = const is one) unless the path is refused; with a
/// witness: see FeedStatus. What counts as a jump of q' or q'': survey() in feed_survey.h.
///
/// Units: mm, rad, s; s as in FeedPath. Calls path.jet on the caller's thread only; parts are
/// solved on all threads (TBB), with the same bits. Memory: 0.4 kB a collocation point (five an
/// element) of one window at most, 1 kB a point of the parts that are being solved, and 100 bytes
/// an element of the law. Cost: about 7 calls of path.jet an element and 4 a piece, more where jets
/// cannot be interpolated between them to 1e-6; 0.2 to 0.4 µs a collocation point and iteration, 20
/// to 180 iterations a solve, two to five solves.
/// @pre breaks ascend, feed (and rate, unless empty) fit the pieces, jets have as many joints as
/// the limits, at most 12; given speeds > 0; settings > 0   @throws ContractViolation Not from a
/// paper: the papers run at constant feed. Derived in the rows of docs/equations.md.
FeedResult schedule_feed(const FeedPath& path, const FeedLimits& limits, const FeedEnd& start,
                         const FeedEnd& end, const FeedSettings& settings,
                         const Progress& progress);

}  // namespace smoothpost
