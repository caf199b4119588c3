#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <set>

#include "kernels/core/nearest_name.h"
#include "kernels/core/units.h"
#include "machines/definition/body_pairs.h"
#include "machines/definition/sections.h"

namespace smoothpost::machine_file {

namespace {

constexpr std::size_t kMaxHullPoints = 1000;
constexpr double kThinnest = 1e-3;  // mm: what is thinner has no inside
constexpr double kMillimetresPerInch = 25.4;
const char* const kPartName = "part";

void read_radii(TableReader& reader, Body& body) {
  const TomlEntry* entry = reader.entry("radius_mm");
  const bool single = entry != nullptr && entry->value.is_number();
  if (single) {
    body.radius_from = reader.number_or("radius_mm", 1.0, Bound::not_negative);
    body.radius_to = body.radius_from;
  } else {
    const auto radii = reader.required().numbers("radius_mm", 2);
    if (!radii) return;
    body.radius_from = (*radii)[0];
    body.radius_to = (*radii)[1];
  }
  if (body.radius_from < 0.0 || body.radius_to < 0.0 || body.radius_from + body.radius_to <= 0.0)
    reader.error("MF108", "radius_mm has to be at least 0 at both ends and more at one",
                 "radius_mm");
  else if (body.shape != BodyShape::frustum && body.radius_from != body.radius_to)
    reader.error("MF124", "radius_mm: only a frustum has two different radii", "radius_mm");
}

/// Frustum, cylinder, capsule and box.
void read_ends(TableReader& reader, Body& body) {
  const auto from = reader.required().vector("from_mm");
  const auto to = reader.required().vector("to_mm");
  body.from = from.value_or(Vec3::Zero());
  body.to = to.value_or(Vec3::Ones());
  if (!from || !to) return;
  if (*from == *to)
    reader.error("MF124", "to_mm is the same point as from_mm",
                 blame(reader, {"from_mm", "to_mm"}));
  else if (body.shape == BodyShape::box && (*to - *from).cwiseAbs().minCoeff() < kThinnest)
    reader.error("MF126",
                 "the box has no thickness: from_mm and to_mm have to differ in x, y and z",
                 blame(reader, {"from_mm", "to_mm"}));
}

/// Largest |f(p)| over the points, and the point.
template <class Measure>
std::pair<double, Vec3> farthest(const std::vector<Vec3>& points, Measure measure) {
  std::pair<double, Vec3> best{-1.0, Vec3::Zero()};
  for (const Vec3& p : points)
    if (const double value = measure(p); value > best.first) best = {value, p};
  return best;
}

/// Height of the points over a plane through three of them that are far apart, mm.
double thickness(const std::vector<Vec3>& points) {
  if (points.empty()) return 0.0;
  const Vec3 a = points.front();
  const auto [length, b] = farthest(points, [&](const Vec3& p) { return (p - a).stableNorm(); });
  if (!(length > 0.0)) return 0.0;
  const Vec3 along = (b - a) / length;
  const auto across = [&](const Vec3& p) { return Vec3((p - a) - along.dot(p - a) * along); };
  const auto [width, c] = farthest(points, [&](const Vec3& p) { return across(p).stableNorm(); });
  if (!(width > 0.0)) return 0.0;
  const Vec3 normal = along.cross(across(c) / width);
  return farthest(points, [&](const Vec3& p) { return std::abs(normal.dot(p - a)); }).first;
}

void read_points(TableReader& reader, Body& body) {
  const auto points = reader.required().vectors("points_mm", kMaxHullPoints);
  if (!points) return;
  body.points = *points;
  if (points->size() < 4)
    reader.error("MF126",
                 "points_mm has " + std::to_string(points->size()) +
                     " points: a hull needs at least 4 that do not lie in a plane",
                 "points_mm");
  else if (!(thickness(*points) >= kThinnest))
    reader.error("MF126", "the points of points_mm lie in a plane: a hull needs a thickness",
                 "points_mm");
}

void read_mesh(TableReader& reader, const std::string& folder, Body& body) {
  if (const auto file = reader.required().text("file")) {
    const bool plain = !file->empty() && std::none_of(file->begin(), file->end(), [](char c) {
      return static_cast<unsigned char>(c) < 0x20U;
    });
    if (plain)
      body.mesh_file = (std::filesystem::path(folder) / *file).generic_string();
    else
      reader.error("MF113", "file has to be the path of an STL file", "file");
  }
  if (reader.choice("units", {"mm", "inch"}) == "inch") body.mesh_scale = kMillimetresPerInch;
  TableReader frame = reader.table("frame", "body.frame");
  body.mesh_frame.translation() = frame.vector("xyz_mm").value_or(Vec3::Zero());
  const Vec3 rpy = frame.vector("rpy_deg").value_or(Vec3::Zero()) * kRadiansPerDegree;
  body.mesh_frame.linear() = rotation_from_rpy(rpy[0], rpy[1], rpy[2]);
  frame.finish();
}

void read_shape(TableReader& reader, const std::string& folder, Body& body) {
  static const std::map<std::string, BodyShape> shapes = {
      {"frustum", BodyShape::frustum}, {"cylinder", BodyShape::cylinder},
      {"capsule", BodyShape::capsule}, {"box", BodyShape::box},
      {"hull", BodyShape::hull},       {"mesh", BodyShape::mesh}};
  const auto shape =
      reader.required().choice("shape", {"frustum", "cylinder", "capsule", "box", "hull", "mesh"});
  if (!shape) {
    // Which keys belong to it is not known either.
    for (const char* key : {"from_mm", "to_mm", "radius_mm", "points_mm", "file", "units", "frame"})
      reader.entry(key);
    return;
  }
  body.shape = shapes.at(*shape);
  if (body.shape == BodyShape::hull) {
    read_points(reader, body);
  } else if (body.shape == BodyShape::mesh) {
    read_mesh(reader, folder, body);
  } else {
    read_ends(reader, body);
    if (body.shape != BodyShape::box) read_radii(reader, body);
  }
}

bool is_link(const std::vector<AxisDefinition>& axes, const std::string& link) {
  return link == "base" || link == "workpiece" ||
         std::any_of(axes.begin(), axes.end(),
                     [&](const AxisDefinition& axis) { return axis.name == link; });
}

void read_link(TableReader& reader, const std::vector<AxisDefinition>& axes, Body& body) {
  body.link = reader.required().text("link").value_or("base");
  if (is_link(axes, body.link)) return;
  std::vector<std::string> names;
  for (const auto& axis : axes) names.push_back(axis.name);
  names.insert(names.end(), {"base", "workpiece"});
  reader.error("MF114",
               "link names no axis of this machine: " + body.link.substr(0, 64) + "; there are " +
                   one_of(names),
               "link");
}

/// Reads the pairs of [collision] against the bodies of the machine.
class PairReader {
 public:
  PairReader(const MachineDefinition& machine, Problems& problems)
      : machine_(machine), problems_(problems) {
    for (const Body& body : machine.bodies) names_.push_back(body.name);
    names_.emplace_back(kPartName);
    for (const auto& name : names_) known_.insert(name);
  }

