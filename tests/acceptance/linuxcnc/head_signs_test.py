#!/usr/bin/python3
"""Shows that the rotary words of a head machine file are the physical motion of the head.

    head_signs_test.py MACHINE.toml [--smoothpost TOOL]

1. Right-hand rule. In our forward kinematics (machine_model.py, written from the definition of the
   machine file) a positive word of a head axis turns the tool counter-clockwise about `direction`.
2. With --smoothpost: the joints of a converted program, put through that forward kinematics, give
   the tips and tool axes that the tool itself wrote beside them, for all signs of both rotary words.
3. A head C B (axes that cross, tip of the machine file at the crossing): a program in the world
   coordinates of LinuxCNC's 5axiskins runs there. Wherever it stands still, the pivot and the tip of
   LinuxCNC must be the pivot and the tip of our forward kinematics when its C is taken as it is and
   its B with the sign reversed, and with no other signs.

Signs of 5axiskins: tip = joints + s2r(pivot + W, C, 180 - B) + (0, 0, pivot). A positive B moves the
tip towards +X at C = 0, so the head turns about -Y: that is opposite to the right-hand rule, and
our B = -B there. C turns about +Z in both. The sign is one for the zero of C that the two share: tip
and tool axis are also those of B as it is with C half a turn further.

The forward kinematics has the zero of the tip at the pivot, LinuxCNC the pivot length above it:
our tip = its tip - (0, 0, pivot), with a tool as long as the pivot length.

Exit status: 0 all hold, 1 not, 77 LinuxCNC is needed and cannot run here (1 and 2 were checked).
"""
import argparse
import itertools
import os
import subprocess
import sys
import tempfile

import numpy as np

from compare_path import Log, Trajectory
from machine_model import Machine, axis_angle_deg, fail
from make_config import PIVOT_LENGTH, write_config
from run_program import SKIP, reason_to_skip, run_program

LIMIT = 1e-3             # mm; and LIMIT / PIVOT_LENGTH rad for the tool axis
SEEN = 1.0               # mm or deg that a wrong sign has to be off, against LinuxCNC at every point
STANDSTILL = 50          # samples (ms) without motion; the program dwells longer
DWELL = 0.15             # s
SIGNS = {"B": -1.0, "C": 1.0}  # our word / LinuxCNC's word
# From the home of X and Y, and below that of Z: tip (mm), B, C (deg). No B or C is a multiple of 90
# deg, so each point by itself tells every combination of signs from the others.
POINTS = np.array([[20, 10, -40, 25, 30], [20, 10, -40, -25, 30], [-15, 30, -60, -40, 130],
                   [-15, 30, -60, 40, 130], [5, -25, -50, 35, -50], [5, -25, -50, -35, -50],
                   [30, 20, -30, -60, -140], [30, 20, -30, 60, -140]], float)
# Tips (mm) and lean and azimuth (deg) of the tool axis of the program that the tool converts. The
# axis passes through the vertical, where the words of the tilting axis change their sign.
CONVERTED = [(20, 30), (-20, 30), (-20, 80), (-20, 150), (20, 150), (20, 80), (20, 30), (20, -30),
             (-20, -30)]


class Verdicts:
    """Prints what holds and what does not, and counts the latter."""

    def __init__(self):
        self.failed = 0

    def that(self, holds, text):
        print(f"{'ok    ' if holds else 'FAILED'} {text}", flush=True)
        self.failed += not holds


def head_axes(machine):
    return [index for index, axis in enumerate(machine.axes) if axis.rotary and not axis.on_workpiece]


def turned_by(axis, start, end):
    """Angle (deg) from `start` to `end` about the axis, counter-clockwise with its arrow towards you."""
    helper = np.eye(3)[np.argmin(np.abs(axis.direction))]
    u = np.cross(helper, axis.direction)
    v = np.cross(axis.direction, u)  # u, v, direction: right-handed
    angle = lambda vectors: np.degrees(np.arctan2(vectors @ v, vectors @ u))
    return (angle(end - axis.origin) - angle(start - axis.origin) + 180.0) % 360.0 - 180.0


