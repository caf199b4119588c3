#pragma once

#include "kernels/kinematics/rotary_pair.h"
#include "kernels/optimise/redundancy.h"
#include "kernels/spline/chebyshev_path.h"
#include "kernels/spline/spline_jets.h"
#include "postproc/pipeline/finish_path.h"
#include "postproc/pipeline/planned_path.h"

namespace smoothpost {

/// Tip and axis of the holder's reference point on a cut: what a chain of tool length 0 is asked
/// for.
inline LocationJet holder_on_cut(const FinishCut& cut, double tool_length, double s) {
  LocationJet at = cut.location(s);
  at.tip += tool_length * at.axis;
  return at;
}

/// A cut's joints: its curves, and the free joint's spline. joints() and tool() are exact; jet() is
/// their polynomials' (ChebyshevPath), which is what the schedule asks for very often, where those
/// come within `third` (one a joint, by s) of the third derivatives, else exact, too.
class FinishJoints : public PlannedPath {
 public:
  FinishJoints(const FinishCut& cut, const RotaryPair& pair, double tool_length,
               const SmoothFree& free, JointVector near, const JointVector& third)
      : cut_(cut),
        pair_(pair),
        free_(free.free),
        scale_(free.scale),
        near_(std::move(near)),
        path_(redundant_path(
            pair_, [this, tool_length](double s) { return holder_on_cut(cut_, tool_length, s); },
            {0.0, cut.length()})) {
    const std::vector<double> all = breaks();
    for (std::size_t i = 1; i < all.size(); ++i)
      if (!table_.append_jets([this](double s) { return values(s); }, all[i - 1], all[i], third,
                              {})) {
        table_.shorten(0);
        return;
      }
  }
  FinishJoints(const FinishJoints&) = delete;
  FinishJoints& operator=(const FinishJoints&) = delete;

  double length() const override { return cut_.length(); }
  // Knots of the contour; those of the free joint are among them.
  std::vector<double> breaks() const override {
    std::vector<double> all;
    for (int i = 0; i < cut_.pieces; ++i) all.push_back(cut_.scale * i);
    all.push_back(cut_.length());
    return all;
  }
  JointVector joints(double s) const override {
    return path_.joints(inside(s), free_at(s)[0], near_).value_or(near_);
  }
  JointJet jet(double s) const override {
    s = inside(s);
    if (table_.pieces() > 0) {
      const ChebyshevJet found = table_.jet(table_.piece_at(s), s);
      JointJet out(near_.size(), 4);
      for (std::size_t r = 0; r < 4; ++r) out.col(static_cast<Eigen::Index>(r)) = found[r];
      return out;
    }
    const auto q = path_.jet(s, free_at(s), near_);
    if (q) return *q;
    JointJet none = JointJet::Zero(near_.size(), 4);
    none.col(0) = near_;
    return none;
  }
  VectorJet tip_jet(double s) const override { return cut_.location(inside(s)).tip; }
  CutterLocation tool(double s) const {
    const LocationJet at = cut_.location(inside(s));
    return {at.tip.col(0), at.axis.col(0)};
  }

 private:
  std::optional<ChebyshevJet> values(double s) const {
    const auto q = path_.jet(inside(s), free_at(s), near_);
    if (!q) return {};
    ChebyshevJet out;
    for (std::size_t r = 0; r < 4; ++r) out[r] = q->col(static_cast<Eigen::Index>(r));
    return out;
  }
  Jet free_at(double s) const {
    const auto jet = free_.jet(inside(s) / scale_, scale_);
    return {jet(0), jet(1), jet(2), jet(3)};
  }
  double inside(double s) const { return std::clamp(s, 0.0, cut_.length()); }

  const FinishCut cut_;
  const RotaryPair pair_;
  const SplineJets<1> free_;
  const double scale_;  // mm of s a unit of free_
  const JointVector near_;
  const RedundantPath path_;
  ChebyshevPath table_;  // of jets; empty: none
};

}  // namespace smoothpost
