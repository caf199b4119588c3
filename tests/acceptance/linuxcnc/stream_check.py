#!/usr/bin/python3
"""Plays a --trajectory file through LinuxCNC's HAL and measures what comes out of its pins.

    stream_check.py --smoothpost TOOL --limits MACHINE.toml [--optional] -- INPUT CONVERT_ARGUMENTS...

The file is fed to HAL's `streamer` by `halstreamer` in a 1 kHz thread, and `sampler` logs the same pins
in every cycle, as on a machine whose joints the streamer moves. Held against the plan: the time
from the first to the last row, every value, and the jerk of the logged joints by third differences.

The values are sent times 10,000, because the sampler prints six decimals: half of its last digit would
be a jerk of 8 * 5e-7 / 1e-9 = 4000 mm/s3.

Exit status: 0 all hold, 1 not, 77 LinuxCNC's HAL is needed and cannot run here.
"""
import argparse
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time

try:
    import tomllib
except ModuleNotFoundError:
    import tomli as tomllib
import numpy as np

SKIP = 77
NOBODY = "65534"        # rtapi_app drops to this user when it is started by root
SCALE = 1e4
CYCLE = 1e-3            # s
MOST_TIME = 1.05        # executed / planned
MOST_JERK = 1.2         # executed / limit of the machine file
SAME = 1e-9             # mm or deg, between a row and the pins


def read_trajectory(path):
    with open(path, encoding="ascii") as file:
        header = file.readline().strip().split(",")
        table = np.loadtxt(file, delimiter=",", ndmin=2)
    joints = header[1:header.index("x_mm")]
    return joints, table[:, 1:1 + len(joints)], table[:, 0]


def limits_of(machine, joints):
    with open(machine, "rb") as file:
        axes = {axis["name"]: axis for axis in tomllib.load(file)["axis"]}
    limits = []
    for column in joints:
        name, unit = column.rsplit("_", 1)
        limits.append(axes[name][f"max_jerk_{unit}_per_s3"])
    return np.array(limits, float)


def hal_text(count):
    kinds = "f" * count
    lines = ["loadrt threads name1=servo period1=1000000",
             f"loadrt streamer depth=16000 cfg={kinds}",
             f"loadrt sampler depth=16000 cfg={kinds}",
             "addf streamer.0 servo", "addf sampler.0 servo"]
    for i in range(count):
        lines.append(f"net joint-{i} streamer.0.pin.{i} => sampler.0.pin.{i}")
    lines += ["setp sampler.0.enable 1", "setp streamer.0.enable 1"]
    return "\n".join(lines) + "\n"


def play(rows, work):
    """What the pins show, one row a cycle, while the rows are played."""
    environment = dict(os.environ, HOME=work, RTAPI_FIFO_PATH=os.path.join(work, "rtapi_fifo"))
    if os.geteuid() == 0:
        environment["RTAPI_UID"] = NOBODY
    os.chmod(work, 0o1777)
    with open(os.path.join(work, "stream.hal"), "w", encoding="ascii") as file:
        file.write(hal_text(rows.shape[1]))
    with open(os.path.join(work, "rows.txt"), "w", encoding="ascii") as file:
        for row in rows:
            file.write(" ".join(f"{SCALE * value:.9f}" for value in row) + "\n")
    subprocess.run(["halrun", "-U"], env=environment, stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL, check=False)
    # Its daemon keeps the output open: a file, not a pipe.
    with open(os.path.join(work, "hal.txt"), "w", encoding="ascii") as told:
        started = subprocess.run(["halcmd", "-f", "stream.hal"], cwd=work, env=environment,
                                 stdin=subprocess.DEVNULL, stdout=told, stderr=told, check=False)
    try:
        if started.returncode != 0:
            with open(os.path.join(work, "hal.txt"), encoding="ascii") as told:
                print("HAL does not start here:", told.read()[:500])
            sys.exit(SKIP)
        log = open(os.path.join(work, "log.txt"), "w", encoding="ascii")
        sampler = subprocess.Popen(["halsampler", "-t"], stdout=log, env=environment)
        with open(os.path.join(work, "rows.txt"), encoding="ascii") as file:
            streamer = subprocess.Popen(["halstreamer"], stdin=file, env=environment)
        time.sleep(1.0)
        subprocess.run(["halcmd", "start"], check=True, env=environment)
        streamer.wait(timeout=len(rows) * CYCLE * 3.0 + 30.0)
        time.sleep(16000 * CYCLE * 1.1 if len(rows) > 16000 else len(rows) * CYCLE * 1.2 + 1.0)
        sampler.send_signal(signal.SIGTERM)
        sampler.wait(timeout=10)
        log.close()
    finally:
        subprocess.run(["halrun", "-U"], env=environment, stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL, check=False)
    with open(os.path.join(work, "log.txt"), encoding="ascii") as file:
        lines = [line.split() for line in file if "overrun" not in line]
    lost = [line for line in lines if len(line) != rows.shape[1] + 1]
    if lost:
        print("the log has", len(lost), "broken lines; the first:", lost[0])
        sys.exit(1)
    return np.array(lines, float)[:, 1:] / SCALE


