#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "kernels/geometry/part_registration.h"
#include "kernels/geometry/triangle_tree.h"
#include "postproc/pipeline/controller_motion.h"
#include "postproc/pipeline/convert.h"

// What convert() and check_program() share.
namespace smoothpost {

/// Of the tolerances, between a tool move and its joint steps.
inline constexpr double kStepShare = 0.02;

/// Seconds of each stage.
class Stopwatch {
 public:
  explicit Stopwatch(std::vector<StageTime>& stages) : stages_(stages) {}
  void lap(const char* name) {
    const auto now = std::chrono::steady_clock::now();
    stages_.push_back({name, std::chrono::duration<double>(now - last_).count()});
    last_ = now;
  }

 private:
  std::vector<StageTime>& stages_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

void append(Diagnostics& to, const Diagnostics& from);
Diagnostic diagnostic(const char* code, std::string text, std::string file = {}, int line = 0);

/// The machine's chain with tool length 0 and the part placed in it.
ScrewChain placed_chain(const MachineDefinition& machine, const Pose& placement);

Check registration_check(const PartRegistration& registration,
                         const RegistrationSettings& settings);
RegistrationSettings registration_settings(const MachineDefinition& machine);

/// Where the input's path meets the part: before anything is planned, so that an inch file or a
/// wrong zero is named as what it is.
class PartCheck {
 public:
  PartCheck(const TriangleMesh& part, const MachineDefinition& machine)
      : settings_(registration_settings(machine)), tree_(build_triangle_tree(part)) {}

  const Diagnostics& diagnostics() const { return tree_.diagnostics(); }
  bool ok() const { return tree_.ok(); }

  /// At every 2 mm of the beam-on path, at most 64 points a segment: a circle is one segment.
  struct InputRegistration {
    PartRegistration registration;
    std::uint32_t worst_line = 0;  ///< input line of the worst gap
  };
  InputRegistration input(const ReferencePath& reference) const;

  const RegistrationSettings& settings() const { return settings_; }
  /// @pre ok()
  const TriangleTree& tree() const { return tree_.value(); }

  Check output(const ReadBack& read, const ScrewChain& chain) const;

 private:
  // The block of the k-th beam location (see beam_locations).
  static std::uint32_t line_of(const ReadBack& read, std::size_t k);

  RegistrationSettings settings_;
  Result<TriangleTree> tree_;
};

/// Tool moves as seen in the part: where the text states its own frames (BASE, work offset, TOOL)
/// with their printed digits, these count and not what we meant.
void into_part(ReadBack& read, const MachineDefinition& machine, const Pose& part,
               const std::function<double(std::size_t)>& tool_length);

/// follow_controller() with the machine's tolerances.
Result<ControllerMotion> follow(ReadBack read, const MachineDefinition& machine,
                                const Inverse& inverse, ToolTurn turn,
                                const std::function<double(std::size_t)>& tool_length);

/// Adds the checks of the accelerations and jerks of out.schedule (planned_limit_checks) and what
/// they rest on; does nothing without a schedule.
void add_planned_limits(const MachineDefinition& machine, Conversion& out);

/// What a certificate takes for granted and does not check, whatever the program.
void describe_promises(const MachineDefinition& machine, bool has_part, Conversion& out);

}  // namespace smoothpost
