#pragma once

#include <optional>
#include <string>
#include <vector>

#include "kernels/core/mesh.h"
#include "kernels/core/result.h"
#include "machines/definition/machine.h"
#include "postproc/pipeline/finish_path.h"
#include "postproc/pipeline/options.h"

// `smoothpost finish`: its options and the stock's file.
namespace smoothpost {

/// What `smoothpost finish` was asked for.
struct FinishRequest {
  FinishSettings settings;
  bool leave_out = false;  ///< what the machine cannot reach, on the user's word
  double scale = 1.0;      ///< of the part's size
};

/// --pitch, --depth, --feed, --rpm, --from, --to, --lead-in, --normal-tolerance, --direction,
/// --mill, --steepest, --contours, --unreachable, --scale and --tool. The
/// machine's tolerances, mm and rad: smoothing the contours takes half of the tip's, ways between
/// path points a tenth of both. Failures: US166, naming the option, what it is and what is
/// expected.
Result<FinishRequest> read_finish_options(const Options& options, double tip_tolerance,
                                          double axis_tolerance);

/// The path of a part on a machine, and where the part stands.
struct PlacedFinish {
  FinishPath path;
  Pose placement = Pose::Identity();
  std::string placement_text;
  std::vector<std::string> assumes;
};

struct FinishOnMachine {
  const MachineDefinition& machine;
  std::optional<Pose> placement;  ///< nothing: find one (find_finish_place)
  std::string file_name;
  bool collisions = true;
};

/// The path, at the place asked for or the one found, with leave_out without what the machine
/// cannot reach there: single places of contours first (FinishReach), then whole cuts
/// (cuts_out_of_reach). Failures: those of make_finish_path, KN172, KN174 nothing is left.
/// Warnings: RG141, RG143 the cuts that are left out; a note RG144 of the place that was found.
Result<PlacedFinish> make_placed_finish(const TriangleMesh& part, const FinishRequest& request,
                                        const FinishOnMachine& on, const Progress& progress);

/// A mesh as a binary STL file, in mm.
std::string stl_bytes(const TriangleMesh& mesh);

}  // namespace smoothpost
