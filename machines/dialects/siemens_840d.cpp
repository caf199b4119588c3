#include "machines/dialects/siemens_840d.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/units.h"
#include "machines/dialects/arc_text.h"
#include "machines/dialects/decimal.h"
#include "machines/dialects/event_text.h"
#include "machines/dialects/zyx_angles.h"

namespace smoothpost::siemens_840d {

namespace {

constexpr std::size_t kMaxComment = 120;
constexpr std::size_t kMaxLabel = 32;
constexpr int kVectorDigits = 8;
constexpr int kGuardDigits = 5;
constexpr std::string_view kGeometryAxes = "XYZ";

std::string decimal(double value, int decimals) {
  std::string out;
  append_decimal(out, value, decimals);
  return out;
}

bool ends_program(const std::string& line) {
  const std::string packed = packed_statement(line.substr(0, line.find(';')));
  return packed == "M30" || packed == "M2" || packed == "M17";
}

class Emitter {
 public:
  Emitter(const MachineDefinition& machine, const MachineProgram& program)
      : machine_(machine), program_(program), printed_(machine.axes.size()) {
    length_scale_ = machine.dialect.units == "inch" ? 1.0 / kMillimetresPerInch : 1.0;
    has_poses_ = std::any_of(program.moves.begin(), program.moves.end(), [](const MachineMove& m) {
      return m.interpolation == MoveInterpolation::tool;
    });
    has_bends_ = std::any_of(program.moves.begin(), program.moves.end(),
                             [](const MachineMove& m) { return m.bend.rows() > 0; });
    out_.move_lines.reserve(program.moves.size());
    out_.text.reserve(96 * program.moves.size() + 4096);
  }

  Result<EmittedProgram> run() {
    check_machine();
    if (has_error(diagnostics_)) return Result<EmittedProgram>::failure(std::move(diagnostics_));
    header();
    std::size_t action = 0;
    for (std::size_t i = 0; i <= program_.moves.size(); ++i) {
      for (; action < program_.actions.size() && program_.actions[action].before == i; ++action)
        print_action(program_.actions[action]);
      if (i < program_.moves.size()) print_move(i);
    }
    footer();
    out_.line_count = line_;
    if (has_error(diagnostics_)) return Result<EmittedProgram>::failure(std::move(diagnostics_));
    return Result<EmittedProgram>(std::move(out_), std::move(diagnostics_));
  }

 private:
  enum class Mode { unknown, joints, tool };

  void check_machine() {
    const auto refuse = [this](std::string text) {
      Diagnostic d;
      d.code = "PR203";
      d.text = std::move(text);
      diagnostics_.push_back(std::move(d));
    };
    if (machine_.dialect.path_mode != "exact")
      refuse("dialect siemens_840d has no path_mode \"" + machine_.dialect.path_mode +
             "\": what G642 rounds off has no bound for rotary axes; write path_mode = \"exact\"");
    const bool bent_rapid =
        std::any_of(program_.moves.begin(), program_.moves.end(),
                    [](const MachineMove& m) { return m.rapid && m.bend.rows() > 0; });
    const bool arcs = std::any_of(program_.moves.begin(), program_.moves.end(),
                                  [](const MachineMove& m) { return m.arc.turn != 0; });
    if (arcs && has_poses_)
      refuse("arcs stand in programs of joint words only: write dialect.mode = \"joint\"");
    if (bent_rapid) refuse("a rapid along polynomials has no words in dialect siemens_840d");
    if (has_bends_ && has_poses_)
      refuse("polynomials stand in programs of joint words only: write dialect.mode = \"joint\"");
    static constexpr std::string_view kLetters = "XYZABCUVWPQ";
    for (const auto& axis : machine_.axes)
      if (kLetters.find(axis.letter) == std::string_view::npos)
        refuse("axis " + axis.name + " has the letter " + std::string(1, axis.letter) +
               ": dialect siemens_840d has the axis words " + std::string(kLetters));
  }

  void header() {
    if (!program_.certified)
      comment("NOT CERTIFIED. Written with --force: read the report before you run it");
    for (const auto& line : program_.title) comment(line);
    if (has_poses_) comment(tool_note());
    for (const auto& line : machine_.dialect.start) put_template(line);
    modal_words();
    put_block(has_poses_ ? "G54 D1" : "G500 D0");
    put_block("TRANS");
    if (machine_.dialect.offset_guard) guard();
    if (!program_.certified) put_block("M0");
  }

  std::string tool_note() const {
    return "D1 has to hold tool length L1 = " +
           decimal(program_.tool_length * length_scale_, kGuardDigits) +
           ", G54 the place of the part";
  }

