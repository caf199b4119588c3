#include "kernels/optimise/dense_fit.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/optimise/near_fit.h"

namespace smoothpost {

namespace {

constexpr double kAtNodes = 0.5;  // of the tolerances; the rest is for the way between
constexpr std::array<std::size_t, 3> kNodesPerSpan = {4, 2, 1};
constexpr std::size_t kShortSpans = 6;  // of one node each, at an end with given derivatives
constexpr std::array<double, 3> kBetween = {0.25, 0.5, 0.75};

Vec3 rate_between(const DenseNode& a, const DenseNode& b) {
  return rotation_log(a.rotation.toRotationMatrix().transpose() * b.rotation.toRotationMatrix()) /
         (b.sigma - a.sigma);
}

double bulge(const Vec3& jump, double in, double out) {
  const double longer = std::max(in, out);
  return jump.norm() * longer * longer / (4.0 * (in + out));
}

/// Nodes that end a span.
std::vector<std::uint32_t> span_ends(std::span<const DenseNode> nodes, std::size_t per_span,
                                     bool short_start, bool short_end) {
  std::vector<std::uint32_t> ends;
  std::size_t since = 0;
  for (std::uint32_t i = 1; i < nodes.size(); ++i) {
    const bool near_end =
        (short_start && i <= kShortSpans) || (short_end && i + 1 + kShortSpans >= nodes.size());
    if (++since >= per_span || near_end || nodes[i].keep || i + 1 == nodes.size()) {
      ends.push_back(i);
      since = 0;
    }
  }
  return ends;
}

/// The curve of one problem, σ counted in `unit` mm from the first node.
struct Scaled {
  NearFitProblem problem;
  double unit = 1.0;
};

/// Takes an end's pose into its column of the values and returns its derivatives by the problem's
/// u.
Eigen::MatrixXd take_end(const PoseDerivatives& at, Eigen::MatrixXd::ColXpr values, double unit) {
  Eigen::MatrixXd out(7, 3);
  const double sign = at.rotation[0].dot(Eigen::Vector4d(values.tail<4>())) < 0.0 ? -1.0 : 1.0;
  values << at.tip[0], sign * at.rotation[0];
  double scale = unit;
  for (std::size_t r = 1; r < 4; ++r, scale *= unit) {
    out.col(static_cast<Eigen::Index>(r - 1)).head<3>() = scale * at.tip[r];
    out.col(static_cast<Eigen::Index>(r - 1)).tail<4>() = sign * scale * at.rotation[r];
  }
  return out;
}

Scaled scaled_problem(std::span<const DenseNode> nodes, const std::optional<PoseDerivatives>& start,
                      const std::optional<PoseDerivatives>& end, const DenseSettings& settings,
                      const std::vector<std::uint32_t>& ends) {
  Scaled out;
  const double origin = nodes.front().sigma;
  out.unit = (nodes.back().sigma - origin) / static_cast<double>(ends.size());
  NearFitProblem& p = out.problem;
  p.hybrid = false;
  p.explain = false;
  const auto count = static_cast<Eigen::Index>(nodes.size());
  p.values.resize(7, count);
  Eigen::Vector4d last = Eigen::Vector4d::Zero();
  for (Eigen::Index i = 0; i < count; ++i) {
    const DenseNode& node = nodes[static_cast<std::size_t>(i)];
    p.u.push_back((node.sigma - origin) / out.unit);
    Eigen::Vector4d q;
    q << node.rotation.w(), node.rotation.vec();
    if (q.dot(last) < 0.0) q = -q;
    last = q;
    p.values.col(i) << node.tip, q;
    if (node.exact) p.exact.push_back(static_cast<std::size_t>(i));
  }
  p.tolerance.resize(7);
  // |δtip| ≤ √3·box; the angle is at most 2·|δq| ≤ 4·box.
  p.tolerance.head<3>().setConstant(kAtNodes * settings.tip_tolerance / std::sqrt(3.0));
  p.tolerance.tail<4>().setConstant(kAtNodes * settings.rotation_tolerance / 4.0);
  if (start) p.start = take_end(*start, p.values.col(0), out.unit);
  if (end) p.end = take_end(*end, p.values.col(count - 1), out.unit);
  p.knots.degree = 5;
  p.knots.values.assign(6, 0.0);
  for (const std::uint32_t i : ends) p.knots.values.push_back(p.u[i]);
  p.knots.values.insert(p.knots.values.end(), 5, p.u.back());
  return out;
}

bool within(const DenseNode& a, const DenseNode& b, double t, const Pose& got,
            const DenseSettings& settings) {
  const Vec3 tip = a.tip + t * (b.tip - a.tip);
  if ((got.translation() - tip).norm() > settings.tip_tolerance) return false;
  const Mat3 wanted = a.rotation.slerp(t, b.rotation).toRotationMatrix();
  if (settings.whole_rotation)
    return rotation_log(wanted.transpose() * got.linear()).norm() <= settings.rotation_tolerance;
  return angle_between(wanted.col(2), got.linear().col(2)) <= settings.rotation_tolerance;
}

bool keeps_tolerances(std::span<const DenseNode> nodes, const DenseFit& fit,
                      const DenseSettings& settings) {
  std::size_t first = 0;
  for (std::size_t span = 0; span < fit.ends.size(); ++span) {
    const std::size_t last = fit.ends[span];
    for (std::size_t i = first + 1; i <= last; ++i) {
      const DenseNode& a = nodes[i - 1];
      const DenseNode& b = nodes[i];
      const double from = a.sigma - nodes[first].sigma;
      if (!within(a, b, 0.0, fit.curve.at(span, from), settings)) return false;
      for (const double t : kBetween)
        if (!within(a, b, t, fit.curve.at(span, from + t * (b.sigma - a.sigma)), settings))
          return false;
    }
    first = last;
  }
  return true;
}

}  // namespace

double dense_bulge(const DenseNode& before, const DenseNode& node, const DenseNode& after,
                   const DenseSettings& settings) {
  const double in = node.sigma - before.sigma;
  const double out = after.sigma - node.sigma;
  const Vec3 tip = (after.tip - node.tip) / out - (node.tip - before.tip) / in;
  const Vec3 turn = rate_between(node, after) - rate_between(before, node);
  return std::max(bulge(tip, in, out) / settings.tip_tolerance,
                  bulge(turn, in, out) / settings.rotation_tolerance);
}

std::optional<DenseFit> fit_dense(std::span<const DenseNode> nodes,
                                  const std::optional<PoseDerivatives>& start,
                                  const std::optional<PoseDerivatives>& end,
                                  const DenseSettings& settings) {
  require(nodes.size() >= 2, "fit_dense: at least two nodes");
  require(settings.tip_tolerance > 0.0 && settings.rotation_tolerance > 0.0,
          "fit_dense: tolerances above 0");
  for (const std::size_t per_span : kNodesPerSpan) {
    std::vector<std::uint32_t> ends =
        span_ends(nodes, per_span, start.has_value(), end.has_value());
    const Scaled scaled = scaled_problem(nodes, start, end, settings, ends);
    NearFit fit = fit_near(scaled.problem);
    if (fit.failed >= 0) continue;
    for (double& u : fit.curve.knots.values) u *= scaled.unit;
    DenseFit out{PoseCurve(fit.curve), std::move(ends)};
    if (keeps_tolerances(nodes, out, settings)) return out;
  }
  return {};
}

}  // namespace smoothpost
