#include "postproc/pipeline/convert.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "kernels/core/units.h"
#include "kernels/optimise/shape_tuning.h"
#include "postproc/pipeline/arc_blocks.h"
#include "postproc/pipeline/arm_plan.h"
#include "postproc/pipeline/beam_power.h"
#include "postproc/pipeline/block_steps.h"
#include "postproc/pipeline/clearance_check.h"
#include "postproc/pipeline/controller_blending.h"
#include "postproc/pipeline/conversion_notes.h"
#include "postproc/pipeline/conversion_parts.h"
#include "postproc/pipeline/curve_blocks.h"
#include "postproc/pipeline/finish_plan.h"
#include "postproc/pipeline/joint_plan.h"
#include "postproc/pipeline/laser_loop.h"
#include "postproc/pipeline/laser_plan.h"
#include "postproc/pipeline/machine_program.h"
#include "postproc/pipeline/process_check.h"
#include "postproc/pipeline/recipe_check.h"
#include "postproc/pipeline/registry.h"
#include "postproc/pipeline/rewind.h"
#include "postproc/pipeline/standoff_retreat.h"

namespace smoothpost {

namespace {

constexpr int kMostSplitRounds = 30;

}  // namespace

bool Conversion::checks_ok() const {
  return std::all_of(checks.begin(), checks.end(), [](const Check& c) { return c.ok; });
}

std::string to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::certified:
      return "certified";
    case Verdict::limits_only:
      return "limits_only";
    case Verdict::refused:
      return "refused";
    case Verdict::forced:
      return "forced";
  }
  return "refused";
}

namespace {

/// One conversion, stage by stage; each stage returns false when there is no way on.
class Converter {
 public:
  Converter(const ConvertInput& in, bool force, const Progress& progress)
      : in_(in),
        force_(force),
        progress_(progress),
        watch_(out_.stages),
        path_(in.input.path),
        cuts_(find_cuts(path_, {in.keep_links, in.machine.links.micro_joint, in.cuts})),
        reference_(path_, in.input.frames),
        wanted_states_(programmed_states(in.input, in.keep_links, in.machine)) {}

  Conversion run() {
    out_.reference = in_.input.reference;
    out_.assumes = in_.input.assumes;
    const bool beam_part = in_.part && uses_beam();
    describe_promises(in_.machine, beam_part, out_);
    if (!in_.placement_text.empty()) out_.assumes.push_back(in_.placement_text);
    watch_.lap("interpret");
    if (!recipe_is_possible() || !has_cuts()) return finish(false);
    tell_links();
    if (beam_part && !register_input()) return finish(false);
    if (in_.part && !uses_beam() && !in_.finish) {
      out_.diagnostics.push_back(diagnostic(
          "RG120", "the program has no beam-on motion: it was not compared with the part",
          in_.part_name));
      out_.diagnostics.back().severity = Severity::note;
    }
    const bool made = plan() && emit() && verify();
    describe_input(path_, cuts_, reference_, out_);
    if (in_.timed) out_.path = path_;
    return finish(made);
  }

 private:
  bool uses_beam() const {
    return std::any_of(in_.input.path.points.begin(), in_.input.path.points.end(),
                       [](const PathPoint& p) { return p.beam; });
  }

  bool recipe_is_possible() {
    dialect_ = find_dialect(in_.machine.dialect.name);
    if (!dialect_) {
      out_.diagnostics.push_back(
          diagnostic("US121", "no output dialect \"" + in_.machine.dialect.name +
                                  "\" in this version: `smoothpost formats` lists them"));
      return false;
    }
    turn_ = tool_turn_of(in_.machine, *dialect_);
    append(out_.diagnostics, recipe_problems(in_.machine, *dialect_, in_.input.path));
    return !has_error(out_.diagnostics);
  }

