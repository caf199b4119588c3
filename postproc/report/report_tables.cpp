#include "postproc/report/report_tables.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "kernels/core/units.h"
#include "postproc/report/check_words.h"
#include "postproc/report/html_table.h"
#include "postproc/report/html_text.h"
#include "postproc/report/report_plots.h"

namespace smoothpost {

namespace {

constexpr std::size_t kMostSlowed = 200, kMostCorners = 500, kMostCuts = 500, kMostMessages = 500;

struct VerdictWords {
  const char* kind;  // class
  const char* title;
  const char* text;
};

VerdictWords words_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::certified:
      return {"good", "CERTIFIED",
              "Every check below was read off the program's own text and holds for the path that "
              "the text describes. Those marked planned hold for the motion as it was scheduled; "
              "what the control makes of it in time is its own."};
    case Verdict::limits_only:
      return {"part", "LIMITS ONLY",
              "The machine's limits and rules hold. The shape of the program was compared with "
              "nothing."};
    case Verdict::forced:
      return {"bad", "NOT CERTIFIED, WRITTEN BY FORCE",
              "A check failed. The program was written because it was asked for (--force); it "
              "opens with an operator stop."};
    case Verdict::refused:
      break;
  }
  return {"bad", "REFUSED", "The program is not certified. Do not run it."};
}

/// Values that have to be at least their limit are told by their outcome.
bool is_lower_bound(const Check& c) { return c.ok ? c.value > c.limit : c.value < c.limit; }

/// Share of the limit that is used; NaN: none can be told.
double share_of(const Check& c) {
  if (!std::isfinite(c.value) || !std::isfinite(c.limit)) return NAN;
  if (is_lower_bound(c)) return c.value > 0.0 ? c.limit / c.value : NAN;
  return c.limit > 0.0 ? c.value / c.limit : NAN;
}

/// The order in which people ask: failed, shape and clearance, rules, limits, digits.
int rank_of(const Check& c) {
  const auto named = [&](std::string_view part) { return c.name.find(part) != std::string::npos; };
  if (!c.ok) return 0;
  if (named("round_trip.")) return 4;
  if (named("_limit.")) return 3;
  if (named("_deviation") || named("clearance") || named("gap") || c.name == "path_complete" ||
      c.name == "part_registration" || c.name == "tip_held" || c.name == "depth_of_cut" ||
      c.name == "axis_to_normal")
    return 1;
  return 2;
}

std::string line_text(std::uint32_t line) { return line > 0 ? std::to_string(line) : ""; }

std::string seconds(double s) {
  if (!(s >= 60.0)) return short_number(s, 3) + " s";
  const auto whole = static_cast<long long>(std::llround(s));
  const std::string rest = std::to_string(whole % 60);
  const std::string minutes = std::to_string(whole / 60 % 60);
  std::string text = minutes + " min " + rest + " s";
  if (whole >= 3600) text = std::to_string(whole / 3600) + " h " + text;
  return text;
}

std::string figure(const char* name, const std::string& value, const std::string& small = {}) {
  return std::string("<div><dt>") + name + "</dt><dd>" + escape_html(value) +
         (small.empty() ? "" : " <small>" + escape_html(small) + "</small>") + "</dd></div>\n";
}

std::size_t count_of(const Diagnostics& list, Severity severity) {
  return static_cast<std::size_t>(std::count_if(
      list.begin(), list.end(), [&](const Diagnostic& d) { return d.severity == severity; }));
}

std::string bar(double share) {
  if (!std::isfinite(share)) return "";
  std::string width = short_number(100.0 * std::clamp(share, 0.0, 1.0), 3);
  return "<span class=\"bar\"><i style=\"width:" + width + "%\"></i></span>" +
         short_number(100.0 * share, 3) + " %";
}

