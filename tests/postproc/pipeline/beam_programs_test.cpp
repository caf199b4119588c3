#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <map>
#include <random>
#include <set>
#include <sstream>

#include "kernels/core/units.h"
#include "postproc/pipeline/convert.h"
#include "tests/postproc/pipeline/paths.h"

// Generated beam programs, converted to every beam machine and dialect: what no certified program
// may do.
using namespace smoothpost;
using namespace smoothpost::test;

namespace {

// ------------------------------------------------------------------------------- the programs

class Generator {
 public:
  explicit Generator(unsigned seed) : rng_(seed) {}

  std::string program() {
    text_ = "%\nM428\nG21 G90 G17 G94\nG54\nG0 X0 Y0 Z60 C0 B0\n";
    if (coin()) text_ += "M67 E0 Q55\n";
    cuts_ = 1 + static_cast<int>(rng_() % 4);
    for (int i = 0; i < cuts_; ++i) cut();
    text_ += "G0 Z60\nM429\nM30\n%\n";
    return text_;
  }
  int cuts() const { return cuts_; }

 private:
  double between(double low, double high) {
    return low + (high - low) * std::uniform_real_distribution<double>(0, 1)(rng_);
  }
  bool coin() { return rng_() % 2 == 0; }
  void words(const char* code, const char* tail = "") {
    char line[160];
    std::snprintf(line, sizeof line, "%s X%.4f Y%.4f Z%.4f C%.4f B%.4f%s\n", code, x_, y_, z_, c_,
                  b_, tail);
    text_ += line;
  }
  void place() {
    x_ = between(-80, 80);
    y_ = between(-80, 80);
    c_ = rng_() % 3 == 0 ? 0.0 : between(-120, 120);
    b_ = rng_() % 3 == 0 ? 0.0 : between(-35, 35);
  }

  void cut() {
    place();
    z_ = 60;
    words("G0");
    if (rng_() % 5 == 0) words("G0");  // goes nowhere
    const bool gas = coin(), follow = coin();
    if (gas && coin())
      text_ += "M64 P1\n";
    else if (gas)
      gas_later_ = true;
    z_ = between(1, 12);
    words("G0");
    if (gas_later_) text_ += "M64 P1\n";
    gas_later_ = false;
    if (follow) text_ += "M64 P2\n";
    if (coin()) text_ += "M67 E0 Q" + std::to_string(20 + rng_() % 80) + "\n";
    z_ -= 0.5;
    words("G1", " F3000");
    if (coin()) text_ += "M64 P0\n";
    text_ += "M62 P0\n";
    const int moves = 1 + static_cast<int>(rng_() % 6);
    for (int i = 0; i < moves; ++i) {
      motion();
      if (i + 1 == moves) break;
      if (rng_() % 6 == 0) text_ += "M67 E0 Q" + std::to_string(20 + rng_() % 80) + "\n";
      if (rng_() % 4 == 0) micro_joint();
    }
    text_ += "M63 P0\n";
    if (follow) text_ += "M65 P2\n";
    if (coin()) {
      z_ += 20;
      words("G0");
    }
    if (gas) text_ += "M65 P1\n";
  }

  void motion() {
    char tail[64];
    std::snprintf(tail, sizeof tail, " F%.0f", between(500, 6000));
    if (rng_() % 4 == 0) {  // a full circle or an arc to its other end
      const double i = between(-15, 15), j = between(-15, 15);
      const bool full = coin();
      char line[160];
      if (!full) x_ += 2 * i, y_ += 2 * j;
      std::snprintf(line, sizeof line, "%s X%.4f Y%.4f I%.4f J%.4f%s\n", coin() ? "G2" : "G3", x_,
                    y_, i, j, tail);
      text_ += line;
      return;
    }
    x_ += between(-25, 25);
    y_ += between(-25, 25);
    z_ += between(-2, 2);
    if (coin()) {
      c_ += between(-12, 12);
      b_ += between(-8, 8);
    }
    words("G1", tail);
  }

  void micro_joint() {
    text_ += "M63 P0\n";
    const double step = coin() ? between(0.2, 1.5) : between(4, 9);
    x_ += step;
    words("G1", " F3000");
    text_ += "M62 P0\n";
  }

