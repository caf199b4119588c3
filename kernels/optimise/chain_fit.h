#pragma once

#include <vector>

#include "kernels/core/progress.h"
#include "kernels/kinematics/screw_chain.h"

namespace smoothpost {

/// What of a chain is fitted: where a rotary axis lies, which way an axis points, or the tip of the
/// tool of length 0.
struct FitParameter {
  enum class Kind { origin, direction, tip };
  Kind kind = Kind::origin;
  int joint = -1;  ///< of origin and direction
};

/// One reading: with the joints at `q` the tip of a tool of length `tool_length` is at `place` (W),
/// or, when `sphere` is not negative, `place` away from the centre of that sphere, which is fixed
/// in W and not known.
struct TipReading {
  JointVector q;
  double tool_length = 0.0;  ///< mm
  int sphere = -1;
  Vec3 place = Vec3::Zero();  ///< mm in W
};

/// One number that is fitted: `parameter` moves along `along`. An origin and a tip in mm, a
/// direction in rad: d ← (d + δ·along)/|d + δ·along|, where `along` is at right angles to d.
struct FitUnknown {
  FitParameter parameter;
  Vec3 along = Vec3::UnitX();  ///< unit, in M
  double change = 0.0;         ///< mm or rad
  double deviation = 0.0;      ///< standard deviation of `change` that the residuals imply
};

struct ChainFit {
  enum class Status {
    ok,
    too_few,         ///< not more readings than unknowns
    not_observable,  ///< `hidden` cannot be told from each other by these readings
    not_converged
  } status = Status::too_few;
  ScrewChain chain;  ///< status ok: with the changes
  std::vector<FitUnknown> unknowns;
  std::vector<int> hidden;          ///< not_observable: unknowns, by index
  double condition = 0.0;           ///< largest by least singular value, of unknowns scaled alike
  std::vector<Vec3> spheres;        ///< their centres in W, mm
  std::vector<Vec3> before, after;  ///< residuals by reading, in W, mm
};

/// Origins, directions and tip of a chain from measured positions of the tip, by least squares.
///
/// Definition, with tip(q; θ) of forward() and the unknowns θ:
///   minimise Σᵢ |tip(qᵢ; θ) − c_s(i) − placeᵢ|²  over θ and the centres c_s  (c = 0 where known).
/// The centres are the means of what is left of each sphere, so that only θ is searched.
///
/// Observability: the Jacobian J of the residuals (centres eliminated), its columns in mm of tip
/// per mm, directions times the largest distance of a tip from the axis, has the singular values σ.
/// A direction of θ with σ/√(3n) below kLeastEffect moves the readings by less than that share of
/// its own size: it is not observable, and the unknowns with a component of at least a tenth in it
/// are `hidden`.
///
/// Guarantees (tests): synthetic readings without noise give the parameters back; with noise within
/// a few of their standard deviations; a shift of axes and tip together is reported as hidden.
/// Units: mm, rad.   Cost: O(readings · unknowns) forward() per step, some ten steps; memory
/// 3 · readings · unknowns numbers. One thread. NLopt's L-BFGS in coordinates in which the first J
/// is orthonormal.
/// @pre at least one parameter; joint numbers exist; origin only of rotary joints; q sizes fit;
/// spheres count from 0   @throws ContractViolation if not.
ChainFit fit_chain(const ScrewChain& chain, const std::vector<TipReading>& readings,
                   const std::vector<FitParameter>& parameters);

inline constexpr double kLeastEffect = 1e-4;

}  // namespace smoothpost