std::string check_row(const Check& c) {
  std::string row = c.ok ? "<tr>" : "<tr class=\"failed\">";
  row += std::string("<td class=\"state\">") + (c.ok ? "ok" : "FAILED") + "</td>";
  row += "<td><span class=\"code\">" + escape_html(c.name) + "</span>" +
         (c.planned ? " <span class=\"planned\">planned</span>" : "") + "<span class=\"what\">" +
         escape_html(check_words(c.name)) + "</span>" +
         (c.note.empty() ? "" : "<span class=\"note\">" + escape_html(c.note) + "</span>") +
         "</td>";
  row += number_cell(short_number(c.value));
  row += number_cell(std::string(is_lower_bound(c) ? "\xE2\x89\xA5 " : "\xE2\x89\xA4 ") +
                     short_number(c.limit));
  row += "<td>" + escape_html(c.unit) + "</td><td class=\"number\">" + bar(share_of(c)) + "</td>";
  row += c.output_line > 0 ? number_cell(line_text(c.input_line))
                           : line_cell(line_text(c.input_line), "input");
  row += line_cell(line_text(c.output_line), "output");
  return row + "</tr>\n";
}

std::string list_of(const std::vector<std::string>& items) {
  std::string out = "<ul>\n";
  for (const auto& item : items) out += "<li>" + escape_html(item) + "</li>\n";
  return out + "</ul>\n";
}

std::string axis_name(const PageInput& in, int joint) {
  const auto& axes = in.conversion.axes;
  if (joint < 0) return "tool tip";
  return static_cast<std::size_t>(joint) < axes.size() ? axes[static_cast<std::size_t>(joint)].name
                                                       : std::to_string(joint);
}

std::string stops_html(const PageInput& in) {
  const std::size_t stops = in.conversion.schedule.stops;
  if (stops == 0) return "";
  return "<p>The path stops at " + std::to_string(stops) + (stops == 1 ? " place" : " places") +
         " inside its cuts (corners that are not blended, dwells, events); every stop has its "
         "ramps.</p>\n";
}

/// Value with the share of its limit.
std::string used(const std::optional<double>& value, double limit) {
  if (!value) return "-";
  return short_number(*value) +
         (limit > 0.0 ? " (" + short_number(100.0 * *value / limit, 2) + " %)" : "");
}

/// The first error of what is not certified, for people who read no further.
std::string reason_html(const Conversion& c) {
  if (c.verdict != Verdict::refused && c.verdict != Verdict::forced) return {};
  const auto errors = count_of(c.diagnostics, Severity::error);
  for (const Diagnostic& d : c.diagnostics) {
    if (d.severity != Severity::error) continue;
    return "<p><b>Why:</b> " + escape_html(to_string(d)) +
           (errors > 1 ? " <a href=\"#messages\">and " + std::to_string(errors - 1) + " more</a>"
                       : std::string()) +
           "</p>\n";
  }
  return {};
}

}  // namespace

std::string verdict_html(const PageInput& in) {
  const Conversion& c = in.conversion;
  const VerdictWords words = words_of(c.verdict);
  const auto failed = static_cast<std::size_t>(
      std::count_if(c.checks.begin(), c.checks.end(), [](const Check& k) { return !k.ok; }));
  std::string out = std::string("<div class=\"verdict ") + words.kind + "\"><strong>" +
                    words.title + "</strong><p>" + words.text + "</p>\n" + reason_html(c) +
                    "<dl class=\"figures\">\n";
  out += figure("Checks", std::to_string(c.checks.size()),
                c.checks.empty() ? "none could be made"
                : failed > 0     ? std::to_string(failed) + " failed"
                                 : "none failed");
  for (const Check& k : c.checks)
    if (k.name == "tip_deviation")
      out += figure("Tool tip leaves the path by", short_number(k.value) + " " + k.unit,
                    "of " + short_number(k.limit));
  if (c.blocks > 0) {
    out += figure(
        "Time, planned", seconds(c.scheduled_time),
        c.programmed_time > 0.0 ? "feeds alone, as programmed: " + seconds(c.programmed_time) : "");
    if (c.executed.seconds)
      out += figure("Time on the control, estimated", seconds(*c.executed.seconds));
    out += figure("Motion blocks", std::to_string(c.blocks));
  }
  out += figure("Not checked", std::to_string(c.not_checked.size()));
  out += figure("Warnings", std::to_string(count_of(c.diagnostics, Severity::warning)));
  return out + "</dl></div>\n";
}

