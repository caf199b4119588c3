#include "postproc/pipeline/test_program.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/units.h"
#include "kernels/kinematics/inverse.h"
#include "machines/dialects/decimal.h"
#include "postproc/pipeline/tool_motion.h"
#include "postproc/pipeline/verify.h"

namespace smoothpost {

namespace {

constexpr double kLinearSpeed = 5.0;                      // mm/s
constexpr double kRotarySpeed = 5.0 * kRadiansPerDegree;  // rad/s
constexpr double kLinearStep = 20.0;                      // mm
constexpr double kRotaryStep = 15.0 * kRadiansPerDegree;  // rad
constexpr double kSwing = 30.0 * kRadiansPerDegree;       // rad
constexpr double kLeastSwing = 3.0 * kRadiansPerDegree;   // rad
constexpr double kSwingStep = 1.0 * kRadiansPerDegree;    // rad, before halving

std::string number(double value, int digits) {
  std::string text;
  append_decimal(text, value, digits);
  return text;
}

std::string direction_text(const Vec3& d) {
  for (int i = 0; i < 3; ++i)
    if (std::abs(std::abs(d[i]) - 1.0) < 1e-9)
      return std::string(d[i] > 0.0 ? "+" : "-") + "XYZ"[i];
  return "[" + number(d.x(), 4) + " " + number(d.y(), 4) + " " + number(d.z(), 4) + "]";
}

class TestBuilder {
 public:
  TestBuilder(const MachineDefinition& machine, double tool_length)
      : machine_(machine), chain_(chain_of(machine)), inverse_(Inverse::from(chain_)) {
    out_.tool_length = tool_length;
    out_.program.part = chain_.workpiece_home;
    out_.program.tool_length = tool_length;
    q_ = home_of(machine);
  }

  Result<TestProgram> run() {
    out_.program.title = {
        "smoothpost: test of the machine file of " + machine_.name,
        "without a workpiece, with the feed override at its lowest, a hand at the stop",
        "what a line says has to be what the machine does: otherwise its file is wrong"};
    go_home();
    for (int j = 0; j < machine_.size(); ++j) single_axis(j);
    if (inverse_) swings();
    comment("home");
    move_all(home_of(machine_));
    if (inverse_ && swung_ == 0) {
      Diagnostic d;
      d.code = "KN130";
      d.text = "no rotary axis of machine " + machine_.name +
               " can swing with the tip held: the linear axes have no room, or the tool length " +
               number(out_.tool_length, 3) + " mm is wrong";
      return Result<TestProgram>::failure(d);
    }
    return Result<TestProgram>(std::move(out_));
  }

 private:
  const AxisDefinition& axis(int j) const { return machine_.axes[static_cast<std::size_t>(j)]; }
  bool is_rotary(int j) const { return axis(j).joint.kind == JointKind::rotary; }

  void comment(std::string text) {
    MachineAction action;
    action.kind = MachineAction::Kind::comment;
    action.before = out_.program.moves.size();
    action.text = std::move(text);
    out_.program.actions.push_back(std::move(action));
  }

  void add(JointMask joints, const JointVector& to, bool held) {
    MachineMove move;
    move.to = to;
    move.joints = joints;
    move.role = MoveRole::link;
    move.tool_length = out_.tool_length;
    move.tool = tip_pose(chain_, to, out_.tool_length);
    move.duration = machine_.cycle.min_block;
    for (int j = 0; j < machine_.size(); ++j)
      move.duration = std::max(
          move.duration, std::abs(to[j] - q_[j]) / (is_rotary(j) ? kRotarySpeed : kLinearSpeed));
    // Where the machine stands before the first move nobody knows: a distance that is slow enough.
    if (out_.program.moves.size() < static_cast<std::size_t>(machine_.size()) && !held)
      move.duration = std::max(move.duration, first_time(joints));
    out_.program.moves.push_back(std::move(move));
    out_.tip_held.push_back(held);
    q_ = to;
  }

  double first_time(JointMask joints) const {
    double time = 0.0;
    for (int j = 0; j < machine_.size(); ++j) {
      if (!(joints >> j & 1U)) continue;
      const double range = axis(j).joint.upper - axis(j).joint.lower;
      const double way = is_rotary(j) ? std::min(range, 2.0 * kPi) : range;
      time = std::max(time, way / (4.0 * (is_rotary(j) ? kRotarySpeed : kLinearSpeed)));
    }
    return time;
  }

