#include "postproc/pipeline/plan_messages.h"

namespace smoothpost {

namespace {

Diagnostic at_line(const char* code, std::uint32_t line, std::string text,
                   const JointPlanSettings& settings) {
  Diagnostic d;
  d.code = code;
  d.text = std::move(text);
  d.where = {settings.file_name, static_cast<int>(line), 0};
  return d;
}

std::string named(std::string text, const JointPlanSettings& settings) {
  for (std::size_t j = settings.axis_names.size(); j-- > 0;) {
    const std::string joint = "joint " + std::to_string(j + 1);
    for (std::size_t at = 0; (at = text.find(joint, at)) != std::string::npos;)
      text.replace(at, joint.size(), "axis " + settings.axis_names[j]);
  }
  return text;
}

}  // namespace

Diagnostics tracking_failure(const BranchTracking& tracking, std::uint32_t line,
                             const JointPlanSettings& settings) {
  const std::string reason = named(tracking.reason, settings);
  switch (tracking.status) {
    case BranchTracking::Status::unreachable:
      return {at_line("KN101", line, "this place cannot be reached by the machine: " + reason,
                      settings)};
    case BranchTracking::Status::over_limit:
      return {at_line("KN102", line,
                      "no position of the machine within its limits: " + reason +
                          ". Place the part elsewhere with --work-offset or choose another machine",
                      settings)};
    default:
      break;
  }
  Diagnostics out;
  for (const auto& rewind : tracking.rewinds)
    out.push_back(
        at_line("KN103", rewind.line,
                "the cut cannot go on without a rewind here: " + named(rewind.reason, settings) +
                    ". Split the cut before this line, set links.rewind = \"in_cut\", or "
                    "choose a machine with more range",
                settings));
  if (out.empty()) out.push_back(at_line("KN103", line, "a rewind is needed: " + reason, settings));
  return out;
}

Diagnostic too_steep(std::uint32_t line, const JointPlanSettings& settings) {
  return at_line("KN104", line,
                 "the machine cannot follow this motion inside the tolerances: a rotary would have "
                 "to jump (the tool axis passes the machine's pole). Widen --axis-tolerance or "
                 "change the tool axis there",
                 settings);
}

Diagnostic plan_cancelled() {
  Diagnostic d;
  d.code = "US190";
  d.text = "cancelled";
  return d;
}

}  // namespace smoothpost
