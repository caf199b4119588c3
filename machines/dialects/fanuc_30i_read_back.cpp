#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "kernels/core/units.h"
#include "kernels/kinematics/screw_chain.h"
#include "kernels/spline/bent_move.h"
#include "machines/dialects/fanuc_30i.h"
#include "machines/dialects/gcode_program.h"
#include "machines/dialects/tool_words.h"

namespace smoothpost::fanuc_30i {

namespace {

using gcode::Block;
using gcode::Word;

/// What the IF blocks at the head of a program demand, read from their text alone.
class Guard {
 public:
  /// Takes one block; false when it is no condition of a guard.
  bool take(std::string_view raw, bool inch) {
    const std::string text = packed_statement(raw);
    const std::string_view limit = inch ? "GT0.00002]THEN#3000=" : "GT0.0005]THEN#3000=";
    std::string_view rest = text;
    if (rest.substr(0, 3) != "IF[" || rest.back() != ')') return false;
    const auto at = rest.find(limit);
    if (at == std::string_view::npos) return false;
    const std::string_view alarm = rest.substr(at + limit.size());
    if (alarm.size() < 4 || alarm[0] < '1' || alarm[0] > '9' || alarm[1] != '(') return false;
    std::string_view value = rest.substr(3, at - 3);
    if (value.size() > 2 && value.front() == '[' && value.back() == ']')
      return take_sum(value.substr(1, value.size() - 2));
    if (value.size() < 6 || value.substr(0, 4) != "ABS[" || value.back() != ']') return false;
    value = value.substr(4, value.size() - 5);
    return take_place(value) || take_length(value);
  }

  bool empty() const { return zero_.empty() && lengths_.empty() && place_.empty(); }

  bool complete(int axes, bool poses) const {
    std::set<int> wanted;
    for (int n = poses ? 4 : 1; n <= axes; ++n) wanted.insert(n);
    return zero_ == wanted && lengths_.empty() != poses && place_.size() == (poses ? 3 : 0);
  }
  std::optional<Vec3> place() const {
    if (place_.size() != 3) return std::nullopt;
    return Vec3(place_.at(1), place_.at(2), place_.at(3));
  }
  /// That of offset H.
  std::optional<double> tool_length(int offset) const {
    const auto found = lengths_.find(offset);
    return found == lengths_.end() ? std::nullopt : std::optional(found->second);
  }
  /// The offset of the first length; 0: there is none.
  int tool() const { return tool_; }

 private:
  static bool drop(std::string_view& text, const std::string& head) {
    if (text.substr(0, head.size()) != head) return false;
    text.remove_prefix(head.size());
    return true;
  }

  static std::string offset_of(int n) {
    return "#" + std::to_string(5020 + n) + "-#" + std::to_string(5040 + n);
  }

  bool take_sum(std::string_view text) {
    if (!zero_.empty()) return false;
    std::set<int> found;
    constexpr int kMostAxes = 20;
    while (!text.empty()) {
      if (!found.empty() && !drop(text, "+")) return false;
      int n = 1;
      while (n <= kMostAxes && !drop(text, "ABS[" + offset_of(n) + "]")) ++n;
      if (n > kMostAxes || !found.insert(n).second) return false;
    }
    zero_ = std::move(found);
    return true;
  }

  bool take_place(std::string_view text) {
    for (int n = 1; n <= 3; ++n) {
      std::string_view rest = text;
      if (!drop(rest, offset_of(n)) || rest.empty() || (rest[0] != '+' && rest[0] != '-')) continue;
      const auto value = whole_number(rest);
      return value && place_.emplace(n, -*value).second;
    }
    return false;
  }

  bool take_length(std::string_view text) {
    constexpr int kMostTools = 400;
    for (int h = 1; h <= kMostTools; ++h) {
      std::string_view rest = text;
      if (!drop(rest, "#" + std::to_string(11000 + h) + "+#" + std::to_string(10000 + h))) continue;
      if (rest.empty() || (rest[0] != '+' && rest[0] != '-')) continue;
      const auto value = whole_number(rest);
      if (!value || !lengths_.emplace(h, -*value).second) return false;
      if (tool_ == 0) tool_ = h;
      return true;
    }
    return false;
  }

  std::set<int> zero_;             // control axes whose offset has to be 0
  std::map<int, double> place_;    // of X Y Z
  std::map<int, double> lengths_;  // by offset
  int tool_ = 0;
};

class Reading : public gcode::GcodeReading {
 public:
  Reading(const MachineDefinition& machine, const std::string& file)
      : GcodeReading(machine, file), tool_(machine) {}

 private:
  enum class Centre { off, positions, vectors };

  bool take_guard(const Block& block) override {
    if (!guard_.take(block.raw, scale_ != 1.0)) return false;
    guarded_in_place_ = guarded_in_place_ && unit_ && work_offset_ && !centre_live();
    return true;
  }
  bool centre_live() const { return centre_ != Centre::off; }

