#include "kernels/optimise/chain_fit.h"

#include <catch2/catch.hpp>
#include <random>

#include "kernels/core/contract.h"

using namespace smoothpost;
using Kind = FitParameter::Kind;

namespace {

ChainJoint linear(const Vec3& direction) {
  ChainJoint j;
  j.direction = direction;
  j.lower = -1000.0;
  j.upper = 1000.0;
  return j;
}

ChainJoint rotary(ChainSide side, const Vec3& direction, const Vec3& origin) {
  ChainJoint j;
  j.kind = JointKind::rotary;
  j.side = side;
  j.direction = direction.normalized();
  j.origin = origin;
  return j;
}

/// A trunnion whose rotary axes pass near the origin, or a fork head.
ScrewChain table(const Vec3& a, const Vec3& c) {
  ScrewChain chain;
  chain.joints = {linear(Vec3::UnitX()), linear(Vec3::UnitY()), linear(Vec3::UnitZ()),
                  rotary(ChainSide::workpiece, Vec3::UnitX(), a),
                  rotary(ChainSide::workpiece, Vec3::UnitZ(), c)};
  return chain;
}
ScrewChain head(double pivot) {
  ScrewChain chain;
  chain.joints = {linear(Vec3::UnitX()), linear(Vec3::UnitY()), linear(Vec3::UnitZ()),
                  rotary(ChainSide::tool, Vec3::UnitZ(), Vec3::Zero()),
                  rotary(ChainSide::tool, Vec3::UnitY(), Vec3(0, 0, pivot))};
  return chain;
}

/// Readings as a shop takes them: rotaries to many places, linears so that the tip of the true
/// chain is at the sphere, `noise` mm off. Dials say half of it.
std::vector<TipReading> readings_at(const ScrewChain& truth, const std::vector<Vec3>& spheres,
                                    int count, double noise, double tool) {
  std::mt19937 random(11);
  std::normal_distribution<double> error(0.0, noise > 0.0 ? noise : 1.0);
  std::uniform_real_distribution<double> angle(-1.2, 1.2);
  std::vector<TipReading> out;
  for (int i = 0; i < count; ++i) {
    TipReading r;
    r.tool_length = tool;
    r.sphere = i % static_cast<int>(spheres.size());
    r.q = JointVector::Zero(5);
    r.q[3] = angle(random);
    r.q[4] = 2.0 * angle(random);
    const Vec3 goal = spheres[static_cast<std::size_t>(r.sphere)];
    for (int step = 0; step < 30; ++step) {  // tip is linear in X, Y, Z: Newton by its Jacobian
      const CutterLocation at = forward_location(truth, r.q);
      const Vec3 off = at.tip - tool * at.axis - goal;
      r.q.head<3>() -= jacobian(truth, r.q).block<3, 3>(3, 0).inverse() * off;
    }
    if (noise > 0.0) r.place = Vec3(error(random), error(random), error(random));
    out.push_back(r);
  }
  return out;
}

const std::vector<FitParameter> kOrigins = {{Kind::origin, 3}, {Kind::origin, 4}};

}  // namespace

TEST_CASE("chain_fit: rotary centres of a trunnion come back from readings without noise",
          "[kernels][optimise]") {
  const ScrewChain truth = table(Vec3(0, 1.7, -32.1), Vec3(0.4, 1.1, 0));
  const auto readings = readings_at(truth, {Vec3(60, 20, 40), Vec3(-50, -30, 25)}, 24, 0.0, 80.0);
  const ChainFit fit = fit_chain(table(Vec3(0, 0, -30), Vec3::Zero()), readings, kOrigins);
  REQUIRE(fit.status == ChainFit::Status::ok);
  CHECK((fit.chain.joints[3].origin - truth.joints[3].origin).norm() < 1e-6);
  CHECK((fit.chain.joints[4].origin - truth.joints[4].origin).norm() < 1e-6);
  CHECK(fit.chain.joints[0].direction == Vec3::UnitX());  // nothing else moves
  REQUIRE(fit.spheres.size() == 2);
  CHECK((fit.spheres[0] - Vec3(60, 20, 40)).norm() < 1e-6);
  CHECK(fit.before.size() == readings.size());
  CHECK(fit.before[0].norm() > 0.1);
  CHECK(fit.after[0].norm() < 1e-7);
}

TEST_CASE("chain_fit: pivot length and crooked axes of a head", "[kernels][optimise]") {
  ScrewChain truth = head(251.3);
  truth.joints[4].direction = Vec3(0.002, 1, -0.001).normalized();
  truth.joints[1].direction = Vec3(0.0005, 1, 0).normalized();
  const auto readings = readings_at(truth, {Vec3(10, 20, 5), Vec3(-200, 90, 60)}, 40, 0.0, 60.0);
  const ChainFit fit =
      fit_chain(head(250.0), readings,
                {{Kind::origin, 3}, {Kind::origin, 4}, {Kind::direction, 4}, {Kind::direction, 1}});
  REQUIRE(fit.status == ChainFit::Status::ok);
  CHECK(std::abs(fit.chain.joints[4].origin.z() - 251.3) < 1e-6);
  CHECK((fit.chain.joints[4].direction - truth.joints[4].direction).norm() < 1e-8);
  CHECK((fit.chain.joints[1].direction - truth.joints[1].direction).norm() < 1e-8);
}

