#!/usr/bin/env python3
"""Measures a motion of the benchmark, whoever planned it.

  measure.py MACHINE.toml TRAJECTORY.csv [--input CASE.csv] [--offset X,Y,Z] [--free-axis] [--json]

TRAJECTORY: the joints at equal steps of time: a column t_s and one for each axis of the machine file, its name with _mm
or _deg (X_mm, B_deg); other columns are not looked at. What `smoothpost convert --trajectory` writes is such a file.

With --input the tool's path (forward kinematics of the joints) is compared with the case both ways: no point of the case
without the tool near it, and the tool nowhere else between the first time at the case's first point and the last time at
its last. --offset is where the case's zero stands in the machine's workpiece frame. --free-axis: the tool axis may leave
the case's; it is told how far.
"""

import argparse
import csv
import json
import math
import sys
import tomllib
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests/acceptance/linuxcnc"))
from machine_model import Machine  # noqa: E402

STEP = 0.05  # mm, between the points that the two paths are compared at
DEGREE = 0.2  # mm that a degree counts: the shipped machines' tolerances are 0.01 mm and 0.05 degrees
BAND = 0.02  # of a path's length
REACHED = 0.05  # mm, nearer than that the tool is at the first or last point


def read_columns(path, names):
    with open(path, newline="", encoding="utf-8") as file:
        rows = csv.DictReader(line for line in file if not line.startswith("#"))
        try:
            return np.array([[float(row[name]) for name in names] for row in rows])
        except KeyError as error:
            sys.exit(f"{path}: no column {error}")


def derivatives(samples, step):
    """Velocity, acceleration and jerk by differences of the samples."""
    found = []
    for _ in range(3):
        samples = np.diff(samples, axis=0) / step
        found.append(samples)
    return found


def joint_rows(data, machine, joints, step):
    rows = []
    for index, (axis, entry) in enumerate(zip(machine.axes, data["axis"])):
        unit = axis.unit
        row = {"axis": axis.name, "unit": unit}
        for order, (name, values) in enumerate(zip(("velocity", "acceleration", "jerk"),
                                                   derivatives(joints[:, index:index + 1], step)), 1):
            power = "" if order == 1 else str(order)
            limit = entry[f"max_{name}_{unit}_per_s{power}"]
            row[name] = float(np.max(np.abs(values))) if len(values) else 0.0
            row[name + "_share"] = row[name] / limit
            if name == "jerk":
                row["rms_jerk"] = float(np.sqrt(np.mean(values ** 2))) if len(values) else 0.0
        rows.append(row)
    return rows


def dense(points, axes):
    """Points at most STEP apart on the polyline, with tool axes on great circles."""
    out_points, out_axes = [points[:1]], [axes[:1]]
    for a, b, u, v in zip(points[:-1], points[1:], axes[:-1], axes[1:]):
        count = max(1, math.ceil(np.linalg.norm(b - a) / STEP), math.ceil(np.linalg.norm(v - u) / 0.001))
        share = (np.arange(1, count + 1) / count)[:, None]
        angle = math.acos(min(1.0, float(u @ v)))
        turned = (u * np.sin((1 - share) * angle) + v * np.sin(share * angle)) / math.sin(angle) if angle > 1e-9 \
            else np.repeat(v[None, :], count, axis=0)
        out_points.append(a + share * (b - a))
        out_axes.append(turned)
    return np.vstack(out_points), np.vstack(out_axes)


def shares(points):
    run = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return run / run[-1]


def apart(points, axes, path, path_axes, degree):
    """How far the points, with their axes, are from the path at most: mm and degrees. Each is compared with the nearest place of
    the path (a degree counts `degree` mm) whose share of the length differs by less than BAND, so that a path that comes by twice is
    not taken for itself."""
    where, along = shares(path), shares(points)
    worst = np.zeros(2)
    first = np.searchsorted(where, along - BAND)
    last = np.searchsorted(where, along + BAND, side="right")
    for i in range(len(points)):
        near, far = first[i], max(last[i], first[i] + 1)
        distance = np.linalg.norm(path[near:far] - points[i], axis=1)
        angle = np.degrees(np.arccos(np.clip(path_axes[near:far] @ axes[i], -1.0, 1.0)))
        j = near + int(np.argmin(np.maximum(distance, degree * angle)))
        ways = []
        for k in (j - 1, j):  # the segments on both sides of the nearest point
            if not 0 <= k < len(path) - 1:
                continue
            leg = path[k + 1] - path[k]
            length = float(leg @ leg)
            share = min(1.0, max(0.0, float((points[i] - path[k]) @ leg) / length)) if length > 0.0 else 0.0
            axis = path_axes[k] + share * (path_axes[k + 1] - path_axes[k])
            cosine = float(axis @ axes[i]) / np.linalg.norm(axis)
            ways.append((float(np.linalg.norm(path[k] + share * leg - points[i])),
                         math.degrees(math.acos(min(1.0, cosine)))))
        worst = np.maximum(worst, min(ways, key=lambda way: max(way[0], degree * way[1])))
    return worst


