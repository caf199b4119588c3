#include "postproc/pipeline/registry.h"

#include <algorithm>
#include <array>
#include <string>

#include "machines/dialects/beckhoff.h"
#include "machines/dialects/fanuc_30i.h"
#include "machines/dialects/fanuc_ls.h"
#include "machines/dialects/grbl.h"
#include "machines/dialects/heidenhain.h"
#include "machines/dialects/krl.h"
#include "machines/dialects/linuxcnc.h"
#include "machines/dialects/rapid.h"
#include "machines/dialects/ros_trajectory.h"
#include "machines/dialects/siemens_840d.h"
#include "machines/dialects/urscript.h"
#include "machines/dialects/val3.h"
#include "machines/dialects/yaskawa_jbi.h"

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

std::span<const Dialect> dialects() {
  static const std::array<Dialect, 21> rows = {
      beckhoff::kDialect,           fanuc_30i::kDialect,
      fanuc_30i::kVectorDialect,    fanuc_ls::kDialect,
      grbl::kDialects[0],           grbl::kDialects[1],
      grbl::kDialects[2],           grbl::kDialects[3],
      grbl::kDialects[4],           heidenhain::kDialect,
      heidenhain::kVectorDialect,   krl::kDialect,
      linuxcnc::kDialect,           rapid::kDialect,
      ros_trajectory::kRos1Dialect, ros_trajectory::kDialect,
      siemens_840d::kDialect,       urscript::kDialect,
      urscript::kServoDialect,      val3::kDialect,
      yaskawa_jbi::kDialect};
  return rows;
}

const InputFormat* find_input_format(std::string_view name) {
  for (const auto& row : kFormats)
    if (row.name == name) return &row;
  return nullptr;
}

const Dialect* find_dialect(std::string_view name) {
  for (const auto& row : dialects())
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
