#include "machines/dialects/ros_trajectory.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "machines/dialects/program_printer.h"
#include "machines/dialects/program_reading.h"

namespace smoothpost::ros_trajectory {

namespace {

constexpr std::size_t kMaxComment = 120;
constexpr int kMostDigits = 9;
constexpr double kMetresPerMillimetre = 1e-3;
constexpr double kFirstShare = 0.10;  // of the velocity limits, from wherever the machine stands
constexpr double kLinkShare = 0.25;
constexpr std::int64_t kNanoseconds = 1000000000;
constexpr std::int64_t kLeastStep = 1000;  // ns: times have to rise
constexpr const char* kRefused = "NOT_CERTIFIED_";

bool is_rotary_joint(const MachineDefinition& machine, int j) {
  return machine.axes[static_cast<std::size_t>(j)].joint.kind == JointKind::rotary;
}

/// What ROS 1 and ROS 2 call differently.
struct MessageFields {
  const char* seconds;
  const char* nanoseconds;
  const char* header;
};
MessageFields message_fields(const MachineDefinition& machine) {
  if (machine.dialect.name == kRos1Dialect.name)
    return {"secs", "nsecs", "header: {seq: 0, stamp: {secs: 0, nsecs: 0}, frame_id: base_link}"};
  return {"sec", "nanosec", "header: {stamp: {sec: 0, nanosec: 0}, frame_id: base_link}"};
}

class Emitter : public ProgramPrinter {
 public:
  Emitter(const MachineDefinition& machine, const MachineProgram& program)
      : ProgramPrinter(machine, program), fields_(message_fields(machine)) {}

 private:
  void check() override {
    if (has_poses())
      refuse("PR203", "a JointTrajectory has joints only: write dialect.mode = \"joint\"");
    if (machine().dialect.path_mode != "exact")
      refuse("PR203", "dialect " + machine().dialect.name + " has no path_mode \"" +
                          machine().dialect.path_mode + "\": write path_mode = \"exact\"");
  }

  void head() override {
    if (!program().certified)
      comment("NOT CERTIFIED. Written with --force: read the report, then mend joint_names");
    for (const auto& title : program().title) comment(title);
    comment("trajectory_msgs/JointTrajectory: rad, m, s");
    for (const auto& own : machine().dialect.start) line(own);
    line(fields_.header);
    std::string names;
    for (const auto& axis : machine().axes)
      names += (names.empty() ? "" : ", ") + std::string(program().certified ? "" : kRefused) +
               axis.name;
    line("joint_names: [" + names + "]");
    line("points:");
    start();
  }

  // From wherever the machine stands: a point has every joint, and a first link may name a few.
  void start() {
    joints_ = home_of(machine());
    double seconds = 0.0;
    for (const auto& axis : machine().axes)
      seconds =
          std::max(seconds, (axis.joint.upper - axis.joint.lower) / (kFirstShare * axis.velocity));
    time_ = static_cast<std::int64_t>(std::ceil(seconds)) * kNanoseconds;
    line("# start: home, slowly; the machine should stand there before this is played");
    point();
  }

  void foot() override {
    for (const auto& own : machine().dialect.end) line(own);
  }

  std::string time_text(std::int64_t ns) const {
    return std::string("{") + fields_.seconds + ": " + std::to_string(ns / kNanoseconds) + ", " +
           fields_.nanoseconds + ": " + std::to_string(ns % kNanoseconds) + "}";
  }

  void comment(const std::string& text) override { line("# - " + plain_text(text, kMaxComment)); }
  void label(const std::string& text) override { comment(text); }

  void statement(const std::string& words, const MachineAction&) override {
    std::string digits = std::to_string(time_ % kNanoseconds);
    digits.insert(0, 9 - digits.size(), '0');
    line("# at " + std::to_string(time_ / kNanoseconds) + "." + digits + " " + words);
  }

  void dwell(double seconds) override {
    const auto ns = std::max(kLeastStep, static_cast<std::int64_t>(std::llround(seconds * 1e9)));
    line("# wait " + decimal_text(static_cast<double>(ns) * 1e-9, 9));
    time_ += ns;
    point();
  }

  void print_move(std::size_t i) override {
    const MachineMove& m = move(i);
    time_ += std::max(kLeastStep, static_cast<std::int64_t>(std::ceil(seconds_of(m) * 1e9 - 1e-3)));
    for (int j = 0; j < machine().size(); ++j)
      if (m.joints >> j & 1U) joints_[j] = m.to[j];
    point();
  }

