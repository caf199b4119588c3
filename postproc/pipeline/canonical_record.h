#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include "kernels/core/canonical_motion.h"
#include "kernels/core/tool_path.h"

namespace smoothpost {

/// Keeps what an interpreter calls: 128 bytes a motion, as a motion mostly starts where the one
/// before ends.
class CanonicalRecord final : public CanonicalSink {
 public:
  /// A CanonicalMotion without its start.
  struct Motion {
    MotionKind kind = MotionKind::feed;
    bool tcp = false;
    bool axis_vector = false;
    bool machine_position = false;
    bool probe = false;
    bool synchronised = false;  ///< it follows the turning of the spindle
    AxisMask unknown_start = 0;
    AxisMask unknown_end = 0;
    AxisMask programmed = 0;
    std::uint32_t line = 0;
    std::uint32_t column = 0;
    std::int32_t arc = -1;  ///< index into arcs; -1: straight
    double duration = 0.0;
    AxisWords end{};
    Vec3 end_axis = Vec3::UnitZ();
  };

  static_assert(sizeof(Motion) <= 128);

  struct Start {
    AxisWords words{};
    Vec3 axis = Vec3::UnitZ();
  };

  struct State {
    double length;
    int tool;
    Vec3 origin;
    double rotation;
    int system;
    std::uint32_t line;
  };

  /// A call that is no motion, and how many motions were before it.
  struct Step {
    enum class Kind : std::uint8_t { event, tool, offset } kind;
    std::size_t index;  ///< into events or states
    std::size_t motions_before;
  };

  std::vector<Motion> motions;
  std::vector<ArcGeometry> arcs;
  std::vector<PathEvent> events;
  std::vector<State> states;
  std::vector<Step> steps;

  /// Where a motion starts. @pre index < motions.size()   Cost: logarithmic in the motions that do
  /// not start at the end before.
  Start start_of(std::size_t index) const {
    const auto found =
        std::lower_bound(starts_.begin(), starts_.end(), index,
                         [](const OwnStart& own, std::size_t value) { return own.motion < value; });
    if (found != starts_.end() && found->motion == index) return found->start;
    return {motions[index - 1].end, motions[index - 1].end_axis};
  }

  void motion(const CanonicalMotion& m) override {
    const bool follows = !motions.empty() && m.start == motions.back().end &&
                         m.start_axis == motions.back().end_axis;
    if (!follows) starts_.push_back({motions.size(), {m.start, m.start_axis}});
    Motion kept{m.kind,       m.tcp,          m.axis_vector,   m.machine_position,
                m.probe,      m.pitch != 0.0, m.unknown_start, m.unknown_end,
                m.programmed, m.line,         m.column,        -1,
                m.duration,   m.end,          m.end_axis};
    if (m.is_arc) {
      kept.arc = static_cast<std::int32_t>(arcs.size());
      arcs.push_back(m.arc);
    }
    motions.push_back(kept);
  }
  void dwell(double seconds, std::uint32_t line) override {
    PathEvent e;
    e.kind = PathEvent::Kind::dwell;
    e.seconds = seconds;
    e.line = line;
    add(std::move(e));
  }
  void event(const ProcessEvent& event) override {
    PathEvent e;
    e.event = event;
    e.line = event.line;
    add(std::move(e));
  }
  void comment(std::string_view text, std::uint32_t line) override {
    PathEvent e;
    e.kind = PathEvent::Kind::comment;
    e.text = text;
    e.line = line;
    add(std::move(e));
  }
  void tool_length(double length, int tool, std::uint32_t line) override {
    states.push_back({length, tool, Vec3::Zero(), 0.0, 0, line});
    steps.push_back({Step::Kind::tool, states.size() - 1, motions.size()});
  }
  void work_offset(const Vec3& origin, double rotation, int system, std::uint32_t line) override {
    states.push_back({0.0, 0, origin, rotation, system, line});
    steps.push_back({Step::Kind::offset, states.size() - 1, motions.size()});
  }
  void program_end(std::uint32_t) override {}

 private:
  struct OwnStart {
    std::size_t motion;
    Start start;
  };

  void add(PathEvent e) {
    events.push_back(std::move(e));
    steps.push_back({Step::Kind::event, events.size() - 1, motions.size()});
  }

  std::vector<OwnStart> starts_;  ///< of motions that do not start at the end before
};

}  // namespace smoothpost
