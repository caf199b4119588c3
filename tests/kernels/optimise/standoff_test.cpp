#include "kernels/optimise/standoff.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <sstream>

#include "kernels/core/contract.h"
#include "kernels/qp/quadratic_program.h"
#include "tests/kernels/kinematics/reference_machines.h"

using namespace smoothpost;
using test::Random;

namespace {

/// qp_q6 of paper_b.json, in its own unit (m): tip and rotaries of 11 pieces, L0 = 0.2.
struct Golden {
  HeadGeometry head = *HeadGeometry::from(test::laser(0.2));
  SplineCurve tip{clamped_knots(5, 11), Eigen::MatrixXd(3, 16)};
  SplineCurve rotary{clamped_knots(5, 11), Eigen::MatrixXd(2, 16)};
  StandoffOptions settings;

  Golden() {
    rotary.controls.row(0) << 0.3, 0.3798667333174625, 0.5364161653290717, 0.7517139787160283,
        0.9731767878463173, 1.0979959892832436, 1.0274379414605455, 0.7787777152831652,
        0.41289600644789376, 0.019373417848304098, -0.30544199624634266, -0.48202409413207764,
        -0.48596209009946606, -0.4067637245761226, -0.31821159004478977, -0.2644322604563136;
    rotary.controls.row(1) << 1.2, 1.1990405118907859, 1.1914013924556088, 1.1660984768337852,
        1.1090120128041496, 1.008707326343002, 0.8912401433096134, 0.7751559490358573,
        0.6787818853376263, 0.6173332977994026, 0.6005115672615742, 0.630972475099756,
        0.6863901850805071, 0.7425832800577961, 0.7852809246861959, 0.8078001390064742;
    tip.controls.row(0) << 0.0, 0.002, 0.006, 0.012, 0.02, 0.03, 0.04, 0.05, 0.06, 0.07, 0.08, 0.09,
        0.098, 0.10400000000000001, 0.10800000000000001, 0.11;
    tip.controls.row(1) << 0.0, 0.0004788488291556775, 0.0014090969331003599, 0.0026375386878858924,
        0.0037281563438689054, 0.003895390523512781, 0.0027018527222046037, 0.0005644800322394688,
        -0.0017700817731794083, -0.003486303089654353, -0.003984658435343363,
        -0.0030910579502239507, -0.0015694008959658155, -0.00017268754083491473,
        0.000782186060402177, 0.0012461654540535114;
    tip.controls.row(2) << 0.002, 0.001990008330556052, 0.001910672978251212, 0.0016506712298193567,
        0.0010806046117362795, 0.0001414744033354058, -0.0008322936730942849,
        -0.0016022872310938673, -0.001979984993200891, -0.0018729133745815927,
        -0.0013072872417272238, -0.0004215915988615594, 0.0003730247388451515,
        0.0009370333426007543, 0.0012693857518852694, 0.00141733954858252;
    settings.lower = -0.1;
    settings.upper = 0.02;
    settings.pull = 0.0;
    settings.rest_at_ends = false;
  }
};

constexpr double kGoldenOptimum = 0.0007003455924960878;
constexpr double kGoldenHeld = 0.001763517644140598;
constexpr std::array<double, 16> kGoldenStandoff = {
    0.0018347636046242603, 0.007449583929871464, 0.015522233326833782, 0.02,
    0.017664520480255134,  0.012973433261815994, 0.015532289790535048, 0.02,
    0.019999999999982917,  0.013256033779225209, 0.004681723470742745, 0.0015095202250655258,
    0.006638701970705766,  0.01348430530360226,  0.018013415830073508, 0.02};

/// Control points of the quintic that takes the values of f at the Greville places.
Eigen::RowVectorXd controls_through(const SplineKnots& knots,
                                    const std::function<double(double)>& f) {
  const SplineLayout layout = spline_layout(knots, 3, 1);
  const int n = knots.controls();
  Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd values(n);
  for (int j = 0; j < n; ++j) {
    const double u = layout.place(0, j);
    const BasisRow row = bspline_basis(knots, u);
    basis.row(j).segment(row.first, row.weights.size()) = row.weights.transpose();
    values[j] = f(u);
  }
  return basis.partialPivLu().solve(values).transpose();
}

/// A stretch of a program with its head.
struct Stretch {
  ScrewChain chain;
  HeadGeometry head;
  SplineCurve tip;
  SplineCurve rotary;