  /// The two names, or nothing when one of them is no body or both are the same.
  std::optional<std::pair<std::string, std::string>> read(const TomlValue& value) {
    bool good = true;
    for (const auto& item : value.items) {
      if (known_.count(item.string)) continue;
      good = false;
      const std::string guess =
          problems_.full() ? std::string() : nearest_name(item.string, names_);
      problems_.error("MF114",
                      "the machine has no body " + item.string.substr(0, 64) +
                          (guess.empty() ? std::string() : ": did you mean " + guess + "?"),
                      item.where);
    }
    if (!good) return std::nullopt;
    if (value.items[0].string == value.items[1].string) {
      problems_.error("MF124", "a pair has two different bodies", value.where);
      return std::nullopt;
    }
    return std::make_pair(value.items[0].string, value.items[1].string);
  }

  /// False, with an error, when the pair has stood before.
  bool is_new(const std::pair<std::string, std::string>& pair, const SourceLocation& where) {
    if (seen_.insert(std::minmax(pair.first, pair.second)).second) return true;
    problems_.error("MF124",
                    "the pair " + pair.first.substr(0, 64) + ", " + pair.second.substr(0, 64) +
                        " stands in [collision] more than once",
                    where);
    return false;
  }

  /// An error when nothing ever moves one of the two against the other.
  void check_motion(const std::pair<std::string, std::string>& pair, const SourceLocation& where) {
    const auto joint = [&](const std::string& name) -> std::optional<int> {
      const auto found = std::find_if(machine_.bodies.begin(), machine_.bodies.end(),
                                      [&](const Body& body) { return body.name == name; });
      const std::string link = found != machine_.bodies.end() ? found->link : "workpiece";
      if (!is_link(machine_.axes, link)) return std::nullopt;  // reported with its body
      return joint_carrying(machine_, link);
    };
    const auto first = joint(pair.first);
    const auto second = joint(pair.second);
    if (!first || !second || *first != *second) return;
    problems_.error("MF124",
                    pair.first.substr(0, 64) + " and " + pair.second.substr(0, 64) +
                        " are fixed to each other: their distance is not checked",
                    where);
  }

 private:
  const MachineDefinition& machine_;
  Problems& problems_;
  std::vector<std::string> names_;
  std::set<std::string> known_;
  std::set<std::pair<std::string, std::string>> seen_;
};

}  // namespace

Body read_body(const TomlValue& item, const BodyContext& context, Problems& problems) {
  TableReader reader(&item.table, "[[body]]", item.where, problems);
  Body body;
  if (const auto name = reader.required().text("name")) {
    body.name = *name;
    if (!is_name(*name, true))
      reader.error("MF113", "a body's name is letters, digits, _ and -", "name");
    if (*name == kPartName)
      reader.error("MF112", "part is the name of the part itself: give the body another", "name");
  }
  read_link(reader, context.axes, body);
  read_shape(reader, context.folder, body);
  body.clearance = reader.number_or("clearance_mm", context.clearance, Bound::not_negative);
  reader.finish();
  return body;
}

CollisionSettings read_collision(TableReader reader, const MachineDefinition& machine,
                                 Problems& problems) {
  CollisionSettings collision;
  PairReader pairs(machine, problems);
  for (const TomlValue* item : reader.pairs("allowed")) {
    const auto pair = pairs.read(*item);
    if (pair && pairs.is_new(*pair, item->where)) collision.allowed.push_back(*pair);
  }
  for (const TomlValue* item : reader.tables("pair")) {
    TableReader table(&item->table, "[[collision.pair]]", item->where, problems);
    const TomlValue* bodies = table.required().pair("bodies");
    const auto clearance = table.required().number("clearance_mm", Bound::not_negative);
    const auto pair = bodies != nullptr ? pairs.read(*bodies) : std::nullopt;
    if (pair && pairs.is_new(*pair, bodies->where)) {
      pairs.check_motion(*pair, bodies->where);
      collision.pairs.push_back({pair->first, pair->second, clearance.value_or(0.0)});
    }
    table.finish();
  }
  reader.finish();
  return collision;
}

}  // namespace smoothpost::machine_file
