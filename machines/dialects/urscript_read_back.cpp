#include <algorithm>
#include <array>
#include <cmath>

#include "machines/dialects/robot_program.h"
#include "machines/dialects/urscript.h"

namespace smoothpost::urscript {

namespace {

constexpr double kMillimetresPerMetre = 1e3;

/// An argument of a call: a number, [..], p[..], or the target pose_trans(sp_part, p[..]).
struct Argument {
  enum class Kind { number, list, pose, target, other } kind = Kind::other;
  std::string name;  ///< of a=1.2
  double number = 0.0;
  std::vector<double> numbers;
};

struct Call {
  std::string name;
  std::vector<Argument> arguments;

  const Argument* named(std::string_view name_wanted) const {
    for (const auto& a : arguments)
      if (a.name == name_wanted) return &a;
    return nullptr;
  }
  /// Whether the arguments are one of `kind` and then numbers with these names, in this order.
  bool is(Argument::Kind kind, std::initializer_list<const char*> names) const {
    if (arguments.size() != names.size() + 1 || arguments[0].kind != kind ||
        !arguments[0].name.empty())
      return false;
    std::size_t i = 1;
    for (const char* name_wanted : names) {
      const Argument& a = arguments[i++];
      if (a.kind != Argument::Kind::number || a.name != name_wanted) return false;
    }
    return true;
  }
};

/// The parts of `text` between commas that stand in no bracket and no quotes. Nothing when brackets
/// or quotes do not match.
std::optional<std::vector<std::string_view>> split(std::string_view text) {
  std::vector<std::string_view> parts;
  int depth = 0;
  bool quoted = false;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '"') quoted = !quoted;
    if (quoted) continue;
    if (c == '(' || c == '[') ++depth;
    if ((c == ')' || c == ']') && --depth < 0) return std::nullopt;
    if (c == ',' && depth == 0) {
      parts.push_back(trimmed(text.substr(begin, i - begin)));
      begin = i + 1;
    }
  }
  if (depth != 0 || quoted) return std::nullopt;
  parts.push_back(trimmed(text.substr(begin)));
  return parts;
}

bool is_name(std::string_view text) {
  return !text.empty() && !(text[0] >= '0' && text[0] <= '9') &&
         std::all_of(text.begin(), text.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                  c == '_';
         });
}

