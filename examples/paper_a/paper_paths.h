#pragma once

#include <array>
#include <string>
#include <vector>

#include "examples/paper_a/paper_literal.h"
#include "kernels/core/pose.h"
#include "kernels/smooth/corner_path.h"

// The paper's test path by several methods, each as tip and rotation over the tip's arc length.
namespace smoothpost::paper_a {

struct Tolerances {
  double tip = 0.8;    ///< mm
  double axis = 0.01;  ///< rad
};

/// A stretch: tip (columns 0 to 2, mm) and Euler angles (3 to 5, rad) as septic polynomials of t.
using Piece = Eigen::Matrix<double, 8, 6>;

/// Tip and Euler angles with the first three derivatives by arc length.
using ArcDerivatives = std::array<Eigen::Matrix<double, 6, 1>, 4>;

/// At t of a piece whose parameter does not stop there.
ArcDerivatives by_arc_length(const Piece& piece, double t);

/// What stands between two corners of the paper.
enum class Links : std::uint8_t {
  literal,  ///< §4: control points U0 … U7 with κ = λ = 0, so angles linear in s on five stretches
  decoupled,  ///< tip and angles each on their line at constant rate
  septic      ///< a septic polynomial of s with the corners' rates at its ends
};

/// Straight legs, angles linear on them.
std::vector<Piece> polyline();

/// The corners of §3.2–3.4 (κ and λ with `sign`, angles by the corners' common t) and links.
std::vector<Piece> paper_path(const Tolerances& tolerances, SignOfM2 sign, Links links);

/// The same by CornerPath over its common parameter.
CornerPath common_parameter(const Tolerances& tolerances, BlendKind kind);

/// A pose every `step` mm of arc length.
std::vector<Pose> sample(const std::vector<Piece>& path, double step);
std::vector<Pose> sample(const CornerPath& path, double step);

/// Synchronisation errors: |dᵏφ/dsᵏ on one side − on the other| for k = 1, 2, 3 (rad/mmᵏ), φ the
/// Euler angles or, for CornerPath, twice the quaternion.
struct SynchronisationErrors {
  std::array<double, 3> at_junctions{};  ///< largest
  std::array<double, 3> peak{};          ///< of the derivative itself, over the path
};
SynchronisationErrors synchronisation(const std::vector<Piece>& path);
SynchronisationErrors synchronisation(const CornerPath& path);

/// |dφ/ds| along the path, both sides of each junction: (s in mm, rad/mm).
std::vector<std::array<double, 2>> rates(const std::vector<Piece>& path);
std::vector<std::array<double, 2>> rates(const CornerPath& path);

/// Largest curvature of the tip, 1/mm.
double peak_curvature(const std::vector<Piece>& path);
double peak_curvature(const CornerPath& path);

}  // namespace smoothpost::paper_a
