#!/usr/bin/env python3
"""The table of README.md from the trajectories of one tool: table.py FOLDER

FOLDER holds <job>.csv for the jobs of jobs.toml, as `smoothpost batch examples/benchmark/jobs.toml` leaves them in
build/benchmark; another tool's files under the same names do as well, and a job without a file is left out.
"""

import json
import subprocess
import sys
import tomllib
from pathlib import Path

HERE = Path(__file__).resolve().parent


def worst(joints, key):
    row = max(joints, key=lambda joint: joint[key])
    return f"{row[key]:.2f} {row['axis']}"


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = Path(sys.argv[1])
    jobs = tomllib.loads((HERE / "jobs.toml").read_text(encoding="utf-8"))["job"]
    print("| Job | Time, s | From first to last point, s | Tip, mm | Axis, deg | Velocity | Acceleration | Jerk |")
    print("|---|---|---|---|---|---|---|---|")
    for job in jobs:
        trajectory = folder / f"{job['name']}.csv"
        if not trajectory.exists():
            continue
        command = [sys.executable, HERE / "measure.py", HERE.parents[1] / "machines" / job["machine"] / "machine.toml",
                   trajectory, "--json"]
        if job["input"].endswith(".csv"):
            offset = job.get("work-offset", "G54=0,0,0").split("=")[1]
            command += ["--input", HERE / job["input"], f"--offset={offset}"] + (["--free-axis"] if "lead" in job else [])
        found = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        path = [f"{found['cut_time_s']:.2f}", f"{found['tip_mm']:.4f}", f"{found['axis_deg']:.4f}"] if "tip_mm" in found \
            else ["", "", ""]
        shares = [worst(found["joints"], name + "_share") for name in ("velocity", "acceleration", "jerk")]
        print("| " + " | ".join([job["name"], f"{found['time_s']:.2f}", *path, *shares]) + " |", flush=True)


if __name__ == "__main__":
    main()
