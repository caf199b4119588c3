#pragma once

#include <limits>
#include <string>

#include "kernels/core/diagnostic.h"
#include "postproc/pipeline/finish_path.h"

// What make_finish_path() has found on its way, as warnings and checks.
namespace smoothpost {

struct FinishFindings {
  std::size_t open = 0;     ///< contours
  std::size_t against = 0;  ///< contours whose triangles are wound the wrong way
  std::size_t inner = 0;    ///< contours left out by outer_only
  std::size_t parted = 0;   ///< places
  std::size_t folded = 0;   ///< triangles of the stock
  std::size_t first_folded = 0;
  DepthOfCut depth;
  double moved = 0.0;                                     ///< mm, by smoothing
  double turned = 0.0;                                    ///< rad, likewise
  double room = std::numeric_limits<double>::infinity();  ///< mm, least of the mill
};

/// Of the depth, that the mill may be in the part: what the mesh itself is off.
inline constexpr double kMillShare = 0.05;

Diagnostic finish_message(Severity severity, const char* code, std::string text,
                          const std::string& file);
/// With so many decimals at most.
std::string finish_number(double value, int digits = 3);

/// RG134 to RG137 and RG140 to RG142 for what was left out, parted and found of the mesh.
Diagnostics finish_warnings(const FinishSettings& settings, const std::vector<FinishLayer>& layers,
                            const FinishFindings& found, const std::string& file);
/// depth_of_cut, contour_deviation, axis_to_normal, mill_room.
Checks finish_checks(const FinishSettings& settings, const FinishFindings& found);

}  // namespace smoothpost
