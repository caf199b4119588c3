#include "kernels/optimise/path_law.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "kernels/optimise/rotary_jerk.h"
#include "kernels/optimise/standoff.h"
#include "tests/kernels/kinematics/reference_machines.h"

using namespace smoothpost;

namespace {

/// u(t) = t + 0.4 sin t with its derivatives, and t of a u.
struct Swing {
  static double u(double t) { return t + 0.4 * std::sin(t); }
  static PathSpeed speed(double t) {
    return {1.0 + 0.4 * std::cos(t), -0.4 * std::sin(t), -0.4 * std::cos(t)};
  }
  static double t_of(double at) {
    double t = at;
    for (int k = 0; k < 60; ++k) t -= (u(t) - at) / speed(t).first;
    return t;
  }
};

/// 40 pieces that the law above runs in about 40 s.
PathLaw swinging(double last) {
  return {Swing::t_of(last), [](double u) { return Swing::speed(Swing::t_of(u)); }};
}

PathLaw constant(double rate, double last) {
  return {last / rate, [rate](double) { return PathSpeed{rate, 0.0, 0.0}; }};
}

/// Rotaries that turn by 0.6 rad and back within windows of 0.1 rad.
struct Turn {
  ScrewChain chain = test::laser();
  RotaryProblem problem;

  Turn() {
    problem.chain = &chain;
    problem.held = JointVector::Zero(6);
    problem.joints = {3, 4};
    problem.knots = clamped_knots(5, 40);
    problem.lower = {-6.0, -1.5};
    problem.upper = {6.0, 1.5};
    for (int i = 0; i <= 80; ++i) {
      OrientationWindow w;
      w.u = 0.5 * i;
      const double x = (w.u - 20.0) / 4.0;
      const double angle = 0.6 * std::exp(-x * x);
      const double c = std::cos(angle), s = std::sin(angle);
      w.normal = Vec3(std::sin(0.7), c * 0.0 + s * std::cos(0.7), c * std::cos(0.7));
      w.tangent = (Vec3::UnitX() - w.normal.x() * w.normal).normalized();
      w.binormal = w.normal.cross(w.tangent);
      w.lead_low = w.tilt_low = -0.1;
      w.lead_high = w.tilt_high = 0.1;
      problem.windows.push_back(w);
      problem.seed.push_back({std::atan2(w.normal.y(), w.normal.x()),
                              std::atan2(std::hypot(w.normal.x(), w.normal.y()), w.normal.z())});
    }
  }
};

RotarySettings banded() {
  RotarySettings s;
  s.hybrid = false;
  return s;
}

/// Σ ∫ (q⃛/limit)² dt over the time, by differences of the motion q(u(t)).
double mean_jerk_square(const SplineCurve& q, const PathLaw& law, double limit) {
  const int n = 20000;
  const double h = law.duration / n;
  double sum = 0.0;
  for (int i = 2; i + 2 <= n; ++i) {
    const double t = i * h, e = 1e-3;
    const auto at = [&](double time) {
      return Eigen::VectorXd(q.at(std::min(Swing::u(time), q.knots.last())));
    };
    const Eigen::VectorXd jerk =
        (at(t + 1.5 * e) - 3.0 * at(t + 0.5 * e) + 3.0 * at(t - 0.5 * e) - at(t - 1.5 * e)) /
        (e * e * e);
    sum += h * jerk.squaredNorm() / (limit * limit);
  }
  return sum / law.duration;
}

}  // namespace

TEST_CASE("path_law: derivatives by time of a motion are its differences", "[kernels][optimise]") {
  const auto q = [](double u) { return std::sin(0.7 * u) + 0.1 * u * u; };
  for (const double t : {0.3, 1.1, 2.9, 4.0}) {
    const double u = Swing::u(t);
    const double by_u[] = {0.7 * std::cos(0.7 * u) + 0.2 * u, -0.49 * std::sin(0.7 * u) + 0.2,
                           -0.343 * std::cos(0.7 * u)};
    const auto motion = [&](double time) { return q(Swing::u(time)); };
    const double h = 1e-2;
    const double m2 = motion(t - 2 * h), m1 = motion(t - h), m0 = motion(t), p1 = motion(t + h),
                 p2 = motion(t + 2 * h);
    const double by_time[] = {(m2 - 8 * m1 + 8 * p1 - p2) / (12 * h),
                              (-m2 + 16 * m1 - 30 * m0 + 16 * p1 - p2) / (12 * h * h),
                              (p2 - 2 * p1 + 2 * m1 - m2) / (2 * h * h * h)};
    for (int order = 1; order <= 3; ++order) {
      const TimeWeights w = time_weights(Swing::speed(t), order);
      CHECK(w.first * by_u[0] + w.second * by_u[1] + w.third * by_u[2] ==
            Approx(by_time[order - 1]).epsilon(1e-3));
    }
  }
}

TEST_CASE("path_law: a constant law is the constant feed", "[kernels][optimise]") {
  Turn turn;
  const double rate = 25.0;
  const RotaryResult plain = optimise_rotaries(turn.problem, banded());
  REQUIRE(plain.status == RotaryStatus::optimal);
  RotaryProblem timed = turn.problem;
  timed.law = constant(rate, 40.0);
  timed.limits.fill({10.0, 100.0, 100.0});
  const RotaryResult by_time = optimise_rotaries(timed, banded());
  REQUIRE(by_time.status == RotaryStatus::optimal);
  CHECK(by_time.solution.objective ==
        Approx(plain.solution.objective * std::pow(rate, 6) / (1e4 * 40.0)).epsilon(1e-3));
  for (int i = 0; i <= 80; ++i) CHECK((plain.q.at(0.5 * i) - by_time.q.at(0.5 * i)).norm() < 2e-3);
}

TEST_CASE("path_law: rotaries are smooth in time and keep their windows", "[kernels][optimise]") {
  Turn turn;
  const RotaryResult plain = optimise_rotaries(turn.problem, banded());
  REQUIRE(plain.status == RotaryStatus::optimal);
  RotaryProblem timed = turn.problem;
  timed.law = swinging(40.0);
  timed.limits.fill({10.0, 10.0, 10.0});
  const RotaryResult free = optimise_rotaries(timed, banded());
  REQUIRE(free.status == RotaryStatus::optimal);
  CHECK(free.solution.objective ==
        Approx(mean_jerk_square(free.q, *timed.law, 10.0)).epsilon(1e-2));
  CHECK(mean_jerk_square(free.q, *timed.law, 10.0) <
        0.99 * mean_jerk_square(plain.q, *timed.law, 10.0));
  JointVector joints = turn.problem.held;
  for (const OrientationWindow& w : turn.problem.windows) {
    joints[3] = free.q.at(w.u)[0];
    joints[4] = free.q.at(w.u)[1];
    CHECK(w.outside(forward_location(turn.chain, joints).axis) <= 1e-8);
  }
}
