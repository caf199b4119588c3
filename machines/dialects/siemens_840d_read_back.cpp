#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>

#include "formats/siemens/mpf_reader.h"
#include "kernels/core/units.h"
#include "machines/dialects/arc_text.h"
#include "machines/dialects/event_text.h"
#include "machines/dialects/program_reading.h"
#include "machines/dialects/siemens_840d.h"

namespace smoothpost::siemens_840d {

namespace {

using siemens::MpfBlock;
using siemens::MpfWord;

/// What the guard at the head of a program demands, read from its text alone.
class GuardReader {
 public:
  explicit GuardReader(const MachineDefinition& machine) {
    for (const char axis : {'X', 'Y', 'Z'}) {
      needed_.insert(std::string("TR") + axis);
      needed_.insert(std::string("RT") + axis);
      needed_.insert(std::string("SC") + axis);
    }
    for (const auto& axis : machine.axes) needed_.insert(std::string("TR") + axis.letter);
  }

  /// Takes one block; false when it belongs to no guard.
  bool take(const MpfBlock& block, bool inch) {
    const std::string text = packed_statement(block.text);
    if (text.rfind("IF", 0) == 0) return condition(text, inch);
    const bool known = text.rfind("MSG(\"smoothpost: ", 0) == 0 || text == "GOTOFSP_START" ||
                       text == "GOTOBSP_WRONG_OFFSET" || text == "GOTOBSP_WRONG_TOOL";
    const bool label = text.empty() && block.label.rfind("SP_", 0) == 0;
    const bool stop = text == "M0" && !stops_.empty() && stops_.back().rfind("MSG", 0) == 0;
    if (!known && !label && !stop) return false;
    stops_.push_back(label ? block.label + ":" : known && text[0] == 'M' ? "MSG" : text);
    return true;
  }

  bool started() const { return !stops_.empty() || !found_.empty(); }

  /// Whether every condition and the stops behind them are there, in order.
  bool complete(bool poses) const {
    std::set<std::string> needed = needed_;
    if (poses)
      for (const char* component : {"L1", "L2", "L3"}) needed.insert(component);
    std::set<std::string> found;
    for (const auto& [name, value] : found_) found.insert(name);
    std::vector<std::string> stops = {"GOTOFSP_START", "SP_WRONG_OFFSET:", "MSG", "M0",
                                      "GOTOBSP_WRONG_OFFSET"};
    if (poses)
      for (const char* line : {"SP_WRONG_TOOL:", "MSG", "M0", "GOTOBSP_WRONG_TOOL"})
        stops.emplace_back(line);
    stops.emplace_back("SP_START:");
    return found == needed && found_.size() == needed.size() && stops == stops_ &&
           value("L2") == 0.0 && value("L3") == 0.0 && rotaries_zero();
  }

  /// The frame that the conditions demand, lengths times `scale` are mm.
  Pose part(double scale) const {
    Pose pose = Pose::Identity();
    pose.translation() = Vec3(value("TRX"), value("TRY"), value("TRZ")) * scale;
    pose.linear() =
        rotation_from_rpy(radians_from_degrees(value("RTX")), radians_from_degrees(value("RTY")),
                          radians_from_degrees(value("RTZ")));
    return pose;
  }

 private:
  double value(const std::string& name) const {
    for (const auto& [key, v] : found_)
      if (key == name) return v;
    return 0.0;
  }

  bool rotaries_zero() const {
    return std::all_of(found_.begin(), found_.end(), [](const auto& row) {
      const bool geometry = row.first.back() >= 'X' && row.first.back() <= 'Z';
      return row.first.rfind("TR", 0) != 0 || geometry || row.second == 0.0;
    });
  }

