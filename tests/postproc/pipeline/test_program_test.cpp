#include "postproc/pipeline/test_program.h"

#include <algorithm>
#include <catch2/catch.hpp>

#include "postproc/pipeline/registry.h"
#include "tests/support/machines.h"

using namespace smoothpost;
using namespace smoothpost::test;

TEST_CASE("test_program: slow and with the tip held on every shipped machine",
          "[postproc][pipeline]") {
  for (const char* name :
       {"finish_2p2r_1p1r", "head_head_ca", "head_table_bc", "laser_5p1", "laser_5p1_offset",
        "robot_6r", "table_table_ac", "table_table_b45c", "table_table_bc"}) {
    INFO(name);
    const auto machine = shipped_machine(name);
    const auto test = make_test_program(machine, 40.0);
    for (const auto& d : test.diagnostics()) UNSCOPED_INFO(to_string(d));
    REQUIRE(test.ok());
    const auto& held = test.value().tip_held;
    CHECK(std::count(held.begin(), held.end(), true) > 10);
    const Dialect* dialect = find_dialect(machine.dialect.name);
    REQUIRE(dialect);
    const auto emitted = dialect->emit(machine, test.value().program);
    REQUIRE(emitted.ok());
    const auto read = dialect->read_back(machine, emitted.value().text, name);
    for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
    REQUIRE(read.ok());
    for (const Check& c : check_test_program(read.value(), machine, test.value())) {
      INFO(c.name << " " << c.value << " of " << c.limit);
      CHECK(c.ok);
    }
    for (const auto& move : read.value().moves) CHECK_FALSE(move.beam);
    // Nobody stands an hour beside a rotary that goes home a few degrees, whatever its range.
    for (const auto& move : test.value().program.moves) CHECK(move.duration <= 300.0);
  }
}

TEST_CASE("test_program: a wrong tool length does not hold the tip", "[postproc][pipeline]") {
  const auto machine = shipped_machine("table_table_bc");
  auto test = make_test_program(machine, 40.0);
  REQUIRE(test.ok());
  const Dialect* dialect = find_dialect(machine.dialect.name);
  const auto emitted = dialect->emit(machine, test.value().program);
  const auto read = dialect->read_back(machine, emitted.value().text, "p");
  REQUIRE(read.ok());
  test.value().tool_length = 41.0;
  const auto checks = check_test_program(read.value(), machine, test.value());
  CHECK(std::any_of(checks.begin(), checks.end(),
                    [](const Check& c) { return c.name == "tip_held" && !c.ok; }));
}
