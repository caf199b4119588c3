#include "machines/dialects/rapid.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "kernels/core/units.h"
#include "kernels/kinematics/screw_chain.h"
#include "machines/dialects/decimal.h"
#include "machines/dialects/event_text.h"
#include "machines/dialects/rapid_items.h"
#include "machines/dialects/rapid_text.h"
#include "machines/dialects/tool_frame.h"

namespace smoothpost::rapid {

namespace {

constexpr std::size_t kMaxComment = 120;
constexpr std::uint32_t kMostLines = 5000;
constexpr std::uint32_t kProcedureLines = 1000;
constexpr int kMostProcedures = 500;
constexpr int kTargetQuaternion = 8;  // decimals
constexpr int kFrameQuaternion = 9;
constexpr int kTimeDecimals = 6;
constexpr double kLinkSpeed = 250.0;       // mm/s, of links whose tip goes straight
constexpr double kLeastOrientation = 500;  // deg/s
constexpr double kLeastLinear = 5000.0;    // mm/s, external axes
constexpr double kLeastRotary = 1000.0;    // deg/s, external axes
constexpr double kLeastSpeed = 0.01;       // mm/s: a slower move is printed with its time
constexpr double kLargestSpeed = 5000.0;   // mm/s of VelSet, unless a move is faster
constexpr double kNoLength = 1e-6;         // mm: a move that only turns
constexpr double kMargin = 1.05;

class Emitter {
 public:
  Emitter(const MachineDefinition& machine, const MachineProgram& program)
      : machine_(machine),
        program_(program),
        axes_(robot_axes(machine)),
        configuration_(machine),
        chain_(chain_of(machine, program.tool_length)) {
    chain_.workpiece_home = program.part;
    body_.reserve(160 * program.moves.size() + 4096);
  }

  Result<EmittedProgram> run() {
    check_machine();
    if (has_error(diagnostics_)) return Result<EmittedProgram>::failure(std::move(diagnostics_));
    find_limits();
    items_ = items_of(machine_, program_, diagnostics_);
    body();
    modes();
    finish();
    if (has_error(diagnostics_)) return Result<EmittedProgram>::failure(std::move(diagnostics_));
    return Result<EmittedProgram>(std::move(out_), std::move(diagnostics_));
  }

 private:
  Diagnostic& tell(const char* code, std::string text, Severity severity = Severity::error) {
    Diagnostic d;
    d.code = code;
    d.text = std::move(text);
    d.severity = severity;
    diagnostics_.push_back(std::move(d));
    return diagnostics_.back();
  }

  static bool is_tool(const MachineMove& move) {
    return move.interpolation == MoveInterpolation::tool;
  }

  // ---- what cannot be printed

  void check_machine() {
    for (const auto& name : axes_.unnamed)
      tell("PR202", "axis " + name + " of machine " + machine_.name +
                        " has no place in RAPID: the arm's axes are A1 to A6, the others E1 to E6");
    if (axes_.unnamed.empty() && !axes_.has_arm())
      tell("PR202", "machine " + machine_.name + " has not all of the axes A1 to A6 of an arm");
    const bool part_moves =
        std::any_of(machine_.axes.begin(), machine_.axes.end(),
                    [](const AxisDefinition& a) { return a.joint.side == ChainSide::workpiece; });
    if (part_moves && std::any_of(program_.moves.begin(), program_.moves.end(), is_tool))
      tell("PR203", "machine " + machine_.name +
                        " moves the part by an axis: MoveL in a moving work object is not written "
                        "by this version");
    if (machine_.dialect.path_mode == "spline")
      tell("PR203",
           "dialect rapid has no path_mode \"spline\": write path_mode = \"exact\" or \"blend\"");
    if (!machine_.tool.load)
      tell("PR221", "machine " + machine_.name +
                        " says no load, and tooldata needs one: add [tool.load] with mass_kg, "
                        "centre_mm and inertia_kg_m2 (there is no default)");
    check_joint_moves();
  }

  // MoveAbsJ states every axis: those that the move does not name have to have a position.
  void check_joint_moves() {
    const JointMask all = (1U << machine_.size()) - 1U;
    if (program_.moves.empty()) return;
    const MachineMove& first = program_.moves.front();
    if (!is_tool(first) && (first.joints & all) == all) return;
    tell("PR203", "the first motion has to be one in joints that names every axis").where.line =
        static_cast<int>(first.input_line);
  }

  // ---- limits of the speed data: above what any move along a line needs, so that the tip decides

