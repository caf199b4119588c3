#include "examples/paper_b/study.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "kernels/core/units.h"
#include "kernels/optimise/tip_fit.h"
#include "kernels/spline/quaternion_spline.h"

namespace smoothpost::paper_b {

namespace {

constexpr double kReserve = 5.0;         // mm of the standoff's range at either end
constexpr double kTipTolerance = 0.005;  // mm
constexpr double kCycle = 0.004;         // s
// Of cone, of via points with cone, of monotone; rad/s³.
constexpr std::array<double, 3> kLooseJerk = {2000.0, 30000.0, 300000.0};
constexpr int kLocationsPerKnot = 4;

ChainJoint joint(JointKind kind, const Vec3& direction, double lower, double upper) {
  ChainJoint j;
  j.kind = kind;
  j.direction = direction;
  j.lower = lower;
  j.upper = upper;
  return j;
}

RateLimits by_piece(const RateLimits& limits, double rate) {
  return {limits.velocity / rate, limits.acceleration / (rate * rate),
          limits.jerk / (rate * rate * rate)};
}

/// Quaternions whose z axes are the programmed axes at the via points, without needless twist, so
/// that the slerp of two neighbours moves the axis on its great circle.
QuaternionKnots via_quaternions(const Study& study) {
  QuaternionKnots knots;
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  for (const RotaryVia& via : study.via_points({})) {
    const Vec3 axis = study.window(via.u).normal;
    q = Eigen::Quaterniond::FromTwoVectors(q * Vec3::UnitZ(), axis) * q;
    knots.u.push_back(via.u);
    knots.values.push_back(q.normalized());
  }
  return with_continuous_signs(knots);
}

double quantile(const std::vector<double>& sorted, double share) {
  const double at = share * static_cast<double>(sorted.size() - 1);
  const auto i = static_cast<std::size_t>(at);
  const std::size_t next = std::min(i + 1, sorted.size() - 1);
  return sorted[i] + (at - static_cast<double>(i)) * (sorted[next] - sorted[i]);
}

double ratio(const RateLimits& limits, double v, double a, double j) {
  return std::max({std::abs(v) / limits.velocity, std::abs(a) / limits.acceleration,
                   std::abs(j) / limits.jerk});
}

/// Value and derivatives by u of q1 … q6 in its columns.
Eigen::Matrix<double, 6, 4> joint_jets(const Study& study, const HeadGeometry& head,
                                       const SplineCurve& rotary, double u,
                                       const SplineCurve* standoff) {
  static constexpr double kBinomial[4][4] = {
      {1, 0, 0, 0}, {1, 1, 0, 0}, {1, 2, 1, 0}, {1, 3, 3, 1}};
  Eigen::Matrix<double, 6, 4> out = Eigen::Matrix<double, 6, 4>::Zero();
  VectorJet tip;
  Jet q4{};
  Jet q5{};
  for (int r = 0; r < 4; ++r) {
    tip.col(r) = study.tip().at(u, r);
    out.block<2, 1>(3, r) = rotary.at(u, r);
    q4[static_cast<std::size_t>(r)] = out(3, r);
    q5[static_cast<std::size_t>(r)] = out(4, r);
    if (standoff != nullptr) out(5, r) = standoff->at(u, r)[0];
  }
  const LinearsByStandoff l = linears_by_standoff(head, tip, q4, q5);
  for (int r = 0; r < 4; ++r) {
    out.block<3, 1>(0, r) = l.a.col(r);
    for (int s = 0; s <= r; ++s)
      out.block<3, 1>(0, r) += kBinomial[r][s] * out(5, s) * l.b.col(r - s);
  }
  return out;
}

/// The tip on knots as the rotaries have them, or on twice or four times as many when those cannot
/// follow it (curvature that steps where a bend begins).
SplineCurve smooth_tip(TipFitProblem fit, int pieces) {
  for (const int finer : {1, 2, 4}) {
    fit.knots = clamped_knots(5, finer * pieces);
    for (double& u : fit.knots.values) u /= finer;
    TipFit fitted = fit_tip(fit);
    if (fitted.failed < 0) return std::move(fitted.curve);
  }
  throw std::runtime_error("the tip cannot be fitted");
}

std::vector<CutterLocation> locations_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::vector<CutterLocation> list;
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#' || line[0] == 'x') continue;
    std::istringstream cells(line);
    std::array<double, 6> v{};
    for (double& value : v) {
      std::string cell;
      if (!std::getline(cells, cell, ',')) throw std::runtime_error(file.string() + ": " + line);
      value = std::stod(cell);
    }
    list.push_back({Vec3(v[0], v[1], v[2]), Vec3(v[3], v[4], v[5]).normalized()});
  }
  if (list.size() < 20) throw std::runtime_error(file.string() + ": no cutter locations");
  return list;
}

}  // namespace

