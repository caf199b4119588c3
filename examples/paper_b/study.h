#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "kernels/core/tool_path.h"
#include "kernels/optimise/rotary_jerk.h"
#include "kernels/optimise/standoff.h"

// The two cases of [Ding2025] by several methods, as numbers. Not for production: feed is constant
// over the whole path, and some of the methods are there to show what they do wrong.
namespace smoothpost::paper_b {

/// A path and what is asked of it.
struct Case {
  std::string name;
  std::vector<CutterLocation> locations;
  std::vector<double> place;  ///< arc length of the tip at each, mm, from 0
  std::vector<double> via;    ///< where via points lie, mm
  double lead = 0.0;          ///< rad, from the programmed axis, either way
  double tilt = 0.0;          ///< rad
  double feed = 0.0;          ///< programmed, mm/s
  double length() const { return place.back(); }
};

/// Case 1 (1200 mm, small changes of the normal, lead and tilt 5°, 20 m/min) or Case 2 (627.5 mm,
/// two rotations of 77°, lead 15°, tilt 10°, 15 m/min): the points of a CSV file with columns
/// x, y, z, i, j, k (docs/formats_csv.md), all else as the paper has it.
/// @pre number is 1 or 2   @throws std::runtime_error when the file has no such points
Case read_case(const std::filesystem::path& file, int number);

/// The laser of the paper's Table 2 with the nozzle's tip `arm` mm from where the rotaries cross.
ScrewChain laser(double arm);

/// Limits of the paper's Table 2 by time (mm, rad, s).
inline constexpr RateLimits kLinearLimits{2000.0, 12000.0, 120000.0};
inline constexpr RateLimits kRotaryLimits{10.0, 80.0, 200.0};
inline constexpr RateLimits kStandoffLimits{2000.0, 40000.0, 400000.0};

enum class Method { qi, qi_c2, via, monotone, cone, via_cone };
std::string to_string(Method method);

/// How the rotaries are asked for.
struct Request {
  Method method = Method::cone;
  double feed = 0.0;             ///< mm/s
  bool limits = false;           ///< of the rotaries (Table 2) at this feed
  double tension = 0.0;          ///< 1/s⁴: adds tension·∫ q'² dt to ∫ q'''² dt; `via` only
  std::vector<double> more_via;  ///< mm, places of cutter locations taken as via points besides
};

/// A case prepared: tip smoothed to 5 µm, windows and via points on knots four locations apart.
class Study {
 public:
  /// @param last_word_by_ipopt  the last programme of each is solved by Ipopt as well
  explicit Study(Case given, bool last_word_by_ipopt = true);

  const Case& path() const { return case_; }
  const SplineCurve& tip() const { return tip_; }
  double spans() const { return problem_.knots.last(); }
  /// Pieces of the spline a second.
  double rate(double feed) const { return feed * spans() / case_.length(); }

  /// Rotaries by one of the optimising methods; status says whether there are any.
  RotaryResult rotaries(const Request& request) const;
  /// Largest constant feed at which a method keeps the rotaries' limits, mm/s.
  double largest_feed(Method method) const;

  /// Tool axis of the baselines at u.   @pre method is qi or qi_c2
  std::function<Vec3(double)> baseline_axis(Method method) const;
  /// Rotaries that point along an axis, nearest to `before`.
  static std::array<double, 2> rotaries_of(const Vec3& axis, double before);

  /// Programmed axis, tangent of the tip across it, and N × T at u.
  OrientationWindow window(double u) const;
  /// Windows at the cutter locations, and via points as Request has them.
  const std::vector<OrientationWindow>& windows() const { return problem_.windows; }
  std::vector<RotaryVia> via_points(const Request& request) const;

 private:
  RotaryProblem problem_for(const Request& request) const;
  RotaryResult with_tension(const RotaryProblem& problem, double weight) const;

  Case case_;
  bool ipopt_;
  ScrewChain chain_;
  SplineCurve tip_;
  RotaryProblem problem_;  ///< windows, seeds, knots, range; neither vias nor limits
};

/// Joints over time by one method.
struct Motion {
  std::vector<double> u;                      ///< of the spline, equal steps
  std::vector<double> time;                   ///< s
  std::vector<std::array<double, 6>> joints;  ///< mm, rad
  std::vector<std::array<double, 6>> jerk;    ///< mm/s³, rad/s³
  std::vector<Vec3> axis;
  double worst_limit = 0.0;  ///< largest |derivative|/limit of Table 2 over the grid; q4, q5 of
                             ///< splines and q1 … q3, q6
};

/// Quartiles, largest and root mean square of |jerk| over the grid.
struct JerkNumbers {
  double lower = 0.0, median = 0.0, upper = 0.0, peak = 0.0, rms = 0.0;
};
JerkNumbers jerk_numbers(const Motion& motion, int joint);
/// Root mean square of the length of (q1''', q2''', q3'''), mm/s³.
double linear_jerk_rms(const Motion& motion);

/// Largest deviations from the programmed axis over the grid, rad.
struct Deviation {
  double lead = 0.0, tilt = 0.0, total = 0.0;
};
Deviation deviation(const Study& study, const Motion& motion);

/// A head, a feed and a standoff.
struct Setting {
  double arm = 0.0;                       ///< L0, mm
  double feed = 0.0;                      ///< mm/s
  const SplineCurve* standoff = nullptr;  ///< q6; none: 0
  int steps = 6276;                       ///< of the grid; the baselines' are 4 ms long
};

/// Derivatives in closed form on an equal-time grid.
Motion motion_of_splines(const Study& study, const SplineCurve& rotary, const Setting& setting);
/// The baselines at 4 ms, jerk by third differences (at 15 m/min the cutter locations of Case 2).
Motion motion_of_baseline(const Study& study, Method method, const Setting& setting);

/// Table 2 by u at a feed, with 5 mm of the standoff's range [−100, 20] mm kept in reserve.
StandoffOptions standoff_options(const Study& study, double feed, bool limits);

}  // namespace smoothpost::paper_b
