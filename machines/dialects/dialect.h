#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/core/canonical_motion.h"
#include "kernels/core/joint_bend.h"
#include "kernels/core/joints.h"
#include "kernels/core/pose.h"
#include "kernels/core/result.h"
#include "machines/definition/machine.h"

// What a dialect prints and what it reads back: joints, and in its tool mode poses of the tip in W.
// A dialect knows words and controllers, not tool paths.
namespace smoothpost {

/// Bit j stands for the joint at index j of the machine file.
using JointMask = std::uint32_t;

enum class MoveRole : std::uint8_t {
  link,  ///< ours: start, relocation and end; not compared with the input
  path   ///< follows the input's tool path
};

/// What a controller keeps straight during a move.
enum class MoveInterpolation : std::uint8_t {
  joints,  ///< every joint is linear from one end to the other
  tool     ///< the tip is on a straight line, the tool turns as Dialect::tool_turn says
};

/// One motion of all joints to `to`.
struct MachineMove {
  JointVector to;
  JointMask joints = 0;  ///< joints that this move commands; the others stay where they are
  MoveInterpolation interpolation = MoveInterpolation::joints;
  Pose tool = Pose::Identity();  ///< X_WT at `to`, of the tip; set for interpolation tool
  bool rapid = false;
  MoveRole role = MoveRole::path;
  bool machine_coordinates = false;  ///< joint words that are valid whatever offsets are live (G53)
  std::uint32_t input_line = 0;
  std::uint32_t segment = 0;  ///< role path: segment of the ToolPath (1 = from point 0 to point 1)
  std::uint32_t from_segment = 0;  ///< role path: where the move starts; below segment when points
                                   ///< between were merged
  double from_share = 0.0;         ///< role path: share of from_segment, in [0, 1]
  double to_share = 1.0;           ///< role path: share of segment
  double blend = 0.0;              ///< mm: the control may round the corner at the end of this move
                                   ///< within this distance of it; 0: exact
  bool spline = false;  ///< interpolation tool: one of a chain of moves whose ends the control
                        ///< joins by a smooth curve of its own
  JointBend bend;       ///< interpolation joints: polynomials in the place of straight joints; only
                        ///< dialects with `polynomials` print them
  JointArc arc;  ///< interpolation joints: two linear joints along an arc; only dialects with
                 ///< `arcs` print them
  double duration = 0.0;      ///< s; 0 for a rapid
  std::int32_t stretch = -1;  ///< role path: number of the stretch of the feed schedule; −1: none
  double stretch_time = 0.0;  ///< s, of that stretch at the end of the move
  double tool_length = 0.0;   ///< mm, of the tool in the holder
};

/// What happens before move `before` (or at the end when before == moves.size()).
struct MachineAction {
  enum class Kind : std::uint8_t {
    event,
    dwell,
    comment,
    cut_label  ///< `text` names a cut: a label from where the program can be started again, then
               ///< every modal word that the moves behind it rely on
  } kind = Kind::event;
  std::size_t before = 0;
  ProcessEvent event;
  double seconds = 0.0;
  std::string text;
  std::uint32_t input_line = 0;
};

/// A program in joints: what is to be printed.
struct MachineProgram {
  std::vector<std::string> title;  ///< comment lines at the top
  Pose part = Pose::Identity();  ///< X_MW with every joint 0: what BASE or the work offset must be
  double tool_length = 0.0;      ///< mm, of the tool at the start, for dialects that state it
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
  MoveInterpolation interpolation = MoveInterpolation::joints;
  Pose tool = Pose::Identity();  ///< interpolation tool: X_WT at the end; `to` holds only the
                                 ///< joints that the block names (external axes)
  bool rapid = false;
  bool beam = false;          ///< beam on while it moves
  double blend = 0.0;         ///< mm, as MachineMove::blend
  bool spline = false;        ///< as MachineMove::spline
  JointBend bend;             ///< as MachineMove::bend
  JointArc arc;               ///< as MachineMove::arc
  Eigen::VectorXd deviation;  ///< a step in the place of a part of a bent move or an arc: no joint
                              ///< is further from the straight way than this; empty: 0
  double spread = 0.0;        ///< mm of it on the joints of an arc: radii differ (arc_spread())
  double duration = 0.0;      ///< s, from F; 0 for a rapid
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
  bool exact_path = false;    ///< the controller is told not to blend, or blends by a known bound
  std::uint32_t line_count = 0;
  std::uint32_t last_line = 0;
  std::optional<Pose> part;        ///< X_MW that the text itself sets or demands
  std::optional<Pose> tool_frame;  ///< X_FT that the text itself sets
};

/// How a controller turns the tool during a move with MoveInterpolation::tool.
enum class ToolTurn : std::uint8_t {
  none,          ///< the dialect has no such moves
  great_circle,  ///< the tool axis on the great circle; rotation about it is not commanded
  slerp          ///< close to one rotation about a fixed axis: within the square of its angle, by 8
};

/// One row of the table of output dialects (postproc/pipeline/registry).
struct Dialect {
  const char* name;
  const char* description;
  const char* interpolation;  ///< what the controller does between blocks, for the certificate
  ToolTurn tool_turn;
  bool joints_linear;  ///< joint moves are straight in the joints; false: only their ends are known
  /// Fails with PR1xx when an event has no words on this machine, all such events collected.
  Result<EmittedProgram> (*emit)(const MachineDefinition& machine, const MachineProgram& program);
  /// Reads program text as that controller would; errors NC1xx. `file_name` is for messages.
  Result<ReadBack> (*read_back)(const MachineDefinition& machine, std::string text,
                                const std::string& file_name);
  const char* guard;         ///< what the program's guard makes sure of, for the certificate
  bool polynomials = false;  ///< prints MachineMove::bend
  bool arcs = false;         ///< prints MachineMove::arc
};

}  // namespace smoothpost
