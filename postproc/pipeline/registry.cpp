#include "postproc/pipeline/registry.h"

#include <algorithm>
#include <array>
#include <string>

namespace smoothpost {

namespace {

constexpr std::array<InputFormat, 4> kFormats = {{
    {"cl", "CL data: APT, NX CLSF (docs/formats_cl.md)", "apt aptsource as cl cld clf cls clsf ncl",
     false, &interpret_cl},
    {"csv", "cutter locations, one a line (docs/formats_csv.md)", "csv", false, &interpret_csv},
    {"heidenhain", "conversational program of Heidenhain controls (docs/formats_heidenhain.md)",
     "h", true, &interpret_heidenhain},
    {"nc", "NC program, RS274NGC as LinuxCNC reads it (docs/formats_nc.md)",
     "ngc nc tap cnc gcode eia mpf spf txt", true, &interpret_nc},
}};

}  // namespace

std::span<const InputFormat> input_formats() { return kFormats; }

const InputFormat* find_input_format(std::string_view name) {
  for (const auto& row : kFormats)
    if (row.name == name) return &row;
  return nullptr;
}

const InputFormat* format_by_extension(std::string_view file_name) {
  const auto dot = file_name.rfind('.');
  if (dot == std::string_view::npos) return nullptr;
  std::string extension(file_name.substr(dot + 1));
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return c >= 'A' && c <= 'Z' ? c + 32 : c; });
  for (const auto& row : kFormats) {
    const std::string list = " " + std::string(row.extensions) + " ";
    if (list.find(" " + extension + " ") != std::string::npos) return &row;
  }
  return nullptr;
}

}  // namespace smoothpost
