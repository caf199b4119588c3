#include "machines/dialects/val3.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "kernels/core/units.h"
#include "machines/dialects/robot_program.h"
#include "machines/dialects/zyx_angles.h"

namespace smoothpost::val3 {

namespace {

constexpr std::size_t kMaxComment = 120;
constexpr int kLeastAngleDigits = 5;
constexpr int kFrameDigits = 6;
constexpr double kLeastRadius = 0.1;  // mm
constexpr double kFreeSpeed = 10000;  // mm/s or deg/s: the other of the two decides

class Emitter : public robot::RobotPrinter {
 public:
  Emitter(const MachineDefinition& machine, const MachineProgram& program)
      : RobotPrinter(machine, program, "VAL3", kLeastRadius) {}

 private:
  void check() override {
    RobotPrinter::check();
    for (const int j : axes().external)
      if (j >= 0)
        refuse("PR203", "axis " + machine().axes[static_cast<std::size_t>(j)].name +
                            ": VAL3 programs of this version move the six axes of the arm only");
  }

  // ---- literals

  int angle_digits() const { return std::max(kLeastAngleDigits, machine().dialect.digits_angle); }

  static std::string list(const std::array<double, 6>& values, int first, int last) {
    std::string text = "{";
    for (std::size_t i = 0; i < 6; ++i)
      text += (i > 0 ? "," : "") + decimal_text(values[i], i < 3 ? first : last);
    return text + "}";
  }

  // R = Rx(rx)·Ry(ry)·Rz(rz): the angles of the inverse the other way round.
  static std::string pose_text(const Pose& pose, int length, int angle) {
    const ZyxAngles inverse = zyx_angles(pose.linear().transpose());
    const Vec3& p = pose.translation();
    return list({p.x(), p.y(), p.z(), degrees_from_radians(-inverse.x),
                 degrees_from_radians(-inverse.y), degrees_from_radians(-inverse.z)},
                length, angle);
  }

  std::string joints_text(const JointVector& joints) const {
    std::array<double, 6> values{};
    for (std::size_t i = 0; i < 6; ++i) values[i] = degrees_from_radians(joints[axes().arm[i]]);
    const int digits = machine().dialect.digits_angle;
    return list(values, digits, digits);
  }

  // ---- head and foot

  void head() override {
    line("<?xml version=\"1.0\" encoding=\"utf-8\" ?>");
    line(
        "<Programs xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" "
        "xmlns=\"http://www.staubli.com/robotics/VAL3/Program/2\">");
    line("  <Program name=\"smoothpost\">");
    line("    <Locals>");
    local("fPart", "frame");
    local("tTip", "tool");
    local("pTo", "pointRx");
    local("jTo", "jointRx");
    for (const char* name : {"mFirst", "mLink", "mJoint", "mMove"}) local(name, "mdesc");
    local("nKey", "num");
    line("    </Locals>");
    line("    <Code><![CDATA[begin");
    if (!program().certified) {
      line("putln(\"NOT CERTIFIED: read the report, then press a key\")");
      line("nKey=get()");
    }
    for (const auto& title : program().title) comment(title);
    for (const auto& own : machine().dialect.start) line(own);
    line("link(fPart,world)");
    line("fPart.trsf=" + pose_text(program().part, kFrameDigits, kFrameDigits));
    line("link(tTip,flange)");
    line("tTip.trsf=" + pose_text(tool(), kFrameDigits, kFrameDigits));
    line("link(pTo,fPart)");
    line("pTo.config={ssame,esame,wsame}");
    speed("mFirst", 10.0, 250.0, 20.0);
    speed("mLink", 100.0, 250.0, 90.0);
    speed("mJoint", 100.0, 250.0, 90.0);
    speed("mMove", 100.0, 250.0, 90.0);
  }

  void local(const char* name, const char* type) {
    line(std::string("      <Local name=\"") + name + "\" type=\"" + type +
         "\" xsi:type=\"array\" size=\"1\" />");
  }

