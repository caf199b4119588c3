#include "postproc/pipeline/smoothed_path.h"

#include "tests/postproc/pipeline/smoothed_checks.h"

using namespace smoothpost;
using namespace smoothpost::test;

TEST_CASE("smoothed_path: without settings it is the reference", "[postproc][pipeline][smooth]") {
  for_random_paths(
      1, 3, [](const Sample&, const std::vector<Cut>&, const ReferencePath& reference) {
        const SmoothedPath smoothed(reference);
        REQUIRE(smoothed.legs() == reference.segments());
        CHECK(smoothed.merged_points() == 0);
        CHECK(smoothed.corners().empty());
        check_order(smoothed);
        for (std::size_t k = 1; k <= smoothed.legs(); ++k) {
          CHECK(&smoothed.point(k) == &reference.path().points[k]);
          for (int i = 0; i <= 6; ++i) {
            const double s = i / 6.0;
            CHECK(smoothed.place(k, s).segment == k);
            CHECK(smoothed.place(k, s).s == s);
            CHECK(smoothed.at(k, s).tip == reference.at(k, s).tip);
            CHECK(smoothed.at(k, s).axis == reference.at(k, s).axis);
            if (smoothed.full_pose())
              CHECK((smoothed.rotation_at(k, s) - reference.rotation_at(k, s).toRotationMatrix())
                        .norm() < 1e-12);
          }
        }
        check_bound(smoothed);
      });
}

TEST_CASE("smoothed_path: tip and axis stay within the tolerances at equal parameter",
          "[postproc][pipeline][smooth]") {
  std::size_t samples = 0;
  unsigned round = 0;
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp})
    for (const double tip : {0.005, 0.1}) {
      SmoothingSettings settings = settings_of(kind, tip, 0.05 * tip);
      for_random_paths(
          10 + 3 * round++, 3,
          [&](const Sample& sample, const std::vector<Cut>& cuts, const ReferencePath& reference) {
            settings.whole_rotation = sample.whole;
            settings.paper_shape = tip > 0.05;
            const SmoothedPath smoothed(reference, cuts, settings);
            const Worst worst = deviation(smoothed, 40);
            samples += worst.samples;
            CHECK(worst.tip <= settings.merge_tip + settings.corner_tip + 1e-9);
            CHECK(worst.axis <= settings.merge_axis + settings.corner_axis + 1e-9);
            if (sample.whole)
              CHECK(worst.rotation <= settings.merge_axis + settings.corner_axis + 1e-9);
            CHECK(worst.tip > 0.2 * settings.corner_tip);
            check_order(smoothed);
            check_links(smoothed, cuts);
          });
    }
  CHECK(samples > 100000);
}

TEST_CASE("smoothed_path: comes through points with events and dwells and the ends of cuts",
          "[postproc][pipeline][smooth]") {
  std::size_t events = 0, points = 0;
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp})
    for_random_paths(
        40, 4,
        [&](const Sample& sample, const std::vector<Cut>& cuts, const ReferencePath& reference) {
          SmoothingSettings settings = settings_of(kind, 0.2, 0.02);
          settings.whole_rotation = sample.whole;
          const SmoothedPath smoothed(reference, cuts, settings);
          points += check_exact(smoothed, exact_points(reference.path(), cuts));
          events += reference.path().events.size();
        });
  CHECK(points > 200);
  CHECK(events > 50);
}

TEST_CASE("smoothed_path: the bound of the second derivative is never below second differences",
          "[postproc][pipeline][smooth]") {
  std::size_t pieces = 0;
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp})
    for_random_paths(
        60, 3,
        [&](const Sample& sample, const std::vector<Cut>& cuts, const ReferencePath& reference) {
          SmoothingSettings settings = settings_of(kind, 0.1, 0.01);
          settings.whole_rotation = sample.whole;
          settings.paper_shape = kind == BlendKind::acr && sample.whole;
          pieces += check_bound(SmoothedPath(reference, cuts, settings));
        });
  CHECK(pieces > 500);
}

