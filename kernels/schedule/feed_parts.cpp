#include "kernels/schedule/feed_parts.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/schedule/feed_start.h"

namespace smoothpost {
namespace {

constexpr std::size_t kWhole = 500;      // elements up to which nothing is parted
constexpr std::size_t kCore = 600;       // elements of a part that it shares with none
constexpr std::size_t kOverlap = 100;    // beyond its core, each way
constexpr std::size_t kBlend = 12;       // controls over which laws change
constexpr std::size_t kEndControls = 8;  // of a part, that are not trusted
constexpr double kApart = 1e-4;          // relative
constexpr double kEndShare = 0.5;        // of the largest constant b, at the ends of a part

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

void solve_part(const FeedProgram& whole, double c, const FeedPartsSettings& settings,
                FeedPart& part) {
  const bool alone = part.first == 0 && part.end == whole.grid->elements.size();
  PartProgram own;
  const FeedProgram* program = &whole;
  if (!alone) {
    cut(whole, part.first, part.end, own);
    program = &own.program;
  }
  const double slow = kEndShare * constant_law(*program);
  const bool from_start = part.first == 0;
  const bool to_end = part.end == whole.grid->elements.size();
  const auto hold_ends = [&](std::vector<double> law) {
    if (!from_start) law[0] = law[1] = slow;
    if (!to_end) law[law.size() - 1] = law[law.size() - 2] = slow;
    return law;
  };
  if (!from_start) own.program.fixed_first = 2;
  if (!to_end) own.program.fixed_last = 2;
  const bool fresh = part.controls.empty();
  std::vector<double> start = std::move(part.controls);
  for (double& b : start) b /= c * c;
  if (fresh) start.assign(static_cast<std::size_t>(program->grid->controls()), slow);
  FeedSolution solution = solve_feed(*program, hold_ends(std::move(start)), settings.solver);
  part.iterations = solution.iterations;
  if (!solution.converged && settings.retry) {
    FeedSolution again = solve_feed(
        *program, hold_ends(local_law(*program, from_start ? 0.0 : slow, to_end ? 0.0 : slow)),
        settings.solver);
    part.iterations += again.iterations;
    if (again.converged || (again.feasible && again.time < solution.time))
      solution = std::move(again);
  }
  part.controls = std::move(solution.controls);
  part.converged = solution.converged;
}

void solve_all(const FeedProgram& program, const std::vector<bool>& wanted, double c,
               const FeedPartsSettings& settings, std::vector<FeedPart>& parts) {
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t k) {
    if (wanted[k]) solve_part(program, c, settings, parts[k]);
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

void finish(const FeedProgram& program, double c, const FeedPartsSettings& settings,
            FeedParts& all) {
  std::vector<bool> wanted;
  while (settings.join && join_parts(all.parts, wanted))
    solve_all(program, wanted, c, settings, all.parts);
  put_together(program, all);
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
  solve_all(program, std::vector<bool>(parts, true), 1.0, settings, all.parts);
  finish(program, 1.0, settings, all);
  return all;
}

void solve_again(const FeedProgram& program, const std::vector<bool>& changed, double c,
                 const FeedPartsSettings& settings, FeedParts& all) {
  std::vector<bool> wanted;
  for (const FeedPart& part : all.parts)
    wanted.push_back(std::find(changed.begin() + static_cast<std::ptrdiff_t>(part.first),
                               changed.begin() + static_cast<std::ptrdiff_t>(part.end),
                               true) != changed.begin() + static_cast<std::ptrdiff_t>(part.end));
  for (std::size_t k = 0; k < wanted.size(); ++k)
    if (!wanted[k]) all.parts[k].iterations = 0;
  solve_all(program, wanted, c, settings, all.parts);
  finish(program, c, settings, all);
}

}  // namespace smoothpost
