#!/usr/bin/python3
"""Acceptance of one conversion by LinuxCNC itself.

    acceptance_linuxcnc.py CASE --smoothpost TOOL --source ROOT --work DIR

CASE is a row of CASES: an input program is converted with the built tool, then (cases with
interpreter_only stop after 2; those with seconds run the beginning, and leave the CSV out)
  1. the tool certifies it (exit status 0, verdict certified),
  2. LinuxCNC's interpreter accepts the program, and refuses it with any live G54 offset,
  3. the program runs to its end in the headless LinuxCNC that make_config.py makes of the machine,
  4. the executed poses and the program agree: tip 0.01 mm, axis 0.05 deg, blending included; every
     row of the trajectory CSV was executed; its tips and axes are those of our forward kinematics;
     it took as long as the report's executed_estimate says, to a twentieth,
  5. digital output 0 (the beam) is where the program wants it, never on in a rapid, off at the end,
  6. with a live G54 offset in the controller the program aborts before any joint has moved,
  7. where LinuxCNC has the input machine's kinematics, the input itself runs there in tool-centre-point
     mode, and what the two machines executed is the same path within the tolerances.
Prints every figure. Exit status: 0 all hold, 1 not, 2 usage, 77 LinuxCNC cannot run here (and why).
"""
import argparse
import json
import os
import re
import subprocess
import sys

import numpy as np

import interpreter_check
from compare_path import (Comparison, Deviation, Log, Plan, Trajectory, block_of_samples, compare,
                          compare_trajectory, nearest)
from joint_program import JointProgram
from machine_model import Machine, axis_angle_deg, fail
from make_config import write_config
from run_program import SKIP, reason_to_skip, run_program

TOLERANCE = (0.01, 0.05)  # mm, deg
OPERATOR_ERROR = 15       # exit status of headless_display.py
BEAM_SWITCH = 0.004       # s, between a switch of the output and the joints' start
LIVE_OFFSET = 0.25        # mm or deg
ESTIMATE = 0.05           # of the executed time
PASSED = 1.0              # mm or deg, from one sample of the log to the next
SAMPLES = "tests/acceptance/linuxcnc/samples"


def elliptic_part(path, a=20.0, b=14.0, height=40.2, around=96, up=20):
    """An elliptic cylinder as an ASCII STL."""
    def at(i, k):
        turn = 2.0 * np.pi * (i % around) / around
        return a * np.cos(turn), b * np.sin(turn), height * k / up
    triangles = []
    for i in range(around):
        for k in range(up):
            corners = at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)
            triangles += [corners[:3], (corners[0], corners[2], corners[3])]
        triangles += [(at(i + 1, 0), at(i, 0), (0.0, 0.0, 0.0)),
                      (at(i, up), at(i + 1, up), (0.0, 0.0, height))]
    with open(path, "w", encoding="ascii") as file:
        file.write("solid part\n")
        for corners in triangles:
            file.write("facet normal 0 0 0\nouter loop\n")
            for corner in corners:
                file.write("vertex " + " ".join(f"{value:.6f}" for value in corner) + "\n")
            file.write("endloop\nendfacet\n")
        file.write("endsolid part\n")


# The mills' home is far above the work; it is moved near, to keep the runs to seconds.
MILL = {"input": f"{SAMPLES}/mill_short.ngc", "input_machine": "table_table_ac",
        "options": ["--tool", "1=50"], "tool_length": 50.0,
        "set": {"axis.Z.home": 150, "links.retract_mm": 150}, "native": True}
CASES = {
    "mill_to_table_table_ac": {**MILL, "machine": "table_table_ac"},
    "mill_to_table_table_bc": {**MILL, "machine": "table_table_bc"},
    "laser_to_laser_5p1": {"input": f"{SAMPLES}/laser_short.ngc", "input_machine": "laser_5p1",
                           "machine": "laser_5p1", "options": [], "tool_length": 0.0, "set": {}},
    # The shipped examples whole: too long for real time, so the interpreter alone.
    "example_mill_ac": {"input": "examples/mill_ac/mill_ac.ngc", "input_machine": "table_table_ac",
                        "machine": "table_table_bc", "options": ["--tool", "1=60"], "set": {},
                        "interpreter_only": True},
    "example_bent_sheet": {"input": "examples/bent_sheet/bent_sheet.ngc",
                           "input_machine": "laser_5p1", "machine": "laser_5p1",
                           "options": ["--work-offset", "G54=700,600,1000"], "set": {},
                           "interpreter_only": True},
    # A whole part of 40 layers is finished; the machine runs the first seconds of its program.
    "finish_first_seconds": {"command": "finish", "make_input": elliptic_part,
                             "machine": "finish_2p2r_1p1r", "options": ["--work-offset", "auto"],
                             "tool_length": 0.0, "set": {}, "seconds": 20.0},
}


