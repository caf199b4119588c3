#include <algorithm>
#include <cmath>

#include "formats/nc/executor.h"
#include "formats/nc/number_text.h"
#include "kernels/core/units.h"

// G33, G33.1, G76: motions that follow the turning of the spindle.
namespace smoothpost::nc {
namespace {

constexpr AxisMask kLinearAxes = 7;
constexpr std::size_t kX = 0, kZ = 2;
constexpr double kSteepest = 80.0;  // degrees; Q of threads is about 30
constexpr double kMotionsOfPass = 5.0;

AxisMask bit(std::size_t axis) { return static_cast<AxisMask>(1u << axis); }
bool is_whole(double value) { return std::abs(value - std::round(value)) <= 1e-4; }

/// The words of a G76 block in mm.
struct Thread {
  double peak = 0.0;         ///< I, from the drive line to the peaks; below 0: outside thread
  double first_depth = 0.0;  ///< J
  double depth = 0.0;        ///< K
  double degression = 1.0;   ///< R
  double slope = 0.0;        ///< tangent of Q, the angle of the slide
  double taper = 0.0;        ///< E, along the drive line
  bool begins_tapered = false, ends_tapered = false;
  double pitch = 0.0;      ///< P
  long spring_passes = 0;  ///< H
};

}  // namespace

/// Why no motion can follow the spindle here; empty: one can.
std::string Executor::why_not_synchronised(const BlockPlan& plan) const {
  if (plan.axes == 0) return "the axis words are missing";
  if ((plan.axes & ~kLinearAxes) != 0) return "it is read with X, Y and Z only";
  if (modal_.tcp) return "it is not read in tool-centre-point mode; write M429 before";
  if (modal_.inverse_time) return "no such motion in inverse time mode; write G94";
  if (radius_.is_on()) return "no such motion under cutter radius compensation; write G40";
  if (!is_turning()) return "the spindle does not turn; write M3 or M4";
  if (!(modal_.words.speed > 0.0)) return "the spindle has no speed; write S";
  return {};
}

void Executor::synchronised(const BlockWords& block, const BlockPlan& plan) {
  const auto refuse = [&](const std::string& why) {
    log_.error("NC266", g_code_text(plan.motion) + ": " + why, at(block, GGroup::motion));
    coordinates_.move_to(target(block, plan.axes), unknown_at_target(block, plan.axes));
    modal_.motion = kRefusedMotion;
  };
  const std::string why = why_not_synchronised(plan);
  if (!why.empty()) return refuse(why);
  if (plan.motion == 760) {
    const std::string problem = thread(block, plan);
    return problem.empty() ? void() : refuse(problem);
  }
  const double pitch = block.has('K') ? block['K'] * modal_.unit : 0.0;
  if (!(pitch > 0.0)) return refuse("K, the way for each turn of the spindle, is not above 0");
  const AxisWords start = coordinates_.world();
  const AxisMask unknown = coordinates_.unknown();
  synchronised_move(block, plan, target(block, plan.axes), pitch);
  if (plan.motion != 331) return;
  synchronised_move(block, plan, start, -pitch);
  coordinates_.move_to(start, unknown);
}

/// A straight motion to world coordinates; `pitch` 0: a rapid, which is left out on the spot.
void Executor::synchronised_move(const BlockWords& block, const BlockPlan& plan,
                                 const AxisWords& end, double pitch) {
  if (pitch == 0.0 && end == coordinates_.world()) return;
  begin_motion(block, plan);
  motion_.kind = pitch == 0.0 ? MotionKind::rapid : MotionKind::feed;
  motion_.end = end;
  motion_.unknown_end = unknown_at_target(block, plan.axes);
  motion_.pitch = pitch;
  if (pitch != 0.0) {
    const Vec3 way(end[0] - motion_.start[0], end[1] - motion_.start[1], end[2] - motion_.start[2]);
    const double speed = std::abs(pitch) * modal_.words.speed / kSecondsPerMinute;
    motion_.duration = way.norm() / speed;
  }
  finish_motion();
}

/// G76, from the present place along Z; what is wrong with its words, or empty.
std::string Executor::thread(const BlockWords& block, const BlockPlan& plan) {
  if ((plan.axes & ~bit(kZ)) != 0) return "it is read with Z, P, I, J, K, R, Q, H, E, L only";
  if (coordinates_.rotated()) return "it is not read under an XY rotation (G10 L2 R)";
  if ((coordinates_.unknown() & (bit(kX) | bit(kZ))) != 0)
    return "where X and Z stand is not known; move there before";
  const auto word = [&](char letter, double otherwise) {
    return block.has(letter) ? block[letter] : otherwise;
  };
  Thread t;
  t.pitch = word('P', 0.0) * modal_.unit;
  const double across = modal_.diameter ? 0.5 * modal_.unit : modal_.unit;
  t.peak = word('I', 0.0) * across;
  t.first_depth = word('J', 0.0) * across;
  t.depth = word('K', 0.0) * across;
  t.degression = word('R', 1.0);
  const double angle = word('Q', 0.0);
  t.slope = std::tan(radians_from_degrees(angle));
  const double ends = word('L', 0.0);
  const double spring = word('H', 0.0);
  if (!(t.pitch > 0.0)) return "P, the pitch, is not above 0";
  if (t.peak == 0.0) return "I, from the drive line to the thread's peaks, is missing";
  if (!(t.first_depth > 0.0)) return "J, the depth of the first cut, is not above 0";
  if (!(t.depth > t.first_depth)) return "K, the full depth, is not above J";
  if (!(t.degression >= 1.0)) return "R, the depth degression, is below 1";
  if (!(std::abs(angle) <= kSteepest)) return "Q, the angle of the slide, is beyond 80 degrees";
  if (!is_whole(ends) || ends < -0.5 || ends > 3.5) return "L, the tapered ends, is 0, 1, 2 or 3";
  if (!is_whole(spring) || spring > 1e9) return "H, the spring passes, is a whole number from 0";
  t.spring_passes = std::lround(spring);
  t.taper = word('E', 0.0) * modal_.unit;
  if (t.taper < 0.0) return "E, the length of a taper, is below 0";
  t.begins_tapered = t.taper > 0.0 && std::lround(ends) % 2 == 1;
  t.ends_tapered = t.taper > 0.0 && std::lround(ends) >= 2;

  const AxisWords start = coordinates_.world();
  const double end_z = target(block, plan.axes)[kZ];
  const double sense = end_z < start[kZ] ? -1.0 : 1.0;
  const double length = std::abs(end_z - start[kZ]) - t.depth * std::abs(t.slope);
  const double tapers = t.taper * ((t.begins_tapered ? 1 : 0) + (t.ends_tapered ? 1 : 0));
  if (!(length > tapers)) return "the thread is not longer than its tapers and the slide's way";
  const double passes = std::pow(t.depth / t.first_depth, t.degression) + spring;
  const double cost = passes * kMotionsOfPass;
  if (!spend(cost < 1e18 ? static_cast<std::uint64_t>(cost) : ~std::uint64_t{0},
             at(block, GGroup::motion)))
    return {};

  const auto pass = [&](double depth) {
    const double outward = t.peak < 0.0 ? 1.0 : -1.0;
    const double safe = start[kX] + outward * (t.depth - depth);
    const double peak = safe + t.peak;
    const double cut = peak - outward * t.depth;
    const double begin = start[kZ] + sense * depth * t.slope;
    const double end = end_z - sense * (t.depth - depth) * t.slope;
    const double slant = t.pitch * std::hypot(t.taper, t.depth) / t.taper;
    const auto go = [&](double x, double z, double pitch) {
      AxisWords to = coordinates_.world();
      to[kX] = x;
      to[kZ] = z;
      synchronised_move(block, plan, to, pitch);
    };
    go(safe, begin, 0.0);
    if (t.begins_tapered) {
      go(peak, begin, slant);
      go(cut, begin + sense * t.taper, slant);
    } else {
      go(cut, begin, 0.0);
    }
    go(cut, t.ends_tapered ? end - sense * t.taper : end, t.pitch);
    if (t.ends_tapered) go(peak, end, slant);
    go(safe, end, 0.0);
  };
  double depth = t.first_depth;
  for (long n = 2; depth < t.depth; ++n) {
    pass(depth);
    depth = t.first_depth * std::pow(static_cast<double>(n), 1.0 / t.degression);
  }
  for (long n = 0; n <= t.spring_passes; ++n) pass(t.depth);
  return {};
}

}  // namespace smoothpost::nc
