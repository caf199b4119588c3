#include "machines/dialects/linuxcnc.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "formats/nc/interpreter.h"
#include "formats/nc/program_stream.h"
#include "kernels/core/units.h"
#include "kernels/spline/bent_move.h"
#include "machines/dialects/arc_text.h"
#include "machines/dialects/decimal.h"
#include "machines/dialects/event_text.h"

namespace smoothpost::linuxcnc {

namespace {

constexpr std::size_t kMaxCommentLength = 200;  // LinuxCNC refuses lines over 255 characters

// The offsets that must be zero when joint words are run: active work offset (and its rotation),
// G92 and tool offset, all nine axes each (parameters of the RS274NGC interpreter as LinuxCNC
// numbers them).
std::vector<std::string> guard_lines() {
  std::vector<std::string> lines;
  const auto sum = [](int first, int count) {
    std::string text;
    for (int i = 0; i < count; ++i)
      text += (i ? "+ABS[#" : "ABS[#") + std::to_string(first + i) + "]";
    return text;
  };
  const auto refuse = [&lines](const std::string& label, const std::string& condition,
                               const std::string& reason) {
    lines.push_back("o" + label + " if [" + condition + "]");
    lines.push_back("(ABORT, smoothpost: " + reason + ")");
    lines.push_back("o" + label + " endif");
  };
  refuse("101", "[" + sum(5221, 10) + "] GT 0.0000001",
         "G54 is not zero. This program is in machine joints: clear G54 with G10 L2 P1 R0 X0 Y0 Z0 "
         "A0 B0 "
         "C0 U0 V0 W0");
  refuse("102", "[#5210*[" + sum(5211, 9) + "]] GT 0.0000001",
         "a G92 or G52 offset is active. Clear it with G92.1");
  refuse("103", "[" + sum(5401, 9) + "] GT 0.0000001",
         "a tool length offset is active. The tool length is in this program");
  return lines;
}

// Comments are printed in parentheses: no nesting, no control characters, bounded length.
std::string comment_text(std::string_view text) {
  std::string out;
  for (const char c : text.substr(0, kMaxCommentLength)) {
    if (c == '(')
      out += '[';
    else if (c == ')')
      out += ']';
    else if (static_cast<unsigned char>(c) < 0x20)
      out += ' ';
    else
      out += c;
  }
  // A cut inside a UTF-8 sequence would leave half a character.
  while (text.size() > kMaxCommentLength && !out.empty() &&
         (static_cast<unsigned char>(out.back()) & 0xC0) == 0x80)
    out.pop_back();
  if (text.size() > kMaxCommentLength && !out.empty() &&
      static_cast<unsigned char>(out.back()) >= 0xC0)
    out.pop_back();
  // "(MSG, ...)", "(ABORT, ...)" and their like act; a plain comment of ours never does.
  const auto comma = out.find(',');
  if (comma != std::string::npos && comma < 12) out.insert(0, "- ");
  return out;
}

class Emitter {
 public:
  Emitter(const MachineDefinition& machine, const MachineProgram& program)
      : machine_(machine), program_(program), printed_(machine.axes.size()) {
    const bool inch = machine.dialect.units == "inch";
    length_scale_ = inch ? 1.0 / kMillimetresPerInch : 1.0;
    out_.move_lines.reserve(program.moves.size());
    out_.text.reserve(64 * program.moves.size() + 4096);
    has_arcs_ = std::any_of(program.moves.begin(), program.moves.end(),
                            [](const MachineMove& m) { return m.arc.turn != 0; });
  }

