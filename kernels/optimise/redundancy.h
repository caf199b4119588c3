#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "kernels/core/joints.h"
#include "kernels/kinematics/joint_jet.h"
#include "kernels/kinematics/rotary_pair.h"
#include "kernels/optimise/standoff.h"
#include "kernels/qp/qp_solver.h"

// One joint more than the task needs: a bed that turns under a finishing head, a rail, a robot's
// rotation about its tool. Its value along the path is free; every other joint then follows
// exactly.
namespace smoothpost {

/// A path of the tool for a machine with one free number σ (a joint's value, or a robot's rotation
/// about its tool), as functions of one parameter s (mm along the path).
struct RedundantPath {
  double first = 0.0, last = 0.0;
  /// Ascending, `first` and `last` among them: between two neighbours the path is smooth.
  std::vector<double> breaks;
  /// The joints at s for a value of σ: the solution nearest to `near`; nothing: out of reach.
  std::function<std::optional<JointVector>(double s, double free, const JointVector& near)> joints;
  /// The joints with their derivatives by s, those of σ(s) given; likewise. Between two breaks
  /// only: at a break, of the formula of the side on which `inside` lies.
  std::function<std::optional<JointJet>(double s, const Jet& free, const JointVector& near)> jet;
};

/// Tip and tool axis of a path with their derivatives by s.
using LocationOnPath = std::function<LocationJet(double s)>;

/// The path for a chain whose redundant joint σ is: the joints by the closed form with that joint
/// held, their derivatives by joint_jet. `pair` has exactly one redundant joint.
/// Guarantees (tests): golden ik of paper_c.json to 1e-9; forward kinematics of the joints give tip
/// and axis to 1e-9 mm and 1e-12 rad for every σ; derivatives equal central differences.
/// Cost: 1 µs a solution, 3 µs a jet.   @pre as said; `pair` outlives the path
/// @throws ContractViolation if not.
/// Implements the closed form of [Yu2023]'s machine with θ2 as parameter, for any such chain.
/// Differences from the paper: it has no closed form and steps with the pseudo-inverse of a
/// Jacobian of rank 5, one linear step a point (see docs/equations.md).
RedundantPath redundant_path(const RotaryPair& pair, const LocationOnPath& location,
                             std::vector<double> breaks);
/// The redundant joint of a chain, or −1 when there is not exactly one.
int redundant_joint(const ScrewChain& chain);

/// σ along a path by values and slopes at places; between them the parabola of the slope behind the
/// first place.
struct FreeProfile {
  std::vector<double> s, free, rate;  ///< ascending s; rate = dσ/ds behind s
  double at(double place) const;
};

struct MinimumNormSettings {
  JointVector weight;            ///< one a joint, > 0: 1/v² of its velocity limit
  JointVector near;              ///< joints near the solution at the start
  double start = 0.0;            ///< σ at the start
  std::optional<double> change;  ///< σ(last) − σ(first) that is asked for; nothing: free
  double step = 0.5;             ///< mm, largest; a step never passes a break
};

struct MinimumNorm {
  bool ok = false;      ///< false: out of reach at `failed`
  double failed = 0.0;  ///< s
  FreeProfile free;
  double cost = 0.0;        ///< ∫ Σ wᵢ qᵢ'² ds
  double multiplier = 0.0;  ///< λ
  double change = 0.0;      ///< σ(last) − σ(first)
};

/// The local weighted minimum-norm resolution: at every place the rate that makes Σ wᵢ qᵢ'² least.
///
/// With q' = a + n·σ', a the joints' rates while σ stands and n those per unit of σ while the tool
/// stands,   σ' = (λ − Σ wᵢ nᵢ aᵢ) / Σ wᵢ nᵢ²,   λ = 0.
/// With `change`, λ is the constant that gives the change: of all rates with that change the least
/// cost wherever the cost does not depend on σ itself. Where the right side does not depend on σ
/// either (a bed under x and y of equal weight) it is a quadrature and λ comes in closed form;
/// elsewhere λ by secants to 1e-12.
/// Solved by Gauss collocation of 4 stages a step, which is then Gauss' quadrature.
///
/// Guarantees (tests): golden θ2 increments of paper_c.json to 1e-9; equal to the discrete global
/// optimum to 1e-5; closure to 1e-12; the rate has the least weighted norm of all.
/// Units: mm, rad.   Cost: 8 jets a step.   @pre weights > 0, sizes fit   @throws
/// ContractViolation. Implements [Yu2023] Eq. (4)-(5). Differences from the paper: Eq. (4) as
/// printed has residual 0 for every z; its norm adds mm and rad, so the result depends on the unit
/// of length: here weights; no closure there: the bed drifts from loop to loop.
MinimumNorm minimum_norm(const RedundantPath& path, const MinimumNormSettings& settings);

/// Σ wᵢ qᵢ'² and Σ wᵢ qᵢ'''² integrated along a path for a σ with derivatives, and their peaks.
struct FreeCost {
  bool ok = false;
  double velocity = 0.0, jerk = 0.0;                        ///< integrals over s
  JointVector most_velocity, most_acceleration, most_jerk;  ///< of |q'|, |q''|, |q'''| by s
};
/// By `points` Gauss points on each piece of `places` (ascending, breaks among them).
FreeCost free_cost(const RedundantPath& path, const std::function<Jet(double)>& free,
                   const std::vector<double>& places, const JointVector& velocity_weight,
                   const JointVector& jerk_weight, const JointVector& near, int points = 5);

struct GlobalSettings {
  JointVector weight;        ///< one a joint, > 0
  JointVector lower, upper;  ///< of the joints: limits, and the side that the head can work on
  JointVector near;          ///< the joints take the solution nearest to it
  double free_lower = 0.0, free_upper = 0.0;  ///< range of σ
  double grid = 0.0349065850398866;           ///< of σ (2°)
  int most_steps = 12;                        ///< of the grid, between two stations
  std::optional<double> start;                ///< σ at the first station; nothing: any
  std::optional<double> change;  ///< σ at the last station − σ at the first; nothing: any
  /// Whether the machine is clear of everything there. Asked for the chosen joints only; where it
  /// says no, that node is closed and the choice is made again, at most `most_rounds` times.
  std::function<bool(double s, const JointVector& q)> clear;
  int most_rounds = 64;
};

struct GlobalResolution {
  enum class Status {
    ok,
    out_of_limits,  ///< at `failed` no σ keeps every joint inside its limits
    no_way,  ///< every station has one, but no way leads past `failed` (or to the end asked for)
    blocked  ///< clear() refuses the ways that are left
  } status = Status::no_way;
  double failed = 0.0;         ///< s
  int joint = -1;              ///< whose limit is nearest to being kept there; −1: out of reach
  double excess = 0.0;         ///< by which it fails, mm or rad
  std::vector<double> free;    ///< σ at the stations
  std::vector<JointVector> q;  ///< likewise
  double cost = 0.0;           ///< Σ over steps of Σ wᵢ Δqᵢ²/Δs
  int rounds = 0;
};

/// The σ of least cost on a grid, along the whole path: dynamic programming over (station, σ).
///
/// With `change` and no `start`, the start is that of the free choice or the one that ends as it
/// does, whichever closed choice costs less, else the first of the grid that has any.
/// Guarantees (tests): the cost of an exhaustive search on small grids; limits; closure exact; the
/// callback; a path that leaves the side which the head can reach is refused by place and joint.
/// Cost: stations × grid × (2·most_steps + 1), plus one solution each of the inverse a node.
/// @pre stations ascending, at least 2, inside the path; sizes fit   @throws ContractViolation.
GlobalResolution resolve_globally(const RedundantPath& path, const std::vector<double>& stations,
                                  const GlobalSettings& settings);

struct SmoothFreeSettings {
  JointVector velocity_weight, jerk_weight;  ///< of ∫ Σ w qᵢ'² ds and ∫ Σ w qᵢ'''² ds
  double velocity_share = 0.0;               ///< the objective is jerk + velocity_share · velocity
  JointVector lower, upper;                  ///< of the joints
  double free_lower = 0.0, free_upper = 0.0;  ///< of σ
  std::vector<RateLimits> limits;  ///< one a joint, by s; empty: none. A limit that the start
                                   ///< breaks is one not to be broken further.
  bool fixed_start = true, fixed_end = true;  ///< σ there stays that of the seed
  double spacing = 1.0;                       ///< mm, largest piece of the spline
  double least_spacing = 0.1;                 ///< mm: breaks nearer to each other share a knot
  double trust = 0.2;                         ///< largest change of σ in a pass
  int most_passes = 12;
  QpSettings solver;
};

struct SmoothFree {
  bool ok = false;
  SplineCurve free;        ///< one component; its parameter is (s − path.first)/scale
  double scale = 1.0;      ///< mm
  double first = 0.0;      ///< path.first
  FreeCost before, after;  ///< of the seed's own spline, and of `free`
  int passes = 0;
  QpSolution solution;      ///< of the last programme, for its certificate
  Jet jet(double s) const;  ///< σ with its derivatives by s
};

/// σ as a quintic spline (C⁴) with the least ∫ Σ wᵢ qᵢ'''² ds, from a seed.
///
/// Knots are the path's breaks and between them equal pieces of at most `spacing`. Each pass is a
/// quadratic programme (QuadraticProgram): q', q'', q''' at 4 Gauss points a piece linear in σ …
/// σ''' about the last pass (Gauss-Newton), joints' positions and rates as rows, |Δσ| ≤ trust. A
/// step that does not lower the true objective, or leaves a limit, is halved. Guarantees (tests):
/// never above the seed's spline; limits; ends; KKT of the last programme; on paper C's ellipse at
/// least 40 % below minimum norm at equal closure. Cost: passes × (20 jets a piece + a programme).
/// @pre sizes fit, seed covers the path
SmoothFree smooth_free(const RedundantPath& path, const FreeProfile& seed, const JointVector& near,
                       const SmoothFreeSettings& settings);

}  // namespace smoothpost