  LinearsByStandoff linears(double u) const {
    VectorJet tip_jet;
    Jet q4;
    Jet q5;
    for (int r = 0; r < 4; ++r) {
      tip_jet.col(r) = tip.at(u, r);
      q4[r] = rotary.at(u, r)[0];
      q5[r] = rotary.at(u, r)[1];
    }
    return linears_by_standoff(head, tip_jet, q4, q5);
  }
  /// The linears with derivatives.
  VectorJet joints(double u, const SplineCurve& q6) const {
    static constexpr double kBinomial[4][4] = {
        {1, 0, 0, 0}, {1, 1, 0, 0}, {1, 2, 1, 0}, {1, 3, 3, 1}};
    const LinearsByStandoff l = linears(u);
    VectorJet q = l.a;
    for (int r = 0; r < 4; ++r)
      for (int s = 0; s <= r; ++s) q.col(r) += kBinomial[r][s] * q6.at(u, s)[0] * l.b.col(r - s);
    return q;
  }
  /// Σ ∫ (q_i''')² du by Simpson's rule.
  double jerk_integral(const SplineCurve& q6) const {
    const int n = 40 * rotary.knots.spans();
    const double h = (rotary.knots.last() - rotary.knots.first()) / n;
    double sum = 0.0;
    for (int i = 0; i <= n; ++i)
      sum += (i == 0 || i == n ? 1.0 : (i % 2 == 1 ? 4.0 : 2.0)) *
             joints(rotary.knots.first() + h * i, q6).col(3).squaredNorm();
    return sum * h / 3.0;
  }
  SplineCurve held(double q6) const {
    return {rotary.knots, Eigen::MatrixXd::Constant(1, rotary.knots.controls(), q6)};
  }
};

/// How the solver ended, for a test that fails.
std::string told(const StandoffResult& result) {
  const QpSolution& s = result.solution;
  std::ostringstream out;
  out << to_string(s.status) << " after " << s.iterations << " iterations; stationarity "
      << s.certificate.stationarity << ", violation " << s.certificate.violation
      << ", complementarity " << s.certificate.complementarity << ", sign " << s.certificate.sign
      << " " << s.message << "; shortfall " << result.feasibility.shortfall;
  return out.str();
}

/// 4 mm of tip a piece, rotaries that swing.
Stretch random_stretch(Random& random, int pieces) {
  Stretch stretch{test::laser(random.below(2) == 0 ? 0.0 : 200.0), {}, {}, {}};
  if (random.below(2) == 0) stretch.chain.joints[4].origin = Vec3(30.0, 0.0, 0.0);
  stretch.chain.workpiece_home.translation() = 100.0 * random.unit();
  stretch.head = *HeadGeometry::from(stretch.chain);
  const SplineKnots knots = clamped_knots(5, pieces);
  const auto wave = [&](double size, double slope) {
    const double rate = random.between(0.1, 0.25);
    const double phase = random.between(-3.0, 3.0);
    return controls_through(
        knots, [=](double u) { return slope * u + size * std::sin(rate * u + phase); });
  };
  stretch.tip = {knots, Eigen::MatrixXd(3, knots.controls())};
  stretch.rotary = {knots, Eigen::MatrixXd(2, knots.controls())};
  stretch.tip.controls.row(0) = wave(10.0, 3.5);
  stretch.tip.controls.row(1) = wave(10.0, 2.0);
  stretch.tip.controls.row(2) = wave(5.0, 0.0);
  stretch.rotary.controls.row(0) = wave(0.6, 0.0);
  stretch.rotary.controls.row(1) = wave(0.4, 0.01);
  return stretch;
}

RateLimits by_piece(const RateLimits& limits, double rate) {
  return {limits.velocity / rate, limits.acceleration / (rate * rate),
          limits.jerk / (rate * rate * rate)};
}

/// Table 2 of paper B (mm, s) at that many pieces a second, with the reserve taken off.
StandoffOptions table_limits(double rate, double reserve = 0.0) {
  StandoffOptions settings;
  settings.lower = -100.0 + reserve;
  settings.upper = 20.0 - reserve;
  settings.standoff = by_piece({2000.0, 40000.0, 400000.0}, rate);
  settings.linear.fill(by_piece({2000.0, 12000.0, 120000.0}, rate));
  return settings;
}

StandoffOptions slowed(StandoffOptions settings, double t) {
  settings.standoff = by_piece(settings.standoff, 1.0 / t);
  for (RateLimits& limits : settings.linear) limits = by_piece(limits, 1.0 / t);
  return settings;
}

/// Largest ratio of derivative to limit on a dense grid.
struct Ratios {
  double range = 0.0;     ///< by how much q6 leaves its range, mm
  double standoff = 0.0;  ///< of q6
  double linear = 0.0;    ///< of q1 … q3
};

Ratios ratios(const Stretch& stretch, const SplineCurve& q6, const StandoffOptions& settings) {
  Ratios worst;
  const int n = 24 * stretch.rotary.knots.spans();
  for (int i = 0; i <= n; ++i) {
    const double u = stretch.rotary.knots.last() * i / n;
    const VectorJet q = stretch.joints(u, q6);
    const auto ratio = [](const RateLimits& limits, double v, double a, double j) {
      return std::max({std::abs(v) / limits.velocity, std::abs(a) / limits.acceleration,
                       std::abs(j) / limits.jerk});
    };
    for (int k = 0; k < 3; ++k)
      worst.linear = std::max(worst.linear, ratio(settings.linear[k], q(k, 1), q(k, 2), q(k, 3)));
    worst.standoff = std::max(
        worst.standoff, ratio(settings.standoff, q6.at(u, 1)[0], q6.at(u, 2)[0], q6.at(u, 3)[0]));
    worst.range =
        std::max({worst.range, q6.at(u)[0] - settings.upper, settings.lower - q6.at(u)[0]});
  }
  return worst;
}

/// Upright head whose tip runs along x as f; the standoff moves z alone.
Stretch upright(const std::function<double(double)>& f) {
  Stretch stretch{test::laser(200.0), {}, {}, {}};
  stretch.head = *HeadGeometry::from(stretch.chain);
  const SplineKnots knots = clamped_knots(5, 12);
  stretch.tip = {knots, Eigen::MatrixXd::Zero(3, knots.controls())};
  stretch.tip.controls.row(0) = controls_through(knots, f);
  stretch.rotary = {knots, Eigen::MatrixXd::Zero(2, knots.controls())};
  return stretch;
}

constexpr double kCaseLength = 627.5;  // mm

/// Case 2 of the shared reference: the rotaries of the cone programme and a least-squares quintic
/// of 157 control points through the tips.
std::optional<Stretch> case2(double l0) {
  const auto rotaries = test::shared_path("reference/case2_cone_controls.csv");
  const auto points = test::shared_path("reference/case2.csv");
  if (!rotaries || !points) return std::nullopt;
  Stretch stretch{test::laser(l0), {}, {}, {}};
  stretch.head = *HeadGeometry::from(stretch.chain);
  const auto angles = test::number_table(*rotaries);
  const int n = static_cast<int>(angles.size());
  stretch.rotary = {clamped_knots(5, n - 5), Eigen::MatrixXd(2, n)};
  for (int j = 0; j < n; ++j) stretch.rotary.controls.col(j) << angles[j][0], angles[j][1];
  const auto tips = test::number_table(*points);
  const int count = static_cast<int>(tips.size());
  SplineKnots knots = clamped_knots(5, 152);
  for (double& u : knots.values)
    u = u == 152.0 ? stretch.rotary.knots.last() : u * stretch.rotary.knots.last() / 152.0;
  Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(count, knots.controls());
  Eigen::MatrixXd values(count, 3);
  for (int i = 0; i < count; ++i) {
    const BasisRow row = bspline_basis(knots, knots.last() * i / (count - 1));
    basis.row(i).segment(row.first, row.weights.size()) = row.weights.transpose();
    values.row(i) << tips[i][0], tips[i][1], tips[i][2];
  }
  const Eigen::MatrixXd normal = basis.transpose() * basis;
  stretch.tip = {knots, normal.ldlt().solve(basis.transpose() * values).transpose()};
  return stretch;
}

}  // namespace

