#!/usr/bin/env python3
"""A third-party five-axis path below the horizon becomes certified programs for two tables and the robot.

  pmill.py --smoothpost TOOL --shared FOLDER [--points N] [--work FOLDER]

The corpus's pmill_test1_4.as: 3,716 tool axes of an NCL export, 2,244 of them below the horizon. The part is turned by
--work-offset so that every axis is at most 87.85 degrees from the vertical, and stands high enough for the nose; for the robot it
keeps its own axes and stands where `smoothpost place` has found room for it. N: only the first so many places (default: all). Status 77: no corpus.
"""

import argparse
import gzip
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

FILE = "corpus/2_apt_cl/sashainna/src/Debug/pmill_test1_4.as.gz"
TURN = "-87.810872771,-10.508722643,0"  # the axis of the smallest cone about all tool axes becomes the vertical
CASES = {
    "table_table_ac": ["--tool", "1=150", "--work-offset", f"G54=0,0,150,{TURN}"],
    "table_table_bc": ["--tool", "1=150", "--work-offset", f"G54=0,0,150,{TURN}"],
    "robot_6r": ["--tool", "1=60", "--work-offset", "G54=-3223.9,-964.4,226.4,0,0,134.9"],  # found by `smoothpost place`
}


def shortened(text, points):
    """The text with the first places only."""
    kept = 0
    for line in text.splitlines(keepends=True):
        if line.startswith("GOTO"):
            kept += 1
            if kept > points:
                continue
        yield line


def axes(text):
    for line in text.splitlines():
        if line.startswith("GOTO"):
            yield [float(word) for word in line.split("/")[1].split(",")][3:6]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--smoothpost", required=True)
    parser.add_argument("--shared", required=True, type=Path)
    parser.add_argument("--points", type=int)
    parser.add_argument("--machines", nargs="+", default=list(CASES))
    options = parser.parse_args()
    path = options.shared / FILE
    if not path.exists():
        print("no corpus beside the checkout")
        sys.exit(77)
    text = gzip.decompress(path.read_bytes()).decode("latin-1")
    every = list(axes(text))
    assert len(every) == 3716 and sum(k < 0 for _, _, k in every) == 2244
    if options.points:
        text = "".join(shortened(text, options.points))
    with tempfile.TemporaryDirectory() as work:
        program = Path(work) / "pmill.as"
        program.write_text(text, encoding="latin-1")
        for machine in options.machines:
            report = Path(work) / "report.json"
            run = subprocess.run(
                [options.smoothpost, "convert", program, "--input-format", "cl", "--input-unit", "mm", "--input-feed",
                 "300", "--set", "process.unmapped=comment", "-m", machine, *CASES[machine], "-o",
                 Path(work) / "out.program", "--json", report], capture_output=True, text=True)
            if run.returncode != 0:
                sys.exit(f"{machine}: exit status {run.returncode}\n{run.stderr[-3000:]}")
            told = json.loads(report.read_text())
            tip = next(c for c in told["checks"] if c["name"] == "tip_deviation")
            print(f"{machine}: {told['verdict']}, {told['output']['blocks']} blocks, tip {tip['value']:.4f} of {tip['limit']} mm",
                  flush=True)
            assert told["verdict"] == "certified" and tip["value"] <= tip["limit"]
            assert told["output"]["blocks"] > 0.9 * (options.points or len(every)) and math.isfinite(tip["value"])


if __name__ == "__main__":
    main()