  Result<EmittedProgram> run() {
    header();
    std::size_t action = 0;
    for (std::size_t i = 0; i <= program_.moves.size(); ++i) {
      for (; action < program_.actions.size() && program_.actions[action].before == i; ++action)
        print_action(program_.actions[action]);
      if (i < program_.moves.size()) print_move(i);
    }
    set_time_mode(false);
    leave_plane();
    for (const auto& line : machine_.dialect.end) put_line(line);
    put_line("%");
    out_.line_count = line_;
    if (has_error(diagnostics_)) return Result<EmittedProgram>::failure(std::move(diagnostics_));
    return Result<EmittedProgram>(std::move(out_), std::move(diagnostics_));
  }

 private:
  void header() {
    put_line("%");
    if (!program_.certified)
      put_line("(NOT CERTIFIED. Written with --force: read the report before you run it)");
    for (const auto& line : program_.title) put_line("(" + comment_text(line) + ")");
    const bool inch = machine_.dialect.units == "inch";
    if (machine_.dialect.start.empty())
      put_line(std::string(inch ? "G20" : "G21") + " G17 G90 G91.1 G94 G40 G49 G80 G92.1 G54");
    for (const auto& line : machine_.dialect.start) put_line(line);
    // Where the template does not say so itself: units, absolute, no compensation, G54, no
    // blending.
    modal_block();
    if (machine_.dialect.offset_guard)
      for (const auto& line : guard_lines()) put_line(line);
    if (!program_.certified) put_line("M0");
  }

  void modal_block() {
    const bool inch = machine_.dialect.units == "inch";
    put_line(std::string(inch ? "G20" : "G21") + " G90 G94 G40 G49 G80 G92.1 G54");
    if (has_arcs_) put_line("G91.1");
    put_line(machine_.dialect.path_mode == "exact" ? "G61" : "G64 P0.001 Q0");
    inverse_time_ = false;
  }

  // From here on every mode and every axis word is stated anew.
  void print_label(const MachineAction& action) {
    set_time_mode(false);
    leave_plane();
    put_line("(" + comment_text(action.text) + ")");
    modal_block();
    for (auto& word : printed_) word.clear();
  }

  void put_line(std::string_view line) {
    out_.text += line;
    out_.text += '\n';
    ++line_;
  }

  void number(std::uint32_t input_line) {
    if (!machine_.dialect.line_numbers || input_line == 0) return;
    out_.text += 'N';
    append_decimal(out_.text, input_line, 0);
    out_.text += ' ';
  }

  void set_time_mode(bool inverse) {
    if (inverse == inverse_time_) return;
    put_line(inverse ? "G93" : "G94");
    inverse_time_ = inverse;
  }

  // Words of the machine file may rely on G17.
  void leave_plane() {
    if (plane_ != 17) put_line("G17");
    plane_ = 17;
  }

  void print_action(const MachineAction& action) {
    switch (action.kind) {
      case MachineAction::Kind::comment:
        put_line("(" + comment_text(action.text) + ")");
        return;
      case MachineAction::Kind::dwell: {
        number(action.input_line);
        out_.text += "G4 P";
        append_decimal(out_.text, action.seconds, 4);
        put_line("");
        return;
      }
      case MachineAction::Kind::event:
        print_event(action);
        return;
      case MachineAction::Kind::cut_label:
        print_label(action);
        return;
    }
  }

  void print_event(const MachineAction& action) {
    const auto event = event_text(machine_, action, diagnostics_);
    if (!event) return;
    if (event->is_comment) return put_line("(" + comment_text(event->text) + ")");
    leave_plane();
    number(action.input_line);
    put_line(event->text);
    if (event->dwell > 0.0) {
      out_.text += "G4 P";
      append_decimal(out_.text, event->dwell, 4);
      put_line("");
    }
  }

