#pragma once

#include <vector>

#include "machines/dialects/dialect.h"

// What one LIN is: a straight way of the tip with one turn about a fixed axis, and the events that
// its TRIGGERs set on the way.
namespace smoothpost::krl {

/// The pose at share t ∈ [0, 1] of a LIN.
Pose line_pose(const Pose& from, const Pose& to, double t);

/// Most TRIGGERs of one motion.
inline constexpr std::size_t kMostTriggers = 8;

/// Where a LIN starts.
struct LineStart {
  Pose pose = Pose::Identity();
  JointVector joints;
  std::size_t move = 0;      ///< the first move of the LIN
  std::size_t action = 0;    ///< the first action behind the start
  std::size_t triggers = 0;  ///< that stand at the start already
};

/// An event on the way.
struct LineEvent {
  std::size_t action = 0;
  double share = 0.0;  ///< of the LIN, where it happens
};

struct JoinedLine {
  std::size_t last = 0;  ///< the last move that the LIN makes
  std::vector<LineEvent> events;
};

/// The moves from start.move on that are one LIN: pieces of one straight way and one turn at one
/// speed, parted only by events on the fly with a latency (and comments). Such an event is put
/// early by time; as a TRIGGER with a DELAY it needs no point on the way. Blends at the inner ends
/// are dropped: there is no corner.
/// Guarantees (tests): a move without such an event behind it is a LIN of its own; the inner ends
/// lie on the LIN within 1e-6 mm and 1e-8 rad.   Cost: quadratic in the pieces of one LIN.
JoinedLine joined_line(const MachineDefinition& machine, const MachineProgram& program,
                       const LineStart& start);

}  // namespace smoothpost::krl
