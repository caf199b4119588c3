#include "postproc/pipeline/rewind.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>

#include "kernels/core/units.h"
#include "postproc/pipeline/convert.h"
#include "tests/postproc/pipeline/paths.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

/// Tip and axis of a path at a tip length from the start of its segment `first`.
CutterLocation at_length(const ReferencePath& path, std::uint32_t first, double length) {
  std::uint32_t k = first;
  for (; k < path.segments() && length > path.length(k); ++k) length -= path.length(k);
  return path.at(k, std::min(1.0, length / path.length(k)));
}

double length_of(const ReferencePath& path, const Cut& cut) {
  double length = 0.0;
  for (std::uint32_t k = cut.first; k <= cut.last; ++k) length += path.length(k);
  return length;
}

double length_to(const ReferencePath& path, const Cut& cut, const SplitPlace& place) {
  double length = 0.0;
  for (std::uint32_t k = cut.first; k < place.segment; ++k) length += path.length(k);
  return length + place.s * path.length(place.segment);
}

/// One cut of lines, an arc and a helix, with an axis that turns; its events around it.
ToolPath beam_cut() {
  PathMaker maker(Vec3(0, 0, 20));
  maker.feed({0, 0, 0}).event("gas_on").event("follow_on").event("power", {{"percent", "80"}});
  maker.event("pierce").event("beam_on");
  maker.axis({0.1, 0, 1}).feed({30, 0, 0}, 3.0);   // 2: line, the axis turns
  maker.arc({30, 20, 0}, kPi, 0.0, 6.0);           // 3: half circle
  maker.arc({30, 30, 0}, -1.5 * kPi, 4.0, 5.0);    // 4: helix
  maker.axis({0, 0.3, 1}).feed({40, 60, 4}, 4.0);  // 5: line, the axis turns
  maker.event("beam_off").event("follow_off").event("gas_off").rapid({40, 60, 30});
  maker.feed({50, 60, 4}).event("beam_on").feed({70, 60, 4}, 2.0).event("beam_off");
  return maker.take();
}

struct Split {
  ToolPath before;
  ToolPath path;
  std::vector<Cut> cuts_before;
  std::vector<Cut> cuts;
};

Split split(ToolPath path, const std::vector<SplitPlace>& places, double over_burn) {
  Split s;
  s.path = std::move(path);
  s.cuts = find_cuts(s.path, {});
  s.before = s.path;
  s.cuts_before = s.cuts;
  split_cuts(s.path, s.cuts, {}, places, over_burn);
  return s;
}

/// Everything that the header promises of a split path; the halves of `number` start `back` mm
/// before each place.
void check_halves(const Split& s, int number, const std::vector<SplitPlace>& places,
                  const std::vector<double>& back) {
  const ReferencePath before(s.before, {}), after(s.path, {});
  const Cut* old = nullptr;
  for (const Cut& c : s.cuts_before)
    if (c.number == number) old = &c;
  REQUIRE(old);
  std::vector<Cut> halves;
  for (const Cut& c : s.cuts)
    if (c.number == number) halves.push_back(c);
  REQUIRE(halves.size() == places.size() + 1);
  for (std::size_t h = 0; h < halves.size(); ++h) {
    const Cut& half = halves[h];
    CHECK(half.after_rewind == (h > 0));
    const double begin = h == 0 ? 0.0 : length_to(before, *old, places[h - 1]) - back[h - 1];
    const double end =
        h < places.size() ? length_to(before, *old, places[h]) : length_of(before, *old);
    CHECK(length_of(after, half) == Approx(end - begin).margin(2e-3));
    for (int i = 0; i <= 200; ++i) {
      const double length = (end - begin) * i / 200;
      const auto got = at_length(after, half.first, length);
      const auto wanted = at_length(before, old->first, begin + length);
      CHECK((got.tip - wanted.tip).norm() < 5e-3);
      CHECK((got.axis - wanted.axis).norm() < 1e-4);
    }
    for (std::uint32_t k = half.first; k <= half.last; ++k) {
      CHECK_FALSE(s.path.points[k].replanned);
      CHECK(s.path.points[k].kind == MotionKind::feed);
    }
    if (h == 0) continue;
    CHECK(half.first == halves[h - 1].last + 2);  // one link between
    CHECK(s.path.points[half.first - 1].replanned);
    CHECK_FALSE(s.path.points[half.first - 1].beam);
    // The beam is off at the first half's end and on where the second starts.
    bool beam = true;
    for (const auto& e : s.path.events) {
      if (e.point > halves[h - 1].last) break;
      if (e.event.name == "beam_on") beam = true;
      if (e.event.name == "beam_off") beam = false;
    }
    CHECK_FALSE(beam);
    for (const auto& e : s.path.events) {
      if (e.point > half.first - 1) break;
      if (e.event.name == "beam_on") beam = true;
      if (e.event.name == "beam_off") beam = false;
    }
    CHECK(beam);
  }
  for (std::size_t i = 1; i < s.path.events.size(); ++i)
    CHECK(s.path.events[i - 1].point <= s.path.events[i].point);
  for (const auto& e : s.path.events) CHECK(e.point < s.path.points.size());
}