Case read_case(const std::filesystem::path& file, int number) {
  Case out;
  out.name = number == 1 ? "Case 1" : "Case 2";
  out.locations = locations_of(file);
  out.place = {0.0};
  for (std::size_t i = 1; i < out.locations.size(); ++i)
    out.place.push_back(out.place.back() +
                        (out.locations[i].tip - out.locations[i - 1].tip).norm());
  out.lead = radians_from_degrees(number == 1 ? 5.0 : 15.0);
  out.tilt = radians_from_degrees(number == 1 ? 5.0 : 10.0);
  out.feed = (number == 1 ? 20000.0 : 15000.0) / kSecondsPerMinute;
  out.via = number == 1 ? std::vector<double>{0, 240, 480, 720, 960, 1200}
                        : std::vector<double>{0, 100, 200, 236, 290, 340, 391, 427, 530, 627.5};
  return out;
}

ScrewChain laser(double arm) {
  ScrewChain chain;
  using enum JointKind;
  chain.joints = {joint(linear, Vec3::UnitX(), 0, 1600),
                  joint(linear, Vec3::UnitY(), 0, 1400),
                  joint(linear, Vec3::UnitZ(), 0, 3000),
                  joint(rotary, Vec3::UnitZ(), -2.0 * kPi, 2.0 * kPi),
                  joint(rotary, Vec3::UnitY(), -0.5 * kPi, 0.5 * kPi),
                  joint(linear, Vec3::UnitZ(), -100, 20)};
  chain.joints.back().redundant = true;
  chain.tool_home.translation() = Vec3(0, 0, -arm);
  return chain;
}

std::string to_string(Method method) {
  switch (method) {
    case Method::qi:
      return "qi";
    case Method::qi_c2:
      return "qi_c2";
    case Method::via:
      return "via";
    case Method::monotone:
      return "monotone";
    case Method::cone:
      return "cone";
    case Method::via_cone:
      return "via + cone";
  }
  return "";
}

Study::Study(Case given, bool last_word_by_ipopt)
    : case_(std::move(given)), ipopt_(last_word_by_ipopt && ipopt_available()), chain_(laser(0.0)) {
  const int count = static_cast<int>(case_.locations.size());
  const int pieces = (count - 2) / kLocationsPerKnot + 1;
  problem_.knots = clamped_knots(5, pieces);
  TipFitProblem fit;
  for (const double s : case_.place)
    fit.u.push_back(std::min<double>(pieces, s / case_.length() * pieces));
  for (const CutterLocation& l : case_.locations) fit.points.push_back(l.tip);
  fit.tolerance = kTipTolerance;
  fit.hybrid = ipopt_;
  tip_ = smooth_tip(fit, pieces);
  problem_.chain = &chain_;
  problem_.joints = {3, 4};
  problem_.held = JointVector::Zero(6);
  problem_.lower = {-2.0 * kPi, -0.5 * kPi};
  problem_.upper = {2.0 * kPi, 0.5 * kPi};
  double before = 0.0;
  for (const double u : fit.u) {
    problem_.windows.push_back(window(u));
    problem_.seed.push_back(rotaries_of(problem_.windows.back().normal, before));
    before = problem_.seed.back()[0];
  }
}

std::array<double, 2> Study::rotaries_of(const Vec3& axis, double before) {
  const double q4 = std::atan2(axis.y(), axis.x());
  return {q4 + 2.0 * kPi * std::round((before - q4) / (2.0 * kPi)),
          std::atan2(std::hypot(axis.x(), axis.y()), axis.z())};
}

OrientationWindow Study::window(double u) const {
  const double s = std::clamp(u / spans(), 0.0, 1.0) * case_.length();
  const auto above = std::upper_bound(case_.place.begin() + 1, case_.place.end() - 1, s);
  const auto i = static_cast<std::size_t>(above - case_.place.begin());
  const double t = (s - case_.place[i - 1]) / (case_.place[i] - case_.place[i - 1]);
  OrientationWindow w;
  w.u = u;
  w.normal =
      great_circle(case_.locations[i - 1].axis, case_.locations[i].axis, std::clamp(t, 0.0, 1.0));
  const Vec3 along = tip_.at(u, 1);
  w.tangent = (along - along.dot(w.normal) * w.normal).normalized();
  w.binormal = w.normal.cross(w.tangent);
  w.lead_low = -case_.lead;
  w.lead_high = case_.lead;
  w.tilt_low = -case_.tilt;
  w.tilt_high = case_.tilt;
  return w;
}

