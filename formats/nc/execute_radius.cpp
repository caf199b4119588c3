#include <algorithm>
#include <cmath>

#include "formats/nc/executor.h"
#include "formats/nc/number_text.h"

// G40, G41, G42 and their forms with a diameter.
namespace smoothpost::nc {
namespace {

bool is_on_code(GCode code) { return code == 410 || code == 411 || code == 420 || code == 421; }

}  // namespace

void Executor::radius_compensation(const BlockWords& block) {
  const GCode code = block.code(GGroup::radius_compensation);
  const TextPlace place = at(block, GGroup::radius_compensation);
  if (!is_on_code(code)) return radius_.end();
  const auto refuse = [&](const char* error_code, const std::string& why) {
    log_.error(error_code, g_code_text(code) + ": " + why, place);
  };
  if (radius_.is_on()) return refuse("NC264", "the compensation is on already; write G40 before");
  const GCode plane = block.code(GGroup::plane);
  if ((plane == kNoCode ? modal_.plane : plane) != 170 || modal_.tcp) {
    return refuse("NC264", "it is read in G17 outside of tool-centre-point mode only");
  }
  double diameter = 0.0;
  if (code == 411 || code == 421) {
    if (!block.has('D')) return refuse("NC264", "D, the diameter of the tool, is missing");
    diameter = block['D'] * modal_.unit;
  } else {
    const double number = block.has('D') ? block['D'] : modal_.spindle_tool;
    if (number == 0.0 && block.has('D')) return radius_.begin(0.0, true);
    const auto found = tools_.find(static_cast<int>(std::lround(std::clamp(number, -1.0, 1e9))));
    if (found == tools_.end() || !found->second.radius) {
      const std::string tool = shortest_text(number);
      return refuse("PR102", "the diameter of tool " + tool +
                                 " is not given; give its radius by G10 L1 P" + tool +
                                 " R, or write " + (code == 410 ? "G41.1" : "G42.1") + " with D");
    }
    if (found->second.orientation.value_or(0) % 9 != 0)
      return refuse("NC264", "a lathe tool with an orientation is not read");
    diameter = 2.0 * *found->second.radius;
  }
  if (!(std::abs(diameter) < 1e4)) return refuse("NC264", "the diameter is not below 10000 mm");
  const bool left = (code == 410 || code == 411) == (diameter >= 0.0);
  log_.note("NC265",
            g_code_text(code) + " is resolved for a tool of " +
                decimal_text(std::abs(diameter), 4) +
                " mm: the motions are those of its centre, and fit no other diameter",
            place);
  radius_.begin(0.5 * std::abs(diameter), left);
}

/// What may not change while the compensation is on.
void Executor::check_under_compensation(const BlockWords& block, const BlockPlan& plan) {
  const GCode non_modal = block.code(GGroup::non_modal);
  const bool offsets = block.code(GGroup::work_system) != kNoCode ||
                       (non_modal != kNoCode && non_modal != 40) ||
                       block.code(GGroup::units) != kNoCode;
  const bool expands = plan.motion > 30;
  const GCode plane = block.code(GGroup::plane);
  if (!offsets && !expands && !block.has_m(6) && (plane == kNoCode || plane == 170)) return;
  error("NC264",
        "under cutter radius compensation offsets, units, planes, tools and machine positions "
        "cannot change, and cycles and splines are not read; write G40 before",
        block, block.first_piece);
}

}  // namespace smoothpost::nc