std::vector<std::string> names_at(const ToolPath& path, std::size_t point) {
  std::vector<std::string> names;
  for (const auto& e : path.events)
    if (e.point == point) names.push_back(e.event.name);
  return names;
}

}  // namespace

TEST_CASE("rewind: a cut is split on lines, arcs and helices", "[postproc][pipeline][rewind]") {
  for (std::uint32_t segment = 2; segment <= 5; ++segment)
    for (const double s : {0.2, 0.5, 0.99, 1.0}) {
      if (segment == 5 && s == 1.0) continue;
      const SplitPlace place{segment, s};
      INFO("segment " << segment << " at " << s);
      check_halves(split(beam_cut(), {place}, 2.0), 1, {place}, {2.0});
    }
}

TEST_CASE("rewind: the seam is exactly over_burn long, over corners too",
          "[postproc][pipeline][rewind]") {
  for (const double over_burn : {0.0, 0.5, 2.0, 40.0, 80.0}) {
    const SplitPlace place{4, 0.05};
    INFO(over_burn);
    check_halves(split(beam_cut(), {place}, over_burn), 1, {place}, {over_burn});
  }
  // Never before the cut's own start.
  const SplitPlace early{2, 0.05};
  check_halves(split(beam_cut(), {early}, 2.0), 1, {early}, {0.05 * 30.0});
}

TEST_CASE("rewind: both halves have the events of the cut", "[postproc][pipeline][rewind]") {
  const Split s = split(beam_cut(), {{3, 0.5}}, 2.0);
  REQUIRE(s.cuts.size() == 3);
  CHECK(names_at(s.path, s.cuts[0].last) ==
        std::vector<std::string>{"beam_off", "follow_off", "gas_off"});
  CHECK(names_at(s.path, s.cuts[1].first - 1) ==
        std::vector<std::string>{"gas_on", "follow_on", "power", "pierce", "beam_on"});
  CHECK(names_at(s.path, s.cuts[1].last) == names_at(s.before, s.cuts_before[0].last));
  CHECK(names_at(s.path, s.cuts[2].last) == std::vector<std::string>{"beam_off"});
  // Durations go with the length; the seam counts twice.
  double before = 0.0, after = 0.0, seam = 0.0;
  for (const auto& p : s.before.points) before += p.duration;
  for (const auto& p : s.path.points) after += p.duration;
  seam = 2.0 / (20.0 * kPi) * 6.0;
  CHECK(after == Approx(before + seam));
}

TEST_CASE("rewind: a second half never starts before an event inside the cut",
          "[postproc][pipeline][rewind]") {
  PathMaker maker(Vec3(0, 0, 0));
  maker.event("power", {{"percent", "80"}}).event("beam_on").feed({10, 0, 0});
  maker.event("power", {{"percent", "40"}}).feed({20, 0, 0}).event("beam_off");
  const Split s = split(maker.take(), {{2, 0.1}}, 5.0);
  REQUIRE(s.cuts.size() == 2);
  CHECK(s.path.points[s.cuts[1].first - 1].location.tip.x() == Approx(10.0));
  // The power there is the one that the cut has there.
  std::string power;
  for (const auto& e : s.path.events)
    if (e.point < s.cuts[1].first && e.event.name == "power") power = e.event.parameters[0].second;
  CHECK(power == "40");
}

