#include "postproc/report/report_page.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "postproc/pipeline/hash.h"
#include "postproc/report/html_text.h"
#include "tests/postproc/report/drawn.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

/// The text between the nth `<script` ... `>` and its end.
std::string script_of(const std::string& html, int nth) {
  std::size_t at = 0;
  for (int k = 0; k <= nth; ++k) at = html.find("<script", at + 1);
  at = html.find('>', at) + 1;
  return html.substr(at, html.find("</script>", at) - at);
}

/// The page without data block, script and style: what a browser without scripts shows.
std::string still(std::string html) {
  for (const std::string name : {"script", "style"})
    for (std::size_t at; (at = html.find("<" + name)) != std::string::npos;) {
      const std::size_t end = html.find("</" + name + ">", at);
      REQUIRE(end != std::string::npos);
      html.erase(at, end + name.size() + 3 - at);
    }
  return html;
}

}  // namespace

TEST_CASE("report_page: every check and message and axis stands in it with scripts off",
          "[postproc][report]") {
  Drawn d = drawn();
  Diagnostic warning;
  warning.severity = Severity::warning;
  warning.code = "LK101";
  warning.text = "no part was given";
  warning.where = {"part.ngc", 17, 3};
  d.conversion.diagnostics.push_back(warning);
  const ReportPage page = report_page(d.page());
  const std::string text = still(page.html);
  CHECK(contains(text, "CERTIFIED"));
  for (const Check& c : d.conversion.checks) {
    INFO(c.name);
    CHECK(contains(text, ">" + c.name + "<"));
    if (c.output_line > 0)
      CHECK(contains(text, "data-output-line=\"" + std::to_string(c.output_line) + "\""));
  }
  for (const auto& name : d.conversion.not_checked) CHECK(contains(text, ">" + name + "<"));
  for (const auto& sentence : d.conversion.assumes) CHECK(contains(text, escape_html(sentence)));
  CHECK(contains(text, "part.ngc:17"));
  CHECK(contains(text, "no part was given"));
  for (const auto& axis : d.conversion.axes)
    for (const char* order : {" position", " velocity", " acceleration", " jerk"})
      CHECK(contains(text, ">" + axis.name + order));
  for (const char* id : {"checks", "unchecked", "messages", "machine", "feed", "view_section",
                         "deviation", "axes_section", "jerk", "rotary", "cuts"}) {
    CHECK(contains(text, "id=\"" + std::string(id) + "\""));
    CHECK(contains(text, "href=\"#" + std::string(id) + "\""));
  }
  // The verdict comes before the checks, these before all that is drawn.
  CHECK(text.find("CERTIFIED") < text.find("id=\"checks\""));
  CHECK(text.find("id=\"checks\"") < text.find("<svg"));
}

TEST_CASE("report_page: failed checks come first and the verdict says what it is",
          "[postproc][report]") {
  Drawn d = drawn();
  d.conversion.verdict = Verdict::refused;
  Check failed;
  failed.name = "gap";
  failed.value = 3.0;
  failed.limit = 0.5;
  failed.unit = "mm";
  failed.ok = false;
  failed.note = "the part lies elsewhere";
  d.conversion.checks.push_back(failed);
  const std::string text = still(report_page(d.page()).html);
  CHECK(contains(text, "REFUSED"));
  CHECK_FALSE(contains(text, ">CERTIFIED<"));
  const std::size_t first_row = text.find("<tbody>");
  CHECK(text.substr(first_row, 80).find("class=\"failed\"") != std::string::npos);
  CHECK(contains(text, "the part lies elsewhere"));
  CHECK(count_of(text, "FAILED") == 1);
  d.conversion.verdict = Verdict::limits_only;
  CHECK(contains(report_page(d.page()).html, "LIMITS ONLY"));
  d.conversion.verdict = Verdict::forced;
  CHECK(contains(report_page(d.page()).html, "NOT CERTIFIED"));
}

TEST_CASE("report_page: the same bytes twice and nothing that is loaded from elsewhere",
          "[postproc][report]") {
  const Drawn d = drawn();
  const ReportPage page = report_page(d.page());
  CHECK(page.html == report_page(d.page()).html);
  const std::string text = still(page.html);
  CHECK(count_of(page.html, "http") ==
        count_of(page.html, "http://www.w3.org/2000/svg") + count_of(page.html, "http-equiv"));
  CHECK_FALSE(std::regex_search(text, std::regex("\\ssrc=")));
  CHECK_FALSE(contains(page.html, "<link"));
  CHECK_FALSE(contains(page.html, "@import"));
  CHECK_FALSE(contains(page.html, "url("));
  const std::regex link("href=\"([^\"]*)\"");
  for (std::sregex_iterator at(text.begin(), text.end(), link), none; at != none; ++at)
    CHECK((*at)[1].str().front() == '#');
}