class Verdicts:
    """Collects what holds and what does not, and says it."""

    def __init__(self):
        self.failed = []

    def that(self, holds, text):
        print(f"{'ok    ' if holds else 'FAILED'} {text}", flush=True)
        if not holds:
            self.failed.append(text)
        return holds


class Acceptance:
    """One case: its files, its machine, its verdicts."""

    def __init__(self, case, arguments):
        self.case = case
        self.tool, self.source, self.work = arguments.smoothpost, arguments.source, arguments.work
        os.makedirs(self.work, exist_ok=True)
        self.machine = Machine(self.machine_file(case["machine"]))
        for axis in self.machine.axes:
            axis.home = case["set"].get(f"axis.{axis.name}.home", axis.home)
        self.program = os.path.join(self.work, "program.ngc")
        self.trajectory = os.path.join(self.work, "trajectory.csv")
        self.json = os.path.join(self.work, "report.json")
        self.verdicts = Verdicts()
        self.that = self.verdicts.that

    def machine_file(self, name):
        return os.path.join(self.source, "machines", name, "machine.toml")

    def forward(self, joints):
        return self.machine.forward(joints, self.case["tool_length"])

    def compared(self, log, plan):
        return Comparison(log, self.machine, plan, TOLERANCE, self.case["tool_length"])

    def convert(self):
        case = self.case
        if "make_input" in case:
            source = os.path.join(self.work, "part.stl")
            case["make_input"](source)
        else:
            source = os.path.join(self.source, case["input"])
        command = [self.tool, case.get("command", "convert"), source,
                   "-m", self.machine_file(case["machine"]), "-o", self.program, "--json", self.json, "--trajectory", self.trajectory,
                   "--progress", "none", *case["options"]]
        if "input_machine" in case:
            command += ["--input-machine", self.machine_file(case["input_machine"])]
        for key, value in case["set"].items():
            command += ["--set", f"{key}={value}"]
        for path in (self.program, self.trajectory, self.json):
            if os.path.exists(path):
                os.remove(path)
        print("$", " ".join(command), flush=True)
        run = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)
        print(run.stderr, end="")
        if not self.that(run.returncode == 0, f"convert: exit status {run.returncode}"):
            return False
        with open(self.json, encoding="utf-8") as file:
            verdict = json.load(file).get("verdict")
        if not self.that(verdict == "certified", f"verdict {verdict}"):
            return False
        if "seconds" in case:
            self.shorten(case["seconds"])
        return True

    def shorten(self, seconds):
        """Ends the program with the block in which its moves at feed have lasted so long."""
        moves = JointProgram(self.program, self.machine.letters, self.machine.home()).moves
        lasted = np.cumsum([move.duration for move in moves])
        count = int(np.searchsorted(lasted, seconds)) + 1
        self.that(count < len(moves), f"the first {seconds:g} s are {count} of {len(moves)} moves, "
                                      f"which last {lasted[-1]:.0f} s")
        with open(self.program, encoding="ascii") as file:
            lines = file.readlines()[:moves[min(count, len(moves)) - 1].line]
        with open(self.program, "w", encoding="ascii") as file:
            file.writelines(lines + ["M5 M9\n", "M2\n"])

    def interpreter(self):
        checker = interpreter_check.Checker(self.machine, {}, {})
        self.that(checker.check(self.program), "LinuxCNC's interpreter accepts the program")
        for letter in self.machine.letters + "R":
            checker = interpreter_check.Checker(self.machine, {}, {letter: LIVE_OFFSET})
            motions, _, errors = checker.module(self.program)
            told = "; ".join(errors) or "NOT refused"
            self.that(bool(errors) and motions == 0, f"interpreter, G54 {letter}{LIVE_OFFSET}: {told}")

    def run(self, name, **offsets):
        """Exit status and log of one run."""
        config = os.path.join(self.work, f"config_{name}")
        log = os.path.join(self.work, f"log_{name}.txt")
        write_config(self.machine, config, "triv", **offsets)
        return run_program(config, self.program, log, timeout=90.0), log

    def execution(self):
        status, path = self.run("plain")
        if not self.that(status == 0, f"run in the headless LinuxCNC: status {status}"):
            return
        within, result = compare(path, self.machine, self.program, TOLERANCE,
                                 self.case["tool_length"])
        self.that(within, "executed path against the program")
        self.that(result.planned > 0.0, f"the program holds {result.planned:.3f} s of feed motion")
        log = Log(path, self.machine)
        self.control(log)
        self.beam(log)
        if "seconds" in self.case:  # the CSV is that of the whole program
            return
        self.estimate(log)
        trajectory = Trajectory(self.trajectory, self.machine)
        executed = compare_trajectory(log, self.machine, trajectory, TOLERANCE,
                                      self.case["tool_length"])
        self.that(executed, "every row of the trajectory CSV was executed, in order")
        tip, axis = self.forward(trajectory.joints)
        tip_error = float(np.max(np.linalg.norm(tip - trajectory.tip, axis=1)))
        axis_error = float(np.max(axis_angle_deg(axis, trajectory.axis)))
        self.that(tip_error < 1e-4 and axis_error < 1e-4,
                  f"CSV against our forward kinematics: {tip_error:.1e} mm, {axis_error:.1e} deg")

    def estimate(self, log):
        """The report's estimate counts from the first position that the program states whole."""
        first = {}
        with open(self.program, encoding="utf-8") as file:
            for line in file:
                text = re.sub(r"\(.*?\)", "", line)
                if text.startswith("o"):
                    continue
                for letter, value in re.findall(r"([A-Z])(-?[0-9.]+)", text):
                    if letter in self.machine.letters:
                        first[letter] = float(value)
                if len(first) == len(self.machine.letters):
                    break
        wanted = np.array([first[axis.letter] for axis in self.machine.axes])
        # Rapids of linear axes may go on through it: the first sample that no neighbour is nearer.
        away = np.max(np.abs(log.joints - wanted), axis=1)
        there = np.flatnonzero((away < PASSED) & (away <= np.append(away[1:], np.inf)))
        with open(self.json, encoding="utf-8") as file:
            estimate = json.load(file)["time_s"]["executed_estimate"]
        if not self.that(len(there) > 0 and estimate is not None, "a start and an estimate"):
            return
        executed = (log.moving().stop - 1 - there[0]) * 1e-3
        self.that(abs(executed - estimate) <= ESTIMATE * executed,
                  f"executed in {executed:.3f} s, estimated {estimate:.3f} s")

    def control(self, log):
        """The comparison itself is checked: a plan 3 tolerances beside in one axis must be over."""
        for index, axis in enumerate(self.machine.axes):
            plan = Plan.of_program(self.program, self.machine, log.joints[0])
            middle = len(plan.joints) // 2
            tip, tool = self.forward(plan.joints[middle:])
            step, share = 0.01, 3.0
            for _ in range(2):  # the second round with the step that the first one found
                step *= 3.0 / share
                moved = plan.joints[middle:].copy()
                moved[:, index] += step
                tip_moved, tool_moved = self.forward(moved)
                share = max(float(np.max(np.linalg.norm(tip_moved - tip, axis=1))) / TOLERANCE[0],
                            float(np.max(axis_angle_deg(tool_moved, tool))) / TOLERANCE[1])
            plan.joints[middle:] = moved
            result = self.compared(log, plan)
            seen = max(max(side.tip / TOLERANCE[0], side.axis / TOLERANCE[1])
                       for side in (result.executed, result.covered))
            self.that(seen > 1.0, f"control: {axis.name} {step:.4f} {axis.unit} beside is seen as "
                                  f"{seen:.1f} tolerances")

    def beam(self, log):
        moves = JointProgram(self.program, self.machine.letters, log.joints[0]).moves
        planned = np.array([move.beam for move in moves], bool)
        plan = Plan.of_program(self.program, self.machine, log.joints[0])
        on = log.output[0]
        self.that(not on[-1], "output 0 is off at the end")
        tip, _ = self.forward(log.joints)
        travel = np.r_[np.linalg.norm(np.diff(tip, axis=0), axis=1), 0.0]
        in_rapid = float(np.sum(travel[on & (log.motion_type == 1)]))
        self.that(in_rapid <= TOLERANCE[0],
                  f"tip travel with output 0 on in a rapid: {in_rapid:.5f} mm")
        moving = log.moving()
        wrong = int(np.count_nonzero((on != planned[block_of_samples(log, plan)])[moving]))
        switches = int(np.count_nonzero(np.diff(planned)))
        self.that(wrong <= round(1000 * BEAM_SWITCH) * switches,
                  f"output 0 is not as programmed for {wrong} ms at {switches} switches")
        if "beam_on" in self.machine.events:
            self.that(bool(np.any(on)), f"output 0 is on for {np.count_nonzero(on)} ms")

    def native(self):
        """The input program in LinuxCNC's own kinematics against the executed output program."""
        machine = Machine(self.machine_file(self.case["input_machine"]))
        for axis in machine.axes:
            axis.home = self.case["set"].get(f"axis.{axis.name}.home", axis.home)
        config, program, path = (os.path.join(self.work, name)
                                 for name in ("config_native", "native.ngc", "log_native.txt"))
        with open(os.path.join(self.source, self.case["input"]), encoding="ascii") as file:
            text = file.read()
        with open(program, "w", encoding="ascii") as file:
            file.write(text.replace("T1 M6", "G61\nT1 M6"))  # the input as written, not blended
        write_config(machine, config, "trt", tools={1: self.case["tool_length"]})
        status = run_program(config, program, path, timeout=90.0)
        if not self.that(status == 0, f"the input in LinuxCNC's own kinematics: status {status}"):
            return
        weight = TOLERANCE[0] / np.radians(TOLERANCE[1])
        sides = []
        for side, log in ((machine, Log(path, machine)),
                          (self.machine, Log(os.path.join(self.work, "log_plain.txt"), self.machine))):
            feed = side.poses(log.joints[log.motion_type >= 2], self.case["tool_length"], weight)
            moved = np.linalg.norm(np.diff(feed, axis=0), axis=1) > 0.0
            sides.append(feed[np.r_[True, moved]])
        for here, there, name in ((*sides, "input to output"), (*sides[::-1], "output to input")):
            deviation = Deviation(weight)
            some = here[::10]
            _, feet = nearest(some, there[:-1], there[1:])
            deviation.add(some, feet, range(len(some)))
            self.that(deviation.tip <= TOLERANCE[0] and deviation.axis <= TOLERANCE[1],
                      f"executed {name}: tip {deviation.tip:.5f} mm, axis {deviation.axis:.5f} deg")

    def guard(self):
        for letter in (self.machine.letters[0], self.machine.letters[-1]):
            status, path = self.run(f"g54_{letter}", g54={letter: LIVE_OFFSET})
            self.that(status == OPERATOR_ERROR, f"run, G54 {letter}{LIVE_OFFSET}: status {status}")
            log = Log(path, self.machine)
            left = np.abs(log.joints - self.machine.home())
            self.that(left.size > 0 and float(np.max(left)) <= 1e-6,
                      f"run, G54 {letter}{LIVE_OFFSET}: no joint left home in {len(left)} ms")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("case", choices=sorted(CASES))
    parser.add_argument("--smoothpost", required=True)
    parser.add_argument("--source", required=True)
    parser.add_argument("--work", required=True)
    arguments = parser.parse_args()
    reason = reason_to_skip() or interpreter_check.reason_to_skip()
    if reason:
        fail(f"skipped: {reason}", SKIP)
    acceptance = Acceptance(CASES[arguments.case], arguments)
    verdicts = acceptance.verdicts
    if acceptance.convert():
        acceptance.interpreter()
        if not acceptance.case.get("interpreter_only"):
            acceptance.execution()
            acceptance.guard()
        if acceptance.case.get("native"):
            acceptance.native()
    print(f"{arguments.case}: "
          f"{f'{len(verdicts.failed)} checks FAILED' if verdicts.failed else 'accepted'}")
    sys.exit(1 if verdicts.failed else 0)


if __name__ == "__main__":
    main()
