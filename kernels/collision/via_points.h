#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

// The choice of one wrist position a cutter location, so that all of them together cost least.
namespace smoothpost {

/// Wrist coordinates that are possible at one cutter location.
struct WristNode {
  std::array<double, 2> rotary{};  ///< rad, unwound: turns of a rotary are nodes of their own
  double standoff = 0.0;           ///< mm
  double cost = 0.0;               ///< of the node itself, ≥ 0, mm as wrist_distance()
  std::int32_t label = 0;          ///< the caller's
};

/// What wrist coordinates weigh against each other.
struct WristWeights {
  double arm = 100.0;     ///< mm that one rad of the tool axis counts
  double standoff = 1.0;  ///< mm that one mm of standoff counts
  /// Share of the arm that a turn of the first rotary counts where it does not turn the tool axis.
  double at_pole = 0.1;
  double pole = 0.0;  ///< rad: the second rotary where the tool axis lies on the first one
};

/// Distance of two wrist positions, mm:
///   d² = arm²·((sin²(q5 − pole) + at_pole²)·Δq4² + Δq5²) + standoff²·Δq6²,
/// the sine in the middle between them.
/// Guarantees (tests): symmetric; 0 only for equal ones; arm times the angle between the tool axes
/// of near ones, when at_pole = 0.
/// Implements [Ding2025] Eq. (55). Differences from the paper: it adds rad and m, so that q6 does
/// not count; sin(q5) is missing, without which near the pole the first rotary outweighs all.
double wrist_distance(const WristNode& a, const WristNode& b, const WristWeights& weights);

struct RouteSettings {
  WristWeights weights;
  double turning = 1.0;  ///< what distance from layer to layer costs, against the nodes' own cost
  /// Edges cost d²/(`squared` · step) and not d: a way in many small steps is the cheaper one. mm;
  /// 0: d.
  double squared = 0.0;
  double farthest = std::numeric_limits<double>::infinity();  ///< mm: no edge is longer
};

/// One node a layer.
struct WristRoute {
  std::vector<std::size_t> node;  ///< by layer; empty when there is no way
  double cost = 0.0;
  /// There is no way to any node of this layer; layers.size(): there is one to the end.
  std::size_t blocked = 0;
};

/// The cheapest way through the layers, one node in each:
///   Σ_i cost(node_i) + turning·Σ_i e(node_{i−1}, node_i),
/// e as RouteSettings says. Exact, by dynamic programming: the best way to every node of a layer is
/// the best one over the nodes before, which are tried in the order of their own cost, until that
/// alone is more than what was found. Of equal ways the one with the earlier nodes.
/// Guarantee (test): the cost of trying all ways, on small random graphs.
/// Units: mm.   Cost: at most Σ P_{i−1}·P_i distances, usually a small share of it.
/// @param step  mm from each layer to the one before (`squared` only): step[i] > 0 for i > 0;
/// empty:
///   1
/// Implements [Ding2025] Eq. (56). Differences from the paper: dynamic programming in place of a
/// greedy choice; branches and turns are nodes.
WristRoute best_route(const std::vector<std::vector<WristNode>>& layers,
                      const RouteSettings& settings, const std::vector<double>& step = {});

}  // namespace smoothpost