std::vector<RotaryVia> Study::via_points(const Request& request) const {
  std::vector<double> places = case_.via;
  places.insert(places.end(), request.more_via.begin(), request.more_via.end());
  std::vector<std::size_t> indices;
  const double half = 0.5 * case_.length() / static_cast<double>(case_.place.size());
  for (const double s : places) {
    const auto at = std::lower_bound(case_.place.begin(), case_.place.end() - 1, s - half);
    indices.push_back(static_cast<std::size_t>(at - case_.place.begin()));
  }
  std::sort(indices.begin(), indices.end());
  indices.erase(std::unique(indices.begin(), indices.end()), indices.end());
  std::vector<RotaryVia> list;
  for (const std::size_t i : indices) list.push_back({problem_.windows[i].u, problem_.seed[i]});
  return list;
}

RotaryProblem Study::problem_for(const Request& request) const {
  RotaryProblem problem = problem_;
  problem.chain = &chain_;
  problem.monotone = request.method == Method::monotone;
  const bool cone = request.method == Method::cone || request.method == Method::via_cone;
  if (!cone) {
    problem.windows.clear();
    problem.seed.clear();
  }
  if (request.method != Method::cone) problem.via = via_points(request);
  if (request.limits)
    problem.limits.fill(by_piece(kRotaryLimits, rate(request.feed)));
  else if (cone || problem.monotone)  // far above the optimum's peak: it scales the programme, and
                                      // is never reached
    for (RateLimits& l : problem.limits)
      l.jerk = by_piece({1.0, 1.0,
                         kLooseJerk[problem.monotone      ? 2
                                    : problem.via.empty() ? 0
                                                          : 1]},
                        rate(request.feed))
                   .jerk;
  return problem;
}

RotaryResult Study::with_tension(const RotaryProblem& problem, double weight) const {
  const SplineLayout layout = spline_layout(problem.knots, 3, 2);
  QuadraticProgram qp = empty_program(layout);
  std::vector<NewRow> rows;
  for (int c = 0; c < 2; ++c) {
    add_derivative_cost(qp, c, 3, 2.0);
    add_derivative_cost(qp, c, 1, 2.0 * weight);
    for (const RotaryVia& via : problem.via) {
      const double q = via.q[static_cast<std::size_t>(c)];
      rows.push_back({local_row(layout, c, via.u, 0), q, q, "via point", via.u});
    }
  }
  set_rows(qp, rows);
  for (int c = 0; c < 2; ++c)
    for (const int level : {1, 2})
      for (const int j : {0, layout.count(level) - 1})
        qp.lower[layout.index(c, level, j)] = qp.upper[layout.index(c, level, j)] = 0.0;
  RotaryResult out;
  out.solution = solve_qp(qp);
  out.q = {layout.knots, controls_of(layout, out.solution.x)};
  if (out.solution.status == QpStatus::optimal) out.status = RotaryStatus::optimal;
  return out;
}

RotaryResult Study::rotaries(const Request& request) const {
  const RotaryProblem problem = problem_for(request);
  const double r = rate(request.feed);
  if (request.tension > 0.0) return with_tension(problem, request.tension / (r * r * r * r));
  RotarySettings settings;
  settings.hybrid = ipopt_;
  settings.most_passes = 40;
  return optimise_rotaries(problem, settings);
}

double Study::largest_feed(Method method) const {
  const RotaryProblem problem = problem_for({method, case_.feed, true, 0.0, {}});
  RotarySettings settings;
  settings.most_passes = 40;
  const RotaryTime answer = least_rotary_time(problem, 0.1, settings);
  if (answer.status != RotaryStatus::optimal && answer.status != RotaryStatus::not_converged)
    throw std::runtime_error(case_.name + ": no feed for " + to_string(method));
  return case_.feed / answer.factor;
}

std::function<Vec3(double)> Study::baseline_axis(Method method) const {
  const QuaternionKnots knots = via_quaternions(*this);
  if (method == Method::qi)
    return [knots](double u) -> Vec3 { return slerp_at(knots, u) * Vec3::UnitZ(); };
  return
      [spline = QuaternionSpline(knots)](double u) -> Vec3 { return spline.at(u) * Vec3::UnitZ(); };
}

