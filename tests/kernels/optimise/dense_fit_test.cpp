#include "kernels/optimise/dense_fit.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "kernels/core/contract.h"

using namespace smoothpost;

namespace {

constexpr double kRadius = 20.0;

/// Points on a circle whose tool leans outwards and nods, rounded to `grid` mm.
std::vector<DenseNode> circle_nodes(int count, double step, double grid) {
  std::vector<DenseNode> nodes;
  for (int i = 0; i < count; ++i) {
    const double angle = i * step / kRadius;
    DenseNode node;
    node.tip = {kRadius * std::cos(angle), kRadius * std::sin(angle), 0.3 * std::sin(2.0 * angle)};
    if (grid > 0.0)
      for (int k = 0; k < 3; ++k) node.tip[k] = grid * std::round(node.tip[k] / grid);
    node.rotation = Eigen::AngleAxisd(angle, Vec3::UnitZ()) *
                    Eigen::AngleAxisd(0.2 + 0.1 * std::sin(angle), Vec3::UnitY());
    node.sigma = i == 0 ? 0.0 : nodes.back().sigma + (node.tip - nodes.back().tip).norm();
    nodes.push_back(node);
  }
  return nodes;
}

/// Straight on from one node to another: what a leg beside the curve is like.
PoseDerivatives straight(const DenseNode& from, const DenseNode& to, const DenseNode& at) {
  PoseDerivatives d;
  const double length = to.sigma - from.sigma;
  d.tip = {at.tip, (to.tip - from.tip) / length, Vec3::Zero(), Vec3::Zero()};
  const Vec3 rate =
      rotation_log(from.rotation.toRotationMatrix().transpose() * to.rotation.toRotationMatrix()) /
      length;
  // d/dσ of q·exp(σ·rate/2), three times.
  Eigen::Quaterniond q = at.rotation;
  const Eigen::Quaterniond half(0.0, rate.x() / 2.0, rate.y() / 2.0, rate.z() / 2.0);
  for (std::size_t r = 0; r < 4; ++r) {
    d.rotation[r] << q.w(), q.vec();
    q = q * half;
  }
  return d;
}

/// The middle of the way between two nodes.
DenseNode middle(const DenseNode& a, const DenseNode& b) {
  return {0.5 * (a.tip + b.tip), a.rotation.slerp(0.5, b.rotation), 0.5 * (a.sigma + b.sigma)};
}

struct Fitted {
  std::vector<DenseNode> nodes;
  PoseDerivatives start, end;
  std::optional<DenseFit> fit;
};

/// From the middle of the first leg to the middle of the last.
Fitted fitted(std::vector<DenseNode> nodes, const DenseSettings& settings) {
  Fitted out;
  const std::size_t n = nodes.size();
  const DenseNode first = middle(nodes[0], nodes[1]), last = middle(nodes[n - 2], nodes[n - 1]);
  out.start = straight(nodes[0], nodes[1], first);
  out.end = straight(nodes[n - 2], nodes[n - 1], last);
  out.nodes.push_back(first);
  out.nodes.insert(out.nodes.end(), nodes.begin() + 1, nodes.end() - 1);
  out.nodes.push_back(last);
  out.fit = fit_dense(out.nodes, out.start, out.end, settings);
  return out;
}

/// The polyline's pose at the same σ.
Pose on_polyline(const std::vector<DenseNode>& nodes, double sigma) {
  std::size_t i = 1;
  while (i + 1 < nodes.size() && nodes[i].sigma < sigma) ++i;
  const DenseNode& a = nodes[i - 1];
  const DenseNode& b = nodes[i];
  const double t = std::clamp((sigma - a.sigma) / (b.sigma - a.sigma), 0.0, 1.0);
  Pose pose = Pose::Identity();
  pose.translation() = a.tip + t * (b.tip - a.tip);
  pose.linear() = a.rotation.slerp(t, b.rotation).toRotationMatrix();
  return pose;
}

}  // namespace

TEST_CASE("dense_fit: stays within the tolerances at equal parameter", "[kernels][optimise]") {
  for (const bool whole : {false, true})
    for (const double grid : {0.0, 1e-3}) {
      INFO("whole " << whole << " grid " << grid);
      const DenseSettings settings{0.005, 0.0004, whole};
      const Fitted f = fitted(circle_nodes(120, 0.4, grid), settings);
      REQUIRE(f.fit);
      const PoseCurve& curve = f.fit->curve;
      double sigma = f.nodes.front().sigma;
      double tip = 0.0, turn = 0.0;
      for (std::size_t span = 0; span < curve.spans(); ++span) {
        CHECK(std::abs(sigma + curve.length(span) - f.nodes[f.fit->ends[span]].sigma) < 1e-9);
        for (int i = 0; i <= 37; ++i) {
          const double x = curve.length(span) * i / 37;
          const Pose got = curve.at(span, x), wanted = on_polyline(f.nodes, sigma + x);
          tip = std::max(tip, (got.translation() - wanted.translation()).norm());
          turn =
              std::max(turn, whole ? rotation_log(wanted.linear().transpose() * got.linear()).norm()
                                   : angle_between(wanted.linear().col(2), got.linear().col(2)));
        }
        sigma += curve.length(span);
      }
      CHECK(f.fit->ends.back() + 1 == f.nodes.size());
      CHECK(tip <= settings.tip_tolerance * 1.001);
      CHECK(turn <= settings.rotation_tolerance * 1.001);
      CHECK(tip > 1e-6);
    }
}

