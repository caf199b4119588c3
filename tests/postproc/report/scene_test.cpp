#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>

#include "kernels/core/units.h"
#include "kernels/kinematics/screw_chain.h"
#include "postproc/pipeline/conversion_parts.h"
#include "postproc/report/scene_data.h"
#include "postproc/report/scene_mesh.h"
#include "tests/postproc/report/drawn.h"

using namespace smoothpost;
using namespace smoothpost::test;
using Json = nlohmann::json;

namespace {

/// The bytes of base64 text, by another way than the writer's.
template <typename T>
std::vector<T> unpacked(const Json& text) {
  std::string bytes;
  unsigned value = 0;
  int bits = 0;
  for (const char c : text.get<std::string>()) {
    if (c == '=') break;
    const int digit = c >= 'A' && c <= 'Z'   ? c - 'A'
                      : c >= 'a' && c <= 'z' ? c - 'a' + 26
                      : c >= '0' && c <= '9' ? c - '0' + 52
                      : c == '+'             ? 62
                                             : 63;
    value = value << 6U | static_cast<unsigned>(digit);
    bits += 6;
    if (bits >= 8) {
      bits -= 8;
      bytes += static_cast<char>(value >> static_cast<unsigned>(bits) & 0xFFU);
    }
  }
  std::vector<T> out(bytes.size() / sizeof(T));
  if (!out.empty()) std::memcpy(out.data(), bytes.data(), out.size() * sizeof(T));
  return out;
}

struct DrawnScene {
  Drawn d;
  ScrewChain chain = {};
  ProgramMotion motion = {};
  Json json = {};
};

DrawnScene scene_of(Drawn d, const SceneSettings& settings = {}) {
  DrawnScene s{std::move(d)};
  const ReferencePath reference(s.d.conversion.path, s.d.in.input.frames);
  s.chain = placed_chain(s.d.in.machine, s.d.in.placement);
  s.motion = program_motion(s.d.page(), &reference, s.chain);
  s.json = Json::parse(scene_json(s.d.page(), &reference, s.chain, s.motion, settings));
  return s;
}

}  // namespace

TEST_CASE("scene: the columns are the program's joints and lines", "[postproc][report]") {
  for (const char* machine : {"table_table_bc", "robot_6r"}) {
    INFO(machine);
    const DrawnScene s = scene_of(drawn(machine));
    const auto& points = s.motion.points;
    REQUIRE(points.size() > 50);
    CHECK(s.json["in_all"] == points.size());
    const auto time = unpacked<double>(s.json["points"]["time"]);
    const auto output = unpacked<std::uint32_t>(s.json["points"]["output_line"]);
    const auto flags = unpacked<std::uint8_t>(s.json["points"]["flags"]);
    REQUIRE(time.size() == points.size());
    for (std::size_t j = 0; j < s.d.in.machine.axes.size(); ++j) {
      const auto column = unpacked<std::int32_t>(s.json["points"]["joints"][j]);
      const double scale = s.json["axes"][j]["scale"];
      const bool rotary = s.json["axes"][j]["unit"] == "deg";
      REQUIRE(column.size() == points.size());
      double worst = 0.0;
      for (std::size_t i = 0; i < points.size(); ++i) {
        const double q = points[i].joints[static_cast<int>(j)];
        worst =
            std::max(worst, std::abs(column[i] * scale - (rotary ? degrees_from_radians(q) : q)));
      }
      CHECK(worst <= 0.5001 * scale);
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
      CHECK(time[i] == points[i].time);
      CHECK(output[i] == points[i].output_line);
      CHECK(((flags[i] & 2U) != 0) == points[i].link);
      CHECK(((flags[i] & 8U) != 0) == points[i].deviation.has_value());
    }
  }
}

TEST_CASE("scene: thinned to its size with the worst places and both ends", "[postproc][report]") {
  SceneSettings settings;
  settings.points = 40;
  const DrawnScene s = scene_of(drawn(), settings);
  const auto output = unpacked<std::uint32_t>(s.json["points"]["output_line"]);
  const auto time = unpacked<double>(s.json["points"]["time"]);
  CHECK(output.size() <= 52);
  CHECK(s.json["in_all"].get<std::size_t>() > 52);
  CHECK(time.front() == s.motion.points.front().time);
  CHECK(time.back() == s.motion.points.back().time);
  REQUIRE(!s.json["marks"].empty());
  for (const auto& mark : s.json["marks"]) {
    REQUIRE(mark["point"].get<std::size_t>() < output.size());
    CHECK(output[mark["point"].get<std::size_t>()] >= mark["output_line"].get<std::uint32_t>());
  }
}

TEST_CASE("scene: what it is written into cannot be left by it", "[postproc][report]") {
  Drawn d = drawn();
  d.in.machine.axes[0].name = "</script><script>alert(1)</script>";
  d.in.machine.axes[1].name = "<!-- & \xff";
  const ReferencePath reference(d.conversion.path, d.in.input.frames);
  const ScrewChain chain = placed_chain(d.in.machine, d.in.placement);
  PageInput page = d.page();
  const std::string nasty = "(</script><img src=x onerror=alert(2)>)\n(<!--)\n";
  page.program_text = nasty;
  page.input_text = nasty;
  const std::string text =
      scene_json(page, &reference, chain, program_motion(page, &reference, chain), {});
  CHECK(text.find('<') == std::string::npos);
  CHECK(text.find('>') == std::string::npos);
  CHECK(text.find('&') == std::string::npos);
  CHECK(Json::parse(text)["axes"][0]["name"] == "</script><script>alert(1)</script>");
  CHECK(scene_json({d.conversion, d.context}, nullptr, {}, {}, {}) == "{}");
}

