#include "formats/heidenhain/cycles.h"

#include <algorithm>
#include <cmath>

namespace smoothpost::conversational {
namespace {

constexpr double kShallow = 30.0;  // mm, up to which depth cycle 1 stops kStop above
constexpr double kStop = 0.6;
constexpr double kStopShare = 50.0;
constexpr double kLargestStop = 7.0;
constexpr double kNoStroke = 1e-9;  // mm

/// Depths below the surface at which strokes end, the last one the hole's.
std::vector<double> strokes(double from, double to, double peck) {
  std::vector<double> depths;
  for (double k = 1.0; from + k * peck < to - kNoStroke; k += 1.0)
    depths.push_back(from + k * peck);
  depths.push_back(to);
  return depths;
}

}  // namespace

double stroke_count(const DrillCycle& cycle) {
  return std::max(1.0, std::ceil(cycle.depth / cycle.peck));
}

std::vector<CycleStep> drill_steps(const DrillCycle& cycle, double height) {
  const bool old = cycle.number == 1;
  const double surface = old ? height - cycle.clearance : cycle.surface;
  const double top = surface + cycle.clearance;
  const double stop =
      cycle.depth <= kShallow ? kStop : std::min(kLargestStop, cycle.depth / kStopShare);
  std::vector<CycleStep> steps;
  if (!old) steps.push_back({top, false, 0.0});
  const auto depths = strokes(0.0, cycle.depth, cycle.peck);
  for (std::size_t i = 0; i < depths.size(); ++i) {
    const bool last = i + 1 == depths.size();
    steps.push_back({surface - depths[i], true, last ? cycle.dwell_bottom : 0.0});
    if (last) break;
    steps.push_back({top, false, cycle.dwell_top});
    const double above = std::min(top, surface - depths[i] + (old ? stop : cycle.clearance));
    if (above < top) steps.push_back({above, false, 0.0});
  }
  const double out = old ? top : std::max(top, surface + cycle.second_clearance);
  steps.push_back({out, false, 0.0});
  return steps;
}

}  // namespace smoothpost::conversational