  void print_move(std::size_t i) {
    const MachineMove& move = program_.moves[i];
    std::string words;
    for (int j = 0; j < machine_.size(); ++j)
      if (move.joints >> j & 1U) axis_word(words, j, move.to[j]);
    // A block without a change is still a block: its line stands for a part of the input.
    if (words.empty())
      for (int j = machine_.size(); j-- > 0;)
        if (move.joints >> j & 1U) words = " " + printed_[static_cast<std::size_t>(j)];
    set_time_mode(!move.rapid);
    number(move.input_line);
    if (move.machine_coordinates) out_.text += "G53 ";
    if (move.arc.turn != 0)
      arc_block(move, program_.moves[i - 1].to, words);
    else
      out_.text += (move.rapid ? "G0" : "G1") + words;
    if (!move.rapid) {
      out_.text += " F";
      const double f = kSecondsPerMinute / move.duration;
      append_decimal(out_.text, f, f < 10.0 ? 7 : f < 1000.0 ? 5 : 3);
    }
    put_line("");
    out_.move_lines.push_back(line_);
  }

  void arc_block(const MachineMove& move, const JointVector& from, const std::string& words) {
    const ArcWords arc = arc_words(machine_, move.arc, from);
    plane_ = arc.plane.code;
    out_.text += "G" + std::to_string(arc.plane.code) + (arc.clockwise ? " G2" : " G3") + words;
    out_.text += std::string(" ") + arc.plane.first_centre;
    append_decimal(out_.text, arc.first, machine_.dialect.digits_length);
    out_.text += std::string(" ") + arc.plane.second_centre;
    append_decimal(out_.text, arc.second, machine_.dialect.digits_length);
  }

  // Words that would print the same digits as before are left out, except when nothing else is
  // left.
  void axis_word(std::string& words, int j, double value) {
    const auto& axis = machine_.axes[static_cast<std::size_t>(j)];
    const bool rotary = axis.joint.kind == JointKind::rotary;
    std::string word(1, axis.letter);
    if (rotary)
      append_decimal(word, degrees_from_radians(value), machine_.dialect.digits_angle);
    else
      append_decimal(word, value * length_scale_, machine_.dialect.digits_length);
    auto& last = printed_[static_cast<std::size_t>(j)];
    if (last == word) return;
    words += ' ';
    words += word;
    last = std::move(word);
  }

  const MachineDefinition& machine_;
  const MachineProgram& program_;
  std::vector<std::string> printed_;
  double length_scale_ = 1.0;
  bool inverse_time_ = false;
  bool has_arcs_ = false;
  int plane_ = 17;
  std::uint32_t line_ = 0;
  EmittedProgram out_;
  Diagnostics diagnostics_;
};

/// Collects what the interpreter says of joint words.
class ReadBackSink : public CanonicalSink {
 public:
  ReadBackSink(const MachineDefinition& machine, const std::set<std::uint32_t>& radius_lines)
      : machine_(machine), radius_lines_(radius_lines) {
    for (int j = 0; j < machine.size(); ++j)
      word_[static_cast<std::size_t>(j)] =
          static_cast<int>(kAxisLetters.find(machine.axes[static_cast<std::size_t>(j)].letter));
  }

  void motion(const CanonicalMotion& motion) override {
    ReadBackMove move;
    move.to.resize(machine_.size());
    for (int j = 0; j < machine_.size(); ++j) {
      const auto w = static_cast<std::size_t>(word_[static_cast<std::size_t>(j)]);
      move.to[j] = motion.end[w];
      if (!(motion.unknown_end >> w & 1U)) move.known |= 1U << j;
    }
    move.rapid = motion.kind == MotionKind::rapid;
    move.beam = beam_;
    move.duration = motion.duration;
    move.line = motion.line;
    if (motion.is_arc) read_arc(motion, move);
    here_ = move.to;
    known_ = move.known;
    result.moves.push_back(std::move(move));
    result.last_line = motion.line;
  }
  void dwell(double seconds, std::uint32_t line) override { add("dwell", seconds, line); }
  void event(const ProcessEvent& event) override {
    if (event.name == event_name::kBeamOn || event.name == event_name::kPierce) beam_ = true;
    if (event.name == event_name::kBeamOff) beam_ = false;
    add(event.name, 0.0, event.line);
  }
  void comment(std::string_view, std::uint32_t) override {}
  void tool_length(double length, int, std::uint32_t line) override {
    if (length != 0.0)
      error(line, "tool length compensation is active in a program of joint words");
  }
  void work_offset(const Vec3& origin, double rotation, int system, std::uint32_t line) override {
    if (system != 1 || origin.norm() > 0.0 || rotation != 0.0)
      error(line, "a work offset other than a zero G54 is active in a program of joint words");
  }
  void program_end(std::uint32_t line) override { result.last_line = line; }

