#include "postproc/jobs/report_files.h"

#include <filesystem>
#include <system_error>

#include "postproc/jobs/files.h"
#include "postproc/jobs/settings.h"

namespace smoothpost {

ReportPage page_of(const Conversion& conversion, const ReportContext& context,
                   const MachineDefinition* machine, const PageParts& parts,
                   std::string_view report) {
  PageInput in{conversion, context};
  in.machine = machine;
  in.placement = parts.placement;
  in.input = parts.input;
  in.part = parts.part;
  in.tool_length = parts.tool_length;
  in.input_text = parts.input_text;
  in.program_text =
      parts.program_text.empty() ? std::string_view(conversion.program) : parts.program_text;
  in.report = report;
  return report_page(in);
}

Diagnostics write_plots(const std::string& folder, const std::vector<NamedPlot>& plots,
                        std::vector<FileHash>& written) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    return {usage_error("US131", "folder " + folder + " cannot be made: " + error.message())};
  Diagnostics problems;
  for (const NamedPlot& plot : plots) {
    const auto path = std::filesystem::path(folder) / (plot.name + ".svg");
    auto failed = write_file(path.string(), plot.svg);
    if (failed.empty()) written.push_back({path.string(), sha256(plot.svg)});
    for (auto& d : failed) problems.push_back(std::move(d));
  }
  return problems;
}

}  // namespace smoothpost