def right_hand_rule(machine, verdicts):
    """One head axis moves, those behind it stand off zero (a lever about every axis), the others at 0."""
    random = np.random.default_rng(7)
    for index in head_axes(machine):
        axis = machine.axes[index]
        rest = np.zeros((100, len(machine.axes)))
        for behind in head_axes(machine):
            if behind > index:
                rest[:, behind] = random.uniform(20.0, 60.0, len(rest))
        moved = rest.copy()
        moved[:, index] = random.uniform(-170.0, 170.0, len(rest))
        start, end = (machine.forward(joints, 150.0)[0] for joints in (rest, moved))
        worst = float(np.max(np.abs(turned_by(axis, start, end) - moved[:, index])))
        along = float(np.max(np.abs((end - start) @ axis.direction)))
        verdicts.that(worst < 1e-9 and along < 1e-9,
                      f"{axis.name}: a word turns the tool by the right-hand rule about "
                      f"{axis.direction.tolist()}: {worst:.1e} deg, {along:.1e} mm")


def home_near_work(machine):
    """Home of X, Y, Z: where the programs of this test are."""
    return np.array([next(a.home_position() for a in machine.axes if a.letter == letter)
                     for letter in "XYZ"])


def converted(machine, path, tool):
    """The trajectory of a conversion of CONVERTED by the tool."""
    origin = home_near_work(machine) - [0.0, 0.0, 500.0]
    rows = ["x_mm,y_mm,z_mm,i,j,k,feed_mm_per_min"]
    for index, (lean, azimuth) in enumerate(np.radians(np.array(CONVERTED, float))):
        row = np.r_[origin + index * np.array([10.0, -5.0, 2.0]), np.sin(lean) * np.cos(azimuth),
                    np.sin(lean) * np.sin(azimuth), np.cos(lean)]
        rows.append(",".join(f"{value:.12f}" for value in row) + ",3000")
    with tempfile.TemporaryDirectory() as directory:
        source, program, trajectory = (os.path.join(directory, name)
                                       for name in ("leaning.csv", "program", "trajectory.csv"))
        with open(source, "w", encoding="ascii") as file:
            file.write("\n".join(rows) + "\n")
        run = subprocess.run([tool, "convert", source, "-m", path, "-o", program, "--trajectory",
                              trajectory, "--progress", "none"], capture_output=True, text=True,
                             errors="replace", check=False)
        if run.returncode != 0:
            fail(f"head_signs_test.py: convert ended with {run.returncode}: {run.stderr}", 1)
        return Trajectory(trajectory, machine)


def same_as_tool(machine, path, tool, verdicts):
    trajectory = converted(machine, path, tool)
    deviation = lambda: tuple(float(np.max(values)) for values in pose_deviation(
        machine.forward(trajectory.joints), (trajectory.tip, trajectory.axis)))
    words = trajectory.joints[:, head_axes(machine)]
    quadrants = {tuple(signs) for signs in np.sign(words[np.all(np.abs(words) > 5.0, axis=1)])}
    tip, axis = deviation()
    verdicts.that(len(quadrants) == 4, f"the converted program has {len(quadrants)} of 4 sign pairs "
                                       f"of its rotary words, {len(words)} rows")
    verdicts.that(tip < 1e-4 and axis < 1e-4,
                  f"tips and axes that the tool wrote: {tip:.1e} mm, {axis:.1e} deg from our forward kinematics")
    for index in head_axes(machine):
        machine.axes[index].direction = -machine.axes[index].direction
        tip, axis = deviation()
        machine.axes[index].direction = -machine.axes[index].direction
        verdicts.that(axis > SEEN, f"control: with {machine.axes[index].name} reversed "
                                   f"{tip:.1f} mm, {axis:.1f} deg")


def pose_deviation(one, other):
    """Distances of the tips (mm) and angles between the axes (deg) of two poses, row by row."""
    return np.linalg.norm(one[0] - other[0], axis=1), axis_angle_deg(one[1], other[1])


def program_text(points):
    lines = ["%", "G21 G17 G90 G94 G40 G49 G80 G54", "G61"]
    for x, y, z, b, c in points:
        lines += [f"G1 X{x:g} Y{y:g} Z{z:g} B{b:g} C{c:g} F30000", f"G4 P{DWELL:g}"]
    return "\n".join(lines + ["M2", "%"]) + "\n"


