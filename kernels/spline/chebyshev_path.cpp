#include "kernels/spline/chebyshev_path.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

constexpr int kPoints = 10;
constexpr double kPi = 3.14159265358979323846;

using Basis = Eigen::Matrix<double, kPoints, 1>;

// cos(π(i + 1/2)/n), descending in i.
double node(int i) { return std::cos(kPi * (i + 0.5) / kPoints); }

// T_k and its first three derivatives at x ∈ [−1, 1], by their recurrences.
std::array<Basis, 4> basis(double x) {
  std::array<Basis, 4> t;
  for (Basis& b : t) b.setZero();
  t[0][0] = 1.0;
  t[0][1] = x;
  t[1][1] = 1.0;
  for (int k = 1; k + 1 < kPoints; ++k)
    for (int d = 0; d < 4; ++d) {
      const auto at = [&](int order, int index) {
        return order < 0 ? 0.0 : t[static_cast<std::size_t>(order)][index];
      };
      t[static_cast<std::size_t>(d)][k + 1] =
          2.0 * x * at(d, k) + 2.0 * d * at(d - 1, k) - at(d, k - 1);
    }
  return t;
}

// Row i: T_k at node i times its weight in the discrete cosine sum.
const Eigen::Matrix<double, kPoints, kPoints>& transform() {
  static const Eigen::Matrix<double, kPoints, kPoints> matrix = [] {
    Eigen::Matrix<double, kPoints, kPoints> m;
    for (int i = 0; i < kPoints; ++i)
      for (int k = 0; k < kPoints; ++k)
        m(i, k) = (k == 0 ? 1.0 : 2.0) / kPoints * std::cos(k * kPi * (i + 0.5) / kPoints);
    return m;
  }();
  return matrix;
}

}  // namespace

bool ChebyshevPath::append(const Function& f, double from, double to,
                           const ChebyshevSettings& settings) {
  require(to > from, "ChebyshevPath::append: to > from");
  const std::size_t before = pieces();
  if (before == 0) start_ = from;
  std::vector<std::pair<double, int>> waiting = {{to, 0}};  // end and depth, nearest last
  double at = from;
  while (!waiting.empty()) {
    const auto [end, depth] = waiting.back();
    const double middle = 0.5 * (at + end), half = 0.5 * (end - at);
    Eigen::Matrix<double, Eigen::Dynamic, kPoints, Eigen::ColMajor, 16, kPoints> values;
    for (int i = 0; i < kPoints; ++i) {
      const PathValue v = f(middle + half * node(i));
      if (i == 0) values.resize(v.size(), kPoints);
      values.col(i) = v;
    }
    const Coefficients c = values * transform();
    const PathValue range = 0.5 * (values.rowwise().maxCoeff() - values.rowwise().minCoeff());
    const PathValue tail = c.rightCols<2>().cwiseAbs().rowwise().maxCoeff();
    if ((tail.array() <= settings.relative * range.array() + settings.absolute).all()) {
      coefficients_.push_back(c);
      ends_.push_back(end);
      at = end;
      waiting.pop_back();
    } else if (depth >= settings.most_halvings || middle <= at || middle >= end) {
      shorten(before);
      return false;
    } else {
      waiting.back().second = depth + 1;
      waiting.emplace_back(middle, depth + 1);
    }
  }
  return true;
}

void ChebyshevPath::shorten(std::size_t pieces) {
  ends_.resize(pieces);
  coefficients_.resize(pieces);
}

ChebyshevPath ChebyshevPath::tail(std::size_t first, double start) const {
  ChebyshevPath out;
  out.start_ = from(first) - start;
  for (std::size_t i = first; i < pieces(); ++i) {
    out.ends_.push_back(ends_[i] - start);
    out.coefficients_.push_back(coefficients_[i]);
  }
  return out;
}

std::size_t ChebyshevPath::piece_at(double x) const {
  const auto next = std::upper_bound(ends_.begin(), ends_.end(), x);
  return std::min(static_cast<std::size_t>(next - ends_.begin()), ends_.size() - 1);
}

ChebyshevJet ChebyshevPath::jet(std::size_t piece, double x) const {
  const double a = from(piece), b = to(piece);
  const double scale = 2.0 / (b - a);
  const std::array<Basis, 4> t = basis((x - 0.5 * (a + b)) * scale);
  ChebyshevJet out;
  double factor = 1.0;
  for (std::size_t d = 0; d < 4; ++d, factor *= scale)
    out[d] = factor * (coefficients_[piece] * t[d]);
  return out;
}

PathValue ChebyshevPath::value(std::size_t piece, double x) const {
  const double a = from(piece), b = to(piece);
  return coefficients_[piece] * basis((x - 0.5 * (a + b)) * 2.0 / (b - a))[0];
}

}  // namespace smoothpost