Motion motion_of_splines(const Study& study, const SplineCurve& rotary, const Setting& setting) {
  const HeadGeometry head = *HeadGeometry::from(laser(setting.arm));
  const double rate = study.rate(setting.feed);
  Motion out;
  for (int i = 0; i <= setting.steps; ++i) {
    const double u = std::min(study.spans(), study.spans() * i / setting.steps);
    const auto jets = joint_jets(study, head, rotary, u, setting.standoff);
    out.u.push_back(u);
    out.time.push_back(u / rate);
    auto& q = out.joints.emplace_back();
    auto& j = out.jerk.emplace_back();
    for (int c = 0; c < 6; ++c) {
      const auto k = static_cast<std::size_t>(c);
      q[k] = jets(c, 0);
      j[k] = jets(c, 3) * rate * rate * rate;
      const RateLimits& limits = c < 3 ? kLinearLimits : c < 5 ? kRotaryLimits : kStandoffLimits;
      out.worst_limit = std::max(out.worst_limit,
                                 ratio(limits, jets(c, 1) * rate, jets(c, 2) * rate * rate, j[k]));
    }
    out.axis.emplace_back(std::cos(q[3]) * std::sin(q[4]), std::sin(q[3]) * std::sin(q[4]),
                          std::cos(q[4]));
  }
  return out;
}

Motion motion_of_baseline(const Study& study, Method method, const Setting& setting) {
  const auto axis = study.baseline_axis(method);
  const double step = study.rate(setting.feed) * kCycle;
  const int steps = static_cast<int>(study.spans() / step + 1e-9);
  Motion out;
  double before = 0.0;
  for (int i = 0; i <= steps; ++i) {
    const double u = std::min(study.spans(), i * step);
    const Vec3 o = axis(u);
    const auto q = Study::rotaries_of(o, before);
    before = q[0];
    const Vec3 wrist = Vec3(study.tip().at(u)) + setting.arm * o;
    out.u.push_back(u);
    out.time.push_back(i * kCycle);
    out.joints.push_back({wrist.x(), wrist.y(), wrist.z(), q[0], q[1], 0.0});
    out.axis.push_back(o);
  }
  out.jerk.assign(out.joints.size(), {});
  for (std::size_t i = 1; i + 2 < out.joints.size(); ++i)
    for (std::size_t c = 0; c < 6; ++c)
      out.jerk[i][c] = (out.joints[i + 2][c] - 3.0 * out.joints[i + 1][c] + 3.0 * out.joints[i][c] -
                        out.joints[i - 1][c]) /
                       (kCycle * kCycle * kCycle);
  return out;
}

JerkNumbers jerk_numbers(const Motion& motion, int joint) {
  std::vector<double> sizes;
  double squares = 0.0;
  for (const auto& j : motion.jerk) {
    sizes.push_back(std::abs(j[static_cast<std::size_t>(joint)]));
    squares += sizes.back() * sizes.back();
  }
  const double rms = std::sqrt(squares / static_cast<double>(sizes.size()));
  std::sort(sizes.begin(), sizes.end());
  return {quantile(sizes, 0.25), quantile(sizes, 0.5), quantile(sizes, 0.75), sizes.back(), rms};
}

double linear_jerk_rms(const Motion& motion) {
  double squares = 0.0;
  for (const auto& j : motion.jerk) squares += j[0] * j[0] + j[1] * j[1] + j[2] * j[2];
  return std::sqrt(squares / static_cast<double>(motion.jerk.size()));
}

Deviation deviation(const Study& study, const Motion& motion) {
  Deviation out;
  for (std::size_t i = 0; i < motion.axis.size(); ++i) {
    const OrientationWindow w = study.window(motion.u[i]);
    const Vec3& o = motion.axis[i];
    const double up = o.dot(w.normal);
    out.lead = std::max(out.lead, std::abs(std::atan2(o.dot(w.tangent), up)));
    out.tilt = std::max(out.tilt, std::abs(std::atan2(o.dot(w.binormal), up)));
    out.total = std::max(out.total, angle_between(o, w.normal));
  }
  return out;
}

StandoffOptions standoff_options(const Study& study, double feed, bool limits) {
  StandoffOptions out;
  out.lower = -100.0 + kReserve;
  out.upper = 20.0 - kReserve;
  if (!limits) return out;
  const double rate = study.rate(feed);
  out.standoff = by_piece(kStandoffLimits, rate);
  out.linear.fill(by_piece(kLinearLimits, rate));
  return out;
}

}  // namespace smoothpost::paper_b