  void finish() override {
    const bool poses = std::any_of(result.moves.begin(), result.moves.end(), [](const auto& m) {
      return m.interpolation == MoveInterpolation::tool;
    });
    result.exact_path = exact_;
    result.offset_guard =
        !guard_.empty() && guarded_in_place_ && guard_.complete(machine().size(), poses);
    if (!guard_.empty() && !result.offset_guard)
      error({1, 1}, "NC342", "the guard at the head of the program is changed or incomplete");
    if (result.offset_guard && poses) {
      result.part = Pose::Identity();
      result.part->translation() = *guard_.place() * scale_;
    }
    if (poses && unplaced_line_ > 0 && !result.offset_guard)
      error({unplaced_line_, 1}, "joint words behind a work offset whose place is not known");
    if (centre_live())
      error({result.last_line, 1}, "tool centre point control is still on at the end: write G49");
  }

  // ---- settings

  bool read_setting(const Block& block) override {
    // H is the number of the tool, where it can be.
    const Word* tool = block.find('T');
    if (tool != nullptr && tool->value >= 1.0 && tool->value <= 400.0 &&
        tool->value == std::floor(tool->value))
      spindle_tool_ = tool->value;
    if (block.has('G', 4.0)) {
      dwell(block, block.find('X'), 1.0);
      return true;
    }
    if (block.has('G', 43.4) || block.has('G', 43.5)) return read_centre(block);
    if (block.has('G', 5.1)) return read_contour_control(block);
    if (block.words.size() == 1 && block.words[0].letter == 'O') return result.moves.empty();
    static const std::set<double> kCodes = {17, 20, 21, 40, 49, 54, 61, 69, 80, 90, 93, 94};
    for (const auto& word : block.words)
      if (word.letter != 'G' || kCodes.count(word.value) == 0) return false;
    for (const auto& word : block.words) set(word.value);
    return true;
  }

  bool read_contour_control(const Block& block) {
    const Word* q = block.find('Q');
    return block.words.size() == 2 && q != nullptr && (q->value == 0.0 || q->value == 1.0);
  }

  bool read_centre(const Block& block) {
    const Word* h = block.find('H');
    const Word* p = block.find('P');
    if (block.words.size() != 3 || h == nullptr || h->value < 1.0 || p == nullptr ||
        p->value != 1.0) {
      error(block.at,
            "G43.4 and G43.5 need H and P1: without tool posture control nothing is known of the "
            "tool between two blocks");
      return true;
    }
    const double wanted = spindle_tool_.value_or(guard_.tool() > 0 ? guard_.tool() : h->value);
    if (h->value != wanted)
      error(block.at, "H" + decimal_word(h->value) + " is not the length of tool " +
                          decimal_word(wanted) + ", which is in the spindle: write H" +
                          decimal_word(wanted));
    if (!all_known())
      error(block.at,
            "tool centre point control begins before every axis has been named: where the tool "
            "stands is not known, nor how fast the first motion is. Name them in G53 G0 before");
    centre_ = block.has('G', 43.4) ? Centre::positions : Centre::vectors;
    tool_.begin(centre_ == Centre::vectors);
    const auto length = guard_.tool_length(static_cast<int>(h->value));
    if (!guard_.empty() && !length)
      error(block.at, "the guard says nothing of the length in H" + decimal_word(h->value));
    tool_.stand(joints(), length ? tip(*length) : std::nullopt);
    return true;
  }

  void set(double code) {
    if (code == 20.0 || code == 21.0) {
      scale_ = code == 20.0 ? kMillimetresPerInch : 1.0;
      unit_ = true;
    }
    if (code == 49.0) centre_ = Centre::off;
    if (code == 54.0) work_offset_ = true;
    if (code == 61.0) exact_ = result.moves.empty() || exact_;
    if (code == 90.0) absolute_ = true;
    if (code == 93.0 || code == 94.0) inverse_time_ = code == 93.0;
  }

  // ---- moves

  void read_motion(const Block& block) override {
    if (!unit_ || !absolute_ || !exact_ || !work_offset_)
      return error(block.at, "a motion stands before G21 or G20, G90, G54 and G61 are set");
    for (const auto& word : block.words) {
      if (word.letter != 'G') continue;
      if (word.value == 49.0)
        leave_centre(block);
      else if (is_arc(block) ? !is_arc_code(word.value)
                             : word.value != 0.0 && word.value != 1.0 && word.value != 53.0)
        return error(block.at, "G" + decimal_word(word.value) + " is not one of ours in a motion");
    }
    ReadBackMove move = new_move(block.at);
    move.rapid = block.has('G', 0.0);
    const Word* f = block.find('F');
    if (move.rapid == (f != nullptr))
      return error(block.at, "F belongs to G1, G2 and G3, and to each of them");
    if (is_arc(block) && (centre_live() || guard_.place()))
      return error(block.at, "an arc in a program of tool moves is not one of ours");
    if (f != nullptr && f->value <= 0.0) return error(block.at, "F has to be above 0");
    const bool good = centre_live() ? read_pose(block, f, move) : read_joints(block, f, move);
    if (good) result.moves.push_back(std::move(move));
  }

