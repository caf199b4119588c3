#include "machines/dialects/fanuc_30i.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "kernels/core/units.h"
#include "kernels/spline/bent_move.h"
#include "machines/dialects/decimal.h"
#include "machines/dialects/gcode_program.h"
#include "machines/dialects/tool_words.h"

namespace smoothpost::fanuc_30i {

namespace {

constexpr std::string_view kAxisLetters = "XYZABCUVW";
constexpr std::string_view kTipLetters = "XYZ";
constexpr int kVectorDigits = 8;
constexpr int kGuardDigits = 5;
constexpr int kMostTools = 400;                     // of offset memory C
constexpr double kShortestBlock = 60.0 / 9999.999;  // s: F of G93 has four digits before the point

class Emitter : public gcode::GcodePrinter {
 public:
  Emitter(const MachineDefinition& machine, const MachineProgram& program)
      : GcodePrinter(machine, program, {true, false}, {1, 99999}),
        vectors_(machine.dialect.name == kVectorDialect.name),
        tool_words_(machine, program, words()) {
    // As the guard will say it: joint words and guard make one position.
    if (has_poses())
      shift_ = program.part.translation().unaryExpr([this](double v) {
        const double scale = words().length_scale();
        return rounded_decimal(v * scale, kGuardDigits) / scale;
      });
    for (int j = 0; j < machine.size(); ++j) {
      const char letter = machine.axes[static_cast<std::size_t>(j)].letter;
      if (kTipLetters.find(letter) != std::string_view::npos) tip_joints_ |= JointMask{1} << j;
    }
    tools_ = gcode::tools_of(program, kMostTools);
  }

 private:
  enum class Mode { unknown, joints, tool };

  // ---- what cannot be printed

  void check() override {
    if (machine().dialect.path_mode != "exact")
      refuse("PR203", "dialect " + machine().dialect.name + " has no path_mode \"" +
                          machine().dialect.path_mode +
                          "\": what G64 and smoothing round off has no bound that is known; write "
                          "path_mode = \"exact\"");
    for (const auto& axis : machine().axes)
      if (kAxisLetters.find(axis.letter) == std::string_view::npos)
        refuse("PR203", "axis " + axis.name + " has the letter " + std::string(1, axis.letter) +
                            ": this dialect has the axis words " + std::string(kAxisLetters));
    if (has_arcs() && has_poses())
      refuse("PR203", "arcs stand in programs of joint words only: write dialect.mode = \"joint\"");
    for (const auto& m : program().moves) check_move(m);
  }

  void check_move(const MachineMove& m) {
    constexpr std::size_t kMost = 10;
    if (diagnostics().size() >= kMost) return;
    if (is_tool(m) && m.joints != 0)
      refuse("PR203",
             "a redundant axis cannot be moved under tool centre point control: write "
             "dialect.mode = \"joint\"",
             m.input_line);
  }

  // ---- head and foot

  void head() override {
    line("%");
    std::size_t own = 0;
    const auto& start = machine().dialect.start;
    const bool named =
        !start.empty() && !start[0].empty() && (start[0][0] == 'O' || start[0][0] == '<');
    line(named ? start[own++] : std::string("O1000"));
    if (!program().certified)
      comment("NOT CERTIFIED. Written with --force: read the report before you run it");
    for (const auto& title : program().title) comment(title);
    for (const gcode::ProgramTool& tool : tools_)
      comment("H" + std::to_string(tool.number) + " has to hold tool length " +
              guard_number(tool.length) +
              (&tool == tools_.data() ? ", G54 the place of the part" : ""));
    for (; own < start.size(); ++own) own_line(start[own]);
    modal_words();
    if (machine().dialect.offset_guard) guard();
    if (!program().certified) block("M0");
  }

  void modal_words() {
    block(std::string(is_inch() ? "G20" : "G21") + " G17 G90 G94 G40 G49 G80 G69 G54 G61");
    block("G05.1 Q1");
    mode_ = Mode::unknown;
    inverse_time_ = false;
    words().forget();
  }

  void foot() override {
    leave_plane();
    if (mode_ == Mode::tool) block("G49");
    if (inverse_time_) block("G94");
    block("G05.1 Q0");
    bool ended = false;
    for (const auto& own : machine().dialect.end) {
      own_line(own);
      const std::string packed = packed_statement(own);
      ended = ended || packed == "M30" || packed == "M2" || packed == "M02";
    }
    if (!ended) block("M30");
    line("%");
  }

  // Comments in capitals: older displays have no others.
  void comment(const std::string& text) override {
    std::string capitals = text;
    for (char& c : capitals) {
      if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 32);
      if (c == '%') c = ' ';
      if (c == ';') c = ',';  // ends a block
    }
    GcodePrinter::comment(capitals);
  }

  // ---- guard

  std::string guard_number(double mm) const {
    return decimal_text(mm * words().length_scale(), kGuardDigits);
  }

  // Machine minus work coordinate of control axis n, which is the offset in force.
  static std::string offset_of(int n) {
    return "#" + std::to_string(5020 + n) + "-#" + std::to_string(5040 + n);
  }

  void guard_line(const std::string& value, int alarm, const std::string& text) {
    block("IF [" + value + " GT " + (is_inch() ? "0.00002" : "0.0005") +
          "] THEN #3000=" + std::to_string(alarm) + "(" + text + ")");
  }

  void guard_zero(int first) {
    std::string sum;
    for (int n = first; n <= machine().size(); ++n)
      sum += (sum.empty() ? "ABS[" : "+ABS[") + offset_of(n) + "]";
    if (!sum.empty()) guard_line("[" + sum + "]", 1, "AN OFFSET IS ACTIVE");
  }

