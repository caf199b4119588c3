#include "postproc/pipeline/path_match.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"
#include "postproc/pipeline/process_windows.h"

namespace smoothpost {

namespace {

constexpr double kStep = 0.25;       // of the tolerances, between samples
constexpr double kAllowance = 0.02;  // of the tolerances, for curves between samples
constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kLeastProjection = 0.5;  // of an axis into the plane that lead or tilt is seen in

struct Sample {
  CutterLocation location;
  std::uint32_t line = 0;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  // of whole rotations
  std::optional<CuttingFrame> frame = {};  // of the input, where the beam is freed
  double turn = 0.0;                       // of the frame to the neighbours, rad
  bool rapid = false;  // of the program: a rapid; of the input: a rapid may pass here
  std::uint32_t process = 0;
  std::int32_t window = -1;  // of the input: which processes may be here; −1: its own
};

/// One stretch of the input between replanned segments.
struct WantedSamples {
  std::vector<Sample> samples;
  std::vector<std::vector<bool>> windows;  ///< as ProcessWindows
};

/// Distances in shares of the tolerances.
class Metric {
 public:
  explicit Metric(const PathMatchSettings& s)
      : tip_(s.tip_tolerance),
        axis_(s.axis_tolerance),
        whole_(s.whole_rotation),
        freed_(s.freed ? &*s.freed : nullptr) {}
  /// Of a program's sample and one of the input, or of two neighbours.
  double between(const Sample& a, const Sample& b) const {
    if (b.frame)
      return std::max((a.location.tip - b.location.tip).norm() / tip_, leaning(a.location.axis, b));
    const double turn = whole_ ? a.rotation.angularDistance(b.rotation)
                               : angle_between(a.location.axis, b.location.axis);
    return std::max((a.location.tip - b.location.tip).norm() / tip_, turn / axis_);
  }
  /// At most between(), whatever counts besides the tip.
  double tips(const Sample& a, const Sample& b) const {
    return (a.location.tip - b.location.tip).norm() / tip_;
  }
  const std::optional<Mat3>& whole() const { return whole_; }
  const FreedBeam* freed() const { return freed_; }
  double bend(const SecondDerivativeBound& b) const {
    return std::max(b.tip / tip_, b.axis / axis_);
  }

  /// Steps on a curve of that length (upper bound) and bend so that neighbours are kStep apart at
  /// most and the curve leaves its chords by at most half of kAllowance.
  int steps(double length, double bend) const {
    const double by_length = length / kStep;
    const double by_bend = std::sqrt(bend / (8.0 * 0.5 * kAllowance));
    return static_cast<int>(std::clamp(std::ceil(std::max(by_length, by_bend)), 1.0, 4.0e6));
  }

 private:
  /// Lead, tilt and exit edge of an axis at a place of the input, the largest share of their
  /// tolerances.
  double leaning(const Vec3& axis, const Sample& place) const {
    const CuttingFrame& frame = *place.frame;
    const LeadTilt got = frame.angles(axis);
    // An axis that moves by ε turns its projection by up to ε/cos; kAllowance has the ε.
    const double across = std::hypot(axis.dot(frame.normal), axis.dot(frame.tangent));
    const double along = std::hypot(axis.dot(frame.normal), axis.dot(frame.binormal));
    if (std::min(across, along) < kLeastProjection || axis.dot(frame.normal) <= 0.0) return kNever;
    const double lead = std::abs(got.lead - frame.programmed.lead);
    const double tilt = std::abs(got.tilt - frame.programmed.tilt);
    const double turned = 0.125 * place.turn * place.turn * std::hypot(lead, tilt);
    double share = std::max((lead + turned) / freed_->lead + kAllowance * (1.0 / across - 1.0),
                            (tilt + turned) / freed_->tilt + kAllowance * (1.0 / along - 1.0));
    if (freed_->exit_edge) {
      const double most = std::max(std::abs(got.tilt), std::abs(frame.programmed.tilt));
      const double slope = 1.0 / (std::cos(most) * std::cos(most));  // of the tangent
      share = std::max(
          share, freed_->thickness * slope * (tilt + turned) / *freed_->exit_edge +
                     kAllowance * freed_->thickness * slope * axis_ / along / *freed_->exit_edge);
    }
    return share;
  }