  void go_home() {
    comment("home, one axis after the other");
    const int retract = machine_.axis_by_name(machine_.links.retract_axis);
    const JointVector home = home_of(machine_);
    if (inverse_ && inverse_->takes_rotation()) {
      add((1U << machine_.size()) - 1U, home, false);
      return;
    }
    if (retract >= 0) add(1U << retract, home, false);
    for (int j = 0; j < machine_.size(); ++j)
      if (j != retract) add(1U << j, home, false);
  }

  void move_all(const JointVector& to) {
    for (int j = machine_.size(); j-- > 0;) {
      if (q_[j] == to[j]) continue;
      JointVector q = q_;
      q[j] = to[j];
      add(1U << j, q, false);
    }
  }

  std::string describe(int j, double step) const {
    const AxisDefinition& a = axis(j);
    const bool tool = a.joint.side == ChainSide::tool;
    const Vec3 direction = step > 0.0 ? a.joint.direction : Vec3(-a.joint.direction);
    std::string text = a.name + (step > 0.0 ? " +" : " ") +
                       number(is_rotary(j) ? degrees_from_radians(step) : step, 3) +
                       (is_rotary(j) ? " deg: " : " mm: ");
    text += tool ? "the tool " : "the table ";
    if (is_rotary(j))
      return text + "turns about " + direction_text(direction) +
             " by the right hand rule, counter-clockwise with that arrow towards you";
    return text + "moves towards " + direction_text(direction) + " of the machine";
  }

  void single_axis(int j) {
    const double size = is_rotary(j) ? kRotaryStep : kLinearStep;
    const double room_up = axis(j).joint.upper - q_[j];
    const double room_down = q_[j] - axis(j).joint.lower;
    const double step = room_up >= room_down ? std::min(size, room_up) : -std::min(size, room_down);
    if (step == 0.0) return;
    comment(describe(j, step));
    JointVector q = q_;
    q[j] += step;
    add(1U << j, q, false);
    q[j] -= step;
    add(1U << j, q, false);
  }

  // Linears in the middle of their ranges, rotaries at home: room on all sides.
  void swings() {
    JointVector centre = home_of(machine_);
    if (!inverse_->takes_rotation())
      for (int j = 0; j < machine_.size(); ++j)
        if (!is_rotary(j) && !axis(j).joint.redundant)
          centre[j] = 0.5 * (axis(j).joint.lower + axis(j).joint.upper);
    comment("to a place with room: the tip is held on a point there");
    move_all(centre);
    held_ = tip_pose(chain_, q_, out_.tool_length);
    if (inverse_->takes_rotation()) {
      for (int i = 0; i < 3; ++i) swing_arm(i);
    } else {
      for (const int j :
           {inverse_->rotary_pair()->first_rotary(), inverse_->rotary_pair()->second_rotary()})
        swing_axis(j);
    }
  }

  std::optional<JointVector> held_at(int j, double value) const {
    JointVector q = q_;
    q[j] = value;
    // The holder's place depends on the axis: solve with the tip where it is.
    Pose turned = tip_pose(chain_, q, out_.tool_length);
    turned.translation() = held_.translation();
    const auto solved = inverse_->rotary_pair()->with_linears(
        holder_pose(chain_, turned, out_.tool_length).translation(), q);
    if (!solved || !inside(*solved)) return {};
    return solved;
  }

  bool inside(const JointVector& q) const {
    for (int j = 0; j < machine_.size(); ++j)
      if (q[j] < axis(j).joint.lower || q[j] > axis(j).joint.upper) return false;
    return true;
  }

  void swing_axis(int j) {
    const double start = q_[j];
    double up = kSwing, down = kSwing;
    while (up > kLeastSwing && !held_at(j, start + up)) up *= 0.8;
    while (down > kLeastSwing && !held_at(j, start - down)) down *= 0.8;
    up = up > kLeastSwing ? up : 0.0;
    down = down > kLeastSwing ? down : 0.0;
    if (up + down == 0.0) {
      comment(axis(j).name + " cannot swing with the tip held: no room");
      return;
    }
    ++swung_;
    comment(axis(j).name + " swings from +" + number(degrees_from_radians(up), 2) + " to -" +
            number(degrees_from_radians(down), 2) + " deg: the tip stays on its point within " +
            number(machine_.tolerance.tip, 4) + " mm");
    for (const double target : {start + up, start - down, start})
      swing_to([this, j](double value) { return held_at(j, value); }, q_[j], target);
  }

