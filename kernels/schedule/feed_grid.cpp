#include "kernels/schedule/feed_grid.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"

namespace smoothpost {
namespace {

constexpr double kSlowTip = 0.005;     // mm per unit of s: half of what counts as a moving tip
constexpr double kStandingTip = 1e-9;  // mm per unit of s
constexpr double kShortest = 1e-4;     // of the size aimed at; closer breaks share an element

double reciprocal(double limit) { return limit > 0.0 ? 1.0 / limit : 0.0; }

/// An end of elements: the place, and the pieces that end and start there.
struct Cut {
  double w = 0.0;
  std::size_t before = 0, after = 0;
};

/// The ends that elements must have, ascending: start, breaks and kinks, end. Cuts closer than
/// `shortest` are one, at the place of the kink or end among them.
std::vector<Cut> necessary_cuts(const FeedStretch& stretch, double shortest) {
  const std::vector<double>& breaks = stretch.path->breaks;
  const auto next = std::upper_bound(breaks.begin(), breaks.end() - 1, stretch.from);
  std::size_t piece = static_cast<std::size_t>(next - breaks.begin()) - 1;
  std::vector<double> kinks = stretch.map.kinks();
  kinks.push_back(stretch.map.extent());
  std::vector<Cut> cuts{{0.0, piece, piece}};
  for (double kink : kinks) {
    for (; piece + 2 < breaks.size() && breaks[piece + 1] < stretch.to; ++piece) {
      const double w = stretch.map.inverse(breaks[piece + 1] - stretch.from);
      if (w > kink) break;
      if (w - cuts.back().w >= shortest) cuts.push_back({w, piece, piece});
      cuts.back().after = piece + 1;
    }
    Cut last{kink, piece, piece};
    while (cuts.size() > 1 && kink - cuts.back().w < shortest) {
      last.before = cuts.back().before;
      cuts.pop_back();
    }
    cuts.push_back(last);
  }
  return cuts;
}

/// The first place past `from` where the measure is `value`.
double place_of(const GridMeasure& measure, double value) {
  const auto at = std::lower_bound(measure.value.begin() + 1, measure.value.end() - 1, value);
  const std::size_t i = static_cast<std::size_t>(at - measure.value.begin());
  const double rise = measure.value[i] - measure.value[i - 1];
  const double share = rise > 0.0 ? (value - measure.value[i - 1]) / rise : 0.0;
  return measure.w[i - 1] + share * (measure.w[i] - measure.w[i - 1]);
}

}  // namespace

FeedLanes FeedLanes::from(const FeedLimits& limits) {
  FeedLanes lanes;
  lanes.joints = static_cast<int>(limits.velocity.size());
  require(lanes.joints <= kMaxJoints && limits.acceleration.size() == lanes.joints &&
              limits.jerk.size() == lanes.joints,
          "FeedLimits: one of each kind for every joint, at most 12 joints");
  lanes.width = lanes.joints < 8 ? 8 : 16;
  for (int k = 0; k < lanes.joints; ++k) {
    lanes.velocity[k] = reciprocal(limits.velocity[k]);
    lanes.acceleration[k] = reciprocal(limits.acceleration[k]);
    lanes.jerk[k] = reciprocal(limits.jerk[k]);
  }
  lanes.acceleration[lanes.tip()] = reciprocal(limits.tip_acceleration);
  lanes.jerk[lanes.tip()] = reciprocal(limits.tip_jerk);
  lanes.turn_rate = reciprocal(limits.turn_rate);
  return lanes;
}

std::array<double, 3> limited_length(const PathJet& jet) {
  const double first = std::abs(jet.tip_first);
  if (first <= kStandingTip) return {0.75 * kSlowTip, 0.0, 0.0};
  const double t = first / kSlowTip;
  if (t >= 2.0) return {first, jet.tip_second, jet.tip_third};
  const double f = 0.75 + t * t * (0.375 - t * t / 64.0), f1 = t * (0.75 - t * t / 16.0),
               f2 = 0.75 - 0.1875 * t * t;
  return {kSlowTip * f, f1 * jet.tip_second,
          f1 * jet.tip_third + f2 * jet.tip_second * jet.tip_second / kSlowTip};
}

FeedRow feed_row(const FeedStretch& stretch, const FeedElement& element, double w) {
  const FeedPath& path = *stretch.path;
  const auto phi = stretch.map.at(w, element.zone);
  const std::size_t piece = element.piece;
  const double s = std::clamp(stretch.from + phi[0], path.breaks[piece], path.breaks[piece + 1]);
  const PathJet jet = path.jet(piece, s);
  const int width = stretch.lanes.width;
  FeedRow row;
  const auto put = [&](int lane, double first, double second, double third) {
    row.q[lane] = first * phi[1];
    row.q[width + lane] = second * phi[1] * phi[1] + first * phi[2];
    row.q[2 * width + lane] =
        third * phi[1] * phi[1] * phi[1] + 3.0 * second * phi[1] * phi[2] + first * phi[3];
  };
  for (int k = 0; k < stretch.lanes.joints; ++k) put(k, jet.first[k], jet.second[k], jet.third[k]);
  const auto length = limited_length(jet);
  put(stretch.lanes.tip(), length[0], length[1], length[2]);
  row.tip = jet.tip_first * phi[1];
  row.turn = jet.turn_first * phi[1];
  row.feed = path.feed[piece];
  row.pace = path.rate.empty() ? 0.0 : phi[1] / path.rate[piece];
  return row;
}

double feed_cap(const FeedLanes& lanes, const FeedRow& row) {
  double rate = std::max(std::abs(row.tip) / row.feed, std::abs(row.turn) * lanes.turn_rate);
  rate = std::max(rate, std::abs(row.pace));
  for (int k = 0; k < lanes.joints; ++k)
    rate = std::max(rate, std::abs(row.q[k]) * lanes.velocity[k]);
  return std::min(kNoCap, 1.0 / (rate * rate));
}

std::array<double, 2> probe_shares(const LobattoRule& rule) {
  const std::size_t half = (rule.nodes.size() - 1) / 2;
  return {0.5 * rule.nodes[1], 0.5 * (rule.nodes[half] + rule.nodes[half + 1])};
}

double GridMeasure::at(double place) const {
  const auto next = std::lower_bound(w.begin() + 1, w.end() - 1, place);
  const std::size_t i = static_cast<std::size_t>(next - w.begin());
  const double share = (place - w[i - 1]) / (w[i] - w[i - 1]);
  return value[i - 1] + share * (value[i] - value[i - 1]);
}

std::vector<FeedElement> feed_elements(const FeedStretch& stretch, const GridMeasure& measure,
                                       int count) {
  const double whole = measure.value.back() - measure.value.front();
  const std::vector<Cut> cuts =
      necessary_cuts(stretch, kShortest * stretch.map.extent() / std::max(count, 1));
  std::vector<FeedElement> elements;
  for (std::size_t c = 0; c + 1 < cuts.size(); ++c) {
    const double begin = cuts[c].w, end = cuts[c + 1].w;
    const double first = measure.at(begin), last = measure.at(end);
    const int parts = std::max(1, static_cast<int>(std::lround(count * (last - first) / whole)));
    FeedElement element;
    element.piece = cuts[c].after;
    element.zone = stretch.map.zone(0.5 * (begin + end));
    element.end = begin;
    for (int part = 1; part <= parts; ++part) {
      element.begin = element.end;
      element.end = part == parts ? end : place_of(measure, first + (last - first) * part / parts);
      elements.push_back(element);
    }
  }
  return elements;
}

FeedGrid feed_grid(const FeedStretch& stretch, std::vector<FeedElement> elements, int points,
                   bool probes) {
  FeedGrid grid;
  grid.elements = std::move(elements);
  grid.rule = lobatto_rule(points);
  grid.width = stretch.lanes.width;
  grid.basis = cubic_basis(grid.elements);
  const std::size_t row_size = 3 * static_cast<std::size_t>(grid.width);
  grid.rows.reserve(grid.points() * row_size);
  const auto shares = probe_shares(grid.rule);
  FeedRow row;
  const FeedElement* before = nullptr;
  for (const FeedElement& element : grid.elements) {
    const bool joined = before && before->zone == element.zone && before->piece == element.piece;
    for (int i = 0; i < points; ++i) {
      if (i > 0 || !joined)
        row = feed_row(stretch, element, grid.place(element, grid.rule.nodes[i]));
      grid.rows.insert(grid.rows.end(), row.q.begin(), row.q.begin() + row_size);
      grid.cap.push_back(feed_cap(stretch.lanes, row));
      grid.tip.push_back(row.tip);
      grid.turn.push_back(row.turn);
    }
    for (std::size_t p = 0; probes && p < shares.size(); ++p)
      grid.probes.push_back(feed_row(stretch, element, grid.place(element, shares[p])));
    before = &element;
  }
  return grid;
}

std::vector<std::array<double, 16>> cubic_basis(const std::vector<FeedElement>& elements) {
  const int count = static_cast<int>(elements.size());
  const auto knot = [&](int i) {  // clamped: four times each end
    i = std::clamp(i - 3, 0, count);
    return i == count ? elements.back().end : elements[i].begin;
  };
  std::vector<std::array<double, 16>> basis(elements.size());
  for (int e = 0; e < count; ++e) {
    const int span = e + 3;
    const double begin = elements[e].begin;
    std::array<std::array<double, 4>, 5> n{};  // n[j]: N_{span−r+j, r} as a polynomial of w − begin
    n[0][0] = 1.0;
    for (int r = 1; r <= 3; ++r) {
      std::array<std::array<double, 4>, 5> next{};
      for (int j = 0; j <= r; ++j) {
        const int i = span - r + j;  // N_{i,r} from N_{i,r−1} = n[j − 1] and N_{i+1,r−1} = n[j]
        const auto add = [&](const std::array<double, 4>& p, double at_begin, double slope) {
          for (int k = 0; k < r; ++k) {
            next[j][k] += at_begin * p[k];
            next[j][k + 1] += slope * p[k];
          }
        };
        if (j > 0) {
          const double step = knot(i + r) - knot(i);
          add(n[j - 1], (begin - knot(i)) / step, 1.0 / step);
        }
        if (j < r) {
          const double step = knot(i + r + 1) - knot(i + 1);
          add(n[j], (knot(i + r + 1) - begin) / step, -1.0 / step);
        }
      }
      n = next;
    }
    for (int j = 0; j < 4; ++j)
      for (int k = 0; k < 4; ++k) basis[e][4 * k + j] = n[j][k];
  }
  return basis;
}

std::vector<double> greville_places(const std::vector<FeedElement>& elements) {
  const int count = static_cast<int>(elements.size());
  const auto knot = [&](int i) {
    i = std::clamp(i - 3, 0, count);
    return i == count ? elements.back().end : elements[i].begin;
  };
  std::vector<double> places(elements.size() + 3);
  for (int j = 0; j < count + 3; ++j) places[j] = (knot(j + 1) + knot(j + 2) + knot(j + 3)) / 3.0;
  return places;
}

std::array<double, 4> cubic_of(const FeedGrid& grid, const std::vector<double>& controls,
                               std::size_t e) {
  std::array<double, 4> c{};
  for (int k = 0; k < 4; ++k)
    for (int j = 0; j < 4; ++j) c[k] += grid.basis[e][4 * k + j] * controls[e + j];
  return c;
}

std::array<double, 4> cubic_values(const FeedGrid& grid, const std::vector<double>& controls,
                                   std::size_t e, double d) {
  const std::array<double, 4> c = cubic_of(grid, controls, e);
  return {c[0] + d * (c[1] + d * (c[2] + d * c[3])), c[1] + d * (2.0 * c[2] + d * 3.0 * c[3]),
          2.0 * c[2] + 6.0 * d * c[3], 6.0 * c[3]};
}

}  // namespace smoothpost
