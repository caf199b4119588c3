#pragma once

#include <array>

#include "formats/nc/block_words.h"
#include "formats/nc/event_words.h"
#include "formats/nc/interpreter.h"
#include "formats/nc/modal_state.h"

namespace smoothpost::nc {

/// What one M word or process letter of a block does.
struct ProcessAction {
  enum class Kind : std::uint8_t { event, comment, tcp_on, tcp_off, program_end, flow };
  Kind kind = Kind::event;
  int rank = 0;  ///< order of execution on the line; 7: after the motion
  int m = -1;
  const EventRow* row = nullptr;
  std::uint32_t piece = BlockWords::kNone;
  LetterMask taken = 0;  ///< kind comment: letters that go with it
};

/// A checked block: which motion it makes and what its process words do.
struct BlockPlan {
  static constexpr int kMaxActions = 12;

  GCode motion = kNoCode;      ///< 0, 10, 20, 30, of a cycle or a spline; kNoCode: none
  AxisMask axes = 0;           ///< axis words of the block
  LetterMask vector = 0;       ///< words of the block that give the tool axis
  LetterMask taken = 0;        ///< letters that were handed to a comment and have no meaning here
  bool whole_comment = false;  ///< G92 or G52 of unmapped words only
  std::array<ProcessAction, kMaxActions> actions;
  int action_count = 0;
};

/// Looks through blocks before they act: which words belong to which code, and all rules of
/// RS274NGC about words on one line.
class BlockPlanner {
 public:
  BlockPlanner(const InterpreterSettings& settings, const EventMatcher& matcher,
               BlockReader& reader, DiagnosticLog& log);

  /// The plan of `block`, and whether it may act; the reasons why not are in the log.
  bool plan(const BlockWords& block, const ModalState& modal);
  const BlockPlan& current() const { return plan_; }

 private:
  void choose_motion(const BlockWords& block, const ModalState& modal);
  void check_axes(const BlockWords& block);
  void check_non_modal(const BlockWords& block, const ModalState& modal);
  void check_g10(const BlockWords& block);
  void check_values(const BlockWords& block);
  void check_arc_words(const BlockWords& block);
  bool takes_axes(const BlockWords& block) const;
  void find_vector(const BlockWords& block, const ModalState& modal);
  void check_vector(const BlockWords& block, const ModalState& modal);
  void check_dwell(const BlockWords& block);
  void check_machine_position(const BlockWords& block, const ModalState& modal);
  bool check_fanuc_g10(const BlockWords& block);
  LetterMask letters_of_g_codes(const BlockWords& block) const;
  LetterMask letters_of_motion(const BlockWords& block) const;
  LetterMask letters_of_flow(const BlockWords& block) const;
  void check_macro_call(const BlockWords& block);
  void check_tool_data(const BlockWords& block);
  LetterMask letters_of_dialect(const BlockWords& block, const ModalState& modal) const;
  void plan_process(const BlockWords& block, LetterMask free);
  void plan_m(const BlockWords& block, int slot, LetterMask& free);
  void plan_letters(const BlockWords& block, LetterMask free);
  void refuse_unmapped(const BlockWords& block, const EventMatch& match, std::uint32_t piece);
  void add_action(const ProcessAction& action);
  void refuse(const char* code, std::string text, TextPlace place);
  TextPlace at(const BlockWords& block, char letter) const;
  TextPlace at(const BlockWords& block, GGroup group) const;

  const InterpreterSettings& settings_;
  const EventMatcher& matcher_;
  BlockReader& reader_;
  DiagnosticLog& log_;
  LetterMask allowed_axes_ = 0;
  LetterMask axes_told_ = 0;
  bool machine_told_ = false;
  const InputDialect dialect_;
  LetterMask letters_told_ = 0;
  std::vector<int> m_told_;
  BlockPlan plan_;
  bool good_ = true;
};

/// The axis words of a set of letters.
AxisMask axis_mask(LetterMask letters);

}  // namespace smoothpost::nc