TEST_CASE("standoff: golden programme of paper B", "[kernels][optimise][paper]") {
  Golden golden;
  const StandoffResult result =
      optimise_standoff(golden.head, golden.tip, golden.rotary, golden.settings);
  INFO(to_string(result.solution.status)
       << " " << result.solution.certificate.kkt() << " " << result.solution.iterations);
  INFO(told(result));
  REQUIRE(result.solution.status == QpStatus::optimal);
  // theirs has the factor 1/2
  CHECK(result.solution.objective / 2.0 == Approx(kGoldenOptimum).epsilon(1e-9).margin(0.0));
  double worst = 0.0;
  for (int j = 0; j < 16; ++j)
    worst = std::max(worst, std::abs(result.q6.controls(0, j) - kGoldenStandoff[j]));
  CHECK(worst < 1e-6);
  CAPTURE(worst);
}

TEST_CASE("standoff: limits hold on a dense grid", "[kernels][optimise]") {
  Random random(81);
  Ratios worst;
  double kkt = 0.0;
  for (int n = 0; n < 12; ++n) {
    const Stretch stretch = random_stretch(random, 40);
    const StandoffOptions table = table_limits(120.0);
    // tight: 3 % slower than can be at all
    const StandoffTimeFactor least =
        least_standoff_time(stretch.head, stretch.tip, stretch.rotary, table);
    REQUIRE(least.found);
    const StandoffOptions settings = slowed(table, 1.03 * least.factor);
    const StandoffResult result =
        optimise_standoff(stretch.head, stretch.tip, stretch.rotary, settings);
    INFO(told(result));
    REQUIRE(result.solution.status == QpStatus::optimal);
    kkt = std::max(kkt, result.solution.certificate.kkt());
    const Ratios here = ratios(stretch, result.q6, settings);
    worst.range = std::max(worst.range, here.range);
    worst.standoff = std::max(worst.standoff, here.standoff);
    worst.linear = std::max(worst.linear, here.linear);
    for (const double end : {0.0, stretch.rotary.knots.last()})
      for (const int order : {1, 2}) CHECK(std::abs(result.q6.at(end, order)[0]) < 1e-9);
  }
  CHECK(kkt < 1e-8);
  CHECK(worst.range < 1e-6);
  CHECK(worst.standoff < 1.0 + 1e-6);
  CHECK(worst.linear <= 1.0);
  CHECK(worst.linear > 0.97);  // or the limits were not tight
}

