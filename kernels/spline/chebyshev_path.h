#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <functional>
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

/// A vector-valued function, replaced on each piece by its polynomial of degree 9 through the ten
/// Chebyshev points of the piece. A piece is halved until the last two coefficients of every
/// component are below relative · range + absolute, where range is half the difference of its
/// largest and least value at the points.
///
/// Made to have derivatives of a function that only gives values (inverse kinematics along a path).
/// Analytic inside each given piece, so that the interpolant converges faster than any power; the
/// third derivative of the interpolant differs from the function's by about 3·10⁴ times the
/// tolerance over the cube of the piece's half length. Guarantees (tests): values and derivatives
/// of analytic functions; one-sided at breaks; a jump inside a piece is found.
class ChebyshevPath {
 public:
  using Function = std::function<PathValue(double)>;

  /// Appends [end of the path, to] (the first call: [from, to]), on which `f` has one formula.
  /// False: not resolved after most_halvings; nothing is appended then.
  /// @pre to > from; `f` is finite and always of the same size, at most 16.
  /// Cost: 10 values of `f` a piece that stays and a piece that is halved; 10 numbers a component.
  bool append(const Function& f, double from, double to, const ChebyshevSettings& settings);

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
  static constexpr int kPoints = 10;
  using Coefficients =
      Eigen::Matrix<double, Eigen::Dynamic, kPoints>;  ///< exactly as large as it is

  double start_ = 0.0;
  std::vector<double> ends_;
  std::vector<Coefficients> coefficients_;
};

}  // namespace smoothpost
