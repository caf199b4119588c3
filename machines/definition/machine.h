#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "kernels/core/body.h"
#include "kernels/core/joints.h"
#include "kernels/core/pose.h"
#include "kernels/core/process.h"
#include "kernels/kinematics/screw_chain.h"

// A machine as its definition file describes it, in mm, rad and s. Values are validated by
// machine_file.h and const from then on.
namespace smoothpost {

enum class LimitSource { datasheet, measured, assumed };

struct AxisDefinition {
  std::string name;
  char letter = 'X';  ///< the word that commands it in this machine's programs
  ChainJoint joint;   ///< kind, side, screw, position range, home, cyclic, redundant
  double velocity = 0.0;
  double acceleration = 0.0;
  double jerk = 0.0;
  LimitSource source = LimitSource::assumed;
};

/// What hangs on the flange, for a controller's own dynamics.
struct LoadData {
  double mass = 0.0;            ///< kg
  Vec3 centre = Vec3::Zero();   ///< of gravity, in the flange frame, mm
  Vec3 inertia = Vec3::Zero();  ///< about the centre, axes of the flange frame, kg·m²
};

struct ToolDefinition {
  Vec3 tip = Vec3::Zero();         ///< in the last link, mm; where a tool of length 0 has its tip
  Vec3 axis = Vec3::UnitZ();       ///< unit, from tip to holder
  Pose flange = Pose::Identity();  ///< X_MF with every joint 0, for controllers that state the tool
                                   ///< in the flange's frame
  double gap = 0.0;                ///< nominal distance tip to part while the beam is on, mm
  double land_radius = 0.0;
  double min_gap = 0.0;
  std::optional<LoadData> load;  ///< for controllers that state it; no default
};

struct WorkpieceDefinition {
  Pose frame = Pose::Identity();  ///< X_MW with every joint 0
  double thickness = 0.0;
};

/// A pair of bodies, by name ("part" is the part), whose least distance is stated for the pair.
struct PairClearance {
  std::string first;
  std::string second;
  double clearance = 0.0;  ///< mm
};

struct CollisionSettings {
  std::vector<std::pair<std::string, std::string>> allowed;  ///< pairs that are never checked
  std::vector<PairClearance> pairs;
};

struct CycleSettings {
  double time = 0.001;       ///< s, the controller's cycle
  double min_block = 0.004;  ///< s
  int look_ahead_blocks = 0;
};

enum class Following { none, additive, exclusive };
struct StandoffSettings {
  std::string axis;  ///< empty: none
  Following following = Following::exclusive;
  double reserve = 5.0;
};

enum class RapidMotion { linear, independent };
struct LinkSettings {
  double clearance = 0.0;    ///< mm along the tool axis
  std::string retract_axis;  ///< axis name
  double retract = 0.0;      ///< its position for a retract, mm; has_plane: height of the tip in M
  bool has_plane = false;    ///< no axis retracts alone: the tip goes up to a plane
  double rotation = 0.0;     ///< rad
  RapidMotion rapid = RapidMotion::linear;
  bool rewind_in_cut = false;  ///< a cut may be split where a rotary has to be unwound
  double over_burn = 2.0;      ///< mm that are cut twice where a cut was split
  double micro_joint = 3.0;    ///< mm, longest beam-off feed that belongs to its cut
};

/// Shares of the tip and axis tolerance; they sum to 1.
struct ToleranceBudget {
  double merge = 0.10;
  double smoothing = 0.40;
  double chord = 0.15;
  double rounding = 0.05;
  double controller = 0.30;
};

struct ToleranceSettings {
  double tip = 0.01;  ///< mm
  double axis = 0.0;  ///< rad
  double lead = 0.0;  ///< rad
  double tilt = 0.0;  ///< rad
  /// mm, that a tilted beam may shift the cut's edge on the far side of the sheet; nothing: what
  /// the tilt tolerance implies
  std::optional<double> exit_edge;
  double clearance = 0.0;  ///< mm, least distance of bodies that state none of their own
  double event = 0.5;      ///< mm along the path that an event on the fly may be off its place
  double limit_share =
      1.0;  ///< share of the velocity, acceleration and jerk limits that we plan with
  ToleranceBudget budget;
};

struct RecipeSettings {
  std::string kind = "five_axis";  ///< robot | laser | finishing | five_axis
  std::string smoothing = "none";
  std::string shape = "half";  ///< half (kappa, lambda below) | paper (Eq. (37)) | tuned
  double kappa = 0.5;
  double lambda = 0.5;
  std::optional<double> ramp_c1;  ///< of ramp; nothing: by the turning angle
  std::string dense = "curve";    ///< what becomes of dense points: curve | corners
  std::string task = "axis";      ///< axis (rotation about the tool is free) | pose
  std::string orientation = "programmed";
  std::string optimise = "none";
  std::string solver = "hybrid";
  std::string schedule = "jerk";  ///< jerk | constant | programmed
  int knot_every = 4;
  int alternations = 2;  ///< passes of the shape under its own schedule; 0: none
  /// mm along each cut, ascending, of the via points of orientation "via"; empty: found from the
  /// path
  std::vector<double> via;
  std::string spin_policy = "fixed";  ///< arms, task axis: fixed | tangent | optimised
  std::optional<double> spin;         ///< rad, arms: rotation about the tool axis; nothing: chosen
};

struct DialectSettings {
  std::string name = "linuxcnc";
  std::string mode = "joint";  ///< joint | tcp
  std::string units = "mm";    ///< mm | inch
  std::string extension = "ngc";
  int digits_length = 5;    ///< decimals of lengths, in `units`
  int digits_angle = 6;     ///< decimals of angles, in degrees
  double block_time = 0.0;  ///< s; 0: as is best for the control
  bool line_numbers = true;
  std::vector<std::string> start;
  std::vector<std::string> end;
  bool offset_guard = true;
  std::string path_mode = "exact";  ///< exact | blend | spline
  std::string curves =
      "lines";  ///< lines | arcs | cubic | quintic: what scheduled blocks of joints are
};

/// Tip speed (mm/s) to power (percent), monotone; empty when the machine has no beam power.
struct PowerTable {
  std::vector<double> speed;
  std::vector<double> percent;
  double min_percent = 0.0;
  double min_cut_speed = 0.0;
  bool by_program = true;  ///< false: the control derives the power from the tip's speed itself
  double error = 30.0;  ///< percent: largest distance of a commanded power from that of the speed

