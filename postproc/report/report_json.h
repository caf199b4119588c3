#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "postproc/pipeline/convert.h"
#include "postproc/pipeline/interpret.h"

namespace smoothpost {

/// Where a part was placed by smoothpost, with its margins (1: middle, 0: border) before and after.
struct PlacementReport {
  struct Margin {
    std::string name;
    double value = 0.0;
    std::uint32_t input_line = 0;
  };
  bool found = false;       ///< false: work_offset is the best that was seen, and does not do
  std::string work_offset;  ///< G54=x,y,z,a,b,c
  std::vector<Margin> before, after;
  int evaluations = 0;
};

/// What the report says besides the conversion itself.
struct ReportContext {
  std::string version;
  std::string machine;
  std::string dialect;
  std::string input_file;
  std::string input_format;
  std::string input_dialect;
  std::size_t input_lines = 0;
  std::size_t cutter_locations = 0;
  std::string input_sha256;
  std::vector<InputFile> input_files;  ///< besides it: what `check` compares with, and subroutines
  std::string program_sha256;
  std::string machine_sha256;
  std::string stream_file;    ///< of --trajectory
  std::string stream_sha256;  ///< of its text
  bool timings = false;
  std::optional<PlacementReport> placement;  ///< place, --work-offset auto
};

/// The JSON report, schema 1 (docs/report.md). Numbers that are not finite become null; the same
/// conversion gives the same bytes, `stages` only when context.timings.
std::string report_json(const Conversion& conversion, const ReportContext& context);

/// The line map: one row [output line, input line, "path"|"link", segment, from, to] per motion.
std::string line_map_json(const LineMap& map, const std::string& input_file);

/// A table of the checks in which two reports differ: name, expected and actual value and verdict.
/// Values that differ by at most `relative` of the limit (or of the value, when the limit is 0)
/// count as equal. Empty when there is none; one line when a report cannot be read.
std::string changed_checks(const std::string& expected_report, const std::string& actual_report,
                           double relative);

/// Diagnostics as a JSON array, for --diagnostics json.
std::string diagnostics_json(const Diagnostics& diagnostics);

}  // namespace smoothpost
