#include "postproc/pipeline/laser_stations.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/units.h"

namespace smoothpost {

namespace {

constexpr double kStands = 1e-6;  // mm: a tip that moves less stands
constexpr double kCorner = 20.0 * kRadiansPerDegree;
constexpr double kFeedChange = 0.05;

double feed_of(const ReferencePath& reference, std::uint32_t k) {
  const double duration = reference.path().points[k].duration;
  return duration > 0.0 ? reference.length(k) / duration : 0.0;
}

Vec3 direction(const ReferencePath& reference, std::uint32_t k, double from, double to) {
  return (reference.at(k, to).tip - reference.at(k, from).tip).normalized();
}

bool turns_corner(const ReferencePath& reference, std::uint32_t k) {
  return angle_between(direction(reference, k, 0.99, 1.0), direction(reference, k + 1, 0.0, 0.01)) >
         kCorner;
}

/// The machine stands at the end of segment k.
std::vector<bool> stops(const ReferencePath& reference, const Cut& cut,
                        const ProcessTable& process) {
  std::vector<bool> stop(cut.last + 2, false);
  for (const PathEvent& e : reference.path().events) {
    if (e.point < cut.first || e.point >= cut.last) continue;
    bool stands = e.kind == PathEvent::Kind::dwell;
    if (e.kind == PathEvent::Kind::process) {
      const auto row = std::find_if(process.events.begin(), process.events.end(),
                                    [&e](const EventWords& w) { return w.event == e.event.name; });
      stands = row == process.events.end() || !row->on_the_fly;
    }
    if (stands) stop[e.point] = true;
  }
  return stop;
}

}  // namespace

std::vector<StretchRange> stretches_of(const ReferencePath& reference, const Cut& cut,
                                       const ProcessTable& process) {
  const std::vector<bool> stop = stops(reference, cut, process);
  std::vector<StretchRange> list;
  bool open = false;
  for (std::uint32_t k = cut.first; k <= cut.last; ++k) {
    if (reference.length(k) <= kStands) {
      open = false;
      continue;
    }
    const double feed = feed_of(reference, k);
    if (open) {
      const double before = feed_of(reference, k - 1);
      open = !stop[k - 1] && std::abs(feed - before) <= kFeedChange * std::max(feed, before) &&
             !turns_corner(reference, k - 1);
    }
    if (!open) list.push_back({k, k, k == cut.first, false});
    list.back().last = k;
    list.back().ends_cut = k == cut.last;
    open = true;
  }
  return list;
}

StretchPath::StretchPath(const ReferencePath& reference, const StretchRange& range)
    : reference_(reference), range_(range), starts_{0.0}, feed_(INFINITY) {
  for (std::uint32_t k = range.first; k <= range.last; ++k) {
    starts_.push_back(starts_.back() + reference.length(k));
    const double feed = feed_of(reference, k);
    if (feed > 0.0) feed_ = std::min(feed_, feed);
  }
  std::vector<double> lengths;
  for (std::size_t i = 1; i < starts_.size(); ++i) lengths.push_back(starts_[i] - starts_[i - 1]);
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  spacing_ = std::clamp(*middle, 0.25, 1.0);
}

PathPlace StretchPath::place(double s) const {
  const auto above = std::lower_bound(starts_.begin() + 1, starts_.end() - 1, s - 1e-9);
  const std::size_t i = static_cast<std::size_t>(above - starts_.begin()) - 1;
  const double share = (s - starts_[i]) / (starts_[i + 1] - starts_[i]);
  const double end = 1.0 - 1e-9;
  return {range_.first + static_cast<std::uint32_t>(i), share >= end ? 1.0 : std::max(0.0, share)};
}

std::uint32_t StretchPath::line(double s) const {
  return reference_.path().points[place(s).segment].line;
}

}  // namespace smoothpost