  Pose pose_after(const MachineMove& move) const {
    return is_tool(move) ? move.tool : forward(chain_, move.to);
  }

  static double turn(const Pose& from, const Pose& to) {
    return degrees_from_radians(rotation_log(from.linear().transpose() * to.linear()).norm());
  }

  void find_limits() {
    orientation_limit_ = kLeastOrientation;
    linear_limit_ = kLeastLinear;
    rotary_limit_ = kLeastRotary;
    largest_speed_ = kLargestSpeed;
    for (std::size_t i = 1; i < program_.moves.size(); ++i) {
      const MachineMove& move = program_.moves[i];
      if (!is_tool(move) || move.duration <= 0.0) continue;
      const Pose from = pose_after(program_.moves[i - 1]);
      const double length = (move.tool.translation() - from.translation()).norm();
      orientation_limit_ =
          std::max(orientation_limit_, kMargin * turn(from, move.tool) / move.duration);
      largest_speed_ = std::max(largest_speed_, kMargin * length / move.duration);
      for (const int j : axes_.external)
        if (j >= 0) see_external(j, (move.to[j] - program_.moves[i - 1].to[j]) / move.duration);
    }
    for (double* limit : {&orientation_limit_, &linear_limit_, &rotary_limit_, &largest_speed_})
      *limit = std::ceil(*limit);
  }

  void see_external(int j, double speed) {
    const bool rotary = machine_.axes[static_cast<std::size_t>(j)].joint.kind == JointKind::rotary;
    double& limit = rotary ? rotary_limit_ : linear_limit_;
    const double value = std::abs(rotary ? degrees_from_radians(speed) : speed);
    limit = std::max(limit, kMargin * value);
  }

  // ---- procedures

  void put(std::string_view line) {
    body_ += line;
    body_ += '\n';
    ++line_;
  }

  static std::string statement(std::string text) {
    while (!text.empty() && (text.back() == ';' || text.back() == ' ')) text.pop_back();
    return "    " + text + ";";
  }

  void body() {
    begin_procedure("main");
    for (const auto& line : machine_.dialect.start) put("    " + line);
    put("    spModes;");
    if (!program_.certified) {
      put("    TPWrite \"NOT CERTIFIED: read the report\";");
      put("    Stop;");
    }
    for (std::size_t i = 0; i < items_.size(); ++i) {
      const auto triggers = print_items(i);
      if (i < program_.moves.size()) print_move(i, triggers);
    }
    for (const auto& line : machine_.dialect.end) put("    " + line);
    put("  ENDPROC");
  }

  void begin_procedure(const std::string& name) {
    put("  PROC " + name + "()");
    procedure_line_ = line_;
    labels_.clear();
  }

  // Modes and triggers that motions rely on; called again at each label.
  void modes() {
    begin_procedure("spModes");
    for (const char* line :
         {"ConfL\\Off;", "ConfJ\\Off;", "SingArea\\Off;", "PDispOff;", "EOffsOff;"})
      put("    " + std::string(line));
    put("    VelSet 100, " + decimal(largest_speed_, 0) + ";");
    for (const auto& [name, text] : triggers_.all()) put("    TriggIO " + name + text);
    put("  ENDPROC");
  }

  // Returns the names of the triggers that the next motion sets.
  std::vector<std::string> print_items(std::size_t i) {
    std::vector<std::string> triggers;
    for (const auto& item : items_[i]) {
      switch (item.kind) {
        case Item::Kind::comment:
          put("    ! " + plain_text(item.text, kMaxComment));
          break;
        case Item::Kind::statement:
          put(statement(item.text));
          break;
        case Item::Kind::wait:
          put("    WaitTime\\InPos, " + decimal(item.seconds, 4) + ";");
          break;
        case Item::Kind::label:
          print_label(item.text);
          break;
        case Item::Kind::trigger:
          triggers.push_back(triggers_.name_of(", 0\\Start\\" + item.signal.option + ":=" +
                                               item.signal.name + ", " + item.signal.value + ";"));
          break;
      }
    }
    return triggers;
  }

  // A long procedure goes on in another one, which it calls at its end: a start at a label runs on
  // to the last.
  void print_label(const std::string& cut) {
    if (line_ - procedure_line_ > kProcedureLines && procedures_ < kMostProcedures) {
      const std::string name = "spPart" + std::to_string(++procedures_ + 1);
      put("    " + name + ";");
      put("  ENDPROC");
      begin_procedure(name);
    }
    put("    ! " + plain_text(cut, kMaxComment));
    put("  " + label_of(cut) + ":");
    put("    spModes;");
  }

