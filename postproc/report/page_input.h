#pragma once

#include <string_view>

#include "kernels/core/mesh.h"
#include "machines/definition/machine.h"
#include "postproc/pipeline/convert.h"
#include "postproc/report/report_json.h"

namespace smoothpost {

/// What a report page is made of. What is null or empty is left out of the page. Everything
/// outlives the call that gets it.
struct PageInput {
  const Conversion& conversion;  ///< with its timeline and path (ConvertInput::timed)
  const ReportContext& context;
  const MachineDefinition* machine = nullptr;
  Pose placement = Pose::Identity();        ///< as ConvertInput::placement
  const InterpretedInput* input = nullptr;  ///< what the program is to follow
  const TriangleMesh* part = nullptr;       ///< in W
  double tool_length = 0.0;                 ///< mm, where the input does not say it
  std::string_view input_text = {};         ///< lines that a picked point shows
  std::string_view program_text = {};
  std::string_view report = {};  ///< report_json() of the same conversion
};

}  // namespace smoothpost
