#include "postproc/report/check_words.h"

#include <catch2/catch.hpp>
#include <regex>

#include "tests/support/support.h"

using namespace smoothpost;

TEST_CASE("check_words: every check of docs/guarantees.md has its sentence on the page",
          "[postproc][report]") {
  const std::string page = test::read_bytes(test::source_path("docs/guarantees.md"));
  const std::size_t begin = page.find("\n## Checks\n");
  REQUIRE(begin != std::string::npos);
  const std::string checks = page.substr(begin, page.find("\n## ", begin + 4) - begin);
  const std::regex row("\n\\| `([a-z_]+)");
  std::size_t count = 0;
  for (std::sregex_iterator at(checks.begin(), checks.end(), row), none; at != none; ++at) {
    INFO("a row for " << (*at)[1] << " is missing in postproc/report/check_words.cpp");
    CHECK_FALSE(check_words((*at)[1].str()).empty());
    ++count;
  }
  CHECK(count > 25);
  CHECK(check_words("position_limit.X") == check_words("position_limit.B"));
  CHECK(check_words("no_such_check").empty());
  CHECK_FALSE(unchecked_words("clearance").empty());
}
