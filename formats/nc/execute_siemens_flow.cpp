#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <tuple>

#include "formats/nc/executor.h"
#include "formats/nc/number_text.h"

// Sinumerik: jumps to labels, loops, repeated parts, calls of subprograms.
namespace smoothpost::nc {

using Kind = FlowKind;

void Executor::siemens_flow(const FlowStatement& statement, std::uint32_t number) {
  const FlowText& text = statement.text;
  switch (text.kind) {
    case Kind::label_goto:
      return go_to_label(text.label, text.direction, statement);
    case Kind::label_if_goto:
      if (holds(statement) && !stopped_) go_to_label(text.label, text.direction, statement);
      return;
    case Kind::label_case:
      return go_by_case(statement);
    case Kind::counted_for:
    case Kind::endfor:
      return count_loop(statement, number);
    case Kind::endloop:
      return jump_behind(statement.partner);
    case Kind::until:
      if (!holds(statement) && !stopped_) jump_behind(statement.partner);
      return;
    case Kind::repeat_part:
      return repeat_part(statement);
    case Kind::program_call:
      return call_siemens(statement);
    default:
      return;  // LOOP, and the begin of REPEAT .. UNTIL
  }
}

/// Of a label or block number in the program that `block` stands in. Cost: a few searches in sorted
/// lists, however often the label stands in the text.
LabelPlaces Executor::places_of(const std::string& label, std::uint32_t block,
                                std::uint32_t around) {
  const FlowIndex& index = index_of(*unit_);
  const FlowIndex::Section& section = index.section_of(block);
  LabelPlaces out;
  // `first` to `last` are rising; `block_of` gives the block of one.
  const auto search = [&](auto first, auto last, const auto& block_of) {
    const auto below = [&](const auto& item, std::uint32_t limit) {
      return block_of(item) < limit;
    };
    first = std::lower_bound(first, last, section.begin, below);
    last = std::lower_bound(first, last, section.end, below);
    const auto behind = std::lower_bound(first, last, around + 1, below);
    out.count = static_cast<std::size_t>(last - first);
    if (behind != first) out.before = block_of(behind[-1]);
    if (behind != last) out.behind = block_of(*behind);
  };
  const auto named = index.labels.find(label);
  if (named != index.labels.end()) {
    search(named->second.begin(), named->second.end(), [](std::uint32_t b) { return b; });
    return out;
  }
  constexpr std::size_t kLongest = 10;
  if (label.size() < 2 || label.size() > kLongest || label[0] != 'N') return out;
  const long number = std::strtol(label.c_str() + 1, nullptr, 10);
  if ("N" + std::to_string(number) != label) return out;
  const auto key = [](const FlowIndex::Numbered& n) { return std::tuple(n.region, n.number); };
  const std::tuple wanted(section.begin, number);
  const auto first = std::lower_bound(
      index.numbers.begin(), index.numbers.end(), wanted,
      [&](const FlowIndex::Numbered& n, const auto& value) { return key(n) < value; });
  const auto last = std::upper_bound(
      first, index.numbers.end(), wanted,
      [&](const auto& value, const FlowIndex::Numbered& n) { return value < key(n); });
  search(first, last, [](const FlowIndex::Numbered& n) { return n.block; });
  return out;
}

/// GOTOF goes to the next block of that label or number, GOTOB to the last one before, GOTO to the
/// next or, when there is none, the last before.
void Executor::go_to_label(const std::string& label, int direction, const FlowStatement& from) {
  const LabelPlaces places = places_of(label, from.block, from.block);
  if (direction >= 0 && places.behind) {
    place_.next = *places.behind;
  } else if (direction <= 0 && places.before) {
    place_.next = *places.before;
  } else {
    return stop("NC250",
                "there is no block " + label +
                    (direction > 0   ? " behind this one to go to"
                     : direction < 0 ? " before this one to go to"
                                     : " to go to"),
                flow_place(from, 0));
  }
  if (place_.next < range_begin_ || place_.next >= range_end_) {
    stop("NC250",
         "the jump leaves the part that REPEAT runs again: where the program would go on is not "
         "stated; end the loop or branch within the part",
         flow_place(from, 0));
  }
}

/// The first constant that equals the value; none: DEFAULT, or the next block.
void Executor::go_by_case(const FlowStatement& statement) {
  const auto value = evaluate(statement, statement.text.values.front());
  if (!value) return;
  for (const CaseJump& jump : statement.text.cases) {
    if (jump.value != FlowText::kNone) {
      const auto constant = evaluate(statement, jump.value);
      if (!constant) return;
      if (*constant != *value) continue;
    }
    return go_to_label(jump.label, jump.direction, statement);
  }
}

/// The value at an offset of the statement when it is a whole number; else told.
std::optional<double> Executor::whole_value(const FlowStatement& statement, std::size_t offset) {
  const auto value = evaluate(statement, offset);
  constexpr double kMost = 1e9;
  if (!value || (*value == std::trunc(*value) && std::abs(*value) <= kMost)) return value;
  stop("NC254", shortest_text(*value) + " is no whole number", flow_place(statement, offset));
  return {};
}

/// FOR counter=first TO last .. ENDFOR: the counter grows by 1 until it is above `last`. What the
/// control does when it is above from the start, when `last` changes within the loop, and what the
/// counter holds behind the loop is not stated: the first two are refused, the counter has no value
/// until it is assigned.
void Executor::count_loop(const FlowStatement& statement, std::uint32_t number) {
  const bool begins = statement.text.kind == Kind::counted_for;
  const std::uint32_t first = begins ? number : statement.partner;
  const FlowStatement& head = partner(first);
  std::unordered_map<std::uint32_t, long>& ends = unit_->counts;
  if (begins) {
    const std::size_t offset = head.text.consequence;
    const Evaluated assigned = values_->assign(flow_text(head).substr(offset));
    if (!assigned.ok()) {
      return stop("NC254", "FOR: " + assigned.problem, flow_place(head, offset + assigned.at));
    }
  } else if (ends.count(first) == 0) {
    return stop("NC250", "ENDFOR of a loop that was not begun: a jump led into it",
                flow_place(statement, 0));
  }
  const Evaluated counter = values_->value(head.text.name);
  if (!counter.ok() || counter.value != std::trunc(counter.value)) {
    return stop("NC254", "FOR: its counter " + head.text.name + " holds no whole number",
                flow_place(statement, 0));
  }
  // The place of a fault in the end value is that of FOR.
  const auto last = whole_value(head, head.text.target);
  if (!last) return;
  if (begins) {
    if (counter.value > *last) {
      return stop("NC250",
                  "FOR begins above its end, " + shortest_text(counter.value) + " above " +
                      shortest_text(*last) +
                      ": what the control does then is not stated; ask "
                      "with IF before",
                  flow_place(statement, 0));
    }
    ends[first] = std::lround(*last);
    return;
  }
  if (ends[first] != std::lround(*last)) {
    return stop("NC250", "the end of the FOR loop changes within the loop; keep it",
                flow_place(statement, 0));
  }
  if (counter.value + 1.0 > *last) {
    ends.erase(first);
    return values_->forget(head.text.name);
  }
  const Evaluated next = values_->assign(head.text.name + "=" + shortest_text(counter.value + 1.0));
  if (!next.ok()) return stop("NC254", "FOR: " + next.problem, flow_place(head, 0));
  jump_behind(first);
}

/// REPEATB label: its block. REPEAT first last: from block to block, both with them. REPEAT label:
/// from its block to the next ENDLABEL before the REPEAT, or up to the REPEAT.
void Executor::repeat_part(const FlowStatement& statement) {
  const FlowText& text = statement.text;
  const TextPlace place = flow_place(statement, 0);
  const auto the_only = [&](const std::string& label) -> std::optional<std::uint32_t> {
    const LabelPlaces places = places_of(label, statement.block, statement.block);
    if (places.count == 1) return places.before ? places.before : places.behind;
    stop("NC250",
         (places.count == 0 ? "there is no block " : "there are several blocks ") + label +
             " in this program to repeat",
         place);
    return {};
  };
  double count = 1.0;
  if (text.target != FlowText::kNone) {
    const auto written = whole_value(statement, text.target);
    if (!written) return;
    count = *written;
    if (count < 0.0) return stop("NC254", "P, the count of repeats, is below 0", place);
  }
  const auto begin = the_only(text.label);
  if (!begin) return;
  CallFrame frame;
  frame.entry = *begin;
  frame.end = *begin + 1;
  if (!text.name.empty()) {
    const auto last = the_only(text.name);
    if (!last) return;
    frame.end = *last + 1;
  } else if (!text.one_block) {
    frame.end = *begin < statement.block ? statement.block : 0;
    const auto last = places_of("ENDLABEL", statement.block, *begin).behind;
    if (last && (frame.end == 0 || *last < frame.end)) frame.end = *last + 1;
  }
  if (frame.end <= frame.entry) {
    return stop("NC250", "the part to repeat has no end behind its begin: ENDLABEL is missing",
                place);
  }
  if (statement.block >= frame.entry && statement.block < frame.end) {
    return stop("NC250", "the part to repeat contains its own REPEAT", place);
  }
  if (count == 0.0) return;
  frame.style = CallFrame::Style::part;
  frame.place = place;
  frame.return_block = place_.next;
  frame.repeats_left = std::lround(count);
  enter(*unit_, std::move(frame));
}

/// L100, NAME(args), CALL "NAME": the program of that name in this text or the main program's, or
/// in a file beside it.
void Executor::call_siemens(const FlowStatement& statement) {
  const FlowText& text = statement.text;
  CallFrame frame;
  frame.style = CallFrame::Style::siemens;
  frame.place = flow_place(statement, 0);
  frame.return_block = place_.next;
  frame.repeats_left = 1;
  frame.scope.kind = CallScope::Kind::subroutine;
  for (std::size_t i = 0; i < text.values.size(); ++i) {
    if (text.values[i] == FlowText::kNone) continue;
    const auto value = evaluate(statement, text.values[i]);
    if (!value) return;
    frame.scope.arguments.emplace_back(static_cast<int>(i), *value);
  }
  if (text.target != FlowText::kNone) {
    const auto count = whole_value(statement, text.target);
    if (!count) return;
    if (*count < 1.0) return stop("NC254", "P, the count of calls, is below 1", frame.place);
    frame.repeats_left = std::lround(*count);
  }
  const TextPlace place = frame.place;
  bool found = false;
  for (ProgramUnit* unit : {unit_, units_.front().get()}) {
    if (!enter_section(*unit, text.name, frame, found) || found) return;
  }
  ProgramUnit* unit = unit_of_file(text.name, place);
  if (stopped_) return;
  if (unit != nullptr) {
    enter_section(*unit, index_of(*unit).sections.front().name, std::move(frame), found);
    return;
  }
  stop("NC251",
       text.name +
           " is no word that is read here, and there is no subprogram of that name in the "
           "text" +
           (settings_.subroutine_folders.empty() ? "" : " or in the program's folder") +
           "; write it behind the program, or its file " + text.name + ".SPF beside it",
       place);
}

/// Enters a program of a text. `found`: it is there. False: something stopped the run.
bool Executor::enter_section(ProgramUnit& unit, const std::string& name, CallFrame frame,
                             bool& found) {
  const FlowIndex& index = index_of(unit);
  const FlowIndex::Section* section = index.section(name);
  if (section == nullptr) return true;
  found = true;
  const auto same = [&](const FlowIndex::Section& s) { return s.name == name; };
  if (std::count_if(index.sections.begin(), index.sections.end(), same) > 1) {
    stop("NC250", "the subprogram " + name + " stands in the text more than once", frame.place);
    return false;
  }
  if (!frame.scope.arguments.empty() && !section->procedure) {
    stop("NC256",
         "the call gives values, but the subprogram " + name +
             " has no PROC that takes "
             "them",
         frame.place);
    return false;
  }
  frame.entry = section->begin;
  frame.end = section->end;
  return enter(unit, std::move(frame));
}

/// The main program stands first.
void Executor::begin_siemens_program() {
  const auto& sections = index_of(*unit_).sections;
  const bool main_behind = sections.front().subprogram &&
                           std::any_of(sections.begin(), sections.end(),
                                       [](const FlowIndex::Section& s) { return !s.subprogram; });
  if (main_behind) {
    return stop("NC250",
                "the text begins with a subprogram, and a main program stands behind it; put the "
                "main program first",
                {1, 1});
  }
  run_within(0, sections.front().end);
}

/// M17, M2, M30 and RET: back to the caller, or the end of the run.
void Executor::end_siemens_program(std::uint32_t line) {
  while (frames_.back().style == CallFrame::Style::part) {
    frames_.back().repeats_left = 1;
    leave_call();
  }
  if (frames_.size() > 1) return leave_call();
  if (!summary_.ended) sink_.program_end(line);
  summary_.ended = true;
}

}  // namespace smoothpost::nc
