#pragma once

#include <string_view>

// What is known of the firmwares of the grbl family (docs/controllers/grbl.md has the sources).
namespace smoothpost::grbl {

enum class FeedRule {
  inverse_time,  ///< G93: F is one over the minutes of the block
  linear_first,  ///< F is over X Y Z, without them over U V W, without them over A B C
  xyz_or_most    ///< F is over X Y Z, without them over the axis that moves most
};

struct Firmware {
  std::string_view dialect;
  FeedRule feed = FeedRule::inverse_time;
  std::string_view letters;         ///< of axes
  bool machine_words = true;        ///< knows G53 in a motion block
  bool several_words = true;        ///< takes several G words in a block, and N
  bool round_comments = true;       ///< ( ), else ;
  bool dwell_milliseconds = false;  ///< P of G4, else seconds
  bool rapid_needs_feed = false;    ///< G0 goes with the last F
  bool waits_for_events = false;    ///< M400 has to stand before every event, not only at stops
  bool ends_with_m30 = true;        ///< false: M30 would delete the file, or is unknown
  std::string_view stop = "M0";     ///< for the operator
};

/// Nothing known: nullptr.
const Firmware* firmware_of(std::string_view dialect);

}  // namespace smoothpost::grbl
