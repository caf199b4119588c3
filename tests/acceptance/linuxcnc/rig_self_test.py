#!/usr/bin/python3
"""Tests the rig itself with small programs of its own; needs no build.

    rig_self_test.py MACHINE.toml

The interpreter check has to accept what is right (tool change, tool length, guard) and to refuse
what is wrong; a hand-written joint program has to run and to be within tolerance of itself, and
its blended version (G64) over it at a corner; a move over a soft limit has to end the run; the
forward kinematics is compared with closed forms. Exit status: 0 as expected, 1 not, 77 LinuxCNC
cannot run here.
"""
import contextlib
import io
import os
import sys
import tempfile

import numpy as np

from compare_path import compare
from interpreter_check import Checker
from interpreter_check import reason_to_skip as no_interpreter
from joint_program import JointProgram
from machine_model import Machine, axis_angle_deg, fail
from make_config import write_config
from measure_path_modes import corner_motion, write_program
from run_program import SKIP, reason_to_skip, run_program

HEAD = "%\nG21 G17 G90 G94 G40 G49 G80 G92.1 G54\nG61\n"
ACCEPTED = {
    "tool change and length": HEAD + "T1 M6\nG43 H1\nG0 X1\nG1 Z2 F100\nM2\n%\n",
    "a guard that does not act": HEAD + "o101 if [ABS[#5221] GT 0.0000001]\n(ABORT, offset)\n"
                                        "o101 endif\nG0 X1\nM2\n%\n",
    "text after the end": HEAD + "G0 X1\nM2\nG0 Q9\n%\n",
    "all nine letters": HEAD + "G93\nG1 X1 Y1 Z1 A1 B1 C1 U1 V1 W1 F60\nG94\nM2\n%\n",
}
REFUSED = {
    "a word without a number": HEAD + "G0 X1\nG1 X5 F\nM2\n%\n",
    "no program end": HEAD[2:] + "G0 X1\n",
    "no feed": HEAD + "G1 X1\nM2\n%\n",
    "no feed, letters beyond rs274": HEAD + "G1 X1 U1\nM2\n%\n",
    "G93 without F": HEAD + "G93\nG1 X1\nM2\n%\n",
    "an unknown tool": HEAD + "T400 M6\nG0 X1\nM2\n%\n",
    "abort": HEAD + "(ABORT, no)\nG0 X1\nM2\n%\n",
    "the end before the last motion": HEAD + "o101 if [1 EQ 2]\nG0 X1\no101 endif\nM2\n%\n",
    "an exponent": HEAD + "G0 X1e-3\nM2\n%\n",
}


