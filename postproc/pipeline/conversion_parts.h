#pragma once

#include <chrono>
#include <functional>
#include <memory>
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
      : settings_(registration_settings(machine)) {
    auto built = build_triangle_tree(part);
    diagnostics_ = built.diagnostics();
    if (built.ok()) tree_ = std::make_shared<const TriangleTree>(std::move(built.value()));
  }

  const Diagnostics& diagnostics() const { return diagnostics_; }
  bool ok() const { return tree_ != nullptr; }

  /// At every 2 mm of the beam-on path, at most 64 points a segment: a circle is one segment.
  struct InputRegistration {
    PartRegistration registration;
    std::uint32_t worst_line = 0;  ///< input line of the worst gap
  };
  InputRegistration input(const ReferencePath& reference) const;

  const RegistrationSettings& settings() const { return settings_; }
  /// @pre ok()
  const TriangleTree& tree() const { return *tree_; }
  const std::shared_ptr<const TriangleTree>& shared_tree() const { return tree_; }

  Check output(const ReadBack& read, const ScrewChain& chain) const;

 private:
  // The block of the k-th beam location (see beam_locations).
  static std::uint32_t line_of(const ReadBack& read, std::size_t k);

  RegistrationSettings settings_;
  Diagnostics diagnostics_;
  std::shared_ptr<const TriangleTree> tree_;
};

/// Tool moves as seen in the part: where the text states its own frames (BASE, work offset, TOOL)
/// with their printed digits, these count and not what we meant.
void into_part(ReadBack& read, const MachineDefinition& machine, const Pose& part,
               const std::function<double(std::size_t)>& tool_length);

/// The steps' tolerances are kStepShare of the machine's.
FollowSettings follow_settings(const MachineDefinition& machine, ToolTurn turn,
                               std::function<double(std::size_t)> tool_length);

/// follow_controller() with follow_settings().
Result<ControllerMotion> follow(ReadBack read, const MachineDefinition& machine,
                                const Inverse& inverse, ToolTurn turn,
                                const std::function<double(std::size_t)>& tool_length);

/// The input's own motion into the summaries, in their units. Nothing where `motion` is empty.
void add_input_motion(const MachineDefinition& machine, const std::vector<InputMotion>& motion,
                      std::vector<AxisSummary>& axes);

/// Adds the checks of the accelerations and jerks of out.schedule (planned_limit_checks) and what
/// they rest on; does nothing without a schedule.
void add_planned_limits(const MachineDefinition& machine, Conversion& out);

/// Checks the clearance of the program's motion, `out.read`, and takes "clearance" from what is not
/// checked; does nothing where the machine has no bodies, or with machine.collision off. Failures
/// are diagnostics CK110, five at most.
struct ClearanceInput {
  const MachineDefinition& machine;
  const ScrewChain& chain;             ///< tool length 0, part placed
  const TriangleMesh* part = nullptr;  ///< in W
  std::shared_ptr<const TriangleTree> tree;
  double allowance = 0.0;  ///< largest_allowance()
  std::string file_name;   ///< for messages, of the output
};
void add_clearance(const ClearanceInput& input, const Progress& progress, Conversion& out);

/// What a certificate takes for granted and does not check, whatever the program.
void describe_promises(const MachineDefinition& machine, bool has_part, Conversion& out);

/// Fills what does not depend on how the program was made: cuts, links, programmed time, length.
void describe_input(const ToolPath& path, const std::vector<Cut>& cuts,
                    const ReferencePath& reference, Conversion& out);

}  // namespace smoothpost
