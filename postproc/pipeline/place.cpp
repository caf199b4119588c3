#include "postproc/pipeline/place.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "kernels/core/units.h"
#include "postproc/pipeline/conversion_parts.h"
#include "postproc/pipeline/joint_plan.h"

namespace smoothpost {

namespace {

constexpr double kTipStep = 5.0;                       // mm, between locations
constexpr double kAxisStep = 2.0 * kRadiansPerDegree;  // rad
constexpr int kMostSteps = 256;                        // of one motion
constexpr std::size_t kSearched = 150;
constexpr std::size_t kMeasured = 4000;
constexpr int kSpins = 24;

/// The cuts' tool locations, of a tool of length 0, densely.
std::vector<PlacementPoint> locations_of(const ReferencePath& reference) {
  std::vector<PlacementPoint> points;
  const auto& path = reference.path().points;
  const auto add = [&](std::size_t segment, double s, bool joined) {
    const CutterLocation at = holder_location(reference.at(segment, s), path[segment].tool_length);
    PlacementPoint p;
    p.tip = at.tip;
    p.axis = at.axis;
    p.joined = joined;
    p.line = path[segment].line;
    points.push_back(p);
  };
  for (std::size_t k = 1; k <= reference.segments(); ++k) {
    if (path[k].replanned) continue;
    if (k == 1 || path[k - 1].replanned) add(k, 0.0, false);
    const double turn = std::sqrt(reference.second_derivative_bound(k).axis);
    const int steps = std::clamp(
        static_cast<int>(std::ceil(std::max(reference.length(k) / kTipStep, turn / kAxisStep))), 1,
        kMostSteps);
    for (int i = 1; i <= steps; ++i) add(k, static_cast<double>(i) / steps, true);
  }
  return points;
}

/// At most `count` of the points, evenly, and those farthest out in 26 directions.
std::vector<PlacementPoint> thinned(const std::vector<PlacementPoint>& points, std::size_t count) {
  std::set<std::size_t> kept = {points.size() - 1};
  const std::size_t step = (points.size() + count - 1) / count;
  for (std::size_t i = 0; i < points.size(); i += step) kept.insert(i);
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z) {
        const Vec3 way(x, y, z);
        std::size_t farthest = 0;
        for (std::size_t i = 1; i < points.size(); ++i)
          if (way.dot(points[i].tip) > way.dot(points[farthest].tip)) farthest = i;
        kept.insert(farthest);
      }
  std::vector<PlacementPoint> out;
  std::size_t next = 0;
  for (const std::size_t i : kept) {
    PlacementPoint p = points[i];
    for (; next < i; ++next) p.joined = p.joined && points[next].joined;
    next = i + 1;
    if (out.empty()) p.joined = false;
    out.push_back(p);
  }
  return out;
}

PlacementTask task_of(const PlaceInput& in, std::vector<PlacementPoint> points) {
  PlacementTask task;
  task.points = std::move(points);
  task.held = home_of(in.machine);
  task.spins.clear();
  if (in.machine.recipe.spin)
    task.spins = {*in.machine.recipe.spin};
  else
    for (int k = 0; k < kSpins; ++k) task.spins.push_back(2.0 * kPi * k / kSpins);
  return task;
}

PlaceMargins named(const PlacementMargins& margins, const PlacementMeasure& measure,
                   const MachineDefinition& machine) {
  PlaceMargins out;
  const auto add = [&](const std::string& name, const PlacementMargins::Margin& margin) {
    out.all.push_back({name, margin.value, measure.task().points[margin.point].line});
  };
  for (std::size_t j = 0; j < margins.joints.size(); ++j)
    if (!machine.axes[j].joint.redundant) add(machine.axes[j].name, margins.joints[j]);
  if (measure.inverse().six_r()) add("singularity", margins.singular);
  if (margins.reach.value < 0.0) add("reach", margins.reach);
  return out;
}

double rounded(double value, double step) { return std::round(value / step) * step + 0.0; }

/// The place with its numbers rounded; the box is kept to.
FoundPlace typed(const Pose& placement, const std::optional<ReachBox>& box) {
  FoundPlace out;
  const Vec3 angles = rpy_of(placement.linear());
  const bool upright = std::abs(angles.x()) < 1e-9 && std::abs(angles.y()) < 1e-9;
  for (int i = 0; i < 3; ++i) {
    out.position[i] = rounded(placement.translation()[i], 0.1);
    if (box) out.position[i] = std::clamp(out.position[i], box->lower[i], box->upper[i]);
    out.turn[i] =
        rounded(angles[i] / kRadiansPerDegree, upright ? 0.1 : 0.0001) * kRadiansPerDegree;
  }
  out.placement.translation() = out.position;
  out.placement.linear() = rotation_from_rpy(out.turn.x(), out.turn.y(), out.turn.z());
  return out;
}

PlacementSearch search_of(const PlaceInput& in, const PlacementMeasure& measure) {
  PlacementSearch search;
  search.start = in.start;
  search.turn = in.turn;
  search.vertical = in.machine.workpiece.frame.linear().transpose() * Vec3::UnitZ();
  if (in.box) {
    search.lower = in.box->lower;
    search.upper = in.box->upper;
    return search;
  }
  Vec3 low = measure.task().points.front().tip, high = low;
  for (const auto& p : measure.task().points) {
    low = low.cwiseMin(p.tip);
    high = high.cwiseMax(p.tip);
  }
  search.pivot = 0.5 * (low + high);
  const ReachBox box = reach_box(measure.inverse(), measure.task().held);
  search.lower = box.lower;
  search.upper = box.upper;
  if (in.machine.links.has_plane && (search.vertical - Vec3::UnitZ()).norm() < 1e-9) {
    double top = 0.0;  // of the path over its pivot
    for (const auto& p : measure.task().points)
      top = std::max(top, (in.start.linear() * (p.tip - search.pivot)).z());
    const double plane = in.machine.links.retract - in.machine.workpiece.frame.translation().z();
    search.upper.z() = std::max(
        search.lower.z(), std::min(search.upper.z(), plane - in.machine.links.clearance - top));
  }
  return search;
}

}  // namespace

