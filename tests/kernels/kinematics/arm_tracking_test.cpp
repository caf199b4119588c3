#include "kernels/kinematics/arm_tracking.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "kernels/core/contract.h"
#include "tests/kernels/kinematics/arms.h"
#include "tests/kernels/kinematics/reference_machines.h"

using namespace smoothpost;

namespace {

using Status = BranchTracking::Status;

bool inside(const ScrewChain& chain, const JointVector& q) {
  for (int j = 0; j < 6; ++j) {
    const auto& joint = chain.joints[static_cast<std::size_t>(j)];
    if (q[j] < joint.lower - 1e-9 || q[j] > joint.upper + 1e-9) return false;
  }
  return true;
}

/// Every allowed way to have the joints at a pose, from the definition.
std::vector<JointVector> choices(const SixR& arm, const Pose& pose) {
  std::vector<JointVector> out;
  const auto solved = arm.solve(pose);
  for (std::size_t b = 0; b < 8; ++b) {
    if (!solved.valid[b]) continue;
    for (int code = 0; code < 729; ++code) {  // turns −1, 0, 1 of every joint
      JointVector q = solved.q[b];
      for (int j = 0, rest = code; j < 6; ++j, rest /= 3) q[j] += 2.0 * M_PI * (rest % 3 - 1);
      if (inside(arm.chain(), q)) out.push_back(q);
    }
  }
  return out;
}

/// Least cost over all sequences of choices, by trying them all.
class Exhaustive {
 public:
  Exhaustive(const SixR& arm, const std::vector<ArmPoint>& points, const ArmTrackingSettings& s)
      : points_(points), settings_(s) {
    for (const auto& p : points) choices_.push_back(choices(arm, p.tool));
  }
  double run() {
    for (const auto& q : choices_.front()) visit(0, q, 0.01 * (q - settings_.start).lpNorm<1>());
    return best_;
  }

 private:
  void visit(std::size_t i, const JointVector& q, double cost) {
    if (cost >= best_) return;
    if (i + 1 == points_.size()) {
      best_ = cost;
      return;
    }
    for (const auto& next : choices_[i + 1]) {
      if (points_[i + 1].cut && (next - q).lpNorm<Eigen::Infinity>() > settings_.continuity)
        continue;
      visit(i + 1, next, cost + (next - q).lpNorm<1>());
    }
  }
  const std::vector<ArmPoint>& points_;
  const ArmTrackingSettings& settings_;
  std::vector<std::vector<JointVector>> choices_;
  double best_ = INFINITY;
};

/// What every result with status ok keeps.
void check_choice(const SixR& arm, const std::vector<ArmPoint>& points,
                  const ArmTrackingSettings& s, const BranchTracking& got) {
  REQUIRE(got.status == Status::ok);
  REQUIRE(got.q.size() == points.size());
  REQUIRE(got.branch.size() == points.size());
  double cost = 0.01 * (got.q.front() - s.start).lpNorm<1>();
  for (std::size_t i = 0; i < points.size(); ++i) {
    CHECK(inside(arm.chain(), got.q[i]));
    const Pose back = forward(arm.chain(), got.q[i]);
    CHECK((back.translation() - points[i].tool.translation()).norm() < 1e-6);
    CHECK((back.linear() - points[i].tool.linear()).norm() < 1e-9);
    if (i == 0) continue;
    const JointVector step = got.q[i] - got.q[i - 1];
    if (points[i].cut) CHECK(step.lpNorm<Eigen::Infinity>() <= s.continuity + 1e-9);
    cost += step.lpNorm<1>();
  }
  CHECK(got.cost == Approx(cost).margin(1e-9));
}

/// Points at joint values, by forward kinematics.
std::vector<ArmPoint> points_of(const ScrewChain& chain, const std::vector<JointVector>& way) {
  std::vector<ArmPoint> points;
  for (const auto& q : way) {
    points.push_back(
        {forward(chain, q), !points.empty(), static_cast<std::uint32_t>(100 + points.size())});
  }
  return points;
}

ArmTrackingSettings from_home() {
  ArmTrackingSettings s;
  s.start = test::kr60_home();
  return s;
}

/// Home with the sixth axis going from `begin` to `end` degrees.
std::vector<JointVector> sixth(double begin, double end) {
  std::vector<JointVector> way;
  for (int k = 0; k <= 40; ++k) {
    JointVector q = test::kr60_home();
    q[5] = (begin + (end - begin) * k / 40) * M_PI / 180.0;
    way.push_back(q);
  }
  return way;
}

}  // namespace