std::string checks_html(const PageInput& in) {
  const Checks& checks = in.conversion.checks;
  if (checks.empty()) return "<p>No check could be made.</p>\n";
  std::vector<const Check*> order;
  for (const Check& c : checks) order.push_back(&c);
  const auto size = [](const Check& c) {
    const double share = share_of(c);
    return std::isnan(share) ? -1.0 : share;
  };
  std::stable_sort(order.begin(), order.end(), [&](const Check* a, const Check* b) {
    const int rank_a = rank_of(*a), rank_b = rank_of(*b);
    return rank_a != rank_b ? rank_a < rank_b : size(*a) > size(*b);
  });
  std::string out =
      "<div class=\"scroll\"><table class=\"checks\"><thead><tr><th></th><th>Check</th>"
      "<th class=\"number\">Value</th><th class=\"number\">Limit</th><th>Unit</th>"
      "<th class=\"number\">Used</th><th class=\"number\">Input line</th>"
      "<th class=\"number\">Output line</th></tr></thead><tbody>\n";
  for (const Check* c : order) out += check_row(*c);
  return out +
         "</tbody></table></div>\n<p class=\"faint\">Lines are those of the tightest place. "
         "<em>planned</em>: true of the times that the program states, if the control keeps "
         "them.</p>\n";
}

std::string unchecked_html(const PageInput& in) {
  const Conversion& c = in.conversion;
  std::string out;
  if (c.not_checked.empty()) {
    out += "<p>Everything that this version can check was checked.</p>\n";
  } else {
    out += "<ul>\n";
    for (const auto& name : c.not_checked)
      out += "<li><span class=\"code\">" + escape_html(name) + "</span> " +
             escape_html(unchecked_words(name)) + "</li>\n";
    out += "</ul>\n";
  }
  if (!c.assumes.empty()) out += "<h3>Taken for granted</h3>\n" + list_of(c.assumes);
  return out;
}

std::string messages_html(const PageInput& in, bool notes) {
  std::string out;
  std::size_t shown = 0, all = 0;
  for (const Severity severity : {Severity::error, Severity::warning, Severity::note}) {
    if ((severity == Severity::note) != notes) continue;
    for (const Diagnostic& d : in.conversion.diagnostics) {
      if (d.severity != severity || ++all > kMostMessages) continue;
      ++shown;
      std::string where = d.where.file;
      if (d.where.line > 0) where += (where.empty() ? "line " : ":") + std::to_string(d.where.line);
      out += "<li class=\"" + to_string(d.severity) + "\"><strong>" + to_string(d.severity) +
             "</strong> " +
             (where.empty() ? "" : "<span class=\"code\">" + escape_html(where) + "</span> ") +
             escape_html(d.text) + " <span class=\"faint code\">" + escape_html(d.code) +
             "</span></li>\n";
    }
  }
  if (out.empty()) return notes ? "" : "<p>None.</p>\n";
  out = "<ul class=\"messages\">\n" + out + "</ul>\n";
  if (all > shown)
    out += "<p>" + std::to_string(all - shown) + " more are in the JSON report.</p>\n";
  return out;
}

