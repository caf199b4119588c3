#include <algorithm>
#include <array>
#include <cmath>

#include "formats/nc/executor.h"
#include "formats/nc/number.h"
#include "formats/nc/number_text.h"
#include "kernels/core/units.h"

// Sinumerik: frames, shifts of single axes, settable offsets that the program writes.
namespace smoothpost::nc {
namespace {

AxisMask bit(std::size_t axis) { return static_cast<AxisMask>(1u << axis); }

Mat3 turn_about(const Vec3& axis, double degrees) {
  return Eigen::AngleAxisd(radians_from_degrees(degrees), axis).toRotationMatrix();
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && detail::is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && detail::is_blank(text.back())) text.remove_suffix(1);
  return text;
}

/// The parts of `text` between commas outside of parentheses and brackets, without blanks.
std::vector<std::string_view> parts_of(std::string_view text) {
  std::vector<std::string_view> out;
  int depth = 0;
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= text.size(); ++i) {
    const char c = i < text.size() ? text[i] : ',';
    if (c == '(' || c == '[') ++depth;
    if (c == ')' || c == ']') --depth;
    if (i < text.size() && (c != ',' || depth > 0)) continue;
    out.push_back(trimmed(text.substr(begin, i - begin)));
    begin = i + 1;
  }
  return out;
}

/// The place of an axis among the words; nothing: no axis.
std::optional<std::size_t> axis_of(std::string_view name) {
  if (name.size() != 1) return std::nullopt;
  const std::string upper = upper_text(name);
  for (std::size_t i = 0; i < kAxisLetters.size(); ++i)
    if (kAxisLetters[i] == upper[0]) return i;
  return std::nullopt;
}

struct OffsetNumber {
  double value = 0.0;
  std::string problem;
};

OffsetNumber number_of(std::string_view text, WordValues& values) {
  const Evaluated found = values.value(text);
  if (found.ok() && found.length == text.size()) return {found.value, {}};
  return {0.0, "a value cannot be read"};
}

/// A settable offset, or why it cannot be read.
struct OffsetRead {
  WorkOffset offset;
  std::string problem;
};

struct OffsetComponent {
  std::string_view axis;
  std::string name;  ///< TR, RT, FI
  double value = 0.0;
};

/// The offset with a component of one axis; lengths in `unit`, angles in degrees.
OffsetRead with_component(WorkOffset offset, const OffsetComponent& component, double unit) {
  const auto axis = axis_of(component.axis);
  if (!axis) return {offset, "an axis is none of X Y Z A B C U V W"};
  const bool rotary = *axis >= 3 && *axis < 6;
  if (component.name == "TR") {
    offset.words[*axis] = rotary ? radians_from_degrees(component.value) : component.value * unit;
  } else if (component.name == "RT" && *axis == 2) {
    offset.rotation = radians_from_degrees(component.value);
  } else if (component.value != 0.0 || (component.name != "RT" && component.name != "FI")) {
    return {offset, "of its components TR, RT of Z, and 0 for the other RT and FI are read"};
  }
  return {offset, {}};
}

/// CTRANS(X,v,..) and CROT(Z,v) behind it: a whole offset.
OffsetRead offset_of_frame(std::string_view text, WordValues& values, double unit) {
  OffsetRead out;
  while (!text.empty()) {
    const std::size_t begin = text.find('(');
    const std::size_t end = text.find(')', std::min(begin, text.size()));
    if (end == std::string_view::npos)
      return {{}, "a frame is CTRANS(..) or CTRANS(..):CROT(Z,..)"};
    const std::string function = upper_text(trimmed(text.substr(0, begin)));
    if (function != "CTRANS" && function != "CROT") return {{}, function + " is not read"};
    const auto words = parts_of(text.substr(begin + 1, end - begin - 1));
    const bool none = words.size() == 1 && words[0].empty();
    if (words.size() % 2 != 0 && !none) return {{}, "axes and values stand in pairs"};
    for (std::size_t i = 0; i + 1 < words.size(); i += 2) {
      const OffsetNumber number = number_of(words[i + 1], values);
      if (!number.problem.empty()) return {{}, number.problem};
      const char* name = function == "CTRANS" ? "TR" : "RT";
      out = with_component(out.offset, {words[i], name, number.value}, unit);
      if (!out.problem.empty()) return out;
    }
    text = trimmed(text.substr(end + 1));
    if (text.empty()) break;
    if (text.front() != ':') return {{}, "text behind the frame"};
    if (function == "CROT") return {{}, "CROT stands last"};
    text = trimmed(text.substr(1));
  }
  return out;
}

}  // namespace

