#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "formats/nc/coordinates.h"
#include "formats/nc/expression.h"
#include "formats/nc/modal_state.h"
#include "formats/nc/tool_table.h"

namespace smoothpost::nc {

/// Where the run stands.
struct ProgramPlace {
  std::size_t next = 0;  ///< block that is read next; the line of the present one counts from 1
  int call_level = 0;    ///< 0: the main program
};

/// What system parameters tell of; it outlives the parameters.
struct ControllerState {
  const Coordinates& coordinates;
  const ModalState& modal;
  const HomePosition& first_home;
  const HomePosition& second_home;
  const ToolTable& tools;
  const ProgramPlace& place;
};

/// What a called subroutine sees of its caller's parameters.
struct CallScope {
  enum class Kind : std::uint8_t {
    subroutine,  ///< o<name> call: #1 to #30 and names of its own
    program,     ///< M98: names of its own
    macro        ///< G65: #1 to #33 of its own, vacant but for the arguments
  };
  Kind kind = Kind::subroutine;
  std::vector<std::pair<int, double>> arguments;  ///< #index = value
};

/// The parameters of one run of a program.
class ParameterStore : public ParameterValues {
 public:
  /// Why `#index` or `#<name>` cannot be assigned; empty: it can.
  virtual std::string refusal(const EvaluatedAssignment& assignment) const = 0;
  virtual void assign(const EvaluatedAssignment& assignment) = 0;
  virtual void enter(const CallScope& scope) = 0;
  virtual void leave() = 0;
  /// A probing motion (G38.2 ..) came to its programmed end, where the machine stands now, without
  /// a touch.
  virtual void set_probed() {}
  /// The value that a subroutine of RS274NGC gives back.
  virtual void set_result(std::optional<double> value) = 0;
};

}  // namespace smoothpost::nc
