#include "postproc/pipeline/joint_stretch.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"

namespace smoothpost {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPerRadian = 50.0;                               // mm of s
constexpr double kNoWay = 1e-9;                                   // mm
constexpr double kNoExtent = 1e-12;                               // mm, of s
constexpr double kSlowestRotaryFeed = 30.0 * kRadiansPerDegree;   // rad/s, turning without a feed
constexpr double kVelocityJump = 1e-6, kAccelerationJump = 1e-3;  // of the limits
constexpr double kSliver = 0.005;                                 // of both neighbours
constexpr double kFinePart = 1.0 / 12.0;                          // of a piece
constexpr double kJerkError = 1e-4;                               // of a joint's jerk
constexpr double kFastest = 500.0;   // mm/s, of s, where no feed is programmed
constexpr double kSamePlace = 1e-6;  // mm or rad, sample and function

/// A laser's path over s.
class LaserPlanned : public PlannedPath {
 public:
  explicit LaserPlanned(LaserJointPath path) : path_(std::move(path)) {}
  double length() const override { return path_.length; }
  std::vector<double> breaks() const override {
    std::vector<double> all = path_.breaks();
    for (double& b : all) b = path_.length_at(b);
    return all;
  }
  JointVector joints(double s) const override { return path_.joints(parameter(s)); }
  JointJet jet(double s) const override {
    JointJet q = path_.jet(parameter(s));
    double factor = 1.0;
    for (int order = 1; order < 4; ++order) q.col(order) *= factor *= scale();
    return q;
  }
  VectorJet tip_jet(double s) const override {
    VectorJet tip = path_.tip_jet(parameter(s));
    double factor = 1.0;
    for (int order = 1; order < 4; ++order) tip.col(order) *= factor *= scale();
    return tip;
  }

 private:
  double parameter(double s) const {
    return std::clamp(path_.parameter_at(s), path_.first(), path_.last());
  }
  double scale() const { return (path_.last() - path_.first()) / path_.length; }

  LaserJointPath path_;
};

std::vector<PlannedStretch> all_planned(const StretchesInput& input) {
  std::vector<PlannedStretch> all;
  if (input.planned) all = *input.planned;
  for (const LaserPlanPath& from : input.laser) {
    PlannedStretch to{planned_path(from.path), from.first_sample, {}};
    for (const double u : from.u) to.s.push_back(from.path.length_at(u));
    all.push_back(std::move(to));
  }
  std::sort(all.begin(), all.end(), [](const PlannedStretch& a, const PlannedStretch& b) {
    return a.first_sample < b.first_sample;
  });
  return all;
}

/// Builds the stretches of one plan.
class StretchBuilder {
 public:
  explicit StretchBuilder(const StretchesInput& input)
      : in_(input),
        samples_(input.plan.samples),
        path_(input.path.reference().path()),
        planned_(all_planned(input)),
        stops_(path_.points.size(), false) {
    for (const PathEvent& e : path_.events)
      if (is_stop(e)) stops_[e.point] = true;
  }

  std::vector<JointStretch> run() {
    std::size_t end = 0;
    while (end < samples_.size()) {
      const std::size_t begin = end++;
      while (end < samples_.size() && !path_.points[samples_[end].segment].replanned) ++end;
      run_of(begin, end);
    }
    return std::move(out_);
  }

 private:
  bool is_stop(const PathEvent& e) const {
    if (e.kind == PathEvent::Kind::dwell) return e.seconds > 0.0;
    if (e.kind == PathEvent::Kind::comment) return false;
    for (const EventWords& row : in_.machine.process.events)
      if (row.event == e.event.name) return !row.on_the_fly || row.dwell > 0.0;
    return true;
  }

