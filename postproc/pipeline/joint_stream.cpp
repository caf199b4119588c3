#include "postproc/pipeline/joint_stream.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string_view>

#include "kernels/core/units.h"
#include "postproc/pipeline/clearance_check.h"
#include "postproc/pipeline/conversion_notes.h"
#include "postproc/pipeline/conversion_parts.h"
#include "postproc/pipeline/worst.h"

namespace smoothpost {

namespace {

constexpr double kSameTime = 1e-9;     // s
constexpr double kTimeDigit = 0.5e-6;  // s, half of the last one printed
constexpr double kSlack = 1e-6;        // relative, of the comparison in doubles
constexpr double kGoodPairing = 0.3;   // of the tolerance: not looked for a better one
constexpr int kPairingSteps = 8, kPairingRounds = 24;
constexpr const char* kWait = "dwell";   // as the readers of dialects name it (ReadBackEvent)
constexpr std::size_t kMoreColumns = 7;  // tip, axis, beam

double display_scale(const AxisDefinition& axis) {
  return axis.joint.kind == JointKind::rotary ? kDegreesPerRadian : 1.0;
}

const char* unit_of(const AxisDefinition& axis) {
  return axis.joint.kind == JointKind::rotary ? "deg" : "mm";
}

double half_digit(const AxisDefinition& axis, double cycle) {
  return 0.5 * std::pow(10.0, -stream_decimals(axis, cycle));
}

std::string header_of(const MachineDefinition& machine) {
  std::string text = "t_s";
  for (const AxisDefinition& axis : machine.axes) text += "," + axis.name + "_" + unit_of(axis);
  return text + ",x_mm,y_mm,z_mm,i,j,k,beam";
}

/// The fields of one line.
std::vector<std::string_view> fields_of(std::string_view line) {
  std::vector<std::string_view> fields;
  while (true) {
    const std::size_t comma = line.find(',');
    fields.push_back(line.substr(0, comma));
    if (comma == std::string_view::npos) return fields;
    line.remove_prefix(comma + 1);
  }
}

bool read_double(std::string_view text, double& value) {
  const char* end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, value);
  return error == std::errc() && at == end && std::isfinite(value);
}

/// The rows of a stream as a program of joint moves, one a cycle, with what each stands for.
struct StreamMotion {
  ReadBack read;
  LineMap map;
  MachineProgram planned;
};

class StreamMotionBuilder {
 public:
  StreamMotionBuilder(const StreamInput& input, const std::vector<StreamRow>& rows)
      : in_(input), rows_(rows), cycle_(input.timeline.cycle) {
    moves_.assign(input.deviation.map.size(), false);
    for (const TimelineItem& item : input.timeline.items)
      if (item.move >= 0) moves_[static_cast<std::size_t>(item.move)] = true;
  }

  StreamMotion run() {
    out_.read.exact_path = true;
    out_.read.line_count = out_.read.last_line = static_cast<std::uint32_t>(rows_.size() + 1);
    push(0, {});
    for (std::size_t k = 1; k < rows_.size(); ++k) {
      set_beam(k);
      step_to(k);
    }
    set_beam(rows_.size());
    pass_to(in_.deviation.map.size());
    return std::move(out_);
  }

 private:
  static std::uint32_t line_of_row(std::size_t k) { return static_cast<std::uint32_t>(k + 2); }

  // In force on the way to row k.
  bool beam_before(std::size_t k) const { return k > 0 && rows_[k - 1].beam; }

  void set_beam(std::size_t k) {
    if (beam_before(k) == beam_) return;
    beam_ = beam_before(k);
    ReadBackEvent event;
    event.before = out_.read.moves.size();
    event.name = beam_ ? event_name::kBeamOn : event_name::kBeamOff;
    event.beam = beam_;
    event.line = line_of_row(k - 1);
    out_.read.events.push_back(std::move(event));
  }

  // What the cycle that ends with row k is part of.
  void step_to(std::size_t k) {
    const double time = static_cast<double>(k) * cycle_;
    at_ = in_.timeline.item_at(time - 2.0 * kSameTime, at_);
    const TimelineItem& item = in_.timeline.items[at_];
    if (item.move < 0) return wait(k);
    pass_to(static_cast<std::size_t>(item.move));
    const LineMapEntry& move = in_.deviation.map[static_cast<std::size_t>(item.move)];
    if (move.role != MoveRole::path) return push(k, {});
    const PathPlace to = nearest(place_on(item, move, time), rows_[k].q);
    LineMapEntry entry;
    entry.role = MoveRole::path;
    entry.segment = to.segment;
    entry.to_share = to.s;
    const PathPlace from = begin_of(move);
    entry.from_segment = from.segment;
    entry.from_share = from.s;
    const bool forward = entry.from_segment < entry.segment ||
                         (entry.from_segment == entry.segment && entry.to_share > entry.from_share);
    if (!forward) return;  // nothing of the path yet: the next row starts from the one before
    last_ = to;
    in_run_ = true;
    push(k, entry);
  }

