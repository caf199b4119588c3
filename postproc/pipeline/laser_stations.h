#pragma once

#include <vector>

#include "postproc/pipeline/cuts.h"
#include "postproc/pipeline/reference_path.h"

namespace smoothpost {

/// Segments first..last of a cut that are optimised as one, at constant feed.
struct StretchRange {
  std::uint32_t first = 0, last = 0;
  bool starts_cut = false, ends_cut = false;  ///< else the tool goes on from, or to, a neighbour
};

/// Where a cut is divided: at dwells and events that stop the machine, where the tool turns in
/// place, where the programmed feed changes by more than 5 % and at corners of the tip above 20
/// degrees. Segments in which the tip stands belong to no stretch.
std::vector<StretchRange> stretches_of(const ReferencePath& reference, const Cut& cut,
                                       const ProcessTable& process);

/// Places along a stretch by the length of the tip's way. Immutable; the reference outlives it.
class StretchPath {
 public:
  StretchPath(const ReferencePath& reference, const StretchRange& range);

  double length() const { return starts_.back(); }  ///< mm
  double feed() const { return feed_; }             ///< mm/s, the least that is programmed
  /// The place at length s; s at the end of a segment is its end.   @pre 0 ≤ s ≤ length()
  PathPlace place(double s) const;
  /// Length at the end of a segment of the stretch.
  double end_of(std::uint32_t segment) const { return starts_[segment - range_.first + 1]; }
  std::uint32_t line(double s) const;
  /// Distance of cutter locations, mm: the median of the segments' lengths, 0.25 to 1 mm.
  double spacing() const { return spacing_; }

 private:
  const ReferencePath& reference_;
  StretchRange range_;
  std::vector<double> starts_;  ///< length at the start of each segment, and the whole
  double feed_ = 0.0;
  double spacing_ = 0.0;
};

}  // namespace smoothpost
