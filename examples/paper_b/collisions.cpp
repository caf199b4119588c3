#include "examples/paper_b/collisions.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "kernels/collision/feasible_domain.h"
#include "kernels/collision/motion_check.h"
#include "kernels/collision/via_points.h"
#include "kernels/core/units.h"
#include "kernels/spline/polygon_curve.h"

namespace smoothpost::paper_b {

namespace {

constexpr double kHalf = 30.0;    // mm, of the strip
constexpr double kGap = 1.0;      // mm
constexpr double kCap = 50.0;     // mm
constexpr double kMargin = 0.05;  // mm, that the graph's cells keep
constexpr int kSteps = 6276;

/// Nozzle and casing as machines/laser_5p1 has them.
Scene scene_of(const TriangleMesh& strip) {
  auto part = mesh_shape(strip);
  if (!part.ok()) throw std::runtime_error("the strip has no tree of triangles");
  const auto nozzle = ConvexShape::frustum(
      {.from = {0, 0, 0}, .to = {0, 0, 60}, .radius_from = 2.0, .radius_to = 25.0});
  const auto casing = ConvexShape::frustum(
      {.from = {0, 0, 160}, .to = {0, 0, 400}, .radius_from = 60.0, .radius_to = 60.0});
  return Scene(
      laser(0.0),
      {{"nozzle", 5, nozzle},
       {"casing", 4, casing},
       {"part", SceneBody::kWorkpiece, CollisionShape(std::move(part.value()))}},
      {{.first = 0, .second = 2, .clearance = 0.2}, {.first = 1, .second = 2, .clearance = 2.0}});
}

/// What the methods are compared by.
struct Bench {
  const Study& study;
  ScrewChain chain = laser(0.0);
  RotaryPair pair = *RotaryPair::from(laser(0.0));
  Scene scene;
  std::vector<double> u;

  explicit Bench(const Study& s) : study(s), scene(scene_of(strip_of(s.path(), kHalf, kGap))) {
    for (const OrientationWindow& w : s.windows()) u.push_back(w.u);
  }
  JointVector joints(std::size_t i, const std::array<double, 2>& rotary, double q6) const {
    JointVector q = JointVector::Zero(6);
    q[3] = rotary[0];
    q[4] = rotary[1];
    q[5] = q6;
    return *pair.with_linears(study.path().locations[i].tip, q);
  }
};

CollisionRow check(const Bench& bench, const std::string& name,
                   const std::vector<JointVector>& joints) {
  CollisionRow row;
  row.method = name;
  row.least = kCap;
  SceneCache cache;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    row.locations += !bench.scene.free(joints[i], &cache);
    row.least = std::min(row.least, bench.scene.clearance(joints[i], row.least, &cache).margin);
    if (i > 0)
      row.motions += check_motion(bench.scene, joints[i - 1], joints[i], {}, &cache).verdict !=
                     MotionVerdict::free;
  }
  row.queries = cache.queries();
  row.skipped = cache.skipped();
  return row;
}

CollisionRow by_rotaries(const Bench& bench, const std::string& name, const SplineCurve& rotary,
                         const SplineCurve* standoff) {
  std::vector<JointVector> joints;
  for (std::size_t i = 0; i < bench.u.size(); ++i) {
    const double u = std::min(bench.u[i], rotary.knots.last());
    const Eigen::VectorXd q = rotary.at(u);
    joints.push_back(bench.joints(i, {q[0], q[1]}, standoff ? standoff->at(u)[0] : 0.0));
  }
  CollisionRow row = check(bench, name, joints);
  const Motion motion =
      motion_of_splines(bench.study, rotary, {0.0, bench.study.path().feed, standoff, kSteps});
  row.peak = std::max(jerk_numbers(motion, 3).peak, jerk_numbers(motion, 4).peak);
  return row;
}

CollisionRow by_axis(const Bench& bench, Method method) {
  const auto axis = bench.study.baseline_axis(method);
  std::vector<JointVector> joints;
  double before = 0.0;
  for (std::size_t i = 0; i < bench.u.size(); ++i) {
    const auto q = Study::rotaries_of(axis(bench.u[i]), before);
    before = q[0];
    joints.push_back(bench.joints(i, q, 0.0));
  }
  CollisionRow row = check(bench, to_string(method), joints);
  const Motion motion =
      motion_of_baseline(bench.study, method, {0.0, bench.study.path().feed, nullptr, kSteps});
  row.peak = std::max(jerk_numbers(motion, 3).peak, jerk_numbers(motion, 4).peak);
  return row;
}

DomainProblem problem_of(const Bench& bench) {
  DomainProblem p;
  p.pair = &bench.pair;
  p.scene = &bench.scene;
  p.standoff = 5;
  p.held = JointVector::Zero(6);
  p.lower.resize(6);
  p.upper.resize(6);
  for (int j = 0; j < 6; ++j) {
    p.lower[j] = bench.chain.joints[static_cast<std::size_t>(j)].lower;
    p.upper[j] = bench.chain.joints[static_cast<std::size_t>(j)].upper;
  }
  p.standoffs = {-95.0, -67.5, -40.0, -12.5, 15.0};
  p.leads = p.tilts = 9;
  p.margin = kMargin;
  return p;
}

CollisionRow by_graph(const Bench& bench, std::size_t every) {
  const DomainProblem problem = problem_of(bench);
  std::vector<std::size_t> stations;
  for (std::size_t i = 0; i + 1 < bench.u.size(); i += every) stations.push_back(i);
  stations.push_back(bench.u.size() - 1);
  std::vector<DomainPlace> places;
  std::vector<double> u, step;
  for (const std::size_t i : stations) {
    const OrientationWindow& w = bench.study.windows()[i];
    places.push_back({bench.study.path().locations[i].tip, w.normal, w.tangent, w.binormal,
                      w.lead_low, w.lead_high, w.tilt_low, w.tilt_high, i});
    u.push_back(bench.u[i]);
    step.push_back(static_cast<double>(every));
  }
  const auto domains = feasible_domains(problem, places);
  std::size_t queries = 0, skipped = 0;
  std::vector<std::vector<WristNode>> layers(places.size());
  for (std::size_t k = 0; k < places.size(); ++k) {
    queries += domains[k].queries;
    skipped += domains[k].skipped;
    for (std::size_t n = 0; n < domains[k].cells.size(); ++n) {
      if (domains[k].cells[n].verdict != CellVerdict::free) continue;
      const auto q = domain_joints(problem, places[k], domains[k].index(n));
      const Vec3 axis = forward_location(bench.chain, *q).axis;
      WristNode node;
      node.standoff = (*q)[5];
      node.cost = 5.0 * (axis - places[k].normal).norm() + 0.005 * std::abs(node.standoff);
      for (double turn = -2.0 * kPi; turn <= 2.0 * kPi; turn += 2.0 * kPi) {
        node.rotary = {(*q)[3] + turn, (*q)[4]};
        if (std::abs(node.rotary[0]) <= 2.0 * kPi) layers[k].push_back(node);
      }
    }
  }
  RouteSettings settings;
  settings.squared = 1.0;
  const WristRoute route = best_route(layers, settings, step);
  if (route.node.empty())
    throw std::runtime_error("no way through the domains, blocked at cutter location " +
                             std::to_string(stations[route.blocked]));
  Eigen::MatrixXd wrist(3, static_cast<Eigen::Index>(layers.size()));
  for (std::size_t k = 0; k < layers.size(); ++k) {
    const WristNode& n = layers[k][route.node[k]];
    wrist.col(static_cast<Eigen::Index>(k)) << n.rotary[0], n.rotary[1], n.standoff;
  }
  // Shorter pieces come nearer to the polygon of the route, until nothing is met.
  CollisionRow row;
  for (const int finer : {1, 2, 4, 8}) {
    const int pieces = finer * static_cast<int>(bench.study.spans());
    SplineKnots knots = clamped_knots(5, pieces);
    for (double& at : knots.values) at /= finer;
    const SplineCurve curve = polygon_curve(knots, u, wrist);
    const SplineCurve rotary{knots, curve.controls.topRows(2)};
    const SplineCurve standoff{knots, curve.controls.bottomRows(1)};
    row = by_rotaries(bench, "graph", rotary, &standoff);
    queries += row.queries;
    skipped += row.skipped;
    if (row.motions == 0) break;
  }
  row.queries = queries;
  row.skipped = skipped;
  return row;
}

}  // namespace

