#include <algorithm>
#include <cmath>

#include "formats/nc/executor.h"
#include "formats/nc/number.h"
#include "formats/nc/plane.h"
#include "kernels/core/units.h"

// Sinumerik: drilling cycles and patterns of holes.
namespace smoothpost::nc {
namespace {

constexpr std::size_t kFreeSteps = 16;  // of a hole; what is more costs of the budget
constexpr unsigned kWarnPeck = 7;       // behind the ones of execute_cycles.cpp

/// The texts between the commas of a call's parentheses, without blanks at their ends.
std::vector<std::string_view> arguments_of(std::string_view statement) {
  const std::size_t open = statement.find('(');
  if (open == std::string_view::npos) return {};
  std::string_view rest = statement.substr(open + 1, statement.rfind(')') - open - 1);
  std::vector<std::string_view> out;
  int depth = 0;
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= rest.size(); ++i) {
    const char c = i < rest.size() ? rest[i] : ',';
    if (c == '(' || c == '[') ++depth;
    if (c == ')' || c == ']') --depth;
    if (i < rest.size() && (c != ',' || depth > 0)) continue;
    std::string_view part = rest.substr(begin, i - begin);
    while (!part.empty() && detail::is_blank(part.front())) part.remove_prefix(1);
    while (!part.empty() && detail::is_blank(part.back())) part.remove_suffix(1);
    out.push_back(part);
    begin = i + 1;
  }
  return out;
}

/// CYCLE83 of MCALL CYCLE83(..).
std::string cycle_name(std::string_view statement) {
  const std::size_t open = std::min(statement.find('('), statement.size());
  std::size_t end = open;
  while (end > 0 && detail::is_blank(statement[end - 1])) --end;
  std::size_t begin = end;
  while (begin > 0 && !detail::is_blank(statement[begin - 1])) --begin;
  return upper_text(statement.substr(begin, end - begin));
}

}  // namespace

/// MCALL CYCLE81(..) from here on at every position, MCALL alone: no more; the call alone: once,
/// where the tool stands. HOLES1 and HOLES2 are such positions.
void Executor::define_drilling(const BlockWords& block, const BlockPlan& plan) {
  const std::string_view text = reader_.raw(block.statement_piece);
  const bool modal = block.says(SiemensWord::modal_call);
  const std::vector<std::string_view> arguments = arguments_of(text);
  const std::string name = cycle_name(text);
  const bool pattern = name.starts_with("HOLES");
  if (!pattern) modal_.drilling.reset();
  if (arguments.empty()) return;
  CycleValues values;
  const auto refuse = [&](const std::string& why) {
    log_.error("NC260", name + ": " + why, reader_.place(block, block.statement_piece));
  };
  for (const std::string_view argument : arguments) {
    values.emplace_back();
    if (argument.empty()) continue;
    const Evaluated found = values_->value(argument);
    if (!found.ok()) return refuse(found.problem);
    if (found.length != argument.size()) return refuse("an argument has text behind its value");
    values.back() = found.value;
  }
  if (pattern) return drill_pattern(block, plan, name, values);
  DrillingCycle cycle = drilling_cycle(name, values, modal_.unit);
  if (!cycle.problem.empty()) return refuse(cycle.problem);
  if (cycle.call.pecks) {
    warn_once(
        kWarnPeck,
        "how far CYCLE83 lifts and where it begins again are taken from its manual, where the "
        "call does not say it: 1 mm, and 0.6 mm to 7 mm above the last depth",
        block, block.statement_piece);
  }
  if (modal) {
    modal_.drilling = std::move(cycle.call);
  } else {
    drill_by_call(block, plan, cycle.call);
  }
}

/// One hole where the tool stands.
void Executor::drill_by_call(const BlockWords& block, const BlockPlan& plan,
                             const DrillingCall& call) {
  const TextPlace place = at(block, GGroup::motion);
  if ((coordinates_.unknown() & 7) != 0) {
    log_.error("NC261", "a drilling cycle where X, Y or Z is not known: move there before", place);
    return;
  }
  if (modal_.tcp || modal_.inverse_time || !(modal_.linear_feed > 0.0)) {
    log_.error("NC261",
               "a drilling cycle needs a feed by the minute (G94 F) and no TRAORI; write them "
               "before",
               place);
    return;
  }
  if (call.spindle != 0 && modal_.spindle != call.spindle) {
    log_.error("NC261",
               "the spindle does not turn as the cycle says (SDAC); write M" +
                   std::to_string(call.spindle) + " before",
               place);
    return;
  }
  if (!spend(call.steps.size() - std::min(call.steps.size(), kFreeSteps), place)) return;
  const std::size_t normal = plane_axes(modal_.plane).third;
  AxisWords program = coordinates_.program_from_world(coordinates_.world());
  program[normal] = call.clearance;
  cycle_move(block, plan, MotionKind::rapid, program);
  const double programmed = modal_.linear_feed;
  for (const DrillStep& step : call.steps) {
    switch (step.kind) {
      case DrillStep::Kind::rapid:
      case DrillStep::Kind::feed:
        program[normal] = step.value;
        modal_.linear_feed =
            step.rate > 0.0 ? step.rate / kSecondsPerMinute : step.factor * programmed;
        cycle_move(block, plan,
                   step.kind == DrillStep::Kind::feed ? MotionKind::feed : MotionKind::rapid,
                   program);
        break;
      case DrillStep::Kind::dwell:
        sink_.dwell(step.value, block.input_line);
        break;
      case DrillStep::Kind::m_word: {
        const int m = static_cast<int>(std::lround(step.value));
        const bool spindle = m_group(m) == 7;
        if (!spindle || modal_.spindle != m) act_on_m(m, block);
        if (spindle) modal_.spindle = m;
        break;
      }
    }
  }
  modal_.linear_feed = programmed;
}

/// Rapids over the holes at the present height, and at each what MCALL says. HOLES1 begins at the
/// end of the row that is nearer.
void Executor::drill_pattern(const BlockWords& block, const BlockPlan& plan, std::string_view name,
                             const CycleValues& values) {
  const TextPlace place = reader_.place(block, block.statement_piece);
  HolePattern pattern = hole_pattern(name, values, modal_.unit);
  if (!pattern.problem.empty()) {
    log_.error("NC260", std::string(name) + ": " + pattern.problem, place);
    return;
  }
  if ((coordinates_.unknown() & 7) != 0 || modal_.tcp) {
    log_.error("NC261",
               std::string(name) +
                   " where X, Y or Z is not known, or under TRAORI: move there, and "
                   "write TRAFOOF, before",
               place);
    return;
  }
  if (!spend(pattern.places.size(), place)) return;
  const PlaneAxes plane = plane_axes(modal_.plane);
  AxisWords program = coordinates_.program_from_world(coordinates_.world());
  const auto distance = [&](const std::pair<double, double>& p) {
    return std::hypot(p.first - program[plane.first], p.second - program[plane.second]);
  };
  auto& places = pattern.places;
  if (name == "HOLES1" && distance(places.back()) < distance(places.front())) {
    std::reverse(places.begin(), places.end());
  }
  for (const auto& [first, second] : places) {
    program = coordinates_.program_from_world(coordinates_.world());
    program[plane.first] = first;
    program[plane.second] = second;
    cycle_move(block, plan, MotionKind::rapid, program);
    if (modal_.drilling) drill_by_call(block, plan, *modal_.drilling);
    if (stopped_) return;
  }
}

}  // namespace smoothpost::nc
