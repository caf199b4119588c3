#pragma once

#include <optional>
#include <string>
#include <vector>

#include "postproc/pipeline/cuts.h"
#include "postproc/pipeline/cutting_frame.h"
#include "postproc/pipeline/worst.h"

namespace smoothpost {

/// What a beam's orientation is judged by.
struct OrientationInput {
  std::vector<CuttingFrames> frames;  ///< of the cuts, in path order
  bool free = false;  ///< lead and tilt count, each with its tolerance, in place of the axis' angle
};

/// Whether a machine's settings free the beam's orientation around the programmed one.
bool orientation_is_free(const MachineDefinition& machine);

/// Nothing when the beam's orientation needs no check of its own: no laser, or one whose tool axis
/// is kept and that has no part, no gap or no nozzle land.
/// @param part  in W; nullptr: none. Reference and part outlive the result.
std::optional<OrientationInput> orientation_input(const MachineDefinition& machine,
                                                  const ReferencePath& reference,
                                                  const std::vector<Cut>& cuts,
                                                  const TriangleTree* part);

/// What the normals of its lead and tilt are, for the certificate.
std::string orientation_assumption(const OrientationInput& input);

/// An output's tool axis at one place of the input.
struct OrientationSample {
  PathPlace place;
  Vec3 axis = Vec3::UnitZ();  ///< in W
  double allowance = 0.0;     ///< chord that the difference to the programmed axis may be more than
                              ///< at the samples, between this one and the next
  bool beam = true;
  std::uint32_t input_line = 0, output_line = 0;
  double time = 0.0;
};

/// Compares the orientation of an output with the programmed one, sample by sample along it.
///
/// With (lead, tilt) of the output's axis and (lead', tilt') of the programmed one in the input's
/// cutting frame (N, T, B) at the same path parameter:
///   lead_deviation = |lead − lead'|, tilt_deviation = |tilt − tilt'|;
///   exit_edge_deviation = d·|tan tilt − tan tilt'|, d the sheet's thickness;
///   tilted_gap = g·cos t − r·sin t, t the angle between axis and N: the least one, beam on.
/// The first three when the orientation is free. Each value holds between samples too: the axes are
/// bounded by `allowance`, and T is taken to turn evenly from one sample to the next by δ, which
/// adds δ²/8 of the combined deviation. N is taken at the samples.
/// Cost: one cutting frame a sample.
class OrientationCheck {
 public:
  OrientationCheck(const MachineDefinition& machine, const OrientationInput& input)
      : machine_(machine), input_(input) {}

  /// The segment has a cutting frame.
  bool covers(std::uint32_t segment) const { return frames_of(segment) != nullptr; }
  /// Lead and tilt count there, not the angle of the axis.
  bool frees(std::uint32_t segment) const { return input_.free && covers(segment); }
  /// Samples that `way` mm of the tip need at least.
  int least_steps(double way) const;
  /// The next sample does not go on from the last one.
  void begin() { before_.reset(); }
  /// @pre covers(sample.place.segment)
  void see(const OrientationSample& sample);
  Checks checks() const;

 private:
  struct Deviation {
    Vec3 tangent = Vec3::UnitX();
    double lead = 0.0, tilt = 0.0, exit_edge = 0.0;
  };
  const CuttingFrames* frames_of(std::uint32_t segment) const;
  void see_deviation(const OrientationSample& sample, const CuttingFrame& frame);
  void see_gap(const OrientationSample& sample, const CuttingFrame& frame);
  bool has_nozzle() const { return machine_.tool.gap > 0.0 && machine_.tool.land_radius > 0.0; }

  const MachineDefinition& machine_;
  const OrientationInput& input_;
  std::optional<Deviation> before_;
  double widest_tilt_ = 0.0;  ///< rad, of the programmed axis
  Worst lead_, tilt_, exit_edge_, angle_;
};

}  // namespace smoothpost