std::string machine_html(const PageInput& in) {
  const Conversion& c = in.conversion;
  const ReportContext& context = in.context;
  PairTable table;
  table.row("Machine", context.machine);
  if (in.machine) table.row("", in.machine->description);
  table.row("Dialect of the program", context.dialect);
  table.row("Between two blocks the control", c.interpolation);
  table.row("The input is taken to move", c.reference);
  table.row("Level of the certificate", c.level);
  if (c.blocks > 0) {
    if (c.programmed_time > 0.0) table.row("Time at the input's feeds", seconds(c.programmed_time));
    table.row("Time planned, with links and dwells", seconds(c.scheduled_time));
    const ToleranceBudget& b = c.budget_mm;
    table.row("Tip tolerance by its shares",
              "merging " + short_number(b.merge) + ", smoothing " + short_number(b.smoothing) +
                  ", chord " + short_number(b.chord) + ", rounding " + short_number(b.rounding) +
                  ", control " + short_number(b.controller) + " mm");
  }
  table.row("Input", context.input_file +
                         (context.input_dialect.empty() ? "" : " (" + context.input_dialect + ")"));
  if (context.input_lines > 0)
    table.row("", std::to_string(context.input_lines) + " lines, " +
                      std::to_string(context.cutter_locations) + " cutter locations, " +
                      short_number(c.length, 6) + " mm");
  table.row("SHA-256 of input", context.input_sha256);
  for (const InputFile& file : context.input_files)
    table.row("SHA-256 of " + file.name, file.sha256);
  table.row("SHA-256 of program", context.program_sha256);
  table.row("SHA-256 of machine file", context.machine_sha256);
  if (context.placement) table.row("Place of the part, found", context.placement->work_offset);
  return table.html();
}

std::string axes_html(const PageInput& in, const MotionRecord& before) {
  const Conversion& c = in.conversion;
  if (c.axes.empty()) return "";
  const bool planned = std::any_of(c.axes.begin(), c.axes.end(),
                                   [](const AxisSummary& a) { return a.peak_jerk.has_value(); });
  std::vector<SortTable::Column> columns = {
      {"Axis"}, {"Unit"}, {"From", true}, {"To", true}, {"Velocity (of limit)", true}};
  if (planned)
    for (const char* name : {"Acceleration (of limit)", "Jerk (of limit)", "rms jerk"})
      columns.push_back({name, true});
  if (!before.empty())
    for (const char* name : {"Input: velocity", "acceleration", "jerk"})
      columns.push_back({name, true});
  columns.push_back({"Limits"});
  SortTable table(columns, false);
  for (std::size_t j = 0; j < c.axes.size(); ++j) {
    const AxisSummary& a = c.axes[j];
    std::vector<std::string> row = {a.name, a.unit, short_number(a.position_low),
                                    short_number(a.position_high),
                                    used(a.peak_velocity, a.limit_velocity)};
    if (planned) {
      row.push_back(used(a.peak_acceleration, a.limit_acceleration));
      row.push_back(used(a.peak_jerk, a.limit_jerk));
      row.push_back(a.rms_jerk ? short_number(*a.rms_jerk) : "-");
    }
    for (const auto order :
         {MotionRecord::velocity, MotionRecord::acceleration, MotionRecord::jerk})
      if (!before.empty()) row.push_back(short_number(largest(before, order, j), 3));
    row.push_back(a.source);
    table.row(row);
  }
  std::string out = table.html();
  if (!before.empty())
    out +=
        "<p class=\"faint\">Input: what the axes would have to do at the programmed feed "
        "without ramps, by differences of " +
        short_number(1000.0 * before.step, 3) +
        " ms. Where the path has corners its true acceleration and jerk have no bound.</p>\n";
  return out;
}