  double seconds_of(const MachineMove& m) const {
    if (!m.rapid && m.duration > 0.0) return m.duration;
    double seconds = 0.0;
    for (int j = 0; j < machine().size(); ++j)
      if (m.joints >> j & 1U)
        seconds = std::max(seconds,
                           std::abs(m.to[j] - joints_[j]) /
                               (kLinkShare * machine().axes[static_cast<std::size_t>(j)].velocity));
    return seconds;
  }

  void point() {
    std::string text = "- {positions: [";
    for (int j = 0; j < machine().size(); ++j) {
      const DialectSettings& d = machine().dialect;
      const bool rotary = is_rotary_joint(machine(), j);
      const int digits = std::min(kMostDigits, rotary ? d.digits_angle + 2 : d.digits_length + 3);
      text += (j > 0 ? ", " : "") +
              decimal_text(rotary ? joints_[j] : joints_[j] * kMetresPerMillimetre, digits);
    }
    line(text + "], velocities: [], accelerations: [], effort: [], time_from_start: " +
         time_text(time_) + "}");
  }

  MessageFields fields_;
  std::int64_t time_ = 0;  // ns
  JointVector joints_;
};

class Reading : public ProgramReading {
 public:
  Reading(const MachineDefinition& machine, const std::string& file)
      : ProgramReading(machine, file, "NC349"), fields_(message_fields(machine)) {}

  void run(std::string_view text) {
    const auto lines = text_lines(text);
    for (std::size_t i = 0; i < lines.size(); ++i)
      read({static_cast<std::uint32_t>(i + 1), 1}, lines[i]);
    result.line_count = result.last_line = static_cast<std::uint32_t>(lines.size());
    result.exact_path = true;
    result.offset_guard = true;  // the message knows no offsets
    if (!started_ || waits_ >= 0)
      error({std::max(1U, result.line_count), 1}, "the message ends before its points do");
  }

 private:
  enum class Part { header, names, list, points };

  void read(TextPlace at, std::string_view line) {
    for (const char c : line)
      if (static_cast<unsigned char>(c) < 0x20U || static_cast<unsigned char>(c) > 0x7EU)
        return error(at, "a character outside printable ASCII");
    const std::string_view text = trimmed(line);
    if (text.empty() || text.substr(0, 3) == "# -") return;
    if (text.substr(0, 8) == "# start:") return read_start(at);
    if (text.substr(0, 5) == "# at " || text.substr(0, 7) == "# wait ")
      return read_action(at, text);
    if (part_ == Part::header && text == fields_.header) {
      part_ = Part::names;
    } else if (part_ == Part::names && text.substr(0, 14) == "joint_names: [") {
      read_names(at, text.substr(14));
      part_ = Part::list;
    } else if (part_ == Part::list && text == "points:") {
      part_ = Part::points;
    } else if (part_ == Part::points && text.substr(0, 14) == "- {positions: ") {
      read_point(at, text.substr(14));
    } else if (!is_own_line(text)) {
      error(at, "this line has no place here: header, joint_names, points and then one line each");
    }
  }

  void read_names(TextPlace at, std::string_view text) {
    std::string wanted, refused;
    for (const auto& axis : machine().axes) {
      wanted += (wanted.empty() ? "" : ", ") + axis.name;
      refused += (refused.empty() ? "" : ", ") + (kRefused + axis.name);
    }
    if (text != wanted + "]" && text != refused + "]")
      error(at, "joint_names are not the axes of machine " + machine().name +
                    " in their order: " + wanted);
  }

  // "12.5" in ns, exactly: at most nine decimals.
  static std::optional<std::int64_t> nanoseconds(std::string_view text) {
    const auto point = std::min(text.find('.'), text.size());
    std::string decimals(text.substr(std::min(point + 1, text.size())));
    constexpr std::size_t kMostSeconds = 9;
    if (point == 0 || point > kMostSeconds || decimals.size() > 9 || !whole_number(text) ||
        text[0] == '-' || text[0] == '+')
      return std::nullopt;
    decimals.append(9 - decimals.size(), '0');
    return static_cast<std::int64_t>(*whole_number(text.substr(0, point))) * kNanoseconds +
           static_cast<std::int64_t>(*whole_number(decimals));
  }

  void read_start(TextPlace at) {
    if (part_ != Part::points || started_ || starts_) return error(at, "a second start");
    starts_ = true;
  }