  void speed(const std::string& name, double percent, double tip, double turn) {
    set(name + ".accel", "100");
    set(name + ".decel", "100");
    set(name + ".vel", decimal_text(percent, 2));
    set(name + ".tvel", decimal_text(tip, 0));
    set(name + ".rvel", decimal_text(turn, 0));
    set(name + ".blend", "off");
    set(name + ".leave", "0");
    set(name + ".reach", "0");
  }

  // What a variable already has is not printed again.
  void set(const std::string& name, const std::string& value) {
    auto& known = values_[name];
    if (known == value) return;
    known = value;
    line(name + "=" + value);
  }

  void foot() override {
    wait();
    for (const auto& own : machine().dialect.end) line(own);
    line("end]]></Code>");
    line("  </Program>");
    line("</Programs>");
  }

  // ---- other lines

  void comment(const std::string& text) override {
    std::string plain = plain_text(text, kMaxComment);
    std::replace(plain.begin(), plain.end(), '>', ')');  // ]]> would end the code
    line("// " + plain);
  }
  void label(const std::string& text) override { comment(text); }

  void wait() {
    if (moving_) line("waitEndMove()");
    moving_ = false;
  }

  void dwell(double seconds) override {
    wait();
    line("delay(" + decimal_text(seconds, 4) + ")");
  }

  void statement(const std::string& words, const MachineAction& action) override {
    warn_on_the_fly(words, action,
                    "VAL3 runs a statement at once unless it waits for the end of the motion");
    wait();
    line(words);
  }

  // ---- motions

  void print_move(std::size_t i) override {
    const MachineMove& m = move(i);
    is_tool(m) ? print_line(i) : print_joints(m);
    arrive(m);
    moving_ = true;
  }

  void print_joints(const MachineMove& m) {
    set("jTo", joints_text(m.to));
    const bool timed = has_started() && !m.rapid && m.duration > 0.0;
    if (timed) set("mJoint.vel", decimal_text(joint_percent(m, 4), 4));
    line(std::string("movej(jTo,tTip,") +
         (timed           ? "mJoint"
          : has_started() ? "mLink"
                          : "mFirst") +
         ")");
  }

  void print_line(std::size_t i) {
    const MachineMove& m = move(i);
    set("pTo.trsf", pose_text(m.tool, machine().dialect.digits_length, angle_digits()));
    if (m.rapid || m.duration <= 0.0) return line("movel(pTo,tTip,mLink)");
    const Leg leg = leg_to(m);
    set_speed("mMove.tvel", leg.moves_tip() ? leg.length / m.duration : kFreeSpeed);
    set_speed("mMove.rvel",
              leg.turn > kLeastTurn ? degrees_from_radians(leg.turn) / m.duration : kFreeSpeed);
    const bool rounds = may_round(i);
    set("mMove.blend", rounds ? "Cartesian" : "off");
    const std::string radius = decimal_text(rounds ? rapid::blend_radius(m.blend) : 0.0, 3);
    set("mMove.leave", radius);
    set("mMove.reach", radius);
    line("movel(pTo,tTip,mMove)");
  }

  void set_speed(const std::string& name, double value) {
    set(name, decimal_text(value, decimals_for(value, 7, 3, 9)));
  }

  static constexpr double kLeastTurn = 1e-5;  // rad
  std::map<std::string, std::string> values_;
  bool moving_ = false;
};

}  // namespace

Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program) {
  return Emitter(machine, program).run();
}

const Dialect kDialect = {
    "val3",
    "VAL3 (Staubli), movel in the part's frame and movej, exact stop or Cartesian blend",
    "movel: tip linear, rotation in proportion, taken as one about a fixed axis with an allowance "
    "of the square of its angle by 8; a blend leaves that way within its leave and reach only; "
    "movej: all axes together, path between its ends not certified: only the box of joint "
    "positions",
    ToolTurn::slerp,
    false,
    &emit,
    &read_back,
    "part's frame and tool are local variables that the program sets itself"};

}  // namespace smoothpost::val3
