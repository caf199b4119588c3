#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "kernels/core/units.h"
#include "kernels/kinematics/screw_chain.h"
#include "machines/dialects/heidenhain.h"
#include "machines/dialects/heidenhain_text.h"
#include "machines/dialects/tool_words.h"

namespace smoothpost::heidenhain {

namespace {

constexpr std::string_view kSystemAxes = "XYZABCUVW";  // 1 to 9 of system data

/// Follows the blocks of the guard at the head of a program, one after the other.
class Guard {
 public:
  /// Takes one block; false when it belongs to no guard.
  bool take(const std::string& block) {
    const std::string text = packed_statement(block);
    if (step_ == Step::sum && take_sum(text)) return true;
    constexpr std::string_view kTool = "FN18:SYSREADQ50=ID200NR6IDX";
    if (step_ == Step::first && text.rfind(kTool, 0) == 0) {
      const auto number = whole_number(std::string_view(text).substr(kTool.size()));
      if (!number || *number < 1.0) return false;
      axis_ = 0;
      number_ = *number;
      step_ = Step::sum;
      return true;
    }
    if (step_ == Step::length && text == "FN18:SYSREADQ53=ID200NR2IDX3") {
      step_ = Step::sum;
      return true;
    }
    const int axis = axis_of(text, step_ == Step::second ? "FN18:SYSREADQ51=ID270NR1IDX"
                                                         : "FN18:SYSREADQ50=ID240NR1IDX");
    if (step_ == Step::first && axis > 0) {
      axis_ = axis;
      step_ = Step::second;
      return true;
    }
    if (step_ == Step::second && axis == axis_) {
      step_ = kSystemAxes[static_cast<std::size_t>(axis - 1)] == 'Z' ? Step::length : Step::sum;
      return true;
    }
    if (step_ == Step::jump && text == "FN11:IF+Q52GT+0.0005GOTOLBL91") {
      step_ = Step::first;
      if (axis_ == 0) return lengths_.emplace(number_, value_).second;
      return offsets_.emplace(kSystemAxes[static_cast<std::size_t>(axis_ - 1)], value_).second;
    }
    static const std::array<const char*, 7> kEnd = {"FN18:SYSREADQ53=ID210NR6",
                                                    "FN10:IF+Q53NE+0GOTOLBL91",
                                                    "FN9:IF+0EQU+0GOTOLBL92",
                                                    "LBL91",
                                                    "STOP",
                                                    "FN9:IF+0EQU+0GOTOLBL91",
                                                    "LBL92"};
    if (step_ != Step::first || offsets_.empty() || end_ == kEnd.size() || text != kEnd[end_])
      return false;
    ++end_;
    complete_ = end_ == kEnd.size();
    return true;
  }

  bool started() const { return step_ != Step::first || !offsets_.empty(); }
  bool complete(const MachineDefinition& machine) const {
    std::set<char> wanted, found;
    for (const auto& axis : machine.axes) wanted.insert(axis.letter);
    for (const auto& [letter, value] : offsets_) {
      found.insert(letter);
      const bool rotary_or_extra = letter < 'X' || letter > 'Z';
      if (rotary_or_extra && value != 0.0) return false;
    }
    return complete_ && wanted == found && !lengths_.empty();
  }
  /// The place of the part.
  Vec3 offset() const { return {value('X'), value('Y'), value('Z')}; }
  /// That of the tool with this number, mm; 0 stands for the only one.
  std::optional<double> tool_length(double number) const {
    if (number == 0.0 && lengths_.size() == 1) return lengths_.begin()->second;
    const auto found = lengths_.find(number);
    return found == lengths_.end() ? std::nullopt : std::optional(found->second);
  }

 private:
  enum class Step { first, second, length, sum, jump };

  double value(char letter) const {
    const auto found = offsets_.find(letter);
    return found == offsets_.end() ? 0.0 : found->second;
  }

  static int axis_of(std::string_view text, std::string_view head) {
    if (text.substr(0, head.size()) != head || text.size() != head.size() + 1) return 0;
    const char digit = text.back();
    return digit >= '1' && digit <= '9' ? digit - '0' : 0;
  }

  bool take_sum(std::string_view text) {
    const bool z = axis_ > 0 && kSystemAxes[static_cast<std::size_t>(axis_ - 1)] == 'Z';
    const std::string_view head = axis_ == 0 ? "Q52=ABS(Q50"
                                  : z        ? "Q52=ABS(Q50-Q51-Q53"
                                             : "Q52=ABS(Q50-Q51";
    if (text.substr(0, head.size()) != head || text.back() != ')') return false;
    text.remove_prefix(head.size());
    text.remove_suffix(1);
    if (text.empty() || (text[0] != '+' && text[0] != '-')) return false;
    const auto number = whole_number(text);
    if (!number) return false;
    value_ = -*number;
    step_ = Step::jump;
    return true;
  }

