#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "kernels/core/progress.h"
#include "machines/dialects/dialect.h"
#include "postproc/pipeline/cutting_frame.h"
#include "postproc/pipeline/reference_path.h"

namespace smoothpost {

/// A beam that may lean: lead and tilt against the programmed ones count in place of the axis.
struct FreedBeam {
  std::vector<CuttingFrames> frames;  ///< of the cuts, in path order
  double lead = 0.0;                  ///< rad, tolerance, at least axis_tolerance
  double tilt = 0.0;
  /// mm that the edge on the far side of a sheet of `thickness` mm may be off; nothing: what `tilt`
  /// implies
  std::optional<double> exit_edge;
  double thickness = 0.0;
};

struct PathMatchSettings {
  double tip_tolerance = 0.0;   ///< mm
  double axis_tolerance = 0.0;  ///< rad
  /// As DeviationInput::whole_rotation; given: axis_tolerance is for whole rotations.
  std::optional<Mat3> whole_rotation = {};
  bool beam = false;  ///< cuts have the beam on: feeds without it are links too
  std::optional<FreedBeam> freed = {};
  /// What the process does, as equal or different numbers: during each move of the program, and on
  /// the segment that ends at each point of the input, then behind its end. Both empty: not
  /// compared.
  std::vector<std::uint32_t> program_process = {};
  std::vector<std::uint32_t> input_process = {};
  /// Of each of these numbers: what each of its parts (spindle, coolant, beam ...) does. Where the
  /// process may change off its place, every part may be as it is on either side. Empty: a number
  /// is one part.
  std::vector<std::vector<std::uint32_t>> process_parts = {};
  double event_tolerance = 0.0;  ///< mm along the input, where the process may change off its place
};

/// Whether a program follows an input, without a line map.
struct PathMatch {
  bool matched = false;
  /// Of the best monotone matching, an upper bound of max(tip distance / tip tolerance, axis angle
  /// / axis tolerance) over the whole path; with a freed beam lead, tilt and exit edge, each over
  /// its tolerance, stand for the axis in cuts. 0 when nothing matched.
  double share = 0.0;
  std::uint32_t input_line = 0;  ///< of the worst pair; when not matched: how far the matching came
  std::uint32_t output_line = 0;
  std::string reason;  ///< when not matched
};

/// Searches a monotone matching of the whole input to the program within the tolerances: the
/// Fréchet decision, by dynamic programming over samples of both.
///
/// Both are sampled in steps of at most a quarter of the tolerances (distance max(tip / tip
/// tolerance, axis / axis tolerance)); v(i, j) = max(d(i, j), min(v(i−1, j), v(i−1, j−1), v(i,
/// j−1))) is kept for the pairs with d ≤ 1 − allowance, a band whose width does not grow with the
/// program. A coupling of samples bounds the distance of the polylines through them; the allowance
/// covers what the curves leave the polylines (h²/8 times the bound of the second derivative). Lead
/// and tilt are those of the program's axis in the input's cutting frame; what an angle in a plane
/// changes more than the axis does, and what the frame's turning from one sample to the next may
/// add (δ²/8 of the combined deviation), is added to them; normals are taken at the samples. The
/// program may have rapids (with settings.beam also feeds without beam) that the input does not
/// have: before it, after it, and where the input's own way is replanned. Feeds of the input are
/// matched by feeds only, and with the process as it is there; around its changes and the ends of
/// cuts, within event_tolerance, each part of it may be as on either side of the change. A feed
/// move that matches nothing (also one before the program has stated every axis), a dropped or a
/// doubled block end the matching. `chain` is the program's machine with tool length 0 and the part
/// placed. @pre process numbers for every move and point and the end, or none. Cost: linear in the
/// path length over the tolerance; memory: the band and the samples of one segment run.
PathMatch match_paths(const ReadBack& program, const ScrewChain& chain, const ReferencePath& input,
                      const PathMatchSettings& settings, const Progress& progress);

}  // namespace smoothpost
