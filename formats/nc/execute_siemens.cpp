#include <algorithm>
#include <array>
#include <cmath>

#include "formats/nc/executor.h"
#include "formats/nc/plane.h"
#include "kernels/core/units.h"

// Sinumerik: arcs through a point, by an angle and by a tangent, polynomials, rotary positions by a
// sense.
namespace smoothpost::nc {
namespace {

constexpr double kFlat = 1e-9;  // mm: the height of a triangle whose corners are on one line
constexpr double kTurn = 2.0 * kPi;

AxisMask bit(std::size_t axis) { return static_cast<AxisMask>(1u << axis); }

Vec3 xyz(const AxisWords& words) { return {words[0], words[1], words[2]}; }

/// Circles stay circles: the frame is a rotation, a mirror image or an equal scale.
bool is_similar(const Mat3& frame) {
  const Mat3 square = frame.transpose() * frame;
  const double scale = square.trace() / 3.0;
  constexpr double kSame = 1e-9;
  return (square - scale * Mat3::Identity()).norm() <= kSame * scale;
}

}  // namespace

/// DC, ACP and ACN: a position of a rotary axis by the shorter way, upwards or downwards.
void Executor::turn_by_sense(const BlockWords& block, AxisWords& end) const {
  if (block.senses == 0) return;
  const AxisWords& here = coordinates_.world();
  for (std::size_t i = 3; i < 6; ++i) {
    const auto sense = static_cast<WordForm>(block.senses >> (8 * (i - 3)) & 0xffU);
    if (sense == WordForm::number || (coordinates_.unknown() & bit(i)) != 0) continue;
    double turn = std::remainder(end[i] - here[i], kTurn);
    if (sense == WordForm::upwards && turn < 0.0) turn += kTurn;
    if (sense == WordForm::downwards && turn > 0.0) turn -= kTurn;
    end[i] = here[i] + turn;
  }
}

void Executor::named_motion(const BlockWords& block, const BlockPlan& plan) {
  if (plan.axes == 0 && plan.vector == 0) return;
  if (plan.motion == kPointArc) return point_arc(block, plan);
  if (plan.motion == kTangentArc) return tangent_arc(block, plan);
  polynomial(block, plan);
}

/// CIP: the arc to X Y Z through I1 J1 K1, in any plane.
void Executor::point_arc(const BlockWords& block, const BlockPlan& plan) {
  begin_motion(block, plan);
  motion_.kind = MotionKind::feed;
  motion_.is_arc = true;
  motion_.end = target(block, plan.axes);
  motion_.unknown_end = unknown_at_target(block, plan.axes);
  if (modal_.tcp) turn_axis(block, plan);
  const AxisWords start = coordinates_.program_from_world(motion_.start);
  constexpr char kThrough[] = {kThroughX, kThroughY, kThroughZ};
  Vec3 through = xyz(start);
  for (int i = 0; i < 3; ++i) {
    if (!block.has(kThrough[i])) continue;
    const LetterMask letter = letter_bit(kThrough[i]);
    const bool absolute = (block.absolute & letter) != 0 ||
                          (!modal_.incremental && (block.incremental & letter) == 0);
    const double value = block[kThrough[i]] * modal_.unit;
    through[i] = absolute ? value : through[i] + value;
  }
  const Vec3 p0 = xyz(motion_.start);
  const Vec3 p1 = coordinates_.world_from_program(through);
  const Vec3 p2 = xyz(motion_.end);
  const Vec3 a = p1 - p0;
  const Vec3 b = p2 - p0;
  const Vec3 cross = a.cross(b);
  const double longest = std::max(a.norm(), b.norm());
  if (!is_similar(coordinates_.frame_rotation())) {
    log_.error("NC245",
               "CIP under an unequal SCALE is no arc any more; let the CAM post write without it",
               at(block, GGroup::motion));
    coordinates_.move_to(motion_.end, motion_.unknown_end);
    return;
  }
  if (!(cross.norm() > kFlat * std::max(1.0, longest))) {
    log_.error("NC221",
               "CIP: start, the point I1 J1 K1 and the end lie on one line; write G1, or the point "
               "off the line",
               at(block, GGroup::motion));
    coordinates_.move_to(motion_.end, motion_.unknown_end);
    return;
  }
  // The centre of the circle through three points, from p0.
  const Vec3 centre = (cross.cross(a) * b.squaredNorm() + b.cross(cross) * a.squaredNorm()) /
                      (2.0 * cross.squaredNorm());
  const Vec3 normal = cross.normalized();
  const Vec3 from = -centre;
  const Vec3 to = b - centre;
  double sweep = std::atan2(normal.dot(from.cross(to)), from.dot(to));
  if (sweep <= 0.0) sweep += kTurn;
  motion_.arc.centre = p0 + centre;
  motion_.arc.normal = normal;
  motion_.arc.sweep = sweep;
  motion_.duration = duration_of(motion_, centre.norm() * sweep, block);
  finish_motion();
}

/// AR: the arc by its angle and its centre, whose end is found here, or by its angle and its end.
PlaneArc Executor::arc_by_angle(const BlockWords& block, ArcWords& words) {
  const double angle = radians_from_degrees(block[kArcAngle]);
  const PlaneAxes plane = plane_axes(modal_.plane);
  if (!block.has(plane.first_centre) && !block.has(plane.second_centre)) {
    const double chord =
        std::hypot(words.end.first - words.start.first, words.end.second - words.start.second);
    const double radius = 0.5 * chord / std::sin(0.5 * angle);
    return arc_by_radius(words, angle > kPi ? -radius : radius);
  }
  const PlanePoint centre = arc_centre(block, words);
  const double turn = words.clockwise ? -angle : angle;
  const double x = words.start.first - centre.first;
  const double y = words.start.second - centre.second;
  PlaneArc arc;
  arc.centre = centre;
  arc.radius = std::hypot(x, y);
  arc.sweep = turn;
  if (arc.radius < words.radius_tolerance) {
    arc.problem = "the radius is zero: the centre is the start";
    return arc;
  }
  AxisWords end = coordinates_.program_from_world(motion_.end);
  end[plane.first] = centre.first + std::cos(turn) * x - std::sin(turn) * y;
  end[plane.second] = centre.second + std::sin(turn) * x + std::cos(turn) * y;
  motion_.end = coordinates_.world_from_program(end);
  return arc;
}

/// The direction at the end of the last motion, in program coordinates; nothing: that motion was no
/// feed in one piece, or the coordinates are others since.
std::optional<Vec3> Executor::tangent_at_end() const {
  const bool here = motion_.line != 0 && xyz(motion_.end) == xyz(coordinates_.world());
  if (!here || motion_.kind != MotionKind::feed || motion_.machine_position) return std::nullopt;
  Vec3 along = xyz(motion_.end) - xyz(motion_.start);
  if (motion_.is_arc) {
    const Vec3& normal = motion_.arc.normal;
    const Vec3 from_centre = xyz(motion_.end) - motion_.arc.centre;
    const double climb = normal.dot(along);
    along = motion_.arc.sweep * normal.cross(from_centre) + climb * normal;
  }
  const Vec3 ahead = xyz(motion_.end) + along;
  AxisWords words = motion_.end;
  for (std::size_t i = 0; i < 3; ++i) words[i] = ahead[static_cast<Eigen::Index>(i)];
  return xyz(coordinates_.program_from_world(words)) -
         xyz(coordinates_.program_from_world(motion_.end));
}

/// CT: the arc of the active plane that goes on in the direction of the motion before; straight
/// when the end lies ahead.
void Executor::tangent_arc(const BlockWords& block, const BlockPlan& plan) {
  const PlaneAxes plane = plane_axes(modal_.plane);
  const std::optional<Vec3> tangent = tangent_at_end();
  begin_motion(block, plan);
  motion_.kind = MotionKind::feed;
  motion_.end = target(block, plan.axes);
  motion_.unknown_end = unknown_at_target(block, plan.axes);
  if (modal_.tcp) turn_axis(block, plan);
  const auto refuse = [&](const char* code, const char* why) {
    log_.error(code, why, at(block, GGroup::motion));
    coordinates_.move_to(motion_.end, motion_.unknown_end);
  };
  if (!tangent) {
    return refuse("NC220",
                  "CT: the motion before is no feed by G1, G2, G3, CIP or CT that ends "
                  "here, so its direction is not known; write G2 or G3");
  }
  const AxisWords start = coordinates_.program_from_world(motion_.start);
  const AxisWords end = coordinates_.program_from_world(motion_.end);
  const double tx = (*tangent)[static_cast<Eigen::Index>(plane.first)];
  const double ty = (*tangent)[static_cast<Eigen::Index>(plane.second)];
  const double cx = end[plane.first] - start[plane.first];
  const double cy = end[plane.second] - start[plane.second];
  const double chord = std::hypot(cx, cy);
  const double speed = std::hypot(tx, ty);
  if (!(speed > kFlat) || !(chord > kFlat)) {
    return refuse("NC221",
                  "CT: the motion before has no direction in the active plane, or the end "
                  "is the start; write G1, G2 or G3");
  }
  // The angle from the tangent to the chord is half of the sweep.
  const double half = std::atan2(tx * cy - ty * cx, tx * cx + ty * cy);
  constexpr double kAhead = 1e-9;  // rad
  if (std::abs(half) > kPi - 1e-6) {
    return refuse("NC221", "CT: the end lies straight behind; write G1, G2 or G3");
  }
  if (std::abs(half) < kAhead) {
    const double length = (xyz(motion_.end) - xyz(motion_.start)).norm();
    motion_.duration = duration_of(motion_, length, block);
    return finish_motion();
  }
  PlaneArc arc;
  const double radius = 0.5 * chord / std::sin(half);  // below 0: clockwise
  arc.centre = {start[plane.first] - radius * ty / speed,
                start[plane.second] + radius * tx / speed};
  arc.radius = std::abs(radius);
  arc.sweep = 2.0 * half;
  motion_.is_arc = true;
  finish_arc(block, arc);
}

/// POLY: from the present place, x(p) = a0 + a1 p + a2 p² + .. for p from 0 to PL, with the end and
/// a2, a3 .. programmed; words without PO go linearly. With u = p / PL the coefficients are
/// c_k = a_k·PL^k, and the Bézier ordinates of degree 5 b_i = sum over k <= i of
/// C(i,k) / C(5,k)·c_k.
void Executor::polynomial(const BlockWords& block, const BlockPlan& plan) {
  constexpr std::size_t kDegree = 5;
  constexpr double kBinomials[6][6] = {{1, 0, 0, 0, 0, 0}, {1, 1, 0, 0, 0, 0},
                                       {1, 2, 1, 0, 0, 0}, {1, 3, 3, 1, 0, 0},
                                       {1, 4, 6, 4, 1, 0}, {1, 5, 10, 10, 5, 1}};
  constexpr AxisMask kLinear = 7;
  const double length = block.has(kParameterLength) ? block[kParameterLength] : 1.0;
  const auto refuse = [&](std::string why) {
    stop("NC262", "POLY: " + std::move(why), at(block, GGroup::motion));
  };
  if ((plan.axes & ~kLinear) != 0 || plan.vector != 0 || modal_.tcp) {
    return refuse("is read for X, Y and Z outside TRAORI; let the CAM post write straight moves");
  }
  if (!(length >= 0.0001) || length > 1e5)
    return refuse("PL, the length of the parameter, is above 0");
  if ((coordinates_.unknown() & kLinear) != 0) {
    return refuse(
        "its start is not known: the program has not given X, Y and Z; move there before");
  }
  const AxisWords start = coordinates_.program_from_world(coordinates_.world());
  const AxisWords end = coordinates_.program_from_world(target(block, plan.axes));
  std::array<Vec3, kDegree + 1> points;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::array<double, kDegree + 1> c{};
    c[0] = start[axis];
    c[1] = end[axis] - start[axis];
    double power = length;
    for (std::size_t k = 2; k <= kDegree; ++k) {
      power *= length;
      if (k - 2 < polynomials_[axis].size()) c[k] = polynomials_[axis][k - 2] * power;
      c[1] -= c[k];
    }
    for (std::size_t i = 0; i <= kDegree; ++i) {
      double sum = 0.0;
      for (std::size_t k = 0; k <= i; ++k) sum += kBinomials[i][k] / kBinomials[kDegree][k] * c[k];
      points[i][static_cast<Eigen::Index>(axis)] = sum;
    }
  }
  ControlNet net;
  for (const Vec3& point : points) net.push_back({coordinates_.world_from_program(point), 1.0});
  net.front().point = xyz(coordinates_.world());
  for (std::vector<double>& coefficients : polynomials_) coefficients.clear();
  follow_curves(block, plan, {net});
  motion_.kind = MotionKind::rapid;  // its last piece has not the direction of the curve
}

}  // namespace smoothpost::nc
