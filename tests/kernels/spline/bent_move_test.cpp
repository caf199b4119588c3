#include "kernels/spline/bent_move.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "kernels/core/contract.h"

using namespace smoothpost;

namespace {

struct Move {
  JointVector from, to;
  JointBend bend;
  BentMove bent() const { return {from, to, bend}; }
};

Move random_move(std::mt19937& rng, int joints) {
  std::normal_distribution<double> normal;
  Move move;
  move.from = JointVector::NullaryExpr(joints, [&](Eigen::Index) { return 100.0 * normal(rng); });
  move.to = JointVector::NullaryExpr(joints, [&](Eigen::Index) { return 100.0 * normal(rng); });
  move.bend = JointBend::NullaryExpr(
      joints, 4, [&](Eigen::Index, Eigen::Index) { return 30.0 * normal(rng); });
  return move;
}

/// Σ a_k p^k of the power form, and its derivatives.
double power_form(const Move& m, Eigen::Index j, double p, int order) {
  double a[6] = {m.from[j],    m.to[j] - m.from[j] - m.bend.row(j).sum(),
                 m.bend(j, 0), m.bend(j, 1),
                 m.bend(j, 2), m.bend(j, 3)};
  double sum = 0.0;
  for (int k = order; k < 6; ++k) {
    double factor = 1.0;
    for (int r = 0; r < order; ++r) factor *= k - r;
    sum += factor * a[k] * std::pow(p, k - order);
  }
  return sum;
}

}  // namespace

TEST_CASE("bent_move: the polynomial of the definition, its ends and derivatives",
          "[kernels][spline]") {
  std::mt19937 rng(1);
  for (int n = 0; n < 500; ++n) {
    const Move m = random_move(rng, 1 + n % kMaxJoints);
    REQUIRE((joints_at(m.bent(), 0.0) - m.from).cwiseAbs().maxCoeff() == 0.0);
    REQUIRE((joints_at(m.bent(), 1.0) - m.to).cwiseAbs().maxCoeff() <= 1e-12);
    for (const double p : {0.0, 0.1, 0.5, 0.77, 1.0})
      for (Eigen::Index j = 0; j < m.from.size(); ++j) {
        REQUIRE(joints_at(m.bent(), p)[j] == Approx(power_form(m, j, p, 0)).margin(1e-9));
        REQUIRE(rates_at(m.bent(), p)[j] == Approx(power_form(m, j, p, 1)).margin(1e-9));
        REQUIRE(second_at(m.bent(), p)[j] == Approx(power_form(m, j, p, 2)).margin(1e-9));
      }
  }
}

TEST_CASE("bent_move: no rows are a straight move", "[kernels][spline]") {
  JointVector from(2), to(2);
  from << 1.0, -2.0;
  to << 3.0, 4.0;
  const JointBend none;
  const BentMove move{from, to, none};
  CHECK(joints_at(move, 0.25)[1] == -0.5);
  CHECK(rates_at(move, 0.9)[0] == 2.0);
  CHECK(second_at(move, 0.9).norm() == 0.0);
  CHECK(bend_bounds(move).rate[1] == 6.0);
  CHECK(bend_bounds(move).second.norm() == 0.0);
}

TEST_CASE("bent_move: bounds are never below dense samples", "[kernels][spline]") {
  std::mt19937 rng(2);
  double loosest = 0.0;
  for (int n = 0; n < 300; ++n) {
    const Move m = random_move(rng, 3);
    const BendBounds bounds = bend_bounds(m.bent());
    JointVector rate = JointVector::Zero(3), second = JointVector::Zero(3);
    for (int k = 0; k <= 400; ++k) {
      rate = rate.cwiseMax(rates_at(m.bent(), k / 400.0).cwiseAbs());
      second = second.cwiseMax(second_at(m.bent(), k / 400.0).cwiseAbs());
    }
    REQUIRE((rate.array() <= bounds.rate.array()).all());
    REQUIRE((second.array() <= bounds.second.array()).all());
    loosest = std::max(loosest, bounds.second.cwiseQuotient(second).maxCoeff());
  }
  CHECK(loosest < 4.0);
  // A derivative that is monotone has its largest size at an end: q' = 6p², q'' = 12p.
  Move cube;
  cube.from = cube.to = JointVector::Zero(1);
  cube.to[0] = 2.0;
  cube.bend = JointBend::Zero(1, 4);
  cube.bend(0, 1) = 2.0;
  CHECK(bend_bounds(cube.bent()).rate[0] == Approx(6.0).epsilon(1e-11));
  CHECK(bend_bounds(cube.bent()).second[0] == Approx(12.0).epsilon(1e-11));
}

