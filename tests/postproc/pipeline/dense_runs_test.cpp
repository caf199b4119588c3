#include "postproc/pipeline/dense_runs.h"

#include "tests/postproc/pipeline/smoothed_checks.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

/// A wave on a circle, tool leaning, as a CAM system writes it: rounded to `grid` mm.
Vec3 wave_tip(double way, double grid) {
  const double angle = way / 40.0;
  Vec3 tip(40.0 * std::cos(angle), 40.0 * std::sin(angle), 2.0 * std::sin(way / 9.0));
  for (int k = 0; k < 3 && grid > 0.0; ++k) tip[k] = grid * std::round(tip[k] / grid);
  return tip;
}
Vec3 wave_axis(double way) {
  return Vec3(0.3 * std::cos(way / 30.0), 0.25 * std::sin(way / 25.0), 1.0).normalized();
}

PathMaker& wave(PathMaker& path, double from, double to, double step, double grid = 1e-4) {
  for (double way = from; way < to; way += step)
    path.axis(wave_axis(way)).feed(wave_tip(way, grid), step / 20.0);
  return path;
}

PathMaker wave_start() {
  PathMaker path(Vec3(0, 0, 50));
  path.axis(wave_axis(0.0)).rapid(wave_tip(0.0, 1e-4));
  return path;
}

struct Smoothed {
  ToolPath path;
  std::vector<Cut> cuts;
  std::optional<ReferencePath> reference;
  std::optional<SmoothedPath> smoothed;

  explicit Smoothed(ToolPath made, bool dense = true, double tip = 0.005, double axis = 0.0005)
      : path(std::move(made)) {
    cuts = {{}};
    cuts[0].first = 2;
    cuts[0].last = static_cast<std::uint32_t>(path.points.size() - 1);
    reference.emplace(path, ReferencePath::Frames{});
    SmoothingSettings settings = settings_of(BlendKind::acr, tip, axis);
    settings.fit_dense = dense;
    smoothed.emplace(*reference, cuts, settings);
  }
};

/// Largest jump of a derivative by σ from leg to leg of the cut, and on how many legs.
double largest_jump(const SmoothedPath& path, int order) {
  double worst = 0.0;
  for (std::size_t leg = 2; leg <= path.legs(); ++leg) {
    const auto before = path.jet(leg - 1, 1.0), after = path.jet(leg, 0.0);
    if (!before || !after) continue;
    const auto column = static_cast<Eigen::Index>(order);
    const double in = std::pow(path.length(leg - 1), order),
                 out = std::pow(path.length(leg), order);
    worst = std::max(worst, (before->tip.col(column) / in - after->tip.col(column) / out).norm());
    const auto k = static_cast<std::size_t>(order);
    worst =
        std::max(worst, (before->rotation[k].col(2) / in - after->rotation[k].col(2) / out).norm());
  }
  return worst;
}

}  // namespace

TEST_CASE("dense_runs: a sampled surface is followed by a curve", "[postproc][pipeline][smooth]") {
  PathMaker maker = wave_start();
  const Smoothed made(wave(maker, 0.3, 110.0, 0.3).take());
  const SmoothedPath& path = *made.smoothed;
  check_order(path);
  CHECK(path.fitted_points() == made.path.points.size() - 1);
  CHECK(path.corners().empty());
  const Worst worst = deviation(path, 33);
  CHECK(worst.tip <= 0.005 * 1.125 + 1e-9);  // half the merge share (a quarter) and smoothing
  CHECK(worst.axis <= 0.0005 * 1.125 + 1e-9);
  for (const int order : {0, 1, 2, 3}) {
    INFO("order " << order);
    CHECK(largest_jump(path, order) < 1e-6);
  }
  // One leg stands for about four segments of the input.
  CHECK(path.legs() < made.path.points.size() / 3);
  CHECK(check_bound(path) > 50);
}

TEST_CASE("dense_runs: long rows are fitted in parts that join", "[postproc][pipeline][smooth]") {
  PathMaker maker = wave_start();
  const Smoothed made(wave(maker, 0.1, 245.0, 0.1).take());
  const SmoothedPath& path = *made.smoothed;
  check_order(path);
  CHECK(path.fitted_points() == made.path.points.size() - 1);
  for (const int order : {0, 1, 2, 3}) {
    INFO("order " << order);
    CHECK(largest_jump(path, order) < 1e-5);
  }
  const Worst worst = deviation(path, 9);
  CHECK(worst.tip <= 0.005 * 1.125 + 1e-9);
}

