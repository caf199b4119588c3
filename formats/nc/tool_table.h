#pragma once

#include <map>
#include <optional>

namespace smoothpost::nc {

/// What a program or the user said of one tool. mm, degrees.
struct ToolData {
  std::optional<double> length;  ///< along the tool axis
  std::optional<double> radius;
  std::optional<double> front_angle;
  std::optional<double> back_angle;
  std::optional<int> orientation;
};

/// The tools of one run: those of InterpreterSettings, changed by G10 L1, L10, L11.
using ToolTable = std::map<int, ToolData>;

}  // namespace smoothpost::nc
