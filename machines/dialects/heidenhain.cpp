#include "machines/dialects/heidenhain.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/units.h"
#include "machines/dialects/decimal.h"
#include "machines/dialects/program_printer.h"
#include "machines/dialects/program_reading.h"
#include "machines/dialects/tool_words.h"

namespace smoothpost::heidenhain {

namespace {

constexpr std::size_t kMaxComment = 120;
constexpr std::string_view kAxisLetters = "XYZABCUVW";
constexpr std::string_view kName = "SMOOTHPOST";
constexpr int kMostDigits = 4;  // of a coordinate
constexpr int kVectorDigits = 8;
constexpr int kGuardDigits = 5;
constexpr int kMostTools = 32767;
constexpr int kFeedDigits = 3;
constexpr double kLargestFeed = 99999.999;
constexpr double kTenthsOfInch = 10.0;  // F of a program in inch is in 0.1 inch/min

class Emitter : public ProgramPrinter {
 public:
  Emitter(const MachineDefinition& machine, const MachineProgram& program)
      : ProgramPrinter(machine, program),
        vectors_(machine.dialect.name == kVectorDialect.name),
        words_(machine, {false, true}),
        tool_words_(machine, program, words_),
        feed_unit_(machine.dialect.units == "inch" ? kTenthsOfInch : 1.0),
        tools_(gcode::tools_of(program, kMostTools)) {}

 private:
  enum class Mode { unknown, joints, tool };

  void check() override {
    const DialectSettings& d = machine().dialect;
    if (d.path_mode != "exact")
      refuse("PR203", "dialect " + d.name + " has no path_mode \"" + d.path_mode +
                          "\": what CYCL DEF 32 rounds off has no bound that is known for rotary "
                          "axes; write path_mode = \"exact\"");
    if (d.digits_length > kMostDigits || d.digits_angle > kMostDigits)
      refuse("PR203",
             "coordinates of this control have 4 decimals: set dialect.digits_mm (digits_inch) and "
             "dialect.digits_deg to at most 4, which are " +
                 std::to_string(d.digits_length) + " and " + std::to_string(d.digits_angle));
    for (const auto& axis : machine().axes)
      if (kAxisLetters.find(axis.letter) == std::string_view::npos)
        refuse("PR203", "axis " + axis.name + " has the letter " + std::string(1, axis.letter) +
                            ": this dialect has the axis words " + std::string(kAxisLetters));
    for (const auto& m : program().moves)
      if (is_tool(m) && m.joints != 0)
        return refuse("PR203",
                      "a redundant axis cannot be moved under TCPM: write dialect.mode = \"joint\"",
                      m.input_line);
  }

  // ---- lines

  void block(std::string_view words) { line(std::to_string(lines()) + " " + std::string(words)); }

  std::string frame(const char* head) const {
    return head + std::string(kName) + (machine().dialect.units == "inch" ? " INCH" : " MM");
  }

  void head() override {
    block(frame("BEGIN PGM "));
    if (!program().certified)
      comment("NOT CERTIFIED. Written with --force: read the report before you run it");
    for (const auto& title : program().title) comment(title);
    for (const gcode::ProgramTool& tool : tools_) {
      const std::string length = decimal_text(tool.length * words_.length_scale(), kGuardDigits);
      comment(&tool == tools_.data()
                  ? "The preset has to be the place of the part, the tool " + length + " long"
                  : "Tool " + std::to_string(tool.number) + " has to be " + length + " long");
    }
    for (const auto& own : machine().dialect.start) block(own);
    modal_words();
    if (has_poses() && machine().dialect.offset_guard) guard();
    if (!program().certified) block("STOP");
  }

  void modal_words() {
    block("FUNCTION RESET TCPM");
    block("M127");  // rotary axes go to the position that is written, not the nearer way round
    mode_ = Mode::unknown;
    words_.forget();
  }

  void foot() override {
    if (mode_ == Mode::tool) block("FUNCTION RESET TCPM");
    bool ended = false;
    for (const auto& own : machine().dialect.end) {
      block(own);
      const std::string packed = packed_statement(own);
      ended = ended || packed == "M30" || packed == "M2";
    }
    if (!ended) block("M30");
    block(frame("END PGM "));
  }

  void comment(const std::string& text) override { block("; " + plain_text(text, kMaxComment)); }

  void label(const std::string& text) override {
    block("* - " + plain_text(text, kMaxComment));
    modal_words();
  }

  void dwell(double seconds) override {
    block("CYCL DEF 9.0 DWELL TIME");
    block("CYCL DEF 9.1 DWELL " + decimal_text(seconds, 3));
  }

  void statement(const std::string& text, const MachineAction& action) override {
    const bool change = action.event.name == event_name::kToolChange;
    if (change && mode_ == Mode::tool) block("FUNCTION RESET TCPM");
    block(text);
    if (!change) return;
    mode_ = Mode::unknown;
    words_.forget();
  }

  // ---- guard

  static std::string minus(double value) {
    const std::string text = decimal_text(-value, kGuardDigits);
    return text.front() == '-' ? " - " + text.substr(1) : " + " + text;
  }