  // Moves of the program without motion take no cycle: the row where they stand is where they end.
  void pass_to(std::size_t move) {
    for (; passed_ < move; ++passed_) {
      const LineMapEntry& e = in_.deviation.map[passed_];
      if (e.role != MoveRole::path || moves_[passed_]) continue;
      if (!in_run_) continue;
      const bool behind =
          e.segment > last_.segment || (e.segment == last_.segment && e.to_share > last_.s);
      if (!behind) continue;
      last_ = {e.segment, e.to_share};
      out_.map.back().segment = last_.segment;
      out_.map.back().to_share = last_.s;
    }
  }

  // Where the cycle starts on the input: where the last one has ended.
  PathPlace begin_of(const LineMapEntry& move) const {
    if (!in_run_) return {move.from_segment, move.from_share};
    if (last_.s >= 1.0) return {last_.segment + 1, 0.0};
    return last_;
  }

  PathPlace place_on(const TimelineItem& item, const LineMapEntry& move, double time) {
    const PathPlace from{move.from_segment, move.from_share}, to{move.segment, move.to_share};
    const double done = time - item.start;
    if (done >= item.duration - kSameTime) return to;
    double share = done / item.duration;
    if (item.law >= 0) {
      const ScheduledStretch& law = in_.timeline.laws[static_cast<std::size_t>(item.law)];
      const auto s = [&](double t) { return law.profile.at(t / law.slowing).s; };
      if (ends_of_ != at_) {
        ends_of_ = at_;
        ends_ = {s(item.from), s(item.from + item.duration)};
      }
      if (ends_[1] > ends_[0])
        share = std::clamp((s(item.from + done) - ends_[0]) / (ends_[1] - ends_[0]), 0.0, 1.0);
    }
    return place_between(in_.deviation.reference, from, to, share);
  }

  CutterLocation tool_at(const JointVector& q, std::uint32_t segment) const {
    const CutterLocation holder = forward_location(in_.deviation.chain, q);
    const double length = in_.deviation.reference.path().points[segment].tool_length;
    return {holder.tip - length * holder.axis, holder.axis};
  }

  /// How far a tool is from a place of the input, in tolerances.
  double distance(const CutterLocation& tool, const PathPlace& place) const {
    const auto& tolerance = in_.machine.tolerance;
    const CutterLocation wanted = in_.deviation.reference.at(place.segment, place.s);
    const bool free = in_.deviation.orientation && in_.deviation.orientation->free;
    const double tip = (tool.tip - wanted.tip).norm() / tolerance.tip;
    return free ? tip : std::hypot(tip, (tool.axis - wanted.axis).norm() / tolerance.axis);
  }

  // A row belongs to the place of the input that it is nearest to, which is not quite the share of
  // its block that the law has done: blocks go by the length of the input, and one that is divided
  // for the latency of an event by its time. Any pairing in order is a right one.
  PathPlace nearest(const PathPlace& guess, const JointVector& q) const {
    const CutterLocation tool = tool_at(q, guess.segment);
    const double off = distance(tool, guess);
    if (off < kGoodPairing || guess.segment == 0) return guess;
    const double reach =
        2.0 * (tool.tip - in_.deviation.reference.at(guess.segment, guess.s).tip).norm();
    const PathPlace first = moved_back(guess, reach), last = moved_on(guess, reach);
    const auto at = [&](double t) {
      return place_between(in_.deviation.reference, first, last, t);
    };
    const auto cost = [&](double t) { return distance(tool, at(t)); };
    double best = 0.0, least = INFINITY;
    for (int k = 0; k <= kPairingSteps; ++k) {
      const double t = static_cast<double>(k) / kPairingSteps, c = cost(t);
      if (c >= least) continue;
      least = c;
      best = t;
    }
    double low = std::max(0.0, best - 1.0 / kPairingSteps);
    double high = std::min(1.0, best + 1.0 / kPairingSteps);
    for (int k = 0; k < kPairingRounds; ++k) {
      const double third = (high - low) / 3.0;
      if (cost(low + third) < cost(high - third))
        high -= third;
      else
        low += third;
    }
    const double t = 0.5 * (low + high);
    return cost(t) < off ? at(t) : guess;
  }

