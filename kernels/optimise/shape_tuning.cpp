#include "kernels/optimise/shape_tuning.h"

#include <nlopt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

constexpr int kSteps = 96;         // places of one window
constexpr double kSharpest = 3.0;  // rad: reversals are stops

CornerSettings with_shape(CornerSettings settings, const BlendShape& shape) {
  settings.paper_shape = false;
  settings.shape = shape.acr;
  settings.ramp_c1 = shape.c1;
  return settings;
}

/// The corner at node 1 of a path of three nodes, with another shape.
CornerPath reshaped(const CornerPath& corner, const CornerSettings& settings) {
  std::vector<PathLeg> legs(2);
  legs[0].turn = corner.turn(0);
  legs[1].turn = corner.turn(1);
  return CornerPath(corner.nodes(), legs, {}, settings);
}

Pose pose_at(const CornerPath& corner, double x) {
  return x < 0.0 ? corner.at(0, corner.length(0) + x) : corner.at(1, x);
}

/// The largest third difference over the window of one corner; below 0: out of reach.
double peak_of(const Inverse& inverse, const CornerPath& corner, const TuningSettings& settings) {
  const Corner& c = corner.corners()[1];
  const double extent = std::max(c.half_width * c.blend.reach(),
                                 c.rotation_half_width * corner.rotation_blend().reach());
  if (extent <= 0.0) return 0.0;
  const double h = 2.0 * extent / kSteps;
  const ScrewChain& chain = inverse.chain();
  JointVector near = settings.start;
  std::array<JointVector, 4> q;
  double peak = 0.0;
  for (int i = 0; i <= kSteps; ++i) {
    const double x = std::clamp(-extent + i * h, -corner.length(0), corner.length(1));
    Pose tool = pose_at(corner, x);
    tool.linear() =
        tool.linear() *
        Eigen::Quaterniond::FromTwoVectors(chain.tool_axis, Vec3::UnitZ()).toRotationMatrix();
    tool.translation() += settings.tool_length * (tool.linear() * chain.tool_axis);
    const auto found = inverse.nearest(tool, near);
    if (!found) return -1.0;
    near = *found;
    std::rotate(q.begin(), q.begin() + 1, q.end());
    q[3] = near;
    if (i < 3) continue;
    const JointVector third = (q[3] - 3.0 * q[2] + 3.0 * q[1] - q[0]) / (h * h * h);
    peak = std::max(peak, third.cwiseAbs().cwiseQuotient(settings.jerk_limits).maxCoeff());
  }
  return peak;
}

struct Search {
  const Inverse& inverse;
  const std::vector<CornerPath>& corners;
  const TuningSettings& settings;
  int evaluations = 0;

  BlendShape shape_of(const double* x) const {
    BlendShape shape;
    if (settings.corners.kind == BlendKind::acr)
      shape.acr = {x[0], x[1]};
    else
      shape.c1 = x[0];
    return shape;
  }

  double peak(const BlendShape& shape) {
    ++evaluations;
    const CornerSettings with = with_shape(settings.corners, shape);
    std::vector<CornerPath> made;
    made.reserve(corners.size());
    for (const CornerPath& corner : corners) made.push_back(reshaped(corner, with));
    int reached = 0;
    return peak_joint_jerk(inverse, made, settings, reached);
  }
};

double objective(unsigned /*n*/, const double* x, double* /*gradient*/, void* data) {
  auto& search = *static_cast<Search*>(data);
  return search.peak(search.shape_of(x));
}

}  // namespace

double peak_joint_jerk(const Inverse& inverse, const std::vector<CornerPath>& corners,
                       const TuningSettings& settings, int& reached) {
  double peak = 0.0;
  reached = 0;
  for (const CornerPath& corner : corners) {
    const double here = peak_of(inverse, corner, settings);
    if (here < 0.0) continue;
    ++reached;
    peak = std::max(peak, here);
  }
  return peak;
}

