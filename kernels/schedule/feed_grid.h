#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

#include "kernels/schedule/feed_path.h"
#include "kernels/schedule/lobatto_rule.h"
#include "kernels/schedule/rest_map.h"

// Internal to kernels/schedule.
namespace smoothpost {

inline constexpr int kMaxFeedLanes = 16;
inline constexpr double kNoCap = 1e9;  ///< of b where nothing limits the velocity

/// First to third derivative of the length that the limits of the tip are about.
///
/// With l the tip's arc length: l itself where l' ≥ 2δ, δ = 0.005 mm per unit of s; below that
///   σ' = δ f(l'/δ),   f(t) = 3/4 + 3/8 t² − t⁴/64   (f(2) = 2, f'(2) = 1, f''(2) = 0, f'(0) = 0),
///   σ'' = f' l'',   σ''' = f' l''' + f'' l''²/δ,
/// so that σ' is C² in l' and never below 0.00375: while the tool turns in place, its limits hold
/// for 0.00375 s. f' ~ l' takes away the 1/l' of l''' where the tip nearly stands and turns back.
/// Where l' ≤ 1e-9, l'' and l''' are not read.
/// (1, 0, 0) below l' = 0.01 in its place is a jump of the row inside elements: dilations up to 13
/// % on random paths, and turning slowed by the limits of the tip.
std::array<double, 3> limited_length(const PathJet& jet);

/// The limits as lanes: the joints, then the tip, then zeros up to a multiple of 8. A lane without
/// a limit has the reciprocal 0.
struct FeedLanes {
  int joints = 0;
  int width = 8;                                                         ///< 8 or 16
  std::array<double, kMaxFeedLanes> velocity{}, acceleration{}, jerk{};  ///< reciprocals
  double turn_rate = 0.0;                                                ///< reciprocal

  static FeedLanes from(const FeedLimits& limits);
  int tip() const { return joints; }
};

/// A part of a path with its map: s = from + φ(w).
struct FeedStretch {
  const FeedPath* path = nullptr;
  FeedLanes lanes;
  double from = 0.0, to = 0.0;
  RestMap map;
  const std::function<bool()>* going = nullptr;  ///< asked by every iteration, on any thread;
                                                 ///< false: what is reached counts
};

/// Derivatives by w at one place: lane l at [l], [width + l], [2·width + l].
///
/// q_w = q' φ',   q_ww = q'' φ'² + q' φ'',   q_www = q''' φ'³ + 3 q'' φ' φ'' + q' φ'''.
/// The tip's lane has limited_length() for q.
struct FeedRow {
  std::array<double, 3 * kMaxFeedLanes> q{};
  double tip = 0.0, turn = 0.0;  ///< first derivatives of arc length and turning
  double feed = 0.0;             ///< mm/s, of the piece
  double pace = 0.0;             ///< ds/dw over the rate of the piece (FeedPath::rate)
};

/// One interval of w on which b is a cubic. It lies in one zone of the map.
struct FeedElement {
  double begin = 0.0, end = 0.0;  ///< w
  std::size_t piece = 0;          ///< of the path
  MapZone zone = MapZone::cruise;
};

/// The row at w inside an element, seen from inside the element.   Cost: one call of path.jet.
FeedRow feed_row(const FeedStretch& stretch, const FeedElement& element, double w);

/// Largest b that velocities, feed and turn rate allow there, at most kNoCap.
double feed_cap(const FeedLanes& lanes, const FeedRow& row);

/// Collocation points on elements: rows, and the clamped cubic B-spline b(w) on them.
struct FeedGrid {
  std::vector<FeedElement> elements;
  LobattoRule rule;
  int width = 8;
  std::vector<double> rows;  ///< 3·width a point, as FeedRow::q; points of elements one by one,
                             ///< both ends of each
  std::vector<double> cap;   ///< feed_cap() of a point
  std::vector<double> tip, turn;  ///< of a point, as in FeedRow
  std::vector<FeedRow> probes;    ///< two an element, to verify interpolation; empty: not wanted
  std::vector<std::array<double, 16>> basis;  ///< of an element: what control e + j gives to
                                              ///< (w − begin)^k at [4k + j]

  int points_per_element() const { return static_cast<int>(rule.nodes.size()); }
  std::size_t points() const { return elements.size() * rule.nodes.size(); }
  int controls() const { return static_cast<int>(elements.size()) + 3; }
  double place(const FeedElement& element, double share) const {
    return share >= 1.0 ? element.end : element.begin + share * (element.end - element.begin);
  }
};

/// Where in an element the two probes are, as shares.
std::array<double, 2> probe_shares(const LobattoRule& rule);

/// A rising function of w, piecewise linear, in which elements are to be of equal size.
struct GridMeasure {
  std::vector<double> w, value;  ///< both ascending, from 0 to the map's extent
  double at(double place) const;
};

/// Elements for a stretch: every break of the path and every kink of the map is an end of one;
/// between those they are of about equal size in `measure`. Pieces shorter than 1e-4 of the size
/// aimed at (below a microsecond of motion) count as a point.
/// @param count  elements aimed at; more where breaks need them
std::vector<FeedElement> feed_elements(const FeedStretch& stretch, const GridMeasure& measure,
                                       int count);

/// Evaluates the rows.   Cost: points − 1 (+ 2 probes) calls of path.jet an element.
FeedGrid feed_grid(const FeedStretch& stretch, std::vector<FeedElement> elements, int points,
                   bool probes);

/// The basis of the elements, see FeedGrid::basis.
std::vector<std::array<double, 16>> cubic_basis(const std::vector<FeedElement>& elements);

/// Greville's places of the controls: where control j of a linear b(w) is b itself.
std::vector<double> greville_places(const std::vector<FeedElement>& elements);

/// b on element e as a polynomial of w − begin, lowest power first.
std::array<double, 4> cubic_of(const FeedGrid& grid, const std::vector<double>& controls,
                               std::size_t e);

/// b and its three derivatives by w at `d` past the start of element e.
std::array<double, 4> cubic_values(const FeedGrid& grid, const std::vector<double>& controls,
                                   std::size_t e, double d);

}  // namespace smoothpost
