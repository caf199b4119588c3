#include "postproc/pipeline/finish_plan.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "kernels/core/units.h"
#include "postproc/pipeline/block_steps.h"
#include "postproc/pipeline/finish_resolve.h"

namespace smoothpost {

namespace {

constexpr double kBlock = 0.25;       // mm, least usual length of a block
constexpr double kLeastBlock = 1e-3;  // mm
constexpr double kUsed = 0.8;         // of the chord share: it is looked at in quarters alone

std::string number(double value) {
  std::string text = std::to_string(std::round(1e3 * value) / 1e3);
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text;
}

class Planner {
 public:
  Planner(const FinishPlanInput& input, const Progress& progress)
      : in_(input), progress_(progress), resolver_(input) {}

  Result<FinishPlan> run() {
    if (!prepare()) return Result<FinishPlan>::failure(std::move(diagnostics_));
    std::vector<ChosenCut> chosen;
    std::optional<double> end;
    for (std::size_t i = 0; i < in_.path.cuts.size(); ++i) {
      if (is_omitted(in_.path.cuts[i])) continue;
      ChosenCut c = resolver_.choose(i, end);
      if (c.found.status != GlobalResolution::Status::ok) {
        refuse(c.found, in_.path.cuts[i]);
        return Result<FinishPlan>::failure(std::move(diagnostics_));
      }
      end = c.found.free.back();
      chosen.push_back(std::move(c));
      if (!progress_("redundancy", 0.5 * share(i))) return cancelled();
    }
    std::vector<Made> made(chosen.size());
    tbb::parallel_for(std::size_t{0}, chosen.size(),
                      [&](std::size_t k) { made[k] = make(chosen[k]); });
    for (std::size_t k = 0; k < made.size(); ++k) {
      if (!made[k].cut.joints) {
        diagnostics_.push_back(error("KN171",
                                     "the free joint of cut " +
                                         std::to_string(made[k].cut.told.cut + 1) +
                                         " could not be made a smooth function of the path",
                                     made[k].cut.told.first_line));
        return Result<FinishPlan>::failure(std::move(diagnostics_));
      }
      append(std::move(made[k]));
    }
    if (!progress_("redundancy", 1.0)) return cancelled();
    return Result<FinishPlan>(std::move(out_), std::move(diagnostics_));
  }

  Result<std::vector<std::size_t>> out_of_reach() {
    using Cuts = std::vector<std::size_t>;
    if (!prepare()) return Result<Cuts>::failure(std::move(diagnostics_));
    Cuts out;
    std::optional<double> end;
    for (std::size_t i = 0; i < in_.path.cuts.size(); ++i) {
      if (is_omitted(in_.path.cuts[i])) continue;
      const ChosenCut c = resolver_.choose(i, end);
      if (c.found.status == GlobalResolution::Status::ok && !c.collides && !c.cramped)
        end = c.found.free.back();
      else
        out.push_back(i);
      if (!progress_("reach", share(i)))
        return Result<Cuts>::failure(error("US190", "cancelled", 0));
    }
    return Result<Cuts>(std::move(out));
  }

 private:
  /// A cut's joints with the samples of its program.
  struct Made {
    CutResolver::Made cut;
    std::vector<JointSample> samples;
    std::vector<double> s;
  };

  bool prepare() {
    if (!resolver_.possible()) {
      diagnostics_.push_back(
          error("KN172",
                "machine " + in_.machine.name +
                    " cannot finish: exactly one axis has to be redundant = true, such as the "
                    "bed's rotary, beside two rotary and three linear ones",
                0));
      return false;
    }
    return true;
  }

  double share(std::size_t cut) const {
    return static_cast<double>(cut + 1) / static_cast<double>(in_.path.cuts.size());
  }
  Result<FinishPlan> cancelled() const {
    return Result<FinishPlan>::failure(error("US190", "cancelled", 0));
  }

  Diagnostic error(const char* code, std::string text, std::uint32_t line) const {
    Diagnostic d;
    d.code = code;
    d.text = std::move(text);
    d.where = {in_.file_name, static_cast<int>(line), 0};
    return d;
  }

  bool is_omitted(const FinishCut& cut) const {
    for (const Cut& c : in_.cuts)
      if (c.first <= cut.first_point + 1 && cut.first_point + 1 <= c.last) return c.omitted;
    return true;
  }

  void refuse(const GlobalResolution& found, const FinishCut& cut) {
    const auto at = std::lower_bound(cut.s.begin(), cut.s.end(), found.failed - 1e-9);
    const std::size_t i =
        std::min<std::size_t>(static_cast<std::size_t>(at - cut.s.begin()), cut.s.size() - 1);
    const PathPoint& p = in_.path.path.points[cut.first_point + i];
    const Vec3& tip = p.location.tip;
    const std::string place =
        " at point " + std::to_string(p.line) + " of the path (layer " +
        std::to_string(cut.layer + 1) + ", " + number(tip.x()) + ", " + number(tip.y()) + ", " +
        number(tip.z()) + " mm in the part, tool axis " + number(p.location.axis.x()) + ", " +
        number(p.location.axis.y()) + ", " + number(p.location.axis.z()) + ")";
    const std::string free =
        in_.machine.axes[static_cast<std::size_t>(resolver_.free_joint())].name;
    if (found.status == GlobalResolution::Status::out_of_limits) {
      const bool reach = found.joint >= 0;
      const std::string joint =
          reach ? in_.machine.axes[static_cast<std::size_t>(found.joint)].name : std::string();
      const bool turns =
          reach &&
          in_.machine.axes[static_cast<std::size_t>(found.joint)].joint.kind == JointKind::rotary;
      diagnostics_.push_back(error(
          "KN170",
          "no position of " + free + " lets the machine reach the part" + place +
              (reach ? ": nearest is one where " + joint + " is " +
                           number(turns ? degrees_from_radians(found.excess) : found.excess) +
                           (turns ? " deg" : " mm") + " beyond its range"
                     : "") +
              ". Place the part otherwise (--work-offset) or leave that height out (--from, --to)",
          p.line));
    } else {
      diagnostics_.push_back(error(
          "KN171",
          "no way of " + free + " along the contour keeps every axis inside its range" + place,
          p.line));
    }
  }

