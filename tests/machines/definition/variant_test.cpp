#include <algorithm>
#include <catch2/catch.hpp>

#include "machines/definition/machine_file.h"
#include "tests/support/support.h"

using namespace smoothpost;

namespace {

const char* const kAxis =
    "schema = 1\nname = \"m\"\n[[axis]]\nname = \"A1\"\nletter = \"A\"\ntype = \"rotary\"\n"
    "chain = \"tool\"\ndirection = [0, 0, 1]\norigin_mm = [0, 0, 0]\nmin_deg = -90\nmax_deg = "
    "90\nmax_velocity_deg_per_s = 60\nmax_acceleration_deg_per_s2 = 120\n"
    "max_jerk_deg_per_s3 = 240\n";

const char* const kOwn =
    "[dialect]\nname = \"krl\"\nmode = \"tcp\"\nextension = \"src\"\ndigits_mm = 4\n"
    "start = [\"$OV_PRO=100\"]\nend = [\"HALT\"]\n"
    "[process]\nunmapped = \"comment\"\n[process.events]\ngas_on = \"$OUT[1]=TRUE\"\n"
    "coolant_on = \"$OUT[2]=TRUE\"\n"
    "[process.power]\nspeed_mm_per_s = [0, 10]\npercent = [10, 20]\n";

const char* const kVariant =
    "[variant.rapid.dialect]\ndigits_mm = 3\nstart = [\"AccSet 50, 50;\"]\nextension = \"modx\"\n"
    "[variant.rapid.process]\nunmapped = \"refuse\"\n[variant.rapid.process.events]\n"
    "gas_on = \"SetDO doGas,1\"\n";

std::string file(const std::string& more = kVariant) { return std::string(kAxis) + kOwn + more; }

std::string listing(const Diagnostics& diagnostics) {
  std::string all;
  for (const auto& d : diagnostics) all += to_string(d) + "\n";
  return all;
}

MachineDefinition parse(const std::string& text,
                        const std::vector<MachineOverride>& overrides = {}) {
  const auto result = parse_machine_file(text, "m.toml", overrides);
  INFO(listing(result.diagnostics()));
  REQUIRE(result.ok());
  CHECK(result.diagnostics().empty());
  return result.value();
}

// The only error: its code, and its line and column by a marker in the text.
void check_error(const std::string& text, const char* code, const std::string& marker,
                 const std::vector<MachineOverride>& overrides = {}) {
  const auto result = parse_machine_file(text, "m.toml", overrides);
  INFO(listing(result.diagnostics()));
  REQUIRE(result.diagnostics().size() == 1);
  const auto& d = result.diagnostics()[0];
  CHECK(d.code == code);
  const auto at = text.find(marker);
  REQUIRE(at != std::string::npos);
  const auto line_begin = text.rfind('\n', at) + 1;
  CHECK(d.where.line == 1 + std::count(text.begin(), text.begin() + static_cast<long>(at), '\n'));
  CHECK(d.where.column == static_cast<int>(at - line_begin + 1));
}

}  // namespace

TEST_CASE("variant: without another dialect the file is as without variants",
          "[machines][definition]") {
  for (const auto& overrides :
       std::vector<std::vector<MachineOverride>>{{}, {{"dialect.name", "krl"}}}) {
    const auto machine = parse(file(), overrides);
    CHECK(machine.dialect.name == "krl");
    CHECK(machine.dialect.digits_length == 4);
    CHECK(machine.dialect.extension == "src");
    CHECK(machine.dialect.start == std::vector<std::string>{"$OV_PRO=100"});
    REQUIRE(machine.process.events.size() == 2);
    CHECK(machine.process.unmapped == UnmappedWords::comment);
    CHECK(machine.power.speed.size() == 2);
  }
}

TEST_CASE("variant: replaces the words of the file's own controller", "[machines][definition]") {
  const auto machine = parse(file(), {{"dialect.name", "rapid"}});
  CHECK(machine.dialect.name == "rapid");
  CHECK(machine.dialect.mode == "tcp");  // not named in the variant: as in [dialect]
  CHECK(machine.dialect.digits_length == 3);
  CHECK(machine.dialect.extension == "modx");
  CHECK(machine.dialect.start == std::vector<std::string>{"AccSet 50, 50;"});
  CHECK(machine.dialect.end.empty());  // never the own controller's
  REQUIRE(machine.process.events.size() == 1);
  CHECK(machine.process.events[0].text == "SetDO doGas,1");
  CHECK(machine.process.unmapped == UnmappedWords::refuse);
  CHECK(machine.power.speed.size() == 2);  // a property of the machine, not of its words
  const auto powered = parse(
      file(std::string(kVariant) + "[variant.rapid.process.power]\nspeed_mm_per_s = [0, 10, 20]\n"
                                   "percent = [10, 20, 30]\n"),
      {{"dialect.name", "\"rapid\""}});
  CHECK(powered.power.speed.size() == 3);
  const auto bare = parse(file("[variant.rapid]\n"), {{"dialect.name", "rapid"}});
  CHECK(bare.process.events.empty());
  CHECK(bare.dialect.extension == "mod");
}

TEST_CASE("variant: another dialect without one has no words", "[machines][definition]") {
  struct Row {
    const char* name;
    const char* extension;
  };
  for (const Row& row : {Row{"siemens_840d", "mpf"}, Row{"linuxcnc", "ngc"}, Row{"other", "txt"}}) {
    const auto machine = parse(file(), {{"dialect.name", row.name}});
    CHECK(machine.dialect.name == row.name);
    CHECK(machine.dialect.extension == row.extension);
    CHECK(machine.dialect.start.empty());
    CHECK(machine.dialect.end.empty());
    CHECK(machine.process.events.empty());
    CHECK(machine.process.unmapped == UnmappedWords::comment);
    CHECK(machine.dialect.digits_length == 4);
  }
  // A file without [dialect] is one of linuxcnc.
  const std::string plain = std::string(kAxis) + "[process.events]\ngas_on = \"M64 P1\"\n";
  CHECK(parse(plain, {{"dialect.name", "linuxcnc"}}).process.events.size() == 1);
  const auto changed = parse(plain, {{"dialect.name", "krl"}});
  CHECK(changed.process.events.empty());
  CHECK(changed.dialect.extension == "src");
}

