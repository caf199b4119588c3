// `check --against` attacked: programs with one fault each. What survives has to be equivalent by
// oracle.h.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <sstream>

#include "tests/postproc/mutation/mutation_cases.h"
#include "tests/postproc/mutation/mutator.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

struct Tally {
  int made = 0;
  int by_reader = 0;   ///< refused by the dialect's reader
  int by_check = 0;    ///< refused by the checker
  int same_text = 0;   ///< read as the unchanged program is: see insignificant()
  int equivalent = 0;  ///< certified, and equivalent by the oracle
  int faults = 0;      ///< certified, and not equivalent

  Tally& operator+=(const Tally& o) {
    made += o.made;
    by_reader += o.by_reader;
    by_check += o.by_check;
    same_text += o.same_text;
    equivalent += o.equivalent;
    faults += o.faults;
    return *this;
  }
};

bool same(const std::optional<Pose>& a, const std::optional<Pose>& b) {
  return a.has_value() == b.has_value() && (!a || a->matrix() == b->matrix());
}

bool same(const JointArc& a, const JointArc& b) {
  return a.turn == b.turn && a.first == b.first && a.second == b.second &&
         a.centre_first == b.centre_first && a.centre_second == b.centre_second;
}

/// Everything that a reader found, but for lines.
bool same_reading(const ReadBack& a, const ReadBack& b) {
  if (a.moves.size() != b.moves.size() || a.events.size() != b.events.size()) return false;
  for (std::size_t i = 0; i < a.moves.size(); ++i) {
    const ReadBackMove &m = a.moves[i], &n = b.moves[i];
    if (m.to != n.to || m.known != n.known || m.interpolation != n.interpolation ||
        m.tool.matrix() != n.tool.matrix() || m.rapid != n.rapid || m.beam != n.beam ||
        m.blend != n.blend || m.spline != n.spline || m.duration != n.duration ||
        m.bend.rows() != n.bend.rows() || m.bend != n.bend || !same(m.arc, n.arc))
      return false;
  }
  for (std::size_t i = 0; i < a.events.size(); ++i) {
    const ReadBackEvent &e = a.events[i], &f = b.events[i];
    if (e.before != f.before || e.name != f.name || e.seconds != f.seconds || e.beam != f.beam)
      return false;
  }
  return a.offset_guard == b.offset_guard && a.exact_path == b.exact_path && same(a.part, b.part) &&
         same(a.tool_frame, b.tool_frame);
}

/// The line of a text, and the one before it as it was.
std::string changed_lines(const std::string& before, const std::string& after) {
  std::istringstream a(before), b(after);
  std::string x, y;
  while (std::getline(a, x)) {
    if (!std::getline(b, y)) return "end missing behind: " + x;
    if (x != y) return x + "   ->   " + y;
  }
  return {};
}

Tally attack(const MutationCase& c, MutantKind kind, int count, std::uint32_t first_seed,
             std::ostream& log) {
  Tally tally;
  const Mutator mutator(c.check.text, c.events);
  const Dialect* dialect = find_dialect(c.check.machine.dialect.name);
  for (int k = 0; k < count; ++k) {
    const std::uint32_t seed =
        first_seed + 7919U * static_cast<std::uint32_t>(k) + 104729U * static_cast<unsigned>(kind);
    const Mutant mutant = mutator.make(kind, seed);
    if (mutant.text.empty()) continue;
    ++tally.made;
    const auto read = dialect->read_back(c.check.machine, mutant.text, "mutant");
    if (!read.ok()) {
      ++tally.by_reader;
      continue;
    }
    CheckInput in = c.check;
    in.text = mutant.text;
    const Conversion verdict = check_program(in, {});
    if (verdict.verdict != Verdict::certified) {
      ++tally.by_check;
      continue;
    }
    const std::string what = c.name + " " + kMutantNames[static_cast<std::size_t>(kind)] + " " +
                             std::to_string(mutant.line + 1) + ": " +
                             changed_lines(c.check.text, mutant.text);
    if (same_reading(c.read, read.value())) {
      ++tally.same_text;
      log << "same " << what << "\n";
      continue;
    }
    const std::string fault =
        oracle_fault({read.value(), verdict.read, c.machine, c.beam, c.wanted, c.unchanged});
    if (fault.empty()) {
      ++tally.equivalent;
      log << "equivalent " << what << "\n";
    } else {
      ++tally.faults;
      log << "FAULT " << fault << " | " << what << "\n";
    }
  }
  return tally;
}

void run_attack(int per_kind) {
  const char* path = std::getenv("SMOOTHPOST_MUTATION_LOG");
  const char* wanted = std::getenv("SMOOTHPOST_MUTATION_CASE");
  if (const char* many = std::getenv("SMOOTHPOST_MUTATION_PER_KIND")) per_kind = std::atoi(many);
  std::ofstream file(path == nullptr ? "/dev/null" : path);
  std::ostringstream table;
  Tally all;
  table << "dialect and machine, kind: made, reader, check, same reading, equivalent, FAULTS\n";
  std::array<Tally, kMutantKinds> by_kind;
  for (std::size_t n = 0; n < mutation_cases().size(); ++n) {
    if (wanted != nullptr && mutation_cases()[n].dialect.find(wanted) == std::string::npos)
      continue;
    const MutationCase c = make_case(mutation_cases()[n]);
    for (int k = 0; k < kMutantKinds; ++k) {
      const Tally t = attack(c, static_cast<MutantKind>(k), per_kind,
                             1000003U * static_cast<std::uint32_t>(n + 1), file);
      by_kind[static_cast<std::size_t>(k)] += t;
      all += t;
      table << c.name << ", " << kMutantNames[static_cast<std::size_t>(k)] << ": " << t.made << ", "
            << t.by_reader << ", " << t.by_check << ", " << t.same_text << ", " << t.equivalent
            << ", " << t.faults << "\n";
      file.flush();
    }
  }
  for (int k = 0; k < kMutantKinds; ++k) {
    const Tally& t = by_kind[static_cast<std::size_t>(k)];
    table << "ALL, " << kMutantNames[static_cast<std::size_t>(k)] << ": " << t.made << ", "
          << t.by_reader << ", " << t.by_check << ", " << t.same_text << ", " << t.equivalent
          << ", " << t.faults << "\n";
  }
  file << table.str();
  CHECK(all.made > 1000);
  CHECK(all.faults == 0);
}

}  // namespace

TEST_CASE("mutation: the oracle finds the unchanged programs equivalent", "[postproc][mutation]") {
  for (const DialectCase& dialect : mutation_cases()) {
    const MutationCase c = make_case(dialect);
    INFO(c.name);
    const Conversion verdict = check_program(c.check, {});
    for (const auto& d : verdict.diagnostics) UNSCOPED_INFO(to_string(d));
    CHECK(verdict.verdict == Verdict::certified);
    CHECK(oracle_fault({c.read, verdict.read, c.machine, c.beam, c.wanted, c.unchanged}) == "");
  }
}

TEST_CASE("mutation: what check --against certifies of wrong programs is equivalent",
          "[postproc][mutation]") {
  run_attack(4);
}

TEST_CASE("mutation: at least 20000 wrong programs", "[postproc][mutation][slow]") {
  run_attack(60);
}
