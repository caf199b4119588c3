#include "postproc/report/domain_plots.h"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "postproc/report/svg_plot.h"

namespace smoothpost {

namespace {

using Json = nlohmann::json;

constexpr const char* kCaption =
    "Green: free at some standoff; red: at none. Where the cut was moved, \"chosen\" is where it "
    "went.";
constexpr std::size_t kMostMaps = 24, kMostRows = 181, kMostBytes = 400000;

std::vector<double> numbers(const Json& list) {
  std::vector<double> out;
  if (!list.is_array()) return out;
  for (const Json& v : list)
    out.push_back(v.is_number()    ? v.get<double>()
                  : v.is_boolean() ? static_cast<double>(v.get<bool>())
                                   : std::numeric_limits<double>::quiet_NaN());
  return out;
}

void add_mark(const Json& map, const char* key, PlotField& field) {
  const std::vector<double> at = map.contains(key) ? numbers(map.at(key)) : std::vector<double>{};
  if (at.size() == 2) field.marks.push_back({at[0], at[1], key});
}

}  // namespace

std::vector<NamedPlot> domain_plots(std::string_view report) {
  std::vector<NamedPlot> out;
  std::size_t bytes = 0;
  const Json json = Json::parse(report, nullptr, false);
  if (!json.is_object() || !json.contains("domain_maps")) return out;
  const Json& maps = json.at("domain_maps");
  if (!maps.is_array()) return out;
  for (const Json& map : maps) {
    if (out.size() == kMostMaps) break;
    if (!map.is_object() || !map.contains("lead_deg") || !map.contains("tilt_deg") ||
        !map.contains("free") || !map.at("free").is_array())
      continue;
    PlotField field;
    field.x = numbers(map.at("lead_deg"));
    field.y = numbers(map.at("tilt_deg"));
    for (const Json& row : map.at("free")) field.value.push_back(numbers(row));
    if (field.x.size() > kMostRows || field.y.size() > kMostRows) continue;
    const Json line = map.value("input_line", Json(0));
    field.title = "Free lead and tilt at input line " +
                  std::to_string(line.is_number_unsigned() ? line.get<std::uint64_t>() : 0U);
    field.x_label = "lead, deg";
    field.y_label = "tilt, deg";
    add_mark(map, "programmed", field);
    add_mark(map, "chosen", field);
    std::string text = svg_field(field);
    if (text.empty()) continue;
    bytes += text.size();
    if (bytes > kMostBytes) break;
    out.push_back(
        {"domain_" + std::to_string(out.size() + 1), "domain", kCaption, std::move(text)});
  }
  return out;
}

}  // namespace smoothpost
