#include "postproc/report/program_motion.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "kernels/core/units.h"
#include "postproc/pipeline/tool_motion.h"

namespace smoothpost {

namespace {

constexpr std::size_t kMiddles = 200000;
constexpr double kTurn = radians_from_degrees(2.0);
constexpr int kMostInside = 16;

struct Times {
  double start = 0.0, end = 0.0;  ///< s
};

/// Printed durations, dwells, rapids at the velocity limits.
std::vector<Times> printed_times(const ReadBack& read, const MachineDefinition& machine) {
  std::vector<Times> times;
  times.reserve(read.moves.size());
  double time = 0.0;
  std::size_t event = 0;
  for (std::size_t i = 0; i < read.moves.size(); ++i) {
    for (; event < read.events.size() && read.events[event].before <= i; ++event)
      time += read.events[event].seconds;
    double step = read.moves[i].duration;
    if (read.moves[i].rapid && i > 0)
      for (int j = 0; j < machine.size(); ++j)
        step = std::max(step, std::abs(read.moves[i].to[j] - read.moves[i - 1].to[j]) /
                                  machine.axes[static_cast<std::size_t>(j)].velocity);
    times.push_back({time, time + step});
    time += step;
  }
  return times;
}

class MotionBuilder {
 public:
  MotionBuilder(const PageInput& in, const ReferencePath* reference, const ScrewChain& chain)
      : in_(in), reference_(reference), chain_(chain), read_(in.conversion.read) {
    for (const LineMapEntry& e : in.conversion.line_map) entries_.emplace(e.output_line, &e);
    const auto& timeline = in.conversion.timeline;
    for (const TimelineItem& item : timeline.items)
      if (item.move >= 0 && static_cast<std::size_t>(item.move) < in.conversion.line_map.size())
        planned_.emplace(in.conversion.line_map[static_cast<std::size_t>(item.move)].output_line,
                         Times{item.start, item.start + item.duration});
    length_ = in.tool_length;
  }

  ProgramMotion run() {
    const std::vector<Times> printed = printed_times(read_, *in_.machine);
    const JointMask all = (1U << static_cast<unsigned>(in_.machine->size())) - 1U;
    std::size_t first = 0;
    while (first < read_.moves.size() && read_.moves[first].known != all) ++first;
    if (first == read_.moves.size()) return std::move(out_);
    middles_ = read_.moves.size() <= kMiddles;
    for (std::size_t i = first; i < read_.moves.size();) {
      std::size_t end = i + 1;
      while (end < read_.moves.size() && read_.moves[end].line == read_.moves[i].line) ++end;
      add_line(i, end, {printed[i].start, printed[end - 1].end}, i == first);
      i = end;
    }
    return std::move(out_);
  }

 private:
  const LineMapEntry* entry_of(std::uint32_t line) const {
    const auto found = entries_.find(line);
    return found == entries_.end() ? nullptr : found->second;
  }

  /// The steps `begin` to `end` of one line; `first`: only where the last of them ends is known.
  void add_line(std::size_t begin, std::size_t end, Times times, bool first) {
    const ReadBackMove& move = read_.moves[begin];
    const LineMapEntry* entry = entry_of(move.line);
    if (!planned_.empty()) {
      const auto found = planned_.find(move.line);
      times = found != planned_.end() ? found->second : Times{at_, at_};
    }
    const bool path = entry && entry->role == MoveRole::path && reference_;
    if (path) length_ = reference_->path().points[entry->segment].tool_length;
    ProgramPoint p;
    p.output_line = move.line;
    p.input_line = entry ? entry->input_line : 0;
    p.beam = move.beam;
    p.link = entry ? entry->role == MoveRole::link : move.rapid;
    p.tool_length = length_;
    const JointVector& start = first ? read_.moves[end - 1].to : read_.moves[begin - 1].to;
    if (path)
      out_.blocks.push_back({{entry->from_segment, entry->from_share},
                             {entry->segment, entry->to_share},
                             start,
                             read_.moves[end - 1].to,
                             times.start});
    if (first) {
      p.line_end = true;
      p.time = times.end;
      finish(p, read_.moves[end - 1].to, path ? entry : nullptr, 1.0);
    } else {
      const double whole = duration(begin, end);
      double passed = 0.0;
      for (std::size_t i = begin; i < end; ++i) {
        const double own =
            whole > 0.0 ? read_.moves[i].duration / whole : 1.0 / static_cast<double>(end - begin);
        add_step(i, {passed, passed + own}, times, path ? entry : nullptr, p);
        passed += own;
      }
      out_.points.back().line_end = true;
    }
    at_ = times.end;
  }

  double duration(std::size_t begin, std::size_t end) const {
    double sum = 0.0;
    for (std::size_t i = begin; i < end; ++i) sum += read_.moves[i].duration;
    return sum;
  }

  /// One straight joint step, `share.start` to `share.end` of its line.
  void add_step(std::size_t i, Times share, Times times, const LineMapEntry* entry,
                ProgramPoint p) {
    const JointVector& from = read_.moves[i - 1].to;
    const JointVector& to = read_.moves[i].to;
    double turn = 0.0;
    for (int j = 0; j < chain_.size(); ++j)
      if (chain_.joints[static_cast<std::size_t>(j)].kind == JointKind::rotary)
        turn = std::max(turn, std::abs(to[j] - from[j]));
    const int least = middles_ && entry ? 2 : 1;
    const int parts = std::clamp(static_cast<int>(std::ceil(turn / kTurn)), least, kMostInside);
    for (int k = 1; k <= parts; ++k) {
      const double t = static_cast<double>(k) / parts;
      const double s = share.start + t * (share.end - share.start);
      p.time = times.start + s * (times.end - times.start);
      finish(p, k == parts ? to : JointVector(from + t * (to - from)), entry, std::min(s, 1.0));
    }
  }

  void finish(ProgramPoint p, const JointVector& joints, const LineMapEntry* entry, double t) {
    p.joints = joints;
    const CutterLocation holder = forward_location(chain_, joints);
    p.tip = holder.tip - p.tool_length * holder.axis;
    if (entry) {
      p.place = place_between(*reference_, {entry->from_segment, entry->from_share},
                              {entry->segment, entry->to_share}, t);
      if (p.place.segment > 0) {
        const CutterLocation wanted = reference_->at(p.place.segment, p.place.s);
        p.deviation = p.tip - wanted.tip;
        p.axis_deviation = angle_between(holder.axis, wanted.axis);
        p.input_line = reference_->path().points[p.place.segment].line;
      }
    }
    out_.points.push_back(std::move(p));
  }

  const PageInput& in_;
  const ReferencePath* reference_;
  const ScrewChain& chain_;
  const ReadBack& read_;
  std::unordered_map<std::uint32_t, const LineMapEntry*> entries_;  ///< by output line
  std::unordered_map<std::uint32_t, Times> planned_;                ///< likewise
  bool middles_ = true;
  double length_ = 0.0, at_ = 0.0;
  ProgramMotion out_;
};

}  // namespace

ProgramMotion program_motion(const PageInput& in, const ReferencePath* reference,
                             const ScrewChain& chain) {
  if (!in.machine) return {};
  return MotionBuilder(in, reference, chain).run();
}

}  // namespace smoothpost
