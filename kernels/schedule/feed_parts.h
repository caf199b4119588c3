#pragma once

#include <cstddef>
#include <vector>

#include "kernels/schedule/feed_solver.h"

// Internal to kernels/schedule.
namespace smoothpost {

struct FeedPartsSettings {
  FeedSolverSettings solver;
  bool join = true;   ///< solve parts that do not meet as one; false: change over where they are
                      ///< nearest
  bool retry = true;  ///< a part that does not converge once more, from its local_law()
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

/// Solves a programme from rest to rest from half of its largest constant, in parts of about 600
/// elements that share 200 with each neighbour. A part starts and ends slowly where the path goes
/// on: two controls there are half of the largest b that is possible as a constant on it, so it
/// always has a law. Behind the next bottleneck such a law is that of the whole: between two parts
/// the law changes from one to the other (with a C² weight over 12 controls) where they are
/// nearest. Parts that differ by more than 1e-4 everywhere are solved as one.
///
/// An interior point takes as many iterations as its worst place and its widest range of feeds
/// need; in parts, the rest does not pay for that. Guarantee (test): the law of the whole, to 1e-4
/// in time. Deterministic on any number of threads (TBB).   Cost: 1.3 times solve_feed()'s per
/// iteration.
/// @pre no fixed controls   @throws ContractViolation   Not from a paper.
FeedParts solve_in_parts(const FeedProgram& program, const FeedPartsSettings& settings);

/// Solves those parts again on which a row has changed, from their laws shrunk by `c` in time.
void solve_again(const FeedProgram& program, const std::vector<bool>& changed, double c,
                 const FeedPartsSettings& settings, FeedParts& parts);

}  // namespace smoothpost
