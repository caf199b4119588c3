#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "kernels/core/units.h"
#include "machines/dialects/fanuc_ls.h"
#include "machines/dialects/robot_program.h"

namespace smoothpost::fanuc_ls {

namespace {

/// A position of /POS: its numbers by their names, X or J1 and so on.
struct Position {
  std::uint32_t line = 0;
  std::map<std::string, double> values;  // mm, deg
  bool has_configuration = false;
  bool used = false;

  bool has(std::initializer_list<const char*> names) const {
    return std::all_of(names.begin(), names.end(),
                       [this](const char* name) { return values.count(name) > 0; });
  }
  bool is_cartesian() const {
    return has_configuration && has({"X", "Y", "Z", "W", "P", "R"}) && values.count("J1") == 0;
  }
  bool is_joints() const {
    return !has_configuration && has({"J1", "J2", "J3", "J4", "J5", "J6"}) &&
           values.count("X") == 0;
  }
};

struct Instruction {
  TextPlace at;
  std::string text;  ///< behind the number, without ;
};

/// "P[12]" as 12, 0 when it is something else.
int index_of(std::string_view text, std::string_view head) {
  constexpr double kMost = 99999.0;
  if (text.size() < head.size() + 2 || text.substr(0, head.size()) != head || text.back() != ']')
    return 0;
  const auto number = whole_number(text.substr(head.size(), text.size() - head.size() - 1));
  if (!number || *number < 1.0 || *number > kMost || *number != std::floor(*number)) return 0;
  return static_cast<int>(*number);
}

/// A number behind which `unit` stands.
std::optional<double> with_unit(std::string_view text, std::string_view unit) {
  if (text.size() <= unit.size() || text.substr(text.size() - unit.size()) != unit)
    return std::nullopt;
  return whole_number(trimmed(text.substr(0, text.size() - unit.size())));
}

std::string without_blanks(std::string_view text) {
  std::string out;
  for (const char c : text)
    if (c != ' ' && c != '\t') out += c;
  return out;
}

/// 'N U T, 0, 0, 0'
bool is_configuration(std::string_view quoted) {
  const std::string text = without_blanks(quoted);
  if (text.size() < 11 || text.front() != '\'' || text.back() != '\'') return false;
  const auto one_of = [&text](std::size_t at, std::string_view letters) {
    return letters.find(text[at]) != std::string_view::npos;
  };
  if (!one_of(1, "FN") || !one_of(2, "UD") || !one_of(3, "TB")) return false;
  std::size_t at = 4;
  for (int k = 0; k < 3; ++k) {
    if (text[at++] != ',') return false;
    if (text[at] == '-') ++at;
    if (text[at] < '0' || text[at] > '9') return false;
    ++at;
  }
  return at + 1 == text.size();
}

class Reading : public robot::RobotReading {
 public:
  Reading(const MachineDefinition& machine, const std::string& file)
      : RobotReading(machine, file, "NC347", "NC348") {}

  void run(std::string_view text) {
    split(text_lines(text));
    if (has_error(diagnostics)) return;
    for (const auto& instruction : instructions_) read(instruction);
    int last = 0;
    for (const auto& [number, position] : positions_) {
      if (number != ++last)
        return error({position.line, 1}, "NC346", "positions have to be P[1], P[2] and so on");
      if (!position.used) error({position.line, 1}, "a position that no motion goes to");
    }
    if (!result.moves.empty() && result.moves.back().blend > 0.0)
      error({result.last_line, 1}, "the last corner is rounded");
    result.offset_guard = has_frames();
  }

 private:
  // ---- sections