TriangleMesh strip_of(const Case& given, double half, double gap) {
  TriangleMesh mesh;
  for (std::size_t i = 0; i < given.locations.size(); ++i) {
    const CutterLocation& l = given.locations[i];
    const std::size_t before = i == 0 ? 0 : i - 1,
                      behind = std::min(i + 1, given.locations.size() - 1);
    const Vec3 along = given.locations[behind].tip - given.locations[before].tip;
    const Vec3 across = l.axis.cross(along).normalized();
    const Vec3 foot = l.tip - gap * l.axis;
    mesh.vertices.push_back(foot - half * across);
    mesh.vertices.push_back(foot + half * across);
    if (i == 0) continue;
    const auto at = static_cast<std::uint32_t>(2 * i);
    mesh.triangles.push_back({at - 2, at, at + 1});
    mesh.triangles.push_back({at - 2, at + 1, at - 1});
  }
  return mesh;
}

std::vector<CollisionRow> collision_rows(const Study& study, std::size_t every) {
  const Bench bench(study);
  std::vector<CollisionRow> rows;
  for (const Method method : {Method::qi, Method::qi_c2}) rows.push_back(by_axis(bench, method));
  rows.push_back(by_graph(bench, every));
  for (const Method method : {Method::via, Method::cone}) {
    const RotaryResult r = study.rotaries({method, study.path().feed, false, 0.0, {}});
    if (r.status != RotaryStatus::optimal)
      throw std::runtime_error("no rotaries for " + to_string(method));
    rows.push_back(by_rotaries(bench, to_string(method), r.q, nullptr));
  }
  return rows;
}

void print_collisions(const Study& study) {
  std::printf(
      "\nL0 = 0 mm, the head of machines/laser_5p1 above a strip of %.0f mm, clearances 0.2 mm "
      "(nozzle) and 2 mm (casing), %zu cutter locations\n",
      2.0 * kHalf, study.path().locations.size());
  std::printf(
      "method | locations, motions that are not free | least beyond the clearance, mm | pairs "
      "searched, skipped | peak |jerk| of q4 q5, rad/s3\n");
  for (const CollisionRow& r : collision_rows(study))
    std::printf("%-6s | %4zu %4zu | %8.3f | %7zu %8zu | %10.4g\n", r.method.c_str(), r.locations,
                r.motions, r.least, r.queries, r.skipped, r.peak);
}

}  // namespace smoothpost::paper_b
