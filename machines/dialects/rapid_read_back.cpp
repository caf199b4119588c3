#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "formats/robot/rapid_reader.h"
#include "kernels/core/units.h"
#include "kernels/kinematics/screw_chain.h"
#include "machines/dialects/event_text.h"
#include "machines/dialects/program_reading.h"
#include "machines/dialects/rapid.h"
#include "machines/dialects/rapid_text.h"

namespace smoothpost::rapid {

namespace {

constexpr double kUnused = 9e9;  // of an external axis
constexpr int kMostCalls = 1000;
constexpr std::size_t kMostModes = 1000;

Vec3 vector_of(const Value& v) { return {v.items[0].number, v.items[1].number, v.items[2].number}; }

Pose pose_of(const Value& position, const Value& orientation) {
  const auto& q = orientation.items;
  Pose pose = Pose::Identity();
  pose.translation() = vector_of(position);
  pose.linear() = Eigen::Quaterniond(q[0].number, q[1].number, q[2].number, q[3].number)
                      .normalized()
                      .toRotationMatrix();
  return pose;
}

struct Speed {
  double tip = 0.0;
  double orientation = 0.0;
  double linear = 0.0;
  double rotary = 0.0;
};

/// Follows the statements as RobotWare would, for one machine.
class Reading {
 public:
  Reading(const MachineDefinition& machine, const std::string& file)
      : machine_(machine), file_(file), axes_(robot_axes(machine)), events_(rows_of(machine)) {
    joints_ = JointVector::Zero(machine.size());
    start_lines_ = packed_lines(machine.dialect.start);
    end_lines_ = packed_lines(machine.dialect.end);
  }

  void run(const RapidProgram& program) {
    result.exact_path = true;  // every zone is fine or has its radius in the text
    result.line_count = program.line_count;
    result.last_line = program.end_line;
    for (const auto& d : program.declarations) data_[d.name] = &d;
    for (const auto& p : program.procedures) procedures_[p.name] = &p;
    const auto main = procedures_.find("MAIN");
    if (main == procedures_.end() || !axes_.has_arm() || !axes_.unnamed.empty()) {
      Statement top;
      top.line = top.column = 1;
      return error(top, "NC333",
                   main == procedures_.end()
                       ? "the module has no PROC main"
                       : "machine " + machine_.name + " is no arm with axes A1 to A6 and E1 to E6");
    }
    called_.insert("MAIN");
    follow(*main->second);
    for (const auto& p : program.procedures) {
      Statement at;
      at.line = p.line;
      at.column = 1;
      if (called_.count(p.name) == 0) error(at, "NC333", "PROC " + p.name + " is never called");
    }
    result.offset_guard = !unguarded_;
  }

  ReadBack result;
  Diagnostics diagnostics;

 private:
  // A ; at the end of a row is none of its words.
  static ProcessTable rows_of(const MachineDefinition& machine) {
    ProcessTable table = machine.process;
    for (auto& row : table.events)
      while (!row.text.empty() && (row.text.back() == ';' || row.text.back() == ' '))
        row.text.pop_back();
    return table;
  }

  static std::set<std::string> packed_lines(const std::vector<std::string>& lines) {
    std::string text = "MODULE m PROC main()\n";
    for (const auto& line : lines) text += line + "\n";
    std::set<std::string> out;
    for (const auto& p : parse(text + "ENDPROC ENDMODULE", "").program.procedures)
      for (const auto& s : p.statements) out.insert(packed_statement(s.text));
    return out;
  }

  void error(const Statement& at, const char* code, std::string text) {
    Diagnostic d;
    d.code = code;
    d.text = std::move(text);
    d.where = {file_, static_cast<int>(at.line), static_cast<int>(at.column)};
    diagnostics.push_back(std::move(d));
  }

  // ---- statements

  void follow(const Procedure& procedure) {
    for (const auto& s : procedure.statements) {
      if (s.kind != Statement::Kind::procedure || procedures_.count(s.name) == 0)
        read(s);
      else if (call(s))
        follow(*procedures_.find(s.name)->second);
    }
  }