  void read_action(TextPlace at, std::string_view text) {
    if (part_ != Part::points || waits_ >= 0 || !started_)
      return error(at, "an event stands outside of the points");
    if (text.substr(0, 7) == "# wait ") {
      const auto ns = nanoseconds(text.substr(7));
      if (!ns || *ns == 0) return error(at, "# wait needs its seconds, at most nine decimals");
      add_event(at, "dwell", static_cast<double>(*ns) * 1e-9);
      waits_ = *ns;
      return;
    }
    const auto blank = text.find(' ', 5);
    const auto ns = nanoseconds(text.substr(5, blank == std::string_view::npos ? 0 : blank - 5));
    if (!ns || *ns != time_) return error(at, "# at needs the time of the point in front of it");
    if (!read_event(at, text.substr(blank + 1)))
      error(at, "the machine's process table has no event for these words");
  }

  // "[..], velocities: [], accelerations: [], effort: [], time_from_start: {sec: 1, nanosec: 2}}"
  void read_point(TextPlace at, std::string_view text) {
    const auto end = text.find(']');
    const std::string middle = std::string("], velocities: [], accelerations: [], effort: [], ") +
                               "time_from_start: {" + fields_.seconds + ": ";
    const std::string between = std::string(", ") + fields_.nanoseconds + ": ";
    if (text.empty() || text[0] != '[' || end == std::string_view::npos ||
        text.substr(end, middle.size()) != middle)
      return error(at, "a point has positions, empty lists and time_from_start");
    std::string_view time = text.substr(end + middle.size());
    const auto comma = time.find(between);
    if (comma == std::string_view::npos || time.size() < comma + between.size() + 3 ||
        time.substr(time.size() - 2) != "}}")
      return error(at, "time_from_start needs seconds and nanoseconds");
    const auto s = nanoseconds(time.substr(0, comma));
    const auto n =
        nanoseconds(time.substr(comma + between.size(), time.size() - comma - between.size() - 2));
    if (!s || !n || *s % kNanoseconds != 0 || *n % kNanoseconds != 0 ||
        *n / kNanoseconds >= kNanoseconds)
      return error(at, "time_from_start needs whole numbers");
    const std::int64_t ns = *s + *n / kNanoseconds;
    if (ns <= time_) return error(at, "the times do not rise");
    const JointVector from = joints();
    if (!take_positions(at, text.substr(1, end - 1))) return;
    if (starts_) {
      starts_ = false;
      started_ = true;
    } else if (!started_) {
      error(at, "the first point is not the start");
    } else if (waits_ >= 0) {
      if (ns != time_ + waits_ || joints() != from)
        return error(at, "the point behind # wait does not repeat the one in front of it");
      waits_ = -1;
    } else {
      ReadBackMove move = new_move(at);
      move.to = joints();
      move.known = known();
      move.duration = static_cast<double>(ns - time_) * 1e-9;
      result.moves.push_back(std::move(move));
    }
    time_ = ns;
  }

  bool take_positions(TextPlace at, std::string_view text) {
    for (int j = 0; j < machine().size(); ++j) {
      const auto end = std::min(text.find(','), text.size());
      const auto value = whole_number(trimmed(text.substr(0, end)));
      if (!value) return error(at, "a point has not one number for each joint"), false;
      set_joint(j, is_rotary(j) ? *value : *value / kMetresPerMillimetre);
      text.remove_prefix(std::min(end + 1, text.size()));
    }
    if (!trimmed(text).empty()) return error(at, "a point has more numbers than joints"), false;
    return true;
  }

  MessageFields fields_;
  Part part_ = Part::header;
  std::int64_t time_ = 0;
  bool starts_ = false;  // the next point is the start
  bool started_ = false;
  std::int64_t waits_ = -1;  // ns, that the next point adds to the one before
};

}  // namespace

Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program) {
  return Emitter(machine, program).run();
}

Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name) {
  return read_with<Reading>(machine, file_name, text);
}

namespace {
constexpr const char* kInterpolation =
    "points with positions only: all joints linear from point to point, in the time between them";
constexpr const char* kGuardText =
    "positions are those of the joints themselves: the message knows no offsets";
}  // namespace

const Dialect kDialect = {"ros_trajectory",
                          "ROS 2 trajectory_msgs/JointTrajectory as YAML, positions and times",
                          kInterpolation,
                          ToolTurn::none,
                          true,
                          &emit,
                          &read_back,
                          kGuardText};

const Dialect kRos1Dialect = {"ros1_trajectory",
                              "ROS 1 trajectory_msgs/JointTrajectory as YAML, positions and times",
                              kInterpolation,
                              ToolTurn::none,
                              true,
                              &emit,
                              &read_back,
                              kGuardText};

}  // namespace smoothpost::ros_trajectory
