#include "examples/paper_b/comparison.h"

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <stdexcept>

#include "examples/paper_b/collisions.h"
#include "examples/paper_b/plots.h"
#include "kernels/core/units.h"
#include "kernels/geometry/triangle_tree.h"

namespace smoothpost::paper_b {

namespace {

constexpr int kSteps = 5000;
constexpr double kBackOff = 0.98;  // of the largest feed, where the optimum is a single point

/// One method with one standoff.
struct Entry {
  std::string name;
  Motion motion;
};

double metres_per_minute(double feed) { return feed * kSecondsPerMinute / 1000.0; }

SplineCurve rotaries_or_throw(const Study& study, const Request& request) {
  RotaryResult r = study.rotaries(request);
  if (r.status != RotaryStatus::optimal)
    throw std::runtime_error(study.path().name + ": no rotaries for " + to_string(request.method));
  return r.q;
}

/// Largest feed, programmed or below, at which via and cone with optimised standoff keep Table 2.
double common_feed(const Study& study, double arm) {
  const HeadGeometry head = *HeadGeometry::from(laser(arm));
  double feed = study.path().feed;
  for (const Method method : {Method::via, Method::cone})
    feed = std::min(feed, kBackOff * study.largest_feed(method));
  // Slower rotaries are other rotaries: again until nothing is slowed.
  for (int round = 0; round < 20; ++round) {
    double factor = 1.0;
    bool kept = true;
    for (const Method method : {Method::via, Method::cone}) {
      const SplineCurve q = rotaries_or_throw(study, {method, feed, true, 0.0, {}});
      const StandoffOptions options = standoff_options(study, feed, true);
      const StandoffResult here = optimise_standoff(head, study.tip(), q, options);
      if (here.solution.status == QpStatus::optimal) continue;
      const StandoffTimeFactor t = least_standoff_time(head, study.tip(), q, options);
      if (!t.found) throw std::runtime_error(study.path().name + ": no feed for the standoff");
      kept = false;
      factor = std::max(factor, t.factor);
    }
    if (kept) return feed;
    feed /= 1.0005 * factor;
  }
  throw std::runtime_error(study.path().name + ": no common feed in 20 rounds");
}

std::vector<Entry> entries(const Study& study, const Setting& setting, bool limits) {
  std::vector<Entry> list;
  for (const Method method : {Method::qi, Method::qi_c2})
    list.push_back({to_string(method), motion_of_baseline(study, method, setting)});
  const HeadGeometry head = *HeadGeometry::from(laser(setting.arm));
  for (const Method method : {Method::via, Method::cone}) {
    const SplineCurve q = rotaries_or_throw(study, {method, setting.feed, limits, 0.0, {}});
    const StandoffResult found =
        optimise_standoff(head, study.tip(), q, standoff_options(study, setting.feed, limits));
    Setting with = setting;
    list.push_back({to_string(method), motion_of_splines(study, q, with)});
    if (found.solution.status != QpStatus::optimal) {
      std::printf("%s: no standoff keeps the limits\n", to_string(method).c_str());
      continue;
    }
    with.standoff = &found.q6;
    list.push_back({to_string(method) + " + q6", motion_of_splines(study, q, with)});
  }
  return list;
}

void print(const Study& study, const std::vector<Entry>& list) {
  std::printf(
      "%-10s | joint | |jerk| peak, rms | quartiles   (m/s3 of q1 q2 q3 q6, rad/s3 of q4 q5)\n",
      "method");
  for (const Entry& e : list) {
    for (int joint = 0; joint < 6; ++joint) {
      const JerkNumbers n = jerk_numbers(e.motion, joint);
      const double unit = joint == 3 || joint == 4 ? 1.0 : 1000.0;
      if (joint == 5 && n.peak == 0.0) continue;
      std::printf("%-10s |  q%d   | %10.4g %10.4g | %10.3g %10.3g %10.3g\n", e.name.c_str(),
                  joint + 1, n.peak / unit, n.rms / unit, n.lower / unit, n.median / unit,
                  n.upper / unit);
    }
  }
  std::printf(
      "%-10s | rms |(q1 q2 q3)'''| m/s3 | deviation lead tilt total, deg | largest share of a "
      "limit\n",
      "method");
  for (const Entry& e : list) {
    const Deviation d = deviation(study, e.motion);
    std::printf("%-10s | %10.4g | %6.2f %6.2f %6.2f | ", e.name.c_str(),
                linear_jerk_rms(e.motion) / 1000.0, degrees_from_radians(d.lead),
                degrees_from_radians(d.tilt), degrees_from_radians(d.total));
    if (e.motion.worst_limit > 0.0)
      std::printf("%6.3f\n", e.motion.worst_limit);
    else
      std::printf("unbounded\n");
  }
}

void plot(const std::filesystem::path& folder, const std::string& name,
          const std::vector<Entry>& list) {
  std::vector<Line> all, smooth;
  for (const Entry& e : list) {
    if (e.name != "qi" && e.name != "qi_c2") smooth.push_back({e.name, &e.motion});
    all.push_back({e.name, &e.motion});
  }
  for (Line& line : all)
    if (line.name.size() > 12) line.name.resize(12);
  std::filesystem::create_directories(folder);
  plot_joints(folder / (name + "_joints.svg"), smooth);
  plot_jerk(folder / (name + "_jerk.svg"), smooth);
  plot_boxes(folder / (name + "_boxes.svg"), all);
}

}  // namespace

void compare(const Study& study, const std::filesystem::path& folder) {
  const Case& path = study.path();
  std::printf("%s: %.1f mm, %zu cutter locations, lead %.0f and tilt %.0f deg\n", path.name.c_str(),
              path.length(), path.locations.size(), degrees_from_radians(path.lead),
              degrees_from_radians(path.tilt));
  for (const Method method : {Method::via, Method::cone})
    std::printf(
        "largest constant feed by the rotaries alone (at most ten times the programmed one), %s: "
        "%.2f m/min\n",
        to_string(method).c_str(), metres_per_minute(study.largest_feed(method)));
  for (const double arm : {0.0, 200.0}) {
    const std::string name =
        std::string(path.name == "Case 1" ? "case1" : "case2") + (arm == 0.0 ? "_l0_0" : "_l0_200");
    std::printf("\nL0 = %.0f mm, %.2f m/min, without limits\n", arm, metres_per_minute(path.feed));
    const auto free = entries(study, {arm, path.feed, nullptr, kSteps}, false);
    print(study, free);
    if (!folder.empty()) plot(folder, name + "_no_limits", free);
    const double feed = common_feed(study, arm);
    std::printf("\nL0 = %.0f mm, %.2f m/min, limits of Table 2\n", arm, metres_per_minute(feed));
    const auto limited = entries(study, {arm, feed, nullptr, kSteps}, true);
    print(study, limited);
    if (!folder.empty()) plot(folder, name + "_limits", limited);
  }
}

int comparison_main(int argc, char** argv, int number) {
  if (argc < 2 || argc > 3) {
    std::cerr << "usage: example_paper_b_case" << number << " case.csv [folder for SVG]\n";
    return 2;
  }
  try {
    const Study study(read_case(argv[1], number));
    compare(study, argc > 2 ? argv[2] : "");
    if (number == 2 && triangle_tree_available()) print_collisions(study);
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 2;
  }
  return 0;
}

}  // namespace smoothpost::paper_b
