#pragma once

#include <array>
#include <vector>

namespace smoothpost {

/// Which ends of a stretch are at rest.
struct RestEnds {
  bool start = true, end = true;

  int count() const { return (start ? 1 : 0) + (end ? 1 : 0); }
};

/// What a RestMap is made for: never a limit, only where the parameter is dense. Halving or
/// doubling the speed changes the optimal time by 3e-5.
struct RestGrading {
  double speed = 1.0;         ///< v > 0, ds/dt that the stretch allows; infinity: none
  double acceleration = 1.0;  ///< A > 0, d²s/dt² near the ends; infinity: none
  double jerk = 1.0;          ///< J > 0, d³s/dt³ near the ends; infinity: none
};

/// Where on a RestMap: φ‴ kinks between the zones.
enum class MapZone { start_ramp, cruise, end_ramp };

/// The graded map s = φ(w) of a stretch that begins or ends at rest: φ ~ w³ there, so that with any
/// smooth positive b(w) = (dw/dt)² the speed ds/dt and d²s/dt² are 0 at the end.
///
/// Definition: with r(u) = 2u³ − 2u⁴ + 0.6u⁵ (r(1) = 0.6, r'(1) = 1, r''(1) = r'''(1) = 0),
///   φ = v τ r(w/τ)                  for w < τ,
///   φ = 0.6 v τ + v (w − τ)         for τ ≤ w ≤ W − τ,
///   φ = L − v τ r((W − w)/τ)        for w > W − τ,
///   τ = max(√(12 v/J), 16/9·v/A),   W = (L − 1.2 v τ)/v + 2τ;
/// where 1.2 v τ > L, v is the one for which it is L and there is no cruise. With one end at rest
/// there is one ramp (0.6 in place of 1.2), with none φ = v w.
/// Guarantees (tests): golden values; φ(0) = 0, φ(W) = L; derivatives equal central differences;
/// C3; inverse(φ(w)) = w. Units: s in any unit of length, w in seconds: at b = 1 the stretch runs
/// at v. Cost: no allocation; inverse() about eight evaluations. Not from a paper;
/// docs/equations.md.
class RestMap {
 public:
  RestMap() = default;
  /// Where A and J are both infinite the ramp is 2 % of L/v.
  /// @pre L > 0, grading > 0 and, of v and (A, J), one finite if an end is at rest; v finite if
  /// none is   @throws ContractViolation
  RestMap(double length, const RestGrading& grading, RestEnds ends);

  double length() const { return length_; }
  double extent() const { return extent_; }  ///< W
  double ramp() const { return ramp_; }      ///< τ
  double speed() const { return speed_; }    ///< v = φ' in the cruise
  RestEnds ends() const { return ends_; }

  MapZone zone(double w) const;
  /// φ, φ', φ'', φ''' at w, by the formula of that zone.
  std::array<double, 4> at(double w, MapZone zone) const;
  /// w of s.   @return within [0, W]; s outside [0, L] counts as the end.
  double inverse(double s) const;
  /// The ends of the ramps inside (0, W), ascending: the places where φ''' kinks.
  std::vector<double> kinks() const;

 private:
  double length_ = 0.0, extent_ = 0.0, ramp_ = 0.0, speed_ = 1.0;
  RestEnds ends_;
};

}  // namespace smoothpost
