// Programs that were changed in one place and are checked against their input: what is certified
// all the same has to follow it, by a comparison of its own.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <optional>
#include <random>

#include "kernels/core/units.h"
#include "postproc/pipeline/cuts.h"
#include "tests/postproc/pipeline/dialect_cases.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

using Lines = std::vector<std::string>;

Lines lines_of(const std::string& text) {
  Lines lines;
  for (std::size_t at = 0; at < text.size();) {
    const auto end = std::min(text.find('\n', at), text.size());
    lines.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

/// Numbers at the start of lines (N12, 12, 12:) anew, so that a dropped block is not found by them.
std::string renumbered(const Lines& lines, const std::string& dialect) {
  std::string text;
  int number = dialect.rfind("heidenhain", 0) == 0 ? 0 : 1;
  for (const std::string& line : lines) {
    std::string head;
    std::size_t end = 0;
    const auto digits_from = [&line](std::size_t at) {
      while (at < line.size() && line[at] >= '0' && line[at] <= '9') ++at;
      return at;
    };
    if (line.size() > 1 && line[0] == 'N' && (end = digits_from(1)) > 1) {
      head = "N" + std::to_string(number++);
    } else if (dialect.rfind("heidenhain", 0) == 0 && (end = digits_from(0)) > 0) {
      head = std::to_string(number++);
    } else if (const auto colon = line.find(':');
               dialect == "fanuc_ls" && colon != std::string::npos && colon > 0 && colon < 6 &&
               digits_from(line.find_first_not_of(' ')) == colon) {
      const std::string digits = std::to_string(number);
      head = std::string(digits.size() < 4 ? 4 - digits.size() : 0, ' ') + digits;
      ++number;
      end = colon;
    } else {
      end = 0;
    }
    text += head + line.substr(end) + "\n";
  }
  return text;
}

/// Makes one change. Empty when this change has no place in the line it fell on.
class Mutator {
 public:
  explicit Mutator(unsigned seed) : rng_(seed) {}

  std::string change(Lines lines, const std::string& dialect, std::string& kind) {
    static const std::vector<std::pair<const char*, bool (Mutator::*)(Lines&, std::size_t)>> kinds =
        {{"digit", &Mutator::digit},  {"sign", &Mutator::sign},   {"drop", &Mutator::drop},
         {"double", &Mutator::twice}, {"swap", &Mutator::swap},   {"axes", &Mutator::axes},
         {"mode", &Mutator::mode},    {"delete", &Mutator::erase}};
    const auto& [name, make] = kinds[pick(kinds.size())];
    kind = name;
    return (this->*make)(lines, pick(lines.size())) ? renumbered(lines, dialect) : std::string();
  }

 private:
  std::size_t pick(std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(rng_);
  }

  // A place in the line with one of these characters.
  std::optional<std::size_t> place(const std::string& line, std::string_view of) {
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < line.size(); ++i)
      if (of.find(line[i]) != std::string_view::npos) places.push_back(i);
    if (places.empty()) return std::nullopt;
    return places[pick(places.size())];
  }
  bool digit(Lines& lines, std::size_t i) {
    const auto at = place(lines[i], "0123456789");
    if (at)
      lines[i][*at] =
          static_cast<char>('0' + (lines[i][*at] - '0' + 1 + static_cast<int>(pick(9))) % 10);
    return at.has_value();
  }
  bool sign(Lines& lines, std::size_t i) {
    if (const auto at = place(lines[i], "-+")) {
      if (lines[i][*at] == '+')
        lines[i][*at] = '-';
      else
        lines[i].erase(*at, 1);
      return true;
    }
    const auto at = place(lines[i], "XYZABCUVWIJK=[{,");
    if (at) lines[i].insert(*at + 1, "-");
    return at.has_value();
  }
  bool drop(Lines& lines, std::size_t i) {
    lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(i));
    return true;
  }
  bool twice(Lines& lines, std::size_t i) {
    lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(i), lines[i]);
    return true;
  }
  bool swap(Lines& lines, std::size_t i) {
    if (i + 1 == lines.size() || lines[i] == lines[i + 1]) return false;
    std::swap(lines[i], lines[i + 1]);
    return true;
  }
  bool axes(Lines& lines, std::size_t i) {
    const auto a = place(lines[i], "XYZABCUVW"), b = place(lines[i], "XYZABCUVW");
    if (!a || !b || lines[i][*a] == lines[i][*b]) return false;
    std::swap(lines[i][*a], lines[i][*b]);
    return true;
  }
  bool mode(Lines& lines, std::size_t i) {
    static const std::vector<std::pair<std::string, std::string>> words = {
        {"G1", "G0"},         {"G0", "G1"},       {"G90", "G91"},        {"G21", "G20"},
        {"G93", "G94"},       {"G94", "G93"},     {"G61", "G64"},        {"G53 ", ""},
        {"M62", "M63"},       {"M63", "M62"},     {"M3", "M4"},          {"M5", "M3"},
        {"M8", "M9"},         {"M80", "M81"},     {"M81", "M80"},        {"LIN", "PTP"},
        {"MoveL", "MoveJ"},   {"movel", "movej"}, {"MOVL", "MOVJ"},      {"FINE", "CR9"},
        {"fine", "z10"},      {"C_DIS", ""},      {"mm/sec", "deg/sec"}, {"TRAORI", "TRAFOOF"},
        {"ORIWKS", "ORIMKS"}, {"P1", "P2"},       {"FMAX", "F9"},        {"M91", ""}};
    std::vector<std::size_t> fit;
    for (std::size_t k = 0; k < words.size(); ++k)
      if (lines[i].find(words[k].first) != std::string::npos) fit.push_back(k);
    if (fit.empty()) return false;
    const auto& [from, to] = words[fit[pick(fit.size())]];
    lines[i].replace(lines[i].find(from), from.size(), to);
    return true;
  }
  bool erase(Lines& lines, std::size_t i) {
    if (lines[i].empty()) return false;
    lines[i].erase(pick(lines[i].size()), 1);
    return true;
  }

  std::mt19937 rng_;
};

