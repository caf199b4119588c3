#include "machines/dialects/arc_text.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"
#include "kernels/spline/bent_move.h"
#include "machines/dialects/decimal.h"

namespace smoothpost {

namespace {

struct Letters {
  int code;
  char first, second, third, first_centre, second_centre;
};
constexpr Letters kPlanes[] = {
    {17, 'X', 'Y', 'Z', 'I', 'J'}, {18, 'Z', 'X', 'Y', 'K', 'I'}, {19, 'Y', 'Z', 'X', 'J', 'K'}};

double length_scale(const MachineDefinition& machine) {
  return machine.dialect.units == "inch" ? 1.0 / kMillimetresPerInch : 1.0;
}

/// Joint with this letter when it is linear, else −1.
int linear_joint(const MachineDefinition& machine, char letter) {
  const int j = machine.axis_by_letter(letter);
  if (j < 0 || machine.axes[static_cast<std::size_t>(j)].joint.kind != JointKind::linear) return -1;
  return j;
}

std::string text_of(double value, int decimals) {
  std::string text;
  append_decimal(text, value, decimals);
  return text;
}

std::string shape_problem(const ArcShape& shape) {
  const double least = std::min(shape.from_radius, shape.to_radius);
  if (!(least >= kLeastRadius && least <= kMostRadius))
    return "the radius of the arc, " + text_of(std::min(least, 1e9), 4) + " mm, is not between " +
           text_of(kLeastRadius, 2) + " and " + text_of(kMostRadius, 0) + " mm";
  if (!(std::abs(shape.to_radius - shape.from_radius) <= kRadiusAgreement))
    return "the end is not on the circle: the radius is " + text_of(shape.from_radius, 5) +
           " mm at the start and " + text_of(std::min(shape.to_radius, 1e9), 5) +
           " mm at the end; limit " + text_of(kRadiusAgreement, 4) + " mm apart";
  const double sweep = std::abs(shape.sweep);
  if (sweep < kLeastSweep || sweep > kMostSweep + 1e-9)
    return "the arc turns by " + text_of(degrees_from_radians(sweep), 4) +
           " deg; possible: " + text_of(degrees_from_radians(kLeastSweep), 4) +
           " to 270 deg. Full circles and longer arcs are to be divided";
  return {};
}

}  // namespace

std::vector<ArcPlane> arc_planes(const MachineDefinition& machine) {
  std::vector<ArcPlane> planes;
  for (const Letters& p : kPlanes) {
    const int first = linear_joint(machine, p.first), second = linear_joint(machine, p.second);
    if (first < 0 || second < 0) continue;
    planes.push_back(
        {p.code, first, second, linear_joint(machine, p.third), p.first_centre, p.second_centre});
  }
  return planes;
}

double printed_joint(const MachineDefinition& machine, int j, double value) {
  if (machine.axes[static_cast<std::size_t>(j)].joint.kind == JointKind::rotary)
    return radians_from_degrees(
        rounded_decimal(degrees_from_radians(value), machine.dialect.digits_angle));
  const double scale = length_scale(machine);
  return rounded_decimal(value * scale, machine.dialect.digits_length) / scale;
}

ArcWords arc_words(const MachineDefinition& machine, const JointArc& arc, const JointVector& from) {
  const auto planes = arc_planes(machine);
  const auto plane = std::find_if(planes.begin(), planes.end(), [&arc](const ArcPlane& p) {
    return p.first == arc.first && p.second == arc.second;
  });
  require(arc.turn != 0 && plane != planes.end(), "arc_words: an arc in a plane of the control");
  const auto word = [&](int j, double centre) {
    return (centre - printed_joint(machine, j, from[j])) * length_scale(machine);
  };
  return {*plane, arc.turn < 0, word(arc.first, arc.centre_first),
          word(arc.second, arc.centre_second)};
}

std::string set_arc(const MachineDefinition& machine, const ArcBlock& block,
                    const JointVector& from, JointMask known, ReadBackMove& move) {
  const auto planes = arc_planes(machine);
  const auto plane = std::find_if(planes.begin(), planes.end(),
                                  [&block](const ArcPlane& p) { return p.code == block.code; });
  if (plane == planes.end())
    return "machine " + machine.name + " has no two linear axes that span G" +
           std::to_string(block.code);
  if (known != (JointMask{1} << machine.size()) - 1U)
    return "an arc before every axis has a position: where it begins is not known";
  for (int j = 0; j < machine.size(); ++j)
    if (j != plane->first && j != plane->second && j != plane->third && move.to[j] != from[j])
      return "an axis that is none of X Y Z moves along with an arc";
  JointArc arc{block.clockwise ? -1 : 1, plane->first, plane->second,
               from[plane->first] + block.first, from[plane->second] + block.second};
  const JointBend none;
  std::string problem = shape_problem(arc_shape({from, move.to, none, arc}));
  if (problem.empty()) move.arc = arc;
  return problem;
}

}  // namespace smoothpost