/// R of ROT and AROT: RPL turns about the normal of the plane; else Z, then the new Y, then the new
/// X.
Mat3 Executor::frame_turn(const BlockWords& block) const {
  if (block.has(kPlaneAngle)) {
    const Vec3 normal = modal_.plane == 180   ? Vec3(Vec3::UnitY())
                        : modal_.plane == 190 ? Vec3(Vec3::UnitX())
                                              : Vec3(Vec3::UnitZ());
    return turn_about(normal, block[kPlaneAngle]);
  }
  const auto angle = [&](char letter) { return block.has(letter) ? block[letter] : 0.0; };
  return turn_about(Vec3::UnitZ(), angle('Z')) * turn_about(Vec3::UnitY(), angle('Y')) *
         turn_about(Vec3::UnitX(), angle('X'));
}

/// The diagonal matrix of MIRROR and SCALE: -1 for the axes that MIRROR names, whatever their
/// values; the factors of SCALE.
Mat3 Executor::frame_stretch(const BlockWords& block) const {
  const bool mirrors = block.says(SiemensWord::mirror) || block.says(SiemensWord::amirror);
  Mat3 stretch = Mat3::Identity();
  for (Eigen::Index i = 0; i < 3; ++i) {
    const char letter = kAxisLetters[static_cast<std::size_t>(i)];
    if (block.has(letter)) stretch(i, i) = mirrors ? -1.0 : block[letter];
  }
  return stretch;
}

/// What MIRROR, SCALE, and what stands behind them may not be; empty: nothing.
std::string Executor::frame_problem(const BlockWords& block) const {
  const bool scales = block.says(SiemensWord::scale) || block.says(SiemensWord::ascale);
  const bool mirrors = block.says(SiemensWord::mirror) || block.says(SiemensWord::amirror);
  const bool turns = block.says(SiemensWord::arot);
  constexpr LetterMask kXyz = letter_bit('X') | letter_bit('Y') | letter_bit('Z');
  if (modal_.swivelled) return "a frame in the plane of CYCLE800 is not read; write it out";
  if ((scales || mirrors) && (block.letters & kAxisLetterMask & ~kXyz) != 0) {
    return "MIRROR and SCALE are read for X, Y and Z";
  }
  for (const char letter : {'X', 'Y', 'Z'}) {
    if (scales && block.has(letter) && !(block[letter] > 1e-6)) {
      return "the factors of SCALE are above 0";
    }
  }
  const Mat3& now = coordinates_.frame_rotation();
  const Mat3 square = now.transpose() * now;
  if (turns && !(square - square.trace() / 3.0 * Mat3::Identity()).isZero(1e-9 * square.trace())) {
    return "AROT behind an unequal SCALE would bend the axes";
  }
  if (block.says(SiemensWord::trans) && axial_shift_ && axis_mask(block.letters) != 0) {
    return "TRANS behind G59: whether its shift stays is not stated; write TRANS without axes "
           "before";
  }
  return {};
}

