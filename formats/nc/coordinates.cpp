#include "formats/nc/coordinates.h"

#include <cmath>

namespace smoothpost::nc {

Coordinates::Coordinates(const InterpreterSettings& settings) : world_(settings.home) {
  for (const auto& [system, offset] : settings.work_offsets) {
    if (system >= 1 && system <= kWorkSystems) systems_[static_cast<std::size_t>(system)] = offset;
  }
  refresh();
}

void Coordinates::refresh() {
  const double angle = rotation();
  rotated_ = angle != 0.0;
  cosine_ = rotated_ ? std::cos(angle) : 1.0;
  sine_ = rotated_ ? std::sin(angle) : 0.0;
}

AxisWords Coordinates::world_from_program(const AxisWords& program) const {
  const AxisWords& origin = offset(system_).words;
  AxisWords world;
  for (std::size_t i = 0; i < world.size(); ++i) world[i] = program[i] + shift_[i];
  if (rotated_) {
    const double x = world[0];
    world[0] = cosine_ * x - sine_ * world[1];
    world[1] = sine_ * x + cosine_ * world[1];
  }
  for (std::size_t i = 0; i < world.size(); ++i) world[i] += origin[i];
  return world;
}

AxisWords Coordinates::program_from_world(const AxisWords& world) const {
  const AxisWords& origin = offset(system_).words;
  AxisWords program;
  for (std::size_t i = 0; i < program.size(); ++i) program[i] = world[i] - origin[i];
  if (rotated_) {
    const double x = program[0];
    program[0] = cosine_ * x + sine_ * program[1];
    program[1] = -sine_ * x + cosine_ * program[1];
  }
  for (std::size_t i = 0; i < program.size(); ++i) program[i] -= shift_[i];
  return program;
}

Vec3 Coordinates::world_from_program(const Vec3& program) const {
  const WorkOffset& active = offset(system_);
  const Vec3 shifted = program + Vec3(shift_[0], shift_[1], shift_[2]);
  return world_direction(shifted) + Vec3(active.words[0], active.words[1], active.words[2]);
}

Vec3 Coordinates::world_direction(const Vec3& direction) const {
  return {cosine_ * direction.x() - sine_ * direction.y(),
          sine_ * direction.x() + cosine_ * direction.y(), direction.z()};
}

Vec3 Coordinates::origin() const { return world_from_program(Vec3(Vec3::Zero())); }

AxisMask Coordinates::unknown_after(AxisMask words) const {
  constexpr AxisMask kXY = 3;
  auto left = static_cast<AxisMask>(unknown_ & ~words);
  if (rotated_ && (left & kXY) != 0) left = static_cast<AxisMask>(left | kXY);
  return left;
}

void Coordinates::set_tool(const AxisWords& tool) {
  for (std::size_t i = 0; i < tool.size(); ++i) world_[i] += tool_[i] - tool[i];
  tool_ = tool;
}

void Coordinates::select_system(int system) {
  system_ = system;
  refresh();
}

void Coordinates::set_offset(int system, const WorkOffset& offset) {
  systems_[static_cast<std::size_t>(system)] = offset;
  refresh();
}

void Coordinates::set_shift(const AxisWords& shift) { shift_ = shift; }

}  // namespace smoothpost::nc
