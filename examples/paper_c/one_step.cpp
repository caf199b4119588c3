#include "examples/paper_c/one_step.h"

#include <Eigen/SVD>

#include "kernels/optimise/redundancy.h"

namespace smoothpost::paper_c {

namespace {

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

Vec3 vee_of_skew(const Mat3& r) {
  return 0.5 * Vec3(r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1));
}

Vec6 twist_of(const Pose& from, const Pose& to, TwistKind kind) {
  const Mat3 turn = to.linear() * from.linear().transpose();
  const Vec3 p = from.translation(), shift = to.translation() - turn * p;
  Vec6 twist;
  if (kind == TwistKind::logarithm) {
    const Vec3 w = rotation_log(turn);
    const double angle = w.norm();
    // V⁻¹ of the exponential of SE(3).
    const Mat3 cross = cross_matrix(w);
    const double c = angle > 1e-4 ? 1.0 / (angle * angle) -
                                        (1.0 + std::cos(angle)) / (2.0 * angle * std::sin(angle))
                                  : 1.0 / 12.0;
    twist << w, shift - 0.5 * cross * shift + c * cross * cross * shift;
    return twist;
  }
  twist << vee_of_skew(turn), kind == TwistKind::skew ? Vec3(to.translation() - p) : shift;
  return twist;
}

/// Rows of the Jacobian that go with the twist.
Mat6 rows_of(const ScrewChain& chain, const JointVector& q, const Vec3& tip, TwistKind kind) {
  Mat6 j = jacobian(chain, q);
  if (kind != TwistKind::skew)
    for (int i = 0; i < 6; ++i) j.block<3, 1>(3, i) -= Vec3(j.block<3, 1>(0, i)).cross(tip);
  return j;
}

/// The least step, weighted, by the five largest singular values.
JointVector step_of(const ScrewChain& chain, Mat6 rows, Vec6 twist, double unit) {
  rows.bottomRows<3>() /= unit;
  twist.tail<3>() /= unit;
  Vec6 scale = Vec6::Ones();
  for (int i = 0; i < 6; ++i)
    if (chain.joints[static_cast<std::size_t>(i)].kind == JointKind::linear) scale[i] = unit;
  const Mat6 weighted = rows * scale.asDiagonal();
  const Eigen::JacobiSVD<Mat6> svd(weighted, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vec6 step = Vec6::Zero();
  for (int k = 0; k < 5; ++k)
    step += svd.matrixV().col(k) * (svd.matrixU().col(k).dot(twist) / svd.singularValues()[k]);
  JointVector out(6);
  for (int i = 0; i < 6; ++i) out[i] = scale[i] * step[i];
  return out;
}

std::vector<double> places_of(const Contour& contour, double step) {
  std::vector<double> places{0.0};
  for (std::size_t b = 1; b < contour.breaks.size(); ++b) {
    const double from = contour.breaks[b - 1], length = contour.breaks[b] - from;
    const auto count = std::max<long>(1, std::lround(length / step));
    for (long k = 1; k <= count; ++k)
      places.push_back(from + length * static_cast<double>(k) / static_cast<double>(count));
  }
  return places;
}

void summarise(OneStep& out) {
  double position = 0.0, orientation = 0.0;
  for (const StepError& e : out.steps) {
    position += e.position * e.position;
    orientation += e.orientation * e.orientation;
    out.position_peak = std::max(out.position_peak, e.position);
    out.orientation_peak = std::max(out.orientation_peak, e.orientation);
  }
  const double n = static_cast<double>(out.steps.size());
  out.position_rms = std::sqrt(position / n);
  out.orientation_rms = std::sqrt(orientation / n);
}

/// Just before a break the contour has the segment's own formula.
LocationJet before(const Contour& contour, double s) {
  return contour.at(std::min(s, contour.length() - 1e-12));
}

OneStep run(const Contour& contour, const OneStepSettings& settings, bool closed) {
  const ScrewChain chain = machine(settings.wrist);
  const RotaryPair pair = *RotaryPair::from(chain);
  const RedundantPath path = redundant_path(
      pair, [&contour](double s) { return before(contour, s); }, contour.breaks);
  OneStep out;
  JointVector q = *path.joints(0.0, 0.0, JointVector::Zero(6));
  const std::vector<double> places = places_of(contour, settings.step);
  for (std::size_t k = 1; k < places.size(); ++k) {
    const Pose here = forward(chain, q);
    const Pose wanted = forward(chain, *path.joints(places[k], q[5], q));
    JointVector next = q + step_of(chain, rows_of(chain, q, here.translation(), settings.twist),
                                   twist_of(here, wanted, settings.twist), settings.length_unit);
    const JointVector exact = *path.joints(places[k], next[5], q);
    if (closed) next = exact;
    const LocationJet at = before(contour, places[k]);
    const Pose reached = forward(chain, next);
    StepError e;
    e.s = places[k];
    e.position = (reached.translation() - at.tip.col(0)).norm();
    e.orientation = closed ? angle_between(reached.linear() * chain.tool_axis, at.axis.col(0))
                           : vee_of_skew(reached.linear() * wanted.linear().transpose()).norm();
    out.steps.push_back(e);
    q = exact;
  }
  summarise(out);
  return out;
}

}  // namespace

std::string to_string(TwistKind kind) {
  switch (kind) {
    case TwistKind::skew:
      return "skew";
    case TwistKind::skew_spatial:
      return "skew spat";
    case TwistKind::logarithm:
      return "slog";
  }
  return "";
}

OneStep one_step_scheme(const Contour& contour, const OneStepSettings& settings) {
  return run(contour, settings, false);
}

OneStep closed_form(const Contour& contour, const OneStepSettings& settings) {
  return run(contour, settings, true);
}

}  // namespace smoothpost::paper_c
