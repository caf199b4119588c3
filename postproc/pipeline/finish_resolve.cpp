#include "postproc/pipeline/finish_resolve.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "kernels/core/units.h"

namespace smoothpost {

namespace {

constexpr double kStation = 3.0;                          // mm, at most between stations
constexpr double kStationTurn = 4.0 * kRadiansPerDegree;  // of the axis, likewise
constexpr double kGrid = 3.0 * kRadiansPerDegree;         // of a free rotary
constexpr double kLinearGrid = 2.0;                       // mm, of a free linear joint
constexpr int kMostSteps = 10;
constexpr double kStartGrid = 6.0 * kRadiansPerDegree;  // of a free rotary's start
constexpr double kMoreRoom = 0.01;                      // of a range: less is no reason
constexpr double kReserve = 1.0;  // mm, of linear ranges, for what is between stations
constexpr double kRotaryReserve = kReserve * kRadiansPerDegree;
constexpr double kReserveShare = 0.01;  // of the range, at most
constexpr double kRoom = 0.6;   // rad or, times 100, mm: besides the turn, of the free joint
constexpr int kFreePieces = 2;  // of the contour's spline to one of the free joint's
constexpr int kPasses = 6;
constexpr double kThirdShare = 1e-4;     // of the jerk limit at the feed
constexpr double kLook = 1.0;            // mm, between looks at the scene
constexpr double kVelocityShare = 1e-3;  // of the objective, against long ways

}  // namespace

CutResolver::CutResolver(const FinishPlanInput& input)
    : in_(input),
      limits_(limits_of(input.machine)),
      near_(home_of(input.machine)),
      free_joint_(redundant_joint(input.pair.chain())) {
  if (free_joint_ < 0) return;
  const auto& points = in_.path.path.points;
  for (std::size_t i = 1; i < points.size(); ++i)
    if (points[i].duration > 0.0) {
      feed_ = (points[i].location.tip - points[i - 1].location.tip).norm() / points[i].duration;
      break;
    }
  range_ = free_range();
  weight_.resize(near_.size());
  jerk_weight_.resize(near_.size());
  third_.resize(near_.size());
  for (Eigen::Index j = 0; j < near_.size(); ++j) {
    weight_[j] = 1.0 / (limits_.velocity[j] * limits_.velocity[j]);
    const double jerk = limits_.jerk[j] / (feed_ * feed_ * feed_);
    jerk_weight_[j] = 1.0 / (jerk * jerk);
    third_[j] = kThirdShare * jerk;
  }
}

// Places of the path where the free joint is chosen.
std::vector<double> CutResolver::stations_of(const FinishCut& cut) {
  std::vector<double> stations{0.0};
  Vec3 axis = cut.location(0.0).axis.col(0);
  for (std::size_t i = 1; i < cut.s.size(); ++i) {
    const Vec3 next = cut.location(cut.s[i]).axis.col(0);
    const bool last = i + 1 == cut.s.size();
    if (!last && cut.s[i] - stations.back() < kStation && angle_between(axis, next) < kStationTurn)
      continue;
    stations.push_back(cut.s[i]);
    axis = next;
  }
  return stations;
}

bool CutResolver::rotary() const {
  return in_.machine.axes[static_cast<std::size_t>(free_joint_)].joint.kind == JointKind::rotary;
}

/// The range that the free joint may have: cyclic joints wind without end.
std::pair<double, double> CutResolver::free_range() const {
  if (in_.machine.axes[static_cast<std::size_t>(free_joint_)].joint.cyclic) return {-1e6, 1e6};
  return {limits_.lower[free_joint_], limits_.upper[free_joint_]};
}

// Takes a share of the reserve off both ends of every range.
void CutResolver::draw_in(JointVector& lower, JointVector& upper, double share) const {
  for (Eigen::Index j = 0; j < lower.size(); ++j) {
    const bool turns =
        in_.machine.axes[static_cast<std::size_t>(j)].joint.kind == JointKind::rotary;
    const double reserve =
        share * std::min(turns ? kRotaryReserve : kReserve, kReserveShare * (upper[j] - lower[j]));
    lower[j] += reserve;
    upper[j] -= reserve;
  }
}

GlobalSettings CutResolver::global_settings() const {
  GlobalSettings settings;
  settings.weight = weight_;
  settings.lower = limits_.lower;
  settings.upper = limits_.upper;
  settings.lower[free_joint_] = range_.first;
  settings.upper[free_joint_] = range_.second;
  draw_in(settings.lower, settings.upper, 1.0);
  settings.near = near_;
  settings.grid = rotary() ? kGrid : kLinearGrid;
  settings.most_steps = kMostSteps;
  return settings;
}

// What the free joint turns by on a closed contour: with a free rotary about the part the axis'
// own turn, seen from the machine; else nothing.
std::optional<double> CutResolver::change_of(const FinishCut& cut) const {
  if (!cut.closed) return {};
  return 2.0 * kPi * std::round(turn_of(cut) / (2.0 * kPi));
}

// About what a free rotary under the part turns by, so that the tool's side stays the same.
double CutResolver::turn_of(const FinishCut& cut) const {
  return rotary() ? sign() * cut.turning : 0.0;
}
// Of the free rotary's direction as the part sees it.
double CutResolver::sign() const {
  const Vec3 up = jacobian(in_.pair.chain(), near_).col(free_joint_).head<3>();
  return up.z() > 0.0 ? 1.0 : -1.0;
}

// How a free rotary under the part turns along the stations so that the tool's side stays the
// same; over a closed contour by whole turns.
std::vector<double> CutResolver::expected_at(const FinishCut& cut,
                                             const std::vector<double>& stations,
                                             std::optional<double> change) const {
  std::vector<double> turn(1, 0.0);
  if (!rotary()) return std::vector<double>(stations.size(), 0.0);
  Vec3 before = cut.location(0.0).axis.col(0);
  for (std::size_t i = 1; i < stations.size(); ++i) {
    const Vec3 now = cut.location(stations[i]).axis.col(0);
    turn.push_back(turn.back() + sign() * std::atan2(before.x() * now.y() - before.y() * now.x(),
                                                     before.x() * now.x() + before.y() * now.y()));
    before = now;
  }
  if (change && std::abs(turn.back()) > 1.0)
    for (double& t : turn) t *= *change / turn.back();
  return turn;
}

ChosenCut CutResolver::choose(std::size_t index, std::optional<double> end) const {
  const FinishCut& cut = in_.path.cuts[index];
  const RedundantPath path = path_of(cut);
  ChosenCut out;
  out.cut = index;
  const std::vector<double> stations = stations_of(cut);
  const std::optional<double> change = change_of(cut);
  const std::vector<double> expected = expected_at(cut, stations, change);
  const auto at = [&](double s) {
    const auto i = std::lower_bound(stations.begin(), stations.end(), s) - stations.begin();
    return expected[static_cast<std::size_t>(i)];
  };
  RedundantPath turning = path;
  bool roomy = true;  // the links at both ends have their clearance along the tool axis
  turning.joints = [&](double s, double free, const JointVector& near) {
    auto q = path.joints(s, free + at(s), near);
    const bool at_end = s == stations.front() || s == stations.back();
    if (q && at_end && roomy && !has_room(*q)) q.reset();
    return q;
  };
  GlobalResolution& last = out.found;
  const auto attempt = [&](std::optional<double> start, bool closed) {
    GlobalSettings settings = global_settings();
    settings.start = start;
    if (closed) settings.change = *change - expected.back();
    const double room = rotary() ? kPi + kRoom : 0.5 * (range_.second - range_.first);
    const double middle = start.value_or(rotary() ? 0.0 : 0.5 * (range_.first + range_.second));
    settings.free_lower = middle - room;
    settings.free_upper = middle + room;
    if (in_.scene)
      settings.clear = [this](double, const JointVector& q) { return in_.scene->free(q, &cache_); };
    last = resolve_globally(turning, stations, settings);
    out.collides = last.status == GlobalResolution::Status::blocked;
    if (out.collides) {
      settings.clear = nullptr;
      last = resolve_globally(turning, stations, settings);
    }
    for (std::size_t i = 0; i < last.free.size(); ++i) last.free[i] += expected[i];
    return last.status == GlobalResolution::Status::ok;
  };
  // A way that the scene does not leave free is the last resort.
  std::optional<ChosenCut> colliding;
  const auto good = [&](std::optional<double> start) {
    out.turned = end && !start;
    if (!attempt(start, change.has_value())) return false;
    if (out.collides && !colliding) colliding = out;
    return !out.collides;
  };
  for (const bool wanted : {true, false}) {
    roomy = wanted;
    out.cramped = !wanted;
    if (end && good(end)) return out;
    if (!good({})) continue;
    // Minimum norm is to keep the limits from there, too.
    const ChosenCut found = out;
    const auto start = roomiest_start(path, cut, found.found);
    if (!start || !attempt(start, change.has_value()) || out.collides) return found;
    return out;
  }
  if (colliding) return *colliding;
  if (change) attempt({}, false);
  return out;
}

/// The start, on a grid, from which the joints keep the largest share of their ranges free along
/// minimum norm between the same turns: where its cost is the same for every start, as under x and
/// y of equal weight, the grid's choice may be at a limit. Nothing: the one it has.
std::optional<double> CutResolver::roomiest_start(const RedundantPath& path, const FinishCut& cut,
                                                  const GlobalResolution& found) const {
  const MinimumNorm norm = minimum_norm(path, local_settings(cut, found));
  if (!norm.ok) return {};
  const GlobalSettings settings = global_settings();
  const JointVector range = settings.upper - settings.lower;
  const auto room = [&](double shift) {
    double least = INFINITY;
    for (std::size_t i = 0; i < norm.free.s.size() && least > 0.0; ++i) {
      const auto q = path.joints(norm.free.s[i], norm.free.free[i] + shift, near_);
      if (!q || ((i == 0 || i + 1 == norm.free.s.size()) && !has_room(*q))) return -1.0;
      for (Eigen::Index j = 0; j < q->size(); ++j)
        least = std::min(
            least, std::min((*q)[j] - settings.lower[j], settings.upper[j] - (*q)[j]) / range[j]);
    }
    return least;
  };
  const double step = rotary() ? kStartGrid : kLinearGrid;
  const double span = rotary() ? kPi : 0.5 * (range_.second - range_.first);
  double best = room(0.0), chosen = 0.0;
  for (double shift = step; shift <= span; shift += step)
    for (const double side : {shift, -shift})
      if (const double here = room(side); here > best + kMoreRoom) {
        best = here;
        chosen = side;
      }
  if (chosen == 0.0) return {};
  return found.free.front() + chosen;
}

MinimumNormSettings CutResolver::local_settings(const FinishCut& cut,
                                                const GlobalResolution& found) const {
  MinimumNormSettings local;
  local.weight = weight_;
  local.near = near_;
  local.start = found.free.front();
  local.change = found.free.back() - found.free.front();
  local.step = kFreePieces * cut.scale;
  return local;
}

// Whether the tool can draw back by the links' clearance, inside the ranges and clear.
bool CutResolver::has_room(const JointVector& q) const {
  const CutterLocation at = forward_location(in_.pair.chain(), q);
  const auto back = in_.pair.with_linears(at.tip + in_.machine.links.clearance * at.axis, q);
  if (!back) return false;
  for (Eigen::Index j = 0; j < back->size(); ++j)
    if (j != free_joint_ && ((*back)[j] < limits_.lower[j] || (*back)[j] > limits_.upper[j]))
      return false;
  return !in_.scene || in_.scene->free(*back, &cache_);
}

FreeProfile CutResolver::profile_of(const GlobalResolution& found,
                                    const std::vector<double>& stations) {
  FreeProfile out{stations, found.free, {}};
  for (std::size_t i = 0; i < stations.size(); ++i) {
    const std::size_t a = i > 0 ? i - 1 : 0;
    const std::size_t b = std::min(i + 1, stations.size() - 1);
    out.rate.push_back((out.free[b] - out.free[a]) / (stations[b] - stations[a]));
  }
  return out;
}

bool CutResolver::keeps_limits(const RedundantPath& path, const FreeProfile& free) const {
  const GlobalSettings settings = global_settings();
  for (std::size_t i = 0; i < free.s.size(); ++i) {
    const auto q = path.joints(free.s[i], free.free[i], near_);
    if (!q || (settings.lower - *q).maxCoeff() > 0.0 || (*q - settings.upper).maxCoeff() > 0.0)
      return false;
  }
  return true;
}

SmoothFreeSettings CutResolver::smooth_settings(const FinishCut& cut) const {
  const GlobalSettings global = global_settings();
  SmoothFreeSettings s;
  s.velocity_weight = weight_;
  s.jerk_weight = jerk_weight_;
  s.velocity_share = kVelocityShare;
  s.lower = global.lower;
  s.upper = global.upper;
  draw_in(s.lower, s.upper, -0.5);  // half of it back
  std::tie(s.free_lower, s.free_upper) = range_;
  const double share = in_.machine.tolerance.limit_share;
  for (Eigen::Index j = 0; j < near_.size(); ++j)
    s.limits.push_back({share * limits_.velocity[j] / feed_,
                        share * limits_.acceleration[j] / (feed_ * feed_),
                        share * limits_.jerk[j] / (feed_ * feed_ * feed_)});
  s.spacing = 1e9;  // knots are the breaks
  s.least_spacing = 0.5 * cut.scale;
  s.most_passes = kPasses;
  return s;
}

/// The cut as a path for one thread: a place is asked for many times with other values of the
/// free joint.
RedundantPath CutResolver::path_of(const FinishCut& cut) const {
  struct Last {
    double s = -1.0;
    LocationJet at;
  };
  const auto last = std::make_shared<Last>();
  std::vector<double> breaks;
  for (int i = 0; i < cut.pieces; i += kFreePieces)
    if (cut.pieces - i >= kFreePieces || i == 0) breaks.push_back(cut.scale * i);
  breaks.push_back(cut.length());
  return redundant_path(
      in_.pair,
      [&cut, length = tool_length(cut), last](double s) {
        if (s != last->s) {
          last->at = holder_on_cut(cut, length, s);
          last->s = s;
        }
        return last->at;
      },
      breaks);
}
// Every millimetre. A cut that collides anyhow is not looked at.
bool CutResolver::is_clear(const RedundantPath& path, const SmoothFree& smooth,
                           const FinishCut& cut, SceneCache& cache) const {
  const auto count = static_cast<int>(std::ceil(cut.length() / kLook));
  for (int i = 0; i <= count; ++i) {
    const double s = cut.length() * i / count;
    const auto q = path.joints(s, smooth.jet(s)[0], near_);
    if (!q || !in_.scene->free(*q, &cache)) return false;
  }
  return true;
}

CutResolver::Made CutResolver::make(const ChosenCut& chosen) const {
  const FinishCut& cut = in_.path.cuts[chosen.cut];
  const RedundantPath path = path_of(cut);
  const GlobalResolution& found = chosen.found;
  Made out;
  out.told.cut = chosen.cut;
  out.told.first_line = in_.path.path.points[cut.first_point].line;
  out.told.wound_back = chosen.turned;
  out.told.collides = chosen.collides;
  out.told.start = found.free.front();
  out.told.end = found.free.back();
  const FreeProfile grid = profile_of(found, stations_of(cut));
  const MinimumNorm norm = minimum_norm(path, local_settings(cut, found));
  SmoothFreeSettings settings = smooth_settings(cut);
  struct Way {
    const FreeProfile* seed;
    const char* name;
    int passes;
  };
  std::vector<Way> ways;
  if (norm.ok && keeps_limits(path, norm.free))
    ways.push_back({&norm.free, "minimum norm", kPasses});
  ways.push_back({&grid, "grid", kPasses});
  ways.push_back({&grid, "grid", 0});
  SceneCache cache;
  SmoothFree smooth;
  for (const Way& way : ways) {
    settings.most_passes = way.passes;
    SmoothFree next = smooth_free(path, *way.seed, near_, settings);
    if (!next.ok) continue;
    const bool clear = !in_.scene || chosen.collides || is_clear(path, next, cut, cache);
    if (!clear && smooth.ok) continue;
    smooth = std::move(next);
    out.told.seed = way.name;
    if (clear) break;
  }
  if (!smooth.ok) return out;
  out.told.jerk_before = smooth.before.jerk;
  out.told.jerk_after = smooth.after.jerk;
  out.told.passes = smooth.passes;
  out.joints =
      std::make_shared<FinishJoints>(cut, in_.pair, tool_length(cut), smooth, near_, third_);
  return out;
}

}  // namespace smoothpost
