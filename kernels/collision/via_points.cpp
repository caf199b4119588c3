#include "kernels/collision/via_points.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

constexpr double kNoWay = std::numeric_limits<double>::infinity();

/// Best ways to the nodes of one layer.
struct Ways {
  std::vector<double> cost;
  std::vector<std::size_t> from;
};

Ways first_ways(const std::vector<WristNode>& layer) {
  Ways out;
  for (const WristNode& n : layer) out.cost.push_back(n.cost);
  out.from.assign(layer.size(), 0);
  return out;
}

Ways next_ways(const std::vector<WristNode>& before, const Ways& ways,
               const std::vector<WristNode>& layer, const RouteSettings& settings, double step) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < before.size(); ++i)
    if (ways.cost[i] < kNoWay) order.push_back(i);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return ways.cost[a] < ways.cost[b]; });
  Ways out;
  out.cost.assign(layer.size(), kNoWay);
  out.from.assign(layer.size(), 0);
  for (std::size_t k = 0; k < layer.size(); ++k) {
    double best = kNoWay;
    std::size_t from = 0;
    for (const std::size_t i : order) {
      if (ways.cost[i] > best) break;
      const double d = wrist_distance(before[i], layer[k], settings.weights);
      if (d > settings.farthest) continue;
      const double edge = settings.squared > 0.0 ? d * d / (settings.squared * step) : d;
      const double cost = ways.cost[i] + settings.turning * edge;
      if (cost < best || (cost == best && i < from)) {
        best = cost;
        from = i;
      }
    }
    if (best == kNoWay) continue;
    out.cost[k] = best + layer[k].cost;
    out.from[k] = from;
  }
  return out;
}

}  // namespace

double wrist_distance(const WristNode& a, const WristNode& b, const WristWeights& w) {
  const double sine = std::sin(0.5 * (a.rotary[1] + b.rotary[1]) - w.pole);
  const double first = a.rotary[0] - b.rotary[0], second = a.rotary[1] - b.rotary[1];
  const double along = w.standoff * (a.standoff - b.standoff);
  return std::sqrt(w.arm * w.arm *
                       ((sine * sine + w.at_pole * w.at_pole) * first * first + second * second) +
                   along * along);
}

WristRoute best_route(const std::vector<std::vector<WristNode>>& layers,
                      const RouteSettings& settings, const std::vector<double>& step) {
  require(step.empty() || step.size() == layers.size(), "a step for every layer");
  WristRoute out;
  std::vector<Ways> ways;
  for (std::size_t i = 0; i < layers.size(); ++i) {
    ways.push_back(i == 0 ? first_ways(layers[i])
                          : next_ways(layers[i - 1], ways.back(), layers[i], settings,
                                      step.empty() ? 1.0 : step[i]));
    const auto& cost = ways.back().cost;
    if (cost.empty() || *std::min_element(cost.begin(), cost.end()) == kNoWay) {
      out.blocked = i;
      return out;
    }
  }
  out.blocked = layers.size();
  if (layers.empty()) return out;
  const auto& last = ways.back().cost;
  auto at = static_cast<std::size_t>(std::min_element(last.begin(), last.end()) - last.begin());
  out.cost = last[at];
  out.node.resize(layers.size());
  for (std::size_t i = layers.size(); i-- > 0;) {
    out.node[i] = at;
    at = ways[i].from[at];
  }
  return out;
}

}  // namespace smoothpost
