// Every shipped machine with every dialect: certified, or refused with a reason.

#include <algorithm>
#include <catch2/catch.hpp>
#include <map>

#include "postproc/pipeline/test_program.h"
#include "tests/postproc/pipeline/dialect_cases.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

std::string reasons(const Conversion& c) {
  std::string all;
  for (const auto& d : c.diagnostics) all += to_string(d) + "\n";
  for (const auto& k : c.checks)
    if (!k.ok) all += k.name + " " + std::to_string(k.value) + " " + k.note + "\n";
  return all;
}

}  // namespace

TEST_CASE(
    "dialect_matrix: a job is certified on every machine with every controller it has words for",
    "[postproc][pipeline]") {
  std::size_t certified = 0;
  for (const auto& c : suited_cases()) {
    if (c.machine == "finish_2p2r_1p1r") continue;  // its jobs come from meshes
    INFO(c.machine << " with " << c.dialect);
    const auto in = short_job(c);
    const Conversion out = convert(in, false, {});
    INFO(reasons(out) << out.program.substr(0, 1500));
    CHECK(out.verdict == Verdict::certified);
    certified += out.verdict == Verdict::certified ? 1 : 0;
    // The text alone, without the line map, says the same.
    CheckInput check;
    check.text = out.program;
    check.file_name = "out";
    check.machine = in.machine;
    check.placement = in.placement;
    check.against = in.input;
    check.tool_length = is_laser(c.machine) ? 0.0 : 60.0;
    check.collision_check = false;
    const Conversion found = check_program(check, {});
    INFO(reasons(found));
    CHECK(found.verdict == Verdict::certified);
  }
  CHECK(certified >= 60);
}

TEST_CASE(
    "dialect_matrix: a test program is printed and held on every machine with every such "
    "controller",
    "[postproc][pipeline]") {
  for (const auto& c : suited_cases()) {
    INFO(c.machine << " with " << c.dialect);
    const auto machine = shipped_machine(c.machine, {{"dialect.name", c.dialect}});
    const auto test = make_test_program(machine, 40.0);
    REQUIRE(test.ok());
    const Dialect* dialect = find_dialect(c.dialect);
    const auto text = dialect->emit(machine, test.value().program);
    for (const auto& d : text.diagnostics()) UNSCOPED_INFO(to_string(d));
    REQUIRE(text.ok());
    const auto read = dialect->read_back(machine, text.value().text, "out");
    for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
    REQUIRE(read.ok());
    REQUIRE(read.value().moves.size() == test.value().program.moves.size());
  }
}

TEST_CASE("dialect_matrix: every other pair is refused with a reason", "[postproc][pipeline]") {
  std::map<std::string, std::size_t> codes;
  for (const auto& machine : all_machines())
    for (const auto& dialect : dialects()) {
      if (is_suited(machine, dialect.name) || machine == "finish_2p2r_1p1r") continue;
      INFO(machine << " with " << dialect.name);
      const Conversion out = convert(short_job({machine, dialect.name}), false, {});
      CHECK(out.verdict == Verdict::refused);
      const auto error =
          std::find_if(out.diagnostics.begin(), out.diagnostics.end(),
                       [](const Diagnostic& d) { return d.severity == Severity::error; });
      REQUIRE(error != out.diagnostics.end());
      CHECK_FALSE(error->code.empty());
      CHECK(error->text.size() > 30);
      ++codes[error->code];
    }
  for (const auto& [code, count] : codes) UNSCOPED_INFO(code << ": " << count);
  CHECK(codes["PR201"] + codes["PR202"] + codes["PR203"] > 20);
}
