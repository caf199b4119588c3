#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/core/canonical_motion.h"
#include "kernels/core/process.h"
#include "kernels/core/result.h"

namespace smoothpost::cl {

/// What MSYS, CSYS and $$*CATIA0 (the frame that coordinates are given in) do.
enum class FrameRule : std::uint8_t {
  one,       ///< coordinates are taken as written; a second, different frame is refused
  reported,  ///< coordinates are taken as written, whatever the frames say
  applied    ///< coordinates are moved into the frame that the matrices are given in
};

/// The sense of CIRCLE in the NX form about its axis.
enum class NxCircleSense : std::uint8_t {
  by_tangents,  ///< as the straight motions at the arcs' ends say; without them clockwise
  clockwise,    ///< left-hand about the axis, as the manual of NX says
  counter_clockwise
};

struct ReaderSettings {
  std::optional<double> unit;  ///< mm of one unit of length before the first UNITS
  std::optional<double> feed;  ///< mm/s of feed motions before the first FEDRAT
  FrameRule frames = FrameRule::one;
  NxCircleSense nx_circles = NxCircleSense::by_tangents;
  ProcessTable process;  ///< rows that are CL statements, and what becomes of unknown words
};

struct ReadingSummary {
  bool ended = false;  ///< END or FINI
  std::uint32_t lines = 0;
  std::vector<std::string> tools;    ///< numbers or names that were changed to, in order
  std::vector<std::string> assumes;  ///< what the reading took for granted, for the certificate
};

/// Reads CL data (APT, ISO 4343, NX CLSF) and calls `sink` for every motion, dwell, event and
/// comment in the order of the program (docs/formats_cl.md).
///
/// Every motion has CanonicalMotion::tcp and axis_vector: X Y Z are the tool tip in W, mm; the tool
/// axis goes from tip to holder and moves on the great circle, also on arcs. The tool axis is
/// (0, 0, 1) until the text gives another. The way to the first position is unknown; GOTO or FROM
/// makes it known by a rapid. Tool lengths and work offsets are never called: CL data speak of the
/// tip.
///
/// Errors are collected; with one the result has no value and what `sink` got is not a program.
/// Any bytes end in a value or in located diagnostics. Cost: linear; memory that of the longest
/// statement and of at most 100 messages of each severity.
/// @param text  the file   @param file_name  for messages only
/// @return codes CL100 to CL168, PR101
Result<ReadingSummary> read(std::string_view text, const std::string& file_name,
                            const ReaderSettings& settings, CanonicalSink& sink);

}  // namespace smoothpost::cl
