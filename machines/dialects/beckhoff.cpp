#include "machines/dialects/beckhoff.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "kernels/core/units.h"
#include "machines/dialects/gcode_program.h"

namespace smoothpost::beckhoff {

namespace {

using gcode::Block;
using gcode::Word;

constexpr std::string_view kAxisLetters = "XYZABCUVWQ";
constexpr int kTimeDigits = 6;

class Emitter : public gcode::GcodePrinter {
 public:
  Emitter(const MachineDefinition& machine, const MachineProgram& program)
      : GcodePrinter(machine, program, {}, {10, 999999990}) {}

 private:
  void check() override {
    if (has_poses())
      refuse("PR203", "dialect beckhoff has joint words only: write dialect.mode = \"joint\"");
    if (machine().dialect.path_mode != "exact")
      refuse("PR203", "dialect beckhoff has no path_mode \"" + machine().dialect.path_mode +
                          "\": how far #HSC leaves the rotary axes has no bound that is known; "
                          "write path_mode = \"exact\"");
    for (const auto& axis : machine().axes)
      if (kAxisLetters.find(axis.letter) == std::string_view::npos)
        refuse("PR203", "axis " + axis.name + " has the letter " + std::string(1, axis.letter) +
                            ": this dialect has the axis words " + std::string(kAxisLetters));
  }

  void head() override {
    line("%SMOOTHPOST");
    if (!program().certified)
      comment("NOT CERTIFIED. Written with --force: read the report before you run it");
    for (const auto& title : program().title) comment(title);
    for (const auto& own : machine().dialect.start) own_line(own);
    modal_words();
    if (!program().certified) block("M0");
  }

  void modal_words() {
    block("#HSC OFF");
    block("#TRAFO OFF");
    block(std::string(is_inch() ? "G70" : "G71") + " G17 G90 G40 G53 D0 G360 G94");
    if (has_arcs()) block("G162");
    timed_ = false;
    words().forget();
  }

  void foot() override {
    leave_plane();
    if (timed_) block("G94");
    bool ended = false;
    for (const auto& own : machine().dialect.end) {
      own_line(own);
      const std::string packed = packed_statement(own);
      ended = ended || packed == "M30" || packed == "M2";
    }
    if (!ended) block("M30");
  }

  void label(const std::string& text) override {
    leave_plane();
    comment(text);
    modal_words();
  }

  void dwell(double seconds) override { block("#TIME " + decimal_text(seconds, 4)); }

  void statement(const std::string& text, const MachineAction& action) override {
    leave_plane();
    block(text);
    if (action.event.name != event_name::kToolChange) return;
    block("D0");  // the control may have chosen the tool's own compensation
  }

  void print_move(std::size_t i) override {
    const MachineMove& m = move(i);
    if (timed_ == m.rapid) block(m.rapid ? "G94" : "G93");
    timed_ = !m.rapid;
    const ArcCode arc = m.arc.turn != 0 ? arc_code(m, move(i - 1).to) : ArcCode{"G1", ""};
    std::string text = (m.rapid ? "G0" : arc.code) + words().joints(m.joints, m.to) + arc.centre;
    if (!m.rapid) {
      const double least = std::pow(10.0, -kTimeDigits);
      text += " F" + decimal_text(std::max(m.duration, least), kTimeDigits);
    }
    block(text);
  }

  bool timed_ = false;
};

class Reading : public gcode::GcodeReading {
 public:
  Reading(const MachineDefinition& machine, const std::string& file)
      : GcodeReading(machine, file) {}

 private:
  void finish() override {
    result.exact_path = exact_;
    result.offset_guard = true;  // no motion was read without G53 and D0
  }

  bool read_statement(const Block& block) override {
    const std::string text = packed_statement(block.text);
    if (text.rfind("%", 0) == 0) return result.moves.empty();
    if (text == "#HSCOFF" || text == "#TRAFOOFF") {
      (text[1] == 'H' ? straight_ : machine_axes_) = true;
      return true;
    }
    if (text.rfind("#TIME", 0) != 0) return false;
    const auto seconds = whole_number(std::string_view(text).substr(5));
    if (!seconds || *seconds < 0.0)
      error(block.at, "#TIME needs its seconds");
    else
      add_event(block.at, "dwell", *seconds);
    return true;
  }