def peak_jerk(joints):
    return np.abs(np.diff(joints, n=3, axis=0)).max(axis=0) / CYCLE ** 3


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--smoothpost", required=True)
    parser.add_argument("--limits", required=True)
    parser.add_argument("--optional", action="store_true", help="skip where the input is not there")
    parser.add_argument("arguments", nargs=argparse.REMAINDER)
    options = parser.parse_args()
    arguments = [a for a in options.arguments if a != "--"]
    if options.optional and not os.path.exists(arguments[0]):
        print(f"skipped: {arguments[0]} is not here")
        sys.exit(SKIP)
    if not all(shutil.which(tool) for tool in ("halrun", "halstreamer", "halsampler")):
        print("LinuxCNC's HAL is not installed")
        sys.exit(SKIP)
    with tempfile.TemporaryDirectory() as work:
        csv = os.path.join(work, "joints.csv")
        made = subprocess.run([options.smoothpost, "convert", *arguments, "-o",
                               os.path.join(work, "program.out"), "--trajectory", csv,
                               "--set", "cycle.time_ms=1"], check=False)
        if made.returncode != 0:
            print("the program was not certified: exit", made.returncode)
            sys.exit(1)
        names, rows, _ = read_trajectory(csv)
        limits = limits_of(options.limits, names)
        executed = play(rows, work)
    moving = np.flatnonzero(np.abs(executed - rows[0]).max(axis=1) > SAME)
    begun = np.flatnonzero(np.abs(executed - rows[0]).max(axis=1) <= SAME)
    ended = np.flatnonzero(np.abs(executed - rows[-1]).max(axis=1) <= SAME)
    if not (len(begun) and len(ended) and len(moving)):
        print("the pins never showed the first and the last row")
        sys.exit(1)
    first = begun[0]
    last = ended[ended > moving[-1] - 1][0] if (ended > moving[-1] - 1).any() else ended[-1]
    # Rows at standstill before the first motion and behind the last do not count on either side.
    planned_moving = np.flatnonzero(np.abs(np.diff(rows, axis=0)).max(axis=1) > 0)
    executed_moving = np.flatnonzero(np.abs(np.diff(executed[first:last + 1], axis=0)).max(axis=1) > 0)
    planned_time = (planned_moving[-1] - planned_moving[0] + 1) * CYCLE
    executed_time = (executed_moving[-1] - executed_moving[0] + 1) * CYCLE
    planned_jerk = peak_jerk(rows) / limits
    jerk = peak_jerk(executed[first:last + 1]) / limits
    print(f"{len(rows)} rows, planned {planned_time:.3f} s, executed {executed_time:.3f} s "
          f"({executed_time / planned_time:.4f})")
    for name, plan, done in zip(names, planned_jerk, jerk):
        print(f"{name}: peak jerk planned {plan:.4f}, executed {done:.4f} of the limit")
    good = executed_time <= MOST_TIME * planned_time and jerk.max() <= MOST_JERK
    print("holds" if good else "does not hold")
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
