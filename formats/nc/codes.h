#pragma once

#include <cstdint>
#include <string>

#include "formats/nc/program.h"

namespace smoothpost::nc {

/// A G word's number times ten: G1 is 10, G91.1 is 911.
using GCode = std::int16_t;
inline constexpr GCode kNoCode = -1;

inline constexpr GCode kSplineEnd = 53;   ///< G5.3
inline constexpr GCode kMacroCall = 650;  ///< G65 of the Fanuc family

// Motions of siemens that have no number.
inline constexpr GCode kPolynomial = 9997;  ///< POLY
inline constexpr GCode kTangentArc = 9998;  ///< CT
inline constexpr GCode kPointArc = 9999;    ///< CIP
/// Above any number that a G word of siemens may have.
inline constexpr double kMostSiemensCode = 999.6;

/// Rank of m_rank() for what acts after the motion of its line.
inline constexpr int kAfterMotion = 7;

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
  unknown,       ///< no code of this language
  read,          ///< has its meaning here
  expanded,      ///< read as the motions that it stands for: cycles, splines, probing; macro calls
  later,         ///< a code of this language that a later version reads
  synchronised,  ///< feed by the turning of the spindle
  tcp            ///< tool-centre-point or tilted-plane mode of another controller
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

/// Why an M word is never read; nullptr when it is.
/// @param plain  a machine program, whose blocks run one after the other
const char* m_refusal(int m, InputDialect dialect, bool plain);

/// M70 to M73, M98, M99 (haas: M97): words of the program's flow and of its saved state.
bool is_flow_m(int m, InputDialect dialect);

/// G73, G74, G81 to G89.
inline bool is_cycle(GCode code) {
  return code == 730 || code == 740 || (code >= 810 && code <= 890);
}
/// G33, G33.1, G76.
inline bool is_synchronised(GCode code) { return code == 330 || code == 331 || code == 760; }
/// G38.2 to G38.5.
inline bool is_probe(GCode code) { return code >= 382 && code <= 385; }
/// CIP, CT, POLY.
inline bool is_named_motion(GCode code) { return code >= kPolynomial; }
/// G5, G5.1, G5.2.
inline bool is_spline(GCode code) { return code >= 50 && code <= 52; }

}  // namespace smoothpost::nc
