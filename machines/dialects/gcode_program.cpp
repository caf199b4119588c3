#include "machines/dialects/gcode_program.h"

#include <algorithm>

#include "kernels/core/units.h"
#include "machines/dialects/arc_text.h"

namespace smoothpost::gcode {

namespace {

constexpr std::size_t kMaxComment = 120;

// Words that end a program or stop it for the operator.
bool is_stop(std::string_view statement) {
  for (const char* word : {"M0", "M1", "M2", "M30", "M00", "M01", "M02", "%"})
    if (statement == word) return true;
  return false;
}

}  // namespace

GcodePrinter::GcodePrinter(const MachineDefinition& machine, const MachineProgram& program,
                           AxisWords::Style style, Numbers numbers)
    : ProgramPrinter(machine, program),
      words_(machine, style),
      numbers_(numbers),
      has_arcs_(std::any_of(program.moves.begin(), program.moves.end(),
                            [](const MachineMove& m) { return m.arc.turn != 0; })) {}

void GcodePrinter::block(std::string_view words) {
  if (machine().dialect.line_numbers && number_ + numbers_.step <= numbers_.last) {
    number_ += numbers_.step;
    text() += "N" + std::to_string(number_) + " ";
  }
  line(words);
}

void GcodePrinter::own_line(const std::string& text) {
  const bool bare = text.empty() || std::string_view("(;%O<").find(text[0]) != std::string::npos;
  bare ? line(text) : block(text);
}

void GcodePrinter::comment(const std::string& text) {
  std::string plain = plain_text(text, kMaxComment);
  std::replace(plain.begin(), plain.end(), '(', '[');
  std::replace(plain.begin(), plain.end(), ')', ']');
  // "(MSG, ...)" and its like act on some controls; a comment of ours never does.
  const auto comma = plain.find(',');
  if (comma != std::string::npos && comma < 12) plain.insert(0, "- ");
  line("(" + plain + ")");
}

void GcodePrinter::statement(const std::string& words, const MachineAction&) { block(words); }

std::string GcodePrinter::inverse_time(double seconds) const {
  const double f = kSecondsPerMinute / seconds;
  return " F" + words_.number(f, decimals_for(f, 8, 3, 7));
}

GcodePrinter::ArcCode GcodePrinter::arc_code(const MachineMove& move, const JointVector& from) {
  const ArcWords arc = arc_words(machine(), move.arc, from);
  plane_ = arc.plane.code;
  const auto centre = [this](char letter, double value) {
    return std::string(" ") + letter + words_.number(value, machine().dialect.digits_length);
  };
  return {"G" + std::to_string(arc.plane.code) + (arc.clockwise ? " G2" : " G3"),
          centre(arc.plane.first_centre, arc.first) + centre(arc.plane.second_centre, arc.second)};
}

void GcodePrinter::leave_plane() {
  if (plane_ != 17) block("G17");
  plane_ = 17;
}

GcodeReading::GcodeReading(const MachineDefinition& machine, const std::string& file)
    : ProgramReading(machine, file, "NC341") {}

void GcodeReading::run(const Parsed& program) {
  for (const auto& block : program.blocks) {
    read(block);
    result.last_line = block.at.line;
  }
  result.line_count = program.line_count;
  finish();
}

void GcodeReading::read(const Block& block) {
  if (result.moves.empty() && take_guard(block)) return;
  if (block.text.empty()) {
    read_event(block.at, block.raw);  // (MSG, text)
    return;
  }
  const auto motion = [](const Word& w) {
    return w.letter == 'G' && w.value >= 0.0 && w.value <= 3.0;
  };
  if (block.is_words && std::any_of(block.words.begin(), block.words.end(), motion)) {
    if (has_ended())
      return error(block.at, "a motion stands behind the last lines of the machine file");
    return read_motion(block);
  }
  if (block.is_words && read_setting(block)) return;
  if (!block.is_words && read_statement(block)) return;
  if (read_event(block.at, block.text) ||
      (block.raw != block.text && read_event(block.at, block.raw))) {
    if (acts_on_motion(block)) error(block.at, "an event's words move an axis or change a mode");
    return;
  }
  if (is_own_line(block.text) || is_own_line(block.raw)) return;
  if (is_stop(packed_statement(block.text))) return;
  error(block.at, "this block is neither one of ours nor in the machine's process table: " +
                      block.text.substr(0, 64));
}

bool GcodeReading::acts_on_motion(const Block& block) const {
  return block.is_words && std::any_of(block.words.begin(), block.words.end(), [this](Word w) {
           return w.letter == 'G' || machine().axis_by_letter(w.letter) >= 0;
         });
}

bool GcodeReading::take_axes(const Block& block, const AxisRule& rule) {
  static constexpr std::string_view kShifted = "XYZ";
  int count = 0;
  for (const auto& word : block.words) {
    if (rule.others.find(word.letter) != std::string_view::npos) continue;
    const int j = machine().axis_by_letter(word.letter);
    if (j < 0)
      return error(block.at,
                   std::string("word ") + word.letter + " is no axis of machine " + machine().name),
             false;
    const auto k = kShifted.find(word.letter);
    const double off = k == std::string_view::npos ? 0.0 : rule.shift[static_cast<Eigen::Index>(k)];
    set_joint(j, is_rotary(j) ? radians_from_degrees(word.value) : word.value * rule.scale + off);
    ++count;
  }
  if (count == 0) return error(block.at, "a motion without axis words"), false;
  return true;
}

bool GcodeReading::take_arc(const Block& block, const ArcStart& start, ReadBackMove& move) {
  ArcBlock arc;
  arc.clockwise = block.has('G', 2.0);
  int planes = 0;
  for (const int code : {17, 18, 19})
    if (block.has('G', code)) {
      arc.code = code;
      ++planes;
    }
  if (planes != 1) return error(block.at, "an arc has to name its plane: G17, G18 or G19"), false;
  const char* centres = arc.code == 17 ? "IJ" : arc.code == 18 ? "KI" : "JK";
  for (const char letter : {'I', 'J', 'K', 'R', 'P'}) {
    const bool wanted = letter == centres[0] || letter == centres[1];
    if ((block.find(letter) != nullptr) == wanted) continue;
    return error(block.at, std::string("an arc in G") + std::to_string(arc.code) +
                               " has its centre in " + centres[0] + " and " + centres[1] +
                               " and nothing else: not " + letter),
           false;
  }
  arc.first = block.find(centres[0])->value * start.scale;
  arc.second = block.find(centres[1])->value * start.scale;
  const std::string problem = set_arc(machine(), arc, start.joints, start.known, move);
  if (!problem.empty()) error(block.at, problem);
  return problem.empty();
}

void GcodeReading::dwell(const Block& block, const Word* seconds, double unit) {
  if (block.words.size() != 2 || seconds == nullptr || seconds->value < 0.0)
    return error(block.at, "G4 needs its time and nothing else");
  add_event(block.at, "dwell", seconds->value * unit);
}

}  // namespace smoothpost::gcode
