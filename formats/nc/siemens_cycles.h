#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace smoothpost::nc {

/// What the tool does next over a hole.
struct DrillStep {
  enum class Kind : std::uint8_t {
    rapid,  ///< to the height `value`, straight along the plane's normal
    feed,   ///< the same
    dwell,  ///< `value` s
    m_word  ///< M`value` of spindle or stop
  };
  Kind kind = Kind::rapid;
  double value = 0.0;
  double factor = 1.0;  ///< of the programmed feed
  double rate = 0.0;    ///< mm/min; 0: the programmed feed
};

/// A hole of a drilling cycle of Sinumerik controls. Heights are those of the program, mm.
struct DrillingCall {
  double clearance = 0.0;  ///< RFP + SDIS, where the steps begin
  double retract = 0.0;    ///< RTP, where they end
  double depth = 0.0;
  int spindle = 0;  ///< 3 or 4: the spindle has to turn so; 0: any
  bool pecks = false;
  std::vector<DrillStep> steps;
};

/// A call of a drilling cycle, or why it is not read.
struct DrillingCycle {
  DrillingCall call;
  std::string problem;
};

using CycleValues = std::vector<std::optional<double>>;

/// The steps of CYCLE81 to CYCLE89 and CYCLE840 from the values of a call, in their order; those
/// without a value are empty. RTP, RFP, SDIS, DP, DPR come first: DPR counts from RFP, DP is a
/// height. Test "siemens: the steps of the drilling cycles".
///
/// 81, 82: feed to the depth, dwell, rapid out. 83: pecks (below) with a dwell at each; chip
/// breaking lifts by VRT (1 mm) with the feed, removal of chips goes to the clearance and back to
/// above the last depth: DIS1, or 0.6 mm up to 30 mm of depth, else depth/50, at most 7 mm. 840
/// without encoder (ENC = 1): feed in, the spindle the other way round (SDR), feed out. 85: feeds
/// FFR and RFF. 86: spindle stopped by M19, rapid out. 87, 88: M5 and M0 at the depth. 89: feed
/// out. A dwell below 0 (turns of the spindle), lifting of a boring bar, CYCLE84 and CYCLE840 with
/// encoder, whose feed follows the spindle, and further values other than 0 are a problem.
/// @param unit  mm per unit of a length in the program
DrillingCycle drilling_cycle(std::string_view name, const CycleValues& values, double unit);

/// The depths of CYCLE83 from the reference, rising, the last one is `total`. The first is `first`;
/// each stroke is by `less` (DAM) smaller than the one before but not below `less`; what is left
/// below two of them is halved. `less` 0: all strokes are equal; below 0: each is |less| times the
/// one before, at least `smallest`. Empty: more than 100 000.
/// @pre 0 < first <= total; less >= -1; smallest > 0 when less < 0
std::vector<double> peck_depths(double total, double first, double less, double smallest);

/// Places in the plane, mm: HOLES1(SPCA, SPCO, STA1, FDIS, DBH, NUM), NUM holes on a line, or
/// HOLES2(CPA, CPO, RAD, STA1, INDA, NUM), NUM holes on a circle; INDA 0 divides it.
struct HolePattern {
  std::vector<std::pair<double, double>> places;
  std::string problem;
};
HolePattern hole_pattern(std::string_view name, const CycleValues& values, double unit);

}  // namespace smoothpost::nc