std::string slowed_html(const PageInput& in) {
  const auto& all = in.conversion.schedule.slowed_by;
  if (in.conversion.schedule.stretches.empty())
    return "<p>The feed was not scheduled: the control alone decides it.</p>\n";
  if (all.empty())
    return "<p>Between stops no joint's limit keeps the tool below its programmed feed.</p>\n" +
           stops_html(in);
  std::map<std::string, std::size_t> causes;
  for (const SlowedBy& s : all) ++causes[axis_name(in, s.joint) + " " + word(s.limit)];
  std::vector<std::pair<std::string, std::size_t>> sorted(causes.begin(), causes.end());
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  std::string text;
  for (const auto& [name, count] : sorted)
    text += (text.empty() ? "" : ", ") + name + " (" + std::to_string(count) + ")";
  std::vector<const SlowedBy*> order;
  for (const SlowedBy& s : all) order.push_back(&s);
  std::stable_sort(order.begin(), order.end(),
                   [](const SlowedBy* a, const SlowedBy* b) { return a->factor < b->factor; });
  if (order.size() > kMostSlowed) order.resize(kMostSlowed);
  SortTable table({{"Input lines", true, true},
                   {"Axis", false},
                   {"At its limit of", false},
                   {"Slowest, % of the programmed feed", true}});
  for (const SlowedBy* s : order)
    table.row({std::to_string(s->first_line) +
                   (s->last_line > s->first_line ? " to " + std::to_string(s->last_line) : ""),
               axis_name(in, s->joint), word(s->limit), short_number(100.0 * s->factor, 3)});
  std::string out = "<p>" + std::to_string(all.size()) +
                    " stretches are slower than programmed, ramps at stops left out. What holds "
                    "them: " +
                    escape_html(text) + ".</p>\n" + stops_html(in);
  if (all.size() > order.size())
    out += "<p class=\"faint\">The " + std::to_string(order.size()) + " slowest:</p>\n";
  return out + table.html();
}

std::string corners_html(const PageInput& in) {
  const auto& all = in.conversion.corners;
  if (all.empty()) return "";
  std::vector<const SmoothedCorner*> shown;
  for (const SmoothedCorner& c : all) shown.push_back(&c);
  std::stable_sort(shown.begin(), shown.end(),
                   [](const SmoothedCorner* a, const SmoothedCorner* b) {
                     return a->tip_deviation > b->tip_deviation;
                   });
  if (shown.size() > kMostCorners) shown.resize(kMostCorners);
  SortTable table({{"Input line", true, true},
                   {"Turn, deg", true},
                   {"Method", false},
                   {"Tip deviation, mm", true},
                   {"Axis deviation, deg", true},
                   {"Rotation deviation, deg", true},
                   {"Half width, mm", true},
                   {"Half width of rotation, mm", true},
                   {"Speed, mm/s", true}});
  for (const SmoothedCorner* c : shown)
    table.row(
        {line_text(c->input_line), short_number(degrees_from_radians(c->turn)), c->method,
         short_number(c->tip_deviation), short_number(degrees_from_radians(c->axis_deviation)),
         short_number(degrees_from_radians(c->rotation_deviation)), short_number(c->half_width),
         short_number(c->rotation_half_width), short_number(c->speed)});
  std::string out;
  if (all.size() > shown.size())
    out = "<p class=\"faint\">The " + std::to_string(shown.size()) + " of " +
          std::to_string(all.size()) + " corners that deviate most.</p>\n";
  return out + table.html();
}

std::string cuts_html(const PageInput& in) {
  const auto& all = in.conversion.cuts;
  if (all.empty()) return "";
  SortTable table({{"Cut", false},
                   {"First input line", true, true},
                   {"Last input line", true, true},
                   {"Length, mm", true},
                   {"Closed", false},
                   {"Lead-in, mm", true},
                   {"Over-burn, mm", true},
                   {"Lead-out, mm", true},
                   {"Micro-joints", true}});
  for (std::size_t i = 0; i < std::min(all.size(), kMostCuts); ++i) {
    const CutSummary& c = all[i];
    table.row({c.label, line_text(c.first_line), line_text(c.last_line), short_number(c.length, 6),
               c.phases.closed ? "yes" : "no", short_number(c.phases.lead_in),
               short_number(c.phases.over_burn), short_number(c.phases.lead_out),
               std::to_string(c.phases.micro_joints)});
  }
  std::string out;
  if (all.size() > kMostCuts)
    out = "<p class=\"faint\">The first " + std::to_string(kMostCuts) + " of " +
          std::to_string(all.size()) + " cuts.</p>\n";
  return out + table.html();
}

}  // namespace smoothpost
