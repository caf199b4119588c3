#include "kernels/optimise/placement.h"

#include <nlopt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <memory>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

constexpr double kApart = 0.1;  // of the box, between places to go on from
constexpr double kFixed = 1e-9;
constexpr std::array<double, 2> kFirstStep = {0.08, 0.01};  // of the box
constexpr double kLastStep = 1e-6;

using Unit = std::vector<double>;  // free coordinates, each in [0, 1]

/// What one call of NLopt works on.
class Search {
 public:
  Search(const PlacementMeasure& measure, const PlacementSearch& search, const Progress& progress)
      : measure_(measure), search_(search), progress_(progress) {
    for (int i = 0; i < 3; ++i)
      if (search.upper[i] - search.lower[i] > kFixed) free_.push_back(i);
    if (search.turn > kFixed) free_.push_back(3);
    budget_ = search.global_evaluations + search.candidates * search.local_evaluations;
  }

  PlacementResult run() {
    PlacementResult result;
    result.before = measure_.at(search_.start);
    seen_.push_back(start_in_box());
    value(seen_.back());
    std::vector<Unit> from = {seen_.back()};
    if (!free_.empty()) {
      minimise(NLOPT_GN_DIRECT_L, Unit(free_.size(), 0.5), 0.0, search_.global_evaluations);
      from = apart();
      for (const Unit& place : from) {
        Unit at = place;
        for (const double step : kFirstStep)
          at = minimise(NLOPT_LN_SBPLX, at, step, search_.local_evaluations / 2);
        result.best.push_back(candidate(at));
      }
    }
    const Vec3 pivot = search_.start * search_.pivot;
    const bool starts_inside = (pivot.array() >= search_.lower.array() - kFixed).all() &&
                               (pivot.array() <= search_.upper.array() + kFixed).all();
    if (starts_inside || result.best.empty())
      result.best.push_back(starts_inside ? PlacementCandidate{search_.start, result.before}
                                          : candidate(seen_.front()));
    std::stable_sort(result.best.begin(), result.best.end(), better);
    result.evaluations = evaluations_;
    result.cancelled = cancelled_;
    return result;
  }

 private:
  static bool better(const PlacementCandidate& a, const PlacementCandidate& b) {
    const double x = a.margins.least(), y = b.margins.least();
    return x != y ? x > y : a.margins.mean > b.margins.mean;
  }

  Pose placement(const Unit& unit) const {
    Vec3 at = search_.lower;
    double turn = 0.0;
    for (std::size_t k = 0; k < free_.size(); ++k) {
      const double share = std::clamp(unit[k], 0.0, 1.0);
      if (free_[k] == 3)
        turn = (2.0 * share - 1.0) * search_.turn;
      else
        at[free_[k]] += share * (search_.upper[free_[k]] - search_.lower[free_[k]]);
    }
    Pose out = Pose::Identity();
    out.linear() = rotation_about(search_.vertical, turn) * search_.start.linear();
    out.translation() = at - out.linear() * search_.pivot;
    return out;
  }

  Unit start_in_box() const {
    const Vec3 pivot = search_.start * search_.pivot;
    Unit unit;
    for (const int i : free_)
      unit.push_back(
          i == 3 ? 0.5
                 : std::clamp((pivot[i] - search_.lower[i]) / (search_.upper[i] - search_.lower[i]),
                              0.0, 1.0));
    return unit;
  }

  PlacementCandidate candidate(const Unit& unit) const {
    const Pose at = placement(unit);
    return {at, measure_.at(at)};
  }

  double value(const Unit& unit) {
    ++evaluations_;
    const double score = PlacementMeasure::score(measure_.at(placement(unit)));
    values_.push_back(score);
    return score;
  }

  // NLopt calls it from C, which no exception may cross.
  static double callback(unsigned n, const double* x, double*, void* data) {
    auto& self = *static_cast<Search*>(data);
    try {
      if (self.keep_) self.seen_.emplace_back(x, x + n);
      if (!self.progress_("place", std::min(1.0, 1.0 * self.evaluations_ / self.budget_))) {
        self.cancelled_ = true;
        nlopt_force_stop(self.running_);
        return 0.0;
      }
      return -self.value(Unit(x, x + n));
    } catch (...) {
      self.failure_ = std::current_exception();
      nlopt_force_stop(self.running_);
      return 0.0;
    }
  }