  void run_of(std::size_t begin, std::size_t end) {
    begin_at(begin);
    std::size_t i = begin + 1;
    while (i < end) {
      if (const PlannedStretch* planned = planned_from(i)) {
        finish(i - 1, StopCause::corner);
        add_planned(*planned);
        i = planned->last_sample() + 1;
        begin_at(i - 1);
        continue;
      }
      std::size_t last = i;  // the samples of one leg
      while (last + 1 < end && samples_[last + 1].leg == samples_[i].leg && !planned_from(last + 1))
        ++last;
      add_leg(i, last);
      i = last + 1;
      if (samples_[last].s == 1.0 && stops_[samples_[last].segment] && i < end) {
        finish(last, StopCause::event);
        begin_at(last);
      }
    }
    finish(end - 1, StopCause::path_end);
    if (!out_.empty() && out_.back().last_sample + 1 == end) out_.back().end = StopCause::path_end;
  }

  void begin_at(std::size_t sample) {
    now_ = JointStretch{};
    now_.first_sample = sample;
    now_.sample_s = {0.0};
    now_.breaks = {0.0};
    now_.joints = in_.machine.size();
  }

  void finish(std::size_t last, StopCause cause) {
    if (last == now_.first_sample) return;
    now_.last_sample = last;
    now_.end = cause;
    out_.push_back(std::move(now_));
  }

  // A planned stretch whose second sample is `i`.
  const PlannedStretch* planned_from(std::size_t i) const {
    const auto found = std::lower_bound(
        planned_.begin(), planned_.end(), i,
        [](const PlannedStretch& p, std::size_t at) { return p.first_sample + 1 < at; });
    return found != planned_.end() && found->first_sample + 1 == i ? &*found : nullptr;
  }

  void add_planned(const PlannedStretch& from) {
    begin_at(from.first_sample);
    now_.planned = from.path;
    now_.sample_s.insert(now_.sample_s.end(), from.s.begin() + 1, from.s.end());
    std::size_t sample = from.first_sample + 1;
    const std::vector<double> breaks = from.path->breaks();
    for (std::size_t b = 1; b < breaks.size(); ++b) {
      now_.breaks.push_back(breaks[b]);
      while (sample < from.last_sample() && from.s[sample - from.first_sample] < breaks[b])
        ++sample;
      add_piece_data(sample, in_.path.reference().feed(samples_[sample].segment), 0.0);
    }
    finish(from.last_sample(), StopCause::corner);
  }

  // What holds on a piece that lies on the way to `sample`; rate: s per second of the whole leg.
  void add_piece_data(std::size_t sample, double feed, double rate) {
    const PathPoint& point = path_.points[samples_[sample].segment];
    now_.feed.push_back(feed > 0.0 ? feed : kInfinity);
    now_.rate.push_back(rate > 0.0 ? rate : kInfinity);
    now_.line.push_back(point.line);
    now_.beam.push_back(point.beam);
  }

  // Samples first .. last are one leg; the one before them is its start.
  void add_leg(std::size_t first, std::size_t last) {
    leg_first_ = first;
    leg_last_ = last;
    const std::size_t leg = samples_[first].leg;
    const double extent = extent_of(leg);
    const double start = now_.length();
    if (extent <= kNoExtent || !(start + extent > start)) {
      // Nothing moves: a block that stands still, whatever its time.
      finish(first - 1, StopCause::corner);
      return begin_at(last);
    }
    if (add_whole_leg(leg, extent, start)) return;
    for (std::size_t i = first; i <= last; ++i) add_step(i, leg, extent);
  }

  double rotary_step(std::size_t from, std::size_t to) const {
    double most = 0.0;
    for (int j = 0; j < in_.machine.size(); ++j)
      if (in_.machine.axes[static_cast<std::size_t>(j)].joint.kind == JointKind::rotary)
        most = std::max(most, std::abs(samples_[to].q[j] - samples_[from].q[j]));
    return most;
  }

  double extent_of(std::size_t leg) const {
    const double way = in_.path.length(leg);
    if (way > kNoWay) return way;
    double turn = 0.0;
    for (std::size_t i = leg_first_; i <= leg_last_; ++i) turn += rotary_step(i - 1, i);
    if (turn > 1e-12) return kPerRadian * turn;
    return (samples_[leg_last_].q - samples_[leg_first_ - 1].q).norm();
  }

