#include "postproc/pipeline/curve_blocks.h"

#include "kernels/spline/bent_move.h"

namespace smoothpost {

namespace {

class CurveMaker {
 public:
  CurveMaker(MachineProgram& program, const CurveInput& input)
      : program_(program),
        runs_(program, input),
        limits_(feed_limits(input.machine)),
        degree_(input.machine.dialect.curves == "cubic" ? 3 : 5) {}

  CurveReport run() {
    return runs_.replace({[this](std::size_t first, std::size_t end) { return holds(first, end); },
                          [this](std::size_t first, std::size_t end) {
                            MachineMove move = program_.moves[end - 1];
                            move.bend = bend(first, end);
                            return move;
                          }});
  }

 private:
  JointBend bend(std::size_t first, std::size_t end) const {
    const double from = runs_.places()[first].from, to = runs_.places()[end - 1].to;
    return hermite_bend(path_end(first, from, false), path_end(first, to, true), to - from,
                        degree_);
  }

  // As seen from inside the run.
  PathEnd path_end(std::size_t i, double s, bool before) const {
    const JointStretch& joints = runs_.stretch(i).joints;
    std::size_t piece = joints.piece_at(s);
    if (before && piece > 0 && s <= joints.breaks[piece]) --piece;
    const PathJet jet = joints.jet(piece, s);
    return {joints.joints_at(s), jet.first, jet.second};
  }

  bool holds(std::size_t first, std::size_t end) const {
    const std::vector<double> paired = runs_.pairing(first, end);
    if (paired.empty()) return false;
    const auto& places = runs_.places();
    const double s0 = places[first].from, extent = places[end - 1].to - s0;
    const double time = runs_.duration(first, end);
    std::vector<double> even;
    for (std::size_t i = first; i < end; ++i) even.push_back((places[i].to - s0) / extent);
    if (!runs_.keeps_time(first, end, even)) return false;
    const JointBend bent = bend(first, end);
    const BentMove run{program_.moves[first - 1].to, program_.moves[end - 1].to, bent};
    double before = 0.0;
    for (std::size_t i = first; i < end; ++i) {
      const double now = paired[i - first];
      const double middle = 0.5 * (places[i].from + places[i].to);
      if (!runs_.is_near(i, joints_at(run, 0.5 * (before + now)),
                         runs_.stretch(i).joints.joints_at(middle)) ||
          !runs_.is_near(i, joints_at(run, now), program_.moves[i].to) ||
          !is_slow(run, even[i - first], time))
        return false;
      before = now;
    }
    return is_slow(run, 0.0, time);
  }

  bool is_slow(const BentMove& run, double tau, double time) const {
    const JointVector rate = rates_at(run, tau).cwiseAbs() / time;
    if ((rate.array() > limits_.velocity.array()).any()) return false;
    const JointVector bend = second_at(run, tau).cwiseAbs() / (time * time);
    return (bend.array() <= limits_.acceleration.array()).all();
  }

  MachineProgram& program_;
  BlockRuns runs_;
  FeedLimits limits_;
  int degree_;
};

}  // namespace

std::string curve_assumption(const MachineDefinition& machine) {
  return "the control has polynomial interpolation of degree " +
         std::string(machine.dialect.curves == "cubic" ? "3" : "5") +
         " for all axes of a block, and takes every axis along its polynomial by one parameter "
         "(POLY under UPATH)";
}

CurveReport join_into_curves(MachineProgram& program, const CurveInput& input) {
  return CurveMaker(program, input).run();
}

}  // namespace smoothpost