  // Reads "IF <condition> GOTOF <label>" without blanks.
  bool condition(std::string_view text, bool inch) {
    const std::string_view lengths_end = inch ? "))>0.00002" : "))>0.0005";
    const auto jump = text.find("GOTOFSP_WRONG_");
    if (jump == std::string_view::npos) return false;
    std::string_view left = text.substr(2, jump - 2);
    const std::string_view to = text.substr(jump + 14);
    const auto between = [](std::string_view whole, std::string_view head,
                            std::string_view tail) -> std::optional<double> {
      if (whole.size() <= head.size() + tail.size() || whole.substr(0, head.size()) != head ||
          whole.substr(whole.size() - tail.size()) != tail)
        return std::nullopt;
      const auto number = whole.substr(head.size(), whole.size() - head.size() - tail.size());
      double value = 0.0;
      const auto end = number.data() + number.size();
      const auto read = std::from_chars(number.data(), end, value, std::chars_format::fixed);
      if (read.ec != std::errc() || read.ptr != end) return std::nullopt;
      return value;
    };
    for (const char letter : std::string_view("XYZABCUVWPQ")) {
      const std::string frame = std::string("$P_ACTFRAME[") + letter;
      if (to != "OFFSET") break;
      if (const auto v = between(left, "ABS(" + frame + ",TR]+" + frame + ",FI]-(", lengths_end))
        return add(std::string("TR") + letter, *v);
      if (const auto v = between(left, "ABS(" + frame + ",RT]-(", "))>0.0001"))
        return add(std::string("RT") + letter, *v);
      if (left == "(" + frame + ",SC]<>1)OR(" + frame + ",MI]<>0)")
        return add(std::string("SC") + letter, 1.0);
    }
    for (const char component : std::string_view("123"))
      if (const auto v =
              between(left, std::string("ABS($P_TOOLL[") + component + "]-(", lengths_end);
          v && to == "TOOL")
        return add(std::string("L") + component, *v);
    return false;
  }

  bool add(std::string name, double v) {
    if (!stops_.empty()) return false;  // behind the jump a condition is never reached
    found_.emplace_back(std::move(name), v);
    return true;
  }

  std::set<std::string> needed_;
  std::vector<std::pair<std::string, double>> found_;
  std::vector<std::string> stops_;
};

/// Follows the blocks as the control would.
class Reading {
 public:
  Reading(const MachineDefinition& machine, const std::string& file)
      : machine_(machine), file_(file), events_(machine.process), guard_(machine) {
    joints_ = JointVector::Zero(machine.size());
    for (const auto& line : machine.dialect.start) start_lines_.push_back(packed(line));
    for (const auto& line : machine.dialect.end) end_lines_.push_back(packed(line));
  }

  void run(const siemens::MpfProgram& program) {
    for (const auto& block : program.blocks) read(block);
    result.exact_path = exact_;
    result.line_count = program.line_count;
    result.last_line = program.end_line;
    const bool poses = std::any_of(result.moves.begin(), result.moves.end(), [](const auto& m) {
      return m.interpolation == MoveInterpolation::tool;
    });
    const bool in_place = poses ? guard_frame_ == Frame::g54 && guard_edge_ == 1
                                : guard_frame_ == Frame::zero && guard_edge_ == 0;
    result.offset_guard = in_place && guard_.complete(poses);
    if (result.offset_guard && poses) result.part = guard_.part(scale_);
    if (guard_.started() && !result.offset_guard)
      error_at(1, 1, "NC329", "the guard at the head of the program is changed or incomplete");
  }

  ReadBack result;
  Diagnostics diagnostics;

 private:
  enum class Frame { unknown, zero, g54 };

  static std::string packed(const std::string& line) {
    return packed_statement(line.substr(0, line.find(';')));
  }

  void error_at(std::uint32_t line, std::uint32_t column, const char* code, std::string text) {
    Diagnostic d;
    d.code = code;
    d.text = std::move(text);
    d.where = {file_, static_cast<int>(line), static_cast<int>(column)};
    diagnostics.push_back(std::move(d));
  }
  void error(const MpfBlock& at, std::string text) {
    error_at(at.line, at.column, "NC328", std::move(text));
  }