  // ds/dt of a leg on which the tip does not move.
  double rate_of(std::size_t leg, double extent) const {
    const PathPoint& point = path_.points[samples_[leg_last_].segment];
    if (in_.path.reference().length(samples_[leg_last_].segment) > kNoWay) return 0.0;
    if (point.duration > 0.0) return extent / point.duration;
    double turn = 0.0;
    for (std::size_t i = leg_first_; i <= leg_last_; ++i) turn += rotary_step(i - 1, i);
    (void)leg;
    return point.kind == MotionKind::feed && turn > 0.0 ? extent / (turn / kSlowestRotaryFeed)
                                                        : 0.0;
  }

  // Share of the leg at which sample i stands; that of the one before the leg is 0.
  double share_of(std::size_t i) const { return i < leg_first_ ? 0.0 : samples_[i].leg_share; }

  std::size_t sample_behind(double share) const {
    std::size_t i = leg_first_;
    while (i < leg_last_ && samples_[i].leg_share < share) ++i;
    return i;
  }

  JointVector near(double share) const {
    const std::size_t i = sample_behind(share);
    const double from = share_of(i - 1), to = share_of(i);
    const double t = to > from ? std::clamp((share - from) / (to - from), 0.0, 1.0) : 1.0;
    return samples_[i - 1].q + t * (samples_[i].q - samples_[i - 1].q);
  }

  JointVector near_rate(double share) const {
    const std::size_t i = sample_behind(share);
    const double part = share_of(i) - share_of(i - 1);
    if (!(part > 0.0)) return JointVector::Zero(in_.machine.size());
    return (samples_[i].q - samples_[i - 1].q) / part;
  }

  // Joints and tip at a share of the leg. Out of reach: the straight way, which is found out as no
  // smooth one.
  PathValue at(std::size_t leg, double share) const {
    const int n = in_.machine.size();
    PathValue v(n + 3);
    const JointVector guess = near(share);
    v.head(n) = in_.plan.joints_on_leg(leg, share, guess).value_or(guess);
    v.tail<3>() = in_.path.at(leg, share).tip;
    return v;
  }

  bool by_joints() const {
    for (std::size_t i = leg_first_; i <= leg_last_; ++i)
      if (samples_[i].by_joints) return true;
    return false;
  }

  bool same_place(const PathValue& value, std::size_t sample) const {
    return (value.head(in_.machine.size()) - samples_[sample].q).cwiseAbs().maxCoeff() < kSamePlace;
  }

  // Two windows that end at nearly the same place leave a piece that is too short for an element
  // of the schedule, or for third derivatives of rounded values. Both sides are C³ there.
  static std::vector<double> without_slivers(std::vector<double> breaks) {
    for (std::size_t i = 1; i + 2 < breaks.size();) {
      const double before = breaks[i] - breaks[i - 1], gap = breaks[i + 1] - breaks[i];
      const double after = breaks[i + 2] - breaks[i + 1];
      if (gap < kSliver * std::min(before, after))
        breaks.erase(breaks.begin() + static_cast<std::ptrdiff_t>(i) + 1);
      else
        ++i;
    }
    return breaks;
  }

  // Joints and tip with their derivatives by s, `extent` mm of which are the leg.
  std::optional<ChebyshevJet> jet_at(std::size_t leg, double share, double extent) const {
    const int n = in_.machine.size();
    JointJet guess = JointJet::Zero(n, 4);
    guess.col(0) = near(share);
    guess.col(1) = near_rate(share);
    const auto tool = in_.path.jet(leg, share);
    if (!tool) return {};
    const auto joints = in_.plan.jet_on_leg(leg, share, *tool, guess);
    if (!joints) return {};
    ChebyshevJet jet;
    double scale = 1.0;
    for (std::size_t r = 0; r < 4; ++r, scale /= extent) {
      const auto order = static_cast<Eigen::Index>(r);
      jet[r].resize(n + 3);
      jet[r].head(n) = scale * joints->col(order);
      jet[r].tail<3>() = scale * tool->tip.col(order);
    }
    return jet;
  }

