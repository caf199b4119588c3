#!/usr/bin/python3
"""The robot through LinuxCNC's own serial kinematics: one model of the arm against another.

    robot_kinematics_test.py --machine MACHINE.toml --smoothpost TOOL -- CONVERT_ARGUMENTS...

A contour (CSV) is converted for the robot. What its flange does by our model along the contour, every STEP seconds of the --trajectory
file, is told to a LinuxCNC whose kinematics are `genserkins` with the arm's Denavit-Hartenberg numbers of the data sheet, as moves of
X Y Z A B C (position and roll, pitch, yaw of the flange). LinuxCNC solves for the joints itself, and runs the whole
contour. Held against ours: at every pose it was told its joints are those of the trajectory, in the same order. Control: with
one joint turned the other way round they are not.

DH numbers: alpha and a from the axis before, then theta about and d along the own axis. Our joints count as KUKA's do, theta as
DH wants it: SIGN and ZERO.

Exit status: 0 all hold, 1 not, 77 LinuxCNC cannot run here (and why).
"""
import argparse
import csv
import json
import math
import os
import subprocess
import sys
import tempfile

import numpy as np

from compare_path import Log, Trajectory
from machine_model import Machine, fail
from make_config import AXIS_ORDER, hal_channels, hal_text, parameter_text, tool_text
from run_program import SKIP, reason_to_skip, run_program

try:
    import tomllib
except ModuleNotFoundError:
    import tomli as tomllib

A = (0.0, 350.0, 850.0, 145.0, 0.0, 0.0)             # mm
ALPHA = (0.0, -90.0, 0.0, -90.0, 90.0, -90.0)        # deg
D = (815.0, 0.0, 0.0, 820.0, 0.0, 170.0)             # mm
SIGN = np.array((-1.0, 1.0, 1.0, -1.0, 1.0, -1.0))
ZERO = np.array((0.0, 0.0, -90.0, 0.0, 0.0, 0.0))    # theta of our zero, deg
FLANGE = np.array(((0.0, 0.0, 1.0), (0.0, -1.0, 0.0), (1.0, 0.0, 0.0)))  # columns: its axes at our zero
STEP = 0.1       # s
LIMIT = 0.0005   # deg: 0.01 mm at 1.5 m
NEAR = 0.01      # deg: from there on to the nearest sample
SEEN = 1.0       # deg


def flange_poses(machine, joints):
    """Position and rotation of the flange in the base, by our model: (n, 3) and (n, 3, 3)."""
    columns = []
    for axis in FLANGE.T:
        machine.tool_axis = axis
        position, direction = machine.forward(joints)
        columns.append(direction)
    return position, np.stack(columns, axis=2)


def roll_pitch_yaw(rotation):
    """Angles (deg) of R = Rz(yaw) Ry(pitch) Rx(roll), unwound along the path."""
    pitch = np.arctan2(-rotation[:, 2, 0], np.hypot(rotation[:, 0, 0], rotation[:, 1, 0]))
    roll = np.arctan2(rotation[:, 2, 1], rotation[:, 2, 2])
    yaw = np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0])
    if np.degrees(np.abs(pitch)).max() > 85.0:
        raise ValueError("roll and yaw of this flange are near their pole: choose another contour")
    return np.degrees(np.stack([np.unwrap(roll), pitch, np.unwrap(yaw)], 1))


def ini_text(home):
    sections = {
        "EMC": {"VERSION": "1.1", "MACHINE": "robot", "DEBUG": 0}, "DISPLAY": {"DISPLAY": "./headless_display.py"},
        "RS274NGC": {"PARAMETER_FILE": "headless.var"},
        "EMCMOT": {"EMCMOT": "motmod", "COMM_TIMEOUT": 4.0, "SERVO_PERIOD": 1000000},
        "TASK": {"TASK": "milltask", "CYCLE_TIME": 0.001}, "HAL": {"HALFILE": "headless.hal"},
        "EMCIO": {"EMCIO": "io", "CYCLE_TIME": 0.1, "TOOL_TABLE": "tool.tbl"},
        "KINS": {"KINEMATICS": "genserkins", "JOINTS": 6},
        "TRAJ": {"COORDINATES": "XYZABC", "LINEAR_UNITS": "mm", "ANGULAR_UNITS": "degree", "DEFAULT_LINEAR_VELOCITY": 200,
                 "MAX_LINEAR_VELOCITY": 200, "DEFAULT_LINEAR_ACCELERATION": 2000, "MAX_LINEAR_ACCELERATION": 2000,
                 "DEFAULT_ANGULAR_VELOCITY": 90, "MAX_ANGULAR_VELOCITY": 90, "NO_FORCE_HOMING": 1}}
    for letter in AXIS_ORDER[:6]:
        reach, fast = (5000, 200) if letter in "XYZ" else (1000, 90)
        sections[f"AXIS_{letter}"] = {"MIN_LIMIT": -reach, "MAX_LIMIT": reach, "MAX_VELOCITY": fast,
                                      "MAX_ACCELERATION": 10 * fast}
    for index, value in enumerate(home):
        sections[f"JOINT_{index}"] = {
            "TYPE": "ANGULAR", "HOME": value, "HOME_OFFSET": value, "MIN_LIMIT": -1000, "MAX_LIMIT": 1000, "MAX_VELOCITY": 300,
            "MAX_ACCELERATION": 3000, "HOME_SEARCH_VEL": 0, "HOME_LATCH_VEL": 0, "HOME_SEQUENCE": 0, "FERROR": 10,
            "MIN_FERROR": 10}
    return "\n".join(f"[{name}]\n" + "\n".join(f"{key} = {value}" for key, value in entries.items())
                     for name, entries in sections.items()) + "\n"


