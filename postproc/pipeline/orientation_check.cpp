#include "postproc/pipeline/orientation_check.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"

namespace smoothpost {

namespace {

constexpr double kSampleWay = 0.25;       // mm, half of the frames' window
constexpr double kTurnsBack = 0.5 * kPi;  // from one sample to the next: nothing lies between

double chord_angle(double chord) { return 2.0 * std::asin(std::min(1.0, 0.5 * chord)); }

/// What an angle atan2(O·T, O·N) may change when O moves by `chord`; `sine` is O·B.
double angle_allowance(double chord, double sine) {
  const double in_plane = std::sqrt(std::max(0.0, 1.0 - sine * sine));
  return chord < in_plane ? std::asin(chord / in_plane) : kPi;
}

/// Largest |tan(tilt ± allowance) − tan(programmed)|; infinite when that passes a right angle.
double tangent_deviation(double tilt, double programmed, double allowance) {
  if (std::abs(tilt) + allowance >= 0.5 * kPi) return INFINITY;
  return std::max(std::abs(std::tan(tilt + allowance) - std::tan(programmed)),
                  std::abs(std::tan(tilt - allowance) - std::tan(programmed)));
}

}  // namespace

bool orientation_is_free(const MachineDefinition& machine) {
  return machine.recipe.kind == "laser" && machine.recipe.orientation != "programmed" &&
         (machine.tolerance.lead > 0.0 || machine.tolerance.tilt > 0.0);
}

std::optional<OrientationInput> orientation_input(const MachineDefinition& machine,
                                                  const ReferencePath& reference,
                                                  const std::vector<Cut>& cuts,
                                                  const TriangleTree* part) {
  OrientationInput input;
  input.free = orientation_is_free(machine);
  const bool nozzle =
      machine.recipe.kind == "laser" && machine.tool.gap > 0.0 && machine.tool.land_radius > 0.0;
  if (!input.free && !(nozzle && part != nullptr)) return {};
  for (const Cut& cut : cuts)
    if (!cut.omitted) input.frames.emplace_back(reference, cut.first, cut.last, part);
  return input;
}

std::string orientation_assumption(const OrientationInput& input) {
  const bool part = !input.frames.empty() && input.frames.front().from_part();
  return std::string(
             "lead and tilt of the beam are free inside their tolerances; they are counted "
             "from the programmed tool axis, in the plane of the cut's direction and ") +
         (part ? "the part's normal" : "the programmed tool axis (no part was given)");
}

const CuttingFrames* OrientationCheck::frames_of(std::uint32_t segment) const {
  const auto behind = std::upper_bound(
      input_.frames.begin(), input_.frames.end(), segment,
      [](std::uint32_t k, const CuttingFrames& frames) { return k < frames.first(); });
  if (behind == input_.frames.begin()) return nullptr;
  const CuttingFrames& frames = *(behind - 1);
  return segment <= frames.last() ? &frames : nullptr;
}

int OrientationCheck::least_steps(double way) const {
  return input_.free ? static_cast<int>(std::ceil(std::min(way / kSampleWay, 1e6))) : 1;
}

void OrientationCheck::see(const OrientationSample& sample) {
  const CuttingFrames* frames = frames_of(sample.place.segment);
  require(frames != nullptr, "a place with a cutting frame");
  const CuttingFrame frame = frames->at(sample.place);
  if (input_.free) see_deviation(sample, frame);
  if (has_nozzle() && sample.beam) see_gap(sample, frame);
}

void OrientationCheck::see_deviation(const OrientationSample& sample, const CuttingFrame& frame) {
  const LeadTilt got = frame.angles(sample.axis);
  const LeadTilt& wanted = frame.programmed;
  Deviation here;
  here.tangent = frame.tangent;
  here.lead = std::abs(got.lead - wanted.lead) +
              angle_allowance(sample.allowance, sample.axis.dot(frame.binormal));
  here.tilt = std::abs(got.tilt - wanted.tilt) +
              angle_allowance(sample.allowance, sample.axis.dot(frame.tangent));
  const Deviation from = before_.value_or(here);
  const double turn = chord_angle((here.tangent - from.tangent).norm());
  const double combined =
      std::max(std::hypot(here.lead, here.tilt), std::hypot(from.lead, from.tilt));
  const double turned = turn < kTurnsBack ? 0.125 * turn * turn * combined : 0.0;
  here.exit_edge = tangent_deviation(got.tilt, wanted.tilt,
                                     here.tilt - std::abs(got.tilt - wanted.tilt) + turned);
  widest_tilt_ = std::max(widest_tilt_, std::abs(wanted.tilt));
  const auto see = [&](Worst& worst, double value) {
    worst.see(value, sample.output_line, sample.time, sample.input_line);
  };
  see(lead_, degrees_from_radians(std::max(here.lead, from.lead) + turned));
  see(tilt_, degrees_from_radians(std::max(here.tilt, from.tilt) + turned));
  see(exit_edge_, machine_.workpiece.thickness * std::max(here.exit_edge, from.exit_edge));
  before_ = here;
}

void OrientationCheck::see_gap(const OrientationSample& sample, const CuttingFrame& frame) {
  const double angle = angle_between(sample.axis, frame.normal) + chord_angle(sample.allowance);
  angle_.see(angle, sample.output_line, sample.time, sample.input_line);
}

Checks OrientationCheck::checks() const {
  Checks checks;
  // What has no freedom of its own is kept as any tool axis is.
  const double lead = std::max(machine_.tolerance.lead, machine_.tolerance.axis);
  const double tilt = std::max(machine_.tolerance.tilt, machine_.tolerance.axis);
  if (input_.free && lead_.seen()) {
    checks.push_back(lead_.check("lead_deviation", degrees_from_radians(lead), "deg"));
    checks.push_back(tilt_.check("tilt_deviation", degrees_from_radians(tilt), "deg"));
    const double implied =
        std::tan(std::min(widest_tilt_ + tilt, 0.4999 * kPi)) - std::tan(widest_tilt_);
    checks.push_back(exit_edge_.check(
        "exit_edge_deviation",
        machine_.tolerance.exit_edge.value_or(machine_.workpiece.thickness * implied), "mm"));
  }
  if (!angle_.seen()) return checks;
  const double angle = angle_.value();
  Check gap = angle_.check("tilted_gap", machine_.tool.min_gap, "mm");
  gap.value = tilted_gap(machine_.tool.gap, machine_.tool.land_radius, std::min(angle, 0.5 * kPi));
  gap.ok = std::isfinite(angle) && gap.value >= gap.limit;
  if (!input_.frames.front().from_part())
    gap.note = "no part was given: the surface's normal is taken to be the programmed tool axis";
  checks.push_back(gap);
  return checks;
}

}  // namespace smoothpost
