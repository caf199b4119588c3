#include "postproc/pipeline/finish_told.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/units.h"

namespace smoothpost {

namespace {

constexpr double kDepthShare = 0.1;    // of the depth, that it may be off
constexpr std::size_t kMostTold = 40;  // heights in a message
constexpr double kNothing = 1e-3;      // mm

std::string number(double value, int digits = 3) { return finish_number(value, digits); }

LeftOut sum_of(const std::vector<FinishLayer>& layers) {
  LeftOut sum;
  for (const FinishLayer& layer : layers) {
    sum.flat += layer.left_out.flat;
    sum.buried += layer.left_out.buried;
    sum.mill += layer.left_out.mill;
    sum.reach += layer.left_out.reach;
    sum.too_short += layer.left_out.too_short;
    sum.rough += layer.left_out.rough;
  }
  return sum;
}

/// Filled in but for its name.
Check planned(const char* unit, double value, double limit) {
  Check check;
  check.unit = unit;
  check.value = value;
  check.limit = limit;
  check.ok = value <= limit * (1.0 + 1e-6);
  check.planned = true;
  return check;
}

/// "12.5 mm: 3.2 of 40 mm; 13.5 mm: ..." of the layers of which something is out of reach.
std::string out_of_reach(const std::vector<FinishLayer>& layers, std::size_t& count) {
  std::string text;
  for (const FinishLayer& layer : layers) {
    if (!(layer.left_out.reach > kNothing)) continue;
    if (++count > kMostTold) continue;
    text += (text.empty() ? "" : "; ") + number(layer.height) +
            " mm: " + number(layer.left_out.reach, 1) + " of " + number(layer.length, 1) + " mm";
  }
  return count > kMostTold ? text + "; ..." : text;
}

}  // namespace

std::string finish_number(double value, int digits) {
  double scale = 1.0;
  for (int i = 0; i < digits; ++i) scale *= 10.0;
  std::string text = std::to_string(std::round(value * scale) / scale);
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text;
}

Diagnostic finish_message(Severity severity, const char* code, std::string text,
                          const std::string& file) {
  Diagnostic d;
  d.severity = severity;
  d.code = code;
  d.text = std::move(text);
  d.where.file = file;
  return d;
}

Diagnostics finish_warnings(const FinishSettings& settings, const std::vector<FinishLayer>& layers,
                            const FinishFindings& found, const std::string& file) {
  Diagnostics out;
  const auto warn = [&](const char* code, std::string text) {
    out.push_back(finish_message(Severity::warning, code, std::move(text), file));
  };
  double length = 0.0;
  for (const FinishLayer& layer : layers) length += layer.length;
  const std::string of_all = " of " + number(length, 1) + " mm of contours are left out";
  const LeftOut sum = sum_of(layers);
  std::string why;
  const auto reason = [&why](double value, const std::string& text) {
    if (value > kNothing) why += (why.empty() ? "" : ", ") + number(value, 1) + " mm " + text;
  };
  reason(sum.flat, "on walls steeper than " + number(degrees_from_radians(settings.steepest)) +
                       " deg against the tool axis' reach (--steepest)");
  reason(sum.buried, "inside of another body of the mesh");
  reason(sum.mill, "where a mill of radius " + number(settings.mill.radius) +
                       " mm would cut into another wall (--mill)");
  reason(sum.too_short,
         "in pieces between edges that are shorter than " + number(kShortestPiece) + " mm");
  reason(sum.rough, "where no smooth curve follows the contour");
  const double known = sum.flat + sum.buried + sum.mill + sum.too_short + sum.rough;
  if (!why.empty()) warn("RG134", number(known, 1) + of_all + ": " + why);
  std::size_t count = 0;
  const std::string heights = out_of_reach(layers, count);
  if (count > 0)
    warn("RG141",
         number(sum.reach, 1) + of_all +
             " on your word (--unreachable leave-out), as the machine cannot be there, in " +
             std::to_string(count) + " layers; by height " + heights);
  if (found.inner > 0)
    warn("RG142", std::to_string(found.inner) +
                      " contours inside of others are left out on your word (--contours outer)");
  if (found.parted > 0)
    warn("RG140", "contours were parted at " + std::to_string(found.parted) +
                      " places, as no curve within " + number(settings.tip_tolerance, 4) +
                      " mm and " + number(degrees_from_radians(settings.axis_tolerance)) +
                      " deg goes on there: each part is a cut of its own. --normal-tolerance and "
                      "--tip-tolerance allow more");
  if (found.folded > 0)
    warn("RG135", "the stock " + number(settings.depth) + " mm outside the part folds at " +
                      std::to_string(found.folded) + " triangles, first at triangle " +
                      std::to_string(found.first_folded + 1) +
                      ": the part is too hollow there for that depth. The depth of cut is measured "
                      "in the stock as it is");
  if (found.open > 0)
    warn("RG136", std::to_string(found.open) +
                      " contours are open: the mesh has holes there, and the body is taken to be "
                      "on the side that its triangles say");
  if (found.against > 0)
    warn("RG137", std::to_string(found.against) +
                      " contours have triangles wound the wrong way round: the outside is taken "
                      "from how contours lie in each other");
  return out;
}

Checks finish_checks(const FinishSettings& settings, const FinishFindings& found) {
  const DepthOfCut& d = found.depth;
  Check depth = planned("mm", std::max(d.greatest - settings.depth, settings.depth - d.least),
                        settings.depth_tolerance.value_or(kDepthShare * settings.depth));
  depth.name = "depth_of_cut";
  depth.note = "depth of cut along the contours, in the stock: least " + number(d.least) +
               ", mean " + number(d.mean()) + ", greatest " + number(d.greatest) +
               " mm; asked for " + number(settings.depth);
  Check moved = planned("mm", found.moved, settings.tip_tolerance);
  moved.name = "contour_deviation";
  Check turned = planned("deg", degrees_from_radians(found.turned),
                         degrees_from_radians(settings.axis_tolerance));
  turned.name = "axis_to_normal";
  // Smoothing moves tip and axis by their tolerances.
  Check room = planned("mm", std::max(0.0, -found.room),
                       kMillShare * settings.depth + settings.tip_tolerance +
                           settings.axis_tolerance * settings.mill.radius);
  room.name = "mill_room";
  room.note = "how far a mill of radius " + number(settings.mill.radius) + " and length " +
              number(settings.mill.length) + " mm is in the part, leads included";
  return {depth, moved, turned, room};
}

}  // namespace smoothpost
