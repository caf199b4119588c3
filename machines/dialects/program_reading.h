#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "machines/dialects/dialect.h"
#include "machines/dialects/event_text.h"

// What reading a program back has in common, whatever its language: events by the process table,
// the machine file's own lines, joints, the beam. Nothing of it knows how a program is printed.
namespace smoothpost {

struct TextPlace {
  std::uint32_t line = 1;
  std::uint32_t column = 1;
};

/// The lines of a text, which has to outlive them, without their ends (LF or CR LF). What stands
/// behind the last end is a line of its own unless it is empty.
std::vector<std::string_view> text_lines(std::string_view text);

/// Without blanks at both ends.
std::string_view trimmed(std::string_view text);

/// The decimal number that is all of `text`: an optional sign, digits, at most one point, no
/// exponent, at most 30 characters. Nothing when it is not that.
std::optional<double> whole_number(std::string_view text);

class ProgramReading {
 public:
  ProgramReading(const ProgramReading&) = delete;
  ProgramReading& operator=(const ProgramReading&) = delete;

  ReadBack result;
  Diagnostics diagnostics;

 protected:
  /// `code` is that of error() without one. machine and file are kept by reference.
  ProgramReading(const MachineDefinition& machine, const std::string& file, const char* code);
  ~ProgramReading() = default;

  const MachineDefinition& machine() const { return machine_; }

  /// At most 100 are kept.
  void error(TextPlace at, std::string text) { error(at, code_, std::move(text)); }
  void error(TextPlace at, const char* code, std::string text);

  /// Adds the event whose words `statement` is; false when no row of the table has them. A ; at the
  /// end of a row is none of its words. The text of a message may be anything that does not close
  /// the bracket or quote it stands in.
  bool read_event(TextPlace at, std::string_view statement,
                  EventReader::Place place = EventReader::Place::any);
  void add_event(TextPlace at, std::string name, double seconds);

  /// The machine file's first lines before the first motion, or its last ones. A last line ends the
  /// program: no motion may follow.
  bool is_own_line(std::string_view statement);
  bool has_ended() const { return ended_; }

  /// A move at `at` with the beam as it is; joints 0, none known.
  ReadBackMove new_move(TextPlace at) const;
  void set_joint(int j, double value);
  void forget_joint(int j) { known_ &= ~(JointMask{1} << j); }
  bool is_rotary(int j) const;
  const JointVector& joints() const { return joints_; }
  JointMask known() const { return known_; }
  bool all_known() const { return known_ == (JointMask{1} << machine_.size()) - 1U; }
  bool beam() const { return beam_; }

 private:
  const MachineDefinition& machine_;
  const std::string& file_;
  bool is_message(std::string_view statement) const;

  const char* code_;
  ProcessTable table_;
  EventReader events_;
  std::vector<std::string> start_lines_;
  std::vector<std::string> end_lines_;
  bool ended_ = false;
  bool beam_ = false;
  JointVector joints_;
  JointMask known_ = 0;
};

/// What `Reading` makes of a text, or of what a parser made of it (with diagnostics, perhaps a
/// program): its result or the errors. `more` goes to the reading's constructor.
template <class Reading, class Source, class... More>
Result<ReadBack> read_with(const MachineDefinition& machine, const std::string& file,
                           Source&& source, const More&... more) {
  if constexpr (requires { source.diagnostics; })
    if (has_error(source.diagnostics))
      return Result<ReadBack>::failure(std::move(source.diagnostics));
  Reading reading(machine, file, more...);
  if (!has_error(reading.diagnostics)) {
    if constexpr (requires { source.program; })
      reading.run(source.program);
    else
      reading.run(source);
  }
  if (has_error(reading.diagnostics))
    return Result<ReadBack>::failure(std::move(reading.diagnostics));
  return Result<ReadBack>(std::move(reading.result), std::move(reading.diagnostics));
}

}  // namespace smoothpost
