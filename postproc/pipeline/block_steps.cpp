#include "postproc/pipeline/block_steps.h"

#include <algorithm>
#include <cmath>

namespace smoothpost {

namespace {

constexpr int kBisections = 4;

}  // namespace

double usual_block_time(const MachineDefinition& machine) {
  const DialectSettings& d = machine.dialect;
  if (d.block_time > 0.0) return std::max(d.block_time, machine.cycle.min_block);
  double time = kShortBlock;
  if (d.name == "linuxcnc" && d.path_mode == "exact")
    time = kLongBlock;
  return std::max(time, machine.cycle.min_block);
}

double longest_step(double rest, double usual, double least,
                    const std::function<bool(double)>& holds) {
  const double even = rest / std::ceil(rest / usual - 1e-9);
  if (even <= least || holds(even)) return even;
  double high = even, low = 0.5 * even;
  while (low > least && !holds(low)) {
    high = low;
    low *= 0.5;
  }
  if (low <= least) return std::min(rest, least);
  for (int k = 0; k < kBisections; ++k) {
    const double middle = 0.5 * (low + high);
    (holds(middle) ? low : high) = middle;
  }
  // What is left would be a short block: two equal ones.
  const double half = 0.5 * rest;
  return rest < 2.0 * low && holds(half) ? half : low;
}

}  // namespace smoothpost
