#!/usr/bin/python3
"""Measures what LinuxCNC makes of emitted programs: time, acceleration and jerk, for several block times.

    measure_block_times.py --smoothpost TOOL --machine MACHINE.toml [--blocks 4,10,20,50,100,default] [--raw FILE] -- CONVERT_ARGUMENTS...

Every block time is a conversion of its own (`dialect.block_ms`; `default`: what the tool chooses) whose program runs in the headless
LinuxCNC; `--raw` runs a joint-level program as it is, before. Printed (markdown): the executed time over
the planned one and the peaks of the logged joints, by differences at 1 ms, over the limits of the
machine file. The last line is the schedule itself, by the same differences of the `--trajectory` file: what
the joint stream executes (stream_check.py). The numbers in docs/controllers/linuxcnc.md come from here.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile

import numpy as np

from compare_path import Log
from machine_model import Machine, fail
from make_config import write_config
from run_program import SKIP, reason_to_skip, run_program
from stream_check import limits_of, read_trajectory

try:
    import tomllib
except ModuleNotFoundError:
    import tomli as tomllib

CYCLE = 1e-3  # s


def limits(machine_file, names):
    """Velocity, acceleration and jerk limits of the axes, in rows."""
    with open(machine_file, "rb") as file:
        axes = {axis["name"]: axis for axis in tomllib.load(file)["axis"]}
    rows = []
    for order in ("velocity", "acceleration", "jerk"):
        power = {"velocity": "s", "acceleration": "s2", "jerk": "s3"}[order]
        row = []
        for name in names:
            keys = [key for key in axes[name] if key.startswith(f"max_{order}_") and key.endswith(f"_per_{power}")]
            if len(keys) != 1:
                fail(f"measure_block_times.py: axis {name} of {machine_file}: no single max_{order}", 1)
            row.append(axes[name][keys[0]])
        rows.append(row)
    return np.array(rows, float)


def peaks(joints, bounds):
    """Largest share of velocity, acceleration and jerk over the joints."""
    return [float(np.max(np.abs(np.diff(joints, n=order, axis=0)).max(axis=0) / CYCLE ** order / bounds[order - 1]))
            for order in (1, 2, 3)]


def row(name, blocks, planned, executed, shares):
    ratio = f"{executed / planned:.2f}" if planned else ""
    print(f"| {name} | {blocks} | {executed:.2f} | {ratio} | " + " | ".join(f"{share:.2f}" for share in shares) + " |",
          flush=True)


def execute(machine, program, work, name):
    """Joints in every millisecond of motion."""
    config, log = os.path.join(work, f"config_{name}"), os.path.join(work, f"log_{name}.txt")
    write_config(machine, config, "triv")
    status = run_program(config, program, log, timeout=300.0)
    if status != 0:
        fail(f"measure_block_times.py: {name}: the program ended with status {status}", 1)
    samples = Log(log, machine)
    return samples.joints[samples.moving()]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--machine", required=True)
    parser.add_argument("--smoothpost", required=True)
    parser.add_argument("--blocks", default="4,10,20,50,100,default", help="block times, ms")
    parser.add_argument("--raw", help="a joint-level program of the same machine")
    parser.add_argument("arguments", nargs=argparse.REMAINDER)
    options = parser.parse_args()
    reason = reason_to_skip()
    if reason:
        fail(f"skipped: {reason}", SKIP)
    machine = Machine(options.machine)
    bounds = limits(options.machine, [axis.name for axis in machine.axes])
    print(f"| {machine.name} | blocks | executed (s) | executed / planned | velocity | acceleration | jerk |\n"
          "|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as work:
        os.chmod(work, 0o755)
        if options.raw:
            joints = execute(machine, options.raw, work, "raw")
            row("input as it is", "", 0.0, len(joints) * CYCLE, peaks(joints, bounds))
        program, report = os.path.join(work, "program.ngc"), os.path.join(work, "report.json")
        trajectory = os.path.join(work, "trajectory.csv")
        for block in options.blocks.split(","):
            made = subprocess.run(
                [options.smoothpost, "convert", *[a for a in options.arguments if a != "--"], "-m", options.machine,
                 "-o", program, "--json", report, "--trajectory", trajectory, "--progress", "none",
                 *([] if block == "default" else ["--set", f"dialect.block_ms={block}"]), "--set", "cycle.time_ms=1"],
                capture_output=True, text=True, check=False)
            if made.returncode != 0:
                print(f"| {block} ms | not certified: exit {made.returncode} | | | | | |")
                continue
            with open(report, encoding="utf-8") as file:
                told = json.load(file)
            joints = execute(machine, program, work, block)
            _, rows, _ = read_trajectory(trajectory)
            moving = np.flatnonzero(np.abs(np.diff(rows, axis=0)).max(axis=1) > 0)
            planned = (moving[-1] - moving[0] + 1) * CYCLE
            row(block if block == "default" else f"{block} ms", told["output"]["blocks"], planned, len(joints) * CYCLE, peaks(joints, bounds))
        names, rows, _ = read_trajectory(trajectory)
        moving = np.flatnonzero(np.abs(np.diff(rows, axis=0)).max(axis=1) > 0)
        planned = (moving[-1] - moving[0] + 1) * CYCLE
        assert np.allclose(limits_of(options.machine, names), bounds[2])
        row("joint stream", "", planned, planned, peaks(rows, bounds))


if __name__ == "__main__":
    main()
    sys.exit(0)
