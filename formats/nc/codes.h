#pragma once

#include <cstdint>
#include <string>

#include "formats/nc/program.h"

namespace smoothpost::nc {

/// A G word's number times ten: G1 is 10, G91.1 is 911.
using GCode = std::int16_t;
inline constexpr GCode kNoCode = -1;

/// Modal groups of RS274NGC as LinuxCNC numbers them; of two words of one group one is wrong.
enum class GGroup : std::uint8_t {
  non_modal = 0,
  motion = 1,
  plane = 2,
  distance = 3,
  arc_distance = 4,
  feed_mode = 5,
  units = 6,
  radius_compensation = 7,
  length_offset = 8,
  no_effect = 9,  ///< of no group, without effect on positions: several may stand in a block
  retract = 10,
  work_system = 12,
  path_control = 13,
  spindle_mode = 14,
  lathe_diameter = 15
};
inline constexpr int kGGroups = 16;

enum class GStatus : std::uint8_t {
  unknown,  ///< no code of this language
  read,     ///< has its meaning here
  later,    ///< a code of this language that a later version reads
  tcp       ///< tool-centre-point or tilted-plane mode of another controller
};

struct GCodeInfo {
  GStatus status = GStatus::unknown;
  GGroup group = GGroup::non_modal;
  const char* name = "";  ///< what it is, for a message
};

/// The entry of G`code`/10 in a dialect; status unknown for anything that is in no table.
const GCodeInfo& g_code_info(GCode code, InputDialect dialect);

/// "G1", "G91.1".
std::string g_code_text(GCode code);

/// Modal group of an M word (4 stop, 5 I/O, 6 tool, 7 spindle, 8 coolant, 9 override, 10 user, 11
/// program call); -1 for a number that has none. M0..M999.
int m_group(int m);

/// Rank in the controller's order of execution on one line: I/O, tool, spindle, coolant, overrides,
/// user.
int m_rank(int m);

/// Why an M word can never be handed on as an event or a comment (program flow, saved state);
/// nullptr when it can.
const char* m_refusal(int m, InputDialect dialect);

}  // namespace smoothpost::nc