TEST_CASE("standoff: the tip stays whatever q6 is", "[kernels][optimise]") {
  Random random(82);
  double worst = 0.0;
  for (int n = 0; n < 6; ++n) {
    const Stretch stretch = random_stretch(random, 30);
    const StandoffResult result =
        optimise_standoff(stretch.head, stretch.tip, stretch.rotary, table_limits(15.0));
    INFO(told(result));
    REQUIRE(result.solution.status == QpStatus::optimal);
    for (int i = 0; i < 200; ++i) {
      const double u = random.between(0.0, 30.0);
      const SplineCurve q6 = i % 2 == 0 ? result.q6 : stretch.held(random.between(-100.0, 20.0));
      const Vec3 linears = stretch.joints(u, q6).col(0);
      JointVector q(6);
      q << linears, stretch.rotary.at(u), q6.at(u);
      const CutterLocation location = forward_location(stretch.chain, q);
      worst = std::max(worst, (location.tip - stretch.tip.at(u)).norm());
    }
  }
  CHECK(worst < 1e-9);
}

TEST_CASE("standoff: not above the held standoff", "[kernels][optimise]") {
  Random random(83);
  for (int n = 0; n < 8; ++n) {
    const Stretch stretch = random_stretch(random, 30);
    const StandoffResult result =
        optimise_standoff(stretch.head, stretch.tip, stretch.rotary, table_limits(8.0));
    INFO(told(result));
    REQUIRE(result.solution.status == QpStatus::optimal);
    CHECK(result.jerk_before == Approx(stretch.jerk_integral(stretch.held(-40.0))).epsilon(1e-5));
    CHECK(result.jerk_after == Approx(stretch.jerk_integral(result.q6)).epsilon(1e-5));
    for (const double held : {-100.0, -40.0, 0.0, 20.0})
      CHECK(result.jerk_after <= stretch.jerk_integral(stretch.held(held)) * (1.0 + 1e-5));
    CHECK(result.solution.objective >= result.jerk_after);
  }
}

