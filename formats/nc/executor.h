#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "formats/nc/arc.h"
#include "formats/nc/block_plan.h"
#include "formats/nc/block_words.h"
#include "formats/nc/coordinates.h"
#include "formats/nc/cycles.h"
#include "formats/nc/interpreter.h"
#include "formats/nc/modal_state.h"
#include "formats/nc/program_stream.h"
#include "formats/nc/program_unit.h"
#include "formats/nc/spline_curve.h"
#include "formats/nc/tool_radius.h"
#include "formats/nc/tool_table.h"
#include "formats/nc/word_values.h"

namespace smoothpost::nc {

/// Where a label or block number stands around a block, in one program of the text.
struct LabelPlaces {
  std::optional<std::uint32_t> before;  ///< the last one at or before the block
  std::optional<std::uint32_t> behind;  ///< the first one behind it
  std::size_t count = 0;
};

/// Runs the blocks of one program in the order of execution of RS274NGC. With `stream`, whose
/// program it is, the window goes with the run.
///
/// One object runs one program. What a block does in which order stands in executor.cpp, motion in
/// execute_motion.cpp, cycles in execute_cycles.cpp, threads in execute_threads.cpp, probing in
/// execute_probe.cpp, splines in execute_splines.cpp, offsets in execute_offsets.cpp, tools in
/// execute_tools.cpp, cutter radius in execute_radius.cpp, process words and comments in
/// execute_process.cpp, loops and branches in execute_flow.cpp, calls in execute_calls.cpp, saved
/// modal state in execute_saved_state.cpp, what only other controls have in execute_dialects.cpp
/// and the files execute_siemens*.cpp.
class Executor {
 public:
  Executor(const Program& program, const InterpreterSettings& settings, const EventMatcher& matcher,
           CanonicalSink& sink, ProgramStream* stream = nullptr);
  Result<InterpretationSummary> run();

 private:
  const Block* reach(std::size_t index);
  bool skipped(const Block& block) const;
  bool run_block();
  bool spend(std::uint64_t amount, TextPlace place);
  void stop(const char* code, std::string text, TextPlace place);
  void block(const BlockWords& block);
  void planned(const BlockWords& block);
  void act(const BlockWords& block, const BlockPlan& plan);
  void set_modes(const BlockWords& block);
  void set_feed_mode(const BlockWords& block);
  void set_feed(const BlockWords& block);
  void set_units(const BlockWords& block);
  void recover(const BlockWords& block);
  void note_text_after_end(std::size_t index);

  void speed_and_tool(const BlockWords& block, const BlockPlan& plan);
  void process(const BlockWords& block, const BlockPlan& plan, bool after_motion);
  void note_switches(const BlockWords& block);
  void act_on_row(const BlockWords& block, const ProcessAction& action);
  void emit_event(const EventRow& row, const BlockWords& block, std::uint32_t piece);
  void comment(const BlockWords& block);
  void comment_words(const BlockWords& block, const ProcessAction& action);
  void set_tcp(bool on);
  void message(std::string_view text, std::uint32_t line, std::uint32_t column);
  void dwell(const BlockWords& block);

  void radius_compensation(const BlockWords& block);
  void check_under_compensation(const BlockWords& block, const BlockPlan& plan);
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

  FlowIndex& index_of(ProgramUnit& unit);
  void tell_flow_faults(ProgramUnit& unit);
  void flow(const BlockWords& block);
  void loop(const FlowStatement& statement, std::uint32_t number);
  void branch(const FlowStatement& statement);
  void macro(const FlowStatement& statement);
  void repeat(const FlowStatement& statement, std::uint32_t number);
  std::optional<double> evaluate(const FlowStatement& statement, std::size_t offset);
  bool holds(const FlowStatement& statement);
  TextPlace flow_place(const FlowStatement& statement, std::size_t offset) const;
  std::string_view flow_text(const FlowStatement& statement) const;
  const FlowStatement& partner(std::uint32_t number);
  void jump(std::uint32_t statement, bool behind);
  void jump_behind(std::uint32_t statement);
  void go_to(const FlowStatement& statement);
  void go_to_number(std::uint32_t region, long number, TextPlace place);

