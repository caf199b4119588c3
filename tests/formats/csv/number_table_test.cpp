#include "formats/csv/number_table.h"

#include <catch2/catch.hpp>

using namespace smoothpost;

TEST_CASE("number_table: columns and rows and their lines", "[formats][csv]") {
  const auto read =
      read_number_table("# readings\n\n a , b\r\n 1, -2.5 # first\n\n+3,4e1\n", "t.csv");
  REQUIRE(read.ok());
  const NumberTable& t = read.value();
  CHECK(t.columns == std::vector<std::string>{"a", "b"});
  CHECK(t.rows == std::vector<std::vector<double>>{{1.0, -2.5}, {3.0, 40.0}});
  CHECK(t.lines == std::vector<int>{4, 6});
  CHECK(t.column("b") == 1);
  CHECK(t.column("c") == -1);
}

TEST_CASE("number_table: faults are named", "[formats][csv]") {
  const auto code = [](const std::string& text) {
    const auto read = read_number_table(text, "t.csv", 3);
    REQUIRE_FALSE(read.ok());
    return read.diagnostics().front().code;
  };
  CHECK(code("") == "CSV101");
  CHECK(code("a,a\n1,2\n") == "CSV103");
  CHECK(code("a,b\n1\n") == "CSV105");
  CHECK(code("a\n1\n2\n3\n4\n") == "CSV105");
  CHECK(code("a\nx\n") == "CSV106");
  CHECK(code("a\n1 2\n") == "CSV106");
  CHECK(code("a\nnan\n") == "CSV107");
  CHECK(code("a\n1e7\n") == "CSV107");
  CHECK(code("a\n") == "CSV114");
}