  double tip_;
  double axis_;
  std::optional<Mat3> whole_;
  const FreedBeam* freed_;
};

Sample input_sample(const ReferencePath& input, std::size_t segment, double s,
                    const Metric& metric) {
  Sample sample{input.at(segment, s), input.path().points[segment].line};
  if (metric.whole()) sample.rotation = input.rotation_at(segment, s);
  return sample;
}

/// The frame at a place; nothing when the beam is not freed there.
std::optional<CuttingFrame> frame_at(const Metric& metric, std::size_t segment, double s) {
  if (metric.freed() == nullptr) return {};
  const auto k = static_cast<std::uint32_t>(segment);
  for (const CuttingFrames& frames : metric.freed()->frames)
    if (k >= frames.first() && k <= frames.last()) return frames.at({k, s});
  return {};
}

/// How far the frames turn from one sample to the next, at the samples on both sides.
void add_turns(std::vector<Sample>& samples) {
  for (std::size_t i = 1; i < samples.size(); ++i) {
    if (!samples[i].frame || !samples[i - 1].frame) continue;
    const double turn = angle_between(samples[i - 1].frame->tangent, samples[i].frame->tangent);
    if (turn >= 0.5 * kPi) continue;  // turns back: nothing lies between
    samples[i].turn = std::max(samples[i].turn, turn);
    samples[i - 1].turn = std::max(samples[i - 1].turn, turn);
  }
}

/// The program's moves as samples, one after the other, without keeping them.
class ProgramSamples {
 public:
  ProgramSamples(const ReadBack& program, const ScrewChain& chain, const Metric& metric,
                 const std::vector<std::uint32_t>& process)
      : program_(program), chain_(chain), metric_(metric), process_(process) {}

  /// The first move that can be sampled: every joint known before it.
  std::size_t first_move() const {
    const JointMask all = (1U << chain_.size()) - 1U;
    for (std::size_t i = 0; i < program_.moves.size(); ++i)
      if (program_.moves[i].known == all) return i + 1;
    return program_.moves.size();
  }

  /// The tip and axis at the end of move i, with a tool of that length.
  Sample at_end(std::size_t i, double tool_length) const {
    Sample out = sample(program_.moves[i].to, tool_length, program_.moves[i].line);
    out.process = process_.empty() ? 0 : process_[i];
    return out;
  }

  /// Whether move i has another process than the one before it.
  bool process_changes(std::size_t i) const {
    return !process_.empty() && process_[i] != process_[i - 1];
  }

  /// How many samples move i has after its start.
  int count(std::size_t i, double tool_length) const {
    const JointVector& from = program_.moves[i - 1].to;
    const JointVector& to = program_.moves[i].to;
    auto bound = second_derivative_bound(chain_, from, to);
    if (metric_.whole()) bound.axis = std::max(bound.axis, turning(from, to));
    const double bend = metric_.bend({bound.tip + tool_length * bound.axis, bound.axis});
    // Length ≤ chord + what the bend allows on either side of it.
    const double chord = metric_.between(sample(from, tool_length, 0), sample(to, tool_length, 0));
    return metric_.steps(chord + bend, bend);
  }

  /// Sample k of n of move i.
  Sample of_move(std::size_t i, double tool_length, int k, int n) const {
    const JointVector& from = program_.moves[i - 1].to;
    const JointVector& to = program_.moves[i].to;
    Sample out = sample(from + static_cast<double>(k) / n * (to - from), tool_length,
                        program_.moves[i].line);
    out.rapid = program_.moves[i].rapid;
    out.process = process_.empty() ? 0 : process_[i];
    return out;
  }