def window(tip, points):
    """From the last sample at the first point before the tool leaves it to the first at the last point for good."""
    at_first = np.flatnonzero(np.linalg.norm(tip - points[0], axis=1) < REACHED)
    at_last = np.flatnonzero(np.linalg.norm(tip - points[-1], axis=1) < REACHED)
    if len(at_first) == 0 or len(at_last) == 0:
        sys.exit(f"the tool never comes within {REACHED} mm of the case's first and last point: is --offset right?")
    begin = at_first[0]
    while begin + 1 < len(tip) and begin + 1 in at_first[:len(at_first)] and \
            np.linalg.norm(tip[begin + 1] - points[0]) <= np.linalg.norm(tip[begin] - points[0]):
        begin += 1
    end = at_last[-1]
    while end > begin and np.linalg.norm(tip[end - 1] - points[-1]) <= np.linalg.norm(tip[end] - points[-1]):
        end -= 1
    return begin, end


def path_figures(given, machine, joints, times):
    case = read_columns(given.input, ["x_mm", "y_mm", "z_mm", "i", "j", "k"])
    keep = np.concatenate([[True], np.any(np.diff(case, axis=0) != 0.0, axis=1)])
    case = case[keep]
    points, axes = case[:, :3], case[:, 3:] / np.linalg.norm(case[:, 3:], axis=1)[:, None]
    tip, axis = machine.forward(joints)
    tip = tip - np.array([float(c) for c in given.offset.split(",")])
    begin, end = window(tip, points)
    moving = np.concatenate([[True], np.linalg.norm(np.diff(tip[begin:end + 1], axis=0), axis=1) > 1e-9])
    made = (tip[begin:end + 1][moving], axis[begin:end + 1][moving])
    wanted = dense(points, axes)
    degree = 0.0 if given.free_axis else DEGREE
    worst = np.maximum(apart(*made, *wanted, degree), apart(*wanted, *made, degree))
    return {"tip_mm": float(worst[0]), "axis_deg": float(worst[1]), "cut_time_s": float(times[end] - times[begin])}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("machine", type=Path)
    parser.add_argument("trajectory", type=Path)
    parser.add_argument("--input", type=Path)
    parser.add_argument("--offset", default="0,0,0")
    parser.add_argument("--free-axis", action="store_true")
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    data = tomllib.loads(given.machine.read_text(encoding="utf-8"))
    machine = Machine(given.machine)
    samples = read_columns(given.trajectory, ["t_s", *(f"{axis.name}_{axis.unit}" for axis in machine.axes)])
    times, joints = samples[:, 0], samples[:, 1:]
    steps = np.diff(times)
    step = float(np.median(steps))
    if len(steps) < 4 or np.max(np.abs(steps[:-1] - step)) > 1e-6:
        sys.exit(f"{given.trajectory}: samples have to be at equal steps of time")
    if abs(steps[-1] - step) > 1e-6:  # the end need not fall on a cycle
        joints = joints[:-1]
    found = {"time_s": float(times[-1]), "step_s": step}
    found["joints"] = joint_rows(data, machine, joints, step)
    if given.input:
        found |= path_figures(given, machine, joints, times)
    if given.json:
        print(json.dumps(found, indent=1))
        return
    print(f"time {found['time_s']:.2f} s" + (f", from first to last point {found['cut_time_s']:.2f} s; tip {found['tip_mm']:.4f} mm, "
                                              f"axis {found['axis_deg']:.4f} deg" if given.input else ""))
    print("axis   velocity        acceleration     jerk            rms jerk     (peak, share of limit)")
    for row in found["joints"]:
        print(f"{row['axis']:5}" + "".join(f"{row[name]:10.4g} {row[name + '_share']:5.2f}" for name in
                                          ("velocity", "acceleration", "jerk")) + f"{row['rms_jerk']:12.4g} {row['unit']}")


if __name__ == "__main__":
    main()
