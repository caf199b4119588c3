#include <algorithm>
#include <cmath>

#include "formats/nc/executor.h"
#include "formats/nc/plane.h"
#include "kernels/core/units.h"

// Sinumerik: polar positions, tool axes by angles and ends of polynomials, which are written as the
// words X Y Z, I J K, A3 B3 C3 that they stand for before a block is planned.
namespace smoothpost::nc {
namespace {

constexpr LetterMask kPolar = letter_bit(kPolarAngle) | letter_bit(kPolarRadius);
constexpr LetterMask kAngles =
    letter_bit(kAxisAngleA) | letter_bit(kAxisAngleB) | letter_bit(kAxisAngleC);

bool is_pole(GCode code) { return code == 1100 || code == 1110 || code == 1120; }

void put(BlockWords& block, char letter, double value, std::uint32_t piece) {
  const auto index = static_cast<std::size_t>(letter_index(letter));
  block.letters |= letter_bit(letter);
  block.absolute |= letter_bit(letter);
  block.incremental &= ~letter_bit(letter);
  block.value[index] = value;
  block.piece[index] = piece;
}

void drop(BlockWords& block, LetterMask letters) {
  block.letters &= ~letters;
  block.absolute &= ~letters;
  block.incremental &= ~letters;
}

}  // namespace

/// The block with its words written out; nothing: it has none of that kind.
std::optional<BlockWords> Executor::rewritten(const BlockWords& block) {
  const bool polar = (block.letters & kPolar) != 0 && !is_pole(block.code(GGroup::non_modal));
  const bool angles = (block.letters & kAngles) != 0;
  const bool polynomials = block.says(SiemensWord::polynomial);
  for (std::vector<double>& coefficients : polynomials_) coefficients.clear();
  if ((!polar && !angles && !polynomials) || block.bad) return std::nullopt;
  std::optional<BlockWords> out = block;
  const auto told = [&](const char* code, const std::string& problem) {
    if (problem.empty()) return;
    log_.error(code, problem, reader_.place(block, block.first_piece));
    out->bad = true;
  };
  if (polar) told("NC245", write_polar(*out));
  if (angles) told("NC243", write_vector(*out));
  if (polynomials) told("NC262", write_polynomial(*out));
  return out;
}

/// AP= and RP= as X Y (G17), and as the centre of G2 and G3, which is the pole.
std::string Executor::write_polar(BlockWords& block) {
  const GCode plane_code =
      block.code(GGroup::plane) != kNoCode ? block.code(GGroup::plane) : modal_.plane;
  const PlaneAxes plane = plane_axes(plane_code);
  PolarState& polar = modal_.polar;
  const GCode distance = block.code(GGroup::distance);
  const bool incremental = distance == kNoCode ? modal_.incremental : distance == 910;
  if (polar.lost || (polar.set && plane_code != modal_.plane)) {
    return "AP RP: the frame or plane changed since the pole was set; write G110, G111 or G112";
  }
  if (!block.has(kPolarAngle)) return "RP without AP, the polar angle; write both";
  const LetterMask angle_bit = letter_bit(kPolarAngle);
  const bool further = (block.incremental & angle_bit) != 0;
  if ((incremental && !further && (block.absolute & angle_bit) == 0) ||
      (block.incremental & letter_bit(kPolarRadius)) != 0) {
    return "AP and RP under G91, or RP=IC(..), are not read; write G90, or AP=IC(..)";
  }
  if (further && !polar.angle) return "AP=IC(..) has no angle before it to count from";
  if (!block.has(kPolarRadius) && !polar.radius)
    return "AP without RP, the polar radius, before it";
  const char first = kAxisLetters[plane.first];
  const char second = kAxisLetters[plane.second];
  if (block.has(first) || block.has(second)) {
    return "AP and RP beside words of the same plane; write one of them";
  }
  if (block.has(kPolarRadius)) polar.radius = block[kPolarRadius] * modal_.unit;
  if (!(*polar.radius >= 0.0)) return "RP, the polar radius, is below 0";
  polar.angle = block[kPolarAngle] + (further ? *polar.angle : 0.0);
  const double angle = radians_from_degrees(*polar.angle);
  const std::uint32_t piece = block.piece[static_cast<std::size_t>(letter_index(kPolarAngle))];
  drop(block, kPolar);
  put(block, first, (polar.first + *polar.radius * std::cos(angle)) / modal_.unit, piece);
  put(block, second, (polar.second + *polar.radius * std::sin(angle)) / modal_.unit, piece);
  const GCode written = block.code(GGroup::motion);
  const GCode motion = written == kNoCode ? modal_.motion : written;
  if (motion != 20 && motion != 30) return {};
  constexpr LetterMask kCentre = letter_bit('I') | letter_bit('J') | letter_bit('K') |
                                 letter_bit(kCircleRadius) | letter_bit(kArcAngle);
  if ((block.letters & kCentre) != 0)
    return "an arc by AP and RP is about the pole; no I J K CR AR";
  put(block, plane.first_centre, polar.first / modal_.unit, piece);
  put(block, plane.second_centre, polar.second / modal_.unit, piece);
  return {};
}

/// G110: from the present place; G111: from the zero; G112: from the last pole. By words of the
/// plane or by AP and RP.
void Executor::set_pole(const BlockWords& block, const BlockPlan& plan) {
  const PlaneAxes plane = plane_axes(modal_.plane);
  const GCode code = block.code(GGroup::non_modal);
  PolarState& polar = modal_.polar;
  const auto plane_bits = static_cast<AxisMask>((1u << plane.first) | (1u << plane.second));
  const auto refuse = [&](const char* why) {
    log_.error("NC245", g_code_text(code) + ": " + why, at(block, GGroup::non_modal));
  };
  if ((plan.axes & ~plane_bits) != 0) return refuse("a pole lies in the active plane");
  const bool by_angle = block.has(kPolarAngle) && block.has(kPolarRadius);
  if (block.has(kPolarAngle) != block.has(kPolarRadius) || (by_angle && plan.axes != 0)) {
    return refuse("a pole has words of the plane, or AP and RP");
  }
  if (((block.absolute | block.incremental) & (kPolar | kAxisLetterMask)) != 0) {
    return refuse("AC and IC are not read here");
  }
  if (code == 1100 && (coordinates_.unknown() & plane_bits) != 0) {
    return refuse("the present place is not known; move there before");
  }
  if (code == 1120 && polar.lost) return refuse("the frame or plane changed since the last pole");
  const AxisWords here = coordinates_.program_from_world(coordinates_.world());
  double first = code == 1100 ? here[plane.first] : code == 1120 ? polar.first : 0.0;
  double second = code == 1100 ? here[plane.second] : code == 1120 ? polar.second : 0.0;
  if (by_angle) {
    const double angle = radians_from_degrees(block[kPolarAngle]);
    first += block[kPolarRadius] * modal_.unit * std::cos(angle);
    second += block[kPolarRadius] * modal_.unit * std::sin(angle);
  } else {
    if ((plan.axes & (1u << plane.first)) != 0) first += word_value(block, plane.first);
    if ((plan.axes & (1u << plane.second)) != 0) second += word_value(block, plane.second);
  }
  polar = {first, second, true, false, std::nullopt, std::nullopt};
}

/// A2= B2= C2= as A3= B3= C3=. Euler: about Z by A2, the new X by B2, the new Z by C2; roll, pitch
/// and yaw: about Z by C2, the new Y by B2, the new X by A2; what becomes of the Z direction.
std::string Executor::write_vector(BlockWords& block) {
  AxisAngles kind = modal_.axis_angles;
  if (block.says(SiemensWord::orieuler)) kind = AxisAngles::euler;
  if (block.says(SiemensWord::orirpy)) kind = AxisAngles::roll_pitch_yaw;
  if (block.says(SiemensWord::oriother)) kind = AxisAngles::none;
  if (kind == AxisAngles::none) {
    return "A2= B2= C2=: which angles they are is data of the machine; write ORIEULER or ORIRPY "
           "before, or let the CAM post write A3= B3= C3=";
  }
  if ((block.letters & kVectorMask) != 0)
    return "A2= B2= C2= beside A3= B3= C3=; write one of them";
  const bool euler = kind == AxisAngles::euler;
  const LetterMask needed = euler ? kAngles & ~letter_bit(kAxisAngleC) : kAngles;
  if ((block.letters & needed) != needed) {
    return euler ? "ORIEULER needs A2= and B2=" : "ORIRPY needs A2=, B2= and C2=";
  }
  if ((block.incremental & kAngles) != 0) return "A2= B2= C2= by IC(..) are not read";
  const auto turn = [&](char letter, const Vec3& axis) {
    const double degrees = block.has(letter) ? block[letter] : 0.0;
    return Eigen::AngleAxisd(radians_from_degrees(degrees), axis).toRotationMatrix();
  };
  const Mat3 rotation =
      euler ? Mat3(turn(kAxisAngleA, Vec3::UnitZ()) * turn(kAxisAngleB, Vec3::UnitX()))
            : Mat3(turn(kAxisAngleC, Vec3::UnitZ()) * turn(kAxisAngleB, Vec3::UnitY()) *
                   turn(kAxisAngleA, Vec3::UnitX()));
  const Vec3 axis = rotation.col(2);
  const std::uint32_t piece = block.piece[static_cast<std::size_t>(letter_index(kAxisAngleA))];
  drop(block, kAngles);
  put(block, kAxisVectorX, axis.x(), piece);
  put(block, kAxisVectorY, axis.y(), piece);
  put(block, kAxisVectorZ, axis.z(), piece);
  return {};
}

/// PO[X]=(end,a2,a3,a4,a5): the end as the word X, the coefficients for polynomial().
std::string Executor::write_polynomial(BlockWords& block) {
  const GCode written = block.code(GGroup::motion);
  if ((written == kNoCode ? modal_.motion : written) != kPolynomial) {
    return "PO[..]=(..) outside of POLY; write POLY before";
  }
  const GCode distance = block.code(GGroup::distance);
  if (distance == kNoCode ? modal_.incremental : distance == 910) {
    return "PO[..]=(..) under G91 is not read; write G90";
  }
  for (const std::uint32_t piece : statements_of(block, SiemensWord::polynomial)) {
    const std::string_view text = reader_.raw(piece);
    const std::size_t open = text.find('[');
    const std::string name = upper_text(text.substr(open + 1, text.find(']') - open - 1));
    const std::size_t axis = name == "X" ? 0 : name == "Y" ? 1 : name == "Z" ? 2 : 3;
    if (axis == 3) return "PO[" + name + "]: polynomials are read for X, Y and Z";
    if (block.has(kAxisLetters[axis])) return "the end of " + name + " is given twice";
    std::string_view rest = text.substr(text.find('(') + 1);
    std::vector<double> values;
    while (values.size() < 6) {
      const Evaluated found = values_->value(rest);
      if (!found.ok()) return "PO[" + name + "]: " + found.problem;
      values.push_back(found.value);
      rest.remove_prefix(found.length);
      const std::size_t next = rest.find_first_not_of(" \t");
      if (next == std::string_view::npos || rest[next] != ',') break;
      rest.remove_prefix(next + 1);
    }
    if (values.size() > 5 || rest.find_first_not_of(" \t)") != std::string_view::npos) {
      return "PO[" + name + "] has the end and up to a2, a3, a4 and a5";
    }
    put(block, kAxisLetters[axis], values.front(), piece);
    for (std::size_t k = 1; k < values.size(); ++k)
      polynomials_[axis].push_back(values[k] * modal_.unit);
  }
  return {};
}

}  // namespace smoothpost::nc
