#include <algorithm>
#include <cmath>

#include "kernels/core/units.h"
#include "postproc/pipeline/clearance_check.h"
#include "postproc/pipeline/controller_blending.h"
#include "postproc/pipeline/conversion_parts.h"
#include "postproc/pipeline/link_check.h"
#include "postproc/pipeline/orientation_check.h"
#include "postproc/pipeline/path_match.h"
#include "postproc/pipeline/process_check.h"
#include "postproc/pipeline/registry.h"
#include "postproc/pipeline/tool_motion.h"

namespace smoothpost {

namespace {

// Of an axis that leans by up to 60 deg: what its projection turns, and the edge behind a sheet
// moves, more than the axis does (kLeastProjection of path_match.cpp).
constexpr double kProjected = 2.0;
constexpr double kSteepest = 4.0;

/// A program with the joints of its tool moves, as joint steps, and how far these may be from what
/// the control does.
struct FollowedProgram {
  ReadBack read;
  double tip_allowance = 0.0;        ///< mm
  double axis_allowance = 0.0;       ///< rad
  double clearance_allowance = 0.0;  ///< mm (largest_allowance)
};

/// Over all tool moves, each from where the joints stand before it.
double largest_turn_allowance(const ReadBack& read, const ScrewChain& chain, ToolTurn turn) {
  double largest = 0.0;
  for (std::size_t i = 1; i < read.moves.size(); ++i) {
    if (read.moves[i].interpolation != MoveInterpolation::tool) continue;
    const Pose from = tip_pose(chain, read.moves[i - 1].to, 0.0);  // its rotation is what counts
    largest = std::max(largest, turn_allowance(from, read.moves[i].tool, turn));
  }
  return largest;
}

/// The tolerances of a beam whose orientation is free, as the matching takes them.
FreedBeam freed_beam(const CheckInput& in, const ReferencePath& reference,
                     const std::vector<Cut>& cuts, const TriangleTree* part, double allowance) {
  const ToleranceSettings& tolerance = in.machine.tolerance;
  FreedBeam beam;
  for (const Cut& cut : cuts)
    if (!cut.omitted) beam.frames.emplace_back(reference, cut.first, cut.last, part);
  beam.lead = std::max(tolerance.lead, tolerance.axis) - allowance;
  beam.tilt = std::max(tolerance.tilt, tolerance.axis) - allowance;
  beam.thickness = in.machine.workpiece.thickness;
  if (tolerance.exit_edge)
    beam.exit_edge = std::max(1e-9, *tolerance.exit_edge - kSteepest * beam.thickness * allowance);
  return beam;
}

/// The shape of a program against its input, as checks. The matching bounds the larger of the two
/// shares of the tolerances, so both deviations are told as that share of theirs.
Checks shape_checks(const CheckInput& in, const FollowedProgram& program, const ScrewChain& chain,
                    const TriangleTree* tree, const Progress& progress) {
  const ReadBack& read = program.read;
  ToolPath path = in.against->path;
  const std::vector<Cut> cuts = find_cuts(path, {false, in.machine.links.micro_joint, {}});
  const ReferencePath reference(path, in.against->frames);
  const auto& tolerance = in.machine.tolerance;
  const bool beam = std::any_of(path.points.begin(), path.points.end(),
                                [](const PathPoint& p) { return p.beam; });
  const double tip = tolerance.tip - program.tip_allowance;
  const bool free = orientation_is_free(in.machine);
  const double allowance = (free ? kProjected : 1.0) * program.axis_allowance;
  const double axis = tolerance.axis - allowance;
  PathMatch match;
  match.reason =
      "the blocks are too long for this axis tolerance: what the control does between "
      "their ends is not known so closely";
  PathMatchSettings settings{tip, axis};
  settings.beam = beam;
  ProcessNumbers process = process_numbers(read, path, in.machine);
  settings.program_process = std::move(process.program);
  settings.input_process = std::move(process.input);
  settings.process_parts = std::move(process.parts);
  settings.event_tolerance = in.machine.tolerance.event;
  const bool whole = in.machine.recipe.task == "pose";
  if (whole) settings.whole_rotation = input_tool_rotation(chain.tool_axis, in.machine.recipe.spin);
  if (free && axis > 0.0) settings.freed = freed_beam(in, reference, cuts, tree, allowance);
  if (whole && !path.full_pose)
    match.reason = "recipe.task = \"pose\" needs an input with whole rotations";
  else if (tip > 0.0 && axis > 0.0)
    match = match_paths(read, chain, reference, settings, progress);
  const auto check = [&](const char* name, double limit, double taken, const char* unit) {
    Check c;
    c.name = name;
    c.limit = limit;
    c.unit = unit;
    c.ok = match.matched;
    c.value = match.matched ? match.share * (limit - taken) + taken : INFINITY;
    c.input_line = match.input_line;
    c.output_line = match.output_line;
    c.note = match.reason;
    return c;
  };
  const Check tip_check = check("tip_deviation", tolerance.tip, program.tip_allowance, "mm");
  if (settings.freed) {
    const FreedBeam& freed = *settings.freed;
    const double allowed = degrees_from_radians(allowance);
    const double lead = degrees_from_radians(freed.lead), tilt = degrees_from_radians(freed.tilt);
    Checks checks = {tip_check, check("lead_deviation", lead + allowed, allowed, "deg"),
                     check("tilt_deviation", tilt + allowed, allowed, "deg")};
    if (freed.exit_edge)
      checks.push_back(check("exit_edge_deviation", *tolerance.exit_edge,
                             *tolerance.exit_edge - *freed.exit_edge, "mm"));
    return checks;
  }
  return {tip_check, check(whole ? "rotation_deviation" : "axis_deviation",
                           degrees_from_radians(tolerance.axis),
                           degrees_from_radians(program.axis_allowance), "deg")};
}

/// Straight steps stand for bent moves: what the control does may be that far from them.
void allow_bends(const CheckInput& in, const ScrewChain& chain, FollowedProgram& program) {
  double longest = std::max(0.0, in.tool_length);
  if (in.against)
    for (const PathPoint& point : in.against->path.points)
      longest = std::max(longest, point.tool_length);
  const StepAllowance bends = step_allowance(program.read, chain, longest);
  program.tip_allowance += bends.tip;
  program.axis_allowance += bends.axis;
}

/// Joints of tool moves; the tool's length is the one that the program's own tool frame has, or the
/// one that the user gave.
bool follow_program(const CheckInput& in, const ScrewChain& chain, const Dialect& dialect,
                    FollowedProgram& program, Conversion& out) {
  ReadBack& read = program.read;
  const bool any = std::any_of(read.moves.begin(), read.moves.end(), [](const ReadBackMove& m) {
    return m.interpolation == MoveInterpolation::tool;
  });
  const auto inverse = Inverse::from(chain);
  if (any && !inverse)
    out.diagnostics.push_back(diagnostic("KN110", "machine " + in.machine.name +
                                                      " has no closed form: its joints on tool "
                                                      "moves are not known in this version"));
  if (!any) {
    ControllerMotion motion =
        follow_joints(std::move(read), chain, follow_settings(in.machine, ToolTurn::none, {}));
    read = motion.steps ? std::move(*motion.steps) : std::move(motion.read);
    allow_bends(in, chain, program);
  }
  if (!any || !inverse) return !any;
  double length = in.tool_length;
  if (read.tool_frame)
    length = -in.machine.tool.axis.dot((in.machine.tool.flange * *read.tool_frame).translation() -
                                       in.machine.tool.tip);
  const auto tool_length = [length](std::size_t) { return length; };
  into_part(read, in.machine, chain.workpiece_home, tool_length);
  auto followed = follow(std::move(read), in.machine, *inverse, dialect.tool_turn, tool_length);
  for (auto d : followed.diagnostics()) {
    d.where.file = in.file_name;
    out.diagnostics.push_back(std::move(d));
  }
  if (!followed.ok()) return false;
  ControllerMotion& motion = followed.value();
  program.tip_allowance = kStepShare * in.machine.tolerance.tip;
  program.axis_allowance = kStepShare * in.machine.tolerance.axis +
                           largest_turn_allowance(motion.read, chain, dialect.tool_turn);
  // A rounding is paired with the straight way monotonically: its bound adds to the matching's.
  BlendAllowance rounding;
  const auto roundings = blend_allowances(motion.read, chain, tool_length);
  program.clearance_allowance = largest_allowance(roundings, in.machine, true);
  for (const BlendAllowance& a : roundings) {
    rounding.tip = std::max(rounding.tip, a.tip);
    rounding.rotation = std::max(rounding.rotation, a.rotation);
  }
  program.tip_allowance += rounding.tip;
  program.axis_allowance += rounding.rotation;
  if (rounding.tip > 0.0)
    out.assumes.push_back(
        blending_assumption(in.machine.dialect.path_mode == "spline" ? "spline" : "blend"));
  read = motion.steps ? std::move(*motion.steps) : std::move(motion.read);
  allow_bends(in, chain, program);
  return true;
}

/// What the program does besides its shape: links and the process as a whole.
void add_program_checks(const CheckInput& in, const FollowedProgram& program,
                        const ScrewChain& chain, Conversion& out) {
  const auto& points = in.against->path.points;
  LinkDepthInput links{in.machine, chain};
  for (const PathPoint& p : points) {
    links.tool_length = std::max(links.tool_length, p.tool_length);
    links.beam = links.beam || p.beam;
  }
  out.checks.push_back(link_depth_check(program.read, links));
  out.checks.push_back(process_complete_check(program.read, in.against->path, in.machine));
}

void tell_failed_checks(Conversion& out, const std::string& file) {
  for (const Check& c : out.checks)
    if (!c.ok)
      out.diagnostics.push_back(diagnostic(
          "CK101",
          "check " + c.name +
              " failed: " + (std::isfinite(c.value) ? std::to_string(c.value) : "no bound") + " " +
              c.unit + ", limit " + std::to_string(c.limit) + " " + c.unit +
              (c.input_line > 0 ? ", input line " + std::to_string(c.input_line) : "") +
              (c.note.empty() ? "" : ". " + c.note),
          file, static_cast<int>(c.output_line)));
}

}  // namespace

Conversion check_program(const CheckInput& in, const Progress& progress) {
  Conversion out;
  Stopwatch watch(out.stages);
  describe_promises(in.machine, in.part.has_value(), out);
  if (!in.against) {
    out.not_checked.push_back("tip_deviation");
    out.not_checked.push_back("axis_deviation");
    out.not_checked.push_back("process_as_programmed");
  }
  out.not_checked.push_back("feed");
  out.not_checked.push_back("process_values");
  out.not_checked.push_back("link_path");
  const Dialect* dialect = find_dialect(in.machine.dialect.name);
  if (!dialect) {
    out.diagnostics.push_back(diagnostic(
        "US121", "no output dialect \"" + in.machine.dialect.name + "\" in this version"));
    return out;
  }
  out.interpolation = dialect->interpolation;
  auto read = dialect->read_back(in.machine, in.text, in.file_name);
  append(out.diagnostics, read.diagnostics());
  watch.lap("read back");
  if (!read.ok()) return out;
  const ScrewChain chain = placed_chain(in.machine, in.placement);
  out.blocks = read.value().moves.size();
  FollowedProgram program{std::move(read.value())};
  if (!follow_program(in, chain, *dialect, program, out)) return out;
  Verification machine = verify_machine(program.read, in.machine);
  out.axes = std::move(machine.axes);
  out.scheduled_time = machine.scheduled_time;
  std::optional<PartCheck> part;
  if (in.part) part.emplace(*in.part, in.machine);
  const std::shared_ptr<const TriangleTree> tree = part ? part->shared_tree() : nullptr;
  if (in.against) {
    out.checks = shape_checks(in, program, chain, tree.get(), progress);
    add_program_checks(in, program, chain, out);
    if (orientation_is_free(in.machine)) {
      out.assumes.push_back(
          "lead and tilt of the beam are free inside their tolerances; they are counted from the "
          "programmed tool axis, in the plane of the cut's direction and " +
          std::string(tree ? "the part's normal" : "the programmed tool axis (no part was given)"));
      out.not_checked.push_back("tilted_gap");
    }
    out.reference = in.against->reference;
    out.assumes.insert(out.assumes.begin(), in.against->assumes.begin(), in.against->assumes.end());
  }
  out.checks.insert(out.checks.end(), machine.checks.begin(), machine.checks.end());
  out.read = std::move(program.read);
  if (part) {
    append(out.diagnostics, part->diagnostics());
    if (part->ok() && !beam_locations(out.read, chain).empty())
      out.checks.push_back(part->output(out.read, chain));
  }
  if (in.collision_check)
    add_clearance({in.machine, chain, in.part ? &*in.part : nullptr, tree,
                   program.clearance_allowance, in.file_name},
                  progress, out);
  watch.lap("verify");
  tell_failed_checks(out, in.file_name);
  if (has_error(out.diagnostics))
    out.verdict = Verdict::refused;
  else
    out.verdict = in.against ? Verdict::certified : Verdict::limits_only;
  return out;
}

}  // namespace smoothpost