  void split(const std::vector<std::string_view>& lines) {
    enum class Section { start, attributes, program, positions, end } section = Section::start;
    Position* open = nullptr;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const TextPlace at{static_cast<std::uint32_t>(i + 1), 1};
      const std::string_view line = lines[i];
      for (const char c : line)
        if ((static_cast<unsigned char>(c) < 0x20U && c != '\t') ||
            static_cast<unsigned char>(c) > 0x7EU)
          return error(at, "NC346", "a character outside printable ASCII");
      const std::string_view text = trimmed(line);
      if (text.empty()) continue;
      if (section == Section::start && text.substr(0, 6) == "/PROG " && text.size() > 7) {
        section = Section::attributes;
      } else if (section == Section::attributes && text == "/MN") {
        section = Section::program;
      } else if (section == Section::attributes) {
        if (text != "/ATTR" && (text.find('=') == std::string_view::npos ||
                                (text.back() != ';' && text.back() != ',')))
          return error(at, "NC346", "an attribute is key = value with ; or , behind it");
      } else if (section == Section::program && text == "/POS") {
        section = Section::positions;
      } else if (section == Section::program) {
        if (!read_line(at, text)) return;
      } else if (section == Section::positions && text == "/END" && open == nullptr) {
        section = Section::end;
        result.last_line = at.line;
      } else if (section != Section::positions || !read_position(at, text, open)) {
        return error(at, "NC346",
                     "this line has no place here, or is not as this version reads it: " +
                         std::string(text.substr(0, 64)) +
                         ". /PROG, /ATTR, /MN, /POS and /END have to follow each other, positions "
                         "are in group 1, user frame 9 and tool frame 9");
      }
    }
    result.line_count = static_cast<std::uint32_t>(lines.size());
    if (section != Section::end)
      error({std::max(1U, result.line_count), 1}, "NC346", "the program has no /END");
  }

  bool read_line(TextPlace at, std::string_view text) {
    const auto colon = text.find(':');
    const auto number = whole_number(trimmed(text.substr(0, std::min(colon, text.size()))));
    if (colon == std::string_view::npos || text.back() != ';' || !number ||
        *number != static_cast<double>(instructions_.size()) + 1.0)
      return error(at, "NC346",
                   "a line is its number, rising by one, then : and ; at its end, and this is " +
                       std::string(text.substr(0, 64))),
             false;
    instructions_.push_back(
        {at, std::string(trimmed(text.substr(colon + 1, text.size() - colon - 2)))});
    return true;
  }

  // One line of a position; false when it is malformed.
  bool read_position(TextPlace at, std::string_view text, Position*& open) {
    if (open == nullptr) {
      const int number = text.back() == '{' ? index_of(text.substr(0, text.size() - 1), "P[") : 0;
      if (number == 0 || positions_.count(number) > 0) return false;
      open = &positions_[number];
      open->line = at.line;
      return true;
    }
    if (text == "};") {
      const bool good = frames_named_ && (open->is_cartesian() || open->is_joints());
      open = nullptr;
      frames_named_ = false;
      return good;
    }
    if (text == "GP1:") return true;
    return read_values(text, *open);
  }

  // "X = 1.5 mm, Y = 2 mm," and "UF : 9, UT : 9, CONFIG : '..',"
  bool read_values(std::string_view text, Position& position) {
    const auto quote = text.find('\'');
    if (quote != std::string_view::npos) {
      const auto end = text.find('\'', quote + 1);
      if (end == std::string_view::npos || !is_configuration(text.substr(quote, end + 1 - quote)) ||
          position.has_configuration)
        return false;
      position.has_configuration = true;
      text = text.substr(0, quote);
    }
    while (!(text = trimmed(text)).empty()) {
      const auto end = std::min(text.find(','), text.size());
      const std::string item = without_blanks(text.substr(0, end));
      text.remove_prefix(std::min(end + 1, text.size()));
      if (item == "CONFIG:" && position.has_configuration) continue;
      if (item == "UF:9" || item == "UT:9") {
        frames_named_ = true;
        continue;
      }
      const auto equals = item.find('=');
      if (equals == std::string::npos || equals == 0) return false;
      const std::string name = item.substr(0, equals);
      auto value = with_unit(std::string_view(item).substr(equals + 1), "mm");
      if (!value) value = with_unit(std::string_view(item).substr(equals + 1), "deg");
      if (!value || !position.values.emplace(name, *value).second) return false;
    }
    return true;
  }

  // ---- instructions

