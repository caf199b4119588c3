#include "postproc/pipeline/cuts.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "kernels/core/units.h"
#include "tests/postproc/pipeline/paths.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

using Range = std::pair<std::uint32_t, std::uint32_t>;

std::vector<Range> ranges(const std::vector<Cut>& cuts) {
  std::vector<Range> out;
  for (const Cut& c : cuts) out.emplace_back(c.first, c.last);
  return out;
}

CutPhases phases(const ToolPath& path) {
  const ReferencePath reference(path, {});
  return phases_of(reference, {1, static_cast<std::uint32_t>(path.points.size() - 1), 1});
}

/// Feeds along a regular polygon of `corners` about (0, 0), from corner `first` on.
void polygon(PathMaker& maker, int first, int steps, int corners, double radius) {
  for (int i = 1; i <= steps; ++i) {
    const double a = 2.0 * kPi * (first + i) / corners;
    maker.feed(Vec3(radius * std::cos(a), radius * std::sin(a), 0));
  }
}

}  // namespace

TEST_CASE("cuts: a mill path cuts where it feeds", "[postproc][pipeline][cuts]") {
  PathMaker maker(Vec3(0, 0, 50));
  maker.rapid({0, 0, 2}).feed({0, 0, 0}).feed({20, 0, 0}).rapid({20, 0, 50});
  maker.rapid({40, 0, 2}).feed({40, 0, 0}).rapid({40, 0, 50});
  ToolPath path = maker.take();
  const auto cuts = find_cuts(path, {});
  CHECK(ranges(cuts) == std::vector<Range>{{2, 3}, {6, 6}});
  CHECK(cuts[0].number == 1);
  CHECK(cuts[1].number == 2);
  for (std::size_t k = 1; k < path.points.size(); ++k) {
    const bool in_cut = (k >= 2 && k <= 3) || k == 6;
    CHECK(path.points[k].replanned != in_cut);
  }
}

TEST_CASE("cuts: a beam path cuts where the beam is on", "[postproc][pipeline][cuts]") {
  PathMaker maker(Vec3(0, 0, 50));
  maker.feed({0, 0, 1}).event("beam_on").feed({10, 0, 1}).feed({20, 0, 1}).event("beam_off");
  maker.feed({20, 0, 20}).rapid({60, 0, 20}).feed({60, 0, 1}).event("beam_on").feed({70, 0, 1});
  maker.event("beam_off").rapid({70, 0, 50});
  ToolPath path = maker.take();
  const auto cuts = find_cuts(path, {});
  CHECK(ranges(cuts) == std::vector<Range>{{2, 3}, {7, 7}});
  CHECK(path.points[4].replanned);
  CHECK(path.points[5].replanned);
  CHECK(path.points[6].replanned);
}

TEST_CASE("cuts: a micro-joint is a beam-off feed no longer than the setting",
          "[postproc][pipeline][cuts]") {
  for (const double gap : {0.5, 2.99, 3.0, 3.01, 30.0}) {
    PathMaker maker(Vec3(0, 0, 1));
    maker.event("beam_on").feed({10, 0, 1}).event("beam_off").feed({10 + gap, 0, 1});
    maker.event("beam_on").feed({50, 0, 1}).event("beam_off");
    ToolPath path = maker.take();
    LinkChoice choice;
    choice.micro_joint = 3.0;
    const auto cuts = find_cuts(path, choice);
    INFO(gap);
    REQUIRE(cuts.size() == (gap <= 3.0 ? 1 : 2));
    CHECK(path.points[2].replanned == (gap > 3.0));
    CHECK_FALSE(path.points[2].beam);
    if (gap <= 3.0) CHECK(phases_of(ReferencePath(path, {}), cuts[0]).micro_joints == 1);
  }
}

