#pragma once

#include "machines/dialects/dialect.h"

namespace smoothpost::val3 {

/// Prints one VAL3 program (.pgx, Staubli CS8 and CS9), in mm, deg and s: movej to joints for
/// interpolation joints, movel to a point in the part's frame for interpolation tool. Frame, tool,
/// targets and speeds are local variables that the program sets itself, so that no other file of
/// the project changes what it does. Corners with a blend are blended by their distance. The
/// interpreter runs ahead of the motion, so waitEndMove() stands before every other statement.
/// Errors: PR201, PR202 (axes are not A1 to A6), PR203 (see RobotPrinter, an external axis).
/// Warning PR222: an event on the fly for which the robot stops.   Cost: linear.
Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program);

/// Reads such a program without knowledge of what emit() was given. Moves with mFirst and mLink
/// come back as rapids. A joint move's time follows from its share of the machine file's speeds
/// where its start is known; elsewhere it is a rapid.
/// Errors: NC346 (text), NC347 (meaning), NC348 (frames).
Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name);

extern const Dialect kDialect;

}  // namespace smoothpost::val3
