#include <algorithm>
#include <cmath>

#include "kernels/core/units.h"
#include "machines/dialects/decimal.h"
#include "machines/import/imported_machine.h"

namespace smoothpost {

namespace {

constexpr int kDigits = 9;
constexpr double kLargest = 1e6;                            // mm or deg in a machine file
constexpr double kMostAcceleration = 4.0, kMostJerk = 8.0;  // of kLargest, with s² and s³
constexpr double kLeastRange = 1e-6;                        // mm or deg
constexpr double kSlowRotary = 30.0 * kRadiansPerDegree;
constexpr double kSlowLinear = 100.0;
constexpr double kAccelerationPerVelocity = 4.0;  // 1/s
constexpr double kJerkPerAcceleration = 10.0;     // 1/s

std::string number(double value) {
  std::string text;
  append_decimal(text, value, kDigits);
  return text;
}

std::string list(const Vec3& v) {
  return "[" + number(v.x()) + ", " + number(v.y()) + ", " + number(v.z()) + "]";
}

/// Printable ASCII: the file is valid UTF-8 whatever the source holds.
std::string one_line(std::string_view text) {
  std::string out;
  for (const char c : text.substr(0, 200)) {
    const auto code = static_cast<unsigned char>(c);
    out += code < 0x20 ? ' ' : code < 0x7f ? c : '?';
  }
  return out;
}

std::string quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : one_line(text)) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

std::string machine_name(const std::string& text) {
  std::string out;
  for (const char c : text.substr(0, 60)) {
    const bool fits = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                      c == '_' || c == '-';
    if (fits || (!out.empty() && out.back() != '_')) out += fits ? c : '_';
  }
  while (!out.empty() && out.back() == '_') out.pop_back();
  return out.empty() ? "imported" : out;
}

struct Limits {
  double velocity = 0.0, acceleration = 0.0, jerk = 0.0;
};
Limits limits_with_assumed(const ImportedAxis& axis) {
  const double slow = axis.kind == JointKind::rotary ? kSlowRotary : kSlowLinear;
  Limits out;
  out.velocity = axis.velocity.value_or(slow);
  out.acceleration = axis.acceleration.value_or(kAccelerationPerVelocity * out.velocity);
  out.jerk = axis.jerk.value_or(kJerkPerAcceleration * out.acceleration);
  return out;
}

class Printer {
 public:
  std::string text;

  void line(const std::string& words) { text += words + "\n"; }

  void row(const std::string& key, const std::string& value, const std::string& note = {}) {
    line(key + " = " + value + (note.empty() ? "" : "  # assumed: " + one_line(note)));
  }

  void axis(const ImportedAxis& a) {
    const bool rotary = a.kind == JointKind::rotary;
    const double scale = rotary ? kDegreesPerRadian : 1.0;
    const std::string unit = rotary ? "deg" : "mm";
    line("[[axis]]" + (a.comment.empty() ? "" : "  # " + one_line(a.comment)));
    row("name", quoted(a.name));
    row("letter", quoted(std::string(1, a.letter)));
    row("type", rotary ? "\"rotary\"" : "\"linear\"");
    row("chain", a.side == ChainSide::tool ? "\"tool\"" : "\"workpiece\"");
    row("direction", list(a.direction.normalized()), a.direction_note);
    if (rotary) row("origin_mm", list(a.origin), a.origin_note);
    row("min_" + unit, number(a.lower.value * scale), a.lower.note);
    row("max_" + unit, number(a.upper.value * scale), a.upper.note);
    const bool zero = a.lower.value <= 0.0 && a.upper.value >= 0.0;
    if (a.home && *a.home >= a.lower.value && *a.home <= a.upper.value)
      row("home", number(*a.home * scale));
    else if (!zero)
      row("home", number(0.5 * (a.lower.value + a.upper.value) * scale),
          "the middle of the range, as 0 is outside of it");
    if (a.cyclic) row("cyclic", "true");
    if (a.redundant) row("redundant", "true");
    limits(a, scale, unit);
    line("");
  }

