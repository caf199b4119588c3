#include "machines/dialects/fanuc_ls.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/units.h"
#include "machines/dialects/decimal.h"
#include "machines/dialects/robot_program.h"
#include "machines/dialects/zyx_angles.h"

namespace smoothpost::fanuc_ls {

namespace {

constexpr std::size_t kMaxRemark = 32;
constexpr std::size_t kMaxComment = 120;
constexpr std::uint32_t kMostLines = 9999;
constexpr int kLeastAngleDigits = 5;
constexpr double kLargestMilliseconds = 32000.0;
constexpr double kLeastSpeed = 1.0;   // mm/s or deg/s that are printed with one decimal
constexpr double kLinkSpeed = 250.0;  // mm/s
constexpr double kLeastRadius = 1.0;  // mm
constexpr double kNoise = 1e-9;

class Emitter : public robot::RobotPrinter {
 public:
  Emitter(const MachineDefinition& machine, const MachineProgram& program)
      : RobotPrinter(machine, program, "TP programs", kLeastRadius), configuration_(machine) {
    positions_.reserve(192 * program.moves.size());
  }

 private:
  // ---- head and foot

  void head() override {
    for (const char* text :
         {"/PROG  SMOOTHPOST", "/ATTR", "OWNER\t\t= MNEDITOR;",
          program().certified ? kComment : kWarning, "PROG_SIZE\t= 0;", "FILE_NAME\t= ;",
          "VERSION\t\t= 0;", kLineCount, "MEMORY_SIZE\t= 0;", "PROTECT\t\t= READ_WRITE;",
          "TCD:  STACK_SIZE\t= 0,", "      TASK_PRIORITY\t= 50,", "      TIME_SLICE\t= 0,",
          "      BUSY_LAMP_OFF\t= 0,", "      ABORT_REQUEST\t= 0,", "      PAUSE_REQUEST\t= 0;",
          "DEFAULT_GROUP\t= 1,*,*,*,*;", "CONTROL_CODE\t= 00000000 00000000;", "/MN"})
      line(text);
    if (!program().certified) {
      comment("NOT CERTIFIED: --force");
      instruction("PAUSE");
    }
    for (const auto& title : program().title) comment(title);
    for (const auto& own : machine().dialect.start) instruction(own);
    instruction("R[91]=" + decimal_text(kLinkSpeed, 0));
    frame(91, program().part);
    frame(92, tool());
    instruction("UFRAME[9]=PR[91]");
    instruction("UTOOL[9]=PR[92]");
    select_frames();
  }

  // A register holds a Cartesian position once it was given one.
  void frame(int number, const Pose& pose) {
    const std::string name = "PR[" + std::to_string(number);
    instruction(name + "]=LPOS");
    const ZyxAngles angles = zyx_angles(pose.linear());
    const std::array<double, 3> turn = {angles.x, angles.y, angles.z};
    for (int k = 0; k < 6; ++k) {
      const double value = k < 3 ? pose.translation()[k]
                                 : degrees_from_radians(turn[static_cast<std::size_t>(k - 3)]);
      std::string text =
          decimal_text(value, k < 3 ? machine().dialect.digits_length : angle_digits());
      if (text.front() == '-') text = "(" + text + ")";
      instruction(name + "," + std::to_string(k + 1) + "]=" + text);
    }
  }

  void select_frames() {
    instruction("UFRAME_NUM=9");
    instruction("UTOOL_NUM=9");
  }

  void foot() override {
    for (const auto& own : machine().dialect.end) instruction(own);
    const auto at = text().find(kLineCount);
    text().replace(at, std::string(kLineCount).size(),
                   "LINE_COUNT\t= " + std::to_string(number_) + ";");
    line("/POS");
    for (std::size_t begin = 0; begin < positions_.size();) {
      const auto end = positions_.find('\n', begin);
      line(std::string_view(positions_).substr(begin, end - begin));
      begin = end + 1;
    }
    line("/END");
    if (number_ > kMostLines)
      warn("PR223", 0,
           "the program has " + std::to_string(number_) + " lines; a TP program has at most " +
               std::to_string(kMostLines) + ". Write it in parts with --cuts");
  }

  // ---- lines of /MN

  void numbered(const std::string& text) {
    const std::string number = std::to_string(++number_);
    line(std::string(number.size() < 4 ? 4 - number.size() : 0, ' ') + number + ":" + text + " ;");
  }