  ReadBack result;
  Diagnostics diagnostics;

 private:
  void read_arc(const CanonicalMotion& motion, ReadBackMove& move) {
    if (radius_lines_.count(motion.line) > 0)
      return error(motion.line,
                   "an arc by its radius is not certified, its centre is not exact near half a "
                   "circle: write I J K");
    if (std::abs(motion.arc.sweep) > kMostSweep + 1e-9)
      return error(motion.line, "an arc of more than 270 deg is not certified: divide it");
    Eigen::Index third = 0;
    motion.arc.normal.cwiseAbs().maxCoeff(&third);
    constexpr std::array<int, 3> kCodes = {19, 18, 17};
    ArcBlock block;
    block.code = kCodes[static_cast<std::size_t>(third)];
    block.clockwise = motion.arc.sweep * motion.arc.normal[third] < 0.0;
    const auto first = (third + 1) % 3, second = (third + 2) % 3;
    block.first = motion.arc.centre[first] - motion.start[static_cast<std::size_t>(first)];
    block.second = motion.arc.centre[second] - motion.start[static_cast<std::size_t>(second)];
    const std::string problem = set_arc(machine_, block, here_, known_, move);
    if (!problem.empty()) error(motion.line, problem);
  }

  void add(std::string name, double seconds, std::uint32_t line) {
    result.events.push_back({result.moves.size(), std::move(name), seconds, beam_, line});
    result.last_line = line;
  }
  void error(std::uint32_t line, std::string text) {
    Diagnostic d;
    d.code = "NC301";
    d.where.line = static_cast<int>(line);
    d.text = std::move(text);
    diagnostics.push_back(std::move(d));
  }

  const MachineDefinition& machine_;
  const std::set<std::uint32_t>& radius_lines_;
  std::array<int, kMaxJoints> word_{};
  JointVector here_;
  JointMask known_ = 0;
  bool beam_ = false;
};

// Blanks the guard out of the text (same line count), so that what is left has no O-words. Returns
// whether it was there, as a whole and unchanged.
bool take_guard(std::string& text) {
  std::string guard;
  for (const auto& line : guard_lines()) guard += line + "\n";
  const auto at = text.find("\n" + guard);
  if (at == std::string::npos) return false;
  for (std::size_t i = at + 1; i < at + 1 + guard.size(); ++i)
    if (text[i] != '\n') text[i] = ' ';
  return true;
}

// A machine program states its numbers: what a parameter or an expression comes to depends on what
// the controller has stored.
void note_computed_words(const nc::Program& program, Diagnostics& diagnostics) {
  for (std::size_t i = 0; i < program.blocks.size() && diagnostics.size() < 10; ++i) {
    const nc::Block& block = program.blocks[i];
    for (std::uint32_t k = 0; k < block.piece_count; ++k) {
      const nc::Piece& piece = program.pieces[block.first_piece + k];
      const bool computed = piece.kind == nc::PieceKind::assignment ||
                            (piece.kind == nc::PieceKind::word &&
                             piece.detail != static_cast<std::uint8_t>(nc::WordForm::number));
      if (!computed) continue;
      Diagnostic d;
      d.code = "NC302";
      d.where = {program.file_name, static_cast<int>(program.first_block + i + 1),
                 static_cast<int>(piece.begin - program.pieces[block.first_piece].begin + 1)};
      d.text =
          "a parameter or an expression in a program of joint words is not certified: its value "
          "depends on the controller. Write the number";
      diagnostics.push_back(std::move(d));
      break;
    }
  }
}

void note_lines_with_radius(const nc::Program& program, std::set<std::uint32_t>& lines) {
  for (std::size_t i = 0; i < program.blocks.size(); ++i) {
    const nc::Block& block = program.blocks[i];
    for (std::uint32_t k = 0; k < block.piece_count; ++k) {
      const nc::Piece& piece = program.pieces[block.first_piece + k];
      if (piece.kind == nc::PieceKind::word && piece.letter == 'R')
        lines.insert(static_cast<std::uint32_t>(program.first_block + i + 1));
    }
  }
}

// Exact path holds when the first path mode word stands before the first motion, is G61, and no
// other path mode follows.
struct ExactPath {
  bool began = false;
  bool broken = false;

