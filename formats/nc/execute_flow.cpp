#include <algorithm>
#include <cmath>

#include "formats/nc/executor.h"
#include "formats/nc/number_text.h"

// Lines of program flow: loops, branches, jumps. Calls are in execute_calls.cpp.
namespace smoothpost::nc {

using Kind = FlowKind;

FlowIndex& Executor::index_of(ProgramUnit& unit) {
  if (!unit.index) {
    const bool in_windows = stream_ != nullptr && unit.program == &stream_->program();
    unit.index = in_windows ? stream_->take_flow() : index_flow(*unit.program);
  }
  return *unit.index;
}

/// Faults behind the end of the program are told when the flow comes to them.
void Executor::tell_flow_faults(ProgramUnit& unit) {
  if (settings_.plain_blocks) return;
  for (const FlowStatement& statement : index_of(unit).statements) {
    if (statement.fault.empty() || statement.block >= unit.program->end_block) continue;
    log_.error("NC250", statement.fault, flow_place(statement, 0));
  }
}

TextPlace Executor::flow_place(const FlowStatement& statement, std::size_t offset) const {
  return {statement.block + 1, statement.column + static_cast<std::uint32_t>(offset)};
}

std::string_view Executor::flow_text(const FlowStatement& statement) const {
  return std::string_view(unit_->program->text).substr(statement.begin, statement.length);
}

void Executor::flow(const BlockWords& block) {
  if (settings_.plain_blocks) {
    return stop("NC255",
                "a line of program flow; a machine program runs its blocks one after the other",
                reader_.place(block, block.flow_piece));
  }
  const FlowIndex& index = index_of(*unit_);
  const std::uint32_t number = index.of_block(block.line - 1);
  const FlowStatement& statement = index.statements[number];
  if (block.bad || !statement.fault.empty()) {
    const std::string why =
        block.bad ? "the line has other text that was refused" : statement.fault;
    return stop("NC250", why, flow_place(statement, 0));
  }
  if (block.comment_piece != BlockWords::kNone) comment(block);
  switch (statement.text.kind) {
    case Kind::sub:
      return jump_behind(statement.partner);
    case Kind::call:
      return call(statement);
    case Kind::endsub:
    case Kind::give_back:
      return give_back(statement);
    case Kind::branch_if:
    case Kind::elseif:
    case Kind::otherwise:
    case Kind::endif:
      return branch(statement);
    case Kind::macro_goto:
    case Kind::macro_if_goto:
    case Kind::macro_if_then:
      return macro(statement);
    case Kind::label_goto:
    case Kind::label_if_goto:
    case Kind::label_case:
    case Kind::counted_for:
    case Kind::endfor:
    case Kind::endless_loop:
    case Kind::endloop:
    case Kind::repeat_until:
    case Kind::until:
    case Kind::repeat_part:
    case Kind::program_call:
      return siemens_flow(statement, number);
    default:
      return loop(statement, number);
  }
}

/// The value at an offset of the statement; nothing: it has none, which ends the run.
std::optional<double> Executor::evaluate(const FlowStatement& statement, std::size_t offset) {
  const std::string_view text = flow_text(statement).substr(offset);
  Evaluated found = values_->value(text);
  if (found.ok() && std::isnan(found.value)) {
    found.problem = "it is vacant: no value was assigned";
    found.at = 0;
  }
  if (found.ok()) return found.value;
  stop("NC254", "the value has no meaning: " + found.problem,
       flow_place(statement, offset + found.at));
  return {};
}

bool Executor::holds(const FlowStatement& statement) {
  return evaluate(statement, statement.text.values.front()).value_or(0.0) != 0.0;
}

const FlowStatement& Executor::partner(std::uint32_t number) {
  return index_of(*unit_).statements[number];
}

/// Goes on with the block of a statement, or behind it.
void Executor::jump(std::uint32_t statement, bool behind) {
  if (statement == FlowStatement::kNone) {
    return stop("NC250", "the line of program flow has no partner to go on with",
                {static_cast<std::uint32_t>(place_.next), 1});
  }
  place_.next = partner(statement).block + (behind ? 1 : 0);
}

void Executor::jump_behind(std::uint32_t statement) { jump(statement, true); }

void Executor::loop(const FlowStatement& statement, std::uint32_t number) {
  switch (statement.text.kind) {
    case Kind::loop_while:
      if (statement.closes_do == holds(statement)) jump_behind(statement.partner);
      return;
    case Kind::macro_while:
      if (!holds(statement)) jump_behind(statement.partner);
      return;
    case Kind::endwhile:
    case Kind::macro_end:
      jump(statement.partner, false);
      return;
    case Kind::repeat:
    case Kind::endrepeat:
      return repeat(statement, number);
    case Kind::leave:
      return jump_behind(statement.end);
    case Kind::next: {
      const bool at_end = partner(statement.partner).text.kind == Kind::loop_do;
      jump(at_end ? statement.end : statement.partner, false);
      return;
    }
    default:  // do: its condition stands at its end
      return;
  }
}

void Executor::repeat(const FlowStatement& statement, std::uint32_t number) {
  std::unordered_map<std::uint32_t, long>& counts = unit_->counts;
  if (statement.text.kind == Kind::endrepeat) {
    if (--counts[statement.partner] > 0) jump_behind(statement.partner);
    return;
  }
  if (counts[number] > 0) {
    return stop("NC250",
                "this repeat loop has not come to its end since it was begun last (break, continue "
                "or return left it, or its subroutine calls itself): LinuxCNC goes on with the old "
                "count; let it end, or write a while loop",
                flow_place(statement, 0));
  }
  const std::optional<double> count = evaluate(statement, statement.text.values.front());
  if (!count) return;
  // More than this is refused by the budget anyway.
  constexpr double kMost = 1e15;
  counts[number] = std::lround(std::clamp(*count, -1.0, kMost));
  if (counts[number] <= 0) jump_behind(statement.partner);
}

/// if: goes to the first branch whose condition holds. elseif and else are come to from the end of
/// the branch before.
void Executor::branch(const FlowStatement& statement) {
  if (statement.text.kind == Kind::endif) return;
  if (statement.text.kind != Kind::branch_if) return jump_behind(statement.end);
  const FlowStatement* now = &statement;
  while (!stopped_) {
    if (!now->fault.empty()) return stop("NC250", now->fault, flow_place(*now, 0));
    const Kind kind = now->text.kind;
    const bool conditional = kind == Kind::branch_if || kind == Kind::elseif;
    if (!conditional || holds(*now)) {
      place_.next = now->block + 1;
      return;
    }
    if (now->partner == FlowStatement::kNone) return jump(now->partner, true);
    now = &partner(now->partner);
  }
}

void Executor::macro(const FlowStatement& statement) {
  if (statement.text.kind == Kind::macro_goto) return go_to(statement);
  if (!holds(statement)) return;
  if (statement.text.kind == Kind::macro_if_goto) return go_to(statement);
  const std::size_t offset = statement.text.consequence;
  const Evaluated found = values_->assign(flow_text(statement).substr(offset));
  if (found.ok()) return values_->finish_block(true);
  stop("NC254", "the assignment cannot be done: " + found.problem,
       flow_place(statement, offset + found.at));
}

void Executor::go_to(const FlowStatement& statement) {
  const std::optional<double> value = evaluate(statement, statement.text.target);
  if (!value) return;
  const std::uint32_t region = index_of(*unit_).region_of(statement.block);
  go_to_number(region, label_number(*value), flow_place(statement, statement.text.target));
}

void Executor::go_to_number(std::uint32_t region, long number, TextPlace place) {
  const std::vector<std::uint32_t> blocks = index_of(*unit_).numbered(region, number);
  const std::string name = "N" + std::to_string(number);
  if (number < 0 || blocks.empty()) {
    return stop("NC250", "there is no block " + name + " in this program to go to", place);
  }
  if (blocks.size() > 1) {
    return stop("NC250",
                "the program has several blocks " + name +
                    ": which one is meant is not "
                    "certain; number them apart",
                place);
  }
  place_.next = blocks.front();
}

}  // namespace smoothpost::nc