TEST_CASE("smoothed_path: smooth over the parameter but at exact points and stops",
          "[postproc][pipeline][smooth]") {
  std::size_t nodes = 0;
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp})
    for_random_paths(
        80, 3,
        [&](const Sample& sample, const std::vector<Cut>& cuts, const ReferencePath& reference) {
          SmoothingSettings settings = settings_of(kind, 0.1, 0.01);
          settings.whole_rotation = sample.whole;
          const SmoothedPath smoothed(reference, cuts, settings);
          const std::set<std::size_t> exact = exact_points(reference.path(), cuts);
          std::set<std::uint32_t> stops;
          for (const SmoothedCorner& corner : smoothed.corners())
            if (corner.stop) stops.insert(corner.input_line);
          for (std::size_t leg = 1; leg < smoothed.legs(); ++leg) {
            const double place = number(smoothed.place(leg, 1.0));
            const bool is_point = place == std::round(place);
            if (is_point && exact.count(static_cast<std::size_t>(place)) > 0) continue;
            if (stops.count(smoothed.point(leg).line) > 0) continue;
            const double before_length = smoothed.length(leg),
                         after_length = smoothed.length(leg + 1);
            if (before_length == 0.0 || after_length == 0.0) continue;  // not smoothed
            const auto breaks_before = smoothed.breaks(leg),
                       breaks_after = smoothed.breaks(leg + 1);
            const double h =
                0.01 * std::min((1.0 - breaks_before[breaks_before.size() - 2]) * before_length,
                                breaks_after[1] * after_length);
            if (h < 1e-5) continue;  // differences are lost in rounding
            const auto at = [&](int i) {
              return i < 0 ? smoothed.at(leg, 1.0 + i * h / before_length)
                           : smoothed.at(leg + 1, i * h / after_length);
            };
            INFO("leg " << leg << " line " << smoothed.point(leg).line);
            const auto jump = [&](const auto& of) {
              const Vec3 before = (3.0 * of(0) - 4.0 * of(-1) + of(-2)) / (2.0 * h);
              const Vec3 after = (-3.0 * of(0) + 4.0 * of(1) - of(2)) / (2.0 * h);
              return (before - after).norm();
            };
            CHECK(jump([&](int i) { return at(i).tip; }) < 5e-3);
            CHECK(jump([&](int i) { return at(i).axis; }) < 5e-3);
            ++nodes;
          }
        });
  CHECK(nodes > 200);
}

TEST_CASE("smoothed_path: corners tell what an independent measurement finds",
          "[postproc][pipeline][smooth]") {
  Random dice(7);
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp})
    for (int round = 0; round < 10; ++round) {
      PathMaker maker(Vec3(0, 0, 0));
      Vec3 p(0, 0, 0), axis = Vec3::UnitZ();
      for (int i = 0; i < 4; ++i) {
        p += Vec3(dice.between(20, 40), dice.between(-30, 30), dice.between(-30, 30));
        axis = (axis + 0.5 * dice.unit()).normalized();
        maker.axis(axis).feed(p, 1.0);
      }
      ToolPath path = maker.take();
      for (std::size_t k = 1; k < path.points.size(); ++k)  // 20 mm/s
        path.points[k].duration =
            (path.points[k].location.tip - path.points[k - 1].location.tip).norm() / 20.0;
      const auto cuts = cuts_of(path);
      const ReferencePath reference(path, {});
      const SmoothingSettings settings = settings_of(kind, 0.05, 0.004);
      const SmoothedPath smoothed(reference, cuts, settings);
      CHECK(smoothed.merged_points() == 0);
      REQUIRE(smoothed.legs() == 4);
      const auto corners = smoothed.corners();
      REQUIRE(corners.size() == 3);
      for (std::size_t k = 1; k <= 3; ++k) {
        const SmoothedCorner& corner = corners[k - 1];
        INFO("round " << round << " corner " << k);
        CHECK(corner.input_line == path.points[k].line);
        const Vec3 t0 =
            (path.points[k].location.tip - path.points[k - 1].location.tip).normalized();
        const Vec3 t1 =
            (path.points[k + 1].location.tip - path.points[k].location.tip).normalized();
        const double turn = angle_between(t0, t1);
        CHECK(corner.turn == Approx(turn));
        CHECK_FALSE(corner.stop);
        CHECK(corner.method == (kind == BlendKind::acr ? "acr" : "ramp"));
        CHECK(corner.half_width > 0.0);
        CHECK(corner.rotation_half_width > 0.0);
        // On the legs' middle halves there is no other corner: legs are long.
        double tip = 0.0, angle = 0.0;
        const int n = 4000;
        for (int i = 0; i <= n; ++i) {
          const double s = static_cast<double>(i) / n;
          const std::size_t leg = s <= 0.5 ? k : k + 1;
          const double share = s <= 0.5 ? 0.5 + s : s - 0.5;
          const auto a = smoothed.at(leg, share);
          const auto b = original(reference, smoothed.place(leg, share));
          tip = std::max(tip, (a.tip - b.tip).norm());
          angle = std::max(angle, angle_between(a.axis, b.axis));
        }
        CHECK(corner.tip_deviation == Approx(tip).epsilon(0.01));
        CHECK(corner.axis_deviation == Approx(angle).epsilon(0.03).margin(1e-9));
        CHECK(corner.tip_deviation <= settings.corner_tip + 1e-9);
        CHECK(corner.tip_deviation > 0.9 * settings.corner_tip);
        CHECK(corner.axis_deviation <= settings.corner_axis + 1e-9);
        CHECK(corner.rotation_deviation == 0.0);
        CHECK(corner.speed == Approx(20.0 * std::cos(0.5 * turn)).epsilon(1e-3));
        // g(0) of acr is 1/4.
        if (kind == BlendKind::acr)
          CHECK(corner.half_width * 0.25 * 2.0 * std::sin(0.5 * turn) ==
                Approx(settings.corner_tip));
      }
    }
}

