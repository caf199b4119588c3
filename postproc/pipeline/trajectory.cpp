#include "postproc/pipeline/trajectory.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/units.h"
#include "machines/dialects/decimal.h"

namespace smoothpost {

namespace {

class Writer {
 public:
  Writer(const MachineDefinition& machine, const ScrewChain& chain, double tool_length)
      : machine_(machine), chain_(chain), tool_length_(tool_length) {
    text_ = "t_s";
    for (const auto& axis : machine.axes)
      text_ += "," + axis.name + (axis.joint.kind == JointKind::rotary ? "_deg" : "_mm");
    text_ += ",x_mm,y_mm,z_mm,i,j,k,beam\n";
  }

  // Rows at the cycle times in (time of the last row, until], joints linear from `from` at `start`.
  void span(double start, double until, const JointVector& from, const JointVector& to, bool beam) {
    const double duration = until - start;
    for (; static_cast<double>(next_) * machine_.cycle.time <= until + 1e-12; ++next_) {
      const double t = static_cast<double>(next_) * machine_.cycle.time;
      const double share = duration > 0.0 ? std::clamp((t - start) / duration, 0.0, 1.0) : 1.0;
      row(t, from + share * (to - from), beam);
    }
  }

  std::string take() { return std::move(text_); }

 private:
  void row(double t, const JointVector& q, bool beam) {
    append_decimal(text_, t, 6);
    for (int j = 0; j < machine_.size(); ++j) {
      const bool rotary =
          machine_.axes[static_cast<std::size_t>(j)].joint.kind == JointKind::rotary;
      text_ += ',';
      append_decimal(text_, rotary ? degrees_from_radians(q[j]) : q[j], rotary ? 7 : 6);
    }
    const CutterLocation holder = forward_location(chain_, q);
    const Vec3 tip = holder.tip - tool_length_ * holder.axis;
    for (int i = 0; i < 3; ++i) {
      text_ += ',';
      append_decimal(text_, tip[i], 6);
    }
    for (int i = 0; i < 3; ++i) {
      text_ += ',';
      append_decimal(text_, holder.axis[i], 9);
    }
    text_ += beam ? ",1\n" : ",0\n";
  }

  const MachineDefinition& machine_;
  const ScrewChain& chain_;
  double tool_length_;
  std::string text_;
  long long next_ = 0;
};

}  // namespace

std::string trajectory_csv(const ReadBack& read, const MachineDefinition& machine,
                           const ScrewChain& chain, double tool_length) {
  Writer writer(machine, chain, tool_length);
  const JointMask all = (1U << machine.size()) - 1U;
  double time = 0.0;
  const JointVector* last = nullptr;
  bool beam = false;
  std::size_t event = 0;
  for (std::size_t i = 0; i < read.moves.size(); ++i) {
    const ReadBackMove& move = read.moves[i];
    for (; event < read.events.size() && read.events[event].before <= i; ++event) {
      beam = read.events[event].beam;
      const double seconds = read.events[event].seconds;
      if (last && seconds > 0.0) {
        writer.span(time, time + seconds, *last, *last, beam);
        time += seconds;
      }
    }
    if (!last) {
      if (move.known == all) {
        last = &move.to;
        writer.span(0.0, 0.0, move.to, move.to, move.beam);
      }
      continue;
    }
    double duration = move.duration;
    if (move.rapid)
      for (int j = 0; j < machine.size(); ++j)
        duration = std::max(duration, std::abs(move.to[j] - (*last)[j]) /
                                          machine.axes[static_cast<std::size_t>(j)].velocity);
    writer.span(time, time + duration, *last, move.to, move.beam);
    time += duration;
    last = &move.to;
  }
  return writer.take();
}

}  // namespace smoothpost