const PlaceMargin& PlaceMargins::tightest() const {
  return *std::min_element(all.begin(), all.end(), [](const PlaceMargin& a, const PlaceMargin& b) {
    return a.value < b.value;
  });
}

Vec3 rpy_of(const Mat3& r) {
  const double b = std::atan2(-r(2, 0), std::hypot(r(0, 0), r(1, 0)));
  if (std::hypot(r(0, 0), r(1, 0)) < 1e-9) return {0.0, b, std::atan2(-r(0, 1), r(1, 1))};
  return {std::atan2(r(2, 1), r(2, 2)), b, std::atan2(r(1, 0), r(0, 0))};
}

Result<Places> find_places(const PlaceInput& in, const Progress& progress) {
  const auto fail = [&in](const char* code, std::string text) {
    return Result<Places>::failure(diagnostic(code, std::move(text)));
  };
  if (in.machine.recipe.task == "pose")
    return fail("US120",
                "recipe.task = \"pose\" is not possible when the part is to be placed; possible: "
                "axis (the rotation about the tool is free)");
  const auto inverse = Inverse::from(placed_chain(in.machine, Pose::Identity()));
  if (!inverse)
    return fail("KN110", "machine " + in.machine.name +
                             " has no closed form in this version: the part cannot be placed");
  ToolPath path = in.input.path;
  find_cuts(path, in.links);
  const ReferencePath reference(path, in.input.frames);
  const std::vector<PlacementPoint> points = locations_of(reference);
  if (points.empty()) return fail("KN140", "the program has no cut that could be placed");

  const PlacementMeasure coarse(*inverse, task_of(in, thinned(points, kSearched)));
  const PlacementMeasure dense(*inverse, task_of(in, thinned(points, kMeasured)));
  const PlacementResult found = place_path(coarse, search_of(in, dense), progress);
  if (found.cancelled) return fail("US190", "cancelled");
  Places out;
  out.evaluations = found.evaluations;
  out.before = named(dense.at(in.start), dense, in.machine);
  for (const auto& candidate : found.best) {
    FoundPlace place = typed(candidate.placement, in.box);
    place.margins = named(dense.at(place.placement), dense, in.machine);
    out.best.push_back(std::move(place));
  }
  std::stable_sort(out.best.begin(), out.best.end(), [](const FoundPlace& a, const FoundPlace& b) {
    return a.margins.tightest().value > b.margins.tightest().value;
  });
  return out;
}

}  // namespace smoothpost
