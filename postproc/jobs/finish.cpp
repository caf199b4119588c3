#include "postproc/jobs/finish.h"

#include <array>
#include <bit>

#include "kernels/core/units.h"
#include "postproc/jobs/settings.h"

namespace smoothpost {

namespace {

constexpr double kTipShare = 0.5;    // of the machine's tip tolerance
constexpr double kChordShare = 0.1;  // of its tolerances, between path points

struct NumberOption {
  const char* name;
  const std::string& text;
  double least, most;
  const char* expected;
};

/// The number of an option, or `fallback` where it is not given.
double read(const NumberOption& option, double fallback, Diagnostics& errors) {
  if (option.text.empty()) return fallback;
  const auto value = read_number(option.text);
  if (value && *value >= option.least && *value <= option.most) return *value;
  errors.push_back(usage_error(
      "US166", std::string(option.name) + " " + option.text + ": expected is " + option.expected));
  return fallback;
}

void append_little_endian(std::string& bytes, std::uint32_t value) {
  for (int shift = 0; shift < 32; shift += 8)
    bytes += static_cast<char>(static_cast<unsigned char>(value >> shift & 0xffU));
}

void append_vector(std::string& bytes, const Vec3& v) {
  for (int i = 0; i < 3; ++i)
    append_little_endian(bytes, std::bit_cast<std::uint32_t>(static_cast<float>(v[i])));
}

}  // namespace

Result<FinishSettings> read_finish_options(const Options& o, double tip_tolerance,
                                           double axis_tolerance) {
  FinishSettings s;
  Diagnostics errors;
  s.pitch =
      read({"--pitch", o.pitch, 1e-3, 1e3, "mm between layers, 0.001 to 1000"}, s.pitch, errors);
  s.depth =
      read({"--depth", o.depth, 1e-3, 50.0, "mm, the depth of cut, 0.001 to 50"}, s.depth, errors);
  s.feed =
      read({"--feed", o.feed, 1e-3, 1e6, "mm/min, above 0"}, s.feed * kSecondsPerMinute, errors) /
      kSecondsPerMinute;
  s.rpm = read({"--rpm", o.rpm, 0.0, 1e6, "turns of the spindle a minute"}, s.rpm, errors);
  if (!o.from.empty())
    s.from = read({"--from", o.from, -1e5, 1e5, "mm, the height of the first layer"}, 0.0, errors);
  if (!o.to.empty())
    s.to = read({"--to", o.to, -1e5, 1e5, "mm, above which there is no layer"}, 0.0, errors);
  s.lead =
      read({"--lead-in", o.lead_in, 0.0, 100.0, "mm, the radius of the arcs that lead in and out"},
           s.lead, errors);
  s.axis_tolerance =
      radians_from_degrees(read({"--normal-tolerance", o.normal_tolerance, 1e-3, 20.0,
                                 "deg that the tool axis may leave the normal by, 0.001 to 20"},
                                degrees_from_radians(s.axis_tolerance), errors));
  if (!o.direction.empty() && o.direction != "alternate" && o.direction != "same" &&
      o.direction != "helical")
    errors.push_back(usage_error(
        "US166", "--direction " + o.direction + ": expected is alternate, same or helical"));
  s.alternate = o.direction != "same";
  s.helical = o.direction == "helical";
  s.tip_tolerance = kTipShare * tip_tolerance;
  s.chord_tip = kChordShare * tip_tolerance;
  s.chord_axis = kChordShare * axis_tolerance;
  const auto tools = read_tools(o.tool);
  errors.insert(errors.end(), tools.diagnostics().begin(), tools.diagnostics().end());
  if (tools.ok() && !tools.value().lengths.empty())
    s.tool_length = tools.value().lengths.begin()->second;
  if (has_error(errors)) return Result<FinishSettings>::failure(std::move(errors));
  return Result<FinishSettings>(s);
}

std::string stl_bytes(const TriangleMesh& mesh) {
  std::string bytes = "stock in mm, made by smoothpost";
  bytes.resize(80, ' ');
  append_little_endian(bytes, static_cast<std::uint32_t>(mesh.triangles.size()));
  bytes.reserve(84 + 50 * mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    const std::array<Vec3, 3> c{mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
    const Vec3 n = (c[1] - c[0]).cross(c[2] - c[0]);
    append_vector(bytes, n.norm() > 0.0 ? Vec3(n.normalized()) : Vec3::Zero());
    for (const Vec3& corner : c) append_vector(bytes, corner);
    bytes.append(2, '\0');
  }
  return bytes;
}

}  // namespace smoothpost