TEST_CASE("standoff: ends that are given", "[kernels][optimise]") {
  Random random(84);
  const Stretch stretch = random_stretch(random, 40);
  StandoffOptions settings = table_limits(10.0);
  settings.fixed_start = settings.fixed_end = true;
  settings.start = 3.0;
  settings.end = -20.0;
  const StandoffResult result =
      optimise_standoff(stretch.head, stretch.tip, stretch.rotary, settings);
  INFO(told(result));
  REQUIRE(result.solution.status == QpStatus::optimal);
  CHECK(std::abs(result.q6.at(0.0)[0] - 3.0) < 1e-9);
  CHECK(std::abs(result.q6.at(40.0)[0] + 20.0) < 1e-9);
  CHECK(result.jerk_before == Approx(stretch.jerk_integral(stretch.held(3.0))).epsilon(1e-5));
}

TEST_CASE("standoff: bounds at places hold there", "[kernels][optimise]") {
  Random random(85);
  const Stretch stretch = random_stretch(random, 40);
  StandoffOptions settings = table_limits(10.0);
  const StandoffResult before =
      optimise_standoff(stretch.head, stretch.tip, stretch.rotary, settings);
  REQUIRE(before.solution.status == QpStatus::optimal);
  const double here = before.q6.at(12.3)[0], there = before.q6.at(31.0)[0];
  // Both towards the middle of the range.
  const double up = here < -40.0 ? 1.0 : -1.0, down = there < -40.0 ? 1.0 : -1.0;
  const auto at_least = [](double u, double side, double value) {
    StandoffBound b;
    b.u = u;
    (side > 0.0 ? b.lower : b.upper) = value;
    return b;
  };
  settings.bounds = {at_least(31.0, down, there + 5.0 * down), at_least(12.3, up, here + 4.0 * up)};
  const StandoffResult after =
      optimise_standoff(stretch.head, stretch.tip, stretch.rotary, settings);
  INFO(told(after));
  REQUIRE(after.solution.status == QpStatus::optimal);
  CHECK(up * (after.q6.at(12.3)[0] - here) >= 4.0 - 1e-6);
  CHECK(down * (after.q6.at(31.0)[0] - there) >= 5.0 - 1e-6);
  CHECK(after.jerk_after >= before.jerk_after);
  // Two that are too close together for the jerk limit need more time.
  settings.bounds = {{.u = 20.0, .upper = -80.0}, {.u = 20.5, .lower = 0.0}};
  const StandoffTimeFactor time =
      least_standoff_time(stretch.head, stretch.tip, stretch.rotary, settings);
  CHECK((!time.found || time.factor > 1.0));
  settings.bounds = {{.u = 20.0, .lower = 5.0, .upper = 4.0}};
  CHECK_THROWS_AS(optimise_standoff(stretch.head, stretch.tip, stretch.rotary, settings),
                  ContractViolation);
}