  void call(const FlowStatement& statement);
  void give_back(const FlowStatement& statement);
  void flow_word(const BlockWords& block, const ProcessAction& action);
  void call_program(const BlockWords& block, const ProcessAction& action);
  void call_local(const BlockWords& block, long number, CallFrame frame);
  void macro_call(const BlockWords& block);
  void end_program_call(const BlockWords& block, const ProcessAction& action);
  bool enter_program(long number, CallFrame frame, bool& found);
  bool enter(ProgramUnit& unit, CallFrame frame);
  void run_within(std::size_t begin, std::size_t end);
  bool leave_range();
  void leave_call();
  ProgramUnit* unit_of_file(const std::string& name, TextPlace place);
  void end_of_text();

  void save_state(bool restores);
  void restore_state(const SavedState& saved, const BlockWords& block);
  void act_on_m(int m, const BlockWords& block);
  bool active_comment(std::string_view text, const BlockWords& block);

  void change_mode(GCode mode, const BlockWords& block);
  void expanded_motion(const BlockWords& block, const BlockPlan& plan, GCode before);
  void cycle(const BlockWords& block, const BlockPlan& plan, GCode before);
  std::string remember_cycle(const BlockWords& block, GCode code, std::size_t normal);
  long cycle_repeats(const BlockWords& block);
  void drill(const BlockWords& block, const BlockPlan& plan, const CycleHole& hole);
  void cycle_move(const BlockWords& block, const BlockPlan& plan, MotionKind kind,
                  const AxisWords& program);
  std::string why_not_synchronised(const BlockPlan& plan) const;
  void synchronised(const BlockWords& block, const BlockPlan& plan);
  void synchronised_move(const BlockWords& block, const BlockPlan& plan, const AxisWords& end,
                         double pitch);
  std::string thread(const BlockWords& block, const BlockPlan& plan);
  std::string why_not_probing(const BlockPlan& plan, const AxisWords& end) const;
  void probe(const BlockWords& block, const BlockPlan& plan);
  void spline(const BlockWords& block, const BlockPlan& plan, GCode before);
  bool may_stand_in_spline(const BlockWords& block);
  void add_control_point(const BlockWords& block, const BlockPlan& plan);
  void end_spline(const BlockWords& block, bool closed);
  void follow_curves(const BlockWords& block, const BlockPlan& plan,
                     const std::vector<ControlNet>& curves);
  void set_tool_data(const BlockWords& block);

