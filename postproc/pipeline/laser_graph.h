#pragma once

#include <optional>
#include <vector>

#include "postproc/pipeline/laser_clearance.h"

namespace smoothpost {

/// One admissible place of the wrist at every station of a stretch.
struct WristWay {
  std::vector<WristState> at;  ///< by station; empty: there is none
  std::size_t blocked = 0;     ///< without a way: the station that none leads to
  bool empty = false;          ///< that one has no admissible cell at all
  double margin = 0.0;         ///< mm that its cells keep beside the clearances
  std::size_t queries = 0;     ///< pairs that were searched for the domains
};

struct WristGraphOptions {
  double node_share = 0.05;  ///< what a node's distance from the programmed orientation costs
  std::vector<double> margins = {0.5, 0.05};  ///< mm; the first that leaves a way is taken
  std::vector<bool> keep = {};  ///< by station: the programmed place is a node too, if it is free
};

/// The cheapest way (best_route) through the domains of all stations: lead × tilt × standoff ×
/// branch × turn, with edges by d²/way, and nodes by their distance from the programmed
/// orientation; at fixed stations the programmed joints. Where the tool axis is on the first
/// rotary's pole that rotary may have any of 24 angles.
/// @param spacing  mm of the tip's way from each station to the one before
/// Cost: the domains, on all threads; then the route, at most about 1600² distances a station.
class WristGraph {
 public:
  WristGraph(const ClearanceTask& task, std::vector<double> spacing,
             WristGraphOptions options = {});

  WristWay way();
  /// Takes the cells of that way out that are next to these stations: another one is found.
  void forbid(const WristWay& way, const std::vector<std::size_t>& stations);

 private:
  void build(double margin);
  void add_cells(std::size_t station, const FeasibleDomain& domain, const DomainProblem& problem);
  void add_turns(std::size_t station, const JointVector& q, bool at_pole);
  void add_programmed(std::size_t station, double margin);

  const ClearanceTask& task_;
  std::vector<double> spacing_;
  WristGraphOptions options_;
  std::vector<std::vector<WristNode>> layers_;
  double margin_ = -1.0;
  std::size_t queries_ = 0;
};

/// Rotaries and standoff along a way as splines: control points are the values of the polygon
/// through the stations at the Greville places of `pieces` equal pieces (Schoenberg's operator), so
/// that every place lies in the hull of six places of the polygon and the curve comes as near to it
/// as one likes with more pieces.
struct WristCurves {
  SplineCurve rotary, standoff;
};
WristCurves curves_of(const ClearanceTask& task, const WristWay& way, double last, int pieces);

}  // namespace smoothpost
