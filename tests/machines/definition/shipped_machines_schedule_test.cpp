#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "kernels/kinematics/screw_chain.h"
#include "kernels/schedule/feed_profile.h"
#include "machines/definition/machine_file.h"
#include "tests/kernels/schedule/feed_paths.h"
#include "tests/support/support.h"

// Feed schedules of random joint paths under the limits of every machine in the tree.
namespace smoothpost {
namespace {

struct Machine {
  std::string name;
  ScrewChain chain;
  JointLimits limits;
};

std::vector<Machine> shipped() {
  std::vector<std::filesystem::path> folders;
  for (const auto& entry : std::filesystem::directory_iterator(test::source_path("machines")))
    if (std::filesystem::exists(entry.path() / "machine.toml")) folders.push_back(entry.path());
  std::sort(folders.begin(), folders.end());
  std::vector<Machine> machines;
  for (const auto& folder : folders) {
    const std::string name = folder.filename().string();
    const auto file = parse_machine_file(test::read_bytes(folder / "machine.toml"), name);
    REQUIRE(file.ok());
    machines.push_back({name, chain_of(file.value(), 80.0), limits_of(file.value())});
  }
  return machines;
}

/// A number and its Taylor coefficients by s, up to s³.
using Series = std::array<double, 4>;
using VectorSeries = std::array<Vec3, 4>;

VectorSeries times(const Series& a, const VectorSeries& b) {
  VectorSeries c{Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t k = 0; i + k < 4; ++k) c[i + k] += a[i] * b[k];
  return c;
}

struct SineCosine {
  Series sine, cosine;
};

SineCosine sine_cosine(const Series& q) {
  const double s = std::sin(q[0]), c = std::cos(q[0]);
  const Series sine{0.0, q[1], q[2], q[3] - q[1] * q[1] * q[1] / 6.0};  // of q − q[0]
  const Series cosine{1.0, 0.0, -0.5 * q[1] * q[1], -q[1] * q[2]};
  SineCosine result{};
  for (std::size_t k = 0; k < 4; ++k) {
    result.sine[k] = s * cosine[k] + c * sine[k];
    result.cosine[k] = c * cosine[k] - s * sine[k];
  }
  return result;
}

/// x carried along by a joint at q.
VectorSeries move(const ChainJoint& joint, const Series& q, VectorSeries x) {
  if (joint.kind == JointKind::linear) {
    for (std::size_t k = 0; k < 4; ++k) x[k] += q[k] * joint.direction;
    return x;
  }
  x[0] -= joint.origin;
  VectorSeries across, twice;
  for (std::size_t k = 0; k < 4; ++k) {
    across[k] = joint.direction.cross(x[k]);
    twice[k] = joint.direction.cross(across[k]);
  }
  SineCosine by = sine_cosine(q);
  by.cosine[0] -= 1.0;
  const VectorSeries a = times(by.sine, across), b = times(by.cosine, twice);
  for (std::size_t k = 0; k < 4; ++k) x[k] += a[k] - b[k];  // x + sin·w×x + (1 − cos)·w×(w×x)
  x[0] += joint.origin;
  return x;
}

/// The tip in the workpiece.
VectorSeries tip(const ScrewChain& chain, const std::vector<Series>& q) {
  VectorSeries x{chain.tool_home.translation(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
  for (std::size_t i = chain.joints.size(); i-- > 0;)
    if (chain.joints[i].side == ChainSide::tool) x = move(chain.joints[i], q[i], x);
  for (std::size_t i = 0; i < chain.joints.size(); ++i) {
    if (chain.joints[i].side == ChainSide::tool) continue;
    Series back = q[i];
    for (double& value : back) value = -value;
    x = move(chain.joints[i], back, x);
  }
  const Pose home = chain.workpiece_home.inverse();
  for (std::size_t k = 0; k < 4; ++k)
    x[k] = k == 0 ? Vec3(home * x[k]) : Vec3(home.linear() * x[k]);
  return x;
}

/// A path of joints that are quartic polynomials of s in each piece.
struct JointPieces {
  ScrewChain chain;
  std::vector<double> middle;                           ///< of the pieces, s
  std::vector<std::array<JointVector, 5>> derivatives;  ///< there, order 0 to 4

  PathJet jet(std::size_t piece, double s) const {
    const double d = s - middle[piece];
    const auto& at = derivatives[piece];
    PathJet jet;
    jet.first = at[1] + d * (at[2] + d / 2.0 * (at[3] + d / 3.0 * at[4]));
    jet.second = at[2] + d * (at[3] + d / 2.0 * at[4]);
    jet.third = at[3] + d * at[4];
    const JointVector value =
        at[0] + d * (at[1] + d / 2.0 * (at[2] + d / 3.0 * (at[3] + d / 4.0 * at[4])));
    std::vector<Series> q;
    for (Eigen::Index k = 0; k < value.size(); ++k)
      q.push_back({value[k], jet.first[k], jet.second[k] / 2.0, jet.third[k] / 6.0});
    const VectorSeries x = tip(chain, q);
    const Vec3 c1 = x[1], c2 = 2.0 * x[2], c3 = 6.0 * x[3];
    jet.tip_first = c1.norm();
    if (jet.tip_first > 0.0) {
      jet.tip_second = c1.dot(c2) / jet.tip_first;
      jet.tip_third =
          (c2.squaredNorm() + c1.dot(c3) - jet.tip_second * jet.tip_second) / jet.tip_first;
    }
    return jet;
  }
};

JointPieces pieces_of(const ScrewChain& chain, const SplineCurve& curve) {
  JointPieces result;
  result.chain = chain;
  for (int i = 0; i < curve.knots.spans(); ++i) {
    const auto* knot = &curve.knots.values[static_cast<std::size_t>(i + 4)];
    result.middle.push_back(0.5 * (knot[0] + knot[1]));
    auto& derivatives = result.derivatives.emplace_back();
    for (int order = 0; order < 5; ++order)
      derivatives[static_cast<std::size_t>(order)] = curve.at(result.middle.back(), order);
  }
  return result;
}

/// Control points that wander: each stretch moves two joints or more, all in their ranges, at
/// `step` s of their largest velocity from one to the next, or less.
Eigen::MatrixXd wandering(const JointLimits& limits, test::FeedRandom& random, int count) {
  const Eigen::Index n = limits.lower.size();
  const double step = std::exp(random.between(std::log(0.004), std::log(0.15)));
  JointVector low = limits.lower.cwiseMax(-400.0), high = limits.upper.cwiseMin(400.0);
  JointVector at(n), turn(n);
  std::vector<bool> moves(static_cast<std::size_t>(n), false);
  for (Eigen::Index k = 0; k < n; ++k)
    at[k] = low[k] + (high[k] - low[k]) * random.between(0.1, 0.9);
  turn.setZero();
  Eigen::MatrixXd controls(n, count);
  for (int i = 0, left = 0; i < count; ++i, --left) {
    if (left == 0) {
      left = 2 + static_cast<int>(random.between(0.0, 6.0));
      do {
        for (std::size_t k = 0; k < moves.size(); ++k) moves[k] = random.between(0.0, 1.0) < 0.6;
      } while (std::count(moves.begin(), moves.end(), true) < 2);
    }
    for (Eigen::Index k = 0; k < n; ++k) {
      if (!moves[static_cast<std::size_t>(k)]) {
        turn[k] = 0.0;
        continue;
      }
      turn[k] = std::clamp(turn[k] + random.between(-0.6, 0.6), -1.0, 1.0);
      const double by = turn[k] * std::min(step * limits.velocity[k], 0.2 * (high[k] - low[k]));
      if (at[k] + by < low[k] || at[k] + by > high[k]) turn[k] = -turn[k];
      at[k] += at[k] + by < low[k] || at[k] + by > high[k] ? -by : by;
    }
    controls.col(i) = at;
  }
  return controls;
}

/// A random path of a machine: s near the length of the tip plus 75 mm a radian of its turning, a
/// feed that changes on the way, on every other path limits of the tip.
test::LimitedPath random_path(const Machine& machine, unsigned seed) {
  test::FeedRandom random(seed);
  const int spans = 6 + static_cast<int>(random.between(0.0, 20.0));
  SplineCurve curve;
  curve.knots = clamped_knots(4, spans);
  curve.controls = wandering(machine.limits, random, spans + 4);
  REQUIRE((curve.controls.rowwise().minCoeff() - machine.limits.lower).minCoeff() >= 0.0);
  REQUIRE((curve.controls.rowwise().maxCoeff() - machine.limits.upper).maxCoeff() <= 0.0);
  double tip_length = 0.0, length = 0.0, time = 0.0;  // time: as the joints' velocities allow
  constexpr int kPlaces = 40;
  for (int i = 0; i < kPlaces * spans; ++i) {
    const double u = (i + 0.5) / kPlaces;
    const JointVector q = curve.at(u), rate = curve.at(u, 1);
    const Eigen::VectorXd motion = jacobian(machine.chain, q) * rate;
    tip_length += motion.tail<3>().norm() / kPlaces;
    length += std::hypot(motion.tail<3>().norm(), 75.0 * motion.head<3>().norm()) / kPlaces;
    time += rate.cwiseAbs().cwiseQuotient(machine.limits.velocity).maxCoeff() / kPlaces;
  }
  for (double& u : curve.knots.values) u *= length / spans;

  test::LimitedPath result;
  const auto& knots = curve.knots.values;
  result.path.breaks.assign(knots.begin() + 4, knots.end() - 4);
  const auto pieces = std::make_shared<const JointPieces>(pieces_of(machine.chain, curve));
  result.path.jet = [pieces](std::size_t piece, double s) { return pieces->jet(piece, s); };
  result.limits = {machine.limits.velocity, machine.limits.acceleration, machine.limits.jerk};
  const double speed = tip_length / time;
  double feed = 0.0;
  for (int i = 0; i < spans; ++i) {
    if (i == 0 || random.between(0.0, 1.0) < 0.2)
      feed = speed * std::exp(random.between(std::log(0.2), std::log(3.0)));
    result.path.feed.push_back(feed);
  }
  if (random.between(0.0, 1.0) < 0.5) {
    result.limits.tip_acceleration = speed / random.between(0.02, 0.3);
    result.limits.tip_jerk = result.limits.tip_acceleration / random.between(0.02, 0.2);
  }
  return result;
}

/// The same path with some of its limits raised.
test::LimitedPath looser(const test::LimitedPath& path, unsigned seed) {
  test::FeedRandom random(seed + 500000u);
  test::LimitedPath result = path;
  const double by = random.between(1.05, 2.0);
  const int what = static_cast<int>(random.between(0.0, 5.0));
  if (what == 0 || what == 4) result.limits.velocity *= by;
  if (what == 1 || what == 4) result.limits.acceleration *= by;
  if (what == 2 || what == 4) result.limits.jerk *= by;
  if (what == 3 || what == 4)
    for (double& feed : result.path.feed) feed *= by;
  return result;
}

struct Tally {
  int paths = 0, constant = 0, slower = 0;  ///< slower: by more than 0.1 % with looser limits
  double motion = 0.0;                      ///< s
  double most_used = 0.0;                   ///< share of a limit
  double most_looser = 0.0;                 ///< time with looser limits over time
  double dilation = 1.0;
};

/// Every path is scheduled, keeps every limit on a grid of 0.1 ms (or 8000 places), and is not
/// slower with looser limits.
Tally check_paths(const Machine& machine, unsigned from, unsigned to) {
  Tally tally;
  for (unsigned seed = from; seed < to; ++seed) {
    const test::LimitedPath given = random_path(machine, seed);
    const FeedResult result = test::from_rest_to_rest(given.path, given.limits);
    INFO(machine.name << " seed " << seed << " status " << static_cast<int>(result.status));
    CHECK((result.status == FeedStatus::solved || result.status == FeedStatus::constant_map));
    const double time = result.profile.duration();
    CHECK(time > 0.0);
    const int places = std::max(8000, static_cast<int>(time / 1e-4));
    const double used =
        test::used_limits(given.path, given.limits, result.profile, places).largest();
    CHECK(used <= 1.0 + 1e-9);
    const test::LimitedPath freer = looser(given, seed);
    const FeedResult fast = test::from_rest_to_rest(freer.path, freer.limits);
    INFO("looser: status " << static_cast<int>(fast.status));
    CHECK(fast.profile.duration() > 0.0);
    ++tally.paths;
    tally.constant += result.status == FeedStatus::constant_map ? 1 : 0;
    tally.slower += fast.profile.duration() > 1.001 * time ? 1 : 0;
    tally.motion += time;
    tally.most_used = std::max(tally.most_used, used);
    tally.most_looser = std::max(tally.most_looser, fast.profile.duration() / time);
    tally.dilation = std::max(tally.dilation, result.dilation);
  }
  return tally;
}

}  // namespace

TEST_CASE("shipped machines: the tip of the random paths is that of the chain",
          "[machines][schedule]") {
  const double h = 1e-4;
  for (const Machine& machine : shipped()) {
    INFO(machine.name);
    const test::LimitedPath given = random_path(machine, 1);
    const double length = given.length();
    for (int i = 1; i < 20; ++i) {
      const double s = length * i / 20.3;
      std::size_t piece = 0;
      while (s > given.path.breaks[piece + 1]) ++piece;
      const PathJet at = given.path.jet(piece, s), a = given.path.jet(piece, s - h),
                    b = given.path.jet(piece, s + h);
      CHECK((b.tip_first - a.tip_first) / (2.0 * h) ==
            Approx(at.tip_second).margin(1e-5).epsilon(1e-5));
      CHECK((b.tip_second - a.tip_second) / (2.0 * h) ==
            Approx(at.tip_third).margin(1e-5).epsilon(1e-4));
      CHECK(((b.first - a.first) / (2.0 * h) - at.second).norm() < 1e-6);
      CHECK(((b.second - a.second) / (2.0 * h) - at.third).norm() < 1e-6);
    }
  }
}

TEST_CASE("shipped machines: the tip's speed by Taylor series is the Jacobian's",
          "[machines][schedule]") {
  test::FeedRandom random(5);
  for (const Machine& machine : shipped()) {
    INFO(machine.name);
    for (int n = 0; n < 50; ++n) {
      JointVector q(machine.chain.size()), rate(machine.chain.size());
      std::vector<Series> series;
      for (int k = 0; k < machine.chain.size(); ++k) {
        q[k] = random.between(std::max(-9.0, machine.limits.lower[k]),
                              std::min(9.0, machine.limits.upper[k]));
        rate[k] = random.between(-1.0, 1.0);
        series.push_back({q[k], rate[k], 0.0, 0.0});
      }
      const VectorSeries x = tip(machine.chain, series);
      CHECK((x[0] - forward_location(machine.chain, q).tip).norm() < 1e-9);
      CHECK((x[1] - (jacobian(machine.chain, q) * rate).tail<3>()).norm() < 1e-8);
    }
  }
}

TEST_CASE("shipped machines: random joint paths keep every limit", "[machines][schedule]") {
  for (const Machine& machine : shipped()) {
    const Tally tally = check_paths(machine, 0, 2);
    INFO(machine.name);
    CHECK(tally.most_looser <= 1.001);
    CHECK(tally.most_used > 0.99);
  }
}

TEST_CASE("shipped machines: 1000 random joint paths each keep every limit",
          "[machines][schedule][.slow][slow]") {
  for (const Machine& machine : shipped()) SECTION(machine.name) {
      const Tally tally = check_paths(machine, 0, 1000);
      WARN(machine.name << ": " << tally.motion << " s of motion, most of a limit "
                        << tally.most_used << ", dilation " << tally.dilation
                        << ", time with looser limits " << tally.most_looser << ", on "
                        << tally.slower << " paths over 1.001");
      CHECK(tally.constant == 0);
      // Other limits, other elements: up to three paths of 1000 lose 0.1 to 0.3 % by that.
      CHECK(tally.most_looser <= 1.003);
      CHECK(tally.slower <= 3);
    }
}

}  // namespace smoothpost
