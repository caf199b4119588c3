#include <cmath>

#include "formats/nc/executor.h"
#include "formats/nc/number_text.h"
#include "kernels/core/units.h"

// Tool lengths and the tool table.
namespace smoothpost::nc {
namespace {

constexpr std::size_t kZ = 2;
constexpr int kFixture = 9;  // G59.3, which G10 L11 counts in

AxisMask bit(std::size_t axis) { return static_cast<AxisMask>(1u << axis); }

}  // namespace

void Executor::tool_length(const BlockWords& block) {
  const GCode code = block.code(GGroup::length_offset);
  if (!is_linuxcnc()) set_tcp_by_offset(code);
  if (code == 490) return set_tool_length(0.0, 0, block.input_line);
  if (code == 431) {
    const AxisMask axes = axis_mask(block.letters);
    if ((axes & ~bit(kZ)) != 0) {
      log_.error("NC225", "G43.1 is read with Z only: the tool length along the tool axis",
                 at(block, GGroup::length_offset));
      return;
    }
    const double length = block.has('Z') ? block['Z'] * modal_.unit : coordinates_.tool()[kZ];
    return set_tool_length(length, modal_.spindle_tool, block.input_line);
  }
  const int tool = block.has('H') ? static_cast<int>(std::lround(block['H'])) : modal_.spindle_tool;
  if (tool == 0 && block.has('H')) return set_tool_length(0.0, 0, block.input_line);
  if (tool == 0) {
    log_.error("PR104",
               g_code_text(code) +
                   " without H, and no tool was changed to before: which length is meant is not "
                   "known; write H with the tool's number or a tool change before it",
               at(block, GGroup::length_offset));
    return;
  }
  const auto found = tools_.find(tool);
  if (found == tools_.end() || !found->second.length) {
    const std::string number = std::to_string(tool);
    log_.error("PR102",
               g_code_text(code) + " needs the length of tool " + number +
                   ", which the program does not contain; "
                   "give it by --tool " +
                   number + "=LENGTH (mm)",
               at(block, GGroup::length_offset));
    return;
  }
  set_tool_length(*found->second.length, tool, block.input_line);
}

void Executor::set_tool_length(double length, int tool, std::uint32_t line) {
  AxisWords offset{};
  offset[kZ] = length;
  const bool same = offset == coordinates_.tool() && tool == modal_.length_tool;
  coordinates_.set_tool(offset);
  constexpr AxisMask kLinear = 7;
  if (!same && modal_.swivelled) coordinates_.forget(kLinear);
  modal_.length_tool = tool;
  if (!same) sink_.tool_length(length, tool, line);
}

/// G10 L1: the words are the tool's data. L10: with this length the present point would have the
/// programmed Z in the active system; L11: in G59.3 without G92 and G52. A length that is in force
/// stays until the next G43.
void Executor::set_tool_data(const BlockWords& block) {
  ToolData& tool = tools_[static_cast<int>(std::lround(block['P']))];
  if (block.has('Z')) {
    const double z = block['Z'] * modal_.unit;
    if (block['L'] == 1.0) {
      tool.length = z;
    } else {
      warn_unknown(block, bit(kZ));
      const AxisWords& world = coordinates_.world();
      const double here = block['L'] == 10.0 ? coordinates_.program_from_world(world)[kZ]
                                             : world[kZ] - coordinates_.offset(kFixture).words[kZ];
      tool.length = here + coordinates_.tool()[kZ] - z;
    }
  }
  if (block.has('R')) tool.radius = block['R'] * modal_.unit;
  if (block.has('I')) tool.front_angle = block['I'];
  if (block.has('J')) tool.back_angle = block['J'];
  if (block.has('Q')) tool.orientation = static_cast<int>(std::lround(block['Q']));
}

}  // namespace smoothpost::nc
