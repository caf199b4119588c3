#include "kernels/schedule/stretch_solver.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/schedule/feed_parts.h"
#include "kernels/schedule/feed_start.h"

namespace smoothpost {
namespace {

constexpr int kCoarsePoints = 5;
constexpr int kLeastCoarse = 20;
constexpr double kFirstShare = 0.5;  // of the largest constant b, at the start
constexpr double kCoarseGap = 1e-2, kFineGap = 1e-4, kLastGap = 1e-4;  // of solves, relative to T
constexpr int kCoarseIterations = 40;   // its law only says where elements are wanted
constexpr int kFineIterations = 400;    // 60 to 180 on paths of very uneven feeds
constexpr double kMostFiner = 40.0;     // fine elements a coarse one, in the mean
constexpr double kTightEnough = 1.001;  // dilation after which nothing is drawn in again
constexpr double kMended =
    1.0005;  // of an element, above which it is; more than mend_law() lets out
constexpr double kMostMore = 4.0;      // elements, for the jerk's variation in one
constexpr double kTimeShare = 0.85;    // of the measure of the fine grid; the rest is w
constexpr double kNearLimit = 0.9999;  // loads above it are drawn in
constexpr double kDrawIn = 1.00005;
constexpr double kMostChange = 0.4;   // of b between the first two controls of a moving end
constexpr double kBlendShare = 0.15;  // of the extent: how far an end's value reaches at first

double dilation_of(const FeedLoad& load) {
  return std::max({1.0, load.velocity, std::sqrt(load.acceleration), std::cbrt(load.jerk)});
}

/// How much the jerk of one lane goes up and down inside element e at the law's speed, in shares of
/// its limit: of the lane for which that is most.
double jerk_variation(const FeedStretch& stretch, const FeedGrid& grid,
                      const std::vector<double>& controls, std::size_t e) {
  const std::size_t nodes = grid.rule.nodes.size(), width = static_cast<std::size_t>(grid.width);
  const double size = grid.elements[e].end - grid.elements[e].begin;
  std::array<double, kMaxFeedLanes> before{}, sum{};
  for (std::size_t i = 0; i < nodes; ++i) {
    const double b = cubic_values(grid, controls, e, grid.rule.nodes[i] * size)[0];
    const double scale = b * std::sqrt(b);
    const double* third = &grid.rows[3 * width * (e * nodes + i) + 2 * width];
    for (std::size_t l = 0; l < width; ++l) {
      const double now = third[l] * scale * stretch.lanes.jerk[l];
      if (i > 0) sum[l] += std::abs(now - before[l]);
      before[l] = now;
    }
  }
  return *std::max_element(sum.begin(), sum.end());
}

/// Elements that a law wants up to each place: `count` by its time (mixed with w), and more where
/// the path's own jerk goes up and down.
GridMeasure element_measure(const FeedStretch& stretch, const FeedGrid& grid,
                            const std::vector<double>& controls, double count) {
  GridMeasure measure;
  measure.w.push_back(0.0);
  std::vector<double> time{0.0}, more{0.0};
  constexpr int kParts = 4;
  for (std::size_t e = 0; e < grid.elements.size(); ++e) {
    const FeedElement& element = grid.elements[e];
    const double size = (element.end - element.begin) / kParts;
    const double variation = std::min(kMostMore, jerk_variation(stretch, grid, controls, e));
    for (int p = 0; p < kParts; ++p) {
      const double b = cubic_values(grid, controls, e, size * (p + 0.5))[0];
      measure.w.push_back(p + 1 == kParts ? element.end : element.begin + size * (p + 1));
      time.push_back(time.back() + size / std::sqrt(b));
      more.push_back(more.back() + variation / kParts);
    }
  }
  for (std::size_t i = 0; i < time.size(); ++i)
    measure.value.push_back(count * (kTimeShare * time[i] / time.back() +
                                     (1.0 - kTimeShare) * measure.w[i] / measure.w.back()) +
                            more[i]);
  return measure;
}

/// b of a law at ascending places of w.
std::vector<double> values_at(const FeedGrid& grid, const std::vector<double>& controls,
                              const std::vector<double>& places) {
  std::vector<double> values;
  values.reserve(places.size());
  std::size_t e = 0;
  for (double w : places) {
    while (e + 1 < grid.elements.size() && w > grid.elements[e].end) ++e;
    values.push_back(cubic_values(grid, controls, e, w - grid.elements[e].begin)[0]);
  }
  return values;
}

/// A programme with the limits lowered as the settings say.
FeedProgram make_program(const FeedStretch& stretch, const FeedGrid& grid,
                         const StretchSettings& settings) {
  FeedProgram program;
  program.grid = &grid;
  program.lanes = &stretch.lanes;
  program.going = stretch.going;
  program.factors.reserve(grid.points());
  for (const FeedElement& element : grid.elements)
    for (double node : grid.rule.nodes) {
      const double s = stretch.map.at(grid.place(element, node), element.zone)[0];
      const double f =
          1.0 / ((1.0 - settings.lower) * (1.0 - settings.slope * s / stretch.map.length()));
      program.factors.push_back({f, f * f, f * f * f});
    }
  return program;
}

/// Draws the rows of elements in by what their loads are beyond the lowered limits.
void draw_in(FeedProgram& program, const std::vector<FeedLoad>& loads, double most) {
  const std::size_t nodes = program.grid->rule.nodes.size();
  const auto more = [](double& factor, double load) {
    if (load > kNearLimit) factor *= kDrawIn * load;
  };
  for (std::size_t e = 0; e < loads.size(); ++e) {
    if (dilation_of(loads[e]) <= most) continue;
    for (std::size_t i = e * nodes; i < (e + 1) * nodes; ++i) {
      more(program.factors[i].velocity, loads[e].velocity);
      more(program.factors[i].acceleration, loads[e].acceleration);
      more(program.factors[i].jerk, loads[e].jerk);
    }
  }
}

std::vector<double> scaled(std::vector<double> values, double factor) {
  for (double& value : values) value *= factor;
  return values;
}

std::vector<double> constant_controls(const FeedProgram& program, double share) {
  return std::vector<double>(program.grid->controls(), share * constant_law(program));
}

/// Controls that the ends fix: two each, from b and db/dw.
void fix_ends(FeedProgram& program, const MovingEnds& ends, std::vector<double>& controls) {
  const std::vector<FeedElement>& elements = program.grid->elements;
  const std::size_t n = controls.size();
  if (ends.start.moving) {
    program.fixed_first = 2;
    controls[0] = ends.start.b;
    controls[1] =
        ends.start.b + ends.start.slope * (elements.front().end - elements.front().begin) / 3.0;
  }
  if (ends.end.moving) {
    program.fixed_last = 2;
    controls[n - 1] = ends.end.b;
    controls[n - 2] =
        ends.end.b - ends.end.slope * (elements.back().end - elements.back().begin) / 3.0;
  }
}

/// Halves the outermost elements until the second control is near the first.
void shorten_ends(std::vector<FeedElement>& elements, const MovingEnds& ends) {
  const auto long_for = [](const FeedElement& element, const MovingEnd& end) {
    return end.moving &&
           std::abs(end.slope) * (element.end - element.begin) > 3.0 * kMostChange * end.b;
  };
  for (int n = 0; n < 40 && long_for(elements.front(), ends.start); ++n) {
    FeedElement first = elements.front();
    first.end = 0.5 * (first.begin + first.end);
    elements.front().begin = first.end;
    elements.insert(elements.begin(), first);
  }
  for (int n = 0; n < 40 && long_for(elements.back(), ends.end); ++n) {
    FeedElement last = elements.back();
    last.begin = 0.5 * (last.begin + last.end);
    elements.back().end = last.begin;
    elements.push_back(last);
  }
}

/// A constant law that changes to the ends' own values towards them.
std::vector<double> blended_controls(const FeedProgram& program, const MovingEnds& ends) {
  std::vector<double> controls = constant_controls(program, kFirstShare);
  const std::vector<double> places = greville_places(program.grid->elements);
  const double extent = places.back(), reach = kBlendShare * extent;
  for (std::size_t k = 0; k < controls.size(); ++k) {
    const double base = controls[k];
    if (ends.start.moving) controls[k] += (ends.start.b - base) * std::exp(-places[k] / reach);
    if (ends.end.moving)
      controls[k] += (ends.end.b - base) * std::exp((places[k] - extent) / reach);
    controls[k] = std::max(controls[k], 0.1 * base);
  }
  return controls;
}

/// The law on the first grid.
StretchLaw solve_coarse(const FeedStretch& stretch, const MovingEnds& ends,
                        const StretchSettings& settings) {
  const double extent = stretch.map.extent();
  const int count = std::max(
      {kLeastCoarse, settings.least_elements / 2,
       static_cast<int>(std::min(1e7, std::ceil(extent / (4.0 * settings.element_time))))});
  StretchLaw law;
  auto elements = feed_elements(stretch, {{0.0, extent}, {0.0, extent}}, count);
  shorten_ends(elements, ends);
  law.grid = feed_grid(stretch, std::move(elements), kCoarsePoints, false);
  FeedProgram program = make_program(stretch, law.grid, settings);
  FeedSolution solution;
  if (ends.start.moving || ends.end.moving) {
    std::vector<double> start = blended_controls(program, ends);
    fix_ends(program, ends, start);
    solution = solve_feed(program, std::move(start), {1e-5, 80});
  } else {
    solution = solve_in_parts(program, {{kCoarseGap, kCoarseIterations}, false}).solution;
  }
  law.controls = std::move(solution.controls);
  law.time = solution.time;
  law.converged = solution.converged;
  law.iterations = solution.iterations;
  return law;
}

/// Elements of the second grid.
std::vector<FeedElement> fine_elements(const FeedStretch& stretch, const StretchLaw& coarse,
                                       const StretchSettings& settings) {
  const double most = kMostFiner * static_cast<double>(coarse.grid.elements.size());
  const double count = std::max(1.0 * settings.least_elements,
                                std::min(most, std::ceil(coarse.time / settings.element_time)));
  const GridMeasure measure = element_measure(stretch, coarse.grid, coarse.controls, count);
  return feed_elements(stretch, measure, static_cast<int>(std::lround(measure.value.back())));
}

/// Draws rows in where the law overshoots and mends it there, a few times; keeps the best.
void tighten(const StretchSettings& settings, FeedProgram& program, FeedCheck& check,
             FeedSolution solution, StretchLaw& law) {
  StretchLaw now;  // without its grid
  now.loads = law.loads;
  now.time = law.time;
  for (int n = 0; n < settings.tightenings && now.dilation() > kTightEnough; ++n) {
    FeedMending mending{{}, kMended, {kLastGap}};
    for (const FeedLoad& load : now.loads) mending.over.push_back(dilation_of(load));
    draw_in(program, now.loads, kMended);
    const std::vector<bool> changed = mend_law(program, mending, solution);
    law.iterations += solution.iterations;
    check.renew(solution.controls, changed, now.loads);
    now.time = solution.time;
    if (now.time * now.dilation() >= law.time * law.dilation()) continue;
    law.controls = solution.controls;
    law.time = now.time;
    law.loads = now.loads;
  }
}

}  // namespace

double StretchLaw::dilation() const { return dilation_of(load()); }

void dilate(StretchLaw& law, double c) {
  law.controls = scaled(std::move(law.controls), 1.0 / (c * c));
  law.time *= c;
  for (FeedLoad& load : law.loads) {
    load.velocity /= c;
    load.acceleration /= c * c;
    load.jerk /= c * c * c;
  }
}

StretchLaw solve_resting(const FeedStretch& stretch, const StretchSettings& settings) {
  StretchLaw law;
  {
    const StretchLaw coarse = solve_coarse(stretch, {}, settings);
    law.iterations = coarse.iterations;
    law.grid = feed_grid(stretch, fine_elements(stretch, coarse, settings), settings.points, true);
  }
  FeedProgram program = make_program(stretch, law.grid, settings);
  FeedSolution solution = solve_in_parts(program, {{kFineGap, kFineIterations}}).solution;
  law.iterations += solution.iterations;
  law.controls = solution.controls;
  law.time = solution.time;
  law.converged = solution.converged;
  FeedCheck check(stretch, law.grid);
  law.loads = check.loads(law.controls);
  tighten(settings, program, check, std::move(solution), law);
  FeedProgram last = make_program(stretch, law.grid, settings);
  const double beta = constant_law(last);
  const double constant_time = stretch.map.extent() / std::sqrt(beta);
  if (!(law.time * law.dilation() < constant_time)) {
    law.constant = !law.converged;
    law.controls.assign(law.grid.controls(), beta);
    law.time = constant_time;
    law.loads = check.loads(law.controls);
  }
  return law;
}

MovingEnd moving_end(const FeedStretch& stretch, const FeedEnd& end) {
  if (end.rest) return {};
  const double v = stretch.map.speed();
  return {true, end.speed * end.speed / (v * v), 2.0 * end.acceleration / v};
}

StretchLaw solve_moving(const FeedStretch& stretch, const MovingEnds& ends,
                        const StretchSettings& settings) {
  StretchLaw coarse = solve_coarse(stretch, ends, settings);
  StretchLaw law;
  law.iterations = coarse.iterations;
  auto elements = fine_elements(stretch, coarse, settings);
  shorten_ends(elements, ends);
  law.grid = feed_grid(stretch, std::move(elements), settings.points, true);
  FeedProgram program = make_program(stretch, law.grid, settings);
  std::vector<double> start =
      values_at(coarse.grid, coarse.controls, greville_places(law.grid.elements));
  const double floor = 1e-7 * *std::max_element(start.begin(), start.end());
  for (double& value : start) value = std::max(value, floor);
  fix_ends(program, ends, start);
  const auto solve = [&](std::vector<double> from) {
    FeedSolution solution = solve_feed(program, std::move(from), {});
    law.iterations += solution.iterations;
    law.converged = solution.converged;
    law.controls = std::move(solution.controls);
    law.time = solution.time;
    law.loads = element_loads(stretch, law.grid, law.controls);
  };
  solve(std::move(start));
  for (int n = 0; n < settings.tightenings && law.converged && law.load().largest() > 1.0; ++n) {
    draw_in(program, law.loads, 0.0);
    solve(law.controls);
  }
  return law;
}

}  // namespace smoothpost
