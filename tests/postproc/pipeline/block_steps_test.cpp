#include "postproc/pipeline/block_steps.h"

#include <catch2/catch.hpp>

#include "tests/support/machines.h"

using namespace smoothpost;

namespace {

/// Steps of a way of `rest` of which at most `most` holds at once.
std::vector<double> steps(double rest, double usual, double most) {
  std::vector<double> list;
  while (rest > 1e-12) {
    list.push_back(longest_step(rest, usual, 1e-6, [&](double s) { return s <= most; }));
    REQUIRE(list.back() > 0.0);
    REQUIRE(list.back() <= rest);
    rest -= list.back();
  }
  return list;
}

}  // namespace

TEST_CASE("block_steps: as long as they hold, to a sixteenth, and no stump at the end",
          "[postproc][pipeline]") {
  for (double most = 0.07; most < 12.0; most *= 1.173) {
    INFO(most);
    const std::vector<double> list = steps(10.0, 100.0, most);
    for (std::size_t i = 0; i < list.size(); ++i) {
      CHECK(list[i] <= most);
      if (i + 2 < list.size()) CHECK(list[i] >= 15.0 / 16.0 * most * (1.0 - 1e-12));
    }
    CHECK(static_cast<double>(list.size()) <= 10.0 / (15.0 / 16.0 * most) + 2.0);
    if (list.size() > 1) CHECK(list.back() >= 0.25 * most);
  }
}

TEST_CASE("block_steps: equal ones where all hold, the least where none does",
          "[postproc][pipeline]") {
  CHECK(steps(10.0, 3.0, 99.0) == std::vector<double>{2.5, 2.5, 2.5, 2.5});
  CHECK(longest_step(10.0, 3.0, 0.25, [](double) { return false; }) == 0.25);
  CHECK(longest_step(0.125, 3.0, 0.25, [](double) { return false; }) == 0.125);
}

TEST_CASE("block_steps: the control decides where the machine file does not",
          "[postproc][pipeline]") {
  const auto of = [](std::vector<MachineOverride> set) {
    return usual_block_time(test::shipped_machine("table_table_bc", set));
  };
  CHECK(of({}) == kLongBlock);
  CHECK(of({{"dialect.path_mode", "blend"}}) == kShortBlock);
  CHECK(of({{"dialect.name", "siemens_840d"}, {"dialect.extension", "mpf"}}) == kShortBlock);
  CHECK(of({{"dialect.block_ms", "35"}}) == Approx(0.035));
  CHECK(of({{"dialect.path_mode", "blend"}, {"cycle.min_block_ms", "20"}}) == Approx(0.020));
}