  /// From `at`; a first step of 0 says that the method has none and that its places are kept.
  Unit minimise(nlopt_algorithm method, Unit at, double first_step, int evaluations) {
    if (cancelled_) return at;
    const unsigned n = static_cast<unsigned>(free_.size());
    const std::unique_ptr<nlopt_opt_s, void (*)(nlopt_opt)> opt(nlopt_create(method, n),
                                                                nlopt_destroy);
    require(opt != nullptr, "place_path: NLopt is out of memory");
    running_ = opt.get();
    keep_ = first_step == 0.0;
    nlopt_set_lower_bounds1(opt.get(), 0.0);
    nlopt_set_upper_bounds1(opt.get(), 1.0);
    nlopt_set_min_objective(opt.get(), callback, this);
    nlopt_set_maxeval(opt.get(), std::max(1, evaluations));
    if (first_step > 0.0) {
      nlopt_set_initial_step1(opt.get(), first_step);
      nlopt_set_xtol_abs1(opt.get(), kLastStep);
    }
    double least = 0.0;
    nlopt_optimize(opt.get(), at.data(), &least);
    running_ = nullptr;
    if (failure_) std::rethrow_exception(failure_);
    for (double& x : at) x = std::clamp(x, 0.0, 1.0);
    return at;
  }

  /// The best places seen, best first, each apart from the others.
  std::vector<Unit> apart() const {
    std::vector<std::size_t> order(std::min(seen_.size(), values_.size()));
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(),
                     [this](std::size_t a, std::size_t b) { return values_[a] > values_[b]; });
    std::vector<Unit> out;
    for (const std::size_t i : order) {
      const bool near = std::any_of(out.begin(), out.end(), [this, i](const Unit& other) {
        double most = 0.0;
        for (std::size_t k = 0; k < other.size(); ++k)
          most = std::max(most, std::abs(other[k] - seen_[i][k]));
        return most < kApart;
      });
      if (near) continue;
      out.push_back(seen_[i]);
      if (static_cast<int>(out.size()) == search_.candidates) break;
    }
    return out;
  }

  const PlacementMeasure& measure_;
  const PlacementSearch& search_;
  const Progress& progress_;
  std::vector<int> free_;  ///< coordinates that move: 0, 1, 2, and 3 for the turn
  std::vector<Unit> seen_;
  std::vector<double> values_;  ///< of seen_, in the same order
  nlopt_opt running_ = nullptr;
  std::exception_ptr failure_;
  int evaluations_ = 0;
  int budget_ = 1;
  bool keep_ = false;
  bool cancelled_ = false;
};

}  // namespace

PlacementResult place_path(const PlacementMeasure& measure, const PlacementSearch& search,
                           const Progress& progress) {
  require((search.lower.array() <= search.upper.array()).all(), "place_path: lower <= upper");
  require(search.turn >= 0.0, "place_path: turn >= 0");
  require(std::abs(search.vertical.norm() - 1.0) < 1e-9, "place_path: a unit vertical");
  require(search.global_evaluations >= 1 && search.local_evaluations >= 1 && search.candidates >= 1,
          "place_path: counts >= 1");
  return Search(measure, search, progress).run();
}

ReachBox reach_box(const Inverse& inverse, const JointVector& held) {
  if (const SixR* arm = inverse.six_r()) {
    const ArmReach reach(*arm);
    const Vec3 half = Vec3::Constant(reach.radius());
    return {reach.centre() - half, reach.centre() + half};
  }
  const ScrewChain& chain = inverse.chain();
  std::vector<int> linears;
  for (int j = 0; j < chain.size(); ++j) {
    const ChainJoint& joint = chain.joints[static_cast<std::size_t>(j)];
    if (joint.kind == JointKind::linear && !joint.redundant) linears.push_back(j);
  }
  ReachBox box;
  for (unsigned corner = 0; corner < (1U << linears.size()); ++corner) {
    JointVector q = held;
    for (std::size_t k = 0; k < linears.size(); ++k) {
      const ChainJoint& joint = chain.joints[static_cast<std::size_t>(linears[k])];
      q[linears[k]] = (corner >> k) & 1U ? joint.upper : joint.lower;
    }
    const Vec3 tip = forward_location(chain, q).tip;
    box.lower = corner == 0 ? tip : Vec3(box.lower.cwiseMin(tip));
    box.upper = corner == 0 ? tip : Vec3(box.upper.cwiseMax(tip));
  }
  return box;
}

}  // namespace smoothpost