  // So far before or behind a place on the same run, and not before the last row's.
  PathPlace moved_back(PathPlace place, double way) const {
    const auto& points = in_.deviation.reference.path().points;
    while (true) {
      const bool same = in_run_ && place.segment == last_.segment;
      const double floor = same ? last_.s : 0.0;
      const double length = in_.deviation.reference.length(place.segment);
      const double part = length * (place.s - floor);
      if (part >= way && length > 0.0) return {place.segment, place.s - way / length};
      if (same || place.segment <= 1 || points[place.segment - 1].replanned)
        return {place.segment, floor};
      way -= part;
      place = {place.segment - 1, 1.0};
    }
  }

  PathPlace moved_on(PathPlace place, double way) const {
    const auto& reference = in_.deviation.reference;
    while (true) {
      const double length = reference.length(place.segment);
      const double part = length * (1.0 - place.s);
      if (part >= way && length > 0.0) return {place.segment, place.s + way / length};
      if (place.segment >= reference.segments() ||
          reference.path().points[place.segment + 1].replanned)
        return {place.segment, 1.0};
      way -= part;
      place = {place.segment + 1, 0.0};
    }
  }

  // All joints stand: no motion, but a wait that the beam's rules know.
  void wait(std::size_t k) {
    auto& events = out_.read.events;
    if (events.empty() || events.back().name != kWait ||
        events.back().before != out_.read.moves.size()) {
      ReadBackEvent event;
      event.before = out_.read.moves.size();
      event.name = kWait;
      event.beam = beam_;
      event.line = line_of_row(k);
      events.push_back(std::move(event));
    }
    events.back().seconds += cycle_;
    // Rows that move all the same are motion that the plan does not have.
    if (k > 0 && rows_[k].q != rows_[k - 1].q) push(k, {});
  }

  void push(std::size_t k, LineMapEntry entry) {
    if (entry.role == MoveRole::link) in_run_ = false;
    entry.output_line = line_of_row(k);
    entry.input_line = in_.timeline.items[at_].line;
    ReadBackMove move;
    move.to = rows_[k].q;
    move.known = (1U << in_.machine.size()) - 1U;
    move.beam = beam_;
    move.duration = k > 0 ? cycle_ : 0.0;
    move.line = entry.output_line;
    MachineMove planned;
    planned.to = move.to;
    planned.input_line = entry.input_line;
    out_.read.moves.push_back(std::move(move));
    out_.planned.moves.push_back(std::move(planned));
    out_.map.push_back(entry);
  }

  const StreamInput& in_;
  const std::vector<StreamRow>& rows_;
  double cycle_;
  std::vector<bool> moves_;  ///< of the program that take time
  std::size_t passed_ = 0;   ///< moves of the program looked at by pass_to()
  std::size_t at_ = 0;
  std::size_t ends_of_ = static_cast<std::size_t>(-1);
  std::array<double, 2> ends_{};  ///< s of the law at both ends of that item
  PathPlace last_;
  bool in_run_ = false, beam_ = false;
  StreamMotion out_;
};

/// The checks of one axis that need its rows alone, and its peaks.
class AxisRows {
 public:
  AxisRows(const StreamInput& input, const std::vector<StreamRow>& rows, int joint)
      : rows_(rows),
        joint_(joint),
        axis_(input.machine.axes[static_cast<std::size_t>(joint)]),
        cycle_(input.timeline.cycle),
        scale_(display_scale(axis_)) {}

  void run(const std::vector<std::uint32_t>& lines) {
    // Rest in front of the first row and behind the last.
    for (std::size_t k = 1; k < rows_.size() + 3; ++k) {
      const double q0 = at(k), q1 = at(k, 1), q2 = at(k, 2), q3 = at(k, 3);
      const std::size_t row = std::min(k, rows_.size() - 1);
      const double time = static_cast<double>(row) * cycle_;
      const auto line = static_cast<std::uint32_t>(row + 2);
      const double h = cycle_;
      velocity_.see(scale_ * std::abs(q0 - q1) / h, line, time, lines[row]);
      acceleration_.see(scale_ * std::abs(q0 - 2.0 * q1 + q2) / (h * h), line, time, lines[row]);
      jerk_.see(scale_ * std::abs(q0 - 3.0 * (q1 - q2) - q3) / (h * h * h), line, time, lines[row]);
    }
  }