TEST_CASE("cuts: the length of a micro-joint is that of its path, not of its chord",
          "[postproc][pipeline][cuts]") {
  for (const double radius : {0.4, 20.0}) {  // full circles: the chord is 0
    PathMaker maker(Vec3(0, 0, 1));
    maker.event("beam_on").feed({10, 0, 1}).event("beam_off").arc({10, radius, 1}, 2.0 * kPi);
    maker.event("beam_on").feed({50, 0, 1}).event("beam_off");
    ToolPath path = maker.take();
    LinkChoice choice;
    choice.micro_joint = 3.0;
    CHECK(find_cuts(path, choice).size() == (2.0 * kPi * radius <= 3.0 ? 1 : 2));
  }
}

TEST_CASE("cuts: a short beam-off feed with other events inside is a link",
          "[postproc][pipeline][cuts]") {
  const std::vector<std::pair<std::string, std::size_t>> cases = {
      {"power", 1}, {"gas_off", 2}, {"pierce", 2}, {"stop", 2}};
  for (const auto& [name, count] : cases) {
    PathMaker maker(Vec3(0, 0, 1));
    maker.event("beam_on").feed({10, 0, 1}).event("beam_off").feed({11, 0, 1});
    maker.event(name).event("beam_on").feed({50, 0, 1}).event("beam_off");
    ToolPath path = maker.take();
    LinkChoice choice;
    choice.micro_joint = 3.0;
    INFO(name);
    CHECK(find_cuts(path, choice).size() == count);
  }
  PathMaker maker(Vec3(0, 0, 1));  // a rapid is never a micro-joint
  maker.event("beam_on").feed({10, 0, 1}).event("beam_off").rapid({11, 0, 1});
  maker.event("beam_on").feed({50, 0, 1}).event("beam_off");
  ToolPath path = maker.take();
  LinkChoice choice;
  choice.micro_joint = 3.0;
  CHECK(find_cuts(path, choice).size() == 2);
}

TEST_CASE("cuts: rapids that go nowhere stay where they are", "[postproc][pipeline][cuts]") {
  PathMaker maker(Vec3(0, 0, 2));
  maker.feed({0, 0, 0}).rapid({0, 0, 0}).feed({20, 0, 0}).rapid({20, 0, 50}).feed({30, 0, 0});
  ToolPath path = maker.take();
  const auto cuts = find_cuts(path, {});
  CHECK(ranges(cuts) == std::vector<Range>{{1, 3}, {5, 5}});
  CHECK_FALSE(path.points[2].replanned);
  CHECK(path.points[4].replanned);

  PathMaker turns(Vec3(0, 0, 2));  // it goes nowhere but turns
  turns.feed({0, 0, 0}).axis({0.1, 0, 1}).rapid({0, 0, 0}).feed({20, 0, 0});
  ToolPath turned = turns.take();
  CHECK(find_cuts(turned, {}).size() == 2);
}

TEST_CASE("cuts: keep leaves the path as it is and finds the same cuts",
          "[postproc][pipeline][cuts]") {
  PathMaker maker(Vec3(0, 0, 50));
  maker.rapid({0, 0, 2}).feed({0, 0, 0}).rapid({20, 0, 50}).feed({30, 0, 0});
  ToolPath path = maker.take();
  LinkChoice choice;
  choice.keep = true;
  CHECK(ranges(find_cuts(path, choice)) == std::vector<Range>{{2, 2}, {4, 4}});
  for (const auto& p : path.points) CHECK_FALSE(p.replanned);
}

TEST_CASE("cuts: without motion or without a cut there is none", "[postproc][pipeline][cuts]") {
  ToolPath path = PathMaker(Vec3(0, 0, 2)).take();
  CHECK(find_cuts(path, {}).empty());
  ToolPath empty;
  CHECK(find_cuts(empty, {}).empty());
  ToolPath rapids = PathMaker(Vec3(0, 0, 2)).rapid({1, 0, 0}).rapid({2, 0, 0}).take();
  CHECK(find_cuts(rapids, {}).empty());
}