  static bool is_arc_code(double code) {
    return code == 2.0 || code == 3.0 || (code >= 17.0 && code <= 19.0);
  }

  static std::string decimal_word(double value) {
    return std::to_string(static_cast<int>(std::floor(value)));
  }

  void leave_centre(const Block& block) {
    if (!centre_live()) return;
    centre_ = Centre::off;
    for (const char letter : {'X', 'Y', 'Z'})
      if (machine().axis_by_letter(letter) >= 0 && block.find(letter) == nullptr)
        error(block.at, std::string("the block of G49 does not name ") + letter +
                            ": the tool's length would stay in that axis");
  }

  bool read_joints(const Block& block, const Word* f, ReadBackMove& move) {
    const bool machine_words = block.has('G', 53.0);
    if (machine_words && !move.rapid) return error(block.at, "G53 moves in G0 only"), false;
    if (f != nullptr && !inverse_time_)
      return error(block.at, "a feed of machine axes needs G93"), false;
    Vec3 shift = Vec3::Zero();
    if (!machine_words) {
      if (const auto place = guard_.place()) shift = *place * scale_;
      if (unplaced_line_ == 0) unplaced_line_ = block.at.line;
    }
    const ArcStart start{joints(), known(), scale_};
    if (!take_axes(block, {is_arc(block) ? "GFIJKRP" : "GF", scale_, shift})) return false;
    if (f != nullptr) move.duration = kSecondsPerMinute / f->value;
    move.to = joints();
    move.known = known();
    if (is_arc(block)) {
      if (!take_arc(block, start, move)) return false;
      // F is the speed over the radius.
      const JointBend none;
      move.duration *= std::abs(arc_shape({start.joints, move.to, none, move.arc}).sweep);
    }
    return true;
  }

  // Where the tip is with a tool of that length, for the time of the first move behind; nothing
  // when the text does not say.
  std::optional<Vec3> tip(double length) const {
    const auto place = guard_.place();
    if (!all_known() || !place) return std::nullopt;
    ScrewChain chain = chain_of(machine(), length * scale_);
    chain.workpiece_home = Pose::Identity();
    chain.workpiece_home.translation() = *place * scale_;
    return forward_location(chain, joints()).tip;
  }

  bool read_pose(const Block& block, const Word* f, ReadBackMove& move) {
    if (inverse_time_) return error(block.at, "a feed of the tool needs G94"), false;
    Vec3 vector = Vec3::Zero();
    bool has_vector = false;
    for (const auto& word : block.words) {
      static constexpr std::string_view kTip = "XYZ", kVector = "IJK";
      if (word.letter == 'G' || word.letter == 'F') continue;
      const auto tip = kTip.find(word.letter), component = kVector.find(word.letter);
      const int j = machine().axis_by_letter(word.letter);
      if (tip != std::string_view::npos) {
        tool_.name_tip(static_cast<int>(tip), word.value * scale_);
      } else if (component != std::string_view::npos && centre_ == Centre::vectors) {
        vector[static_cast<Eigen::Index>(component)] = word.value;
        has_vector = true;
      } else if (j >= 0 && is_rotary(j) && centre_ == Centre::positions) {
        tool_.name_rotary(j, radians_from_degrees(word.value));
      } else {
        return error(block.at, std::string("word ") + word.letter +
                                   " is not one of ours under tool centre point control"),
               false;
      }
    }
    if (has_vector && !tool_.name_vector(vector))
      return error(block.at, "the vector I J K is far from unit length"), false;
    if (!tool_.is_complete())
      return error(block.at,
                   "behind G43.4 or G43.5 the first motion has to name X Y Z and the tool's axis"),
             false;
    move.interpolation = MoveInterpolation::tool;
    move.tool = tool_.pose();
    const auto way = tool_.arrive();
    if (f != nullptr && way) move.duration = way->in_program(scale_) / f->value * kSecondsPerMinute;
    for (int j = 0; j < machine().size(); ++j) forget_joint(j);
    return true;
  }

  Guard guard_;
  bool guarded_in_place_ = true;
  double scale_ = 1.0;
  bool unit_ = false;
  bool absolute_ = false;
  bool exact_ = false;
  bool work_offset_ = false;
  bool inverse_time_ = false;
  Centre centre_ = Centre::off;
  std::optional<double> spindle_tool_;  // of the last T word
  gcode::ToolFollowing tool_;
  std::uint32_t unplaced_line_ = 0;
};

}  // namespace

Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name) {
  return read_with<Reading>(machine, file_name, gcode::parse(text, file_name, {250, false, true}));
}

}  // namespace smoothpost::fanuc_30i