  bool chord_holds(const FinishJoints& joints, double tool_length, double from, double to,
                   const JointVector& a, const JointVector& b) const {
    const auto& t = in_.machine.tolerance;
    for (const double share : {0.25, 0.5, 0.75}) {
      const CutterLocation want = joints.tool(from + share * (to - from));
      const JointVector q = a + share * (b - a);
      const CutterLocation at = forward_location(in_.pair.chain(), q);
      if ((at.tip - tool_length * at.axis - want.tip).norm() > kUsed * t.tip * t.budget.chord ||
          (at.axis - want.axis).norm() > kUsed * t.axis * t.budget.chord)
        return false;
    }
    return true;
  }

  JointSample sample_at(const FinishCut& cut, double s, const JointVector& q) const {
    const auto next = std::lower_bound(cut.s.begin() + 1, cut.s.end() - 1, s);
    const auto i = static_cast<std::size_t>(next - cut.s.begin());
    JointSample sample;
    sample.segment = static_cast<std::uint32_t>(cut.first_point + i);
    sample.s = std::clamp((s - cut.s[i - 1]) / (cut.s[i] - cut.s[i - 1]), 0.0, 1.0);
    sample.leg = sample.segment;
    sample.leg_share = sample.s;
    sample.q = q;
    return sample;
  }

  Made make(const ChosenCut& chosen) const {
    Made made;
    made.cut = resolver_.make(chosen);
    if (made.cut.joints) sample(in_.path.cuts[chosen.cut], made);
    return made;
  }

  void sample(const FinishCut& cut, Made& made) const {
    const FinishJoints& joints = *made.cut.joints;
    const double tool_length = resolver_.tool_length(cut);
    const double usual = std::max(kBlock, usual_block_time(in_.machine) * resolver_.feed());
    double s = 0.0;
    JointVector from = joints.joints(0.0);
    JointSample start;  // the end of the link: the cut's first point
    start.segment = static_cast<std::uint32_t>(cut.first_point);
    start.leg = start.segment;
    start.q = from;
    made.samples.push_back(start);
    made.s.push_back(0.0);
    while (s < cut.length()) {
      const double rest = cut.length() - s;
      const double step = longest_step(rest, usual, kLeastBlock, [&](double length) {
        return chord_holds(joints, tool_length, s, s + length, from, joints.joints(s + length));
      });
      s = rest - step < 1e-9 ? cut.length() : s + step;
      const JointVector to = joints.joints(s);
      made.samples.push_back(sample_at(cut, s, to));
      made.s.push_back(s);
      from = to;
    }
  }

  void append(Made made) {
    PlannedStretch stretch;
    stretch.path = std::move(made.cut.joints);
    stretch.first_sample = out_.joints.samples.size();
    stretch.s = std::move(made.s);
    out_.joints.samples.insert(out_.joints.samples.end(), made.samples.begin(), made.samples.end());
    out_.paths.push_back(std::move(stretch));
    out_.resolutions.push_back(std::move(made.cut.told));
  }

  const FinishPlanInput& in_;
  const Progress& progress_;
  CutResolver resolver_;
  Diagnostics diagnostics_;
  FinishPlan out_;
};

}  // namespace

Result<FinishPlan> plan_finish(const FinishPlanInput& input, const Progress& progress) {
  return Planner(input, progress).run();
}

Result<std::vector<std::size_t>> cuts_out_of_reach(const FinishPlanInput& input,
                                                   const Progress& progress) {
  return Planner(input, progress).out_of_reach();
}

Diagnostics finish_notes(const FinishPlan& plan, const MachineDefinition& machine,
                         const std::string& file_name) {
  if (plan.resolutions.empty()) return {};
  std::size_t back = 0, grid = 0;
  double before = 0.0, after = 0.0, lower = INFINITY, upper = -INFINITY;
  for (const FinishResolution& r : plan.resolutions) {
    back += r.wound_back;
    grid += r.seed == "grid";
    before += r.jerk_before;
    after += r.jerk_after;
    lower = std::min({lower, r.start, r.end});
    upper = std::max({upper, r.start, r.end});
  }
  std::string name;
  bool rotary = false;
  for (const AxisDefinition& axis : machine.axes)
    if (axis.joint.redundant) {
      name = axis.name;
      rotary = axis.joint.kind == JointKind::rotary;
    }
  const auto value = [rotary](double v) { return number(rotary ? degrees_from_radians(v) : v); };
  Diagnostic d;
  d.severity = Severity::note;
  d.code = "KN173";
  d.text = name + " is free and goes from cut to cut between " + value(lower) + " and " +
           value(upper) + (rotary ? " deg" : " mm") + "; " + std::to_string(back) + " of " +
           std::to_string(plan.resolutions.size()) + " links turn it in between; " +
           std::to_string(grid) +
           " cuts leave a limit with minimum norm and follow the grid; integral of the squared "
           "joint jerk " +
           (before > 0.0 ? number(100.0 * after / before) : "100") + " % of before smoothing";
  d.where.file = file_name;
  return {d};
}

}  // namespace smoothpost