TEST_CASE("standoff: constant tool axis", "[kernels][optimise]") {
  // D of Eq. (53) is singular here: any parabola of q6 is as smooth.
  const Stretch straight = upright([](double u) { return 4.0 * u; });
  const StandoffResult still =
      optimise_standoff(straight.head, straight.tip, straight.rotary, table_limits(10.0, 5.0));
  INFO(told(still));
  REQUIRE(still.solution.status == QpStatus::optimal);
  CHECK((still.q6.controls.array() + 40.0).abs().maxCoeff() < 1e-3);
  CHECK(still.jerk_after < 1e-9);

  Stretch wavy = upright([](double u) { return 4.0 * u; });
  wavy.tip.controls.row(2) =
      controls_through(wavy.tip.knots, [](double u) { return 8.0 * std::sin(0.5 * u); });
  const StandoffResult result =
      optimise_standoff(wavy.head, wavy.tip, wavy.rotary, table_limits(10.0, 5.0));
  INFO(told(result));
  REQUIRE(result.solution.status == QpStatus::optimal);
  CHECK(result.jerk_after < 0.9 * result.jerk_before);
}

TEST_CASE("standoff: limits that cannot be kept are named", "[kernels][optimise]") {
  const Stretch stretch = upright([](double u) { return 0.05 * u * u * u; });  // x''' = 0.3
  StandoffOptions settings = table_limits(1.0);
  settings.linear[0].jerk = 0.1;
  const StandoffResult result =
      optimise_standoff(stretch.head, stretch.tip, stretch.rotary, settings);
  CHECK(result.solution.status == QpStatus::infeasible);
  CHECK_FALSE(result.feasibility.feasible);
  CHECK(result.feasibility.name == "jerk of the first linear");
  CHECK(result.feasibility.shortfall == Approx(2.0 / 3.0).epsilon(1e-4));  // 0.3 = 0.1 (1 + 3 tau)
  CHECK((result.q6.controls.array() == -40.0).all());
  CHECK(result.jerk_after == result.jerk_before);
}

TEST_CASE("standoff: time factor in closed form", "[kernels][optimise]") {
  struct Case {
    std::function<double(double)> path;
    RateLimits limits;
    double factor;
    int derivative;
  };
  const double none = std::numeric_limits<double>::infinity();
  const std::vector<Case> cases = {
      {[](double u) { return 4.0 * u; }, {0.5, none, none}, 8.0, 1},
      {[](double u) { return 2.0 * u * u; }, {none, 0.5, none}, std::sqrt(8.0), 2},
      {[](double u) { return 0.05 * u * u * u; }, {none, none, 0.01}, std::cbrt(30.0), 3},
      {[](double u) { return 0.05 * u * u * u; }, {none, 1.0, 0.2}, std::sqrt(3.6), 2}};
  for (const Case& c : cases) {
    const Stretch stretch = upright(c.path);
    StandoffOptions settings = table_limits(10.0);
    settings.linear.fill(c.limits);
    const StandoffTimeFactor factor =
        least_standoff_time(stretch.head, stretch.tip, stretch.rotary, settings);
    REQUIRE(factor.found);
    CHECK(factor.factor == Approx(c.factor).epsilon(1e-4));
    CHECK(factor.joint == 0);
    CHECK(factor.derivative == c.derivative);
    CHECK(factor.solves <= 8);
    if (c.derivative == 2 && c.limits.jerk < none) CHECK(factor.place == Approx(12.0));
  }
  const Stretch easy = upright([](double u) { return u; });
  const StandoffTimeFactor one =
      least_standoff_time(easy.head, easy.tip, easy.rotary, table_limits(10.0));
  CHECK(one.found);
  CHECK(one.factor == 1.0);
  CHECK(one.joint == -1);
}

TEST_CASE("standoff: the time factor is the least", "[kernels][optimise]") {
  Random random(85);
  int slow = 0;
  for (int n = 0; n < 6; ++n) {
    const Stretch stretch = random_stretch(random, 30);
    StandoffOptions settings = table_limits(200.0);
    settings.fixed_start = settings.fixed_end = n % 2 == 0;  // then q6 itself has to move
    settings.start = -90.0;
    settings.end = 15.0;
    const StandoffTimeFactor least =
        least_standoff_time(stretch.head, stretch.tip, stretch.rotary, settings);
    REQUIRE(least.found);
    const auto status = [&](double t) {
      return optimise_standoff(stretch.head, stretch.tip, stretch.rotary, slowed(settings, t))
          .solution.status;
    };
    CHECK(status(least.factor * 1.005) == QpStatus::optimal);
    if (least.factor > 1.0) CHECK(status(least.factor * (1.0 - 1e-4)) == QpStatus::infeasible);
    slow += least.factor > 1.0 ? 1 : 0;
  }
  CHECK(slow >= 4);
}