std::vector<CornerPath> single_corners(const std::vector<CornerPath>& runs,
                                       const CornerSettings& settings, int most) {
  struct Found {
    const CornerPath* run;
    std::size_t node;
    double turn;
  };
  std::vector<Found> found;
  for (const CornerPath& run : runs)
    for (std::size_t i = 1; i < run.legs(); ++i) {
      const Corner& c = run.corners()[i];
      if (c.stop || c.turn > kSharpest || (c.half_width <= 0.0 && c.rotation_half_width <= 0.0))
        continue;
      found.push_back({&run, i, c.turn});
    }
  std::vector<std::size_t> order(found.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return found[a].turn > found[b].turn; });
  order.resize(std::min<std::size_t>(order.size(), static_cast<std::size_t>(most)));
  std::sort(order.begin(), order.end());
  std::vector<CornerPath> corners;
  for (const std::size_t k : order) {
    const CornerPath& run = *found[k].run;
    const std::size_t i = found[k].node;
    // Half of each leg: what is left when the neighbours want as much.
    const Pose before = run.original(i - 1, 0.5 * run.length(i - 1));
    const Pose behind = run.original(i, 0.5 * run.length(i));
    std::vector<PathNode> nodes = {
        {before.translation(), Eigen::Quaterniond(before.linear()), true},
        {run.nodes()[i].tip, run.nodes()[i].rotation, false},
        {behind.translation(), Eigen::Quaterniond(behind.linear()), true}};
    if ((nodes[0].tip - nodes[1].tip).norm() < 1e-9 || (nodes[2].tip - nodes[1].tip).norm() < 1e-9)
      continue;
    std::vector<PathLeg> legs(2);
    legs[0].turn = 0.5 * run.turn(i - 1);
    legs[1].turn = 0.5 * run.turn(i);
    corners.emplace_back(nodes, legs, std::vector<ArcGeometry>{}, settings);
  }
  return corners;
}

TuningResult tune_blend_shape(const Inverse& inverse, const std::vector<CornerPath>& runs,
                              const TuningSettings& settings) {
  require(!runs.empty() && settings.evaluations > 0, "shape_tuning: a path and an evaluation");
  require(settings.jerk_limits.size() == inverse.chain().size() &&
              settings.jerk_limits.minCoeff() > 0.0,
          "shape_tuning: a jerk limit above 0 for each joint");
  TuningResult result;
  const auto corners = single_corners(runs, settings.corners, settings.most_corners);
  double mean = 0.0;
  for (const CornerPath& corner : corners)
    mean += ramp_c1(corner.corners()[1].turn) / static_cast<double>(corners.size());
  result.before.c1 = result.after.c1 = mean;
  if (corners.empty()) return result;
  Search search{inverse, corners, settings};
  result.peak_before = result.peak_after = search.peak(result.before);
  peak_joint_jerk(inverse, corners, settings, result.corners);
  const bool acr = settings.corners.kind == BlendKind::acr;
  std::vector<double> x = acr ? std::vector<double>{0.5, 0.5} : std::vector<double>{mean};
  const std::vector<double> lower =
      acr ? std::vector<double>{0.4, -0.5} : std::vector<double>{-1.09};
  const std::vector<double> upper = acr ? std::vector<double>{0.6, 2.5} : std::vector<double>{6.56};
  const std::vector<double> step = acr ? std::vector<double>{0.02, 0.2} : std::vector<double>{0.5};
  nlopt_opt opt = nlopt_create(NLOPT_LN_SBPLX, static_cast<unsigned>(x.size()));
  nlopt_set_min_objective(opt, &objective, &search);
  nlopt_set_lower_bounds(opt, lower.data());
  nlopt_set_upper_bounds(opt, upper.data());
  nlopt_set_initial_step(opt, step.data());
  nlopt_set_maxeval(opt, settings.evaluations);
  nlopt_set_xtol_abs1(opt, 1e-4);
  double value = 0.0;
  nlopt_optimize(opt, x.data(), &value);
  nlopt_destroy(opt);
  const BlendShape found = search.shape_of(x.data());
  const double peak = search.peak(found);
  if (peak < result.peak_before) {
    result.after = found;
    result.peak_after = peak;
  }
  result.evaluations = search.evaluations;
  return result;
}

}  // namespace smoothpost