class SelfTest:
    """Counts what is not as expected."""

    def __init__(self, machine, directory):
        self.machine, self.directory, self.failures = machine, directory, 0

    def expect(self, holds, text):
        print(f"{'ok    ' if holds else 'FAILED'} {text}", flush=True)
        self.failures += not holds

    def path(self, name):
        return os.path.join(self.directory, name)

    def interpreter(self):
        checker = Checker(None, {1: 40.0}, {})
        for programs, accepted in ((ACCEPTED, True), (REFUSED, False)):
            for name, text in programs.items():
                with open(self.path("check.ngc"), "w", encoding="ascii") as file:
                    file.write(text)
                output = io.StringIO()
                with contextlib.redirect_stdout(output):
                    result = checker.check(self.path("check.ngc"))
                reasons = " ".join(line.strip() for line in output.getvalue().splitlines()[1:])
                self.expect(result == accepted,
                            f"{'accepts' if accepted else 'refuses'} {name} {reasons[:120]}")

    def kinematics(self):
        """A head C B W and a table A C, against their closed forms."""
        random = np.random.default_rng(2)
        for letters in ("AC", "BC"):
            machine = table_machine(letters)
            joints = random.uniform(-90.0, 90.0, (200, 5))
            tip, axis = machine.forward(joints, 30.0)
            angle_t, angle_c = np.radians(joints[:, 3]), np.radians(joints[:, 4])
            x, y, z = joints[:, 0], joints[:, 1], joints[:, 2] - 30.0
            ct, st, cc, sc = np.cos(angle_t), np.sin(angle_t), np.cos(angle_c), np.sin(angle_c)
            if letters == "AC":
                x1, y1, z1 = x, ct * y + st * z, -st * y + ct * z
                a1 = np.stack([0.0 * st, st, ct], 1)
            else:
                x1, y1, z1 = ct * x - st * z, y, st * x + ct * z
                a1 = np.stack([-st, 0.0 * st, ct], 1)
            expected = np.stack([cc * x1 + sc * y1, -sc * x1 + cc * y1, z1], 1)
            expected_axis = np.stack([cc * a1[:, 0] + sc * a1[:, 1],
                                      -sc * a1[:, 0] + cc * a1[:, 1], a1[:, 2]], 1)
            error = max(float(np.max(np.abs(tip - expected))),
                        float(np.max(axis_angle_deg(axis, expected_axis))))
            self.expect(error < 1e-9, f"forward kinematics of a table {letters}: {error:.1e}")

    def run(self, name, text=None, **offsets):
        """(status, log) of a run of the program `name`."""
        if text is not None:
            with open(self.path(name), "w", encoding="ascii") as file:
                file.write(text)
        write_config(self.machine, self.path("config"), **offsets)
        log = self.path("log.txt")
        return run_program(self.path("config"), self.path(name), log, 30.0), log

    def corner(self, mode):
        """(within tolerance, comparison) of a rotary corner at 20 ms a block."""
        write_program(self.path("corner.ngc"), self.machine, corner_motion(self.machine, 0.020),
                      0.020, mode)
        status, log = self.run("corner.ngc")
        self.expect(status == 0, f"{mode}: the corner program runs: status {status}")
        return compare(log, self.machine, self.path("corner.ngc"))

    def execution(self):
        within, _ = self.corner("G61")
        self.expect(within, "exact path (G61) stays within 0.01 mm and 0.05 deg at a rotary corner")
        within, _ = self.corner("G64 P0.01 Q0")
        self.expect(not within, "blending (G64 P0.01) does not, and the comparison sees it")
        axis = self.machine.axes[0]
        status, _ = self.run("over.ngc", HEAD + f"G0 {axis.letter}{axis.maximum + 1.0}\nM2\n%\n")
        self.expect(status == 15, f"a move over the soft limit ends the run: status {status}")

    def reader(self):
        start = np.zeros(len(self.machine.axes))
        program = HEAD + ("G53 G0 Z5\nG93\nM62 P0\nN12 G1 X1.5 F60\nG1 X2 F120\nG94\nM63 P0\n"
                          "G0 X0\nM2\n%\n")
        with open(self.path("read.ngc"), "w", encoding="ascii") as file:
            file.write(program)
        moves = JointProgram(self.path("read.ngc"), self.machine.letters, start).moves
        x = self.machine.letters.index("X")
        told = [(m.line, m.joints[x], m.rapid, m.duration, m.beam) for m in moves]
        expected = [(4, 0.0, True, 0.0, False), (7, 1.5, False, 1.0, True),
                    (8, 2.0, False, 0.5, True), (11, 0.0, True, 0.0, False)]
        self.expect(told == expected, f"reader of joint programs: {told}")


def table_machine(letters):
    """A trunnion machine with its axes through the origin, from a machine file written here."""
    rows = [("X", "linear", "tool", "[1, 0, 0]"), ("Y", "linear", "tool", "[0, 1, 0]"),
            ("Z", "linear", "tool", "[0, 0, 1]"),
            (letters[0], "rotary", "workpiece", "[1, 0, 0]" if letters[0] == "A" else "[0, 1, 0]"),
            (letters[1], "rotary", "workpiece", "[0, 0, 1]")]
    text = 'name = "table"\n'
    for name, kind, chain, direction in rows:
        unit = "deg" if kind == "rotary" else "mm"
        text += (f'[[axis]]\nname = "{name}"\nletter = "{name}"\ntype = "{kind}"\n'
                 f'chain = "{chain}"\ndirection = {direction}\nmin_{unit} = -100\nmax_{unit} = 100\n'
                 f"max_velocity_{unit}_per_s = 1\nmax_acceleration_{unit}_per_s2 = 1\n")
    with tempfile.NamedTemporaryFile("w", suffix=".toml", encoding="ascii") as file:
        file.write(text)
        file.flush()
        return Machine(file.name)


def main():
    if len(sys.argv) != 2:
        fail(__doc__)
    reason = reason_to_skip() or no_interpreter()
    if reason:
        fail(f"skipped: {reason}", SKIP)
    with tempfile.TemporaryDirectory() as directory:
        test = SelfTest(Machine(sys.argv[1]), directory)
        test.reader()
        test.kinematics()
        test.interpreter()
        test.execution()
    print(f"rig self-test: {test.failures} failures")
    sys.exit(1 if test.failures else 0)


if __name__ == "__main__":
    main()
