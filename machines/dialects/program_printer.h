#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "kernels/core/diagnostic.h"
#include "machines/dialects/dialect.h"
#include "machines/dialects/event_text.h"

// What the text of every controller has in common when it is printed: the order of its parts.
namespace smoothpost {

/// `value` with at most `decimals` decimals, as append_decimal().
std::string decimal_text(double value, int decimals);

/// Decimals with which `value` has `figures` figures, in [least, most].
int decimals_for(double value, int figures, int least, int most);

/// Prints a program: the head, every move behind the actions in front of it, the foot. What each of
/// them looks like is up to the dialect that derives from it. A move stands on the last line that
/// print_move() prints. Errors are collected; with one there is no text.
class ProgramPrinter {
 public:
  virtual ~ProgramPrinter() = default;
  ProgramPrinter(const ProgramPrinter&) = delete;
  ProgramPrinter& operator=(const ProgramPrinter&) = delete;

  /// Once.   Cost: linear.
  Result<EmittedProgram> run();

 protected:
  /// Both are kept by reference.
  ProgramPrinter(const MachineDefinition& machine, const MachineProgram& program);

  /// Refuses what cannot be printed; nothing else is called when it does.
  virtual void check() {}
  virtual void head() = 0;
  virtual void print_move(std::size_t i) = 0;
  virtual void foot() = 0;
  virtual void comment(const std::string& text) = 0;
  virtual void dwell(double seconds) = 0;
  virtual void label(const std::string& text) = 0;
  /// The words of an event; `action` is the event itself.
  virtual void statement(const std::string& words, const MachineAction& action) = 0;

  const MachineDefinition& machine() const { return machine_; }
  const MachineProgram& program() const { return program_; }
  const MachineMove& move(std::size_t i) const { return program_.moves[i]; }
  static bool is_tool(const MachineMove& move) {
    return move.interpolation == MoveInterpolation::tool;
  }
  bool has_poses() const { return has_poses_; }

  void line(std::string_view text);
  std::uint32_t lines() const { return lines_; }
  std::string& text() { return out_.text; }
  void refuse(const char* code, std::string text, std::uint32_t input_line = 0);

  /// The actions in front of move `before`, by index; those that take() got are not printed.
  std::pair<std::size_t, std::size_t> actions_before(std::size_t before) const;
  void take(std::size_t action) { taken_[action] = true; }
  bool is_taken(std::size_t action) const { return taken_[action]; }
  Diagnostics& diagnostics() { return diagnostics_; }

 private:
  void print_action(const MachineAction& action);

  const MachineDefinition& machine_;
  const MachineProgram& program_;
  std::vector<bool> taken_;
  bool has_poses_ = false;
  std::uint32_t lines_ = 0;
  EmittedProgram out_;
  Diagnostics diagnostics_;
};

}  // namespace smoothpost
