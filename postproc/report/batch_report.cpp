#include "postproc/report/batch_report.h"

#include <map>
#include <nlohmann/json.hpp>

#include "postproc/report/html_table.h"
#include "postproc/report/html_text.h"

namespace smoothpost {

std::string_view page_asset(std::string_view name);  // made by cmake/embed_files.cmake

namespace {

using Json = nlohmann::ordered_json;

constexpr int kSchema = 1;

std::optional<BatchRecord::Value> check_value(const Json& check) {
  const auto value = check.find("value"), limit = check.find("limit");
  if (value == check.end() || limit == check.end() || !value->is_number() || !limit->is_number())
    return {};
  return BatchRecord::Value{value->get<double>(), limit->get<double>()};
}

void add_checks(const Json& checks, BatchRecord& record) {
  for (const Json& check : checks) {
    ++record.checks;
    if (!check.value("ok", false)) ++record.failed_checks;
    const std::string name = check.value("name", "");
    if (name == "tip_deviation") record.tip = check_value(check);
    if (name == "axis_deviation") record.axis = check_value(check);
  }
}

Json value_json(const std::optional<BatchRecord::Value>& value) {
  return value ? Json{{"value", value->value}, {"limit", value->limit}} : Json(nullptr);
}

Json figures_json(const BatchRecord& r) {
  return {{"job", r.job},
          {"status", r.status},
          {"verdict", r.verdict},
          {"message", r.message},
          {"tip_mm", value_json(r.tip)},
          {"axis_deg", value_json(r.axis)},
          {"checks", r.checks},
          {"failed_checks", r.failed_checks},
          {"blocks", r.blocks},
          {"lines", r.lines},
          {"time_s", r.time ? Json(*r.time) : Json(nullptr)},
          {"program", r.program},
          {"report", r.report},
          {"page", r.page},
          {"log", r.log}};
}

Json hashes_json(const std::vector<FileHash>& files) {
  Json list = Json::array();
  for (const FileHash& f : files) list.push_back({{"path", f.path}, {"sha256", f.sha256}});
  return list;
}

std::vector<FileHash> hashes_of(const Json& list) {
  std::vector<FileHash> files;
  for (const Json& f : list) files.push_back({f.at("path"), f.at("sha256")});
  return files;
}

std::optional<BatchRecord::Value> value_of(const Json& json) {
  if (json.is_null()) return {};
  return BatchRecord::Value{json.at("value"), json.at("limit")};
}

std::string cell(const std::string& html) { return "<td>" + html + "</td>"; }

std::string link(const std::string& path, const char* words) {
  if (path.empty()) return {};
  return "<a href=\"" + escape_html(path) + "\">" + words + "</a> ";
}

std::string share_words(const std::optional<BatchRecord::Value>& value) {
  return value ? short_number(value->value) + " of " + short_number(value->limit) : std::string();
}

std::string page_row(const BatchRecord& r) {
  const std::string checks = r.checks == 0 ? std::string()
                                           : std::to_string(r.checks - r.failed_checks) + " of " +
                                                 std::to_string(r.checks);
  return std::string(r.status == 0 ? "<tr>" : "<tr class=\"failed\">") + cell(escape_html(r.job)) +
         cell("<strong>" + escape_html(r.verdict) + "</strong>") + number_cell(checks) +
         number_cell(share_words(r.tip)) + number_cell(share_words(r.axis)) +
         number_cell(r.blocks ? std::to_string(r.blocks) : "") +
         number_cell(r.time ? short_number(*r.time) : "") +
         cell(link(r.program, "program") + link(r.page, "report page") + link(r.report, "report") +
              link(r.log, "messages")) +
         cell(r.status == 0 ? "" : escape_html(r.message)) + "</tr>\n";
}

}  // namespace

void add_report_figures(std::string_view report, BatchRecord& record) {
  const Json json = Json::parse(report, nullptr, false);
  if (!json.is_object()) return;
  if (json.contains("checks") && json["checks"].is_array()) add_checks(json["checks"], record);
  if (json.contains("output") && json["output"].is_object()) {
    record.blocks = json["output"].value("blocks", std::size_t{0});
    record.lines = json["output"].value("lines", std::size_t{0});
  }
  if (json.contains("time_s") && json["time_s"].is_object()) {
    const auto time = json["time_s"].find("scheduled");
    if (record.blocks > 0 && time != json["time_s"].end() && time->is_number())
      record.time = time->get<double>();
  }
}

std::string batch_record_json(const BatchRecord& r) {
  Json json = {{"schema", kSchema},
               {"version", r.version},
               {"settings_sha256", r.settings_sha256},
               {"result", figures_json(r)},
               {"read", hashes_json(r.read)},
               {"written", hashes_json(r.written)}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::optional<BatchRecord> read_batch_record(std::string_view text) {
  try {
    const Json json = Json::parse(text);
    if (json.at("schema") != kSchema) return {};
    const Json& f = json.at("result");
    BatchRecord r;
    r.version = json.at("version");
    r.settings_sha256 = json.at("settings_sha256");
    r.job = f.at("job");
    r.status = f.at("status");
    r.verdict = f.at("verdict");
    r.message = f.at("message");
    r.tip = value_of(f.at("tip_mm"));
    r.axis = value_of(f.at("axis_deg"));
    r.checks = f.at("checks");
    r.failed_checks = f.at("failed_checks");
    r.blocks = f.at("blocks");
    r.lines = f.at("lines");
    if (!f.at("time_s").is_null()) r.time = f.at("time_s").get<double>();
    r.program = f.at("program");
    r.report = f.at("report");
    r.page = f.at("page");
    r.log = f.at("log");
    r.read = hashes_of(json.at("read"));
    r.written = hashes_of(json.at("written"));
    return r;
  } catch (const nlohmann::json::exception&) {
    return {};
  }
}

std::string batch_count_words(const std::vector<BatchRecord>& records) {
  std::map<std::string, std::size_t> counts;
  for (const BatchRecord& r : records) ++counts[r.verdict];
  std::string words = std::to_string(records.size()) + (records.size() == 1 ? " job" : " jobs");
  const char* separator = ": ";
  for (const char* verdict :
       {"certified", "limits_only", "forced", "refused", "crashed", "not run"}) {
    const auto found = counts.find(verdict);
    if (found == counts.end()) continue;
    words += separator + std::to_string(found->second) + " " + verdict;
    separator = ", ";
  }
  return words;
}

std::string batch_summary_json(const std::string& job_file,
                               const std::vector<BatchRecord>& records) {
  Json jobs = Json::array();
  for (const BatchRecord& r : records) jobs.push_back(figures_json(r));
  const Json json = {{"schema", kSchema}, {"job_file", job_file}, {"jobs", jobs}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string batch_summary_page(const std::string& job_file,
                               const std::vector<BatchRecord>& records) {
  std::size_t good = 0;
  std::string rows;
  for (const BatchRecord& r : records) {
    if (r.status == 0) ++good;
    rows += page_row(r);
  }
  const bool all = good == records.size();
  const std::string title = escape_html(job_file);
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
         "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
         "'unsafe-inline'; base-uri 'none'; form-action 'none'\">\n<title>" +
         title + ": batch</title>\n<style>\n" + std::string(page_asset("page.css")) +
         "</style>\n</head>\n<body>\n<header>\n<h1>" + title + "</h1>\n<div class=\"verdict " +
         (all ? "good" : "bad") + "\"><strong>" + std::to_string(good) + " OF " +
         std::to_string(records.size()) + "</strong><p>" + escape_html(batch_count_words(records)) +
         "</p></div>\n</header>\n<main>\n<table>\n<thead><tr><th>Job</th><th>Verdict</th>"
         "<th>Checks kept</th><th>Tip, mm</th><th>Axis, deg</th><th>Blocks</th><th>Time, s</th>"
         "<th>Files</th><th>Why not</th></tr></thead>\n<tbody>\n" +
         rows + "</tbody>\n</table>\n</main>\n</body>\n</html>\n";
}

}  // namespace smoothpost
