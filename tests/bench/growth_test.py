#!/usr/bin/env python3
"""Work that is promised to grow with the length of a program does: the short form of the benchmarks.

  growth_test.py --tool TOOL --work FOLDER [CASE...]
  growth_test.py --self-test

Each case is run on a short and a long program, and the processor time beyond that of a trivial program is compared: the exponent of
growth, log(time ratio) / log(size ratio), is to stay below 1.15. No absolute time is looked at. Other work on the machine makes times
larger, never smaller, so the least of several runs counts, and a case is repeated until its exponent is good or it has had its runs.
"""

import argparse
import math
import os
import resource
import shutil
import subprocess
import sys
from pathlib import Path

LIMIT = 1.15
RUNS = 4
TRIVIAL = 8


def program(blocks):
    """A five-axis program of so many cutting blocks on the A/C table, slow enough for every axis as it is."""
    lines = ["%", "M428", "G21 G90 G94", "G0 X0 Y0 Z30 A0 C0", "G0 A-20 C0"]
    for i in range(blocks):
        t = 0.01 * i
        lines.append(f"G1 X{30 * math.cos(t):.3f} Y{30 * math.sin(t):.3f} Z{2 * math.sin(3 * t):.3f} "
                     f"A{-20 - 5 * math.sin(2 * t):.3f} C{10 * math.sin(t):.3f} F600")
    return "\n".join(lines + ["G0 Z60", "M429", "M30", "%"]) + "\n"


def csv(blocks):
    """The same tip path as cutter locations."""
    lines = ["x_mm,y_mm,z_mm,i,j,k,feed_mm_per_min"]
    for i in range(blocks):
        t = 0.01 * i
        lean = 0.2 + 0.1 * math.sin(2 * t)
        lines.append(f"{30 * math.cos(t):.4f},{30 * math.sin(t):.4f},{2 * math.sin(3 * t):.4f},{math.sin(lean):.7f},0,"
                     f"{math.cos(lean):.7f},600")
    return "\n".join(lines) + "\n"


TABLE = ["--input-machine", "table_table_ac", "-m", "table_table_bc"]
# Name: (text of so many blocks, its ending, arguments, short, long). Refusals count as well: their work is done.
CASES = {
    "read, kinematics, print, verify": (program, "ngc", [*TABLE, "--smoothing", "none", "--schedule", "constant",
                                                         "--no-collision-check"], 125, 1000),
    "corners and schedule": (program, "ngc", [*TABLE, "--no-collision-check", "--set", "recipe.dense=corners"], 50, 400),
    "robot, corners and schedule": (csv, "csv", ["-m", "robot_6r", "--no-collision-check", "--set",
                                             "recipe.dense=corners"], 50, 400),
}


def processor_time(command):
    """Seconds of user time of a command that ends by itself."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if done.returncode not in (0, 3):
        sys.exit(f"{command}\nstatus {done.returncode}: {done.stderr[-2000:]}")
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def exponent(measure, short, long, runs=RUNS):
    """The least exponent of growth that some runs show; `measure` gives the time for a size."""
    least = {size: math.inf for size in (TRIVIAL, short, long)}
    found = math.inf
    for _ in range(runs):
        for size in least:
            least[size] = min(least[size], measure(size))
        beyond = [max(least[size] - least[TRIVIAL], 1e-9) for size in (short, long)]
        found = math.log(beyond[1] / beyond[0]) / math.log((long - TRIVIAL) / (short - TRIVIAL))
        if found <= LIMIT:
            break
    return found, least


def run_case(name, given):
    text, ending, arguments, short, long = CASES[name]

    def measure(size):
        source = given.work / f"{text.__name__}_{size}.{ending}"
        if not source.exists():
            source.write_text(text(size), encoding="utf-8")
        return processor_time([given.tool, "convert", source, *arguments, "-o", given.work / "out"])
    found, least = exponent(measure, short, long)
    times = ", ".join(f"{size}: {1000 * seconds:.0f} ms" for size, seconds in least.items())
    print(f"{name}: exponent {found:.2f} ({times})", flush=True)
    return found


def self_test():
    assert abs(exponent(lambda n: 0.02 + 1e-4 * n, 100, 800)[0] - 1.0) < 1e-9
    assert exponent(lambda n: 0.02 + 1e-4 * n * math.log2(n), 100, 800)[0] > LIMIT
    assert exponent(lambda n: 0.02 + 1e-7 * n * n, 100, 800)[0] > 1.9
    noise = iter([0.0, 0.0, 0.3] + [0.0] * 30)  # the first long run is disturbed
    assert exponent(lambda n: 1e-4 * n + next(noise), 100, 800)[0] <= 1.01
    print("self test passed")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--self-test", action="store_true")
    parser.add_argument("--tool", type=Path)
    parser.add_argument("--work", type=Path)
    parser.add_argument("case", nargs="*")
    given = parser.parse_args()
    if given.self_test:
        self_test()
        return 0
    shutil.rmtree(given.work, ignore_errors=True)
    given.work.mkdir(parents=True)
    os.environ.setdefault("LC_ALL", "C")
    worse = [name for name in given.case or CASES if run_case(name, given) > LIMIT]
    for name in worse:
        print(f"grows faster than the program: {name} (limit {LIMIT})")
    return 1 if worse else 0


if __name__ == "__main__":
    sys.exit(main())