TEST_CASE("smoothed_path: corners of whole rotations tell the whole angle",
          "[postproc][pipeline][smooth]") {
  Random dice(8);
  for (int round = 0; round < 20; ++round) {
    PathMaker maker(Vec3(0, 0, 0));
    maker.feed({30, 0, 0}, 2.0).feed({30 + dice.between(5, 20), 30, 5}, 2.0);
    ToolPath path = maker.take();
    path.full_pose = true;
    Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
    for (PathPoint& p : path.points) {
      p.rotation = q;
      p.location.axis = q * Vec3::UnitZ();
      p.interpolation = PathInterpolation::slerp;
      q = q * Eigen::Quaterniond(rotation_exp(dice.between(0.1, 0.8) * dice.unit()));
    }
    const auto cuts = cuts_of(path);
    const ReferencePath reference(path, {});
    SmoothingSettings settings = settings_of(BlendKind::acr, 0.05, 0.004);
    settings.whole_rotation = true;
    const SmoothedPath smoothed(reference, cuts, settings);
    const auto corners = smoothed.corners();
    REQUIRE(corners.size() == 1);
    const Worst worst = deviation(smoothed, 2000);
    CHECK(corners[0].rotation_deviation == Approx(worst.rotation).epsilon(0.01));
    CHECK(corners[0].axis_deviation == Approx(worst.axis).epsilon(0.03).margin(1e-9));
    CHECK(corners[0].rotation_deviation <= settings.corner_axis + 1e-9);
    CHECK(corners[0].rotation_deviation > 0.9 * settings.corner_axis);
  }
}