  void read(const Instruction& instruction) {
    const std::string& text = instruction.text;
    if (text.empty() || text[0] == '!') return;
    if (text.substr(0, 2) == "J " || text.substr(0, 2) == "L ") return read_motion(instruction);
    if (read_setting(instruction)) return;
    needs_stop(instruction.at);
    if (text.rfind("WAIT ", 0) == 0) {
      const auto seconds = with_unit(std::string_view(text).substr(5), "(sec)");
      if (seconds && *seconds >= 0.0) return add_event(instruction.at, "dwell", *seconds);
    }
    if (read_event(instruction.at, text, EventReader::Place::stop) || is_own_line(text) ||
        text == "PAUSE" || index_of(text, "LBL[") > 0)
      return;
    error(instruction.at,
          "this instruction is neither one of ours nor in the machine's process table: " +
              text.substr(0, 64));
  }

  // Registers 91, 92 and the frames; false when it is another instruction.
  bool read_setting(const Instruction& instruction) {
    const std::string text = without_blanks(instruction.text);
    for (const int number : {91, 92}) {
      const std::string name = "PR[" + std::to_string(number);
      if (text == name + "]=LPOS") return registers_[number].clear(), true;
      if (text.substr(0, name.size() + 1) != name + ",") continue;
      const auto end = text.find("]=");
      if (end == std::string::npos) return false;
      const auto element = whole_number(text.substr(name.size() + 1, end - name.size() - 1));
      std::string value = text.substr(end + 2);
      if (value.size() > 2 && value.front() == '(' && value.back() == ')')
        value = value.substr(1, value.size() - 2);
      const auto number_read = whole_number(value);
      if (!element || !number_read || registers_.count(number) == 0) return false;
      registers_[number][static_cast<int>(*element)] = *number_read;
      return true;
    }
    if (text == "UFRAME[9]=PR[91]" || text == "UTOOL[9]=PR[92]") {
      set_frame(instruction.at, text[1] == 'F' ? 91 : 92);
      return true;
    }
    if (text == "UFRAME_NUM=9" || text == "UTOOL_NUM=9") {
      (text[1] == 'F' ? frame_chosen_ : tool_chosen_) = true;
      return true;
    }
    return text == "R[91]=250" && (has_link_speed_ = true);
  }

  void set_frame(TextPlace at, int number) {
    const auto& values = registers_[number];
    Vec3 place, turn;
    for (int k = 1; k <= 6; ++k) {
      const auto value = values.find(k);
      if (value == values.end())
        return error(at, "NC348",
                     "PR[" + std::to_string(number) + "] has not all of its six values");
      (k <= 3 ? place[k - 1] : turn[k - 4]) = value->second;
    }
    Pose pose = Pose::Identity();
    pose.translation() = place;
    pose.linear() = rotation_from_rpy(radians_from_degrees(turn[0]), radians_from_degrees(turn[1]),
                                      radians_from_degrees(turn[2]));
    number == 91 ? set_part(at, pose) : set_tool(at, pose);
  }

  // ---- motions

  void read_motion(const Instruction& instruction) {
    std::vector<std::string_view> words;
    std::string_view rest = instruction.text;
    while (!(rest = trimmed(rest)).empty()) {
      const auto end = std::min(rest.find(' '), rest.size());
      words.push_back(rest.substr(0, end));
      rest.remove_prefix(end);
    }
    const bool joints = words[0] == "J";
    for (std::size_t i = 3; i < words.size(); ++i) {
      const std::string_view word = words[i];
      if (word.substr(0, 3) == "CNT")
        return error(instruction.at, "NC346",
                     std::string(word) +
                         ": how far CNT leaves a corner has no bound; write CR or "
                         "FINE");
      if (i > 3 && word != "TB" && words[i - 1] != "TB")
        return error(instruction.at, "NC346",
                     "the motion option " + std::string(word.substr(0, 32)) + " is not read");
    }
    if (words.size() != 4 && (joints || words.size() != 6 || words[4] != "TB"))
      return error(instruction.at, "NC346", "a motion is J or L, P[n], its speed and FINE or CR");
    if (!frame_chosen_ || !tool_chosen_ || !has_frames())
      return error(instruction.at, "NC348",
                   "a motion stands before the frames 9 are set and chosen");
    const auto found = positions_.find(index_of(words[1], "P["));
    if (found == positions_.end() ||
        !(joints ? found->second.is_joints() : found->second.is_cartesian()))
      return error(instruction.at, "the position of this motion is missing or of the other kind");
    found->second.used = true;
    if (!take_external(instruction.at, found->second)) return;
    joints ? read_joints(instruction.at, found->second, words[2], words[3])
           : read_linear(instruction.at, found->second, words);
  }