TEST_CASE("arm_tracking: the cost is that of an exhaustive search", "[kernels][kinematics]") {
  const ScrewChain chain = test::kr60();
  const auto arm = SixR::from(chain);
  REQUIRE(arm);
  test::Random random(17);
  int found = 0, dead = 0;
  for (int round = 0; round < 120; ++round) {
    JointVector q = random.joints(chain);
    std::vector<ArmPoint> points;
    for (int k = 0; k < 5; ++k) {
      points.push_back(
          {forward(chain, q), k > 0 && random.below(3) > 0, static_cast<std::uint32_t>(k + 1)});
      const double size = random.below(4) == 0 ? 1.5 : 0.4;
      for (int j = 0; j < 6; ++j) q[j] += size * random.between(-1, 1);
      for (int j = 0; j < 6; ++j)
        q[j] = std::clamp(q[j], chain.joints[static_cast<std::size_t>(j)].lower,
                          chain.joints[static_cast<std::size_t>(j)].upper);
    }
    const auto settings = from_home();
    const double wanted = Exhaustive(*arm, points, settings).run();
    const BranchTracking got = track_arm(*arm, points, settings);
    INFO("round " << round);
    if (std::isinf(wanted)) {
      ++dead;
      CHECK(got.status == Status::rewind_needed);
      CHECK_FALSE(got.rewinds.empty());
      continue;
    }
    ++found;
    check_choice(*arm, points, settings, got);
    CHECK(got.cost == Approx(wanted).margin(1e-9));
  }
  INFO(found << " found, " << dead << " dead ends");
  CHECK(found > 40);
  CHECK(dead > 10);
}

TEST_CASE("arm_tracking: the sixth axis unwinds between cuts", "[kernels][kinematics]") {
  const ScrewChain chain = test::kr60();
  const auto arm = SixR::from(chain);
  std::vector<ArmPoint> points;
  for (int cut = 0; cut < 4; ++cut) {
    auto part = points_of(chain, sixth(500.0 * cut, 500.0 * (cut + 1)));
    part.front().cut = false;
    points.insert(points.end(), part.begin(), part.end());
  }
  const auto settings = from_home();
  const BranchTracking got = track_arm(*arm, points, settings);
  check_choice(*arm, points, settings, got);
  for (std::size_t cut = 0; cut < 4; ++cut)
    CHECK(std::abs(got.q[41 * cut + 40][5] - got.q[41 * cut][5]) ==
          Approx(500.0 * M_PI / 180.0).margin(1e-6));
}

TEST_CASE("arm_tracking: a cut that winds an axis up is a dead end with its joint",
          "[kernels][kinematics]") {
  const ScrewChain chain = test::kr60();
  const auto arm = SixR::from(chain);
  auto points = points_of(chain, sixth(0, 1000));
  const BranchTracking got = track_arm(*arm, points, from_home());
  CHECK(got.status == Status::rewind_needed);
  REQUIRE(got.rewinds.size() == 1);
  const Rewind& rewind = got.rewinds.front();
  CHECK(rewind.joint == 5);
  CHECK(got.joint == 5);
  CHECK(rewind.line == points[rewind.point].line);
  CHECK(rewind.reason.find("joint 6") != std::string::npos);
  CHECK(rewind.reason.find("350") != std::string::npos);
  // It is where the last possible choice ends: up to there is a way, one further there is none.
  auto until = points;
  until.resize(rewind.point);
  CHECK(track_arm(*arm, until, from_home()).status == Status::ok);
  until = points;
  until.resize(rewind.point + 1);
  CHECK(track_arm(*arm, until, from_home()).status == Status::rewind_needed);
  // Every one is listed.
  auto longer = points_of(chain, sixth(0, 1500));
  auto more = points_of(chain, sixth(1500, 3000));
  longer.insert(longer.end(), more.begin(), more.end());
  CHECK(track_arm(*arm, longer, from_home()).rewinds.size() >= 4);
}

TEST_CASE("arm_tracking: through a singular wrist", "[kernels][kinematics]") {
  const ScrewChain chain = test::kr60();
  const auto arm = SixR::from(chain);
  for (const double fourth : {0.0, 0.7}) {
    std::vector<JointVector> way;
    for (int k = -20; k <= 20; ++k) {
      JointVector q = test::kr60_home();
      q[3] = fourth;
      q[4] = 0.02 * k;  // exactly 0 in the middle
      way.push_back(q);
    }
    auto points = points_of(chain, way);
    auto settings = from_home();
    settings.start = way.front();
    const BranchTracking got = track_arm(*arm, points, settings);
    check_choice(*arm, points, settings, got);
    for (std::size_t i = 0; i < way.size(); ++i) CHECK((got.q[i] - way[i]).norm() < 1e-6);
  }
}

TEST_CASE("arm_tracking: out of reach and over a limit", "[kernels][kinematics]") {
  ScrewChain chain = test::kr60();
  auto points = points_of(chain, sixth(0, 10));
  const auto arm = SixR::from(chain);
  points[7].tool.translation() += Vec3(9000, 0, 0);
  const BranchTracking far = track_arm(*arm, points, from_home());
  CHECK(far.status == Status::unreachable);
  CHECK(far.point == 7);
  CHECK_FALSE(far.reason.empty());

  chain.joints[4].lower = 1.0;  // home has 45 deg
  chain.joints[1].lower = -1.7;
  const auto narrow = SixR::from(chain);
  points = points_of(chain, sixth(0, 10));
  const BranchTracking over = track_arm(*narrow, points, from_home());
  CHECK(over.status == Status::over_limit);
  CHECK(over.point == 0);
  CHECK(over.reason.find("joint ") != std::string::npos);
  CHECK(over.reason.find("limit") != std::string::npos);

  CHECK(track_arm(*arm, {}, from_home()).status == Status::ok);
  ArmTrackingSettings bad;
  bad.start = JointVector::Zero(5);
  CHECK_THROWS_AS(track_arm(*arm, points, bad), ContractViolation);
}