  SmoothedPath smoothed() {
    const auto& r = in_.machine.recipe;
    // An optimised cut has its corners rounded by its own splines (fit_tip).
    // So has a finishing path before it comes here.
    if (r.smoothing == "none" || optimises() || in_.finish) return SmoothedPath(reference_);
    SmoothingSettings s = smoothing_settings(in_.machine);
    if (r.shape == "tuned") tune(s);
    return SmoothedPath(reference_, cuts_, s);
  }

  // Once for a conversion: every round of splits has the same shape.
  void tune(SmoothingSettings& s) {
    if (!tuned_) {
      const SmoothedPath untuned(reference_, cuts_, s);
      if (untuned.runs().empty()) return;
      TuningSettings settings;
      settings.corners = corner_settings(s);
      settings.jerk_limits = limits_of(in_.machine).jerk;
      settings.start = home_of(in_.machine);
      settings.tool_length = in_.input.path.points.back().tool_length;
      tuned_ = tune_blend_shape(*inverse_, untuned.runs(), settings);
      watch_.lap("tune");
      out_.diagnostics.push_back(
          tuning_note(*tuned_, in_.machine.recipe.smoothing == "acr", in_.input_name));
    }
    s.shape = tuned_->after.acr;
    s.ramp_c1 = tuned_->after.c1;
  }

  bool has_cuts() {
    const auto first =
        std::find_if(cuts_.begin(), cuts_.end(), [](const Cut& c) { return !c.omitted; });
    if (first != cuts_.end()) return true;
    if (in_.cuts)
      out_.diagnostics.push_back(diagnostic("US147",
                                            "--cuts asks for none of the program's " +
                                                std::to_string(cuts_.size()) +
                                                " cuts (they count from 1)",
                                            in_.input_name));
    else if (!in_.keep_links)
      out_.diagnostics.push_back(diagnostic(
          "PR310",
          "the program cuts nowhere: it has no feed motion" +
              std::string(in_.machine.has_event(event_name::kBeamOn) ? " with the beam on" : "") +
              ", only rapids. Use --links keep to convert its rapids as they are",
          in_.input_name));
    return in_.keep_links && !in_.cuts;
  }

  // What the links are, said where nobody can overlook it.
  void tell_links() {
    const auto warn = [this](const char* code, std::string text) {
      out_.diagnostics.push_back(diagnostic(code, std::move(text), in_.input_name));
      out_.diagnostics.back().severity = Severity::warning;
    };
    if (in_.keep_links)
      warn("LK102",
           "links are the input's own rapids, on your word (--links keep): nothing was "
           "checked of where they pass on this machine");
    else if (!in_.part)
      warn("LK101",
           "no part was given (-w PART.stl): links go over the retract plane, and nothing "
           "was checked against the part (clearance)");
    if (in_.cuts)
      out_.assumes.push_back("only cuts " + std::to_string(in_.cuts->first) + " to " +
                             std::to_string(std::min<int>(in_.cuts->last, cuts_.back().number)) +
                             " of " + std::to_string(cuts_.back().number) +
                             " are in this program (--cuts)");
  }

  bool register_input() {
    part_.emplace(*in_.part, in_.machine);
    append(out_.diagnostics, part_->diagnostics());
    if (!part_->ok()) return false;
    const auto [registration, worst_line] = part_->input(reference_);
    Check c = registration_check(registration, part_->settings());
    c.input_line = worst_line;
    if (!c.ok)
      out_.diagnostics.push_back(diagnostic(
          registration_code(registration.verdict).c_str(),
          c.note + "; worst at input line " + std::to_string(worst_line), in_.part_name));
    out_.checks.push_back(c);
    watch_.lap("registration");
    return c.ok || force_;
  }

