#pragma once

#include <string>
#include <vector>

#include "examples/paper_c/paper_paths.h"

// The resolved-rate scheme of paper C, as its Table 2 was most probably made: one linear step a
// point with the pseudo-inverse of the 6 × 6 Jacobian, cut off at rank 5. Only here and in tests:
// the product solves the closed form.
namespace smoothpost::paper_c {

/// How the step from one pose to the next becomes a twist (ω, v).
enum class TwistKind {
  skew,          ///< ω = vee(dR − dRᵀ)/2, v = p_d − p, at the tool point
  skew_spatial,  ///< the same ω, v = p_d − dR·p, at the part's origin
  logarithm      ///< of T_d·T⁻¹, at the part's origin
};
std::string to_string(TwistKind kind);

struct OneStepSettings {
  double wrist = 90.0;       ///< Le, mm
  double step = 0.025;       ///< mm, rounded to a whole number on every segment
  double length_unit = 1.0;  ///< mm that weigh as much as a radian: 1 or 1000
  TwistKind twist = TwistKind::skew;
};

/// Errors after one step from the exact pose before.
struct StepError {
  double s = 0.0;            ///< mm, of the pose that was aimed at
  double position = 0.0;     ///< mm
  double orientation = 0.0;  ///< rad
};

struct OneStep {
  std::vector<StepError> steps;
  double position_rms = 0.0, position_peak = 0.0;        ///< mm
  double orientation_rms = 0.0, orientation_peak = 0.0;  ///< rad
};

/// Goes once along a contour; the bed's angle is the one that the steps give.
OneStep one_step_scheme(const Contour& contour, const OneStepSettings& settings);

/// The same places by the closed form: what the product's joints miss the poses by.
OneStep closed_form(const Contour& contour, const OneStepSettings& settings);

}  // namespace smoothpost::paper_c
