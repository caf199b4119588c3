#include "postproc/pipeline/laser_joint_path.h"

namespace smoothpost {

namespace {

/// Derivatives of a_i + b_i·q6 by u, orders 0 … 3.
Jet linear_jet(const LinearsByStandoff& l, int i, const Jet& q6) {
  constexpr double kBinomial[4][4] = {{1, 0, 0, 0}, {1, 1, 0, 0}, {1, 2, 1, 0}, {1, 3, 3, 1}};
  Jet jet{};
  for (int n = 0; n < 4; ++n) {
    double value = l.a(i, n);
    for (int r = 0; r <= n; ++r)
      value += kBinomial[n][r] * l.b(i, n - r) * q6[static_cast<std::size_t>(r)];
    jet[static_cast<std::size_t>(n)] = value;
  }
  return jet;
}

}  // namespace

Jet jet_of(const SplineCurve& curve, int component, double u) {
  const Eigen::Index row = component;
  Jet jet{};
  for (int order = 0; order < 4; ++order) {
    const BasisRow basis = bspline_basis(curve.knots, u, order);
    jet[static_cast<std::size_t>(order)] = curve.controls.row(row)
                                               .segment(basis.first, basis.weights.size())
                                               .dot(basis.weights.transpose());
  }
  return jet;
}

std::vector<double> LaserJointPath::breaks() const {
  const SplineKnots& knots = rotary.knots;
  return {knots.values.begin() + knots.degree, knots.values.end() - knots.degree};
}

VectorJet LaserJointPath::tip_jet(double u) const {
  VectorJet jet;
  for (int order = 0; order < 4; ++order) {
    const BasisRow basis = bspline_basis(tip.knots, u, order);
    jet.col(order) = tip.controls.middleCols(basis.first, basis.weights.size()) * basis.weights;
  }
  return jet;
}

JointJet LaserJointPath::jet(double u) const {
  JointJet jet = JointJet::Zero(held.size(), 4);
  jet.col(0) = held;
  const auto set = [&jet](int joint, const Jet& derivatives) {
    for (int order = 0; order < 4; ++order)
      jet(joint, order) = derivatives[static_cast<std::size_t>(order)];
  };
  const Jet q4 = jet_of(rotary, 0, u), q5 = jet_of(rotary, 1, u), q6 = jet_of(standoff, 0, u);
  const LinearsByStandoff l = linears_by_standoff(head, tip_jet(u), q4, q5);
  set(head.first_rotary, q4);
  set(head.second_rotary, q5);
  set(head.standoff, q6);
  for (int i = 0; i < 3; ++i) set(head.linear[static_cast<std::size_t>(i)], linear_jet(l, i, q6));
  return jet;
}

JointVector LaserJointPath::joints(double u) const { return jet(u).col(0); }

CutterLocation LaserJointPath::tool(double u) const {
  const Eigen::VectorXd r = rotary.at(u);
  return {Vec3(tip.at(u)),
          Vec3(axis_jet(head, {r[0], 0.0, 0.0, 0.0}, {r[1], 0.0, 0.0, 0.0}).col(0))};
}

}  // namespace smoothpost
