#include "kernels/schedule/feed_survey.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "kernels/core/contract.h"
#include "kernels/schedule/feed_grid.h"

namespace smoothpost {
namespace {

constexpr std::size_t kPlaces = 64;  // along the path, at least
constexpr double kMoves = 1e-9;      // of the largest derivative
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Largest derivatives along the path.
struct PathScale {
  JointVector first, second;
  double tip = 0.0, turn = 0.0;

  double largest() const {
    return std::max({first.size() > 0 ? first.maxCoeff() : 0.0, tip, turn});
  }
};

bool finite(const PathJet& jet) {
  const auto length = limited_length(jet);
  return std::isfinite(length[1]) && std::isfinite(length[2]) && jet.first.allFinite() &&
         jet.second.allFinite() && jet.third.allFinite() && std::isfinite(jet.tip_first) &&
         std::isfinite(jet.turn_first);
}

/// The jet, from inside the piece.   @pre sizes
PathJet jet_at(const FeedPath& path, std::size_t piece, double s, Eigen::Index joints) {
  PathJet jet = path.jet(piece, s);
  require(jet.first.size() == joints && jet.second.size() == joints && jet.third.size() == joints,
          "FeedPath::jet: as many joints as the limits");
  return jet;
}

PathScale path_scale(const FeedPath& path, Eigen::Index joints) {
  PathScale scale{JointVector::Zero(joints), JointVector::Zero(joints)};
  const std::size_t looks = std::min(kPlaces, 4 * path.pieces());
  for (std::size_t i = 0; i < looks; ++i) {
    const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(looks);
    const double at = share * static_cast<double>(path.pieces());
    const std::size_t piece = std::min(path.pieces() - 1, static_cast<std::size_t>(at));
    const double within = at - static_cast<double>(piece);
    const double s = path.breaks[piece] + within * (path.breaks[piece + 1] - path.breaks[piece]);
    const PathJet jet = jet_at(path, piece, s, joints);
    if (!finite(jet)) continue;  // the survey itself meets it or a neighbour
    scale.first = scale.first.cwiseMax(jet.first.cwiseAbs());
    scale.second = scale.second.cwiseMax(jet.second.cwiseAbs());
    scale.tip = std::max(scale.tip, std::abs(jet.tip_first));
    scale.turn = std::max(scale.turn, std::abs(jet.turn_first));
  }
  return scale;
}

/// The survey on its way along the path.
class Surveyor {
 public:
  Surveyor(const FeedPath& path, const FeedLimits& limits, double share)
      : path_(path), limits_(limits), share_(share), joints_(limits.velocity.size()) {}

  FeedSurvey run() {
    found_.slow.push_back(0.0);
    scale_ = path_scale(path_, joints_);
    const std::size_t inside =
        std::max<std::size_t>(2, (kPlaces + path_.pieces() - 1) / path_.pieces());
    for (std::size_t piece = 0; piece < path_.pieces() && good(); ++piece)
      look_at_piece(piece, inside);
    if (good() && !moved_) found_.status = FeedStatus::empty;
    return found_;
  }

 private:
  bool good() const { return found_.status == FeedStatus::solved; }

  void refuse(FeedStatus status, const FeedWitness& witness) {
    if (!good()) return;
    found_.status = status;
    found_.witness = witness;
  }

  void look_at_piece(std::size_t piece, std::size_t inside) {
    const double begin = path_.breaks[piece], size = path_.breaks[piece + 1] - begin;
    double slowness = 0.0, still_at = begin;
    bool still = false;
    for (std::size_t i = 0; i < inside + 2 && good(); ++i) {
      const double s = i > inside ? path_.breaks[piece + 1]
                                  : begin + size * static_cast<double>(i) / (inside + 1.0);
      const PathJet jet = jet_at(path_, piece, s, joints_);
      if (!finite(jet)) return name_infinite(jet, piece, s);
      name_no_limit(jet, piece, s);
      if (i == 0 && last_) compare(*last_, jet, piece);
      const bool moves = this->moves(jet);
      moved_ = moved_ || moves;
      if (!moves && still) hold(piece, still_at);
      if (!moves && !still) still_at = s;
      still = !moves;
      slowness += (i == 0 || i > inside ? 0.5 : 1.0) / piece_bound(jet, piece);
      last_ = jet;
    }
    if (still_ && moved_) refuse(FeedStatus::not_regular, still_witness_);
    found_.slow.push_back(found_.slow.back() + slowness * size / (inside + 1.0));
  }

