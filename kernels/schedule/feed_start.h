#pragma once

#include <vector>

#include "kernels/schedule/feed_solver.h"

// Internal to kernels/schedule.
namespace smoothpost {

/// Controls to start solve_feed() from: at every element a share of the
/// largest constant b that its own rows allow, and between such bottlenecks as steep as a share of
/// accelerations and jerks allows (one sweep each way), smoothed. Unlike one constant for the whole
/// path it is within a small factor of the optimum where feeds differ by powers of ten.
/// Breaks no row.   Cost: linear, a few iterations.
std::vector<double> local_law(const FeedProgram& program);

/// Lowers b about the points whose rows it breaks, a few times, and at last everywhere by what is
/// left: the result breaks no row.   @pre b > 0 at every point   Cost: up to 10 evaluations.
std::vector<double> keep_inside(const FeedProgram& program, std::vector<double> controls);

}  // namespace smoothpost