  // Every procedure runs once, but for the modes, which call no other.
  bool call(const Statement& s) {
    const bool modes = s.name == "SPMODES";
    if (!s.arguments.empty()) return error(s, "NC333", "a PROC has no arguments here"), false;
    if (!called_.insert(s.name).second && !modes)
      return error(s, "NC333", "PROC " + s.name + " is called twice"), false;
    if (called_.size() > static_cast<std::size_t>(kMostCalls))
      return error(s, "NC333", "too many PROCs"), false;
    if (!modes) return true;
    const auto& statements = procedures_.find(s.name)->second->statements;
    const bool plain =
        statements.size() <= kMostModes &&
        std::all_of(statements.begin(), statements.end(), [this](const Statement& m) {
          return m.kind == Statement::Kind::mode || m.kind == Statement::Kind::trigger ||
                 (m.kind == Statement::Kind::procedure && procedures_.count(m.name) == 0);
        });
    if (!plain) error(s, "NC333", "spModes holds more than modes and triggers");
    return plain;
  }

  void read(const Statement& s) {
    switch (s.kind) {
      case Statement::Kind::move:
        return s.name == "MOVEABSJ" ? read_joints(s) : read_line(s);
      case Statement::Kind::trigger:
        return read_trigger(s);
      case Statement::Kind::mode:
        return read_mode(s);
      case Statement::Kind::wait:
        needs_stop(s);
        return add_event(s, "dwell", s.positional(0)->number);
      case Statement::Kind::stop:
        break;
      case Statement::Kind::procedure:
        if (read_offsets(s)) return;
        break;
    }
    read_other(s);
  }

  void read_mode(const Statement& s) {
    if (!s.has("OFF"))
      return error(s, "NC333", s.name + " is on: the motion is not that of this program");
    modes_.insert(s.name);
  }

  bool read_offsets(const Statement& s) {
    if (s.name == "PDISPOFF" || s.name == "EOFFSOFF") {
      if (!s.arguments.empty()) error(s, "NC333", s.name + " has no arguments here");
      modes_.insert(s.name);
      return true;
    }
    if (s.name == "TPWRITE" && packed_statement(s.text).rfind("TPWRITE\"NOT CERTIFIED", 0) == 0)
      return true;
    if (s.name != "VELSET") return false;
    const Value* percent = s.positional(0);
    const Value* most = s.positional(1);
    const bool good = s.arguments.size() == 2 && percent != nullptr && most != nullptr &&
                      percent->kind == Value::Kind::number && percent->number == 100.0 &&
                      most->kind == Value::Kind::number && most->number > 0.0;
    if (!good) return error(s, "NC333", "VelSet needs 100 and a speed"), true;
    largest_speed_ = most->number;
    modes_.insert(s.name);
    return true;
  }

  // What runs while the program is read ahead has to have a robot that stands.
  void needs_stop(const Statement& s) {
    if (!result.moves.empty() && result.moves.back().blend > 0.0)
      error(s, "NC333", "this statement acts before the robot is through the zone in front of it");
  }

  // Words of the process table, of the machine file's first and last lines, and the stop.
  void read_other(const Statement& s) {
    needs_stop(s);
    if (const auto event = events_.find(s.text, EventReader::Place::stop))
      return add_event(s, *event, 0.0);
    if (s.kind == Statement::Kind::stop) return;
    const std::string packed = packed_statement(s.text);
    if (result.moves.empty() && start_lines_.count(packed) > 0) return;
    if (end_lines_.count(packed) > 0) {
      ended_ = true;
      return;
    }
    error(s, "NC333",
          "this statement is neither one of ours nor in the machine's process table: " +
              s.text.substr(0, 64));
  }

  // ---- triggers