  bool plan() {
    chain_ = placed_chain(in_.machine, in_.placement);
    inverse_ = Inverse::from(chain_);
    if (!inverse_) {
      out_.diagnostics.push_back(diagnostic(
          "KN110",
          "machine " + in_.machine.name +
              " has no closed form in this version: two free rotary and three free linear axes "
              "are needed (further axes redundant = true), or a six-axis arm with spherical "
              "wrist"));
      return false;
    }
    if (inverse_->takes_rotation() && turn_ == ToolTurn::great_circle) {
      out_.diagnostics.push_back(
          diagnostic("KN111", "dialect " + in_.machine.dialect.name +
                                  " says only the tool axis in its tcp mode, and machine " +
                                  in_.machine.name + " also turns about it: use mode = \"joint\""));
      return false;
    }
    const auto& tolerance = in_.machine.tolerance;
    JointPlanSettings settings;
    settings.tip_tolerance = tolerance.tip * tolerance.budget.chord;
    settings.axis_tolerance = tolerance.axis * tolerance.budget.chord;
    settings.held = home_of(in_.machine);
    settings.file_name = in_.input_name;
    for (const auto& axis : in_.machine.axes) settings.axis_names.push_back(axis.name);
    settings.may_split = in_.machine.links.rewind_in_cut;
    settings.tool_moves = turn_ != ToolTurn::none;
    settings.spin = in_.machine.recipe.spin;
    settings.spin_policy = in_.machine.recipe.spin_policy;
    settings.whole_rotation = in_.machine.recipe.task == "pose";
    auto planned = plan_with(settings);
    // The second half starts a little before the place, so that it may need a split of its own.
    for (int round = 1; planned.ok() && !planned.value().splits.empty(); ++round) {
      split(planned.value().splits);
      settings.may_split = round < kMostSplitRounds;
      planned = plan_with(settings);
    }
    if (planned.ok() && optimises()) tell_stretches();
    tell_splits();
    append(out_.diagnostics, planned.diagnostics());
    watch_.lap("kinematics");
    if (!planned.ok()) return false;
    tell_clearing();
    out_.corners = smoothed_->corners();
    out_.merged_points = smoothed_->merged_points();
    out_.fitted_points = smoothed_->fitted_points();
    watch_.lap("corners");
    append(out_.diagnostics, posture_notes(planned.value(), in_.input_name));
    if (!schedule(planned.value())) return false;
    see_input(settings);
    BuiltProgram built =
        build_program({reference_, cuts_, in_.machine, chain_, part_box(), turn_, &*inverse_},
                      planned.value().samples);
    program_ = std::move(built.program);
    plan_blending(program_, in_.machine, chain_);
    if (follows_power(in_.machine))
      power_ = follow_power(program_, reference_, out_.schedule, in_.machine);
    make_curves();
    if (!built.cramped.empty()) {
      out_.diagnostics.push_back(diagnostic(
          "LK104",
          "a link has no room for the whole clearance of " + number(in_.machine.links.clearance) +
              " mm along the tool axis, here and at " + std::to_string(built.cramped.size() - 1) +
              " other places",
          in_.input_name, static_cast<int>(built.cramped.front())));
      out_.diagnostics.back().severity = Severity::warning;
    }
    program_.part = chain_.workpiece_home;
    const auto first_cut =
        std::find_if(program_.moves.begin(), program_.moves.end(),
                     [](const MachineMove& m) { return m.role == MoveRole::path; });
    if (first_cut != program_.moves.end()) program_.tool_length = first_cut->tool_length;
    if (!tools_are_possible()) return false;
    program_.title = in_.title;
    program_.certified = true;
    if (in_.timed)
      out_.timeline = timeline_of({program_, out_.schedule, in_.machine, chain_, *inverse_, turn_});
    return true;
  }

  void make_curves() {
    const std::string& curves = in_.machine.dialect.curves;
    const CurveInput with{reference_, out_.schedule, in_.machine, chain_};
    if (curves == "lines") return;
    const bool arcs = curves == "arcs";
    arcs ? join_into_arcs(program_, with) : join_into_curves(program_, with);
    out_.assumes.push_back(arcs ? arc_assumption() : curve_assumption(in_.machine));
  }

