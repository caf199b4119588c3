#include "kernels/optimise/placement_margins.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"

namespace smoothpost {

namespace {

constexpr double kTie = 1e-3;  // weight of the mean beside the least margin
constexpr double kSmallestLack = 1e-9;
constexpr double kOpposite = 20.0 * kRadiansPerDegree;

Mat3 least_rotation(const Vec3& from, const Vec3& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to).toRotationMatrix();
}

void lower(PlacementMargins::Margin& margin, double value, std::size_t point) {
  if (value < margin.value) margin = {value, point};
}

}  // namespace

double PlacementMargins::least() const {
  double least = std::min(singular.value, reach.value);
  for (const Margin& joint : joints) least = std::min(least, joint.value);
  return least;
}

/// The branches of one point.
struct PlacementMeasure::Solutions {
  std::array<JointVector, 8> q;
  std::array<bool, 8> known{};
  std::array<double, 8> lack{};
  std::array<double, 8> singular{};
  int count = 0;
};

/// One branch along the path.
struct PlacementMeasure::Walk {
  PlacementMargins margins;
  JointVector last, low, high;  ///< of the stretch
  bool open = false;            ///< a stretch is going on
  bool dropped = false;

  void add(const ScrewChain& chain, const JointVector& q, std::size_t point, bool joined) {
    const bool goes_on = open && joined;
    if (!goes_on) low = high = q;
    JointVector here = q;
    for (int j = 0; j < chain.size(); ++j) {
      const ChainJoint& joint = chain.joints[static_cast<std::size_t>(j)];
      if (joint.redundant) continue;
      const bool rotary = joint.kind == JointKind::rotary;
      if (rotary && goes_on) here[j] += 2.0 * kPi * std::round((last[j] - q[j]) / (2.0 * kPi));
      low[j] = goes_on && rotary ? std::min(low[j], here[j]) : here[j];
      high[j] = goes_on && rotary ? std::max(high[j], here[j]) : here[j];
      const double middle = 0.5 * (joint.lower + joint.upper);
      const double half = 0.5 * (joint.upper - joint.lower);
      double off = 0.5 * (low[j] + high[j]) - middle;
      if (rotary) off -= 2.0 * kPi * std::round(off / (2.0 * kPi));
      const double used = std::abs(off) + 0.5 * (high[j] - low[j]);
      lower(margins.joints[static_cast<std::size_t>(j)], 1.0 - used / half, point);
    }
    last = here;
    open = true;
  }
};

PlacementMeasure::PlacementMeasure(const Inverse& inverse, PlacementTask task)
    : inverse_(inverse), task_(std::move(task)) {
  require(!task_.points.empty() && !task_.spins.empty(), "PlacementMeasure: points and spins");
  const ScrewChain& chain = inverse_.chain();
  require(task_.held.size() == chain.size(), "PlacementMeasure: one held value per joint");
  if (const SixR* arm = inverse_.six_r()) {
    reach_.emplace(*arm);
    home_ = forward(chain, task_.held).linear();
    choose_reference();
    return;
  }
  const RotaryPair& pair = *inverse_.rotary_pair();
  const Jacobian columns = jacobian(chain, task_.held);
  first_ = columns.col(pair.first_rotary()).head<3>();
  const Vec3 second = columns.col(pair.second_rotary()).head<3>();
  const double near = angle_between(first_, second);
  const double tool = angle_between(second, forward_location(chain, task_.held).axis);
  nearest_ = std::abs(near - tool);
  farthest_ = kPi - std::abs(kPi - near - tool);
  task_.spins = {0.0};
}

void PlacementMeasure::choose_reference() {
  if (task_.whole_rotation) {
    task_.spins = {0.0};
    return;
  }
  double best = -1.0;
  for (const Vec3& axis : {Vec3(Vec3::UnitZ()), Vec3(Vec3::UnitX()), Vec3(Vec3::UnitY()),
                           Vec3(-Vec3::UnitX()), Vec3(-Vec3::UnitY()), Vec3(-Vec3::UnitZ())}) {
    double least = kPi;
    for (const auto& point : task_.points)
      least = std::min(least, angle_between(point.axis, -axis));
    if (least <= best) continue;
    best = least;
    reference_ = axis;
    if (least > kOpposite) break;
  }
  lean_.reserve(task_.points.size());
  for (const auto& point : task_.points) lean_.push_back(least_rotation(reference_, point.axis));
}