  // cut_7 of "CUT 7 from ...", once in a procedure.
  std::string label_of(const std::string& cut) {
    const auto begin = std::min(cut.find_first_of("0123456789"), cut.size());
    const auto end = std::min(cut.find_first_not_of("0123456789", begin), cut.size());
    std::string label = "cut_" + cut.substr(begin, std::min<std::size_t>(end - begin, 9));
    const std::string stem = label;
    for (int n = 2; !labels_.insert(label).second; ++n) label = stem + "_" + std::to_string(n);
    return label;
  }

  // ---- motions

  void print_move(std::size_t i, const std::vector<std::string>& triggers) {
    const MachineMove& move = program_.moves[i];
    std::string text;
    if (is_tool(move)) {
      text = triggers.empty() ? "    MoveL " : "    TriggL ";
      text += "[" + pose_text(move.tool, machine_.dialect.digits_length, kTargetQuaternion) + "," +
              configuration_.text(move.to) + "," + external_text(machine_, axes_, move.to) + "], " +
              line_speed(move);
      for (std::size_t k = 0; k < triggers.size(); ++k)
        text += (k == 0 ? ", " : "\\T" + std::to_string(k + 1) + ":=") + triggers[k];
    } else {
      text = "    MoveAbsJ [" + arm_text(machine_, axes_, move.to) + "," +
             external_text(machine_, axes_, move.to) + "]\\NoEOffs, " + joint_speed(move);
    }
    put(text + ", " + zone(i) + ", spTool\\WObj:=spPart;");
    out_.move_lines.push_back(line_);
    last_pose_ = pose_after(move);
    last_place_ = is_tool(move) ? printed(move.tool) : Vec3(last_pose_.translation());
    started_ = true;
  }

  Vec3 printed(const Pose& pose) const {
    const int digits = machine_.dialect.digits_length;
    return pose.translation().unaryExpr([digits](double v) { return rounded_decimal(v, digits); });
  }

  std::string speed_data(double tip, double orientation) {
    return "[" + decimal(tip, 9) + "," + decimal(orientation, 9) + "," + decimal(linear_limit_, 0) +
           "," + decimal(rotary_limit_, 0) + "]";
  }

  std::string line_speed(const MachineMove& move) {
    if (move.rapid || move.duration <= 0.0 || !started_) return "spLink";
    const double length = (printed(move.tool) - last_place_).norm();
    const double speed = printed_speed(length / move.duration);
    if (length >= kNoLength && speed >= kLeastSpeed)
      return speeds_.name_of(speed_data(speed, orientation_limit_));
    const double turning = printed_speed(turn(last_pose_, move.tool) / move.duration);
    if (length < kNoLength && turning >= kLeastSpeed)
      return speeds_.name_of(speed_data(kLinkSpeed, turning));
    return "spLink\\T:=" + time_text(move.duration);
  }

  static std::string time_text(double seconds) {
    const double least = std::pow(10.0, -kTimeDecimals);
    return decimal(std::max(seconds, least), kTimeDecimals);
  }

  std::string joint_speed(const MachineMove& move) const {
    if (!started_) return "spFirst";
    if (move.rapid || move.duration <= 0.0) return "spJoint";
    return "spJoint\\T:=" + time_text(move.duration);
  }

  bool has_length(std::size_t i) const {
    const Pose from = pose_after(program_.moves[i - 1]);
    return (printed(program_.moves[i].tool) - printed(from)).norm() >= kNoLength;
  }

  // A corner is rounded between two straight ways only.
  std::string zone(std::size_t i) {
    const auto& moves = program_.moves;
    const double radius = blend_radius(moves[i].blend);
    if (radius <= 0.0 || i == 0 || i + 1 == moves.size() || has_stop(items_[i + 1])) return "fine";
    if (!is_tool(moves[i]) || !is_tool(moves[i + 1])) return "fine";
    if (!has_length(i) || !has_length(i + 1)) return "fine";
    const std::string r = decimal(radius, 5);
    const std::string turn = decimal(
        degrees_from_radians(machine_.tolerance.axis * machine_.tolerance.budget.controller), 5);
    std::string text = "[FALSE";
    for (const auto& value : {r, r, r, turn, r, turn}) text += "," + value;
    return zones_.name_of(text + "]");
  }

  // ---- the module around them

