#include "kernels/qp/quadratic_program.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "kernels/core/contract.h"
#include "kernels/spline/gauss_rule.h"
#include "kernels/spline/spline_piece.h"

namespace smoothpost {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Weights of one channel's local variables become those of the scaled ones.
void scale_row(const SplineLayout& layout, int channel, BasisRow& row) {
  for (int q = 0; q < row.weights.size(); ++q)
    row.weights[q] *= layout.scale(channel, std::min(q, layout.levels));
}

Eigen::MatrixXd piece_cost(const SplineLayout& layout, int channel, int span, int order) {
  const int k = layout.knots.degree;
  const double length = layout.knots.values[span + k + 1] - layout.knots.values[span + k];
  const GaussRule& rule = gauss_rule(k - order + 1);
  Eigen::MatrixXd cost = Eigen::MatrixXd::Zero(k + 1, k + 1);
  for (int g = 0; g < rule.points; ++g) {
    BasisRow row = piece_lifted(layout.knots, span, length * rule.nodes[g], order, layout.levels);
    scale_row(layout, channel, row);
    cost += length * rule.weights[g] * row.weights * row.weights.transpose();
  }
  return cost;
}

/// The local variables of one piece after the other, in one place.
class LocalVariables {
 public:
  LocalVariables(const SplineLayout& layout, const Eigen::VectorXd& x)
      : x_(x), local_(layout.local_size()) {
    for (int p = 0; p < local_.size(); ++p) first_.push_back(layout.local_index(0, p));
  }
  const Eigen::VectorXd& at(int span) {
    for (std::size_t p = 0; p < first_.size(); ++p)
      local_[static_cast<Eigen::Index>(p)] = x_[first_[p] + span];
    return local_;
  }

 private:
  const Eigen::VectorXd& x_;
  Eigen::VectorXd local_;
  std::vector<int> first_;  ///< of the first piece; every other one is one further
};

}  // namespace

double SplineLayout::place(int level, int j) const {
  const int k = knots.degree;
  if (level >= k) return 0.5 * (knots.values[j + k] + knots.values[j + k + 1]);
  const auto first = knots.values.begin() + j + level + 1;
  return std::accumulate(first, first + (k - level), 0.0) / (k - level);
}

SplineLayout spline_layout(const SplineKnots& knots, int levels, int channels) {
  knot_span(knots, knots.first());  // asks for clamped knots
  require(levels >= 1 && levels <= knots.degree, "spline_layout: levels between 1 and the degree");
  require(channels >= 1, "spline_layout: at least one channel");
  const auto inner = knots.values.begin() + knots.degree;
  require(std::adjacent_find(inner, inner + knots.spans() + 1, std::greater_equal<>()) ==
              inner + knots.spans() + 1,
          "spline_layout: simple inner knots");
  return {knots, levels, channels, Eigen::MatrixXd::Ones(channels, levels + 1)};
}

LocalRow local_row(const SplineLayout& layout, int channel, double u, int order) {
  require(channel >= 0 && channel < layout.channels, "local_row: a channel of the layout");
  BasisRow row = lifted_basis(layout.knots, u, order, layout.levels);
  scale_row(layout, channel, row);
  LocalRow local{row.first, Eigen::VectorXd::Zero(layout.local_size())};
  local.weights.segment(channel * row.weights.size(), row.weights.size()) = row.weights;
  return local;
}

Eigen::VectorXd lift(const SplineLayout& layout, const Eigen::MatrixXd& controls) {
  require(controls.rows() == layout.channels && controls.cols() == layout.controls(),
          "lift: channels × controls");
  Eigen::VectorXd x(layout.size());
  for (int c = 0; c < layout.channels; ++c)
    for (int level = 0; level <= layout.levels; ++level)
      x.segment(layout.index(c, level, 0), layout.count(level)) =
          derivative_controls(layout.knots, controls.row(c).transpose(), level) /
          layout.scale(c, level);
  return x;
}

Eigen::MatrixXd controls_of(const SplineLayout& layout, const Eigen::VectorXd& x) {
  require(x.size() == layout.size(), "controls_of: one value a variable");
  Eigen::MatrixXd controls(layout.channels, layout.controls());
  for (int c = 0; c < layout.channels; ++c)
    controls.row(c) =
        x.segment(layout.index(c, 0, 0), layout.controls()).transpose() * layout.scale(c, 0);
  return controls;
}