  static std::string bare(std::string text) {
    while (!text.empty() && (text.back() == ';' || text.back() == ' ')) text.pop_back();
    return text;
  }
  void instruction(const std::string& text) { numbered("  " + bare(text)); }

  // In as many remarks as it takes, parted at blanks.
  void comment(const std::string& text) override {
    std::string plain = plain_text(text, kMaxComment);
    std::replace(plain.begin(), plain.end(), ';', ',');
    for (const auto& remark : remark_lines(plain, kMaxRemark)) instruction("!" + remark);
  }

  void dwell(double seconds) override {
    std::string text = decimal_text(std::ceil(seconds * 100.0 - kNoise) / 100.0, 2);
    instruction("WAIT " + text + "(sec)");
  }

  void label(const std::string& text) override {
    comment(text);
    instruction("LBL[" + std::to_string(++labels_) + "]");
    select_frames();
  }

  void statement(const std::string& words, const MachineAction& action) override {
    warn_on_the_fly(words, action, "one output, such as DO[1]=ON, can be set at a rounded corner");
    instruction(words);
  }

  // ---- motions

  int angle_digits() const { return std::max(kLeastAngleDigits, machine().dialect.digits_angle); }

  // Whole millimetres.
  static int corner_radius(const MachineMove& m) {
    return static_cast<int>(std::floor(m.blend + kNoise));
  }

  void print_move(std::size_t i) override {
    const MachineMove& m = move(i);
    const std::string target = " P[" + std::to_string(i + 1) + "] ";
    std::string trigger;
    if (is_tool(m)) {
      if (has_blend(m)) trigger = take_trigger(i + 1);
      const bool rounds = may_round(i);
      numbered("L" + target + line_speed(m) +
               (rounds ? " CR" + std::to_string(corner_radius(m)) : std::string(" FINE")) +
               trigger);
    } else {
      numbered("J" + target + joint_speed(m) + " FINE");
    }
    put_position(i + 1, m);
    arrive(m);
  }

  // The one output that is set at the end of a rounded move, as a time before of 0.
  std::string take_trigger(std::size_t before) {
    const auto [first, last] = actions_before(before);
    std::size_t found = last;
    for (std::size_t k = first; k < last; ++k) {
      const MachineAction& action = program().actions[k];
      if (action.kind == MachineAction::Kind::comment) continue;
      if (found != last || action.kind != MachineAction::Kind::event) return {};
      found = k;
    }
    if (found == last) return {};
    Diagnostics ignored;
    const auto words = event_text(machine(), program().actions[found], ignored);
    if (!words || words->is_comment || !words->on_the_fly || words->dwell > 0.0) return {};
    std::string text = bare(words->text);
    text.erase(std::remove(text.begin(), text.end(), ' '), text.end());
    const bool output = text.size() > 4 &&
                        (text[0] == 'D' || text[0] == 'R' || text[0] == 'G' || text[0] == 'A') &&
                        text.substr(1, 2) == "O[" && text.find('=') != std::string::npos;
    if (!output) return {};
    take(found);
    return " TB 0.00sec," + text;
  }

  // Never faster than planned.
  static std::string time_text(double seconds) {
    const double ms = std::max(1.0, std::ceil(seconds * 1e3 - kNoise));
    if (ms <= kLargestMilliseconds) return decimal_text(ms, 0) + "msec";
    return decimal_text(std::ceil(seconds * 10.0 - kNoise) / 10.0, 1) + "sec";
  }

  std::string joint_speed(const MachineMove& m) const {
    if (!has_started()) return "10%";
    return m.rapid || m.duration <= 0.0 ? "100%" : time_text(m.duration);
  }

  std::string line_speed(const MachineMove& m) const {
    if (m.rapid || m.duration <= 0.0) return "R[91]mm/sec";
    const Leg leg = leg_to(m);
    const double value =
        leg.moves_tip() ? leg.length / m.duration : degrees_from_radians(leg.turn) / m.duration;
    const double speed = std::floor(value * 10.0 * (1.0 + kNoise)) / 10.0;
    if (speed < kLeastSpeed) return time_text(m.duration);
    return decimal_text(speed, 1) + (leg.moves_tip() ? "mm/sec" : "deg/sec");
  }