TEST_CASE("variant: a table for the first part of the name, and digits that the control has",
          "[machines][definition]") {
  const std::string family =
      "[variant.grbl.process.events]\ngas_on = \"M64\"\n"
      "[variant.grbl_marlin.process.events]\ngas_on = \"M42\"\n";
  const auto words = [&family](const char* name) {
    return parse(file(family), {{"dialect.name", name}}).process.events.at(0).text;
  };
  CHECK(words("grbl") == "M64");
  CHECK(words("grbl_fluidnc") == "M64");
  CHECK(words("grbl_marlin") == "M42");
  CHECK(parse(file(family), {{"dialect.name", "grblx"}}).process.events.empty());
  const std::string plain = kAxis;
  const auto digits = [&plain](std::vector<MachineOverride> more, const std::string& text) {
    more.insert(more.begin(), {"dialect.name", "heidenhain_vectors"});
    const auto machine = parse(plain + text, more);
    return std::pair(machine.dialect.digits_length, machine.dialect.digits_angle);
  };
  CHECK(digits({}, "") == std::pair(4, 4));
  CHECK(digits({}, "[dialect]\ndigits_mm = 3\ndigits_deg = 5\n") == std::pair(3, 4));
  CHECK(digits({{"dialect.units", "inch"}}, "") == std::pair(4, 4));
  CHECK(digits({{"dialect.digits_mm", "6"}}, "").first == 6);  // asked for: the dialect refuses it
}

TEST_CASE("variant: overrides come last", "[machines][definition]") {
  const auto machine = parse(file(), {{"dialect.digits_mm", "6"},
                                      {"dialect.name", "linuxcnc"},
                                      {"process.events.gas_off", "SetDO doGas,0"},
                                      {"variant.rapid.dialect.digits_deg", "3"},
                                      {"dialect.name", "rapid"}});
  CHECK(machine.dialect.name == "rapid");
  CHECK(machine.dialect.digits_length == 6);
  CHECK(machine.dialect.digits_angle == 3);
  CHECK(machine.dialect.extension == "modx");
  CHECK(machine.process.events.size() == 2);
}

TEST_CASE("variant: faults are errors with their place whether it is chosen or not",
          "[machines][definition]") {
  for (const auto& overrides :
       std::vector<std::vector<MachineOverride>>{{}, {{"dialect.name", "rapid"}}}) {
    check_error(file("[variant.rapid.dialect]\ndigit_mm = 3\n"), "MF104", "digit_mm", overrides);
    check_error(file("[variant.rapid]\nprocesses = 3\n"), "MF104", "processes", overrides);
    check_error(file("[variant.rapid.process.events]\ngas_on = { text = \"SetDO a,1\", xx = 1 }\n"),
                "MF104", "xx", overrides);
    check_error(file("[variant.rapid.process]\nunmaped = \"refuse\"\n"), "MF104", "unmaped",
                overrides);
    check_error(file("[variant.rapid.dialect]\nunits = \"parsec\"\n"), "MF113", "\"parsec\"",
                overrides);
  }
  check_error(file("[variant.rapid.dialect]\nname = \"rapid\"\n"), "MF124", "\"rapid\"");
  check_error(file("[variant.krl.dialect]\ndigits_mm = 3\n"), "MF124", "krl.dialect");
  const auto no_table =
      parse_machine_file(file("[variant]\nrapid = 12345\n"), "m.toml", {{"dialect.name", "rapid"}});
  REQUIRE(no_table.diagnostics().size() == 1);
  CHECK(no_table.diagnostics()[0].code == "MF106");
  CHECK_FALSE(parse_machine_file(std::string(kAxis) + "variant = 3\n", "m.toml").ok());
}

TEST_CASE("tool load: mass, centre and inertia, all or none", "[machines][definition]") {
  const std::string load =
      "[tool.load]\nmass_kg = 12.5\ncentre_mm = [1, 2, 30]\ninertia_kg_m2 = [0.1, 0.2, 0]\n";
  CHECK_FALSE(parse(kAxis).tool.load);
  const auto tool = parse(kAxis + load).tool;
  REQUIRE(tool.load);
  CHECK(tool.load->mass == 12.5);
  CHECK(tool.load->centre == Vec3(1, 2, 30));
  CHECK(tool.load->inertia == Vec3(0.1, 0.2, 0));
  const auto with = [&load](const std::string& from, const std::string& to) {
    std::string text = kAxis + load;
    return text.replace(text.find(from), from.size(), to);
  };
  const auto code = [](const std::string& text) {
    const auto result = parse_machine_file(text, "m.toml");
    REQUIRE(result.diagnostics().size() == 1);
    return result.diagnostics()[0].code;
  };
  CHECK(code(with("mass_kg = 12.5\n", "")) == "MF105");
  CHECK(code(with("centre_mm = [1, 2, 30]\n", "")) == "MF105");
  CHECK(code(with("inertia_kg_m2 = [0.1, 0.2, 0]\n", "")) == "MF105");
  CHECK(code(with("12.5", "0")) == "MF108");
  CHECK(code(with("0.1,", "-0.1,")) == "MF108");
  CHECK(code(with("[1, 2, 30]", "[1, 2]")) == "MF106");
}
