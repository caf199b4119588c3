#pragma once

#include <string>
#include <utility>
#include <vector>

#include "kernels/core/tool_path.h"
#include "postproc/pipeline/interpret.h"
#include "tests/support/machines.h"

// Tool paths written out by hand, and conversions of short programs.
namespace smoothpost::test {

/// Builds a ToolPath of cutter locations; W is the words' frame.
class PathMaker {
 public:
  explicit PathMaker(const Vec3& start, const Vec3& axis = Vec3::UnitZ()) {
    add(start, axis).kind = MotionKind::rapid;
  }
  PathMaker& axis(const Vec3& a) {
    axis_ = a.normalized();
    return *this;
  }
  PathMaker& rapid(const Vec3& to) {
    add(to, axis_).kind = MotionKind::rapid;
    return *this;
  }
  PathMaker& feed(const Vec3& to, double seconds = 1.0) {
    PathPoint& p = add(to, axis_);
    p.duration = seconds;
    p.beam = beam_;
    return *this;
  }
  /// About a normal of Z through `centre`, `rise` along Z.
  PathMaker& arc(const Vec3& centre, double sweep, double rise = 0.0, double seconds = 1.0) {
    const Vec3 spoke = path_.points.back().location.tip - centre;
    const Vec3 end = centre + rotation_about(Vec3::UnitZ(), sweep) * spoke + Vec3(0, 0, rise);
    path_.arcs.push_back({centre, Vec3::UnitZ(), sweep});
    PathPoint& p = add(end, axis_);
    p.is_arc = true;
    p.arc = static_cast<std::int32_t>(path_.arcs.size()) - 1;
    p.duration = seconds;
    p.beam = beam_;
    return *this;
  }
  PathMaker& event(const std::string& name,
                   std::vector<std::pair<std::string, std::string>> parameters = {}) {
    PathEvent e;
    e.point = path_.points.size() - 1;
    e.event.name = name;
    e.event.parameters = std::move(parameters);
    e.line = ++line_;
    path_.events.push_back(e);
    if (name == "beam_on") beam_ = true;
    if (name == "beam_off") beam_ = false;
    return *this;
  }
  PathMaker& dwell(double seconds) {
    PathEvent e;
    e.kind = PathEvent::Kind::dwell;
    e.point = path_.points.size() - 1;
    e.seconds = seconds;
    path_.events.push_back(e);
    return *this;
  }
  std::size_t last() const { return path_.points.size() - 1; }
  ToolPath take() { return std::move(path_); }

 private:
  PathPoint& add(const Vec3& tip, const Vec3& axis) {
    axis_ = axis;
    PathPoint p;
    p.location = {tip, axis};
    p.kind = MotionKind::feed;
    for (std::size_t i = 0; i < 3; ++i) p.words[i] = tip[static_cast<Eigen::Index>(i)];
    p.line = ++line_;
    path_.points.push_back(p);
    return path_.points.back();
  }

  ToolPath path_;
  Vec3 axis_ = Vec3::UnitZ();
  bool beam_ = false;
  std::uint32_t line_ = 0;
};

inline std::vector<std::string> event_names(const ToolPath& path) {
  std::vector<std::string> names;
  for (const auto& e : path.events)
    if (e.kind == PathEvent::Kind::process) names.push_back(e.event.name);
  return names;
}

inline Pose shifted(double x, double y, double z) {
  Pose p = Pose::Identity();
  p.translation() = Vec3(x, y, z);
  return p;
}

/// Reads NC text that was posted for a shipped machine; REQUIREs that it can be read.
inline InterpretedInput read_program(const std::string& text, const std::string& machine) {
  InputSettings settings;
  settings.file_name = "part.ngc";
  settings.machine = shipped_machine(machine);
  settings.tool_lengths = {{1, 60.0}, {2, 85.5}};
  auto read = interpret_nc(text, settings);
  for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(read.ok());
  return std::move(read.value());
}

inline bool has_code(const Diagnostics& diagnostics, const std::string& code) {
  for (const auto& d : diagnostics)
    if (d.code == code) return true;
  return false;
}

}  // namespace smoothpost::test
