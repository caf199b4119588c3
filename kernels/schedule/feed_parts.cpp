#include "kernels/schedule/feed_parts.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/schedule/feed_start.h"

namespace smoothpost {
namespace {

constexpr std::size_t kWhole = 500;      // elements up to which nothing is parted
constexpr std::size_t kCore = 1000;      // elements of a part that it shares with none
constexpr std::size_t kOverlap = 60;     // beyond its core, each way
constexpr std::size_t kBlend = 12;       // controls over which laws change
constexpr std::size_t kEndControls = 8;  // of a part, that are not trusted
constexpr double kApart = 1e-3;          // relative; what is left, mend_law() mends
constexpr std::size_t kReach = 24;       // elements that are mended with one
constexpr std::size_t kWiden = 4;        // times, where that is not enough
constexpr int kHeld = 3;                 // controls that join what is mended to the rest
constexpr std::size_t kEased = 4;        // elements beside them
constexpr double kEase = 1.0004;         // by which their rows are let out
constexpr double kStartBelow = 1.01;     // what is mended starts slower by that than it has to be

/// A programme of its own for elements first .. end of another.
struct PartProgram {
  FeedGrid grid;
  FeedProgram program;
};

void cut(const FeedProgram& whole, std::size_t first, std::size_t end, PartProgram& part) {
  const FeedGrid& grid = *whole.grid;
  const std::size_t nodes = grid.rule.nodes.size(), row = 3 * static_cast<std::size_t>(grid.width);
  const auto slice = [](const auto& from, std::size_t begin, std::size_t stop) {
    return std::decay_t<decltype(from)>(from.begin() + static_cast<std::ptrdiff_t>(begin),
                                        from.begin() + static_cast<std::ptrdiff_t>(stop));
  };
  part.grid.elements = slice(grid.elements, first, end);
  const double start = part.grid.elements.front().begin;
  for (FeedElement& element : part.grid.elements) {
    element.begin -= start;
    element.end -= start;
  }
  part.grid.rule = grid.rule;
  part.grid.width = grid.width;
  part.grid.rows = slice(grid.rows, first * nodes * row, end * nodes * row);
  part.grid.cap = slice(grid.cap, first * nodes, end * nodes);
  part.grid.basis = cubic_basis(part.grid.elements);
  part.program.grid = &part.grid;
  part.program.lanes = whole.lanes;
  part.program.going = whole.going;
  part.program.factors = slice(whole.factors, first * nodes, end * nodes);
}

void solve_part(const FeedProgram& whole, const FeedPartsSettings& settings, FeedPart& part) {
  const bool alone = part.first == 0 && part.end == whole.grid->elements.size();
  PartProgram own;
  const FeedProgram* program = &whole;
  if (!alone) {
    cut(whole, part.first, part.end, own);
    program = &own.program;
  }
  if (part.first > 0) own.program.fixed_first = 2;
  if (part.end < whole.grid->elements.size()) own.program.fixed_last = 2;
  std::vector<double> start = local_law(*program);
  FeedSolution solution = solve_feed(*program, start, settings.solver);
  part.iterations = solution.iterations;
  part.controls = std::move(solution.feasible ? solution.controls : start);
  part.converged = solution.converged;
}

void solve_all(const FeedProgram& program, const std::vector<bool>& wanted,
               const FeedPartsSettings& settings, std::vector<FeedPart>& parts) {
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t k) {
    if (wanted[k]) solve_part(program, settings, parts[k]);
  });
}

/// Where two neighbours are nearest over kBlend controls: the first of these, of the whole.
struct Seam {
  std::size_t control = 0;
  double apart = 1e300;
};

Seam seam(const FeedPart& a, const FeedPart& b) {
  Seam best;
  const std::size_t low = b.first + kEndControls;
  const std::size_t high = a.end + 3 - kEndControls - kBlend;
  for (std::size_t j = low; j <= high; ++j) {
    double most = 0.0;
    for (std::size_t k = j; k < j + kBlend; ++k) {
      const double x = a.controls[k - a.first], y = b.controls[k - b.first];
      most = std::max(most, std::abs(x - y) / std::max(std::abs(x), std::abs(y)));
    }
    if (most < best.apart) best = {j, most};
  }
  return best;
}

double law_time(const FeedGrid& grid, const std::vector<double>& controls) {
  double time = 0.0;
  for (std::size_t e = 0; e < grid.elements.size(); ++e) {
    const FeedElement& element = grid.elements[e];
    const double size = element.end - element.begin;
    for (std::size_t i = 0; i < grid.rule.nodes.size(); ++i)
      time += grid.rule.weights[i] * size /
              std::sqrt(cubic_values(grid, controls, e, grid.rule.nodes[i] * size)[0]);
  }
  return time;
}