  bool holds() const { return began && !broken; }
  void look_at(const nc::Program& program) {
    for (const auto& piece : program.pieces) {
      if (piece.kind != nc::PieceKind::word || piece.letter != 'G') continue;
      if (piece.value == 61.0) began = true;
      if (piece.value == 64.0 || piece.value == 61.1) broken = true;
      if (piece.value >= 0.0 && piece.value <= 3.0 && !began) broken = true;
    }
  }
};

}  // namespace

Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program) {
  return Emitter(machine, program).run();
}

Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name) {
  const bool guard = take_guard(text);
  Diagnostics computed;
  ExactPath exact_path;
  std::set<std::uint32_t> with_radius;
  std::optional<ReadBackSink> sink(std::in_place, machine, with_radius);
  nc::ProgramStream::Hooks hooks;
  hooks.restart = [&] { sink.emplace(machine, with_radius); };
  hooks.look = [&](const nc::Program& window) {
    if (window.first_block == 0) {
      computed.clear();
      with_radius.clear();
      exact_path = {};
    }
    note_computed_words(window, computed);
    note_lines_with_radius(window, with_radius);
    exact_path.look_at(window);
  };
  nc::ProgramStream program(std::move(text), file_name, nc::InputDialect::linuxcnc, hooks);
  nc::InterpreterSettings settings;
  settings.inch_default = machine.dialect.units == "inch";
  settings.has_tcp = false;
  settings.plain_blocks = true;
  settings.process = machine.process;
  settings.axes = 0;
  for (const auto& axis : machine.axes) {
    const auto w = kAxisLetters.find(axis.letter);
    settings.axes |= static_cast<AxisMask>(1U << w);
    settings.home[w] = axis.joint.home;
  }
  const auto summary = nc::interpret(program, settings, *sink);
  if (has_error(program.diagnostics())) return Result<ReadBack>::failure(program.diagnostics());
  if (!computed.empty()) return Result<ReadBack>::failure(std::move(computed));
  Diagnostics diagnostics = summary.diagnostics();
  for (auto& d : sink->diagnostics) {
    d.where.file = file_name;
    diagnostics.push_back(d);
  }
  if (has_error(diagnostics)) return Result<ReadBack>::failure(std::move(diagnostics));
  sink->result.offset_guard = guard;
  sink->result.exact_path = exact_path.holds();
  sink->result.line_count = static_cast<std::uint32_t>(program.program().block_count);
  return Result<ReadBack>(std::move(sink->result), std::move(diagnostics));
}

const Dialect kDialect = {"linuxcnc",
                          "LinuxCNC 2.9, joint words (trivkins), G93, exact path",
                          "all joints linear between blocks, exact path (G61): the controller "
                          "stops blending at block ends",
                          ToolTurn::none,
                          true,
                          &emit,
                          &read_back,
                          "every work, G92 and tool offset of the controller is zero: the program "
                          "aborts before its first motion otherwise",
                          false,
                          true};

}  // namespace smoothpost::linuxcnc