  bool take_external(TextPlace at, const Position& position) {
    for (std::size_t k = 0; k < 6; ++k) {
      const int j = axes().external[k];
      const auto value = position.values.find("E" + std::to_string(k + 1));
      if ((j >= 0) != (value != position.values.end()))
        return error(at, "an extended axis is missing, or the machine does not have it"), false;
      if (j >= 0) set_joint(j, is_rotary(j) ? radians_from_degrees(value->second) : value->second);
    }
    return true;
  }

  static std::optional<double> seconds_of(std::string_view speed) {
    if (const auto ms = with_unit(speed, "msec")) return *ms * 1e-3;
    return with_unit(speed, "sec");
  }

  void read_joints(TextPlace at, const Position& position, std::string_view speed,
                   std::string_view end) {
    std::array<double, 6> j{};
    for (std::size_t k = 0; k < 6; ++k) j[k] = position.values.at("J" + std::to_string(k + 1));
    j[2] += j[1];  // J3 is measured from the horizontal
    for (std::size_t k = 0; k < 6; ++k) set_joint(axes().arm[k], radians_from_degrees(j[k]));
    const auto percent = with_unit(speed, "%");
    const auto seconds = seconds_of(speed);
    const double value = percent ? *percent : seconds.value_or(0.0);
    if (end != "FINE" || !(value > 0.0) || (percent && *percent > 100.0))
      return error(at, "NC346", "J needs its share of the speed or its time, and FINE");
    add_joint_move(at, seconds);
  }

  void read_linear(TextPlace at, const Position& position,
                   const std::vector<std::string_view>& words) {
    LineSpeed speed;
    if (words[2] == "R[91]mm/sec") {
      if (!has_link_speed_) return error(at, "R[91] has no value");
    } else if (const auto seconds = seconds_of(words[2])) {
      speed.seconds = seconds;
    } else if (const auto tip = with_unit(words[2], "mm/sec")) {
      speed.tip = *tip;
    } else if (const auto turn = with_unit(words[2], "deg/sec")) {
      speed.turn = radians_from_degrees(*turn);
    } else {
      return error(at, "NC346", "the speed of L is in mm/sec, deg/sec, msec or sec");
    }
    if (words[2] != "R[91]mm/sec" && !(speed.seconds.value_or(0.0) > 0.0) && !(speed.tip > 0.0) &&
        !(speed.turn > 0.0))
      return error(at, "NC346", "a speed has to be above 0");
    double blend = 0.0;
    if (words[3] != "FINE") {
      const auto distance =
          words[3].substr(0, 2) == "CR" ? whole_number(words[3].substr(2)) : std::nullopt;
      if (!distance || *distance < 0.0)
        return error(at, "NC346",
                     "L ends in FINE or CR with a distance: how far CNT leaves a corner "
                     "has no bound");
      blend = *distance;
    }
    add_line_move(at, pose_of(position), speed, blend);
    if (words.size() == 6) read_trigger(at, words[5]);
  }

  static Pose pose_of(const Position& position) {
    const auto value = [&](const char* name) { return position.values.at(name); };
    Pose pose = Pose::Identity();
    pose.translation() = Vec3(value("X"), value("Y"), value("Z"));
    pose.linear() =
        rotation_from_rpy(radians_from_degrees(value("W")), radians_from_degrees(value("P")),
                          radians_from_degrees(value("R")));
    return pose;
  }

  void read_trigger(TextPlace at, std::string_view text) {
    constexpr std::string_view kHead = "0.00sec,";
    if (text.substr(0, kHead.size()) != kHead ||
        !read_event(at, text.substr(kHead.size()), EventReader::Place::on_the_fly))
      error(at, "the TB of a motion has another time than 0.00sec, or an event without a row");
  }

  std::vector<Instruction> instructions_;
  std::map<int, Position> positions_;
  std::map<int, std::map<int, double>> registers_;
  bool frames_named_ = false;
  bool frame_chosen_ = false;
  bool tool_chosen_ = false;
  bool has_link_speed_ = false;
};

}  // namespace

Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name) {
  return read_with<Reading>(machine, file_name, text);
}

}  // namespace smoothpost::fanuc_ls