/// What cuts, as samples: the feeds with the beam on or, without a beam, all feeds.
struct CutSample {
  CutterLocation location;
  std::string process;
  bool near_change = false;  // within the event tolerance of where the process changes
};

/// Names of the states that are on, with the beam.
std::string process_text(const std::map<std::string, std::string>& states, bool beam) {
  std::string text = beam ? "beam" : "";
  for (const auto& [group, event] : states) text += " " + event;
  return text;
}

std::vector<CutSample> cut_samples(const Conversion& c, const ConvertInput& in, bool beam) {
  ScrewChain chain = chain_of(in.machine, beam ? 0.0 : 60.0);
  chain.workpiece_home = chain.workpiece_home * in.placement;
  std::vector<CutSample> samples;
  std::map<std::string, std::string> states;
  std::size_t event = 0;
  JointVector from;
  bool cutting = false;
  for (std::size_t i = 0; i < c.read.moves.size(); ++i) {
    const ReadBackMove& move = c.read.moves[i];
    for (; event < c.read.events.size() && c.read.events[event].before <= i; ++event)
      if (c.read.events[event].name != event_name::kPower)
        note_state(c.read.events[event].name, states);
    if (!move.rapid && (!beam || move.beam) && from.size() > 0) {
      const CutterLocation a = forward_location(chain, from), b = forward_location(chain, move.to);
      const int n =
          1 + static_cast<int>(std::max((a.tip - b.tip).norm() / 0.02,
                                        angle_between(a.axis, b.axis) / radians_from_degrees(0.1)));
      for (int k = cutting ? 1 : 0; k <= n; ++k)
        samples.push_back(
            {forward_location(chain, from + static_cast<double>(k) / n * (move.to - from)),
             process_text(states, move.beam), false});
      cutting = true;
    } else {
      cutting = false;
    }
    from = move.to;
  }
  const double reach = in.machine.tolerance.event + 0.1;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    if (samples[i].process == samples[i - 1].process) continue;
    for (auto& s : samples)
      if ((s.location.tip - samples[i].location.tip).norm() < reach) s.near_change = true;
  }
  return samples;
}

/// Fréchet: whether both walk the same way, each within twice the tolerances of the other (both are
/// within one of the input), in the same process.
bool follow_each_other(const std::vector<CutSample>& a, const std::vector<CutSample>& b,
                       const MachineDefinition& machine) {
  const double tip = 2.0 * machine.tolerance.tip + 0.02,
               axis = 2.0 * machine.tolerance.axis + radians_from_degrees(0.1);
  const auto close = [&](const CutSample& x, const CutSample& y) {
    return (x.location.tip - y.location.tip).norm() <= tip &&
           angle_between(x.location.axis, y.location.axis) <= axis &&
           (x.process == y.process || x.near_change || y.near_change);
  };
  if (a.empty() || b.empty()) return a.empty() == b.empty();
  std::vector<char> reach(b.size(), 0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::vector<char> next(b.size(), 0);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const bool from = (i == 0 && j == 0) ||
                        (i > 0 && (reach[j] != 0 || (j > 0 && reach[j - 1] != 0))) ||
                        (j > 0 && next[j - 1] != 0);
      next[j] = from && close(a[i], b[j]) ? 1 : 0;
    }
    reach = std::move(next);
  }
  return reach.back() != 0;
}

