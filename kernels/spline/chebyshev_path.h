#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

namespace smoothpost {

/// A value of at most 16 components; no allocation.
using PathValue = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 16, 1>;

/// A value with its first three derivatives by the parameter.
using ChebyshevJet = std::array<PathValue, 4>;

struct ChebyshevSettings {
  double relative = 1e-9;  ///< of the component's range on a piece
  double absolute = 1e-11;
  int most_halvings = 24;
};

struct ChebyshevJetSettings {
  double relative = 5e-4;  ///< of the largest third derivative of the component on a piece
  double value = 1e-9;     ///< of 1 + the component's range on a piece
  int most_halvings = 24;
};

/// A vector-valued function, replaced on each piece by its polynomial of degree 9 through the ten
/// Chebyshev points of the piece. A piece is halved until the last two coefficients of every
/// component are below relative · range + absolute, where range is half the difference of its
/// largest and least value at the points.
///
/// Derivatives of a function that only gives values (inverse kinematics along a path) come out
/// with the rounding of the values times 3·10⁴ over the cube of the half length: useless on very
/// short pieces. append_jets() takes a function that gives its derivatives and has no such limit.
/// Analytic inside each given piece, so that the interpolant converges faster than any power; the
/// third derivative of the interpolant differs from the function's by about 3·10⁴ times the
/// tolerance over the cube of the piece's half length. Guarantees (tests): values and derivatives
/// of analytic functions; one-sided at breaks; a jump inside a piece is found, also where it lies
/// between two halves, but for the outermost 0.7 % (append) or 1.3 % (append_jets) of what is asked
/// for, which no point sees: compare the ends.
class ChebyshevPath {
 public:
  using Function = std::function<PathValue(double)>;

  /// Appends [end of the path, to] (the first call: [from, to]), on which `f` has one formula.
  /// False: not resolved after most_halvings; nothing is appended then.
  /// @pre to > from; `f` is finite and always of the same size, at most 16.
  /// Cost: 10 values of `f` a piece that stays and a piece that is halved; 10 numbers a component.
  bool append(const Function& f, double from, double to, const ChebyshevSettings& settings);

  /// A value with its derivatives; nothing where there are none.
  using JetFunction = std::function<std::optional<ChebyshevJet>(double)>;

  /// The same for a function that knows its derivatives: the third one is interpolated in seven
  /// Chebyshev points and integrated three times from the middle of the piece, so that derivatives
  /// have the function's own accuracy on pieces of any length. A piece is halved until the last two
  /// coefficients of every component's third derivative are below relative · (its largest value)
  /// + third[component], and value and first derivative at the outermost points are the function's
  /// to value · (1 + range) and 1e-6 of the largest first derivative.
  /// False, and nothing appended: not resolved after most_halvings, or `f` gave nothing.
  /// @pre to > from; `f` is finite; third.size() is the size of its values.
  /// Cost: 7 jets of `f` a piece that stays and a piece that is halved.
  bool append_jets(const JetFunction& f, double from, double to, const PathValue& third,
                   const ChebyshevJetSettings& settings);

  /// Drops everything behind the first `pieces` pieces.
  void shorten(std::size_t pieces);

  /// Its pieces from `first` on, moved in x by −start.
  ChebyshevPath tail(std::size_t first, double start) const;

  std::size_t pieces() const { return ends_.size(); }
  double from(std::size_t piece) const { return piece == 0 ? start_ : ends_[piece - 1]; }
  double to(std::size_t piece) const { return ends_[piece]; }

  /// The piece that x is in, the later one at a break; the first or last beyond the ends.
  std::size_t piece_at(double x) const;

  /// Value and derivatives by the polynomial of `piece`, also beyond its ends.
  /// Cost: about 0.1 µs for ten components.
  ChebyshevJet jet(std::size_t piece, double x) const;
  PathValue value(std::size_t piece, double x) const;

 private:
  static constexpr double kMeets = 1e-7;  ///< of 1 + the component's range on a piece
  static constexpr int kPoints = 10;
  static constexpr int kJets = kPoints - 3;
  using Coefficients =
      Eigen::Matrix<double, Eigen::Dynamic, kPoints>;  ///< exactly as large as it is

  bool meets(const Coefficients& next, const PathValue& range) const;

  double start_ = 0.0;
  std::vector<double> ends_;
  std::vector<Coefficients> coefficients_;
};

}  // namespace smoothpost
