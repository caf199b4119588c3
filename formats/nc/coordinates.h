#pragma once

#include <array>
#include <optional>

#include "formats/nc/interpreter.h"
#include "kernels/core/canonical_motion.h"

namespace smoothpost::nc {

inline constexpr int kWorkSystems = 9;

/// Where the controlled point is and how programmed words become world coordinates. mm and rad.
///
/// With p the programmed words, s the shift (G92, G52), o and φ the offset and XY rotation of the
/// active work system, and t the tool length offset:   world = Rz(φ)·(p + s) + o,   machine = world
/// + t. G92 and G52 set one and the same shift, as in LinuxCNC. A siemens frame (R, f) stands in
/// front of it: p becomes R·p + f. R is a rotation, but for MIRROR and SCALE, which make it any
/// matrix that has an inverse.
class Coordinates {
 public:
  explicit Coordinates(const InterpreterSettings& settings);

  /// Position of the controlled point: world coordinates without tool length.
  const AxisWords& world() const { return world_; }
  AxisMask unknown() const { return unknown_; }
  const AxisWords& tool() const { return tool_; }
  int system() const { return system_; }
  const WorkOffset& offset(int system) const { return systems_[static_cast<std::size_t>(system)]; }
  const AxisWords& shift() const { return shift_; }

  AxisWords world_from_program(const AxisWords& program) const;
  AxisWords program_from_world(const AxisWords& world) const;
  Vec3 world_from_program(const Vec3& program) const;
  /// A direction, turned by the rotation of the active system.
  Vec3 world_direction(const Vec3& direction) const;
  /// The unit normal of a plane with the unit normal `normal` in the program, on the side from
  /// which a turn keeps its sense: det(R)·R⁻ᵀ·normal, normalised.
  Vec3 world_normal(const Vec3& normal) const;
  /// The frame's R is a rotation: neither MIRROR nor SCALE.
  bool rigid() const { return rigid_; }
  /// The program's zero in world coordinates: Rz(φ)·s + o.
  Vec3 origin() const;
  double rotation() const { return offset(system_).rotation; }
  /// X Y Z words mix: a rotation is active.
  bool rotated() const { return rotated_; }

  /// Axis letters that hang together with `words` through the XY rotation.
  AxisMask unknown_after(AxisMask words) const;

  void move_to(const AxisWords& world, AxisMask unknown) {
    world_ = world;
    unknown_ = unknown;
  }
  void forget(AxisMask words) { unknown_ = static_cast<AxisMask>(unknown_ | words); }

  /// The machine stays where it is; the controlled point becomes another one.
  void set_tool(const AxisWords& tool);
  void select_system(int system);
  void set_offset(int system, const WorkOffset& offset);
  void set_shift(const AxisWords& shift);
  /// A G92, G52 or G92.3 is in force.
  bool shift_active() const { return shift_active_; }
  void set_shift_active(bool active) { shift_active_ = active; }
  /// The program's frame (siemens TRANS, ROT, MIRROR, SCALE): p' = R·p + t before the work offset;
  /// `shift` holds t and the shifts of the other axes. @pre `rotation` has an inverse
  void set_frame(const Mat3& rotation, const AxisWords& shift);
  const Mat3& frame_rotation() const { return frame_rotation_; }
  const AxisWords& frame_shift() const { return frame_shift_; }
  /// G92.2 and G92.3.
  void store_shift() { stored_shift_ = shift_; }
  const AxisWords& stored_shift() const { return stored_shift_; }

 private:
  void refresh();
  Vec3 plane_turned(const Vec3& direction) const;

  AxisWords world_{};
  AxisMask unknown_ = 0x1ff;
  AxisWords tool_{};
  AxisWords shift_{};
  AxisWords stored_shift_{};
  std::array<WorkOffset, kWorkSystems + 1> systems_{};
  Mat3 frame_rotation_ = Mat3::Identity();
  Mat3 frame_inverse_ = Mat3::Identity();
  AxisWords frame_shift_{};
  int system_ = 1;
  bool shift_active_ = false;
  bool framed_ = false;         ///< frame_rotation_ is not the identity
  bool rigid_ = true;           ///< frame_rotation_ is a rotation
  bool plane_rotated_ = false;  ///< the work system has an XY rotation
  bool rotated_ = false;        ///< either of them
  double cosine_ = 1.0;
  double sine_ = 0.0;
};

/// How the frame stretches circles of the plane of G17, G18, G19 and the way along its normal.
struct PlaneScale {
  double within = 1.0;
  double along = 1.0;
};

/// Nothing: circles of the plane are no circles in the world, or its normal is bent. Relative
/// tolerance 1e-9.
std::optional<PlaneScale> plane_scale(const Coordinates& coordinates, int plane_code);

}  // namespace smoothpost::nc