def write_config(machine, folder, home):
    """The files of make_config.py for a robot: joints and axes are not the same here."""
    os.makedirs(folder)
    arm = "".join(f"setp genserkins.A-{n} {A[n]}\nsetp genserkins.ALPHA-{n} {math.radians(ALPHA[n])}\n"
                  f"setp genserkins.D-{n} {D[n]}\n" for n in range(6))
    files = {"headless.ini": ini_text(home), "headless.hal": hal_text(machine, "triv") + arm, "tool.tbl": tool_text({}),
             "headless.var": parameter_text({}, {}),
             "channels.json": json.dumps([name for name, _, _ in hal_channels(machine)]) + "\n"}
    for name, text in files.items():
        with open(os.path.join(folder, name), "w", encoding="ascii") as file:
            file.write(text)


def program_text(position, angles):
    lines = ["%", "G21 G17 G90 G94 G40 G49 G80 G54", "G61"]
    for index, row in enumerate(np.hstack([position, angles])):
        if index % 5 == 0:  # genserkins looks for the joints from where the arm stands: nothing far ahead
            lines.append("M66 E0 L0")
        lines.append("G1 " + " ".join(f"{letter}{value:.6f}" for letter, value in zip("XYZABC", row)) + " F12000")
    return "\n".join(lines + ["M2", "%"]) + "\n"


def trajectory_of(tool, arguments, machine, work):
    path = os.path.join(work, "trajectory.csv")
    made = subprocess.run([tool, "convert", *arguments, "-o", os.path.join(work, "program.out"), "--trajectory", path,
                           "--progress", "none"], capture_output=True, text=True, errors="replace", check=False)
    if made.returncode != 0:
        fail(f"robot_kinematics_test.py: convert ended with {made.returncode}: {made.stderr}", 1)
    return Trajectory(path, machine)


def along_contour(trajectory, source):
    """The rows from where the tip comes into the contour's box to where it leaves it for good."""
    with open(source, encoding="ascii") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    contour = np.array([[float(row[f"{c}_mm"]) for c in "xyz"] for row in rows])
    inside = np.all((trajectory.tip >= contour.min(axis=0) - 1.0) & (trajectory.tip <= contour.max(axis=0) + 1.0), axis=1)
    at = np.flatnonzero(inside)
    return slice(at[0], at[-1] + 1)


def in_order(rows, executed):
    """Largest joint difference (deg) of the rows to the executed joints, each looked for behind the one before."""
    worst, at = 0.0, 0
    for row in rows:
        apart = np.abs(executed[at:] - row).max(axis=1)
        near = np.flatnonzero(apart <= NEAR)
        step = int(near[0]) if len(near) else int(np.argmin(apart))
        while step + 1 < len(apart) and apart[step + 1] < apart[step]:
            step += 1
        worst, at = max(worst, float(apart[step])), at + step
    return worst


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--machine", required=True)
    parser.add_argument("--smoothpost", required=True)
    parser.add_argument("arguments", nargs=argparse.REMAINDER)
    given = parser.parse_args()
    reason = reason_to_skip()
    if reason:
        fail(f"skipped: {reason}", SKIP)
    machine = Machine(given.machine)
    with open(given.machine, "rb") as file:
        origin = np.array(tomllib.load(file)["tool"]["flange"]["xyz_mm"], float)
    with tempfile.TemporaryDirectory() as work:
        os.chmod(work, 0o755)
        arguments = [a for a in given.arguments if a != "--"]
        trajectory = trajectory_of(given.smoothpost, arguments, machine, work)
        machine.tip, machine.workpiece_origin, machine.workpiece_rotation = origin, np.zeros(3), np.eye(3)
        every = max(1, round(STEP / (trajectory.time[1] - trajectory.time[0])))
        joints = trajectory.joints[along_contour(trajectory, arguments[0])][::every]
        joints = joints[np.r_[True, np.abs(np.diff(joints, axis=0)).max(axis=1) > LIMIT]]
        theta = joints * SIGN + ZERO
        position, rotation = flange_poses(machine, joints)
        config, program, log = (os.path.join(work, name) for name in ("config", "flange.ngc", "log.txt"))
        write_config(machine, config, theta[0])
        with open(program, "w", encoding="ascii") as file:
            file.write(program_text(position, roll_pitch_yaw(rotation)))
        status = run_program(config, program, log, timeout=200.0)
        if status != 0:
            fail(f"robot_kinematics_test.py: the program ended with status {status}", 1)
        executed = Log(log, machine).joints
    worst = in_order(theta, executed)
    print(f"{len(theta)} poses of the flange, {len(executed) / 1000:.1f} s: joints of genserkins and ours differ by "
          f"{worst:.6f} deg (limit {LIMIT})")
    good = worst <= LIMIT
    for index in range(6):
        turned = theta.copy()
        turned[:, index] = 2.0 * ZERO[index] - turned[:, index]
        wrong = in_order(turned, executed)
        print(f"control: joint {index + 1} the other way round: {wrong:.2f} deg")
        good = good and wrong > SEEN
    print("holds" if good else "does not hold")
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