  void read_trigger(const Statement& s) {
    const std::string& name = s.positional(0)->text;
    const auto declared = data_.find(name);
    if (declared == data_.end() || declared->second->type != "TRIGGDATA")
      return error(s, "NC333", name + " is no triggdata of this module");
    if (s.positional(1)->number != 0.0 || !s.has("START"))
      return error(s, "NC333", "only triggers at 0\\Start are ours");
    const bool equipment = s.name == "TRIGGEQUIP";
    if (equipment && s.positional(2)->number != 0.0)
      return error(s, "NC333", "a trigger with a lag of its equipment is not one of ours");
    for (const char* option : {"DOP", "GOP", "AOP"}) {
      const Value* signal = s.find(option);
      if (signal == nullptr) continue;
      const std::string words = std::string("SET") + option[0] + "O " + signal->text + "," +
                                s.text.substr(s.text.rfind(',') + 1);
      const auto event = events_.find(words, EventReader::Place::on_the_fly);
      if (!event) return error(s, "NC333", "the machine's process table has no event for " + words);
      triggers_[name] = *event;
    }
  }

  void take_triggers(const Statement& s) {
    std::vector<const Value*> names = {s.positional(2)};
    for (const char* option : {"T2", "T3", "T4", "T5", "T6", "T7", "T8"})
      if (const Value* name = s.find(option)) names.push_back(name);
    for (const Value* name : names) {
      const auto trigger = triggers_.find(name->text);
      if (trigger == triggers_.end())
        error(s, "NC333", "trigger " + name->text + " is not set before");
      else
        add_event(s, trigger->second, 0.0);
    }
  }

  // ---- data

  // The literal of an argument: written there, or of a declaration with that type.
  const Value* literal(const Statement& s, const Value& value, const char* type) {
    if (value.kind == Value::Kind::aggregate) return &value;
    const auto found = data_.find(value.text);
    if (found != data_.end() && found->second->type == type) return &*found->second->value;
    error(s, "NC333", value.text + " is no " + type + " of this module");
    return nullptr;
  }

  bool take_speed(const Statement& s, const Value& value, Speed& speed) {
    const Value* v = literal(s, value, "SPEEDDATA");
    if (v == nullptr) return false;
    speed = {v->items[0].number, v->items[1].number, v->items[2].number, v->items[3].number};
    if (speed.tip <= 0.0 || speed.orientation <= 0.0 || speed.linear <= 0.0 || speed.rotary <= 0.0)
      return error(s, "NC333", "speed data have to be above 0"), false;
    if (modes_.count("VELSET") > 0 && speed.tip > largest_speed_)
      return error(s, "NC333", "a speed is above that of VelSet"), false;
    return true;
  }

  bool take_zone(const Statement& s, const Value& value, double& blend) {
    blend = 0.0;
    if (value.kind == Value::Kind::name && value.text == "FINE") return true;
    const Value* v = literal(s, value, "ZONEDATA");
    if (v == nullptr) return false;
    for (std::size_t i = 1; i < 7; ++i)
      if (v->items[i].number < 0.0) return error(s, "NC333", "a zone has a negative number"), false;
    if (v->items[0].number != 0.0) return true;
    // The largest of tip, rotation and external axes: none begins farther from the corner.
    for (std::size_t i = 1; i < 4; ++i) blend = std::max(blend, v->items[i].number);
    return true;
  }

  // Tool and work object: the same in the whole program.
  bool take_frames(const Statement& s, std::size_t tool_place) {
    const Value* work = s.find("WOBJ");
    if (work == nullptr) return error(s, "NC334", "a motion names no work object"), false;
    const std::string frames = s.positional(tool_place)->text + " " + work->text;
    if (!frames_.empty() && frames != frames_)
      return error(s, "NC334", "tool or work object change within the program"), false;
    if (!frames_.empty()) return result.part && result.tool_frame;
    frames_ = frames;
    const Value* tool = literal(s, *s.positional(tool_place), "TOOLDATA");
    const Value* object = literal(s, *work, "WOBJDATA");
    if (tool == nullptr || object == nullptr) return false;
    return set_tool(s, *tool) && set_part(s, *object);
  }

