#!/usr/bin/python3
"""Measures what LinuxCNC makes of a program as it came, of ours, and of our joint stream.

    measure_programs.py --smoothpost TOOL --source ROOT --work DIR [CASE...]

CASES below: paper B's Case 2 and two programs of others (skipped where the corpus does not lie beside the checkout).
Every run is in real time, and its log stays in DIR: a second call only runs what is missing there. For each
case, one row each:
  as it came, G64    LinuxCNC's default path mode; Case 2, whose words LinuxCNC does not read, is put point by
  as it came, G61    point into joint words with its feed, what a post without smoothing does
  ours, G-code       the converted program
  ours, stream       the file of --trajectory, played through HAL's streamer
and the last two again with the jerk limits of the machine file times JERK_FACTOR.
Columns: seconds in all and in feeds (of the stream: those of its plan); how far tip and axis leave what the
controller was told (of G64 in tool-centre-point mode: the executed path of G61); and for each joint the peaks of velocity,
acceleration and jerk over the machine file's limits, by differences at 1 ms. Where LinuxCNC switches kinematics its
joints may jump; such steps are left out and counted. Printed as markdown; docs/controllers/linuxcnc.md has it.
"""
import argparse
import csv
import os
import subprocess
import sys

import numpy as np

from compare_path import Comparison, Deviation, Log, Plan, nearest, runs_of
from machine_model import Machine, fail
from make_config import write_config
from measure_block_times import CYCLE, limits
from run_program import NAMESPACES, SKIP, namespaces_allowed, reason_to_skip, run_program
from stream_check import play, read_trajectory

TOLERANCE = (0.01, 0.05)  # mm, deg: the scale of "nearest"
JERK_FACTOR = 5
LINES_AROUND = 3
EVERY = 10                # ms, between the samples of a path that another one is compared with
JUMP = 3.0                # of the velocity limit, in one step: not a motion
CORPUS = "../shared/corpus/1_five_axis/LinuxCNC/configs/sim/axis/vismach/5axis/table-rotary-tilting/demos"
HOME = {"axis.Z.home": 150, "links.retract_mm": 100}  # the mills' home is far above the work
CASES = {
    "case2": {"input": "examples/paper_b/case2.csv", "machine": "laser_5p1", "tool": 0.0, "set": {},
              "options": ["--lead", "15", "--tilt", "10"]},
    "boat_bc": {"input": f"{CORPUS}/boat-xyzbc.ngc", "machine": "table_table_bc", "tool": 50.0, "set": HOME,
                "options": ["--input-machine", "table_table_bc", "--tool", "1=50"]},
    "boat_ac": {"input": f"{CORPUS}/boat-xyzac.ngc", "machine": "table_table_ac", "tool": 50.0, "set": HOME,
                "options": ["--input-machine", "table_table_ac", "--tool", "1=50"]},
}


def motion_of(joints, bounds):
    """Joints without the steps that are jumps, in pieces, and how many jumps there were."""
    step = np.abs(np.diff(joints, axis=0)) / CYCLE / bounds[0]
    jumps = np.flatnonzero(step.max(axis=1) > JUMP) + 1
    return [piece for piece in np.split(joints, jumps) if len(piece) > 3], len(jumps)


def peaks(pieces, bounds):
    """Of each joint the largest share of velocity, acceleration and jerk: three rows."""
    rows = [[np.abs(np.diff(piece, n=order, axis=0)).max(axis=0) / CYCLE ** order / bounds[order - 1]
             for piece in pieces] for order in (1, 2, 3)]
    return [np.max(row, axis=0) for row in rows]


def lines_of(log):
    """The line of every sample; at rest that of the motion before."""
    line = log.line.copy()
    for i in range(1, len(line)):
        if line[i] == 0:
            line[i] = line[i - 1]
    return line


def follow(log, path, machine, tool):
    """Largest distance of the feeds of `log` from those of `path`, the same program run in another path mode."""
    weight = TOLERANCE[0] / np.radians(TOLERANCE[1])
    sides = []
    for one, every in ((log, 1), (path, EVERY)):
        feed = one.motion_type >= 2
        sides.append((machine.poses(one.joints[feed][::every], tool, weight), lines_of(one)[feed][::every]))
    (points, line), (curve, there) = sides
    deviation = Deviation(weight)
    if np.any(np.diff(there) < 0):
        raise ValueError("the lines of the path do not rise: a program with loops cannot be compared like this")
    for run in runs_of(line, line):
        first = max(0, np.searchsorted(there, line[run.start] - LINES_AROUND) - 1)
        last = np.searchsorted(there, line[run.start] + LINES_AROUND, side="right")
        if last - first > 1:
            _, feet = nearest(points[run], curve[first:last - 1], curve[first + 1:last])
            deviation.add(points[run], feet, line[run])
    return deviation


