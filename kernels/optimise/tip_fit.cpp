#include "kernels/optimise/tip_fit.h"

#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/optimise/near_fit.h"

namespace smoothpost {

TipFit fit_tip(const TipFitProblem& p) {
  require(p.u.size() == p.points.size() && p.u.size() >= 2, "a point for every parameter");
  NearFitProblem near;
  near.knots = p.knots;
  near.u = p.u;
  near.values.resize(3, static_cast<Eigen::Index>(p.points.size()));
  for (std::size_t i = 0; i < p.points.size(); ++i)
    near.values.col(static_cast<Eigen::Index>(i)) = p.points[i];
  near.tolerance = Eigen::VectorXd::Constant(3, p.tolerance / std::sqrt(3.0));
  near.hybrid = p.hybrid;
  near.solver = p.solver;
  near.explain = p.explain;
  NearFit fit = fit_near(near);
  return {std::move(fit.curve), std::move(fit.solutions), fit.failed, fit.place};
}

}  // namespace smoothpost
