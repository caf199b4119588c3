#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/ini/ini.h"
#include "kernels/core/result.h"
#include "machines/definition/machine.h"

// A machine as another program's file describes it, and the text of its machine.toml. What the
// source does not say stands there as an assumption with a comment, or as a commented key.
namespace smoothpost {

/// A number of the machine file. `note` empty: the source says it. Otherwise it is assumed, and the
/// note says from what.
struct ImportedNumber {
  double value = 0.0;
  std::string note;
};

struct ImportedAxis {
  std::string name;
  char letter = 'X';
  JointKind kind = JointKind::linear;
  ChainSide side = ChainSide::tool;
  Vec3 direction = Vec3::UnitX();  ///< any length above 0
  Vec3 origin = Vec3::Zero();      ///< mm in M
  std::string comment;             ///< above the axis
  std::string direction_note;      ///< not empty: the direction, or its sign, is assumed
  std::string origin_note;         ///< not empty: the origin is assumed
  ImportedNumber lower, upper;     ///< mm or rad
  std::optional<double> home;      ///< mm or rad; nothing: 0, or the middle where 0 is outside
  std::optional<double> velocity, acceleration, jerk;  ///< mm or rad, s
  bool cyclic = false;
  bool redundant = false;
};

struct ImportedMachine {
  std::string name;         ///< any text; the machine file's name is made of it
  std::string description;  ///< any text
  std::string source;       ///< the file's name without its folder
  std::vector<ImportedAxis> axes;
  Vec3 tip = Vec3::Zero();
  Vec3 tool_axis = Vec3::UnitZ();
  std::string tool_note;  ///< what of the tool is assumed
  std::optional<Pose> flange;
  std::string kind = "five_axis";
  std::string dialect = "linuxcnc";
  std::string units = "mm";
  std::vector<std::string> events;  ///< rows of [process.events] that the controller's language has
  std::vector<std::string> left_out;  ///< lines of comment: what the source has and this file lacks
};

/// The machine file as TOML text, every key with its unit and every assumption with its comment.
/// Limits that the source lacks are assumed: 30 deg/s or 100 mm/s, four times the velocity by
/// second, ten times the acceleration by second; such axes have source = "assumed". An axis whose
/// three limits the source has is "datasheet".
/// Guarantee: parse_machine_file() reads it, unless `axes` is empty, has more than kMaxJoints
/// entries, names or letters twice, or a range that is reversed (which the importers refuse).
/// Precision: 1e-9 in mm, deg and directions.
std::string machine_text(const ImportedMachine& machine);

/// Assumptions of an imported machine in one sentence for a warning; empty: none.
std::string assumptions(const ImportedMachine& machine);

/// What the user says beside the file: A=table, tip=LINK, order=A,C ...
using ImportWords = std::map<std::string, std::string>;

/// URDF with, optionally, a joint_limits.yaml. Words: base=LINK, tip=LINK.
/// The chain goes from `base` (the root) to `tip` (else tool0, else the only end with most joints).
/// M is the base link's frame; the tool axis is −Z of the tip's frame. MF2xx.
struct UrdfTexts {
  std::string_view urdf;
  std::string urdf_name;
  std::optional<std::string_view> limits;
  std::string limits_name;
};
Result<ImportedMachine> import_urdf(const UrdfTexts& texts, const ImportWords& said);

/// LinuxCNC's INI file, with the HAL files that it names. Read are the kinematics trivkins,
/// xyzac-trt-kins, xyzbc-trt-kins, 5axiskins and genserkins; others are refused by name. Words:
/// A=table, B=head ...: where the rotaries of trivkins are, base outwards. MF2xx.
Result<ImportedMachine> import_linuxcnc(std::string_view text, const std::string& file,
                                        const ini::Source& files, const ImportWords& said);

/// A machine of FreeCAD's CAM workbench. Words: order=A,C: which axes carry which, base outwards,
/// where the file names no parents. MF2xx.
Result<ImportedMachine> import_freecad(std::string_view text, const std::string& file,
                                       const ImportWords& said);

/// Errors that every import may have: no axis or too many, names or letters twice, a range that is
/// reversed or beyond what a machine file takes (1e6). MF203, MF204.
Diagnostics check_imported(const ImportedMachine& machine, const std::string& file);

}  // namespace smoothpost
