#include "machines/definition/number_edit.h"

#include <catch2/catch.hpp>

#include "tests/support/support.h"

using namespace smoothpost;

TEST_CASE("number_edit: only the numbers change", "[machines][definition]") {
  const std::string text =
      "# top\n[[axis]]\nname = \"A\"\norigin_mm = [ 0,1.50 , -2 ] # measured\n"
      "[[axis]]\nname = \"C\" # with \xC3\xA9\norigin_mm=[0,0,0]\n[tool]\ntip_mm = [\n  1, # x\n  "
      "2,\n  3]\n";
  const auto out = with_vectors(text, "m.toml",
                                {{"A", "origin_mm", Vec3(0.25, 1.5, -2.0000001), 6},
                                 {"C", "origin_mm", Vec3(0.0, -1e-9, 7.125), 6},
                                 {"", "tip_mm", Vec3(1.0, 2.5, -0.001), 6}});
  REQUIRE(out.ok());
  CHECK(out.value() ==
        "# top\n[[axis]]\nname = \"A\"\norigin_mm = [ 0.25,1.50 , -2 ] # measured\n"
        "[[axis]]\nname = \"C\" # with \xC3\xA9\norigin_mm=[0,0,7.125]\n[tool]\ntip_mm = [\n  1, # "
        "x\n  2.5,\n  -0.001]\n");
}

TEST_CASE("number_edit: what is not in the file is an error", "[machines][definition]") {
  const std::string text =
      test::read_bytes(test::source_path("machines/table_table_ac/machine.toml"));
  CHECK(with_vectors(text, "m", {{"A", "origin_mm", Vec3::Zero(), 6}}).value() == text);
  CHECK_FALSE(with_vectors(text, "m", {{"Q", "origin_mm", Vec3::Zero(), 6}}).ok());
  CHECK_FALSE(with_vectors(text, "m", {{"X", "origin_mm", Vec3::Zero(), 6}}).ok());
  CHECK_FALSE(with_vectors("[", "m", {}).ok());
}
