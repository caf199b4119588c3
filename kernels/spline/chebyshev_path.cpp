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
double node(int i, int n = kPoints) { return std::cos(kPi * (i + 0.5) / n); }

// T_k and its first three derivatives at x ∈ [−1, 1], by their recurrences.
std::array<Basis, 4> basis(double x) {
  std::array<Basis, 4> t;
  for (Basis& b : t) b.setZero();
  t[0][0] = 1.0;
  t[0][1] = x;
  t[1][1] = 1.0;
  for (int k = 1; k + 1 < kPoints; ++k) {
    t[0][k + 1] = 2.0 * x * t[0][k] - t[0][k - 1];
    t[1][k + 1] = 2.0 * x * t[1][k] + 2.0 * t[0][k] - t[1][k - 1];
    t[2][k + 1] = 2.0 * x * t[2][k] + 4.0 * t[1][k] - t[2][k - 1];
    t[3][k + 1] = 2.0 * x * t[3][k] + 6.0 * t[2][k] - t[3][k - 1];
  }
  return t;
}

// Σ_k t_k c_k from the first k on that counts; `rows` numbers a coefficient. (Eigen's product of a
// matrix of any height takes its memory from the heap.)
PathValue sum_of(const double* c, Eigen::Index rows, const Basis& t, int first) {
  PathValue out = PathValue::Zero(rows);
  for (int k = first; k < kPoints; ++k)
    for (Eigen::Index i = 0; i < rows; ++i) out[i] += t[k] * c[k * rows + i];
  return out;
}

// Row i: T_k at node i of N times its weight in the discrete cosine sum.
template <int N>
const Eigen::Matrix<double, N, N>& transform() {
  static const Eigen::Matrix<double, N, N> matrix = [] {
    Eigen::Matrix<double, N, N> m;
    for (int i = 0; i < N; ++i)
      for (int k = 0; k < N; ++k)
        m(i, k) = (k == 0 ? 1.0 : 2.0) / N * std::cos(k * kPi * (i + 0.5) / N);
    return m;
  }();
  return matrix;
}

using Values = Eigen::Matrix<double, Eigen::Dynamic, kPoints, Eigen::ColMajor, 16, kPoints>;

// The integral of a piece's polynomial of degree below kPoints − 1 that is `at_middle` at x = 0.
Values integral(const Values& c, const PathValue& at_middle) {
  Values out = Values::Zero(c.rows(), kPoints);
  out.col(1) = c.col(0) - 0.5 * c.col(2);
  for (int k = 2; k < kPoints; ++k)
    out.col(k) =
        (c.col(k - 1) - (k + 1 < kPoints ? 1.0 : 0.0) * c.col(std::min(k + 1, kPoints - 1))) /
        (2.0 * k);
  // T_k(0) is 1, 0, −1, 0, 1, …
  for (int k = 2; k < kPoints; k += 2) out.col(0) += (k % 4 == 0 ? -1.0 : 1.0) * out.col(k);
  out.col(0) += at_middle;
  return out;
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
    const Coefficients c = values * transform<kPoints>();
    const PathValue range = 0.5 * (values.rowwise().maxCoeff() - values.rowwise().minCoeff());
    const PathValue tail = c.rightCols<2>().cwiseAbs().rowwise().maxCoeff();
    if ((tail.array() <= settings.relative * range.array() + settings.absolute).all() &&
        (pieces() == before || meets(c, range))) {
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

bool ChebyshevPath::append_jets(const JetFunction& f, double from, double to,
                                const PathValue& third, const ChebyshevJetSettings& settings) {
  require(to > from, "ChebyshevPath::append_jets: to > from");
  const std::size_t before = pieces();
  if (before == 0) start_ = from;
  std::vector<std::pair<double, int>> waiting = {{to, 0}};  // end and depth, nearest last
  double at = from;
  while (!waiting.empty()) {
    const auto [end, depth] = waiting.back();
    const double middle = 0.5 * (at + end), half = 0.5 * (end - at);
    std::array<ChebyshevJet, kJets> jets;
    Eigen::Matrix<double, Eigen::Dynamic, kJets, Eigen::ColMajor, 16, kJets> thirds;
    for (int i = 0; i < kJets; ++i) {
      auto jet = f(middle + half * node(i, kJets));
      if (!jet) {
        shorten(before);
        return false;
      }
      if (i == 0) thirds.resize((*jet)[3].size(), kJets);
      thirds.col(i) = (*jet)[3];
      jets[static_cast<std::size_t>(i)] = std::move(*jet);
    }
    const ChebyshevJet& centre = jets[kJets / 2];
    Values c = Values::Zero(thirds.rows(), kPoints);
    c.leftCols<kJets>() = thirds * transform<kJets>();
    const PathValue tail = c.middleCols<2>(kJets - 2).cwiseAbs().rowwise().maxCoeff();
    bool resolved =
        (tail.array() <=
         settings.relative * thirds.cwiseAbs().rowwise().maxCoeff().array() + third.array())
            .all();
    c = integral(half * c, centre[2]);
    const Values first = integral(half * c, centre[1]);
    c = integral(half * first, centre[0]);
    for (const int i : {0, kJets - 1}) {
      const ChebyshevJet& wanted = jets[static_cast<std::size_t>(i)];
      const Basis t = basis(node(i, kJets))[0];
      const PathValue value = c * t, slope = first * t;
      const PathValue range = (jets[0][0] - jets[kJets - 1][0]).cwiseAbs();
      if (i > 0 && pieces() > before) resolved = resolved && meets(c, range);
      resolved =
          resolved &&
          ((value - wanted[0]).array().abs() <= settings.value * (1.0 + range.array())).all() &&
          (slope - wanted[1]).norm() <= 1e-6 * (wanted[1].norm() + centre[1].norm());
    }
    if (resolved) {
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

// A jump of the function may lie between the last point of one piece and the first of the next.
bool ChebyshevPath::meets(const Coefficients& next, const PathValue& range) const {
  const PathValue end = coefficients_.back() * basis(1.0)[0], start = next * basis(-1.0)[0];
  return ((end - start).array().abs() <= kMeets * (1.0 + range.array())).all();
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
  const Coefficients& c = coefficients_[piece];
  ChebyshevJet out;
  double factor = 1.0;
  for (std::size_t d = 0; d < 4; ++d, factor *= scale)
    out[d] = factor * sum_of(c.data(), c.rows(), t[d], static_cast<int>(d));
  return out;
}

PathValue ChebyshevPath::value(std::size_t piece, double x) const {
  const double a = from(piece), b = to(piece);
  const Coefficients& c = coefficients_[piece];
  return sum_of(c.data(), c.rows(), basis((x - 0.5 * (a + b)) * 2.0 / (b - a))[0], 0);
}

}  // namespace smoothpost
