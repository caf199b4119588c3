// One fault in every arc of a certified program: a digit of the centre, the sense, the plane.
#include <algorithm>
#include <catch2/catch.hpp>

#include "tests/postproc/mutation/mutation_cases.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

/// Where lines with G2 or G3 begin.
std::vector<std::size_t> arc_lines(const std::string& text) {
  std::vector<std::size_t> lines;
  for (std::size_t at = 0; at < text.size(); at = text.find('\n', at) + 1) {
    const std::string_view line(text.data() + at, text.find('\n', at) - at);
    if (line.find(" G2 ") != std::string::npos || line.find(" G3 ") != std::string::npos)
      lines.push_back(at);
    if (text.find('\n', at) == std::string::npos) break;
  }
  return lines;
}

struct Tally {
  int made = 0, refused = 0, equivalent = 0;
};

/// A program with a fault is refused, or the oracle finds it equivalent (a digit behind those that
/// the tolerance sees).
void attack(const MutationCase& c, const std::string& text, Tally& tally) {
  ++tally.made;
  CheckInput in = c.check;
  in.text = text;
  const Conversion verdict = check_program(in, {});
  if (verdict.verdict != Verdict::certified) {
    ++tally.refused;
    return;
  }
  const auto read =
      find_dialect(c.check.machine.dialect.name)->read_back(c.check.machine, text, "mutant");
  REQUIRE(read.ok());
  CHECK(oracle_fault({read.value(), verdict.read, c.machine, c.beam, c.wanted, c.unchanged}) == "");
  ++tally.equivalent;
}

}  // namespace

TEST_CASE("mutation: every arc with another digit, sense or plane is refused or equivalent",
          "[postproc][mutation]") {
  for (const char* dialect : {"linuxcnc", "siemens_840d", "fanuc_30i", "beckhoff"}) {
    const MutationCase c = make_case({"table_table_bc", dialect, "arcs"});
    INFO(c.name);
    const std::vector<std::size_t> lines = arc_lines(c.check.text);
    REQUIRE(lines.size() >= 5);
    Tally digits, senses, planes;
    for (const std::size_t at : lines) {
      const std::string line = c.check.text.substr(at, c.check.text.find('\n', at) - at);
      INFO(line);
      const auto with = [&](std::size_t from, std::size_t size, const std::string& to) {
        std::string text = c.check.text;
        return text.replace(at + from, size, to);
      };
      for (std::size_t k = line.find_first_of("IJK"); k < line.size() && line[k] != 'F'; ++k)
        if (line[k] >= '0' && line[k] <= '9')
          attack(c,
                 with(k, 1, std::string(1, line[k] == '9' ? '0' : static_cast<char>(line[k] + 1))),
                 digits);
      const std::size_t sense = std::min(line.find(" G2 "), line.find(" G3 ")) + 2;
      attack(c, with(sense, 1, line[sense] == '2' ? "3" : "2"), senses);
      const std::size_t plane = line.find("G1");
      REQUIRE(plane < sense);
      for (const char code : {'7', '8', '9'})
        if (line[plane + 2] != code) attack(c, with(plane + 2, 1, std::string(1, code)), planes);
    }
    CAPTURE(digits.made, digits.refused, senses.made, planes.made);
    CHECK(senses.refused == senses.made);
    CHECK(planes.refused == planes.made);
    CHECK(digits.made > 20);
    CHECK(3 * digits.refused > digits.made);
  }
}
