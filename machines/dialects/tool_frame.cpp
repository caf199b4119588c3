#include "machines/dialects/tool_frame.h"

namespace smoothpost {

Pose tool_frame(const MachineDefinition& machine, double tool_length) {
  Pose tool = Pose::Identity();
  tool.translation() = machine.tool.tip - tool_length * machine.tool.axis;
  return machine.tool.flange.inverse() * tool;
}

}  // namespace smoothpost
