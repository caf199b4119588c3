#pragma once

#include <array>
#include <string>
#include <vector>

#include "kernels/core/pose.h"

// LinuxCNC's own interpreter as an independent judge of positions.
namespace smoothpost::test {

/// One motion that rs274 printed, brought to world coordinates without tool length: mm and degrees.
struct OracleMotion {
  bool rapid = false;
  bool arc = false;
  int turns = 0;                ///< as printed: the sign is the sense
  std::array<double, 6> end{};  ///< X Y Z A B C
  Vec3 centre = Vec3::Zero();   ///< of an arc; the coordinate along the normal is the end's
  double feed_mm_per_min = 0.0;
  double tool_z = 0.0;  ///< active tool length, mm
};

struct OracleRun {
  bool accepted = false;
  bool inch = false;     ///< G20 was active at some time: the four printed decimals are of an inch
  bool rotated = false;  ///< an XY rotation was active at some time
  std::string message;   ///< the last line of its complaint
  std::vector<OracleMotion> motions;
};

bool oracle_present();

/// Length of tool `n` in the oracle's tool table, mm (1 <= n <= 99).
double oracle_tool_length(int n);

/// Runs `rs274 -g` on the text in a folder of its own.
OracleRun run_oracle(const std::string& text);

}  // namespace smoothpost::test