  bool read_setting(const Block& block) override {
    static const std::set<double> kCodes = {17, 40, 53, 70, 71, 90, 93, 94, 162, 360};
    for (const auto& word : block.words) {
      const bool code = word.letter == 'G' && kCodes.count(word.value) > 0;
      if (!code && !(word.letter == 'D' && word.value == 0.0)) return false;
    }
    for (const auto& word : block.words) {
      if (word.letter == 'D') no_tool_ = true;
      if (word.letter != 'G') continue;
      const double g = word.value;
      if (g == 53.0) no_offset_ = true;
      if (g == 70.0 || g == 71.0) scale_ = g == 70.0 ? kMillimetresPerInch : 1.0;
      if (g == 70.0 || g == 71.0) unit_ = true;
      if (g == 90.0) absolute_ = true;
      if (g == 162.0) from_start_ = true;
      if (g == 93.0 || g == 94.0) timed_ = g == 93.0;
      if (g == 360.0) exact_ = result.moves.empty() || exact_;
    }
    return true;
  }

  void read_motion(const Block& block) override {
    if (!straight_ || !machine_axes_ || !unit_ || !absolute_ || !no_offset_ || !no_tool_ || !exact_)
      return error(
          block.at,
          "a motion stands before #HSC OFF, #TRAFO OFF, G71 or G70, G90, G53, D0 and G360");
    const bool arc = is_arc(block);
    for (const auto& word : block.words) {
      if (word.letter != 'G') continue;
      const bool own =
          arc ? word.value == 2.0 || word.value == 3.0 || (word.value >= 17.0 && word.value <= 19.0)
              : word.value == 0.0 || word.value == 1.0;
      if (!own) return error(block.at, "only G0, G1, G2 and G3 move the axes of this program");
    }
    if (arc && !from_start_)
      return error(block.at, "an arc before G162: its centre may be meant absolutely");
    ReadBackMove move = new_move(block.at);
    move.rapid = block.has('G', 0.0);
    const Word* f = block.find('F');
    if (move.rapid == (f != nullptr))
      return error(block.at, "F belongs to G1, G2 and G3, and to each of them");
    if (f != nullptr && (f->value <= 0.0 || !timed_))
      return error(block.at, "G1, G2 and G3 need G93 and F above 0");
    const ArcStart start{joints(), known(), scale_};
    if (!take_axes(block, {arc ? "GFIJKRP" : "GF", scale_, Vec3::Zero()})) return;
    move.to = joints();
    move.known = known();
    if (arc && !take_arc(block, start, move)) return;
    if (f != nullptr) move.duration = f->value;
    result.moves.push_back(std::move(move));
  }

  double scale_ = 1.0;
  bool straight_ = false;
  bool machine_axes_ = false;
  bool unit_ = false;
  bool absolute_ = false;
  bool no_offset_ = false;
  bool no_tool_ = false;
  bool exact_ = false;
  bool timed_ = false;
  bool from_start_ = false;  // G162
};

}  // namespace

Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program) {
  return Emitter(machine, program).run();
}

Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name) {
  return read_with<Reading>(machine, file_name, gcode::parse(text, file_name, {250, true, true}));
}

const Dialect kDialect = {
    "beckhoff",
    "Beckhoff TwinCAT CNC (ISG), joint words, G93 in seconds, G360",
    "all axes linear between blocks, exact stop (G360) at block ends, no spline (#HSC OFF)",
    ToolTurn::none,
    true,
    &emit,
    &read_back,
    "the program cancels zero offsets, tool and transformation (G53, D0, #TRAFO OFF); shifts of "
    "another kind are not live",
    false,
    true};

}  // namespace smoothpost::beckhoff