TEST_CASE("dense_fit: begins and ends like the legs beside it", "[kernels][optimise]") {
  const Fitted f = fitted(circle_nodes(60, 0.4, 1e-4), {0.005, 0.0004, false});
  REQUIRE(f.fit);
  const PoseCurve& curve = f.fit->curve;
  const PoseDerivatives first = curve.derivatives(0, 0.0);
  const PoseDerivatives last =
      curve.derivatives(curve.spans() - 1, curve.length(curve.spans() - 1));
  for (std::size_t r = 0; r < 4; ++r) {
    INFO("derivative " << r);
    CHECK((first.tip[r] - f.start.tip[r]).norm() < 1e-7);
    CHECK((last.tip[r] - f.end.tip[r]).norm() < 1e-7);
    const auto turned = [](const Eigen::Vector4d& a, const Eigen::Vector4d& b) {
      return std::min((a - b).norm(), (a + b).norm());
    };
    CHECK(turned(first.rotation[r], f.start.rotation[r]) < 1e-7);
    CHECK(turned(last.rotation[r], f.end.rotation[r]) < 1e-7);
  }
}

TEST_CASE("dense_fit: a circle's points give its curvature", "[kernels][optimise]") {
  for (const double grid : {0.0, 1e-3}) {
    INFO("grid " << grid);
    const Fitted f = fitted(circle_nodes(200, 0.4, grid), {0.005, 0.0004, false});
    REQUIRE(f.fit);
    const PoseCurve& curve = f.fit->curve;
    // Away from the straight legs at the ends.
    for (std::size_t span = 8; span + 8 < curve.spans(); ++span)
      for (const double t : {0.0, 0.3, 0.6}) {
        const auto d = curve.derivatives(span, t * curve.length(span));
        const double bend = d.tip[1].cross(d.tip[2]).norm() / std::pow(d.tip[1].norm(), 3);
        CHECK(bend == Approx(1.0 / kRadius).epsilon(0.05));
      }
  }
}

TEST_CASE("dense_fit: derivatives are those of the poses and bends are bounded",
          "[kernels][optimise]") {
  const Fitted f = fitted(circle_nodes(60, 0.9, 0.0), {0.02, 0.002, false});
  REQUIRE(f.fit);
  const PoseCurve& curve = f.fit->curve;
  for (std::size_t span = 0; span < curve.spans(); ++span) {
    const double h = 1e-4 * curve.length(span);
    for (const double t : {0.2, 0.5, 0.8}) {
      const double x = t * curve.length(span);
      const auto before = curve.derivatives(span, x - h), here = curve.derivatives(span, x),
                 after = curve.derivatives(span, x + h);
      for (std::size_t r = 0; r < 3; ++r) {
        const Vec3 tip = (after.tip[r] - before.tip[r]) / (2.0 * h);
        CHECK((tip - here.tip[r + 1]).norm() < 1e-4 * (1.0 + here.tip[r + 1].norm()));
        const Eigen::Vector4d q = (after.rotation[r] - before.rotation[r]) / (2.0 * h);
        CHECK((q - here.rotation[r + 1]).norm() < 1e-4 * (1.0 + here.rotation[r + 1].norm()));
      }
      CHECK(here.tip[2].norm() <= curve.bend_bound(span).tip * (1.0 + 1e-9));
      const Vec3 bend =
          (curve.at(span, x + h).linear().col(2) - 2.0 * curve.at(span, x).linear().col(2) +
           curve.at(span, x - h).linear().col(2)) /
          (h * h);
      CHECK(bend.norm() <= curve.bend_bound(span).axis * (1.0 + 1e-3) + 1e-5);
    }
  }
}

TEST_CASE("dense_fit: kept nodes end a span and an impossible polyline has no curve",
          "[kernels][optimise]") {
  auto nodes = circle_nodes(60, 0.4, 0.0);
  nodes[21].keep = true;
  const Fitted f = fitted(nodes, {0.005, 0.0004, false});
  REQUIRE(f.fit);
  CHECK(std::count(f.fit->ends.begin(), f.fit->ends.end(), 21u) == 1);

  auto pinned = circle_nodes(60, 0.4, 0.01);
  pinned[21].exact = pinned[21].keep = true;
  const auto through = fit_dense(pinned, {}, {}, {0.02, 0.001, false});
  REQUIRE(through);
  const auto ends = through->ends;
  const auto span =
      static_cast<std::size_t>(std::find(ends.begin(), ends.end(), 21u) - ends.begin());
  const Pose at = through->curve.at(span, through->curve.length(span));
  CHECK((at.translation() - pinned[21].tip).norm() < 1e-8);
  CHECK(angle_between(at.linear().col(2), pinned[21].rotation * Vec3::UnitZ()) < 1e-8);

  auto bent = circle_nodes(60, 0.4, 0.0);
  for (std::size_t i = 30; i < bent.size(); ++i)
    bent[i].tip.z() += 0.3 * (bent[i].sigma - bent[30].sigma);
  CHECK_FALSE(fitted(bent, {0.005, 0.0004, false}).fit);
  CHECK(dense_bulge(bent[29], bent[30], bent[31], {0.005, 0.0004, false}) > 1.0);
  // 20 mm of radius and legs of 0.4 mm: l²/(8R) = 1 µm, of 5.
  CHECK(dense_bulge(bent[9], bent[10], bent[11], {0.005, 1.0, false}) == Approx(0.2).epsilon(0.05));
}