void PlacementMeasure::solve_arm(const Pose& tool, Solutions& out) const {
  const SixR& arm = *inverse_.six_r();
  const SixRSolutions solved = arm.solve(tool, task_.held);
  out.count = 8;
  for (int side = 0; side < 2; ++side) {
    const std::array<std::size_t, 4> branches = {
        static_cast<std::size_t>(side), static_cast<std::size_t>(side + 2),
        static_cast<std::size_t>(side + 4), static_cast<std::size_t>(side + 6)};
    const bool reached = std::any_of(branches.begin(), branches.end(),
                                     [&solved](std::size_t b) { return solved.valid[b]; });
    SixRSolutions other;
    const SixRSolutions* from = &solved;
    double lack = 0.0;
    if (!reached) {
      const ArmReach::Nearest nearest = reach_->nearest(tool, side);
      lack = nearest.lack;
      other = arm.solve(nearest.tool, task_.held);
      from = &other;
    }
    for (const std::size_t b : branches) {
      out.known[b] = from->valid[b];
      out.lack[b] = lack;
      if (!out.known[b]) continue;
      out.q[b] = from->q[b];
      out.singular[b] = reach_->singular(out.q[b]);
    }
  }
}

void PlacementMeasure::solve_pair(const CutterLocation& tool, Solutions& out) const {
  const RotaryPairSolutions solved = inverse_.rotary_pair()->solve(tool, task_.held);
  out.count = 2;
  const double angle = angle_between(first_, tool.axis);
  const double lack = std::max({0.0, nearest_ - angle, angle - farthest_}) / kPi;
  for (std::size_t b = 0; b < 2; ++b) {
    out.known[b] = solved.valid[b];
    // Linears that depend on each other there have no lack by the angle: any will do.
    out.lack[b] = solved.valid[b] ? 0.0 : std::max(lack, kSmallestLack);
    out.singular[b] = 1.0;
    if (out.known[b]) out.q[b] = solved.q[b];
  }
}

PlacementMeasure::Solutions PlacementMeasure::solve(std::size_t point, const Pose& placement,
                                                    const Mat3& turned_home) const {
  const PlacementPoint& p = task_.points[point];
  Solutions out;
  if (!reach_) {
    solve_pair({placement * p.tip, placement.linear() * p.axis}, out);
    return out;
  }
  Pose tool = Pose::Identity();
  tool.translation() = placement * p.tip;
  tool.linear() = task_.whole_rotation ? Mat3(placement.linear() * p.rotation)
                                       : Mat3(placement.linear() * lean_[point] * turned_home);
  solve_arm(tool, out);
  return out;
}

std::optional<PlacementMargins> PlacementMeasure::with_spin(const Pose& placement, double spin,
                                                            double bound) const {
  const ScrewChain& chain = inverse_.chain();
  Mat3 turned_home = Mat3::Identity();
  if (reach_ && !task_.whole_rotation) {
    const Mat3 home = placement.linear().transpose() * home_;
    turned_home = rotation_about(reference_, spin) *
                  least_rotation(home * chain.tool_axis, reference_) * home;
  }
  std::array<Walk, 8> walks;
  for (Walk& walk : walks) walk.margins.joints.resize(chain.joints.size());
  int count = 8;
  for (std::size_t i = 0; i < task_.points.size(); ++i) {
    const Solutions solved = solve(i, placement, turned_home);
    count = solved.count;
    bool any = false;
    for (std::size_t b = 0; b < static_cast<std::size_t>(count); ++b) {
      Walk& walk = walks[b];
      if (walk.dropped) continue;
      if (solved.lack[b] > 0.0) lower(walk.margins.reach, -solved.lack[b], i);
      if (solved.known[b]) {
        walk.add(chain, solved.q[b], i, task_.points[i].joined);
        lower(walk.margins.singular, solved.singular[b], i);
      } else {
        walk.open = false;
      }
      walk.dropped = walk.margins.least() + kTie <= bound;
      any = any || !walk.dropped;
    }
    if (!any) return {};
  }
  std::optional<PlacementMargins> best;
  for (std::size_t b = 0; b < static_cast<std::size_t>(count); ++b) {
    if (walks[b].dropped) continue;
    PlacementMargins& margins = walks[b].margins;
    double sum = reach_ ? std::max(-1.0, margins.singular.value) : 0.0;
    double parts = reach_ ? 1.0 : 0.0;
    for (std::size_t j = 0; j < margins.joints.size(); ++j) {
      if (chain.joints[j].redundant) continue;
      sum += std::max(-1.0, margins.joints[j].value);
      parts += 1.0;
    }
    margins.mean = sum / parts;
    margins.branch = static_cast<int>(b);
    margins.spin = spin;
    if (!best || score(margins) > score(*best)) best = margins;
  }
  return best;
}

double PlacementMeasure::score(const PlacementMargins& margins) {
  return margins.least() + kTie * margins.mean;
}

PlacementMargins PlacementMeasure::at(const Pose& placement) const {
  std::optional<PlacementMargins> best;
  for (const double spin : task_.spins) {
    const double bound = best ? score(*best) : -std::numeric_limits<double>::infinity();
    auto margins = with_spin(placement, spin, bound);
    if (margins && (!best || score(*margins) > bound)) best = std::move(margins);
  }
  return *best;
}

}  // namespace smoothpost