 private:
  Sample sample(const JointVector& q, double tool_length, std::uint32_t line) const {
    const Pose holder = forward(chain_, q);
    const Vec3 axis = holder.linear() * chain_.tool_axis;
    Sample out{{holder.translation() - tool_length * axis, axis}, line};
    if (metric_.whole())
      out.rotation = Eigen::Quaterniond(Mat3(holder.linear() * *metric_.whole()));
    return out;
  }

  // (Σ|Δq|)² over the rotaries: the rotation's own curve stays as near its chord as with that bend.
  double turning(const JointVector& from, const JointVector& to) const {
    double sum = 0.0;
    for (std::size_t j = 0; j < chain_.joints.size(); ++j)
      if (chain_.joints[j].kind == JointKind::rotary)
        sum += std::abs(to[static_cast<Eigen::Index>(j)] - from[static_cast<Eigen::Index>(j)]);
    return sum * sum;
  }

  const ReadBack& program_;
  const ScrewChain& chain_;
  const Metric& metric_;
  const std::vector<std::uint32_t>& process_;
};

/// Opens the windows of a stretch; `before` and `behind`: the input's process outside of it.
void open_windows(WantedSamples& wanted, std::uint32_t before, std::uint32_t behind,
                  const PathMatchSettings& settings) {
  std::vector<double> way;
  std::vector<std::uint32_t> process;
  for (std::size_t i = 0; i < wanted.samples.size(); ++i) {
    way.push_back(
        i == 0 ? 0.0
               : way.back() +
                     (wanted.samples[i].location.tip - wanted.samples[i - 1].location.tip).norm());
    process.push_back(wanted.samples[i].process);
  }
  ProcessWindows found = process_windows({way, process, before, behind, settings.process_parts},
                                         settings.event_tolerance);
  for (std::size_t i = 0; i < wanted.samples.size(); ++i) wanted.samples[i].window = found.of[i];
  wanted.windows = std::move(found.windows);
}

/// One stretch of the input between replanned segments, as samples.
WantedSamples input_samples(const ReferencePath& input, std::size_t first, std::size_t last,
                            const Metric& metric, const PathMatchSettings& settings) {
  const auto& points = input.path().points;
  WantedSamples wanted;
  std::vector<Sample>& samples = wanted.samples;
  samples.push_back({points[first].location, points[first].line, points[first].rotation});
  samples.back().frame = frame_at(metric, first + 1, 0.0);
  const auto process = [&settings](std::size_t k) {
    return settings.input_process.empty() ? 0U : settings.input_process[k];
  };
  samples.back().process = process(first + 1);
  for (std::size_t k = first + 1; k <= last; ++k) {
    const double bend = metric.bend(input.second_derivative_bound(k));
    const int n = metric.steps(
        metric.between(input_sample(input, k, 0.0, metric), input_sample(input, k, 1.0, metric)) +
            bend,
        bend);
    for (int i = 1; i <= n; ++i) {
      samples.push_back(input_sample(input, k, static_cast<double>(i) / n, metric));
      samples.back().frame = frame_at(metric, k, static_cast<double>(i) / n);
      samples.back().rapid = points[k].kind == MotionKind::rapid;
      samples.back().process = process(k);
    }
  }
  add_turns(samples);
  samples.front().rapid = samples.back().rapid = true;  // where links begin and end
  if (!settings.input_process.empty())
    open_windows(wanted, process(first), process(last + 1), settings);
  return wanted;
}

/// The dynamic programme for one stretch; rows are program samples, columns input samples.
class Stretch {
 public:
  Stretch(const WantedSamples& wanted, const Metric& metric)
      : input_(wanted.samples), windows_(wanted.windows), metric_(metric) {}

