#include <algorithm>
#include <array>
#include <cmath>

#include "formats/robot/krl_reader.h"
#include "kernels/core/units.h"
#include "kernels/kinematics/screw_chain.h"
#include "machines/dialects/event_text.h"
#include "machines/dialects/krl.h"
#include "machines/dialects/krl_line.h"
#include "machines/dialects/program_reading.h"

namespace smoothpost::krl {

namespace {

/// An event on the way of a LIN.
struct WayEvent {
  double share = 0.0;  // of the LIN
  const Statement* trigger = nullptr;
};

/// Follows the statements as KSS would, for one machine.
class Reading {
 public:
  Reading(const MachineDefinition& machine, const std::string& file)
      : machine_(machine), file_(file), events_(machine.process) {
    joints_ = JointVector::Zero(machine.size());
    for (const auto& line : machine.dialect.start) start_lines_.push_back(packed(line));
    for (const auto& line : machine.dialect.end) end_lines_.push_back(packed(line));
  }

  void run(const KrlProgram& program) {
    result.exact_path = true;
    for (const auto& s : program.statements) read(s);
    if (!pending_.empty()) error(*pending_.back(), "NC323", "a TRIGGER has no motion behind it");
    result.line_count = program.line_count;
    result.last_line = program.end_line;
    result.part = base_;
    result.tool_frame = tool_;
    result.offset_guard = base_ && tool_ && !moved_without_frames_;
  }

  ReadBack result;
  Diagnostics diagnostics;

 private:
  static std::string packed(const std::string& line) {
    return packed_statement(line.substr(0, line.find(';')));
  }

  void error(const Statement& at, const char* code, std::string text) {
    Diagnostic d;
    d.code = code;
    d.text = std::move(text);
    d.where = {file_, static_cast<int>(at.line), static_cast<int>(at.column)};
    diagnostics.push_back(std::move(d));
  }

  void read(const Statement& s) {
    switch (s.kind) {
      case Statement::Kind::motion:
        return s.name == "PTP" ? read_joints(s) : read_line(s);
      case Statement::Kind::spline_begin:
        block_speed_ = s.speed;
        return;
      case Statement::Kind::spline_end:
        return;
      case Statement::Kind::trigger:
        pending_.push_back(&s);
        return;
      case Statement::Kind::wait_seconds:
        return add_event(s, "dwell", *s.number);
      case Statement::Kind::declaration:
        if (s.name != "SP_LINK") error(s, "NC323", "a variable that this program does not have");
        return;
      case Statement::Kind::assignment:
        if (read_variable(s)) return;
        break;
      case Statement::Kind::call:
        if (read_bas(s)) return;
        break;
      case Statement::Kind::interrupt:
        if (packed(s.text) == "INTERRUPTON3" ||
            packed(s.text) == "GLOBALINTERRUPTDECL3WHEN$STOPMESS==TRUEDOIR_STOPM()")
          return;
        break;
      case Statement::Kind::halt:
        break;
    }
    read_other(s);
  }

  // Words of the process table, of the machine file's first and last lines, and the stop.
  void read_other(const Statement& s) {
    if (const auto event = events_.find(s.text, EventReader::Place::stop))
      return add_event(s, *event, 0.0);
    if (s.kind == Statement::Kind::halt) return;
    if (is_template(packed(s.text))) return;
    error(s, "NC323",
          "this statement is neither one of ours nor in the machine's process table: " +
              s.text.substr(0, 64));
  }

  // The machine file's own lines, in their place.
  bool is_template(const std::string& text) {
    const auto has = [&text](const std::vector<std::string>& lines) {
      return std::find(lines.begin(), lines.end(), text) != lines.end();
    };
    if (result.moves.empty() && has(start_lines_)) return true;
    ended_ = has(end_lines_);
    return ended_;
  }

  bool read_bas(const Statement& s) {
    if (s.name != "BAS") return false;
    const std::string arguments = packed(s.value);
    if (arguments == "#INITMOV,0") {
      if (result.moves.empty()) return true;
      error(s, "NC323", "BAS(#INITMOV,0) behind a motion changes frames and speeds");
      return true;
    }
    if (arguments.rfind("#VEL_PTP,", 0) == 0) return true;
    return false;
  }