TEST_CASE("standoff: Ipopt finds the same optimum", "[kernels][optimise][paper]") {
  Golden golden;
  golden.settings.solver.solver = QpSolver::ipopt;
  golden.settings.solver.tolerance = 1e-9;
  const StandoffResult result =
      optimise_standoff(golden.head, golden.tip, golden.rotary, golden.settings);
  INFO(told(result));
  REQUIRE(result.solution.status == QpStatus::optimal);
  CHECK(result.solution.objective / 2.0 == Approx(kGoldenOptimum).epsilon(1e-8).margin(0.0));
}

TEST_CASE("standoff: jerk of the linears of Case 2", "[kernels][optimise][paper]") {
  struct Case {
    double l0;
    double before, after;  // m/s3, combined rms of q1 … q3 at 10.8 m/min, held at q6 = 0
    double fall, fall_with_reserve;
  };
  for (const Case& c : {Case{0.0, 9.77, 2.785, 0.71, 0.65}, Case{200.0, 44.4, 28.37, 0.36, 0.33}}) {
    const auto stretch = case2(c.l0);
    if (!stretch) {
      WARN("no ../shared, not tested");
      return;
    }
    const double length = stretch->rotary.knots.last();
    const double rate = 180.0 * length / kCaseLength;
    const auto rms = [&](double integral) {
      return std::sqrt(integral / length) * std::pow(rate, 3) / 1000.0;
    };
    const double held = rms(stretch->jerk_integral(stretch->held(0.0)));
    CHECK(held == Approx(c.before).epsilon(0.01));
    for (const double reserve : {0.0, 5.0}) {
      const StandoffOptions settings = table_limits(rate, reserve);
      const StandoffResult result =
          optimise_standoff(stretch->head, stretch->tip, stretch->rotary, settings);
      INFO(told(result));
      REQUIRE(result.solution.status == QpStatus::optimal);
      const double after = rms(result.jerk_after);
      if (reserve == 0.0) {
        CHECK(after == Approx(c.after).epsilon(0.01));
        CHECK(1.0 - after / held == Approx(c.fall).margin(0.01));
      } else {
        CHECK(1.0 - after / held >= c.fall_with_reserve);
      }
      const Ratios here = ratios(*stretch, result.q6, settings);
      CHECK(here.linear < 1.005);
      CHECK(here.standoff < 1.0 + 1e-6);
      CHECK(here.range < 1e-6);
    }
  }
}

TEST_CASE("standoff: a constant law is the constant feed", "[kernels][optimise]") {
  Random random(31);
  for (int n = 0; n < 4; ++n) {
    const Stretch stretch = random_stretch(random, 20);
    const double rate = 50.0;
    StandoffOptions by_u = table_limits(rate, 5.0);
    by_u.standoff = {};
    by_u.linear.fill({});
    const StandoffResult plain = optimise_standoff(stretch.head, stretch.tip, stretch.rotary, by_u);
    StandoffOptions by_time = by_u;
    by_time.law = PathLaw{20.0 / rate, [rate](double) { return PathSpeed{rate, 0.0, 0.0}; }};
    const StandoffResult timed =
        optimise_standoff(stretch.head, stretch.tip, stretch.rotary, by_time);
    INFO(told(plain) << "\n" << told(timed));
    REQUIRE(plain.solution.status == QpStatus::optimal);
    REQUIRE(timed.solution.status == QpStatus::optimal);
    const double fifth = std::pow(rate, 5);
    CHECK(timed.jerk_before == Approx(plain.jerk_before * fifth));
    CHECK(timed.jerk_after == Approx(plain.jerk_after * fifth));
    for (int i = 0; i <= 40; ++i)
      CHECK(timed.q6.at(0.5 * i)[0] == Approx(plain.q6.at(0.5 * i)[0]).margin(1e-3));
  }
}

