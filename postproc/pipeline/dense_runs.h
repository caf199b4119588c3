#pragma once

#include <cstdint>
#include <vector>

#include "kernels/optimise/dense_fit.h"
#include "postproc/pipeline/reference_path.h"

// Where a cut's points are so dense that they stand for a smooth curve, and those curves.
namespace smoothpost {

struct SmoothingSettings;

/// A point of a cut before smoothing, and what the leg that ends here is.
struct SmoothingNode {
  PathPlace place;
  CutterLocation location;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< of whole rotations
  double length = 0.0;    ///< way of the tip from the cut's start, mm
  bool exact = false;     ///< the path comes through this pose
  bool keep = false;      ///< a straight leg ends here
  bool split = false;     ///< a span of a curve ends here
  std::int32_t arc = -1;  ///< of the leg: index of its arc, −1: a line
};

/// A part of a cut on one curve.
struct DenseRun {
  SmoothingNode begin, end;  ///< of the curve: a node of the cut, or the middle of one of its legs
  std::size_t before = 0;    ///< nodes of the cut before `begin`
  std::size_t inside = 0;    ///< first node of the cut behind `begin`
  std::size_t after = 0;     ///< first node of the cut behind `end`
  bool joined = false;       ///< begins, C³, where the run before ends
  DenseFit fit;              ///< of begin, the nodes between, end
};

/// The rotation that takes one axis to another on the great circle.
Eigen::Quaterniond least_rotation(const Vec3& from, const Vec3& to);
/// The rotation vector, in the tool frame, from one rotation to another, at most half a turn.
Vec3 rotation_vector(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to);

/// The curves of a cut, in path order. A node is dense when its corner cuts off at most 0.3 of the
/// tolerances left to smoothing (dense_bulge) and both its legs are lines that move the tip; at
/// least eight in a row make a curve. It begins and ends in the middle of the legs beside the row,
/// with their direction and rates, C³; at the ends of the cut, where the tool stands, with the
/// node. Long rows are fitted in parts of 1,000 nodes, on all threads, that join C³ in what a fit
/// around the joint gives; where no curve keeps the tolerances, halves are tried, and what is left
/// stays corners. Deterministic.   Cost: about 25 µs a node.
std::vector<DenseRun> dense_runs(const ReferencePath& reference,
                                 const std::vector<SmoothingNode>& nodes,
                                 const SmoothingSettings& settings);

}  // namespace smoothpost
