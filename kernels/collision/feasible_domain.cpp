#include "kernels/collision/feasible_domain.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"

namespace smoothpost {

namespace {

double step_value(double low, double high, int i, int count) {
  return count == 1 ? 0.5 * (low + high) : low + (high - low) * i / (count - 1);
}

/// A rotary in (−π, π] has a turn inside of its range.
bool fits(const ChainJoint& joint, double value, double lower, double upper) {
  if (joint.kind == JointKind::linear) return value >= lower && value <= upper;
  const double first = value + 2.0 * kPi * std::ceil((lower - value) / (2.0 * kPi) - 1e-12);
  return first <= upper + 1e-12;
}

/// One cutter location while it is looked at.
class Search {
 public:
  Search(const DomainProblem& problem, const DomainPlace& place) : in_(problem), place_(place) {
    out_.leads = problem.leads;
    out_.tilts = problem.tilts;
    out_.standoffs = static_cast<int>(problem.standoffs.size());
    out_.cells.resize(static_cast<std::size_t>(2 * out_.leads * out_.tilts * out_.standoffs));
  }

  FeasibleDomain run() {
    for (int branch = 0; branch < 2; ++branch) {
      std::vector<Candidate> candidates = kinematics(branch);
      if (in_.scene == nullptr || candidates.empty()) continue;
      for (std::size_t pair = 0; pair < in_.scene->pairs().size(); ++pair) {
        std::vector<Candidate*> open;
        for (Candidate& c : candidates)
          if (cell(c.at).verdict == CellVerdict::free) open.push_back(&c);
        decide(pair, std::move(open), {0, 0, 0, out_.leads, out_.tilts, out_.standoffs});
      }
    }
    return std::move(out_);
  }

 private:
  /// A cell that the joints can reach.
  struct Candidate {
    DomainIndex at;
    ScenePoses poses;
    double way = 0.0;  ///< of the bodies from the cell that was asked last
  };
  struct Block {
    int lead, tilt, standoff;              ///< first of each
    int lead_end, tilt_end, standoff_end;  ///< behind the last
  };

  DomainCell& cell(const DomainIndex& at) { return out_.cells[out_.flat(at)]; }

  // Verdicts of everything but the scene; the cells that are left for it.
  std::vector<Candidate> kinematics(int branch) {
    std::vector<Candidate> list;
    for (int i = 0; i < out_.leads; ++i)
      for (int j = 0; j < out_.tilts; ++j) {
        const Vec3 axis = place_.axis(lead_at(in_, place_, i), tilt_at(in_, place_, j));
        const bool gap = !in_.gap || in_.gap(place_, axis);
        const Vec3 holder = place_.tip + in_.tool_length * axis;
        const RotaryPairSolutions found = in_.pair->solve({holder, axis}, held_at(0));
        for (int k = 0; k < out_.standoffs; ++k) {
          const DomainIndex at{branch, i, j, k};
          DomainCell& c = cell(at);
          if (!found.valid[static_cast<std::size_t>(branch)]) continue;
          const auto q = with_standoff(found.q[static_cast<std::size_t>(branch)], holder, k);
          if (!q) continue;
          c = reach(*q, gap);
          if (c.verdict == CellVerdict::free && in_.scene != nullptr)
            list.push_back({at, in_.scene->poses(*q), 0.0});
        }
      }
    return list;
  }

  JointVector held_at(int k) const {
    JointVector held = in_.held;
    if (in_.standoff >= 0) held[in_.standoff] = in_.standoffs[static_cast<std::size_t>(k)];
    return held;
  }

  std::optional<JointVector> with_standoff(JointVector q, const Vec3& holder, int k) const {
    if (k == 0 || in_.standoff < 0) return q;
    q[in_.standoff] = in_.standoffs[static_cast<std::size_t>(k)];
    return in_.pair->with_linears(holder, q);
  }

  DomainCell reach(const JointVector& q, bool gap) const {
    const ScrewChain& chain = in_.pair->chain();
    for (int i = 0; i < chain.size(); ++i)
      if (!fits(chain.joints[static_cast<std::size_t>(i)], q[i], in_.lower[i], in_.upper[i]))
        return {CellVerdict::out_of_range, i, 0.0};
    if (!gap) return {CellVerdict::gap, -1, 0.0};
    return {CellVerdict::free, -1, std::numeric_limits<double>::infinity()};
  }

  static Candidate* nearest_to_middle(const std::vector<Candidate*>& open, const Block& b) {
    const auto far = [&b](const Candidate* c) {
      return std::abs(2 * c->at.lead + 1 - b.lead - b.lead_end) +
             std::abs(2 * c->at.tilt + 1 - b.tilt - b.tilt_end) +
             std::abs(2 * c->at.standoff + 1 - b.standoff - b.standoff_end);
    };
    return *std::min_element(open.begin(), open.end(), [&](const Candidate* a, const Candidate* c) {
      return far(a) < far(c);
    });
  }

