#include "kernels/kinematics/numeric_ik.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/core/contract.h"

namespace smoothpost {
namespace {

constexpr double kDamping = 1e-5;       // μ at the start
constexpr double kLeastDamping = 1e-9;  // μ after many good steps
constexpr double kMostDamping = 1e9;    // μ that means there is no way down
constexpr double kFloor = 1e-15;        // of λ², as a share of the trace
constexpr double kLargestTurn = 1.0;    // rad of a rotary joint in one step
constexpr double kSlow = 1e-3;          // a step that gains less than this share of |e|² is slow
constexpr int kSlowSteps = 8;
constexpr int kCentringRounds = 60;
constexpr double kCentred = 1e-7;  // mm of weighted null-space motion that is left alone

/// Rotation vector of R in W; exact to round-off for small angles.
Vec3 rotation_vector(const Mat3& r) {
  const Vec3 twice(r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1));
  const double sine = 0.5 * twice.norm();
  const double cosine = 0.5 * (r.trace() - 1.0);
  if (cosine < -0.9) return rotation_log(r);
  if (sine < 1e-4) return (0.5 + sine * sine / 12.0) * twice;
  return (0.5 * std::atan2(sine, cosine) / sine) * twice;
}

/// Rows of a task: its error and the rows of its Jacobian, rotations not yet scaled.
struct PoseTask {
  static constexpr int kTurnRows = 3;
  using Turn = Vec3;
  Pose target;
  Pose at;

  void move_to(const ScrewChain& chain, const JointVector& q) { at = forward(chain, q); }
  Vec3 tip_error() const { return target.translation() - at.translation(); }
  Turn turn_error() const { return rotation_vector(target.linear() * at.linear().transpose()); }
  template <class Columns>
  auto turn_rows(const Columns& angular) const {
    return angular;
  }
};

struct LocationTask {
  static constexpr int kTurnRows = 2;
  using Turn = Eigen::Vector2d;
  CutterLocation target;
  CutterLocation at;
  Eigen::Matrix<double, 2, 3> across = Eigen::Matrix<double, 2, 3>::Zero();  ///< square to the axis

  void move_to(const ScrewChain& chain, const JointVector& q) {
    at = forward_location(chain, q);
    const Vec3 first = at.axis.unitOrthogonal();
    across.row(0) = first.transpose();
    across.row(1) = at.axis.cross(first).transpose();
  }
  Vec3 tip_error() const { return target.tip - at.tip; }
  Turn turn_error() const {
    const Vec3 normal = at.axis.cross(target.axis);
    const double sine = normal.norm();
    const double cosine = at.axis.dot(target.axis);
    if (sine < 1e-12 && cosine < 0.0) return {M_PI, 0.0};
    const double factor = sine < 1e-9 ? 1.0 : std::atan2(sine, cosine) / sine;
    return across * (factor * normal);
  }
  template <class Columns>
  auto turn_rows(const Columns& angular) const {
    return across * angular;
  }
};

template <class Task>
class Solver {
 public:
  static constexpr int kRows = 3 + Task::kTurnRows;
  using Error = Eigen::Matrix<double, kRows, 1>;
  using Rows = Eigen::Matrix<double, kRows, Eigen::Dynamic, Eigen::ColMajor, kRows, kMaxJoints>;
  using Square = Eigen::Matrix<double, kRows, kRows>;

  Solver(const ScrewChain& chain, const NumericInverseSettings& settings, Task task)
      : chain_(chain), settings_(settings), task_(std::move(task)), inverse_weight_(chain.size()) {
    for (int j = 0; j < chain.size(); ++j) inverse_weight_[j] = 1.0 / weight_of(j);
  }

  NumericInverse solve(const JointVector& start) {
    NumericInverse found;
    found.q = clamped(start);
    descend(found);
    if (found.status == NumericInverse::Status::ok && settings_.centre.size() > 0) centre(found);
    return found;
  }