TEST_CASE("standoff: smooth in the time of a law", "[kernels][optimise]") {
  Random random(32);
  int tested = 0;
  for (int n = 0; n < 6; ++n) {
    const Stretch stretch = random_stretch(random, 20);
    StandoffOptions settings = table_limits(1.0, 5.0);
    const double last = 20.0;
    // from 30 to 70 pieces a second and back
    const auto speed = [](double u) {
      const double c = std::cos(0.3 * u), s = std::sin(0.3 * u);
      const double v = 50.0 - 20.0 * c, dv = 6.0 * s, ddv = 1.8 * c;
      return PathSpeed{v, v * dv, v * (dv * dv + v * ddv)};
    };
    double duration = 0.0;
    for (int k = 0; k < 2000; ++k) duration += last / 2000 / speed(last * (k + 0.5) / 2000).first;
    settings.law = PathLaw{duration, speed};
    const StandoffResult timed =
        optimise_standoff(stretch.head, stretch.tip, stretch.rotary, settings);
    if (timed.solution.status != QpStatus::optimal) continue;
    ++tested;
    // Σ ∫ (q⃛)² dt from the definition
    const auto integral = [&](const SplineCurve& q6) {
      double sum = 0.0;
      for (int k = 0; k < 4000; ++k) {
        const double u = last * (k + 0.5) / 4000;
        const PathSpeed p = speed(u);
        const VectorJet q = stretch.joints(u, q6);
        const Vec3 jerk = p.first * p.first * p.first * q.col(3) +
                          3.0 * p.first * p.second * q.col(2) + p.third * q.col(1);
        sum += last / 4000 / p.first * jerk.squaredNorm();
      }
      return sum;
    };
    CHECK(timed.jerk_after == Approx(integral(timed.q6)).epsilon(1e-3));
    CHECK(timed.jerk_after <= timed.jerk_before);
    const StandoffResult plain =
        optimise_standoff(stretch.head, stretch.tip, stretch.rotary, table_limits(30.0, 5.0));
    if (plain.solution.status == QpStatus::optimal)
      CHECK(timed.jerk_after <= integral(plain.q6) * (1.0 + 1e-3));
  }
  CHECK(tested >= 3);
}

TEST_CASE("standoff: preconditions", "[kernels][optimise]") {
  Random random(86);
  const Stretch stretch = random_stretch(random, 10);
  const auto refused = [&](const std::function<void(Stretch&, StandoffOptions&)>& change) {
    Stretch s = stretch;
    StandoffOptions settings = table_limits(10.0);
    change(s, settings);
    CHECK_THROWS_AS(optimise_standoff(s.head, s.tip, s.rotary, settings), ContractViolation);
    CHECK_THROWS_AS(least_standoff_time(s.head, s.tip, s.rotary, settings), ContractViolation);
  };
  refused([](Stretch& s, StandoffOptions&) { s.tip.controls.conservativeResize(2, 15); });
  refused([](Stretch& s, StandoffOptions&) { s.rotary.controls.conservativeResize(1, 15); });
  refused([](Stretch& s, StandoffOptions&) {
    s.rotary = {clamped_knots(3, 10), Eigen::MatrixXd::Zero(2, 13)};
  });
  refused([](Stretch& s, StandoffOptions&) {
    s.rotary = {clamped_knots(5, 9), Eigen::MatrixXd::Zero(2, 14)};
  });
  refused([](Stretch&, StandoffOptions& o) { o.lower = o.upper; });
  refused([](Stretch&, StandoffOptions& o) { o.rows_per_span = 0; });
  refused([](Stretch&, StandoffOptions& o) { o.pull = -1.0; });
  refused([](Stretch&, StandoffOptions& o) { o.regularisation = -1.0; });
  refused([](Stretch&, StandoffOptions& o) { o.standoff.jerk = 0.0; });
  refused([](Stretch&, StandoffOptions& o) { o.linear[1].velocity = 0.0; });
  refused([](Stretch&, StandoffOptions& o) {
    o.fixed_start = o.fixed_end = true;
    o.start = 21.0;
  });
}
