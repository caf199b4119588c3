#include <catch2/catch.hpp>

#include "kernels/core/units.h"
#include "tests/kernels/smooth/paths.h"

// Guarantees of corner_path.h over random corners and paths. The counts of the default run are a
// part of those under [.slow]; the same code runs both.
namespace smoothpost {
namespace {

using test::Deviation;
using test::Jumps;
using test::PathText;
using test::Random;

CornerSettings random_settings(Random& random) {
  CornerSettings settings;
  settings.kind = random.chance(0.5) ? BlendKind::acr : BlendKind::ramp;
  settings.paper_shape = settings.kind == BlendKind::acr && random.chance(0.3);
  settings.tip_tolerance = random.scale(1e-3, 1.0);
  settings.rotation_tolerance = random.scale(1e-4, 0.3);
  if (random.chance(0.3)) settings.tool_axis = random.unit();
  return settings;
}

Vec3 random_turn(Random& random) {
  if (random.chance(0.15)) return Vec3::Zero();
  return random.scale(1e-3, random.chance(0.1) ? 7.0 : 1.5) * random.unit();
}

void check_jumps(const Jumps& jumps) {
  CHECK(jumps.tip[0] < 1e-11);
  CHECK(jumps.rotation[0] < 1e-13);
  for (std::size_t k = 1; k < 4; ++k) {
    INFO("order " << k);
    CHECK(jumps.tip[k] < 1e-8);
    CHECK(jumps.rotation[k] < 1e-8);
    CHECK(jumps.tip_arc[k] < 1e-8);
    CHECK(jumps.rotation_arc[k] < 1e-8);
  }
  CHECK(jumps.rotation_arc[1] < 1e-12);
  CHECK(jumps.slowest > 0.0);
}

void report(const std::string& what, const Deviation& ratio, const Jumps& jumps) {
  std::ostringstream text;
  text << what << ": tip/tolerance " << ratio.tip << ", rotation/tolerance " << ratio.rotation
       << ", axis/tolerance " << ratio.axis << "; jumps over " << jumps.junctions
       << " junctions, tip";
  for (const double j : jumps.tip) text << ' ' << j;
  text << ", rotation";
  for (const double j : jumps.rotation) text << ' ' << j;
  text << ", tip by arc length";
  for (const double j : jumps.tip_arc) text << ' ' << j;
  text << ", synchronisation";
  for (const double j : jumps.rotation_arc) text << ' ' << j;
  text << "; least speed " << jumps.slowest;
  WARN(text.str());
}

/// The ratios to the tolerances; of rotation and axis only the one that the settings bound.
void keep_worst(const Deviation& d, const CornerSettings& settings, Deviation& ratio) {
  ratio.tip = std::max(ratio.tip, d.tip / settings.tip_tolerance);
  if (settings.tool_axis)
    ratio.axis = std::max(ratio.axis, d.axis / settings.rotation_tolerance);
  else
    ratio.rotation = std::max(ratio.rotation, d.rotation / settings.rotation_tolerance);
}

void run_corners(int count, bool print) {
  Random random(101);
  Deviation ratio;
  Jumps jumps;
  for (int n = 0; n < count; ++n) {
    CornerSettings settings = random_settings(random);
    settings.stop_angle = kPi;
    const double turn = radians_from_degrees(random.between(1.0, 179.0));
    const Vec3 in = random.unit();
    const Vec3 normal = in.cross(random.unit()).normalized();
    const Vec3 out = Eigen::AngleAxisd(turn, normal) * in;
    PathText text;
    text.line(random.scale(0.05, 100.0) * in, random_turn(random))
        .line(random.scale(0.05, 100.0) * out, random_turn(random));
    const CornerPath path = text.blended(settings);
    REQUIRE(path.corners()[1].half_width > 0.0);
    keep_worst(test::deviation(text, path, 16, settings.tool_axis.value_or(Vec3::UnitZ())),
               settings, ratio);
    test::measure_jumps(path, false, jumps);
  }
  if (print) report(std::to_string(count) + " corners", ratio, jumps);
  CHECK(ratio.tip <= 1.0 + 1e-9);
  CHECK(ratio.rotation <= 1.0 + 1e-9);
  CHECK(ratio.axis <= 1.0 + 1e-9);
  CHECK(ratio.tip > 0.999);
  check_jumps(jumps);
}

/// Lines, arcs and helices in any order, rotation without motion, motion without rotation.
PathText random_path(Random& random, bool arcs) {
  PathText text;
  const int legs = 2 + random.below(8);
  for (int i = 0; i < legs; ++i) {
    Vec3 turn = random_turn(random);
    if (random.chance(0.1)) {
      if (turn.norm() == 0.0) turn = 0.1 * random.unit();
      text.line(Vec3::Zero(), turn);
    } else if (arcs && random.chance(0.5)) {
      const Vec3 axis = random.unit();
      const Vec3 across = axis.cross(random.unit()).normalized();
      const double sweep = random.between(0.05, 6.2) * (random.chance(0.5) ? 1.0 : -1.0);
      text.arc(random.scale(0.5, 60.0) * across, axis, sweep,
               random.chance(0.5) ? 0.0 : random.between(-5.0, 5.0), turn);
    } else {
      text.line(random.scale(0.05, 100.0) * random.unit(), turn);
    }
  }
  return text;
}

/// How often the windows of tip and rotation meet, in each order.
struct Overlaps {
  int same_node_tip_longer = 0;
  int same_node_rotation_longer = 0;
  int tip_into_next_rotation = 0;  ///< the tip's window and the next node's rotation window
  int rotation_into_next_tip = 0;  ///< the other way round
  int tip_past_next_rotation = 0;  ///< the rotation's window of the next node inside the tip's
};

void count_overlaps(const CornerPath& path, Overlaps& count) {
  const double reach = path.rotation_blend().reach();
  for (std::size_t leg = 0; leg < path.legs(); ++leg) {
    const Corner& a = path.corners()[leg];
    const Corner& b = path.corners()[leg + 1];
    const double length = path.length(leg);
    const double tip_a = a.half_width * a.blend.reach();
    const double tip_b = b.half_width * b.blend.reach();
    const double rotation_a = a.rotation_half_width * reach;
    const double rotation_b = b.rotation_half_width * reach;
    REQUIRE(tip_a + tip_b <= length * (1 + 1e-14));
    REQUIRE(rotation_a + rotation_b <= length * (1 + 1e-14));
    if (tip_a > 0.0 && rotation_a > 0.0)
      ++(tip_a > rotation_a ? count.same_node_tip_longer : count.same_node_rotation_longer);
    if (tip_a > 0.0 && rotation_b > 0.0 && tip_a + rotation_b > length)
      ++count.tip_into_next_rotation;
    if (rotation_a > 0.0 && tip_b > 0.0 && rotation_a + tip_b > length)
      ++count.rotation_into_next_tip;
    if (rotation_b > 0.0 && tip_b > rotation_b && rotation_a + tip_b > length)
      ++count.tip_past_next_rotation;
  }
}

void run_paths(int count, bool arcs, bool print) {
  Random random(arcs ? 103 : 102);
  Deviation ratio;
  Jumps jumps;
  Overlaps overlaps;
  for (int n = 0; n < count; ++n) {
    const CornerSettings settings = random_settings(random);
    const PathText text = random_path(random, arcs);
    const CornerPath path = text.blended(settings);
    count_overlaps(path, overlaps);
    keep_worst(test::deviation(text, path, 16, settings.tool_axis.value_or(Vec3::UnitZ())),
               settings, ratio);
    test::measure_jumps(path, false, jumps);
  }
  if (print) {
    report(std::to_string(count) + (arcs ? " paths with arcs" : " paths of lines"), ratio, jumps);
    std::ostringstream text;
    text << "windows: tip longer " << overlaps.same_node_tip_longer << ", rotation longer "
         << overlaps.same_node_rotation_longer << ", tip into the next rotation "
         << overlaps.tip_into_next_rotation << ", rotation into the next tip "
         << overlaps.rotation_into_next_tip << ", next tip past its rotation into the one before "
         << overlaps.tip_past_next_rotation;
    WARN(text.str());
  }
  CHECK(ratio.tip <= 1.0 + 1e-9);
  CHECK(ratio.rotation <= 1.0 + 1e-9);
  CHECK(ratio.axis <= 1.0 + 1e-9);
  check_jumps(jumps);
  CHECK(overlaps.same_node_tip_longer > count / 10);
  CHECK(overlaps.same_node_rotation_longer > count / 10);
  CHECK(overlaps.tip_into_next_rotation > count / 10);
  CHECK(overlaps.rotation_into_next_tip > count / 10);
  CHECK(overlaps.tip_past_next_rotation > count / 20);
}

}  // namespace

TEST_CASE("corner_path: random corners keep the tolerances and are C3",
          "[kernels][smooth][paper]") {
  run_corners(3000, false);
}

TEST_CASE("corner_path: random paths keep the tolerances and are C3 in any overlap",
          "[kernels][smooth][paper]") {
  run_paths(500, false, false);
}

TEST_CASE("corner_path: random paths of arcs and helices keep the tolerances and are C3",
          "[kernels][smooth]") {
  run_paths(500, true, false);
}

TEST_CASE("corner_path: 100000 random corners", "[.slow][slow][kernels][smooth]") {
  run_corners(100000, true);
}

TEST_CASE("corner_path: 10000 random paths", "[.slow][slow][kernels][smooth]") {
  run_paths(10000, false, true);
}

TEST_CASE("corner_path: 10000 random paths of arcs and helices", "[.slow][slow][kernels][smooth]") {
  run_paths(10000, true, true);
}

}  // namespace smoothpost