  bool set_part(const Statement& s, const Value& object) {
    if (object.items[0].number != 0.0 || object.items[1].number != 1.0 ||
        !object.items[2].text.empty())
      return error(s, "NC334", "the work object is held by the robot or moved by an axis"), false;
    result.part = pose_of(object.items[3].items[0], object.items[3].items[1]) *
                  pose_of(object.items[4].items[0], object.items[4].items[1]);
    return true;
  }

  // The tool of the machine file may be longer or shorter along its axis, nothing else.
  bool set_tool(const Statement& s, const Value& tool) {
    if (tool.items[0].number != 1.0)
      return error(s, "NC334", "the tool is not held by the robot"), false;
    if (tool.items[2].items[0].number <= 0.0)
      return error(s, "NC334", "the load of the tool has no mass"), false;
    const Pose frame = pose_of(tool.items[1].items[0], tool.items[1].items[1]);
    const Pose in_machine = machine_.tool.flange * frame;
    const Vec3 shift = machine_.tool.tip - in_machine.translation();
    tool_length_ = shift.dot(machine_.tool.axis);
    const double aside = (shift - tool_length_ * machine_.tool.axis).norm();
    constexpr double kMostAside = 1e-3;  // mm
    if (aside > kMostAside || rotation_log(in_machine.linear()).norm() > radians_from_degrees(1e-4))
      return error(s, "NC334",
                   "the tooldata are not of the tool of machine " + machine_.name +
                       ": [tool] tip_mm, axis and flange of the machine file give another frame"),
             false;
    result.tool_frame = frame;
    return true;
  }

  // ---- motions

  bool begin_motion(const Statement& s, ReadBackMove& move) {
    if (ended_) error(s, "NC333", "a motion stands behind the last lines of the machine file");
    for (const char* mode : {"CONFL", "CONFJ", "SINGAREA"})
      if (modes_.count(mode) == 0)
        return error(s, "NC333", std::string("a motion stands before ") + mode + "\\Off"), false;
    for (const char* mode : {"PDISPOFF", "EOFFSOFF", "VELSET"})
      if (modes_.count(mode) == 0) unguarded_ = true;
    const std::size_t zone = s.name == "TRIGGL" ? 3 : 2;
    if (!take_frames(s, zone + 1)) return false;
    if (!take_zone(s, *s.positional(zone), move.blend)) return false;
    if (s.name == "TRIGGL") take_triggers(s);
    move.line = s.line;
    move.beam = beam_;
    move.to = JointVector::Zero(machine_.size());
    return true;
  }

  void set_joint(int j, double value) {
    const bool rotary = machine_.axes[static_cast<std::size_t>(j)].joint.kind == JointKind::rotary;
    joints_[j] = rotary ? radians_from_degrees(value) : value;
    known_ |= 1U << j;
  }

  bool take_external(const Statement& s, const Value& values) {
    for (std::size_t i = 0; i < 6; ++i) {
      const int j = axes_.external[i];
      const double value = values.items[i].number;
      if ((j < 0) != (value == kUnused))
        return error(s, "NC333",
                     j < 0 ? "a value for an external axis that machine " + machine_.name +
                                 " does not have"
                           : "an external axis has no value"),
               false;
      if (j >= 0) set_joint(j, value);
    }
    return true;
  }

  void read_joints(const Statement& s) {
    ReadBackMove move;
    Speed speed;
    if (!begin_motion(s, move) || !take_speed(s, *s.positional(1), speed)) return;
    const Value* target = literal(s, *s.positional(0), "JOINTTARGET");
    if (target == nullptr || !take_external(s, target->items[1])) return;
    for (std::size_t i = 0; i < 6; ++i) set_joint(axes_.arm[i], target->items[0].items[i].number);
    if (!s.has("NOEOFFS")) unguarded_ = true;
    move.to = joints_;
    move.known = known_;
    const Value* time = s.find("T");
    move.rapid = time == nullptr;
    if (time != nullptr) move.duration = time->number;
    ScrewChain chain = chain_of(machine_, tool_length_);
    chain.workpiece_home = *result.part;
    pose_ = forward(chain, joints_);
    last_joints_ = joints_;
    result.moves.push_back(std::move(move));
  }

