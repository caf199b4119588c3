#pragma once

#include <string>
#include <vector>

#include "kernels/core/check.h"
#include "kernels/core/progress.h"
#include "machines/dialects/dialect.h"
#include "postproc/pipeline/controller_blending.h"
#include "postproc/pipeline/input_motion.h"
#include "postproc/pipeline/line_map.h"
#include "postproc/pipeline/links.h"
#include "postproc/pipeline/orientation_check.h"
#include "postproc/pipeline/reference_path.h"

namespace smoothpost {

/// What an axis does in the output, in the units of people (mm or deg, and their derivatives by s).
struct AxisSummary {
  std::string name;
  std::string unit;
  double position_low = 0.0;
  double position_high = 0.0;
  double peak_velocity = 0.0;
  /// Of the plan, where there is one that knows them.
  std::optional<double> peak_acceleration = {}, peak_jerk = {}, rms_jerk = {};
  /// What half a unit of the last printed digit may be in jerk at the shortest block: 8·(half
  /// unit)/time³.
  std::optional<double> rounding_jerk = {};
  /// What the input asks for when it is run as it is.
  std::optional<InputMotion> input = {};
  double limit_velocity = 0.0;
  double limit_acceleration = 0.0;
  double limit_jerk = 0.0;
  std::string source;
};

struct Verification {
  Checks checks;
  std::vector<AxisSummary> axes;
  double scheduled_time =
      0.0;  ///< s, of the output: feeds as printed, rapids at the velocity limits
};

/// The output's text, read back, against the machine alone: position limits at every move, planned
/// velocity, beam rules, and that the program protects itself against live offsets.
Verification verify_machine(const ReadBack& read, const MachineDefinition& machine);

/// What a deviation check compares with.
struct DeviationInput {
  const ReferencePath& reference;
  const LineMap& map;
  const MachineProgram& planned;
  const ScrewChain& chain;           ///< output machine, tool length 0, part placed
  ToolTurn turn = ToolTurn::none;    ///< of the dialect
  std::optional<PartBox> part = {};  ///< where low links are proven to pass it
  /// For each move of the text: how far the control itself rounds it (controller_blending).
  std::vector<BlendAllowance> rounding = {};
  /// R_chain,input = R_W,chain^T · R_W,input, constant (input_tool_rotation()); given: rotations
  /// are compared whole (task = "pose").
  std::optional<Mat3> whole_rotation = {};
  /// Given: what a beam's orientation is judged by (OrientationCheck).
  std::optional<OrientationInput> orientation = {};
};

/// The output's text, read back, against the input: tip and tool axis everywhere along every block
/// at equal path parameter, the beam, the completeness and order of the map, and the printed
/// against the planned joints.
///
/// On a block with K steps of size h = 1/K in τ ∈ [0, 1] the deviation d(τ) = output − input
/// satisfies
///   |d(τ)| ≤ max(|d_k|, |d_k+1|) + h²/8 · (sup|output''| + sup|input''|),
/// where the suprema are proven bounds (second_derivative_bound), so the value printed bounds the
/// deviation between samples too. The axis deviation is the angle of the chord |a_out − a_in|.
Checks verify_deviation(const ReadBack& read, const MachineDefinition& machine,
                        const DeviationInput& input, const Progress& progress);

/// Tips and axes of the output while the beam is on, at block ends and middles, in W.
std::vector<CutterLocation> beam_locations(const ReadBack& read, const ScrewChain& chain);

}  // namespace smoothpost
