#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "machines/dialects/dialect.h"

namespace smoothpost {

/// What one motion line of the output stands for.
struct LineMapEntry {
  std::uint32_t output_line = 0;
  std::uint32_t input_line = 0;  ///< 0 for a link of ours
  MoveRole role = MoveRole::link;
  std::uint32_t segment = 0;       ///< where the block ends
  std::uint32_t from_segment = 0;  ///< where it starts; below segment when points were merged
  double from_share = 0.0;
  double to_share = 1.0;
};

using LineMap = std::vector<LineMapEntry>;

/// @pre emitted is what a dialect made of program
LineMap line_map_of(const MachineProgram& program, const EmittedProgram& emitted);

}  // namespace smoothpost