  void decide(std::size_t pair, std::vector<Candidate*> open, const Block& block) {
    if (open.empty()) return;
    Candidate* asked = nearest_to_middle(open, block);
    double farthest = 0.0;
    for (Candidate* c : open) {
      c->way = c == asked ? 0.0 : in_.scene->movement(pair, asked->poses, c->poses);
      farthest = std::max(farthest, c->way);
    }
    const PairMargin known = in_.scene->decide(pair, asked->poses, in_.margin + farthest);
    ++out_.queries;
    std::vector<Candidate*> left;
    for (Candidate* c : open) {
      if (settle(pair, *c, known, c == asked)) {
        out_.skipped += c == asked ? 0 : 1;
        continue;
      }
      left.push_back(c);
    }
    descend(pair, left, block);
  }

  // The cell that was asked is always settled.
  bool settle(std::size_t pair, const Candidate& c, const PairMargin& known, bool asked) {
    DomainCell& out = cell(c.at);
    const double spare = known.lower - c.way - in_.margin;
    if (spare >= 0.0) {
      out.spare = std::min(out.spare, spare);
      return true;
    }
    if (!asked && known.upper + c.way >= in_.margin) return false;
    out = {CellVerdict::collision, static_cast<std::int32_t>(pair), 0.0};
    return true;
  }

  void descend(std::size_t pair, const std::vector<Candidate*>& left, const Block& b) {
    if (left.empty()) return;
    const int lead = (b.lead + b.lead_end) / 2, tilt = (b.tilt + b.tilt_end) / 2,
              standoff = (b.standoff + b.standoff_end) / 2;
    for (int part = 0; part < 8; ++part) {
      Block child = b;
      (part & 1 ? child.lead : child.lead_end) = lead;
      (part & 2 ? child.tilt : child.tilt_end) = tilt;
      (part & 4 ? child.standoff : child.standoff_end) = standoff;
      std::vector<Candidate*> inside;
      for (Candidate* c : left)
        if (c->at.lead >= child.lead && c->at.lead < child.lead_end && c->at.tilt >= child.tilt &&
            c->at.tilt < child.tilt_end && c->at.standoff >= child.standoff &&
            c->at.standoff < child.standoff_end)
          inside.push_back(c);
      decide(pair, std::move(inside), child);
    }
  }

  const DomainProblem& in_;
  const DomainPlace& place_;
  FeasibleDomain out_;
};

void check(const DomainProblem& p) {
  require(p.pair != nullptr, "a rotary pair");
  const auto size = p.pair->chain().size();
  require(p.held.size() == size && p.lower.size() == size && p.upper.size() == size,
          "one value per joint");
  require(p.margin >= 0.0, "a margin of at least 0");
  require(p.leads >= 1 && p.tilts >= 1 && !p.standoffs.empty(), "a grid with cells");
  require(p.standoff < size, "a standoff joint of the chain");
  require(p.scene == nullptr || p.scene->chain().size() == size, "a scene of the same chain");
}

}  // namespace

Vec3 DomainPlace::axis(double lead, double tilt) const {
  return (normal + std::tan(lead) * tangent + std::tan(tilt) * binormal).normalized();
}

DomainIndex FeasibleDomain::index(std::size_t flat) const {
  const int n = static_cast<int>(flat);
  DomainIndex at;
  at.standoff = n % standoffs;
  at.tilt = n / standoffs % tilts;
  at.lead = n / (standoffs * tilts) % leads;
  at.branch = n / (standoffs * tilts * leads);
  return at;
}

std::size_t FeasibleDomain::free_cells() const {
  return static_cast<std::size_t>(
      std::count_if(cells.begin(), cells.end(),
                    [](const DomainCell& c) { return c.verdict == CellVerdict::free; }));
}

double lead_at(const DomainProblem& problem, const DomainPlace& place, int i) {
  return step_value(place.lead_low, place.lead_high, i, problem.leads);
}

double tilt_at(const DomainProblem& problem, const DomainPlace& place, int j) {
  return step_value(place.tilt_low, place.tilt_high, j, problem.tilts);
}

std::optional<JointVector> domain_joints(const DomainProblem& problem, const DomainPlace& place,
                                         const DomainIndex& at) {
  check(problem);
  const Vec3 axis = place.axis(lead_at(problem, place, at.lead), tilt_at(problem, place, at.tilt));
  JointVector held = problem.held;
  if (problem.standoff >= 0)
    held[problem.standoff] = problem.standoffs[static_cast<std::size_t>(at.standoff)];
  const auto found = problem.pair->solve({place.tip + problem.tool_length * axis, axis}, held);
  if (!found.valid[static_cast<std::size_t>(at.branch)]) return std::nullopt;
  return found.q[static_cast<std::size_t>(at.branch)];
}

FeasibleDomain feasible_domain(const DomainProblem& problem, const DomainPlace& place) {
  check(problem);
  return Search(problem, place).run();
}

std::vector<FeasibleDomain> feasible_domains(const DomainProblem& problem,
                                             const std::vector<DomainPlace>& places, int threads) {
  check(problem);
  std::vector<FeasibleDomain> out(places.size());
  // More threads than the machine has are for those who want to see that they change nothing.
  std::optional<tbb::global_control> more;
  if (threads > tbb::info::default_concurrency())
    more.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  arena.execute([&] {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, places.size(), 1), [&](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i)
        out[i] = Search(problem, places[i]).run();
    });
  });
  return out;
}

}  // namespace smoothpost