  /// Between the points linearly, beyond them the nearest.   @pre a table
  double at(double tip_speed) const;
};

struct MachineDefinition {
  std::string name;
  std::string description;
  std::vector<AxisDefinition> axes;
  ToolDefinition tool;
  WorkpieceDefinition workpiece;
  std::vector<Body> bodies;
  CollisionSettings collision;
  CycleSettings cycle;
  StandoffSettings standoff;
  LinkSettings links;
  ToleranceSettings tolerance;
  RecipeSettings recipe;
  DialectSettings dialect;
  ProcessTable process;
  PowerTable power;

  int size() const { return static_cast<int>(axes.size()); }
  /// Index of the axis with that word letter, or −1.
  int axis_by_letter(char letter) const;
  /// Index of the axis with that name, or −1.
  int axis_by_name(const std::string& axis_name) const;
  bool has_event(const std::string& event) const;
};

/// The machine's chain with a tool of `tool_length` mm: tip at tool.tip − tool_length · tool.axis.
/// X_MT(0) has the tip as origin and the identity as rotation.
ScrewChain chain_of(const MachineDefinition& machine, double tool_length = 0.0);

/// Position range, velocity, acceleration and jerk of every axis, in machine-file order; mm or rad
/// and s. limit_share is not applied. @pre size() ≤ kMaxJoints   @throws ContractViolation if not.
JointLimits limits_of(const MachineDefinition& machine);

/// Home position of every axis, in machine-file order; mm or rad.
/// @pre size() ≤ kMaxJoints   @throws ContractViolation if not.
JointVector home_of(const MachineDefinition& machine);

}  // namespace smoothpost
