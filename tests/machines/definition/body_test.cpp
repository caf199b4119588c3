#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <set>

#include "machines/definition/body_pairs.h"
#include "machines/definition/machine_file.h"
#include "tests/support/support.h"

using namespace smoothpost;

namespace {

std::string axis_text(const std::string& name, const std::string& letter, bool rotary, bool table) {
  const std::string unit = rotary ? "deg" : "mm";
  return "[[axis]]\nname = \"" + name + "\"\nletter = \"" + letter + "\"\ntype = \"" +
         (rotary ? "rotary" : "linear") + "\"\nchain = \"" + (table ? "workpiece" : "tool") +
         "\"\ndirection = [0, 0, 1]\n" + (rotary ? "origin_mm = [0, 0, 0]\n" : "") + "min_" + unit +
         " = -10\nmax_" + unit + " = 10\nmax_velocity_" + unit + "_per_s = 1\nmax_acceleration_" +
         unit + "_per_s2 = 1\nmax_jerk_" + unit + "_per_s3 = 1\n";
}

/// Tool chain X, Z, B; workpiece chain Y, C; the axes of both are mixed in the file.
std::string base() {
  return "schema = 1\nname = \"m\"\n" + axis_text("X", "X", false, false) +
         axis_text("Y", "Y", false, true) + axis_text("Z", "Z", false, false) +
         axis_text("C", "C", true, true) + axis_text("B", "B", true, false);
}

std::string body(const std::string& name, const std::string& link, const std::string& more = "") {
  return "[[body]]\nname = \"" + name + "\"\nlink = \"" + link +
         "\"\nshape = \"capsule\"\nfrom_mm = [0, 0, 0]\nto_mm = [0, 0, 1]\nradius_mm = 1\n" + more;
}

std::string shaped(const std::string& shape, const std::string& keys) {
  return base() + "[[body]]\nname = \"b\"\nlink = \"X\"\nshape = \"" + shape + "\"\n" + keys;
}

std::string listing(const Diagnostics& diagnostics) {
  std::string all;
  for (const auto& diagnostic : diagnostics) all += to_string(diagnostic) + "\n";
  return all;
}

MachineDefinition parse(const std::string& text,
                        const std::vector<MachineOverride>& overrides = {}) {
  const auto result = parse_machine_file(text, "shop/m.toml", overrides);
  INFO(text << listing(result.diagnostics()));
  REQUIRE(result.ok());
  return result.value();
}

/// Exactly one error, with that code, at byte `at` of the text; the message.
std::string check_error_at(const std::string& text, const std::string& code, std::size_t at) {
  const auto result = parse_machine_file(text, "m.toml");
  INFO(text << listing(result.diagnostics()));
  REQUIRE(at < text.size());
  REQUIRE_FALSE(result.ok());
  REQUIRE(result.diagnostics().size() == 1);
  const auto begin = text.begin();
  const auto line = std::count(begin, begin + static_cast<std::ptrdiff_t>(at), '\n');
  const std::size_t before = text.rfind('\n', at - 1);
  const Diagnostic& found = result.diagnostics()[0];
  CHECK(found.code == code);
  CHECK(found.severity == Severity::error);
  CHECK(found.where.file == "m.toml");
  CHECK(found.where.line == line + 1);
  CHECK(found.where.column == static_cast<int>(at - before));
  return found.text;
}

/// The error is where `marker` stands last.
std::string check_error(const std::string& text, const std::string& code,
                        const std::string& marker) {
  return check_error_at(text, code, text.rfind(marker));
}

/// The error is at the value of the line "key = value".
std::string check_value(const std::string& text, const std::string& code, const std::string& line) {
  return check_error_at(text, code, text.rfind("\n" + line) + 1 + line.find(" = ") + 3);
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

using Names = std::pair<std::string, std::string>;

/// Checked pairs by name, with their clearance.
std::map<Names, double> pairs_of(const MachineDefinition& machine) {
  std::map<Names, double> out;
  for (const BodyPair& pair : checked_pairs(machine)) {
    const auto name = [&](std::size_t place) {
      return place == BodyPair::kPart ? std::string("part") : machine.bodies.at(place).name;
    };
    CHECK(pair.first < pair.second);
    const bool fresh =
        out.emplace(Names{name(pair.first), name(pair.second)}, pair.clearance).second;
    CHECK(fresh);
  }
  return out;
}

}  // namespace

TEST_CASE("bodies: every shape and its keys", "[machines][definition]") {
  const std::string ends = "from_mm = [1, 2, 3]\nto_mm = [4, 6, 8]\n";
  const Body frustum = parse(shaped("frustum", ends + "radius_mm = [7, 0]\n")).bodies.at(0);
  CHECK(frustum.shape == BodyShape::frustum);
  CHECK(frustum.name == "b");
  CHECK(frustum.link == "X");
  CHECK(frustum.from == Vec3(1, 2, 3));
  CHECK(frustum.to == Vec3(4, 6, 8));
  CHECK(frustum.radius_from == 7.0);
  CHECK(frustum.radius_to == 0.0);
  const Body cylinder = parse(shaped("cylinder", ends + "radius_mm = [7, 7]\n")).bodies.at(0);
  CHECK(cylinder.shape == BodyShape::cylinder);
  CHECK(cylinder.radius_to == 7.0);
  const Body capsule = parse(shaped("capsule", ends + "radius_mm = 5\n")).bodies.at(0);
  CHECK(capsule.shape == BodyShape::capsule);
  CHECK(capsule.radius_from == 5.0);
  CHECK(capsule.radius_to == 5.0);
  CHECK(parse(shaped("box", ends)).bodies.at(0).shape == BodyShape::box);
  const Body hull =
      parse(shaped("hull", "points_mm = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0.5]]\n"))
          .bodies.at(0);
  CHECK(hull.shape == BodyShape::hull);
  REQUIRE(hull.points.size() == 4);
  CHECK(hull.points[3] == Vec3(0, 0, 0.5));
  const Body mesh = parse(shaped("mesh",
                                 "file = \"parts/vise.stl\"\nunits = \"inch\"\n"
                                 "frame = { xyz_mm = [1, 2, 3], rpy_deg = [0, 0, 90] }\n"))
                        .bodies.at(0);
  CHECK(mesh.shape == BodyShape::mesh);
  CHECK(mesh.mesh_scale == 25.4);
  CHECK(mesh.mesh == nullptr);
  CHECK((mesh.mesh_frame * Vec3(1, 0, 0) - Vec3(1, 3, 3)).norm() < 1e-15);
  for (const char* link : {"X", "Y", "C", "base", "workpiece"})
    CHECK(parse(base() + body("b", link)).bodies.at(0).link == link);
}

TEST_CASE("bodies: files of triangles are found beside the machine file",
          "[machines][definition]") {
  const auto file = [](const std::string& machine, const std::string& name) {
    const auto read = parse_machine_file(shaped("mesh", "file = \"" + name + "\"\n"), machine);
    REQUIRE(read.ok());
    CHECK(read.value().bodies.at(0).mesh_scale == 1.0);
    CHECK(read.value().bodies.at(0).mesh_frame.matrix() == Pose::Identity().matrix());
    return read.value().bodies.at(0).mesh_file;
  };
  CHECK(file("m.toml", "a.stl") == "a.stl");
  CHECK(file("shop/m.toml", "a.stl") == "shop/a.stl");
  CHECK(file("/shop/m.toml", "meshes/a.stl") == "/shop/meshes/a.stl");
  CHECK(file("/shop/m.toml", "/other/a.stl") == "/other/a.stl");
}

TEST_CASE("bodies: clearance of the body or else of the tolerance", "[machines][definition]") {
  const std::string two = body("a", "X") + body("b", "B", "clearance_mm = 0.5\n");
  const MachineDefinition none = parse(base() + two);
  CHECK(none.bodies[0].clearance == 0.0);
  CHECK(none.bodies[1].clearance == 0.5);
  // The section may stand before or after the bodies.
  CHECK(parse(base() + two + "[tolerance]\nclearance_mm = 3\n").bodies[0].clearance == 3.0);
  const MachineDefinition before = parse(base() + "[tolerance]\nclearance_mm = 3\n" + two);
  CHECK(before.bodies[0].clearance == 3.0);
  CHECK(before.bodies[1].clearance == 0.5);
  const MachineDefinition changed =
      parse(base() + two, {{"tolerance.clearance_mm", "4"}, {"body.b.clearance_mm", "6"}});
  CHECK(changed.bodies[0].clearance == 4.0);
  CHECK(changed.bodies[1].clearance == 6.0);
}

TEST_CASE("bodies: errors of a body are located", "[machines][definition]") {
  const std::string ends = "from_mm = [1, 2, 3]\nto_mm = [4, 6, 8]\n";
  const std::string points = "points_mm = [[0, 0, 0], [1, 0, 0], [0, 1, 0], ";
  // Wrong types and counts.
  check_value(shaped("mesh", "file = 7\n"), "MF106", "file = 7");
  check_value(shaped("mesh", "file = \"a\"\nframe = 7\n"), "MF106", "frame = 7");
  check_value(shaped("mesh", "file = \"a\"\nunits = 7\n"), "MF106", "units = 7");
  check_value(shaped("hull", "points_mm = 7\n"), "MF106", "points_mm = 7");
  check_error(shaped("hull", points + "[0, 1]]\n"), "MF106", "[0, 1]");
  check_error(shaped("hull", points + "5]\n"), "MF106", "5]");
  check_error(shaped("hull", points + "[0, 1, \"z\"]]\n"), "MF106", "\"z\"");
  check_value(shaped("box", "from_mm = [1, 2]\nto_mm = [4, 6, 8]\n"), "MF106", "from_mm = [1, 2]");
  check_value(shaped("box", ends + "clearance_mm = \"far\"\n"), "MF106", "clearance_mm = \"far\"");
  // Values out of range.
  check_value(shaped("box", ends + "clearance_mm = -1\n"), "MF108", "clearance_mm = -1");
  check_value(shaped("capsule", ends + "radius_mm = 0\n"), "MF108", "radius_mm = 0");
  check_error(shaped("hull", points + "[0, 1, inf]]\n"), "MF109", "inf");
  check_value(shaped("mesh", "file = \"\"\n"), "MF113", "file = \"\"");
  check_value(shaped("mesh", "file = \"a\\nb\"\n"), "MF113", "file = \"a\\nb\"");
  CHECK(contains(
      check_value(shaped("mesh", "file = \"a\"\nunits = \"cm\"\n"), "MF113", "units = \"cm\""),
      "mm or inch"));
  CHECK(contains(check_value(shaped("sphere", ""), "MF113", "shape = \"sphere\""),
                 "frustum, cylinder, capsule, box, hull or mesh"));
  // No volume.
  check_value(shaped("box", "from_mm = [1, 2, 3]\nto_mm = [4, 6, 3]\n"), "MF126",
              "to_mm = [4, 6, 3]");
  check_value(shaped("hull", points + "[5, 5, 0]]\n"), "MF126", points + "[5, 5, 0]]");
  check_value(shaped("hull", points + "[0.3, 0.3, 0.0009]]\n"), "MF126",
              points + "[0.3, 0.3, 0.0009]]");
  CHECK(parse(shaped("hull", points + "[0.3, 0.3, 0.0011]]\n")).bodies.size() == 1);
  const std::string line = "points_mm = [[0, 0, 0], [1, 1, 1], [2, 2, 2], [5, 5, 5]]";
  check_value(shaped("hull", line + "\n"), "MF126", line);
  const std::string same = "points_mm = [[3, 0, 0], [3, 0, 0], [3, 0, 0], [3, 0, 0]]";
  check_value(shaped("hull", same + "\n"), "MF126", same);
  const std::string three = "points_mm = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]";
  check_value(shaped("hull", three + "\n"), "MF126", three);
  // Missing keys, keys of another shape, names.
  CHECK(contains(check_error(shaped("hull", ""), "MF105", "[[body]]"), "points_mm"));
  CHECK(contains(check_error(shaped("mesh", ""), "MF105", "[[body]]"), "file"));
  check_error(shaped("mesh", "file = \"a\"\nradius_mm = 2\n"), "MF104", "radius_mm");
  check_error(shaped("hull", points + "[0, 0, 1]]\nfrom_mm = [0, 0, 0]\n"), "MF104", "from_mm");
  check_error(shaped("box", ends + "file = \"a\"\n"), "MF104", "file");
  check_error(shaped("box", ends + "clearance = 1\n"), "MF107", "clearance");
  check_error(shaped("mesh", "file = \"a\"\nframe = { xyz = [0, 0, 0] }\n"), "MF107", "xyz");
  check_error(base() + body("part", "X"), "MF112", "\"part\"");
  check_error(base() + body("a", "X") + body("a", "Y"), "MF112", "\"a\"\nlink = \"Y\"");
  check_error(base() + body("a b", "X"), "MF113", "\"a b\"");
  CHECK(contains(check_error(base() + body("a", "V"), "MF114", "\"V\""),
                 "X, Y, Z, C, B, base or workpiece"));
}

TEST_CASE("bodies: no axis takes the name of a link that every machine has",
          "[machines][definition]") {
  for (const char* name : {"base", "workpiece"}) {
    const std::string text = base() + axis_text(name, "W", false, false);
    check_error(text, "MF112", "\"" + std::string(name) + "\"");
  }
}

TEST_CASE("bodies: at most 1000 points in a hull", "[machines][definition]") {
  std::string points = "points_mm = [[0, 0, 1]";
  for (int i = 1; i < 1000; ++i)
    points += ", [" + std::to_string(i) + ", " + std::to_string(i * i) + ", 0]";
  CHECK(parse(shaped("hull", points + "]\n")).bodies.at(0).points.size() == 1000);
  check_error(shaped("hull", points + ", [7, 7, 7]]\n"), "MF119", "[7, 7, 7]");
}

TEST_CASE("collision: pairs that are allowed or have a clearance of their own",
          "[machines][definition]") {
  const MachineDefinition m =
      parse(base() + body("a", "X") + body("b", "B") + body("c", "C") +
            "[collision]\nallowed = [[\"a\", \"b\"], [\"part\", \"b\"]]\n"
            "[[collision.pair]]\nbodies = [\"c\", \"b\"]\nclearance_mm = 0.25\n"
            "[[collision.pair]]\nbodies = [\"a\", \"part\"]\nclearance_mm = 0\n");
  CHECK(m.collision.allowed == std::vector<Names>{{"a", "b"}, {"part", "b"}});
  REQUIRE(m.collision.pairs.size() == 2);
  CHECK(m.collision.pairs[0].first == "c");
  CHECK(m.collision.pairs[0].second == "b");
  CHECK(m.collision.pairs[0].clearance == 0.25);
  CHECK(m.collision.pairs[1].clearance == 0.0);
  CHECK(parse(base()).collision.allowed.empty());
  CHECK(parse(base()).collision.pairs.empty());
  CHECK(parse(base() + body("a", "X"), {{"collision.allowed", "[[\"a\", \"part\"]]"}})
            .collision.allowed.size() == 1);
}

TEST_CASE("collision: errors are located", "[machines][definition]") {
  const std::string bodies = base() + body("nozzle", "X") + body("casing", "B");
  const auto allowed = [&](const std::string& value) {
    return bodies + "[collision]\nallowed = " + value + "\n";
  };
  const auto pair = [&](const std::string& keys) { return bodies + "[[collision.pair]]\n" + keys; };
  const std::string clearance = "clearance_mm = 1\n";
  check_value(allowed("\"nozzle\""), "MF106", "allowed = \"nozzle\"");
  check_error(allowed("[[\"nozzle\"]]"), "MF106", "[\"nozzle\"]");
  check_error(allowed("[[\"nozzle\", \"casing\", \"part\"]]"), "MF106", "[\"nozzle\"");
  check_error(allowed("[[\"nozzle\", 7]]"), "MF106", "[\"nozzle\"");
  check_error(allowed("[\"casing\"]"), "MF106", "\"casing\"]");
  CHECK(contains(check_error(allowed("[[\"nozzle\", \"casting\"]]"), "MF114", "\"casting\""),
                 "did you mean casing?"));
  check_error(allowed("[[\"nozzle\", \"nozzle\"]]"), "MF124", "[\"nozzle\"");
  check_error(allowed("[[\"nozzle\", \"part\"], [\"part\", \"nozzle\"]]"), "MF124", "[\"part\"");
  check_error(bodies + "[collision]\nallow = []\n", "MF104", "allow");
  check_value("collision = 7\n" + bodies, "MF106", "collision = 7");

  check_value(pair("bodies = \"nozzle\"\n" + clearance), "MF106", "bodies = \"nozzle\"");
  check_value(pair("bodies = [\"nozzle\"]\n" + clearance), "MF106", "bodies = [\"nozzle\"]");
  check_error(pair("bodies = [\"nozzle\", \"horn\"]\n" + clearance), "MF114", "\"horn\"");
  const std::string good = "bodies = [\"nozzle\", \"part\"]\n";
  check_value(pair(good + "clearance_mm = -1\n"), "MF108", "clearance_mm = -1");
  check_value(pair(good + "clearance_mm = nan\n"), "MF109", "clearance_mm = nan");
  check_value(pair(good + "clearance_mm = true\n"), "MF106", "clearance_mm = true");
  check_error(pair(good + "clearance = 1\n"), "MF107", "clearance");
  check_error(pair(good), "MF105", "[[collision.pair]]");
  check_error(pair(clearance), "MF105", "[[collision.pair]]");
  check_error(pair(good + clearance + "body = 1\n"), "MF104", "body = 1");
  check_error(
      pair(good + clearance + "[[collision.pair]]\nbodies = [\"part\", \"nozzle\"]\n" + clearance),
      "MF124", "[\"part\"");
  // Allowed and required at once; two things that nothing moves against each other.
  check_error(allowed("[[\"nozzle\", \"part\"]]") + "[[collision.pair]]\n" + good + clearance,
              "MF124", "[\"nozzle\", \"part\"]");
  check_error(base() + body("a", "X") + body("b", "X") +
                  "[[collision.pair]]\nbodies = [\"a\", \"b\"]\n" + clearance,
              "MF124", "[\"a\", \"b\"]");
  check_error(
      base() + body("a", "C") + "[[collision.pair]]\nbodies = [\"a\", \"part\"]\n" + clearance,
      "MF124", "[\"a\", \"part\"]");
  // A body whose own link is wrong gives one error, not two.
  check_error(
      base() + body("a", "Q") + "[[collision.pair]]\nbodies = [\"a\", \"part\"]\n" + clearance,
      "MF114", "\"Q\"");
}

TEST_CASE("checked_pairs: links that a joint connects are left out but clamped things are not",
          "[machines][definition]") {
  // Tool chain X, Z, B; workpiece chain Y, C.
  std::string text = base() + "[tolerance]\nclearance_mm = 2\n";
  for (const char* link : {"X", "Y", "Z", "C", "B", "base", "workpiece"})
    text += body(std::string("on_") + link, link);
  const auto pairs = pairs_of(parse(text));
  // All 28 pairs of seven bodies and the part, without: X-base, X-Z, Z-B, Y-base, Y-C (one joint);
  // C-workpiece, C-part, workpiece-part (same link).
  const std::set<Names> left_out = {
      {"on_X", "on_base"}, {"on_X", "on_Z"},         {"on_Z", "on_B"}, {"on_Y", "on_base"},
      {"on_Y", "on_C"},    {"on_C", "on_workpiece"}, {"on_C", "part"}, {"on_workpiece", "part"}};
  CHECK(pairs.size() == 28 - left_out.size());
  for (const auto& [names, clearance] : pairs) {
    INFO(names.first << " " << names.second);
    CHECK_FALSE(left_out.count(names));
    CHECK(clearance == 2.0);
  }
  for (const char* name : {"on_X", "on_Y", "on_Z", "on_B", "on_base"})
    CHECK(pairs.count({name, "part"}));
  CHECK(pairs.count({"on_Y", "on_workpiece"}));
}

TEST_CASE("checked_pairs: without a workpiece chain the part stands on the base",
          "[machines][definition]") {
  const MachineDefinition m =
      parse("schema = 1\nname = \"m\"\n" + axis_text("X", "X", false, false) + body("bed", "base") +
            body("vise", "workpiece") + body("head", "X"));
  const auto pairs = pairs_of(m);
  // head-bed meet at joint X.
  CHECK(pairs.size() == 2);
  CHECK(pairs.count({"vise", "head"}));
  CHECK(pairs.count({"head", "part"}));
  CHECK(joint_carrying(m, "base") == -1);
  CHECK(joint_carrying(m, "workpiece") == -1);
  CHECK(joint_carrying(m, "X") == 0);
  CHECK(joint_carrying(parse(base()), "workpiece") == 3);
  CHECK_THROWS(joint_carrying(m, "Q"));
}

TEST_CASE("checked_pairs: the larger clearance or that of the pair", "[machines][definition]") {
  const std::string text = base() + body("a", "X", "clearance_mm = 3\n") +
                           body("b", "B", "clearance_mm = 5\n") + body("z", "Z") +
                           body("c", "C", "clearance_mm = 1\n") +
                           "[collision]\nallowed = [[\"c\", \"a\"]]\n"
                           "[[collision.pair]]\nbodies = [\"part\", \"b\"]\nclearance_mm = 0.5\n"
                           "[[collision.pair]]\nbodies = [\"z\", \"b\"]\nclearance_mm = 7\n";
  const std::map<Names, double> expected = {
      {{"a", "b"}, 5.0},  // the larger one
      {{"b", "z"}, 7.0},  // one joint connects Z and B: checked because the pair is named
      {{"b", "c"}, 5.0},    {{"z", "c"}, 1.0},   {{"a", "part"}, 3.0},
      {{"b", "part"}, 0.5}, {{"z", "part"}, 0.0}};  // a-z: one joint; c-part: same link
  CHECK(pairs_of(parse(text)) == expected);
}