  static void put_data(std::string& text, const std::string& kind, const std::string& name,
                       const std::string& value) {
    text += "  " + kind + " " + name + ":=" + value + ";\n";
  }

  std::string head() {
    std::string text = "MODULE smoothpost\n";
    if (!program_.certified)
      text += "  ! NOT CERTIFIED. Written with --force: read the report before you run it\n";
    for (const auto& line : program_.title) text += "  ! " + plain_text(line, kMaxComment) + "\n";
    text += "  ! mm, mm/s, deg, s; quaternions w first\n";
    const int digits = machine_.dialect.digits_length;
    put_data(text, "PERS tooldata", "spTool",
             "[TRUE,[" +
                 pose_text(tool_frame(machine_, program_.tool_length), digits, kFrameQuaternion) +
                 "]," + load_text() + "]");
    put_data(text, "PERS wobjdata", "spPart",
             "[FALSE,TRUE,\"\",[" + pose_text(program_.part, digits, kFrameQuaternion) +
                 "],[[0,0,0],[1,0,0,0]]]");
    put_data(text, "CONST speeddata", "spFirst", "[100,30,100,30]");
    put_data(text, "CONST speeddata", "spJoint", speed_data(1000.0, kLeastOrientation));
    put_data(text, "CONST speeddata", "spLink", speed_data(kLinkSpeed, orientation_limit_));
    for (const auto& [name, value] : speeds_.all()) put_data(text, "CONST speeddata", name, value);
    for (const auto& [name, value] : zones_.all()) put_data(text, "CONST zonedata", name, value);
    for (const auto& trigger : triggers_.all()) text += "  VAR triggdata " + trigger.first + ";\n";
    return text;
  }

  std::string load_text() const {
    constexpr int kDecimals = 6;
    const LoadData& load = *machine_.tool.load;
    std::string text = "[" + decimal(std::max(load.mass, 1e-3), kDecimals) + ",[";
    for (int i = 0; i < 3; ++i) text += (i > 0 ? "," : "") + decimal(load.centre[i], kDecimals);
    text += "],[1,0,0,0]";
    for (int i = 0; i < 3; ++i) text += "," + decimal(load.inertia[i], kDecimals);
    return text + "]";
  }

  void finish() {
    out_.text = head();
    const auto above =
        static_cast<std::uint32_t>(std::count(out_.text.begin(), out_.text.end(), '\n'));
    for (auto& line : out_.move_lines) line += above;
    out_.text += body_;
    out_.text += "ENDMODULE\n";
    out_.line_count = above + line_ + 1;
    if (out_.line_count > kMostLines)
      tell("PR223",
           "the module has " + std::to_string(out_.line_count) +
               " lines; controllers are known to "
               "take " +
               std::to_string(kMostLines) +
               " in one module. Write it in parts with --cuts, or load it with care",
           Severity::warning);
  }

  const MachineDefinition& machine_;
  const MachineProgram& program_;
  RobotAxes axes_;
  ArmConfiguration configuration_;
  ScrewChain chain_;
  double orientation_limit_ = 0.0;
  double linear_limit_ = 0.0;
  double rotary_limit_ = 0.0;
  double largest_speed_ = 0.0;
  std::vector<std::vector<Item>> items_;  // in front of each move, and behind the last
  NamedTexts speeds_{"spV"};
  NamedTexts zones_{"spZ"};
  NamedTexts triggers_{"spT"};
  std::string body_;
  std::uint32_t line_ = 0;
  std::uint32_t procedure_line_ = 0;
  int procedures_ = 0;
  std::set<std::string> labels_;  // of the procedure
  bool started_ = false;
  Pose last_pose_ = Pose::Identity();
  Vec3 last_place_ = Vec3::Zero();  // its tip, as printed
  EmittedProgram out_;
  Diagnostics diagnostics_;
};

}  // namespace

Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program) {
  return Emitter(machine, program).run();
}

const Dialect kDialect = {
    "rapid",
    "ABB RAPID (RobotWare 6 and 7), MoveL in the part's frame and MoveAbsJ, fine or zones",
    "MoveL: tip linear, rotation about one fixed axis in proportion; a zone leaves that way within "
    "its radius of the corner only; MoveAbsJ: all axes together, path between its ends not "
    "certified: only the box of joint positions",
    ToolTurn::slerp,
    false,
    &emit,
    &read_back,
    "tooldata and wobjdata are those of the program itself, and program displacement and offsets "
    "of external axes are turned off by it (PDispOff, EOffsOff, VelSet)"};

}  // namespace smoothpost::rapid
