#pragma once

#include <string>
#include <vector>

namespace smoothpost {

/// How one process event is written on a controller: a row of [process.events] in a machine file.
/// `text` is NC words with named values in braces, such as "M3 S{rpm}".
struct EventWords {
  std::string event;
  std::string text;
  bool on_the_fly = false;
  double dwell = 0.0;    ///< s after the words
  double latency = 0.0;  ///< s from the words to their effect
};

enum class UnmappedWords { refuse, comment };

/// The event table of one machine, in file order.
struct ProcessTable {
  std::vector<EventWords> events;
  UnmappedWords unmapped = UnmappedWords::refuse;
};

/// Events that every part of the program knows by name. A machine file may add others, which are
/// mapped by their name only.
namespace event_name {
inline constexpr const char* kBeamOn = "beam_on";
inline constexpr const char* kBeamOff = "beam_off";
inline constexpr const char* kPierce = "pierce";
inline constexpr const char* kPower = "power";
inline constexpr const char* kSpindleOn = "spindle_on";
inline constexpr const char* kSpindleOnReverse = "spindle_on_reverse";
inline constexpr const char* kSpindleOff = "spindle_off";
inline constexpr const char* kToolChange = "tool_change";
inline constexpr const char* kStop = "stop";
inline constexpr const char* kOptionalStop = "optional_stop";
inline constexpr const char* kMessage = "message";
}  // namespace event_name

}  // namespace smoothpost
