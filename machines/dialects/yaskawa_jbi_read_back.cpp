#include <algorithm>
#include <cmath>

#include "kernels/core/units.h"
#include "machines/dialects/robot_program.h"
#include "machines/dialects/yaskawa_jbi.h"
#include "machines/dialects/yaskawa_posture.h"

namespace smoothpost::yaskawa_jbi {

namespace {

struct Position {
  std::uint32_t line = 0;
  Pose pose = Pose::Identity();
  Posture posture;
  bool used = false;
};

/// The numbers of "a,b,c"; nothing when one is malformed.
std::optional<std::vector<double>> numbers_of(std::string_view text) {
  std::vector<double> values;
  while (true) {
    const auto end = std::min(text.find(','), text.size());
    const auto value = whole_number(text.substr(0, end));
    if (!value) return std::nullopt;
    values.push_back(*value);
    if (end == text.size()) return values;
    text.remove_prefix(end + 1);
  }
}

/// "C00012" as 12; nothing when it is something else.
std::optional<std::size_t> index_of(std::string_view text) {
  if (text.size() != 6 || text[0] != 'C') return std::nullopt;
  std::size_t value = 0;
  for (const char c : text.substr(1)) {
    if (c < '0' || c > '9') return std::nullopt;
    value = 10 * value + static_cast<std::size_t>(c - '0');
  }
  return value;
}

bool starts_with(std::string_view text, std::string_view head) {
  return text.substr(0, head.size()) == head;
}

class Reading : public robot::RobotReading {
 public:
  Reading(const MachineDefinition& machine, const std::string& file)
      : RobotReading(machine, file, "NC347", "NC348"), postures_(machine) {
    if (!postures_.exists())
      error({1, 1}, "machine " + machine.name + " has no postures: its arm has no closed form");
  }

  void run(std::string_view text) {
    const auto lines = text_lines(text);
    result.line_count = static_cast<std::uint32_t>(lines.size());
    set_part({1, 1}, Pose::Identity());  // W is the robot's base
    for (std::size_t i = 0; i < lines.size(); ++i)
      read({static_cast<std::uint32_t>(i + 1), 1}, lines[i]);
    if (section_ != Section::end)
      error({std::max(1U, result.line_count), 1}, "NC346", "the job has no END");
    for (const auto& position : positions_)
      if (!position.used) error({position.line, 1}, "a position that no motion goes to");
    result.offset_guard = has_frames();
  }

 private:
  enum class Section { job, name, positions, header, program, end };

  void read(TextPlace at, std::string_view line) {
    for (const char c : line)
      if (static_cast<unsigned char>(c) < 0x20U || static_cast<unsigned char>(c) > 0x7EU)
        return error(at, "NC346", "a character outside printable ASCII");
    if (line.empty()) return error(at, "NC346", "an empty line");
    bool good = false;
    switch (section_) {
      case Section::job:
        good = line == "/JOB";
        section_ = Section::name;
        break;
      case Section::name:
        good = read_name(line);
        break;
      case Section::positions:
        good = read_position(at, line);
        break;
      case Section::header:
        good = read_header(line);
        break;
      case Section::program:
        return read_instruction(at, trimmed(line));
      case Section::end:
        break;
    }
    if (!good)
      error(at, "NC346",
            "this line has no place here: /JOB, //NAME, //POS, //INST, NOP and END have to follow "
            "each other, and positions are Cartesian in the base: " +
                std::string(line.substr(0, 64)));
  }

  bool read_name(std::string_view line) {
    if (line == "//POS" && has_name_) {
      section_ = Section::positions;
      return true;
    }
    const bool good = !has_name_ && starts_with(line, "//NAME ") && line.size() > 7;
    has_name_ = true;
    return good;
  }

  // ---- positions

  bool read_position(TextPlace at, std::string_view line) {
    if (starts_with(line, "///NPOS ")) {
      const auto counts = numbers_of(line.substr(8));
      if (!counts || counts->size() != 6 || count_) return false;
      for (const std::size_t i : {1U, 2U, 4U, 5U})
        if ((*counts)[i] != 0.0) return false;
      count_ = (*counts)[0];
      return (*counts)[3] == 1.0;
    }
    if (!count_) return false;
    for (const auto& [text, done] :
         {std::pair{"///TOOL 9", &has_tool_number_}, std::pair{"///POSTYPE BASE", &has_type_},
          std::pair{"///RECTAN", &has_form_}})
      if (line == text) return !std::exchange(*done, true);
    if (!has_tool_number_ || !has_type_ || !has_form_) return false;
    if (starts_with(line, "///RCONF ")) return read_posture(line.substr(9));
    if (line == "//INST") {
      section_ = Section::header;
      return has_tool_variable_ && *count_ == static_cast<double>(positions_.size());
    }
    const auto equals = line.find('=');
    const auto values =
        equals == std::string_view::npos ? std::nullopt : numbers_of(line.substr(equals + 1));
    if (!values || values->size() != 6 || !posture_) return false;
    const std::string_view name = line.substr(0, equals);
    if (name == "P00091" && !has_tool_variable_) {
      tool_variable_ = pose_of(*values);
      return has_tool_variable_ = true;
    }
    if (has_tool_variable_ || index_of(name) != positions_.size()) return false;
    positions_.push_back({at.line, pose_of(*values), *posture_, false});
    return true;
  }

