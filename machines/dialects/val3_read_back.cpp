#include <algorithm>
#include <cmath>
#include <map>

#include "kernels/core/units.h"
#include "machines/dialects/robot_program.h"
#include "machines/dialects/val3.h"

namespace smoothpost::val3 {

namespace {

/// A motion descriptor: what a motion with it does.
struct MotionSpeed {
  std::map<std::string, double> numbers;  ///< accel, vel, decel (percent), tvel, rvel, leave, reach
  std::string blend;

  bool is_complete() const { return numbers.size() == 7 && !blend.empty(); }
  double at(const char* name) const { return numbers.at(name); }
};

constexpr std::array<const char*, 7> kSpeedFields = {"accel", "vel",   "decel", "tvel",
                                                     "rvel",  "leave", "reach"};

/// The six numbers of "{..}"; nothing when it is not that.
std::optional<std::array<double, 6>> list_of(std::string_view text) {
  if (text.size() < 2 || text.front() != '{' || text.back() != '}') return std::nullopt;
  text = text.substr(1, text.size() - 2);
  std::array<double, 6> values{};
  for (std::size_t i = 0; i < 6; ++i) {
    const auto end = i < 5 ? text.find(',') : text.size();
    if (end == std::string_view::npos) return std::nullopt;
    const auto value = whole_number(text.substr(0, end));
    if (!value) return std::nullopt;
    values[i] = *value;
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return values;
}

Pose pose_of(const std::array<double, 6>& values) {
  const auto turn = [&values](const Vec3& axis, std::size_t i) {
    return rotation_about(axis, radians_from_degrees(values[i]));
  };
  Pose pose = Pose::Identity();
  pose.translation() = Vec3(values[0], values[1], values[2]);
  pose.linear() = turn(Vec3::UnitX(), 3) * turn(Vec3::UnitY(), 4) * turn(Vec3::UnitZ(), 5);
  return pose;
}

class Reading : public robot::RobotReading {
 public:
  Reading(const MachineDefinition& machine, const std::string& file)
      : RobotReading(machine, file, "NC347", "NC348") {}

  void run(std::string_view text) {
    const auto lines = text_lines(text);
    result.line_count = static_cast<std::uint32_t>(lines.size());
    const auto begin = read_frame(lines);
    if (!begin) return;
    const std::size_t end = lines.size() - 3;
    for (std::size_t i = *begin; i < end; ++i)
      read({static_cast<std::uint32_t>(i + 1), 1}, lines[i]);
    result.last_line = static_cast<std::uint32_t>(end + 1);
    const TextPlace last{result.last_line, 1};
    if (rounded()) error(last, "the last corner is rounded");
    if (moving_) error(last, "the program ends before its last motion has");
    result.offset_guard = has_frames();
  }

 private:
  bool rounded() const { return !result.moves.empty() && result.moves.back().blend > 0.0; }

  // The XML around the code, and the local variables. Index of the first line of code.
  std::optional<std::size_t> read_frame(const std::vector<std::string_view>& lines) {
    static constexpr std::array<std::array<const char*, 2>, 9> kLocals = {{{"fPart", "frame"},
                                                                           {"tTip", "tool"},
                                                                           {"pTo", "pointRx"},
                                                                           {"jTo", "jointRx"},
                                                                           {"mFirst", "mdesc"},
                                                                           {"mLink", "mdesc"},
                                                                           {"mJoint", "mdesc"},
                                                                           {"mMove", "mdesc"},
                                                                           {"nKey", "num"}}};
    std::vector<std::string> head = {
        "<?xml version=\"1.0\" encoding=\"utf-8\" ?>",
        "<Programs xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" "
        "xmlns=\"http://www.staubli.com/robotics/VAL3/Program/2\">",
        "<Program name=\"smoothpost\">", "<Locals>"};
    for (const auto& [name, type] : kLocals)
      head.push_back(std::string("<Local name=\"") + name + "\" type=\"" + type +
                     "\" xsi:type=\"array\" size=\"1\" />");
    head.emplace_back("</Locals>");
    head.emplace_back("<Code><![CDATA[begin");
    const std::array<const char*, 3> foot = {"end]]></Code>", "</Program>", "</Programs>"};
    for (std::size_t i = 0; i < head.size(); ++i)
      if (i >= lines.size() || trimmed(lines[i]) != head[i])
        return error({static_cast<std::uint32_t>(i + 1), 1}, "NC346", "expected " + head[i]),
               std::nullopt;
    for (std::size_t i = 0; i < foot.size(); ++i) {
      const std::size_t at = lines.size() - foot.size() + i;
      if (lines.size() < head.size() + foot.size() || trimmed(lines[at]) != foot[i])
        return error({std::max(1U, result.line_count), 1}, "NC346",
                     std::string("the program has to end with ") + foot[i]),
               std::nullopt;
    }
    return head.size();
  }

  void read(TextPlace at, std::string_view line) {
    for (const char c : line)
      if (static_cast<unsigned char>(c) < 0x20U || static_cast<unsigned char>(c) > 0x7EU)
        return error(at, "NC346", "a character outside printable ASCII");
    if (line.find("]]>") != std::string_view::npos)
      return error(at, "NC346", "]]> ends the code before its last line");
    const std::string_view text = trimmed(line);
    if (text.empty() || text.substr(0, 2) == "//") return;
    if (read_motion(at, text) || read_setting(at, text)) return;
    if (text == "waitEndMove()") {
      if (rounded()) error(at, "the robot stops at a corner that the motion in front of it rounds");
      moving_ = false;
      return;
    }
    if (moving_)
      return error(at, "this statement acts before the motion in front of it has ended: " +
                           std::string(text.substr(0, 64)));
    if (read_delay(at, text) || read_event(at, text) || is_own_line(text)) return;
    const bool stop = text == "putln(\"NOT CERTIFIED: read the report, then press a key\")" ||
                      text == "nKey=get()";
    if (stop && result.moves.empty()) return;
    error(at, "this statement is neither one of ours nor in the machine's process table: " +
                  std::string(text.substr(0, 64)));
  }

  bool read_delay(TextPlace at, std::string_view text) {
    if (text.substr(0, 6) != "delay(" || text.back() != ')') return false;
    const auto seconds = whole_number(text.substr(6, text.size() - 7));
    if (!seconds || *seconds < 0.0) return error(at, "NC346", "delay needs its seconds"), true;
    add_event(at, "dwell", *seconds);
    return true;
  }

  // ---- settings: name=value and link(). False when it is another statement.

  bool read_setting(TextPlace at, std::string_view text) {
    for (const auto& [link, done] : {std::pair{"link(fPart,world)", &part_linked_},
                                     std::pair{"link(tTip,flange)", &tool_linked_},
                                     std::pair{"link(pTo,fPart)", &target_linked_}})
      if (text == link) return *done = true;
    if (text == "pTo.config={ssame,esame,wsame}") return same_configuration_ = true;
    const auto equals = text.find('=');
    if (equals == std::string_view::npos) return false;
    const std::string_view name = text.substr(0, equals), value = text.substr(equals + 1);
    if (name == "fPart.trsf" || name == "tTip.trsf" || name == "pTo.trsf" || name == "jTo") {
      const auto values = list_of(value);
      if (!values)
        return error(at, "NC346", std::string(name) + " needs {..} of six numbers"), true;
      if (name == "jTo") return joints_to_ = *values, true;
      if (name == "pTo.trsf") return pose_to_ = pose_of(*values), true;
      return name[0] == 'f' ? set_part(at, pose_of(*values)) : set_tool(at, pose_of(*values)), true;
    }
    const auto dot = name.find('.');
    const auto speed = dot == std::string_view::npos
                           ? speeds_.end()
                           : speeds_.find(std::string(name.substr(0, dot)));
    return speed != speeds_.end() && read_speed(at, speed->second, name.substr(dot + 1), value);
  }

  bool read_speed(TextPlace at, MotionSpeed& speed, std::string_view field,
                  std::string_view value) {
    if (field == "blend") {
      if (value != "off" && value != "Cartesian")
        return error(at, "NC346", "blend is off or Cartesian: others have no bound"), true;
      speed.blend = value;
      return true;
    }
    if (std::find(kSpeedFields.begin(), kSpeedFields.end(), field) == kSpeedFields.end())
      return false;
    const auto number = whole_number(value);
    const bool distance = field == "leave" || field == "reach";
    const bool percent = field == "vel" || field == "accel" || field == "decel";
    if (!number || *number < 0.0 || (!distance && *number == 0.0) || (percent && *number > 100.0))
      return error(at, "NC346", "a speed is above 0, and at most 100 where it is a share"), true;
    speed.numbers[std::string(field)] = *number;
    return true;
  }

  // ---- motions; false when it is another statement

  bool read_motion(TextPlace at, std::string_view text) {
    for (const bool joints : {true, false}) {
      const std::string head = joints ? "movej(jTo,tTip," : "movel(pTo,tTip,";
      if (text.substr(0, head.size()) != head || text.back() != ')') continue;
      const std::string name(text.substr(head.size(), text.size() - head.size() - 1));
      const auto speed = speeds_.find(name);
      if (speed == speeds_.end() || !speed->second.is_complete())
        return error(at, "the speed of this motion is unknown or not set whole"), true;
      if (!part_linked_ || !tool_linked_ || !has_frames())
        return error(at, "NC348", "a motion stands before frame and tool are linked and set"), true;
      joints ? read_joints(at, name, speed->second) : read_line(at, name, speed->second);
      moving_ = true;
      return true;
    }
    return false;
  }

  void read_joints(TextPlace at, const std::string& name, const MotionSpeed& speed) {
    if (!joints_to_) return error(at, "jTo has no value yet");
    if (speed.blend != "off") return error(at, "a joint motion is blended: its way is not known");
    for (std::size_t i = 0; i < 6; ++i)
      set_joint(axes().arm[i], radians_from_degrees((*joints_to_)[i]));
    add_joint_move(at, name == "mJoint" ? seconds_at(speed.at("vel")) : std::nullopt);
  }

  void read_line(TextPlace at, const std::string& name, const MotionSpeed& speed) {
    if (name != "mMove" && name != "mLink")
      return error(at, "a straight motion goes with mMove or mLink");
    if (!pose_to_) return error(at, "pTo has no value yet");
    if (!target_linked_ || !same_configuration_)
      return error(at, "NC348", "pTo is not linked to fPart, or may change the configuration");
    const bool blended = speed.blend != "off";
    if (speed.at("leave") != speed.at("reach") || blended != (speed.at("leave") > 0.0) ||
        (blended && name != "mMove"))
      return error(at, "leave and reach have to be the same, above 0 with a blend and 0 without");
    LineSpeed line;
    if (name == "mMove") {
      line.tip = speed.at("tvel");
      line.turn = radians_from_degrees(speed.at("rvel"));
    }
    add_line_move(at, *pose_to_, line, speed.at("leave"));
  }

  std::map<std::string, MotionSpeed> speeds_ = {
      {"mFirst", {}}, {"mLink", {}}, {"mJoint", {}}, {"mMove", {}}};
  std::optional<Pose> pose_to_;
  std::optional<std::array<double, 6>> joints_to_;
  bool part_linked_ = false;
  bool tool_linked_ = false;
  bool target_linked_ = false;
  bool same_configuration_ = false;
  bool moving_ = false;
};

}  // namespace

Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name) {
  return read_with<Reading>(machine, file_name, text);
}

}  // namespace smoothpost::val3
