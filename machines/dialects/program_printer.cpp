#include "machines/dialects/program_printer.h"

#include <algorithm>
#include <cmath>

#include "machines/dialects/decimal.h"

namespace smoothpost {

std::string decimal_text(double value, int decimals) {
  std::string out;
  append_decimal(out, value, decimals);
  return out;
}

int decimals_for(double value, int figures, int least, int most) {
  const double size = std::abs(value);
  if (!(size > 0.0)) return least;
  return std::clamp(figures - 1 - static_cast<int>(std::floor(std::log10(size))), least, most);
}

ProgramPrinter::ProgramPrinter(const MachineDefinition& machine, const MachineProgram& program)
    : machine_(machine), program_(program), taken_(program.actions.size(), false) {
  has_poses_ = std::any_of(program.moves.begin(), program.moves.end(), is_tool);
  out_.move_lines.reserve(program.moves.size());
  out_.text.reserve(96 * program.moves.size() + 4096);
}

Result<EmittedProgram> ProgramPrinter::run() {
  check();
  if (has_error(diagnostics_)) return Result<EmittedProgram>::failure(std::move(diagnostics_));
  head();
  for (std::size_t i = 0; i <= program_.moves.size(); ++i) {
    const auto [first, last] = actions_before(i);
    for (std::size_t k = first; k < last; ++k)
      if (!taken_[k]) print_action(program_.actions[k]);
    if (i == program_.moves.size()) break;
    print_move(i);
    out_.move_lines.push_back(lines_);
  }
  foot();
  out_.line_count = lines_;
  if (has_error(diagnostics_)) return Result<EmittedProgram>::failure(std::move(diagnostics_));
  return Result<EmittedProgram>(std::move(out_), std::move(diagnostics_));
}

void ProgramPrinter::line(std::string_view text) {
  out_.text += text;
  out_.text += '\n';
  ++lines_;
}

void ProgramPrinter::refuse(const char* code, std::string text, std::uint32_t input_line) {
  Diagnostic d;
  d.code = code;
  d.text = std::move(text);
  d.where.line = static_cast<int>(input_line);
  diagnostics_.push_back(std::move(d));
}

std::pair<std::size_t, std::size_t> ProgramPrinter::actions_before(std::size_t before) const {
  const auto& actions = program_.actions;
  const auto below = [](const MachineAction& a, std::size_t value) { return a.before < value; };
  const auto first = std::lower_bound(actions.begin(), actions.end(), before, below);
  const auto last = std::lower_bound(first, actions.end(), before + 1, below);
  return {static_cast<std::size_t>(first - actions.begin()),
          static_cast<std::size_t>(last - actions.begin())};
}

void ProgramPrinter::print_action(const MachineAction& action) {
  switch (action.kind) {
    case MachineAction::Kind::comment:
      return comment(action.text);
    case MachineAction::Kind::dwell:
      return dwell(action.seconds);
    case MachineAction::Kind::cut_label:
      return label(action.text);
    case MachineAction::Kind::event:
      break;
  }
  const auto event = event_text(machine_, action, diagnostics_);
  if (!event) return;
  if (event->is_comment) return comment(event->text);
  statement(event->text, action);
  if (event->dwell > 0.0) dwell(event->dwell);
}

}  // namespace smoothpost
