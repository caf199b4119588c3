#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kernels/core/pose.h"

// What an NC program asks a machine to do, after all modal state, units and offsets are resolved
// and before any kinematics. Readers of every dialect produce these calls;
// `postproc/pipeline/interpret` turns them into a ToolPath with the input machine's kinematics.
namespace smoothpost {

/// The axis words of RS274NGC in their fixed order: X Y Z A B C U V W. X Y Z U V W in mm, A B C in
/// rad.
inline constexpr int kAxisWords = 9;
inline constexpr std::string_view kAxisLetters = "XYZABCUVW";
using AxisWords = std::array<double, kAxisWords>;

/// A set of axis words: bit i stands for kAxisLetters[i].
using AxisMask = std::uint16_t;

enum class MotionKind : std::uint8_t { rapid, feed };

/// A circular arc or helix: from the motion's start, `sweep` rad (signed, right-hand about
/// `normal`) about `centre`, while the position along `normal` goes linearly to the end's.
struct ArcGeometry {
  Vec3 centre = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();
  double sweep = 0.0;
};

/// One motion of the controlled point. `start` and `end` are in the input controller's world
/// coordinates: work offset (G54.., G52, G92, XY rotation) added, tool length NOT added. All axis
/// words move linearly in the motion's parameter s ∈ [0, 1], except X Y Z of an arc.
struct CanonicalMotion {
  MotionKind kind = MotionKind::feed;
  bool is_arc = false;
  bool tcp = false;               ///< tool-centre-point mode: XYZ is the tip in the workpiece
  bool axis_vector = false;       ///< tcp with the tool axis given as a vector
  bool probe = false;             ///< to its end only if the probe says nothing on the way (G38.2)
  bool machine_position = false;  ///< G53, G28, G30: a place of the input machine, not of the part
  AxisMask unknown_start = 0;     ///< words that the program has not yet given a value
  AxisMask unknown_end = 0;
  AxisMask programmed = 0;  ///< words written in this block
  std::uint32_t line = 0;   ///< 1-based line of the input
  std::uint32_t column = 0;
  double duration = 0.0;  ///< s at the programmed feed; 0 for a rapid
  /// Way in mm for each turn of the spindle that the motion follows (G33, G76); below 0: while the
  /// spindle turns back, out of a rigid tap; 0: it follows time.
  double pitch = 0.0;
  AxisWords start{};
  AxisWords end{};
  /// Unit, tip to spindle, in W. Zero: unknown; when the rotary words are known, the one that the
  /// machine has at them (a great circle between positions of rotary axes).
  Vec3 start_axis = Vec3::UnitZ();
  Vec3 end_axis = Vec3::UnitZ();
  ArcGeometry arc;
};

/// A process event by its name in the machine file's table, with the values found in the words.
struct ProcessEvent {
  std::string name;  ///< beam_on, spindle_on, tool_change ...
  std::vector<std::pair<std::string, std::string>> parameters;  ///< {"rpm", "630"}
  std::uint32_t line = 0;
  std::uint32_t column = 0;
};

/// Receives the calls in program order.
class CanonicalSink {
 public:
  virtual ~CanonicalSink() = default;
  virtual void motion(const CanonicalMotion& motion) = 0;
  virtual void dwell(double seconds, std::uint32_t line) = 0;
  virtual void event(const ProcessEvent& event) = 0;
  /// A comment, or words kept as a comment on the user's word.
  virtual void comment(std::string_view text, std::uint32_t line) = 0;
  /// The active tool length compensation becomes `length` mm along the tool axis; `tool` 0: none.
  virtual void tool_length(double length, int tool, std::uint32_t line) = 0;
  /// The program's zero becomes `origin` (mm, world coordinates), turned by `rotation` rad about Z.
  /// `system` 1..9 stands for G54..G59.3.
  virtual void work_offset(const Vec3& origin, double rotation, int system, std::uint32_t line) = 0;
  virtual void program_end(std::uint32_t line) = 0;
};

}  // namespace smoothpost