TEST_CASE("dense_runs: corners between dense rows stay corners", "[postproc][pipeline][smooth]") {
  PathMaker maker = wave_start();
  wave(maker, 0.3, 30.0, 0.3);
  const std::size_t corner = maker.last();
  const Vec3 there = wave_tip(29.7, 1e-4);
  for (int i = 1; i <= 60; ++i)
    maker.feed(there + Vec3(-0.25 * i, 0.0, 0.4 * std::sin(0.05 * i)), 0.0125);
  const Smoothed made(maker.take());
  const SmoothedPath& path = *made.smoothed;
  check_order(path);
  const auto corners = path.corners();
  REQUIRE(corners.size() == 1);
  CHECK(corners[0].input_line == made.path.points[corner].line);
  CHECK(corners[0].half_width > 0.0);
  CHECK(path.fitted_points() > 140);
  for (const int order : {0, 1, 2, 3}) {
    INFO("order " << order);
    CHECK(largest_jump(path, order) < 1e-6);
  }
  const Worst worst = deviation(path, 33);
  CHECK(worst.tip <= 0.005 * 1.25 + 1e-9);
}

TEST_CASE("dense_runs: events and feeds and repeated points", "[postproc][pipeline][smooth]") {
  PathMaker maker = wave_start();
  wave(maker, 0.3, 15.0, 0.3);
  maker.event("message");
  const std::size_t event = maker.last();
  maker.feed(wave_tip(14.7, 1e-4), 0.0);  // once more
  for (double way = 15.0; way < 40.0; way += 0.3)
    maker.axis(wave_axis(way)).feed(wave_tip(way, 1e-4), 0.3 / 12.0);  // slower
  const Smoothed made(maker.take());
  const SmoothedPath& path = *made.smoothed;
  check_order(path);
  CHECK(path.merged_points() == 1);
  CHECK(check_exact(path, {event}) == 1);
  CHECK(path.fitted_points() == made.path.points.size() - 2);
  CHECK(largest_jump(path, 2) < 1e-6);
}

TEST_CASE("dense_runs: wide corners and few points are none", "[postproc][pipeline][smooth]") {
  PathMaker coarse = wave_start();
  const Smoothed wide(wave(coarse, 4.0, 200.0, 4.0).take());
  CHECK(wide.smoothed->fitted_points() == 0);
  PathMaker few = wave_start();
  const Smoothed some(wave(few, 0.3, 2.2, 0.3).take());
  CHECK(some.smoothed->fitted_points() == 0);
  PathMaker maker = wave_start();
  const Smoothed off(wave(maker, 0.3, 30.0, 0.3).take(), false);
  CHECK(off.smoothed->fitted_points() == 0);
  CHECK(off.smoothed->corners().size() > 90);
}

TEST_CASE("dense_runs: random paths keep what every smoothed path keeps",
          "[postproc][pipeline][smooth]") {
  std::size_t fitted = 0;
  Random dice(4);
  for (int round = 0; round < 60; ++round) {
    INFO("round " << round);
    PathMaker maker(Vec3(0, 0, 30));
    maker.rapid(Vec3::Zero());
    Vec3 at = Vec3::Zero(), direction = dice.unit(), axis = Vec3::UnitZ();
    const double step = std::pow(10.0, dice.between(-2.0, 0.5));
    for (int i = 0; i < 150; ++i) {
      const bool sharp = dice.below(40) == 0;
      direction = (direction + (sharp ? 2.0 : dice.between(0.0, 0.02)) * dice.unit()).normalized();
      axis = (axis + dice.between(0.0, 0.0004) * dice.unit()).normalized();
      at += step * dice.between(0.3, 1.0) * direction;
      maker.axis(axis).feed(at, 0.01);
      if (dice.below(50) == 0) maker.event("message");
      if (dice.below(50) == 0) maker.dwell(0.1);
    }
    const Smoothed made(maker.take());
    check_order(*made.smoothed);
    check_exact(*made.smoothed, exact_points(made.path, made.cuts));
    const Worst worst = deviation(*made.smoothed, 9);
    CHECK(worst.tip <= 0.005 * 1.25 + 1e-9);
    CHECK(worst.axis <= 0.0005 * 1.25 + 1e-9);
    fitted += made.smoothed->fitted_points();
  }
  CHECK(fitted > 500);
}
