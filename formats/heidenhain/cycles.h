#pragma once

#include <string>
#include <vector>

namespace smoothpost::conversational {

/// Drilling by cycle 1 (pecking) or 200; mm, s, heights along the tool axis in program coordinates.
struct DrillCycle {
  int number = 0;          ///< 1 or 200
  double clearance = 0.0;  ///< above the surface
  double depth = 0.0;      ///< below the surface, above 0
  double peck = 0.0;
  double dwell_top = 0.0;  ///< 200: after each stroke but the last
  double dwell_bottom = 0.0;
  double surface = 0.0;           ///< 200: its height
  double second_clearance = 0.0;  ///< 200: above the surface
  double feed = 0.0;              ///< as written
};

/// What the tool does next: to a height, as a feed or a rapid, then a dwell.
struct CycleStep {
  double height = 0.0;
  bool feed = false;
  double dwell = 0.0;
};

/// How many strokes a hole takes.
double stroke_count(const DrillCycle& cycle);

/// The steps of one hole for a tool that stands over it at `height`.
///  - 1: feed from the present height, which is the clearance above the surface, by strokes of
///    `peck`; after each one a rapid back up and down again to t above the depth that was reached:
///    t is 0.6 mm for holes up to 30 mm, else a fiftieth of the depth, at most 7 mm. Rapid out.
///  - 200: rapid to the clearance; strokes, between them a rapid to the clearance, the dwell, and a
///    rapid to the clearance above the depth that was reached; out to the clearance or the second
///    one, whichever is higher.
/// @pre peck > 0 and stroke_count() is small enough to be stored
std::vector<CycleStep> drill_steps(const DrillCycle& cycle, double height);

}  // namespace smoothpost::conversational