  Step step_ = Step::first;
  int axis_ = 0;         // 0: the length of a tool
  double number_ = 0.0;  // of that tool
  double value_ = 0.0;
  std::map<char, double> offsets_;
  std::map<double, double> lengths_;  // by number
  std::size_t end_ = 0;
  bool complete_ = false;
};

class Reading : public ProgramReading {
 public:
  Reading(const MachineDefinition& machine, const std::string& file)
      : ProgramReading(machine, file, "NC344"), tool_(machine) {}

  void run(const Parsed& program) {
    scale_ = program.inch ? kMillimetresPerInch : 1.0;
    inch_ = program.inch;
    for (const auto& block : program.blocks) read(block);
    result.exact_path = true;  // the tolerance cycle is none of ours
    result.line_count = program.line_count;
    result.last_line = program.end_line;
    const bool poses = std::any_of(result.moves.begin(), result.moves.end(), [](const auto& m) {
      return m.interpolation == MoveInterpolation::tool;
    });
    const bool complete = guard_.complete(machine());
    result.offset_guard = poses ? complete : only_machine_words_;
    if (guard_.started() && !complete)
      error({1, 1}, "NC345", "the guard at the head of the program is changed or incomplete");
    if (poses && complete) {
      result.part = Pose::Identity();
      result.part->translation() = guard_.offset();
    }
    if (centre_)
      error({program.end_line, 1}, "TCPM is still on at the end: write FUNCTION RESET TCPM");
  }

 private:
  void read(const Block& block) {
    if (result.moves.empty() && guard_.take(block.text)) return;
    if (block.is_line) {
      if (has_ended())
        return error(block.at, "a motion stands behind the last lines of the machine file");
      return read_motion(block);
    }
    const std::string text = packed_statement(block.text);
    note_tool_call(text);
    if (text == "FUNCTIONRESETTCPM") {
      centre_ = false;
      reset_ = true;
    } else if (text == "FUNCTIONTCPMFTCPAXISPOSPATHCTRLVECTOR") {
      if (!all_known())
        error(block.at,
              "TCPM begins before every axis has been named: where the tool stands is not known, "
              "nor how fast the first motion is. Name them with M91 before");
      centre_ = true;
      began_ = true;
      begin_at_tip(block);
    } else if (text == "M127") {
      written_way_ = true;
    } else if (text == "CYCLDEF9.0DWELLTIME") {
      dwell_line_ = block.at.line;
    } else if (text.rfind("CYCLDEF9.1DWELL", 0) == 0) {
      const auto seconds = whole_number(std::string_view(text).substr(15));
      if (dwell_line_ + 1 != block.at.line || !seconds || *seconds < 0.0)
        return error(block.at, "CYCL DEF 9.1 needs CYCL DEF 9.0 in front of it and its seconds");
      add_event(block.at, "dwell", *seconds);
    } else if (!read_event(block.at, block.text) && !is_own_line(block.text) && text != "STOP" &&
               text != "M30" && text != "M2") {
      error(block.at, "this block is neither one of ours nor in the machine's process table: " +
                          block.text.substr(0, 64));
    }
  }

  void read_motion(const Block& block) {
    if (!reset_ || !written_way_)
      return error(block.at, "a motion stands before FUNCTION RESET TCPM and M127");
    const auto f = block.find("F");
    if (block.rapid == f.has_value()) return error(block.at, "a block needs F or FMAX");
    ReadBackMove move = new_move(block.at);
    move.rapid = block.rapid;
    if (centre_ ? read_pose(block, move) : read_joints(block, move))
      result.moves.push_back(std::move(move));
  }

  double feed_per_second(double f) const {
    constexpr double kTenthsOfInch = 10.0;
    return f / kSecondsPerMinute / (inch_ ? kTenthsOfInch : 1.0);
  }

