#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "formats/cl/reader.h"
#include "kernels/core/units.h"

// What the tests of this component share: a sink that keeps the calls, and a run of one text.
namespace smoothpost::test {

struct ClSink final : CanonicalSink {
  std::vector<CanonicalMotion> motions;
  std::vector<std::string> events;  ///< "spindle_on rpm=500"
  std::vector<std::string> comments;
  std::vector<std::string> calls;  ///< all in order: "line 3", "arc 4", "rapid 5", "event ..." ...
  std::vector<double> dwells;
  int ends = 0;

  void motion(const CanonicalMotion& m) override {
    motions.push_back(m);
    const char* kind = m.is_arc ? "arc " : m.kind == MotionKind::rapid ? "rapid " : "line ";
    calls.push_back(kind + std::to_string(m.line));
  }
  void dwell(double seconds, std::uint32_t line) override {
    dwells.push_back(seconds);
    calls.push_back("dwell " + std::to_string(line));
  }
  void event(const ProcessEvent& e) override {
    std::string text = e.name;
    for (const auto& [name, value] : e.parameters) text += " " + name + "=" + value;
    events.push_back(text);
    calls.push_back("event " + text);
  }
  void comment(std::string_view text, std::uint32_t) override {
    comments.emplace_back(text);
    calls.push_back("comment " + std::string(text));
  }
  void tool_length(double, int, std::uint32_t) override { calls.emplace_back("tool_length"); }
  void work_offset(const Vec3&, double, int, std::uint32_t) override {
    calls.emplace_back("work_offset");
  }
  void program_end(std::uint32_t) override { ++ends; }
};

struct ClRun {
  ClSink sink;
  bool ok = false;
  Diagnostics diagnostics;
  cl::ReadingSummary summary;

  std::vector<std::string> codes(Severity severity) const {
    std::vector<std::string> out;
    for (const Diagnostic& d : diagnostics)
      if (d.severity == severity) out.push_back(d.code);
    return out;
  }
  std::vector<std::string> errors() const { return codes(Severity::error); }
  bool has(std::string_view code) const {
    return std::any_of(diagnostics.begin(), diagnostics.end(),
                       [&](const Diagnostic& d) { return d.code == code; });
  }
  std::string all_text() const {
    std::string out;
    for (const Diagnostic& d : diagnostics) out += to_string(d) + "\n";
    return out;
  }
};

inline ClRun read_cl(const std::string& text, const cl::ReaderSettings& settings = {}) {
  ClRun out;
  const auto result = cl::read(text, "t.apt", settings, out.sink);
  out.ok = result.ok();
  out.diagnostics = result.diagnostics();
  if (result.ok()) out.summary = result.value();
  return out;
}

/// `lines` in mm at 600 mm/min with a known start at the origin, ended by FINI.
inline ClRun read_lines(const std::string& lines, const cl::ReaderSettings& settings = {}) {
  return read_cl("UNITS/MM\nFEDRAT/600,MMPM\nFROM/0,0,0\n" + lines + "\nFINI\n", settings);
}

inline Vec3 end_of(const CanonicalMotion& m) { return {m.end[0], m.end[1], m.end[2]}; }
inline Vec3 start_of(const CanonicalMotion& m) { return {m.start[0], m.start[1], m.start[2]}; }

/// The point of an arc at share s, from the definition in canonical_motion.h.
inline Vec3 arc_at(const CanonicalMotion& m, double s) {
  const Vec3 spoke = start_of(m) - m.arc.centre;
  const Vec3 along = m.arc.normal * m.arc.normal.dot(spoke);
  const double rise = m.arc.normal.dot(end_of(m) - start_of(m));
  return m.arc.centre + along + rotation_about(m.arc.normal, s * m.arc.sweep) * (spoke - along) +
         s * rise * m.arc.normal;
}

}  // namespace smoothpost::test
