#include "formats/nc/cycles.h"

#include <algorithm>
#include <cmath>

namespace smoothpost::nc {
namespace {

using Kind = CycleStep::Kind;
constexpr double kNoPeck = 1e-9;  // mm; a last peck below it is none

bool pecks(const CycleHole& hole) { return hole.code == 730 || hole.code == 830; }

void add_pecks(const CycleHole& hole, std::vector<CycleStep>& steps) {
  const double count = peck_count(hole);
  for (double k = 1.0; k < count; k += 1.0) {
    const double depth = hole.retract - k * hole.peck;
    if (depth <= hole.bottom + kNoPeck) return;
    steps.push_back({Kind::feed, depth});
    if (hole.code == 830) steps.push_back({Kind::rapid, hole.retract});
    steps.push_back({Kind::rapid, depth + hole.clearance});
  }
}

}  // namespace

double peck_count(const CycleHole& hole) {
  if (!pecks(hole)) return 1.0;
  return std::max(1.0, std::ceil((hole.retract - hole.bottom) / hole.peck));
}

std::vector<CycleStep> cycle_steps(const CycleHole& hole) {
  std::vector<CycleStep> steps;
  const CycleStep bottom{Kind::feed, hole.bottom};
  const CycleStep wait{Kind::dwell, hole.dwell};
  const CycleStep rapid_out{Kind::rapid, hole.clear};
  switch (hole.code) {
    case 730:
    case 830:
      add_pecks(hole, steps);
      steps.insert(steps.end(), {bottom, rapid_out});
      break;
    case 740:
    case 840:
      steps = {bottom,
               {Kind::spindle_back, 0.0},
               wait,
               {Kind::feed, hole.clear},
               {Kind::spindle_on, 0.0}};
      break;
    case 820:
      steps = {bottom, wait, rapid_out};
      break;
    case 850:
      steps = {bottom, {Kind::feed, hole.retract}, rapid_out};
      break;
    case 860:
      steps = {bottom, wait, {Kind::spindle_stop, 0.0}, rapid_out, {Kind::spindle_on, 0.0}};
      break;
    case 870:
      steps = {{Kind::aside, 0.0},
               {Kind::spindle_orient, 0.0},
               {Kind::rapid, hole.bottom},
               {Kind::centre, 0.0},
               {Kind::spindle_on, 0.0},
               {Kind::feed, hole.middle},
               bottom,
               {Kind::spindle_orient, 0.0},
               {Kind::aside, 0.0},
               rapid_out,
               {Kind::centre, 0.0},
               {Kind::spindle_on, 0.0}};
      break;
    case 890:
      steps = {bottom, wait, {Kind::feed, hole.clear}};
      break;
    default:
      steps = {bottom, rapid_out};
      break;
  }
  return steps;
}

}  // namespace smoothpost::nc