TEST_CASE("rewind: a split inside a micro-joint", "[postproc][pipeline][rewind]") {
  PathMaker maker(Vec3(0, 0, 0));
  maker.event("gas_on").event("pierce").event("beam_on").feed({20, 0, 0}).event("beam_off");
  maker.feed({22, 0, 0}).event("beam_on").feed({40, 0, 0}).event("beam_off").event("gas_off");
  ToolPath path = maker.take();
  LinkChoice choice;
  choice.micro_joint = 3.0;
  auto cuts = find_cuts(path, choice);
  REQUIRE(cuts.size() == 1);
  split_cuts(path, cuts, {}, {{2, 0.5}}, 5.0);
  REQUIRE(cuts.size() == 2);
  CHECK(path.points[cuts[1].first - 1].location.tip.x() == Approx(20.0));
  // Everywhere the events say what the points say.
  bool beam = false;
  std::size_t next = 0;
  for (std::size_t k = 1; k < path.points.size(); ++k) {
    for (; next < path.events.size() && path.events[next].point < k; ++next) {
      if (path.events[next].event.name == "beam_on") beam = true;
      if (path.events[next].event.name == "beam_off") beam = false;
    }
    INFO("point " << k);
    CHECK(beam == path.points[k].beam);
  }
  CHECK(names_at(path, cuts[1].first - 1) == std::vector<std::string>{"gas_on"});
}

TEST_CASE("rewind: several splits", "[postproc][pipeline][rewind]") {
  SECTION("in segments of their own and in two cuts") {
    const std::vector<SplitPlace> first = {{2, 0.7}, {3, 0.5}, {5, 0.25}};
    std::vector<SplitPlace> all = first;
    all.push_back({8, 0.5});
    const Split s = split(beam_cut(), all, 2.0);
    CHECK(s.cuts.size() == 6);
    check_halves(s, 1, first, {2.0, 2.0, 2.0});
    check_halves(s, 2, {{8, 0.5}}, {2.0});
  }
  SECTION("in one segment") {
    const std::vector<SplitPlace> places = {{3, 0.2}, {3, 0.5}, {3, 0.8}};
    check_halves(split(beam_cut(), places, 2.0), 1, places, {2.0, 2.0, 2.0});
  }
  SECTION("in one segment and at its end") {
    const std::vector<SplitPlace> places = {{3, 0.4}, {3, 1.0}};
    check_halves(split(beam_cut(), places, 2.0), 1, places, {2.0, 2.0});
  }
}

TEST_CASE("rewind: words of rotary axes go on where they were", "[postproc][pipeline][rewind]") {
  auto input = read_program(
      "%\nM428\nG21 G90 G17 G94\nG0 X0 Y0 Z20 C0 B20\nG0 Z1\nM62 P0\nG1 X60 C200 F3000\n"
      "G3 X60 Y40 I0 J20 C-40\nM63 P0\nG0 Z30\nM429\nM30\n%\n",
      "laser_5p1");
  ToolPath path = input.path;
  auto cuts = find_cuts(path, {});
  REQUIRE(cuts.size() == 1);
  const ToolPath old = path;
  const Cut whole = cuts[0];
  const std::vector<SplitPlace> places = {{whole.first, 0.75}, {whole.last, 0.5}};
  split_cuts(path, cuts, input.frames, places, 2.0);
  REQUIRE(cuts.size() == 3);
  const ReferencePath before(old, input.frames), after(path, input.frames);
  for (const auto& [cut, from] : {std::make_pair(cuts[0], 0.0), std::make_pair(cuts[1], 43.0)})
    for (int i = 0; i <= 100; ++i) {
      const double length = 0.01 * i * length_of(after, cut);
      const auto got = at_length(after, cut.first, length);
      const auto wanted = at_length(before, whole.first, from + length);
      CHECK((got.tip - wanted.tip).norm() < 5e-3);
      CHECK((got.axis - wanted.axis).norm() < 1e-3);
    }
}

