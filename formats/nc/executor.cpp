#include "formats/nc/executor.h"

#include <utility>

#include "kernels/core/units.h"

namespace smoothpost::nc {
namespace {

std::unique_ptr<WordValues> make_values(InputDialect dialect, const InterpreterSettings& settings,
                                        ControllerState state) {
  if (dialect == InputDialect::siemens) return std::make_unique<SiemensValues>(state.modal);
  return std::make_unique<Rs274Values>(settings, state);
}

}  // namespace

Executor::Executor(const Program& program, const InterpreterSettings& settings,
                   const EventMatcher& matcher, CanonicalSink& sink)
    : program_(program),
      settings_(settings),
      matcher_(matcher),
      sink_(sink),
      log_(program.file_name),
      coordinates_(settings),
      values_(make_values(program.dialect, settings,
                          {coordinates_, modal_, first_home_, second_home_})),
      reader_(program, settings, *values_, log_),
      planner_(settings, matcher, reader_, log_),
      systems_used_(kWorkSystems + 1, false) {
  modal_.unit = modal_.feed_unit = settings.inch_default ? kMillimetresPerInch : 1.0;
  // The motion mode after reset; RS274NGC has none.
  if (!is_linuxcnc()) modal_.motion = is_siemens() ? 10 : 0;
  first_home_.machine = second_home_.machine = settings.home;
}

Result<InterpretationSummary> Executor::run() {
  for (std::size_t i = 0; i < program_.blocks.size(); ++i) {
    if (skipped(i)) continue;
    const BlockWords& words = reader_.read(i);
    if (words.percent) {
      summary_.ended = percent_or_words_seen_;
    } else {
      block(words);
    }
    percent_or_words_seen_ = percent_or_words_seen_ || words.percent || words.words;
    if (summary_.ended) {
      if (!words.percent) note_text_after_end(i + 1);
      break;
    }
  }
  if (!summary_.ended) {
    log_.warning("NC229",
                 is_linuxcnc()
                     ? "the program ends without M2, M30 or a closing %: it is read to its last "
                       "line, but LinuxCNC refuses such a file"
                     : "the program ends without M2 or M30: it is read to its last line",
                 {static_cast<std::uint32_t>(program_.blocks.size()), 0});
  }
  if (log_.has_error()) return Result<InterpretationSummary>::failure(log_.take());
  return {std::move(summary_), log_.take()};
}

bool Executor::skipped(std::size_t index) const {
  const Block& block = program_.blocks[index];
  if (settings_.execute_deleted) return false;
  for (std::uint32_t i = 0; i < block.piece_count && i < 2; ++i) {
    if (program_.pieces[block.first_piece + i].kind == PieceKind::block_delete) return true;
  }
  return false;
}

void Executor::block(const BlockWords& block) {
  if (!block.words) {
    if (block.comment_piece != BlockWords::kNone) comment(block);
    return;
  }
  if (planner_.plan(block, modal_)) {
    act(block, planner_.current());
  } else {
    recover(block);
  }
}

/// The order of execution on one line that the LinuxCNC manual gives.
void Executor::act(const BlockWords& block, const BlockPlan& plan) {
  if (block.comment_piece != BlockWords::kNone) comment(block);
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
  if (block.code(GGroup::length_offset) != kNoCode) tool_length(block);
  if (block.code(GGroup::work_system) != kNoCode) work_system(block);
  set_modes(block);
  if (block.code(GGroup::non_modal) != kNoCode) non_modal(block, plan);
  motion(block, plan);
  process(block, plan, true);
}

void Executor::set_feed_mode(const BlockWords& block) {
  const GCode mode = block.code(GGroup::feed_mode);
  if (mode == kNoCode) return;
  const bool inverse = mode == 930;
  // After inverse time a new feed is required.
  if (modal_.inverse_time && !inverse) modal_.linear_feed = modal_.angular_feed = 0.0;
  modal_.inverse_time = inverse;
}

/// F is taken in the units that are active before this line's G20 or G21, as LinuxCNC does; the
/// other controls take the new unit.
void Executor::set_feed(const BlockWords& block) {
  if (!block.has('F') || modal_.inverse_time) return;
  if (is_siemens() && block.code(GGroup::non_modal) == 40) return;  // seconds
  modal_.linear_feed = block['F'] * modal_.feed_unit / kSecondsPerMinute;
  modal_.angular_feed = radians_from_degrees(block['F']) / kSecondsPerMinute;
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
  if (plane != kNoCode) modal_.plane = plane;
  const GCode distance = block.code(GGroup::distance);
  if (distance != kNoCode) modal_.incremental = distance == 910;
  const GCode arc_distance = block.code(GGroup::arc_distance);
  if (arc_distance != kNoCode) modal_.arc_absolute = arc_distance == 901;
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
  const GCode mode = block.code(GGroup::motion);
  if (mode != kNoCode) {
    const bool read = g_code_info(mode, program_.dialect).status == GStatus::read;
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
    if (m == 2 || m == 30 || (is_siemens() && m == 17)) summary_.ended = true;
  }
}

void Executor::note_text_after_end(std::size_t index) {
  for (std::size_t i = index; i < program_.blocks.size(); ++i) {
    const Block& block = program_.blocks[i];
    for (std::uint32_t k = 0; k < block.piece_count; ++k) {
      const PieceKind kind = program_.pieces[block.first_piece + k].kind;
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