  // What the input itself asks of the joints, for the report.
  void see_input(JointPlanSettings settings) {
    if (in_.finish) return;
    settings.spin_policy = "fixed";
    settings.may_split = false;
    const SmoothedPath raw(reference_);
    const RotaryPair* pair = inverse_->rotary_pair();
    const auto planned = pair ? plan_joints(raw, *pair, settings, progress_)
                              : plan_arm(raw, *inverse_->six_r(), settings, progress_);
    if (planned.ok()) input_motion_ = input_motion(raw, planned.value(), in_.machine.size());
    watch_.lap("input motion");
  }

  // A program that states its tool frame states one; one that leaves it to the control relies on
  // it.
  bool tools_are_possible() {
    if (turn_ == ToolTurn::none) return true;
    for (const MachineMove& move : program_.moves) {
      if (move.role != MoveRole::path || move.tool_length == program_.tool_length) continue;
      if (turn_ == ToolTurn::slerp) {
        out_.diagnostics.push_back(diagnostic(
            "PR311",
            "tools of " + number(program_.tool_length) + " and " + number(move.tool_length) +
                " mm: a program of this dialect has one tool frame in this version. Write "
                "one program for each tool with --cuts",
            in_.input_name, static_cast<int>(move.input_line)));
        return false;
      }
      out_.assumes.push_back(
          "the control has the lengths of all tools as the head of the program states them; its "
          "guard "
          "knows only the first");
      return true;
    }
    return true;
  }

  Result<JointPlan> plan_with(const JointPlanSettings& settings) {
    smoothed_.emplace(smoothed());
    watch_.lap("smooth");
    if (in_.finish) return finishing();
    if (const RotaryPair* pair = inverse_->rotary_pair()) {
      auto planned = plan_by_pair(settings, *pair);
      if (!optimises() || !planned.ok() || !planned.value().splits.empty()) return planned;
      const JointPlan base = planned.value();
      planned = optimised(base, *pair);
      if (!planned.ok() || !keeps_programmed_) return planned;
      // Programmed joints have come into the plan that were to be optimised.
      const double before = retreat_;
      auto again = plan_by_pair(settings, *pair, true);
      if (retreat_ <= before || !again.ok() || !again.value().splits.empty()) return planned;
      return optimised(std::move(again.value()), *pair);
    }
    return plan_arm(*smoothed_, *inverse_->six_r(), settings, progress_);
  }

  // With the standoff held where the programmed joints are clear of everything.
  Result<JointPlan> plan_by_pair(JointPlanSettings settings, const RotaryPair& pair,
                                 bool whole_cuts = false) {
    const int standoff = standoff_joint(in_.machine);
    const double home = standoff < 0 ? 0.0 : settings.held[standoff];
    if (retreat_ > 0.0) settings.held[standoff] = retreated(in_.machine, home, retreat_);
    auto planned = plan_joints(*smoothed_, pair, settings, progress_);
    if (!planned.ok() || !planned.value().splits.empty()) return planned;
    if (standoff < 0 || !make_scene()) return planned;
    const auto& samples = planned.value().samples;
    // The programmes and what comes after them move the rest (keep_clear).
    const double more = base_retreat(
        *scene_, in_.machine, pair,
        optimises() && !whole_cuts ? joined_samples(reference_, cuts_, in_.machine.process, samples)
                                   : samples_of_cuts(cuts_, samples));
    if (more <= 0.0) return planned;
    retreat_ += more;
    settings.held[standoff] = retreated(in_.machine, home, retreat_);
    return plan_joints(*smoothed_, pair, settings, progress_);
  }

