#include "kernels/collision/motion_check.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"

namespace smoothpost {

class MotionSearch {
 public:
  MotionSearch(const Scene& scene, const JointVector& from, const JointVector& to,
               const MotionSettings& settings, SceneCache* cache)
      : scene_(scene), from_(from), to_(to), settings_(settings), cache_(cache) {}

  MotionReport run() {
    std::vector<std::size_t> pairs(scene_.pairs().size());
    for (std::size_t i = 0; i < pairs.size(); ++i) pairs[i] = i;
    if (cache_ != nullptr) scene_.prepare(cache_);
    check(0.0, 1.0, pairs);
    return report_;
  }

 private:
  JointVector at(double t) const { return (1.0 - t) * from_ + t * to_; }

  /// Margin that the deviation may use up.
  double deviation(const MovementBound& bound) const {
    return settings_.deviation.size() == 0 ? 0.0 : bound.lever.dot(settings_.deviation);
  }

  /// False when the search has ended.
  bool check(double begin, double end, const std::vector<std::size_t>& pairs) {
    const JointVector first = at(begin);
    const JointVector last = at(end);
    const double middle = 0.5 * (begin + end);
    const ScenePoses poses = scene_.poses(0.5 * first + 0.5 * last);
    std::vector<std::size_t> open;
    double proven = 0.5;  // half the share of the piece that every open pair is proven for
    for (const std::size_t pair : pairs) {
      const MovementBound bound = scene_.movement_bound(pair, first, last);
      const double half = 0.5 * bound.travel;
      const double around = deviation(bound) + reserve(pair);
      if (known(pair, poses, half + around)) continue;
      const PairMargin margin = scene_.search(
          pair, poses, {.want = wanted(pair, half + around), .decide = true, .need = half + around},
          cache_);
      ++report_.queries;
      if (margin.found && margin.upper < 0.0) {
        tell(MotionVerdict::hit, middle, pair, margin);
        return false;
      }
      if (margin.lower >= half + around) continue;
      if (half <= settings_.resolution) {
        tell(MotionVerdict::undecided, middle, pair, margin);
        return false;
      }
      open.push_back(pair);
      proven = std::min(proven, std::max(margin.lower - around, 0.0) / bound.travel);
    }
    if (open.empty()) return true;
    const double share = proven * (end - begin);
    return check(begin, middle - share, open) && check(middle + share, end, open);
  }

  /// With a cache a motion is free only with so much to spare that it would be found free without,
  /// where pieces of at most the resolution have to be proven one by one.
  double reserve(std::size_t pair) const {
    return cache_ == nullptr ? 0.0 : 1.1 * settings_.resolution + scene_.tolerance(pair);
  }

  bool known(std::size_t pair, const ScenePoses& poses, double needed) {
    if (cache_ == nullptr || scene_.known_margin(pair, poses, *cache_) < needed) return false;
    ++cache_->skipped_;
    ++report_.skipped;
    return true;
  }

  /// Margins above are as good as this one, but worth knowing for what comes.
  double wanted(std::size_t pair, double needed) const {
    const double enough = needed + scene_.tolerance(pair);
    return cache_ == nullptr ? enough : 4.0 * enough + 1.0;
  }

  void tell(MotionVerdict verdict, double t, std::size_t pair, const PairMargin& margin) {
    report_.verdict = verdict;
    report_.t = t;
    report_.pair = pair;
    report_.at = margin;
  }

  const Scene& scene_;
  const JointVector& from_;
  const JointVector& to_;
  const MotionSettings& settings_;
  SceneCache* cache_;
  MotionReport report_;
};

MotionReport check_motion(const Scene& scene, const JointVector& from, const JointVector& to,
                          const MotionSettings& settings, SceneCache* cache) {
  require(from.size() == scene.chain().size() && to.size() == from.size() && from.allFinite() &&
              to.allFinite(),
          "one finite value per joint");
  require(settings.resolution > 0.0, "a resolution above 0");
  require(settings.deviation.size() == 0 ||
              (settings.deviation.size() == from.size() && settings.deviation.allFinite() &&
               settings.deviation.minCoeff() >= 0.0),
          "no deviation, or one of at least 0 per joint");
  const MotionReport report = MotionSearch(scene, from, to, settings, cache).run();
  if (cache == nullptr || report.verdict == MotionVerdict::free) return report;
  // What is told must not depend on what the cache happened to know.
  MotionReport again = MotionSearch(scene, from, to, settings, nullptr).run();
  again.queries += report.queries;
  again.skipped += report.skipped;
  return again;
}

}  // namespace smoothpost