  bool read_variable(const Statement& s) {
    if (s.name == "$BASE" || s.name == "$TOOL") return read_frame(s), true;
    if (s.name.rfind("$LOAD.", 0) == 0) return read_load(s);
    if (s.name == "$VEL.CP") {
      link_speed_ = packed(s.value) == "SP_LINK";
      cp_ = s.number.value_or(0.0);
      if (!link_speed_ && cp_ <= 0.0) error(s, "NC323", "$VEL.CP needs a number above 0");
      return true;
    }
    if (s.name == "$VEL.ORI1" || s.name == "$VEL.ORI2") {
      (s.name.back() == '1' ? ori1_ : ori2_) = s.number.value_or(0.0);
      if (s.number.value_or(0.0) <= 0.0) error(s, "NC323", s.name + " needs a number above 0");
      return true;
    }
    if (s.name == "$IPO_MODE" || s.name == "$ORI_TYPE") {
      const bool mode = s.name == "$IPO_MODE";
      const bool right = packed(s.value) == (mode ? "#BASE" : "#VAR");
      if (!right) error(s, "NC323", s.name + " is another than this program's");
      (mode ? ipo_mode_ : ori_type_) = right;
      return true;
    }
    if (s.name == "$APO.CDIS") {
      cdis_ = s.number;
      if (!(cdis_.value_or(-1.0) >= 0.0)) error(s, "NC323", "$APO.CDIS needs a number from 0 on");
      return true;
    }
    if (s.name == "SP_LINK" || s.name == "$ADVANCE" || s.name == "$APO.CORI") {
      if (!s.number) error(s, "NC323", s.name + " needs a number");
      return true;
    }
    return false;
  }

  static Pose pose_of(const Aggregate& a) {
    Pose pose = Pose::Identity();
    const auto value = [&a](const char* key) { return a.find(key).value_or(0.0); };
    pose.translation() = Vec3(value("X"), value("Y"), value("Z"));
    pose.linear() =
        rotation_from_rpy(radians_from_degrees(value("C")), radians_from_degrees(value("B")),
                          radians_from_degrees(value("A")));
    return pose;
  }

  // A load other than the machine file's is another tool.
  bool read_load(const Statement& s) {
    const auto& load = machine_.tool.load;
    if (!load || !result.moves.empty()) {
      error(s, "NC324",
            s.name + (load ? " changes behind a motion" : ": the machine file has no [tool.load]"));
      return true;
    }
    constexpr double kPrinted = 1e-4;
    bool same = false;
    if (s.name == "$LOAD.M") {
      same = s.number && std::abs(*s.number - load->mass) < kPrinted;
    } else if (s.name == "$LOAD.CM" || s.name == "$LOAD.J") {
      const Vec3& wanted = s.name == "$LOAD.CM" ? load->centre : load->inertia;
      const std::array<const char*, 3> keys = {"X", "Y", "Z"};
      same = true;
      for (std::size_t i = 0; i < 3; ++i) {
        const auto value = s.aggregate.find(keys[i]);
        same = same && value && std::abs(*value - wanted[static_cast<int>(i)]) < kPrinted;
      }
    } else {
      return false;
    }
    if (!same) error(s, "NC324", s.name + " is not the load of machine " + machine_.name);
    return true;
  }

  void read_frame(const Statement& s) {
    const bool base = s.name == "$BASE";
    for (const char* key : {"X", "Y", "Z", "A", "B", "C"})
      if (!s.aggregate.find(key)) return error(s, "NC324", s.name + " has no value " + key);
    if (s.aggregate.values.size() != 6)
      return error(s, "NC324", s.name + " has values besides X, Y, Z, A, B, C");
    const Pose pose = pose_of(s.aggregate);
    auto& known = base ? base_ : tool_;
    if (known && !known->isApprox(pose, 1e-12))
      return error(s, "NC324", s.name + " changes within the program");
    known = pose;
    if (!base) check_tool(s, pose);
  }

  // The tool of the machine file may be longer or shorter along its axis, nothing else.
  void check_tool(const Statement& s, const Pose& tool) {
    const Pose in_machine = machine_.tool.flange * tool;
    const Vec3 shift = machine_.tool.tip - in_machine.translation();
    tool_length_ = shift.dot(machine_.tool.axis);
    const double aside = (shift - tool_length_ * machine_.tool.axis).norm();
    const double turned = rotation_log(in_machine.linear()).norm();
    constexpr double kMostAside = 1e-3;  // mm
    const double most_turned = radians_from_degrees(1e-4);
    if (aside > kMostAside || turned > most_turned)
      error(s, "NC324",
            "$TOOL is not the tool of machine " + machine_.name +
                ": [tool] tip_mm, axis and flange of the machine file give another frame");
  }