  // What must not meet; false: nothing is known that could.
  bool make_scene() {
    if (scene_) return true;
    if (!in_.collision_check) return false;
    auto built = machine_scene({in_.machine, chain_, in_.part ? &*in_.part : nullptr,
                                part_ && part_->ok() ? part_->shared_tree() : nullptr,
                                largest_allowance({}, in_.machine, turn_ != ToolTurn::none)});
    if (!built.ok()) return false;  // told by the certificate
    scene_ = std::move(built.value());
    return scene_.has_value();
  }

  Result<JointPlan> finishing() {
    if (!inverse_->rotary_pair())
      return Result<JointPlan>::failure(
          diagnostic("KN172", "machine " + in_.machine.name +
                                  " cannot finish: it is an arm, and a finishing machine has two "
                                  "rotary and three linear axes and one more that is redundant"));
    auto planned = plan_finish({*in_.finish, cuts_, in_.machine, *inverse_->rotary_pair(),
                                in_.input_name, make_scene() ? &*scene_ : nullptr},
                               progress_);
    watch_.lap("redundancy");
    if (!planned.ok()) return Result<JointPlan>::failure(planned.diagnostics());
    append(out_.diagnostics, finish_notes(planned.value(), in_.machine, in_.input_name));
    planned_ = std::move(planned.value().paths);
    return Result<JointPlan>(std::move(planned.value().joints), planned.diagnostics());
  }

  // The time of the way to every sample.
  bool schedule(JointPlan& plan) {
    auto scheduled = schedule_plan(
        {{*smoothed_, plan, laser_paths_, in_.machine, &planned_}, cuts_, in_.input_name},
        progress_);
    append(out_.diagnostics, scheduled.diagnostics());
    watch_.lap("schedule");
    if (!scheduled.ok()) return false;
    out_.schedule = std::move(scheduled.value());
    append(out_.diagnostics, schedule_notes(out_.schedule, in_.machine, in_.input_name));
    plan.samples = timed_samples(std::move(plan.samples), out_.schedule);
    return true;
  }

  bool optimises() const {
    return in_.machine.recipe.optimise == "jerk" && in_.machine.recipe.kind == "laser";
  }

  Result<JointPlan> optimised(JointPlan base, const RotaryPair& pair) {
    watch_.lap("kinematics");
    LaserPlanInput laser{reference_,
                         cuts_,
                         in_.machine,
                         pair,
                         part_ && part_->ok() ? &part_->tree() : nullptr,
                         in_.input_name,
                         make_scene() ? &*scene_ : nullptr};
    auto result = plan_laser(laser, base, progress_);
    watch_.lap("optimise");
    if (!result.ok()) return Result<JointPlan>::failure(result.diagnostics());
    out_.stretches = std::move(result.value().stretches);
    laser_paths_ = std::move(result.value().paths);
    not_clear_ = std::move(result.value().not_clear);
    keeps_programmed_ = result.value().keeps_programmed;
    JointPlan plan = std::move(base);
    plan.samples = std::move(result.value().joints.samples);
    return Result<JointPlan>(std::move(plan), result.diagnostics());
  }

  // What was slowed down, and what the standoff may not do.
  void tell_stretches() {
    const auto note = [this](const char* code, std::string text, std::uint32_t line) {
      out_.diagnostics.push_back(
          diagnostic(code, std::move(text), in_.input_name, static_cast<int>(line)));
      out_.diagnostics.back().severity = Severity::note;
    };
    for (const LaserStretch& stretch : out_.stretches)
      if (!stretch.slowed_by.empty() && in_.machine.recipe.schedule == "constant")
        note("KN155",
             "cut at " + number(stretch.feed * kSecondsPerMinute) + " mm/min instead of " +
                 number(stretch.programmed_feed * kSecondsPerMinute) + " for " + stretch.slowed_by,
             stretch.slowed_lines.empty() ? 0 : stretch.slowed_lines.front());
    if (in_.machine.standoff.following == Following::exclusive &&
        !in_.machine.standoff.axis.empty())
      note("KN156",
           "axis " + in_.machine.standoff.axis +
               " belongs to the height follower (standoff.following = \"exclusive\"): it is held, "
               "not optimised",
           0);
  }