  // What third derivatives may be off: kJerkError of the joint's jerk at the programmed feed.
  PathValue third_tolerance() const {
    const int n = in_.machine.size();
    const PathPoint& point = path_.points[samples_[leg_last_].segment];
    const double way = in_.path.reference().length(samples_[leg_last_].segment);
    const double feed = point.duration > 0.0 && way > kNoWay ? way / point.duration : kFastest;
    PathValue third(n + 3);
    double least = kInfinity;
    for (int j = 0; j < n; ++j) {
      const AxisDefinition& axis = in_.machine.axes[static_cast<std::size_t>(j)];
      third[j] = kJerkError * axis.jerk / (feed * feed * feed);
      if (axis.joint.kind == JointKind::linear) least = std::min(least, third[j]);
    }
    third.tail<3>().setConstant(least < kInfinity ? least : kPerRadian * third.head(n).minCoeff());
    return third;
  }

  // The whole leg by the planner's function; false and nothing added if that is not smooth.
  bool add_whole_leg(std::size_t leg, double extent, double start) {
    if (by_joints() || !in_.plan.joints_on_leg) return false;
    for (std::size_t i = leg_first_; i <= leg_last_; ++i)
      if (!same_place(at(leg, share_of(i)), i)) return false;
    if (!same_place(at(leg, 0.0), leg_first_ - 1)) return false;
    const std::vector<double> breaks = in_.path.breaks(leg);
    const std::vector<double> shares = without_slivers(breaks);
    const std::size_t before = now_.pieces();
    const std::size_t sub_before = now_.path.pieces();
    const auto place = [&](double share) { return start + share * extent; };
    const auto share_at = [&](double s) { return std::clamp((s - start) / extent, 0.0, 1.0); };
    bool exact = in_.plan.jet_on_leg && jet_at(leg, 0.5, extent).has_value();
    for (std::size_t b = 1, part = 1; b < shares.size(); ++b) {
      if (!(place(shares[b]) > place(shares[b - 1]))) continue;
      const std::size_t sub = now_.path.pieces();
      // Slivers belong to a piece of the schedule, but have formulas of their own.
      for (; exact && part < breaks.size() && breaks[part] <= shares[b]; ++part)
        if (place(breaks[part]) > place(breaks[part - 1]))
          exact = now_.path.append_jets([&](double s) { return jet_at(leg, share_at(s), extent); },
                                        place(breaks[part - 1]), place(breaks[part]),
                                        third_tolerance(), {});
      if (!exact) {
        now_.path.shorten(sub);
        if (!now_.path.append([&](double s) { return at(leg, share_at(s)); }, place(shares[b - 1]),
                              place(shares[b]), {})) {
          drop_pieces(before, sub_before);
          return false;
        }
      }
      end_pieces(sub, place(shares[b]), rate_of(leg, extent));
    }
    if (!meets_samples(before)) {
      drop_pieces(before, sub_before);
      return false;
    }
    stop_if_rough(before, leg_first_ - 1);
    const double shift = now_.length() - extent - start;  // of s, when a new stretch began
    for (std::size_t i = leg_first_; i <= leg_last_; ++i)
      now_.sample_s.push_back(start + shift + share_of(i) * extent);
    return true;
  }

  // What was appended from piece `first` on goes from the sample before the leg to its last one.
  // The function may jump beside its ends, where a rotary is free at a pole.
  bool meets_samples(std::size_t first) const {
    if (now_.pieces() == first) return true;
    const std::size_t sub = first == 0 ? 0 : now_.sub_end[first - 1];
    const ChebyshevPath& path = now_.path;
    return same_place(path.value(sub, path.from(sub)), leg_first_ - 1) &&
           same_place(path.value(path.pieces() - 1, now_.length()), leg_last_);
  }