  bool read_joints(const Block& block, ReadBackMove& move) {
    if (block.is_vector) return error(block.at, "LN without TCPM"), false;
    if (!block.machine_words) {
      only_machine_words_ = false;
      return error(block.at, "machine axes without M91: an offset may be live"), false;
    }
    const JointVector from = joints();
    const JointMask known_from = known();
    double linear = 0.0, rotary = 0.0;
    int count = 0;
    bool known_start = true;
    for (const auto& word : block.words) {
      if (word.address == "F") continue;
      const int j = word.address.size() == 1 ? machine().axis_by_letter(word.address[0]) : -1;
      if (j < 0)
        return error(block.at, "word " + word.address + " is no axis of the machine"), false;
      set_joint(j, is_rotary(j) ? radians_from_degrees(word.value) : word.value * scale_);
      const double way = joints()[j] - from[j];
      known_start = known_start && (known_from >> j & 1U);
      (is_rotary(j) ? rotary : linear) +=
          std::pow(is_rotary(j) ? degrees_from_radians(way) : way / scale_, 2);
      ++count;
    }
    if (count == 0) return error(block.at, "a motion without axis words"), false;
    if (const auto f = block.find("F"); f && known_start)
      move.duration = std::sqrt(linear > 0.0 ? linear : rotary) / feed_per_second(*f);
    move.to = joints();
    move.known = known();
    return true;
  }

  // TOOL CALL 5 Z S2000. With a name or a parameter in the place of the number the tool is none
  // that the guard has, with neither (TOOL CALL S2000) it stays.
  void note_tool_call(std::string_view text) {
    constexpr std::string_view kCall = "TOOLCALL";
    if (text.substr(0, kCall.size()) != kCall) return;
    text.remove_prefix(kCall.size());
    const auto end = std::min(text.find_first_not_of("0123456789"), text.size());
    if (end > 0)
      spindle_tool_ = whole_number(text.substr(0, end)).value_or(-1.0);
    else if (!text.empty() && (text[0] == '"' || text[0] == 'Q'))
      spindle_tool_ = -1.0;
  }

  // Where the tip is, for the time of the first tool move.
  void begin_at_tip(const Block& block) {
    if (!all_known() || !guard_.complete(machine())) return tool_.stand(joints(), std::nullopt);
    const auto length = guard_.tool_length(spindle_tool_);
    if (!length)
      return error(block.at,
                   "the guard says nothing of the length of the tool in the spindle: TOOL CALL "
                   "names a tool by its number, and the guard has its length");
    ScrewChain chain = chain_of(machine(), *length);
    chain.workpiece_home = Pose::Identity();
    chain.workpiece_home.translation() = guard_.offset();
    tool_.stand(joints(), forward_location(chain, joints()).tip);
  }

  bool read_pose(const Block& block, ReadBackMove& move) {
    if (block.machine_words) return error(block.at, "M91 while TCPM is on"), false;
    if (began_) tool_.begin(block.is_vector);
    if (!began_ && block.is_vector != by_vector_)
      return error(block.at, "L and LN under one TCPM"), false;
    began_ = false;
    by_vector_ = block.is_vector;
    Vec3 vector = Vec3::Zero();
    int components = 0;
    for (const auto& word : block.words) {
      const std::string& address = word.address;
      const int j = address.size() == 1 ? machine().axis_by_letter(address[0]) : -1;
      if (address == "F") continue;
      if (address.size() == 1 && address[0] >= 'X' && address[0] <= 'Z') {
        tool_.name_tip(address[0] - 'X', word.value * scale_);
      } else if (by_vector_ && address.size() == 2 && address[0] == 'T' && address[1] >= 'X' &&
                 address[1] <= 'Z') {
        vector[address[1] - 'X'] = word.value;
        ++components;
      } else if (!by_vector_ && j >= 0 && is_rotary(j)) {
        tool_.name_rotary(j, radians_from_degrees(word.value));
      } else {
        return error(block.at, "word " + address + " is not one of ours under TCPM"), false;
      }
    }
    if (components != 0 && (components != 3 || !tool_.name_vector(vector)))
      return error(block.at, "TX TY TZ have to be three, of unit length"), false;
    if (!tool_.is_complete())
      return error(block.at,
                   "behind FUNCTION TCPM the first motion has to name X Y Z and the tool's axis"),
             false;
    move.interpolation = MoveInterpolation::tool;
    move.tool = tool_.pose();
    const auto way = tool_.arrive();
    if (const auto f = block.find("F"); f && way)
      move.duration = way->in_program(scale_) / feed_per_second(*f);
    for (int j = 0; j < machine().size(); ++j) forget_joint(j);
    return true;
  }

  gcode::ToolFollowing tool_;
  Guard guard_;
  double scale_ = 1.0;
  bool inch_ = false;
  bool reset_ = false;
  bool written_way_ = false;  // M127
  bool centre_ = false;       // TCPM
  bool began_ = false;
  bool by_vector_ = false;
  bool only_machine_words_ = true;
  double spindle_tool_ = 0.0;  // of the last TOOL CALL; 0: there was none
  std::uint32_t dwell_line_ = 0;
};

}  // namespace

Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name) {
  return read_with<Reading>(machine, file_name, parse(text, file_name));
}

}  // namespace smoothpost::heidenhain
