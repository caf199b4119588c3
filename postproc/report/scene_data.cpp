#include "postproc/report/scene_data.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>

#include "kernels/core/units.h"
#include "postproc/report/html_text.h"
#include "postproc/report/scene_mesh.h"

namespace smoothpost {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostMarks = 24;
constexpr std::size_t kMostText = 160;  // bytes of a line
constexpr double kAngleStep = radians_from_degrees(4.0);

/// Numbers as base64 of their little-endian bytes.
template <typename T>
std::string packed(const std::vector<T>& values) {
  static_assert(std::endian::native == std::endian::little);
  std::string bytes(values.size() * sizeof(T), '\0');
  if (!values.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return base64(bytes);
}

Json vector_json(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

Json pose_json(const Pose& pose) {
  Json out = Json::array();
  for (int c = 0; c < 4; ++c)
    for (int r = 0; r < 4; ++r) out.push_back(pose.matrix()(r, c));
  return out;
}

/// float32 coordinates from `centre`.
void add_point(std::vector<float>& out, const Vec3& p, const Vec3& centre) {
  for (int k = 0; k < 3; ++k) out.push_back(static_cast<float>(p[k] - centre[k]));
}

Json mesh_json(const TriangleMesh& mesh, const Vec3& centre) {
  std::vector<float> xyz;
  for (const Vec3& v : mesh.vertices) add_point(xyz, v, centre);
  std::vector<std::uint32_t> triangles;
  for (const auto& t : mesh.triangles) triangles.insert(triangles.end(), t.begin(), t.end());
  return {{"xyz", packed(xyz)}, {"triangles", packed(triangles)}};
}

struct Bounds {
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();
  bool any = false;
  void see(const Vec3& p) {
    if (!p.allFinite()) return;
    low = any ? low.cwiseMin(p) : p;
    high = any ? high.cwiseMax(p) : p;
    any = true;
  }
};

/// A place of the input's path; `start` begins a new line.
struct InputPlace {
  Vec3 tip;
  std::uint32_t line = 0;
  bool start = false;
};

/// The input's motion between its links, arcs and turns in steps.
std::vector<InputPlace> input_places(const ReferencePath& reference) {
  std::vector<InputPlace> out;
  const auto& points = reference.path().points;
  bool open = false;
  for (std::size_t k = 1; k < points.size(); ++k) {
    if (points[k].replanned || points[k].kind == MotionKind::rapid) {
      open = false;
      continue;
    }
    if (!open) out.push_back({reference.at(k, 0.0).tip, points[k].line, true});
    open = true;
    const double turn =
        angle_between(points[k - 1].location.axis, points[k].location.axis) / kAngleStep;
    const int parts = points[k].is_arc ? 24 : std::clamp(static_cast<int>(std::ceil(turn)), 1, 16);
    for (int i = 1; i <= parts; ++i)
      out.push_back({reference.at(k, static_cast<double>(i) / parts).tip, points[k].line, false});
  }
  return out;
}

/// Indices of at most about `most` of `count` places, those of `kept` among them.
template <typename Kept>
std::vector<std::size_t> thinned(std::size_t count, std::size_t most, const Kept& kept) {
  std::vector<std::size_t> out;
  const std::size_t every = count / std::max<std::size_t>(most, 1) + 1;
  std::size_t spare = most / 4;  // what `kept` may add
  for (std::size_t i = 0; i < count; ++i) {
    const bool due = i % every == 0 || i + 1 == count;
    if (!due && (spare == 0 || !kept(i))) continue;
    if (!due) --spare;
    out.push_back(i);
  }
  return out;
}

/// The lines of a text by number, as far as `most` bytes go.
Json texts_json(std::string_view text, const std::set<std::uint32_t>& lines, std::size_t most) {
  Json out = Json::array();
  std::uint32_t number = 1;
  std::size_t at = 0, used = 0;
  for (const std::uint32_t wanted : lines) {
    while (number < wanted && at < text.size()) {
      const std::size_t end = text.find('\n', at);
      at = end == std::string_view::npos ? text.size() : end + 1;
      ++number;
    }
    if (at >= text.size()) break;
    std::string_view line = text.substr(at, text.find('\n', at) - at);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    std::string shown(line.substr(0, kMostText));
    if (line.size() > kMostText) shown += " ...";
    used += shown.size() + 12;
    if (used > most) break;
    out.push_back({wanted, shown});
  }
  return out;
}

/// Where the rotaries of a head or the last ones of an arm are centred: a point on the axis of the
/// last rotary of the tool side, nearest to the axis before it; carried by that joint.
Json wrist_json(const ScrewChain& chain) {
  int last = -1, before = -1;
  for (int j = 0; j < chain.size(); ++j) {
    const ChainJoint& joint = chain.joints[static_cast<std::size_t>(j)];
    if (joint.side != ChainSide::tool || joint.kind != JointKind::rotary) continue;
    before = last;
    last = j;
  }
  if (last < 0) return nullptr;
  const ChainJoint& b = chain.joints[static_cast<std::size_t>(last)];
  Vec3 point = b.origin;
  if (before >= 0) {
    const ChainJoint& a = chain.joints[static_cast<std::size_t>(before)];
    const Vec3 across = a.direction.cross(b.direction);
    const double size = across.squaredNorm();
    if (size > 1e-12)
      point += (a.origin - b.origin).cross(a.direction).dot(across) / -size * b.direction;
  }
  return {{"joint", last}, {"point", vector_json(point)}};
}

class SceneBuilder {
 public:
  SceneBuilder(const PageInput& in, const ReferencePath* reference, const ScrewChain& chain,
               const ProgramMotion& motion, const SceneSettings& settings)
      : in_(in), chain_(chain), points_(motion.points), settings_(settings) {
    if (reference) input_ = input_places(*reference);
  }

  Json run() {
    shown_ = thinned(points_.size(), settings_.points, [this](std::size_t i) {
      const ProgramPoint& p = points_[i];
      const ProgramPoint& next = points_[std::min(i + 1, points_.size() - 1)];
      return (p.link && p.line_end) || p.beam != next.beam || p.link != next.link ||
             is_worst(p.output_line);
    });
    find_bounds();
    Json j;
    j["in_all"] = points_.size();
    j["tip_tolerance"] = in_.machine->tolerance.tip;
    j["centre"] = vector_json(centre_);
    j["size"] = size_;
    add_machine(j);
    add_points(j);
    add_original(j);
    if (in_.part) {
      j["part"] = mesh_json(decimated(*in_.part, settings_.part_triangles), centre_);
      j["part"]["in_all"] = in_.part->triangles.size();
    }
    add_bodies(j);
    j["marks"] = marks();
    j["texts"] = {{"input", texts_json(in_.input_text, input_lines_, settings_.text_bytes)},
                  {"output", texts_json(in_.program_text, output_lines_, settings_.text_bytes)}};
    return j;
  }

 private:
  bool is_worst(std::uint32_t line) const {
    return std::any_of(in_.conversion.checks.begin(), in_.conversion.checks.end(),
                       [line](const Check& c) { return c.output_line == line && line > 0; });
  }

  /// Of part and cuts; links would make everything small.
  void find_bounds() {
    Bounds b;
    if (in_.part)
      for (const Vec3& v : in_.part->vertices) b.see(v);
    for (const InputPlace& p : input_) b.see(p.tip);
    for (const ProgramPoint& p : points_)
      if (!p.link) b.see(p.tip);
    if (!b.any)
      for (const ProgramPoint& p : points_) b.see(p.tip);
    centre_ = 0.5 * (b.low + b.high);
    size_ = std::max((b.high - b.low).norm(), 1e-3);
  }

  void add_machine(Json& j) const {
    Json axes = Json::array();
    for (std::size_t i = 0; i < in_.machine->axes.size(); ++i) {
      const AxisDefinition& axis = in_.machine->axes[i];
      const bool rotary = axis.joint.kind == JointKind::rotary;
      const double unit = rotary ? kDegreesPerRadian : 1.0;
      axes.push_back({{"name", axis.name},
                      {"unit", rotary ? "deg" : "mm"},
                      {"scale", scale_of(i)},
                      {"kind", rotary ? "rotary" : "linear"},
                      {"side", axis.joint.side == ChainSide::tool ? "tool" : "workpiece"},
                      {"direction", vector_json(axis.joint.direction)},
                      {"origin", vector_json(axis.joint.origin)},
                      {"range", {unit * axis.joint.lower, unit * axis.joint.upper}}});
    }
    j["axes"] = std::move(axes);
    j["home"] = pose_json(chain_.workpiece_home);
    j["tool_home"] = pose_json(chain_.tool_home);
    j["tool_axis"] = vector_json(chain_.tool_axis);
    j["wrist"] = wrist_json(chain_);
  }

  double shown_joint(std::size_t point, std::size_t axis) const {
    const bool rotary = in_.machine->axes[axis].joint.kind == JointKind::rotary;
    return (rotary ? kDegreesPerRadian : 1.0) * points_[point].joints[static_cast<int>(axis)];
  }

  /// The unit of an axis' integers: 1e-5, more where they would not fit.
  double scale_of(std::size_t axis) const {
    double most = 0.0;
    for (const std::size_t i : shown_) most = std::max(most, std::abs(shown_joint(i, axis)));
    double scale = 1e-5;
    while (most / scale > 2e9) scale *= 10.0;
    return scale;
  }

  void add_points(Json& j) {
    std::vector<double> time;
    std::vector<std::uint32_t> output, input;
    std::vector<float> deviation;
    std::vector<std::uint8_t> flags;
    Json lengths = Json::array();
    double length = std::numeric_limits<double>::quiet_NaN();
    for (const std::size_t i : shown_) {
      const ProgramPoint& p = points_[i];
      if (p.tool_length != length) lengths.push_back({time.size(), length = p.tool_length});
      time.push_back(p.time);
      output.push_back(p.output_line);
      input.push_back(p.input_line);
      add_point(deviation, p.deviation.value_or(Vec3::Zero()), Vec3::Zero());
      flags.push_back(static_cast<std::uint8_t>((p.beam ? 1 : 0) | (p.link ? 2 : 0) |
                                                (p.line_end ? 4 : 0) | (p.deviation ? 8 : 0)));
      output_lines_.insert(p.output_line);
      if (p.input_line > 0) input_lines_.insert(p.input_line);
    }
    Json joints = Json::array();
    for (std::size_t axis = 0; axis < in_.machine->axes.size(); ++axis) {
      std::vector<std::int32_t> column;
      const double scale = scale_of(axis);
      for (const std::size_t i : shown_)
        column.push_back(static_cast<std::int32_t>(std::lround(shown_joint(i, axis) / scale)));
      joints.push_back(packed(column));
    }
    j["points"] = {{"time", packed(time)},           {"joints", joints},
                   {"output_line", packed(output)},  {"input_line", packed(input)},
                   {"deviation", packed(deviation)}, {"flags", packed(flags)}};
    j["tool_lengths"] = std::move(lengths);
  }

  void add_original(Json& j) {
    std::vector<float> xyz;
    std::vector<std::uint32_t> lines, starts;
    const auto shown = thinned(input_.size(), settings_.points, [this](std::size_t i) {
      return input_[i].start || (i + 1 < input_.size() && input_[i + 1].start);
    });
    bool cut = true;  // a start that was thinned away begins at the next place
    std::size_t next = 0;
    for (const std::size_t i : shown) {
      for (; next <= i; ++next) cut = cut || input_[next].start;
      if (cut) starts.push_back(static_cast<std::uint32_t>(lines.size()));
      cut = false;
      add_point(xyz, input_[i].tip, centre_);
      lines.push_back(input_[i].line);
    }
    j["original"] = {{"xyz", packed(xyz)}, {"line", packed(lines)}, {"starts", packed(starts)}};
  }

  void add_bodies(Json& j) const {
    Json list = Json::array();
    const auto& bodies = in_.machine->bodies;
    for (const Body& body : bodies) {
      const TriangleMesh surface = decimated(
          surface_of(body), std::max<std::size_t>(settings_.body_triangles / bodies.size(), 100));
      if (surface.triangles.empty()) continue;
      Json b = mesh_json(surface, Vec3::Zero());
      b["name"] = body.name;
      b["link"] = body.link == "workpiece" ? -2 : in_.machine->axis_by_name(body.link);
      list.push_back(std::move(b));
    }
    j["bodies"] = std::move(list);
  }

  /// The first drawn place of a check's output line or behind it, or on its input line.
  std::vector<std::size_t>::const_iterator place_of(const Check& c) const {
    if (c.output_line > 0)
      return std::lower_bound(
          shown_.begin(), shown_.end(), c.output_line,
          [this](std::size_t i, std::uint32_t line) { return points_[i].output_line < line; });
    return std::find_if(shown_.begin(), shown_.end(), [&](std::size_t i) {
      return c.input_line > 0 && points_[i].input_line == c.input_line;
    });
  }

  /// The tightest place of each check that has one, failed ones first.
  Json marks() const {
    Json list = Json::array();
    for (const bool failed : {true, false})
      for (const Check& c : in_.conversion.checks) {
        if (c.ok == failed || list.size() >= kMostMarks) continue;
        if (c.name.rfind("round_trip.", 0) == 0) continue;
        const auto at = place_of(c);
        if (at == shown_.end()) continue;
        list.push_back(
            {{"name", c.name},
             {"point", at - shown_.begin()},
             {"failed", !c.ok},
             {"output_line", points_[*at].output_line},
             {"input_line", c.input_line},
             {"text", short_number(c.value) + " of " + short_number(c.limit) + " " + c.unit}});
      }
    return list;
  }

  const PageInput& in_;
  const ScrewChain& chain_;
  const std::vector<ProgramPoint>& points_;
  SceneSettings settings_;
  std::vector<InputPlace> input_;
  std::vector<std::size_t> shown_;
  std::set<std::uint32_t> input_lines_, output_lines_;
  Vec3 centre_ = Vec3::Zero();
  double size_ = 1.0;
};

/// What could end a <script> element or start a comment in it is written as an escape.
std::string inside_script(const std::string& json) {
  std::string out;
  out.reserve(json.size());
  for (const char c : json) {
    if (c == '<')
      out += "\\u003c";
    else if (c == '>')
      out += "\\u003e";
    else if (c == '&')
      out += "\\u0026";
    else
      out += c;
  }
  return out;
}

}  // namespace

std::string scene_json(const PageInput& in, const ReferencePath* reference, const ScrewChain& chain,
                       const ProgramMotion& motion, const SceneSettings& settings) {
  if (!in.machine) return "{}";
  const Json scene = SceneBuilder(in, reference, chain, motion, settings).run();
  return inside_script(scene.dump(-1, ' ', false, Json::error_handler_t::replace));
}

}  // namespace smoothpost
