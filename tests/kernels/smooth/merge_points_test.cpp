#include "kernels/smooth/merge_points.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

namespace smoothpost {
namespace {

/// A dense wavy path with axes that lean about; every `keep_every`-th point must stay.
std::vector<MergePoint> wavy(std::size_t n, std::uint64_t seed, std::size_t keep_every) {
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<MergePoint> all;
  double phase = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    phase += 0.01 + 0.05 * unit(engine);
    MergePoint p;
    p.tip = Vec3(10.0 * phase, 5.0 * std::sin(phase), std::cos(2.0 * phase));
    p.rotation = Eigen::AngleAxisd(0.4 * std::sin(0.7 * phase), Vec3::UnitX()) *
                 Eigen::AngleAxisd(0.3 * std::cos(phase), Vec3::UnitY());
    p.axis = p.rotation * Vec3::UnitZ();
    p.length = all.empty() ? 0.0 : all.back().length + (p.tip - all.back().tip).norm();
    p.keep = keep_every > 0 && i % keep_every == 0;
    all.push_back(p);
  }
  return all;
}

struct Deviation {
  double tip = 0.0;
  double axis = 0.0;
  double rotation = 0.0;
};

/// Largest deviation at equal share of the length, at and between the points.
Deviation deviation(const std::vector<MergePoint>& p, const std::vector<std::uint32_t>& kept) {
  Deviation worst;
  for (std::size_t k = 0; k + 1 < kept.size(); ++k) {
    const MergePoint& a = p[kept[k]];
    const MergePoint& b = p[kept[k + 1]];
    for (std::size_t i = kept[k]; i < kept[k + 1]; ++i)
      for (int j = 0; j <= 8; ++j) {
        const double t = j / 8.0;
        const double length = p[i].length + t * (p[i + 1].length - p[i].length);
        if (b.length <= a.length) continue;
        const double share = (length - a.length) / (b.length - a.length);
        const Vec3 tip = p[i].tip + t * (p[i + 1].tip - p[i].tip);
        worst.tip = std::max(worst.tip, (tip - (a.tip + share * (b.tip - a.tip))).norm());
        worst.axis = std::max(worst.axis, angle_between(great_circle(p[i].axis, p[i + 1].axis, t),
                                                        great_circle(a.axis, b.axis, share)));
        worst.rotation =
            std::max(worst.rotation, p[i].rotation.slerp(t, p[i + 1].rotation)
                                         .angularDistance(a.rotation.slerp(share, b.rotation)));
      }
  }
  return worst;
}

}  // namespace

TEST_CASE("merge_points: deviation at equal share is within the tolerances", "[kernels][smooth]") {
  std::size_t merged = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const auto points = wavy(400, 40 + seed, 0);
    MergeSettings settings;
    settings.tip_tolerance = std::pow(10.0, -3.0 + 0.05 * static_cast<double>(seed));
    settings.axis_tolerance = 1e-3 * (1.0 + static_cast<double>(seed % 7));
    settings.whole_rotation = seed % 2 == 1;
    const auto kept = merge_points(points, settings);
    CHECK(kept.front() == 0);
    CHECK(kept.back() == 399);
    CHECK(std::is_sorted(kept.begin(), kept.end()));
    const Deviation worst = deviation(points, kept);
    CHECK(worst.tip <= settings.tip_tolerance * (1 + 1e-9));
    if (settings.whole_rotation)
      CHECK(worst.rotation <= settings.axis_tolerance * (1 + 1e-9));
    else
      CHECK(worst.axis <= settings.axis_tolerance * (1 + 1e-9));
    merged += points.size() - kept.size();
  }
  CHECK(merged > 4000);
}

TEST_CASE("merge_points: kept points stay", "[kernels][smooth]") {
  const auto points = wavy(500, 91, 7);
  const auto kept = merge_points(points, {1.0, 0.1});
  for (std::uint32_t i = 0; i < 500; i += 7) CHECK(std::binary_search(kept.begin(), kept.end(), i));
}

TEST_CASE("merge_points: repeated points", "[kernels][smooth]") {
  std::vector<MergePoint> points(6);
  for (std::size_t i = 0; i < 6; ++i) points[i].tip = Vec3(i < 3 ? 0.0 : 1.0, i < 5 ? 0.0 : 1.0, 0);
  for (std::size_t i = 1; i < 6; ++i)
    points[i].length = points[i - 1].length + (points[i].tip - points[i - 1].tip).norm();
  const auto kept = merge_points(points, {0.01, 0.01});
  REQUIRE(kept.size() == 3);
  CHECK(points[kept[1]].tip == Vec3(1, 0, 0));
  // A kept repetition stays in place of the one before it.
  points[4].keep = true;
  CHECK(merge_points(points, {0.01, 0.01}) == std::vector<std::uint32_t>{0, 4, 5});
  // Rotation alone is no repetition.
  points[4].keep = false;
  points[4].axis = Vec3(0.6, 0.0, 0.8);
  points[5].axis = points[4].axis;
  CHECK(merge_points(points, {0.01, 0.01}).size() == 4);
}

TEST_CASE("merge_points: tolerance 0 keeps every point that is not on the way",
          "[kernels][smooth]") {
  std::vector<MergePoint> points;
  for (int i = 0; i <= 20; ++i) {
    MergePoint p;
    p.tip = i <= 10 ? Vec3(i, 0, 0) : Vec3(10, i - 10, 0);
    p.length = i;
    points.push_back(p);
  }
  CHECK(merge_points(points, {}) == std::vector<std::uint32_t>{0, 10, 20});
  const auto all = merge_points(wavy(100, 92, 0), {});
  CHECK(all.size() == 100);
}

TEST_CASE("merge_points: a leg stands for no more points than it may", "[kernels][smooth]") {
  std::vector<MergePoint> points;
  for (int i = 0; i <= 200; ++i) {
    MergePoint p;
    p.tip = Vec3(i, 0, 0);
    p.length = i;
    points.push_back(p);
  }
  MergeSettings settings{1.0, 1.0};
  settings.longest = 10;
  const auto kept = merge_points(points, settings);
  for (std::size_t k = 0; k + 1 < kept.size(); ++k) CHECK(kept[k + 1] - kept[k] <= 11);
  CHECK(kept.size() >= 19);
}

TEST_CASE("merge_points: none and one point", "[kernels][smooth]") {
  CHECK(merge_points({}, {}).empty());
  const std::vector<MergePoint> one(1);
  CHECK(merge_points(one, {}) == std::vector<std::uint32_t>{0});
}

}  // namespace smoothpost