  // Everything that motions rely on except frame, tool and transformation, which each kind of move
  // sets for itself.
  void modal_words() {
    plane_ = 17;
    put_block("TRAFOOF");
    const bool inch = machine_.dialect.units == "inch";
    put_block(std::string("G17 ") + (inch ? "G700" : "G710") + " G90 G94 G40 G60 G601 " +
              (machine_.links.rapid == RapidMotion::linear ? "RTLION" : "RTLIOF"));
    if (has_bends_) put_block("UPATH");
    mode_ = Mode::unknown;
    inverse_time_ = false;
    forget_words();
  }

  void forget_words() {
    for (auto& word : printed_) word.clear();
    for (auto& word : printed_tip_) word.clear();
    printed_axis_.clear();
  }

  // ------------------------------------------------------------------------------------- guard

  void guard() {
    put_block("STOPRE");
    Pose part = has_poses_ ? program_.part : Pose::Identity();
    const ZyxAngles angles = zyx_angles(part.linear());
    const Vec3 turn(angles.x, angles.y, angles.z);
    for (std::size_t i = 0; i < kGeometryAxes.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      const std::string axis(1, kGeometryAxes[i]);
      guard_offset(axis, part.translation()[k] * length_scale_);
      guard_line("ABS($P_ACTFRAME[" + axis + ",RT]-(" +
                     decimal(degrees_from_radians(turn[k]), kGuardDigits) + "))>0.0001",
                 "OFFSET");
      guard_line("($P_ACTFRAME[" + axis + ",SC]<>1) OR ($P_ACTFRAME[" + axis + ",MI]<>0)",
                 "OFFSET");
    }
    for (const auto& axis : machine_.axes)
      if (kGeometryAxes.find(axis.letter) == std::string_view::npos)
        guard_offset(std::string(1, axis.letter), 0.0);
    if (has_poses_) guard_tool();
    put_block("GOTOF SP_START");
    guard_stop("OFFSET", has_poses_ ? "smoothpost: G54 is not the place of the part of this program"
                                    : "smoothpost: an offset is active, this program is in joints");
    if (has_poses_) guard_stop("TOOL", "smoothpost: D1 has not the tool length of this program");
    put_block("SP_START:");
  }

  // In the program's unit; about half a micrometre.
  std::string length_tolerance() const {
    return machine_.dialect.units == "inch" ? "0.00002" : "0.0005";
  }

  void guard_line(const std::string& condition, const std::string& what) {
    put_block("IF " + condition + " GOTOF SP_WRONG_" + what);
  }

  void guard_offset(const std::string& axis, double value) {
    guard_line("ABS($P_ACTFRAME[" + axis + ",TR]+$P_ACTFRAME[" + axis + ",FI]-(" +
                   decimal(value, kGuardDigits) + "))>" + length_tolerance(),
               "OFFSET");
  }

  void guard_tool() {
    for (int component = 1; component <= 3; ++component)
      guard_line(
          "ABS($P_TOOLL[" + std::to_string(component) + "]-(" +
              decimal(component == 1 ? program_.tool_length * length_scale_ : 0.0, kGuardDigits) +
              "))>" + length_tolerance(),
          "TOOL");
  }

  // The stop comes back at each start: no motion is reached.
  void guard_stop(const std::string& what, const std::string& message) {
    put_block("SP_WRONG_" + what + ":");
    put_block("MSG(\"" + message + "\")");
    put_block("M0");
    put_block("GOTOB SP_WRONG_" + what);
  }

  // ------------------------------------------------------------------------------------- lines

  void put_line(std::string_view line) {
    out_.text += line;
    out_.text += '\n';
    ++line_;
  }

  void put_block(std::string_view block) {
    if (machine_.dialect.line_numbers) {
      block_number_ += 10;
      out_.text += "N" + std::to_string(block_number_) + " ";
    }
    put_line(block);
  }

  void put_template(const std::string& line) {
    const bool bare = line.empty() || line[0] == ';' || line[0] == '%';
    bare ? put_line(line) : put_block(line);
  }

  void comment(std::string_view text) { put_line("; " + plain_text(text, kMaxComment)); }

  void footer() {
    leave_plane();
    if (mode_ != Mode::joints) put_block("TRAFOOF");
    if (inverse_time_) put_block("G94");
    bool ended = false;
    for (const auto& line : machine_.dialect.end) {
      put_template(line);
      ended = ended || ends_program(line);
    }
    if (!ended) put_block("M30");
  }

