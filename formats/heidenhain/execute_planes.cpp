#include <array>

#include "formats/heidenhain/executor.h"
#include "kernels/core/units.h"

// Tool-centre-point modes and tilted planes.
namespace smoothpost::conversational {
namespace {

constexpr AxisMask kXyz = 0x7;
constexpr AxisMask kRotary = 0x38;

/// Rz(C)·Ry(B)·Rx(A) of spatial angles A B C: about the axes that are not tilted, A first.
Mat3 spatial_rotation(const Vec3& angles) {
  return rotation_about(Vec3::UnitZ(), angles.z()) * rotation_about(Vec3::UnitY(), angles.y()) *
         rotation_about(Vec3::UnitX(), angles.x());
}

}  // namespace

/// FUNCTION TCPM .. and FUNCTION RESET TCPM.
void Executor::tcpm(Scanner& scanner) {
  send_held(nullptr);
  if (scanner.take("MODE")) {
    if (!scanner.take("MILL"))
      error("NC402", "FUNCTION MODE is read for milling only (MODE MILL)", 0);
    return;
  }
  if (scanner.take("RESET")) {
    if (!scanner.take("TCPM"))
      return error("NC402", "FUNCTION RESET is read for TCPM only", scanner.offset());
    if (no_more(scanner)) set_tcp(false);
    return;
  }
  if (!scanner.take("TCPM"))
    return error("NC402", "FUNCTION " + scanner.token() + " is not read", scanner.offset());
  bool spatial = false;
  bool vectors = false;
  while (!scanner.at_end()) {
    const std::size_t offset = scanner.offset();
    if (scanner.take("F TCP") || scanner.take("AXIS POS") || scanner.take("PATHCTRL AXIS") ||
        scanner.take("REFPNT TIP-TIP") || scanner.take("REFPNT TIP-CENTER"))
      continue;
    if (scanner.take("F CONT")) {
      warn_once(contour_feed, "NC418",
                "F CONT: F is read as the speed of the tip, the control takes it for the axes' own",
                offset);
    } else if (scanner.take("AXIS SPAT")) {
      spatial = true;
    } else if (scanner.take("PATHCTRL VECTOR")) {
      vectors = true;
    } else if (scanner.take_byte('F')) {
      if (!value(scanner)) return;
    } else {
      return error("NC402", "FUNCTION TCPM with `" + scanner.token() + "` is not read", offset);
    }
  }
  set_tcp(true);
  by_spatial_angles_ = spatial;
  great_circles_ = vectors;
  spatial_.setZero();
}

/// Outside the mode X Y Z are another point unless the rotary axes stand at 0.
void Executor::set_tcp(bool on) {
  by_spatial_angles_ = great_circles_ = false;
  if (on == tcp_) return;
  tcp_ = on;
  const AxisWords& world = coordinates_.world();
  bool straight = (coordinates_.unknown() & kRotary & settings_.axes) == 0;
  for (std::size_t i = 3; i < 6; ++i) straight = straight && world[i] == 0.0;
  if (!straight) coordinates_.forget(kXyz);
  if (on) return;
  by_vector_ = false;
  axis_.setZero();
}

/// A B C of a block under AXIS SPAT; those that are not written stay.
Vec3 Executor::spatial_axis(const MotionWords& words) {
  for (int i = 0; i < 3; ++i) {
    const auto axis = static_cast<std::size_t>(i) + 3;
    const double angle = radians_from_degrees(words.value[axis]);
    if ((words.absolute >> axis & 1U) != 0) spatial_[i] = angle;
    if ((words.incremental >> axis & 1U) != 0) spatial_[i] += angle;
  }
  return coordinates_.world_direction(spatial_rotation(spatial_) * Vec3::UnitZ());
}

/// PLANE SPATIAL and PLANE RESET.
void Executor::plane(Scanner& scanner) {
  send_held(nullptr);
  if (scanner.take("RESET")) {
    const auto stays = plane_behaviour(scanner);
    if (!stays) return;
    if (!tilted_) return;
    stale_plane_ = *stays;
    return set_plane({});
  }
  if (!scanner.take("SPATIAL"))
    return error("NC402",
                 "PLANE " + scanner.token() +
                     " is not read (PLANE SPATIAL and PLANE RESET are); let the CAM post write "
                     "spatial angles",
                 scanner.offset());
  Vec3 angles = Vec3::Zero();
  constexpr std::array<std::string_view, 3> kNames = {"SPA", "SPB", "SPC"};
  for (int i = 0; i < 3; ++i) {
    if (!scanner.take(kNames[static_cast<std::size_t>(i)]))
      return error("NC417", "PLANE SPATIAL needs SPA, SPB and SPC", scanner.offset());
    const auto angle = value(scanner);
    if (!angle) return;
    angles[i] = radians_from_degrees(*angle);
  }
  const auto stays = plane_behaviour(scanner);
  if (!stays) return;
  if (*stays)
    return error("NC402",
                 "PLANE SPATIAL with STAY is not read: the program itself turns the axes by values "
                 "of the control; write TURN or MOVE",
                 0);
  if (tcp_ || rotation_ != 0.0)
    return error("NC417", "PLANE under M128, FUNCTION TCPM or a rotation (CYCL DEF 10)", 0);
  stale_plane_ = false;
  set_plane(spatial_rotation(angles));
}

/// STAY, TURN or MOVE and what may stand behind: whether the rotary axes stay.
std::optional<bool> Executor::plane_behaviour(Scanner& scanner) {
  std::optional<bool> stays;
  while (!scanner.at_end()) {
    if (scanner.take("STAY")) {
      stays = true;
    } else if (scanner.take("TURN") || scanner.take("MOVE")) {
      stays = false;
    } else if (scanner.take("FMAX") || scanner.take("FAUTO") || scanner.take("MB MAX") ||
               scanner.take("SEQ+") || scanner.take("SEQ-") || scanner.take("SYM+") ||
               scanner.take("SYM-") || scanner.take("TABLE ROT") || scanner.take("COORD ROT")) {
      continue;
    } else if (scanner.take("DIST") || scanner.take("ABST") || scanner.take("SET-UP") ||
               scanner.take("MB") || scanner.take_byte('F')) {
      if (!value(scanner)) return {};
    } else {
      error("NC404", "`" + scanner.token() + "` has no meaning in PLANE", scanner.offset());
      return {};
    }
  }
  if (!stays) error("NC417", "PLANE needs STAY, TURN or MOVE", 0);
  return stays;
}

/// Coordinates are those of the plane from here on; nothing: of the datum alone.
void Executor::set_plane(const std::optional<Mat3>& rotation) {
  tilted_ = rotation.has_value();
  set_frame(rotation ? *rotation : Mat3(Mat3::Identity()));
  coordinates_.forget(kXyz | kRotary);
  by_vector_ = tilted_;
  axis_ = tilted_ ? coordinates_.world_direction(Vec3::UnitZ()) : Vec3(Vec3::Zero());
}

void Executor::set_frame(const Mat3& rotation) {
  coordinates_.set_frame(rotation, shift_);
  offset_told_ = false;
}

}  // namespace smoothpost::conversational
