#pragma once

#include <optional>
#include <string>

#include "machines/dialects/dialect.h"

namespace smoothpost {

/// How long a controller takes for a program, when its way of timing blocks is known.
struct ExecutedTime {
  std::optional<double> seconds;  ///< s, with waits; nothing: no model of this controller
  std::string model;              ///< what the number rests on, or why there is none
};

/// An estimate from the program's text, read back (`joints`: straight joint steps).
///
/// `linuxcnc` with path_mode = "exact", by what was measured (docs/controllers/linuxcnc.md): a
/// block goes at the speed of its F word or as fast as its axes allow, along a trapezoid of the
/// acceleration that its slowest axis allows, without a limit of jerk. With x ∈ [0, 1] along a
/// block, v = min(1/t_F, min_j V_j/|Δq_j|) and a = min_j A_j/|Δq_j|. Where a rotary moves in one of
/// two neighbouring blocks it stops between them: a block alone takes
///   1/v + v/a,   or 2/√a when v²/a > 1.
/// Between blocks of linear axes alone it goes on at a speed whose step of no axis is above
/// kKinkShare·A_j·T, T the machine's cycle. Every block ends on a cycle where it stops.
/// Rapids likewise at the axes' velocities; waits as printed. The way to the first position that is
/// stated whole is not counted.
///
/// Guarantee (test, acceptance/linuxcnc): within 5 % of LinuxCNC 2.9 on converted programs.
/// Other controllers: nothing, with the reason; their look-ahead was not measured.
/// Units: s.   Cost: O(blocks).
ExecutedTime executed_time(const ReadBack& joints, const MachineDefinition& machine);

}  // namespace smoothpost