/// Joins neighbours that do not meet; true when there were some.
bool join_parts(std::vector<FeedPart>& parts, std::vector<bool>& wanted) {
  std::vector<FeedPart> joined;
  std::vector<bool> fresh;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const bool meets = k == 0 || seam(parts[k - 1], parts[k]).apart <= kApart;
    if (meets) {
      joined.push_back(parts[k]);
      fresh.push_back(false);
      continue;
    }
    joined.back().end = parts[k].end;
    joined.back().controls.clear();
    fresh.back() = true;
  }
  const bool any = joined.size() < parts.size();
  parts = std::move(joined);
  wanted = std::move(fresh);
  return any;
}

void put_together(const FeedProgram& program, FeedParts& all) {
  FeedSolution& solution = all.solution;
  const std::size_t controls = static_cast<std::size_t>(program.grid->controls());
  solution = {};
  solution.converged = solution.feasible = true;
  solution.controls.resize(controls);
  std::size_t from = 0;
  double iterations = 0.0;
  for (std::size_t k = 0; k < all.parts.size(); ++k) {
    const FeedPart& part = all.parts[k];
    const bool last = k + 1 == all.parts.size();
    const Seam next = last ? Seam{controls, 0.0} : seam(part, all.parts[k + 1]);
    for (std::size_t j = from; j < next.control; ++j)
      solution.controls[j] = part.controls[j - part.first];
    from = next.control;
    for (std::size_t i = 0; !last && i < kBlend; ++i, ++from) {
      const FeedPart& other = all.parts[k + 1];
      const double t = (static_cast<double>(i) + 1.0) / (kBlend + 1.0);
      const double share = t * t * t * (10.0 - t * (15.0 - 6.0 * t));
      solution.controls[from] = (1.0 - share) * part.controls[from - part.first] +
                                share * other.controls[from - other.first];
    }
    solution.converged = solution.converged && part.converged;
    iterations += part.iterations * static_cast<double>(part.end - part.first);
  }
  solution.iterations = static_cast<int>(
      std::lround(iterations / static_cast<double>(program.grid->elements.size())));
  solution.time = law_time(*program.grid, solution.controls);
}

/// Elements first .. end that are mended as one, `reach` of them on each side for the others' sake.
struct Run {
  std::size_t first = 0, end = 0, reach = kReach;
};

Run widened(const Run& run, std::size_t by, std::size_t count) {
  Run wide = run;
  wide.first = run.first > by + kEased ? run.first - by : 0;
  wide.end = run.end + by + kEased < count ? run.end + by : count;
  return wide;
}

/// Those that touch become one.
std::vector<Run> joined(const std::vector<Run>& runs) {
  std::vector<Run> out;
  for (const Run& run : runs) {
    if (out.empty() || run.first > out.back().end) {
      out.push_back(run);
      continue;
    }
    out.back().end = std::max(out.back().end, run.end);
    out.back().reach = std::max(out.back().reach, run.reach);
  }
  return out;
}

std::vector<Run> runs_to_mend(const FeedMending& mending) {
  std::vector<Run> runs;
  const std::size_t count = mending.over.size();
  for (std::size_t e = 0; e < count; ++e)
    if (mending.over[e] > mending.most) runs.push_back(widened({e, e + 1}, kReach, count));
  return joined(runs);
}

