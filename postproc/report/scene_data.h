#pragma once

#include <string>

#include "postproc/report/program_motion.h"

namespace smoothpost {

/// How much of a program a page draws. Checks never see these numbers.
struct SceneSettings {
  std::size_t points = 12000;  ///< of the certified and of the original path, each
  std::size_t part_triangles = 20000;
  std::size_t body_triangles = 12000;  ///< of all bodies together
  std::size_t text_bytes = 650000;     ///< of the lines that picked points show, each side
};

/// What the 3D view draws, as one JSON object that may stand inside a <script> element ('<', '>'
/// and '&' are written \u003c ...). Empty object without a machine.
///
/// Keys (docs/report.md): `axes` [{name, unit, scale, kind, side, direction, origin, range}],
/// `home` and `tool_home` (4 by 4, columns first), `tool_axis`, `centre` and `size` of everything
/// in W, `points` (columns of the certified path, base64, little-endian: `time` float64, `joints`
/// int32 in units of `scale`, `output_line`, `input_line` uint32, `deviation` 3 float32 in mm,
/// `flags` uint8: 1 beam, 2 link, 4 end of its line, 8 the deviation means something),
/// `tool_lengths`
/// [[first point, mm]],
/// `original` (`xyz` float32 from `centre`, `line`, `starts` uint32), `part` and `bodies` (`xyz`
/// float32, `triangles` uint32), `marks` [{name, point, text}], `texts` {input, output}: [[line,
/// text]], `in_all` points before decimation, `tip_tolerance` in mm, `wrist` {joint, point}.
std::string scene_json(const PageInput& in, const ReferencePath* reference, const ScrewChain& chain,
                       const ProgramMotion& motion, const SceneSettings& settings);

}  // namespace smoothpost
