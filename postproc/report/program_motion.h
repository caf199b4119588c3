#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "kernels/kinematics/screw_chain.h"
#include "postproc/pipeline/reference_path.h"
#include "postproc/report/page_input.h"

// The certified program as places in time, for drawing. Nothing here decides anything.
namespace smoothpost {

/// A place on the program: the end of a straight joint step, or a place inside one.
struct ProgramPoint {
  double time = 0.0;  ///< s, of the timeline where there is one, else of the printed block times
  JointVector joints;
  double tool_length = 0.0;  ///< mm
  std::uint32_t output_line = 0, input_line = 0;
  bool beam = false;
  bool link = false;      ///< between cuts, not compared with the input
  bool line_end = false;  ///< the last place of its line
  PathPlace place;        ///< of the input; segment 0: none
  Vec3 tip = Vec3::Zero();
  /// Output minus input at equal path parameter; nothing where nothing is compared.
  std::optional<Vec3> deviation;
  double axis_deviation = 0.0;  ///< rad, with `deviation`
};

/// A line of the output that stands for a part of the input's path.
struct ProgramBlock {
  PathPlace from, to;
  JointVector start, end;
  double time = 0.0;  ///< s, at its start
};

struct ProgramMotion {
  std::vector<ProgramPoint> points;
  std::vector<ProgramBlock> blocks;  ///< in path order
  double duration() const { return points.empty() ? 0.0 : points.back().time; }
};

/// Places of `conversion.read` from the first move on behind which all joints are known. Steps that
/// turn the tool by more than 2 degrees have places inside, and up to `kMiddles` moves their
/// middle. `reference` is that of conversion.path, or null. Cost: linear in the moves; about 250
/// bytes a place.
ProgramMotion program_motion(const PageInput& in, const ReferencePath* reference,
                             const ScrewChain& chain);

}  // namespace smoothpost