  std::mt19937 rng_;
  std::string text_;
  int cuts_ = 0;
  bool gas_later_ = false;
  double x_ = 0, y_ = 0, z_ = 0, c_ = 0, b_ = 0;
};

// ------------------------------------------------------------------------------- the machines

EventWords row(const char* event, const char* text, bool on_the_fly = false, double dwell = 0.0,
               double latency = 0.0) {
  EventWords words;
  words.event = event;
  words.text = text;
  words.on_the_fly = on_the_fly;
  words.dwell = dwell;
  words.latency = latency;
  return words;
}

MachineDefinition siemens(const char* mode) {
  MachineDefinition machine = shipped_machine("laser_5p1");
  machine.dialect.name = "siemens_840d";
  machine.dialect.mode = mode;
  if (machine.dialect.mode == "tcp") {  // the control has the joints there, not we
    machine.recipe.optimise = "none";
    machine.recipe.orientation = "programmed";
    machine.power.min_cut_speed = 0.0;  // programs of chance have corners of any kind
  }
  machine.dialect.start = {};
  machine.dialect.end = {"M30"};
  machine.links.rapid = RapidMotion::independent;
  machine.process.events = {row("beam_on", "M70", true, 0.0, 0.002),
                            row("beam_off", "M71", true, 0.0, 0.002),
                            row("pierce", "M72", false, 0.3),
                            row("gas_on", "M73"),
                            row("gas_off", "M74"),
                            row("follow_on", "M75"),
                            row("follow_off", "M76"),
                            row("power", "H2={percent}", true)};
  return machine;
}

MachineDefinition robot() {
  MachineDefinition machine = shipped_machine("robot_6r");
  machine.process.events = {row("beam_on", "$OUT[1]=TRUE", true, 0.0, 0.002),
                            row("beam_off", "$OUT[1]=FALSE", true, 0.0, 0.002),
                            row("pierce", "$OUT[4]=TRUE", false, 0.3),
                            row("gas_on", "$OUT[2]=TRUE"),
                            row("gas_off", "$OUT[2]=FALSE"),
                            row("follow_on", "$OUT[3]=TRUE"),
                            row("follow_off", "$OUT[3]=FALSE"),
                            row("power", "$ANOUT[1]=0.01*{percent}", true)};
  return machine;
}

struct Target {
  const char* name;
  MachineDefinition machine;
  Pose placement;
};

std::vector<Target> targets() {
  return {
      {"laser_5p1 linuxcnc", shipped_machine("laser_5p1"), shifted(700, 600, 1000)},
      {"laser_5p1_offset linuxcnc", shipped_machine("laser_5p1_offset"), shifted(700, 600, 1000)},
      {"laser_5p1 siemens joint", siemens("joint"), shifted(700, 600, 1000)},
      {"laser_5p1 siemens tcp", siemens("tcp"), shifted(700, 600, 1000)},
      {"robot_6r krl", robot(), shifted(0, 0, 0)}};
}

// ---------------------------------------------------------------------------------- the rules

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// What a certified program breaks; empty when nothing.
std::string broken(const Conversion& c, const MachineDefinition& machine) {
  std::map<std::uint32_t, MoveRole> role;
  for (const auto& e : c.line_map) role[e.output_line] = e.role;
  const bool arm = machine.axis_by_name(machine.links.retract_axis) < 0;
  const int retract = machine.axis_by_name(machine.links.retract_axis);
  const auto lines = lines_of(c.program);
  std::vector<std::uint32_t> labels;
  std::map<int, int> cuts;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const auto at = lines[i].find("CUT ");
    if (at == std::string::npos || lines[i].find(" from input line ") == std::string::npos)
      continue;
    labels.push_back(static_cast<std::uint32_t>(i + 1));
    ++cuts[std::stoi(lines[i].substr(at + 4))];
  }
  if (cuts.size() != c.cuts.size()) return "a cut has no label";
  for (const auto& [number, count] : cuts)
    if (count != 1) return "a cut has two labels";

