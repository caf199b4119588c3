#include "kernels/collision/chain_motion.h"

#include "kernels/core/contract.h"
#include "tests/kernels/collision/scenes.h"

using namespace smoothpost;

namespace {

Pose relative(const LinkPoses& poses, int first, int second) {
  return poses[static_cast<std::size_t>(second + 1)].inverse() *
         poses[static_cast<std::size_t>(first + 1)];
}

}  // namespace

TEST_CASE("chain_motion: link poses are those of forward kinematics", "[kernels][collision]") {
  std::mt19937 random(31);
  for (int i = 0; i < 200; ++i) {
    const ScrewChain chain = test::random_chain(random, 1 + i % 9);
    const JointVector q = test::random_joints(random, chain, 100.0, 4.0);
    const LinkPoses poses = link_poses(chain, q);
    int tool = -1;
    int table = -1;
    for (int k = 0; k < chain.size(); ++k)
      (chain.joints[static_cast<std::size_t>(k)].side == ChainSide::tool ? tool : table) = k;
    const Pose expected =
        (poses[static_cast<std::size_t>(table + 1)] * chain.workpiece_home).inverse() *
        poses[static_cast<std::size_t>(tool + 1)] * chain.tool_home;
    REQUIRE(expected.isApprox(forward(chain, q), 1e-9));
    const LinkPoses home = link_poses(chain, JointVector::Zero(chain.size()));
    for (int k = 0; k <= chain.size(); ++k)
      REQUIRE(home[static_cast<std::size_t>(k)].isApprox(Pose::Identity()));
  }
}

TEST_CASE("chain_motion: paths have the joints that move one link against the other",
          "[kernels][collision]") {
  std::mt19937 random(32);
  int moved = 0;
  for (int i = 0; i < 100; ++i) {
    const ScrewChain chain = test::random_chain(random, 7);
    for (int a = -1; a < 7; ++a)
      for (int b = -1; b < 7; ++b) {
        const ChainPath path = path_between(chain, a, b);
        const JointVector q = test::random_joints(random, chain, 50.0, 2.0);
        const Pose before = relative(link_poses(chain, q), a, b);
        for (int k = 0; k < 7; ++k) {
          JointVector changed = q;
          changed[k] += 0.1;
          const Pose after = relative(link_poses(chain, changed), a, b);
          const bool on_path = std::any_of(path.begin(), path.end(),
                                           [&](const ChainStep& s) { return s.joint == k; });
          REQUIRE(on_path == !after.isApprox(before, 1e-9));
          moved += on_path;
        }
      }
  }
  CHECK(moved > 5000);
  CHECK_THROWS_AS(path_between(test::laser_chain(), 6, -1), ContractViolation);
  CHECK_THROWS_AS(path_between(test::laser_chain(), 0, -2), ContractViolation);
}

TEST_CASE("chain_motion: displacement is never below that of a body's points",
          "[kernels][collision]") {
  std::mt19937 random(33);
  double tightest = 0.0;
  for (int i = 0; i < 400; ++i) {
    const test::Body body = test::random_body(random, i);
    const Pose from = test::random_pose(random, 50.0);
    Pose to = from;
    to.linear() = rotation_exp(test::uniform(random, 0.0, i % 2 ? 0.1 : 3.0) *
                               test::random_direction(random)) *
                  to.linear();
    to.translation() += test::random_vector(random, 10.0);
    const double bound = displacement(body.shape.balls(), from, to);
    double most = 0.0;
    for (const Vec3& p : body.points) most = std::max(most, (to * p - from * p).norm());
    REQUIRE(most <= bound);
    tightest = std::max(tightest, most / bound);
  }
  CHECK(tightest > 0.999);
}

TEST_CASE("chain_motion: travel and levers are never below dense sampling",
          "[kernels][collision]") {
  std::mt19937 random(34);
  double ratio = 1e9;
  for (int i = 0; i < 300; ++i) {
    const ScrewChain chain = test::random_chain(random, 2 + i % 6);
    const test::Body body = test::random_body(random, i);
    const JointVector from = test::random_joints(random, chain, 100.0, 2.0);
    const double scale = i % 3 == 0 ? 1.0 : 0.02;
    const JointVector to = from + scale * test::random_joints(random, chain, 100.0, 2.0);
    const int first = chain.size() - 1;
    const int second = i % 4 == 0 ? -1 : static_cast<int>(test::uniform(random, 0, first - 0.01));
    const ChainPath path = path_between(chain, first, second);
    const auto bound = movement_bound(chain, path, body.shape.balls(), from, to);
    std::vector<double> way(body.points.size(), 0.0);
    Pose last = relative(link_poses(chain, from), first, second);
    constexpr int kSteps = 60;
    for (int k = 1; k <= kSteps; ++k) {
      const double t = double(k) / kSteps;
      const JointVector q = (1.0 - t) * from + t * to;
      const Pose now = relative(link_poses(chain, q), first, second);
      for (std::size_t p = 0; p < body.points.size(); p += 5)
        way[p] += (now * body.points[p] - last * body.points[p]).norm();
      last = now;
      if (k % 10 != 0) continue;
      JointVector e = test::random_joints(random, chain, 5.0, 0.3);
      const Pose off = relative(link_poses(chain, q + e), first, second);
      const double allowed = bound.lever.dot(e.cwiseAbs());
      for (std::size_t p = 0; p < body.points.size(); p += 5)
        REQUIRE((off * body.points[p] - now * body.points[p]).norm() <= allowed + 1e-9);
    }
    const double most = *std::max_element(way.begin(), way.end());
    REQUIRE(most <= bound.travel);
    // Corners of boxes have no radius: there the bound is tight when the motion is short.
    if (scale < 1.0 && i % 6 >= 4 && most > 0.1) ratio = std::min(ratio, most / bound.travel);
  }
  CHECK(ratio < 1.0);
  CHECK(ratio > 1.0 / 1.5);
}

TEST_CASE("chain_motion: a turn about the tip does not move the tip", "[kernels][collision]") {
  // Wrist 200 mm above the tip, X and Z go along with B: levers add up, the way does not.
  ScrewChain chain = test::laser_chain();
  const std::vector<Ball> tip = {{Vec3(0, 0, -200), 0.0}};
  const auto joints = [](double b) {
    JointVector q(6);
    q << 200.0 * std::sin(b), 0.0, 200.0 * std::cos(b), 0.0, b, 0.0;
    return q;
  };
  const auto bound =
      movement_bound(chain, path_between(chain, test::kW, -1), tip, joints(0.30), joints(0.32));
  CHECK(bound.travel < 0.1);
  CHECK(bound.lever[test::kB] > 199.0);
  CHECK(bound.lever[test::kB] < 203.0);
  CHECK(bound.lever[0] == 1.0);
}

TEST_CASE("chain_motion: nothing moves where no joint lies between", "[kernels][collision]") {
  const ScrewChain chain = test::laser_chain();
  const auto bound = movement_bound(chain, path_between(chain, 3, 3), {{Vec3(100, 0, 0), 5.0}},
                                    JointVector::Zero(6), JointVector::Constant(6, 1.0));
  CHECK(bound.travel < 1e-9);
  CHECK(bound.lever.isZero());
  CHECK_THROWS_AS(movement_bound(chain, {}, {}, JointVector::Zero(5), JointVector::Zero(6)),
                  ContractViolation);
  CHECK_THROWS_AS(link_poses(chain, JointVector::Zero(5)), ContractViolation);
}
