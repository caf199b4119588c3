#include "formats/urdf/urdf.h"

#include <catch2/catch.hpp>

#include "tests/support/support.h"

using namespace smoothpost;

namespace {

const char* const kArm = R"(<?xml version="1.0"?>
<robot name="two">
  <link name="foot"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
  <link name="arm"/>
  <link name="tool0"/>
  <joint name="turn" type="revolute">
    <origin xyz="0.1 -2e-1 +3" rpy="0 1.5 0"/>
    <parent link="foot"/><child link="arm"/>
    <axis xyz="0 0 -1"/>
    <limit lower="-1" upper="2" velocity="3" effort="0"/>
  </joint>
  <joint name="end" type="fixed"><parent link="arm"/><child link="tool0"/></joint>
</robot>)";

bool fails(const std::string& text, const std::string& code, const std::string& words) {
  const auto read = urdf::read_urdf(text, "r.urdf");
  for (const auto& d : read.diagnostics()) {
    UNSCOPED_INFO(to_string(d));
    if (d.code == code && d.text.find(words) != std::string::npos && !read.ok()) return true;
  }
  return false;
}

std::string with(const std::string& old, const std::string& now) {
  std::string text = kArm;
  const auto at = text.find(old);
  REQUIRE(at != std::string::npos);
  return text.replace(at, old.size(), now);
}

}  // namespace

TEST_CASE("read_urdf: links and joints as written", "[formats][urdf]") {
  const auto read = urdf::read_urdf(kArm, "r.urdf");
  REQUIRE(read.ok());
  const urdf::Robot& robot = read.value();
  CHECK(robot.name == "two");
  CHECK(robot.root == "foot");
  REQUIRE(robot.links.size() == 3);
  CHECK(robot.links[0].collision == std::vector<std::string>{"box"});
  REQUIRE(robot.joints.size() == 2);
  const urdf::Joint& turn = robot.joints[0];
  CHECK(turn.xyz == std::array<double, 3>{0.1, -0.2, 3.0});
  CHECK(turn.rpy == std::array<double, 3>{0.0, 1.5, 0.0});
  CHECK(turn.axis == std::array<double, 3>{0.0, 0.0, -1.0});
  CHECK(turn.limits.lower == -1.0);
  CHECK(turn.limits.upper == 2.0);
  CHECK(turn.limits.velocity == 3.0);
  CHECK(turn.line == 6);
  CHECK(robot.joints[1].axis == std::array<double, 3>{1.0, 0.0, 0.0});  // the format's default
}

TEST_CASE("read_urdf: faults are named with their line", "[formats][urdf]") {
  CHECK(fails("", "MF201", "not XML"));
  CHECK(fails("<robot name='x'>", "MF201", "not XML"));
  CHECK(fails("<sdf/>", "MF201", "<robot>"));
  CHECK(fails("<robot name='x'/>", "MF204", "no link"));
  CHECK(fails(with("name=\"turn\" type=\"revolute\"", "name=\"turn\" type=\"helix\""), "MF202",
              "helix"));
  CHECK(fails(with("0.1 -2e-1 +3", "0.1 -2e-1"), "MF203", "xyz"));
  CHECK(fails(with("0.1 -2e-1 +3", "${d} 0 0"), "MF203", "xacro"));
  CHECK(fails(with("lower=\"-1\"", "lower=\"nan\""), "MF203", "lower"));
  CHECK(fails(with("lower=\"-1\"", "lower=\"1e300\""), "MF203", "lower"));
  CHECK(fails(with("0 0 -1", "0 0 0"), "MF203", "no length"));
  CHECK(fails(with("<link name=\"arm\"/>", ""), "MF204", "arm"));
  CHECK(fails(with("<link name=\"arm\"/>", "<link name=\"arm\"/><link name=\"arm\"/>"), "MF204",
              "two links"));
  CHECK(fails(with("<link name=\"arm\"/>", "<link name=\"arm\"/><link name=\"lone\"/>"), "MF204",
              "one tree"));
  CHECK(fails(with("<link name=\"arm\"/>", "<xacro:include filename=\"a\"/>"), "MF202", "xacro"));
  // A ring beside a whole tree: foot is the root, and nothing leads to the two others.
  CHECK(fails(
      with("<link name=\"arm\"/>",
           "<link name=\"arm\"/><link name=\"p\"/><link name=\"q\"/>"
           "<joint name=\"pq\" type=\"fixed\"><parent link=\"p\"/><child link=\"q\"/></joint>"
           "<joint name=\"qp\" type=\"fixed\"><parent link=\"q\"/><child link=\"p\"/></joint>"),
      "MF204", "ring"));
}

TEST_CASE("read_urdf: deep and cut text ends in diagnostics", "[formats][urdf]") {
  std::string deep = "<robot>";
  for (int i = 0; i < 100000; ++i) deep += "<a>";
  CHECK(fails(deep, "MF201", "not XML"));
  const std::string text = kArm;
  for (std::size_t n = 0; n < text.size(); ++n) {
    const auto read = urdf::read_urdf(std::string_view(text).substr(0, n), "r.urdf");
    REQUIRE(read.ok() != has_error(read.diagnostics()));
    REQUIRE_FALSE(read.ok());
  }
}

TEST_CASE("read_joint_limits: what is switched on and nothing else", "[formats][urdf]") {
  const char* const text = R"(# limits
default_velocity_scaling_factor: 0.1
robot_description_planning:
  joint_limits:
    a1:
      has_velocity_limits: true
      max_velocity: 2.5
      has_acceleration_limits: false
      max_acceleration: 9
      has_jerk_limits: true
      max_jerk: 1e2
    a2: {has_position_limits: true, min_position: -1, max_position: +1.5, list: [1, 2]}
  other:
    a3: {max_velocity: 7}
)";
  const auto read = urdf::read_joint_limits(text, "l.yaml");
  for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(read.ok());
  REQUIRE(read.value().size() == 2);
  const auto& [first, a1] = read.value()[0];
  CHECK(first == "a1");
  CHECK(a1.velocity == 2.5);
  CHECK_FALSE(a1.acceleration);
  CHECK(a1.jerk == 100.0);
  CHECK_FALSE(a1.lower);
  const auto& [second, a2] = read.value()[1];
  CHECK(second == "a2");
  CHECK(a2.lower == -1.0);
  CHECK(a2.upper == 1.5);
}

TEST_CASE("read_joint_limits: faults are named", "[formats][urdf]") {
  const auto code = [](const std::string& text) {
    const auto read = urdf::read_joint_limits(text, "l.yaml");
    REQUIRE(read.ok() != has_error(read.diagnostics()));
    return read.ok() ? std::string() : read.diagnostics().front().code;
  };
  CHECK(code("") == "MF203");
  CHECK(code("joint_limits: [") == "MF201");
  CHECK(code("joint_limits: {a: {max_velocity: fast}}") == "MF203");
  CHECK(code("joint_limits: {a: {max_velocity: 0}}") == "MF203");
  CHECK(code("joint_limits: {a: {has_velocity_limits: maybe}}") == "MF203");
  CHECK(code("joint_limits: {a: {max_position: !degrees 90}}") == "MF202");
  CHECK(code("joint_limits: {a: &x {max_velocity: 1}, b: *x}") == "MF202");
  CHECK(code("joint_limits: {a: " + std::string(5000, '[') + "}") == "MF201");
  CHECK(code("joint_limits: {a: {max_velocity: 1}}").empty());
}
