#include <charconv>
#include <cmath>
#include <system_error>

#include "formats/nc/executor.h"
#include "formats/nc/number_text.h"
#include "formats/nc/parser.h"
#include "formats/nc/subroutine_files.h"

// Calls of subroutines and the way back: o<name> call, M98, M97, G65, M99.
namespace smoothpost::nc {
namespace {

bool is_whole(double value) { return std::abs(value - std::round(value)) <= 1e-4; }

/// The variable that an address of G65 sets; 0: none.
int argument_index(char letter) {
  constexpr std::string_view kLetters = "ABCIJKDEF H     QRSTUVWXYZ";
  const std::size_t place = kLetters.find(letter);
  return place == std::string_view::npos ? 0 : static_cast<int>(place) + 1;
}

/// A label of digits as a number; nothing for other labels.
std::optional<long> number_of(const std::string& label) {
  long number = 0;
  const char* end = label.data() + label.size();
  const auto read = std::from_chars(label.data(), end, number);
  if (read.ec != std::errc{} || read.ptr != end) return {};
  return number;
}

}  // namespace

/// The text in a file that holds a subroutine, read once; nullptr: there is none, or it was
/// refused.
ProgramUnit* Executor::unit_of_file(const std::string& name, TextPlace place) {
  const auto known = files_.find(name);
  if (known != files_.end()) return known->second;
  SubroutineFile file = find_subroutine(settings_.subroutine_folders, name, dialect_);
  files_[name] = nullptr;
  if (!file.found()) return nullptr;
  if (!file.problem.empty()) {
    stop("NC251", "the subroutine's file \"" + file.name + "\" is not read: " + file.problem,
         place);
    return nullptr;
  }
  log_.adopt({Severity::note, "NC259", "read as a subroutine of the program", {file.path, 1, 1}});
  if (!spend(1 + file.text.size() / 256, place)) return nullptr;
  ParsedProgram parsed = parse(std::move(file.text), file.name, dialect_);
  for (const Diagnostic& d : parsed.diagnostics) {
    if (d.severity == Severity::error) log_.adopt(d);
    stopped_ = stopped_ || d.severity == Severity::error;
  }
  auto unit = std::make_unique<ProgramUnit>();
  unit->path = std::move(file.path);
  unit->owned = std::make_unique<Program>(std::move(parsed.program));
  unit->program = unit->owned.get();
  units_.push_back(std::move(unit));
  if (stopped_) return nullptr;
  return files_[name] = units_.back().get();
}

/// Goes into a text at `frame.entry`.
bool Executor::enter(ProgramUnit& unit, CallFrame frame) {
  if (static_cast<int>(frames_.size()) > settings_.call_depth) {
    stop("NC253",
         "more than " + std::to_string(settings_.call_depth) +
             " calls within each other, which controllers refuse; let the CAM post write fewer",
         frame.place);
    return false;
  }
  called_ = true;
  frame.caller = unit_;
  frame.caller_input_line = input_line_;
  // What a file does counts as the line of the program that called it.
  if (unit.owned && input_line_ == 0) {
    input_line_ = frame.place.line;
  } else if (!unit.owned) {
    input_line_ = 0;
  }
  unit_ = &unit;
  place_.next = frame.entry;
  frame.caller_begin = range_begin_;
  frame.caller_end = range_end_;
  const bool part = frame.style == CallFrame::Style::part;
  run_within(part || is_siemens() ? frame.entry : 0,
             frame.end != 0 ? frame.end : unit.program->block_count);
  if (!part) values_->enter_call(frame.scope);
  frames_.push_back(std::move(frame));
  place_.call_level = static_cast<int>(frames_.size()) - 1;
  reader_.select(*unit.program, input_line_);
  log_.enter_file(unit.program->file_name);
  return true;
}

void Executor::leave_call() {
  CallFrame& frame = frames_.back();
  const bool part = frame.style == CallFrame::Style::part;
  if (!part) values_->leave_call();
  if (--frame.repeats_left > 0) {
    if (!part) values_->enter_call(frame.scope);
    place_.next = frame.entry;
    return;
  }
  run_within(frame.caller_begin, frame.caller_end);
  unit_ = frame.caller;
  input_line_ = frame.caller_input_line;
  place_.next = frame.return_block;
  frames_.pop_back();
  place_.call_level = static_cast<int>(frames_.size()) - 1;
  reader_.select(*unit_->program, input_line_);
  log_.enter_file(unit_->program->file_name);
}

void Executor::run_within(std::size_t begin, std::size_t end) {
  range_begin_ = begin;
  range_end_ = end;
}

/// The next block is not one of those that are run. True: the run goes on.
bool Executor::leave_range() {
  if (frames_.back().style == CallFrame::Style::part) {
    if (place_.next == range_end_) {
      leave_call();
      return true;
    }
    stop("NC250",
         "the flow leaves the part that REPEAT runs again: where it would go on is not "
         "stated; end the loop or branch within the part",
         frames_.back().place);
    return false;
  }
  if (frames_.size() > 1) end_of_text();
  return false;
}

void Executor::end_of_text() {
  const TextPlace place{static_cast<std::uint32_t>(range_end_), 1};
  const char* end = is_siemens()                                      ? "M17 or RET"
                    : frames_.back().style == CallFrame::Style::oword ? "endsub"
                                                                      : "M99";
  stop("NC257", std::string("the text ends within a subroutine: ") + end + " is missing", place);
}

void Executor::call(const FlowStatement& statement) {
  const TextPlace place = flow_place(statement, 0);
  std::string label = statement.text.label;
  if (statement.text.computed_label != FlowText::kNone) {
    const auto value = evaluate(statement, statement.text.computed_label);
    if (!value) return;
    const long number = label_number(*value);
    if (number < 0) {
      return stop("NC251", "the label " + shortest_text(*value) + " is no whole number from 0",
                  place);
    }
    label = std::to_string(number);
  }
  CallFrame frame;
  frame.style = CallFrame::Style::oword;
  frame.place = place;
  frame.return_block = place_.next;
  for (std::size_t i = 0; i < statement.text.values.size(); ++i) {
    const auto value = evaluate(statement, statement.text.values[i]);
    if (!value) return;
    frame.scope.arguments.emplace_back(static_cast<int>(i) + 1, *value);
  }
  const auto enter_sub = [&](ProgramUnit& unit) {
    FlowIndex& index = index_of(unit);
    const auto found = index.subs.find(label);
    if (found == index.subs.end()) return false;
    const FlowStatement& sub = index.statements[found->second];
    if (!sub.fault.empty()) {
      stop("NC250", "the subroutine " + label + ": " + sub.fault, place);
      return true;
    }
    frame.entry = sub.block + 1;
    enter(unit, frame);
    return true;
  };
  if (enter_sub(*unit_) || enter_sub(*units_.front())) return;
  ProgramUnit* unit = unit_of_file(label, place);
  if (stopped_ || (unit != nullptr && enter_sub(*unit))) return;
  if (unit != nullptr) {
    return stop(
        "NC251",
        "the file \"" + unit->program->file_name + "\" has no subroutine o<" + label + "> sub",
        place);
  }
  const auto& programs = index_of(*unit_).programs;
  const std::optional<long> number = number_of(label);
  if (number && programs.count(*number) != 0) {
    return stop("NC251", "O" + label + " is a program of the Fanuc style: call it by M98 P" + label,
                place);
  }
  stop("NC251",
       "there is no subroutine " + label + " in the program" +
           (settings_.subroutine_folders.empty() ? "" : " or in the folders of subroutines") +
           "; write it into the program, or its file beside it",
       place);
}

/// endsub and return.
void Executor::give_back(const FlowStatement& statement) {
  if (frames_.back().style != CallFrame::Style::oword) {
    return stop("NC256",
                frames_.size() == 1 ? "the subroutine ends here but was not called"
                                    : "a subroutine that M98 called ends with M99",
                flow_place(statement, 0));
  }
  std::optional<double> result;
  if (!statement.text.values.empty()) {
    result = evaluate(statement, statement.text.values.front());
    if (!result) return;
  }
  const CallFrame& frame = frames_.back();
  if (frame.restores && frame.saved) {
    const SavedState saved = *frame.saved;
    restore_state(saved, reader_.read(statement.block));
  }
  leave_call();
  values_->store()->set_result(result);
}

/// M70 to M73, M97, M98, M99.
void Executor::flow_word(const BlockWords& block, const ProcessAction& action) {
  const TextPlace place = reader_.place(block, action.piece);
  switch (action.m) {
    case 70:
      return save_state(false);
    case 73:
      return save_state(true);
    case 71:
      frames_.back().saved.reset();
      return;
    case 72:
      if (!frames_.back().saved) {
        return stop("NC258", "M72: no state was saved at this level; write M70 before", place);
      }
      return restore_state(*frames_.back().saved, block);
    case 99:
      return end_program_call(block, action);
    default:
      return call_program(block, action);
  }
}

void Executor::call_program(const BlockWords& block, const ProcessAction& action) {
  const TextPlace place = reader_.place(block, action.piece);
  const std::string word = "M" + std::to_string(action.m);
  if (is_linuxcnc() && (planner_.current().motion != kNoCode || block.m_count > 1)) {
    return stop("NC256", word + " stands alone on its line; write the other words before", place);
  }
  double number = block.has('P') ? block['P'] : -1.0;
  double count = block.has('L') ? block['L'] : 1.0;
  if (!is_whole(number) || number < -1e-4 || number > 99'999'999.0) {
    return stop("NC256", word + " needs P with the number of the subroutine", place);
  }
  if (!is_whole(count) || count < -1e-4 || count > 1e9) {
    return stop("NC256", word + ": L, the count of calls, is a whole number from 0", place);
  }
  CallFrame frame;
  frame.style = CallFrame::Style::program;
  frame.place = place;
  frame.return_block = place_.next;
  frame.scope.kind = CallScope::Kind::program;
  frame.repeats_left = std::lround(count);
  const long program = std::lround(number);
  if (action.m == 97) {
    if (frame.repeats_left > 0) call_local(block, program, std::move(frame));
    return;
  }
  bool found = false;
  if (frame.repeats_left == 0 || !enter_program(program, frame, found) || found) return;
  // P31000 of older controls: three times O1000.
  constexpr long kFold = 10'000;
  if (!is_linuxcnc() && !block.has('L') && program >= kFold) {
    frame.repeats_left = program / kFold;
    if (!enter_program(program % kFold, frame, found) || found) return;
  }
  const auto& subs = index_of(*unit_).subs;
  if (subs.count(std::to_string(program)) != 0) {
    return stop("NC251",
                "o" + std::to_string(program) + " sub is a subroutine of LinuxCNC: call it by o" +
                    std::to_string(program) + " call",
                place);
  }
  stop("NC251",
       "there is no program O" + std::to_string(program) + " in the text" +
           (settings_.subroutine_folders.empty() ? "" : " or in the folders of subroutines") +
           "; write it behind the program, or its file beside it",
       place);
}

/// Haas M97: the block with that N number, up to M99.
void Executor::call_local(const BlockWords& block, long number, CallFrame frame) {
  const std::uint32_t region = index_of(*unit_).region_of(block.line - 1);
  const std::size_t back = place_.next;
  go_to_number(region, number, frame.place);
  if (stopped_) return;
  frame.entry = place_.next;
  frame.return_block = back;
  enter(*unit_, std::move(frame));
}

/// Enters O`number` of this text, of the program's or of a file. `found`: it was entered. False:
/// something else stopped the run.
bool Executor::enter_program(long number, CallFrame frame, bool& found) {
  for (ProgramUnit* unit : {unit_, units_.front().get()}) {
    const auto& programs = index_of(*unit).programs;
    const auto label = programs.find(number);
    if (label == programs.end()) continue;
    if (label->second.twice) {
      stop("NC250", "O" + std::to_string(number) + " stands in the text more than once",
           frame.place);
      return false;
    }
    frame.entry = label->second.block + 1;
    found = true;
    return enter(*unit, std::move(frame));
  }
  ProgramUnit* unit = unit_of_file(std::to_string(number), frame.place);
  if (unit == nullptr) return !stopped_;
  const auto& programs = index_of(*unit).programs;
  const auto label = programs.find(number);
  frame.entry = label == programs.end() ? 0 : label->second.block + 1;
  found = true;
  return enter(*unit, std::move(frame));
}

void Executor::macro_call(const BlockWords& block) {
  const TextPlace place = at(block, GGroup::non_modal);
  const double number = block.has('P') ? block['P'] : -1.0;
  const double count = block.has('L') ? block['L'] : 1.0;
  if (!is_whole(number) || number < -1e-4 || !is_whole(count) || count < -1e-4 || count > 1e9 ||
      number > 99'999'999.0) {
    return stop("NC256", "G65 needs P with the number of the program, and L as a count", place);
  }
  CallFrame frame;
  frame.style = CallFrame::Style::program;
  frame.place = place;
  frame.return_block = place_.next;
  frame.scope.kind = CallScope::Kind::macro;
  frame.repeats_left = std::lround(count);
  for (char letter = 'A'; letter <= 'Z'; ++letter) {
    const int index = block.has(letter) ? argument_index(letter) : 0;
    if (index != 0) frame.scope.arguments.emplace_back(index, block[letter]);
  }
  if (frame.repeats_left == 0) return;
  bool found = false;
  if (!enter_program(std::lround(number), std::move(frame), found) || found) return;
  stop(
      "NC251",
      "there is no program O" + shortest_text(number) + " in the text; write it behind the program",
      place);
}

/// M99: back to the caller; with P (not in LinuxCNC) to its block N P.
void Executor::end_program_call(const BlockWords& block, const ProcessAction& action) {
  const TextPlace place = reader_.place(block, action.piece);
  if (frames_.size() == 1) {
    return stop("NC256",
                "M99 in the main program starts it again without end; end the program with M30",
                place);
  }
  if (frames_.back().style != CallFrame::Style::program) {
    return stop("NC256", "a subroutine that \"o.. call\" called ends with endsub or return", place);
  }
  const bool alone = planner_.current().motion == kNoCode && block.m_count == 1 && !block.has('P');
  if (is_linuxcnc() && !alone) {
    return stop("NC256", "M99 stands alone on its line", place);
  }
  const CallFrame& frame = frames_.back();
  if (frame.restores && frame.saved) {
    const SavedState saved = *frame.saved;
    restore_state(saved, block);
  }
  const double target = block.has('P') ? block['P'] : -1.0;
  if (block.has('P')) frames_.back().repeats_left = 0;
  const TextPlace call = frames_.back().place;
  leave_call();
  if (!block.has('P') || stopped_) return;
  go_to_number(index_of(*unit_).region_of(call.line - 1), label_number(target), call);
}

}  // namespace smoothpost::nc
