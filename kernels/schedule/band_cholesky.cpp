#include "kernels/schedule/band_cholesky.h"

#include <algorithm>
#include <cmath>

namespace smoothpost {

bool factor_band(std::vector<BandRow>& a) {
  static constexpr BandRow kNone{1.0, 0.0, 0.0, 0.0};
  for (std::size_t i = 0; i < a.size(); ++i) {
    const BandRow& p1 = i >= 1 ? a[i - 1] : kNone;
    const BandRow& p2 = i >= 2 ? a[i - 2] : kNone;
    const BandRow& p3 = i >= 3 ? a[i - 3] : kNone;
    BandRow& row = a[i];
    row[3] *= p3[0];
    row[2] = (row[2] - row[3] * p2[1]) * p2[0];
    row[1] = (row[1] - row[2] * p1[1] - row[3] * p1[2]) * p1[0];
    const double diagonal = row[0];
    const double pivot = diagonal - row[1] * row[1] - row[2] * row[2] - row[3] * row[3];
    if (std::isnan(pivot)) return false;
    row[0] = 1.0 / std::sqrt(std::max({pivot, 1e-13 * std::abs(diagonal), 1e-300}));
  }
  return true;
}

void solve_band(const std::vector<BandRow>& l, std::vector<double>& x) {
  const std::size_t n = l.size();
  for (std::size_t i = 0; i < n; ++i) {
    double value = x[i];
    for (std::size_t d = 1; d <= std::min<std::size_t>(3, i); ++d) value -= l[i][d] * x[i - d];
    x[i] = value * l[i][0];
  }
  for (std::size_t i = n; i-- > 0;) {
    double value = x[i];
    for (std::size_t d = 1; d <= 3 && i + d < n; ++d) value -= l[i + d][d] * x[i + d];
    x[i] = value * l[i][0];
  }
}

}  // namespace smoothpost
