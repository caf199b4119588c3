#include <cmath>
#include <string_view>

#include "formats/nc/executor.h"
#include "formats/nc/number_text.h"

namespace smoothpost::nc {
namespace {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t";
  const std::size_t begin = text.find_first_not_of(kBlank);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlank) - begin + 1);
}

/// Whether `text` begins with `word`, in any case; then `rest` is what follows.
bool begins_with(std::string_view text, std::string_view word) {
  if (text.size() < word.size()) return false;
  for (std::size_t i = 0; i < word.size(); ++i) {
    const char c = text[i] >= 'a' && text[i] <= 'z' ? static_cast<char>(text[i] - 32) : text[i];
    if (c != word[i]) return false;
  }
  return true;
}

bool is_active(std::string_view text) {
  constexpr std::string_view kActive[] = {"DEBUG,",    "PRINT,",     "LOG,",
                                          "LOGOPEN,",  "LOGCLOSE",   "LOGAPPEND,",
                                          "PROBEOPEN", "PROBECLOSE", "ABORT,"};
  for (const std::string_view word : kActive) {
    if (begins_with(text, word)) return true;
  }
  return false;
}

}  // namespace

void Executor::comment(const BlockWords& block) {
  const Piece& piece = reader_.program().pieces[block.comment_piece];
  std::string_view text(reader_.program().text);
  text = text.substr(piece.begin, piece.length);
  const bool parentheses = text.front() == '(';
  text = trimmed(parentheses ? text.substr(1, text.size() - 2) : text.substr(1));
  if (parentheses && begins_with(text, "MSG,")) {
    return message(trimmed(text.substr(4)), block.input_line,
                   reader_.input_place(block, block.comment_piece).column);
  }
  if (parentheses && is_linuxcnc() && active_comment(text, block)) return;
  if (parentheses && is_active(text)) {
    log_.note("NC231", "an active comment is kept as plain text; it does nothing here",
              reader_.place(block, block.comment_piece));
  }
  if (!text.empty()) sink_.comment(text, block.input_line);
}

void Executor::message(std::string_view text, std::uint32_t line, std::uint32_t column) {
  ProcessEvent event;
  event.name = event_name::kMessage;
  event.parameters.emplace_back("text", std::string(text));
  event.line = line;
  event.column = column;
  sink_.event(event);
}

void Executor::speed_and_tool(const BlockWords& block, const BlockPlan& plan) {
  if (block.has('T') && (plan.taken & letter_bit('T')) == 0) {
    modal_.words.tool = static_cast<int>(std::lround(block['T']));
    if (is_siemens()) {
      const std::string_view text = reader_.raw(block.piece[letter_index('T')]);
      const std::size_t quote = text.find('"');
      modal_.words.tool_name =
          quote == std::string_view::npos ? "" : text.substr(quote + 1, text.size() - quote - 2);
    }
  }
  if (!block.has('S') || (plan.taken & letter_bit('S')) != 0) return;
  const bool changed = block['S'] != modal_.words.speed;
  modal_.words.speed = block['S'];
  if (!changed || modal_.spindle_row == nullptr) return;
  for (int i = 0; i < block.m_count; ++i) {
    if (m_group(block.m[static_cast<std::size_t>(i)]) == 7) return;  // that one says it
  }
  for (int i = 0; i < plan.action_count; ++i) {
    const EventRow* row = plan.actions[static_cast<std::size_t>(i)].row;
    if (row == nullptr) continue;
    for (const RowWord& word : row->words) {
      if (word.letter == 'S') return;  // S belongs to that row
    }
  }
  emit_event(*modal_.spindle_row, block, block.piece[static_cast<std::size_t>(letter_index('S'))]);
}

void Executor::process(const BlockWords& block, const BlockPlan& plan, bool after_motion) {
  if (block.m_count != 0 && !after_motion) note_switches(block);
  for (int i = 0; i < plan.action_count; ++i) {
    const ProcessAction& action = plan.actions[static_cast<std::size_t>(i)];
    if ((action.rank >= kAfterMotion) != after_motion) continue;
    switch (action.kind) {
      case ProcessAction::Kind::event:
        act_on_row(block, action);
        break;
      case ProcessAction::Kind::comment:
        comment_words(block, action);
        break;
      case ProcessAction::Kind::tcp_on:
        set_tcp(true);
        break;
      case ProcessAction::Kind::tcp_off:
        set_tcp(false);
        break;
      case ProcessAction::Kind::flow:
        flow_word(block, action);
        break;
      case ProcessAction::Kind::program_end:
        if (is_siemens()) {
          end_siemens_program(block.input_line);
          break;
        }
        sink_.program_end(block.input_line);
        summary_.ended = true;
        break;
    }
  }
}

