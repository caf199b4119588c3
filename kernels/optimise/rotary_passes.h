#pragma once

#include <optional>
#include <vector>

#include "kernels/optimise/rotary_jerk.h"

// Internal to kernels/optimise.
namespace smoothpost {

/// A half-space normal·O ≥ least.
struct HalfSpace {
  Vec3 normal;
  std::string_view name;
  double least = 0.0;
};
/// The half-spaces of a window with unit normals. The widest cone is the pyramid inside it whose
/// edges lie on it, where the corners of lead and tilt are outside. Cuts come last.
std::vector<HalfSpace> half_spaces(const OrientationWindow& w);

/// The convex passes over one problem of optimise_rotaries(): programmes that are linear about the
/// last pass. The problem outlives it.
class RotaryPasses {
 public:
  static constexpr double kHolds = 1e-9;  ///< rad-like: a window is kept
  RotaryPasses(const RotaryProblem& problem, const RotarySettings& settings);

  /// The programme with limits of one piece taking t times as long (without a law), linear about
  /// the last pass.
  QuadraticProgram programme(double t);
  /// Takes the multipliers of the windows, for the curvature of the next programme.
  void learn(const QpSolution& solution);
  /// The solution that was learned last as a start of the programme that was made last; nullptr:
  /// none was learned, or the rotaries have gone another way since.
  const QpSolution* start();
  /// Moves the place of linearisation to the spline; half the way when it violates more than the
  /// one before.
  void follow(const SplineCurve& q);
  /// `objective` is that of this pass' rotaries.
  bool settled(double objective);

  double outside() const { return outside_; }  ///< largest, of the rotaries followed last
  int passes() const { return passes_; }

 private:
  /// A row of a window: normal·O ≥ 0, and which of its half-spaces. Other rows have window −1 and
  /// are the same in every pass.
  struct WindowRow {
    int window = -1;
    std::size_t side = 0;
    Vec3 normal = Vec3::Zero();
    NewRow row;
  };
  /// A place at which motion by time is looked at.
  struct LawPlace {
    double u = 0.0;
    double time = 0.0;  ///< weight of the place in ∫ dt
    PathSpeed speed;
  };

  void find_law_places();
  SplineLayout layout_at(double t) const;
  void add_cost(QuadraticProgram& qp, double t) const;
  void add_law_cost(QuadraticProgram& qp) const;
  void add_limits(QuadraticProgram& qp, double t) const;
  void add_monotone(QuadraticProgram& qp) const;
  void add_window(const SplineLayout& layout, std::size_t i);
  void add_curvature(QuadraticProgram& qp, std::size_t i) const;
  std::vector<NewRow> rows(const SplineLayout& layout);
  Vec3 axis_at(const std::array<double, 2>& q) const;
  std::array<Vec3, 2> slopes_at(const std::array<double, 2>& q) const;

  const RotaryProblem& in_;
  const RotarySettings& settings_;
  mutable JointVector joints_;
  std::vector<std::array<double, 2>> at_;
  std::vector<Vec3> pull_;  ///< Σ multiplier·normal of every window
  std::vector<WindowRow> window_rows_;
  std::optional<QpSolution> learned_;
  /// Its multipliers: of the half-spaces of every window, and of the other rows in their order.
  std::vector<std::vector<double>> held_;
  std::vector<std::array<double, 2>> other_held_;
  std::vector<LawPlace> quadrature_;
  double fastest_ = 1.0;  ///< du/dt
  double outside_ = 0.0;
  double change_ = 0.0;
  double objective_ = -1.0;
  int passes_ = 0;
};

/// What optimise_rotaries() reports as the objective, of any rotaries.
double rotary_objective(const RotaryProblem& problem, const SplineCurve& q);

}  // namespace smoothpost
