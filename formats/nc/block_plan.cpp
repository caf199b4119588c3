#include "formats/nc/block_plan.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>

#include "formats/nc/number_text.h"

namespace smoothpost::nc {
namespace {

constexpr LetterMask kRotaryLetters = letter_bit('A') | letter_bit('B') | letter_bit('C');
constexpr LetterMask kCentreLetters = letter_bit('I') | letter_bit('J') | letter_bit('K');

bool is_arc(GCode motion) { return motion == 20 || motion == 30; }
bool is_whole(double value) { return std::abs(value - std::round(value)) <= 1e-4; }

/// G10 L1, L10, L11.
bool sets_tool_data(const BlockWords& block) {
  if (block.code(GGroup::non_modal) != 100 || !block.has('L')) return false;
  return block['L'] == 1.0 || block['L'] == 10.0 || block['L'] == 11.0;
}

}  // namespace

AxisMask axis_mask(LetterMask letters) {
  // X Y Z are bits 0..2 of an AxisMask, A B C 3..5, U V W 6..8; in the alphabet they stand in three
  // runs.
  const LetterMask xyz = (letters >> letter_index('X')) & 7u;
  const LetterMask abc = letters & 7u;
  const LetterMask uvw = (letters >> letter_index('U')) & 7u;
  return static_cast<AxisMask>(xyz | (abc << 3) | (uvw << 6));
}

BlockPlanner::BlockPlanner(const InterpreterSettings& settings, const EventMatcher& matcher,
                           BlockReader& reader, DiagnosticLog& log)
    : settings_(settings),
      matcher_(matcher),
      reader_(reader),
      log_(log),
      dialect_(reader.dialect()) {
  for (std::size_t i = 0; i < kAxisLetters.size(); ++i) {
    const bool rotary = i >= 3 && i < 6;
    const bool has = (settings.axes >> i) & 1;
    if (has && !(rotary && settings.any_axis_needs_machine)) {
      allowed_axes_ |= letter_bit(kAxisLetters[i]);
    }
  }
}

void BlockPlanner::refuse(const char* code, std::string text, TextPlace place) {
  good_ = false;
  log_.error(code, std::move(text), place);
}

TextPlace BlockPlanner::at(const BlockWords& block, char letter) const {
  return reader_.place(block, block.has(letter)
                                  ? block.piece[static_cast<std::size_t>(letter_index(letter))]
                                  : BlockWords::kNone);
}

TextPlace BlockPlanner::at(const BlockWords& block, GGroup group) const {
  return reader_.place(block, block.code(group) != kNoCode
                                  ? block.g_piece[static_cast<std::size_t>(group)]
                                  : BlockWords::kNone);
}

bool BlockPlanner::plan(const BlockWords& block, const ModalState& modal) {
  good_ = !block.bad;
  plan_.motion = kNoCode;
  plan_.taken = plan_.vector = 0;
  plan_.whole_comment = false;
  plan_.action_count = 0;
  plan_.axes = axis_mask(block.letters);
  if ((block.letters & kAxisLetterMask & ~allowed_axes_) != 0 &&
      block.code(GGroup::non_modal) != kMacroCall) {
    check_axes(block);
  }
  // What is wrong with its words was told already; what they would mean is a guess.
  if (block.bad) return false;
  if (dialect_ != InputDialect::linuxcnc) find_vector(block, modal);
  choose_motion(block, modal);
  constexpr LetterMask kPlain = kAxisLetterMask | letter_bit('F');
  const bool plain = block.m_count == 0 && (block.letters & ~kPlain) == 0 && block.statements == 0;
  if (plain && block.code(GGroup::non_modal) == kNoCode) {
    if (block.has('F')) check_values(block);
    return good_;
  }
  check_values(block);
  if (plan_.vector != 0) {
    check_vector(block, modal);
  } else {
    check_arc_words(block);
  }
  LetterMask process =
      block.letters & ~kPlain & ~kCentreLetters & ~letter_bit('S') & ~letter_bit('T');
  process &= ~letters_of_g_codes(block);
  process &= ~letters_of_flow(block);
  if (dialect_ != InputDialect::linuxcnc) process &= ~letters_of_dialect(block, modal);
  if (block.has('R') && block.has_m(19) && block.code(GGroup::path_control) == 640) {
    refuse("NC215", "R beside G64 and M19 may belong to either; write them on two lines",
           at(block, 'R'));
  }
  plan_process(block, process);
  if (good_) check_non_modal(block, modal);
  return good_;
}

void BlockPlanner::check_axes(const BlockWords& block) {
  const LetterMask wrong = block.letters & kAxisLetterMask & ~allowed_axes_;
  for (std::size_t i = 0; i < kAxisLetters.size(); ++i) {
    const char letter = kAxisLetters[i];
    if ((wrong & letter_bit(letter)) == 0) continue;
    good_ = false;
    const bool rotary = (letter_bit(letter) & kRotaryLetters) != 0;
    if (rotary && settings_.any_axis_needs_machine) {
      if (machine_told_) continue;
      machine_told_ = true;
      refuse(
          "US110",
          joined({"the rotary word ", std::string_view(&letter, 1),
                  " is a position of the input machine's axis: needs --input-machine MACHINE, the "
                  "machine that the program was posted for (first of such words)"}),
          at(block, letter));
    } else if ((axes_told_ & letter_bit(letter)) == 0) {
      axes_told_ |= letter_bit(letter);
      refuse(
          "NC212",
          joined({"axis word ", std::string_view(&letter, 1),
                  ", but the input machine has no axis of that letter; name the machine that the "
                  "program was posted for by --input-machine (first of such words)"}),
          at(block, letter));
    }
  }
}

void BlockPlanner::choose_motion(const BlockWords& block, const ModalState& modal) {
  const GCode mode0 = block.code(GGroup::non_modal);
  const GCode mode1 = block.code(GGroup::motion);
  const bool covets = takes_axes(block);
  const bool by_value = block.code(GGroup::length_offset) == 431;
  const bool fanuc = dialect_ == InputDialect::fanuc || dialect_ == InputDialect::haas;
  if (mode1 != kNoCode) {
    if (mode1 == 800 && fanuc) {
      // G80 ends a cycle there and leaves G0 or G1 as it was.
      if (plan_.axes != 0 && !covets) plan_.motion = mode0 == 530 ? 0 : modal.base_motion;
    } else if (mode1 == 800 || mode1 == kSplineEnd) {
      if (plan_.axes != 0 && !covets) {
        refuse("NC210",
               g_code_text(mode1) +
                   " ends motion, but axis words stand beside it; write G0 or G1 instead",
               at(block, GGroup::motion));
      }
    } else if (covets) {
      refuse("NC211",
             (mode0 == kNoCode ? std::string("the frame") : g_code_text(mode0)) + " and " +
                 g_code_text(mode1) +
                 " both use the axis words of the block; write them on two lines",
             at(block, GGroup::motion));
    } else {
      plan_.motion = mode1;
    }
  } else if (!covets && plan_.axes != 0 && !by_value) {
    if (mode0 == 530 && dialect_ != InputDialect::siemens && dialect_ != InputDialect::linuxcnc) {
      plan_.motion = 0;  // always a rapid there
    } else if (modal.motion == kNoCode || modal.motion == 800) {
      refuse("NC209", "axis words without a motion mode: no G0, G1, G2 or G3 is active here",
             reader_.place(block, block.first_piece));
    } else {
      plan_.motion = modal.motion;
    }
  } else if (plan_.axes == 0 && !covets && (block.letters & kCentreLetters) != 0 &&
             is_arc(modal.motion)) {
    plan_.motion = modal.motion;
  } else if (!covets && plan_.vector != 0) {
    plan_.motion = modal.motion;
  }
}

LetterMask BlockPlanner::letters_of_g_codes(const BlockWords& block) const {
  LetterMask used = 0;
  const GCode mode0 = block.code(GGroup::non_modal);
  if (is_arc(plan_.motion)) used |= letter_bit('P') | letter_bit('R');
  if (plan_.motion > 30 && !is_named_motion(plan_.motion)) used |= letters_of_motion(block);
  if (mode0 == 40) used |= letter_bit('P');
  if (mode0 == 100) used |= letter_bit('L') | letter_bit('P') | letter_bit('R');
  if (sets_tool_data(block)) used |= letter_bit('Q');
  if (block.code(GGroup::path_control) == 640) used |= letter_bit('P') | letter_bit('Q');
  if (block.code(GGroup::length_offset) == 430) used |= letter_bit('H');
  const GCode compensation = block.code(GGroup::radius_compensation);
  if (compensation != kNoCode && compensation != 400) used |= letter_bit('D');
  if (compensation == 411 || compensation == 421) used |= letter_bit('L');
  return used & block.letters;
}

/// Words of cycles and splines. K of a cycle is the count of repeats in the Fanuc family.
LetterMask BlockPlanner::letters_of_motion(const BlockWords& block) const {
  if (plan_.motion == 52) return letter_bit('P') | letter_bit('L');
  if (is_spline(plan_.motion)) return letter_bit('P') | letter_bit('Q');
  const GCode cycle = plan_.motion;
  if (cycle == 330 || cycle == 331 || is_probe(cycle)) return 0;
  LetterMask used = letter_bit('R') | letter_bit('L');
  if (cycle == 760) {
    used |= letter_bit('P') | letter_bit('Q') | letter_bit('H') | letter_bit('E');
    return used & block.letters;
  }
  const bool fanuc = dialect_ != InputDialect::linuxcnc;
  if (cycle == 730 || cycle == 830) used |= letter_bit('Q');
  if (cycle == 740 || cycle == 820 || cycle == 840 || cycle == 860 || cycle == 890 || fanuc) {
    used |= letter_bit('P');
  }
  return used & block.letters;
}

/// Words of M98 and its kin, and of G65, whose other letters are all arguments.
LetterMask BlockPlanner::letters_of_flow(const BlockWords& block) const {
  if (block.code(GGroup::non_modal) == kMacroCall) return block.letters;
  LetterMask used = 0;
  for (const int m : {97, 98, 99}) {
    if (block.has_m(m) && is_flow_m(m, dialect_)) used |= letter_bit('P') | letter_bit('L');
  }
  return used & block.letters;
}

void BlockPlanner::check_values(const BlockWords& block) {
  const auto at_least_zero = [&](char letter) {
    if (block.has(letter) && block[letter] < 0.0) {
      refuse("NC223",
             joined({std::string_view(&letter, 1), shortest_text(block[letter]),
                     " is negative; write a value from 0"}),
             at(block, letter));
    }
  };
  at_least_zero('F');
  at_least_zero('S');
  at_least_zero('T');
  if (dialect_ != InputDialect::siemens) at_least_zero('H');
  for (const char letter : {'T', 'H'}) {
    if (letter == 'H' && dialect_ == InputDialect::siemens) continue;
    if (block.has(letter) && (!is_whole(block[letter]) || block[letter] > 1e9)) {
      refuse("NC223",
             joined({std::string_view(&letter, 1), shortest_text(block[letter]),
                     " is no whole number; write the tool's number"}),
             at(block, letter));
    }
  }
}

void BlockPlanner::check_arc_words(const BlockWords& block) {
  if (!is_arc(plan_.motion)) {
    LetterMask used = 0;
    if (plan_.motion == 50 || plan_.motion == 51) used = letter_bit('I') | letter_bit('J');
    if (plan_.motion == 870 || plan_.motion == 760) used = kCentreLetters;
    if (plan_.motion == 330 || plan_.motion == 331) used = letter_bit('K');
    if (is_cycle(plan_.motion) && dialect_ == InputDialect::fanuc) used = letter_bit('K');
    if (sets_tool_data(block)) used = letter_bit('I') | letter_bit('J');
    if (block.code(GGroup::non_modal) == kMacroCall) used = kCentreLetters;
    for (const char letter : {'I', 'J', 'K'}) {
      if (block.has(letter) && (used & letter_bit(letter)) == 0) {
        refuse("NC215",
               joined({"no code of this block uses the word ", std::string_view(&letter, 1),
                       "; remove it or write G2 or G3"}),
               at(block, letter));
      }
    }
    return;
  }
  if (block.has('P') && (!is_whole(block['P']) || block['P'] < 0.5 || block['P'] > 1e6)) {
    refuse("NC222",
           "P" + shortest_text(block['P']) +
               ": the turns of an arc are a whole number from 1 to 1000000",
           at(block, 'P'));
  }
  if (block.has(kCircleTurns) &&
      (!is_whole(block[kCircleTurns]) || block[kCircleTurns] < -0.5 || block[kCircleTurns] > 1e6)) {
    refuse("NC222", "TURN: the further turns of an arc are a whole number from 0 to 1000000",
           at(block, kCircleTurns));
  }
}

void BlockPlanner::check_non_modal(const BlockWords& block, const ModalState& modal) {
  const GCode code = block.code(GGroup::non_modal);
  const TextPlace place = at(block, GGroup::non_modal);
  if (code == kMacroCall && dialect_ != InputDialect::linuxcnc) {
    check_macro_call(block);
  } else if (code == 40) {
    check_dwell(block);
  } else if (code == 100) {
    if (dialect_ == InputDialect::linuxcnc || check_fanuc_g10(block)) check_g10(block);
  } else if (code == 530 || code == 1530 || block.says(SiemensWord::supa)) {
    check_machine_position(block, modal);
  } else if ((code == 520 || code == 920) && plan_.axes == 0 && !plan_.whole_comment) {
    refuse("NC219", g_code_text(code) + " needs axis words (process words have no zero to shift)",
           place);
  }
}

void BlockPlanner::check_g10(const BlockWords& block) {
  const TextPlace place = at(block, GGroup::non_modal);
  const double kind = block.has('L') ? block['L'] : -1.0;
  if (sets_tool_data(block)) return check_tool_data(block);
  if (kind != 2.0 && kind != 20.0) {
    refuse("NC218", "G10 is read with L1, L10, L11 (tool data), L2 and L20 (work offsets) only",
           place);
    return;
  }
  const double system = block.has('P') ? block['P'] : -1.0;
  if (!is_whole(system) || system < -1e-4 || system > 9.0001) {
    refuse("NC218", "G10 L2 and L20 need P with a work system: 1 to 9, or 0 for the active one",
           place);
  }
  if (kind == 20.0 && block.has('R')) {
    refuse("NC218", "G10 L20 cannot set a rotation; write R with G10 L2", place);
  }
}

/// G10 L1, L10, L11: tools are known by their length along the tool axis.
void BlockPlanner::check_tool_data(const BlockWords& block) {
  const TextPlace place = at(block, GGroup::non_modal);
  if (settings_.plain_blocks) {
    refuse("NC218", "G10 sets tool data, which a machine program does not", place);
    return;
  }
  const double tool = block.has('P') ? block['P'] : 0.0;
  if (!is_whole(tool) || tool < 0.5 || tool > 1e9) {
    refuse("NC218", "G10 L1, L10 and L11 need P with the number of a tool, from 1", place);
  }
  constexpr AxisMask kZ = 4;
  if ((plan_.axes & ~kZ) != 0) {
    refuse(
        "NC218",
        "G10 L1, L10 and L11 are read with Z, R, I, J and Q: a tool is known by its length along "
        "the tool axis; let the CAM post write without the other words",
        place);
  }
  if (block.has('Q') && (!is_whole(block['Q']) || block['Q'] < -0.5 || block['Q'] > 9.5)) {
    refuse("NC218", "G10: Q is the orientation of a lathe tool, 0 to 9", place);
  }
}

void BlockPlanner::add_action(const ProcessAction& action) {
  if (plan_.action_count == BlockPlan::kMaxActions) return;
  int slot = plan_.action_count++;
  while (slot > 0 && plan_.actions[static_cast<std::size_t>(slot - 1)].rank > action.rank) {
    plan_.actions[static_cast<std::size_t>(slot)] =
        plan_.actions[static_cast<std::size_t>(slot - 1)];
    --slot;
  }
  plan_.actions[static_cast<std::size_t>(slot)] = action;
}

void BlockPlanner::plan_process(const BlockWords& block, LetterMask free) {
  if (block.m_count == 0 && free == 0 && matcher_.letters() == 0) return;
  // Words of rows in the table first, so that an M word without a row takes only what is left.
  for (int slot = 0; slot < block.m_count; ++slot) plan_m(block, slot, free);
  plan_letters(block, free);
}

void BlockPlanner::plan_m(const BlockWords& block, int slot, LetterMask& free) {
  const auto index = static_cast<std::size_t>(slot);
  ProcessAction action;
  action.m = block.m[index];
  action.rank = m_rank(action.m);
  action.piece = block.m_piece[index];
  const bool siemens = dialect_ == InputDialect::siemens;
  if (action.m == 2 || action.m == 30 || (siemens && action.m == 17)) {
    action.kind = ProcessAction::Kind::program_end;
    if (siemens) action.rank = kAfterMotion + 1;
    return add_action(action);
  }
  if (is_flow_m(action.m, dialect_)) {
    action.kind = ProcessAction::Kind::flow;
    action.rank = action.m >= 97 ? kAfterMotion + 1 : 0;  // the last one of the block
    return add_action(action);
  }
  if (settings_.has_tcp && dialect_ == InputDialect::linuxcnc &&
      (action.m == 428 || action.m == 429)) {
    action.kind = action.m == 428 ? ProcessAction::Kind::tcp_on : ProcessAction::Kind::tcp_off;
    return add_action(action);
  }
  // A further M word of a row that another M word of the block found says nothing of its own.
  for (int other = 0; other < block.m_count; ++other) {
    if (other == slot) continue;
    const EventMatch owner = matcher_.match_m(block.m[static_cast<std::size_t>(other)], block);
    if (owner.row == nullptr) continue;
    const auto& m = owner.row->m;
    if (std::find(m.begin(), m.end(), action.m) != m.end()) return;
  }
  const EventMatch match = matcher_.match_m(action.m, block);
  action.row = match.row;
  if (match.row != nullptr) {
    free &= ~match.used;
    return add_action(action);
  }
  if (settings_.process.unmapped == UnmappedWords::refuse) {
    refuse_unmapped(block, match, action.piece);
    plan_.taken |= free;  // they belong to the unknown word
    return;
  }
  action.kind = ProcessAction::Kind::comment;
  add_action(action);
}

/// Deals out the letters that no G code and no row uses.
void BlockPlanner::plan_letters(const BlockWords& block, LetterMask free) {
  LetterMask begins = matcher_.letters() & block.letters;
  while (begins != 0) {
    const char letter = static_cast<char>('A' + std::countr_zero(begins));
    begins &= begins - 1;
    const bool open = (free & letter_bit(letter)) != 0 || letter == 'S' || letter == 'T';
    const EventMatch match = open ? matcher_.match_letter(letter, block) : EventMatch{};
    if (match.row == nullptr) continue;
    ProcessAction action;
    action.row = match.row;
    action.piece = block.piece[static_cast<std::size_t>(letter_index(letter))];
    free &= ~match.used;
    add_action(action);
  }
  for (int i = 0; i < plan_.action_count; ++i) {
    ProcessAction& action = plan_.actions[static_cast<std::size_t>(i)];
    if (action.kind != ProcessAction::Kind::comment) continue;
    LetterMask with = free | (block.letters & (letter_bit('S') | letter_bit('T')));
    for (int j = 0; j < plan_.action_count; ++j) {
      const EventRow* row = plan_.actions[static_cast<std::size_t>(j)].row;
      if (row == nullptr) continue;
      for (const RowWord& word : row->words) with &= ~letter_bit(word.letter);
    }
    action.taken = with;
    // A commented tool change still says which tool later lengths belong to.
    plan_.taken |= action.m == 6 ? with & ~letter_bit('T') : with;
    free = 0;
    break;
  }
  free &= ~plan_.taken;
  for (; free != 0; free &= free - 1) {
    const char letter = static_cast<char>('A' + std::countr_zero(free));
    const std::uint32_t piece = block.piece[static_cast<std::size_t>(letter_index(letter))];
    if (letter != 'E') {
      refuse("NC215",
             joined({"no code of this block uses the word ", address_text(letter),
                     "; remove it or write the code that it belongs to"}),
             reader_.place(block, piece));
      continue;
    }
    const GCode code = block.code(GGroup::non_modal);
    plan_.whole_comment = plan_.axes == 0 && (code == 920 || code == 520);
    if (settings_.process.unmapped == UnmappedWords::refuse) {
      refuse_unmapped(block, {}, piece);
      continue;
    }
    ProcessAction action;
    action.kind = ProcessAction::Kind::comment;
    action.piece = piece;
    plan_.taken |= letter_bit(letter);
    add_action(action);
  }
}

void BlockPlanner::refuse_unmapped(const BlockWords& block, const EventMatch& match,
                                   std::uint32_t piece) {
  good_ = false;
  const std::string word = reader_.text(piece);
  if (match.near_row != nullptr) {
    const bool lacks = match.missing != 0;
    refuse(lacks ? "PR103" : "PR101",
           joined({word, " does not fit the input machine's process table: its row \"",
                   match.near_row->event, "\" ", lacks ? "needs the word " : "has other values",
                   std::string_view(&match.missing, lacks ? 1 : 0),
                   lacks ? ", which this block lacks" : "",
                   "; write the block as the row says, add a row to [process.events], give a table "
                   "by --process FILE, or set process.unmapped = \"comment\""}),
           reader_.place(block, piece));
    return;
  }
  if (word.front() == 'M') {
    const int m = std::atoi(word.c_str() + 1);
    if (std::find(m_told_.begin(), m_told_.end(), m) != m_told_.end()) return;
    m_told_.push_back(m);
  } else {
    const LetterMask bit = letter_bit(word.front());
    if ((letters_told_ & bit) != 0) return;
    letters_told_ |= bit;
  }
  refuse(
      "PR101",
      word +
          (settings_.any_axis_needs_machine
               ? " is known to no process table, as no input machine is named (first of such "
                 "words); say --input-machine MACHINE, the machine that the program was posted "
                 "for, or give a table by --process FILE"
               : " has no row in the process table of the input machine (first of such words); "
                 "add a row to its [process.events], give a table by --process FILE, or set "
                 "process.unmapped = \"comment\" to keep such words as comments that do nothing"),
      reader_.place(block, piece));
}

}  // namespace smoothpost::nc