struct Tally {
  std::size_t tried = 0, refused = 0, survived = 0, wrong = 0;
};

/// Changes of the program of one case.
Tally attack(const DialectCase& c, std::size_t mutants, unsigned seed) {
  Tally tally;
  const bool beam = is_laser(c.machine);
  const ConvertInput in = short_job(c);
  const Conversion good = convert(in, false, {});
  REQUIRE(good.verdict == Verdict::certified);
  CheckInput check;
  check.file_name = "out";
  check.machine = in.machine;
  check.placement = in.placement;
  check.against = in.input;
  check.tool_length = beam ? 0.0 : 60.0;
  check.collision_check = false;
  const Lines lines = lines_of(good.program);
  check.text = renumbered(lines, c.dialect);
  const Conversion unchanged = check_program(check, {});
  for (const auto& d : unchanged.diagnostics) UNSCOPED_INFO(to_string(d));
  REQUIRE(unchanged.verdict == Verdict::certified);
  const auto wanted = cut_samples(unchanged, in, beam);
  REQUIRE(wanted.size() > 100);
  Mutator mutator(seed);
  while (tally.tried < mutants) {
    std::string kind;
    check.text = mutator.change(lines, c.dialect, kind);
    if (check.text.empty() || check.text == good.program) continue;
    ++tally.tried;
    const Conversion found = check_program(check, {});
    if (found.verdict != Verdict::certified) {
      ++tally.refused;
      continue;
    }
    ++tally.survived;
    if (follow_each_other(wanted, cut_samples(found, in, beam), in.machine)) continue;
    ++tally.wrong;
    const Lines changed = lines_of(check.text);
    std::string difference;
    for (std::size_t i = 0; i < std::max(lines.size(), changed.size()) && difference.size() < 400;
         ++i) {
      const std::string was = i < lines.size() ? lines[i] : "",
                        is = i < changed.size() ? changed[i] : "";
      if (was != is) difference += std::to_string(i + 1) + ": " + was + "\n     " + is + "\n";
    }
    UNSCOPED_INFO(c.machine << " " << c.dialect << " " << kind << "\n" << difference);
    CHECK(false);
  }
  return tally;
}

void attack_all(const std::vector<DialectCase>& cases, std::size_t mutants) {
  unsigned seed = 1000;
  Tally sum;
  std::string table;
  for (const auto& c : cases) {
    const Tally t = attack(c, mutants, ++seed);
    table += c.machine + " " + c.dialect + ": " + std::to_string(t.tried) + " changed, " +
             std::to_string(t.refused) + " refused, " + std::to_string(t.survived) +
             " follow the input\n";
    sum.tried += t.tried;
    sum.refused += t.refused;
    sum.wrong += t.wrong;
  }
  INFO(table);
  CHECK(sum.wrong == 0);
  CHECK(sum.tried == mutants * cases.size());
  CHECK(4 * sum.refused > sum.tried);
  WARN(table << sum.tried << " changed, " << sum.refused << " refused, " << sum.wrong << " wrong");
}

/// Every dialect once, on a machine of the kind it is for.
std::vector<DialectCase> one_each() {
  std::vector<DialectCase> cases;
  for (const auto& dialect : dialects())
    for (const char* machine : {"table_table_bc", "robot_6r"})
      if (is_suited(machine, dialect.name) &&
          (cases.empty() || cases.back().dialect != dialect.name))
        cases.push_back({machine, dialect.name});
  cases.push_back({"laser_5p1", "linuxcnc"});
  return cases;
}

}  // namespace

TEST_CASE("mutants: a program changed in one place is refused or still follows its input",
          "[postproc][pipeline][attack]") {
  attack_all(one_each(), 20);
}

TEST_CASE("mutants: 20000 changes", "[.slow][attack]") {
  auto cases = one_each();
  for (const char* dialect : {"siemens_840d", "fanuc_30i_vectors", "heidenhain_vectors"})
    cases.push_back({"head_table_bc", dialect});
  cases.push_back({"laser_5p1", "siemens_840d"});
  attack_all(cases, 1 + 20000 / cases.size());
}
