#include <algorithm>
#include <cmath>

#include "formats/nc/executor.h"
#include "formats/nc/number_text.h"

// G40, G41, G42, and G41.1, G42.1 with a diameter.
namespace smoothpost::nc {
namespace {

constexpr double kLargestDiameter = 1e4;  // mm

bool is_by_value(GCode code) { return code == 411 || code == 421; }
bool is_whole(double value) { return std::abs(value - std::round(value)) <= 1e-4; }

/// From the centre of a lathe tool's nose to the point that its words move, along Z and X: 1 to 4
/// are the corners of the nose, 5 to 8 its sides, 0 and 9 the centre.
Vec2 nose_shift(int orientation, double radius) {
  constexpr int kAlong[10][2] = {{0, 0}, {1, -1}, {-1, -1}, {-1, 1}, {1, 1},
                                 {1, 0}, {0, -1}, {-1, 0},  {0, 1},  {0, 0}};
  const auto& along = kAlong[orientation];
  return radius * Vec2(along[0], along[1]);
}

}  // namespace

void Executor::radius_compensation(const BlockWords& block) {
  const GCode code = block.code(GGroup::radius_compensation);
  if (code == 400) {
    modal_.radius_compensation = 400;
    return radius_.end();
  }
  const TextPlace place = at(block, GGroup::radius_compensation);
  const auto refuse = [&](const char* error_code, const std::string& why) {
    log_.error(error_code, g_code_text(code) + ": " + why, place);
  };
  if (radius_.is_on()) return refuse("NC264", "the compensation is on already; write G40 before");
  RadiusSettings settings;
  const GCode plane = block.code(GGroup::plane);
  settings.plane = plane == kNoCode ? modal_.plane : plane;
  settings.unit = modal_.unit;
  if (settings.plane == 190) return refuse("NC264", "it is read in G17 and G18 only");
  if (modal_.tcp)
    return refuse("NC202", "it is not read in tool-centre-point mode (M428); write M429 before");
  const bool lathe = settings.plane == 180;
  if (lathe && coordinates_.rotated())
    return refuse("NC202", "it is not read in G18 under an XY rotation (G10 L2 R)");
  double diameter = 0.0;
  int orientation = 0;
  if (is_by_value(code)) {
    if (!block.has('D')) return refuse("NC264", "D, the diameter of the tool, is missing");
    diameter = block['D'] * modal_.unit;
    const double l = block.has('L') ? block['L'] : 0.0;
    if (!is_whole(l) || l < -0.5 || l > 9.5)
      return refuse("NC264", "L is the orientation of a lathe tool, 0 to 9");
    orientation = static_cast<int>(std::lround(l));
  } else {
    const double number = block.has('D') ? block['D'] : modal_.spindle_tool;
    if (!is_whole(number) || number < -0.5 || number > 1e9)
      return refuse("NC264", "D is the number of a tool");
    const auto found = tools_.find(static_cast<int>(std::lround(number)));
    const bool none = block.has('D') && number == 0.0;
    if (!none && (found == tools_.end() || !found->second.radius)) {
      const std::string tool = number == 0.0 ? "in the spindle" : shortest_text(number);
      return refuse("PR102",
                    "the diameter of the tool " + tool +
                        " is not given; give it by --tool N=LENGTH,DIAMETER (mm), or its radius by "
                        "G10 L1 P R in the program, or write " +
                        (code == 410 ? "G41.1" : "G42.1") + " with the diameter as D");
    }
    if (!none) diameter = 2.0 * *found->second.radius;
    if (!none) orientation = found->second.orientation.value_or(0);
  }
  if (!(std::abs(diameter) < kLargestDiameter))
    return refuse("NC264", "the diameter is not below 10000 mm");
  if (!lathe && orientation % 9 != 0)
    return refuse("NC264", "the tool is a lathe tool (orientation " + std::to_string(orientation) +
                               "), but the plane is not G18");
  settings.tool.left = (code == 410 || code == 411) == (diameter >= 0.0);
  settings.tool.radius = 0.5 * std::abs(diameter);
  settings.shift = nose_shift(orientation, settings.tool.radius);
  settings.straight_entry = orientation % 9 != 0;
  log_.note("NC265",
            g_code_text(code) + " is resolved for a diameter of " +
                decimal_text(std::abs(diameter), 4) +
                " mm: the motions are those of the tool's centre and fit no other tool",
            place);
  radius_.begin(settings);
  modal_.radius_compensation = settings.tool.left ? 410 : 420;
}

/// What may not change while the compensation is on: offsets, units, planes, tools.
void Executor::check_under_compensation(const BlockWords& block, const BlockPlan& plan) {
  const GCode non_modal = block.code(GGroup::non_modal);
  const GCode units = block.code(GGroup::units);
  const GCode plane = block.code(GGroup::plane);
  const bool state = block.has_m(70) || block.has_m(71) || block.has_m(72) || block.has_m(73);
  const bool changes = block.code(GGroup::work_system) != kNoCode ||
                       block.code(GGroup::length_offset) != kNoCode ||
                       (non_modal != kNoCode && non_modal != 40) ||
                       (units != kNoCode && (units == 200) != (modal_.unit != 1.0)) ||
                       (plane != kNoCode && plane != modal_.plane);
  const bool expands = plan.motion > 30 && !is_synchronised(plan.motion);
  if (!changes && !expands && !state && !block.has_m(6)) return;
  error("NC264",
        "under cutter radius compensation offsets, units, planes, tools and the saved state do "
        "not change, and cycles, splines and machine positions are not read; write G40 before",
        block, block.first_piece);
}

}  // namespace smoothpost::nc
