#include "kernels/kinematics/bent_motion.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "kernels/core/contract.h"
#include "tests/kernels/kinematics/reference_machines.h"

namespace smoothpost {
namespace {

using test::Random;
using test::random_chain;

TEST_CASE("bent_motion_bound: never below dense second differences", "[kernels][kinematics]") {
  Random random(16);
  const double noise_tip = 1e-7, noise_axis = 1e-10;
  constexpr int kSamples = 200;
  int bent = 0;
  for (int n = 0; n < 3000; ++n) {
    const ScrewChain chain = random_chain(random, 1 + random.below(8));
    const double size = std::pow(10.0, random.between(-3.0, 0.0));
    const JointVector q = random.joints(chain);
    // q + a τ + b τ² + c τ³: |q'| ≤ |a| + 2|b| + 3|c|, |q''| ≤ 2|b| + 6|c|.
    const JointVector a = size * (random.joints(chain) - q), b = size * (random.joints(chain) - q);
    const JointVector c = size * (random.joints(chain) - q);
    const auto at = [&](double t) { return JointVector(q + t * (a + t * (b + t * c))); };
    const JointMotionBound motion{at(0.5), a + b + 0.75 * c,
                                  a.cwiseAbs() + 2.0 * b.cwiseAbs() + 3.0 * c.cwiseAbs(),
                                  2.0 * b.cwiseAbs() + 6.0 * c.cwiseAbs()};
    const SecondDerivativeBound bound = bent_motion_bound(chain, motion);
    std::vector<CutterLocation> seen;
    for (int s = 0; s <= kSamples; ++s)
      seen.push_back(forward_location(chain, at(static_cast<double>(s) / kSamples)));
    for (std::size_t s = 1; s < kSamples; ++s) {
      const Vec3 tip = seen[s - 1].tip - 2.0 * seen[s].tip + seen[s + 1].tip;
      const Vec3 axis = seen[s - 1].axis - 2.0 * seen[s].axis + seen[s + 1].axis;
      REQUIRE(tip.norm() * kSamples * kSamples <= bound.tip + noise_tip);
      REQUIRE(axis.norm() * kSamples * kSamples <= bound.axis + noise_axis);
      bent += tip.norm() > 1e-9 ? 1 : 0;
    }
  }
  CHECK(bent > 100000);
}

TEST_CASE("bent_motion_bound: one rotary in closed form", "[kernels][kinematics]") {
  ScrewChain chain;
  chain.joints = {test::joint({'C', ChainSide::tool, -3, 3})};
  chain.tool_home.translation() = Vec3(100, 0, 7);
  chain.tool_axis = Vec3::UnitX();
  JointVector middle(1), rate(1), second(1);
  middle << 0.9;
  // A constant rate: |tip''| = 100 · w² all along.
  rate << 1.2;
  second << 0.0;
  CHECK(bent_motion_bound(chain, {middle, rate, rate, second}).tip == Approx(144.0).epsilon(1e-9));
  CHECK(bent_motion_bound(chain, {middle, rate, rate, second}).axis == Approx(1.44).epsilon(1e-9));
  // A rate that grows from 1 to 2: √(w⁴ + α²) at its end, and w² + α is the bound.
  JointVector fastest(1);
  fastest << 2.0;
  rate << 1.5;
  second << 1.0;
  const auto faster = bent_motion_bound(chain, {middle, rate, fastest, second});
  CHECK(faster.tip >= 100.0 * std::sqrt(17.0));
  CHECK(faster.tip == Approx(500.0).epsilon(1e-9));
  CHECK(faster.axis == Approx(5.0).epsilon(1e-9));
  CHECK_THROWS_AS(bent_motion_bound(chain, {middle, rate, fastest, {}}), ContractViolation);
}

}  // namespace
}  // namespace smoothpost
