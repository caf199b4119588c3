#include "formats/nc/codes.h"

#include <algorithm>
#include <array>

namespace smoothpost::nc {
namespace {

struct Row {
  GCode code;
  GGroup group;
  GStatus status;
  const char* name;
};

constexpr auto kRead = GStatus::read;
constexpr auto kExpanded = GStatus::expanded;
constexpr auto kLater = GStatus::later;
constexpr auto kSynchronised = GStatus::synchronised;
constexpr auto kTcp = GStatus::tcp;

constexpr Row kRows[] = {
    {0, GGroup::motion, kRead, "rapid"},
    {10, GGroup::motion, kRead, "straight feed"},
    {20, GGroup::motion, kRead, "clockwise arc"},
    {30, GGroup::motion, kRead, "counter-clockwise arc"},
    {40, GGroup::non_modal, kRead, "dwell"},
    {50, GGroup::motion, kExpanded, "cubic spline"},
    {51, GGroup::motion, kExpanded, "quadratic spline"},
    {52, GGroup::motion, kExpanded, "NURBS"},
    {53, GGroup::motion, kExpanded, "end of NURBS"},
    {70, GGroup::lathe_diameter, kRead, "lathe diameter mode"},
    {80, GGroup::lathe_diameter, kRead, "lathe radius mode"},
    {100, GGroup::non_modal, kRead, "setting of offsets"},
    {170, GGroup::plane, kRead, "XY plane"},
    {171, GGroup::plane, kLater, "UV plane"},
    {180, GGroup::plane, kRead, "XZ plane"},
    {181, GGroup::plane, kLater, "UW plane"},
    {190, GGroup::plane, kRead, "YZ plane"},
    {191, GGroup::plane, kLater, "VW plane"},
    {200, GGroup::units, kRead, "inch"},
    {210, GGroup::units, kRead, "millimetre"},
    {280, GGroup::non_modal, kRead, "home position"},
    {281, GGroup::non_modal, kRead, "storing of the home position"},
    {300, GGroup::non_modal, kRead, "second home position"},
    {301, GGroup::non_modal, kRead, "storing of the second home position"},
    {330, GGroup::motion, kExpanded, "spindle-synchronised motion"},
    {331, GGroup::motion, kExpanded, "rigid tapping"},
    {382, GGroup::motion, kExpanded, "probing"},
    {383, GGroup::motion, kExpanded, "probing"},
    {384, GGroup::motion, kExpanded, "probing"},
    {385, GGroup::motion, kExpanded, "probing"},
    {400, GGroup::radius_compensation, kRead, "end of cutter radius compensation"},
    {410, GGroup::radius_compensation, kExpanded, "cutter radius compensation"},
    {411, GGroup::radius_compensation, kExpanded, "cutter radius compensation"},
    {420, GGroup::radius_compensation, kExpanded, "cutter radius compensation"},
    {421, GGroup::radius_compensation, kExpanded, "cutter radius compensation"},
    {430, GGroup::length_offset, kRead, "tool length offset"},
    {431, GGroup::length_offset, kRead, "tool length offset by value"},
    {432, GGroup::length_offset, kLater, "added tool length offset"},
    {434, GGroup::length_offset, kTcp, "Fanuc tool-centre-point control with rotary positions"},
    {435, GGroup::length_offset, kTcp, "Fanuc tool-centre-point control with tool vectors"},
    {490, GGroup::length_offset, kRead, "end of tool length offset"},
    {520, GGroup::non_modal, kRead, "local offset"},
    {530, GGroup::non_modal, kRead, "machine coordinates"},
    {531, GGroup::non_modal, kTcp, "tool axis direction control"},
    {540, GGroup::work_system, kRead, "work system 1"},
    {544, GGroup::work_system, kTcp, "workpiece setting error compensation"},
    {550, GGroup::work_system, kRead, "work system 2"},
    {560, GGroup::work_system, kRead, "work system 3"},
    {570, GGroup::work_system, kRead, "work system 4"},
    {580, GGroup::work_system, kRead, "work system 5"},
    {590, GGroup::work_system, kRead, "work system 6"},
    {591, GGroup::work_system, kRead, "work system 7"},
    {592, GGroup::work_system, kRead, "work system 8"},
    {593, GGroup::work_system, kRead, "work system 9"},
    {610, GGroup::path_control, kRead, "exact path"},
    {611, GGroup::path_control, kRead, "exact stop"},
    {640, GGroup::path_control, kRead, "path blending"},
    {680, GGroup::non_modal, kLater, "coordinate rotation"},
    {682, GGroup::non_modal, kTcp, "tilted work plane"},
    {683, GGroup::non_modal, kTcp, "tilted work plane by tool axis"},
    {690, GGroup::non_modal, kLater, "end of coordinate rotation or tilted work plane"},
    {730, GGroup::motion, kExpanded, "chip-breaking drilling cycle"},
    {740, GGroup::motion, kExpanded, "left-hand tapping cycle"},
    {760, GGroup::motion, kExpanded, "threading cycle"},
    {800, GGroup::motion, kRead, "end of motion mode"},
    {810, GGroup::motion, kExpanded, "drilling cycle"},
    {820, GGroup::motion, kExpanded, "drilling cycle with dwell"},
    {830, GGroup::motion, kExpanded, "peck drilling cycle"},
    {840, GGroup::motion, kExpanded, "tapping cycle"},
    {850, GGroup::motion, kExpanded, "boring cycle"},
    {860, GGroup::motion, kExpanded, "boring cycle with spindle stop"},
    {870, GGroup::motion, kExpanded, "back boring cycle"},
    {880, GGroup::motion, kLater, "boring cycle with a retract by hand"},
    {890, GGroup::motion, kExpanded, "boring cycle with dwell"},
    {900, GGroup::distance, kRead, "absolute words"},
    {901, GGroup::arc_distance, kRead, "absolute arc centres"},
    {910, GGroup::distance, kRead, "incremental words"},
    {911, GGroup::arc_distance, kRead, "incremental arc centres"},
    {920, GGroup::non_modal, kRead, "shift of the zero"},
    {921, GGroup::non_modal, kRead, "end of shift"},
    {922, GGroup::non_modal, kRead, "end of shift, stored"},
    {923, GGroup::non_modal, kRead, "stored shift"},
    {930, GGroup::feed_mode, kRead, "inverse time feed"},
    {940, GGroup::feed_mode, kRead, "feed by the minute"},
    {950, GGroup::feed_mode, kExpanded, "feed by the turn"},
    {960, GGroup::spindle_mode, kLater, "constant surface speed"},
    {970, GGroup::spindle_mode, kRead, "spindle speed"},
    {980, GGroup::retract, kRead, "retract to the old height"},
    {990, GGroup::retract, kRead, "retract to the R height"},
    {1680, GGroup::non_modal, kTcp, "Okuma tool-centre-point control"},
    {1690, GGroup::non_modal, kTcp, "Okuma tool-centre-point control"},
    {1700, GGroup::non_modal, kTcp, "Okuma end of tool-centre-point control"},
    {2340, GGroup::non_modal, kTcp, "Haas tool-centre-point control"},
    {2540, GGroup::non_modal, kTcp, "Haas dynamic work offset"},
};

/// Where the Fanuc family (Fanuc, Haas, and controls that read their programs) differs.
constexpr Row kFanucRows[] = {
    {50, GGroup::no_effect, kRead, "high-speed mode"},
    {51, GGroup::no_effect, kRead, "contour control"},
    {52, GGroup::motion, kLater, "NURBS"},
    {53, GGroup::motion, kLater, "end of NURBS"},
    {70, GGroup::non_modal, kLater, "hypothetical axis interpolation"},
    {71, GGroup::non_modal, kLater, "cylindrical interpolation"},
    {80, GGroup::no_effect, kRead, "look-ahead control"},
    {90, GGroup::no_effect, kRead, "exact stop in the block"},
    {110, GGroup::no_effect, kRead, "end of data setting"},
    {131, GGroup::no_effect, kRead, "end of polar interpolation"},
    {150, GGroup::no_effect, kRead, "end of polar coordinates"},
    {160, GGroup::non_modal, kLater, "polar coordinates"},
    {310, GGroup::motion, kLater, "skip function"},
    {330, GGroup::motion, kSynchronised, "spindle-synchronised motion"},
    {331, GGroup::motion, kSynchronised, "rigid tapping"},
    {382, GGroup::motion, kLater, "probing"},
    {383, GGroup::motion, kLater, "probing"},
    {384, GGroup::motion, kLater, "probing"},
    {385, GGroup::motion, kLater, "probing"},
    {410, GGroup::radius_compensation, kLater, "cutter radius compensation"},
    {411, GGroup::radius_compensation, kLater, "cutter radius compensation"},
    {420, GGroup::radius_compensation, kLater, "cutter radius compensation"},
    {421, GGroup::radius_compensation, kLater, "cutter radius compensation"},
    {434, GGroup::length_offset, kRead, "tool-centre-point control with rotary positions"},
    {435, GGroup::length_offset, kRead, "tool-centre-point control with tool vectors"},
    {500, GGroup::no_effect, kRead, "end of scaling"},
    {501, GGroup::no_effect, kRead, "end of mirror image"},
    {510, GGroup::non_modal, kLater, "scaling"},
    {511, GGroup::non_modal, kLater, "mirror image"},
    {541, GGroup::work_system, kLater, "further work systems"},
    {600, GGroup::non_modal, kLater, "positioning from one side"},
    {620, GGroup::no_effect, kRead, "corner override"},
    {630, GGroup::no_effect, kRead, "tapping mode"},
    {650, GGroup::non_modal, kExpanded, "macro call"},
    {660, GGroup::non_modal, kLater, "modal macro call"},
    {670, GGroup::no_effect, kRead, "end of modal macro call"},
    {690, GGroup::no_effect, kRead, "end of rotation"},
    {760, GGroup::motion, kLater, "fine boring cycle"},
    {870, GGroup::motion, kLater, "back boring cycle"},
    {921, GGroup::non_modal, kLater, "preset of the work system"},
    {950, GGroup::feed_mode, kSynchronised, "feed by the turn"},
};

constexpr Row kHaasRows[] = {
    {1030, GGroup::no_effect, kRead, "limit of look-ahead"},
    {1870, GGroup::no_effect, kRead, "smoothness"},
    {2340, GGroup::length_offset, kRead, "tool-centre-point control"},
};

constexpr Row kSiemensRows[] = {
    {0, GGroup::motion, kRead, "rapid"},
    {10, GGroup::motion, kRead, "straight feed"},
    {20, GGroup::motion, kRead, "clockwise arc"},
    {30, GGroup::motion, kRead, "counter-clockwise arc"},
    {40, GGroup::non_modal, kRead, "dwell"},
    {90, GGroup::no_effect, kRead, "exact stop in the block"},
    {170, GGroup::plane, kRead, "XY plane"},
    {180, GGroup::plane, kRead, "ZX plane"},
    {190, GGroup::plane, kRead, "YZ plane"},
    {250, GGroup::non_modal, kLater, "lower limit"},
    {260, GGroup::non_modal, kLater, "upper limit"},
    {330, GGroup::motion, kLater, "thread"},
    {400, GGroup::radius_compensation, kRead, "end of cutter radius compensation"},
    {410, GGroup::radius_compensation, kLater, "cutter radius compensation"},
    {420, GGroup::radius_compensation, kLater, "cutter radius compensation"},
    {530, GGroup::non_modal, kRead, "machine coordinates"},
    {540, GGroup::work_system, kRead, "work system 1"},
    {550, GGroup::work_system, kRead, "work system 2"},
    {560, GGroup::work_system, kRead, "work system 3"},
    {570, GGroup::work_system, kRead, "work system 4"},
    {580, GGroup::non_modal, kRead, "shift of single axes"},
    {590, GGroup::non_modal, kRead, "further shift of single axes"},
    {600, GGroup::path_control, kRead, "exact stop"},
    {620, GGroup::no_effect, kRead, "corner override"},
    {630, GGroup::motion, kLater, "tapping"},
    {640, GGroup::path_control, kRead, "path blending"},
    {700, GGroup::units, kRead, "inch"},
    {710, GGroup::units, kRead, "millimetre"},
    {740, GGroup::non_modal, kLater, "reference point"},
    {750, GGroup::non_modal, kLater, "fixed point"},
    {900, GGroup::distance, kRead, "absolute words"},
    {910, GGroup::distance, kRead, "incremental words"},
    {930, GGroup::feed_mode, kRead, "inverse time feed"},
    {940, GGroup::feed_mode, kRead, "feed by the minute"},
    {950, GGroup::feed_mode, kLater, "feed by the turn"},
    {960, GGroup::spindle_mode, kLater, "constant surface speed"},
    {970, GGroup::spindle_mode, kRead, "spindle speed"},
    {1100, GGroup::non_modal, kRead, "pole from the present position"},
    {1110, GGroup::non_modal, kRead, "pole from the zero"},
    {1120, GGroup::non_modal, kRead, "pole from the last pole"},
    {1530, GGroup::non_modal, kRead, "machine coordinates"},
    {3310, GGroup::motion, kLater, "tapping"},
    {3320, GGroup::motion, kLater, "tapping"},
    {4500, GGroup::no_effect, kRead, "corner behaviour of compensation"},
    {4510, GGroup::no_effect, kRead, "corner behaviour of compensation"},
    {5000, GGroup::work_system, kRead, "no work offset"},
    {6010, GGroup::no_effect, kRead, "fine exact stop"},
    {6020, GGroup::no_effect, kRead, "coarse exact stop"},
    {6030, GGroup::no_effect, kRead, "exact stop by set point"},
    {6410, GGroup::path_control, kRead, "path blending"},
    {6420, GGroup::path_control, kRead, "path blending"},
    {6430, GGroup::path_control, kRead, "path blending"},
    {6440, GGroup::path_control, kRead, "path blending"},
    {6450, GGroup::path_control, kRead, "path blending"},
    {7000, GGroup::units, kRead, "inch, feed too"},
    {7100, GGroup::units, kRead, "millimetre, feed too"},
    {kPolynomial, GGroup::motion, kExpanded, "polynomial"},
    {kTangentArc, GGroup::motion, kRead, "tangential arc"},
    {kPointArc, GGroup::motion, kRead, "arc through a point"},
};

constexpr std::size_t kTableSize = 10000;
using Table = std::array<GCodeInfo, kTableSize>;

template <std::size_t N>
void put_rows(Table& table, const Row (&rows)[N]) {
  for (const Row& row : rows) {
    table[static_cast<std::size_t>(row.code)] = {row.status, row.group, row.name};
  }
}

Table make_table(InputDialect dialect) {
  Table table{};
  if (dialect == InputDialect::siemens) {
    put_rows(table, kSiemensRows);
    return table;
  }
  put_rows(table, kRows);
  if (dialect == InputDialect::linuxcnc) return table;
  put_rows(table, kFanucRows);
  if (dialect == InputDialect::haas) put_rows(table, kHaasRows);
  return table;
}

constexpr GCodeInfo kUnknown{};

}  // namespace

const GCodeInfo& g_code_info(GCode code, InputDialect dialect) {
  static const std::array<Table, 4> kTables = {
      make_table(InputDialect::linuxcnc), make_table(InputDialect::fanuc),
      make_table(InputDialect::haas), make_table(InputDialect::siemens)};
  if (code < 0 || static_cast<std::size_t>(code) >= kTableSize) return kUnknown;
  return kTables[static_cast<std::size_t>(dialect)][static_cast<std::size_t>(code)];
}

std::string g_code_text(GCode code) {
  if (code == kPointArc) return "CIP";
  if (code == kTangentArc) return "CT";
  if (code == kPolynomial) return "POLY";
  std::string text = "G" + std::to_string(code / 10);
  if (code % 10 != 0) text += "." + std::to_string(code % 10);
  return text;
}

int m_group(int m) {
  if (m == 0 || m == 1 || m == 2 || m == 30 || m == 60) return 4;
  if (m >= 62 && m <= 68) return 5;
  if (m == 6 || m == 61) return 6;
  if ((m >= 3 && m <= 5) || m == 19) return 7;
  if (m >= 7 && m <= 9) return 8;
  if (m >= 48 && m <= 53) return 9;
  if (m >= 70 && m <= 73) return 5;
  if (m >= 98 && m <= 99) return 11;
  if (m >= 100 && m <= 999) return 10;
  return -1;
}

int m_rank(int m) {
  constexpr int kOrder[] = {/*4*/ 7, /*5*/ 0, /*6*/ 1,  /*7*/ 2,
                            /*8*/ 3, /*9*/ 4, /*10*/ 5, /*11*/ 6};
  const int group = m_group(m);
  return group < 4 ? 5 : kOrder[group - 4];
}

const char* m_refusal(int m, InputDialect dialect, bool plain) {
  if (dialect == InputDialect::siemens) return nullptr;
  if (plain && is_flow_m(m, dialect)) {
    return "a machine program runs its blocks one after the other; write the blocks out";
  }
  if (dialect != InputDialect::linuxcnc) {
    const bool other = m == 96 || (m == 97 && dialect != InputDialect::haas) || m == 198;
    return other ? "a call of another memory or an interrupt is not read; write M98" : nullptr;
  }
  if (m == 61) return "setting the tool number without a change is read in a later version";
  return nullptr;
}

bool is_flow_m(int m, InputDialect dialect) {
  if (dialect == InputDialect::siemens) return false;
  if (m == 98 || m == 99) return true;
  if (m == 97) return dialect == InputDialect::haas;
  return m >= 70 && m <= 73 && dialect == InputDialect::linuxcnc;
}

}  // namespace smoothpost::nc
