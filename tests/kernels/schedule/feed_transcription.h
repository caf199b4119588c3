#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "kernels/core/contract.h"
#include "kernels/schedule/feed_path.h"
#include "kernels/spline/bspline_basis.h"
#include "kernels/spline/gauss_rule.h"

// The scheduling problem written down a second time from its definition, for a solver that is not
// ours: nothing of kernels/schedule but the description of the path is used.
namespace smoothpost::test {

/// s = φ(w) from rest to rest: r(u) = 2u³ − 2u⁴ + 0.6u⁵ at both ends, speed v between; C³.
struct PlainMap {
  double length = 0.0, speed = 1.0, ramp = 1.0;

  double extent() const { return (length - 1.2 * speed * ramp) / speed + 2.0 * ramp; }
  /// φ, φ', φ'', φ'''.
  std::array<double, 4> at(double w) const {
    const bool late = w > extent() - ramp;
    if (w >= ramp && !late) return {0.6 * speed * ramp + speed * (w - ramp), speed, 0.0, 0.0};
    const double u = std::max(0.0, (late ? extent() - w : w) / ramp);
    const double r0 = u * u * u * (2.0 + u * (-2.0 + 0.6 * u));
    const double r1 = u * u * (6.0 + u * (-8.0 + 3.0 * u));
    const double r2 = 12.0 * u * (1.0 - u) * (1.0 - u), r3 = 12.0 * (1.0 - u) * (1.0 - 3.0 * u);
    const double far = speed * ramp * r0, turn = late ? -1.0 : 1.0;
    return {late ? length - far : far, speed * r1, turn * speed * r2 / ramp,
            speed * r3 / (ramp * ramp)};
  }
  double inverse(double s) const {
    double low = 0.0, high = extent();
    for (int k = 0; k < 100; ++k) {
      const double middle = 0.5 * (low + high);
      (at(middle)[0] < s ? low : high) = middle;
    }
    return 0.5 * (low + high);
  }
};

/// Least ∫ b^{−1/2} dw over cubic splines b(w) > 0 on given elements of w, with at five Lobatto
/// points of every element, for every joint and for the tip's arc length in place of q
///   |q_w| √b ≤ V,   |q_ww b + q_w b'/2| ≤ A,   √b |q_www b + 3/2 q_ww b' + q_w b''/2| ≤ J.
struct FeedTranscription {
  /// A place: what the controls first … first + 3 give to b, b', b'', and its part of ∫ dw.
  struct Point {
    int first = 0;
    std::array<std::array<double, 4>, 3> basis{};
    double weight = 0.0;

    std::array<double, 3> of(const double* controls) const {
      std::array<double, 3> v{};
      for (int order = 0; order < 3; ++order)
        for (int j = 0; j < 4; ++j) v[order] += basis[order][j] * controls[first + j];
      return v;
    }
  };
  /// |k·(b, b', b'')| ≤ 1, of jerk √b·|k·(b, b', b'')| ≤ 1.
  struct Row {
    std::size_t point = 0;
    std::array<double, 3> k{};
    bool jerk = false;

    double at(const std::array<double, 3>& v) const {
      const double linear = k[0] * v[0] + k[1] * v[1] + k[2] * v[2];
      return jerk ? std::sqrt(v[0]) * linear : linear;
    }
    std::array<double, 3> gradient(const std::array<double, 3>& v) const {
      if (!jerk) return k;
      const double root = std::sqrt(v[0]);
      const double linear = k[0] * v[0] + k[1] * v[1] + k[2] * v[2];
      return {root * k[0] + 0.5 * linear / root, root * k[1], root * k[2]};
    }
    /// Second derivatives by b and b, b and b', b and b''; all others are 0.
    std::array<double, 3> bend(const std::array<double, 3>& v) const {
      if (!jerk) return {};
      const double root = std::sqrt(v[0]);
      const double linear = k[0] * v[0] + k[1] * v[1] + k[2] * v[2];
      return {k[0] / root - 0.25 * linear / (v[0] * root), 0.5 * k[1] / root, 0.5 * k[2] / root};
    }
  };

  SplineKnots knots;
  std::vector<Point> points;
  std::vector<Row> rows;

  int controls() const { return knots.controls(); }