/// The law of a run, slower where it is too fast and the same at the controls that are held.
std::vector<double> slower(const std::vector<double>& law, double c, std::size_t reach,
                           bool held_first, bool held_last) {
  std::vector<double> out = law;
  const std::size_t n = law.size();
  const auto ramp = [reach](std::size_t from_end) {
    const double t = std::clamp(
        (static_cast<double>(from_end) - (kHeld - 1.0)) / static_cast<double>(reach), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
  };
  for (std::size_t j = 0; j < n; ++j) {
    const double share = std::min(held_first ? ramp(j) : 1.0, held_last ? ramp(n - 1 - j) : 1.0);
    out[j] /= std::pow(c, 2.0 * share);
  }
  return out;
}

/// False: no law was found; else `controls` of the whole are changed.
bool mend_run(const FeedProgram& whole, const FeedMending& mending, const Run& run,
              std::vector<double>& controls, int& iterations) {
  const auto at = [](std::size_t k) { return static_cast<std::ptrdiff_t>(k); };
  PartProgram own;
  cut(whole, run.first, run.end, own);
  // The controls of the whole, not those of a clamped spline of its own.
  own.grid.basis.assign(whole.grid->basis.begin() + at(run.first),
                        whole.grid->basis.begin() + at(run.end));
  const bool held_first = run.first > 0, held_last = run.end < whole.grid->elements.size();
  const std::size_t nodes = own.grid.rule.nodes.size(), elements = run.end - run.first;
  const auto ease = [&](std::size_t e) {
    for (std::size_t i = e * nodes; i < (e + 1) * nodes; ++i) {
      FeedProgram::Factors& f = own.program.factors[i];
      f = {f.velocity / kEase, f.acceleration / kEase, f.jerk / kEase};
    }
  };
  for (std::size_t e = 0; e < kEased; ++e) {
    if (held_first) ease(e);
    if (held_last) ease(elements - 1 - e);
  }
  if (held_first) own.program.fixed_first = kHeld;
  if (held_last) own.program.fixed_last = kHeld;
  const double most =
      *std::max_element(mending.over.begin() + at(run.first), mending.over.begin() + at(run.end));
  const std::vector<double> law(controls.begin() + at(run.first),
                                controls.begin() + at(run.end) + 3);
  const FeedSolution solution =
      solve_feed(own.program, slower(law, kStartBelow * most, run.reach, held_first, held_last),
                 mending.solver);
  iterations = solution.iterations;
  if (!solution.converged) return false;
  // Runs side by side share controls that both hold.
  const std::size_t from = held_first ? kHeld : 0, to = law.size() - (held_last ? kHeld : 0);
  std::copy(solution.controls.begin() + at(from), solution.controls.begin() + at(to),
            controls.begin() + at(run.first + from));
  return true;
}

}  // namespace

FeedParts solve_in_parts(const FeedProgram& program, const FeedPartsSettings& settings) {
  require(program.fixed_first == 0 && program.fixed_last == 0, "solve_in_parts: from rest to rest");
  const std::size_t count = program.grid->elements.size();
  const std::size_t parts = count <= kWhole ? 1 : (count + kCore - 1) / kCore;
  FeedParts all;
  all.parts.resize(parts);
  for (std::size_t k = 0; k < parts; ++k) {
    const std::size_t first = count * k / parts, end = count * (k + 1) / parts;
    all.parts[k].first = k == 0 ? 0 : first - kOverlap;
    all.parts[k].end = k + 1 == parts ? count : end + kOverlap;
  }
  std::vector<bool> wanted(parts, true);
  solve_all(program, wanted, settings, all.parts);
  const auto going = [&] { return !program.going || (*program.going)(); };
  while (settings.join && going() && join_parts(all.parts, wanted))
    solve_all(program, wanted, settings, all.parts);
  put_together(program, all);
  return all;
}

std::vector<bool> mend_law(const FeedProgram& program, const FeedMending& mending,
                           FeedSolution& solution) {
  const std::size_t count = program.grid->elements.size();
  require(program.fixed_first == 0 && program.fixed_last == 0 && mending.over.size() == count &&
              solution.controls.size() == static_cast<std::size_t>(program.grid->controls()),
          "mend_law: a law of this grid, from rest to rest");
  std::vector<bool> changed(count, false);
  double weighted = 0.0;
  for (std::vector<Run> runs = runs_to_mend(mending); !runs.empty();) {
    std::vector<int> iterations(runs.size(), 0);
    std::vector<char> mended(runs.size(), 0);
    tbb::parallel_for(std::size_t{0}, runs.size(), [&](std::size_t k) {
      mended[k] = mend_run(program, mending, runs[k], solution.controls, iterations[k]);
    });
    std::vector<Run> wider;
    for (std::size_t k = 0; k < runs.size(); ++k) {
      const Run& run = runs[k];
      weighted += iterations[k] * static_cast<double>(run.end - run.first);
      if (mended[k]) {
        std::fill(changed.begin() + static_cast<std::ptrdiff_t>(run.first),
                  changed.begin() + static_cast<std::ptrdiff_t>(run.end), true);
      } else if (run.first > 0 || run.end < count) {
        wider.push_back(widened(run, (kWiden - 1) * run.reach, count));
        wider.back().reach *= kWiden;
      }
    }
    runs = joined(wider);
  }
  solution.iterations = static_cast<int>(std::lround(weighted / static_cast<double>(count)));
  solution.time = law_time(*program.grid, solution.controls);
  return changed;
}

}  // namespace smoothpost