  // Ends a piece at `at`, and further ones where `path` was halved often since its piece `sub`:
  // there derivatives change within a fraction of it, which an element of the schedule would not
  // see.
  void end_pieces(std::size_t sub, double at, double rate) {
    const ChebyshevPath& path = now_.path;
    const double fine = kFinePart * (at - now_.length());
    const auto size = [&](std::size_t i) { return path.to(i) - path.from(i); };
    for (; sub < path.pieces(); ++sub) {
      const bool last = sub + 1 == path.pieces();
      if (!last && std::min(size(sub), size(sub + 1)) >= fine) continue;
      now_.sub_end.push_back(static_cast<std::uint32_t>(sub + 1));
      now_.breaks.push_back(last ? at : path.to(sub));
      add_piece_data(leg_last_, in_.path.feed(samples_[leg_last_].leg), rate);
    }
  }

  void end_piece(double at) {
    now_.sub_end.push_back(static_cast<std::uint32_t>(now_.path.pieces()));
    now_.breaks.push_back(at);
  }

  void drop_pieces(std::size_t pieces, std::size_t sub_pieces) {
    now_.path.shorten(sub_pieces);
    now_.breaks.resize(pieces + 1);
    now_.sub_end.resize(pieces);
    now_.feed.resize(pieces);
    now_.rate.resize(pieces);
    now_.line.resize(pieces);
    now_.beam.resize(pieces);
  }

  // From sample i − 1 straight in the joints to sample i, from stop to stop.
  void add_step(std::size_t i, std::size_t leg, double extent) {
    finish(i - 1, i == leg_first_ ? StopCause::corner : StopCause::no_formula);
    begin_at(i - 1);
    const double share = share_of(i) - share_of(i - 1);
    double way = share * extent;
    if (!(way > 0.0)) way = kPerRadian * rotary_step(i - 1, i);
    if (!(way > 0.0)) way = (samples_[i].q - samples_[i - 1].q).norm();
    const int n = in_.machine.size();
    const Vec3 from_tip = in_.path.at(leg, share_of(i - 1)).tip;
    const Vec3 to_tip = in_.path.at(leg, share_of(i)).tip;
    if (way > 0.0) {
      now_.path.append(
          [&](double s) {
            PathValue v(n + 3);
            v.head(n) = samples_[i - 1].q + s / way * (samples_[i].q - samples_[i - 1].q);
            v.tail<3>() = from_tip + s / way * (to_tip - from_tip);
            return v;
          },
          0.0, way, {});
      end_piece(way);
      add_piece_data(i, in_.path.feed(leg), rate_of(leg, extent));
    }
    now_.sample_s.push_back(way > 0.0 ? way : 0.0);
    finish(i, StopCause::no_formula);
    begin_at(i);
  }

  // The leg from piece `first` on was appended: does the path pass its start without a stop?
  void stop_if_rough(std::size_t first, std::size_t sample) {
    if (first == 0 || !is_rough(first)) return;
    JointStretch leg = now_.cut_off(first, sample);
    finish(sample, StopCause::corner);
    now_ = std::move(leg);
  }

  bool is_rough(std::size_t piece) const {
    const double s = now_.breaks[piece];
    const PathJet before = now_.jet(piece - 1, s);
    const PathJet after = now_.jet(piece, s);
    for (int j = 0; j < in_.machine.size(); ++j) {
      const AxisDefinition& axis = in_.machine.axes[static_cast<std::size_t>(j)];
      const double speed = fastest(piece, before, after);
      if (std::abs(after.first[j] - before.first[j]) * speed > kVelocityJump * axis.velocity)
        return true;
      if (std::abs(after.second[j] - before.second[j]) * speed * speed >
          kAccelerationJump * axis.acceleration)
        return true;
    }
    return false;
  }

  // ds/dt with which the path may pass the start of `piece`.
  double fastest(std::size_t piece, const PathJet& before, const PathJet& after) const {
    double speed = kInfinity;
    for (int j = 0; j < in_.machine.size(); ++j) {
      const double rate = std::max(std::abs(before.first[j]), std::abs(after.first[j]));
      if (rate > 0.0)
        speed = std::min(speed, in_.machine.axes[static_cast<std::size_t>(j)].velocity / rate);
    }
    const double way = std::min(before.tip_first, after.tip_first);
    const double feed = std::min(now_.feed[piece - 1], now_.feed[piece]);
    if (way > 0.0) speed = std::min(speed, feed / way);
    return std::min({speed, now_.rate[piece - 1], now_.rate[piece]});
  }

