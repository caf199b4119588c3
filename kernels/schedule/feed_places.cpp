#include "kernels/schedule/feed_places.h"

#include <algorithm>
#include <cmath>

#include "kernels/schedule/lane_clones.h"

namespace smoothpost {
namespace {

constexpr double kNearPeak = 0.9;  // loads from which peaks between places are looked for

template <int P>
SMOOTHPOST_INLINE void interpolate(const RowInterpolation& by, const double* rows, double* out) {
  for (int place = 0; place < by.count; ++place) {
    const double* weights = by.weights + place * by.nodes;
    double sum[3 * P] = {};
    for (int j = 0; j < by.nodes; ++j)
      for (int k = 0; k < 3 * P; ++k) sum[k] += weights[j] * rows[3 * P * j + k];
    for (int k = 0; k < 3 * P; ++k) out[3 * P * place + k] = sum[k];
  }
}

template <int P>
SMOOTHPOST_INLINE void to_loads(const FeedLanes& lanes, const std::vector<PlaceValues>& at,
                                double* rows) {
  for (std::size_t place = 0; place < at.size(); ++place) {
    const PlaceValues v = at[place];
    const double half1 = 0.5 * v.b1, half2 = 0.5 * v.b2, more = 1.5 * v.b1;
    double* __restrict q = rows + 3 * P * place;
    for (int l = 0; l < P; ++l) {
      const double q1 = q[l], q2 = q[P + l], q3 = q[2 * P + l];
      q[l] = std::abs(q1) * v.root * lanes.velocity[l];
      q[P + l] = (q2 * v.b + q1 * half1) * lanes.acceleration[l];
      q[2 * P + l] = (q3 * v.b + q2 * more + q1 * half2) * v.root * lanes.jerk[l];
    }
  }
}

SMOOTHPOST_INLINE double larger(double a, double b) { return a > b ? a : b; }

template <int P>
SMOOTHPOST_INLINE double largest_size(const double* v) {
  double most[P];
  for (int l = 0; l < P; ++l) most[l] = std::abs(v[l]);
  double all = most[0];
  for (int l = 1; l < P; ++l) all = larger(all, most[l]);
  return all;
}

/// The largest top between neighbours of the place at `c`; `ratio`: the second distance over the
/// first.
template <int P>
double largest_top(const double* before, const double* c, const double* after, double ratio) {
  double largest = 0.0;
  for (int l = 0; l < P; ++l) {
    const double sign = c[l] < 0.0 ? -1.0 : 1.0;
    const double p = sign * before[l], m = sign * c[l], n = sign * after[l];
    if (m < kNearPeak || m < p || m < n) continue;
    const double left = m - p, right = (n - m) / ratio;  // slopes; the first distance is 1
    const double bend = (left - right) / (1.0 + ratio),
                 slope = (left * ratio + right) / (1.0 + ratio);
    if (bend > 0.0) largest = std::max(largest, m + slope * slope / (4.0 * bend));
  }
  return largest;
}

template <int P>
SMOOTHPOST_INLINE FeedLoad largest(const std::vector<double>& shares, const double* loads) {
  double worst[3] = {0.0, 0.0, 0.0};
  const std::size_t count = shares.size();
  for (std::size_t i = 0; i < count; ++i)
    for (int kind = 0; kind < 3; ++kind) {
      const double* here = loads + 3 * P * i + P * kind;
      const double most = largest_size<P>(here);
      worst[kind] = larger(worst[kind], most);
      if (most < kNearPeak || i == 0 || i + 1 == count) continue;
      const double ratio = (shares[i + 1] - shares[i]) / (shares[i] - shares[i - 1]);
      worst[kind] = larger(worst[kind], largest_top<P>(here - 3 * P, here, here + 3 * P, ratio));
    }
  return {worst[0], worst[1], worst[2]};
}

template <int P>
struct Width {};

#define SMOOTHPOST_PLACES(P)                                                                     \
  SMOOTHPOST_LANES void interpolate_of(Width<P>, const RowInterpolation& by, const double* rows, \
                                       double* out) {                                            \
    interpolate<P>(by, rows, out);                                                               \
  }                                                                                              \
  SMOOTHPOST_LANES void loads_of(Width<P>, const FeedLanes& lanes,                               \
                                 const std::vector<PlaceValues>& at, double* rows) {             \
    to_loads<P>(lanes, at, rows);                                                                \
  }                                                                                              \
  SMOOTHPOST_LANES FeedLoad largest_of(Width<P>, const std::vector<double>& shares,              \
                                       const double* loads) {                                    \
    return largest<P>(shares, loads);                                                            \
  }
SMOOTHPOST_PLACES(8)
SMOOTHPOST_PLACES(16)
#undef SMOOTHPOST_PLACES

}  // namespace

void interpolate_rows(const RowInterpolation& by, const double* rows, double* out) {
  if (by.width == 8)
    interpolate_of(Width<8>{}, by, rows, out);
  else
    interpolate_of(Width<16>{}, by, rows, out);
}

void rows_to_loads(const FeedLanes& lanes, const std::vector<PlaceValues>& at, double* rows) {
  if (lanes.width == 8)
    loads_of(Width<8>{}, lanes, at, rows);
  else
    loads_of(Width<16>{}, lanes, at, rows);
}

FeedLoad largest_loads(int width, const std::vector<double>& shares, const double* loads) {
  return width == 8 ? largest_of(Width<8>{}, shares, loads)
                    : largest_of(Width<16>{}, shares, loads);
}

}  // namespace smoothpost
