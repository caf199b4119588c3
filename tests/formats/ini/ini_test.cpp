#include "formats/ini/ini.h"

#include <catch2/catch.hpp>

using namespace smoothpost;

TEST_CASE("read_ini: sections and repeated keys and continued lines and included files",
          "[formats][ini]") {
  const auto read = ini::read_ini(
      "# comment\n[KINS]\n  KINEMATICS = trivkins \\\n coordinates=XYZ\nJOINTS=3\r\n; c\n"
      "[HAL]\nHALCMD = a\nHALCMD = b = c\n#INCLUDE more.inc\n",
      "m.ini", [](const std::string& name) -> std::optional<std::string> {
        return name == "more.inc" ? std::optional<std::string>("[TRAJ]\nLINEAR_UNITS = mm\n")
                                  : std::nullopt;
      });
  REQUIRE(read.ok());
  const ini::File& file = read.value();
  REQUIRE(file.find("KINS", "KINEMATICS") != nullptr);
  CHECK(ini::words(file.find("KINS", "KINEMATICS")->value) ==
        std::vector<std::string>{"trivkins", "coordinates=XYZ"});
  CHECK(file.find("KINS", "KINEMATICS")->where.line == 3);
  CHECK(file.find("KINS", "JOINTS")->value == "3");
  REQUIRE(file.find("HAL") != nullptr);
  CHECK(file.find("HAL")->entries.size() == 2);
  CHECK(file.find("HAL")->entries[1].value == "b = c");
  CHECK(file.find("TRAJ", "LINEAR_UNITS")->where.file == "more.inc");
  CHECK(file.find("TRAJ", "NOT") == nullptr);
}

TEST_CASE("read_ini: faults are named and files that include themselves end", "[formats][ini]") {
  const auto code = [](const std::string& text, const ini::Source& files = {}) {
    const auto read = ini::read_ini(text, "m.ini", files);
    REQUIRE(read.ok() != has_error(read.diagnostics()));
    return read.diagnostics().empty() ? std::string() : read.diagnostics().front().code;
  };
  CHECK(code("nonsense") == "MF201");
  CHECK(code("A = 1") == "MF201");
  CHECK(code("[KINS") == "MF201");
  CHECK(code(std::string(5u << 20, '#')) == "MF201");
  CHECK(code("#INCLUDE gone.inc\n[A]\nB = 1\n") == "MF207");
  CHECK(code("#INCLUDE self.ini\n#INCLUDE self.ini\n", [](const std::string&) {
          return std::optional<std::string>("#INCLUDE self.ini\n#INCLUDE self.ini\n");
        }) == "MF201");
}

TEST_CASE("leading_number: a number and perhaps a comment", "[formats][ini]") {
  CHECK(ini::leading_number(" 1.5 # mm") == 1.5);
  CHECK(ini::leading_number("+2;x") == 2.0);
  CHECK(ini::leading_number("-1e2") == -100.0);
  CHECK_FALSE(ini::leading_number("1.5mm"));
  CHECK_FALSE(ini::leading_number("inf"));
  CHECK_FALSE(ini::leading_number("1e99"));
  CHECK_FALSE(ini::leading_number(""));
}

TEST_CASE("Hal: values of pins by setp and by the signal of a net", "[formats][ini]") {
  const auto file = ini::read_ini("[KIN]\nY = 4\n", "m.ini", {});
  REQUIRE(file.ok());
  ini::Hal hal;
  hal.add(
      "setp k.a 1 # one\nsetp k.a 2\nsetp k.b=3\nnet s => k.c other\nsets s 7\nnet t k.d\n"
      "setp k.e [KIN]Y\nsetp k.f [KIN](Z)\n",
      "f.hal", 1, file.value());
  using Kind = ini::PinValue::Kind;
  CHECK(hal.pin("k.a").value == 2.0);
  CHECK(hal.pin("k.a").where.line == 2);
  CHECK(hal.pin("k.b").value == 3.0);
  CHECK(hal.pin("k.c").value == 7.0);
  CHECK(hal.pin("k.d").kind == Kind::signal);
  CHECK(hal.pin("k.d").text == "t");
  CHECK(hal.pin("k.e").value == 4.0);
  CHECK(hal.pin("k.f").kind == Kind::unreadable);
  CHECK(hal.pin("k.g").kind == Kind::unset);
}