  /// Takes the next program sample; `may_start`: the program has made only rapids since the last
  /// stretch.
  void next(const Sample& sample, bool may_start) {
    std::vector<double> row;
    std::size_t first = 0;
    const std::size_t band_end =
        first_ + row_.size();  // one column further can be reached diagonally
    double left = kNever;
    for (std::size_t j = may_start ? 0 : first_; j < input_.size(); ++j) {
      double best = std::min({value(j), j > 0 ? value(j - 1) : kNever, left});
      if (j == 0 && may_start) best = 0.0;
      double v = kNever;
      if (best < kNever) {
        const double d = agree(sample, input_[j]) ? metric_.between(sample, input_[j]) : kNever;
        if (d <= 1.0 - kAllowance) v = std::max(best, d);
      }
      left = v;
      if (row.empty() && v == kNever) {
        if (j >= band_end) break;
        continue;
      }
      if (row.empty()) first = j;
      if (v == kNever && j > band_end) break;
      row.push_back(v);
    }
    while (!row.empty() && row.back() == kNever) row.pop_back();
    row_ = std::move(row);
    first_ = first;
    if (!row_.empty() && first_ + row_.size() > furthest_) {
      furthest_ = first_ + row_.size();
      furthest_output_ = sample.line;
    }
  }

  bool alive() const { return !row_.empty(); }
  /// The best value of a matching that ends here, or infinity.
  double finished() const {
    return !row_.empty() && first_ + row_.size() == input_.size() ? row_.back() : kNever;
  }
  std::uint32_t input_line() const { return input_[std::min(furthest_, input_.size() - 1)].line; }
  std::uint32_t output_line() const { return furthest_output_; }

 private:
  /// Whether a program sample may stand for an input sample, wherever they are.
  bool agree(const Sample& program, const Sample& input) const {
    if (program.rapid && !input.rapid) return false;
    if (input.window < 0) return program.process == input.process;
    const std::vector<bool>& open = windows_[static_cast<std::size_t>(input.window)];
    return program.process < open.size() && open[program.process];
  }

  double value(std::size_t j) const {
    return j >= first_ && j < first_ + row_.size() ? row_[j - first_] : kNever;
  }

  const std::vector<Sample>& input_;
  const std::vector<std::vector<bool>>& windows_;
  const Metric& metric_;
  std::vector<double> row_;  ///< values of columns first_ ...
  std::size_t first_ = 0;
  std::size_t furthest_ = 0;
  std::uint32_t furthest_output_ = 0;
};

class Matcher {
 public:
  Matcher(const ReadBack& program, const ScrewChain& chain, const ReferencePath& input,
          const PathMatchSettings& settings, const Progress& progress)
      : program_(program),
        input_(input),
        settings_(settings),
        progress_(progress),
        metric_(settings),
        samples_(program, chain, metric_, settings_.program_process) {}

  PathMatch run() {
    move_ = samples_.first_move();
    const auto& points = input_.path().points;
    for (std::size_t i = 0; i < move_; ++i)
      if (!is_free(program_.moves[i]))
        return fail(0, program_.moves[i].line,
                    "a feed move before the program has stated the position of every axis");
    for (std::size_t first = 0; first < points.size();) {
      std::size_t last = first;
      while (last + 1 < points.size() && !points[last + 1].replanned) ++last;
      if (last > first && !match_stretch(first, last)) return out_;
      first = last + 1;
    }
    // Behind the last stretch only rapids are left.
    for (std::size_t i = move_; i < program_.moves.size(); ++i)
      if (!is_free(program_.moves[i]))
        return fail(points.back().line, program_.moves[i].line,
                    "a feed move of the program is not in the input");
    out_.matched = true;
    out_.share += kAllowance;
    return out_;
  }

 private:
  // What a link may be made of.
  bool is_free(const ReadBackMove& move) const {
    return move.rapid || (settings_.beam && !move.beam);
  }