/// Whether spindle and coolant are on, for cycles, parameters and M70.
void Executor::note_switches(const BlockWords& block) {
  for (int i = 0; i < block.m_count; ++i) {
    const int m = block.m[static_cast<std::size_t>(i)];
    if (m_group(m) == 7) modal_.spindle = m;
    if (m == 7) modal_.mist = true;
    if (m == 8) modal_.flood = true;
    if (m == 9) modal_.mist = modal_.flood = false;
  }
}

void Executor::act_on_row(const BlockWords& block, const ProcessAction& action) {
  emit_event(*action.row, block, action.piece);
  if (m_group(action.m) == 7) {
    modal_.spindle_row = nullptr;
    for (const RowWord& word : action.row->words) {
      if (word.letter == 'S' && !word.name.empty()) modal_.spindle_row = action.row;
    }
  }
  if (action.m == 6) change_tool(block);
}

void Executor::emit_event(const EventRow& row, const BlockWords& block, std::uint32_t piece) {
  ProcessEvent event;
  event.name = row.event;
  event.parameters = EventMatcher::values(row, block, modal_.words);
  event.line = block.input_line;
  event.column = reader_.input_place(block, piece).column;
  sink_.event(event);
}

/// The words in the order of the block, as the user wrote them.
void Executor::comment_words(const BlockWords& block, const ProcessAction& action) {
  const GCode code = block.code(GGroup::non_modal);
  const bool whole = planner_.current().whole_comment;
  std::string text = "unmapped:";
  const Block& span = reader_.program().block(block.line - 1);
  for (std::uint32_t i = span.first_piece; i < span.first_piece + span.piece_count; ++i) {
    const Piece& piece = reader_.program().pieces[i];
    if (piece.kind != PieceKind::word) continue;
    const bool letter = piece.letter != 'G' && piece.letter != 'M' && piece.letter != 'N' &&
                        (action.taken & letter_bit(piece.letter)) != 0;
    const bool shift = whole && piece.letter == 'G' && std::lround(piece.value * 10.0) == code;
    if (i == action.piece || letter || shift) text += " " + reader_.text(i);
  }
  sink_.comment(text, block.input_line);
  if (action.m == 6) change_tool(block);
  if (m_group(action.m) == 7) modal_.spindle_row = nullptr;
}

/// The controller finds X Y Z anew from its joints when the mode changes. They keep their values
/// when all rotary axes stand at zero, where both modes agree; otherwise they are unknown.
void Executor::set_tcp(bool on) {
  constexpr AxisMask kLinear = 7;
  constexpr AxisMask kRotary = 0x38;
  if (on == modal_.tcp) return;
  modal_.tcp = on;
  bool at_zero = (coordinates_.unknown() & kRotary & settings_.axes) == 0;
  for (std::size_t i = 3; i < 6; ++i) at_zero = at_zero && coordinates_.world()[i] == 0.0;
  modal_.by_vector = false;
  modal_.axis = Vec3::Zero();
  if (!at_zero) coordinates_.forget(kLinear);
}

void Executor::dwell(const BlockWords& block) {
  if (block.code(GGroup::non_modal) != 40) return;
  if (is_linuxcnc()) return sink_.dwell(block['P'], block.input_line);
  if (is_siemens()) return sink_.dwell(block['F'], block.input_line);
  constexpr double kMillisecond = 1e-3;
  const char letter = block.has('P') ? 'P' : block.has('X') ? 'X' : 'U';
  const std::uint32_t piece = block.piece[static_cast<std::size_t>(letter_index(letter))];
  const bool milliseconds = letter == 'P' && !reader_.has_point(piece);
  sink_.dwell(block[letter] * (milliseconds ? kMillisecond : 1.0), block.input_line);
}

}  // namespace smoothpost::nc
