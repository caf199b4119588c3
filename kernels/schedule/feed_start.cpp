#include "kernels/schedule/feed_start.h"

#include <algorithm>
#include <cmath>

namespace smoothpost {
namespace {

constexpr double kConstantShare = 0.5;  // of the largest constant b of an element
constexpr double kSlopeShare = 0.3;     // of accelerations and jerks between bottlenecks
constexpr int kSmoothings = 3;
constexpr int kLocalRounds = 8;
constexpr double kReserve = 1.02;    // of a ratio that is taken away
constexpr double kMostRatio = 64.0;  // of one round

/// What the rows of an element allow.
struct ElementBounds {
  double constant = kNoCap;  ///< b, where b' = b'' = 0
  double slope = kNoCap;     ///< |b'|, by itself
  double bend = kNoCap;      ///< |b''| √b, by itself
};

std::vector<ElementBounds> element_bounds(const FeedProgram& program) {
  const FeedGrid& grid = *program.grid;
  const FeedLanes& lanes = *program.lanes;
  const int width = grid.width, nodes = grid.points_per_element();
  std::vector<ElementBounds> bounds(grid.elements.size());
  std::size_t i = 0;
  for (ElementBounds& bound : bounds)
    for (int node = 0; node < nodes; ++node, ++i) {
      const FeedProgram::Factors& f = program.factors[i];
      const double* q = &grid.rows[3 * static_cast<std::size_t>(width) * i];
      bound.constant = std::min(bound.constant, grid.cap[i] / (f.velocity * f.velocity));
      double a = 0.0, j = 0.0, slope = 0.0, bend = 0.0;
      for (int l = 0; l < width; ++l) {
        const double ia = lanes.acceleration[l] * f.acceleration, ij = lanes.jerk[l] * f.jerk;
        a = std::max(a, std::abs(q[width + l]) * ia);
        j = std::max(j, std::abs(q[2 * width + l]) * ij);
        slope = std::max(slope, std::abs(q[l]) * ia);
        bend = std::max(bend, std::abs(q[l]) * ij);
      }
      if (a > 0.0) bound.constant = std::min(bound.constant, 1.0 / a);
      if (j > 0.0) bound.constant = std::min(bound.constant, 1.0 / std::cbrt(j * j));
      if (slope > 0.0) bound.slope = std::min(bound.slope, 2.0 / slope);
      if (bend > 0.0) bound.bend = std::min(bound.bend, 2.0 / bend);
    }
  return bounds;
}

/// One sweep: b rises from bottlenecks as bounds allow, never above `most`.
void sweep(const FeedGrid& grid, const std::vector<ElementBounds>& bounds, bool backward,
           std::vector<double>& most) {
  const std::size_t count = bounds.size();
  double b = most[backward ? count - 1 : 0], slope = 0.0;
  for (std::size_t k = 1; k < count; ++k) {
    const std::size_t e = backward ? count - 1 - k : k, old = backward ? e + 1 : e - 1;
    const FeedElement &here = grid.elements[e], &there = grid.elements[old];
    const double h = 0.5 * (here.end - here.begin + there.end - there.begin);
    const double steepest = kSlopeShare * std::min(bounds[e].slope, bounds[old].slope);
    const double bend = kSlopeShare * std::min(bounds[e].bend, bounds[old].bend);
    // b'' = bend/√b, with the √b that it reaches
    double next = b + std::min(slope, steepest) * h;
    for (int n = 0; n < 3; ++n) {
      const double up = bend / std::sqrt(std::max(next, b));
      next = b + h * std::min(steepest, slope + 0.5 * up * h);
    }
    const double up = bend / std::sqrt(std::max(next, b));
    slope = std::min(steepest, slope + up * h);
    if (next >= most[e]) {
      next = most[e];
      slope = 0.0;
    }
    b = most[e] = next;
  }
}

/// Controls from values of elements, as geometric means of those that a control lies on.
std::vector<double> controls_of(const std::vector<double>& values, std::size_t controls) {
  std::vector<double> logs(values.size());
  for (std::size_t e = 0; e < values.size(); ++e) logs[e] = std::log(values[e]);
  for (int n = 0; n < kSmoothings; ++n) {
    double before = logs.front();
    for (std::size_t e = 0; e < logs.size(); ++e) {
      const double now = logs[e], after = logs[std::min(e + 1, logs.size() - 1)];
      logs[e] = 0.25 * before + 0.5 * now + 0.25 * after;
      before = now;
    }
  }
  std::vector<double> out(controls);
  for (std::size_t j = 0; j < controls; ++j) {  // about the middle of elements j − 2 and j − 1
    const auto at = [&](std::size_t back) {
      return logs[std::clamp<std::size_t>(j < back ? 0 : j - back, 0, logs.size() - 1)];
    };
    out[j] = std::exp(0.5 * (at(2) + at(1)));
  }
  return out;
}

}  // namespace

std::vector<double> local_law(const FeedProgram& program) {
  const FeedGrid& grid = *program.grid;
  const std::vector<ElementBounds> bounds = element_bounds(program);
  std::vector<double> values;
  values.reserve(bounds.size());
  for (const ElementBounds& bound : bounds) values.push_back(kConstantShare * bound.constant);
  sweep(grid, bounds, false, values);
  sweep(grid, bounds, true, values);
  return keep_inside(program, controls_of(values, static_cast<std::size_t>(grid.controls())));
}

std::vector<double> keep_inside(const FeedProgram& program, std::vector<double> controls) {
  double last = 0.0;
  for (int round = 0;; ++round) {
    std::vector<double> over = element_dilations(program, controls);
    const double most = *std::max_element(over.begin(), over.end());
    if (most <= 1.0) return controls;
    if (round == kLocalRounds || (round > 2 && most > 0.98 * last)) {
      for (double& x : controls) x /= most * most;
      return controls;
    }
    last = most;
    for (double& c : over) {
      c = std::clamp(c, 1.0, kMostRatio);
      c = c > 1.0 ? 1.0 / (kReserve * kReserve * c * c) : 1.0;
    }
    std::vector<double> spread = over;  // a neighbour's is felt, too
    for (std::size_t e = 0; e < over.size(); ++e) {
      if (e > 0) spread[e] = std::min(spread[e], over[e - 1]);
      if (e + 1 < over.size()) spread[e] = std::min(spread[e], over[e + 1]);
    }
    const std::vector<double> factors = controls_of(spread, controls.size());
    for (std::size_t j = 0; j < controls.size(); ++j) controls[j] *= factors[j];
  }
}

}  // namespace smoothpost