  void see_planned(std::size_t row, double planned, std::uint32_t input_line) {
    planned_.see(scale_ * std::abs(rows_[row].q[joint_] - planned),
                 static_cast<std::uint32_t>(row + 2), static_cast<double>(row) * cycle_,
                 input_line);
  }

  void add_to(Checks& checks) const {
    const double digit = half_digit(axis_, cycle_), h = cycle_;
    const std::string unit = unit_of(axis_);
    checks.push_back(planned_.check("round_trip." + axis_.name, digit * (1.0 + 1e-4), unit));
    const auto limit = [&](const char* name, const Worst& worst, double most, double rounding,
                           const char* per) {
      Check c = worst.check(std::string(name) + axis_.name,
                            (scale_ * most + rounding) * (1.0 + 1e-12), unit + per);
      c.note = "limit of the machine file " + four_digits(scale_ * most) + ", and " +
               four_digits(rounding) + " that half a digit of every row may be";
      checks.push_back(std::move(c));
    };
    limit("velocity_limit.", velocity_, axis_.velocity, 2.0 * digit / h, "/s");
    limit("acceleration_limit.", acceleration_, axis_.acceleration, 4.0 * digit / (h * h), "/s2");
    limit("jerk_limit.", jerk_, axis_.jerk, 8.0 * digit / (h * h * h), "/s3");
  }

  StreamAxis summary() const {
    const double digit = half_digit(axis_, cycle_);
    return {axis_.name,        unit_of(axis_),
            velocity_.value(), acceleration_.value(),
            jerk_.value(),     8.0 * digit / std::pow(cycle_, 3)};
  }

 private:
  double at(std::size_t k, std::size_t back = 0) const {
    const std::size_t row = k > back ? k - back : 0;
    return rows_[std::min(row, rows_.size() - 1)].q[joint_];
  }

  const std::vector<StreamRow>& rows_;
  int joint_;
  const AxisDefinition& axis_;
  double cycle_, scale_;
  Worst velocity_, acceleration_, jerk_, planned_;
};

/// Rows and their times: as many as the timeline has cycles, row k at k cycles.
void check_rows(const StreamInput& in, const std::vector<StreamRow>& rows, Checks& checks) {
  const double wanted = std::round(in.timeline.duration() / in.timeline.cycle) + 1.0;
  Check count;
  count.name = "stream_rows";
  count.unit = "rows too many or missing";
  count.value = std::abs(wanted - static_cast<double>(rows.size()));
  count.ok = count.value == 0.0;
  checks.push_back(count);
  Worst off;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const double time = static_cast<double>(k) * in.timeline.cycle;
    off.see(std::abs(rows[k].time - time), static_cast<std::uint32_t>(k + 2), time);
  }
  checks.push_back(off.check("stream_cycle", kTimeDigit * (1.0 + kSlack) + 1e-12, "s"));
}

/// The axes' own checks, and each row against the planned motion.
void check_axes(const StreamInput& in, const std::vector<StreamRow>& rows, JointStream& out) {
  std::vector<AxisRows> axes;
  for (int j = 0; j < in.machine.size(); ++j) axes.emplace_back(in, rows, j);
  std::vector<std::uint32_t> lines(rows.size(), 0);
  std::size_t at = 0;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const double time = static_cast<double>(k) * in.timeline.cycle;
    at = in.timeline.item_at(time, at);
    const TimelineItem& item = in.timeline.items[at];
    lines[k] = item.line;
    const JointVector planned = in.timeline.at(item, time).position;
    for (int j = 0; j < in.machine.size(); ++j)
      axes[static_cast<std::size_t>(j)].see_planned(k, planned[j], lines[k]);
  }
  for (AxisRows& axis : axes) {
    axis.run(lines);
    axis.add_to(out.checks);
    out.axes.push_back(axis.summary());
  }
}

bool starts_with(const std::string& text, std::string_view start) {
  return text.compare(0, start.size(), start) == 0;
}

/// Deviation, ranges, beam and clearance of the motion from row to row.
void check_motion_of(const StreamInput& in, const std::vector<StreamRow>& rows,
                     const Progress& progress, JointStream& out) {
  const StreamMotion motion = StreamMotionBuilder(in, rows).run();
  const Verification machine = verify_machine(motion.read, in.machine);
  for (const Check& c : machine.checks)
    if (starts_with(c.name, "position_limit.") || starts_with(c.name, "beam_"))
      out.checks.push_back(c);
  const DeviationInput with{in.deviation.reference,
                            motion.map,
                            motion.planned,
                            in.deviation.chain,
                            ToolTurn::none,
                            {},
                            {},
                            in.deviation.whole_rotation,
                            in.deviation.orientation};
  for (const Check& c : verify_deviation(motion.read, in.machine, with, progress))
    if (!starts_with(c.name, "round_trip.")) out.checks.push_back(c);
  if (in.scene == nullptr) {
    out.not_checked.push_back("clearance");
    return;
  }
  const ClearanceReport report = check_clearance(*in.scene, motion.read, in.machine, progress);
  out.checks.push_back(clearance_check(report, *in.scene, motion.read));
}

}  // namespace

