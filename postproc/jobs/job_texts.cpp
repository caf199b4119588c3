#include "postproc/jobs/job_texts.h"

#include <cmath>
#include <map>

#include "machines/dialects/decimal.h"
#include "postproc/jobs/job.h"

namespace smoothpost {

namespace {

/// With that many decimals; "no bound" when it is not finite.
std::string fixed_text(double value, int decimals) {
  if (!std::isfinite(value)) return "no bound";
  std::string text;
  append_decimal(text, value, decimals);
  return text;
}

void add_wrapped(std::string text, std::vector<std::string>& lines) {
  constexpr std::size_t kLongest = 118;
  while (text.size() > kLongest) {
    const std::size_t blank = text.rfind(' ', kLongest);
    if (blank == std::string::npos || blank == 0) break;
    lines.push_back(text.substr(0, blank));
    text.erase(0, blank + 1);
  }
  lines.push_back(std::move(text));
}

}  // namespace

std::vector<std::string> program_title(const ConvertInput& in, const std::string& input,
                                       const std::string& input_sha256) {
  std::vector<std::string> lines;
  lines.push_back(std::string("smoothpost ") + kVersion + " for machine " + in.machine.name);
  lines.push_back("input " + input + " sha256 " + input_sha256);
  const bool by_tool = in.machine.dialect.mode == "tcp";
  add_wrapped((by_tool ? "tool tip in the part. " : "machine joints. ") + in.placement_text, lines);
  std::map<int, double> tools;
  for (const auto& p : in.input.path.points)
    if (p.tool > 0) tools[p.tool] = p.tool_length;
  for (const auto& [tool, length] : tools)
    lines.push_back(
        "tool " + std::to_string(tool) + ": length " + fixed_text(length, 4) +
        (by_tool ? " mm, as the control has to have it" : " mm is in the joint values"));
  return lines;
}

std::string summary_text(const Conversion& conversion) {
  std::size_t failed = 0;
  const Check* tip = nullptr;
  const Check* axis = nullptr;
  const Check* lead = nullptr;
  const Check* tilt = nullptr;
  for (const auto& c : conversion.checks) {
    if (!c.ok) ++failed;
    if (c.name == "tip_deviation") tip = &c;
    if (c.name == "axis_deviation") axis = &c;
    if (c.name == "lead_deviation") lead = &c;
    if (c.name == "tilt_deviation") tilt = &c;
  }
  std::string text = to_string(conversion.verdict) + " (level " + conversion.level +
                     "): " + std::to_string(conversion.checks.size()) + " checks, " +
                     std::to_string(failed) + " failed";
  const auto share = [](const char* name, const Check* c, const char* unit) {
    return std::string(name) + " " + fixed_text(c->value, 5) + " of " + fixed_text(c->limit, 5) +
           unit;
  };
  if (tip && (axis || lead)) text += "; " + share("tip", tip, " mm");
  if (tip && axis) text += ", " + share("axis", axis, " deg");
  if (tip && lead) text += ", " + share("lead", lead, " deg");
  if (tip && lead && tilt) text += ", " + share("tilt", tilt, " deg");
  if (conversion.blocks > 0)
    text += "; " + std::to_string(conversion.blocks) + " blocks, " +
            fixed_text(conversion.scheduled_time, 1) + " s planned";
  if (conversion.stream)
    text += "; joint stream of " + fixed_text(conversion.stream->duration, 1) +
            (conversion.stream->ok() ? " s (level timed)" : " s failed");
  const auto& unsaid = conversion.not_checked;
  for (std::size_t i = 0; i < unsaid.size(); ++i)
    text += (i == 0 ? "; not checked: " : ", ") + unsaid[i];
  return text;
}

}  // namespace smoothpost