  int joint_named(const std::string& key) const { return machine_.axis_by_name(key); }

  // Takes the joints that a target names; false when one is not of this machine.
  bool take_joints(const Statement& s, ReadBackMove& move) {
    for (const auto& [key, value] : s.aggregate.values) {
      if (key.size() != 2) continue;  // X Y Z A B C
      const int j = joint_named(key);
      if (j < 0)
        return error(s, "NC323", "machine " + machine_.name + " has no axis " + key), false;
      const bool rotary =
          machine_.axes[static_cast<std::size_t>(j)].joint.kind == JointKind::rotary;
      joints_[j] = rotary ? radians_from_degrees(value) : value;
      move.to[j] = joints_[j];
      known_ |= 1U << j;
    }
    return true;
  }

  void begin_motion(const Statement& s, ReadBackMove& move) {
    if (ended_) error(s, "NC323", "a motion stands behind the last lines of the machine file");
    if (!base_ || !tool_) moved_without_frames_ = true;
    move.line = s.line;
    move.to = JointVector::Zero(machine_.size());
  }

  // Events at the start point.
  void start_triggers(ReadBackMove& move) {
    for (const Statement* trigger : pending_) {
      if (trigger->distance != 0) continue;
      if (trigger->path != 0.0 || trigger->number != 0.0)
        error(*trigger, "NC323",
              "a TRIGGER at the start of a motion has another DELAY or PATH than 0");
      read_trigger(*trigger);
    }
    move.beam = beam_;
  }

  void read_trigger(const Statement& s) {
    if (const auto event = events_.find(s.body, EventReader::Place::on_the_fly))
      return add_event(s, *event, 0.0);
    error(s, "NC323", "the machine's process table has no event for " + s.body.substr(0, 64));
  }

  // Events before the end point, in the order in which they happen.
  std::vector<WayEvent> way_triggers(const ReadBackMove& move) {
    std::vector<WayEvent> events;
    for (const Statement* trigger : pending_) {
      if (trigger->distance == 0) continue;
      const double delay = *trigger->number;
      if (delay > 0.0 || trigger->path > 0.0 || (delay == 0.0 && trigger->path == 0.0)) {
        error(*trigger, "NC323", "a TRIGGER at the end of a motion needs a DELAY or PATH below 0");
        continue;
      }
      const double length = pose_ ? (move.tool.translation() - pose_->translation()).norm() : 0.0;
      if (move.spline || !(move.duration > 0.0) || !(length > 0.0)) {
        error(*trigger, "NC323", "this TRIGGER needs a LIN with a way and a speed");
        continue;
      }
      constexpr double kMillisecondsPerSecond = 1e3;
      const double share =
          1.0 + delay / kMillisecondsPerSecond / move.duration + trigger->path / length;
      if (share <= 0.0)
        error(*trigger, "NC323", "this TRIGGER would stand before the motion that it belongs to");
      events.push_back({share, trigger});
    }
    std::stable_sort(events.begin(), events.end(),
                     [](const WayEvent& a, const WayEvent& b) { return a.share < b.share; });
    return events;
  }

  void read_joints(const Statement& s) {
    ReadBackMove move;
    begin_motion(s, move);
    if (!s.blend.empty() || rounds_) result.exact_path = false;
    rounds_ = false;
    if (!take_joints(s, move)) return;
    move.to = joints_;
    move.known = known_;
    move.rapid = true;
    way_triggers(move);
    start_triggers(move);
    pending_.clear();
    const JointMask all = (1U << machine_.size()) - 1U;
    pose_.reset();
    if (known_ == all && base_ && tool_) {
      ScrewChain chain = chain_of(machine_, tool_length_);
      chain.workpiece_home = *base_;
      pose_ = forward(chain, joints_);
    }
    result.moves.push_back(std::move(move));
  }

  // LIN or SPL.
  void read_line(const Statement& s) {
    if (!base_ || !tool_ || !ipo_mode_ || !ori_type_)
      return error(s, "NC323",
                   s.name + " stands before $BASE, $TOOL, $IPO_MODE and $ORI_TYPE are set");
    ReadBackMove move;
    begin_motion(s, move);
    if (s.aggregate.find("S") || s.aggregate.find("T"))
      return error(s, "NC323", "S and T have no meaning in " + s.name);
    const JointVector from = joints_;
    const JointMask known_from = known_;
    if (!take_joints(s, move)) return;
    move.interpolation = MoveInterpolation::tool;
    move.tool = pose_of(s.aggregate);
    move.spline = s.name == "SPL";
    for (int j = 0; j < machine_.size(); ++j)
      if (machine_.axes[static_cast<std::size_t>(j)].name[0] == 'A') known_ &= ~(1U << j);
    move.known = known_;
    set_blend(s, move);
    set_time(s, move);
    add_line(move, from, known_from);
    pose_ = move.tool;
  }