TEST_CASE("scene: a picked point has the text of its lines", "[postproc][report]") {
  Drawn d = drawn();
  const std::string input = small_program();
  const ReferencePath reference(d.conversion.path, d.in.input.frames);
  const ScrewChain chain = placed_chain(d.in.machine, d.in.placement);
  PageInput page = d.page();
  page.input_text = input;
  const ProgramMotion motion = program_motion(page, &reference, chain);
  const Json json = Json::parse(scene_json(page, &reference, chain, motion, {}));
  std::map<int, std::string> lines;
  for (const auto& row : json["texts"]["input"]) lines[row[0]] = row[1];
  CHECK(lines.at(11) == "G1 X20 F600");
  CHECK(lines.at(13) == "G2 X20 Y10 I0 J10");
  for (const auto& row : json["texts"]["output"]) lines[row[0]] = row[1];
  for (const ProgramPoint& p : motion.points)
    if (!p.link) CHECK(contains(lines.at(static_cast<int>(p.output_line)), "G1"));
}

TEST_CASE("scene: the wrist of a head is where its rotary axes meet", "[postproc][report]") {
  Drawn d = drawn("robot_6r");
  const DrawnScene s = scene_of(std::move(d));
  REQUIRE(s.json["wrist"].is_object());
  const auto& joints = s.chain.joints;
  const int last = s.json["wrist"]["joint"];
  CHECK(last == 5);
  Vec3 p;
  for (int k = 0; k < 3; ++k) p[k] = s.json["wrist"]["point"][static_cast<std::size_t>(k)];
  for (const int j : {4, 5}) {
    const ChainJoint& joint = joints[static_cast<std::size_t>(j)];
    CHECK((p - joint.origin).cross(joint.direction).norm() < 1e-9);
  }
  CHECK(scene_of(drawn("table_table_bc")).json["wrist"].is_null());
}

TEST_CASE("decimated: fewer triangles inside the same box and a small mesh unchanged",
          "[postproc][report]") {
  TriangleMesh mesh;  // a waved sheet of 200 by 200 squares
  constexpr std::uint32_t kSide = 201;
  for (std::uint32_t y = 0; y < kSide; ++y)
    for (std::uint32_t x = 0; x < kSide; ++x)
      mesh.vertices.emplace_back(x, y, 5.0 * std::sin(0.1 * x));
  for (std::uint32_t y = 0; y + 1 < kSide; ++y)
    for (std::uint32_t x = 0; x + 1 < kSide; ++x) {
      const std::uint32_t a = y * kSide + x;
      mesh.triangles.push_back({a, a + 1, a + kSide});
      mesh.triangles.push_back({a + 1, a + kSide + 1, a + kSide});
    }
  const TriangleMesh small = decimated(mesh, 5000);
  CHECK(small.triangles.size() <= 5000);
  CHECK(small.triangles.size() > 1000);
  for (const Vec3& v : small.vertices) {
    CHECK(v.x() >= 0.0);
    CHECK(v.x() <= 200.0);
    CHECK(std::abs(v.z() - 5.0 * std::sin(0.1 * v.x())) < 1.0);
  }
  for (const auto& t : small.triangles)
    for (const auto i : t) CHECK(i < small.vertices.size());
  CHECK(decimated(mesh, 100000).triangles.size() == mesh.triangles.size());
  CHECK(decimated({}, 10).triangles.empty());
}

TEST_CASE("surface_of: closed surfaces of the shape's volume, counter-clockwise from outside",
          "[postproc][report]") {
  const auto volume = [](const TriangleMesh& mesh) {
    double six = 0.0;
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const auto& t : mesh.triangles) {
      six += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]]));
      for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
    }
    for (const auto& [edge, count] : edges) {
      CHECK(count == 1);
      CHECK(edges.count({edge.second, edge.first}) == 1);
    }
    return six / 6.0;
  };
  Body b;
  b.shape = BodyShape::box;
  b.from = {10, 20, 30};
  b.to = {13, 24, 35};
  CHECK(volume(surface_of(b)) == Approx(60.0));
  b.shape = BodyShape::hull;  // a tetrahedron: no four points of it lie in a plane
  b.points = {{0, 0, 0}, {6, 0, 0}, {0, 6, 0}, {0, 0, 6}};
  CHECK(volume(surface_of(b)) == Approx(36.0));
  b.shape = BodyShape::cylinder;
  b.from = {0, 0, 5};
  b.to = {0, 0, 15};
  b.radius_from = b.radius_to = 3.0;
  CHECK(volume(surface_of(b)) == Approx(kPi * 90.0).epsilon(0.02));
  b.shape = BodyShape::frustum;
  b.radius_to = 1.0;
  CHECK(volume(surface_of(b)) == Approx(kPi * 10.0 / 3.0 * (9.0 + 3.0 + 1.0)).epsilon(0.02));
  b.shape = BodyShape::mesh;
  CHECK(surface_of(b).triangles.empty());
}
