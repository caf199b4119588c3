#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "kernels/core/result.h"
#include "kernels/core/tool_path.h"
#include "postproc/pipeline/reference_path.h"

// What a tool path is made of: cuts, where the beam or the spindle works, and links between them.
namespace smoothpost {

/// Segments first..last of a tool path, where the process works without a link between.
struct Cut {
  std::uint32_t first = 0;
  std::uint32_t last = 0;
  int number = 0;             ///< from 1, in the order of the whole input
  bool after_rewind = false;  ///< the second half of a cut that was split to unwind an axis
  bool omitted = false;       ///< not asked for: --cuts
};

/// Numbers of the first and last cut to be written; both count from 1.
struct CutRange {
  int first = 1;
  int last = 1;
};

/// "7", "7-40", "7-" (to the end). Failure: US146.
Result<CutRange> parse_cut_range(const std::string& text);

struct LinkChoice {
  bool keep = false;             ///< --links keep: rapids stay as the input has them
  double micro_joint = 0.0;      ///< mm: a beam-off feed no longer than this belongs to its cut
  std::optional<CutRange> cuts;  ///< the others are left out
};

/// Finds the cuts of a path and marks every other segment as replanned (a link of ours), unless
/// choice.keep.
///
/// A segment belongs to a cut when the beam is on, or, in a path that never turns a beam on, when
/// it is a feed. A beam-off feed between two beam-on stretches, no longer than choice.micro_joint,
/// is a micro-joint and stays in its cut. Rapids that go nowhere stay where they are. Segments of
/// cuts outside choice.cuts become links too; of the events in and between left-out cuts only the
/// last of each kind of state (spindle, coolant, power, tool ...) remains, on or off. A short
/// beam-off feed with a dwell or another event than beam and power inside is a link. Cost: linear
/// in the points and events.
std::vector<Cut> find_cuts(ToolPath& path, const LinkChoice& choice);

/// What a cut consists of, lengths of the tip in mm. A cut is closed when its tip comes back to a
/// point where it was (within 0.01 mm); the longest way between two such points is the contour.
/// Behind it the tip retraces the contour's start (over-burn) or leaves it (lead-out). An open cut
/// is all contour.
struct CutPhases {
  bool closed = false;
  double lead_in = 0.0;
  double contour = 0.0;
  double over_burn = 0.0;
  double lead_out = 0.0;
  int micro_joints = 0;  ///< beam-off stretches inside
};

/// Cost: linear in the cut's points.
CutPhases phases_of(const ReferencePath& reference, const Cut& cut);

/// The group of states that an event sets, such as "spindle" for spindle_on; empty when it sets
/// none that outlives a link (beam_on, pierce, message ...).
std::string state_group(const std::string& event);
/// The event ends its group's state: spindle_off.
bool ends_state(const std::string& event);
/// Takes `event` into the states that are on: group -> event.
void note_state(const std::string& event, std::map<std::string, std::string>& states);
/// The states that are on when the path has reached `point` and its events have happened.
/// @pre events sorted by point
std::map<std::string, std::string> states_at(const std::vector<PathEvent>& events,
                                             std::size_t point);

}  // namespace smoothpost
