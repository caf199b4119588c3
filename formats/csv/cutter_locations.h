#pragma once

#include <string>
#include <string_view>

#include "kernels/core/result.h"
#include "kernels/core/tool_path.h"

namespace smoothpost {

/// Reads a CSV file of cutter locations (docs/formats_csv.md) into a tool path in W.
///
/// The first line that is neither empty nor a comment is the header; columns in any order:
/// `x_mm,y_mm,z_mm` and one of `i,j,k` (tool axis from tip to holder, normalised), `qw,qx,qy,qz`
/// (rotation of the tool frame, normalised, axis = R·z) or `rz_deg,ry_deg,rx_deg` (R = Rz·Ry·Rx,
/// axis = R·z); `feed_mm_per_min`; optional `beam` (0 or 1) and `line`. `#` starts a comment. LF
/// and CRLF.
///
/// A row's feed and beam belong to the segment that ends at the row; those of the first row have no
/// segment. Interpolation is great_circle with i,j,k; slerp with whole rotations, and the path is
/// full_pose.
///   feed > 0: MotionKind::feed, duration = tip distance / feed; a segment that only turns has
///     duration 0 and is to be stretched to the axis limits by whoever plans its time;
///   feed 0 or empty: MotionKind::rapid, duration 0; refused while the beam is on.
/// With a beam column events beam_on and beam_off stand where the state changes, the beam being off
/// before the first segment and after the last; without one there are no events and every `beam` is
/// false. PathPoint::line is the value of the `line` column, else the line of the file.
///
/// Guarantees: any bytes end in a value or in located diagnostics; at most 100 errors.
/// Units: tip mm, axis unit vector, duration s.   Cost: linear, one pass.
/// @param text  the file   @param file_name  for messages only
/// @return errors CSV101..CSV114, warning CSV115, note CSV116
Result<ToolPath> read_cutter_locations(std::string_view text, const std::string& file_name);

}  // namespace smoothpost