  void set_blend(const Statement& s, ReadBackMove& move) {
    rounds_ = !s.blend.empty();
    if (!rounds_) return;
    if (s.blend != "C_DIS") {
      result.exact_path = false;
    } else if (!cdis_) {
      error(s, "NC323", "C_DIS stands before $APO.CDIS is set");
    } else {
      move.blend = *cdis_;
    }
  }

  // The LIN, in pieces where events happen on the way.
  void add_line(const ReadBackMove& whole, const JointVector& from, JointMask known_from) {
    const std::vector<WayEvent> events = way_triggers(whole);
    ReadBackMove rest = whole;
    start_triggers(rest);
    pending_.clear();
    double done = 0.0;
    for (const WayEvent& event : events) {
      if (event.share > done && pose_) {
        if (whole.known & ~known_from)
          return error(*event.trigger, "NC323", "this TRIGGER needs a known start of every axis");
        ReadBackMove piece = rest;
        piece.tool = line_pose(*pose_, whole.tool, event.share);
        for (int j = 0; j < machine_.size(); ++j)
          if (whole.known >> j & 1U) piece.to[j] = from[j] + event.share * (whole.to[j] - from[j]);
        piece.duration = (event.share - done) * whole.duration;
        piece.blend = 0.0;
        result.moves.push_back(std::move(piece));
        done = event.share;
      }
      read_trigger(*event.trigger);
      rest.beam = beam_;
    }
    rest.duration = (1.0 - done) * whole.duration;
    result.moves.push_back(std::move(rest));
  }

  // The slowest of path, swivel and rotation decides; each of the latter is at most the whole turn.
  void set_time(const Statement& s, ReadBackMove& move) {
    const std::optional<double> own = !move.spline ? std::nullopt
                                      : s.speed    ? s.speed
                                                   : block_speed_;
    move.rapid = link_speed_ && !own;
    if (move.rapid && ori1_ > 0.0 && ori2_ > 0.0) return;
    const double cp = own.value_or(cp_);
    if (ori1_ <= 0.0 || ori2_ <= 0.0 || cp <= 0.0)
      return error(s, "NC323", s.name + " stands before $VEL.CP, $VEL.ORI1 and $VEL.ORI2 are set");
    if (!pose_)
      return error(s, "NC323",
                   "a " + s.name + " with a programmed speed starts at an unknown place");
    const double length = (move.tool.translation() - pose_->translation()).norm();
    const double degrees =
        degrees_from_radians(rotation_log(pose_->linear().transpose() * move.tool.linear()).norm());
    constexpr double kMillimetresPerMetre = 1e3;
    const double path = length / (cp * kMillimetresPerMetre);
    move.duration = std::max(path, degrees / std::min(ori1_, ori2_));
  }

  void add_event(const Statement& s, std::string name, double seconds) {
    if (name == event_name::kBeamOn || name == event_name::kPierce) beam_ = true;
    if (name == event_name::kBeamOff) beam_ = false;
    result.events.push_back({result.moves.size(), std::move(name), seconds, beam_, s.line});
  }

  const MachineDefinition& machine_;
  const std::string& file_;
  EventReader events_;
  std::vector<std::string> start_lines_;
  std::vector<std::string> end_lines_;
  bool ended_ = false;
  std::vector<const Statement*> pending_;  // triggers of the next motion
  std::optional<Pose> base_;
  std::optional<Pose> tool_;
  std::optional<Pose> pose_;
  double tool_length_ = 0.0;
  std::optional<double> cdis_;
  std::optional<double> block_speed_;  // of the open SPLINE
  bool rounds_ = false;                // at the end of the last motion
  double cp_ = 0.0;
  double ori1_ = 0.0;
  double ori2_ = 0.0;
  bool link_speed_ = false;
  bool ipo_mode_ = false;
  bool ori_type_ = false;
  bool moved_without_frames_ = false;
  bool beam_ = false;
  JointVector joints_;
  JointMask known_ = 0;
};

}  // namespace

Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name) {
  return read_with<Reading>(machine, file_name, parse(text, file_name));
}

}  // namespace smoothpost::krl
