#include "kernels/collision/via_points.h"

#include "tests/kernels/collision/oracles.h"

using namespace smoothpost;

namespace {

WristNode random_node(std::mt19937& random) {
  WristNode n;
  n.rotary = {test::uniform(random, -4.0, 4.0), test::uniform(random, -1.5, 1.5)};
  n.standoff = test::uniform(random, -100.0, 20.0);
  n.cost = test::uniform(random, 0.0, 30.0);
  return n;
}

/// The cheapest of all ways, by trying every one.
double cheapest(const std::vector<std::vector<WristNode>>& layers, const RouteSettings& settings,
                const std::vector<double>& step, std::size_t i, const WristNode* before) {
  if (i == layers.size()) return 0.0;
  double best = std::numeric_limits<double>::infinity();
  for (const WristNode& n : layers[i]) {
    double here = n.cost;
    if (before != nullptr) {
      const double d = wrist_distance(*before, n, settings.weights);
      if (d > settings.farthest) continue;
      here += settings.turning * (settings.squared > 0.0 ? d * d / settings.squared / step[i] : d);
    }
    best = std::min(best, here + cheapest(layers, settings, step, i + 1, &n));
  }
  return best;
}

}  // namespace

TEST_CASE("via_points: the route costs what trying all ways costs", "[kernels][collision][paper]") {
  std::mt19937 random(41);
  int blocked = 0, far = 0;
  for (int round = 0; round < 300; ++round) {
    std::vector<std::vector<WristNode>> layers(2 + round % 4);
    std::vector<double> step(layers.size(), 1.0);
    for (std::size_t i = 0; i < layers.size(); ++i) {
      const int count = 1 + static_cast<int>(test::uniform(random, 0.0, 6.0));
      for (int k = 0; k < count; ++k) layers[i].push_back(random_node(random));
      step[i] = test::uniform(random, 0.2, 3.0);
    }
    RouteSettings settings;
    settings.turning = round % 3 == 0 ? 0.05 : 1.0;
    settings.squared = round % 2 ? 25.0 : 0.0;
    if (round % 5 == 0) settings.farthest = 150.0;
    const WristRoute route = best_route(layers, settings, step);
    const double best = cheapest(layers, settings, step, 0, nullptr);
    if (!std::isfinite(best)) {
      ++blocked;
      CHECK(route.node.empty());
      CHECK(route.blocked < layers.size());
      continue;
    }
    ++far;
    REQUIRE(route.node.size() == layers.size());
    CHECK(route.blocked == layers.size());
    CHECK(route.cost == Approx(best).epsilon(1e-12));
    // And the way that it names has that cost.
    double sum = 0.0;
    for (std::size_t i = 0; i < layers.size(); ++i) {
      const WristNode& n = layers[i][route.node[i]];
      sum += n.cost;
      if (i == 0) continue;
      const double d = wrist_distance(layers[i - 1][route.node[i - 1]], n, settings.weights);
      sum += settings.turning * (settings.squared > 0.0 ? d * d / settings.squared / step[i] : d);
    }
    CHECK(sum == Approx(best).epsilon(1e-12));
  }
  CHECK(blocked > 10);
  CHECK(far > 200);
}

TEST_CASE("via_points: a layer without nodes is named", "[kernels][collision]") {
  std::mt19937 random(42);
  std::vector<std::vector<WristNode>> layers(4);
  for (const std::size_t i : {0, 1, 3}) layers[i].push_back(random_node(random));
  CHECK(best_route(layers, {}).blocked == 2);
  CHECK(best_route({}, {}).blocked == 0);
}

TEST_CASE("via_points: the distance is the arm times the angle of the tool axis",
          "[kernels][collision][paper]") {
  std::mt19937 random(43);
  WristWeights w;
  w.at_pole = 0.0;
  for (int round = 0; round < 200; ++round) {
    WristNode a = random_node(random), b = a;
    b.rotary[0] += test::uniform(random, -1e-4, 1e-4);
    b.rotary[1] += test::uniform(random, -1e-4, 1e-4);
    const auto axis = [](const WristNode& n) {
      return Vec3(std::sin(n.rotary[1]) * std::cos(n.rotary[0]),
                  std::sin(n.rotary[1]) * std::sin(n.rotary[0]), std::cos(n.rotary[1]));
    };
    CHECK(wrist_distance(a, b, w) == Approx(w.arm * (axis(a) - axis(b)).norm()).epsilon(1e-4));
    CHECK(wrist_distance(a, b, w) == wrist_distance(b, a, w));
    b = a;
    b.standoff += 3.0;
    CHECK(wrist_distance(a, b, w) == Approx(3.0));
    // On the pole itself a turn of the first rotary is none of the tool axis.
    a.rotary[1] = b.rotary[1] = 0.0;
    b.standoff = a.standoff;
    b.rotary[0] = a.rotary[0] + 1.0;
    CHECK(wrist_distance(a, b, w) == 0.0);
    WristWeights some = w;
    some.at_pole = 0.1;
    CHECK(wrist_distance(a, b, some) == Approx(10.0));
  }
}
