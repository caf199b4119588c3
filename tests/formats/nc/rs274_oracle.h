#pragma once

#include <array>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "formats/nc/interpreter.h"
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
  /// What the end may be off, mm: behind a probing motion rs274 takes the machine to stand 0.254 mm
  /// before that motion's end.
  double slack = 0.0;
};

struct OracleRun {
  bool accepted = false;
  bool inch = false;     ///< G20 was active at some time: the four printed decimals are of an inch
  bool rotated = false;  ///< an XY rotation was active at some time
  double digit = 1e-4;   ///< the last printed decimal
  std::string message;   ///< the last line of its complaint
  std::vector<OracleMotion> motions;
  std::vector<std::string> messages;  ///< of DEBUG and PRINT comments, in order
};

bool oracle_present();

/// Length of tool `n` in the oracle's tool table, mm (1 <= n <= 99).
double oracle_tool_length(int n);

/// Reads the lines that `rs274 -g` prints into `run`.
void read_canonical(std::istream& text, OracleRun& run);

/// Runs `rs274 -g` on the text in a folder of its own.
OracleRun run_oracle(const std::string& text);

/// The same interpreter by its Python module, with nine decimals and every tool of length 0, on the
/// text of the last run_oracle(). Nothing when the module is not installed.
std::optional<OracleRun> run_fine_oracle();

/// How the oracle's machine is described to our interpreter.
nc::InterpreterSettings oracle_settings();

struct Comparison {
  std::string problem;  ///< empty: the motions are the same
  std::size_t motions = 0;
  std::size_t arcs = 0;
  std::size_t times = 0;
  double worst = 0.0;
};

/// Ends, kinds, arcs and durations of our motions against those of the oracle, as far as its
/// printed decimals go. Its motions on the spot are passed over.
Comparison compare(const std::vector<CanonicalMotion>& ours, const OracleRun& oracle);

}  // namespace smoothpost::test