def standstills(joints):
    """Joint vectors at which the machine stood for STANDSTILL samples or more, in order."""
    moves = np.flatnonzero(np.any(np.diff(joints, axis=0) != 0.0, axis=1))
    bounds = np.r_[-1, moves, len(joints) - 1]
    long = np.diff(bounds) >= STANDSTILL
    return joints[bounds[1:][long]]


def run_in_linuxcnc(machine, points):
    """Joints at the standstills after home, one row a point."""
    with tempfile.TemporaryDirectory() as directory:
        config, program, log = (os.path.join(directory, n) for n in ("config", "head.ngc", "log.txt"))
        write_config(machine, config, "head")
        with open(program, "w", encoding="ascii") as file:
            file.write(program_text(points))
        status = run_program(config, program, log)
        if status != 0:
            fail(f"head_signs_test.py: the program ended with status {status}", 1)
        stood = standstills(Log(log, machine).joints)[1:]
    if len(stood) != len(points):
        fail(f"head_signs_test.py: {len(stood)} standstills at {len(points)} points", 1)
    return stood


def same_as_linuxcnc(machine, verdicts):
    column = {axis.letter: index for index, axis in enumerate(machine.axes)}
    points = POINTS + np.r_[home_near_work(machine), 0.0, 0.0]
    stood = run_in_linuxcnc(machine, points)
    words = stood[:, [column["B"], column["C"]]]
    verdicts.that(float(np.max(np.abs(words - points[:, 3:]))) < 1e-5,
                  f"the joints B and C of 5axiskins are its words ({len(points)} standstills)")
    # The tool axis of LinuxCNC is from the tip that it was told to the pivot that it moved to.
    tip = points[:, :3] - [0.0, 0.0, PIVOT_LENGTH]
    lever = stood[:, [column[letter] for letter in "XYZ"]] - tip
    length = np.linalg.norm(lever, axis=1)
    verdicts.that(float(np.max(np.abs(length - PIVOT_LENGTH))) < LIMIT,
                  f"its pivot is {PIVOT_LENGTH:g} mm from its tip to "
                  f"{np.max(np.abs(length - PIVOT_LENGTH)):.1e} mm")
    told = (tip, lever / length[:, None])
    for b, c in itertools.product((1.0, -1.0), repeat=2):
        joints = stood.copy()
        joints[:, column["B"]] *= b
        joints[:, column["C"]] *= c
        distance, angle = pose_deviation(machine.forward(joints, PIVOT_LENGTH), told)
        text = (f"our B = {b:+.0f} B, our C = {c:+.0f} C: tip {np.min(distance):.2g} to "
                f"{np.max(distance):.2g} mm, axis {np.min(angle):.2g} to {np.max(angle):.2g} deg off")
        if (b, c) == (SIGNS["B"], SIGNS["C"]):
            verdicts.that(float(np.max(distance)) <= LIMIT
                          and float(np.max(angle)) <= np.degrees(LIMIT / PIVOT_LENGTH), text)
        else:
            verdicts.that(float(np.min(distance)) > SEEN, "control: " + text)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("machine")
    parser.add_argument("--smoothpost")
    arguments = parser.parse_args()
    machine, verdicts = Machine(arguments.machine), Verdicts()
    right_hand_rule(machine, verdicts)
    if arguments.smoothpost:
        same_as_tool(machine, arguments.machine, arguments.smoothpost, verdicts)
    if [machine.axes[index].letter for index in head_axes(machine)] == ["C", "B"]:
        reason = reason_to_skip()
        if reason and not verdicts.failed:
            fail(f"skipped: {reason}", SKIP)
        for axis in machine.axes:  # 5axiskins has W where LinuxCNC's trivkins has any second linear
            axis.letter = "W" if axis.letter == "U" else axis.letter
        if not reason:
            same_as_linuxcnc(machine, verdicts)
    print(f"{machine.name}: {verdicts.failed} failures")
    sys.exit(1 if verdicts.failed else 0)


if __name__ == "__main__":
    main()
