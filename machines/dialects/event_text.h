#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/core/diagnostic.h"
#include "machines/dialects/dialect.h"

// Process events in the words of controllers whose statements are one line of text each.
namespace smoothpost {

/// An event in the machine's words, or as a comment where the machine file asks for that.
struct EventText {
  std::string text;
  bool is_comment = false;  ///< the event has no row and process.unmapped is "comment"
  bool on_the_fly = false;
  double dwell = 0.0;  ///< s behind the text
};

/// The row of [process.events] for the action's event with its values filled in. Values come from
/// the input program: quotes, semicolons, parentheses and characters outside printable ASCII in
/// them are replaced, so that a value stays a value and never ends the comment or the text it
/// stands in. Nothing, with PR201 (or PR110, PR111), when there are no words.
std::optional<EventText> event_text(const MachineDefinition& machine, const MachineAction& action,
                                    Diagnostics& diagnostics);

/// Printable ASCII of at most `length` characters: what any controller takes in a comment.
std::string plain_text(std::string_view text, std::size_t length);

/// `text` in pieces of at most `width` characters, parted at blanks where there are any: remarks of
/// controllers with short lines. One empty piece for an empty text.
std::vector<std::string> remark_lines(std::string_view text, std::size_t width);

/// Finds the event that a statement of a program stands for, by the machine's rows.
class EventReader {
 public:
  explicit EventReader(const ProcessTable& table);

  /// Whether a statement was found in a place where events on the fly stand.
  enum class Place { any, stop, on_the_fly };

  /// Name of the event whose row fits `statement`: same words (blanks aside), values where the row
  /// has {names}. Rows that fit `place` come first, then those with more fixed text, then the first
  /// in the table. Nothing when no row fits.   Cost: linear in the rows.
  std::optional<std::string> find(std::string_view statement, Place place = Place::any) const;

 private:
  struct Row {
    std::string event;
    std::vector<std::string> fixed;  ///< what stands around the values, blanks dropped
    std::size_t characters = 0;
    bool on_the_fly = false;
  };
  static bool fits(const Row& row, std::string_view packed);

  std::vector<Row> rows_;
};

/// `text` without blanks outside double quotes, in upper case there: how statements are compared.
std::string packed_statement(std::string_view text);

}  // namespace smoothpost