TEST_CASE("bent_move: a polynomial comes back from the ends of its path", "[kernels][spline]") {
  std::mt19937 rng(3);
  for (const int degree : {3, 5})
    for (int n = 0; n < 200; ++n) {
      Move m = random_move(rng, 4);
      if (degree == 3) m.bend.rightCols(2).setZero();
      const double length = 0.01 + 0.5 * n;
      const auto end = [&](double p) {
        return PathEnd{joints_at(m.bent(), p), rates_at(m.bent(), p) / length,
                       second_at(m.bent(), p) / (length * length)};
      };
      const JointBend found = hermite_bend(end(0.0), end(1.0), length, degree);
      REQUIRE((found - m.bend).cwiseAbs().maxCoeff() <= 1e-8);
    }
}

TEST_CASE("bent_move: preconditions", "[kernels][spline]") {
  const JointVector two = JointVector::Zero(2), three = JointVector::Zero(3);
  const JointBend none, wrong = JointBend::Zero(3, 4);
  CHECK_THROWS_AS(joints_at({two, three, none}, 0.5), ContractViolation);
  CHECK_THROWS_AS(joints_at({two, two, wrong}, 0.5), ContractViolation);
  CHECK_THROWS_AS(rates_at({two, two, wrong}, 0.5), ContractViolation);
  CHECK_THROWS_AS(second_at({two, two, wrong}, 0.5), ContractViolation);
  CHECK_THROWS_AS(bend_bounds({two, two, wrong}), ContractViolation);
  const PathEnd end{two, two, two};
  CHECK_THROWS_AS(hermite_bend(end, end, 1.0, 4), ContractViolation);
  CHECK_THROWS_AS(hermite_bend(end, end, 0.0, 5), ContractViolation);
  CHECK_THROWS_AS(hermite_bend(end, {three, two, two}, 1.0, 5), ContractViolation);
  CHECK_THROWS_AS(hermite_bend(end, {two, two, {}}, 1.0, 5), ContractViolation);
}

namespace {

struct ArcMove {
  JointVector from, to;
  JointBend none;
  JointArc arc;
  double radius[2] = {0.0, 0.0}, start = 0.0, sweep = 0.0;
  BentMove bent() const { return {from, to, none, arc}; }
};

/// Joints 2 and 0 of four go round, from radius[0] to radius[1], by up to `most` either way.
ArcMove random_arc(std::mt19937& rng, double most, double change) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  ArcMove m;
  m.from = JointVector::NullaryExpr(4, [&](Eigen::Index) { return 100.0 * unit(rng); });
  m.to = JointVector::NullaryExpr(4, [&](Eigen::Index) { return 100.0 * unit(rng); });
  m.radius[0] = 0.1 * std::pow(1e5, unit(rng));
  m.radius[1] = m.radius[0] + change * (2.0 * unit(rng) - 1.0);
  m.start = 6.0 * unit(rng) - 3.0;
  m.sweep = (0.01 + (most - 0.01) * unit(rng)) * (rng() % 2 == 0 ? 1.0 : -1.0);
  m.arc = {m.sweep > 0.0 ? 1 : -1, 2, 0, 50.0 * unit(rng), -50.0 * unit(rng)};
  m.from[2] = m.arc.centre_first + m.radius[0] * std::cos(m.start);
  m.from[0] = m.arc.centre_second + m.radius[0] * std::sin(m.start);
  m.to[2] = m.arc.centre_first + m.radius[1] * std::cos(m.start + m.sweep);
  m.to[0] = m.arc.centre_second + m.radius[1] * std::sin(m.start + m.sweep);
  return m;
}

}  // namespace