  /// ∫ b^{−1/2} dw of a law.
  double time(const std::vector<double>& law) const {
    const GaussRule& rule = gauss_rule(8);
    const Eigen::Map<const Eigen::VectorXd> x(law.data(), static_cast<Eigen::Index>(law.size()));
    double sum = 0.0;
    for (int e = 0; e < knots.spans(); ++e) {
      const double begin = knots.values[e + 3], size = knots.values[e + 4] - begin;
      for (int g = 0; g < rule.points; ++g)
        sum += size * rule.weights[g] /
               std::sqrt(bspline_value(knots, x, begin + size * rule.nodes[g]));
    }
    return sum;
  }
  /// The largest |row|: ≤ 1 where a law keeps them all.
  double worst(const std::vector<double>& law) const {
    double most = 0.0;
    for (const Row& row : rows)
      most = std::max(most, std::abs(row.at(points[row.point].of(law.data()))));
    return most;
  }
  /// The controls of b = β as large as the rows allow.
  std::vector<double> constant_law() const {
    double beta = 1e9;
    for (const Row& row : rows)
      if (row.k[0] != 0.0)
        beta = std::min(beta, std::pow(std::abs(row.k[0]), row.jerk ? -2.0 / 3.0 : -1.0));
    return std::vector<double>(static_cast<std::size_t>(controls()), beta);
  }

  /// @param ends  ascending, of the elements: from 0 to the map's extent, with every break of the
  /// path and both ends of the ramps among them   @pre the tip moves by 0.01 or more wherever it
  /// has limits of acceleration or jerk
  FeedTranscription(const FeedPath& path, const FeedLimits& limits, const PlainMap& map,
                    const std::vector<double>& ends) {
    knots.degree = 3;
    knots.values.assign(3, ends.front());
    knots.values.insert(knots.values.end(), ends.begin(), ends.end());
    knots.values.insert(knots.values.end(), 3, ends.back());
    const double off = 0.5 * std::sqrt(3.0 / 7.0);
    const std::array<double, 5> nodes{0.0, 0.5 - off, 0.5, 0.5 + off, 1.0};
    const std::array<double, 5> weights{9.0, 49.0, 64.0, 49.0, 9.0};  // of 180
    for (std::size_t e = 0; e + 1 < ends.size(); ++e) {
      const double size = ends[e + 1] - ends[e];
      const double middle = path.breaks.front() + map.at(ends[e] + 0.5 * size)[0];
      std::size_t piece = 0;
      while (piece + 1 < path.pieces() && middle > path.breaks[piece + 1]) ++piece;
      for (std::size_t i = 0; i < nodes.size(); ++i) {
        const double w = i == 4 ? ends[e + 1] : ends[e] + size * nodes[i];
        Point point;
        for (int order = 0; order < 3; ++order) {
          const BasisRow row = bspline_basis(knots, w, order);
          point.first = row.first;
          for (int j = 0; j < 4; ++j) point.basis[order][j] = row.weights[j];
        }
        point.weight = size * weights[i] / 180.0;
        points.push_back(point);
        const auto phi = map.at(w);
        add_rows(path.jet(piece, path.breaks.front() + phi[0]), limits, phi, path.feed[piece]);
      }
    }
  }

 private:
  void add_rows(const PathJet& jet, const FeedLimits& limits, const std::array<double, 4>& phi,
                double feed) {
    const std::size_t point = points.size() - 1;
    double cap = 1e9;  // of b
    const auto add_cap = [&](double rate, double limit) {
      if (rate != 0.0 && std::isfinite(limit))
        cap = std::min(cap, std::pow(limit / (rate * phi[1]), 2));
    };
    const auto add_lane = [&](const std::array<double, 3>& q, double acceleration, double jerk) {
      const double q1 = q[0] * phi[1], q2 = q[1] * phi[1] * phi[1] + q[0] * phi[2];
      const double q3 =
          q[2] * phi[1] * phi[1] * phi[1] + 3.0 * q[1] * phi[1] * phi[2] + q[0] * phi[3];
      if (q1 == 0.0 && q2 == 0.0 && q3 == 0.0) return;
      if (std::isfinite(acceleration))
        rows.push_back({point, {q2 / acceleration, 0.5 * q1 / acceleration, 0.0}, false});
      if (std::isfinite(jerk))
        rows.push_back({point, {q3 / jerk, 1.5 * q2 / jerk, 0.5 * q1 / jerk}, true});
    };
    for (int k = 0; k < jet.first.size(); ++k) {
      add_cap(jet.first[k], limits.velocity[k]);
      add_lane({jet.first[k], jet.second[k], jet.third[k]}, limits.acceleration[k], limits.jerk[k]);
    }
    add_cap(jet.tip_first, feed);
    add_cap(jet.turn_first, limits.turn_rate);
    if (std::isfinite(limits.tip_acceleration) || std::isfinite(limits.tip_jerk)) {
      require(jet.tip_first >= 0.01, "FeedTranscription: the tip moves where it has limits");
      add_lane({jet.tip_first, jet.tip_second, jet.tip_third}, limits.tip_acceleration,
               limits.tip_jerk);
    }
    if (cap < 1e9) rows.push_back({point, {1.0 / cap, 0.0, 0.0}, false});
  }
};

}  // namespace smoothpost::test