TEST_CASE("report_page: the one script is the one that its policy allows", "[postproc][report]") {
  const Drawn d = drawn();
  const std::string html = report_page(d.page()).html;
  CHECK(count_of(html, "<script") == 2);
  CHECK(count_of(html, "</script>") == 2);
  const std::string hex = sha256(script_of(html, 1));
  std::string bytes;
  for (std::size_t i = 0; i < hex.size(); i += 2)
    bytes += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
  CHECK(contains(html, "script-src 'sha256-" + base64(bytes) + "'"));
  CHECK(contains(html, "default-src 'none'"));
  CHECK(nlohmann::json::parse(script_of(html, 0))["axes"].size() == d.in.machine.axes.size());
}

TEST_CASE("report_page: nothing of the input becomes markup", "[postproc][report]") {
  const std::string tag = "</script><script>alert(1)</script><img src=x onerror=alert(2)>\"'&";
  const Drawn plain = drawn();
  Drawn d = drawn();
  Conversion& c = d.conversion;
  d.context.input_file = tag + ".ngc";
  d.context.machine = tag;
  d.context.dialect = tag;
  d.context.version = tag;
  d.context.input_dialect = tag;
  d.context.input_sha256 = tag;
  d.context.placement = PlacementReport{true, tag, {}, {}, 1};
  d.in.machine.description = tag;
  for (auto& axis : d.in.machine.axes) axis.name += tag;
  for (auto& axis : c.axes) {
    axis.name += tag;
    axis.source = tag;
    axis.unit = tag;
  }
  for (auto& check : c.checks) {
    check.note = tag;
    check.unit = tag;
    check.name += tag;
  }
  Diagnostic message;
  message.code = tag;
  message.text = tag;
  message.where.file = tag;
  c.diagnostics.push_back(message);
  c.assumes = {tag};
  c.not_checked = {tag};
  c.interpolation = c.reference = c.level = tag;
  for (auto& cut : c.cuts) cut.label = tag;
  SmoothedCorner corner;
  corner.method = tag;
  c.corners.push_back(corner);
  const std::string text = "(" + tag + ")\n";
  PageInput in = d.page();
  in.input_text = text;
  in.program_text = text;
  const std::string report = R"({"domain_maps": [{"input_line": ")"
                             "</script>"
                             R"("}]})";
  in.report = report;
  const ReportPage page = report_page(in);
  CHECK(count_of(page.html, "<script") == 2);
  CHECK(count_of(page.html, "</script") == 2);
  CHECK_FALSE(contains(page.html, "<img"));
  CHECK(contains(page.html, "&lt;img src=x onerror=alert(2)&gt;"));
  // No attribute but those of our own markup.
  std::set<std::string> own, now;
  for (const auto& [html, names] : {std::pair{still(report_page(plain.page()).html), &own},
                                    std::pair{still(page.html), &now}}) {
    const std::regex name("\\s([a-zA-Z0-9:-]+)=\"");
    for (std::sregex_iterator at(html.begin(), html.end(), name), none; at != none; ++at)
      names->insert((*at)[1]);
  }
  CHECK(now == own);
  for (const NamedPlot& plot : page.plots) {
    CHECK(plot.name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                      "0123456789_-") == std::string::npos);
    CHECK_FALSE(contains(plot.svg, "<script"));
    CHECK_FALSE(contains(plot.svg, "<img"));
  }
}

TEST_CASE("report_page: a run that made nothing still has its page", "[postproc][report]") {
  Conversion none;
  Diagnostic error;
  error.code = "NC104";
  error.text = "C word without a number";
  error.where = {"part.ngc", 112, 9};
  none.diagnostics.push_back(error);
  ReportContext context;
  context.input_file = "part.ngc";
  const ReportPage page = report_page({none, context});
  CHECK(contains(page.html, "REFUSED"));
  CHECK(contains(page.html, "C word without a number"));
  CHECK(contains(page.html, "part.ngc:112"));
  CHECK(page.plots.empty());
  CHECK_FALSE(contains(page.html, "id=\"view\""));
}

