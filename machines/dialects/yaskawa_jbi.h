#pragma once

#include "machines/dialects/dialect.h"

namespace smoothpost::yaskawa_jbi {

/// Prints one INFORM job (.JBI, NX100 and later, with relative jobs), in mm, deg and s: MOVJ for
/// interpolation joints, MOVL for interpolation tool. Positions C00000 on are Cartesian in the
/// robot's base with the posture RCONF, so a machine file needs no pulses per degree; the arm has
/// to have a closed form (six_r.h), whose branch is the posture. The job sets tool file 9 from
/// position variable P091. Every move has PL=0. Lines end in CR LF. Errors: PR201, PR202 (axes are
/// not A1 to A6), PR203 (see RobotPrinter; an external axis; an arm of another kind; a joint target
/// whose posture is not certain; a motion slower than the least speed). Warnings: PR222 (an event
/// on the fly stops the robot), PR223 (more lines than a job can have).   Cost: linear.
Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program);

/// Reads such a job without knowledge of what emit() was given. Its moves come back in a part's
/// frame that is the robot's base. A MOVJ comes back as the joints of its position and posture;
/// with VJ=10.00 as the first motion or VJ=100.00 it is a rapid, as is MOVL with V=250.0 and a
/// MOVJ whose start is not known. Errors: NC346 (text), NC347 (meaning), NC348 (tool).
Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name);

extern const Dialect kDialect;

}  // namespace smoothpost::yaskawa_jbi
