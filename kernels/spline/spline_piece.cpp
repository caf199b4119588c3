#include "kernels/spline/spline_piece.h"

#include <algorithm>

namespace smoothpost {
namespace {

/// Turns weights of level `from`, at row.weights[from …], into weights of the lifted variables:
/// T^l_{i+m} = T^l_i + Σ_{p<m} h^{l+1}_{i+p}·T^{l+1}_{i+p}, level by level.
void raise_level(const SplineKnots& knots, int from, int to, BasisRow& row) {
  for (int level = from; level < to; ++level) {
    double* w = row.weights.data() + level;
    double beyond = 0.0;
    for (int m = knots.degree - level; m > 0; --m) {
      beyond += w[m];
      w[m] = beyond * derivative_step(knots, level + 1, row.first + m - 1);
    }
    w[0] += beyond;
  }
}

}  // namespace

double derivative_step(const SplineKnots& knots, int level, int j) {
  const int k = knots.degree;
  return (knots.values[j + k + 1] - knots.values[j + level]) / (k - level + 1);
}

PieceSlopes piece_slopes(const SplineKnots& knots, int span, int levels) {
  const int k = knots.degree;
  const double* u = knots.values.data() + span;
  PieceSlopes slopes;
  for (int level = 1; level <= levels; ++level)
    for (int m = 0; m <= k - level; ++m)
      slopes.values[level][m] = (k - level + 1) / (u[m + k + 1] - u[m + level]);
  return slopes;
}

BasisRow piece_basis(const SplineKnots& knots, int span, int degree, double offset) {
  const double* at = knots.values.data() + span + knots.degree;  // the piece is [at[0], at[1]]
  BasisRow row;
  row.first = span;
  row.weights.resize(degree + 1);
  double* n = row.weights.data();
  n[0] = 1.0;
  for (int r = 1; r <= degree; ++r) {
    double saved = 0.0;
    for (int m = 0; m < r; ++m) {
      const double right = at[m + 1] - at[0];
      const double left = at[m + 1 - r] - at[0];
      const double share = n[m] / (right - left);
      n[m] = saved + (right - offset) * share;
      saved = (offset - left) * share;
    }
    n[r] = saved;
  }
  return row;
}

BasisRow piece_lifted(const SplineKnots& knots, int span, double offset, int order, int levels) {
  const int k = knots.degree;
  const int start = std::min(order, levels);
  BasisRow derivative = piece_basis(knots, span, k - order, offset);
  if (order > levels) lower_level(piece_slopes(knots, span, order), order, levels, derivative);
  BasisRow row;
  row.first = span;
  row.weights.resize(k + 1);
  row.weights.head(start).setZero();
  row.weights.tail(k + 1 - start) = derivative.weights;
  raise_level(knots, order, levels, row);
  return row;
}

void lower_level(const PieceSlopes& slopes, int from, int to, BasisRow& row) {
  int count = static_cast<int>(row.weights.size());
  row.weights.conservativeResize(count + from - to);
  double* w = row.weights.data();
  for (int level = from; level > to; --level, ++count) {
    double carried = 0.0;
    for (int m = 0; m < count; ++m) {
      const double share = w[m] * slopes.value(level, m);
      w[m] = carried - share;
      carried = share;
    }
    w[count] = carried;
  }
}

bool piece_repeats(const SplineKnots& knots, int span) {
  if (span == 0) return false;
  const int k = knots.degree;
  const double* here = knots.values.data() + span + k;
  const double* before = here - 1;
  for (int m = 1 - k; m <= std::max(k, 1); ++m)
    if (here[m] - here[0] != before[m] - before[0]) return false;
  return true;
}

}  // namespace smoothpost
