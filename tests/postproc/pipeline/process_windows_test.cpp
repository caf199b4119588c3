#include "postproc/pipeline/process_windows.h"

#include <catch2/catch.hpp>

using namespace smoothpost;

namespace {

struct Opened {
  std::vector<std::uint32_t> process;
  ProcessWindows windows;
};

/// Whether the process may be as `number` says at a place.
bool may(const Opened& opened, std::size_t place, std::uint32_t number) {
  const std::int32_t w = opened.windows.of[place];
  return w < 0 ? number == opened.process[place]
               : opened.windows.windows[static_cast<std::size_t>(w)][number];
}

bool only_own(const Opened& opened, std::size_t place, std::uint32_t numbers) {
  for (std::uint32_t n = 0; n < numbers; ++n)
    if (may(opened, place, n) != (n == opened.process[place])) return false;
  return true;
}

}  // namespace

TEST_CASE("process_windows: each part as on either side of a change, and nothing else",
          "[postproc][pipeline]") {
  // Numbers 0: all off, 1: spindle, 2: spindle and coolant, 3: coolant, 4: beam.
  const std::vector<std::vector<std::uint32_t>> parts = {
      {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}};
  std::vector<double> way;
  std::vector<std::uint32_t> process;
  for (int i = 0; i <= 100; ++i) {
    way.push_back(0.1 * i);
    process.push_back(i <= 50 ? 1U : 2U);
  }
  // Before the stretch all is off; behind it spindle and coolant go on.
  const Opened w = {process, process_windows({way, process, 0, 2, parts}, 0.5)};
  REQUIRE(w.windows.of.size() == way.size());
  CHECK(may(w, 0, 0));
  CHECK(may(w, 0, 1));
  CHECK_FALSE(may(w, 0, 2));  // coolant is on neither side of the start
  CHECK_FALSE(may(w, 0, 4));
  CHECK(only_own(w, 20, 5));  // far from any change
  CHECK(may(w, 47, 2));
  CHECK(may(w, 54, 1));
  CHECK_FALSE(may(w, 54, 0));
  CHECK_FALSE(may(w, 54, 3));  // the spindle is on on both sides
  CHECK(only_own(w, 60, 5));
  CHECK(only_own(w, 100, 5));  // nothing changes at the end
}

TEST_CASE("process_windows: two events of one place may stand apart", "[postproc][pipeline]") {
  const std::vector<std::vector<std::uint32_t>> parts = {{0, 0}, {1, 1}, {0, 1}, {1, 0}};
  const std::vector<double> way = {0.0, 1.0, 2.0, 3.0};
  const std::vector<std::uint32_t> process = {1, 1, 1, 1};
  const Opened w = {process, process_windows({way, process, 1, 0, parts}, 0.5)};
  CHECK(only_own(w, 0, 4));
  CHECK(only_own(w, 2, 4));
  for (const std::uint32_t number : {0U, 1U, 2U, 3U}) CHECK(may(w, 3, number));
}

TEST_CASE("process_windows: without parts a number is one part", "[postproc][pipeline]") {
  const std::vector<std::vector<std::uint32_t>> parts;
  const std::vector<double> way = {0.0, 0.2, 0.4, 5.0};
  const std::vector<std::uint32_t> process = {0, 2, 1, 1};
  const Opened w = {process, process_windows({way, process, 0, 1, parts}, 0.1)};
  CHECK(may(w, 0, 0));
  CHECK(may(w, 0, 2));
  CHECK_FALSE(may(w, 0, 1));
  CHECK(may(w, 1, 1));
  CHECK(only_own(w, 3, 3));
}
