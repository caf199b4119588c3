#include "kernels/core/nearest_name.h"

#include <catch2/catch.hpp>

using namespace smoothpost;

TEST_CASE("nearest_name: fewest edits and no far guesses", "[kernels][core]") {
  const std::vector<std::string> names = {"tip_mm", "axis_deg", "convert", "siemens_840d"};
  CHECK(nearest_name("tip_m", names) == "tip_mm");
  CHECK(nearest_name("conver", names) == "convert");
  CHECK(nearest_name("converts", names) == "convert");
  CHECK(nearest_name("xyz", names).empty());
  CHECK(nearest_name("", names).empty());
  CHECK(nearest_name("anything", {}).empty());
  CHECK(nearest_name("ab", {"abc", "abd"}) == "abc");
  CHECK(did_you_mean("siemens", names) == ", did you mean siemens_840d?");
  CHECK(did_you_mean("si", names).empty());
}
