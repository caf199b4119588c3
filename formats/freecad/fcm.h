#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/core/result.h"

// Machine files of FreeCAD's CAM workbench (.fcm, JSON), as written.
namespace smoothpost::freecad {

struct Axis {
  std::string name;
  bool rotary = false;
  bool head = false;                   ///< role head_..., else table_...
  std::string parent;                  ///< name of the axis that carries it; empty: not told
  std::array<double, 3> origin{};      ///< in the file's unit
  std::array<double, 3> direction{};   ///< any length above 0
  std::optional<double> lower, upper;  ///< in the file's unit or deg
  std::optional<double> velocity;      ///< per minute, above 0
};

struct Machine {
  std::string name, manufacturer, description;
  bool inch = false;
  std::string postprocessor;
  std::vector<Axis> axes;  ///< linear before rotary, each sorted by name
};

inline constexpr std::size_t kMaxBytes = std::size_t{4} << 20;

/// Reads a .fcm file; `joint` as an object and as the older pair of lists. What describes posts and
/// output is left alone, except the postprocessor's name. MF201: not JSON, too large, not a machine
/// of FreeCAD; MF202: an unknown type, role or unit; MF203: a value that is missing or of the wrong
/// kind, named by its path. JSON values have no lines here: diagnostics name the path.
/// Cost: linear; the text is held once more as a tree.
Result<Machine> read_fcm(std::string_view text, const std::string& file);

}  // namespace smoothpost::freecad