TEST_CASE("report_page: maps of lead and tilt are drawn when the report has them",
          "[postproc][report]") {
  const Drawn d = drawn();
  PageInput in = d.page();
  const std::string maps = R"({"domain_maps": [
    {"input_line": 42, "lead_deg": [-10, 0, 10], "tilt_deg": [-5, 5],
     "free": [[1, 1, 0], [0, 1, 1]], "programmed": [0, 0], "chosen": [5, 1]},
    {"input_line": 43, "lead_deg": "no list", "tilt_deg": [], "free": 3}, 7]})";
  in.report = maps;
  const ReportPage page = report_page(in);
  std::size_t fields = 0;
  for (const NamedPlot& plot : page.plots)
    if (plot.group == "domain") {
      ++fields;
      CHECK(contains(plot.svg, "input line 42"));
      CHECK(contains(plot.svg, "chosen"));
    }
  CHECK(fields == 1);
  CHECK(contains(page.html, "Room of lead and tilt"));
  for (const char* broken : {"", "[]", "{\"domain_maps\": 1}", "{\"domain_maps\": [{}]}"}) {
    in.report = broken;
    CHECK_FALSE(contains(report_page(in).html, "Room of lead and tilt"));
  }
}

TEST_CASE("report_page: 100000 points stay below 5 MB", "[postproc][report]") {
  // A path of 100,000 blocks that a program of the small one's machine might be: the read-back
  // moves are drawn, so these alone are made longer.
  Drawn d = drawn();
  Conversion& c = d.conversion;
  const ReadBackMove last = c.read.moves.back();
  const std::uint32_t segment = c.line_map[c.line_map.size() / 2].segment;
  std::string program, input;
  for (std::uint32_t i = 0; i < 100000; ++i) {
    ReadBackMove move = last;
    move.rapid = false;
    move.line = last.line + 1 + i;
    move.duration = 0.01;
    const double t = 1e-3 * i;
    move.to[0] = 50.0 * std::cos(t) + 3.0 * std::sin(37.0 * t);
    move.to[1] = 50.0 * std::sin(t) + 3.0 * std::cos(41.0 * t);
    move.to[3] = 0.3 * std::sin(13.0 * t);
    move.to[4] = 0.3 * std::cos(17.0 * t);
    c.read.moves.push_back(move);
    LineMapEntry entry;
    entry.output_line = move.line;
    entry.input_line = i + 1;
    entry.role = MoveRole::path;
    entry.segment = entry.from_segment = segment;
    c.line_map.push_back(entry);
    SmoothedCorner corner;
    corner.method = "acr";
    corner.input_line = i + 1;
    corner.turn = 0.001 * i;
    corner.tip_deviation = 1e-8 * i;
    c.corners.push_back(corner);
    SlowedBy slowed;
    slowed.joint = static_cast<int>(i % 5);
    slowed.first_line = i + 1;
    slowed.last_line = i + 1;
    slowed.factor = 1e-6 * i;
    c.schedule.slowed_by.push_back(slowed);
    Diagnostic warning;
    warning.severity = Severity::warning;
    warning.code = "NC100";
    warning.text = "a warning of this line that says something about what stands in it";
    warning.where = {"part.ngc", static_cast<int>(i + 1), 1};
    c.diagnostics.push_back(warning);
    CutSummary cut;
    cut.label = "CUT " + std::to_string(i);
    c.cuts.push_back(cut);
    program += "N" + std::to_string(i) + " G1 X-12.34567 Y-12.34567 Z14.65910 B-29.367700 F300\n";
    input += "G1 X12.34567 Y12.34567 Z14.65910 A-29.367700 C28.905900\n";
  }
  c.timeline = {};
  PageInput in = d.page();
  in.program_text = program;
  in.input_text = input;
  TriangleMesh part;
  constexpr std::uint32_t kSide = 400;
  for (std::uint32_t y = 0; y < kSide; ++y)
    for (std::uint32_t x = 0; x < kSide; ++x)
      part.vertices.emplace_back(0.31 * x, 0.29 * y, 9.0 * std::sin(0.05 * x + 0.03 * y));
  for (std::uint32_t y = 0; y + 1 < kSide; ++y)
    for (std::uint32_t x = 0; x + 1 < kSide; ++x) {
      const std::uint32_t a = y * kSide + x;
      part.triangles.push_back({a, a + 1, a + kSide});
      part.triangles.push_back({a + 1, a + kSide + 1, a + kSide});
    }
  in.part = &part;
  const ReportPage page = report_page(in);
  CHECK(page.html.size() < 5000000);
  CHECK(page.html.size() > 1000000);
}
