#include "postproc/pipeline/recipe_check.h"

#include <algorithm>
#include <catch2/catch.hpp>

#include "tests/support/machines.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

std::string problems_of(const MachineDefinition& machine) {
  // Of a dialect only what it can do counts here.
  const bool tool = machine.dialect.name != "linuxcnc";
  const Dialect dialect{"d",  "",      "",      tool ? ToolTurn::great_circle : ToolTurn::none,
                        true, nullptr, nullptr, ""};
  std::string all;
  for (const auto& d : recipe_problems(machine, dialect, {})) {
    CHECK(d.severity == Severity::error);
    all += d.code + ": " + d.text + "\n";
  }
  return all;
}

/// A laser as its file was shipped before anything was freed, with settings laid over it.
std::string laser(std::vector<MachineOverride> overrides) {
  std::vector<MachineOverride> all = {
      {"recipe.orientation", "programmed"}, {"recipe.optimise", "none"},
      {"recipe.schedule", "programmed"},    {"recipe.smoothing", "none"},
      {"tolerance.lead_deg", "0"},          {"tolerance.tilt_deg", "0"},
      {"workpiece.thickness_mm", "1.5"}};
  all.insert(all.end(), overrides.begin(), overrides.end());
  return problems_of(shipped_machine("laser_5p1", all));
}

std::string mill(const std::vector<MachineOverride>& overrides) {
  return problems_of(shipped_machine("table_table_bc", overrides));
}

std::string arm(const std::vector<MachineOverride>& overrides) {
  return problems_of(shipped_machine("robot_6r", overrides));
}

bool says(const std::string& text, const std::string& part) {
  INFO(text);
  const bool found = text.find(part) != std::string::npos;
  CHECK(found);
  return found;
}

long count(const std::string& text) { return std::count(text.begin(), text.end(), '\n'); }

const MachineOverride kJerk{"recipe.optimise", "jerk"};
const MachineOverride kLead{"tolerance.lead_deg", "15"};
const MachineOverride kTilt{"tolerance.tilt_deg", "10"};
const MachineOverride kCone{"recipe.orientation", "cone"};

}  // namespace

TEST_CASE("recipe_check: what a laser can do", "[postproc][pipeline]") {
  CHECK(laser({}).empty());
  CHECK(laser({kJerk}).empty());
  CHECK(laser({kJerk, {"recipe.schedule", "constant"}}).empty());
  for (const char* orientation : {"cone", "via", "graph", "monotone"}) {
    CHECK(laser({kJerk, {"recipe.orientation", orientation}}).empty());
    CHECK(laser({kJerk, kLead, kTilt, {"recipe.orientation", orientation}}).empty());
    CHECK(laser({kJerk, kTilt, {"recipe.orientation", orientation}}).empty());
  }
  CHECK(laser({kJerk, kCone, kLead, {"standoff.following", "exclusive"}}).empty());
}

TEST_CASE("recipe_check: freedom that nothing uses is refused", "[postproc][pipeline]") {
  const std::string both = laser({kJerk, kLead, kTilt});
  CHECK(count(both) == 1);
  says(both, "US120: tolerance.lead_deg and tilt_deg");
  says(both, "recipe.orientation = \"cone\"");
  says(laser({kLead}), "recipe.orientation = \"cone\"");
  says(mill({kTilt}), "recipe.kind = \"laser\"");
}

TEST_CASE("recipe_check: a free beam needs the sheet's thickness", "[postproc][pipeline]") {
  const std::string text = laser({kJerk, kCone, kLead, kTilt, {"workpiece.thickness_mm", "0"}});
  CHECK(count(text) == 1);
  says(text, "US123: ");
  says(text, "workpiece.thickness_mm");
  CHECK(laser({kJerk, kCone, {"workpiece.thickness_mm", "0"}}).empty());
}

TEST_CASE("recipe_check: orientations of lasers and of a later version", "[postproc][pipeline]") {
  for (const char* orientation : {"cone", "via", "monotone", "qi", "qi_c2", "graph"}) {
    const std::string text = mill({{"recipe.orientation", orientation}});
    CHECK(count(text) == 1);
    says(text, "US120: recipe.orientation = \"" + std::string(orientation) + "\"");
  }
  for (const char* orientation : {"qi", "qi_c2"})
    says(laser({kJerk, {"recipe.orientation", orientation}}),
         "possible: programmed, cone, via, graph, monotone (qi and qi_c2 are in the examples)");
  says(laser({kCone}), "US120: recipe.optimise = \"none\"");  // nothing would carry it out
}

TEST_CASE("recipe_check: the least jerk is for lasers in joints", "[postproc][pipeline]") {
  says(mill({kJerk}), "US120: recipe.optimise = \"jerk\"");
  says(arm({kJerk, {"recipe.kind", "laser"}}), "this machine is an arm");
  says(laser({kJerk, {"dialect.name", "siemens_840d"}, {"dialect.mode", "tcp"}}),
       "US120: dialect.mode = \"tcp\"");
}

TEST_CASE("recipe_check: every schedule is for every machine", "[postproc][pipeline]") {
  for (const char* schedule : {"jerk", "constant", "programmed"}) {
    CHECK(laser({kJerk, {"recipe.schedule", schedule}}).empty());
    CHECK(mill({{"recipe.schedule", schedule}}).empty());
  }
}

TEST_CASE("recipe: curves are for dialects that print polynomials, and for joints",
          "[postproc][pipeline]") {
  const auto problems = [](const std::vector<MachineOverride>& overrides, bool polynomials) {
    const Dialect dialect{"d",     "", "",         ToolTurn::great_circle, true, nullptr,
                          nullptr, "", polynomials};
    std::string all;
    for (const auto& d : recipe_problems(shipped_machine("head_table_bc", overrides), dialect, {}))
      all += d.code + ": " + d.text + "\n";
    return all;
  };
  const MachineOverride joint{"dialect.mode", "joint"}, tcp{"dialect.mode", "tcp"};
  for (const char* curves : {"cubic", "quintic"}) {
    const MachineOverride key{"dialect.curves", curves};
    CHECK(problems({joint, key}, true).empty());
    CHECK(says(problems({joint, key}, false), "prints no polynomials"));
    CHECK(says(problems({tcp, key}, true), "polynomials are of joints"));
    CHECK(says(problems({joint, key, {"recipe.task", "pose"}}, true), "straight joints only"));
  }
  CHECK(problems({joint}, false).empty());
}
