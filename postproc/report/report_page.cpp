#include "postproc/report/report_page.h"

#include <map>
#include <string_view>

#include "postproc/pipeline/conversion_parts.h"
#include "postproc/pipeline/hash.h"
#include "postproc/report/html_text.h"
#include "postproc/report/report_tables.h"

namespace smoothpost {

std::string_view page_asset(std::string_view name);  // made by cmake/embed_files.cmake

namespace {

constexpr const char* kScripts[] = {"matrix.js", "kinematics.js", "drawing.js", "scene.js",
                                    "camera.js", "picking.js",    "tables.js",  "main.js"};

/// One closed script of all files.
std::string script() {
  std::string text = "(function () {\n'use strict';\n";
  for (const char* name : kScripts) text += page_asset(name);
  return text + "}());\n";
}

std::string bytes_of_hex(const std::string& hex) {
  const auto digit = [](char c) { return c <= '9' ? c - '0' : c - 'a' + 10; };
  std::string out;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    out += static_cast<char>(digit(hex[i]) * 16 + digit(hex[i + 1]));
  return out;
}

/// `{{name}}` in the template becomes fields[name]; what is put in is not looked at again.
std::string filled(std::string_view text, const std::map<std::string, std::string>& fields) {
  std::string out;
  std::size_t at = 0;
  while (true) {
    const std::size_t open = text.find("{{", at);
    if (open == std::string_view::npos) break;
    const std::size_t close = text.find("}}", open);
    if (close == std::string_view::npos) break;
    out += text.substr(at, open - at);
    const auto field = fields.find(std::string(text.substr(open + 2, close - open - 2)));
    if (field != fields.end()) out += field->second;
    at = close + 2;
  }
  return out += text.substr(at);
}

std::string figure(const NamedPlot& plot) {
  return "<figure>" + plot.svg +
         (plot.caption.empty() ? ""
                               : "<figcaption>" + escape_html(plot.caption) + "</figcaption>") +
         "</figure>\n";
}

std::string figures(const std::vector<NamedPlot>& plots, const std::string& group) {
  std::string out;
  for (const NamedPlot& p : plots)
    if (p.group == group) out += figure(p);
  return out;
}

/// Side by side.
std::string figure_pairs(const std::vector<NamedPlot>& plots, const std::string& group) {
  const std::string own = figures(plots, group);
  return own.empty() ? own : "<div class=\"plots\">" + own + "</div>\n";
}

std::string axis_figures(const std::vector<NamedPlot>& plots, const Conversion& c) {
  std::string out;
  for (const AxisSummary& axis : c.axes) {
    const std::string own = figure_pairs(plots, "axis_" + axis.name);
    if (!own.empty()) out += "<h3>Axis " + escape_html(axis.name) + "</h3>\n" + own;
  }
  return out;
}

/// Left out of the page without content.
struct Section {
  std::string id, title, content;
};

using Fields = std::map<std::string, std::string>;

Fields head_fields(const PageInput& in) {
  const std::string code = script();
  Fields f;
  f["title"] = escape_html(in.context.input_file.empty() ? "program" : in.context.input_file);
  f["machine_name"] = escape_html(in.context.machine);
  f["version"] = escape_html(in.context.version);
  f["style"] = page_asset("page.css");
  f["script_hash"] = base64(bytes_of_hex(sha256(code)));
  f["script"] = code;
  f["verdict"] = verdict_html(in);
  return f;
}

std::string axes_words(const PageInput& in, const MotionRecord& after, const MotionRecord& before) {
  if (after.empty()) return "";
  std::string text = "<p class=\"faint\">";
  if (after.orders == 4)
    text += "The program is drawn from its feed schedule every " +
            short_number(1000.0 * after.step, 3) +
            " ms; peaks between are in the table above. The scale is that of the cuts: links "
            "(grey, from "
            "rest to rest) may leave the picture.";
  else
    text +=
        "Drawn from the printed block times: acceleration and jerk are the control's own and not "
        "known.";
  if (!before.empty())
    text +=
        " The input is what the axes would have to do to follow it at its programmed feed "
        "without ramps, cut by cut; its derivatives are differences of " +
        short_number(1000.0 * before.step, 3) + " ms.";
  if (in.conversion.axes.empty()) return "";
  return text + " Limits are dashed.</p>\n";
}

const char* view_html() {
  return "<noscript><p class=\"noscript\">The 3D view needs scripts. The views below, all tables "
         "and all plots are here without.</p></noscript>\n<div id=\"view\" hidden></div>\n";
}

}  // namespace

ReportPage report_page(const PageInput& in, const SceneSettings& settings) {
  ReportPage page;
  const Conversion& c = in.conversion;
  const ScrewChain chain = in.machine ? placed_chain(*in.machine, in.placement) : ScrewChain{};
  const ToolPath* path = !c.path.points.empty() ? &c.path : in.input ? &in.input->path : nullptr;
  std::optional<ReferencePath> reference;
  if (path && in.input && !path->points.empty()) reference.emplace(*path, in.input->frames);
  const ReferencePath* follows = reference ? &*reference : nullptr;
  const ProgramMotion motion = program_motion(in, c.path.points.empty() ? nullptr : follows, chain);
  MotionRecord after = planned_record(in);
  if (after.empty()) after = printed_record(in, motion);
  const MotionRecord before =
      c.path.points.empty() ? MotionRecord{} : input_record(in, follows, chain, motion);
  page.plots = report_plots({in, follows, motion, after, before});
  Fields f = head_fields(in);
  f["scene"] = scene_json(in, follows, chain, motion, settings);
  const std::string view = motion.points.empty() && !follows && !in.part
                               ? std::string()
                               : view_html() + figure_pairs(page.plots, "path");
  const std::string notes = messages_html(in, true);
  const std::vector<Section> sections = {
      {"checks", "Checks", checks_html(in)},
      {"unchecked", "Not checked", unchecked_html(in)},
      {"messages", "Messages",
       messages_html(in, false) + (notes.empty() ? "" : "<h3>Notes</h3>\n" + notes)},
      {"machine", "Machine and time", machine_html(in)},
      {"feed", "What slows the feed", figures(page.plots, "feed") + slowed_html(in)},
      {"corners", "Corners", corners_html(in)},
      {"view_section", "Path in the part", view},
      {"deviation", "Deviation", figure_pairs(page.plots, "deviation")},
      {"axes_section", "Axes",
       axes_html(in, before) + axes_words(in, after, before) + axis_figures(page.plots, c)},
      {"jerk", "Jerk", figures(page.plots, "jerk")},
      {"rotary", "Rotary axes", figure_pairs(page.plots, "rotary")},
      {"domain", "Room of lead and tilt", figure_pairs(page.plots, "domain")},
      {"cuts", "Cuts", cuts_html(in)}};
  for (const Section& s : sections) {
    if (s.content.empty()) continue;
    f["nav"] += "<a href=\"#" + s.id + "\">" + s.title + "</a>\n";
    f["sections"] +=
        "<section id=\"" + s.id + "\"><h2>" + s.title + "</h2>\n" + s.content + "</section>\n";
  }
  page.html = filled(page_asset("page.html"), f);
  return page;
}

}  // namespace smoothpost
