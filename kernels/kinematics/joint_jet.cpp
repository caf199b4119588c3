#include "kernels/kinematics/joint_jet.h"

#include <Eigen/QR>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

constexpr double kPerRadian = 100.0;  // mm, so that rows of tip and axis compare
constexpr double kSingular = 1e-9;

Jet row_of(const JointJet& q, int joint) {
  return {q(joint, 0), q(joint, 1), q(joint, 2), q(joint, 3)};
}

/// Carries a point (first of `vectors`) and directions (the others) through joint `i`.
template <std::size_t N>
void carry(const ChainJoint& joint, double sign, const Jet& value,
           std::array<VectorJet, N>& vectors) {
  if (joint.kind == JointKind::linear) {
    for (int r = 0; r < 4; ++r)
      vectors[0].col(r) += sign * value[static_cast<std::size_t>(r)] * joint.direction;
    return;
  }
  const SineCosine angle =
      sine_cosine({sign * value[0], sign * value[1], sign * value[2], sign * value[3]});
  vectors[0].col(0) -= joint.origin;
  for (VectorJet& v : vectors) v = turned(joint.direction, angle, v);
  vectors[0].col(0) += joint.origin;
}

/// Tip and directions fixed in the tool (`vectors`, in M with every joint 0), seen from W.
template <std::size_t N>
void carry_to_workpiece(const ScrewChain& chain, const JointJet& q,
                        std::array<VectorJet, N>& vectors) {
  const int n = chain.size();
  for (int i = n - 1; i >= 0; --i) {
    const ChainJoint& joint = chain.joints[static_cast<std::size_t>(i)];
    if (joint.side == ChainSide::tool) carry(joint, 1.0, row_of(q, i), vectors);
  }
  for (int i = 0; i < n; ++i) {
    const ChainJoint& joint = chain.joints[static_cast<std::size_t>(i)];
    if (joint.side == ChainSide::workpiece) carry(joint, -1.0, row_of(q, i), vectors);
  }
  vectors[0].col(0) -= chain.workpiece_home.translation();
  const Mat3 to_workpiece = chain.workpiece_home.linear().transpose();
  for (VectorJet& v : vectors) v = to_workpiece * v;
}

std::array<VectorJet, 2> location_vectors(const ScrewChain& chain) {
  return {constant_jet(Vec3(chain.tool_home.translation())),
          constant_jet(Vec3(chain.tool_home.linear() * chain.tool_axis))};
}

/// The chain at one set of joint values, from the workpiece to the tip, seen from W.
struct Skeleton {
  struct Axis {
    int joint = 0;
    bool rotary = false;
    Vec3 direction, origin;  ///< positive motion of the joint; unit
  };
  std::array<Axis, kMaxJoints> axes;
  int count = 0;
  Vec3 tip, tool_axis;

  Skeleton(const ScrewChain& chain, const JointJet& q) {
    Pose pose = chain.workpiece_home.inverse();
    for (int i = chain.size() - 1; i >= 0; --i)
      if (chain.joints[static_cast<std::size_t>(i)].side == ChainSide::workpiece)
        add(chain, i, -1.0, q(i, 0), pose);
    for (int i = 0; i < chain.size(); ++i)
      if (chain.joints[static_cast<std::size_t>(i)].side == ChainSide::tool)
        add(chain, i, 1.0, q(i, 0), pose);
    tip = pose * Vec3(chain.tool_home.translation());
    tool_axis = pose.linear() * (chain.tool_home.linear() * chain.tool_axis);
  }

  void add(const ScrewChain& chain, int i, double sign, double value, Pose& pose) {
    const ChainJoint& joint = chain.joints[static_cast<std::size_t>(i)];
    Axis& axis = axes[static_cast<std::size_t>(count++)];
    axis.joint = i;
    axis.rotary = joint.kind == JointKind::rotary;
    axis.direction = pose.linear() * (sign * joint.direction);
    axis.origin = pose * joint.origin;
    if (!axis.rotary) {
      pose.translation() += value * axis.direction;
      return;
    }
    const Mat3 turn = rotation_about(axis.direction, value);
    pose.translation() = (axis.origin + turn * (pose.translation() - axis.origin)).eval();
    pose.linear() = (turn * pose.linear()).eval();
  }
};

/// Of the last link: angular velocity with two derivatives, and three derivatives of the tip.
struct Rates {
  Vec3 w = Vec3::Zero(), w1 = Vec3::Zero(), w2 = Vec3::Zero();
  Vec3 p1 = Vec3::Zero(), p2 = Vec3::Zero(), p3 = Vec3::Zero();

  /// From one point of a link to another that is `r` away.
  void move(const Vec3& r) {
    const Vec3 r1 = w.cross(r);
    const Vec3 r2 = w1.cross(r) + w.cross(r1);
    p1 += r1;
    p2 += r2;
    p3 += w2.cross(r) + 2.0 * w1.cross(r1) + w.cross(r2);
  }
};

