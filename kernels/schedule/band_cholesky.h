#pragma once

#include <array>
#include <cstddef>
#include <vector>

// Internal to kernels/schedule.
namespace smoothpost {

/// Row i of a symmetric matrix of half-width 3: entry d is at column i − d.
using BandRow = std::array<double, 4>;

/// A = L Lᵀ in place; the diagonal then holds 1/L_ii. A pivot that rounding made not positive is
/// raised to 1e-13 of its diagonal.   @return false when a pivot is NaN.   Cost: 16 n.
bool factor_band(std::vector<BandRow>& a);

/// x becomes A⁻¹ x.   @param l  what factor_band() left
void solve_band(const std::vector<BandRow>& l, std::vector<double>& x);

}  // namespace smoothpost