  void swing_arm(int i) {
    const Pose centre = held_;
    const auto at = [&](double angle) -> std::optional<JointVector> {
      Pose pose = centre;
      pose.linear() = rotation_about(Vec3::Unit(i), angle) * centre.linear();
      auto q = inverse_->nearest(holder_pose(chain_, pose, out_.tool_length), q_);
      if (q && !inside(*q)) q.reset();
      return q;
    };
    double swing = 0.5 * kSwing;
    while (swing > kLeastSwing && (!at(swing) || !at(-swing))) swing *= 0.8;
    if (swing <= kLeastSwing) return;
    ++swung_;
    comment("the tool turns about " + std::string(1, "XYZ"[i]) + " of the part by +" +
            number(degrees_from_radians(swing), 2) + ", -" +
            number(degrees_from_radians(swing), 2) + " deg: the tip stays on its point within " +
            number(machine_.tolerance.tip, 4) + " mm");
    double from = 0.0;
    for (const double target : {swing, -swing, 0.0}) {
      swing_to(at, from, target);
      from = target;
    }
  }

  template <class At>
  void swing_to(const At& at, double from, double target) {
    const int steps =
        std::max(1, static_cast<int>(std::ceil(std::abs(target - from) / kSwingStep)));
    for (int k = 1; k <= steps; ++k)
      step_to(at, from + (target - from) * (k - 1) / steps, from + (target - from) * k / steps, 0);
  }

  // Halves a step until the straight joint motion keeps the tip within half the tolerance.
  template <class At>
  void step_to(const At& at, double from, double to, int depth) {
    const auto q = at(to);
    if (!q) return;
    const auto bend = second_derivative_bound(chain_, q_, *q);
    const double sag = (bend.tip + std::abs(out_.tool_length) * bend.axis) / 8.0;
    if (sag > 0.5 * machine_.tolerance.tip && depth < 12) {
      step_to(at, from, 0.5 * (from + to), depth + 1);
      step_to(at, 0.5 * (from + to), to, depth + 1);
      return;
    }
    add((1U << machine_.size()) - 1U, *q, true);
  }

  const MachineDefinition& machine_;
  ScrewChain chain_;
  std::optional<Inverse> inverse_;
  TestProgram out_;
  JointVector q_;
  Pose held_ = Pose::Identity();
  int swung_ = 0;
};

}  // namespace

Result<TestProgram> make_test_program(const MachineDefinition& machine, double tool_length) {
  return TestBuilder(machine, tool_length).run();
}

Checks check_test_program(const ReadBack& read, const MachineDefinition& machine,
                          const TestProgram& test) {
  const ScrewChain chain = chain_of(machine);
  Checks checks = verify_machine(read, machine).checks;
  Check held;
  held.name = "tip_held";
  held.unit = "mm";
  held.limit = machine.tolerance.tip;
  Check complete;
  complete.name = "path_complete";
  complete.unit = "faults";
  complete.value = read.moves.size() == test.program.moves.size() ? 0.0 : 1.0;
  complete.ok = complete.value == 0.0;
  std::optional<Vec3> point;
  for (std::size_t i = 1; complete.ok && i < read.moves.size(); ++i) {
    if (!test.tip_held[i]) {
      point.reset();
      continue;
    }
    const JointVector& from = read.moves[i - 1].to;
    const JointVector& to = read.moves[i].to;
    if (!point) point = tip_pose(chain, from, test.tool_length).translation();
    const auto bend = second_derivative_bound(chain, from, to);
    const double sag = (bend.tip + std::abs(test.tool_length) * bend.axis) / 8.0;
    const double distance =
        std::max((tip_pose(chain, from, test.tool_length).translation() - *point).norm(),
                 (tip_pose(chain, to, test.tool_length).translation() - *point).norm()) +
        sag;
    if (distance <= held.value) continue;
    held.value = distance;
    held.output_line = read.moves[i].line;
  }
  held.ok = held.value <= held.limit;
  checks.push_back(held);
  checks.push_back(complete);
  return checks;
}

}  // namespace smoothpost