 private:
  double weight_of(int j) const {
    if (settings_.weight.size() > 0) return settings_.weight[j];
    return chain_.joints[j].kind == JointKind::linear ? 1.0 : settings_.length;
  }

  JointVector clamped(JointVector q) const {
    if (!settings_.limits) return q;
    for (int j = 0; j < chain_.size(); ++j)
      q[j] = std::clamp(q[j], chain_.joints[j].lower, chain_.joints[j].upper);
    return q;
  }

  /// Puts the task at found.q and returns the scaled error.
  Error evaluate(NumericInverse& found) {
    task_.move_to(chain_, found.q);
    const auto turn = task_.turn_error();
    const Vec3 tip = task_.tip_error();
    found.tip_error = tip.norm();
    found.rotation_error = turn.norm();
    Error error;
    error.template head<Task::kTurnRows>() = settings_.length * turn;
    error.template tail<3>() = tip;
    return error;
  }

  bool within_tolerance(const NumericInverse& found) const {
    return found.tip_error <= settings_.tip_tolerance &&
           found.rotation_error <= settings_.rotation_tolerance;
  }

  /// A at found.q, where the task is.
  Rows rows_at(const JointVector& q) const {
    const Jacobian columns = jacobian(chain_, q);
    Rows rows(kRows, chain_.size());
    rows.template topRows<Task::kTurnRows>() =
        settings_.length * task_.turn_rows(columns.template topRows<3>());
    rows.template bottomRows<3>() = columns.template bottomRows<3>();
    for (int j = 0; j < chain_.size(); ++j) rows.col(j) *= inverse_weight_[j];
    return rows;
  }

  static Eigen::LLT<Square> damped_square(const Rows& rows, double damping) {
    Square square = Square::Zero();
    for (Eigen::Index j = 0; j < rows.cols(); ++j)
      square.noalias() += rows.col(j) * rows.col(j).transpose();
    square.diagonal().array() += damping + kFloor * square.trace() + 1e-30;
    return Eigen::LLT<Square>(square);
  }

  /// The damped step from q; joints that would leave their range end at its end.
  struct Step {
    JointVector change;
    int stopped = -1;  ///< first joint that its limit stopped
  };
  Step step_from(const JointVector& q, Rows rows, Error error, double damping) const {
    const int n = chain_.size();
    Step step{JointVector::Zero(n), -1};
    std::array<bool, kMaxJoints> fixed{};
    for (int round = 0; round <= n; ++round) {
      const Error multiplier = damped_square(rows, damping).solve(error);
      double share = 1.0;
      for (int j = 0; j < n; ++j) {
        if (fixed[j]) continue;
        step.change[j] = rows.col(j).dot(multiplier) * inverse_weight_[j];
        if (chain_.joints[j].kind == JointKind::rotary)
          share = std::min(share, kLargestTurn / std::abs(step.change[j]));
      }
      bool again = false;
      for (int j = 0; j < n; ++j) {
        if (fixed[j]) continue;
        if (share < 1.0) step.change[j] *= share;
        if (!settings_.limits) continue;
        const double lower = chain_.joints[j].lower - q[j];
        const double upper = chain_.joints[j].upper - q[j];
        if (step.change[j] >= lower && step.change[j] <= upper) continue;
        step.change[j] = std::clamp(step.change[j], lower, upper);
        error -= rows.col(j) * (step.change[j] / inverse_weight_[j]);
        rows.col(j).setZero();
        fixed[j] = true;
        if (step.stopped < 0) step.stopped = j;
        again = true;
      }
      if (!again) break;
    }
    return step;
  }