TEST_CASE("smoothed_path: arcs stay arcs", "[postproc][pipeline][smooth]") {
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp})
    for (const double rise : {0.0, 4.0}) {
      PathMaker maker(Vec3(0, 0, 0));
      maker.feed({20, 0, 0}).arc({20, 15, 0}, 2.5, rise);
      maker.feed({60, 60, 0}).feed({80, 0, 0}).arc({80, -10, 0}, 2.0 * kPi, rise).feed({120, 5, 0});
      ToolPath path = maker.take();
      const auto cuts = cuts_of(path);
      const ReferencePath reference(path, {});
      const SmoothedPath smoothed(reference, cuts, settings_of(kind));
      std::size_t legs = 0;
      REQUIRE(smoothed.legs() >= 6);
      for (std::size_t leg = 1; leg <= smoothed.legs(); ++leg) {
        const std::uint32_t segment = smoothed.place(leg, 1.0).segment;
        if (segment != 2 && segment != 5) continue;
        const auto breaks = smoothed.breaks(leg);
        double from = 0.0, to = 0.0;
        for (std::size_t i = 1; i < breaks.size(); ++i)
          if (breaks[i] - breaks[i - 1] > to - from) from = breaks[i - 1], to = breaks[i];
        INFO("leg " << leg << " from " << from << " to " << to);
        CHECK(to - from > 0.8);
        ++legs;
        const ArcGeometry& arc = path.arcs[segment == 2 ? 0 : 1];
        for (int i = 0; i <= 100; ++i) {
          const double s = from + i / 100.0 * (to - from);
          Vec3 spoke = smoothed.at(leg, s).tip - arc.centre;
          spoke.z() = 0.0;
          CHECK(spoke.norm() == Approx(segment == 2 ? 15.0 : 10.0).margin(1e-9));
          CHECK((smoothed.at(leg, s).tip - original(reference, smoothed.place(leg, s)).tip).norm() <
                1e-9);
        }
      }
      CHECK(legs >= 2);
    }
}

TEST_CASE("smoothed_path: dense points are merged and counted and corners are not",
          "[postproc][pipeline][smooth]") {
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp}) {
    PathMaker maker(Vec3(0, 0, 0));
    const auto walk = [&](const Vec3& to) {  // 40 steps
      static Vec3 at;
      if (to == Vec3(100, 0, 0)) at.setZero();
      for (int i = 1; i <= 40; ++i) maker.feed(at + i / 40.0 * (to - at), 0.1);
      at = to;
    };
    walk({100, 0, 0});
    const std::size_t first = maker.last();
    walk({100, 100, 0});
    const std::size_t second = maker.last();
    walk({0, 100, 20});
    ToolPath path = maker.take();
    for (std::size_t k = 1; k < path.points.size(); ++k)
      path.points[k].duration =
          (path.points[k].location.tip - path.points[k - 1].location.tip).norm() / 25.0;
    const auto cuts = cuts_of(path);
    const ReferencePath reference(path, {});
    const SmoothingSettings settings = settings_of(kind);
    const SmoothedPath smoothed(reference, cuts, settings);
    CHECK(smoothed.legs() <= 6);  // 48 points a leg at most
    CHECK(smoothed.merged_points() == path.points.size() - 1 - smoothed.legs());
    CHECK(leg_ending_at(smoothed, first) > 0);
    CHECK(leg_ending_at(smoothed, second) > 0);
    std::set<std::uint32_t> lines;
    for (const auto& c : smoothed.corners()) lines.insert(c.input_line);
    CHECK(lines == std::set<std::uint32_t>{path.points[first].line, path.points[second].line});
    const Worst worst = deviation(smoothed, 400);
    CHECK(worst.tip <= settings.merge_tip + settings.corner_tip + 1e-9);
    check_order(smoothed);
  }
}

TEST_CASE("smoothed_path: changes of feed and points with events are never merged",
          "[postproc][pipeline][smooth]") {
  PathMaker maker(Vec3(0, 0, 0));
  std::set<std::size_t> kept, exact;
  for (int i = 1; i <= 60; ++i) {
    maker.feed({static_cast<double>(i), 0, 0}, i > 20 && i <= 33 ? 0.05 : 0.1);
    if (i == 20 || i == 33) kept.insert(maker.last());
    if (i == 41) maker.event("coolant_on"), exact.insert(maker.last());
    if (i == 47) maker.dwell(0.5), exact.insert(maker.last());
  }
  ToolPath path = maker.take();
  for (std::size_t k = 55; k < path.points.size(); ++k) path.points[k].tool_length = 12.0;
  exact.insert(54);
  const auto cuts = cuts_of(path);
  const ReferencePath reference(path, {});
  const SmoothedPath smoothed(reference, cuts, settings_of(BlendKind::acr));
  for (const std::size_t k : kept) CHECK(leg_ending_at(smoothed, k) > 0);
  CHECK(check_exact(smoothed, exact) == 3);
  CHECK(smoothed.merged_points() > 40);
  check_order(smoothed);
}

