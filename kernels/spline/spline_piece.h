#pragma once

#include <array>

#include "kernels/spline/bspline_basis.h"

// One piece of a clamped B-spline, by its index: what the functions over whole splines are made of.
namespace smoothpost {

/// 1/h^l_j of the control points of one piece: value(l, m) belongs to j = span + m (see
/// derivative_steps()).
struct PieceSlopes {
  std::array<std::array<double, kMaxSplineDegree>, kMaxSplineDegree + 1> values{};

  double value(int level, int m) const { return values[level][m]; }
};

/// The step h^l_j, unchecked.
double derivative_step(const SplineKnots& knots, int level, int j);

/// The slopes of levels 1 … `levels` of a piece.
/// @pre knots clamped, 0 ≤ span < spans, the piece not empty, levels ≤ k; unchecked.
PieceSlopes piece_slopes(const SplineKnots& knots, int span, int levels);

/// The degree + 1 basis functions of that degree on a piece, at `offset` from its start; row.first
/// = span. From the start of the piece, for u itself has lost digits far from 0.
/// @pre as piece_slopes(), degree ≤ knots.degree; unchecked.
BasisRow piece_basis(const SplineKnots& knots, int span, int degree, double offset);

/// lifted_basis() at `offset` from the start of a piece.   @pre as there; unchecked.
BasisRow piece_lifted(const SplineKnots& knots, int span, double offset, int order, int levels);

/// Turns weights of the derivative control points of level `from` into weights of those of level
/// `to` ≤ from, by the slopes of the piece.
void lower_level(const PieceSlopes& slopes, int from, int to, BasisRow& row);

/// Whether a piece has the same basis functions as the one before it, moved along: the knots around
/// both are equally spaced, to the bit.   @pre knots clamped, 0 ≤ span < spans; unchecked.
bool piece_repeats(const SplineKnots& knots, int span);

}  // namespace smoothpost
