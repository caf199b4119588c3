#include "machines/dialects/yaskawa_jbi.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/units.h"
#include "machines/dialects/robot_program.h"
#include "machines/dialects/yaskawa_posture.h"
#include "machines/dialects/zyx_angles.h"

namespace smoothpost::yaskawa_jbi {

namespace {

constexpr std::size_t kMaxRemark = 32;
constexpr std::size_t kMaxComment = 120;
constexpr std::uint32_t kMostSteps = 9999;
constexpr std::size_t kMostPositions = 100000;
constexpr int kLengthDigits = 3;  // those of the format
constexpr int kAngleDigits = 4;
constexpr double kLeastSpeed = 0.1;  // mm/s or deg/s
constexpr double kMostTip = 1500.0;
constexpr double kMostTurn = 180.0;
constexpr double kLinkSpeed = 250.0;  // mm/s, and no other motion has it
constexpr double kNoise = 1e-9;

class Emitter : public robot::RobotPrinter {
 public:
  Emitter(const MachineDefinition& machine, const MachineProgram& program)
      : RobotPrinter(machine, program, "INFORM", 1.0),
        postures_(machine),
        in_base_(chain_of(machine, program.tool_length)) {
    in_base_.workpiece_home = Pose::Identity();
  }

 private:
  void check() override {
    RobotPrinter::check();
    for (const int j : axes().external)
      if (j >= 0)
        refuse("PR203", "axis " + machine().axes[static_cast<std::size_t>(j)].name +
                            ": INFORM jobs of this version move the six axes of the arm only");
    if (!postures_.exists())
      refuse("PR203", "machine " + machine().name +
                          ": a job's positions are Cartesian with a posture, and this arm has "
                          "none: it needs a spherical wrist behind two parallel axes");
    if (machine().dialect.digits_length > kLengthDigits)
      refuse("PR203", "a job has " + std::to_string(kLengthDigits) +
                          " decimals of mm: write dialect.digits_mm = 3");
    if (program().moves.size() > kMostPositions)
      refuse("PR203", "a job has at most 100000 positions: write it in parts with --cuts");
  }

  // ---- positions, in front of the instructions

  void put(const std::string& text) { line(text + "\r"); }

  void head() override {
    put("/JOB");
    put("//NAME SMTHPOST");
    put("//POS");
    put("///NPOS " + std::to_string(program().moves.size()) + ",0,0,1,0,0");
    put("///TOOL 9");
    put("///POSTYPE BASE");
    put("///RECTAN");
    for (std::size_t i = 0; i < program().moves.size(); ++i) put_position(i);
    put_posture("0,0,0,0,0,0");
    put("P00091=" + pose_text(tool()));
    put("//INST");
    put("///DATE 2000/01/01 00:00");
    put(std::string("///COMM ") + (program().certified ? "smoothpost" : "NOT CERTIFIED"));
    put("///ATTR SC,RW,RJ");
    put("////FRAME BASE");
    put("///GROUP1 RB1");
    put("NOP");
    if (!program().certified) {
      comment("NOT CERTIFIED: read the report");
      put("PAUSE");
    }
    for (const auto& title : program().title) comment(title);
    for (const auto& own : machine().dialect.start) put(own);
    put("SETTOOL TL#(9) P091");
  }

  void put_position(std::size_t i) {
    const MachineMove& m = move(i);
    const auto posture = postures_.of(m.to);
    if (!posture && !is_tool(m)) {
      refuse("PR203",
             "the joints of a motion are too close to where their posture changes (axis 5 at 0, "
             "axis 1, 4 or 6 at 180 deg or beyond 360 deg): INFORM would not find them",
             m.input_line);
      return;
    }
    if (posture) put_posture(posture_text(*posture));
    const std::string number = std::to_string(i);
    put("C" + std::string(number.size() < 5 ? 5 - number.size() : 0, '0') + number + "=" +
        pose_text(is_tool(m) ? program().part * m.tool : forward(in_base_, m.to)));
  }

  void put_posture(const std::string& text) {
    if (text == posture_) return;
    posture_ = text;
    put("///RCONF " + text + ",0,0");
  }