  /// Damped Newton steps from found.q until the target, the least error, or max_iterations.
  void descend(NumericInverse& found) {
    const double scale = 1.0 / (settings_.length * settings_.length);
    Error error = evaluate(found);
    double square = error.squaredNorm();
    double factor = kDamping;
    int slow = 0;
    int stopped = -1;
    Rows rows;
    bool fresh = false;
    while (!within_tolerance(found) && found.iterations < settings_.max_iterations &&
           factor < kMostDamping && slow < kSlowSteps) {
      if (!fresh) rows = rows_at(found.q);
      fresh = true;
      ++found.iterations;
      const Step step = step_from(found.q, rows, error, factor * square * scale);
      NumericInverse next = found;
      next.q = clamped(found.q + step.change);
      const Task task_here = task_;
      const Error next_error = evaluate(next);
      const double next_square = next_error.squaredNorm();
      stopped = step.stopped;
      if (next_square < square) {
        slow = next_square > (1.0 - kSlow) * square ? slow + 1 : 0;
        found = next;
        error = next_error;
        square = next_square;
        factor = std::max(0.1 * factor, kLeastDamping);
        fresh = false;
      } else {
        task_ = task_here;
        factor *= 30.0;
      }
    }
    using Status = NumericInverse::Status;
    found.status = within_tolerance(found) ? Status::ok
                   : stopped >= 0          ? Status::limit
                                           : Status::unreachable;
    found.joint = found.status == Status::limit ? stopped : -1;
  }

  double distance_to_centre(const JointVector& q) const {
    return (settings_.centre - q).cwiseQuotient(inverse_weight_).norm();
  }

  /// Null-space motion towards the centre, unweighted joint changes.
  JointVector null_motion(const JointVector& q) const {
    const Rows rows = rows_at(q);
    const JointVector wish = (settings_.centre - q).cwiseQuotient(inverse_weight_);
    const Error along = rows * wish;
    const Error multiplier = damped_square(rows, 0.0).solve(along);
    return (wish - rows.transpose() * multiplier).cwiseProduct(inverse_weight_);
  }

  void centre(NumericInverse& found) {
    double distance = distance_to_centre(found.q);
    double share = 1.0;
    for (int round = 0; round < kCentringRounds && share > 1e-3; ++round) {
      const JointVector motion = null_motion(found.q);
      if (motion.cwiseQuotient(inverse_weight_).norm() < kCentred) return;
      NumericInverse next = found;
      next.q = clamped(found.q + share * motion);
      next.iterations = 0;
      descend(next);
      const int iterations = found.iterations + next.iterations + 1;
      const double reached = distance_to_centre(next.q);
      if (next.status == NumericInverse::Status::ok && reached < distance) {
        found = next;
        distance = reached;
        share = std::min(1.0, 2.0 * share);
      } else {
        task_.move_to(chain_, found.q);
        share *= 0.5;
      }
      found.iterations = iterations;
    }
  }

  const ScrewChain& chain_;
  const NumericInverseSettings& settings_;
  Task task_;
  JointVector inverse_weight_;
};

void require_valid(const ScrewChain& chain, const JointVector& start,
                   const NumericInverseSettings& settings) {
  const auto fits = [&](const JointVector& v) { return v.size() == 0 || v.size() == chain.size(); };
  require(start.size() == chain.size(), "one start value per joint");
  require(start.allFinite(), "finite start values");
  require(fits(settings.weight) && fits(settings.centre), "one weight and centre per joint");
  require(settings.weight.size() == 0 || settings.weight.minCoeff() > 0.0, "positive weights");
  require(
      settings.tip_tolerance > 0.0 && settings.rotation_tolerance > 0.0 && settings.length > 0.0,
      "positive tolerances and length");
}

}  // namespace

NumericInverse numeric_inverse(const ScrewChain& chain, const Pose& target,
                               const JointVector& start, const NumericInverseSettings& settings) {
  require_valid(chain, start, settings);
  return Solver<PoseTask>(chain, settings, PoseTask{target, target}).solve(start);
}

NumericInverse numeric_inverse(const ScrewChain& chain, const CutterLocation& target,
                               const JointVector& start, const NumericInverseSettings& settings) {
  require_valid(chain, start, settings);
  const double length = target.axis.norm();
  require(std::abs(length - 1.0) <= 1e-6, "unit tool axis");
  LocationTask task;
  task.target = {target.tip, target.axis / length};
  return Solver<LocationTask>(chain, settings, task).solve(start);
}

}  // namespace smoothpost