class Measurement:
    """One case: its machine, its files in the work folder, its rows."""

    def __init__(self, name, given):
        self.name, self.case, self.given = name, CASES[name], given
        self.work = os.path.join(given.work, name)
        os.makedirs(self.work, exist_ok=True)
        self.machine_file = os.path.join(given.source, "machines", self.case["machine"], "machine.toml")
        self.machine = Machine(self.machine_file)
        for axis in self.machine.axes:
            axis.home = self.case["set"].get(f"axis.{axis.name}.home", axis.home)
        self.bounds = limits(self.machine_file, [axis.name for axis in self.machine.axes])
        self.input = os.path.join(given.source, self.case["input"])

    def file(self, name):
        return os.path.join(self.work, name)

    def header(self):
        names = [f"{axis.name}: v / a / j" for axis in self.machine.axes]
        print(f"\n**{self.name}** ({self.machine.name})\n")
        print("| | time (s) | in feeds (s) | tip (mm) | axis (deg) | " + " | ".join(names) + " |")
        print("|---" * (5 + len(names)) + "|")

    def row(self, name, times, deviation, joints):
        pieces, jumps = motion_of(joints, self.bounds)
        shares = [" / ".join(f"{value:.2f}" if value < 10 else f"{value:.0f}" for value in joint)
                  for joint in np.transpose(peaks(pieces, self.bounds))]
        note = f", {jumps} jumps" if jumps else ""
        tip, axis = (f"{value:.4f}" for value in deviation) if deviation else ("", "")
        print(f"| {name}{note} | {times[0]:.2f} | {times[1]:.2f} | {tip} | {axis} | " + " | ".join(shares) + " |",
              flush=True)

    # --- the program as it came ---

    def joint_words(self):
        """A row of the CSV as joint words: the head turned to the axis, the standoff at 0, the feed as time."""
        with open(self.input, encoding="ascii") as file:
            rows = csv.DictReader(line for line in file if not line.startswith("#"))
            values = [{name: float(value) for name, value in row.items()} for row in rows]
        table = {name: np.array([row[name] for row in values]) for name in values[0]}
        point = np.stack([table[f"{c}_mm"] for c in "xyz"], 1)
        axis = np.stack([table[c] for c in "ijk"], 1)
        index = {one.name: i for i, one in enumerate(self.machine.axes)}
        joints = np.zeros((len(point), len(index)))
        joints[:, index["B"]] = np.degrees(np.arccos(axis[:, 2]))
        joints[:, index["C"]] = np.degrees(np.unwrap(np.arctan2(axis[:, 1], axis[:, 0])))
        tip, direction = self.machine.forward(joints)
        if np.abs(direction - axis).max() > 1e-6:
            raise ValueError("this head does not turn to the axis as it is written here")
        for column, letter in enumerate("XYZ"):
            joints[:, index[letter]] = point[:, column] - tip[:, column]
        length = np.linalg.norm(np.diff(point, axis=0), axis=1)
        rate = table["feed_mm_per_min"][1:] / length
        words = [" ".join(f"{one.letter}{value:.5f}" for one, value in zip(self.machine.axes, row)) for row in joints]
        return ["G21 G90 G40 G49 G80", "G0 " + words[0], "G93"] + [
            f"G1 {text} F{value:.4f}" for text, value in zip(words[1:], rate)] + ["M2"]

    def raw_program(self, mode):
        if self.input.endswith(".csv"):
            lines = self.joint_words()
            lines.insert(1, mode)
            kins = "triv"
        else:
            with open(self.input, encoding="ascii", errors="replace") as file:
                lines = file.read().splitlines()
            at = next(i for i, line in enumerate(lines) if line.startswith("M428"))
            lines.insert(at + 1, mode)
            kins = "trt"
        program = self.file(f"raw_{mode}.ngc")
        with open(program, "w", encoding="ascii", errors="replace") as file:
            file.write("\n".join(lines) + "\n")
        return program, kins

    def run(self, name, program, kins):
        log = self.file(f"log_{name}.txt")
        if not os.path.exists(log):
            config = self.file(f"config_{name}")
            write_config(self.machine, config, kins, tools={1: self.case["tool"]})
            status = run_program(config, program, log + ".new", timeout=3000.0)
            if status != 0:
                fail(f"measure_programs.py: {self.name}, {name}: status {status}", 1)
            os.replace(log + ".new", log)
        return Log(log, self.machine)

    def raw(self):
        programs = {mode: self.raw_program(mode) for mode in ("G61", "G64")}
        logs = {mode: self.run(f"raw_{mode}", *programs[mode]) for mode in programs}
        for mode in ("G64", "G61"):
            log, (program, kins) = logs[mode], programs[mode]
            joints = log.joints[log.moving()]
            if kins == "triv":
                plan = Plan.of_program(program, self.machine, log.joints[0])
                told = Comparison(log, self.machine, plan, TOLERANCE, self.case["tool"]).executed
                deviation = (told.tip, told.axis)
            elif mode == "G64":
                told = follow(log, logs["G61"], self.machine, self.case["tool"])
                deviation = (told.tip, told.axis)
            else:
                deviation = None
            feeds = CYCLE * np.count_nonzero(log.motion_type[log.moving()] >= 2)
            self.row(f"as it came, {mode}", (len(joints) * CYCLE, feeds), deviation, joints)

    # --- ours ---

    def convert(self, factor):
        """Program and trajectory; converted once."""
        program, trajectory = self.file(f"ours_{factor}.ngc"), self.file(f"ours_{factor}.csv")
        report = self.file(f"ours_{factor}.json")
        if not all(map(os.path.exists, (program, trajectory, report))):
            settings = {**self.case["set"], "cycle.time_ms": 1}
            for axis, jerk in zip(self.machine.axes, self.bounds[2]):
                if factor != 1:
                    settings[f"axis.{axis.name}.max_jerk_{axis.unit}_per_s3"] = factor * jerk
            made = subprocess.run(
                [self.given.smoothpost, "convert", self.input, "-m", self.case["machine"], "--machine-path",
                 os.path.join(self.given.source, "machines"), *self.case["options"],
                 *[word for key, value in settings.items() for word in ("--set", f"{key}={value}")],
                 "-o", program, "--json", report, "--trajectory", trajectory, "--progress", "none"], check=False)
            if made.returncode != 0:
                fail(f"measure_programs.py: {self.name}: not certified: exit {made.returncode}", 1)
        return program, trajectory

    def gcode(self, name, factor):
        program, _ = self.convert(factor)
        log = self.run(f"ours_{factor}", program, "triv")
        plan = Plan.of_program(program, self.machine, log.joints[0])
        told = Comparison(log, self.machine, plan, TOLERANCE, self.case["tool"])
        joints = log.joints[log.moving()]
        self.row(name, (len(joints) * CYCLE, told.executed_time), (told.executed.tip, told.executed.axis), joints)

    def stream(self, name, factor):
        program, trajectory = self.convert(factor)
        names, rows, _ = read_trajectory(trajectory)
        if [text.rsplit("_", 1)[0] for text in names] != [axis.name for axis in self.machine.axes]:
            raise ValueError(f"{trajectory}: other axes than the machine")
        log = self.file(f"stream_{factor}.npy")
        if not os.path.exists(log):
            command = [sys.executable, "-B", os.path.abspath(__file__), "--play", trajectory, log]
            subprocess.run((NAMESPACES if namespaces_allowed() else []) + command, check=True)
        executed = np.load(log)
        moving = np.flatnonzero(np.any(np.diff(executed, axis=0) != 0.0, axis=1))
        planned = np.flatnonzero(np.any(np.diff(rows, axis=0) != 0.0, axis=1))
        executed, rows = executed[moving[0]:moving[-1] + 2], rows[planned[0]:planned[-1] + 2]
        deviation = None
        if len(executed) == len(rows):  # the same cycle on both sides
            weight = TOLERANCE[0] / np.radians(TOLERANCE[1])
            apart = Deviation(weight)
            apart.add(*(self.machine.poses(side, self.case["tool"], weight) for side in (executed, rows)),
                      np.arange(len(rows)))
            deviation = (apart.tip, apart.axis)
        feeds = float(np.sum(Plan.of_program(program, self.machine, rows[0]).durations))
        self.row(name, (len(executed) * CYCLE, feeds), deviation, executed)

    def all_rows(self):
        self.header()
        self.raw()
        self.gcode("ours, G-code", 1)
        self.stream("ours, stream", 1)
        self.stream(f"ours, stream, {JERK_FACTOR} times the jerk limits", JERK_FACTOR)


def main():
    if sys.argv[1:2] == ["--play"]:  # in namespaces of its own
        folder = sys.argv[3] + ".hal"
        os.makedirs(folder, exist_ok=True)
        _, rows, _ = read_trajectory(sys.argv[2])
        np.save(sys.argv[3], play(rows, folder))
        return
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    for name in ("smoothpost", "source", "work"):
        parser.add_argument(f"--{name}", required=True)
    parser.add_argument("cases", nargs="*", help=", ".join(CASES))
    given = parser.parse_args()
    reason = reason_to_skip()
    if reason:
        fail(f"skipped: {reason}", SKIP)
    for name in given.cases or CASES:
        measurement = Measurement(name, given)
        if os.path.exists(measurement.input):
            measurement.all_rows()
        else:
            print(f"\n{name}: skipped, {CASES[name]['input']} is not here")


if __name__ == "__main__":
    main()