  // What was moved out of the way, and what could not be.
  void tell_clearing() {
    const auto note = [this](const char* code, std::string text, std::uint32_t line) {
      out_.diagnostics.push_back(
          diagnostic(code, std::move(text), in_.input_name, static_cast<int>(line)));
      out_.diagnostics.back().severity = Severity::note;
    };
    if (retreat_ > 0.0)
      note("KN157",
           "the standoff was made " + std::to_string(std::lround(retreat_)) +
               " mm longer than it would be, so that the head keeps its clearance",
           0);
    for (const LaserStretch& stretch : out_.stretches) {
      const ClearanceLoopReport& r = stretch.clear;
      if (!r.clear || r.method == "none" || (r.method == "graph" && !scene_)) continue;
      std::string text = "the head was moved out of the way of what is beside the cut (" +
                         r.method + ", " + std::to_string(r.passes) + " passes, " +
                         std::to_string(r.cuts) + " conditions)";
      if (!r.bodies.empty())
        text += "; tightest " + number(0.001 * std::round(1000.0 * r.tightest)) +
                " mm beyond the clearance of " + r.bodies;
      note("KN158", std::move(text), r.line);
    }
    append(out_.diagnostics, not_clear_);
  }

  void split(const std::vector<SplitPlace>& places) {
    for (const auto& place : places) split_lines_.push_back(path_.points[place.segment].line);
    split_cuts(path_, cuts_, in_.input.frames, places, in_.machine.links.over_burn);
  }

  void tell_splits() {
    if (split_lines_.empty()) return;
    std::sort(split_lines_.begin(), split_lines_.end());
    std::string lines;
    for (std::size_t i = 0; i < std::min<std::size_t>(split_lines_.size(), 8); ++i)
      lines += (i ? ", " : "") + std::to_string(split_lines_[i]);
    if (split_lines_.size() > 8)
      lines += " and " + std::to_string(split_lines_.size() - 8) + " more";
    out_.assumes.push_back("cuts are split to unwind an axis (links.rewind = \"in_cut\") and cut " +
                           number(in_.machine.links.over_burn) + " mm twice there: input lines " +
                           lines);
    out_.diagnostics.push_back(diagnostic("LK103", out_.assumes.back(), in_.input_name,
                                          static_cast<int>(split_lines_.front())));
    out_.diagnostics.back().severity = Severity::warning;
  }

  std::optional<PartBox> part_box() const {
    if (!in_.part || in_.part->vertices.empty()) return {};
    PartBox box{in_.part->vertices.front(), in_.part->vertices.front()};
    for (const Vec3& v : in_.part->vertices) {
      box.lower = box.lower.cwiseMin(v);
      box.upper = box.upper.cwiseMax(v);
    }
    return box;
  }

  bool emit() {
    out_.interpolation = dialect_->interpolation;
    auto emitted = dialect_->emit(in_.machine, program_);
    std::set<std::string> told;  // a state that is stated again at every cut is told once
    for (auto d : emitted.diagnostics()) {
      if (d.where.file.empty()) d.where.file = in_.input_name;
      if (told.insert(to_string(d)).second) out_.diagnostics.push_back(std::move(d));
    }
    watch_.lap("emit");
    if (!emitted.ok()) return false;
    out_.line_map = line_map_of(program_, emitted.value());
    out_.program = std::move(emitted.value().text);
    return true;
  }

