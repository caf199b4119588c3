#include "formats/freecad/fcm.h"

#include <catch2/catch.hpp>

using namespace smoothpost;

namespace {

const std::string kMill = R"({"machine": {"name": "M", "units": "metric", "axes": {
  "X": {"type": "linear", "role": "table_linear", "parent": null,
        "joint": {"origin": [0, 0, 0], "axis": [1, 0, 0]}, "limits": {"min": 0, "max": 510},
        "max_velocity": 18000},
  "Z": {"type": "linear", "role": "head_linear", "joint": [[0, 0, 1], [0, 0, 5]], "limits": {}},
  "A": {"type": "angular", "role": "table_rotary", "parent": "X",
        "joint": [[0, 10, 20], [1, 0, 0]], "limits": {"min": -90, "max": 30}}}},
  "postprocessor": {"file_name": "fanuc"}})";

}  // namespace

TEST_CASE("read_fcm: axes of the two forms of joints", "[formats][freecad]") {
  const auto read = freecad::read_fcm(kMill, "m.fcm");
  for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(read.ok());
  const freecad::Machine& m = read.value();
  CHECK(m.name == "M");
  CHECK(m.postprocessor == "fanuc");
  CHECK_FALSE(m.inch);
  REQUIRE(m.axes.size() == 3);
  CHECK(m.axes[0].name == "X");
  CHECK(m.axes[0].velocity == 18000.0);
  CHECK(m.axes[0].upper == 510.0);
  CHECK(m.axes[1].name == "Z");  // the older pair of a linear axis begins with its direction
  CHECK(m.axes[1].head);
  CHECK(m.axes[1].direction == std::array<double, 3>{0, 0, 1});
  CHECK_FALSE(m.axes[1].lower);
  CHECK(m.axes[2].rotary);
  CHECK(m.axes[2].parent == "X");
  CHECK(m.axes[2].origin == std::array<double, 3>{0, 10, 20});
}

TEST_CASE("read_fcm: faults are named by their path", "[formats][freecad]") {
  const auto first = [](std::string text, const std::string& old, const std::string& now) {
    if (!old.empty()) {
      REQUIRE(text.find(old) != std::string::npos);
      text.replace(text.find(old), old.size(), now);
    }
    const auto read = freecad::read_fcm(text, "m.fcm");
    REQUIRE_FALSE(read.ok());
    return read.diagnostics().front();
  };
  CHECK(first("{", "", "").code == "MF201");
  CHECK(first("[]", "", "").code == "MF201");
  CHECK(first("{\"machine\": {}}", "", "").code == "MF201");
  CHECK(first(std::string(100000, '['), "", "").code == "MF201");
  CHECK(first(kMill, "metric", "furlong").code == "MF202");
  CHECK(first(kMill, "\"angular\"", "\"ball\"").text.find("machine.axes.A.type") !=
        std::string::npos);
  CHECK(first(kMill, "table_linear", "table_rotary").code == "MF202");
  CHECK(first(kMill, "\"max\": 510", "\"max\": \"far\"").text.find("machine.axes.X.limits.max") !=
        std::string::npos);
  CHECK(first(kMill, "[1, 0, 0]}", "[0, 0, 0]}").code == "MF203");
  CHECK(first(kMill, "18000", "-1").code == "MF203");
}

TEST_CASE("read_fcm: a number that no double holds is an error at its line", "[formats][freecad]") {
  for (const char* number : {"8E333", "-1e999", "1E400"}) {
    std::string text = kMill;
    text.replace(text.find("18000"), 5, number);
    for (const auto& [given, line] : {std::pair(text, 4), std::pair(std::string("\n") + number, 2),
                                      std::pair(std::string(number), 1)}) {
      const auto read = freecad::read_fcm(given, "m.fcm");
      REQUIRE_FALSE(read.ok());
      CHECK(read.diagnostics()[0].code == "MF201");
      CHECK(read.diagnostics()[0].where.line == line);
      CHECK(read.diagnostics()[0].text.find("is too large") != std::string::npos);
    }
  }
}
