#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/core/canonical_motion.h"
#include "kernels/core/joints.h"
#include "kernels/core/result.h"
#include "machines/definition/machine.h"

// What a dialect prints and what it reads back. Both sides speak joints: a dialect knows words and
// controllers, not tool paths.
namespace smoothpost {

/// Bit j stands for the joint at index j of the machine file.
using JointMask = std::uint32_t;

enum class MoveRole : std::uint8_t {
  link,  ///< ours: start, relocation and end; not compared with the input
  path   ///< follows the input's tool path
};

/// One motion of all joints to `to`, linear in every joint.
struct MachineMove {
  JointVector to;
  JointMask joints = 0;  ///< joints that this move commands; the others stay where they are
  bool rapid = false;
  MoveRole role = MoveRole::path;
  bool machine_coordinates = false;  ///< print it independent of offsets (G53)
  std::uint32_t input_line = 0;
  std::uint32_t segment = 0;  ///< role path: segment of the ToolPath (1 = from point 0 to point 1)
  double from_share = 0.0;    ///< role path: the part of that segment, shares in [0, 1]
  double to_share = 1.0;
  double duration = 0.0;  ///< s; 0 for a rapid
};

/// What happens before move `before` (or at the end when before == moves.size()).
struct MachineAction {
  enum class Kind : std::uint8_t { event, dwell, comment } kind = Kind::event;
  std::size_t before = 0;
  ProcessEvent event;
  double seconds = 0.0;
  std::string text;
  std::uint32_t input_line = 0;
};

/// A program in joints: what is to be printed.
struct MachineProgram {
  std::vector<std::string> title;  ///< comment lines at the top
  std::vector<MachineMove> moves;
  std::vector<MachineAction> actions;  ///< sorted by before
  bool certified = true;               ///< false: print NOT CERTIFIED and an operator stop first
};

struct EmittedProgram {
  std::string text;
  std::vector<std::uint32_t> move_lines;  ///< 1-based output line of each move
  std::uint32_t line_count = 0;
};

/// A move as the controller will make it, read from program text.
struct ReadBackMove {
  JointVector to;
  JointMask known = 0;  ///< joints whose position the program has set by the end of this move
  bool rapid = false;
  bool beam = false;      ///< beam on while it moves
  double duration = 0.0;  ///< s, from F; 0 for a rapid
  std::uint32_t line = 0;
};

struct ReadBackEvent {
  std::size_t before = 0;
  std::string name;  ///< event, or "dwell"
  double seconds = 0.0;
  bool beam = false;  ///< beam on after the event
  std::uint32_t line = 0;
};

struct ReadBack {
  std::vector<ReadBackMove> moves;
  std::vector<ReadBackEvent> events;
  bool offset_guard = false;  ///< the text holds the guard of emit(), unchanged
  bool exact_path = false;    ///< the controller is told not to blend
  std::uint32_t line_count = 0;
  std::uint32_t last_line = 0;
};

/// One row of the table of output dialects (postproc/pipeline/registry).
struct Dialect {
  const char* name;
  const char* description;
  const char* interpolation;  ///< what the controller does between blocks, for the certificate
  /// Fails with PR1xx when an event has no words on this machine, all such events collected.
  Result<EmittedProgram> (*emit)(const MachineDefinition& machine, const MachineProgram& program);
  /// Reads program text as that controller would; errors NC1xx. `file_name` is for messages.
  Result<ReadBack> (*read_back)(const MachineDefinition& machine, std::string text,
                                const std::string& file_name);
};

}  // namespace smoothpost
