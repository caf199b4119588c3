#include "kernels/schedule/feed_profile.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/schedule/feed_law.h"
#include "kernels/spline/gauss_rule.h"

namespace smoothpost {
namespace {

constexpr int kGauss = 5;
constexpr double kNear = 1e-9;  // of a part: a Newton step after which the next one is none

double cubic_value(const std::array<double, 4>& c, double d) {
  return c[0] + d * (c[1] + d * (c[2] + d * c[3]));
}

/// ∫ b^{−1/2} from d to d + width.
double time_between(const std::array<double, 4>& c, double d, double width) {
  const GaussRule& rule = gauss_rule(kGauss);
  double sum = 0.0;
  for (int g = 0; g < kGauss; ++g)
    sum += rule.weights[g] / std::sqrt(cubic_value(c, d + width * rule.nodes[g]));
  return sum * width;
}

/// Where inside an element a part starts, past its begin.
double part_begin(const LawPart& part, std::size_t index) {
  const std::size_t e = index / LawPart::kParts;
  return (part.begin[e + 1] - part.begin[e]) * static_cast<double>(index % LawPart::kParts) /
         LawPart::kParts;
}

/// The index of the last start ≤ value among starts[0] … starts[n − 2].
std::size_t index_of(const std::vector<double>& starts, double value) {
  const auto next = std::upper_bound(starts.begin() + 1, starts.end() - 1, value);
  return static_cast<std::size_t>(next - starts.begin()) - 1;
}

}  // namespace

LawPart law_part(const FeedStretch& stretch, const FeedGrid& grid,
                 const std::vector<double>& controls, std::size_t elements) {
  LawPart part;
  part.from = stretch.from;
  part.map = stretch.map;
  part.times.reserve(elements * LawPart::kParts + 1);
  double t = 0.0;
  part.times.push_back(t);
  for (std::size_t e = 0; e < elements; ++e) {
    const std::array<double, 4> c = cubic_of(grid, controls, e);
    const double size = grid.elements[e].end - grid.elements[e].begin;
    for (int p = 0; p < LawPart::kParts; ++p) {
      t += time_between(c, size * p / LawPart::kParts, size / LawPart::kParts);
      part.times.push_back(t);
    }
    part.begin.push_back(grid.elements[e].begin);
    part.zone.push_back(grid.elements[e].zone);
    part.cubic.push_back(c);
  }
  part.begin.push_back(grid.elements[elements - 1].end);
  return part;
}

void shift_times(LawPart& part, double t) {
  const double by = t - part.times.front();
  for (double& time : part.times) time += by;
}

FeedProfile::FeedProfile(std::shared_ptr<const FeedLaw> law) : law_(std::move(law)) {
  require(law_ && !law_->parts.empty(), "FeedProfile: a law with parts");
}

double FeedProfile::duration() const { return law_ ? law_->parts.back().end_time() : 0.0; }

FeedState FeedProfile::at(double t) const {
  if (!law_) return {};
  t = std::clamp(t, 0.0, duration());
  const auto next =
      std::upper_bound(law_->parts.begin() + 1, law_->parts.end(), t,
                       [](double time, const LawPart& part) { return time < part.start_time(); });
  const LawPart& part = *(next - 1);
  const std::size_t index = index_of(part.times, t);
  const std::size_t e = index / LawPart::kParts;
  const auto& c = part.cubic[e];
  const double begin = part_begin(part, index);
  const double size = (part.begin[e + 1] - part.begin[e]) / LawPart::kParts;
  const double share = (t - part.times[index]) / (part.times[index + 1] - part.times[index]);
  double d = size * std::clamp(share, 0.0, 1.0);
  for (int step = 0; step < 6; ++step) {
    const double late = time_between(c, begin, d) - (t - part.times[index]);
    const double before = d;
    d = std::clamp(d - late * std::sqrt(cubic_value(c, begin + d)), 0.0, size);
    if (std::abs(d - before) <= kNear * size) break;
  }
  d += begin;
  const auto phi = part.map.at(part.begin[e] + d, part.zone[e]);
  const double b = cubic_value(c, d), root = std::sqrt(b);
  const double b1 = c[1] + d * (2.0 * c[2] + d * 3.0 * c[3]), b2 = 2.0 * c[2] + 6.0 * d * c[3];
  return {part.from + phi[0], phi[1] * root, phi[2] * b + 0.5 * phi[1] * b1,
          root * (phi[3] * b + 1.5 * phi[2] * b1 + 0.5 * phi[1] * b2)};
}

double FeedProfile::time(double s) const {
  if (!law_) return 0.0;
  const auto next =
      std::upper_bound(law_->parts.begin() + 1, law_->parts.end(), s,
                       [](double place, const LawPart& part) { return place < part.from; });
  const LawPart& part = *(next - 1);
  const double w = std::clamp(part.map.inverse(s - part.from), 0.0, part.begin.back());
  const std::size_t e = index_of(part.begin, w);
  const double size = (part.begin[e + 1] - part.begin[e]) / LawPart::kParts;
  const double d = std::clamp(w - part.begin[e], 0.0, part.begin[e + 1] - part.begin[e]);
  const int p = std::min(LawPart::kParts - 1, static_cast<int>(d / size));
  const std::size_t index = e * LawPart::kParts + p;
  const double begin = part_begin(part, index);
  return part.times[index] + time_between(part.cubic[e], begin, d - begin);
}

double FeedLoad::largest() const { return std::max({velocity, acceleration, jerk}); }

}  // namespace smoothpost
