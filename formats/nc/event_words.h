#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/nc/block_words.h"
#include "kernels/core/process.h"
#include "kernels/core/result.h"

namespace smoothpost::nc {

using EventParameters = std::vector<std::pair<std::string, std::string>>;

/// The words of an event with its values filled in: "M3 S{rpm}" with {"rpm","630"} is "M3 S630".
/// Values that the words do not name are left out. A failure names the value that the event does
/// not carry [PR110] or the fault of the row [PR111].
Result<std::string> render_event(const EventWords& words, const EventParameters& parameters);

/// A word of a row with a fixed value ("P0") or with a value that has a name ("S{rpm}").
struct RowWord {
  char letter = 0;
  double value = 0.0;
  std::string name;  ///< empty: fixed
};

/// A row of a process table, ready for comparing with blocks.
struct EventRow {
  std::string event;
  std::vector<int> m;          ///< M words; the first one is the key
  std::vector<RowWord> words;  ///< the others, in the order of the row
  bool readable = false;  ///< false: comments, G words, several lines: such a row is only written
};

/// Modal values that a row's word takes when the block does not write it.
struct ModalWords {
  double speed = 0.0;     ///< S
  int tool = 0;           ///< T, the selected tool
  std::string tool_name;  ///< siemens T="NAME"; then `tool` is 0
};

/// What a table says of one M word (or process letter) of a block.
struct EventMatch {
  const EventRow* row = nullptr;       ///< the most specific row that fits
  const EventRow* near_row = nullptr;  ///< when none fits: one with the same key word
  char missing = 0;                    ///< the letter that `near_row` needs and the block lacks
  LetterMask used = 0;                 ///< letters of the block that belong to the row
};

/// The process table of the input machine, compiled once for a program.
///
/// A row fits a block when its M words and its fixed words stand in the block and each of its named
/// words does too; S and T may be modal instead. Of several the one with more M and fixed words is
/// taken, then the one that uses more words of the block, then the first in the table (so "pierce"
/// and "beam_on", both "M62 P0", are read as whichever the table lists first). Rows with several M
/// words are found through the first of them. In rows of a Sinumerik T="{tool}" is the word T;
/// calls and long names (MSG("{text}"), $A_OUT[1]=1, M1=3) make a row that is only written. Cost:
/// linear in the rows, only for blocks with M words.
class EventMatcher {
 public:
  /// A failure names the rows that cannot be understood [PR111].
  static Result<EventMatcher> compile(const ProcessTable& table);

  EventMatch match_m(int m, const BlockWords& block) const;
  /// Rows without M word, found through their first letter, such as "E{length}".
  EventMatch match_letter(char letter, const BlockWords& block) const;
  /// Letters that begin rows without M word.
  LetterMask letters() const { return letters_; }
  const std::vector<EventRow>& rows() const { return rows_; }

  /// The values of a row's named words, as the shortest decimal text.
  static EventParameters values(const EventRow& row, const BlockWords& block,
                                const ModalWords& modal);

 private:
  std::vector<EventRow> rows_;
  LetterMask letters_ = 0;
};

}  // namespace smoothpost::nc
