#include "formats/nc/executor.h"

#include <algorithm>
#include <utility>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"

namespace smoothpost::nc {
namespace {

std::unique_ptr<WordValues> make_values(InputDialect dialect, const InterpreterSettings& settings,
                                        ControllerState state) {
  if (dialect == InputDialect::siemens) return std::make_unique<SiemensValues>(state.modal);
  return std::make_unique<Rs274Values>(settings, dialect, state);
}

ToolTable tool_table(const InterpreterSettings& settings) {
  ToolTable tools;
  for (const auto& [tool, length] : settings.tool_lengths) tools[tool].length = length;
  for (const auto& [tool, diameter] : settings.tool_diameters) tools[tool].radius = 0.5 * diameter;
  return tools;
}

/// What reading a block costs of the budget: 1, and 1 more for every 256 bytes.
std::uint64_t cost_of(const Program& program, const Block& block) {
  if (block.piece_count == 0) return 1;
  const Piece& first = program.pieces[block.first_piece];
  const Piece& last = program.pieces[block.first_piece + block.piece_count - 1];
  return 1 + (last.begin + last.length - first.begin) / 256;
}

}  // namespace

Executor::Executor(const Program& program, const InterpreterSettings& settings,
                   const EventMatcher& matcher, CanonicalSink& sink, ProgramStream* stream)
    : dialect_(program.dialect),
      settings_(settings),
      matcher_(matcher),
      radius_(sink,
              [this](const std::string& text, const CanonicalMotion& motion) {
                log_.program_error("NC264", "cutter radius compensation: " + text,
                                   {motion.line, motion.column});
              }),
      sink_(radius_),
      log_(program.file_name),
      coordinates_(settings),
      tools_(tool_table(settings)),
      values_(make_values(program.dialect, settings,
                          {coordinates_, modal_, first_home_, second_home_, tools_, place_})),
      reader_(program, settings, *values_, log_),
      planner_(settings, matcher, reader_, log_),
      systems_used_(kWorkSystems + 1, false),
      stream_(stream) {
  modal_.unit = modal_.feed_unit = settings.inch_default ? kMillimetresPerInch : 1.0;
  // The motion mode after reset; RS274NGC has none.
  if (!is_linuxcnc()) modal_.motion = is_siemens() ? 10 : 0;
  modal_.retract_to_old = !is_linuxcnc();
  first_home_.machine = second_home_.machine = settings.home;
  units_.push_back(std::make_unique<ProgramUnit>());
  unit_ = units_.back().get();
  unit_->program = &program;
  run_within(0, program.block_count);
  frames_.emplace_back();
  // What the program costs when every block runs once.
  constexpr std::uint64_t kMost = std::uint64_t{1} << 60;
  budget_ = std::min(settings.run_budget, kMost) + program.block_count + program.text.size() / 256;
}

Result<InterpretationSummary> Executor::run() {
  const Program& program = *unit_->program;
  if (program.has_flow) tell_flow_faults(*unit_);
  if (program.has_flow && is_siemens()) begin_siemens_program();
  while (run_block()) {
  }
  // The faults of the text behind the run count too.
  while (stream_ != nullptr && stream_->next()) {
  }
  radius_.end();
  if (program.first_fault != 0 && !log_.has_error()) {
    log_.error("NC200", "this line has text that could not be read; mend what the reader named",
               {program.first_fault, 1});
  }
  if (!control_points_.empty() && !stopped_) {
    stop("NC262", "the spline (G5.2) has no end: G5.3 is missing",
         {static_cast<std::uint32_t>(program.block_count), 1});
  }
  if (!summary_.ended && !stopped_) {
    log_.warning("NC229",
                 is_linuxcnc()
                     ? "the program ends without M2, M30 or a closing %: it is read to its last "
                       "line, but LinuxCNC refuses such a file"
                     : "the program ends without M2 or M30: it is read to its last line",
                 {static_cast<std::uint32_t>(program.block_count), 0});
  }
  if (log_.has_error()) return Result<InterpretationSummary>::failure(log_.take());
  for (const auto& unit : units_)
    if (unit->owned)
      summary_.files.push_back({unit->owned->file_name, unit->path, std::move(unit->owned->text)});
  return {std::move(summary_), log_.take()};
}

/// A block of the text that is run; nullptr: the run is void, as the program turned out to jump.
/// Blocks before the window can be had again of programs that jump, and only those ask for them.
const Block* Executor::reach(std::size_t index) {
  const Program& program = *unit_->program;
  while (!program.holds(index)) {
    require(stream_ != nullptr, "a program without windows is whole");
    if (stream_->jumps()) {
      stream_->go_to(index);
      continue;
    }
    require(index >= program.first_block, "the run goes forward through the windows");
    if (!stream_->next()) return nullptr;
  }
  return &program.block(index);
}

/// Runs the next block; false: there is none.
bool Executor::run_block() {
  if (place_.next >= range_end_ || place_.next < range_begin_) return leave_range();
  const std::size_t index = place_.next++;
  const Block* next = reach(index);
  if (next == nullptr) return false;
  if (skipped(*next)) return true;
  const std::uint64_t cost = cost_of(*unit_->program, *next);
  if (cost > budget_) {
    spend(cost, {static_cast<std::uint32_t>(index) + 1, 1});
    return false;
  }
  budget_ -= cost;
  const BlockWords& words = reader_.read(index);
  if (words.flow_piece != BlockWords::kNone) {
    flow(words);
  } else if (words.percent) {
    if (frames_.size() > 1) {
      end_of_text();
    } else {
      summary_.ended = percent_or_words_seen_;
    }
  } else {
    block(words);
  }
  percent_or_words_seen_ = percent_or_words_seen_ || words.percent || words.words;
  if (!summary_.ended) return !stopped_;
  if (!words.percent && frames_.size() == 1) note_text_after_end(index + 1);
  return false;
}

/// Takes `amount` of the budget; false: it is used up, which is told and ends the run.
bool Executor::spend(std::uint64_t amount, TextPlace place) {
  if (amount <= budget_) {
    budget_ -= amount;
    return true;
  }
  stop("NC252",
       "the program goes on here after " + std::to_string(settings_.run_budget) +
           " repeated blocks and motions of cycles (the budget of loops and calls): an endless "
           "loop, or one that is too long; let the CAM post write the moves out",
       place);
  return false;
}

void Executor::stop(const char* code, std::string text, TextPlace place) {
  log_.error(code, std::move(text), place);
  stopped_ = true;
}

bool Executor::skipped(const Block& block) const {
  if (settings_.execute_deleted) return false;
  const Program& program = *unit_->program;
  for (std::uint32_t i = 0; i < block.piece_count && i < 2; ++i) {
    if (program.pieces[block.first_piece + i].kind == PieceKind::block_delete) return true;
  }
  return false;
}

void Executor::block(const BlockWords& block) {
  if (!block.words) {
    if (block.comment_piece != BlockWords::kNone) comment(block);
    return;
  }
  constexpr LetterMask kRewritten = letter_bit(kPolarAngle) | letter_bit(kPolarRadius) |
                                    letter_bit(kAxisAngleA) | letter_bit(kAxisAngleB) |
                                    letter_bit(kAxisAngleC);
  if (is_siemens() && ((block.letters & kRewritten) != 0 || block.statements != 0 ||
                       modal_.motion == kPolynomial)) {
    if (const auto own = rewritten(block)) return planned(*own);
  }
  planned(block);
}

void Executor::planned(const BlockWords& block) {
  if (planner_.plan(block, modal_)) {
    if (block.code(GGroup::non_modal) == kMacroCall) return macro_call(block);
    if (!control_points_.empty() && !may_stand_in_spline(block)) return;
    act(block, planner_.current());
  } else {
    recover(block);
  }
}

/// The order of execution on one line that the LinuxCNC manual gives.
void Executor::act(const BlockWords& block, const BlockPlan& plan) {
  if (block.comment_piece != BlockWords::kNone) comment(block);
  if (radius_.is_on()) check_under_compensation(block, plan);
  if (radius_.stands_beside() && block.has_m(6)) {
    AxisWords place = coordinates_.world();
    radius_.forget_contour(place);
    coordinates_.move_to(place, coordinates_.unknown());
  }
  if (!is_linuxcnc()) {
    set_units(block);
    warn_dialect(block);
  }
  set_feed_mode(block);
  set_feed(block);
  speed_and_tool(block, plan);
  process(block, plan, false);
  dwell(block);
  if (is_linuxcnc()) set_units(block);
  if (is_siemens()) {
    if (block.has('D')) tool_edge(block);
    if (block.statements != 0) statements(block);
  }
  if (block.code(GGroup::radius_compensation) != kNoCode) radius_compensation(block);
  if (block.code(GGroup::length_offset) != kNoCode) tool_length(block);
  if (block.code(GGroup::work_system) != kNoCode) work_system(block);
  set_modes(block);
  if (block.code(GGroup::non_modal) != kNoCode) non_modal(block, plan);
  motion(block, plan);
  if (is_siemens()) {
    if (modal_.drilling && plan.axes != 0 && plan.motion != kNoCode)
      drill_by_call(block, plan, *modal_.drilling);
    if (block.says(SiemensWord::modal_call) || block.says(SiemensWord::single_call))
      define_drilling(block, plan);
  }
  const std::size_t depth = frames_.size();
  process(block, plan, true);
  const bool ended = summary_.ended || frames_.size() != depth;
  if (block.says(SiemensWord::program_end) && !ended) end_siemens_program(block.input_line);
}

void Executor::set_feed_mode(const BlockWords& block) {
  const GCode mode = block.code(GGroup::feed_mode);
  if (mode == kNoCode) return;
  const bool inverse = mode == 930;
  const bool per_turn = mode == 950;
  // After inverse time, and by and after feed by the turn, a new feed is required.
  if ((modal_.inverse_time && !inverse) || modal_.per_turn || per_turn)
    modal_.linear_feed = modal_.angular_feed = 0.0;
  modal_.inverse_time = inverse;
  modal_.per_turn = per_turn;
}

/// F is taken in the units that are active before this line's G20 or G21, as LinuxCNC does; the
/// other controls take the new unit.
void Executor::set_feed(const BlockWords& block) {
  if (!block.has('F') || modal_.inverse_time) return;
  if (is_siemens() && block.code(GGroup::non_modal) == 40) return;  // seconds
  const double seconds = modal_.per_turn ? 1.0 : kSecondsPerMinute;
  modal_.linear_feed = block['F'] * modal_.feed_unit / seconds;
  modal_.angular_feed = radians_from_degrees(block['F']) / seconds;
}

void Executor::set_units(const BlockWords& block) {
  const GCode code = block.code(GGroup::units);
  if (code == kNoCode) return;
  const bool inch = code == 200 || code == 700 || code == 7000;
  const double unit = inch ? kMillimetresPerInch : 1.0;
  if (is_linuxcnc() && unit != modal_.unit && block.has('F') && !modal_.inverse_time) {
    log_.warning("NC227",
                 "F stands in the block that changes the unit: the controller takes it in the old "
                 "unit; write " +
                     g_code_text(code) + " on a line before",
                 at(block, 'F'));
  }
  modal_.unit = unit;
  // G70 and G71 of siemens leave the feed in the control's unit.
  if (code != 700 && code != 710) modal_.feed_unit = unit;
}

void Executor::set_modes(const BlockWords& block) {
  const GCode plane = block.code(GGroup::plane);
  if (plane != kNoCode && plane != modal_.plane) {
    modal_.plane = plane;
    modal_.polar.lost = modal_.polar.set;
  }
  const GCode distance = block.code(GGroup::distance);
  if (distance != kNoCode) modal_.incremental = distance == 910;
  const GCode arc_distance = block.code(GGroup::arc_distance);
  if (arc_distance != kNoCode) modal_.arc_absolute = arc_distance == 901;
  const GCode retract = block.code(GGroup::retract);
  if (retract != kNoCode) modal_.retract_to_old = retract == 980;
  const GCode lathe = block.code(GGroup::lathe_diameter);
  if (lathe != kNoCode) modal_.diameter = lathe == 70;
}

/// After a refused block: takes over what can be told from it, so that later messages are about
/// later blocks. The result has no value any more, whatever this does.
void Executor::recover(const BlockWords& block) {
  set_feed_mode(block);
  set_feed(block);
  const GCode unit = block.code(GGroup::units);
  if (unit != kNoCode) {
    const bool inch = unit == 200 || unit == 700 || unit == 7000;
    modal_.unit = inch ? kMillimetresPerInch : 1.0;
    if (unit != 700 && unit != 710) modal_.feed_unit = modal_.unit;
  }
  const GCode plane = block.code(GGroup::plane);
  if (plane == 170 || plane == 180 || plane == 190) modal_.plane = plane;
  const GCode distance = block.code(GGroup::distance);
  if (distance != kNoCode) modal_.incremental = distance == 910;
  const GCode arc_distance = block.code(GGroup::arc_distance);
  if (arc_distance != kNoCode) modal_.arc_absolute = arc_distance == 901;
  const GCode lathe = block.code(GGroup::lathe_diameter);
  if (lathe != kNoCode) modal_.diameter = lathe == 70;
  const GCode mode = block.code(GGroup::motion);
  if (mode != kNoCode) {
    const bool read = g_code_info(mode, dialect_).status == GStatus::read;
    modal_.motion = read ? mode : kRefusedMotion;
  } else if (modal_.motion == kNoCode) {
    modal_.motion = kRefusedMotion;
  }
  const AxisMask axes = axis_mask(block.letters);
  if (axes != 0 && block.code(GGroup::non_modal) == kNoCode) {
    coordinates_.move_to(target(block, axes), unknown_at_target(block, axes));
  }
  // So that what follows a refused start of a mode is judged in that mode.
  if (is_siemens() && block.says(SiemensWord::traori)) set_tcp(true);
  const GCode offset = block.code(GGroup::length_offset);
  if (!is_linuxcnc() && offset != kNoCode) set_tcp_by_offset(offset);
  for (int i = 0; i < block.m_count; ++i) {
    const int m = block.m[static_cast<std::size_t>(i)];
    if (is_siemens() && (m == 2 || m == 17 || m == 30)) {
      return end_siemens_program(block.input_line);
    }
    if (m == 2 || m == 30) summary_.ended = true;
  }
}

/// Text behind the end that is no subroutine: one begins with an O word.
void Executor::note_text_after_end(std::size_t index) {
  const Program& program = *unit_->program;
  for (std::size_t i = index; i < program.block_count; ++i) {
    const Block* block = reach(i);
    if (block == nullptr) return;
    for (std::uint32_t k = 0; k < block->piece_count; ++k) {
      const Piece& piece = program.pieces[block->first_piece + k];
      const PieceKind kind = piece.kind;
      const bool label = kind == PieceKind::word && piece.letter == 'O' && called_;
      const bool section = is_siemens() && kind == PieceKind::statement && called_ &&
                           piece.detail >= static_cast<std::uint8_t>(SiemensWord::program_name);
      if (kind == PieceKind::flow || label || section) return;
      if (kind == PieceKind::percent) return;
      if (kind != PieceKind::word && kind != PieceKind::construct) continue;
      log_.note("NC230", "the program has ended; the lines from here on are not read",
                {static_cast<std::uint32_t>(i) + 1, 1});
      return;
    }
  }
}

void Executor::error(const char* code, std::string text, const BlockWords& block,
                     std::uint32_t piece) {
  log_.error(code, std::move(text), reader_.place(block, piece));
}

TextPlace Executor::at(const BlockWords& block, char letter) const {
  return reader_.place(block, block.has(letter)
                                  ? block.piece[static_cast<std::size_t>(letter_index(letter))]
                                  : block.first_piece);
}

TextPlace Executor::at(const BlockWords& block, GGroup group) const {
  return reader_.place(block, block.code(group) != kNoCode
                                  ? block.g_piece[static_cast<std::size_t>(group)]
                                  : block.first_piece);
}

}  // namespace smoothpost::nc
