#include "postproc/pipeline/laser_plan.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/units.h"
#include "postproc/pipeline/conversion_parts.h"
#include "postproc/pipeline/laser_stretch.h"
#include "postproc/pipeline/orientation_check.h"

namespace smoothpost {

namespace {

/// Replaces the samples of the stretches in those of the programmed path.
class LaserPlanner {
 public:
  LaserPlanner(const LaserPlanInput& input, const JointPlan& base, const Progress& progress)
      : in_(input), base_(base), progress_(progress) {}

  Result<LaserPlan> run() {
    const auto head = HeadGeometry::from(in_.pair.chain());
    if (!head)
      return Result<LaserPlan>::failure(diagnostic("KN150",
                                                   "recipe.optimise = \"jerk\" needs a head of "
                                                   "three linear axes that carry two rotaries and "
                                                   "a redundant axis along the tool, and machine " +
                                                       in_.machine.name +
                                                       " is none: set recipe.optimise = \"none\"",
                                                   in_.file_name));
    LaserPlan plan;
    Diagnostics warnings;
    std::size_t next = 0;  // first base sample that is not taken over
    std::size_t done = 0;
    for (const Cut& cut : in_.cuts) {
      if (cut.omitted) continue;
      const CuttingFrames frames(in_.reference, cut.first, cut.last, in_.part);
      for (const StretchRange& range : stretches_of(in_.reference, cut, in_.machine.process)) {
        StretchPlanner planner({in_, *head, frames, range}, base_.samples);
        if (!planner.worth_it()) continue;
        auto result = planner.run();
        if (!result.ok()) {
          Diagnostics problems = result.diagnostics();
          if (!goes_on(problems)) return Result<LaserPlan>::failure(std::move(problems));
          plan.keeps_programmed = true;
          append(warnings, problems);
          continue;
        }
        take_until(planner.first_sample(), next, plan.joints.samples);
        // Where a stretch went before, its end is the start of this one.
        auto& samples = result.value().samples;
        const std::ptrdiff_t from = next > planner.first_sample() ? 1 : 0;
        plan.joints.samples.insert(plan.joints.samples.end(), samples.begin() + from,
                                   samples.end());
        next = planner.end_sample();
        plan.paths.push_back({std::move(result.value().path),
                              plan.joints.samples.size() - samples.size(),
                              std::move(result.value().u)});
        plan.stretches.push_back(std::move(result.value().report));
        if (result.value().not_clear) plan.not_clear.push_back(*result.value().not_clear);
      }
      if (!progress_("optimise",
                     static_cast<double>(++done) / static_cast<double>(in_.cuts.size())))
        return Result<LaserPlan>::failure(
            diagnostic("KN105", "cancelled while the cuts were optimised", in_.file_name));
    }
    take_until(base_.samples.size(), next, plan.joints.samples);
    return Result<LaserPlan>(std::move(plan), std::move(warnings));
  }

 private:
  // A stretch that cannot be optimised keeps the joints of the programmed path, and that is said;
  // where the orientation was freed for it, or the feed is not to change, there is no such way.
  bool goes_on(Diagnostics& problems) const {
    for (Diagnostic& d : problems) {
      const bool kept = !orientation_is_free(in_.machine);
      if (!(d.code == "KN153" || d.code == "KN154" || (d.code == "KN151" && kept))) return false;
      d.severity = Severity::warning;
      d.text += ". This stretch keeps the joints of the programmed path, and stops at its corners";
    }
    return true;
  }

  void take_until(std::size_t end, std::size_t& next, std::vector<JointSample>& samples) const {
    for (; next < end; ++next) samples.push_back(base_.samples[next]);
  }

  const LaserPlanInput& in_;
  const JointPlan& base_;
  const Progress& progress_;
};

}  // namespace

std::vector<JointSample> joined_samples(const ReferencePath& reference,
                                        const std::vector<Cut>& cuts, const ProcessTable& process,
                                        const std::vector<JointSample>& base) {
  std::vector<JointSample> out;
  for (const Cut& cut : cuts) {
    if (cut.omitted) continue;
    const std::vector<StretchRange> ranges = stretches_of(reference, cut, process);
    std::size_t r = 0;
    for (const JointSample& s : samples_of_cuts({cut}, base)) {
      while (r < ranges.size() && ranges[r].last < s.segment) ++r;
      if (r < ranges.size() && s.segment >= ranges[r].first &&
          (s.segment < ranges[r].last || s.s < 1.0 || ranges[r].ends_cut))
        continue;
      if (s.segment < cut.first && !ranges.empty() && ranges.front().starts_cut) continue;
      out.push_back(s);
    }
  }
  return out;
}

std::vector<JointSample> samples_of_cuts(const std::vector<Cut>& cuts,
                                         const std::vector<JointSample>& base) {
  std::vector<JointSample> out;
  for (const Cut& cut : cuts) {
    if (cut.omitted) continue;
    for (std::size_t i = 0; i < base.size(); ++i)
      if ((base[i].segment >= cut.first && base[i].segment <= cut.last) ||
          (i + 1 < base.size() && base[i].segment < cut.first && base[i + 1].segment >= cut.first))
        out.push_back(base[i]);
  }
  return out;
}

Result<LaserPlan> plan_laser(const LaserPlanInput& input, const JointPlan& base,
                             const Progress& progress) {
  return LaserPlanner(input, base, progress).run();
}

}  // namespace smoothpost
