#pragma once

#include <cstddef>
#include <vector>

#include "kernels/schedule/feed_solver.h"

// Internal to kernels/schedule.
namespace smoothpost {

struct FeedPartsSettings {
  FeedSolverSettings solver;
  bool join = true;  ///< solve parts that do not meet as one; false: change over where they are
                     ///< nearest
};

/// A run of elements that was solved by itself.
struct FeedPart {
  std::size_t first = 0, end = 0;  ///< elements, with what it shares with its neighbours
  std::vector<double> controls;  ///< end − first + 3; control k is number first + k of the whole
  bool converged = false;
  int iterations = 0;
};

/// A programme of many elements, solved in overlapping parts.
struct FeedParts {
  std::vector<FeedPart> parts;  ///< ascending; one: solved as a whole
  FeedSolution solution;        ///< of the whole; its iterations are those of the parts, weighted
                                ///< with their points
};

/// Solves a programme from rest to rest from its local_law(), in parts of about 1,000
/// elements that share 120 with each neighbour. Where the path goes on, two controls of a part stay
/// as that law has them: it breaks no row, so a part always has a law. Behind the next bottleneck
/// such a law is that of the whole: between two parts the law changes from one to the other (with a
/// C² weight over 12 controls) where they are nearest. Parts that differ by more than 1e-3
/// everywhere are solved as one. A part whose solve ends outside of its rows keeps its local_law().
///
/// An interior point takes as many iterations as its worst place and its widest range of feeds
/// need; in parts, the rest does not pay for that. Guarantee (test): the law of the whole, to 1e-4
/// in time. Deterministic on any number of threads (TBB).   Cost: 1.1 times solve_feed()'s per
/// iteration.
/// @pre no fixed controls   @throws ContractViolation   Not from a paper.
FeedParts solve_in_parts(const FeedProgram& program, const FeedPartsSettings& settings);

/// Where a law is to be mended: elements whose limits were drawn in.
struct FeedMending {
  std::vector<double> over;  ///< of an element: the factor of all times that it wants by itself
  double most = 1.0;         ///< elements with more than that are mended
  FeedSolverSettings solver;
};

/// Solves the elements that want more than `most` again, with 24 on each side of them, in place:
/// everything else stays. Three controls beside each such run hold b, b' and b''; rows of the four
/// elements next to them are let out by 0.04 %, for the law that is held there uses them up. Where
/// that has no law (in the middle of a way at full acceleration the speed at the end of a slower
/// start cannot be had), 96, 384 .. elements on each side, at last all of them; where they have
/// none, the law stays. Returns the elements whose law may have changed. `solution.time` and
/// iterations are brought up to date.   Deterministic on any number of threads (TBB).   Cost:
/// solve_feed()'s of the runs.
/// @pre as solve_in_parts(); `solution` is of this grid   @throws ContractViolation
std::vector<bool> mend_law(const FeedProgram& program, const FeedMending& mending,
                           FeedSolution& solution);

}  // namespace smoothpost
