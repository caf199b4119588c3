#include <algorithm>
#include <catch2/catch.hpp>

#include "kernels/core/units.h"
#include "kernels/geometry/triangle_tree.h"
#include "kernels/optimise/redundancy.h"
#include "postproc/pipeline/convert.h"
#include "postproc/pipeline/finish_path.h"
#include "postproc/pipeline/finish_plan.h"
#include "postproc/pipeline/finish_reach.h"
#include "tests/kernels/geometry/parts.h"
#include "tests/support/machines.h"

using namespace smoothpost;

namespace {

FinishPath path_of(const test::Soup& soup, const FinishSettings& settings) {
  auto made = make_finish_path(weld(soup), settings, "part.stl", {});
  for (const auto& d : made.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(made.ok());
  return std::move(made.value());
}

bool says(const Diagnostics& list, const std::string& code) {
  return std::any_of(list.begin(), list.end(), [&](const Diagnostic& d) { return d.code == code; });
}

const Check& check_of(const Checks& checks, const std::string& name) {
  const auto found =
      std::find_if(checks.begin(), checks.end(), [&](const Check& c) { return c.name == name; });
  REQUIRE(found != checks.end());
  return *found;
}

FinishSettings layers(double from, double to) {
  FinishSettings s;
  s.from = from;
  s.to = to;
  return s;
}

struct Planned {
  MachineDefinition machine = test::shipped_machine("finish_2p2r_1p1r");
  ScrewChain chain;
  std::optional<RotaryPair> pair;
  ToolPath path;
  std::vector<Cut> cuts;

  Planned(const FinishPath& finish, const Vec3& place) : path(finish.path) {
    chain = chain_of(machine);
    chain.workpiece_home.translation() += place;
    pair = RotaryPair::from(chain);
    REQUIRE(pair);
    cuts = find_cuts(path, {});
  }
  Result<FinishPlan> plan(const FinishPath& finish) const {
    return plan_finish({finish, cuts, machine, *pair, "part.stl", nullptr}, {});
  }
};

}  // namespace

TEST_CASE("make_finish_path: the tip on the part and the axis along its normal",
          "[postproc][pipeline][finish]") {
  const test::Soup part = test::ellipse_body(50, 35, 40, 384, 50);
  const FinishSettings settings = layers(10.3, 12.3);
  const FinishPath path = path_of(part, settings);
  REQUIRE(path.layers.size() == 3);
  REQUIRE(path.cuts.size() == 3);
  CHECK(path.fitted == path.samples);
  for (const Check& c : path.checks) CHECK(c.ok);
  CHECK(check_of(path.checks, "depth_of_cut").value < 0.02);
  for (std::size_t k = 0; k < 3; ++k) {
    const FinishCut& cut = path.cuts[k];
    CHECK(cut.closed);
    // Every second layer runs the other way round.
    CHECK(cut.turning == Approx(k % 2 ? -2 * kPi : 2 * kPi).margin(0.1));
    double off = 0.0, turned = 0.0;
    for (double s = 6.0; s < cut.length() - 6.0; s += 0.37) {
      const LocationJet at = cut.location(s);
      const Vec3 p = at.tip.col(0);
      const Vec3 gradient(p.x() / 2500, p.y() / 1225, 0.0);
      const double level = 0.5 * (p.x() * p.x() / 2500 + p.y() * p.y() / 1225 - 1.0);
      off = std::max(off, std::abs(level) / gradient.norm());
      turned = std::max(turned, angle_between(gradient.normalized(), at.axis.col(0)));
      CHECK(std::abs(p.z() - path.layers[k].height) < 2 * settings.tip_tolerance);
      const double h = 1e-4;
      for (int r = 0; r < 3; ++r)
        CHECK(((cut.location(s + h).axis.col(r) - cut.location(s - h).axis.col(r)) / (2 * h) -
               at.axis.col(r + 1))
                  .norm() < 1e-4);
    }
    CHECK(off < settings.tip_tolerance + 0.5e-3);
    CHECK(turned < settings.axis_tolerance + 0.15e-3);
    // Both ends stand off the part by the lead's radius: outside the stock.
    for (const double s : {0.0, cut.length()}) {
      const LocationJet at = cut.location(s);
      const double x = at.tip(0, 0) / 50, y = at.tip(1, 0) / 35;
      CHECK(std::hypot(x, y) > 1.0 + 2.0 * settings.depth / 50);
    }
  }
  REQUIRE(path.path.events.size() == 2);
  CHECK(path.path.events[0].event.name == "spindle_on");
}

TEST_CASE("make_finish_path: holes and edges and flat walls", "[postproc][pipeline][finish]") {
  SECTION("a hole is finished from inside") {
    const test::Soup ring =
        test::together({test::ellipse_body(30, 30, 20, 180, 12),
                        test::turned_over(test::ellipse_body(15, 15, 20, 120, 12))});
    FinishSettings settings = layers(8, 8);
    settings.mill = {1.5, 6.0};
    const FinishPath path = path_of(ring, settings);
    REQUIRE(path.cuts.size() == 2);
    for (const Check& c : path.checks) CHECK(c.ok);
    for (const FinishCut& cut : path.cuts) {
      const LocationJet at = cut.location(0.5 * cut.length());
      const double radius = at.tip.col(0).head<2>().norm();
      const double outwards = at.axis.col(0).dot(at.tip.col(0)) / radius;
      CHECK(outwards == Approx(radius > 20 ? 1.0 : -1.0).margin(1e-3));
    }
  }
  SECTION("a hole that the mill does not fit in; outer contours only") {
    const test::Soup ring =
        test::together({test::ellipse_body(30, 30, 20, 180, 12),
                        test::turned_over(test::ellipse_body(12, 12, 20, 120, 12))});
    const FinishPath path = path_of(ring, layers(8, 8));
    REQUIRE(path.cuts.size() == 1);
    CHECK(path.layers[0].left_out.mill == Approx(2 * 12 * kPi).epsilon(0.01));
    FinishSettings settings = layers(8, 8);
    settings.outer_only = true;
    const auto made = make_finish_path(weld(ring), settings, "p", {});
    REQUIRE(made.ok());
    CHECK(made.value().cuts.size() == 1);
    CHECK(made.value().layers[0].left_out.mill == 0.0);
    CHECK(says(made.diagnostics(), "RG142"));
  }
  SECTION("the mill stays out of a hollow corner") {
    // An L: the corner at (0, 0) is hollow.
    const std::vector<Vec3> outline{{0, 0, 0},     {0, 20, 0},   {-20, 20, 0},
                                    {-20, -20, 0}, {20, -20, 0}, {20, 0, 0}};
    const FinishPath path = path_of(test::prism(outline, 20), layers(10, 10));
    for (const Check& c : path.checks) CHECK(c.ok);
    CHECK(path.layers[0].left_out.mill == Approx(2 * (1.5 + 0.75)).margin(0.6));
    for (const FinishCut& cut : path.cuts)
      for (double s = 0.0; s <= cut.length(); s += 0.2) {
        const LocationJet at = cut.location(s);
        const Vec3 ball = at.tip.col(0) + 1.5 * at.axis.col(0);
        const Vec3 into(std::max(ball.x(), 0.0), std::max(ball.y(), 0.0), 0.0);
        if (ball.x() > 0.0 && ball.y() > 0.0 && ball.x() < 20.0 && ball.y() < 20.0)
          CHECK(into.head<2>().minCoeff() > 1.5 - 0.07);
      }
  }
  SECTION("facets of 10 deg: the stock is that of the cylinder that they stand for") {
    const FinishPath path = path_of(test::ellipse_body(35, 35, 40, 36, 8), layers(12, 12));
    REQUIRE(path.cuts.size() == 1);
    CHECK(check_of(path.checks, "depth_of_cut").ok);
    for (double s = 6.0; s < path.cuts[0].length() - 6.0; s += 3.1)
      CHECK(path.cuts[0].location(s).tip.col(0).head<2>().norm() == Approx(35.0).margin(0.03));
  }
  SECTION("walls inside of another body are not cut") {
    const FinishPath path = path_of(test::together({test::box({-20, -15, 0}, {20, 15, 30}),
                                                    test::box({10, -5, 0}, {40, 5, 30})}),
                                    layers(10, 10));
    for (const Check& c : path.checks) CHECK(c.ok);
    // At least 10 mm of two sides and one end of the second box, and 10 mm of the first one's face.
    const LeftOut& out = path.layers[0].left_out;
    CHECK(out.buried + out.mill > 2 * 10 + 10 + 10 - 2.5);
    for (const FinishCut& cut : path.cuts) {
      const Vec3 middle = cut.location(0.5 * cut.length()).tip.col(0);
      const bool in_first = std::abs(middle.x()) < 19.9 && std::abs(middle.y()) < 14.9;
      const bool in_second = middle.x() > 10.1 && middle.x() < 39.9 && std::abs(middle.y()) < 4.9;
      CHECK_FALSE(in_first);
      CHECK_FALSE(in_second);
    }
  }
  SECTION("inside out") {
    const FinishPath path =
        path_of(test::turned_over(test::box({-20, -15, 0}, {20, 15, 30})), layers(10, 10));
    CHECK(path.cuts.size() == 4);
    CHECK(check_of(path.checks, "depth_of_cut").ok);
  }
  SECTION("a contour that no smooth curve follows is parted") {
    // Sides of 20 deg to each other, too long for a quadric: planes that are no edges.
    std::vector<Vec3> outline;
    for (int i = 0; i < 18; ++i) outline.push_back(test::on_ellipse(60, 60, 2 * kPi * i / 18));
    FinishSettings settings = layers(10, 10);
    settings.axis_tolerance = radians_from_degrees(0.05);
    settings.tip_tolerance = 2e-4;
    const auto made = make_finish_path(weld(test::prism(outline, 20)), settings, "p", {});
    REQUIRE(made.ok());
    for (const Check& c : made.value().checks)
      if (c.name != "depth_of_cut") CHECK(c.ok);
    double cut = 0.0;
    for (const FinishCut& c : made.value().cuts) cut += c.length() - 2 * 0.5 * kPi * 3.0;
    const FinishLayer& layer = made.value().layers[0];
    CHECK(cut + layer.left_out.rough + layer.left_out.too_short ==
          Approx(layer.length).epsilon(0.05));
  }
  SECTION("places that a test refuses") {
    FinishSettings settings = layers(10, 10);
    settings.reach_with = [](const TriangleMesh&) {
      return [](const CutterLocation& at) { return at.tip.x() < 10.0; };
    };
    const auto made =
        make_finish_path(weld(test::box({-20, -15, 0}, {20, 15, 30})), settings, "p", {});
    REQUIRE(made.ok());
    CHECK(made.value().cuts.size() == 3);
    CHECK(made.value().layers[0].left_out.reach == Approx(30 + 2 * 10).margin(2.5));
    CHECK(says(made.diagnostics(), "RG141"));
    for (const FinishCut& c : made.value().cuts)
      CHECK(c.location(0.5 * c.length()).tip(0, 0) < 10.0);
  }
  SECTION("a box is cut face by face up to its edges") {
    const FinishPath path = path_of(test::box({-20, -15, 0}, {20, 15, 30}), layers(10, 10));
    REQUIRE(path.cuts.size() == 4);
    std::vector<double> lengths;
    for (const FinishCut& cut : path.cuts) {
      CHECK_FALSE(cut.closed);
      lengths.push_back(cut.length() - 2 * 0.5 * kPi * 3.0);
    }
    std::sort(lengths.begin(), lengths.end());
    for (int k = 0; k < 4; ++k)
      CHECK(lengths[std::size_t(k)] == Approx(k < 2 ? 30 : 40).margin(0.2));
  }
  SECTION("what faces up is left out and said") {
    const auto made =
        make_finish_path(weld(test::sphere({0, 0, 20}, 20, 80)), layers(0.2, 39.9), "p", {});
    REQUIRE(made.ok());
    CHECK(says(made.diagnostics(), "RG134"));
    for (const PathPoint& p : made.value().path.points)
      CHECK(std::abs(p.location.axis.z()) < std::sin(radians_from_degrees(82)));
  }
  SECTION("a hollow too narrow for the depth is said") {
    FinishSettings settings = layers(5, 5);
    settings.depth = 6.0;
    settings.mill = {0.5, 2.0};
    const test::Soup tube =
        test::together({test::ellipse_body(30, 30, 20, 180, 12),
                        test::turned_over(test::ellipse_body(4, 4, 20, 60, 12))});
    const auto made = make_finish_path(weld(tube), settings, "p", {});
    REQUIRE(made.ok());
    CHECK(says(made.diagnostics(), "RG135"));
    CHECK_FALSE(check_of(made.value().checks, "depth_of_cut").ok);
  }
  SECTION("nothing there") {
    const auto made =
        make_finish_path(weld(test::box({0, 0, 0}, {5, 5, 5})), layers(7, 9), "p", {});
    REQUIRE_FALSE(made.ok());
    CHECK(says(made.diagnostics(), "RG132"));
  }
}

TEST_CASE("plan_finish: joints are exact and inside their limits", "[postproc][pipeline][finish]") {
  const FinishPath path = path_of(test::ellipse_body(50, 35, 40, 384, 50), layers(10.3, 11.3));
  const Planned with(path, Vec3(0, 0, 25));
  const auto planned = with.plan(path);
  for (const auto& d : planned.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(planned.ok());
  const FinishPlan& plan = planned.value();
  REQUIRE(plan.paths.size() == 2);
  const JointLimits limits = limits_of(with.machine);
  for (std::size_t c = 0; c < 2; ++c) {
    const PlannedStretch& stretch = plan.paths[c];
    const FinishCut& cut = path.cuts[c];
    CHECK(stretch.path->length() == cut.length());
    double tip = 0.0, axis = 0.0, rate = 0.0;
    for (double s = 0.01; s < cut.length(); s += 0.73) {
      const LocationJet want = cut.location(s);
      const JointVector q = stretch.path->joints(s);
      const CutterLocation at = forward_location(with.chain, q);
      tip = std::max(tip, (at.tip - want.tip.col(0)).norm());
      axis = std::max(axis, angle_between(at.axis, want.axis.col(0)));
      CHECK((q - limits.lower).minCoeff() >= -1e-9);
      CHECK((limits.upper - q).minCoeff() >= -1e-9);
      const JointJet jet = stretch.path->jet(s);
      const double h = 1e-4;
      rate = std::max(
          rate, ((stretch.path->joints(s + h) - stretch.path->joints(s - h)) / (2 * h) - jet.col(1))
                    .cwiseAbs()
                    .maxCoeff());
    }
    CHECK(tip < 1e-9);
    CHECK(axis < 1e-12);
    CHECK(rate < 1e-5);
    // The samples are the path's own joints, in order, at places of the cut's segments.
    for (std::size_t i = 0; i < stretch.s.size(); ++i) {
      const JointSample& sample = plan.joints.samples[stretch.first_sample + i];
      CHECK((sample.q - stretch.path->joints(stretch.s[i])).norm() < 1e-12);
      CHECK(sample.segment >= cut.first_point);
      CHECK(sample.segment < cut.first_point + cut.s.size());
      if (i > 0) CHECK(stretch.s[i] > stretch.s[i - 1]);
    }
    const FinishResolution& r = plan.resolutions[c];
    CHECK(std::abs(r.end - r.start) == Approx(2 * kPi));
    CHECK(r.jerk_after <= r.jerk_before);
  }
  // The second layer starts where the first has ended and turns back.
  CHECK(plan.resolutions[1].start == Approx(plan.resolutions[0].end));
  CHECK_FALSE(plan.resolutions[1].wound_back);
}

TEST_CASE("plan_finish: a helix needs a bed without end", "[postproc][pipeline][finish]") {
  FinishSettings settings = layers(10.3, 13.3);
  settings.helical = true;
  const FinishPath path = path_of(test::ellipse_body(50, 35, 40, 384, 50), settings);
  REQUIRE(path.cuts.size() == 1);
  const FinishCut& cut = path.cuts.front();
  CHECK(cut.turning == Approx(5 * 2 * kPi).margin(0.1));
  for (const Check& c : path.checks) CHECK(c.ok);
  double height = 0.0;
  for (double s = 5.0; s < cut.length() - 5.0; s += 1.0) {
    const double z = cut.location(s).tip(2, 0);
    CHECK(z > height - 2 * settings.tip_tolerance);
    height = std::max(height, z);
  }
  CHECK(height == Approx(path.layers.back().height).margin(0.01));
  Planned with(path, Vec3(0, 0, 25));
  const auto refused = with.plan(path);
  REQUIRE_FALSE(refused.ok());
  CHECK((says(refused.diagnostics(), "KN170") || says(refused.diagnostics(), "KN171")));
  with.machine.axes.back().joint.cyclic = true;
  const auto planned = with.plan(path);
  for (const auto& d : planned.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(planned.ok());
  CHECK(std::abs(planned.value().resolutions[0].end - planned.value().resolutions[0].start) >
        4 * 2 * kPi);
  // A box has edges.
  const auto box =
      make_finish_path(weld(test::box({-20, -15, 0}, {20, 15, 30})), settings, "p", {});
  REQUIRE_FALSE(box.ok());
  CHECK(says(box.diagnostics(), "RG139"));
}

TEST_CASE("plan_finish: refusals name place and axis", "[postproc][pipeline][finish]") {
  const FinishPath path = path_of(test::ellipse_body(50, 35, 40, 384, 50), layers(10.3, 10.3));
  SECTION("part out of reach") {
    const Planned with(path, Vec3(400, 0, 25));
    const auto planned = with.plan(path);
    REQUIRE_FALSE(planned.ok());
    CHECK(says(planned.diagnostics(), "KN170"));
    CHECK(planned.diagnostics()[0].text.find("beyond its range") != std::string::npos);
  }
  SECTION("a bed that does not turn far enough") {
    Planned with(path, Vec3(0, 0, 25));
    auto& bed = with.machine.axes.back();
    REQUIRE(bed.name == "bedC");
    bed.joint.lower = -1.0;
    bed.joint.upper = 1.0;
    const auto planned = with.plan(path);
    REQUIRE_FALSE(planned.ok());
    CHECK((says(planned.diagnostics(), "KN170") || says(planned.diagnostics(), "KN171")));
  }
  SECTION("no redundant joint") {
    const Planned with(path, Vec3(0, 0, 25));
    ScrewChain chain = with.chain;
    chain.joints.back().redundant = false;
    chain.joints.erase(chain.joints.begin() + 2);
    const auto pair = RotaryPair::from(chain);
    REQUIRE(pair);
    const auto planned =
        plan_finish({path, with.cuts, with.machine, *pair, "part.stl", nullptr}, {});
    REQUIRE_FALSE(planned.ok());
    CHECK(says(planned.diagnostics(), "KN172"));
  }
}

TEST_CASE("find_finish_place: over the middle and as low as the machine reaches",
          "[postproc][pipeline][finish]") {
  test::Soup part = test::ellipse_body(25, 20, 20, 90, 20);
  for (Vec3& v : part) v += Vec3(300, -40, 7);
  const FinishPath path = path_of(part, layers(12, 20));
  const MachineDefinition machine = test::shipped_machine("finish_2p2r_1p1r");
  const auto found = find_finish_place(path, machine, true);
  REQUIRE(found);
  CHECK(found->reached == found->points);
  CHECK(found->position.x() == Approx(-300).margin(0.5));
  CHECK(found->position.y() == Approx(40).margin(0.5));
  // At that height every point has joints inside their ranges; 5 mm lower some have not.
  const auto reached = [&](double lower) {
    Pose at = Pose::Identity();
    at.translation() = found->position - Vec3(0, 0, lower);
    const auto reach = FinishReach::make({machine, at, &path.stock, nullptr, true});
    REQUIRE(reach);
    ScrewChain chain = chain_of(machine);
    chain.workpiece_home = chain.workpiece_home * at;
    const JointLimits limits = limits_of(machine);
    std::size_t count = 0;
    for (std::size_t i = 0; i < path.path.points.size(); i += 20) {
      const CutterLocation& want = path.path.points[i].location;
      const auto q = reach->joints(want, 0.0);
      if (!q) continue;
      ++count;
      CHECK((forward_location(chain, *q).tip - want.tip).norm() < 1e-9);
      CHECK((*q - limits.lower).minCoeff() >= 0.0);
      CHECK((limits.upper - *q).minCoeff() >= 0.0);
    }
    return count;
  };
  const std::size_t all = (path.path.points.size() + 19) / 20;
  CHECK(reached(0.0) == all);
  CHECK(reached(5.0) < all);
}

TEST_CASE("without_cuts: the rest is a path of its own", "[postproc][pipeline][finish]") {
  const FinishPath whole = path_of(test::box({-20, -15, 0}, {20, 15, 30}), layers(10, 11));
  REQUIRE(whole.cuts.size() == 8);
  const FinishPath rest = without_cuts(whole, {0, 5});
  REQUIRE(rest.cuts.size() == 6);
  CHECK(rest.layers[0].cuts == 3);
  CHECK(rest.layers[0].left_out.reach == Approx(whole.cuts[0].length()));
  CHECK(rest.path.points.size() ==
        whole.path.points.size() - whole.cuts[0].s.size() - whole.cuts[5].s.size());
  CHECK(rest.path.events.back().point + 1 == rest.path.points.size());
  for (const FinishCut& cut : rest.cuts)
    for (std::size_t i = 0; i < cut.s.size(); ++i) {
      const PathPoint& p = rest.path.points[cut.first_point + i];
      CHECK((p.location.tip - cut.location(cut.s[i]).tip.col(0)).norm() < 1e-12);
      CHECK(p.line == cut.first_point + i + 1);
      CHECK((p.kind == MotionKind::rapid) == (i == 0));
    }
}

TEST_CASE("convert: a finishing path is certified", "[postproc][pipeline][finish]") {
  const FinishPath path = path_of(test::ellipse_body(50, 35, 40, 384, 50), layers(10.3, 11.3));
  ConvertInput in;
  in.machine = test::shipped_machine("finish_2p2r_1p1r");
  in.input.path = path.path;
  in.input.reference = "walls";
  in.placement.translation() = Vec3(0, 0, 25);
  in.part = path.stock;
  in.part_name = in.input_name = "part.stl";
  in.finish = &path;
  const Conversion done = convert(in, false, {});
  for (const auto& d : done.diagnostics) UNSCOPED_INFO(to_string(d));
  CHECK(done.verdict == Verdict::certified);
  CHECK(done.cuts.size() == 2);
  CHECK(done.schedule.stretches.size() == 2);
  CHECK(check_of(done.checks, "depth_of_cut").ok);
  CHECK(check_of(done.checks, "tip_deviation").value < 0.01);
  CHECK(says(done.diagnostics, "KN173"));
  // One cut alone starts anew.
  ConvertInput second = in;
  second.cuts = CutRange{2, 2};
  const Conversion alone = convert(second, false, {});
  CHECK(alone.verdict == Verdict::certified);
  CHECK(alone.schedule.stretches.size() == 1);
}