  void read(const MpfBlock& block) {
    // The guard stands before the first motion and is one piece.
    if (result.moves.empty() && guard_.take(block, scale_ != 1.0)) {
      guard_frame_ = frame_;
      guard_edge_ = edge_;
      return;
    }
    if (block.text.empty()) return;  // a label of ours
    if (block.is_words && is_motion(block)) return read_motion(block);
    if (block.is_words && read_setting(block)) return;
    if (const auto event = events_.find(block.text, EventReader::Place::any)) {
      if (moves_axes(block)) error(block, "an event's words move an axis or change a mode");
      return add_event(block, *event, 0.0);
    }
    const std::string text = packed(block.text);
    if (text == "M0" || text == "M30" || text == "M2" || text == "M17") return;
    if (is_template(text)) return;
    error(block, "this block is neither one of ours nor in the machine's process table: " +
                     block.text.substr(0, 64));
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

  static bool is_motion(const MpfBlock& block) {
    for (const double g : {0.0, 1.0, 2.0, 3.0})
      if (block.has('G', g)) return true;
    return block.has("POLY");
  }

  // G words and axis words of an event would act behind our back.
  bool moves_axes(const MpfBlock& block) const {
    for (const auto& word : block.words) {
      if (word.address == "G" || word.address == "D") return true;
      if (word.value && (word.address == "X" || word.address == "Y" || word.address == "Z"))
        return true;
      for (const auto& axis : machine_.axes)
        if (word.value && word.address == std::string(1, axis.letter)) return true;
      for (const char* keyword : {"TRAORI", "TRAFOOF", "TRANS", "ROT", "SUPA", "RTLIOF", "G4",
                                  "POLY", "UPATH", "SPATH", "FGROUP", "POLYPATH"})
        if (word.address == keyword) return true;
    }
    return false;
  }

  // ---------------------------------------------------------------------------------- settings

  // A block of modal words. False, with nothing changed, when it holds a word that is not ours.
  bool read_setting(const MpfBlock& block) {
    if (block.has('G', 4.0)) return read_dwell(block);
    static const std::set<std::string> kWords = {"TRAORI", "TRAFOOF", "ORIWKS", "ORIVECT", "RTLION",
                                                 "RTLIOF", "STOPRE",  "TRANS",  "UPATH"};
    static const std::set<double> kCodes = {17, 40, 54, 60, 90, 93, 94, 500, 601, 700, 710};
    for (const auto& word : block.words) {
      const bool code = word.address == "G" && word.value && kCodes.count(*word.value) > 0;
      const bool keyword = !word.value && kWords.count(word.address) > 0;
      const bool edge = word.address == "D" && (word.value == 0.0 || word.value == 1.0);
      if (!code && !keyword && !edge) return false;
    }
    for (const auto& word : block.words) set(word);
    if (block.has("TRANS") && block.words.size() > 1)
      error(block, "TRANS with values shifts the frame");
    return true;
  }

  void set(const MpfWord& word) {
    if (word.address == "D") edge_ = word.value == 1.0 ? 1 : 0;
    if (word.address == "TRAORI" || word.address == "TRAFOOF") {
      transformation_ = word.address == "TRAORI";
      transformation_known_ = true;
      frame_ = Frame::unknown;  // the control drops it
      forget();
    }
    if (word.address == "ORIWKS") in_part_ = true;
    if (word.address == "UPATH") by_parameter_ = true;
    if (word.address == "ORIVECT") great_circle_ = true;
    if (word.address != "G") return;
    const double g = *word.value;
    if (g == 54.0) frame_ = Frame::g54;
    if (g == 500.0) frame_ = Frame::zero;
    if (g == 60.0) exact_ = result.moves.empty() || exact_;
    if (g == 90.0) absolute_ = true;
    if (g == 93.0 || g == 94.0) inverse_time_ = g == 93.0;
    if (g == 700.0 || g == 710.0) {
      scale_ = g == 700.0 ? kMillimetresPerInch : 1.0;
      unit_ = true;
    }
  }

  void forget() {
    tip_known_ = 0;
    axis_known_ = false;
  }

  bool read_dwell(const MpfBlock& block) {
    const auto* seconds = block.find("F");
    if (block.words.size() != 2 || seconds == nullptr || !seconds->value || *seconds->value < 0.0) {
      error(block, "G4 needs F with seconds and nothing else");
      return true;
    }
    add_event(block, "dwell", *seconds->value);
    return true;
  }

  void add_event(const MpfBlock& block, std::string name, double seconds) {
    if (name == event_name::kBeamOn || name == event_name::kPierce) beam_ = true;
    if (name == event_name::kBeamOff) beam_ = false;
    if (name == event_name::kToolChange) edge_ = -1;  // the control may select a D of its own
    result.events.push_back({result.moves.size(), std::move(name), seconds, beam_, block.line});
  }

  // ------------------------------------------------------------------------------------- moves

  void read_motion(const MpfBlock& block) {
    if (ended_) return error(block, "a motion stands behind the last lines of the machine file");
    if (!unit_ || !absolute_ || !transformation_known_ || !exact_)
      return error(block,
                   "a motion stands before G710 or G700, G90, G60 and TRAORI or TRAFOOF are set");
    ReadBackMove move;
    move.rapid = block.has('G', 0.0);
    const bool bent = block.has("POLY");
    const bool arc = is_arc(block);
    for (const auto& word : block.words) {
      if (word.address != "G" || !word.value) continue;
      const double g = *word.value;
      if (g > 1.0 && !(arc && (g <= 3.0 || (g >= 17.0 && g <= 19.0))))
        return error(block, "a motion with another G word is not one of ours");
    }
    move.line = block.line;
    move.beam = beam_;
    move.to = JointVector::Zero(machine_.size());
    const auto* f = block.find("F");
    if (!move.rapid) {
      if (!inverse_time_ || f == nullptr || !f->value || *f->value <= 0.0)
        return error(block, "a feed needs G93 and F above 0 in its block");
      move.duration = kSecondsPerMinute / *f->value;
    } else if (f != nullptr) {
      return error(block, "F in a block of G0");
    }
    if (bent && !may_bend(block)) return;
    if (arc && transformation_) return error(block, "an arc under TRAORI is not one of ours");
    if (transformation_ ? read_pose(block, move) : read_joints(block, move))
      result.moves.push_back(std::move(move));
  }

  static bool is_arc(const MpfBlock& block) { return block.has('G', 2.0) || block.has('G', 3.0); }

  // A polynomial begins where the axis stands, and the path has to follow its parameter: with SPATH
  // axes outside of FGROUP follow the length of the others' way.
  bool may_bend(const MpfBlock& block) {
    const char* why = transformation_          ? "a polynomial under TRAORI is not one of ours"
                      : !by_parameter_         ? "a polynomial without UPATH"
                      : block.has("SUPA")      ? "a polynomial with SUPA is not one of ours"
                      : known_ != all_joints() ? "a polynomial before every axis has a position"
                                               : nullptr;
    if (why != nullptr) error(block, why);
    return why == nullptr;
  }

  JointMask all_joints() const { return (JointMask{1} << machine_.size()) - 1U; }

  bool read_joints(const MpfBlock& block, ReadBackMove& move) {
    const bool suppressed = block.has("SUPA");
    for (const auto& word : block.words)
      if (word.address == "D") edge_ = word.value == 0.0 ? 0 : 1;
    if (edge_ != 0) return error(block, "joint words with a tool length: D0 is missing"), false;
    if (!suppressed && frame_ != Frame::zero)
      return error(block, "joint words with an offset: SUPA or G500 is missing"), false;
    int joints = 0;
    const JointVector from = joints_;
    const JointMask known_from = known_;
    const bool arc = is_arc(block);
    if (block.has("POLY")) move.bend = JointBend::Zero(machine_.size(), 4);
    for (const auto& word : block.words) {
      static const std::set<std::string> kOthers = {"G", "F", "D", "SUPA", "POLY", "PL"};
      if (!word.polynomial && kOthers.count(word.address) > 0) continue;
      if (arc && (word.address == "I" || word.address == "J" || word.address == "K")) continue;
      const int j = word.address.size() == 1 ? machine_.axis_by_letter(word.address[0]) : -1;
      if (j < 0 || !word.value)
        return error(block, "word " + word.address + " is no axis of the machine"), false;
      const bool rotary =
          machine_.axes[static_cast<std::size_t>(j)].joint.kind == JointKind::rotary;
      const double unit = rotary ? radians_from_degrees(1.0) : scale_;
      joints_[j] = rotary ? radians_from_degrees(*word.value) : *word.value * scale_;
      if (word.polynomial) read_bend(*block.find("PL")->value, unit, word, j, move);
      known_ |= 1U << j;
      ++joints;
    }
    if (joints == 0) return error(block, "a motion without axis words"), false;
    move.to = joints_;
    move.known = known_;
    return !arc || read_arc(block, from, known_from, move);
  }

  // A block that says all of its arc: plane, end, centre from the start (which is how G90 has it,
  // too).
  bool read_arc(const MpfBlock& block, const JointVector& from, JointMask known_from,
                ReadBackMove& move) {
    ArcBlock arc;
    arc.clockwise = block.has('G', 2.0);
    int planes = 0;
    for (const int code : {17, 18, 19})
      if (block.has('G', code)) {
        arc.code = code;
        ++planes;
      }
    if (planes != 1) return error(block, "an arc has to name its plane: G17, G18 or G19"), false;
    if (block.has("SUPA")) return error(block, "an arc with SUPA is not one of ours"), false;
    const std::string centres = arc.code == 17 ? "IJ" : arc.code == 18 ? "KI" : "JK";
    for (const char letter : {'I', 'J', 'K'}) {
      const MpfWord* word = block.find(std::string(1, letter));
      const bool wanted = centres.find(letter) != std::string::npos;
      if (wanted != (word != nullptr) || (word != nullptr && !word->value))
        return error(block, "an arc in G" + std::to_string(arc.code) + " has its centre in " +
                                centres[0] + " and " + centres[1] + " and nothing else"),
               false;
    }
    arc.first = *block.find(centres.substr(0, 1))->value * scale_;
    arc.second = *block.find(centres.substr(1))->value * scale_;
    const std::string problem = set_arc(machine_, arc, from, known_from, move);
    if (!problem.empty()) error(block, problem);
    return problem.empty();
  }

  // The control's p runs from 0 to `length`, ours from 0 to 1.
  static void read_bend(double length, double unit, const MpfWord& word, int j,
                        ReadBackMove& move) {
    double power = length;
    for (std::size_t k = 0; k < word.higher.size(); ++k) {
      power *= length;
      move.bend(j, static_cast<Eigen::Index>(k)) = word.higher[k] * unit * power;
    }
  }

  bool read_pose(const MpfBlock& block, ReadBackMove& move) {
    if (frame_ != Frame::g54 || edge_ != 1 || !in_part_ || !great_circle_)
      return error(block, "a motion under TRAORI without G54, D1, ORIWKS and ORIVECT"), false;
    Vec3 axis = Vec3::Zero();
    bool vector = false;
    for (const auto& word : block.words) {
      if (word.address == "G" || word.address == "F") continue;
      static const std::string kTip = "XYZ";
      const auto tip = word.address.size() == 1 ? kTip.find(word.address[0]) : std::string::npos;
      if (tip != std::string::npos && word.value) {
        tip_[static_cast<Eigen::Index>(tip)] = *word.value * scale_;
        tip_known_ |= 1U << tip;
      } else if (word.address == "A3" || word.address == "B3" || word.address == "C3") {
        axis[word.address[0] - 'A'] = *word.value;
        vector = true;
      } else {
        return error(block, "word " + word.address + " is not one of ours under TRAORI"), false;
      }
    }
    constexpr double kShortest = 0.5;
    if (vector && axis.norm() < kShortest)
      return error(block, "the vector A3= B3= C3= is far from unit length"), false;
    if (vector) axis_ = axis.normalized();
    axis_known_ = axis_known_ || vector;
    if (tip_known_ != 7U || !axis_known_)
      return error(block, "behind TRAORI the first motion has to name X Y Z A3 B3 C3"), false;
    known_ = 0;
    move.interpolation = MoveInterpolation::tool;
    move.tool.translation() = tip_;
    move.tool.linear() =
        Eigen::Quaterniond::FromTwoVectors(machine_.tool.axis, axis_).toRotationMatrix();
    return true;
  }

  const MachineDefinition& machine_;
  const std::string& file_;
  EventReader events_;
  GuardReader guard_;
  std::vector<std::string> start_lines_;
  std::vector<std::string> end_lines_;
  bool ended_ = false;
  Frame guard_frame_ = Frame::unknown;  // live where the guard stands
  int guard_edge_ = -1;
  Frame frame_ = Frame::unknown;
  int edge_ = -1;  // D
  double scale_ = 1.0;
  bool unit_ = false;
  bool absolute_ = false;
  bool exact_ = false;
  bool inverse_time_ = false;
  bool transformation_ = false;
  bool transformation_known_ = false;
  bool in_part_ = false;
  bool great_circle_ = false;
  bool by_parameter_ = false;  // UPATH
  bool beam_ = false;
  Vec3 tip_ = Vec3::Zero();
  Vec3 axis_ = Vec3::UnitZ();
  unsigned tip_known_ = 0;
  bool axis_known_ = false;
  JointVector joints_;
  JointMask known_ = 0;
};

}  // namespace

Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name) {
  return read_with<Reading>(machine, file_name, siemens::parse_mpf(text, file_name));
}

}  // namespace smoothpost::siemens_840d