QuadraticProgram empty_program(SplineLayout layout) {
  QuadraticProgram qp;
  const int local = layout.local_size();
  qp.hessian = Eigen::MatrixXd::Zero(local, local * layout.spans());
  qp.gradient = Eigen::MatrixXd::Zero(local, layout.spans());
  qp.lower = Eigen::VectorXd::Constant(layout.size(), -kInfinity);
  qp.upper = Eigen::VectorXd::Constant(layout.size(), kInfinity);
  qp.rows.resize(local, 0);
  qp.layout = std::move(layout);
  return qp;
}

void add_derivative_cost(QuadraticProgram& qp, int channel, int order, double weight) {
  const SplineLayout& layout = qp.layout;
  require(channel >= 0 && channel < layout.channels, "add_derivative_cost: a channel");
  require(order >= 0 && order <= layout.knots.degree, "add_derivative_cost: order up to degree");
  const int count = layout.knots.degree + 1;
  const int local = layout.local_size();
  Eigen::MatrixXd cost;
  for (int span = 0; span < layout.spans(); ++span) {
    if (!piece_repeats(layout.knots, span))
      cost = weight * piece_cost(layout, channel, span, order);
    qp.hessian.block(channel * count, span * local + channel * count, count, count) += cost;
  }
}

void limit_level(QuadraticProgram& qp, int channel, int level, double limit) {
  const SplineLayout& layout = qp.layout;
  require(channel >= 0 && channel < layout.channels, "limit_level: a channel of the layout");
  require(level >= 0 && level <= layout.levels, "limit_level: a level of the layout");
  require(limit >= 0.0, "limit_level: a limit that is not negative");
  const double bound = limit / layout.scale(channel, level);
  const int first = layout.index(channel, level, 0);
  for (int i = first; i < first + layout.count(level); ++i) {
    qp.lower[i] = std::max(qp.lower[i], -bound);
    qp.upper[i] = std::min(qp.upper[i], bound);
  }
}

void set_rows(QuadraticProgram& qp, const std::vector<NewRow>& rows) {
  const int count = static_cast<int>(rows.size());
  const int local = qp.layout.local_size();
  std::vector<int> order(count);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return rows[a].row.span < rows[b].row.span; });
  qp.rows.resize(local, count);
  qp.row_span.assign(count, 0);
  qp.row_lower.resize(count);
  qp.row_upper.resize(count);
  qp.row_name.assign(count, {});
  qp.row_place.assign(count, 0.0);
  for (int i = 0; i < count; ++i) {
    const NewRow& row = rows[order[i]];
    require(row.row.weights.size() == local, "set_rows: a weight for every local variable");
    require(row.row.span >= 0 && row.row.span < qp.layout.spans(), "set_rows: a piece");
    qp.rows.col(i) = row.row.weights;
    qp.row_span[i] = row.row.span;
    qp.row_lower[i] = row.lower;
    qp.row_upper[i] = row.upper;
    qp.row_name[i] = row.name;
    qp.row_place[i] = row.place;
  }
}

double objective_value(const QuadraticProgram& qp, const Eigen::VectorXd& x) {
  require(x.size() == qp.layout.size(), "objective_value: one value a variable");
  const int local = qp.layout.local_size();
  double sum = qp.constant;
  LocalVariables variables(qp.layout, x);
  Eigen::VectorXd slope(local);
  for (int span = 0; span < qp.layout.spans(); ++span) {
    const Eigen::VectorXd& here = variables.at(span);
    slope.noalias() = qp.hessian.middleCols(span * local, local) * here;
    sum += 0.5 * here.dot(slope) + qp.gradient.col(span).dot(here);
  }
  return sum;
}

Eigen::VectorXd row_values(const QuadraticProgram& qp, const Eigen::VectorXd& x) {
  require(x.size() == qp.layout.size(), "row_values: one value a variable");
  Eigen::VectorXd values(qp.row_count());
  LocalVariables variables(qp.layout, x);
  for (int i = 0; i < qp.row_count(); ++i)
    values[i] = qp.rows.col(i).dot(variables.at(qp.row_span[static_cast<std::size_t>(i)]));
  return values;
}

}  // namespace smoothpost