  void limits(const ImportedAxis& a, double scale, const std::string& unit) {
    const Limits l = limits_with_assumed(a);
    const auto not_said = [](bool said, const char* rule) {
      return said ? std::string() : std::string(rule);
    };
    row("max_velocity_" + unit + "_per_s", number(l.velocity * scale),
        not_said(a.velocity.has_value(), "slow, as the source says none"));
    row("max_acceleration_" + unit + "_per_s2", number(l.acceleration * scale),
        not_said(a.acceleration.has_value(), "4 times the velocity, as the source says none"));
    row("max_jerk_" + unit + "_per_s3", number(l.jerk * scale),
        not_said(a.jerk.has_value(), "10 times the acceleration, as the source says none"));
    const bool known = a.velocity && a.acceleration && a.jerk;
    row("source", known ? "\"datasheet\"" : "\"assumed\"");
  }
};

std::string flange_text(const Pose& flange) {
  // R = Rz(c) Ry(b) Rx(a)
  const Mat3 r = flange.linear();
  const double b = std::atan2(-r(2, 0), std::hypot(r(0, 0), r(1, 0)));
  double a = 0.0, c = 0.0;
  if (std::hypot(r(0, 0), r(1, 0)) > 1e-9) {
    a = std::atan2(r(2, 1), r(2, 2));
    c = std::atan2(r(1, 0), r(0, 0));
  } else {
    c = std::atan2(-r(0, 1), r(1, 1));
  }
  const Vec3 degrees = Vec3(a, b, c) * kDegreesPerRadian;
  return "{ xyz_mm = " + list(flange.translation()) + ", rpy_deg = " + list(degrees) + " }";
}

void tool(Printer& p, const ImportedMachine& m) {
  p.line("[tool]");
  p.row("tip_mm", list(m.tip), m.tool_note);
  p.row("axis", list(m.tool_axis.normalized()));
  if (m.flange) p.row("flange", flange_text(*m.flange));
  p.line("");
  p.line("[workpiece]  # assumed: the part's zero lies at the origin of M; --work-offset moves it");
  p.line("frame = { xyz_mm = [0, 0, 0], rpy_deg = [0, 0, 0] }");
  p.line("");
}

void rest(Printer& p, const ImportedMachine& m) {
  p.line("# [[body]]: no collision shapes were imported; see docs/machine_file.md");
  for (const std::string& line : m.left_out) p.line("# " + one_line(line));
  p.line("");
  p.line("# [links]: where the tool may cross over the part; the source does not say.");
  p.line("# [links]");
  p.line("# clearance_mm = 20");
  if (m.kind == "five_axis") p.line("# retract_axis = \"Z\"");
  p.line("# retract_mm = 0");
  p.line("");
  p.line("[tolerance]  # assumed: state what the work needs");
  p.line("tip_mm = 0.02");
  p.line("axis_deg = 0.05");
  p.line("");
  p.line("[recipe]");
  p.row("kind", quoted(m.kind));
  p.line("");
  p.line("[dialect]");
  p.row("name", quoted(m.dialect));
  p.line("mode = \"joint\"");
  p.row("units", quoted(m.units));
  p.line("");
  p.line(
      "# [process.events]: a row is a promise that the machine has the thing. Take away the # of");
  p.line("# the rows that are true of it, and of the heading.");
  p.line("# [process.events]");
  for (const std::string& row : m.events) p.line("# " + row);
}

}  // namespace

std::string machine_text(const ImportedMachine& m) {
  Printer p;
  p.line("# Imported from " + one_line(m.source) +
         ". Numbers with \"assumed\" behind them are not in that file:");
  p.line("# replace them by measured ones before a certificate is to mean something.");
  p.line("schema = 1");
  p.row("name", quoted(machine_name(m.name)));
  p.row("description", quoted(m.description));
  p.line("");
  for (const ImportedAxis& axis : m.axes) p.axis(axis);
  tool(p, m);
  rest(p, m);
  return p.text;
}

std::string assumptions(const ImportedMachine& m) {
  std::string limits, ranges, places;
  const auto name = [](std::string& into, const ImportedAxis& a) {
    into += (into.empty() ? "" : ", ") + a.name;
  };
  for (const ImportedAxis& a : m.axes) {
    if (!a.velocity || !a.acceleration || !a.jerk) name(limits, a);
    if (!a.lower.note.empty() || !a.upper.note.empty()) name(ranges, a);
    if (!a.direction_note.empty() || !a.origin_note.empty()) name(places, a);
  }
  std::string text;
  const auto add = [&text](const std::string& what) { text += (text.empty() ? "" : "; ") + what; };
  if (!places.empty()) add("direction, sign or place of " + places);
  if (!m.tool_note.empty()) add("the tool (" + m.tool_note + ")");
  if (!ranges.empty()) add("range of " + ranges);
  if (!limits.empty()) add("velocity, acceleration or jerk of " + limits);
  return text;
}

Diagnostics check_imported(const ImportedMachine& m, const std::string& file) {
  Diagnostics out;
  const auto error = [&](const char* code, std::string text) {
    out.push_back({Severity::error, code, std::move(text), {file, 0, 0}});
  };
  if (m.axes.empty()) error("MF204", "there is no axis to import");
  if (m.axes.size() > static_cast<std::size_t>(kMaxJoints)) {
    error("MF204", std::to_string(m.axes.size()) + " axes; at most " + std::to_string(kMaxJoints) +
                       " can be used");
    return out;
  }
  for (std::size_t i = 0; i < m.axes.size(); ++i) {
    const ImportedAxis& a = m.axes[i];
    const double scale = a.kind == JointKind::rotary ? kDegreesPerRadian : 1.0;
    for (std::size_t k = 0; k < i; ++k)
      if (m.axes[k].name == a.name || m.axes[k].letter == a.letter)
        error("MF204",
              "axes " + m.axes[k].name + " and " + a.name + " have the same name or letter");
    const Limits l = limits_with_assumed(a);
    const double largest =
        std::max({std::abs(a.lower.value) * scale, std::abs(a.upper.value) * scale,
                  a.origin.cwiseAbs().maxCoeff(), l.velocity * scale,
                  l.acceleration * scale / kMostAcceleration, l.jerk * scale / kMostJerk});
    if (!(largest <= kLargest)) {
      error("MF203", "axis " + a.name + ": a range, limit or place is beyond 1000000 mm or deg");
      continue;
    }
    if (!((a.upper.value - a.lower.value) * scale > kLeastRange))
      error("MF203", "axis " + a.name + ": its range " + number(a.lower.value * scale) + " to " +
                         number(a.upper.value * scale) + " is empty or reversed");
    if (std::min({l.velocity, l.acceleration, l.jerk}) * scale < 1e-6)
      error("MF203",
            "axis " + a.name + ": a velocity, acceleration or jerk is 0 or below 0.000001");
  }
  if (!(m.tip.cwiseAbs().maxCoeff() <= kLargest)) error("MF203", "the tool is beyond 1000000 mm");
  return out;
}

}  // namespace smoothpost