  void guard() {
    if (!has_poses()) return guard_zero(1);
    for (int k = 0; k < 3; ++k) {
      std::string value = guard_number(-shift_[k]);
      if (value.front() != '-') value.insert(0, 1, '+');
      guard_line("ABS[" + offset_of(k + 1) + value + "]", 1, "G54 IS NOT THE PLACE OF THE PART");
    }
    guard_zero(4);
    for (const gcode::ProgramTool& tool : tools_) {
      std::string value = guard_number(-tool.length);
      if (value.front() != '-') value.insert(0, 1, '+');
      guard_line("ABS[#" + std::to_string(11000 + tool.number) + "+#" +
                     std::to_string(10000 + tool.number) + value + "]",
                 2, "H" + std::to_string(tool.number) + " IS NOT THE LENGTH OF THE TOOL");
    }
  }

  // ---- actions

  void dwell(double seconds) override { block("G4 X" + words().number(seconds, 3)); }

  void label(const std::string& text) override {
    leave_plane();
    if (mode_ == Mode::tool) block("G49");
    comment(text);
    modal_words();
  }

  void statement(const std::string& text, const MachineAction& action) override {
    leave_plane();
    const bool change = action.event.name == event_name::kToolChange;
    if (change && mode_ == Mode::tool) block("G49");
    block(text);
    if (!change) return;
    offset_ = gcode::tool_number(action, kMostTools).value_or(offset_);
    mode_ = Mode::unknown;
    words().forget();
  }

  // ---- moves

  void set_time_mode(bool inverse) {
    if (inverse == inverse_time_) return;
    block(inverse ? "G93" : "G94");
    inverse_time_ = inverse;
  }

  void print_move(std::size_t i) override {
    is_tool(move(i)) ? print_tool(move(i)) : print_joints(i);
  }

  void print_joints(std::size_t i) {
    const MachineMove& m = move(i);
    // The first block behind G49 takes the tool's length out of every linear axis.
    const bool leaves = mode_ == Mode::tool;
    const bool machine_words = m.rapid && (has_poses() || m.machine_coordinates);
    if (leaves || machine_words) words().forget();
    set_time_mode(!m.rapid);
    std::string text = leaves ? "G49 " : "";
    const ArcCode arc = m.arc.turn != 0 ? arc_code(m, move(i - 1).to) : ArcCode{"G1", ""};
    text += machine_words ? "G53 G0" : m.rapid ? "G0" : arc.code;
    text += words().joints(leaves ? m.joints | tip_joints_ : m.joints, m.to,
                           machine_words ? Vec3(Vec3::Zero()) : shift_);
    if (machine_words) words().forget();
    text += arc.centre;
    if (!m.rapid) text += inverse_time(std::max(time_of_feed(i), kShortestBlock));
    block(text);
    mode_ = Mode::joints;
    tool_words_.stand(m);
  }

  // s: F of an arc is the speed over its radius, so one over the time of one radian.
  double time_of_feed(std::size_t i) const {
    const MachineMove& m = move(i);
    if (m.arc.turn == 0) return m.duration;
    const JointBend none;
    return m.duration / std::abs(arc_shape({move(i - 1).to, m.to, none, m.arc}).sweep);
  }

  void print_tool(const MachineMove& m) {
    set_time_mode(false);
    if (mode_ != Mode::tool) {
      block(std::string(vectors_ ? "G43.5" : "G43.4") + " H" + std::to_string(offset_) + " P1");
      words().forget();
      mode_ = Mode::tool;
    }
    const auto printed =
        vectors_ ? tool_words_.vector(m, {"I", "J", "K"}, kVectorDigits) : tool_words_.positions(m);
    block((m.rapid ? "G0" : "G1") + printed.text + (m.rapid ? "" : feed(printed.way / m.duration)));
  }

  // G94: the tip's speed, and that of the rotary axes where the tip stands.
  std::string feed(double per_second) const {
    constexpr double kLeast = 1e-4;
    const double f = std::max(per_second * kSecondsPerMinute, kLeast);
    return " F" + words().number(f, decimals_for(f, 6, 0, 4));
  }

  const bool vectors_;
  gcode::ToolWords tool_words_;
  Vec3 shift_ = Vec3::Zero();  // of G54
  JointMask tip_joints_ = 0;
  std::vector<gcode::ProgramTool> tools_;
  int offset_ = 1;  // H has the number of the tool
  Mode mode_ = Mode::unknown;
  bool inverse_time_ = false;
};

}  // namespace

Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program) {
  if (gcode::is_turned(program)) return Emitter(machine, gcode::along_machine_axes(program)).run();
  return Emitter(machine, program).run();
}

namespace {
constexpr const char* kGuardText =
    "the offsets and the tool length that are live in the control are those that the program "
    "names: it raises an alarm before its first motion otherwise";
constexpr const char* kInterpolation =
    "tool centre point control with tool posture control: tip linear, tool axis in the plane of "
    "its two ends; joint words: all axes linear; exact stop (G61) at block ends";
}  // namespace

const Dialect kDialect = {
    "fanuc_30i",    "FANUC 30i/31i, joint words in G93, or G43.4 P1 with rotary positions, G61",
    kInterpolation, ToolTurn::great_circle,
    true,           &emit,
    &read_back,     kGuardText,
    false,          true};

const Dialect kVectorDialect = {
    "fanuc_30i_vectors",
    "FANUC 30i/31i, joint words in G93, or G43.5 P1 with tool vectors, G61",
    kInterpolation,
    ToolTurn::great_circle,
    true,
    &emit,
    &read_back,
    kGuardText,
    false,
    true};

}  // namespace smoothpost::fanuc_30i