  // ---- /POS

  void put(const std::string& text) { positions_ += text + "\n"; }

  void put_position(std::size_t number, const MachineMove& m) {
    put("P[" + std::to_string(number) + "]{");
    put("   GP1:");
    std::string frames = "\tUF : 9, UT : 9,";
    if (is_tool(m)) {
      put(frames + "\t\tCONFIG : '" + configuration(m.to) + "',");
      const ZyxAngles angles = zyx_angles(m.tool.linear(), held_);
      held_ = angles.z;
      const int digits = machine().dialect.digits_length;
      const Vec3& p = m.tool.translation();
      put("\tX = " + decimal_text(p.x(), digits) + " mm,\tY = " + decimal_text(p.y(), digits) +
          " mm,\tZ = " + decimal_text(p.z(), digits) + " mm,");
      put("\tW = " + degrees(angles.x, angle_digits()) +
          " deg,\tP = " + degrees(angles.y, angle_digits()) +
          " deg,\tR = " + degrees(angles.z, angle_digits()) + " deg" + external(m.to));
    } else {
      put(frames);
      std::string text;
      for (std::size_t k = 0; k < 6; ++k)
        text += (k > 0 ? (k == 3 ? ",\n\t" : ",\t") : "\t") + ("J" + std::to_string(k + 1)) + "= " +
                joint(k, m.to) + " deg";
      put(text + external(m.to));
    }
    put("};");
  }

  static std::string degrees(double angle, int digits) {
    return decimal_text(degrees_from_radians(angle), digits);
  }

  // J3 is measured from the horizontal: without A2. Difference of what is printed, so that it comes
  // back to the digit.
  std::string joint(std::size_t k, const JointVector& joints) const {
    const int digits = machine().dialect.digits_angle;
    const auto value = [&](std::size_t axis) {
      return rounded_decimal(degrees_from_radians(joints[axes().arm[axis]]), digits);
    };
    return decimal_text(k == 2 ? value(2) - value(1) : value(k), digits);
  }

  std::string external(const JointVector& joints) const {
    std::string text;
    for (std::size_t k = 0; k < 6; ++k) {
      const int j = axes().external[k];
      if (j < 0) continue;
      const bool rotary =
          machine().axes[static_cast<std::size_t>(j)].joint.kind == JointKind::rotary;
      text += ",\n\tE" + std::to_string(k + 1) + "= " +
              (rotary ? degrees(joints[j], machine().dialect.digits_angle) + " deg"
                      : decimal_text(joints[j], machine().dialect.digits_length) + " mm");
    }
    return text;
  }

  std::string configuration(const JointVector& joints) const {
    const int bits = configuration_.at(joints)[3];
    std::string text = joints[axes().arm[4]] < 0.0 ? "N " : "F ";
    text += (bits & 2) != 0 ? "D " : "U ";
    text += (bits & 4) != 0 ? "B" : "T";
    for (const std::size_t k : {3U, 4U, 5U})
      text += ", " + std::to_string(static_cast<int>(
                         std::floor((joints[axes().arm[k]] + kPi) / (2.0 * kPi) + kNoise)));
    return text;
  }

  static constexpr const char* kComment = "COMMENT\t\t= \"smoothpost\";";
  static constexpr const char* kWarning = "COMMENT\t\t= \"NOT CERTIFIED\";";
  static constexpr const char* kLineCount = "LINE_COUNT\t= 0;";

  rapid::ArmConfiguration configuration_;
  std::string positions_;
  std::uint32_t number_ = 0;
  std::uint32_t labels_ = 0;
  double held_ = 0.0;  // R, where it is not unique
};

}  // namespace

Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program) {
  return Emitter(machine, program).run();
}

const Dialect kDialect = {
    "fanuc_ls",
    "FANUC TP programs (.LS), L in the part's frame and J, FINE or CR",
    "L: tip linear, rotation in proportion, taken as one about a fixed axis with an allowance of "
    "the square of its angle by 8; CR leaves that way within its distance of the corner only; J: "
    "all axes together, path between its ends not certified: only the box of joint positions",
    ToolTurn::slerp,
    false,
    &emit,
    &read_back,
    "user frame 9 and tool frame 9 are set by the program itself, and it uses no other"};

}  // namespace smoothpost::fanuc_ls