/// TRANS, ROT, MIRROR and SCALE replace the frame, ATRANS .. go on from it: p' = R·p + t.
void Executor::change_frame(const BlockWords& block) {
  const bool shifts = block.says(SiemensWord::trans) || block.says(SiemensWord::atrans);
  const bool turns = block.says(SiemensWord::rot) || block.says(SiemensWord::arot);
  const bool stretches = block.says(SiemensWord::mirror) || block.says(SiemensWord::amirror) ||
                         block.says(SiemensWord::scale) || block.says(SiemensWord::ascale);
  if (!shifts && !turns && !stretches) return;
  // There only the plane's own frame is in force.
  if (modal_.swivelled && axis_mask(block.letters) == 0 && !block.has(kPlaneAngle)) return;
  const std::string problem = frame_problem(block);
  if (!problem.empty()) {
    log_.error("NC245", problem, reader_.place(block, block.statement_piece));
    return;
  }
  const AxisWords here = coordinates_.world();
  const AxisMask unknown = coordinates_.unknown();
  Mat3 rotation = coordinates_.frame_rotation();
  AxisWords shift = coordinates_.frame_shift();
  if (block.says(SiemensWord::trans) || block.says(SiemensWord::rot) ||
      block.says(SiemensWord::mirror) || block.says(SiemensWord::scale)) {
    rotation = Mat3::Identity();
    shift = added_shift_ = {};
    axial_shift_ = false;
  }
  if (turns) rotation = rotation * frame_turn(block);
  if (stretches) rotation = rotation * frame_stretch(block);
  if (shifts) {
    const AxisMask axes = axis_mask(block.letters);
    Vec3 linear = Vec3::Zero();
    for (std::size_t i = 0; i < shift.size(); ++i) {
      if ((axes & bit(i)) == 0) continue;
      if (i < 3) {
        linear[static_cast<Eigen::Index>(i)] = word_value(block, i);
      } else {
        shift[i] += word_value(block, i);
      }
    }
    const Vec3 moved = rotation * linear;
    for (std::size_t i = 0; i < 3; ++i) shift[i] += moved[static_cast<Eigen::Index>(i)];
    if (block.says(SiemensWord::atrans)) {
      for (std::size_t i = 0; i < 3; ++i) added_shift_[i] += moved[static_cast<Eigen::Index>(i)];
    }
  }
  modal_.polar.lost = modal_.polar.set;
  coordinates_.set_frame(rotation, shift);
  coordinates_.move_to(here, unknown);
  offset_dirty_ = true;
}

/// CYCLE800(FR,TC,ST,MODE,X0,Y0,Z0,A,B,C,X1,Y1,Z1,DIR,..): the tool normal to a plane, read where
/// no data of the machine say what it is: a new plane (ST 0 or 10) turned axis by axis about X, the
/// new Y, the new Z (MODE 57), p' = R·(p + (X1 Y1 Z1)) + (X0 Y0 Z0). TC "0" ends it. How the axes
/// get there is planned anew.
void Executor::swivel(const BlockWords& block) {
  const auto refuse = [&](const std::string& why) {
    log_.error("NC245",
               "CYCLE800: " + why + "; let the CAM post write MODE 57, or positions under TRAORI",
               reader_.place(block, block.statement_piece));
  };
  const std::string_view text = reader_.raw(block.statement_piece);
  const std::size_t open = text.find('(');
  const auto arguments = parts_of(text.substr(open + 1, text.rfind(')') - open - 1));
  std::array<double, 16> values{};
  if (arguments.size() > values.size()) return refuse("it has more than 16 values");
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (i == 1 || arguments[i].empty()) continue;
    const Evaluated found = values_->value(arguments[i]);
    if (!found.ok() || found.length != arguments[i].size()) return refuse("a value cannot be read");
    values[i] = found.value;
  }
  if (arguments.size() > 1 && arguments[1] == "\"0\"") return leave_plane();
  if (values[3] != 57.0) {
    return refuse("of its kinds MODE 57, axis by axis about X, Y and Z, is read");
  }
  if (values[2] != 0.0 && values[2] != 10.0)
    return refuse("ST, an added plane, is read as 0 or 10");
  if (values[13] != 1.0 && values[13] != -1.0) {
    return refuse("DIR has to be 1 or -1: with 0 the axes do not go to the plane");
  }
  if (values[15] != 0.0 && values[15] != 1.0) return refuse("DMODE is read as 0 or 1");
  if (modal_.plane != 170 || modal_.tcp) return refuse("it is read in G17, outside of TRAORI");
  const bool framed =
      !coordinates_.frame_rotation().isIdentity(0.0) || coordinates_.frame_shift() != AxisWords{};
  if (framed && !modal_.swivelled) return refuse("a frame (TRANS, ROT ..) is in force before it");
  const Mat3 rotation = turn_about(Vec3::UnitX(), values[7]) *
                        turn_about(Vec3::UnitY(), values[8]) * turn_about(Vec3::UnitZ(), values[9]);
  const Vec3 shift = modal_.unit * (Vec3(values[4], values[5], values[6]) +
                                    rotation * Vec3(values[10], values[11], values[12]));
  AxisWords words{};
  for (std::size_t i = 0; i < 3; ++i) words[i] = shift[static_cast<Eigen::Index>(i)];
  leave_plane();
  coordinates_.set_frame(rotation, words);
  modal_.swivelled = true;
  modal_.axis = coordinates_.world_direction(Vec3::UnitZ());
}