  bool verify() {
    auto read = dialect_->read_back(in_.machine, out_.program, "output");
    watch_.lap("read back");
    append(out_.diagnostics, read.diagnostics());
    if (!read.ok()) {
      out_.diagnostics.push_back(diagnostic("IN110", "the program could not be read back"));
      return false;
    }
    const auto tool_length = [this](std::size_t i) {
      return i < program_.moves.size() ? program_.moves[i].tool_length : 0.0;
    };
    into_part(read.value(), in_.machine, program_.part, tool_length);
    auto followed = follow(std::move(read.value()), in_.machine, *inverse_, turn_, tool_length);
    for (auto d : followed.diagnostics()) {
      d.where.file = "output";
      out_.diagnostics.push_back(std::move(d));
    }
    if (!followed.ok()) return false;
    ControllerMotion motion = std::move(followed.value());
    Verification machine = verify_machine(motion.joints(), in_.machine);
    DeviationInput with{reference_, out_.line_map, program_, chain_, turn_, part_box()};
    if (turn_ == ToolTurn::slerp) {
      with.rounding = blend_allowances(motion.read, chain_, tool_length);
      const auto rounds = [](const BlendAllowance& a) { return a.tip > 0.0 || a.rotation > 0.0; };
      if (std::any_of(with.rounding.begin(), with.rounding.end(), rounds))
        out_.assumes.push_back(blending_assumption(in_.machine.dialect.path_mode));
    }
    if (in_.machine.recipe.task == "pose")
      with.whole_rotation = input_tool_rotation(chain_.tool_axis, in_.machine.recipe.spin);
    with.orientation = orientation_input(in_.machine, reference_, cuts_,
                                         part_ && part_->ok() ? &part_->tree() : nullptr);
    if (with.orientation && with.orientation->free)
      out_.assumes.push_back(orientation_assumption(*with.orientation));
    const Checks deviation = verify_deviation(motion.read, in_.machine, with, progress_);
    out_.blocks = motion.read.moves.size();
    if (turn_ != ToolTurn::none)
      out_.assumes.push_back(
          "on moves of the tool the control takes the joints to the nearest solution, from the "
          "joint positions that the program has stated before");
    out_.read = motion.steps ? std::move(*motion.steps) : std::move(motion.read);
    if (in_.finish)
      out_.checks.insert(out_.checks.end(), in_.finish->checks.begin(), in_.finish->checks.end());
    out_.checks.insert(out_.checks.end(), deviation.begin(), deviation.end());
    if (part_ && part_->ok()) out_.checks.push_back(part_->output(out_.read, chain_));
    out_.checks.insert(out_.checks.end(), machine.checks.begin(), machine.checks.end());
    out_.axes = std::move(machine.axes);
    add_input_motion(in_.machine, input_motion_, out_.axes);
    if (in_.collision_check)
      add_clearance(
          {in_.machine, chain_, in_.part ? &*in_.part : nullptr,
           part_ && part_->ok() ? part_->shared_tree() : nullptr,
           largest_allowance(with.rounding, in_.machine, turn_ != ToolTurn::none), "output"},
          progress_, out_);
    add_planned_limits(in_.machine, out_);
    out_.scheduled_time = machine.scheduled_time;
    if (power_) out_.checks.push_back(power_check(*power_, in_.machine));
    out_.checks.push_back(
        process_check(motion.read, out_.line_map, cuts_, wanted_states_, in_.machine));
    for (Check& c : out_.checks) give_input_line(c);
    out_.executed = executed_time(out_.read, in_.machine);
    watch_.lap("verify");
    return !in_.stream || certify_stream(with);
  }

  // The joints at the control's cycle, with checks of their own.
  bool certify_stream(const DeviationInput& with) {
    auto stream = certified_stream(
        {out_.timeline, in_.machine, with, program_.tool_length, make_scene() ? &*scene_ : nullptr},
        progress_);
    watch_.lap("stream");
    for (auto d : stream.diagnostics()) {
      if (d.where.file.empty()) d.where.file = in_.input_name;
      out_.diagnostics.push_back(std::move(d));
    }
    if (!stream.ok()) return false;
    out_.stream = std::move(stream.value());
    for (const Check& c : out_.stream->checks)
      if (!c.ok)
        out_.diagnostics.push_back(diagnostic("CK102", "joint stream: " + describe(c),
                                              in_.input_name, static_cast<int>(c.input_line)));
    return true;
  }