  bool match_stretch(std::size_t first, std::size_t last) {
    const double tool_length = input_.path().points[first].tool_length;
    const WantedSamples wanted = input_samples(input_, first, last, metric_, settings_);
    Stretch stretch(wanted, metric_);
    const Sample& start = wanted.samples.front();
    bool only_rapids = true;
    double best = kNever;
    std::size_t next_move = 0;
    if (move_ > 0 && move_ <= program_.moves.size())
      stretch.next(samples_.at_end(move_ - 1, tool_length), true);
    for (std::size_t i = move_; i < program_.moves.size(); ++i) {
      if (i % 256 == 0 && !progress_("match", static_cast<double>(i) /
                                                  static_cast<double>(program_.moves.size()))) {
        fail(0, 0, "cancelled");
        return false;
      }
      const bool rapid = is_free(program_.moves[i]);
      const int n = samples_.count(i, tool_length);
      // Where it starts, the process has become this move's; a stretch may begin there.
      if (samples_.process_changes(i))
        stretch.next(samples_.of_move(i, tool_length, 0, n), only_rapids);
      if (!rapid) only_rapids = false;
      for (int k = 1; k <= n; ++k) {
        const Sample sample = samples_.of_move(i, tool_length, k, n);
        stretch.next(sample, only_rapids);
        if (!stretch.alive()) {
          if (!only_rapids) break;
          // Only its first place can bring the matching to life: what is too far from it to get
          // there in so many steps is passed over.
          const double far = metric_.tips(sample, start);
          k += static_cast<int>(std::max(0.0, std::min((far - 1.0) / kStep - 1.0, 4.0e6)));
          continue;
        }
        // A rapid may leave the end of the stretch at any place, and lead on to the next one.
        if (rapid && stretch.finished() < kNever) {
          best = stretch.finished();
          next_move = i;
        }
      }
      // A feed has to end where the stretch ends. The latest such place counts: what follows within
      // the tolerance still belongs to it.
      if (stretch.finished() < kNever) {
        best = stretch.finished();
        next_move = i + 1;
      }
      if (!only_rapids && !stretch.alive()) break;
    }
    if (best == kNever) {
      fail(stretch.input_line(), stretch.output_line(),
           "the program leaves the input's path here, a block is missing or doubled or a rapid, or "
           "the process (spindle, coolant, beam, gas, tool) is not as the input has it");
      return false;
    }
    if (best >= out_.share) {
      out_.input_line = stretch.input_line();
      out_.output_line = stretch.output_line();
    }
    out_.share = std::max(out_.share, best);
    move_ = next_move;
    return true;
  }

  PathMatch fail(std::uint32_t input_line, std::uint32_t output_line, std::string reason) {
    out_.matched = false;
    out_.input_line = input_line;
    out_.output_line = output_line;
    out_.reason = std::move(reason);
    return out_;
  }

  const ReadBack& program_;
  const ReferencePath& input_;
  const PathMatchSettings settings_;
  const Progress& progress_;
  Metric metric_;
  ProgramSamples samples_;
  std::size_t move_ = 0;
  PathMatch out_;
};

}  // namespace

PathMatch match_paths(const ReadBack& program, const ScrewChain& chain, const ReferencePath& input,
                      const PathMatchSettings& settings, const Progress& progress) {
  require(settings.tip_tolerance > 0.0 && settings.axis_tolerance > 0.0, "positive tolerances");
  require(!settings.freed || (settings.freed->lead >= settings.axis_tolerance &&
                              settings.freed->tilt >= settings.axis_tolerance),
          "a freed beam's tolerances are at least the axis'");
  require(settings.input_process.empty()
              ? settings.program_process.empty()
              : settings.program_process.size() == program.moves.size() &&
                    settings.input_process.size() == input.path().points.size() + 1,
          "process numbers for every move and point, and for the end");
  return Matcher(program, chain, input, settings, progress).run();
}

}  // namespace smoothpost