TEST_CASE("cuts: what is left of the events of cuts that are left out",
          "[postproc][pipeline][cuts]") {
  const auto make = [] {
    PathMaker maker(Vec3(0, 0, 50));
    maker.event("tool_change", {{"tool", "1"}}).event("spindle_on", {{"rpm", "1000"}});
    maker.rapid({0, 0, 2}).event("message").feed({10, 0, 0}).event("coolant_on").dwell(1.0);
    maker.rapid({10, 0, 50}).event("spindle_on", {{"rpm", "2000"}}).event("stop");
    maker.rapid({20, 0, 2}).feed({30, 0, 0}).event("coolant_off");  // cut 2
    maker.rapid({30, 0, 50}).event("tool_change", {{"tool", "2"}}).rapid({40, 0, 2});
    maker.feed({50, 0, 0}).event("spindle_off").rapid({50, 0, 50});  // cut 3
    return maker.take();
  };
  const auto chosen = [&](int first, int last) {
    ToolPath path = make();
    LinkChoice choice;
    choice.cuts = CutRange{first, last};
    const auto cuts = find_cuts(path, choice);
    REQUIRE(cuts.size() == 3);
    for (const Cut& c : cuts) {
      CHECK(c.omitted == (c.number < first || c.number > last));
      for (std::uint32_t k = c.first; k <= c.last; ++k)
        CHECK(path.points[k].replanned == c.omitted);
    }
    for (std::size_t i = 1; i < path.events.size(); ++i)
      CHECK(path.events[i - 1].point <= path.events[i].point);
    return path;
  };
  SECTION("the second alone: tool, coolant and the last speed before it") {
    const ToolPath path = chosen(2, 2);
    CHECK(event_names(path) == std::vector<std::string>{"tool_change", "coolant_on", "spindle_on",
                                                        "coolant_off", "tool_change",
                                                        "spindle_off"});
    for (const auto& e : path.events) {
      if (e.event.name == "spindle_on") CHECK(e.event.parameters[0].second == "2000");
      CHECK(e.kind == PathEvent::Kind::process);  // no dwell of a cut that is not there
    }
  }
  SECTION("the last alone: one tool, one speed, no coolant on") {
    const ToolPath path = chosen(3, 3);
    int tools = 0;
    for (const auto& e : path.events) {
      CHECK(e.event.name != "coolant_on");
      CHECK(e.event.name != "stop");
      CHECK(e.event.name != "message");
      if (e.event.name != "tool_change") continue;
      ++tools;
      CHECK(e.event.parameters[0].second == "2");
    }
    CHECK(tools == 1);
  }
  SECTION("the first alone: everything is off at the end") {
    const ToolPath path = chosen(1, 1);
    CHECK(event_names(path).front() == "tool_change");
    const auto names = event_names(path);
    CHECK(std::count(names.begin(), names.end(), "spindle_off") == 1);
    CHECK(std::count(names.begin(), names.end(), "coolant_off") == 1);
  }
}

TEST_CASE("cuts: a beam of a cut that is left out is off", "[postproc][pipeline][cuts]") {
  PathMaker maker(Vec3(0, 0, 1));
  maker.event("pierce").event("beam_on").event("power", {{"percent", "40"}}).feed({10, 0, 1});
  maker.event("beam_off").rapid({20, 0, 1});
  maker.event("pierce").event("beam_on").feed({30, 0, 1}).event("beam_off").rapid({30, 0, 9});
  ToolPath path = maker.take();
  LinkChoice choice;
  choice.cuts = CutRange{2, 2};
  const auto cuts = find_cuts(path, choice);
  REQUIRE(cuts.size() == 2);
  CHECK_FALSE(path.points[1].beam);
  CHECK(path.points[3].beam);
  CHECK(event_names(path) == std::vector<std::string>{"power", "pierce", "beam_on", "beam_off"});
}