  double piece_bound(const PathJet& jet, std::size_t piece) const {
    const double bound = speed_bound(jet, limits_, path_.feed[piece]);
    return path_.rate.empty() ? bound : std::min(bound, path_.rate[piece]);
  }

  bool moves(const PathJet& jet) const {
    const double least = kMoves * scale_.largest();
    return (joints_ > 0 && jet.first.cwiseAbs().maxCoeff() > least) ||
           std::abs(jet.tip_first) > least || std::abs(jet.turn_first) > least;
  }

  /// Nothing moves about s: refused as soon as something moves elsewhere.
  void hold(std::size_t piece, double s) {
    if (still_) return;
    still_ = true;
    still_witness_.s = s;
    still_witness_.piece = piece;
  }

  void name_infinite(const PathJet& jet, std::size_t piece, double s) {
    FeedWitness witness;
    witness.s = s;
    witness.piece = piece;
    witness.value = std::isfinite(jet.tip_first) ? jet.turn_first : jet.tip_first;
    for (int k = static_cast<int>(joints_) - 1; k >= 0; --k)
      for (const double value : {jet.third[k], jet.second[k], jet.first[k]})
        if (!std::isfinite(value)) {
          witness.joint = k;
          witness.value = value;
        }
    refuse(FeedStatus::not_finite, witness);
  }

  void name_no_limit(const PathJet& jet, std::size_t piece, double s) {
    using Kind = FeedWitness::Kind;
    const auto need = [&](Kind kind, int joint, double rate, double limit) {
      if (!(limit > 0.0)) refuse(FeedStatus::no_limit, {kind, joint, s, piece, rate, limit});
    };
    need(Kind::feed, -1, jet.tip_first, path_.feed[piece]);
    if (!path_.rate.empty()) need(Kind::feed, -1, 1.0, path_.rate[piece]);
    const double least = kMoves * scale_.largest();
    bool bounded = !path_.rate.empty() && path_.rate[piece] < kInfinity;
    for (int k = 0; k < joints_; ++k) {
      const double rate = jet.first[k];
      if (std::abs(rate) <= least) continue;
      need(Kind::velocity, k, rate, limits_.velocity[k]);
      need(Kind::acceleration, k, rate, limits_.acceleration[k]);
      need(Kind::jerk, k, rate, limits_.jerk[k]);
      bounded = bounded || limits_.velocity[k] < kInfinity || limits_.acceleration[k] < kInfinity ||
                limits_.jerk[k] < kInfinity;
    }
    if (std::abs(jet.turn_first) > least) {
      need(Kind::turn_rate, -1, jet.turn_first, limits_.turn_rate);
      bounded = bounded || limits_.turn_rate < kInfinity;
    }
    if (std::abs(jet.tip_first) > least) {
      need(Kind::acceleration, -1, jet.tip_first, limits_.tip_acceleration);
      need(Kind::jerk, -1, jet.tip_first, limits_.tip_jerk);
      bounded = bounded || path_.feed[piece] < kInfinity;
    }
    bounded = bounded || limits_.tip_acceleration < kInfinity || limits_.tip_jerk < kInfinity;
    if (!bounded && moves(jet))
      refuse(FeedStatus::no_limit, {Kind::velocity, -1, s, piece, scale_.largest(), kInfinity});
  }

  /// Jumps of q' and q'' at the start of a piece.
  void compare(const PathJet& before, const PathJet& after, std::size_t piece) {
    using Kind = FeedWitness::Kind;
    const double s = path_.breaks[piece];
    const double speed = std::min(piece_bound(before, piece - 1), piece_bound(after, piece));
    for (int k = 0; k < joints_; ++k) {
      if (!(limits_.acceleration[k] < kInfinity || limits_.jerk[k] < kInfinity)) continue;
      const auto judge = [&](Kind kind, double jump, double allowed, double largest) {
        const double reference = std::isfinite(allowed) ? allowed : largest;
        if (std::abs(jump) > share_ * reference)
          refuse(FeedStatus::not_smooth, {kind, k, s, piece, jump, share_ * reference});
      };
      judge(Kind::velocity, after.first[k] - before.first[k], limits_.velocity[k] / speed,
            scale_.first[k]);
      judge(Kind::acceleration, after.second[k] - before.second[k],
            limits_.acceleration[k] / (speed * speed), scale_.second[k]);
    }
  }