Rates rates_of(const Skeleton& skeleton, const JointJet& q) {
  Rates v;
  Vec3 at = Vec3::Zero();
  for (int k = 0; k < skeleton.count; ++k) {
    const Skeleton::Axis& axis = skeleton.axes[static_cast<std::size_t>(k)];
    const Vec3& a = axis.direction;  // fixed in the link before
    const Vec3 a1 = v.w.cross(a);
    const Vec3 a2 = v.w1.cross(a) + v.w.cross(a1);
    const double d1 = q(axis.joint, 1), d2 = q(axis.joint, 2), d3 = q(axis.joint, 3);
    if (axis.rotary) {
      v.move(axis.origin - at);
      at = axis.origin;
      v.w += d1 * a;
      v.w1 += d2 * a + d1 * a1;
      v.w2 += d3 * a + 2.0 * d2 * a1 + d1 * a2;
    } else {
      v.p1 += d1 * a;
      v.p2 += d2 * a + 2.0 * d1 * a1;
      v.p3 += d3 * a + 3.0 * d2 * a1 + 3.0 * d1 * a2;
    }
  }
  v.move(skeleton.tip - at);
  return v;
}

Vec3 of_tip(const Rates& v, int order) { return order == 1 ? v.p1 : order == 2 ? v.p2 : v.p3; }
Vec3 of_turn(const Rates& v, int order) { return order == 1 ? v.w : order == 2 ? v.w1 : v.w2; }

/// Derivatives of a direction that is fixed in the last link.
Vec3 of_direction(const Rates& v, const Vec3& a, int order) {
  const Vec3 a1 = v.w.cross(a);
  if (order == 1) return a1;
  const Vec3 a2 = v.w1.cross(a) + v.w.cross(a1);
  if (order == 2) return a2;
  return v.w2.cross(a) + 2.0 * v.w1.cross(a1) + v.w.cross(a2);
}

/// Angular velocity of a rotation with its derivatives: the skew parts of R'Rᵀ and of its own.
std::array<Vec3, 3> turns_of(const MatrixJet& r) {
  const auto vee = [](const Mat3& m) {
    return Vec3(0.5 * Vec3(m(2, 1) - m(1, 2), m(0, 2) - m(2, 0), m(1, 0) - m(0, 1)));
  };
  return {vee(r[1] * r[0].transpose()), vee(r[2] * r[0].transpose() + r[1] * r[1].transpose()),
          vee(r[3] * r[0].transpose() + 2.0 * r[2] * r[1].transpose() + r[1] * r[2].transpose())};
}

using Rows = Eigen::Matrix<double, 6, 1>;
using Columns = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, 6>;

/// `turn_rows(a)`: the upper rows for a turn about a; `missing(q, r)`: what the r-th derivative
/// lacks.
template <class TurnRows, class Missing>
std::optional<JointJet> solve(const Skeleton& skeleton, JointJet q, const FreeJoints& free,
                              const TurnRows& turn_rows, const Missing& missing) {
  std::array<int, kMaxJoints> sought{};
  Columns matrix(6, 6);
  int count = 0;
  for (int k = 0; k < skeleton.count; ++k) {
    const Skeleton::Axis& axis = skeleton.axes[static_cast<std::size_t>(k)];
    if (!free[static_cast<std::size_t>(axis.joint)]) continue;
    if (count == 6) return {};
    sought[static_cast<std::size_t>(count)] = axis.joint;
    if (axis.rotary)
      matrix.col(count) << kPerRadian * turn_rows(axis.direction),
          axis.direction.cross(skeleton.tip - axis.origin);
    else
      matrix.col(count) << Vec3::Zero(), axis.direction;
    ++count;
  }
  Eigen::ColPivHouseholderQR<Columns> factors(matrix.leftCols(count));
  factors.setThreshold(kSingular);
  if (factors.rank() < count) return {};
  for (int k = 0; k < count; ++k) q.row(sought[static_cast<std::size_t>(k)]).tail<3>().setZero();
  for (int r = 1; r < 4; ++r) {
    const Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 6, 1> found =
        factors.solve(missing(q, r));
    for (int k = 0; k < count; ++k) q(sought[static_cast<std::size_t>(k)], r) = found[k];
  }
  return q;
}

}  // namespace

LocationJet forward_jet(const ScrewChain& chain, const JointJet& q) {
  require(q.rows() == chain.size(), "one row per joint");
  std::array<VectorJet, 2> vectors = location_vectors(chain);
  carry_to_workpiece(chain, q, vectors);
  return {vectors[0], vectors[1]};
}

std::optional<JointJet> joint_jet(const ScrewChain& chain, const JointJet& q,
                                  const FreeJoints& free, const LocationJet& target) {
  require(q.rows() == chain.size(), "one row per joint");
  const Skeleton skeleton(chain, q);
  const Vec3& axis = skeleton.tool_axis;
  const auto missing = [&](const JointJet& known, int r) {
    const Rates at = rates_of(skeleton, known);
    Rows rows;
    rows << kPerRadian * (target.axis.col(r) - of_direction(at, axis, r)),
        target.tip.col(r) - of_tip(at, r);
    return rows;
  };
  return solve(
      skeleton, q, free, [&](const Vec3& a) { return Vec3(a.cross(axis)); }, missing);
}

std::optional<JointJet> joint_jet(const ScrewChain& chain, const JointJet& q,
                                  const FreeJoints& free, const PoseJet& target) {
  require(q.rows() == chain.size(), "one row per joint");
  const Skeleton skeleton(chain, q);
  const std::array<Vec3, 3> turns = turns_of(target.rotation);
  const auto missing = [&](const JointJet& known, int r) {
    const Rates at = rates_of(skeleton, known);
    Rows rows;
    rows << kPerRadian * (turns[static_cast<std::size_t>(r - 1)] - of_turn(at, r)),
        target.tip.col(r) - of_tip(at, r);
    return rows;
  };
  return solve(
      skeleton, q, free, [](const Vec3& a) { return a; }, missing);
}

}  // namespace smoothpost