  bool is_turning() const { return modal_.spindle == 3 || modal_.spindle == 4; }
  bool is_linuxcnc() const { return dialect_ == InputDialect::linuxcnc; }
  bool is_siemens() const { return dialect_ == InputDialect::siemens; }
  void statements(const BlockWords& block);
  void change_frame(const BlockWords& block);
  Mat3 frame_turn(const BlockWords& block) const;
  void tool_edge(const BlockWords& block);
  void change_tool(const BlockWords& block);
  void set_tcp_by_offset(GCode code);
  void warn_dialect(const BlockWords& block);
  void warn_once(unsigned which, std::string text, const BlockWords& block, std::uint32_t piece);
  void siemens_flow(const FlowStatement& statement, std::uint32_t number);
  void go_to_label(const std::string& label, int direction, const FlowStatement& from);
  LabelPlaces places_of(const std::string& label, std::uint32_t block, std::uint32_t around);
  void go_by_case(const FlowStatement& statement);
  void count_loop(const FlowStatement& statement, std::uint32_t number);
  std::optional<double> whole_value(const FlowStatement& statement, std::size_t offset);
  void repeat_part(const FlowStatement& statement);
  void call_siemens(const FlowStatement& statement);
  bool enter_section(ProgramUnit& unit, const std::string& name, CallFrame frame, bool& found);
  void begin_siemens_program();
  void end_siemens_program(std::uint32_t line);
  void turn_by_sense(const BlockWords& block, AxisWords& end) const;
  void point_arc(const BlockWords& block, const BlockPlan& plan);
  std::optional<Vec3> tangent_at_end() const;
  void named_motion(const BlockWords& block, const BlockPlan& plan);
  void tangent_arc(const BlockWords& block, const BlockPlan& plan);
  void polynomial(const BlockWords& block, const BlockPlan& plan);
  std::optional<BlockWords> rewritten(const BlockWords& block);
  std::string write_polar(BlockWords& block);
  std::string write_vector(BlockWords& block);
  std::string write_polynomial(BlockWords& block);
  std::string read_offset_data(std::string_view text);
  void swivel(const BlockWords& block);
  void leave_plane();
  void set_pole(const BlockWords& block, const BlockPlan& plan);
  void shift_axes(const BlockWords& block, const BlockPlan& plan);
  Mat3 frame_stretch(const BlockWords& block) const;
  std::string frame_problem(const BlockWords& block) const;
  std::vector<std::uint32_t> statements_of(const BlockWords& block, SiemensWord word) const;
  void take_offset_data(const BlockWords& block);
  void define_drilling(const BlockWords& block, const BlockPlan& plan);
  void drill_pattern(const BlockWords& block, const BlockPlan& plan, std::string_view name,
                     const CycleValues& values);
  void drill_by_call(const BlockWords& block, const BlockPlan& plan, const DrillingCall& call);
  void turn_axis(const BlockWords& block, const BlockPlan& plan);
  AxisMask absolute_axes(const BlockWords& block, AxisMask axes) const;

  void motion(const BlockWords& block, const BlockPlan& plan);
  void straight(const BlockWords& block, const BlockPlan& plan);
  void arc(const BlockWords& block, const BlockPlan& plan);
  std::string arc_form(const BlockWords& block, const BlockPlan& plan) const;
  PlaneArc arc_by_angle(const BlockWords& block, ArcWords& words);
  PlanePoint arc_centre(const BlockWords& block, const ArcWords& words) const;
  void finish_arc(const BlockWords& block, const PlaneArc& found);
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

  const InputDialect dialect_;
  const InterpreterSettings& settings_;
  const EventMatcher& matcher_;
  RadiusCompensation radius_;
  CanonicalSink& sink_;  ///< radius_, behind which the caller's sink is
  DiagnosticLog log_;
  ModalState modal_;
  Coordinates coordinates_;
  HomePosition first_home_;
  HomePosition second_home_;
  ToolTable tools_;
  ProgramPlace place_;
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

  std::vector<std::unique_ptr<ProgramUnit>> units_;      ///< the first is the program
  std::unordered_map<std::string, ProgramUnit*> files_;  ///< by subroutine; nullptr: none
  ProgramStream* stream_;                                ///< of the program; nullptr: it is whole
  ProgramUnit* unit_ = nullptr;                          ///< whose blocks are run
  std::uint32_t input_line_ = 0;                         ///< as BlockReader::select takes it
  std::vector<CallFrame> frames_;                        ///< the first is the program
  ControlNet control_points_;                            ///< of G5.2 so far, world coordinates
  std::size_t spline_order_ = 3;
  std::array<std::vector<double>, 3> polynomials_;  ///< a2, a3 .. of PO[X], PO[Y], PO[Z]; mm
  std::map<int, WorkOffset> pending_offsets_;       ///< $P_UIFR, until the next G54 .. G57
  AxisWords added_shift_{};           ///< the part of the frame's shift by ATRANS, G59
  bool axial_shift_ = false;          ///< G59 is in it
  std::optional<Vec3> last_tangent_;  ///< of a G5: from its last inner control point to its end
  bool called_ = false;               ///< some subroutine was called
  std::uint64_t budget_ = 0;
  bool stopped_ = false;  ///< what would come next is not known
  /// The blocks that are run: the text, or of siemens a program of it or a repeated part.
  std::size_t range_begin_ = 0, range_end_ = 0;
};

}  // namespace smoothpost::nc