TEST_CASE("smoothed_path: corners with events and dwells and tool lengths stay sharp",
          "[postproc][pipeline][smooth]") {
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp}) {
    PathMaker maker(Vec3(0, 0, 0));
    maker.event("beam_on").feed({20, 0, 0}).axis({0.3, 0, 1}).feed({20, 20, 0}).event("power");
    const std::size_t power = maker.last();
    maker.axis({0, 0.3, 1}).feed({40, 20, 0}).dwell(0.3);
    const std::size_t dwell = maker.last();
    maker.axis({0, 0, 1}).feed({40, 40, 5});
    const std::size_t plain = maker.last();
    maker.feed({60, 40, 0}).event("beam_off").feed({61, 42, 0}).event("beam_on");
    const std::size_t off = maker.last() - 1;
    maker.feed({80, 60, 0}).event("beam_off").rapid({80, 60, 50});
    ToolPath path = maker.take();
    LinkChoice choice;
    choice.micro_joint = 5.0;  // the beam goes off and on inside of one cut
    const auto cuts = find_cuts(path, choice);
    REQUIRE(cuts.size() == 1);
    const ReferencePath reference(path, {});
    const SmoothedPath smoothed(reference, cuts, settings_of(kind, 0.1, 0.01));
    const std::set<std::size_t> exact = {power, dwell, off, off + 1};
    check_exact(smoothed, exact);
    for (const std::size_t k : exact) {  // not only the point: its surroundings are the input's
      const std::size_t leg = leg_ending_at(smoothed, k);
      for (int i = 0; i <= 20; ++i) {
        const double s = 1.0 - 0.005 * i;
        CHECK((smoothed.at(leg, s).tip - original(reference, smoothed.place(leg, s)).tip).norm() <
              1e-9);
        CHECK((smoothed.at(leg + 1, 1.0 - s).tip -
               original(reference, smoothed.place(leg + 1, 1.0 - s)).tip)
                  .norm() < 1e-9);
      }
    }
    const std::size_t leg = leg_ending_at(smoothed, plain);
    REQUIRE(leg > 0);
    CHECK((smoothed.at(leg, 1.0).tip - path.points[plain].location.tip).norm() > 0.05);
    std::set<std::uint32_t> blended;
    for (const auto& c : smoothed.corners())
      if (c.half_width > 0.0) blended.insert(c.input_line);
    CHECK(blended.count(path.points[plain].line) == 1);
    for (const std::size_t k : exact) CHECK(blended.count(path.points[k].line) == 0);
    check_order(smoothed);
  }
}

TEST_CASE("smoothed_path: repeated points and turns on the spot inside a cut",
          "[postproc][pipeline][smooth]") {
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp}) {
    PathMaker maker(Vec3(0, 0, 0));
    maker.feed({0, 0, 0}).feed({20, 0, 0}).feed({20, 0, 0}).feed({20, 20, 0});
    maker.feed({20, 20, 0}).dwell(1.0).feed({20, 20, 0}).feed({40, 20, 0});
    const std::size_t dwell = 5;
    maker.axis({0.2, 0.1, 1}).feed({40, 20, 0}, 0.0);  // turns only
    maker.feed({40, 50, 0}).feed({40, 50, 0}).feed({60, 50, 0}).axis({0, 0, 1});
    maker.feed({60, 50, 0}, 0.0).feed({80, 50, 0}).feed({80, 50, 0});
    ToolPath path = maker.take();
    const auto cuts = cuts_of(path);
    const ReferencePath reference(path, {});
    const SmoothingSettings settings = settings_of(kind);
    const SmoothedPath smoothed(reference, cuts, settings);
    check_order(smoothed);
    check_exact(smoothed, {dwell, path.points.size() - 1});
    const Worst worst = deviation(smoothed, 200);
    CHECK(worst.tip <= settings.merge_tip + settings.corner_tip + 1e-9);
    CHECK(worst.axis <= settings.merge_axis + settings.corner_axis + 1e-9);
    check_bound(smoothed);
    for (const auto& c : smoothed.corners()) {
      CHECK(std::isfinite(c.speed));
      CHECK(std::isfinite(c.tip_deviation));
    }
  }
}