namespace {

/// A circle of growing radius under a tilted head: C follows the tangent, `blocks` times 5 deg.
std::string spiral(int blocks) {
  std::string text =
      "%\nM428\nG21 G90 G94\nG0 X0 Y0 Z50 B0 C0\nM64 P1\nG0 X60 Y0 Z20 B20 C0\nG0 Z1\nM62 P0\n";
  for (int i = 1; i <= blocks; ++i) {
    const double a = radians_from_degrees(5.0 * i);
    const double r = 60.0 + 0.05 * i;
    char line[120];
    std::snprintf(line, sizeof line, "G1 X%.4f Y%.4f C%.4f F3000\n", r * std::cos(a),
                  r * std::sin(a), 5.0 * i);
    text += line;
  }
  return text + "M63 P0\nM65 P1\nG0 Z50\nM429\nM2\n%\n";
}

Conversion convert_on_laser(const std::string& text, const char* rewind) {
  ConvertInput in;
  in.input = read_program(text, "laser_5p1");
  in.machine = shipped_machine("laser_5p1", {{"links.rewind", rewind}});
  in.input_name = "part.ngc";
  in.placement = shifted(700, 600, 1000);
  return convert(in, false, {});
}

}  // namespace

TEST_CASE("rewind: a spiral that winds an axis past its limit", "[postproc][pipeline][rewind]") {
  const std::string text = spiral(230);  // 3.2 turns; C has 2
  const Conversion refused = convert_on_laser(text, "links_only");
  CHECK(refused.verdict == Verdict::refused);
  CHECK(has_code(refused.diagnostics, "KN103"));

  const Conversion c = convert_on_laser(text, "in_cut");
  for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
  REQUIRE(c.verdict == Verdict::certified);
  CHECK(c.cuts.size() >= 2);
  CHECK(has_code(c.diagnostics, "LK103"));
  std::size_t starts = 0;
  for (std::size_t i = 0; i < c.read.moves.size(); ++i) {
    CHECK(std::abs(c.read.moves[i].to[3]) <= 2.0 * kPi + 1e-9);
    if (c.line_map[i].role == MoveRole::link) CHECK_FALSE(c.read.moves[i].beam);
    if (i > 0 && c.read.moves[i].beam && !c.read.moves[i - 1].beam) ++starts;
  }
  CHECK(starts == c.cuts.size());
  CHECK(c.program.find("goes on after a rewind") != std::string::npos);
}

TEST_CASE("rewind: one block that winds an axis several times", "[postproc][pipeline][rewind]") {
  for (const double turns : {2.6, 5.3}) {
    const std::string text =
        "%\nM428\nG21 G90 G94\nG0 X0 Y0 Z50 B0 C0\nG0 X60 Y0 Z20 B20 C0\nG0 Z1\n"
        "M62 P0\nG1 X400 C" +
        std::to_string(360.0 * turns) + " F3000\nM63 P0\nG0 Z50\nM429\nM2\n%\n";
    const Conversion c = convert_on_laser(text, "in_cut");
    for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
    INFO(turns << " turns");
    CHECK(c.verdict == Verdict::certified);
  }
}

TEST_CASE("rewind: two cuts unwind in the link between them", "[postproc][pipeline][rewind]") {
  std::string text = spiral(120);  // 600 deg each: together past what C has
  const auto begin = text.find("M64 P1");
  const auto end = text.find("M429");
  const std::string body = text.substr(begin, end - begin);
  std::string second = body;  // the words go on: 600 to 1200 deg
  for (int i = 120; i >= 1; --i) {
    char from[32], to[32];
    std::snprintf(from, sizeof from, " C%.4f F", 5.0 * i);
    std::snprintf(to, sizeof to, " C%.4f F", 600.0 + 5.0 * i);
    const auto at = second.find(from);
    REQUIRE(at != std::string::npos);
    second.replace(at, std::string(from).size(), to);
  }
  second.replace(second.find(" C0\n"), 4, " C600\n");
  text = text.substr(0, end) + second + text.substr(end);
  const Conversion c = convert_on_laser(text, "links_only");
  for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
  REQUIRE(c.verdict == Verdict::certified);
  CHECK(c.cuts.size() == 2);
  CHECK(c.program.find("goes on after a rewind") == std::string::npos);
  double unwound = 0.0;
  for (std::size_t i = 1; i < c.read.moves.size(); ++i)
    if (c.line_map[i].role == MoveRole::link)
      unwound = std::max(unwound, std::abs(c.read.moves[i].to[3] - c.read.moves[i - 1].to[3]));
  CHECK(unwound > kPi);
}
