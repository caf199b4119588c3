#include "kernels/schedule/stretch_solver.h"

#include <algorithm>
#include <cmath>

namespace smoothpost {
namespace {

constexpr int kCoarsePoints = 5;
constexpr int kLeastCoarse = 20;
constexpr double kFirstShare = 0.5;    // of the largest constant b, at the start
constexpr double kAgainShare = 0.7;    // of the coarse law, at the start of the fine grid
constexpr double kTimeShare = 0.85;    // of the measure of the fine grid; the rest is w
constexpr double kNearLimit = 0.9999;  // loads above it are drawn in
constexpr double kDrawIn = 1.00005;
constexpr double kInside = 1.002;
constexpr double kMostChange = 0.4;     // of b between the first two controls of a moving end
constexpr double kBlendShare = 0.15;    // of the extent: how far an end's value reaches at first
constexpr double kRefineAbove = 1.005;  // dilation of an element from which on it is cut in two
constexpr double kCoarseAbove = 0.03;   // over 1: in three

double dilation_of(const FeedLoad& load) {
  return std::max({1.0, load.velocity, std::sqrt(load.acceleration), std::cbrt(load.jerk)});
}

/// Where the coarse law is at which time, mixed with w.
GridMeasure time_measure(const FeedGrid& grid, const std::vector<double>& controls) {
  GridMeasure measure;
  measure.w.push_back(0.0);
  measure.value.push_back(0.0);
  constexpr int kParts = 4;
  for (std::size_t e = 0; e < grid.elements.size(); ++e) {
    const FeedElement& element = grid.elements[e];
    const double size = (element.end - element.begin) / kParts;
    for (int p = 0; p < kParts; ++p) {
      const double b = cubic_values(grid, controls, e, size * (p + 0.5))[0];
      measure.w.push_back(p + 1 == kParts ? element.end : element.begin + size * (p + 1));
      measure.value.push_back(measure.value.back() + size / std::sqrt(b));
    }
  }
  const double time = measure.value.back(), extent = measure.w.back();
  for (std::size_t i = 0; i < measure.w.size(); ++i)
    measure.value[i] =
        kTimeShare * measure.value[i] + (1.0 - kTimeShare) * time * measure.w[i] / extent;
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

/// Draws the rows of an element in by what its loads are beyond the lowered limits.
void draw_in(FeedProgram& program, const std::vector<FeedLoad>& loads) {
  const std::size_t nodes = program.grid->rule.nodes.size();
  const auto more = [](double& factor, double load) {
    if (load > kNearLimit) factor *= kDrawIn * load;
  };
  for (std::size_t e = 0; e < loads.size(); ++e)
    for (std::size_t i = e * nodes; i < (e + 1) * nodes; ++i) {
      more(program.factors[i].velocity, loads[e].velocity);
      more(program.factors[i].acceleration, loads[e].acceleration);
      more(program.factors[i].jerk, loads[e].jerk);
    }
}

std::vector<double> scaled(std::vector<double> values, double factor) {
  for (double& value : values) value *= factor;
  return values;
}

/// Start on a finer grid: a share of the old law, inside every row.
std::vector<double> finer_start(const FeedProgram& program, std::vector<double> old) {
  const double floor = 1e-7 * *std::max_element(old.begin(), old.end());
  for (double& value : old) value = std::max(value, floor);
  const FeedProgram::Factors ratios = point_ratios(program, old);
  const double c = 1.0 / dilation_of({ratios.velocity, ratios.acceleration, ratios.jerk});
  return scaled(std::move(old), kAgainShare * c * c);
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
  std::vector<double> start = blended_controls(program, ends);
  fix_ends(program, ends, start);
  FeedSolution solution = solve_feed(program, std::move(start), {1e-5, 80});
  law.controls = std::move(solution.controls);
  law.time = solution.time;
  law.converged = solution.converged;
  law.iterations = solution.iterations;
  return law;
}

/// Elements of the second grid.
std::vector<FeedElement> fine_elements(const FeedStretch& stretch, const StretchLaw& coarse,
                                       const StretchSettings& settings) {
  const int count =
      std::max(settings.least_elements,
               static_cast<int>(std::min(1e8, std::ceil(coarse.time / settings.element_time))));
  return feed_elements(stretch, time_measure(coarse.grid, coarse.controls), count);
}

/// Takes another solve on the same grid when its certified time is shorter.
bool take_better(const FeedStretch& stretch, StretchLaw& law, FeedSolution solution) {
  law.iterations += solution.iterations;
  auto loads = element_loads(stretch, law.grid, solution.controls);
  if (!(solution.time * dilation_of(largest_load(loads)) < law.time * law.dilation())) return false;
  law.controls = std::move(solution.controls);
  law.time = solution.time;
  law.converged = law.converged || solution.converged;
  law.loads = std::move(loads);
  return true;
}

/// One more solve with the rows drawn in; false when it is no better.
bool tighten(const FeedStretch& stretch, const StretchSettings& settings, StretchLaw& law) {
  FeedProgram program = make_program(stretch, law.grid, settings);
  draw_in(program, law.loads);
  const double c = kInside * law.dilation();
  return take_better(stretch, law, solve_feed(program, scaled(law.controls, 1.0 / (c * c)), {}));
}

/// One more solve with the elements that overshoot cut in parts; false when it is no better.
bool refine(const FeedStretch& stretch, const StretchSettings& settings, StretchLaw& law) {
  std::vector<FeedElement> elements;
  for (std::size_t e = 0; e < law.loads.size(); ++e) {
    const double over = dilation_of(law.loads[e]) - 1.0;
    const int parts = over > kCoarseAbove ? 3 : over > kRefineAbove - 1.0 ? 2 : 1;
    FeedElement element = law.grid.elements[e];
    const double begin = element.begin, size = element.end - begin, end = element.end;
    for (int p = 0; p < parts; ++p) {
      element.begin = p == 0 ? begin : elements.back().end;
      element.end = p + 1 == parts ? end : begin + size * (p + 1) / parts;
      elements.push_back(element);
    }
  }
  StretchLaw finer;
  finer.grid = feed_grid(stretch, std::move(elements), settings.points, true);
  FeedProgram program = make_program(stretch, finer.grid, settings);
  FeedSolution solution = solve_feed(
      program,
      finer_start(program, values_at(law.grid, law.controls, greville_places(finer.grid.elements))),
      {});
  finer.iterations = law.iterations + solution.iterations;
  law.iterations = finer.iterations;
  finer.controls = std::move(solution.controls);
  finer.time = solution.time;
  finer.converged = solution.converged;
  finer.loads = element_loads(stretch, finer.grid, finer.controls);
  if (!(finer.time * finer.dilation() < law.time * law.dilation())) return false;
  law = std::move(finer);
  return true;
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
  const StretchLaw coarse = solve_coarse(stretch, {}, settings);
  StretchLaw law;
  law.iterations = coarse.iterations;
  law.grid = feed_grid(stretch, fine_elements(stretch, coarse, settings), settings.points, true);
  FeedProgram program = make_program(stretch, law.grid, settings);
  const auto start = values_at(coarse.grid, coarse.controls, greville_places(law.grid.elements));
  FeedSolution solution = solve_feed(program, finer_start(program, start), {});
  law.iterations += solution.iterations;
  if (!solution.converged) {
    FeedSolution again = solve_feed(program, constant_controls(program, kFirstShare), {});
    law.iterations += again.iterations;
    if (again.converged || again.time < solution.time) solution = std::move(again);
  }
  law.controls = std::move(solution.controls);
  law.time = solution.time;
  law.converged = solution.converged;
  law.loads = element_loads(stretch, law.grid, law.controls);
  for (int n = 0; n < settings.refinements && law.dilation() > kRefineAbove; ++n)
    if (!refine(stretch, settings, law)) break;
  for (int n = 0; n < settings.tightenings && law.dilation() > kDrawIn; ++n)
    if (!tighten(stretch, settings, law)) break;
  FeedProgram last = make_program(stretch, law.grid, settings);
  const double beta = constant_law(last);
  const double constant_time = stretch.map.extent() / std::sqrt(beta);
  if (!(law.time * law.dilation() < constant_time)) {
    law.constant = !law.converged;
    law.controls.assign(law.grid.controls(), beta);
    law.time = constant_time;
    law.loads = element_loads(stretch, law.grid, law.controls);
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
    draw_in(program, law.loads);
    solve(law.controls);
  }
  return law;
}

}  // namespace smoothpost