TEST_CASE("smoothed_path: a turn on the spot behind a repeated point",
          "[postproc][pipeline][smooth]") {
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp})
    for (const bool whole : {false, true}) {
      PathMaker maker(Vec3(0, 0, 0));
      maker.feed({40, 0, 0}).feed({40, 0, 0}).axis({0.2, 0, 1}).feed({40, 0, 0}, 0.0);
      maker.feed({40, 40, 0});
      ToolPath path = maker.take();
      path.full_pose = whole;
      for (PathPoint& p : path.points) {
        p.rotation = Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), p.location.axis);
        if (whole) p.interpolation = PathInterpolation::slerp;
      }
      const auto cuts = cuts_of(path);
      const ReferencePath reference(path, {});
      SmoothingSettings settings = settings_of(kind);
      settings.whole_rotation = whole;
      const SmoothedPath smoothed(reference, cuts, settings);
      check_order(smoothed);
      const Worst worst = deviation(smoothed, 100);
      CHECK(worst.tip <= settings.merge_tip + settings.corner_tip + 1e-9);
      CHECK(worst.axis <= settings.merge_axis + settings.corner_axis + 1e-9);
      if (whole) CHECK(worst.rotation <= settings.merge_axis + settings.corner_axis + 1e-9);
    }
}

TEST_CASE("smoothed_path: corners are points of the input and each is told once",
          "[postproc][pipeline][smooth]") {
  for_random_paths(95, 2,
                   [](const Sample&, const std::vector<Cut>& cuts, const ReferencePath& reference) {
                     const SmoothedPath smoothed(reference, cuts, settings_of(BlendKind::acr));
                     std::set<std::uint32_t> lines;
                     std::size_t again = 0, straight = 0;
                     for (const auto& c : smoothed.corners()) {
                       again += lines.insert(c.input_line).second ? 0 : 1;
                       straight += c.turn < 1e-6 && c.rotation_half_width == 0.0 ? 1 : 0;
                     }
                     CHECK(again == 0);
                     CHECK(straight == 0);
                   });
}

TEST_CASE("smoothed_path: a reversal is a stop", "[postproc][pipeline][smooth]") {
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp}) {
    PathMaker maker(Vec3(0, 0, 0));
    maker.feed({30, 0, 0}).feed({10, 0, 0}).feed({10, 20, 0});
    ToolPath path = maker.take();
    const auto cuts = cuts_of(path);
    const ReferencePath reference(path, {});
    const SmoothedPath smoothed(reference, cuts, settings_of(kind));
    check_order(smoothed);
    const auto corners = smoothed.corners();
    REQUIRE(corners.size() == 2);
    CHECK(corners[0].stop);
    CHECK(corners[0].input_line == path.points[1].line);
    CHECK(corners[0].turn == Approx(kPi));
    CHECK(corners[0].speed == 0.0);
    CHECK_FALSE(corners[1].stop);
    CHECK(check_exact(smoothed, {1}) == 1);
  }
}

TEST_CASE("smoothed_path: a path without cuts and a path of one point",
          "[postproc][pipeline][smooth]") {
  ToolPath point = PathMaker(Vec3(1, 2, 3)).take();
  const ReferencePath one(point, {});
  for (const SmoothedPath& s :
       {SmoothedPath(one), SmoothedPath(one, {}, settings_of(BlendKind::acr))}) {
    CHECK(s.legs() == 0);
    CHECK((s.at(0, 1.0).tip - Vec3(1, 2, 3)).norm() == 0.0);
    CHECK(number(s.place(0, 1.0)) == 0.0);
    CHECK(s.corners().empty());
  }
  ToolPath rapids = PathMaker(Vec3(0, 0, 0)).rapid({10, 0, 0}).rapid({10, 10, 0}).take();
  const ReferencePath reference(rapids, {});
  const SmoothedPath smoothed(reference, cuts_of(rapids), settings_of(BlendKind::acr));
  CHECK(smoothed.legs() == 2);
  CHECK(smoothed.corners().empty());
  check_order(smoothed);
}