  bool read_posture(std::string_view text) {
    const auto bits = numbers_of(text);
    if (!bits || bits->size() != 8 || (*bits)[6] != 0.0 || (*bits)[7] != 0.0) return false;
    for (const double bit : *bits)
      if (bit != 0.0 && bit != 1.0) return false;
    const auto is = [&bits](std::size_t i) { return (*bits)[i] == 1.0; };
    posture_ = Posture{is(0), is(1), is(2), {is(3), is(4), is(5)}};
    return true;
  }

  static Pose pose_of(const std::vector<double>& v) {
    Pose pose = Pose::Identity();
    pose.translation() = Vec3(v[0], v[1], v[2]);
    pose.linear() = rotation_from_rpy(radians_from_degrees(v[3]), radians_from_degrees(v[4]),
                                      radians_from_degrees(v[5]));
    return pose;
  }

  // ---- instructions

  bool read_header(std::string_view line) {
    if (line == "NOP") {
      section_ = Section::program;
      return header_ == 5;
    }
    static constexpr std::array<const char*, 5> kRows = {"///DATE ", "///COMM ", "///ATTR SC,RW,RJ",
                                                         "////FRAME BASE", "///GROUP1 RB1"};
    if (header_ >= kRows.size()) return false;
    const std::string_view row = kRows[header_++];
    return row.back() == ' ' ? starts_with(line, row) : line == row;
  }

  void read_instruction(TextPlace at, std::string_view text) {
    if (text.empty() || text[0] == '\'' || (text[0] == '*' && text.size() > 1)) return;
    if (text == "END") {
      section_ = Section::end;
      result.last_line = at.line;
      return;
    }
    if (starts_with(text, "MOVJ ") || starts_with(text, "MOVL ")) return read_motion(at, text);
    if (text == "SETTOOL TL#(9) P091") return set_tool(at, tool_variable_);
    if (starts_with(text, "TIMER T=")) {
      const auto seconds = whole_number(text.substr(8));
      if (!seconds || *seconds < 0.0) return error(at, "NC346", "TIMER needs T= and its seconds");
      return add_event(at, "dwell", *seconds);
    }
    if (read_event(at, text) || is_own_line(text) || (text == "PAUSE" && result.moves.empty()))
      return;
    error(at, "this instruction is neither one of ours nor in the machine's process table: " +
                  std::string(text.substr(0, 64)));
  }

  // MOVL C00001 V=50 PL=0
  void read_motion(TextPlace at, std::string_view text) {
    const bool joints = text[3] == 'J';
    const auto first = text.find(' '), second = text.find(' ', first + 1),
               third = text.find(' ', std::min(second, text.size() - 1) + 1);
    if (second == std::string_view::npos || third == std::string_view::npos ||
        text.substr(third) != " PL=0")
      return error(at, "NC346",
                   "a motion is MOVJ or MOVL, C, its speed and PL=0: how far other levels leave a "
                   "corner has no bound");
    const auto index = index_of(text.substr(first + 1, second - first - 1));
    if (!index || *index >= positions_.size())
      return error(at, "the position of this motion is missing");
    if (!has_frames()) return error(at, "NC348", "a motion stands before SETTOOL");
    Position& position = positions_[*index];
    position.used = true;
    const std::string_view speed = text.substr(second + 1, third - second - 1);
    joints ? read_joints(at, position, speed) : read_line(at, position, speed);
  }

  void read_joints(TextPlace at, const Position& position, std::string_view speed) {
    const auto percent = starts_with(speed, "VJ=") ? whole_number(speed.substr(3)) : std::nullopt;
    if (!percent || !(*percent > 0.0) || *percent > 100.0)
      return error(at, "NC346", "the speed of MOVJ is VJ= above 0 and at most 100");
    const auto arm =
        postures_.joints(position.pose * result.tool_frame->inverse(), position.posture);
    if (!arm) return error(at, "no joints of that posture reach the position, or more than one do");
    for (std::size_t i = 0; i < 6; ++i) set_joint(axes().arm[i], (*arm)[i]);
    const bool rapid = *percent == 100.0 || result.moves.empty();
    add_joint_move(at, rapid ? std::nullopt : seconds_at(*percent));
  }

  void read_line(TextPlace at, const Position& position, std::string_view speed) {
    constexpr double kLinkSpeed = 250.0;
    const bool turn = starts_with(speed, "VR=");
    const auto value =
        whole_number(speed.substr(std::min<std::size_t>(turn ? 3 : 2, speed.size())));
    if ((!turn && !starts_with(speed, "V=")) || !value || !(*value > 0.0))
      return error(at, "NC346", "the speed of MOVL is V= or VR= above 0");
    LineSpeed line;
    if (turn) line.turn = radians_from_degrees(*value);
    if (!turn && *value != kLinkSpeed) line.tip = *value;
    add_line_move(at, position.pose, line, 0.0);
  }

  Postures postures_;
  Section section_ = Section::job;
  bool has_name_ = false;
  std::optional<double> count_;
  bool has_tool_number_ = false;
  bool has_type_ = false;
  bool has_form_ = false;
  bool has_tool_variable_ = false;
  std::size_t header_ = 0;
  std::optional<Posture> posture_;
  Pose tool_variable_ = Pose::Identity();
  std::vector<Position> positions_;
};

}  // namespace

Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name) {
  return read_with<Reading>(machine, file_name, text);
}

}  // namespace smoothpost::yaskawa_jbi
