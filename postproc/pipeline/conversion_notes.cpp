#include "postproc/pipeline/conversion_notes.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "machines/dialects/decimal.h"
#include "postproc/pipeline/conversion_parts.h"

namespace smoothpost {

namespace {

constexpr std::size_t kMostLines = 8;  // in a message

Diagnostic note(const char* code, Severity severity, std::string text, const std::string& file,
                std::uint32_t line) {
  Diagnostic d = diagnostic(code, std::move(text), file, static_cast<int>(line));
  d.severity = severity;
  return d;
}

}  // namespace

std::string number(double value) {
  std::string text = std::to_string(value);
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text;
}

std::string four_digits(double value) {
  if (!(std::abs(value) > 0.0)) return "0";
  const int places = 3 - static_cast<int>(std::floor(std::log10(std::abs(value))));
  std::string text;
  append_decimal(text, value, std::clamp(places, 0, 9));
  return text;
}

SmoothingSettings smoothing_settings(const MachineDefinition& machine) {
  const auto& r = machine.recipe;
  const auto& tolerance = machine.tolerance;
  SmoothingSettings s;
  s.kind = r.smoothing == "acr" ? BlendKind::acr : BlendKind::ramp;
  s.shape = {r.kappa, r.lambda};
  s.paper_shape = r.shape == "paper";
  s.ramp_c1 = r.ramp_c1;
  s.merge_tip = tolerance.tip * tolerance.budget.merge;
  s.merge_axis = tolerance.axis * tolerance.budget.merge;
  s.corner_tip = tolerance.tip * tolerance.budget.smoothing;
  s.corner_axis = tolerance.axis * tolerance.budget.smoothing;
  s.whole_rotation = r.task == "pose";
  s.fit_dense = r.dense == "curve";
  return s;
}

Diagnostic tuning_note(const TuningResult& t, bool acr, const std::string& file_name) {
  const auto shape_text = [acr](const BlendShape& shape) {
    return acr ? "kappa " + number(shape.acr.kappa) + ", lambda " + number(shape.acr.lambda)
               : "c1 " + number(shape.c1);
  };
  return note("KN133", Severity::note,
              "shape of the corners tuned to the joints: " + shape_text(t.before) + " -> " +
                  shape_text(t.after) + ", peak joint jerk at constant feed " +
                  (t.peak_before > 0.0 ? number(100.0 * t.peak_after / t.peak_before) : "100") +
                  " % of before, on the " + std::to_string(t.corners) + " sharpest corners",
              file_name, 0);
}

Diagnostics posture_notes(const JointPlan& plan, const std::string& file_name) {
  Diagnostics notes;
  if (plan.spin_gain) {
    const SpinGain& g = *plan.spin_gain;
    notes.push_back(
        note("KN131", Severity::note,
             "rotation about the tool optimised: least margin of the joints " +
                 number(g.margin_before) + " before, " + number(g.margin_after) +
                 " after (share of the range); rms third difference of the joints " +
                 (g.jerk_before > 0.0 ? number(100.0 * g.jerk_after / g.jerk_before) : "100") +
                 " % of before",
             file_name, 0));
  }
  for (const std::string_view kind : {"wrist", "elbow", "shoulder"}) {
    double least = 1.0;
    std::uint32_t nearest = 0;
    std::string lines;
    std::size_t count = 0;
    for (const SingularPlace& place : plan.singular) {
      if (place.kind != kind) continue;
      if (place.measure < least) nearest = place.line;
      least = std::min(least, place.measure);
      if (++count <= kMostLines) lines += (count > 1 ? ", " : "") + std::to_string(place.line);
    }
    if (count == 0) continue;
    if (count > kMostLines) lines += " and " + std::to_string(count - kMostLines) + " more";
    notes.push_back(
        note("KN132", Severity::warning,
             "the arm passes near a singular " + std::string(kind) + " (measure " + number(least) +
                 ", 0 is singular, below 0.05 is told), input lines " + lines +
                 ": joints turn fast there and blocks are slowed to their limits. Another place of "
                 "the part (smoothpost place) or recipe.spin = \"optimised\" may avoid it",
             file_name, nearest));
  }
  return notes;
}

}  // namespace smoothpost
