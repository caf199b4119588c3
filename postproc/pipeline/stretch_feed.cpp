#include "postproc/pipeline/stretch_feed.h"

#include <algorithm>

#include "postproc/pipeline/conversion_notes.h"
#include "postproc/pipeline/conversion_parts.h"

namespace smoothpost {

namespace {

constexpr int kPlaces = 24;  // of a piece, for a constant feed
constexpr double kSame = 1e-9;
constexpr std::size_t kMostTold = 12;  // lines in a message

const char* word(FeedOverload::Kind kind) {
  switch (kind) {
    case FeedOverload::Kind::velocity:
      return "velocity";
    case FeedOverload::Kind::acceleration:
      return "acceleration";
    default:
      return "jerk";
  }
}

/// A blended corner where a program may stop.
struct SharpCorner {
  std::size_t sample = 0;  ///< of the plan
  double s = 0.0, reach = 0.0;
  bool stop = false;

  bool covers(double from, double to, double same) const {
    return from >= s - reach - same && to <= s + reach + same;
  }
};

/// For each leg of the path how far the blend of the corner at its end reaches on either side in σ,
/// mm; 0 where the corner is not sharp, or not blended.
std::vector<double> reaches_of(const SmoothedPath& path) {
  std::vector<double> reaches(path.legs() + 1, 0.0);
  std::size_t run = 0, index = 0;  // legs that are not the input's own belong to the runs in turn
  for (std::size_t leg = 1; leg <= path.legs() && run < path.runs().size(); ++leg) {
    if (!path.jet(leg, 0.5)) continue;
    const CornerPath& corners = path.runs()[run];
    const Corner& c = corners.corners()[++index];
    if (c.turn >= kSharpCorner)
      reaches[leg] = std::max(c.half_width * c.blend.reach(),
                              c.rotation_half_width * corners.rotation_blend().reach());
    if (index < corners.legs()) continue;
    index = 0;
    ++run;
  }
  return reaches;
}

std::vector<SharpCorner> sharp_corners(const JointStretch& stretch, const StretchesInput& plan,
                                       const std::vector<double>& reaches) {
  std::vector<SharpCorner> corners;
  for (std::size_t i = 1; !stretch.planned && i + 1 < stretch.sample_s.size(); ++i) {
    const JointSample& sample = plan.plan.samples[stretch.first_sample + i];
    if (sample.leg_share < 1.0 || !(reaches[sample.leg] > 0.0)) continue;
    corners.push_back({stretch.first_sample + i, stretch.sample_s[i], reaches[sample.leg], false});
  }
  return corners;
}

/// Marks the corners whose blends the stretch cannot pass; returns what is too fast elsewhere.
std::vector<TooFast> mark_stops(const JointStretch& stretch, const FeedLimits& limits,
                                std::vector<SharpCorner>& corners) {
  std::vector<TooFast> too_fast;
  const double same = kSame * stretch.length();
  for (const FeedOverload& o : overloads(feed_path(stretch, {}), limits, kPlaces)) {
    if (o.kind == FeedOverload::Kind::none || o.factor <= 1.0 + kSame) continue;
    const double from = stretch.breaks[o.piece], to = stretch.breaks[o.piece + 1];
    // Corners are breaks: the next one behind the piece and the last one before it.
    const auto behind = std::lower_bound(corners.begin(), corners.end(), to - same,
                                         [](const SharpCorner& c, double s) { return c.s < s; });
    bool in_blend = false;
    const auto see = [&](SharpCorner& c) {
      if (c.covers(from, to, same)) in_blend = c.stop = true;
    };
    if (behind != corners.begin()) see(*(behind - 1));
    if (behind != corners.end()) see(*behind);
    if (!in_blend) too_fast.push_back({o, stretch.line[o.piece]});
  }
  return too_fast;
}

bool in_cut(const JointStretch& stretch, const Cut& cut, const std::vector<JointSample>& samples) {
  const std::uint32_t segment = samples[stretch.first_sample + 1].segment;
  return !cut.omitted && cut.first <= segment && segment <= cut.last;
}

}  // namespace

FeedPath feed_path(const JointStretch& stretch, const std::vector<RateCap>& caps) {
  FeedPath path;
  std::vector<std::size_t> owner;
  const double least = kSame * stretch.length();
  path.breaks = {stretch.breaks.front()};
  std::size_t cap = 0;
  for (std::size_t p = 0; p < stretch.pieces(); ++p) {
    const double end = stretch.breaks[p + 1];
    double at = stretch.breaks[p];
    while (at < end) {
      while (cap < caps.size() && caps[cap].to <= at + least) ++cap;
      double to = end;
      double rate = stretch.rate[p];
      if (cap < caps.size()) {
        if (caps[cap].from <= at + least) {
          rate = std::min(rate, caps[cap].rate);
          if (caps[cap].to < end - least) to = caps[cap].to;
        } else if (caps[cap].from < end - least) {
          to = caps[cap].from;
        }
      }
      path.breaks.push_back(to);
      path.feed.push_back(stretch.feed[p]);
      path.rate.push_back(rate);
      owner.push_back(p);
      at = to;
    }
  }
  path.jet = [&stretch, owner = std::move(owner)](std::size_t piece, double s) {
    return stretch.jet(owner[piece], s);
  };
  return path;
}

void lower_to_constant(std::vector<JointStretch>& stretches, const std::vector<Cut>& cuts,
                       const std::vector<JointSample>& samples, const FeedLimits& limits) {
  for (const Cut& cut : cuts) {
    double feed = std::numeric_limits<double>::infinity();
    for (const JointStretch& s : stretches)
      if (in_cut(s, cut, samples) && s.length() > 0.0)
        feed = std::min(feed, largest_constant_feed(feed_path(s, {}), limits, kPlaces).feed);
    for (JointStretch& s : stretches)
      if (in_cut(s, cut, samples))
        for (double& f : s.feed) f = std::min(f, feed);
  }
}

std::vector<JointStretch> at_programmed_feed(std::vector<JointStretch> stretches,
                                             const StretchesInput& plan, const FeedLimits& limits,
                                             std::vector<TooFast>& too_fast) {
  std::vector<JointStretch> out;
  const std::vector<double> reaches = reaches_of(plan.path);
  for (JointStretch& stretch : stretches) {
    if (!(stretch.length() > 0.0)) {
      out.push_back(std::move(stretch));
      continue;
    }
    const double same = kSame * stretch.length();
    std::vector<SharpCorner> corners = sharp_corners(stretch, plan, reaches);
    const std::vector<TooFast> found = mark_stops(stretch, limits, corners);
    too_fast.insert(too_fast.end(), found.begin(), found.end());
    double start = 0.0;
    for (const SharpCorner& c : corners) {
      if (!c.stop) continue;
      const auto piece =
          std::lower_bound(stretch.breaks.begin(), stretch.breaks.end(), c.s - start - same);
      JointStretch rest =
          stretch.cut_off(static_cast<std::size_t>(piece - stretch.breaks.begin()), c.sample);
      start = c.s;
      out.push_back(std::move(stretch));
      stretch = std::move(rest);
    }
    out.push_back(std::move(stretch));
  }
  return out;
}

Diagnostic too_fast_problem(const std::vector<TooFast>& too_fast, const MachineDefinition& machine,
                            const std::string& file_name) {
  std::string text;
  std::size_t count = 0;
  std::uint32_t last_line = 0;
  for (const TooFast& t : too_fast) {
    if (t.line == last_line) continue;
    last_line = t.line;
    if (++count > kMostTold) continue;
    text += std::string(count > 1 ? "; " : "") + "line " + std::to_string(t.line) + ": axis " +
            machine.axes[static_cast<std::size_t>(t.load.joint)].name + " needs " +
            four_digits(t.load.factor) + " times its " + word(t.load.kind);
    const double order = t.load.kind == FeedOverload::Kind::jerk           ? 3.0
                         : t.load.kind == FeedOverload::Kind::acceleration ? 2.0
                                                                           : 1.0;
    if (order > 1.0)
      text += " (a feed " + four_digits(std::pow(t.load.factor, 1.0 / order)) + " times lower)";
  }
  if (count > kMostTold) text += "; and " + std::to_string(count - kMostTold) + " more lines";
  return diagnostic("KN152",
                    "the programmed feed cannot be kept (limits times tolerance.limit_share): " +
                        text + ". --schedule jerk (recipe.schedule) slows down where it has to, and only there",
                    file_name, static_cast<int>(too_fast.front().line));
}

}  // namespace smoothpost
