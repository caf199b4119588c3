#include "postproc/pipeline/conversion_parts.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/units.h"
#include "postproc/pipeline/clearance_check.h"
#include "postproc/pipeline/planned_limits.h"
#include "postproc/pipeline/process_check.h"
#include "postproc/pipeline/registry.h"

namespace smoothpost {

void append(Diagnostics& to, const Diagnostics& from) {
  to.insert(to.end(), from.begin(), from.end());
}

Diagnostic diagnostic(const char* code, std::string text, std::string file, int line) {
  Diagnostic d;
  d.code = code;
  d.text = std::move(text);
  d.where = {std::move(file), line, 0};
  return d;
}

ScrewChain placed_chain(const MachineDefinition& machine, const Pose& placement) {
  ScrewChain chain = chain_of(machine);
  chain.workpiece_home = chain.workpiece_home * placement;
  return chain;
}

RegistrationSettings registration_settings(const MachineDefinition& machine) {
  RegistrationSettings s;
  s.nominal_gap = machine.tool.gap;
  s.allowed_gap_deviation = machine.tool.gap - machine.tool.min_gap;
  return s;
}

Check registration_check(const PartRegistration& registration,
                         const RegistrationSettings& settings) {
  Check c;
  c.name = "part_registration";
  c.value = registration.gap.worst_deviation;
  c.limit = settings.allowed_gap_deviation;
  c.unit = "mm";
  c.ok = registration.verdict == RegistrationVerdict::registered;
  c.note = registration.sentence;
  return c;
}

void into_part(ReadBack& read, const MachineDefinition& machine, const Pose& part,
               const std::function<double(std::size_t)>& tool_length) {
  if (!read.part && !read.tool_frame) return;
  const Pose base = read.part ? part.inverse() * *read.part : Pose::Identity();
  for (std::size_t i = 0; i < read.moves.size(); ++i) {
    ReadBackMove& move = read.moves[i];
    if (move.interpolation != MoveInterpolation::tool) continue;
    move.tool = base * move.tool;
    if (!read.tool_frame) continue;
    Pose tip = Pose::Identity();
    tip.translation() = machine.tool.tip - tool_length(i) * machine.tool.axis;
    move.tool = move.tool * read.tool_frame->inverse() * (machine.tool.flange.inverse() * tip);
  }
}

FollowSettings follow_settings(const MachineDefinition& machine, ToolTurn turn,
                               std::function<double(std::size_t)> tool_length) {
  FollowSettings settings;
  settings.turn = turn;
  settings.tip_tolerance = kStepShare * machine.tolerance.tip;
  settings.axis_tolerance = kStepShare * machine.tolerance.axis;
  settings.tool_length = std::move(tool_length);
  return settings;
}

Result<ControllerMotion> follow(ReadBack read, const MachineDefinition& machine,
                                const Inverse& inverse, ToolTurn turn,
                                const std::function<double(std::size_t)>& tool_length) {
  return follow_controller(std::move(read), inverse, follow_settings(machine, turn, tool_length));
}

void describe_promises(const MachineDefinition& machine, bool has_part, Conversion& out) {
  const double tip = machine.tolerance.tip;
  const ToleranceBudget& share = machine.tolerance.budget;
  out.budget_mm = {share.merge * tip, share.smoothing * tip, share.chord * tip,
                   share.rounding * tip, share.controller * tip};
  out.assumes.push_back(
      "the machine is as its definition file says: axes, pivots and tool are calibrated");
  if (const Dialect* dialect = find_dialect(machine.dialect.name))
    if (machine.dialect.offset_guard) out.assumes.push_back(dialect->guard);
  if (!machine.power.speed.empty() && !follows_power(machine))
    out.assumes.push_back(
        "the control sets the beam's power from the speed of the tip by the table of "
        "[process.power]: the program commands no power by speed");
  out.not_checked.push_back("clearance");
  out.not_checked.push_back("acceleration_limit");
  out.not_checked.push_back("jerk_limit");
  if (!has_part) {
    out.not_checked.push_back("part_registration");
    out.not_checked.push_back("gap");
  }
  std::string assumed;
  for (const auto& axis : machine.axes)
    if (axis.source == LimitSource::assumed) assumed += (assumed.empty() ? "" : ", ") + axis.name;
  if (!assumed.empty())
    out.assumes.push_back(
        "the limits of these axes are assumed, not from a datasheet, and used at 90 %: " + assumed);
}

void add_clearance(const ClearanceInput& in, const Progress& progress, Conversion& out) {
  auto built = machine_scene({in.machine, in.chain, in.part, in.tree, in.allowance});
  append(out.diagnostics, built.diagnostics());
  if (!built.ok() || !built.value()) return;
  const Scene& scene = *built.value();
  const ClearanceReport report = check_clearance(scene, out.read, in.machine, progress);
  out.checks.push_back(clearance_check(report, scene, out.read));
  const auto texts = place_texts(report, scene);
  for (std::size_t k = 0; k < texts.size(); ++k)
    out.diagnostics.push_back(
        diagnostic("CK110", texts[k], in.file_name,
                   static_cast<int>(out.read.moves[report.places[k].move].line)));
  std::erase(out.not_checked, "clearance");
  if (in.part == nullptr) out.not_checked.push_back("part_clearance");
  out.assumes.push_back(
      "bodies are where the machine file has them; the tool that cuts is none of them, nor is the "
      "way from where the machine stands to the first position that the program states whole");
  if (in.allowance > 0.0)
    out.assumes.push_back(
        "what the control rounds moves no body farther than the tip of an arm "
        "of 1 m: " +
        std::to_string(in.allowance) + " mm are added to every clearance");
}

namespace {

// A beam that goes slower than its material takes, and what keeps it so.
void add_cut_speed(const MachineDefinition& machine, Conversion& out) {
  const double limit = machine.power.min_cut_speed;
  if (!(limit > 0.0) || !std::isfinite(out.schedule.slowest_cut)) return;
  Check c;
  c.name = "min_cut_speed";
  c.unit = "mm/s";
  c.value = out.schedule.slowest_cut;
  c.limit = limit;
  c.ok = c.value >= c.limit;
  c.planned = true;
  c.input_line = out.schedule.slowest_cut_line;
  c.note = "from below: the slowest place with the beam on, ramps at stops left out";
  for (const SlowedBy& s : out.schedule.slowed_by)
    if (s.first_line <= c.input_line && c.input_line <= s.last_line)
      c.note += "; axis " + machine.axes[static_cast<std::size_t>(s.joint)].name + " at its " +
                word(s.limit) + " limit";
  out.checks.push_back(c);
}

}  // namespace

void add_input_motion(const MachineDefinition& machine, const std::vector<InputMotion>& motion,
                      std::vector<AxisSummary>& axes) {
  for (std::size_t j = 0; j < motion.size(); ++j) {
    const bool rotary = machine.axes[j].joint.kind == JointKind::rotary;
    const double scale = rotary ? kDegreesPerRadian : 1.0;
    InputMotion m = motion[j];
    m.velocity *= scale;
    for (auto* value : {&m.acceleration, &m.jerk, &m.rms_jerk})
      if (*value) **value *= scale;
    axes[j].input = m;
  }
}

void add_planned_limits(const MachineDefinition& machine, Conversion& out) {
  if (out.schedule.peaks.empty()) return;
  const Checks checks =
      planned_limit_checks(out.schedule.peaks, out.schedule.time, machine, out.axes);
  out.checks.insert(out.checks.end(), checks.begin(), checks.end());
  std::erase_if(out.not_checked, [](const std::string& name) {
    return name == "acceleration_limit" || name == "jerk_limit";
  });
  out.assumes.push_back(planned_limits_assumption());
  add_cut_speed(machine, out);
  for (std::size_t j = 0; j < machine.axes.size(); ++j) {
    const bool rotary = machine.axes[j].joint.kind == JointKind::rotary;
    const int digits = rotary ? machine.dialect.digits_angle : machine.dialect.digits_length;
    const double unit =
        (rotary || machine.dialect.units != "inch" ? 1.0 : 25.4) * std::pow(10.0, -digits);
    out.axes[j].rounding_jerk = 4.0 * unit / std::pow(machine.cycle.min_block, 3);
  }
}

PartCheck::InputRegistration PartCheck::input(const ReferencePath& reference) const {
  constexpr double kStep = 2.0;
  std::vector<CutterLocation> points;
  std::vector<std::uint32_t> lines;
  for (std::size_t k = 1; k <= reference.segments(); ++k) {
    if (!reference.path().points[k].beam) continue;
    const int steps =
        static_cast<int>(std::clamp(std::ceil(reference.length(k) / kStep), 1.0, 64.0));
    for (int i = 1; i <= steps; ++i)
      points.push_back(reference.at(k, static_cast<double>(i) / steps));
    lines.resize(points.size(), reference.path().points[k].line);
  }
  InputRegistration out;
  out.registration = register_part(points, *tree_, settings_);
  out.worst_line = lines[out.registration.gap.worst];
  return out;
}

Check PartCheck::output(const ReadBack& read, const ScrewChain& chain) const {
  const GapStatistics gap = measure_gaps(beam_locations(read, chain), *tree_, settings_);
  Check c;
  c.name = "gap";
  c.unit = "mm";
  c.value = gap.worst_deviation;
  c.limit = settings_.allowed_gap_deviation;
  c.ok = c.value <= c.limit;
  c.output_line = line_of(read, gap.worst);
  return c;
}

std::uint32_t PartCheck::line_of(const ReadBack& read, std::size_t k) {
  std::size_t n = 0;
  for (std::size_t i = 1; i < read.moves.size(); ++i) {
    if (!read.moves[i].beam) continue;
    n += read.moves[i - 1].beam ? 2 : 3;
    if (k < n) return read.moves[i].line;
  }
  return 0;
}

void describe_input(const ToolPath& path, const std::vector<Cut>& cuts,
                    const ReferencePath& reference, Conversion& out) {
  std::vector<bool> in_cut(path.points.size(), false);
  for (const Cut& cut : cuts) {
    if (cut.omitted) continue;
    CutSummary summary;
    summary.label =
        "CUT " + std::to_string(cut.number) + (cut.after_rewind ? " goes on after a rewind" : "");
    summary.first = cut.first;
    summary.last = cut.last;
    summary.first_line = path.points[cut.first].line;
    summary.last_line = path.points[cut.last].line;
    for (std::uint32_t k = cut.first; k <= cut.last; ++k) {
      in_cut[k] = true;
      summary.length += reference.length(k);
    }
    summary.phases = phases_of(reference, cut);
    out.cuts.push_back(std::move(summary));
  }
  bool in_link = false;
  std::vector<bool> omitted(path.points.size(), false);
  for (const Cut& cut : cuts)
    for (std::uint32_t k = cut.first; cut.omitted && k <= cut.last; ++k) omitted[k] = true;
  for (std::size_t k = 1; k < path.points.size(); ++k) {
    if (omitted[k]) continue;
    out.programmed_time += path.points[k].duration;
    out.length += reference.length(k);
    if (!in_cut[k] && !in_link) ++out.links;
    in_link = !in_cut[k];
  }
}

}  // namespace smoothpost
