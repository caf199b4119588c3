#include "postproc/pipeline/recipe_check.h"

#include <string>

#include "machines/dialects/decimal.h"

namespace smoothpost {

namespace {

class Refusals {
 public:
  void refuse(const std::string& key, const std::string& value, const std::string& possible) {
    Diagnostic d;
    d.code = "US120";
    d.text = key + " = \"" + value + "\" is not possible in this version; possible: " + possible;
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

}  // namespace

ToolTurn tool_turn_of(const MachineDefinition& machine, const Dialect& dialect) {
  return machine.dialect.mode == "tcp" ? dialect.tool_turn : ToolTurn::none;
}

Diagnostics recipe_problems(const MachineDefinition& machine, const Dialect& dialect,
                            const ToolPath& input) {
  Refusals refusals;
  const RecipeSettings& r = machine.recipe;
  if (r.orientation != "programmed")
    refusals.refuse("recipe.orientation", r.orientation, "programmed");
  if (r.optimise != "none") refusals.refuse("recipe.optimise", r.optimise, "none");
  if (r.schedule != "programmed") refusals.refuse("recipe.schedule", r.schedule, "programmed");
  if (machine.tolerance.lead != 0.0 || machine.tolerance.tilt != 0.0)
    refusals.refuse("tolerance.lead_deg and tilt_deg", "free",
                    "0 (the programmed tool axis is kept)");
  check_dialect(machine, dialect, refusals);
  check_smoothing(machine, input, refusals);
  return refusals.take();
}

}  // namespace smoothpost