  const auto& moves = c.read.moves;
  std::size_t label = 0;
  for (std::size_t i = 0; i < moves.size(); ++i) {
    const auto found = role.find(moves[i].line);
    if (found == role.end()) return "a move without an entry in the map";
    if (moves[i].beam && found->second == MoveRole::link) return "beam during a link";
    if (moves[i].beam && moves[i].rapid) return "beam during a rapid";
    const bool behind_label = label < labels.size() && moves[i].line > labels[label];
    if (behind_label) ++label;
    if (i > 0 && !behind_label) continue;
    if (arm) {
      if (lines[moves[i].line - 1].rfind("PTP ", 0) != 0) return "a label without a joint move";
      if (moves[i].known != 0x3fU) return "a first move that leaves joints out";
      continue;
    }
    if (!moves[i].rapid) return "a first move that is a feed";
    if (i == 0 && moves[i].known != 1U << retract) return "a first move of several axes";
    // One group of axes: the retract axis, the rotaries, or the other linears.
    std::set<int> groups;
    for (int j = 0; i > 0 && j < machine.size(); ++j) {
      if (moves[i].to[j] == moves[i - 1].to[j]) continue;
      const auto kind = machine.axes[static_cast<std::size_t>(j)].joint.kind;
      groups.insert(j == retract ? 0 : kind == JointKind::rotary ? 1 : 2);
    }
    if (groups.size() > 1) return "a first move of several axis groups";
  }
  if (label != labels.size()) return "a label without a move";
  return {};
}

struct Count {
  int certified = 0;
  int refused = 0;
  std::map<std::string, int> codes;
  std::map<std::string, int> examples;  ///< first seed of each
};

void run(int first, int last, std::map<std::string, Count>& counts) {
  static const std::vector<Target> machines = targets();
  for (int seed = first; seed < last; ++seed) {
    Generator generator(static_cast<unsigned>(seed));
    const std::string text = generator.program();
    ConvertInput in;
    in.input = read_program(text, "laser_5p1");
    in.input_name = "part.ngc";
    const Target& target = machines[static_cast<std::size_t>(seed) % machines.size()];
    in.machine = target.machine;
    in.placement = target.placement;
    const Conversion c = convert(in, false, {});
    Count& count = counts[target.name];
    if (c.verdict != Verdict::certified) {
      ++count.refused;
      std::string codes;
      for (const auto& d : c.diagnostics)
        if (d.severity == Severity::error)
          codes = d.code + (d.code == "CK101" ? d.text.substr(5, d.text.find(" failed") - 5) : "");
      ++count.codes[codes];
      count.examples.try_emplace(codes, seed);
      continue;
    }
    ++count.certified;
    const std::string fault = broken(c, in.machine);
    INFO(target.name << " seed " << seed << ": " << fault << "\n" << text);
    REQUIRE(fault.empty());
  }
}

std::string table(const std::map<std::string, Count>& counts) {
  std::ostringstream out;
  for (const auto& [name, count] : counts) {
    out << name << ": " << count.certified << " certified, " << count.refused << " refused";
    for (const auto& [code, n] : count.codes)
      out << "; " << code << " " << n << " (seed " << count.examples.at(code) << ")";
    out << "\n";
  }
  return out.str();
}

}  // namespace

TEST_CASE("beam programs: what no certified program does on any machine",
          "[postproc][pipeline][beam_programs]") {
  std::map<std::string, Count> counts;
  run(0, 60, counts);
  INFO(table(counts));
  REQUIRE(counts.size() == 5);
  for (const auto& [name, count] : counts) CHECK(count.refused <= 0.05 * count.certified);
}

TEST_CASE("beam programs: polynomials are certified where lines are, in fewer blocks",
          "[postproc][pipeline][beam_programs][curves]") {
  MachineDefinition lines = siemens("joint"), curves = lines;
  std::size_t blocks = 0, fewer = 0;
  for (int seed = 100; seed < 116; ++seed) {
    Generator generator(static_cast<unsigned>(seed));
    const std::string text = generator.program();
    ConvertInput in;
    in.input = read_program(text, "laser_5p1");
    in.placement = shifted(700, 600, 1000);
    in.machine = lines;
    const Conversion straight = convert(in, false, {});
    curves.dialect.curves = seed % 2 == 0 ? "cubic" : "quintic";
    in.machine = curves;
    const Conversion bent = convert(in, false, {});
    for (const auto& d : bent.diagnostics) UNSCOPED_INFO(to_string(d));
    INFO("seed " << seed << "\n" << text);
    REQUIRE(bent.verdict == straight.verdict);
    if (bent.verdict != Verdict::certified) continue;
    REQUIRE(broken(bent, in.machine).empty());
    REQUIRE(bent.blocks <= straight.blocks);
    blocks += straight.blocks;
    fewer += bent.blocks;
  }
  CAPTURE(blocks, fewer);
  CHECK(2 * fewer < blocks);
}