TEST_CASE("cuts: phases", "[postproc][pipeline][cuts]") {
  const double around = 2.0 * 36 * 20.0 * std::sin(kPi / 36);
  SECTION("an open cut is all contour") {
    const auto p = phases(PathMaker(Vec3(0, 0, 0)).feed({30, 0, 0}).feed({30, 40, 0}).take());
    CHECK_FALSE(p.closed);
    CHECK(p.contour == Approx(70.0));
    CHECK(p.lead_in + p.over_burn + p.lead_out == 0.0);
  }
  SECTION("a full circle in one block") {
    const auto p = phases(PathMaker(Vec3(20, 0, 0)).arc({0, 0, 0}, 2.0 * kPi).take());
    CHECK(p.closed);
    CHECK(p.contour == Approx(2.0 * kPi * 20.0).epsilon(1e-4));
    CHECK(p.lead_in == 0.0);
    CHECK(p.over_burn + p.lead_out == 0.0);
  }
  SECTION("lead-in then contour then over-burn on the contour's own corners") {
    for (int first = 0; first < 36; ++first) {
      const double a = 2.0 * kPi * first / 36;
      PathMaker maker(Vec3(12 * std::cos(a), 12 * std::sin(a), 0));
      maker.feed(Vec3(20 * std::cos(a), 20 * std::sin(a), 0));
      polygon(maker, first, 36 + 3, 36, 20.0);
      const auto p = phases(maker.take());
      INFO(first);
      CHECK(p.closed);
      CHECK(p.lead_in == Approx(8.0));
      CHECK(p.contour == Approx(around));
      CHECK(p.over_burn == Approx(around / 12));
      CHECK(p.lead_out == 0.0);
    }
  }
  SECTION("an over-burn that ends between corners") {
    PathMaker maker(Vec3(12, 0, 0));
    maker.feed({20, 0, 0});
    polygon(maker, 0, 36, 36, 20.0);
    const Vec3 corner(20 * std::cos(kPi / 18), 20 * std::sin(kPi / 18), 0);
    maker.feed(Vec3(20, 0, 0) + 0.4 * (corner - Vec3(20, 0, 0)));
    const auto p = phases(maker.take());
    CHECK(p.lead_in == Approx(8.0));
    CHECK(p.over_burn == Approx(0.4 * around / 36));
    CHECK(p.lead_out == 0.0);
  }
  SECTION("a lead-out leaves the contour") {
    PathMaker maker(Vec3(12, 0, 0));
    maker.feed({20, 0, 0});
    polygon(maker, 0, 36, 36, 20.0);
    const auto p = phases(maker.feed({14, 0, 0}).take());
    CHECK(p.lead_in == Approx(8.0));
    CHECK(p.contour == Approx(around));
    CHECK(p.over_burn == 0.0);
    CHECK(p.lead_out == Approx(6.0));
  }
}

TEST_CASE("cuts: groups of states", "[postproc][pipeline][cuts]") {
  CHECK(state_group("spindle_on") == "spindle");
  CHECK(state_group("spindle_on_reverse") == "spindle");
  CHECK(state_group("spindle_off") == "spindle");
  CHECK(state_group("gas_on") == "gas");
  CHECK(state_group("follow_off") == "follow");
  CHECK_FALSE(state_group("power").empty());
  CHECK_FALSE(state_group("tool_change").empty());
  for (const char* name : {"beam_on", "beam_off", "pierce", "message", "stop", "optional_stop"})
    CHECK(state_group(name).empty());
  CHECK(ends_state("spindle_off"));
  CHECK_FALSE(ends_state("spindle_on"));
  CHECK_FALSE(ends_state("power"));
}

TEST_CASE("cuts: ranges of cuts", "[postproc][pipeline][cuts]") {
  const auto range = [](const std::string& text) {
    const auto r = parse_cut_range(text);
    REQUIRE(r.ok());
    return std::make_pair(r.value().first, r.value().last);
  };
  CHECK(range("7") == std::make_pair(7, 7));
  CHECK(range("7-40") == std::make_pair(7, 40));
  CHECK(range("7-7") == std::make_pair(7, 7));
  CHECK(range("7-").first == 7);
  CHECK(range("7-").second == std::numeric_limits<int>::max());
  for (const char* text : {"", "-", "0", "-3", "0-3", "7-3", "a", "7-b", "7--8", "7-8-9", "7 - 8",
                           "+7", "99999999999", "1-99999999999", "7,8", "1.5"}) {
    INFO(text);
    const auto r = parse_cut_range(text);
    REQUIRE_FALSE(r.ok());
    CHECK(r.diagnostics().front().code == "US146");
  }
}