  void print_action(const MachineAction& action) {
    switch (action.kind) {
      case MachineAction::Kind::comment:
        return comment(action.text);
      case MachineAction::Kind::dwell:
        return put_block("G4 F" + decimal(action.seconds, 4));
      case MachineAction::Kind::cut_label:
        return print_label(action.text);
      case MachineAction::Kind::event:
        break;
    }
    const auto event = event_text(machine_, action, diagnostics_);
    if (!event) return;
    if (event->is_comment) return comment(event->text);
    leave_plane();
    put_block(event->text);
    if (action.event.name == event_name::kToolChange) after_tool_change();
    if (event->dwell > 0.0) put_block("G4 F" + decimal(event->dwell, 4));
  }

  // Words of the machine file may rely on G17.
  void leave_plane() {
    if (plane_ != 17) put_block("G17");
    plane_ = 17;
  }

  // The control may have selected a D of its own.
  void after_tool_change() {
    if (mode_ == Mode::tool) put_block("TRAFOOF");
    if (!has_poses_) put_block("D0");
    mode_ = Mode::unknown;
    forget_words();
  }

  // "CUT 7 from input line 12" becomes the label CUT_7, "PATH from ..." PATH.
  static std::string first_words(const std::string& text) {
    const auto first = text.find(' ');
    const bool number = first != std::string::npos && first + 1 < text.size() &&
                        text[first + 1] >= '0' && text[first + 1] <= '9';
    return text.substr(0, number ? text.find(' ', first + 1) : first);
  }

