#pragma once

#include <cstdint>
#include <vector>

#include "formats/nc/codes.h"

namespace smoothpost::nc {

/// One hole of a canned cycle. Heights are along the plane's normal, in program coordinates; mm, s.
struct CycleHole {
  GCode code = 810;
  double clear = 0.0;    ///< where the cycle ends: the R height, or the old one (G98) if higher
  double retract = 0.0;  ///< R; the tool stands there, over the hole, when the steps begin
  double bottom = 0.0;
  double peck = 0.0;       ///< Q of G73 and G83, above 0
  double clearance = 0.0;  ///< G73, G83: how far above the last depth the next peck begins
  double dwell = 0.0;      ///< at the bottom
  double middle = 0.0;     ///< K of G87
};

/// What the tool does next.
struct CycleStep {
  enum class Kind : std::uint8_t {
    rapid,           ///< to `value`, straight along the normal
    feed,            ///< the same
    dwell,           ///< `value` s
    spindle_stop,    ///< M5
    spindle_orient,  ///< M19: stopped at the angle that lets a boring tool pass
    spindle_back,    ///< turns the other way round
    spindle_on,      ///< turns as before the cycle
    aside,           ///< rapid in the plane by the shift of G87
    centre           ///< rapid back over the hole
  };
  Kind kind = Kind::rapid;
  double value = 0.0;
};

/// How many pecks a hole takes: ⌈(R - bottom) / Q⌉; 1 for other cycles. Infinity stays infinity.
double peck_count(const CycleHole& hole);

/// The steps of one hole, as LinuxCNC 2.9 makes them: G81 G82 drill and rapid out; G73 pecks and
/// lifts by the clearance; G83 pecks and lifts to R; G74 and G84 feed in, turn the spindle round,
/// dwell and feed out; G85 and G89 feed out; G86 stops the spindle and rapids out; G87 goes down
/// beside the hole and feeds from the bottom up to `middle` and back.
/// Test "cycles: the steps of each cycle". @pre peck_count(hole) is small enough to be stored.
std::vector<CycleStep> cycle_steps(const CycleHole& hole);

}  // namespace smoothpost::nc