  static std::string posture_text(const Posture& p) {
    std::string text;
    for (const bool bit : {p.no_flip, p.lower, p.rear, p.turned[0], p.turned[1], p.turned[2]})
      text += std::string(text.empty() ? "" : ",") + (bit ? "1" : "0");
    return text;
  }

  static std::string pose_text(const Pose& pose) {
    const ZyxAngles a = zyx_angles(pose.linear());
    std::string text;
    for (int i = 0; i < 3; ++i) text += decimal_text(pose.translation()[i], kLengthDigits) + ",";
    for (const double angle : {a.x, a.y, a.z})
      text += decimal_text(degrees_from_radians(angle), kAngleDigits) + ",";
    text.pop_back();
    return text;
  }

  // ---- instructions

  void foot() override {
    for (const auto& own : machine().dialect.end) put(own);
    put("END");
    if (lines() - program().moves.size() > kMostSteps)
      warn("PR223", 0,
           "the job has more than " + std::to_string(kMostSteps) +
               " lines of instructions: write it in parts with --cuts");
  }

  void comment(const std::string& text) override {
    for (const auto& remark : remark_lines(plain_text(text, kMaxComment), kMaxRemark))
      put("'" + remark);
  }

  void label(const std::string& text) override {
    comment(text);
    put("*CUT" + std::to_string(++labels_));
  }

  void dwell(double seconds) override {
    put("TIMER T=" + decimal_text(std::ceil(seconds * 100.0 - kNoise) / 100.0, 2));
  }

  void statement(const std::string& words, const MachineAction& action) override {
    warn_on_the_fly(words, action, "every motion of a job ends exactly before the next line");
    put(words);
  }

  void print_move(std::size_t i) override {
    const MachineMove& m = move(i);
    const std::string number = std::to_string(i);
    const std::string target = "C" + std::string(number.size() < 5 ? 5 - number.size() : 0, '0') +
                               number + (is_tool(m) ? line_speed(m) : joint_speed(m)) + " PL=0";
    put((is_tool(m) ? "MOVL " : "MOVJ ") + target);
    arrive(m);
  }

  std::string joint_speed(const MachineMove& m) const {
    if (!has_started()) return " VJ=10";
    if (m.rapid || m.duration <= 0.0) return " VJ=100";
    return " VJ=" + decimal_text(joint_percent(m, 2), 2);
  }

  // Never faster than planned, but for what is slower than the least speed.
  std::string line_speed(const MachineMove& m) const {
    if (m.rapid || m.duration <= 0.0) return " V=" + decimal_text(kLinkSpeed, 1);
    const Leg leg = leg_to(m);
    const bool tip = leg.moves_tip();
    const double value = (tip ? leg.length : degrees_from_radians(leg.turn)) / m.duration;
    double speed = std::floor(value * 10.0 * (1.0 + kNoise)) / 10.0;
    speed = std::min(speed, tip ? kMostTip : kMostTurn);
    if (tip && std::abs(speed - kLinkSpeed) < kNoise) speed = kLinkSpeed - kLeastSpeed;
    return (tip ? " V=" : " VR=") + decimal_text(std::max(speed, kLeastSpeed), 1);
  }

  Postures postures_;
  ScrewChain in_base_;  // W is M
  std::string posture_;
  std::uint32_t labels_ = 0;
};

}  // namespace

Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program) {
  return Emitter(machine, program).run();
}

const Dialect kDialect = {
    "yaskawa_jbi",
    "Yaskawa INFORM jobs (.JBI), MOVL and MOVJ to Cartesian positions with RCONF, PL=0",
    "MOVL: tip linear, rotation in proportion, taken as one about a fixed axis with an allowance "
    "of the square of its angle by 8, exact at its end (PL=0); MOVJ: all axes together, path "
    "between its ends not certified: only the box of joint positions",
    ToolTurn::slerp,
    false,
    &emit,
    &read_back,
    "positions are in the robot's base and the job sets tool file 9 itself, and uses no other"};

}  // namespace smoothpost::yaskawa_jbi