/// The numbers of "[..]"; nothing when it is not that.
std::optional<std::vector<double>> list_of(std::string_view text) {
  if (text.size() < 2 || text.front() != '[' || text.back() != ']') return std::nullopt;
  const auto parts = split(text.substr(1, text.size() - 2));
  if (!parts) return std::nullopt;
  std::vector<double> numbers;
  for (const auto part : *parts) {
    const auto number = whole_number(part);
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

Argument argument_of(std::string_view text) {
  Argument a;
  const auto equals = text.find('=');
  if (equals != std::string_view::npos && is_name(trimmed(text.substr(0, equals)))) {
    a.name = trimmed(text.substr(0, equals));
    text = trimmed(text.substr(equals + 1));
  }
  constexpr std::string_view kTarget = "pose_trans(sp_part,";
  const bool target = text.substr(0, kTarget.size()) == kTarget && text.back() == ')';
  if (target) text = trimmed(text.substr(kTarget.size(), text.size() - kTarget.size() - 1));
  if (const auto number = whole_number(text); number && !target) {
    a.kind = Argument::Kind::number;
    a.number = *number;
    return a;
  }
  const bool pose = !text.empty() && text.front() == 'p';
  const auto numbers = list_of(pose ? text.substr(1) : text);
  if (!numbers || (target && !pose) || (pose && numbers->size() != 6)) return a;
  a.kind = target ? Argument::Kind::target : pose ? Argument::Kind::pose : Argument::Kind::list;
  a.numbers = *numbers;
  return a;
}

/// `text` as name(arguments); nothing when it is something else.
std::optional<Call> call_of(std::string_view text) {
  const auto open = text.find('(');
  if (open == std::string_view::npos || text.back() != ')' || !is_name(text.substr(0, open)))
    return std::nullopt;
  const auto parts = split(text.substr(open + 1, text.size() - open - 2));
  if (!parts) return std::nullopt;
  Call call;
  call.name = text.substr(0, open);
  for (const auto part : *parts) call.arguments.push_back(argument_of(part));
  return call;
}

Pose pose_of(const std::vector<double>& numbers) {
  Pose pose = Pose::Identity();
  pose.translation() = Vec3(numbers[0], numbers[1], numbers[2]) * kMillimetresPerMetre;
  pose.linear() = rotation_exp(Vec3(numbers[3], numbers[4], numbers[5]));
  return pose;
}

class Reading : public robot::RobotReading {
 public:
  Reading(const MachineDefinition& machine, const std::string& file)
      : RobotReading(machine, file, "NC347", "NC348") {}

  void run(std::string_view text) {
    const auto lines = text_lines(text);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const TextPlace at{static_cast<std::uint32_t>(i + 1), 1};
      read(at, lines[i]);
    }
    result.line_count = static_cast<std::uint32_t>(lines.size());
    if (result.last_line == 0)
      error({std::max(1U, result.line_count), 1}, "NC346", "the program has no end");
    if (rounded()) error({result.last_line, 1}, "the last corner is rounded");
    result.offset_guard = has_frames();
  }

 private:
  bool rounded() const { return !result.moves.empty() && result.moves.back().blend > 0.0; }

  void read(TextPlace at, std::string_view line) {
    for (const char c : line)
      if ((static_cast<unsigned char>(c) < 0x20U && c != '\t') ||
          static_cast<unsigned char>(c) > 0x7EU)
        return error(at, "NC346", "a character outside printable ASCII");
    const std::string_view text = trimmed(line);
    if (!begun_) {
      if (text.empty() || text.front() == '#') return;
      const bool good = text.size() > 7 && text.substr(0, 4) == "def " &&
                        text.substr(text.size() - 3) == "():" &&
                        is_name(text.substr(4, text.size() - 7));
      if (!good) error(at, "NC346", "the program has to begin with def name():");
      begun_ = true;
      return;
    }
    if (text.empty()) return;
    if (read_hold(at, line)) return;
    if (text.front() == '#') return;
    if (result.last_line > 0) return error(at, "NC346", "text behind the end of the program");
    if (text == "end") {
      if (streaming_) error(at, "the program ends before its last servoj is held");
      if (hold_ > 0 && hold_ < kHold.size()) error(at, "NC346", "sp_hold has no end");
      result.last_line = at.line;
      return;
    }
    const auto column = static_cast<std::uint32_t>(text.data() - line.data()) + 1;
    for (const char* block : {"if ", "while ", "def ", "thread ", "for ", "global ", "local "})
      if (text.rfind(block, 0) == 0)
        return error({at.line, column}, "NC346",
                     "program flow and variables are not read: " + std::string(text.substr(0, 64)));
    read_statement({at.line, column}, text);
  }

  // The lines of sp_hold, one behind the other, before the first motion.
  bool read_hold(TextPlace at, std::string_view line) {
    const bool open = hold_ > 0 && hold_ < kHold.size();
    if (!open && (hold_ > 0 || line != kHold[0])) return false;
    if (line != kHold[hold_] || !result.moves.empty())
      return error(at, "NC346", "sp_hold is not the function that we write"), hold_ = 0, true;
    ++hold_;
    return true;
  }

  void read_statement(TextPlace at, std::string_view text) {
    constexpr std::string_view kPart = "sp_part = ";
    if (text.substr(0, kPart.size()) == kPart) {
      const Argument a = argument_of(text.substr(kPart.size()));
      if (a.kind != Argument::Kind::pose)
        return error(at, "NC346", "sp_part needs p[..] of six numbers");
      part_stated_ = true;
      return set_part(at, pose_of(a.numbers));
    }
    if (result.moves.empty() && text == "popup(\"NOT CERTIFIED: read the report\", blocking=True)")
      return;
    const auto call = call_of(text);
    if (call && read_stream(at, *call)) return;
    if (streaming_)
      return error(at, "this statement cuts off the stream of servoj: sp_hold has to be in front");
    if (call && read_call(at, *call)) return;
    needs_stop(at);
    if (read_event(at, text) || is_own_line(text)) return;
    error(at, call ? "NC347" : "NC346",
          "this statement is neither one of ours nor in the machine's process table: " +
              std::string(text.substr(0, 64)));
  }

  // servoj and sp_hold; false when the call is another.
  bool read_stream(TextPlace at, const Call& call) {
    using Kind = Argument::Kind;
    const bool hold = call.name == "sp_hold";
    if (!hold && call.name != "servoj") return false;
    const bool good = hold ? call.is(Kind::list, {})
                           : call.is(Kind::list, {"t", "lookahead_time", "gain"}) &&
                                 call.arguments[1].number > 0.0;
    if (!good || call.arguments[0].numbers.size() != 6)
      return error(at, "NC346", call.name + " needs [..] of six joints and its times"), true;
    const auto& target = call.arguments[0].numbers;
    if (hold) {
      if (!streaming_ || target != target_ || hold_ != kHold.size())
        error(at, "sp_hold has another target than the servoj in front of it, or is not defined");
      streaming_ = false;
      return true;
    }
    if (call.arguments[2].number != 0.03 || call.arguments[3].number != 2000.0)
      return error(at, "lookahead_time is 0.03 and gain 2000"), true;
    if (!has_frames() || !all_known())
      return error(at, "servoj stands before a movej, sp_part and set_tcp"), true;
    for (std::size_t i = 0; i < 6; ++i) set_joint(axes().arm[i], target[i]);
    add_joint_move(at, call.arguments[1].number);
    target_ = target;
    return streaming_ = true;
  }

  // False when the call is none of ours.
  bool read_call(TextPlace at, const Call& call) {
    using Kind = Argument::Kind;
    if (call.name == "movej") return read_joints(at, call), true;
    if (call.name == "movel" || call.name == "movep") return read_line(at, call), true;
    if (call.name == "set_tcp") {
      needs_stop(at);
      if (!call.is(Kind::pose, {})) return error(at, "NC346", "set_tcp needs p[..]"), true;
      return set_tool(at, pose_of(call.arguments[0].numbers)), true;
    }
    if (call.name == "set_payload") {
      needs_stop(at);
      const bool good = call.arguments.size() == 2 && call.arguments[0].kind == Kind::number &&
                        call.arguments[1].numbers.size() == 3;
      if (!good) return error(at, "NC346", "set_payload needs a mass and a centre [..]"), true;
      const auto& load = machine().tool.load;
      const auto& centre = call.arguments[1].numbers;
      const Vec3 place = Vec3(centre[0], centre[1], centre[2]) * kMillimetresPerMetre;
      const bool same = load && std::abs(call.arguments[0].number - load->mass) < 1e-4 &&
                        (place - load->centre).norm() < 1e-2;
      if (!same || !result.moves.empty())
        error(at, "NC348", "the load changes, or is not that of the machine file");
      return true;
    }
    if (call.name != "sleep") return false;
    needs_stop(at);
    if (!call.is(Kind::number, {}) || call.arguments[0].number < 0.0)
      return error(at, "NC346", "sleep needs its seconds"), true;
    add_event(at, "dwell", call.arguments[0].number);
    return true;
  }

  // A target p[..] without a frame of the part is one in the base, which is then the part's frame.
  Argument::Kind target_kind(TextPlace at, const Call& call) {
    const bool in_base =
        !call.arguments.empty() && call.arguments[0].kind == Argument::Kind::pose && !part_stated_;
    if (!in_base) return Argument::Kind::target;
    set_part(at, Pose::Identity());
    return Argument::Kind::pose;
  }

  // t= of a move; nothing: a= and v= stand there. False after an error.
  bool take_time(TextPlace at, const Call& call, Argument::Kind kind,
                 std::optional<double>& seconds) {
    const bool timed = call.is(kind, {"t"});
    if (!timed && !call.is(kind, {"a", "v"}))
      return error(at, "NC346",
                   call.name + (call.name == "movej" && !call.arguments.empty() &&
                                        call.arguments[0].kind == Argument::Kind::pose
                                    ? " to a pose: which of the arm's solutions it takes is not "
                                      "certain; write its six joints"
                                    : " needs its target and t=, or a= and v=")),
             false;
    for (std::size_t i = 1; i < call.arguments.size(); ++i)
      if (!(call.arguments[i].number > 0.0))
        return error(at, "NC346", call.arguments[i].name + "= has to be above 0"), false;
    if (timed) seconds = call.arguments[1].number;
    return true;
  }

  void read_joints(TextPlace at, const Call& call) {
    std::optional<double> seconds;
    if (!take_time(at, call, Argument::Kind::list, seconds)) return;
    const auto& numbers = call.arguments[0].numbers;
    if (numbers.size() != 6) return error(at, "NC346", "movej needs [..] of six joints");
    if (!result.tool_frame) return error(at, "a motion stands before set_tcp");
    if (!result.part) set_part(at, Pose::Identity());  // the base, until targets say another
    for (std::size_t i = 0; i < 6; ++i) set_joint(axes().arm[i], numbers[i]);
    add_joint_move(at, seconds);
  }

  void read_line(TextPlace at, const Call& call) {
    using Kind = Argument::Kind;
    LineSpeed speed;
    double blend = 0.0;
    const Kind kind = target_kind(at, call);
    if (kind == Kind::target && !part_stated_)
      return error(at, "NC348", "a motion in the part's frame stands before sp_part = p[..]");
    if (call.name == "movel") {
      if (!take_time(at, call, kind, speed.seconds)) return;
      if (const Argument* v = call.named("v"); kind == Kind::pose && v != nullptr)
        speed.tip = v->number * kMillimetresPerMetre;
      if (rounded()) return error(at, "a movel behind a rounded corner: only movep rounds");
    } else {
      if (!call.is(kind, {"a", "v", "r"}) || !(call.named("v")->number > 0.0) ||
          !(call.named("a")->number > 0.0) || call.named("r")->number < 0.0)
        return error(at, "NC346", "movep needs its target, a=, v= and r=");
      speed.tip = call.named("v")->number * kMillimetresPerMetre;
      blend = call.named("r")->number * kMillimetresPerMetre;
    }
    add_line_move(at, pose_of(call.arguments[0].numbers), speed, blend);
  }

  bool begun_ = false;        ///< by def name():
  bool part_stated_ = false;  ///< by sp_part
  static constexpr std::array<std::string_view, 4> kHold = {
      "  def sp_hold(q):", "    servoj(q, t=0.2, lookahead_time=0.03, gain=2000)", "    stopj(10)",
      "  end"};
  std::size_t hold_ = 0;    ///< lines of sp_hold that have been read
  bool streaming_ = false;  ///< the last motion is a servoj that is not held yet
  std::vector<double> target_;
};

}  // namespace

Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name) {
  return read_with<Reading>(machine, file_name, text);
}

}  // namespace smoothpost::urscript
