#pragma once

#include <algorithm>
#include <optional>
#include <string_view>
#include <vector>

#include "kernels/spline/bspline_basis.h"

// Quadratic programmes over clamped B-splines in lifted form: the control points and the control
// points of the derivatives are variables of their own, tied by bidiagonal equations, so that
// every limit of a derivative is a plain bound and the matrices stay well conditioned.
namespace smoothpost {

/// The variables of a programme over `channels` splines on the same knots.
///
/// Variable (c, l, j) is T^l_j of channel c divided by scale(c, l): l = 0 the control points,
/// l = 1 … levels those of the derivatives, j = 0 … controls() − l − 1. They satisfy
///   x^{l−1}_{j+1} = x^{l−1}_j + h^l_j·scale(c, l)/scale(c, l − 1)·x^l_j      (derivative_steps).
struct SplineLayout {
  SplineKnots knots;
  int levels = 3;
  int channels = 1;
  Eigen::MatrixXd scale;  ///< channels × (levels + 1); a derivative's limit, or 1

  int spans() const { return knots.spans(); }
  int controls() const { return knots.controls(); }
  int count(int level) const { return controls() - level; }
  /// Of all variables: channel by channel, level by level.
  int size() const { return channels * channel_size(); }
  int channel_size() const { return level_start(levels + 1); }
  int index(int channel, int level, int j) const {
    return channel * channel_size() + level_start(level) + j;
  }
  /// Variables that determine one piece: channels × (degree + 1), channel by channel, each in the
  /// order of lifted_basis().
  int local_size() const { return channels * (knots.degree + 1); }
  /// Index of local variable p of piece `span`.
  int local_index(int span, int p) const {
    const int channel = p / (knots.degree + 1), q = p % (knots.degree + 1);
    const int level = std::min(q, levels);
    return index(channel, level, span + q - level);
  }
  /// Where the variable acts: the mean of the knots that its control point hangs on (Greville).
  double place(int level, int j) const;

 private:
  int level_start(int level) const { return level * controls() - level * (level - 1) / 2; }
};

/// The layout with scale 1.   @pre knots clamped with simple inner knots, 1 ≤ levels ≤ degree
SplineLayout spline_layout(const SplineKnots& knots, int levels, int channels);

/// Weights, in scaled local variables, of the derivative of that order of one channel at u; the
/// other channels' weights are 0.   @pre as lifted_basis()
struct LocalRow {
  int span = 0;
  Eigen::VectorXd weights;  ///< local_size()
};
LocalRow local_row(const SplineLayout& layout, int channel, double u, int order);

/// The lifted variables of given control points (channels × controls), scaled.
Eigen::VectorXd lift(const SplineLayout& layout, const Eigen::MatrixXd& controls);
/// The control points (channels × controls) of lifted variables, by their level 0.
Eigen::MatrixXd controls_of(const SplineLayout& layout, const Eigen::VectorXd& x);

/// Row limits and bounds all give way to one more variable τ:
///   lower − weight·τ ≤ value ≤ upper + weight·τ,   τ ≥ lower bound, cost·τ is added to the
///   objective.
/// With weights 1 and rows divided by their limits the least τ says by which share limits fall
/// short.
struct Relaxation {
  Eigen::VectorXd bound_weight;  ///< one a variable, ≥ 0
  Eigen::VectorXd row_weight;    ///< one a row, ≥ 0
  double cost = 1.0;
  double lower = -1e9;  ///< of τ
};

/// minimise ½ xᵀHx + gᵀx + constant, H and g summed over pieces of the spline,
/// subject to the equations of the layout, lower ≤ x ≤ upper and row_lower ≤ rows ≤ row_upper.
/// Equal lower and upper: an equation. ±infinity: no limit.
struct QuadraticProgram {
  SplineLayout layout;
  Eigen::MatrixXd hessian;   ///< local × (local·spans): one symmetric block a piece, positive
                             ///< semidefinite, and definite in the top level's last variable
  Eigen::MatrixXd gradient;  ///< local × spans
  double constant = 0.0;
  Eigen::VectorXd lower, upper;            ///< size()
  Eigen::MatrixXd rows;                    ///< local × number of rows, each over one piece
  std::vector<int> row_span;               ///< ascending
  Eigen::VectorXd row_lower, row_upper;    ///< one a row
  std::vector<std::string_view> row_name;  ///< what each row limits, for messages
  std::vector<double> row_place;           ///< u of each row
  std::optional<Relaxation> relaxation;

  int row_count() const { return static_cast<int>(row_span.size()); }
};

/// A programme of that layout without objective, bounds or rows.
QuadraticProgram empty_program(SplineLayout layout);

/// Adds weight/2·∫ (q⁽ʳ⁾)² du of one channel to the objective, exactly; q unscaled, r = order ≥
/// levels' own top level or below.   Cost: linear.
void add_derivative_cost(QuadraticProgram& qp, int channel, int order, double weight);

/// −limit ≤ every control point of the derivative `level` ≤ limit, on top of earlier bounds.
void limit_level(QuadraticProgram& qp, int channel, int level, double limit);

/// A row to be added: value between lower and upper.
struct NewRow {
  LocalRow row;
  double lower = 0.0;
  double upper = 0.0;
  std::string_view name;  ///< of static storage
  double place = 0.0;
};
/// Replaces the rows of a programme; sorts them by piece, stable.
void set_rows(QuadraticProgram& qp, const std::vector<NewRow>& rows);

/// Half the quadratic form, the linear term and the constant at x; without cost·τ.
double objective_value(const QuadraticProgram& qp, const Eigen::VectorXd& x);
/// Value of every row at x.
Eigen::VectorXd row_values(const QuadraticProgram& qp, const Eigen::VectorXd& x);

}  // namespace smoothpost