/// The frame is none, and where the axes stand is not known.
void Executor::leave_plane() {
  constexpr AxisMask kMoved = 0x3f;
  modal_.swivelled = false;
  modal_.axis = Vec3::Zero();
  coordinates_.set_frame(Mat3::Identity(), {});
  coordinates_.forget(kMoved);
  modal_.polar.lost = modal_.polar.set;
  offset_dirty_ = true;
}

/// G58 replaces the shift of TRANS of the axes that it names, G59 the further one of ATRANS.
void Executor::shift_axes(const BlockWords& block, const BlockPlan& plan) {
  const bool further = block.code(GGroup::non_modal) == 590;
  const TextPlace place = at(block, GGroup::non_modal);
  if (!coordinates_.frame_rotation().isIdentity(0.0) || modal_.swivelled) {
    log_.error(
        "NC245",
        "G58 and G59 in a frame that is turned, mirrored or scaled are not read; write TRANS "
        "or ATRANS",
        place);
    return;
  }
  AxisWords shift = coordinates_.frame_shift();
  for (std::size_t i = 0; i < shift.size(); ++i) {
    if ((plan.axes & bit(i)) == 0) continue;
    const double value = word_value(block, i);
    shift[i] = further ? shift[i] - added_shift_[i] + value : value + added_shift_[i];
    if (further) added_shift_[i] = value;
  }
  axial_shift_ = axial_shift_ || further;
  coordinates_.set_frame(coordinates_.frame_rotation(), shift);
  modal_.polar.lost = modal_.polar.set;
  offset_dirty_ = true;
}

std::vector<std::uint32_t> Executor::statements_of(const BlockWords& block,
                                                   SiemensWord word) const {
  std::vector<std::uint32_t> out;
  const Program& program = reader_.program();
  const Block& span = program.block(block.line - 1);
  for (std::uint32_t i = span.first_piece; i < span.first_piece + span.piece_count; ++i) {
    const Piece& piece = program.pieces[i];
    if (piece.kind == PieceKind::statement && piece.detail == static_cast<std::uint8_t>(word))
      out.push_back(i);
  }
  return out;
}

/// $P_UIFR: settable offsets are data of the control, which the next G54 .. G57 takes.
void Executor::take_offset_data(const BlockWords& block) {
  for (const std::uint32_t piece : statements_of(block, SiemensWord::offset_data)) {
    std::string problem = block.code(GGroup::work_system) != kNoCode
                              ? "G54 stands in the same block; write it on a line behind"
                              : read_offset_data(reader_.raw(piece));
    if (!problem.empty()) log_.error("NC245", "$P_UIFR: " + problem, reader_.place(block, piece));
  }
}

/// `$P_UIFR[n,X,TR]=v`, `$P_UIFR[n]=CTRANS(X,v,..):CROT(Z,v)`; what is wrong with it, or nothing.
std::string Executor::read_offset_data(std::string_view text) {
  const std::size_t open = text.find('[');
  const std::size_t close = text.find(']', open);
  const std::size_t equals = text.find('=', std::min(close, text.size()));
  if (close == std::string_view::npos || equals == std::string_view::npos) return "no such form";
  const auto head = parts_of(text.substr(open + 1, close - open - 1));
  if (head.size() != 1 && head.size() != 3) return "no such form";
  if (modal_.unit != modal_.feed_unit) return "under G70 its unit is not certain; write G700";
  const OffsetNumber system = number_of(head.front(), *values_);
  if (!system.problem.empty()) return system.problem;
  if (system.value != 1.0 && system.value != 2.0 && system.value != 3.0 && system.value != 4.0) {
    return "the offsets 1 to 4, of G54 to G57, are read";
  }
  const int place = static_cast<int>(system.value);
  const std::string_view value = trimmed(text.substr(equals + 1));
  OffsetRead read;
  if (head.size() == 1) {
    read = offset_of_frame(value, *values_, modal_.unit);
  } else {
    const auto pending = pending_offsets_.find(place);
    read.offset = pending != pending_offsets_.end() ? pending->second : coordinates_.offset(place);
    const OffsetNumber number = number_of(value, *values_);
    read.problem = number.problem;
    if (read.problem.empty()) {
      read = with_component(read.offset, {head[1], upper_text(head[2]), number.value}, modal_.unit);
    }
  }
  if (read.problem.empty()) pending_offsets_[place] = read.offset;
  return read.problem;
}

}  // namespace smoothpost::nc