  const StretchesInput& in_;
  const std::vector<JointSample>& samples_;
  const ToolPath& path_;
  std::vector<PlannedStretch> planned_;  ///< ascending
  std::vector<bool> stops_;              ///< of path points
  std::size_t leg_first_ = 0, leg_last_ = 0;
  JointStretch now_;
  std::vector<JointStretch> out_;
};

// Of the length of the way with derivatives c1, c2, c3.
void set_tip(PathJet& jet, const Vec3& c1, const Vec3& c2, const Vec3& c3) {
  const double way = c1.norm();
  jet.tip_first = way;
  if (way <= 0.0) return;
  const double along = c1.dot(c2) / way;
  jet.tip_second = along;
  jet.tip_third = (c2.squaredNorm() + c1.dot(c3) - along * along) / way;
}

}  // namespace

std::size_t JointStretch::piece_at(double s) const {
  const auto next = std::upper_bound(breaks.begin(), breaks.end(), s);
  const std::ptrdiff_t at = next - breaks.begin() - 1;
  return static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(at, 0, static_cast<std::ptrdiff_t>(pieces()) - 1));
}

JointVector JointStretch::joints_at(double s) const {
  if (planned) return planned->joints(s);
  return path.value(path.piece_at(s), s).head(joints);
}

JointStretch JointStretch::cut_off(std::size_t piece, std::size_t sample) {
  require(!planned && piece > 0 && piece < pieces(), "cut_off: a piece inside");
  const auto at = static_cast<std::ptrdiff_t>(piece);
  const double start = breaks[piece];
  const std::uint32_t sub = sub_end[piece - 1];
  JointStretch rest;
  rest.joints = joints;
  rest.first_sample = sample;
  rest.last_sample = last_sample;
  rest.end = end;
  rest.path = path.tail(sub, start);
  for (std::size_t p = piece; p < breaks.size(); ++p) rest.breaks.push_back(breaks[p] - start);
  for (std::size_t p = piece; p < pieces(); ++p) rest.sub_end.push_back(sub_end[p] - sub);
  rest.sample_s = {0.0};
  const std::size_t kept = sample - first_sample + 1;
  for (std::size_t i = kept; i < sample_s.size(); ++i) rest.sample_s.push_back(sample_s[i] - start);
  const auto move_tail = [at](auto& from, auto& to) {
    to.assign(from.begin() + at, from.end());
    from.resize(static_cast<std::size_t>(at));
  };
  move_tail(feed, rest.feed);
  move_tail(rate, rest.rate);
  move_tail(line, rest.line);
  move_tail(beam, rest.beam);
  path.shorten(sub);
  breaks.resize(piece + 1);
  sub_end.resize(piece);
  sample_s.resize(std::min(sample_s.size(), kept));
  last_sample = sample;
  end = StopCause::corner;
  return rest;
}

PathJet JointStretch::jet(std::size_t piece, double s) const {
  PathJet out;
  if (planned) {
    const JointJet q = planned->jet(s);
    out.first = q.col(1);
    out.second = q.col(2);
    out.third = q.col(3);
    const VectorJet tip = planned->tip_jet(s);
    set_tip(out, tip.col(1), tip.col(2), tip.col(3));
    return out;
  }
  const std::size_t low = piece == 0 ? 0 : sub_end[piece - 1];
  const std::size_t sub = std::clamp<std::size_t>(path.piece_at(s), low, sub_end[piece] - 1);
  const ChebyshevJet jet = path.jet(sub, s);
  out.first = jet[1].head(joints);
  out.second = jet[2].head(joints);
  out.third = jet[3].head(joints);
  set_tip(out, jet[1].tail<3>(), jet[2].tail<3>(), jet[3].tail<3>());
  return out;
}

std::vector<JointStretch> joint_stretches(const StretchesInput& input) {
  return StretchBuilder(input).run();
}

std::shared_ptr<const PlannedPath> planned_path(LaserJointPath path) {
  return std::make_shared<LaserPlanned>(std::move(path));
}

}  // namespace smoothpost
