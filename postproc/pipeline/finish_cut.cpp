#include "postproc/pipeline/finish_cut.h"

#include <algorithm>
#include <cmath>

#include "kernels/optimise/tip_fit.h"

namespace smoothpost {

namespace {

bool fit(const std::vector<double>& u, std::vector<Vec3> points, int spans, double tolerance,
         SplineJets<3>& curve) {
  TipFitProblem problem;
  problem.knots = clamped_knots(5, spans);
  problem.u = u;
  problem.points = std::move(points);
  problem.tolerance = tolerance;
  problem.hybrid = false;
  problem.explain = false;
  TipFit found = fit_tip(problem);
  if (found.failed >= 0) return false;
  curve = SplineJets<3>(found.curve);
  return true;
}

}  // namespace

LocationJet FinishCut::location(double place) const {
  LocationJet out{tip.jet(place / scale, scale), axis.jet(place / scale, scale)};
  Jet square{};
  for (std::size_t r = 0; r < 4; ++r)
    for (std::size_t k = 0; k <= r; ++k)
      square[r] += kLeibniz[r][k] * out.axis.col(static_cast<Eigen::Index>(k))
                                        .dot(out.axis.col(static_cast<Eigen::Index>(r - k)));
  Jet root{};
  root[0] = std::sqrt(square[0]);
  root[1] = square[1] / (2.0 * root[0]);
  root[2] = (square[2] - 2.0 * root[1] * root[1]) / (2.0 * root[0]);
  root[3] = (square[3] - 6.0 * root[1] * root[2]) / (2.0 * root[0]);
  out.axis = product(reciprocal(root), out.axis);
  return out;
}

std::optional<FinishCut> smooth_cut(const std::vector<SurfacePoint>& samples,
                                    const CutTolerances& tolerances) {
  FinishCut cut;
  std::vector<Vec3> points, normals;
  for (const SurfacePoint& sample : samples) {
    if (!sample.point.allFinite() || !sample.normal.allFinite()) return {};
    cut.s.push_back(points.empty() ? 0.0 : cut.s.back() + (sample.point - points.back()).norm());
    points.push_back(sample.point);
    normals.push_back(sample.normal);
  }
  for (std::size_t i = 1; i < normals.size(); ++i) {
    const Vec3 &a = normals[i - 1], &b = normals[i];
    cut.turning += std::atan2(a.x() * b.y() - a.y() * b.x(), a.x() * b.x() + a.y() * b.y());
  }
  for (const double piece : {2.0, 1.0, 0.5, 0.25}) {
    const int spans =
        std::max(6, static_cast<int>(std::ceil(cut.length() / std::max(piece, tolerances.step))));
    cut.scale = cut.length() / spans;
    cut.pieces = spans;
    std::vector<double> u;
    for (const double s : cut.s) u.push_back(std::min(s / cut.scale, static_cast<double>(spans)));
    u.back() = spans;
    // The normalised axis is off by no more than the components are.
    if (fit(u, points, spans, tolerances.tip, cut.tip) &&
        fit(u, normals, spans, 0.98 * tolerances.axis, cut.axis))
      return cut;
  }
  return {};
}

}  // namespace smoothpost
