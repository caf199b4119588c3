#include <algorithm>
#include <cmath>
#include <optional>

#include "kernels/core/units.h"
#include "machines/definition/sections.h"

namespace smoothpost::machine_file {

namespace {

constexpr double kSecondsPerMillisecond = 1e-3;

double radians_or(TableReader& reader, std::string_view key, double degrees, Bound bound) {
  return radians_from_degrees(reader.number_or(key, degrees, bound));
}

const AxisDefinition* axis_named(const std::vector<AxisDefinition>& axes, const std::string& name) {
  const auto found = std::find_if(axes.begin(), axes.end(),
                                  [&](const AxisDefinition& axis) { return axis.name == name; });
  return found != axes.end() ? &*found : nullptr;
}

std::vector<std::string> names_of(const std::vector<AxisDefinition>& axes) {
  std::vector<std::string> names;
  for (const auto& axis : axes) names.push_back(axis.name);
  return names;
}

/// The linear axis that `key` names, or nullptr with an error (none when the key is absent).
const AxisDefinition* linear_axis(TableReader& reader, std::string_view key,
                                  const std::vector<AxisDefinition>& axes) {
  const auto name = reader.text(key);
  if (!name) return nullptr;
  const AxisDefinition* axis = axis_named(axes, *name);
  if (axis == nullptr) {
    reader.error("MF114",
                 std::string(key) + " names no axis of this machine: " + name->substr(0, 64) +
                     "; there are " + one_of(names_of(axes)),
                 key);
  } else if (axis->joint.kind != JointKind::linear) {
    reader.error("MF124", std::string(key) + " has to be a linear axis; " + *name + " is rotary",
                 key);
    return nullptr;
  }
  return axis;
}

/// A pose { xyz_mm, rpy_deg } below `key`; the identity when it is absent.
Pose read_pose(TableReader& reader, std::string_view key, const std::string& name) {
  TableReader table = reader.table(key, name);
  Pose pose = Pose::Identity();
  pose.translation() = table.vector("xyz_mm").value_or(Vec3::Zero());
  const Vec3 rpy = table.vector("rpy_deg").value_or(Vec3::Zero()) * kRadiansPerDegree;
  pose.linear() = rotation_from_rpy(rpy[0], rpy[1], rpy[2]);
  table.finish();
  return pose;
}

// Every key is required: a controller that moves a load which it does not know is worse off than
// one that is told nothing.
LoadData read_load(TableReader reader) {
  LoadData load;
  load.mass = reader.required().number("mass_kg", Bound::positive).value_or(1.0);
  load.centre = reader.required().vector("centre_mm").value_or(load.centre);
  load.inertia = reader.required().vector("inertia_kg_m2").value_or(load.inertia);
  if (load.inertia.minCoeff() < 0.0)
    reader.error("MF108", "inertia_kg_m2 has " + to_text(load.inertia.minCoeff()) + ": at least 0",
                 "inertia_kg_m2");
  reader.finish();
  return load;
}

}  // namespace

ToolDefinition read_tool(TableReader reader) {
  ToolDefinition tool;
  tool.tip = reader.vector("tip_mm").value_or(tool.tip);
  tool.axis = reader.direction("axis").value_or(tool.axis);
  tool.flange = read_pose(reader, "flange", "tool.flange");
  tool.gap = reader.number_or("gap_mm", 0.0, Bound::not_negative);
  tool.land_radius = reader.number_or("land_radius_mm", 0.0, Bound::not_negative);
  tool.min_gap = reader.number_or("min_gap_mm", 0.0, Bound::not_negative);
  if (tool.min_gap > tool.gap)
    reader.error(
        "MF124",
        "min_gap_mm " + to_text(tool.min_gap) + " is more than gap_mm " + to_text(tool.gap),
        blame(reader, {"gap_mm", "min_gap_mm"}));
  if (reader.has("load")) tool.load = read_load(reader.table("load", "[tool.load]"));
  reader.entry("load");
  reader.finish();
  return tool;
}

WorkpieceDefinition read_workpiece(TableReader reader) {
  WorkpieceDefinition workpiece;
  workpiece.frame = read_pose(reader, "frame", "workpiece.frame");
  workpiece.thickness = reader.number_or("thickness_mm", 0.0, Bound::not_negative);
  reader.finish();
  return workpiece;
}

CycleSettings read_cycle(TableReader reader) {
  CycleSettings cycle;
  cycle.time = reader.number_or("time_ms", 1.0, Bound::positive) * kSecondsPerMillisecond;
  cycle.min_block = reader.number_or("min_block_ms", 4.0, Bound::positive) * kSecondsPerMillisecond;
  cycle.look_ahead_blocks = reader.integer("look_ahead_blocks", 0, 1000000).value_or(0);
  reader.finish();
  return cycle;
}

StandoffSettings read_standoff(TableReader reader, const std::vector<AxisDefinition>& axes) {
  StandoffSettings standoff;
  const AxisDefinition* axis = linear_axis(reader, "axis", axes);
  const auto following = reader.choice("following", {"none", "additive", "exclusive"});
  if (following == "none") standoff.following = Following::none;
  if (following == "additive") standoff.following = Following::additive;
  standoff.reserve = reader.number_or("reserve_mm", 5.0, Bound::not_negative);
  if (axis != nullptr) {
    standoff.axis = axis->name;
    if (axis->joint.side != ChainSide::tool)
      reader.error("MF124",
                   "axis has to be in the tool chain; " + axis->name + " moves the workpiece",
                   "axis");
    const double stroke = axis->joint.upper - axis->joint.lower;
    if (stroke > 0.0 && 2.0 * standoff.reserve >= stroke)
      reader.error("MF124",
                   "reserve_mm " + to_text(standoff.reserve) +
                       " at both ends leaves nothing of the " + to_text(stroke) + " mm of axis " +
                       axis->name,
                   "reserve_mm");
  }
  reader.finish();
  return standoff;
}

LinkSettings read_links(TableReader reader, const std::vector<AxisDefinition>& axes) {
  LinkSettings links;
  links.clearance = reader.number_or("clearance_mm", 0.0, Bound::not_negative);
  const AxisDefinition* axis = linear_axis(reader, "retract_axis", axes);
  if (axis != nullptr) {
    links.retract_axis = axis->name;
    reader.required();
  }
  const auto retract = reader.number("retract_mm");
  links.retract = retract.value_or(0.0);
  links.has_plane = axis == nullptr && retract.has_value();
  if (axis != nullptr && retract && axis->joint.lower < axis->joint.upper &&
      (*retract < axis->joint.lower || *retract > axis->joint.upper))
    reader.error("MF124",
                 "retract_mm " + to_text(*retract) + " is outside the range of axis " + axis->name +
                     ", " + to_text(axis->joint.lower) + " to " + to_text(axis->joint.upper) +
                     " mm",
                 blame(reader, {"retract_axis", "retract_mm"}));
  links.rotation = radians_or(reader, "rotation_deg", 0.0, Bound::not_negative);
  const auto rapid = reader.choice("rapid", {"linear", "independent"});
  if (rapid == "independent") links.rapid = RapidMotion::independent;
  links.rewind_in_cut =
      reader.choice("rewind", {"links_only", "in_cut"}).value_or("links_only") == "in_cut";
  links.over_burn = reader.number_or("over_burn_mm", links.over_burn, Bound::not_negative);
  links.micro_joint = reader.number_or("micro_joint_mm", links.micro_joint, Bound::not_negative);
  reader.finish();
  return links;
}

namespace {

// What a recipe does not do has no share of the tolerances; an optimised cut is on exact path.
ToleranceBudget read_budget(TableReader reader, const RecipeSettings& recipe) {
  ToleranceBudget budget;
  if (recipe.optimise == "jerk")
    budget = {0.0, 0.40, 0.50, 0.10, 0.0};
  else if (recipe.smoothing == "none")
    budget = {0.0, 0.0, 0.65, 0.05, 0.30};
  const auto share = [&](std::string_view key, double fallback) {
    return reader.number_or(key, fallback, Bound::not_negative);
  };
  budget.merge = share("merge", budget.merge);
  budget.smoothing = share("smoothing", budget.smoothing);
  budget.chord = share("chord", budget.chord);
  budget.rounding = share("rounding", budget.rounding);
  budget.controller = share("controller", budget.controller);
  const double sum =
      budget.merge + budget.smoothing + budget.chord + budget.rounding + budget.controller;
  constexpr double kSumTolerance = 1e-6;
  if (std::abs(sum - 1.0) > kSumTolerance) {
    reader.error("MF116", "the shares of tolerance.budget sum to " + to_text(sum) + ", not to 1",
                 blame_table(reader, {"merge", "smoothing", "chord", "rounding", "controller"}));
  }
  reader.finish();
  return budget;
}

constexpr double kLeastTolerance = 1e-6;  // mm, deg

}  // namespace

ToleranceSettings read_tolerance(TableReader reader, const RecipeSettings& recipe) {
  ToleranceSettings tolerance;
  tolerance.tip = reader.number_or("tip_mm", 0.01, Bound::positive);
  tolerance.axis = radians_or(reader, "axis_deg", 0.05, Bound::positive);
  tolerance.lead = radians_or(reader, "lead_deg", 0.0, Bound::not_negative);
  tolerance.tilt = radians_or(reader, "tilt_deg", 0.0, Bound::not_negative);
  tolerance.exit_edge = reader.number("exit_edge_mm", Bound::positive);
  tolerance.clearance = reader.number_or("clearance_mm", 0.0, Bound::not_negative);
  tolerance.event = reader.number_or("event_mm", tolerance.event, Bound::positive);
  tolerance.limit_share = reader.number_or("limit_share", 1.0, Bound::positive);
  const auto least = [&reader](const char* key, double value) {
    if (value > 0.0 && value < kLeastTolerance)
      reader.error("MF108",
                   std::string(key) + " is " + to_text(value) +
                       " and has to be at least 0.000001: no control resolves less",
                   key);
  };
  least("tip_mm", tolerance.tip);
  least("axis_deg", degrees_from_radians(tolerance.axis));
  if (tolerance.limit_share > 1.0)
    reader.error("MF108",
                 "limit_share is " + to_text(tolerance.limit_share) + " and has to be at most 1",
                 "limit_share");
  tolerance.budget = read_budget(reader.table("budget", "[tolerance.budget]"), recipe);
  reader.finish();
  return tolerance;
}

namespace {

/// Where via points are wanted along a cut, mm.
std::vector<double> read_via(TableReader& reader) {
  const auto via = reader.numbers("via_mm");
  if (!via) return {};
  for (std::size_t i = 0; i < via->size(); ++i) {
    if ((*via)[i] < 0.0)
      reader.error("MF108", "via_mm has " + to_text((*via)[i]) + ": at least 0", "via_mm");
    else if (i > 0 && (*via)[i] <= (*via)[i - 1])
      reader.error("MF124",
                   "via_mm has " + to_text((*via)[i]) + " after " + to_text((*via)[i - 1]) +
                       ": it has to rise strictly",
                   "via_mm");
    else
      continue;
    return {};
  }
  return *via;
}

}  // namespace

RecipeSettings read_recipe(TableReader reader) {
  RecipeSettings recipe;
  const auto choose = [&](std::string_view key, std::vector<std::string> allowed,
                          std::string& into) {
    if (auto value = reader.choice(key, std::move(allowed))) into = std::move(*value);
  };
  choose("kind", {"robot", "laser", "finishing", "five_axis"}, recipe.kind);
  choose("smoothing", {"acr", "ramp", "none"}, recipe.smoothing);
  choose("shape", {"half", "paper", "tuned"}, recipe.shape);
  choose("dense", {"curve", "corners"}, recipe.dense);
  choose("orientation", {"programmed", "qi", "qi_c2", "via", "cone", "graph", "monotone"},
         recipe.orientation);
  choose("optimise", {"jerk", "none"}, recipe.optimise);
  choose("solver", {"hybrid", "ipopt", "banded"}, recipe.solver);
  choose("schedule", {"jerk", "constant", "programmed"}, recipe.schedule);
  recipe.knot_every = reader.integer("knot_every", 1, 64).value_or(recipe.knot_every);
  recipe.alternations = reader.integer("alternations", 0, 8).value_or(recipe.alternations);
  recipe.via = read_via(reader);
  const auto share = [&](std::string_view key, double fallback) {
    const double value = reader.number_or(key, fallback, Bound::not_negative);
    if (value > 3.0)
      reader.error("MF108", std::string(key) + " is " + to_text(value) + " and has to be at most 3",
                   key);
    return value;
  };
  recipe.kappa = share("kappa", recipe.kappa);
  recipe.lambda = share("lambda", recipe.lambda);
  if (const auto c1 = reader.number("ramp_c1")) {
    recipe.ramp_c1 = *c1;
    if (*c1 < -1.09 || *c1 > 6.56)
      reader.error("MF108",
                   "ramp_c1 is " + to_text(*c1) + " and has to lie between -1.09 and 6.56 (convex)",
                   "ramp_c1");
  }
  choose("task", {"axis", "pose"}, recipe.task);
  choose("spin", {"fixed", "tangent", "optimised"}, recipe.spin_policy);
  if (const auto spin = reader.number("spin_deg")) recipe.spin = *spin * kRadiansPerDegree;
  reader.finish();
  return recipe;
}

namespace {

/// Decimals of lengths: the key of the program's unit counts, the other one is only checked.
int read_length_digits(TableReader& reader, const std::string& units) {
  const int millimetres = reader.integer("digits_mm", 0, 9).value_or(5);
  const int inches = reader.integer("digits_inch", 0, 9).value_or(6);
  return units == "inch" ? inches : millimetres;
}

void read_block_time(TableReader& reader, const CycleSettings& cycle, DialectSettings& dialect) {
  const auto milliseconds = reader.number("block_ms", Bound::positive);
  if (!milliseconds) return;
  dialect.block_time = *milliseconds * kSecondsPerMillisecond;
  if (dialect.block_time >= cycle.min_block) return;
  reader.error("MF124",
               "block_ms " + to_text(*milliseconds) + " is less than cycle.min_block_ms " +
                   to_text(cycle.min_block / kSecondsPerMillisecond),
               "block_ms");
}

}  // namespace

DialectSettings read_dialect(TableReader reader, const CycleSettings& cycle) {
  DialectSettings dialect;
  dialect.name = reader.text("name").value_or(dialect.name);
  if (!is_name(dialect.name))
    reader.error("MF113", "name has to be a dialect's name, such as linuxcnc", "name");
  dialect.mode = reader.choice("mode", {"joint", "tcp"}).value_or(dialect.mode);
  dialect.units = reader.choice("units", {"mm", "inch"}).value_or(dialect.units);
  dialect.extension = reader.text("extension").value_or(dialect.extension);
  if (!is_name(dialect.extension, true))
    reader.error("MF113", "extension has to be letters and digits, without dot", "extension");
  dialect.digits_length = read_length_digits(reader, dialect.units);
  dialect.digits_angle = reader.integer("digits_deg", 0, 9).value_or(dialect.digits_angle);
  read_block_time(reader, cycle, dialect);
  dialect.line_numbers = reader.boolean("line_numbers").value_or(dialect.line_numbers);
  dialect.start = reader.lines("start").value_or(dialect.start);
  dialect.end = reader.lines("end").value_or(dialect.end);
  dialect.offset_guard = reader.boolean("offset_guard").value_or(dialect.offset_guard);
  dialect.path_mode =
      reader.choice("path_mode", {"exact", "blend", "spline"}).value_or(dialect.path_mode);
  dialect.curves =
      reader.choice("curves", {"lines", "arcs", "cubic", "quintic"}).value_or(dialect.curves);
  reader.finish();
  return dialect;
}

}  // namespace smoothpost::machine_file
