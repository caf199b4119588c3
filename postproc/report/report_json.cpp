#include "postproc/report/report_json.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "kernels/core/units.h"
#include "machines/dialects/decimal.h"

namespace smoothpost {

namespace {

using Json = nlohmann::ordered_json;

// Nine significant digits are more than any check needs and the same on every machine.
Json number(double value) {
  if (!std::isfinite(value)) return nullptr;
  if (value == 0.0) return 0.0;
  const int magnitude = static_cast<int>(std::floor(std::log10(std::abs(value))));
  const double scale = std::pow(10.0, 8 - magnitude);
  const double rounded = std::round(value * scale) / scale;
  return std::isfinite(rounded) ? rounded : value;
}

Json check_json(const Check& c) {
  Json j = {{"name", c.name},
            {"value", number(c.value)},
            {"limit", number(c.limit)},
            {"unit", c.unit},
            {"ok", c.ok},
            {"planned", c.planned},
            {"input_line", c.input_line},
            {"output_line", c.output_line},
            {"time_s", number(c.time_s)}};
  if (!c.note.empty()) j["note"] = c.note;
  return j;
}

Json diagnostic_json(const Diagnostic& d) {
  return {{"file", d.where.file},     {"line", d.where.line},
          {"column", d.where.column}, {"severity", to_string(d.severity)},
          {"code", d.code},           {"text", d.text}};
}

Json qp_json(const QpReport& q) {
  return {{"name", q.name},
          {"solver", q.solver},
          {"status", q.status},
          {"objective", number(q.objective)},
          {"iterations", q.iterations},
          {"windows", q.windows},
          {"kkt", number(q.kkt)},
          {"violation", number(q.violation)}};
}

/// What keeps the cut below its programmed feed, the slowest `kMostSlowed` in path order.
Json slowed_json(const CutSummary& cut, const Conversion& c) {
  constexpr std::size_t kMostSlowed = 1000;
  const auto before = [](const SlowedBy& s, std::uint32_t segment) {
    return s.first_segment < segment;
  };
  const auto& all = c.schedule.slowed_by;
  const auto begin = std::lower_bound(all.begin(), all.end(), cut.first, before);
  std::vector<SlowedBy> shown(begin, std::lower_bound(begin, all.end(), cut.last + 1, before));
  if (shown.size() > kMostSlowed) {
    std::stable_sort(shown.begin(), shown.end(),
                     [](const SlowedBy& a, const SlowedBy& b) { return a.factor < b.factor; });
    shown.resize(kMostSlowed);
    std::stable_sort(shown.begin(), shown.end(), [](const SlowedBy& a, const SlowedBy& b) {
      return a.first_segment < b.first_segment;
    });
  }
  Json list = Json::array();
  for (const SlowedBy& s : shown)
    list.push_back({{"joint", c.axes[static_cast<std::size_t>(s.joint)].name},
                    {"limit", word(s.limit)},
                    {"input_lines", {s.first_line, s.last_line}},
                    {"factor", number(s.factor)}});
  return list;
}

/// Angles in degrees, lengths in mm; free: at some standoff.
Json domain_json(const DomainMap& map) {
  Json j = {{"input_line", map.line}};
  const auto list = [](const std::vector<double>& values, bool angle) {
    Json out = Json::array();
    for (const double v : values) out.push_back(number(angle ? degrees_from_radians(v) : v));
    return out;
  };
  j["lead_deg"] = list(map.leads, true);
  j["tilt_deg"] = list(map.tilts, true);
  j["standoff_mm"] = list(map.standoffs, false);
  Json rows = Json::array();
  for (std::size_t t = 0; t < map.tilts.size(); ++t) {
    Json row = Json::array();
    for (std::size_t l = 0; l < map.leads.size(); ++l)
      row.push_back(std::any_of(map.cells.begin(), map.cells.end(),
                                [&](const auto& cells) { return cells[l][t] == '.'; })
                        ? 1
                        : 0);
    rows.push_back(std::move(row));
  }
  j["free"] = std::move(rows);
  j["cells"] = map.cells;
  j["programmed"] = list({map.programmed[0], map.programmed[1]}, true);
  if (map.chosen) j["chosen"] = list({(*map.chosen)[0], (*map.chosen)[1]}, true);
  return j;
}

/// What was optimised in the cut; nothing when nothing was.
void add_stretches(const CutSummary& cut, const std::vector<LaserStretch>& stretches, Json& j) {
  int points = 0, via = 0, passes = 0, count = 0;
  bool from_part = true;
  double feed = 0.0;
  Json qp = Json::array();
  AlternationReport alternation;
  const auto begin =
      std::lower_bound(stretches.begin(), stretches.end(), cut.first,
                       [](const LaserStretch& s, std::uint32_t k) { return s.first < k; });
  for (auto at = begin; at != stretches.end() && at->last <= cut.last; ++at) {
    const LaserStretch& s = *at;
    feed = count++ == 0 ? s.feed : std::min(feed, s.feed);
    points += s.control_points;
    via += s.via_points;
    passes += s.passes;
    from_part = from_part && s.normal_from_part;
    for (const QpReport& q : s.qp) qp.push_back(qp_json(q));
    alternation.tried += s.alternation.tried;
    alternation.kept += s.alternation.kept;
    alternation.time_before += s.alternation.time_before;
    alternation.time_after += s.alternation.time_after;
  }
  if (count == 0) return;
  j["stretches"] = count;
  j["control_points"] = points;
  j["via_points"] = via;
  j["passes"] = passes;
  j["normal"] = from_part ? "part" : "programmed";
  j["feed_mm_per_min"] = number(kSecondsPerMinute * feed);
  j["qp"] = std::move(qp);
  if (alternation.tried > 0)
    j["alternation"] = {{"tried", alternation.tried},
                        {"kept", alternation.kept},
                        {"time_before_s", number(alternation.time_before)},
                        {"time_after_s", number(alternation.time_after)}};
}

/// How the cut was kept clear of what is beside it; nothing where nothing was in the way.
void add_clearing(const CutSummary& cut, const std::vector<LaserStretch>& stretches, Json& j) {
  Json clear;
  int passes = 0, conditions = 0, boxes = 0;
  bool all = true;
  const ClearanceLoopReport* tightest = nullptr;
  static const std::vector<std::string> kMethods = {"none", "cuts", "boxes", "via", "graph"};
  std::ptrdiff_t method = 0;
  for (const LaserStretch& s : stretches) {
    const ClearanceLoopReport& r = s.clear;
    if (s.first < cut.first || s.last > cut.last || (r.passes == 0)) continue;
    passes += r.passes;
    conditions += r.cuts;
    boxes += r.boxes;
    all = all && r.clear;
    method =
        std::max(method, std::find(kMethods.begin(), kMethods.end(), r.method) - kMethods.begin());
    if (!r.bodies.empty() && (tightest == nullptr || r.tightest < tightest->tightest))
      tightest = &r;
  }
  if (method == 0) return;
  const auto known = static_cast<std::size_t>(method);
  clear = {{"method", known < kMethods.size() ? kMethods[known] : ""},
           {"passes", passes},
           {"conditions", conditions},
           {"boxes", boxes},
           {"clear", all}};
  if (tightest != nullptr) {
    clear["tightest_mm"] = number(tightest->tightest);
    clear["bodies"] = tightest->bodies;
    clear["input_line"] = tightest->line;
  }
  j["clear"] = std::move(clear);
}

Json cut_json(const CutSummary& c) {
  return {{"label", c.label},
          {"input_lines", {c.first_line, c.last_line}},
          {"length_mm", number(c.length)},
          {"closed", c.phases.closed},
          {"lead_in_mm", number(c.phases.lead_in)},
          {"contour_mm", number(c.phases.contour)},
          {"over_burn_mm", number(c.phases.over_burn)},
          {"lead_out_mm", number(c.phases.lead_out)},
          {"micro_joints", c.phases.micro_joints}};
}

Json axis_json(const AxisSummary& a) {
  // Acceleration and jerk of a program at level geometry are the controller's, unless a plan says
  // what it has asked for: null, not zero.
  const auto known = [](const std::optional<double>& value) {
    return value ? number(*value) : Json(nullptr);
  };
  Json input = nullptr;
  if (a.input)
    input = {{"velocity", number(a.input->velocity)},
             {"acceleration", known(a.input->acceleration)},
             {"jerk", known(a.input->jerk)}};
  return {{"name", a.name},
          {"unit", a.unit},
          {"position", {number(a.position_low), number(a.position_high)}},
          {"peak",
           {{"velocity", number(a.peak_velocity)},
            {"acceleration", known(a.peak_acceleration)},
            {"jerk", known(a.peak_jerk)}}},
          {"limit",
           {{"velocity", number(a.limit_velocity)},
            {"acceleration", number(a.limit_acceleration)},
            {"jerk", number(a.limit_jerk)},
            {"source", a.source}}},
          {"input_peak", std::move(input)},
          {"rms_jerk", known(a.rms_jerk)},
          {"input_rms_jerk", a.input ? known(a.input->rms_jerk) : Json(nullptr)},
          {"rounding_jerk", known(a.rounding_jerk)}};
}

Json corner_json(const SmoothedCorner& c) {
  const bool acr = c.method == "acr";
  return {{"input_line", c.input_line},
          {"turn_deg", number(degrees_from_radians(c.turn))},
          {"method", c.method},
          {"kappa", acr ? Json(number(c.shape.kappa)) : Json(nullptr)},
          {"lambda", acr ? Json(number(c.shape.lambda)) : Json(nullptr)},
          {"c1", c.method == "ramp" ? Json(number(c.c1)) : Json(nullptr)},
          {"half_width_mm", number(c.half_width)},
          {"rotation_half_width_mm", number(c.rotation_half_width)},
          {"tip_deviation_mm", number(c.tip_deviation)},
          {"rotation_deviation_deg", number(degrees_from_radians(c.rotation_deviation))},
          {"axis_deviation_deg", number(degrees_from_radians(c.axis_deviation))},
          {"speed_mm_per_s", number(c.speed)}};
}

/// The list, cut to the corners that deviate most (in path order) when it is longer than `most`.
Json corners_json(const std::vector<SmoothedCorner>& corners, std::size_t most) {
  std::vector<std::size_t> shown(corners.size());
  std::iota(shown.begin(), shown.end(), std::size_t{0});
  if (shown.size() > most) {
    std::stable_sort(shown.begin(), shown.end(), [&](std::size_t a, std::size_t b) {
      return corners[a].tip_deviation > corners[b].tip_deviation;
    });
    shown.resize(most);
    std::sort(shown.begin(), shown.end());
  }
  Json list = Json::array();
  for (const std::size_t i : shown) list.push_back(corner_json(corners[i]));
  return list;
}

std::string dump(const Json& json) {
  // Invalid UTF-8 in a comment or file name must not lose the report.
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

Json placement_json(const PlacementReport& placement) {
  const auto margins = [](const std::vector<PlacementReport::Margin>& list) {
    Json out = Json::array();
    for (const auto& m : list)
      out.push_back({{"name", m.name}, {"value", number(m.value)}, {"input_line", m.input_line}});
    return out;
  };
  return {{"found", placement.found},
          {"work_offset", placement.work_offset},
          {"evaluations", placement.evaluations},
          {"before", margins(placement.before)},
          {"after", margins(placement.after)}};
}

/// A joint stream with its own certificate: what is said of the program is not said of it, nor the
/// other way round.
Json stream_json(const JointStream& s, const ReportContext& context) {
  Json checks = Json::array();
  for (const Check& check : s.checks) checks.push_back(check_json(check));
  Json axes = Json::array();
  for (const StreamAxis& a : s.axes)
    axes.push_back({{"name", a.name},
                    {"unit", a.unit},
                    {"peak",
                     {{"velocity", number(a.velocity)},
                      {"acceleration", number(a.acceleration)},
                      {"jerk", number(a.jerk)}}},
                    {"rounding_jerk", number(a.rounding_jerk)}});
  return {{"file", context.stream_file},
          {"sha256", context.stream_sha256},
          {"verdict", s.ok() ? "certified" : "refused"},
          {"level", "timed"},
          {"cycle_s", number(s.cycle)},
          {"rows", s.rows},
          {"duration_s", number(s.duration)},
          {"assumes", s.assumes},
          {"not_checked", s.not_checked},
          {"checks", std::move(checks)},
          {"axes", std::move(axes)}};
}

}  // namespace

std::string report_json(const Conversion& c, const ReportContext& context) {
  Json checks = Json::array();
  for (const auto& check : c.checks) checks.push_back(check_json(check));
  Json axes = Json::array();
  for (const auto& axis : c.axes) axes.push_back(axis_json(axis));
  Json diagnostics = Json::array();
  for (const auto& d : c.diagnostics) diagnostics.push_back(diagnostic_json(d));

  Json j;
  j["schema"] = 1;
  j["tool"] = {{"name", "smoothpost"}, {"version", context.version}};
  j["machine"] = context.machine;
  j["dialect"] = context.dialect;
  j["verdict"] = to_string(c.verdict);
  j["certificate"] = {{"level", c.level},
                      {"interpolation", c.interpolation},
                      {"reference", c.reference},
                      {"assumes", c.assumes},
                      {"not_checked", c.not_checked},
                      {"budget_mm",
                       {{"merge", number(c.budget_mm.merge)},
                        {"smoothing", number(c.budget_mm.smoothing)},
                        {"chord", number(c.budget_mm.chord)},
                        {"rounding", number(c.budget_mm.rounding)},
                        {"controller", number(c.budget_mm.controller)}}},
                      {"input_sha256", context.input_sha256},
                      {"program_sha256", context.program_sha256},
                      {"machine_sha256", context.machine_sha256}};
  for (const InputFile& file : context.input_files)
    j["certificate"]["input_files"].push_back({{"file", file.name}, {"sha256", file.sha256}});
  j["input"] = {{"file", context.input_file},
                {"format", context.input_format},
                {"dialect", context.input_dialect},
                {"lines", context.input_lines},
                {"cuts", c.cuts.size()},
                {"links", c.links},
                {"cutter_locations", context.cutter_locations},
                {"merged_points", c.merged_points},
                {"fitted_points", c.fitted_points},
                {"length_mm", number(c.length)}};
  j["output"] = {{"lines", std::count(c.program.begin(), c.program.end(), '\n')},
                 {"blocks", c.blocks},
                 {"bytes", c.program.size()}};
  j["checks"] = std::move(checks);
  j["axes"] = std::move(axes);
  constexpr std::size_t kMostCuts = 10000;
  Json cuts = Json::array();
  for (std::size_t i = 0; i < std::min(c.cuts.size(), kMostCuts); ++i) {
    Json& cut = cuts.emplace_back(cut_json(c.cuts[i]));
    add_stretches(c.cuts[i], c.stretches, cut);
    add_clearing(c.cuts[i], c.stretches, cut);
    if (!c.axes.empty()) cut["slowed_by"] = slowed_json(c.cuts[i], c);
  }
  constexpr std::size_t kMostCorners = 10000;
  j["corners"] = corners_json(c.corners, kMostCorners);
  if (c.corners.size() > kMostCorners) j["corners_in_all"] = c.corners.size();
  j["cuts"] = std::move(cuts);
  Json maps = Json::array();
  for (const LaserStretch& stretch : c.stretches)
    for (const DomainMap& map : stretch.clear.maps) maps.push_back(domain_json(map));
  if (!maps.empty()) j["domain_maps"] = std::move(maps);
  j["time_s"] = {
      {"programmed", number(c.programmed_time)},
      {"scheduled", number(c.scheduled_time)},
      {"executed_estimate", c.executed.seconds ? number(*c.executed.seconds) : Json(nullptr)},
      {"executed_model", c.executed.model}};
  if (c.stream) j["stream"] = stream_json(*c.stream, context);
  if (context.placement) j["placement"] = placement_json(*context.placement);
  j["diagnostics"] = std::move(diagnostics);
  if (context.timings) {
    Json stages = Json::array();
    for (const auto& stage : c.stages)
      stages.push_back({{"name", stage.name}, {"seconds", number(stage.seconds)}});
    j["stages"] = std::move(stages);
  }
  return dump(j);
}

std::string line_map_json(const LineMap& map, const std::string& input_file) {
  // Written by hand: a million rows as a JSON tree would cost a hundred times their text.
  std::string text = "{\"schema\": 1, \"input\": " +
                     Json(input_file).dump(-1, ' ', false, Json::error_handler_t::replace) +
                     ",\n\"columns\": [\"output_line\", \"input_line\", \"role\", \"segment\", "
                     "\"from\", \"to\", \"from_segment\"],\n\"rows\": [";
  for (std::size_t i = 0; i < map.size(); ++i) {
    const LineMapEntry& e = map[i];
    text += i ? ",\n[" : "\n[";
    text += std::to_string(e.output_line) + "," + std::to_string(e.input_line) +
            (e.role == MoveRole::path ? ",\"path\"," : ",\"link\",") + std::to_string(e.segment) +
            ",";
    append_decimal(text, e.from_share, 9);
    text += ',';
    append_decimal(text, e.to_share, 9);
    text += ',' + std::to_string(e.from_segment) + ']';
  }
  return text + "\n]}\n";
}

std::string diagnostics_json(const Diagnostics& diagnostics) {
  Json list = Json::array();
  for (const auto& d : diagnostics) list.push_back(diagnostic_json(d));
  return dump(list);
}

std::string changed_checks(const std::string& expected_report, const std::string& actual_report,
                           double relative) {
  const Json before = Json::parse(expected_report, nullptr, false);
  const Json after = Json::parse(actual_report, nullptr, false);
  if (before.is_discarded() || after.is_discarded()) {
    return expected_report == actual_report ? "" : "    a report is missing or no JSON\n";
  }
  const auto row = [](const Json& check) {
    return check.value("value", Json(nullptr)).dump() +
           (check.value("ok", false) ? " ok" : " FAILED");
  };
  const auto find = [](const Json& report, const std::string& name) {
    for (const auto& check : report.value("checks", Json::array()))
      if (check.value("name", "") == name) return check;
    return Json(nullptr);
  };
  const auto close = [&](const Json& a, const Json& b) {
    if (a.value("ok", false) != b.value("ok", true)) return false;
    if (!a["value"].is_number() || !b["value"].is_number()) return a["value"] == b["value"];
    const double x = a["value"].get<double>(), y = b["value"].get<double>();
    const double scale = std::max({std::abs(a.value("limit", 0.0)), std::abs(x), std::abs(y)});
    return std::abs(x - y) <= relative * scale;
  };
  std::string text;
  if (before.value("verdict", "") != after.value("verdict", ""))
    text += "    verdict: expected " + before.value("verdict", "") + ", now " +
            after.value("verdict", "") + "\n";
  for (const auto& a : before.value("checks", Json::array())) {
    const std::string name = a.value("name", "");
    const Json b = find(after, name);
    if (b.is_null())
      text += "    " + name + ": expected " + row(a) + ", now absent\n";
    else if (!close(a, b))
      text += "    " + name + ": expected " + row(a) + ", now " + row(b) + "\n";
  }
  for (const auto& b : after.value("checks", Json::array()))
    if (find(before, b.value("name", "")).is_null())
      text += "    " + b.value("name", "") + ": new, " + row(b) + "\n";
  return text;
}

}  // namespace smoothpost