  bool is_configuration(const Value& values) const {
    constexpr double kMost = 100.0;
    for (std::size_t i = 0; i < 4; ++i) {
      const double n = values.items[i].number;
      const bool whole = std::abs(n) < kMost && n == std::floor(n);
      if (!whole || (i == 3 && (n < 0.0 || n > 7.0))) return false;
    }
    return true;
  }

  void read_line(const Statement& s) {
    ReadBackMove move;
    Speed speed;
    if (!begin_motion(s, move) || !take_speed(s, *s.positional(1), speed)) return;
    const Value* target = literal(s, *s.positional(0), "ROBTARGET");
    if (target == nullptr || !take_external(s, target->items[3])) return;
    if (!is_configuration(target->items[2]))
      return error(s, "NC333", "configuration data are whole numbers, the last from 0 to 7");
    if (!pose_) return error(s, "NC333", "the first motion has to be MoveAbsJ");
    move.interpolation = MoveInterpolation::tool;
    move.tool = pose_of(target->items[0], target->items[1]);
    for (const int j : axes_.arm) known_ &= ~(1U << j);
    for (const int j : axes_.external)
      if (j >= 0) move.to[j] = joints_[j];
    move.known = known_;
    set_time(s, speed, move);
    pose_ = move.tool;
    last_joints_ = joints_;
    result.moves.push_back(std::move(move));
  }

  // The slowest of tip, rotation and external axes decides.
  void set_time(const Statement& s, const Speed& speed, ReadBackMove& move) {
    if (const Value* time = s.find("T")) {
      move.duration = time->number;
      return;
    }
    const Value& name = *s.positional(1);
    move.rapid = name.kind == Value::Kind::name && name.text == "SPLINK";
    if (move.rapid) return;
    const double length = (move.tool.translation() - pose_->translation()).norm();
    const double degrees =
        degrees_from_radians(rotation_log(pose_->linear().transpose() * move.tool.linear()).norm());
    move.duration = std::max(length / speed.tip, degrees / speed.orientation);
    for (const int j : axes_.external) {
      if (j < 0) continue;
      const double way = std::abs(joints_[j] - last_joints_[j]);
      const bool rotary =
          machine_.axes[static_cast<std::size_t>(j)].joint.kind == JointKind::rotary;
      move.duration = std::max(
          move.duration, rotary ? degrees_from_radians(way) / speed.rotary : way / speed.linear);
    }
  }

  void add_event(const Statement& s, std::string name, double seconds) {
    if (name == event_name::kBeamOn || name == event_name::kPierce) beam_ = true;
    if (name == event_name::kBeamOff) beam_ = false;
    result.events.push_back({result.moves.size(), std::move(name), seconds, beam_, s.line});
  }

  const MachineDefinition& machine_;
  const std::string& file_;
  RobotAxes axes_;
  EventReader events_;
  std::set<std::string> start_lines_;
  std::set<std::string> end_lines_;
  std::map<std::string, const Declaration*> data_;
  std::map<std::string, const Procedure*> procedures_;
  std::set<std::string> called_;
  std::set<std::string> modes_;                  // that were set
  std::map<std::string, std::string> triggers_;  // triggdata to event
  std::string frames_;                           // names of tool and work object
  double largest_speed_ = 0.0;
  double tool_length_ = 0.0;
  bool ended_ = false;
  bool unguarded_ = false;
  bool beam_ = false;
  std::optional<Pose> pose_;
  JointVector joints_;
  JointVector last_joints_;
  JointMask known_ = 0;
};

}  // namespace

Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name) {
  return read_with<Reading>(machine, file_name, parse(text, file_name));
}

}  // namespace smoothpost::rapid
