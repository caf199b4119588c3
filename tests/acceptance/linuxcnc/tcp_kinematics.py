#!/usr/bin/python3
"""Checks the signs of a table-table machine file against LinuxCNC's own kinematics.

    tcp_kinematics.py MACHINE.toml [--limit 0.002]

A short program in tool-centre-point mode (M428) with a 50 mm tool runs in LinuxCNC under
xyzac-trt-kins or xyzbc-trt-kins. The joints that LinuxCNC makes of it, put through the forward
kinematics of the machine file, must give back the programmed tip path: at each sample the tip has
to lie where the program has it when the rotary axes stand as they do. Wrong signs, origins or
axis orders are off by tens of millimetres. Exit status: 0 the same kinematics within --limit
(mm), 1 not, 77 LinuxCNC cannot run here.
"""
import argparse
import os
import sys
import tempfile

import numpy as np

from compare_path import Log, nearest
from machine_model import Machine, fail
from make_config import write_config
from run_program import SKIP, reason_to_skip, run_program

TOOL_LENGTH = 50.0
# Tip in the workpiece (mm), tilting axis, rotary axis (deg). The second point turns the axes alone.
POINTS = np.array([[20, 10, 300, 0, 0], [20, 10, 300, -15, 30], [40, -20, 310, -10, 75],
                   [-10, 30, 290, 12, 20], [0, 0, 300, 5, -60], [15, 25, 295, -20, -100]], float)
FASTER = 10.0     # limits are raised, they do not matter here
DEG_TO_MM = 1.0  # weight of a degree in the search for the nearest programmed point


def program_text(tilt, turn):
    words = lambda p: f"X{p[0]:g} Y{p[1]:g} Z{p[2]:g} {tilt}{p[3]:g} {turn}{p[4]:g}"
    lines = ["%", "G21 G17 G90 G94 G40 G49 G80 G54", "G61", "T1 M6", "M428", "G43 H1",
             "G0 " + words(POINTS[0])]
    lines += ["G1 " + words(point) + " F9000" for point in POINTS[1:]]
    return "\n".join(lines + ["G0 X0 Y0", "M429", "M2", "%"]) + "\n"


def run(machine, tilt, turn):
    """The log of the run in LinuxCNC's kinematics."""
    with tempfile.TemporaryDirectory() as directory:
        config, program, log = (os.path.join(directory, n) for n in ("config", "tcp.ngc", "log.txt"))
        write_config(machine, config, "trt", tools={1: TOOL_LENGTH})
        with open(program, "w", encoding="ascii") as file:
            file.write(program_text(tilt, turn))
        status = run_program(config, program, log)
        if status != 0:
            fail(f"tcp_kinematics.py: the program ended with status {status}", 1)
        return Log(log, machine)


def deviation(machine, log, tilt, turn):
    """Largest distance (mm) of our tips from the programmed path, and the number of samples."""
    lines = program_text(tilt, turn).splitlines()
    feed_lines = [number for number, text in enumerate(lines, 1) if text.startswith("G1 ")]
    feed = (log.line >= feed_lines[0]) & (log.line <= feed_lines[-1])
    joints = log.joints[feed]
    tip, _ = machine.forward(joints, TOOL_LENGTH)
    rotary = joints[:, [machine.letters.index(tilt), machine.letters.index(turn)]]
    executed = np.hstack([tip, DEG_TO_MM * rotary])
    programmed = POINTS * np.array([1, 1, 1, DEG_TO_MM, DEG_TO_MM])
    _, foot = nearest(executed, programmed[:-1], programmed[1:])
    ends = max(float(np.min(np.linalg.norm(executed - point, axis=1))) for point in programmed)
    return float(np.max(np.linalg.norm((executed - foot)[:, :3], axis=1))), ends, len(joints)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("machine")
    parser.add_argument("--limit", type=float, default=0.002, help="mm")
    arguments = parser.parse_args()
    reason = reason_to_skip()
    if reason:
        fail(f"skipped: {reason}", SKIP)
    machine = Machine(arguments.machine)
    tables = [axis.letter for axis in machine.axes if axis.rotary and axis.on_workpiece]
    for axis in machine.axes:
        axis.velocity, axis.acceleration = FASTER * axis.velocity, FASTER * axis.acceleration
    log = run(machine, *tables)
    tip, ends, samples = deviation(machine, log, *tables)
    # The check itself is checked: with one rotary axis turned round it has to see millimetres.
    wrong = []
    for axis in (axis for axis in machine.axes if axis.rotary):
        axis.direction = -axis.direction
        wrong.append(deviation(machine, log, *tables)[0])
        axis.direction = -axis.direction
    ok = tip <= arguments.limit and ends <= 0.05 and min(wrong) > 1.0
    print(f"{machine.name}: our forward kinematics is {tip:.6f} mm from the programmed tips at most"
          f" ({samples} samples), misses a programmed point by {ends:.4f}, and with one rotary axis"
          f" reversed by {min(wrong):.1f} mm: {'same kinematics' if ok else 'DIFFERENT'}")
    sys.exit(0 if ok else 1)


if __name__ == "__main__":
    main()