TEST_CASE("bent_move: an arc is polar about its centre, ends and derivatives",
          "[kernels][spline]") {
  std::mt19937 rng(11);
  for (int n = 0; n < 500; ++n) {
    const ArcMove m = random_arc(rng, 6.2, 0.05);
    const double size = m.radius[0] + 200.0;
    const ArcShape shape = arc_shape(m.bent());
    REQUIRE(shape.sweep == Approx(m.sweep).margin(1e-9));
    REQUIRE(shape.from_radius == Approx(m.radius[0]));
    REQUIRE((joints_at(m.bent(), 0.0) - m.from).cwiseAbs().maxCoeff() <= 1e-12 * size);
    REQUIRE((joints_at(m.bent(), 1.0) - m.to).cwiseAbs().maxCoeff() <= 1e-12 * size);
    for (const double t : {0.1, 0.5, 0.83}) {
      const JointVector q = joints_at(m.bent(), t);
      const double radius = m.radius[0] + t * (m.radius[1] - m.radius[0]);
      const double angle = m.start + t * m.sweep;
      REQUIRE(q[2] == Approx(m.arc.centre_first + radius * std::cos(angle)).margin(1e-9 * size));
      REQUIRE(q[0] == Approx(m.arc.centre_second + radius * std::sin(angle)).margin(1e-9 * size));
      for (const int j : {1, 3})
        REQUIRE(q[j] == Approx(m.from[j] + t * (m.to[j] - m.from[j])).margin(1e-12));
      const double h = 1e-4;
      const JointVector a = joints_at(m.bent(), t - h), b = joints_at(m.bent(), t + h);
      const double curve = m.radius[0] * std::pow(std::abs(m.sweep), 3) + size;
      REQUIRE(((b - a) / (2.0 * h) - rates_at(m.bent(), t)).cwiseAbs().maxCoeff() <= 1e-6 * curve);
      REQUIRE(((b - 2.0 * q + a) / (h * h) - second_at(m.bent(), t)).cwiseAbs().maxCoeff() <=
              1e-5 * curve * (1.0 + std::abs(m.sweep)));
    }
  }
}

TEST_CASE("bent_move: bounds of an arc are never below dense samples", "[kernels][spline]") {
  std::mt19937 rng(12);
  for (int n = 0; n < 300; ++n) {
    const ArcMove m = random_arc(rng, 6.2, 0.05);
    const BendBounds bounds = bend_bounds(m.bent());
    for (int k = 0; k <= 200; ++k) {
      const double t = k / 200.0;
      REQUIRE((rates_at(m.bent(), t).cwiseAbs().array() <= bounds.rate.array()).all());
      REQUIRE((second_at(m.bent(), t).cwiseAbs().array() <= bounds.second.array()).all());
    }
  }
}

TEST_CASE("bent_move: what controls do about radii that differ is within the spread",
          "[kernels][spline]") {
  std::mt19937 rng(13);
  double most = 0.0;
  for (int n = 0; n < 400; ++n) {
    const ArcMove m = random_arc(rng, kMostSweep, 0.005);
    if (std::abs(m.radius[1] - m.radius[0]) < 1e-6) continue;
    const double spread = arc_spread(m.bent());
    REQUIRE(spread == Approx(2.0 * std::abs(m.radius[1] - m.radius[0])).epsilon(1e-3));
    using Point = Eigen::Vector2d;
    const auto plane = [](const JointVector& q) { return Point(q[2], q[0]); };
    const Point a = plane(m.from), b = plane(m.to), centre(m.arc.centre_first, m.arc.centre_second);
    // (b) the first radius, then straight to the end: all of the difference there.
    // (c) the centre where a and b are equally far, on the chord's middle line.
    const Point middle = 0.5 * (a + b), along = (b - a).normalized();
    const Point moved = centre + along * along.dot(middle - centre);
    const Point spoke = a - moved;
    const Point other = b - moved;
    double turn = std::atan2(spoke.x() * other.y() - spoke.y() * other.x(), spoke.dot(other));
    if (turn * m.sweep < 0.0)
      turn += m.sweep > 0.0 ? 2.0 * 3.14159265358979 : -2.0 * 3.14159265358979;
    for (int k = 0; k <= 100; ++k) {
      const double t = k / 100.0;
      const Point p = plane(joints_at(m.bent(), t));
      const double angle = m.start + t * m.sweep;
      const Point first = centre + m.radius[0] * Point(std::cos(angle), std::sin(angle));
      const double c = std::cos(t * turn), s = std::sin(t * turn);
      const Point third =
          moved + Point(c * spoke.x() - s * spoke.y(), s * spoke.x() + c * spoke.y());
      REQUIRE((p - first).norm() <= spread + 1e-9);
      REQUIRE((p - third).norm() <= spread + 1e-9);
      most = std::max(most, (p - third).norm() / spread);
    }
  }
  CHECK(most > 0.2);
}
