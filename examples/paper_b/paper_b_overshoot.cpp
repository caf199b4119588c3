#include <algorithm>
#include <cstdio>
#include <iostream>

#include "examples/paper_b/study.h"
#include "kernels/core/units.h"

// What keeps the rotaries of Case 2 near the programmed axis between via points, at 15 m/min and
// without limits: peak jerk, largest deviation, overshoot of q4 beyond its neighbouring via values,
// and the constant feed that Table 2 would leave (the motion slowed as a whole). Argument: a CSV
// file of Case 2.
namespace smoothpost::paper_b {
namespace {

struct Row {
  const char* name;
  const char* printed;  ///< of the study that this table follows
  Request request;
};

/// Via points at the cutter locations of the largest violation until lead and tilt hold.
Request inserted(const Study& study, double feed) {
  Request request{Method::via, feed, false, 0.0, {}};
  for (int round = 0; round < 30; ++round) {
    const RotaryResult r = study.rotaries(request);
    if (r.status != RotaryStatus::optimal) break;
    double worst = 1e-6, where = -1.0;
    for (const OrientationWindow& w : study.windows()) {
      const Eigen::VectorXd q = r.q.at(w.u);
      const Vec3 axis(std::cos(q[0]) * std::sin(q[1]), std::sin(q[0]) * std::sin(q[1]),
                      std::cos(q[1]));
      const double outside = w.outside(axis);
      if (outside <= worst) continue;
      worst = outside;
      where = w.u / study.spans() * study.path().length();
    }
    if (where < 0.0) break;
    request.more_via.push_back(where);
  }
  return request;
}

double overshoot(const Study& study, const SplineCurve& q) {
  const auto via = study.via_points({});
  double most = 0.0;
  for (std::size_t i = 0; i + 1 < via.size(); ++i) {
    const auto [low, high] = std::minmax(via[i].q[0], via[i + 1].q[0]);
    for (int k = 0; k <= 400; ++k) {
      const double value = q.at(via[i].u + (via[i + 1].u - via[i].u) * k / 400.0)[0];
      most = std::max({most, value - high, low - value});
    }
  }
  return most;
}

/// Feed at which the slowed motion meets the limits of both rotaries, mm/s.
double slowed_feed(const Study& study, const SplineCurve& q, double feed) {
  const double rate = study.rate(feed);
  double factor = 1e-9;
  for (int i = 0; i <= 6000; ++i) {
    const double u = std::min(study.spans(), study.spans() * i / 6000.0);
    const double v = q.at(u, 1).cwiseAbs().maxCoeff() * rate;
    const double a = q.at(u, 2).cwiseAbs().maxCoeff() * rate * rate;
    const double j = q.at(u, 3).cwiseAbs().maxCoeff() * rate * rate * rate;
    factor =
        std::max({factor, v / kRotaryLimits.velocity, std::sqrt(a / kRotaryLimits.acceleration),
                  std::cbrt(j / kRotaryLimits.jerk)});
  }
  return feed / factor;
}

void print(const Study& study, const Row& row) {
  const RotaryResult r = study.rotaries(row.request);
  if (r.status != RotaryStatus::optimal && r.status != RotaryStatus::not_converged) {
    std::printf("%-20s | no solution | %s\n", row.name, row.printed);
    return;
  }
  const double feed = row.request.feed;
  const Motion m = motion_of_splines(study, r.q, {0.0, feed, nullptr, 6276});
  const Deviation d = deviation(study, m);
  const bool settled = r.status == RotaryStatus::optimal;
  std::printf("%-20s%c| %6.0f / %6.0f | %5.1f (%5.1f, %5.1f) | %5.1f | %5.2f | %s\n", row.name,
              settled ? ' ' : '*', jerk_numbers(m, 3).peak, jerk_numbers(m, 4).peak,
              degrees_from_radians(d.total), degrees_from_radians(d.lead),
              degrees_from_radians(d.tilt), degrees_from_radians(overshoot(study, r.q)),
              slowed_feed(study, r.q, feed) * kSecondsPerMinute / 1000.0, row.printed);
}

void run(const Study& study) {
  const double feed = study.path().feed;
  const Request insertion = inserted(study, feed);
  const std::string name = "insertion (+" + std::to_string(insertion.more_via.size()) + ")";
  std::printf(
      "%-20s | peak jerk q4 / q5 | deviation (lead, tilt) deg | overshoot q4 deg | feed m/min "
      "| reference\n",
      "method");
  const auto plain = [&](Method m) { return Request{m, feed, false, 0.0, {}}; };
  for (const Row& row :
       {Row{"via", "1140 / 683, 41.2 (29.9 39.2), 60.3, 8.40", plain(Method::via)},
        Row{"tension 4e4 1/s4",
            "1e2: 1735 / 1024, 23.2 (21.0 20.1), 32, 7.3",
            {Method::via, feed, false, 4e4, {}}},
        Row{"tension 4e5 1/s4",
            "1e3: 2798 / 1634, 23.6 (19.4 16.5), 14, 6.2",
            {Method::via, feed, false, 4e5, {}}},
        Row{"monotone", "30480 / 17600, 23.2 (17.6 16.5), 0.3, 2.81", plain(Method::monotone)},
        Row{name.c_str(), "+8: 17819 / 20694, 11.8 (11.2 8.6), 28, 3.20", insertion},
        Row{"via + cone", "3108 / 2592, 17.2 (15.0 10.0), 45, 6.01", plain(Method::via_cone)},
        Row{"cone", "757 / 686, 17.8 (15.0 10.0), 47, 9.63", plain(Method::cone)}})
    print(study, row);
}

}  // namespace
}  // namespace smoothpost::paper_b

int main(int argc, char** argv) {
  using namespace smoothpost::paper_b;
  if (argc != 2) {
    std::cerr << "usage: example_paper_b_overshoot case2.csv\n";
    return 2;
  }
  try {
    run(Study(read_case(argv[1], 2)));
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 2;
  }
  return 0;
}
