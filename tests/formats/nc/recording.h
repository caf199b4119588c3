#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "formats/nc/interpreter.h"
#include "formats/nc/parser.h"
#include "kernels/core/units.h"

// What the tests of this component share: a sink that keeps the calls, and a run of one text.
namespace smoothpost::test {

/// One call of a sink other than a motion, in the order among all calls.
struct Call {
  std::string kind;  ///< dwell, event, comment, tool_length, work_offset, program_end
  std::string text;
  double number = 0.0;
  int integer = 0;
  Vec3 point = Vec3::Zero();
  std::uint32_t line = 0;
  std::size_t motions_before = 0;
};

struct Recording final : CanonicalSink {
  std::vector<CanonicalMotion> motions;
  std::vector<ProcessEvent> events;
  std::vector<std::string> comments;
  std::vector<Call> calls;

  void motion(const CanonicalMotion& m) override { motions.push_back(m); }
  void dwell(double seconds, std::uint32_t line) override {
    add({"dwell", "", seconds, 0, {}, line, 0});
  }
  void event(const ProcessEvent& e) override {
    events.push_back(e);
    std::string text = e.name;
    for (const auto& [name, value] : e.parameters) text += " " + name + "=" + value;
    add({"event", text, 0.0, 0, Vec3::Zero(), e.line, 0});
  }
  void comment(std::string_view text, std::uint32_t line) override {
    comments.emplace_back(text);
    add({"comment", std::string(text), 0.0, 0, Vec3::Zero(), line, 0});
  }
  void tool_length(double length, int tool, std::uint32_t line) override {
    add({"tool_length", "", length, tool, Vec3::Zero(), line, 0});
  }
  void work_offset(const Vec3& origin, double rotation, int system, std::uint32_t line) override {
    add({"work_offset", "", rotation, system, origin, line, 0});
  }
  void program_end(std::uint32_t line) override {
    add({"program_end", "", 0.0, 0, Vec3::Zero(), line, 0});
  }

  std::vector<Call> of(std::string_view kind) const {
    std::vector<Call> out;
    std::copy_if(calls.begin(), calls.end(), std::back_inserter(out),
                 [&](const Call& call) { return call.kind == kind; });
    return out;
  }
  std::vector<std::string> event_texts() const {
    std::vector<std::string> out;
    for (const Call& call : of("event")) out.push_back(call.text);
    return out;
  }

 private:
  void add(Call call) {
    call.motions_before = motions.size();
    calls.push_back(std::move(call));
  }
};

struct Run {
  Recording sink;
  bool ok = false;          ///< neither parse nor interpret found an error
  Diagnostics diagnostics;  ///< of both
  nc::InterpretationSummary summary;

  /// The codes of the errors, in order.
  std::vector<std::string> errors() const { return codes(Severity::error); }
  std::vector<std::string> codes(Severity severity) const {
    std::vector<std::string> out;
    for (const Diagnostic& d : diagnostics) {
      if (d.severity == severity) out.push_back(d.code);
    }
    return out;
  }
  std::string all_text() const {
    std::string out;
    for (const Diagnostic& d : diagnostics) out += to_string(d) + "\n";
    return out;
  }
  bool has(std::string_view code) const {
    return std::any_of(diagnostics.begin(), diagnostics.end(),
                       [&](const Diagnostic& d) { return d.code == code; });
  }
};

inline Run run(const std::string& text, const nc::InterpreterSettings& settings = {},
               nc::InputDialect dialect = nc::InputDialect::linuxcnc) {
  Run out;
  const nc::ParsedProgram parsed = nc::parse(text, "t.ngc", dialect);
  const auto result = nc::interpret(parsed.program, settings, out.sink);
  out.diagnostics = parsed.diagnostics;
  out.diagnostics.insert(out.diagnostics.end(), result.diagnostics().begin(),
                         result.diagnostics().end());
  out.ok = !has_error(out.diagnostics);
  if (result.ok()) out.summary = result.value();
  return out;
}

/// `lines` ended by M2.
inline Run run_lines(const std::string& lines, const nc::InterpreterSettings& settings = {}) {
  return run(lines + "\nM2\n", settings);
}

/// A mill's process table, as a machine file would hold it.
inline ProcessTable mill_table() {
  ProcessTable table;
  const std::pair<const char*, const char*> rows[] = {{"spindle_on", "M3 S{rpm}"},
                                                      {"spindle_on_reverse", "M4 S{rpm}"},
                                                      {"spindle_off", "M5"},
                                                      {"coolant_on", "M8"},
                                                      {"coolant_off", "M9"},
                                                      {"tool_change", "T{tool} M6"},
                                                      {"stop", "M0"},
                                                      {"optional_stop", "M1"},
                                                      {"message", "(MSG, {text})"}};
  for (const auto& [event, text] : rows) {
    EventWords words;
    words.event = event;
    words.text = text;
    table.events.push_back(words);
  }
  return table;
}

inline nc::InterpreterSettings mill_settings() {
  nc::InterpreterSettings settings;
  settings.process = mill_table();
  settings.tool_lengths = {{1, 50.0}, {2, 20.0}};
  return settings;
}

inline double degrees(double radians) { return degrees_from_radians(radians); }

}  // namespace smoothpost::test
