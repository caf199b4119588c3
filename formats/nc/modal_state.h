#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "formats/nc/codes.h"
#include "formats/nc/event_words.h"
#include "formats/nc/siemens_cycles.h"
#include "kernels/core/canonical_motion.h"

namespace smoothpost::nc {

/// Motion mode after a block whose motion was refused: its axis words are passed over without a
/// further message until the next G0, G1, G2, G3 or G80.
inline constexpr GCode kRefusedMotion = -2;

/// What a canned cycle keeps for the next hole, as programmed.
struct CycleMemory {
  std::optional<double> bottom;                             ///< word along the plane's normal
  std::optional<double> retract;                            ///< R
  std::optional<double> peck;                               ///< Q
  std::optional<double> dwell;                              ///< P, s
  std::optional<double> shift_first, shift_second, middle;  ///< G87
  double level = 0.0;        ///< height at the start of the series, program coordinates, mm
  bool incremental = false;  ///< G91 at the series' last block
};

/// What A2= B2= C2= of siemens are.
enum class AxisAngles : std::uint8_t { none, euler, roll_pitch_yaw };

/// Polar coordinates of siemens in the active plane, program coordinates, mm and degrees.
struct PolarState {
  double first = 0.0, second = 0.0;     ///< the pole
  bool set = false;                     ///< by the program; else it is the zero
  bool lost = false;                    ///< the frame or plane changed since
  std::optional<double> radius, angle;  ///< the last ones
};

/// The modal state of RS274NGC but for coordinates; the values are those at the start of a program.
struct ModalState {
  GCode motion = kNoCode;
  GCode base_motion = 0;  ///< the last of G0 to G3, which G80 goes back to in the Fanuc family
  CycleMemory cycle;
  std::optional<DrillingCall> drilling;       ///< siemens MCALL
  AxisAngles axis_angles = AxisAngles::none;  ///< siemens ORIEULER, ORIRPY
  PolarState polar;
  bool swivelled = false;  ///< siemens CYCLE800: the tool stands normal to the frame's XY plane
  GCode plane = 170;
  bool incremental = false;
  bool arc_absolute = false;
  bool inverse_time = false;
  bool per_turn = false;  ///< G95
  bool diameter = false;  ///< G7: X words are diameters
  bool tcp = false;
  GCode radius_compensation = 400;        ///< G40, G41 or G42
  bool vector_words = false;              ///< fanuc G43.5: I J K are the tool axis
  bool by_vector = false;                 ///< the tool axis was last given by a vector
  bool machine_vectors = false;           ///< siemens ORIMKS
  bool great_circle = false;              ///< siemens ORIVECT
  bool linear_axes = false;               ///< siemens ORIAXES
  bool tool_changed = false;              ///< an M6 came
  Vec3 axis = Vec3::Zero();               ///< world, from tip to spindle; zero: not given
  double unit = 1.0;                      ///< mm per unit of a linear word
  double feed_unit = 1.0;                 ///< mm per unit of a feed
  double linear_feed = 0.0;               ///< mm/s; G95: mm for each turn of the spindle
  double angular_feed = 0.0;              ///< rad/s, for moves of rotary words only; G95: as above
  ModalWords words;                       ///< S and the selected T
  int spindle_tool = 0;                   ///< tool of the last M6; 0: none yet
  std::string spindle_tool_name;          ///< siemens: its name, when it has one
  int length_tool = 0;                    ///< tool of the active G43; 0: none
  int spindle = 5;                        ///< the last of M3, M4, M5 (and M19)
  bool mist = false;                      ///< M7
  bool flood = false;                     ///< M8
  bool retract_to_old = false;            ///< G98: cycles end at the height of their start
  const EventRow* spindle_row = nullptr;  ///< event of the last M3, M4, M5 or M19 that has one
};

/// A place that G28 or G30 goes to, in machine coordinates.
struct HomePosition {
  AxisWords machine{};
  AxisMask known = 0;  ///< words that the program stored with G28.1 or G30.1
};

}  // namespace smoothpost::nc
