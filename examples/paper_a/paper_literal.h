#pragma once

#include <array>
#include <span>
#include <vector>

#include "kernels/spline/acr_spline.h"

// Formulas of [Cai2025] as they are printed, for its Tables 2 and 3. Not for production: Euler
// angles, spans that depend on the coordinate frame. kernels/smooth has what is used instead.
namespace smoothpost::paper_a {

/// The paper's test path (Table 1): five tips (mm) and Euler angles (alpha, beta, gamma in rad,
/// R = Rz(alpha) Ry(beta) Rx(gamma)). The last tip's x is 255; Table 1 prints 235, with which
/// corner 3 of Tables 2 and 3 is not reached.
extern const std::array<Vec3, 5> kTips;
extern const std::array<Vec3, 5> kAngles;

/// One corner of the test path, of the tips or the angles.
struct LiteralCorner {
  Vec3 vertex, incoming, outgoing;  ///< unit directions
  double length = 0.0;              ///< L, Eq. (17) or (29) with the printed 12
  std::array<Vec3, 11> points;      ///< Q0 … Q10, Eq. (14) or (18)
};

/// L = min(eps, legs·sin(θ/2)/12), Eq. (17).   @pre 1 ≤ corner ≤ 3
LiteralCorner tip_corner(std::size_t corner, double eps);
/// eps is converted by Eq. (28), 2 sin(eps/2)/|J·T_m|, and limited as in Eq. (29).
LiteralCorner angle_corner(std::size_t corner, double eps);

/// Tool axis and its Jacobian by the Euler angles, Eq. (23) and (26).
Vec3 tool_axis(const Vec3& angles);
Mat3 tool_axis_jacobian(const Vec3& angles);

/// κ, λ and e of Eq. (30)–(37) over the FIRST coordinate of the points Q1 … Q4.
struct LiteralFit {
  AcrShape shape;
  double error = 0.0;  ///< |e|
};

/// Which sign m2 has in B of Eq. (33): the paper prints plus, its tables were made with minus.
enum class SignOfM2 : std::uint8_t { printed, of_the_tables };

/// Solves Eq. (37). e is Eq. (34) with the two factors 2 that it lacks before D3, D4 and D5.
LiteralFit literal_fit(const LiteralCorner& corner, SignOfM2 sign);

}  // namespace smoothpost::paper_a
