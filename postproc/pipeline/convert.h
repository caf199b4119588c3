#pragma once

#include <optional>
#include <string>
#include <vector>

#include "kernels/core/mesh.h"
#include "kernels/core/progress.h"
#include "postproc/pipeline/cuts.h"
#include "postproc/pipeline/executed_time.h"
#include "postproc/pipeline/feed_schedule.h"
#include "postproc/pipeline/interpret.h"
#include "postproc/pipeline/joint_stream.h"
#include "postproc/pipeline/laser_plan.h"
#include "postproc/pipeline/line_map.h"
#include "postproc/pipeline/smoothed_path.h"
#include "postproc/pipeline/timeline.h"
#include "postproc/pipeline/verify.h"

namespace smoothpost {

struct FinishPath;

/// Everything one conversion needs, already read and validated.
struct ConvertInput {
  InterpretedInput input;
  MachineDefinition machine;
  Pose placement =
      Pose::Identity();        ///< X_WM'W: the program's zero in the machine's workpiece frame
  std::string placement_text;  ///< for the certificate
  std::optional<TriangleMesh> part;  ///< in the program's coordinates
  std::string part_name;
  std::string input_name;
  std::vector<std::string> title;  ///< comment lines at the top of the program
  bool keep_links = false;         ///< --links keep: rapids stay as the input has them
  std::optional<CutRange> cuts;    ///< --cuts: the others are left out
  bool timed = false;              ///< make Conversion::timeline
  bool stream = false;             ///< make Conversion::stream; needs `timed`
  bool collision_check = true;     ///< false: --no-collision-check
  /// `input` is this path of make_finish_path(), whose joints plan_finish() plans; outlives the
  /// call
  const FinishPath* finish = nullptr;
};

enum class Verdict { certified, limits_only, refused, forced };
std::string to_string(Verdict verdict);

/// A cut of the input.
struct CutSummary {
  std::string label;                  ///< as its label in the program says: "CUT 7"
  std::uint32_t first = 0, last = 0;  ///< segments of the input
  std::uint32_t first_line = 0;
  std::uint32_t last_line = 0;
  double length = 0.0;  ///< mm, of the tip
  CutPhases phases;
};

struct StageTime {
  std::string name;
  double seconds = 0.0;
};

/// A conversion with its certificate. `program` is empty when nothing could be made of the input.
struct Conversion {
  Verdict verdict = Verdict::refused;
  std::string program;
  LineMap line_map;
  ReadBack read;
  Checks checks;
  std::vector<AxisSummary> axes;
  Diagnostics diagnostics;
  std::vector<std::string> assumes;
  std::vector<std::string> not_checked;
  std::string level = "geometry";
  std::string interpolation;
  std::string reference;
  ToleranceBudget budget_mm;  ///< mm, not shares
  double programmed_time = 0.0;
  double scheduled_time = 0.0;
  ExecutedTime executed;
  double length = 0.0;  ///< mm, of the tip
  std::vector<CutSummary> cuts;
  std::vector<SmoothedCorner> corners;
  std::vector<LaserStretch> stretches;  ///< of optimise = "jerk", in path order
  FeedSchedule schedule;
  Timeline timeline;                  ///< empty unless ConvertInput::timed
  std::optional<JointStream> stream;  ///< of ConvertInput::stream; its checks are its own
  ToolPath path;  ///< the input's, split where cuts were, as the line map counts its segments;
                  ///< empty unless ConvertInput::timed
  std::uint32_t merged_points = 0;
  std::uint32_t fitted_points = 0;  ///< that curves took the place of
  std::size_t links = 0;
  std::size_t blocks = 0;
  std::vector<StageTime> stages;

  bool checks_ok() const;
};

/// read -> registration -> kinematics -> emission -> read back -> certificate.
/// The program is made when it can be made, also when a check fails (the verdict says so); the
/// caller writes it only when it is certified or forced.
/// What collides is moved out of the way where the machine may: a standoff axis of the programmed
/// joints by base_retreat() (KN157), the stretches of an optimised laser by keep_clear() (KN158;
/// KN159 where that is not possible, and the program is refused).
Conversion convert(const ConvertInput& in, bool force, const Progress& progress);

struct CheckInput {
  std::string text;
  std::string file_name;
  MachineDefinition machine;
  Pose placement = Pose::Identity();
  std::optional<TriangleMesh> part;
  std::string part_name;
  double tool_length = 0.0;                 ///< mm, for programs that leave it to the control
  std::optional<InterpretedInput> against;  ///< the input that the program is to follow
  bool collision_check = true;              ///< false: --no-collision-check
};

/// Certifies an existing machine program against its machine: verdict limits_only; with `against`
/// also its shape, by a monotone matching (path_match.h): verdict certified. Else refused.
Conversion check_program(const CheckInput& in, const Progress& progress);

}  // namespace smoothpost
