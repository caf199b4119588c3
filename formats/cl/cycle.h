#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/cl/feed.h"
#include "formats/cl/statement.h"

namespace smoothpost::cl {

/// A drilling cycle, lengths in mm along the tool axis over the programmed point, which is the
/// hole's mouth.
struct Cycle {
  double depth = 0.0;             ///< below the point
  double clearance = 0.0;         ///< where the feed begins, above the point
  std::optional<double> retract;  ///< where the tool goes after a hole; nothing: clearance
  bool retract_to_start = false;  ///< to the height that the tool had before the cycle
  double dwell = 0.0;             ///< s at the bottom
  double first_peck = 0.0;        ///< 0: one stroke
  double peck = 0.0;              ///< of the further strokes
  bool break_chips = false;       ///< retracts by kPeckGap only
  std::optional<Feed> feed;       ///< nothing: the feed of FEDRAT
};

/// What the tool stays away from the last depth when it comes back: LinuxCNC's 0.010 inch.
inline constexpr double kPeckGap = 0.254;
inline constexpr int kMostPecks = 1000;

/// A cycle, or the reason and place why there is none; `refused`: a cycle that is not read, as
/// against one that is written wrongly.
struct CycleReading {
  std::optional<Cycle> cycle;
  std::string problem;
  TextPlace place;
  bool refused = false;
};

/// Reads the values of CYCLE/type, word, value ...
///
/// Types: DRILL and FACE (one stroke), DEEP and DEEP2 (out of the hole after each stroke), BRKCHP.
/// Words: FEDTO or DEPTH d; RAPTO or CLEAR c; RTRCTO or RETURN r, or RTRCTO,AUTO; DWELL s; STEP,
/// INCR or 1STPECK q, SUBPECK q; MMPM, IPM, MMPR, IPR, PERMIN or PERREV f. DEEP and BRKCHP may
/// stand behind DRILL (NX). A depth counts downwards whatever its sign.
/// @param unit  mm of one unit of length
CycleReading read_cycle(std::span<const Item> items, double unit);

/// One stroke or rapid of a hole: to `height` mm above the point, as a feed or a rapid.
struct CycleStep {
  double height = 0.0;
  bool feed = false;
  bool dwell = false;  ///< at the end of the step
};

/// The steps of one hole from the retract height on, which comes first: down to the clearance,
/// the strokes, back to the retract height.   @param retract  at least the clearance
std::vector<CycleStep> hole_steps(const Cycle& cycle, double retract);

}  // namespace smoothpost::cl