TEST_CASE("beam programs: the rules find their own faults", "[postproc][pipeline][beam_programs]") {
  for (const Target& target : targets()) {
    Generator generator(21);
    ConvertInput in;
    in.input = read_program(generator.program(), "laser_5p1");
    in.machine = target.machine;
    in.placement = target.placement;
    const Conversion good = convert(in, false, {});
    INFO(target.name);
    REQUIRE(good.verdict == Verdict::certified);
    REQUIRE(broken(good, in.machine).empty());
    std::map<std::uint32_t, MoveRole> role;
    for (const auto& e : good.line_map) role[e.output_line] = e.role;
    std::size_t link = 0, path = 0;
    for (std::size_t i = 0; i < good.read.moves.size(); ++i)
      (role[good.read.moves[i].line] == MoveRole::link ? link : path) = i;
    Conversion c = good;
    c.read.moves[link].beam = true;
    CHECK(broken(c, in.machine) == "beam during a link");
    c = good;
    c.read.moves[path].beam = c.read.moves[path].rapid = true;
    CHECK(broken(c, in.machine) == "beam during a rapid");
    c = good;
    c.read.moves[0].known ^= 3U;
    CHECK_FALSE(broken(c, in.machine).empty());
    c = good;
    const auto at = c.program.find(" from input line ");
    c.program.replace(at, 17, " from input  line ");
    CHECK(broken(c, in.machine) == "a cut has no label");
  }
}

namespace {

TriangleMesh sheet() {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices.emplace_back(i & 1 ? 150 : -150, i & 2 ? 150 : -150, i & 4 ? 0 : -3);
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

}  // namespace

TEST_CASE("beam programs: low links over a part", "[postproc][pipeline][beam_programs]") {
  std::string text = "%\nM428\nG21 G90 G17 G94\nG54\nG0 X0 Y0 Z60 C20 B3\n";
  for (int i = 0; i < 8; ++i) {
    const std::string x = std::to_string(-100 + 25 * i), y = std::to_string(40 * (i % 3) - 40);
    text += "G0 X" + x + " Y" + y + " B" + std::to_string(3 + i % 3) + "\nG0 Z1\nM62 P0\n";
    text += "G3 X" + x + " Y" + y + " I5 J0 F3000\nM63 P0\nG0 Z60\n";
  }
  text += "M429\nM30\n%\n";
  for (const Target& target : targets()) {
    if (target.machine.axis_by_name("Z") < 0) continue;  // arms have none
    ConvertInput in;
    in.input = read_program(text, "laser_5p1");
    in.machine = target.machine;
    in.placement = target.placement;
    in.part = sheet();
    const Conversion c = convert(in, false, {});
    INFO(target.name);
    for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
    REQUIRE(c.verdict == Verdict::certified);
    CHECK(broken(c, in.machine).empty());
    ScrewChain chain = chain_of(in.machine);
    chain.workpiece_home = chain.workpiece_home * in.placement;
    std::map<std::uint32_t, MoveRole> role;
    for (const auto& e : c.line_map) role[e.output_line] = e.role;
    const auto& moves = c.read.moves;
    std::size_t first_cut = 0, last_cut = 0;
    for (std::size_t i = 0; i < moves.size(); ++i)
      if (role[moves[i].line] == MoveRole::path) last_cut = i;
    while (role[moves[first_cut].line] == MoveRole::link) ++first_cut;
    double highest = 0.0;
    for (std::size_t i = first_cut; i < last_cut; ++i) {
      if (role[moves[i].line] != MoveRole::link) continue;
      highest = std::max(highest, moves[i].to[2]);
      const JointVector step = moves[i].to - moves[i - 1].to;
      if (in.machine.links.rapid == RapidMotion::independent && moves[i].rapid)
        CHECK((step.array().abs() > 1e-9).count() <= 1);
      for (int k = 0; k <= 20; ++k)
        CHECK(forward_location(chain, moves[i - 1].to + 0.05 * k * step).tip.z() > 0.99);
    }
    CHECK(highest > 0.0);
    CHECK(highest < in.machine.links.retract - 500.0);  // every link between them is low
  }
}

TEST_CASE("beam programs: many", "[.slow][slow][beam_programs]") {
  std::map<std::string, Count> counts;
  run(1000, 11000, counts);
  WARN(table(counts));
  for (const auto& [name, count] : counts) CHECK(count.refused <= 0.05 * count.certified);
}