  void print_label(const std::string& text) {
    std::string label;
    for (const char c : plain_text(first_words(text), kMaxLabel - 6)) {
      const bool letter = (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
      const bool digit = c >= '0' && c <= '9';
      label += letter || digit ? c : '_';
      if (c >= 'a' && c <= 'z') label.back() = static_cast<char>(c - 32);
    }
    if (label.size() < 2 || label[0] < 'A' || label[1] < 'A') label = "CUT_" + label;
    std::string unique = label;
    for (int n = 2; std::find(labels_.begin(), labels_.end(), unique) != labels_.end(); ++n)
      unique = label + "_" + std::to_string(n);
    labels_.push_back(unique);
    leave_plane();
    put_block(unique + ": ; " + plain_text(text, kMaxComment));
    modal_words();
    if (!has_poses_) put_block("G500 D0");
  }

  // ------------------------------------------------------------------------------------- moves

  void set_mode(Mode mode) {
    if (mode == mode_) return;
    forget_words();
    if (mode == Mode::tool) {
      put_block("D1");
      put_block("TRAORI");
      put_block("G54");  // TRAORI drops the frame
      put_block("ORIWKS ORIVECT");
    } else if (mode_ == Mode::tool) {
      put_block("TRAFOOF");
    }
    mode_ = mode;
  }

  void set_time_mode(bool inverse) {
    if (inverse == inverse_time_) return;
    put_block(inverse ? "G93" : "G94");
    inverse_time_ = inverse;
  }

  void print_move(std::size_t i) {
    const MachineMove& move = program_.moves[i];
    const bool tool = move.interpolation == MoveInterpolation::tool;
    set_mode(tool ? Mode::tool : Mode::joints);
    set_time_mode(!move.rapid);
    const bool bent = degree(move) > 1;
    const auto [code, centre] = arc_code(i);
    std::string block = move.rapid ? "G0" : bent ? "POLY" : code;
    block += tool ? tool_words(move) : bent ? bent_words(move) : joint_words(move) + centre;
    if (!move.rapid) {
      const double f = kSecondsPerMinute / move.duration;
      block += " F" + decimal(f, f < 10.0 ? 7 : f < 1000.0 ? 5 : 3);
    }
    put_block(block);
    out_.move_lines.push_back(line_);
  }

  // "G17 G2" and " I1.5 J-2"; the centre from the start.
  std::pair<std::string, std::string> arc_code(std::size_t i) {
    const MachineMove& move = program_.moves[i];
    if (move.arc.turn == 0) return {"G1", ""};
    const ArcWords arc = arc_words(machine_, move.arc, program_.moves[i - 1].to);
    plane_ = arc.plane.code;
    const auto centre = [this](char letter, double value) {
      return std::string(" ") + letter + decimal(value, machine_.dialect.digits_length);
    };
    return {
        "G" + std::to_string(arc.plane.code) + (arc.clockwise ? " G2" : " G3"),
        centre(arc.plane.first_centre, arc.first) + centre(arc.plane.second_centre, arc.second)};
  }

  // Words that would print the same digits as before are left out, except when nothing else is
  // left and in blocks whose frames are suppressed.
  std::string joint_words(const MachineMove& move) {
    const bool suppressed = has_poses_ || move.machine_coordinates;
    std::string words, one;
    for (int j = 0; j < machine_.size(); ++j) {
      if (!(move.joints >> j & 1U)) continue;
      std::string word = joint_word(j, move.to[j]);
      auto& last = printed_[static_cast<std::size_t>(j)];
      if (one.empty()) one = " " + word;
      if (last == word && !suppressed) continue;
      words += " " + word;
      last = std::move(word);
    }
    return (suppressed ? " SUPA D0" : "") + (words.empty() ? one : words);
  }

  std::string joint_word(int j, double value) const {
    return std::string(1, machine_.axes[static_cast<std::size_t>(j)].letter) + number(j, value);
  }

  // Of joint j, in the program's units.
  std::string number(int j, double value) const {
    const auto& axis = machine_.axes[static_cast<std::size_t>(j)];
    return axis.joint.kind == JointKind::rotary
               ? decimal(degrees_from_radians(value), machine_.dialect.digits_angle)
               : decimal(value * length_scale_, machine_.dialect.digits_length);
  }

  // The coefficients of joint j as printed, without zeros at the end.
  std::vector<std::string> coefficients(const MachineMove& move, int j) const {
    std::vector<std::string> printed;
    for (Eigen::Index k = 0; k < move.bend.cols(); ++k)
      printed.push_back(number(j, move.bend(j, k)));
    while (!printed.empty() && printed.back() == "0") printed.pop_back();
    return printed;
  }

  // Highest power that is left of a move's polynomials in the printed digits.
  std::size_t degree(const MachineMove& move) const {
    std::size_t most = 1;
    for (int j = 0; j < machine_.size() && move.bend.rows() > 0; ++j)
      if (move.joints >> j & 1U) most = std::max(most, coefficients(move, j).size() + 1);
    return most;
  }

  // Polynomials over 0 to 1, in the older notation where it is enough. An axis that comes back to
  // where it was has to be named as well.
  std::string bent_words(const MachineMove& move) {
    const bool cubic = degree(move) <= 3;
    std::string words;
    for (int j = 0; j < machine_.size(); ++j) {
      if (!(move.joints >> j & 1U)) continue;
      std::string& last = printed_[static_cast<std::size_t>(j)];
      const std::string end = joint_word(j, move.to[j]);
      const std::vector<std::string> higher = coefficients(move, j);
      if (higher.empty() && end != last) words += " " + end;
      if (!higher.empty()) {
        const std::string letter = end.substr(0, 1);
        words += (cubic ? " PO[" + letter + "]=(" : " " + letter + "=PO(") + end.substr(1);
        for (const std::string& coefficient : higher) words += "," + coefficient;
        words += ")";
      }
      last = end;
    }
    return words + " PL=1";
  }

  std::string tool_words(const MachineMove& move) {
    std::string words;
    for (std::size_t i = 0; i < kGeometryAxes.size(); ++i) {
      std::string word(1, kGeometryAxes[i]);
      append_decimal(word, move.tool.translation()[static_cast<Eigen::Index>(i)] * length_scale_,
                     machine_.dialect.digits_length);
      if (printed_tip_[i] == word) continue;
      words += " " + word;
      printed_tip_[i] = std::move(word);
    }
    const Vec3 axis = (move.tool.linear() * machine_.tool.axis).normalized();
    // A component that is not written is 0 for the control: all three or none.
    const std::string vector = " A3=" + decimal(axis[0], kVectorDigits) +
                               " B3=" + decimal(axis[1], kVectorDigits) +
                               " C3=" + decimal(axis[2], kVectorDigits);
    if (vector != printed_axis_) words += vector;
    printed_axis_ = vector;
    return words.empty() ? " " + printed_tip_[0] : words;
  }

  const MachineDefinition& machine_;
  const MachineProgram& program_;
  std::vector<std::string> printed_;  // word of each joint
  std::array<std::string, 3> printed_tip_;
  std::string printed_axis_;
  std::vector<std::string> labels_;
  double length_scale_ = 1.0;
  bool has_poses_ = false;
  bool has_bends_ = false;
  int plane_ = 17;
  bool inverse_time_ = false;
  Mode mode_ = Mode::unknown;
  std::uint64_t block_number_ = 0;
  std::uint32_t line_ = 0;
  EmittedProgram out_;
  Diagnostics diagnostics_;
};

}  // namespace

Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program) {
  return Emitter(machine, program).run();
}

const Dialect kDialect = {"siemens_840d",
                          "SINUMERIK 840D sl, joint words or TRAORI with tool vectors, G93, G60",
                          "TRAORI with ORIVECT: tip linear, tool axis on the great circle; joint "
                          "words: all axes linear; exact stop (G60 G601) at block ends",
                          ToolTurn::great_circle,
                          true,
                          &emit,
                          &read_back,
                          "the frame and the tool length that are active in the control are those "
                          "that the program names: it stops before its first motion otherwise",
                          true,
                          true};

}  // namespace smoothpost::siemens_840d
