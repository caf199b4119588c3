#include <string_view>

#include "formats/nc/comment_text.h"
#include "formats/nc/executor.h"
#include "formats/nc/number_text.h"

// M70 to M73, M words that other codes stand for, and comments that show values.
namespace smoothpost::nc {
namespace {

bool begins_with(std::string_view text, std::string_view word) {
  if (text.size() < word.size()) return false;
  for (std::size_t i = 0; i < word.size(); ++i) {
    const char c = text[i] >= 'a' && text[i] <= 'z' ? static_cast<char>(text[i] - 32) : text[i];
    if (c != word[i]) return false;
  }
  return true;
}

}  // namespace

void Executor::save_state(bool restores) {
  SavedState saved;
  saved.unit = modal_.unit;
  saved.feed_unit = modal_.feed_unit;
  saved.plane = modal_.plane;
  saved.incremental = modal_.incremental;
  saved.arc_absolute = modal_.arc_absolute;
  saved.inverse_time = modal_.inverse_time;
  saved.per_turn = modal_.per_turn;
  saved.retract_to_old = modal_.retract_to_old;
  saved.diameter = modal_.diameter;
  saved.linear_feed = modal_.linear_feed;
  saved.angular_feed = modal_.angular_feed;
  saved.speed = modal_.words.speed;
  saved.system = coordinates_.system();
  saved.tool_length = coordinates_.tool()[2];
  saved.length_tool = modal_.length_tool;
  saved.spindle = modal_.spindle;
  saved.mist = modal_.mist;
  saved.flood = modal_.flood;
  frames_.back().saved = saved;
  frames_.back().restores = restores;
}

/// The motion mode stays, as in LinuxCNC. Spindle and coolant are switched where they differ.
void Executor::restore_state(const SavedState& saved, const BlockWords& block) {
  if (radius_.is_on())
    return error("NC264",
                 "the saved state (M70, M73) comes back under cutter radius compensation; write "
                 "G40 before",
                 block, block.first_piece);
  modal_.unit = saved.unit;
  modal_.feed_unit = saved.feed_unit;
  modal_.plane = saved.plane;
  modal_.incremental = saved.incremental;
  modal_.arc_absolute = saved.arc_absolute;
  modal_.inverse_time = saved.inverse_time;
  modal_.per_turn = saved.per_turn;
  modal_.retract_to_old = saved.retract_to_old;
  modal_.diameter = saved.diameter;
  modal_.linear_feed = saved.linear_feed;
  modal_.angular_feed = saved.angular_feed;
  if (saved.system != coordinates_.system()) {
    coordinates_.select_system(saved.system);
    offset_dirty_ = true;
  }
  set_tool_length(saved.tool_length, saved.length_tool, block.input_line);
  const bool turns = saved.spindle == 3 || saved.spindle == 4;
  const bool other_speed = turns && saved.speed != modal_.words.speed;
  modal_.words.speed = saved.speed;
  if (saved.spindle != modal_.spindle || other_speed) act_on_m(saved.spindle, block);
  modal_.spindle = saved.spindle;
  if ((modal_.mist && !saved.mist) || (modal_.flood && !saved.flood)) {
    act_on_m(9, block);
    modal_.mist = modal_.flood = false;
  }
  if (saved.mist && !modal_.mist) act_on_m(7, block);
  if (saved.flood && !modal_.flood) act_on_m(8, block);
  modal_.mist = saved.mist;
  modal_.flood = saved.flood;
}

/// Does what the block `Mm` would do by the process table, with the modal S.
void Executor::act_on_m(int m, const BlockWords& block) {
  BlockWords alone = block;
  alone.letters = 0;
  alone.m_count = 1;
  alone.m[0] = static_cast<std::int16_t>(m);
  const EventMatch match = matcher_.match_m(m, alone);
  const std::string word = "M" + std::to_string(m);
  if (match.row != nullptr) {
    emit_event(*match.row, alone, block.first_piece);
    if (m_group(m) == 7) {
      modal_.spindle_row = nullptr;
      for (const RowWord& row_word : match.row->words) {
        if (row_word.letter == 'S' && !row_word.name.empty()) modal_.spindle_row = match.row;
      }
    }
  } else if (settings_.process.unmapped == UnmappedWords::comment) {
    sink_.comment("unmapped: " + word, block.input_line);
  } else {
    log_.error("PR101",
               "this block stands for " + word +
                   ", which has no row in the process table of the input machine; add a row to its "
                   "[process.events] or give a table by --process FILE",
               reader_.place(block, block.first_piece));
  }
}

/// (PRINT,..), (DEBUG,..), (LOG,..) go on with their values; (ABORT,..) ends the run.
bool Executor::active_comment(std::string_view text, const BlockWords& block) {
  const TextPlace place = reader_.place(block, block.comment_piece);
  const ParameterStore* store = values_->store();
  if (begins_with(text, "ABORT,")) {
    stop("NC263", "the program ends itself here: " + with_values(text.substr(6), *store), place);
    return true;
  }
  for (const std::string_view word : {"PRINT,", "DEBUG,", "LOG,"}) {
    if (!begins_with(text, word)) continue;
    log_.note("NC231", "an active comment is kept as plain text; it does nothing here", place);
    sink_.comment(joined({word, with_values(text.substr(word.size()), *store)}), block.input_line);
    return true;
  }
  return false;
}

}  // namespace smoothpost::nc
