#include "formats/nc/coordinates.h"

#include <cmath>

#include "formats/nc/plane.h"

namespace smoothpost::nc {
namespace {

Vec3 first_three(const AxisWords& words) { return {words[0], words[1], words[2]}; }

void turn(const Mat3& rotation, AxisWords& words) {
  const Vec3 turned = rotation * first_three(words);
  for (std::size_t i = 0; i < 3; ++i) words[i] = turned[static_cast<Eigen::Index>(i)];
}

}  // namespace

Coordinates::Coordinates(const InterpreterSettings& settings) : world_(settings.home) {
  for (const auto& [system, offset] : settings.work_offsets) {
    if (system >= 1 && system <= kWorkSystems) systems_[static_cast<std::size_t>(system)] = offset;
  }
  refresh();
}

void Coordinates::refresh() {
  const double angle = rotation();
  plane_rotated_ = angle != 0.0;
  rotated_ = plane_rotated_ || framed_;
  cosine_ = plane_rotated_ ? std::cos(angle) : 1.0;
  sine_ = plane_rotated_ ? std::sin(angle) : 0.0;
}

AxisWords Coordinates::world_from_program(const AxisWords& program) const {
  const AxisWords& origin = offset(system_).words;
  AxisWords world = program;
  if (framed_) turn(frame_rotation_, world);
  for (std::size_t i = 0; i < world.size(); ++i) world[i] += frame_shift_[i] + shift_[i];
  if (plane_rotated_) {
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
  if (plane_rotated_) {
    const double x = program[0];
    program[0] = cosine_ * x + sine_ * program[1];
    program[1] = -sine_ * x + cosine_ * program[1];
  }
  for (std::size_t i = 0; i < program.size(); ++i) program[i] -= frame_shift_[i] + shift_[i];
  if (framed_) turn(frame_inverse_, program);
  return program;
}

Vec3 Coordinates::world_from_program(const Vec3& program) const {
  const WorkOffset& active = offset(system_);
  const Vec3 framed = framed_ ? Vec3(frame_rotation_ * program) : program;
  const Vec3 shifted = framed + first_three(shift_) + first_three(frame_shift_);
  return plane_turned(shifted) + first_three(active.words);
}

Vec3 Coordinates::world_direction(const Vec3& direction) const {
  return plane_turned(framed_ ? Vec3(frame_rotation_ * direction) : direction);
}

Vec3 Coordinates::world_normal(const Vec3& normal) const {
  if (rigid_) return world_direction(normal);
  const Vec3 turned = frame_rotation_.determinant() * (frame_inverse_.transpose() * normal);
  return plane_turned(turned.normalized());
}

Vec3 Coordinates::plane_turned(const Vec3& direction) const {
  return {cosine_ * direction.x() - sine_ * direction.y(),
          sine_ * direction.x() + cosine_ * direction.y(), direction.z()};
}

Vec3 Coordinates::origin() const { return world_from_program(Vec3(Vec3::Zero())); }

AxisMask Coordinates::unknown_after(AxisMask words) const {
  const AxisMask mixed = framed_ ? 7 : plane_rotated_ ? 3 : 0;
  auto left = static_cast<AxisMask>(unknown_ & ~words);
  if ((left & mixed) != 0) left = static_cast<AxisMask>(left | mixed);
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

void Coordinates::set_frame(const Mat3& rotation, const AxisWords& shift) {
  frame_rotation_ = rotation;
  frame_shift_ = shift;
  framed_ = !rotation.isIdentity(0.0);
  constexpr double kUnitary = 1e-9;
  const bool unitary = rotation.isUnitary(kUnitary);
  rigid_ = unitary && rotation.determinant() > 0.0;
  frame_inverse_ = unitary ? Mat3(rotation.transpose()) : Mat3(rotation.inverse());
  refresh();
}

void Coordinates::set_shift(const AxisWords& shift) { shift_ = shift; }

std::optional<PlaneScale> plane_scale(const Coordinates& coordinates, int plane_code) {
  if (coordinates.rigid()) return PlaneScale{};
  const PlaneAxes plane = plane_axes(static_cast<GCode>(plane_code));
  const Mat3& frame = coordinates.frame_rotation();
  const Vec3 a = frame.col(static_cast<Eigen::Index>(plane.first));
  const Vec3 b = frame.col(static_cast<Eigen::Index>(plane.second));
  const Vec3 c = frame.col(static_cast<Eigen::Index>(plane.third));
  constexpr double kSame = 1e-9;
  const auto crosses = [&](const Vec3& u, const Vec3& v) {
    return std::abs(u.dot(v)) <= kSame * u.norm() * v.norm();
  };
  if (std::abs(a.norm() - b.norm()) > kSame * a.norm()) return std::nullopt;
  if (!crosses(a, b) || !crosses(a, c) || !crosses(b, c)) return std::nullopt;
  return PlaneScale{a.norm(), c.norm()};
}

}  // namespace smoothpost::nc
