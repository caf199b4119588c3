#include "postproc/pipeline/line_map.h"

#include "kernels/core/contract.h"

namespace smoothpost {

LineMap line_map_of(const MachineProgram& program, const EmittedProgram& emitted) {
  require(program.moves.size() == emitted.move_lines.size(), "every move has its line");
  LineMap map;
  map.reserve(program.moves.size());
  for (std::size_t i = 0; i < program.moves.size(); ++i) {
    const MachineMove& m = program.moves[i];
    map.push_back({emitted.move_lines[i], m.input_line, m.role, m.segment, m.from_segment,
                   m.from_share, m.to_share});
  }
  return map;
}

}  // namespace smoothpost