  void give_input_line(Check& check) const {
    if (check.input_line != 0 || check.output_line == 0) return;
    const auto entry = std::lower_bound(
        out_.line_map.begin(), out_.line_map.end(), check.output_line,
        [](const LineMapEntry& e, std::uint32_t line) { return e.output_line < line; });
    if (entry != out_.line_map.end()) check.input_line = entry->input_line;
  }

  Conversion finish(bool made) {
    bool beam_rules_ok = true;
    for (const Check& c : out_.checks) {
      if (c.ok) continue;
      if (c.name.rfind("beam_", 0) == 0) beam_rules_ok = false;
      if (c.name == "part_registration") continue;  // told by its own name already
      out_.diagnostics.push_back(
          diagnostic("CK101", describe(c), in_.input_name, static_cast<int>(c.input_line)));
    }
    if (made && out_.checks_ok() && !has_error(out_.diagnostics)) {
      out_.verdict = Verdict::certified;
    } else if (made && force_ && beam_rules_ok) {
      out_.verdict = Verdict::forced;
      reprint_uncertified();
    } else {
      out_.verdict = Verdict::refused;
    }
    return std::move(out_);
  }

  static std::string describe(const Check& c) {
    std::string text = "check " + c.name + " failed: " + number(c.value) + " " + c.unit +
                       ", limit " + number(c.limit) + " " + c.unit;
    if (c.output_line > 0) text += ", output line " + std::to_string(c.output_line);
    if (!c.note.empty()) text += ". " + c.note;
    return text;
  }

  // The same program under its warning: the text that was checked, with other first lines.
  void reprint_uncertified() {
    program_.certified = false;
    auto emitted = dialect_->emit(in_.machine, program_);
    if (!emitted.ok()) return;
    out_.line_map = line_map_of(program_, emitted.value());
    out_.program = std::move(emitted.value().text);
  }

  const ConvertInput& in_;
  bool force_;
  const Progress& progress_;
  Conversion out_;
  Stopwatch watch_;
  ToolPath path_;
  std::vector<Cut> cuts_;
  ReferencePath reference_;
  ScrewChain chain_;
  MachineProgram program_;
  std::vector<ProcessStates> wanted_states_;
  std::vector<std::uint32_t> split_lines_;
  std::optional<SmoothedPath> smoothed_;
  std::vector<InputMotion> input_motion_;
  std::optional<TuningResult> tuned_;
  std::vector<LaserPlanPath> laser_paths_;
  std::vector<PlannedStretch> planned_;  ///< of a finishing path
  std::optional<Scene> scene_;           ///< what must not meet, once it was asked for
  double retreat_ = 0.0;                 ///< mm by which the standoff is held longer
  Diagnostics not_clear_;
  bool keeps_programmed_ = false;
  std::optional<PowerFollowing> power_;
  std::optional<PartCheck> part_;
  std::optional<Inverse> inverse_;
  const Dialect* dialect_ = nullptr;
  ToolTurn turn_ = ToolTurn::none;
};

}  // namespace

Conversion convert(const ConvertInput& in, bool force, const Progress& progress) {
  Conversion made = Converter(in, force, progress).run();
  // One power a block: in long blocks the speed may change too much for it.
  const bool chosen = in.machine.dialect.block_time <= 0.0;
  const auto too_long = [](const Check& c) { return c.name == "power_follows_speed" && !c.ok; };
  if (!chosen || usual_block_time(in.machine) <= kShortBlock ||
      std::none_of(made.checks.begin(), made.checks.end(), too_long))
    return made;
  ConvertInput shorter = in;
  shorter.machine.dialect.block_time = kShortBlock;
  return Converter(shorter, force, progress).run();
}

}  // namespace smoothpost
