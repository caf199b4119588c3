#!/usr/bin/env python3
"""examples/benchmark/measure.py finds what was put into a motion: measure_test.py SOURCE

A motion of table_table_bc whose X is a sine has known peaks; a case beside it is as far away as it was put.
"""

import csv
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

STEP = 0.002
AMPLITUDE, RATE = 5.0, 2.0  # mm, rad/s


def expect(holds, what):
    if not holds:
        sys.exit(f"not so: {what}")


def measure(source, trajectory, *more):
    command = [sys.executable, "-B", source / "examples/benchmark/measure.py", source / "machines/table_table_bc/machine.toml",
               trajectory, "--json", *map(str, more)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def near(value, wanted, share=0.01):
    return abs(value - wanted) <= share * abs(wanted)


def main():
    source = Path(sys.argv[1])
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        count = int(math.pi / RATE / STEP)
        with open(folder / "motion.csv", "w", newline="", encoding="utf-8") as file:
            rows = csv.writer(file)
            rows.writerow(["t_s", "C_deg", "X_mm", "Y_mm", "Z_mm", "B_deg"])  # in any order
            for k in range(count + 1):
                t = k * STEP
                rows.writerow([f"{t:.6f}", 0, repr(AMPLITUDE * (1 - math.cos(RATE * t))), 0, 0, 0])

        def case(points):
            text = "x_mm,y_mm,z_mm,i,j,k\n" + "".join(",".join(map(repr, point)) + "\n" for point in points)
            (folder / "case.csv").write_text(text, encoding="utf-8")
            return "--input", folder / "case.csv"
        end = AMPLITUDE * (1 - math.cos(RATE * count * STEP))

        found = measure(source, folder / "motion.csv")
        joint = next(row for row in found["joints"] if row["axis"] == "X")
        expect(near(found["time_s"], count * STEP, 1e-9), f"time {found['time_s']}")
        for order, name, limit in ((1, "velocity", 20), (2, "acceleration", 300), (3, "jerk", 3000)):
            peak = AMPLITUDE * RATE ** order
            expect(near(joint[name], peak) and near(joint[name + "_share"], peak / limit), f"{name}: {joint[name]}, not {peak}")
        expect(near(joint["rms_jerk"], AMPLITUDE * RATE ** 3 / math.sqrt(2), 0.02), f"rms jerk {joint['rms_jerk']}")
        expect(all(row["velocity"] == 0 for row in found["joints"] if row["axis"] != "X"), "the others stand")

        # The tool's zero of this machine is its tip at the joints' zero.
        straight = [(0.0, 0.0, 0.0, 0.0, 0.0, 1.0), (end, 0.0, 0.0, 0.0, 0.0, 1.0)]
        found = measure(source, folder / "motion.csv", *case(straight))
        expect(found["tip_mm"] < 1e-6 and found["axis_deg"] < 1e-4, f"on its path: {found}")
        corner = [straight[0], (end / 2, 0.03, 0.0, 0.0, 0.0, 1.0), straight[1]]
        found = measure(source, folder / "motion.csv", *case(corner))
        expect(near(found["tip_mm"], 0.03, 0.02), f"a case that leaves it by 0.03 mm: {found}")
        tilted = [straight[0], (end / 2, 0.0, 0.0, 0.0, math.sin(math.radians(2)), math.cos(math.radians(2))), straight[1]]
        found = measure(source, folder / "motion.csv", *case(tilted))
        expect(near(found["axis_deg"], 2.0, 0.1) and found["tip_mm"] < 0.5, f"a case tilted by 2 deg: {found}")
        found = measure(source, folder / "motion.csv", *case([(x + 7.0, y, z, *axis) for x, y, z, *axis in straight]), "--offset=-7,0,0")
        expect(found["tip_mm"] < 1e-6, f"a case that stands elsewhere: {found}")
    print("peaks, times and distances are found as they were put in")


if __name__ == "__main__":
    main()