  const FeedPath& path_;
  const FeedLimits& limits_;
  double share_;
  Eigen::Index joints_;
  PathScale scale_;
  FeedSurvey found_;
  std::optional<PathJet> last_;
  bool moved_ = false, still_ = false;
  FeedWitness still_witness_;
};

/// Least limit/rate of joints and tip at a place.
struct EndBounds {
  double acceleration = kInfinity, jerk = kInfinity;
};

EndBounds end_bounds(const PathJet& jet, const FeedLimits& limits) {
  EndBounds bounds;
  const auto take = [&](double rate, double acceleration, double jerk) {
    if (!(std::abs(rate) > 0.0)) return;
    if (acceleration > 0.0)
      bounds.acceleration = std::min(bounds.acceleration, acceleration / std::abs(rate));
    if (jerk > 0.0) bounds.jerk = std::min(bounds.jerk, jerk / std::abs(rate));
  };
  for (int k = 0; k < jet.first.size(); ++k)
    take(jet.first[k], limits.acceleration[k], limits.jerk[k]);
  take(limited_length(jet)[0], limits.tip_acceleration, limits.tip_jerk);
  return bounds;
}

}  // namespace

double speed_bound(const PathJet& jet, const FeedLimits& limits, double feed) {
  double speed = kInfinity;
  const auto take = [&](double bound) { speed = std::min(speed, bound); };
  const auto lane = [&](double limit, double rate) {
    return limit > 0.0 && rate != 0.0 ? limit / std::abs(rate) : kInfinity;
  };
  for (int k = 0; k < jet.first.size(); ++k) {
    take(lane(limits.velocity[k], jet.first[k]));
    take(std::sqrt(lane(limits.acceleration[k], jet.second[k])));
    take(std::cbrt(lane(limits.jerk[k], jet.third[k])));
  }
  take(lane(feed, jet.tip_first));
  take(lane(limits.turn_rate, jet.turn_first));
  const auto length = limited_length(jet);
  take(std::sqrt(lane(limits.tip_acceleration, length[1])));
  take(std::cbrt(lane(limits.tip_jerk, length[2])));
  return speed;
}

double FeedSurvey::time(const FeedPath& path, double s) const {
  const auto next = std::upper_bound(path.breaks.begin() + 1, path.breaks.end() - 1, s);
  const std::size_t i = static_cast<std::size_t>(next - path.breaks.begin());
  const double share = (s - path.breaks[i - 1]) / (path.breaks[i] - path.breaks[i - 1]);
  return slow[i - 1] + share * (slow[i] - slow[i - 1]);
}

double FeedSurvey::place(const FeedPath& path, double t) const {
  if (t >= slow.back()) return path.breaks.back();
  const auto next = std::upper_bound(slow.begin() + 1, slow.end() - 1, t);
  const std::size_t i = static_cast<std::size_t>(next - slow.begin());
  const double rise = slow[i] - slow[i - 1];
  const double share = rise > 0.0 ? std::clamp((t - slow[i - 1]) / rise, 0.0, 1.0) : 1.0;
  return path.breaks[i - 1] + share * (path.breaks[i] - path.breaks[i - 1]);
}

FeedSurvey survey(const FeedPath& path, const FeedLimits& limits, double smooth_share) {
  return Surveyor(path, limits, smooth_share).run();
}

RestGrading grading(const FeedPath& path, const FeedLimits& limits, const FeedSurvey& survey,
                    const FeedSpan& span) {
  RestGrading result;
  const double time = survey.time(path, span.to) - survey.time(path, span.from);
  result.speed = time > 0.0 ? (span.to - span.from) / time : kInfinity;
  result.acceleration = result.jerk = kInfinity;
  for (const double s : {span.from, span.to}) {
    const auto next = std::upper_bound(path.breaks.begin() + 1, path.breaks.end() - 1, s);
    const std::size_t piece = static_cast<std::size_t>(next - path.breaks.begin()) - 1;
    const EndBounds bounds = end_bounds(path.jet(piece, s), limits);
    result.acceleration = std::min(result.acceleration, bounds.acceleration);
    result.jerk = std::min(result.jerk, bounds.jerk);
  }
  return result;
}

}  // namespace smoothpost
