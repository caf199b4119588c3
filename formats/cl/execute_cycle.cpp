#include <algorithm>

#include "formats/cl/executor.h"

namespace smoothpost::cl {

/// CYCLE/OFF, ON, INIT (CAMWorks: a new one follows) or the values of a cycle.
void Executor::cycle(const Statement& statement) {
  circle_without_end(statement.place);
  if (statement.items.empty()) {
    error("CL131", "the type is expected behind CYCLE/, such as DRILL", statement.place);
    return lose(statement);
  }
  const Item& first = statement.items.front();
  if (statement.items.size() == 1 && first.kind == Item::Kind::word) {
    const bool off = same_word(first.text, "OFF") || same_word(first.text, "NOMORE");
    if (off || same_word(first.text, "INIT")) {
      cycle_.reset();
      cycle_refused_ = false;
      return;
    }
    if (same_word(first.text, "ON")) {
      if (!last_cycle_ && !cycle_refused_) {
        error("CL131", "CYCLE/ON without a cycle before it", first.place);
        return lose(statement);
      }
      cycle_ = last_cycle_;
      before_cycle_ = position_;
      known_before_cycle_ = known_;
      return;
    }
  }
  if (!length_unit(statement.place)) return lose(statement);
  const CycleReading reading = read_cycle(statement.items, unit_.value_or(1.0));
  cycle_ = reading.cycle;
  last_cycle_ = reading.cycle;
  before_cycle_ = position_;
  known_before_cycle_ = known_;
  cycle_refused_ = !reading.cycle;
  if (!reading.cycle)
    error(reading.refused ? "CL130" : "CL131", "CYCLE: " + reading.problem, reading.place);
}

/// The motions of one hole; `mouth` is what GOTO names.
void Executor::hole(const Position& mouth, TextPlace place) {
  if (rapid_) {
    rapid_ = false;
    error("CL131", "RAPID before a hole of a cycle; write CYCLE/OFF before a rapid", place);
    return reach(mouth);
  }
  double retract = cycle_->retract.value_or(cycle_->clearance);
  if (cycle_->retract_to_start) {
    if (!known_before_cycle_) {
      error("CL131", "RTRCTO,AUTO goes back to the position before the cycle, which is not known",
            place);
      return reach(mouth);
    }
    retract = std::max(cycle_->clearance, mouth.axis.dot(before_cycle_.tip - mouth.tip));
  }
  const Cycle cycle = *cycle_;
  for (const CycleStep& step : hole_steps(cycle, retract)) {
    const Position end{mouth.tip + step.height * mouth.axis, mouth.axis};
    line_to(end, step.feed ? MotionKind::feed : MotionKind::rapid, cycle.feed, place);
    if (step.dwell) sink_.dwell(cycle.dwell, place.line);
  }
}

}  // namespace smoothpost::cl
