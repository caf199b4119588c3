#pragma once

#include <optional>
#include <string>
#include <vector>

#include "kernels/core/progress.h"
#include "kernels/core/result.h"
#include "postproc/pipeline/timeline.h"
#include "postproc/pipeline/verify.h"

namespace smoothpost {

class Scene;

/// One row of a joint stream, as its text says.
struct StreamRow {
  double time = 0.0;  ///< s
  JointVector q;
  bool beam = false;  ///< during the cycle behind the row
};

/// What one axis does in a joint stream, by differences of its rows at the cycle; mm or deg.
struct StreamAxis {
  std::string name, unit;
  double velocity = 0.0, acceleration = 0.0, jerk = 0.0;  ///< largest
  double rounding_jerk = 0.0;  ///< what half a digit of each of four rows may be of it
};

/// A file of joint positions for a control that takes one row each cycle, with its own certificate.
struct JointStream {
  std::string text;
  std::size_t rows = 0;
  double cycle = 0.0, duration = 0.0;  ///< s
  Checks checks;                       ///< none is `planned`
  std::vector<StreamAxis> axes;
  std::vector<std::string> assumes, not_checked;

  bool ok() const;
};

struct StreamInput {
  const Timeline& timeline;
  const MachineDefinition& machine;
  const DeviationInput& deviation;  ///< as for the program that the timeline is of, whose map it
                                    ///< has; planned, turn, part and rounding are not read
  double tool_length = 0.0;         ///< mm, for the columns of the tip
  const Scene* scene = nullptr;     ///< what must not meet; null: clearance is not checked
};

/// Reads trajectory_csv() text. Failures IN111, with the line: another header, a row with too few,
/// too many or unreadable values, no row.
Result<std::vector<StreamRow>> read_joint_stream(const std::string& text,
                                                 const MachineDefinition& machine,
                                                 const std::string& file_name);

/// Reads a joint stream of a timeline back and certifies what was read, at level
/// `timed`: when the control moves every joint from row to row, one a cycle T, nothing of its
/// timing is left open. Checks, all of the printed rows q_k, at rest before the first and behind
/// the last:
///  - stream_rows, stream_cycle, round_trip.<axis>: as many rows as cycles, row k at k·T, each
///    within half a digit of the planned motion;
///  - velocity_limit.<axis>: |q_k − q_k−1|/T; acceleration_limit.<axis>: |q_k − 2 q_k−1 +
///    q_k−2|/T²; jerk_limit.<axis>: |q_k − 3 q_k−1 + 3 q_k−2 − q_k−3|/T³, each against the machine
///    file's limit and what half a digit d of every row may add to it: 2d/T, 4d/T², 8d/T³. A path
///    that keeps a limit has such a difference within it, because it is a mean of the derivative;
///  - position_limit.<axis> and the beam rules (verify_machine), deviations, path_complete and the
///    beam's places (verify_deviation), with straight joint motion from row to row, each row paired
///    with the place of the input that it is nearest to, in order; clearance.
///
/// A stream that fails a check is not to be written. Failures: IN111 as read_joint_stream; KN162 no
/// row, or more than kMostStreamRows. Guarantee (tests): a row that is changed, missing, doubled or
/// late fails a check. Units: mm, deg in checks. Memory: about 1 kB a row. Cost: about 10 µs a row.
Result<JointStream> check_stream(std::string text, const StreamInput& input,
                                 const Progress& progress);

/// check_stream() of trajectory_csv().
Result<JointStream> certified_stream(const StreamInput& input, const Progress& progress);

inline constexpr std::size_t kMostStreamRows = 1000000;

}  // namespace smoothpost