bool JointStream::ok() const {
  return std::all_of(checks.begin(), checks.end(), [](const Check& c) { return c.ok; });
}

Result<std::vector<StreamRow>> read_joint_stream(const std::string& text,
                                                 const MachineDefinition& machine,
                                                 const std::string& file_name) {
  using Out = Result<std::vector<StreamRow>>;
  std::vector<StreamRow> rows;
  const auto axes = static_cast<std::size_t>(machine.size());
  std::string_view rest = text;
  int line = 0;
  const auto fail = [&](std::string why) {
    return Out::failure(diagnostic("IN111", std::move(why), file_name, line));
  };
  while (!rest.empty()) {
    ++line;
    const std::size_t end = rest.find('\n');
    if (end == std::string_view::npos) return fail("the last row is cut off");
    const std::string_view row = rest.substr(0, end);
    rest.remove_prefix(end + 1);
    if (line == 1) {
      if (row != header_of(machine)) return fail("the header is not " + header_of(machine));
      continue;
    }
    const std::vector<std::string_view> fields = fields_of(row);
    if (fields.size() != 1 + axes + kMoreColumns)
      return fail("a row with " + std::to_string(fields.size()) + " values, expected are " +
                  std::to_string(1 + axes + kMoreColumns));
    std::vector<double> values(fields.size());
    for (std::size_t i = 0; i < fields.size(); ++i)
      if (!read_double(fields[i], values[i]))
        return fail("\"" + std::string(fields[i]) + "\" is no number");
    StreamRow r;
    r.time = values[0];
    r.q.resize(machine.size());
    for (std::size_t j = 0; j < axes; ++j)
      r.q[static_cast<Eigen::Index>(j)] = values[j + 1] / display_scale(machine.axes[j]);
    if (fields.back() != "0" && fields.back() != "1") return fail("the beam is neither 0 nor 1");
    r.beam = fields.back() == "1";
    rows.push_back(std::move(r));
  }
  if (rows.empty()) return fail("there is no row");
  return Out(std::move(rows));
}

Result<JointStream> check_stream(std::string text, const StreamInput& in,
                                 const Progress& progress) {
  auto read = read_joint_stream(text, in.machine, "trajectory");
  if (!read.ok()) return Result<JointStream>::failure(read.diagnostics());
  const std::vector<StreamRow>& rows = read.value();
  JointStream out;
  out.text = std::move(text);
  out.rows = rows.size();
  out.cycle = in.timeline.cycle;
  out.duration = in.timeline.duration();
  out.assumes = {
      "the control takes one row each cycle of " + number(1e3 * out.cycle) +
          " ms as the position of its joints, unchanged, none left out; velocity, acceleration and "
          "jerk are differences of the rows at that cycle, and what the drives make of them "
          "inside a cycle is their own",
      "the machine stands at the first row when the stream starts and stays at the last",
      "column beam is switched by the control with its row; a latency of the source is as the "
      "machine file says"};
  out.not_checked = {"process events other than the beam: the stream does not carry them"};
  check_rows(in, rows, out.checks);
  check_axes(in, rows, out);
  check_motion_of(in, rows, progress, out);
  return Result<JointStream>(std::move(out));
}

Result<JointStream> certified_stream(const StreamInput& in, const Progress& progress) {
  const double rows = in.timeline.duration() / in.timeline.cycle;
  if (in.timeline.items.empty())
    return Result<JointStream>::failure(
        diagnostic("KN162", "there is no motion to write as a joint stream"));
  if (rows > static_cast<double>(kMostStreamRows))
    return Result<JointStream>::failure(diagnostic(
        "KN162",
        "a joint stream of " + number(in.timeline.duration()) + " s has more than " +
            std::to_string(kMostStreamRows) +
            " rows, which is the most that is certified: write one for each part of the program "
            "(--cuts), or set a longer cycle.time_ms"));
  return check_stream(trajectory_csv(in.timeline, in.machine, in.deviation.chain, in.tool_length),
                      in, progress);
}

}  // namespace smoothpost
