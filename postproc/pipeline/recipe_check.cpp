#include "postproc/pipeline/recipe_check.h"

#include <cmath>
#include <string>

#include "kernels/core/units.h"
#include "kernels/kinematics/inverse.h"
#include "machines/dialects/arc_text.h"
#include "machines/dialects/decimal.h"

namespace smoothpost {

namespace {

class Refusals {
 public:
  void refuse(const std::string& key, const std::string& value, const std::string& possible) {
    say("US120",
        key + " = \"" + value + "\" is not possible in this version; possible: " + possible);
  }
  void say(const char* code, std::string text) {
    Diagnostic d;
    d.code = code;
    d.text = std::move(text);
    list_.push_back(std::move(d));
  }
  Diagnostics take() { return std::move(list_); }

 private:
  Diagnostics list_;
};

std::string text_of(double value) {
  std::string text;
  append_decimal(text, value, 4);
  return text;
}

/// The radii of an arc at its ends differ by the rounding of start, end and centre.
bool prints_arcs(const DialectSettings& dialect) {
  const double unit = std::pow(10.0, -dialect.digits_length) *
                      (dialect.units == "inch" ? kMillimetresPerInch : 1.0);
  return std::sqrt(8.0) * unit <= kRadiusAgreement;
}

void check_curves(const MachineDefinition& machine, const Dialect& dialect, Refusals& refusals) {
  const DialectSettings& settings = machine.dialect;
  const auto refuse = [&](const char* possible) {
    refusals.refuse("dialect.curves", settings.curves, possible);
  };
  const bool arcs = settings.curves == "arcs";
  if (settings.curves == "lines") return;
  if (arcs ? !dialect.arcs : !dialect.polynomials)
    refuse(arcs ? "lines (this dialect prints no arcs)"
                : "lines (this dialect prints no polynomials)");
  if (settings.mode == "tcp")
    refuse(arcs ? "lines (arcs are of joints: dialect.mode = \"joint\" has them)"
                : "lines (polynomials are of joints: dialect.mode = \"joint\" has them)");
  if (machine.recipe.task == "pose")
    refuse("lines (the rotation about the tool is proven for straight joints only)");
  if (arcs && !prints_arcs(settings))
    refuse(
        "lines (with so few dialect.digits_length the radii at both ends of an arc would not "
        "agree within 0.005 mm: 3 digits of mm or 5 of inch do)");
}

void check_dialect(const MachineDefinition& machine, const Dialect& dialect, Refusals& refusals) {
  const DialectSettings& settings = machine.dialect;
  const ToolTurn turn = tool_turn_of(machine, dialect);
  if (settings.mode == "joint" && !dialect.joints_linear)
    refusals.refuse(
        "dialect.mode", "joint",
        "tcp (between the ends of its joint moves nothing is known of this controller)");
  if (settings.mode == "tcp" && turn == ToolTurn::none)
    refusals.refuse("dialect.mode", "tcp", "joint (this dialect has no tool-centre-point mode)");
  if (settings.path_mode != "exact" && turn != ToolTurn::slerp)
    refusals.refuse("dialect.path_mode", settings.path_mode,
                    "exact (the rounding of this control has no bound that is known)");
  check_curves(machine, dialect, refusals);
}

void check_smoothing(const MachineDefinition& machine, const ToolPath& input, Refusals& refusals) {
  const RecipeSettings& r = machine.recipe;
  const ToleranceBudget& budget = machine.tolerance.budget;
  if (r.smoothing != "none" && (budget.smoothing <= 0.0 || budget.merge <= 0.0))
    refusals.refuse("tolerance.budget.smoothing and merge",
                    text_of(budget.smoothing) + " and " + text_of(budget.merge),
                    "shares above 0 when recipe.smoothing is on");
  if (r.kappa < 0.4 || r.kappa > 0.6 || r.lambda < -0.5 || r.lambda > 2.5)
    refusals.refuse("recipe.kappa and lambda", text_of(r.kappa) + " and " + text_of(r.lambda),
                    "0.4 to 0.6 and -0.5 to 2.5 (beyond, the curve runs backwards)");
  if (r.task == "pose" && !input.full_pose)
    refusals.refuse("recipe.task", "pose",
                    "axis (this input gives tool axes only; CSV with qw,qx,qy,qz or "
                    "rz_deg,ry_deg,rx_deg has whole rotations)");
  if (r.task == "pose" && r.kind != "robot")
    refusals.refuse("recipe.task", "pose",
                    "axis (five axes cannot set the rotation about the tool)");
}

bool frees_orientation(const ToleranceSettings& t) { return t.lead > 0.0 || t.tilt > 0.0; }

void check_orientation(const MachineDefinition& machine, Refusals& refusals) {
  const RecipeSettings& r = machine.recipe;
  const bool laser = r.kind == "laser";
  // qi and qi_c2 are what others do, to compare with (examples/paper_b): jerk without bound.
  const bool baseline = r.orientation == "qi" || r.orientation == "qi_c2";
  if (baseline || (r.orientation != "programmed" && !laser))
    refusals.refuse(
        "recipe.orientation", r.orientation,
        laser ? "programmed, cone, via, graph, monotone (qi and qi_c2 are in the examples)"
              : "programmed (others are for recipe.kind = \"laser\")");
  if (!frees_orientation(machine.tolerance)) return;
  if (!laser)
    refusals.refuse("tolerance.lead_deg and tilt_deg", "free",
                    "0 (the programmed tool axis is kept; it can be free for recipe.kind = "
                    "\"laser\")");
  else if (r.orientation == "programmed")
    refusals.refuse("tolerance.lead_deg and tilt_deg", "free",
                    "0 while recipe.orientation = \"programmed\" keeps the tool axis; "
                    "recipe.orientation = \"cone\" uses the freedom");
  if (laser && machine.workpiece.thickness <= 0.0)
    refusals.say("US123",
                 "tolerance.lead_deg and tilt_deg free the beam, and workpiece.thickness_mm does "
                 "not say how thick the sheet is: give it, how far a tilted beam shifts the cut's "
                 "edge on the far side is checked by it");
}

void check_laser(const MachineDefinition& machine, Refusals& refusals) {
  const RecipeSettings& r = machine.recipe;
  const bool laser = r.kind == "laser";
  const bool optimised = r.optimise == "jerk";
  if (optimised && !laser)
    refusals.refuse("recipe.optimise", r.optimise, "none (jerk is for recipe.kind = \"laser\")");
  if (laser && !optimised && r.orientation != "programmed")
    refusals.refuse("recipe.optimise", r.optimise,
                    "jerk (recipe.orientation = \"" + r.orientation + "\" is planned by it)");
  if (!optimised || !laser) return;
  if (machine.dialect.mode != "joint")
    refusals.refuse("dialect.mode", machine.dialect.mode,
                    "joint (recipe.optimise = \"jerk\" plans the joints themselves)");
  const auto inverse = Inverse::from(chain_of(machine));
  if (inverse && inverse->rotary_pair() == nullptr)
    refusals.refuse("recipe.optimise", r.optimise,
                    "none (jerk needs two rotary and three linear axes; this machine is an arm)");
}

}  // namespace

ToolTurn tool_turn_of(const MachineDefinition& machine, const Dialect& dialect) {
  return machine.dialect.mode == "tcp" ? dialect.tool_turn : ToolTurn::none;
}

Diagnostics recipe_problems(const MachineDefinition& machine, const Dialect& dialect,
                            const ToolPath& input) {
  Refusals refusals;
  check_orientation(machine, refusals);
  check_laser(machine, refusals);
  check_dialect(machine, dialect, refusals);
  check_smoothing(machine, input, refusals);
  return refusals.take();
}

}  // namespace smoothpost