  // Position in the REF system minus that in the active one is what lies between them: the preset,
  // along Z the length of whichever tool is active, too. System data are in mm. The plan's tools
  // are looked up by their numbers: their TOOL CALLs come later.
  void guard() {
    int index = 0;
    for (const char letter : kAxisLetters) {
      ++index;
      if (machine().axis_by_letter(letter) < 0) continue;
      double wanted = 0.0;
      if (letter == 'X') wanted = program().part.translation().x();
      if (letter == 'Y') wanted = program().part.translation().y();
      if (letter == 'Z') wanted = program().part.translation().z();
      const std::string number = std::to_string(index);
      block("FN 18: SYSREAD Q50 = ID240 NR1 IDX" + number);
      block("FN 18: SYSREAD Q51 = ID270 NR1 IDX" + number);
      if (letter == 'Z') block("FN 18: SYSREAD Q53 = ID200 NR2 IDX3");
      block("Q52 = ABS ( Q50 - Q51" + std::string(letter == 'Z' ? " - Q53" : "") + minus(wanted) +
            " )");
      block("FN 11: IF +Q52 GT +0.0005 GOTO LBL 91");
    }
    for (const gcode::ProgramTool& tool : tools_) {
      block("FN 18: SYSREAD Q50 = ID200 NR6 IDX" + std::to_string(tool.number));
      block("Q52 = ABS ( Q50" + minus(tool.length) + " )");
      block("FN 11: IF +Q52 GT +0.0005 GOTO LBL 91");
    }
    block("FN 18: SYSREAD Q53 = ID210 NR6");
    block("FN 10: IF +Q53 NE +0 GOTO LBL 91");
    block("FN 9: IF +0 EQU +0 GOTO LBL 92");
    block("LBL 91");
    comment("smoothpost: preset or tool length are not those of this program");
    block("STOP");
    block("FN 9: IF +0 EQU +0 GOTO LBL 91");
    block("LBL 92");
  }

  // ---- moves

  void print_move(std::size_t i) override {
    const MachineMove& m = move(i);
    const Mode mode = is_tool(m) ? Mode::tool : Mode::joints;
    if (mode != mode_) {
      words_.forget();
      if (mode == Mode::tool)
        block("FUNCTION TCPM F TCP AXIS POS PATHCTRL VECTOR");
      else if (mode_ == Mode::tool)
        block("FUNCTION RESET TCPM");
      mode_ = mode;
    }
    mode == Mode::tool ? print_tool(m) : print_joints(m);
  }

  void print_tool(const MachineMove& m) {
    const auto printed = vectors_ ? tool_words_.vector(m, {"TX", "TY", "TZ"}, kVectorDigits)
                                  : tool_words_.positions(m);
    block((vectors_ ? "LN" : "L") + printed.text + (vectors_ ? "" : " R0") + feed(m, printed.way));
  }

  void print_joints(const MachineMove& m) {
    const double way = joint_way(m);
    block("L" + words_.joints(m.joints, m.to) + " R0" + feed(m, way) + " M91");
    tool_words_.stand(m);
    last_ = m.to;
  }

  // What F is over, in the program's unit: the way of the linear axes, or the turn of the rotary
  // ones when no linear axis moves.
  double joint_way(const MachineMove& m) const {
    double linear = 0.0, rotary = 0.0;
    if (last_.size() == 0) return 0.0;
    for (int j = 0; j < machine().size(); ++j) {
      if (!(m.joints >> j & 1U)) continue;
      const auto& axis = machine().axes[static_cast<std::size_t>(j)];
      if (axis.joint.kind == JointKind::rotary)
        rotary += std::pow(degrees_from_radians(m.to[j] - last_[j]), 2);
      else
        linear +=
            std::pow(tool_words_.printed_length(m.to[j]) - tool_words_.printed_length(last_[j]), 2);
    }
    return linear > 0.0 ? std::sqrt(linear) * words_.length_scale() : std::sqrt(rotary);
  }

  std::string feed(const MachineMove& m, double way) {
    if (m.rapid) return " FMAX";
    const double least = std::pow(10.0, -kFeedDigits);
    const double f = std::max(way / m.duration * kSecondsPerMinute * feed_unit_, least);
    if (f > kLargestFeed)
      refuse("PR203",
             "a feed of " + decimal_text(f, 0) + " is faster than this control can be told",
             m.input_line);
    return " F" + decimal_text(std::min(f, kLargestFeed), kFeedDigits);
  }

  const bool vectors_;
  gcode::AxisWords words_;
  gcode::ToolWords tool_words_;
  double feed_unit_ = 1.0;
  std::vector<gcode::ProgramTool> tools_;
  Mode mode_ = Mode::unknown;
  JointVector last_;
};

}  // namespace

Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program) {
  if (gcode::is_turned(program)) return Emitter(machine, gcode::along_machine_axes(program)).run();
  return Emitter(machine, program).run();
}

namespace {
constexpr const char* kGuardText =
    "tool moves: the preset, its tilt and the tool length that are live in the control are those "
    "of the program, it stops before its first motion otherwise; other moves refer to the machine "
    "datum (M91)";
constexpr const char* kInterpolation =
    "TCPM with PATHCTRL VECTOR: tip linear, tool axis in the plane of its two ends; L with M91: "
    "all axes linear; no tolerance cycle, so blocks end where they are written";
}  // namespace

const Dialect kDialect = {
    "heidenhain",   "HEIDENHAIN TNC, L with M91, or TCPM with positions of the rotary axes",
    kInterpolation, ToolTurn::great_circle,
    true,           &emit,
    &read_back,     kGuardText};

const Dialect kVectorDialect = {"heidenhain_vectors",
                                "HEIDENHAIN TNC, L with M91, or TCPM with LN and tool vectors",
                                kInterpolation,
                                ToolTurn::great_circle,
                                true,
                                &emit,
                                &read_back,
                                kGuardText};

}  // namespace smoothpost::heidenhain