TEST_CASE("chain_fit: noise comes back as the stated deviations", "[kernels][optimise]") {
  const Vec3 a(0, 0.3, -30.2), c(0.15, 0.25, 0);
  const ScrewChain truth = table(a, c);
  const auto readings = readings_at(truth, {Vec3(60, 20, 40)}, 200, 0.003, 80.0);
  const ChainFit fit = fit_chain(table(Vec3(0, 0, -30), Vec3::Zero()), readings, kOrigins);
  REQUIRE(fit.status == ChainFit::Status::ok);
  REQUIRE(fit.unknowns.size() == 4);
  const double found[] = {
      fit.chain.joints[3].origin.y() - a.y(), fit.chain.joints[3].origin.z() - a.z(),
      fit.chain.joints[4].origin.x() - c.x(), fit.chain.joints[4].origin.y() - c.y()};
  for (std::size_t k = 0; k < 4; ++k) {
    CHECK(fit.unknowns[k].deviation < 0.002);
    CHECK(fit.unknowns[k].deviation > 0.0001);
    CHECK(std::abs(found[k]) < 4.0 * fit.unknowns[k].deviation);
  }
}

TEST_CASE("chain_fit: what readings cannot tell is named", "[kernels][optimise]") {
  const ScrewChain truth = table(Vec3(0, 0.3, -30.2), Vec3(0.15, 0.25, 0));
  auto readings = readings_at(truth, {Vec3(60, 20, 40)}, 30, 0.0, 80.0);
  // A shift of the tip and all axes together changes nothing but where M is.
  const ChainFit shift =
      fit_chain(truth, readings, {{Kind::origin, 3}, {Kind::origin, 4}, {Kind::tip, -1}});
  CHECK(shift.status == ChainFit::Status::not_observable);
  CHECK(shift.hidden.size() == 7);
  // A stands still: where it is cannot be told.
  ScrewChain still = truth;
  readings = readings_at(truth, {Vec3(60, 20, 40)}, 30, 0.0, 80.0);
  for (TipReading& r : readings) {
    r.q[3] = 0.0;
    for (int step = 0; step < 3; ++step)
      r.q.head<3>() -= jacobian(truth, r.q).block<3, 3>(3, 0).inverse() *
                       (forward_location(truth, r.q).tip -
                        80.0 * forward_location(truth, r.q).axis - Vec3(60, 20, 40));
  }
  const ChainFit a = fit_chain(still, readings, kOrigins);
  CHECK(a.status == ChainFit::Status::not_observable);
  CHECK(a.hidden == std::vector<int>{0, 1});
  CHECK(fit_chain(still, readings, {{Kind::origin, 4}}).status == ChainFit::Status::ok);
  // Four unknowns and a sphere from two readings.
  readings.resize(2);
  CHECK(fit_chain(still, readings, kOrigins).status == ChainFit::Status::too_few);
}

TEST_CASE("chain_fit: places in the part tell the tip too", "[kernels][optimise]") {
  ScrewChain truth = table(Vec3(0, 0.3, -30.2), Vec3(0.15, 0.25, 0));
  truth.tool_home.translation() = Vec3(0.2, -0.1, 1.5);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> value(-1.0, 1.0);
  std::vector<TipReading> readings;
  for (int i = 0; i < 40; ++i) {
    TipReading r;
    r.q = JointVector::Zero(5);
    for (int j = 0; j < 5; ++j) r.q[j] = value(random) * (j < 3 ? 100.0 : 1.5);
    r.place = forward_location(truth, r.q).tip;
    readings.push_back(r);
  }
  const ChainFit fit = fit_chain(table(Vec3(0, 0, -30), Vec3::Zero()), readings,
                                 {{Kind::origin, 3}, {Kind::origin, 4}, {Kind::tip, -1}});
  REQUIRE(fit.status == ChainFit::Status::ok);
  CHECK((fit.chain.tool_home.translation() - truth.tool_home.translation()).norm() < 1e-6);
  CHECK((fit.chain.joints[3].origin - truth.joints[3].origin).norm() < 1e-6);
}

TEST_CASE("chain_fit: preconditions", "[kernels][optimise]") {
  const ScrewChain chain = head(100.0);
  CHECK_THROWS_AS(fit_chain(chain, {}, {}), ContractViolation);
  CHECK_THROWS_AS(fit_chain(chain, {}, {{Kind::origin, 0}}), ContractViolation);
  CHECK_THROWS_AS(fit_chain(chain, {}, {{Kind::direction, 5}}), ContractViolation);
  TipReading wrong;
  wrong.q = JointVector::Zero(4);
  CHECK_THROWS_AS(fit_chain(chain, {wrong}, {{Kind::origin, 3}}), ContractViolation);
}
