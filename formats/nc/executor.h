#pragma once

#include <memory>
#include <string>
#include <vector>

#include "formats/nc/block_plan.h"
#include "formats/nc/block_words.h"
#include "formats/nc/coordinates.h"
#include "formats/nc/interpreter.h"
#include "formats/nc/modal_state.h"
#include "formats/nc/word_values.h"

namespace smoothpost::nc {

/// Runs the blocks of one program in the order of execution of RS274NGC.
///
/// One object runs one program. What a block does in which order stands in executor.cpp, motion in
/// execute_motion.cpp, offsets and tool length in execute_offsets.cpp, process words and comments
/// in execute_process.cpp, what only other controls have in execute_dialects.cpp.
class Executor {
 public:
  Executor(const Program& program, const InterpreterSettings& settings, const EventMatcher& matcher,
           CanonicalSink& sink);
  Result<InterpretationSummary> run();

 private:
  bool skipped(std::size_t index) const;
  void block(const BlockWords& block);
  void act(const BlockWords& block, const BlockPlan& plan);
  void set_modes(const BlockWords& block);
  void set_feed_mode(const BlockWords& block);
  void set_feed(const BlockWords& block);
  void set_units(const BlockWords& block);
  void recover(const BlockWords& block);
  void note_text_after_end(std::size_t index);

  void speed_and_tool(const BlockWords& block, const BlockPlan& plan);
  void process(const BlockWords& block, const BlockPlan& plan, bool after_motion);
  void act_on_row(const BlockWords& block, const ProcessAction& action);
  void emit_event(const EventRow& row, const BlockWords& block, std::uint32_t piece);
  void comment(const BlockWords& block);
  void comment_words(const BlockWords& block, const ProcessAction& action);
  void set_tcp(bool on);
  void message(std::string_view text, std::uint32_t line, std::uint32_t column);
  void dwell(const BlockWords& block);

  void tool_length(const BlockWords& block);
  void set_tool_length(double length, int tool, std::uint32_t line);
  void work_system(const BlockWords& block);
  void non_modal(const BlockWords& block, const BlockPlan& plan);
  void go_home(const BlockWords& block, const BlockPlan& plan, HomePosition& home);
  void store_home(HomePosition& home) const;
  void set_work_offset(const BlockWords& block, const BlockPlan& plan);
  void shift_zero(const BlockWords& block, const BlockPlan& plan);
  void warn_unknown(const BlockWords& block, AxisMask words);
  void announce_offset(std::uint32_t line);

  bool is_linuxcnc() const { return program_.dialect == InputDialect::linuxcnc; }
  bool is_siemens() const { return program_.dialect == InputDialect::siemens; }
  void statements(const BlockWords& block);
  void change_frame(const BlockWords& block);
  Mat3 frame_turn(const BlockWords& block) const;
  void tool_edge(const BlockWords& block);
  void change_tool(const BlockWords& block);
  void set_tcp_by_offset(GCode code);
  void warn_dialect(const BlockWords& block);
  void warn_once(unsigned which, std::string text, const BlockWords& block, std::uint32_t piece);
  void turn_axis(const BlockWords& block, const BlockPlan& plan);
  AxisMask absolute_axes(const BlockWords& block, AxisMask axes) const;

  void motion(const BlockWords& block, const BlockPlan& plan);
  void straight(const BlockWords& block, const BlockPlan& plan);
  void arc(const BlockWords& block, const BlockPlan& plan);
  bool feed_given(const BlockWords& block, const BlockPlan& plan);
  double duration_of(const CanonicalMotion& motion, double xyz_length,
                     const BlockWords& block) const;
  AxisWords target(const BlockWords& block, AxisMask axes) const;
  AxisWords machine_target(const BlockWords& block, AxisMask axes) const;
  AxisMask unknown_at_target(const BlockWords& block, AxisMask axes) const;
  double word_value(const BlockWords& block, std::size_t axis) const;
  void begin_motion(const BlockWords& block, const BlockPlan& plan);
  void finish_motion();

  void error(const char* code, std::string text, const BlockWords& block, std::uint32_t piece);
  TextPlace at(const BlockWords& block, char letter) const;
  TextPlace at(const BlockWords& block, GGroup group) const;

  const Program& program_;
  const InterpreterSettings& settings_;
  const EventMatcher& matcher_;
  CanonicalSink& sink_;
  DiagnosticLog log_;
  ModalState modal_;
  Coordinates coordinates_;
  HomePosition first_home_;
  HomePosition second_home_;
  std::unique_ptr<WordValues> values_;
  BlockReader reader_;
  BlockPlanner planner_;
  InterpretationSummary summary_;
  CanonicalMotion motion_;
  AxisMask unknown_told_ = 0;
  unsigned warned_ = 0;       ///< bits of warn_once
  bool offset_dirty_ = true;  ///< the sink does not know the present work offset
  std::vector<bool> systems_used_;
  bool percent_or_words_seen_ = false;
};

}  // namespace smoothpost::nc
