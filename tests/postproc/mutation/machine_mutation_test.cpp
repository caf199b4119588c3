// `check --against` with a wrong machine file: an unchanged program, and one number of the machine
// that it runs on is another. What is certified all the same has to be equivalent by oracle.h.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "tests/postproc/mutation/mutation_cases.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

struct MachineFault {
  std::string what;
  MachineDefinition machine;
};

std::string coordinate(int k) { return std::string(1, "xyz"[k]); }

/// Signs, places and limits, one at a time.
std::vector<MachineFault> faults_of(const MachineDefinition& right) {
  std::vector<MachineFault> faults;
  const auto add = [&](const std::string& what, const auto& change) {
    faults.push_back({what, right});
    change(faults.back().machine);
  };
  for (std::size_t j = 0; j < right.axes.size(); ++j) {
    const std::string name = right.axes[j].name;
    const bool rotary = right.axes[j].joint.kind == JointKind::rotary;
    add("direction of " + name, [&](MachineDefinition& m) { m.axes[j].joint.direction *= -1.0; });
    add("side of " + name, [&](MachineDefinition& m) {
      auto& side = m.axes[j].joint.side;
      side = side == ChainSide::tool ? ChainSide::workpiece : ChainSide::tool;
    });
    add("upper limit of " + name, [&](MachineDefinition& m) {
      m.axes[j].joint.upper = 0.5 * (m.axes[j].joint.lower + m.axes[j].joint.upper);
    });
    add("lower limit of " + name, [&](MachineDefinition& m) {
      m.axes[j].joint.lower = 0.5 * (m.axes[j].joint.lower + m.axes[j].joint.upper);
    });
    add("velocity of " + name, [&](MachineDefinition& m) { m.axes[j].velocity *= 0.01; });
    for (std::size_t k = j + 1; k < right.axes.size(); ++k)
      add("exchanged directions of " + name + " and " + right.axes[k].name,
          [&](MachineDefinition& m) {
            std::swap(m.axes[j].joint.direction, m.axes[k].joint.direction);
          });
    for (int k = 0; k < 3 && rotary; ++k)
      for (const double by : {-0.1, 2.0})
        add("pivot of " + name + " along " + coordinate(k),
            [&](MachineDefinition& m) { m.axes[j].joint.origin[k] += by; });
    if (rotary)
      add("tilt of " + name, [&](MachineDefinition& m) {
        Vec3& d = m.axes[j].joint.direction;
        d = rotation_about(d.unitOrthogonal(), 0.5 * kRadiansPerDegree) * d;
      });
  }
  for (int k = 0; k < 3; ++k) {
    add("tip along " + coordinate(k), [&](MachineDefinition& m) { m.tool.tip[k] += 0.1; });
    add("flange along " + coordinate(k),
        [&](MachineDefinition& m) { m.tool.flange.translation()[k] += 0.1; });
    add("part along " + coordinate(k),
        [&](MachineDefinition& m) { m.workpiece.frame.translation()[k] += 0.1; });
  }
  add("tool axis", [](MachineDefinition& m) {
    m.tool.axis = rotation_about(m.tool.axis.unitOrthogonal(), kRadiansPerDegree) * m.tool.axis;
  });
  return faults;
}

void run_attack(std::size_t every) {
  const char* path = std::getenv("SMOOTHPOST_MUTATION_LOG");
  std::ofstream log(path == nullptr ? "/dev/null" : std::string(path) + ".machine");
  int made = 0, caught = 0, equivalent = 0;
  for (std::size_t n = 0; n < mutation_cases().size(); n += every) {
    const MutationCase c = make_case(mutation_cases()[n]);
    const Dialect* dialect = find_dialect(c.check.machine.dialect.name);
    for (const MachineFault& fault : faults_of(c.check.machine)) {
      ++made;
      CheckInput in = c.check;
      in.machine = fault.machine;
      const Conversion verdict = check_program(in, {});
      if (verdict.verdict != Verdict::certified) {
        ++caught;
        continue;
      }
      const auto read = dialect->read_back(fault.machine, c.check.text, "program");
      REQUIRE(read.ok());
      OracleMachine machine = c.machine;
      machine.machine = fault.machine;
      INFO(c.name << ": " << fault.what);
      const std::string why =
          oracle_fault({read.value(), verdict.read, machine, c.beam, c.wanted, c.unchanged});
      log << (why.empty() ? "equivalent " : "FAULT " + why + " | ") << c.name << ": " << fault.what
          << "\n";
      CHECK(why == "");
      ++equivalent;
    }
  }
  log << "machine files: " << made << " made, " << caught << " refused, " << equivalent
      << " certified\n";
  CHECK(made > 1500 / static_cast<int>(every));
  CHECK(caught > made / 2);
}

}  // namespace

TEST_CASE("mutation: a program on a wrong machine file is refused or equivalent",
          "[postproc][mutation]") {
  run_attack(4);
}

TEST_CASE("mutation: programs of all dialects on wrong machine files",
          "[postproc][mutation][slow]") {
  run_attack(1);
}
