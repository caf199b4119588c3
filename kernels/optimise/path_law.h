#pragma once

#include <functional>

namespace smoothpost {

/// du/dt, d²u/dt² and d³u/dt³ at a place u of a path.
struct PathSpeed {
  double first = 1.0, second = 0.0, third = 0.0;
};

/// How fast a path is run at every place, by a time law that is known: what lets a programme count
/// in time although its splines are over u. With v, a, j = PathSpeed a function q(u) has
///   q̇ = q'v,   q̈ = q''v² + q'a,   q⃛ = q'''v³ + 3q''va + q'j,
/// all linear in q. At an end at rest v = a = 0.
struct PathLaw {
  double duration = 0.0;  ///< s, > 0
  std::function<PathSpeed(double u)> at;
};

/// Weights of q', q'', q''' in the derivative of that order (1, 2, 3) by time.
struct TimeWeights {
  double first = 0.0, second = 0.0, third = 0.0;
};
inline TimeWeights time_weights(const PathSpeed& s, int order) {
  if (order == 1) return {s.first, 0.0, 0.0};
  if (order == 2) return {s.second, s.first * s.first, 0.0};
  return {s.third, 3.0 * s.first * s.second, s.first * s.first * s.first};
}

}  // namespace smoothpost
