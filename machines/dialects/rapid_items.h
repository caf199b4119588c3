#pragma once

#include <string>
#include <vector>

#include "machines/dialects/dialect.h"
#include "machines/dialects/rapid_text.h"

namespace smoothpost::rapid {

/// One thing that stands between two moves of a RAPID program.
struct Item {
  enum class Kind { comment, statement, wait, label, trigger } kind = Kind::comment;
  std::string text;  ///< label: what the cut is called
  Signal signal;     ///< trigger: set by the motion that follows
  double seconds = 0.0;
};

/// What stands in front of each move, and behind the last. An event on the fly becomes a trigger
/// when its text is a signal, a tool move follows, no statement stands behind it in the same place,
/// and there are less than eight; else a statement. Errors: PR201 and those of event_text().
/// Warning PR222: an event on the fly for which the robot stops; it stands behind a joint move.
/// Cost: linear.
std::vector<std::vector<Item>> items_of(const MachineDefinition& machine,
                                        const MachineProgram& program, Diagnostics& diagnostics);

/// Whether the robot has to stand for one of them: RAPID runs statements ahead of the motion.
bool has_stop(const std::vector<Item>& items);

}  // namespace smoothpost::rapid
