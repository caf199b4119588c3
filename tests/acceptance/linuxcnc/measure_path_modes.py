#!/usr/bin/python3
"""Measures how closely LinuxCNC follows joint-level programs: path modes and block times.

    measure_path_modes.py MACHINE.toml [--blocks 4,10,20,50]

Two motions of all axes of the machine are written as equal-time G93 blocks and run in the
headless LinuxCNC: `smooth`, rest to rest with curved joint paths at up to 40 % of every velocity
and acceleration limit, and `corner`, one linear axis at constant speed while a rotary axis goes
up and down again at 40 % of its velocity, its velocity reversed within no time. Prints a table
(markdown): deviation of the executed path from the programmed polyline, and executed over planned
time. The numbers in docs/controllers/linuxcnc.md come from here.
"""
import argparse
import os
import sys
import tempfile

import numpy as np

from compare_path import Comparison, Log, Plan
from machine_model import Machine, fail
from make_config import write_config
from run_program import SKIP, reason_to_skip, run_program

SHARE = 0.4      # of the limits
DURATION = 2.0   # s, smooth motion
LEG = 0.5        # s, each leg of the corner
MODES = ("G61", "G64 P0.01 Q0")


def start_point(machine):
    """From home some way towards the middle of every range."""
    start = []
    for axis in machine.axes:
        home, middle = axis.home_position(), 0.5 * (axis.minimum + axis.maximum)
        away = min(0.25 * (axis.maximum - axis.minimum), 20.0 if axis.rotary else 200.0)
        start.append(home + (away if middle >= home else -away))
    return np.array(start)


def smooth_motion(machine, step):
    """Joint vectors every `step` s: q_j = q0_j + D_j sin(pi f_j s), s a quintic from 0 to 1."""
    count = round(DURATION / step)
    u = np.arange(count + 1) / count
    s = u ** 3 * (10.0 - 15.0 * u + 6.0 * u ** 2)
    fine = np.linspace(0.0, 1.0, 2001)
    s_fine = fine ** 3 * (10.0 - 15.0 * fine + 6.0 * fine ** 2)
    columns, start = [], start_point(machine)
    for index, axis in enumerate(machine.axes):
        frequency = 0.5 + 0.17 * index
        shape = np.sin(np.pi * frequency * s_fine)
        velocity = np.max(np.abs(np.gradient(shape, DURATION / 2000)))
        acceleration = np.max(np.abs(np.gradient(np.gradient(shape, DURATION / 2000), DURATION / 2000)))
        room = min(start[index] - axis.minimum, axis.maximum - start[index])
        amplitude = min(SHARE * axis.velocity / velocity, SHARE * axis.acceleration / acceleration,
                        0.8 * room)
        columns.append(start[index] + amplitude * np.sin(np.pi * frequency * s))
    return np.stack(columns, 1)


def corner_motion(machine, step):
    """The first linear axis at constant speed, the first rotary axis up and down."""
    count = round(LEG / step)
    linear = next(i for i, axis in enumerate(machine.axes) if not axis.rotary)
    rotary = next(i for i, axis in enumerate(machine.axes) if axis.rotary)
    time = np.arange(2 * count + 1) * step
    joints = np.tile(start_point(machine), (len(time), 1))
    speed = min(SHARE * machine.axes[linear].velocity, 60.0)
    joints[:, linear] -= speed * time
    joints[:, rotary] += SHARE * machine.axes[rotary].velocity * (LEG - np.abs(time - LEG))
    return joints


def write_program(path, machine, joints, step, mode):
    """Rapid to the first vector, then one G93 block per vector."""
    word = lambda axis, value: f"{axis.letter}{value:.{6 if axis.rotary else 5}f}"
    block = lambda vector: " ".join(word(axis, value) for axis, value in zip(machine.axes, vector))
    lines = ["%", "G21 G17 G90 G94 G40 G49 G80 G92.1 G54", mode, "G0 " + block(joints[0]), "G93"]
    lines += [f"G1 {block(vector)} F{60.0 / step:.3f}" for vector in joints[1:]]
    lines += ["G94", "M2", "%"]
    with open(path, "w", encoding="ascii") as file:
        file.write("\n".join(lines) + "\n")


def measure(machine, directory, joints, step, mode):
    """Comparison of one run."""
    config, program, log = (os.path.join(directory, name) for name in ("config", "p.ngc", "log.txt"))
    write_config(machine, config)
    write_program(program, machine, joints, step, mode)
    status = run_program(config, program, log)
    if status != 0:
        fail(f"measure_path_modes.py: the program ended with status {status}", 1)
    samples = Log(log, machine)
    plan = Plan.of_program(program, machine, samples.joints[0])
    return Comparison(samples, machine, plan, (0.01, 0.05), 0.0)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("machine")
    parser.add_argument("--blocks", default="4,10,20,50", help="block times, ms")
    arguments = parser.parse_args()
    reason = reason_to_skip()
    if reason:
        fail(f"skipped: {reason}", SKIP)
    machine = Machine(arguments.machine)
    print(f"| {machine.name} | block (ms) | mode | tip (mm) | axis (deg) | executed / planned time |\n"
          "|---|---|---|---|---|---|")
    for name, motion in (("smooth", smooth_motion), ("corner", corner_motion)):
        for block in (float(item) for item in arguments.blocks.split(",")):
            for mode in MODES:
                with tempfile.TemporaryDirectory() as directory:
                    step = 0.001 * block
                    result = measure(machine, directory, motion(machine, step), step, mode)
                tip = max(result.executed.tip, result.covered.tip)
                axis = max(result.executed.axis, result.covered.axis)
                print(f"| {name} | {block:g} | {mode} | {tip:.4f} | {axis:.4f} | "
                      f"{result.executed_time / result.planned:.2f} |", flush=True)


if __name__ == "__main__":
    main()
    sys.exit(0)
