#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <random>
#include <vector>

#include "kernels/kinematics/rotary_pair.h"
#include "kernels/kinematics/screw_chain.h"
#include "machines/definition/machine_file.h"
#include "tests/support/support.h"

namespace smoothpost {
namespace {

std::vector<std::filesystem::path> shipped_machine_files() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(test::source_path("machines"))) {
    const auto file = entry.path() / "machine.toml";
    if (std::filesystem::exists(file)) files.push_back(file);
  }
  std::sort(files.begin(), files.end());
  return files;
}

JointVector random_joints(const ScrewChain& chain, std::mt19937_64& engine) {
  JointVector q(chain.size());
  for (int j = 0; j < chain.size(); ++j)
    q[j] = std::uniform_real_distribution<double>(chain.joints[j].lower,
                                                  chain.joints[j].upper)(engine);
  return q;
}

/// Largest difference of two joint vectors, rotary joints modulo a turn and by 1000 mm.
double difference(const ScrewChain& chain, const JointVector& a, const JointVector& b) {
  double worst = 0.0;
  for (int j = 0; j < chain.size(); ++j) {
    const bool rotary = chain.joints[j].kind == JointKind::rotary;
    const double d = rotary ? 1000.0 * std::remainder(a[j] - b[j], 2.0 * M_PI) : a[j] - b[j];
    worst = std::max(worst, std::abs(d));
  }
  return worst;
}

TEST_CASE("shipped machines: FK(IK(x)) = x on 20,000 poses, a solution required",
          "[machines][definition][kinematics]") {
  int five_axis = 0;
  for (const auto& file : shipped_machine_files()) {
    CAPTURE(file.parent_path().filename().string());
    const auto machine = parse_machine_file(test::read_bytes(file), file.filename().string());
    REQUIRE(machine.ok());
    const ScrewChain chain = chain_of(machine.value(), 37.5);
    REQUIRE(chain.size() == machine.value().size());
    const auto pair = RotaryPair::from(chain);
    if (!pair) continue;
    ++five_axis;
    std::mt19937_64 engine(41);
    double worst_tip = 0.0;
    double worst_axis = 0.0;
    for (int n = 0; n < 20000; ++n) {
      const JointVector q = random_joints(chain, engine);
      const CutterLocation x = forward_location(chain, q);
      const RotaryPairSolutions solutions = pair->solve(x, q);
      bool own = false;
      for (int b = 0; b < 2; ++b) {
        REQUIRE(solutions.valid[b]);
        const CutterLocation back = forward_location(chain, solutions.q[b]);
        worst_tip = std::max(worst_tip, (back.tip - x.tip).norm());
        worst_axis = std::max(worst_axis, (back.axis - x.axis).norm());
        own = own || difference(chain, solutions.q[b], q) < 1e-3;
      }
      REQUIRE(own);
    }
    CAPTURE(worst_tip, worst_axis);
    CHECK(worst_tip <= 1e-9);
    CHECK(worst_axis <= 1e-12);
  }
  CHECK(five_axis >= 3);
}

TEST_CASE("shipped machines: tool length moves the tip along the tool axis",
          "[machines][definition][kinematics]") {
  for (const auto& file : shipped_machine_files()) {
    CAPTURE(file.parent_path().filename().string());
    const auto machine = parse_machine_file(test::read_bytes(file), file.filename().string());
    REQUIRE(machine.ok());
    std::mt19937_64 engine(42);
    for (int n = 0; n < 50; ++n) {
      const JointVector q = random_joints(chain_of(machine.value()), engine);
      const CutterLocation bare = forward_location(chain_of(machine.value(), 0.0), q);
      const CutterLocation longer = forward_location(chain_of(machine.value(), 80.0), q);
      CHECK((longer.axis - bare.axis).norm() < 1e-14);
      CHECK((bare.tip - 80.0 * bare.axis - longer.tip).norm() < 1e-9);
    }
  }
}

}  // namespace
}  // namespace smoothpost
