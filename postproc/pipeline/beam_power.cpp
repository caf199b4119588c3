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

/// Parts of the way to one sample.
class PowerSplitter {
 public:
  PowerSplitter(const std::vector<JointSample>& samples, const ReferencePath& reference,
                const FeedSchedule& schedule, const MachineDefinition& machine)
      : samples_(samples),
        reference_(reference),
        schedule_(schedule),
        power_(machine.power),
        least_(machine.cycle.min_block) {
    for (const PathEvent& e : reference.path().events)
      commanded_ =
          commanded_ || (e.kind == PathEvent::Kind::process && e.event.name == event_name::kPower);
  }

  std::vector<JointSample> run() {
    std::vector<JointSample> out;
    out.reserve(samples_.size());
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      out.push_back(samples_[i]);
      if (i == 0 || samples_[i].stretch < 0 || !point_of(i).beam) continue;
      const std::vector<double> cuts = cuts_before(i);
      if (cuts.empty()) continue;
      out.pop_back();
      double before = start_of(i);
      for (const double t : cuts) {
        out.push_back(part(i, t));
        out.back().time = t - before;
        before = t;
      }
      out.push_back(samples_[i]);
      out.back().time = samples_[i].stretch_time - before;
    }
    return out;
  }

 private:
  const PathPoint& point_of(std::size_t i) const {
    return reference_.path().points[samples_[i].segment];
  }
  const ScheduledStretch& stretch_of(std::size_t i) const {
    return schedule_.stretches[static_cast<std::size_t>(samples_[i].stretch)];
  }
  double start_of(std::size_t i) const {
    return samples_[i - 1].stretch == samples_[i].stretch ? samples_[i - 1].stretch_time : 0.0;
  }

  // The input may command any power up to 100 % at its feed: then the table counts that much more.
  double scale(std::size_t i) const {
    if (!commanded_) return 1.0;
    const double way = reference_.length(samples_[i].segment), time = point_of(i).duration;
    return 100.0 / std::max(power_.at(time > 0.0 ? way / time : 0.0), 1.0);
  }

  // Times in the stretch, ascending.
  std::vector<double> cuts_before(std::size_t i) const {
    const double from = start_of(i), to = samples_[i].stretch_time;
    std::vector<double> cuts;
    if (to - from < 2.0 * least_) return cuts;
    const auto steps = static_cast<int>(std::min(1e6, std::ceil(2.0 * (to - from) / least_)));
    const double most = 2.0 * kOfError * power_.error, by = scale(i);
    double begin = from, before = from, last = 0.0, low = INFINITY, high = 0.0;
    for (int k = 0; k <= steps; ++k) {
      const double t = from + (to - from) * k / steps;
      const double percent = by * power_.at(stretch_of(i).tip_speed(t));
      const double lower = std::min(low, percent), upper = std::max(high, percent);
      if (upper - lower > most && before - begin >= least_ && to - before >= least_) {
        cuts.push_back(before);
        begin = before;
        low = std::min(last, percent);
        high = std::max(last, percent);
      } else {
        low = lower;
        high = upper;
      }
      last = percent;
      before = t;
    }
    return cuts;
  }

  // The sample at time t of the stretch, on the way to sample i.
  JointSample part(std::size_t i, double t) const {
    const ScheduledStretch& stretch = stretch_of(i);
    const auto s = [&](double time) { return stretch.profile.at(time / stretch.slowing).s; };
    const double from = s(start_of(i)), to = s(samples_[i].stretch_time);
    const double share = to > from ? std::clamp((s(t) - from) / (to - from), 0.0, 1.0) : 0.0;
    const JointSample& before = samples_[i - 1];
    JointSample out = samples_[i];
    const PathPlace place =
        place_between(reference_, {before.segment, before.s}, {out.segment, out.s}, share);
    out.segment = place.segment;
    out.s = place.s;
    out.q = stretch.joints.joints_at(s(t));
    out.guide = false;
    const double leg_from = before.leg == out.leg ? before.leg_share : 0.0;
    out.leg_share = leg_from + share * (out.leg_share - leg_from);
    out.stretch_time = t;
    return out;
  }

  static constexpr double kOfError = 0.98;

  const std::vector<JointSample>& samples_;
  const ReferencePath& reference_;
  const FeedSchedule& schedule_;
  const PowerTable& power_;
  double least_;
  bool commanded_ = false;
};

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

std::vector<JointSample> split_at_powers(const std::vector<JointSample>& samples,
                                         const ReferencePath& reference,
                                         const FeedSchedule& schedule,
                                         const MachineDefinition& machine) {
  return PowerSplitter(samples, reference, schedule, machine).run();
}

PowerFollowing follow_power(MachineProgram& program, const ReferencePath& reference,
                            const FeedSchedule& schedule, const MachineDefinition& machine) {
  return PowerPlanner(program, reference, schedule, machine).run();
}

}  // namespace smoothpost
