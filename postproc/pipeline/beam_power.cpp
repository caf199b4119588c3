#include "postproc/pipeline/beam_power.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string>
#include <utility>

#include "machines/dialects/decimal.h"

namespace smoothpost {

namespace {

constexpr int kDecimals = 1;  // of a percent
constexpr const char* kPercent = "percent";

class PowerPlanner {
 public:
  PowerPlanner(MachineProgram& program, const ReferencePath& reference,
               const FeedSchedule& schedule, const MachineDefinition& machine)
      : program_(program), reference_(reference), schedule_(schedule), power_(machine.power) {}

  PowerFollowing run() {
    for (std::size_t i = 0; i < program_.moves.size(); ++i) {
      take_actions(i);
      const MachineMove& move = program_.moves[i];
      if (move.role != MoveRole::path || !point_of(move).beam) {
        end_command();
        continue;
      }
      see(i, wanted(i));
    }
    take_actions(program_.moves.size());
    end_command();
    program_.actions = std::move(actions_);
    return out_;
  }

 private:
  struct Range {
    double low = 0.0, high = 0.0;
  };

  // The program's own actions before move i. A label or a power of the input ends a command.
  void take_actions(std::size_t i) {
    for (; next_ < program_.actions.size() && program_.actions[next_].before <= i; ++next_) {
      MachineAction& action = program_.actions[next_];
      const bool label = action.kind == MachineAction::Kind::cut_label;
      const bool power =
          action.kind == MachineAction::Kind::event && action.event.name == event_name::kPower;
      if (label || power) end_command();
      if (power) programmed_ = percent_of(action.event);
      actions_.push_back(std::move(action));
    }
  }

  static double percent_of(const ProcessEvent& event) {
    for (const auto& [name, value] : event.parameters)
      if (name == kPercent) {
        double percent = 0.0;
        std::from_chars(value.data(), value.data() + value.size(), percent);
        return percent;
      }
    return 0.0;
  }

  const PathPoint& point_of(const MachineMove& move) const {
    return reference_.path().points[move.segment];
  }

  Range wanted(std::size_t i) const {
    const MachineMove& move = program_.moves[i];
    double scale = 1.0;
    if (programmed_ > 0.0) {
      const PathPoint& point = point_of(move);
      const double feed =
          point.duration > 0.0 ? reference_.length(move.segment) / point.duration : 0.0;
      scale = programmed_ / std::max(power_.at(feed), 1e-3);
    }
    Range range{INFINITY, 0.0};
    for (const double speed : speeds(i)) {
      const double percent = std::min(scale * power_.at(speed), 100.0);
      range.low = std::min(range.low, percent);
      range.high = std::max(range.high, percent);
    }
    return range;
  }

  // Of the tip, at the start, the middle and the end of a block.
  std::array<double, 3> speeds(std::size_t i) const {
    const MachineMove& move = program_.moves[i];
    if (move.stretch < 0) {
      double way = 0.0;
      for (std::uint32_t k = move.from_segment; k <= move.segment; ++k)
        way += reference_.length(k) * ((k == move.segment ? move.to_share : 1.0) -
                                       (k == move.from_segment ? move.from_share : 0.0));
      const double speed = move.duration > 0.0 ? way / move.duration : 0.0;
      return {speed, speed, speed};
    }
    const ScheduledStretch& stretch = schedule_.stretches[static_cast<std::size_t>(move.stretch)];
    const bool goes_on = i > 0 && program_.moves[i - 1].stretch == move.stretch;
    const double from = goes_on ? program_.moves[i - 1].stretch_time : 0.0;
    const double to = move.stretch_time;
    return {stretch.tip_speed(from), stretch.tip_speed(0.5 * (from + to)), stretch.tip_speed(to)};
  }

  void see(std::size_t i, const Range& range) {
    const Range both{std::max(serves_.low, range.high - power_.error),
                     std::min(serves_.high, range.low + power_.error)};
    if (first_ != kNone && both.low > both.high) end_command();
    if (first_ == kNone) {
      first_ = i;
      at_ = actions_.size();
      want_ = range;
      want_line_ = program_.moves[i].input_line;
      serves_ = {range.high - power_.error, range.low + power_.error};
      return;
    }
    serves_ = both;
    if (range.low < want_.low || range.high > want_.high) want_line_ = program_.moves[i].input_line;
    want_.low = std::min(want_.low, range.low);
    want_.high = std::max(want_.high, range.high);
  }

  void end_command() {
    if (first_ == kNone) return;
    const double least = std::min(power_.min_percent, want_.high);
    const double percent =
        rounded_decimal(std::clamp(0.5 * (want_.low + want_.high), least, 100.0), kDecimals);
    MachineAction action;
    action.before = first_;
    action.input_line = program_.moves[first_].input_line;
    action.event.name = event_name::kPower;
    std::string text;
    append_decimal(text, percent, kDecimals);
    action.event.parameters = {{kPercent, text}};
    place(std::move(action));
    const double error = std::max(want_.high - percent, percent - want_.low);
    if (error > out_.error) {
      out_.error = error;
      out_.input_line = want_line_;
    }
    ++out_.commands;
    first_ = kNone;
  }

  // Instead of a power of the input right before the block, else where the block's actions end.
  void place(MachineAction action) {
    for (std::size_t k = at_; k-- > 0 && actions_[k].before == action.before;)
      if (actions_[k].kind == MachineAction::Kind::event &&
          actions_[k].event.name == event_name::kPower) {
        actions_[k].event = std::move(action.event);
        return;
      }
    actions_.insert(actions_.begin() + static_cast<std::ptrdiff_t>(at_), std::move(action));
  }

  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  MachineProgram& program_;
  const ReferencePath& reference_;
  const FeedSchedule& schedule_;
  const PowerTable& power_;
  std::vector<MachineAction> actions_;
  std::size_t next_ = 0;
  double programmed_ = 0.0;    ///< percent, that the input commanded last
  std::size_t first_ = kNone;  ///< move that the command which is being made stands before
  std::size_t at_ = 0;         ///< its place among actions_
  Range want_, serves_;
  std::uint32_t want_line_ = 0;
  PowerFollowing out_;
};

}  // namespace

PowerFollowing follow_power(MachineProgram& program, const ReferencePath& reference,
                            const FeedSchedule& schedule, const MachineDefinition& machine) {
  return PowerPlanner(program, reference, schedule, machine).run();
}

}  // namespace smoothpost
