#include "postproc/pipeline/laser_samples.h"

#include <algorithm>
#include <cmath>

#include "postproc/pipeline/block_steps.h"

namespace smoothpost {

namespace {

constexpr double kUsed = 0.8;        // of the chord share: it is looked at in quarters alone
constexpr double kSamePlace = 1e-9;  // of u
constexpr double kLeastStep = 1e-4;  // of u

bool chord_holds(const LaserSampling& in, double from, double to, const JointVector& a,
                 const JointVector& b) {
  const auto& t = in.machine.tolerance;
  for (const double share : {0.25, 0.5, 0.75}) {
    const CutterLocation want = in.path.tool(from + share * (to - from));
    const JointVector q = a + share * (b - a);
    const CutterLocation holder = forward_location(in.pair.chain(), q);
    const Vec3 tip = holder.tip - in.tool_length * holder.axis;
    if ((tip - want.tip).norm() > kUsed * t.tip * t.budget.chord) return false;
    if ((holder.axis - want.axis).norm() > kUsed * t.axis * t.budget.chord) return false;
  }
  return true;
}

void add(const LaserSampling& in, double u, const JointVector& q, LaserSamples& out) {
  const PathPlace at = in.places.place(std::min(in.places.length(), in.path.length_at(u)));
  JointSample s;
  s.segment = at.segment;
  s.s = at.s;
  s.branch = in.start.branch;
  s.q = q;
  out.samples.push_back(std::move(s));
  out.u.push_back(u);
}

}  // namespace

LaserSamples sample_path(const LaserSampling& in, double rate) {
  LaserSamples out;
  const double usual = usual_block_time(in.machine) * rate;
  double u = in.path.first(), shortest = INFINITY;
  JointVector from = in.path.joints(u);
  out.samples.push_back(in.start);
  out.samples.back().q = from;
  out.u.push_back(u);
  for (const double stop : in.stops) {
    while (u < stop - kSamePlace) {
      const double rest = stop - u;
      double step = longest_step(rest, usual, kLeastStep, [&](double s) {
        return chord_holds(in, u, u + s, from, in.path.joints(u + s));
      });
      if (rest - step < kSamePlace) step = rest;
      shortest = std::min(shortest, step);
      u = rest - step < kSamePlace ? stop : u + step;
      const JointVector to = in.path.joints(u);
      add(in, u, to, out);
      from = to;
    }
  }
  const double allowed = shortest / in.machine.cycle.min_block;
  out.rate = rate > allowed && shortest < usual * (1.0 - 1e-6) ? allowed : rate;
  for (std::size_t i = 1; i < out.samples.size(); ++i)
    out.samples[i].time = (out.u[i] - out.u[i - 1]) / out.rate;
  return out;
}

}  // namespace smoothpost
