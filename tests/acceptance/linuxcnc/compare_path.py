#!/usr/bin/python3
"""Compares an executed program with its plan, as sets of poses (at any time).

    compare_path.py LOG MACHINE.toml PLAN [--tip 0.01] [--axis 0.05] [--tool-length 0]

LOG comes from run_program.py. PLAN is the program itself (joints linear from block to block) or a
trajectory CSV (*.csv). Both sides go through the forward kinematics of machine_model.py. For every
executed sample the nearest pose of the program is found among the blocks near the one that the
controller was executing, so that a match cannot jump to another pass of the tool, and for every block
end of the program the nearest executed pose. Of a CSV every row is looked for in the executed path, in
order. Nearest is in the norm that adds the squares of tip distance over --tip and axis angle over
--axis; the tip distance and the angle at that match are reported. Motions are cut so finely that
poses between the cuts are linear to 0.0001 mm.

Exit status: 0 within both tolerances, 1 over one of them, 2 usage or unreadable input.
"""
import argparse
import csv
import math
import sys

import numpy as np

from joint_program import JointProgram
from machine_model import Machine, axis_angle_deg, fail

CHORD = 1e-4        # mm, linearity of the pieces of the plan
BLOCKS_AROUND = 3   # blocks before and after the executed one among which a match is sought
PAIRS_AT_ONCE = 400_000


class Log:
    """Samples of run_program.py, one a millisecond."""

    def __init__(self, path, machine):
        with open(path, encoding="ascii") as file:
            columns = file.readline().lstrip("#").split()
            rows = [line.split() for line in file if "overrun" not in line]
            if any(len(row) != len(columns) for row in rows[:-1]):
                raise ValueError(f"{path}: a sample is not {len(columns)} columns (overrun?)")
        rows = [row for row in rows if len(row) == len(columns)]
        table = np.array(rows, float).reshape(-1, len(columns))
        column = dict(zip(columns, table.T))
        if len(table) and np.any(np.diff(column["index"]) != 1):
            raise ValueError(f"{path}: samples are missing")
        self.line = column["line"].astype(int)
        self.motion_type = column["motion_type"].astype(int)
        self.joints = np.stack([column[f"joint_{axis.name}"] for axis in machine.axes], 1)
        self.velocity = column["velocity"]
        self.output = [column[f"output_{n}"] > 0.5 for n in range(4)]
        self.spindle = column["spindle"] > 0.5

    def moving(self):
        """Samples from the first motion to the last."""
        changed = np.flatnonzero(np.any(np.diff(self.joints, axis=0) != 0.0, axis=1))
        return slice(changed[0], changed[-1] + 2) if len(changed) else slice(0, 0)


class Plan:
    """Polyline of joint vectors; `block[i]` numbers the motion from vertex i to vertex i + 1."""

    def __init__(self, joints, rapid, durations, lines):
        self.joints, self.rapid, self.durations, self.lines = joints, rapid, durations, lines

    @staticmethod
    def of_program(path, machine, start):
        program = JointProgram(path, machine.letters, start)
        moves = program.moves
        return Plan(program.joints(), np.array([m.rapid for m in moves], bool),
                    np.array([m.duration for m in moves]), np.array([m.line for m in moves]))

class Trajectory:
    """A trajectory CSV of the tool: t_s, axes with units, x_mm,y_mm,z_mm,i,j,k,beam."""

    def __init__(self, path, machine):
        with open(path, encoding="utf-8", newline="") as file:
            rows = [row for row in csv.reader(file) if row and not row[0].startswith("#")]
        header = [name.strip() for name in rows[0]]
        table = np.array(rows[1:], float)
        column = dict(zip(header, table.T))
        self.time = column["t_s"]
        names = [next((n for n in (f"{axis.name}_{axis.unit}", f"{axis.letter}_{axis.unit}")
                       if n in column), None) for axis in machine.axes]
        if None in names:
            raise ValueError(f"{path}: no column for axis {machine.axes[names.index(None)].name}")
        self.joints = np.stack([column[name] for name in names], 1)
        self.tip = np.stack([column[name] for name in ("x_mm", "y_mm", "z_mm")], 1)
        self.axis = np.stack([column[name] for name in "ijk"], 1)
        self.beam = column["beam"] > 0.5


class Pieces:
    """The plan in pieces that are straight in pose space to CHORD."""

    def __init__(self, plan, machine, tool_length, weight):
        start, end = plan.joints[:-1], plan.joints[1:]
        rotary = [index for index, axis in enumerate(machine.axes) if axis.rotary]
        turn = np.sum(np.abs((end - start)[:, rotary]), axis=1)
        count = np.maximum(1, np.ceil(turn / 5.0).astype(int))
        # Bow of the middle one of these pieces; it falls with the square of their number.
        poses = lambda share: machine.poses(start + (end - start) * share[:, None], tool_length, weight)
        middle = np.zeros(len(start))
        for part in np.linspace(0.0, 1.0, 9):
            first = np.floor(part * (count - 1)) / count
            bow = poses(first + 0.5 / count) - 0.5 * (poses(first) + poses(first + 1.0 / count))
            middle = np.maximum(middle, np.linalg.norm(bow, axis=1))
        count = count * np.maximum(1, np.ceil(np.sqrt(middle / CHORD)).astype(int))
        self.block = np.repeat(np.arange(len(start)), count)
        self.first = np.r_[0, np.cumsum(count)]
        share = (np.arange(len(self.block)) - self.first[self.block]) / count[self.block]
        joints = start[self.block] + (end - start)[self.block] * share[:, None]
        self.points = machine.poses(np.vstack([joints, plan.joints[-1:]]), tool_length, weight)


def nearest(points, starts, ends):
    """For every point the nearest point of the segments start-end: index and foot, in pose space."""
    step = max(1, PAIRS_AT_ONCE // max(1, len(starts)))
    centre = np.mean(points, axis=0)
    points, starts, ends = points - centre, starts - centre, ends - centre
    along = ends - starts
    length2 = np.einsum("ij,ij->i", along, along)
    safe = np.where(length2 > 0.0, length2, 1.0)
    index, foot = [], []
    for first in range(0, len(points), step):
        part = points[first:first + step]
        # |p - s|^2 - 2 t (p - s).d + t^2 |d|^2, without forming all differences.
        dot = part @ along.T - np.einsum("ij,ij->i", starts, along)
        share = np.clip(dot / safe, 0.0, 1.0)
        p2 = np.einsum("ij,ij->i", part, part)[:, None]
        s2 = np.einsum("ij,ij->i", starts, starts)
        distance2 = (p2 - 2.0 * (part @ starts.T) + s2 - 2.0 * share * dot
                     + share * share * length2)
        best = np.argmin(distance2, axis=1)
        index.append(best)
        foot.append(starts[best] + share[np.arange(len(part)), best][:, None] * along[best])
    return np.concatenate(index), np.vstack(foot) + centre


class Deviation:
    """Largest tip distance (mm) and axis angle (deg) of a set of matches, and where."""

    def __init__(self, weight):
        self.weight = weight
        self.tip = self.axis = 0.0
        self.tip_at = self.axis_at = None

    def add(self, points, feet, labels):
        tip = np.linalg.norm(points[:, :3] - feet[:, :3], axis=1)
        unit = feet[:, 3:] / np.linalg.norm(feet[:, 3:], axis=1)[:, None]
        angle = axis_angle_deg(points[:, 3:] / self.weight, unit)
        for name, values in (("tip", tip), ("axis", angle)):
            worst = int(np.argmax(values))
            if values[worst] > getattr(self, name):
                setattr(self, name, float(values[worst]))
                setattr(self, f"{name}_at", labels[worst])


def block_of_samples(log, plan):
    """The plan's block that the controller was executing at each sample."""
    line = log.line.copy()
    for i in range(1, len(line)):  # 0 is told while the controller rests: the last block counts on
        if line[i] == 0:
            line[i] = line[i - 1]
    return np.clip(np.searchsorted(plan.lines, line), 0, len(plan.lines) - 1)


def runs_of(first, final):
    """Slices of consecutive samples with the same two values."""
    edges = np.flatnonzero((np.diff(first) != 0) | (np.diff(final) != 0)) + 1
    return [slice(a, b) for a, b in zip(np.r_[0, edges], np.r_[edges, len(first)]) if b > a]


class Comparison:
    """Both directions of the comparison, and times."""

    def __init__(self, log, machine, plan, tolerance, tool_length):
        tip, axis_deg = tolerance
        weight = tip / math.radians(axis_deg)
        moving = log.moving()
        self.samples = moving.stop - moving.start
        self.executed, self.covered = Deviation(weight), Deviation(weight)
        pieces = Pieces(plan, machine, tool_length, weight)
        points = machine.poses(log.joints[moving], tool_length, weight)
        blocks = len(plan.joints) - 1
        block = block_of_samples(log, plan)[moving]
        bounds = np.maximum(block - BLOCKS_AROUND, 0), np.minimum(block + BLOCKS_AROUND, blocks - 1)
        for run in runs_of(*bounds):
            first, last = pieces.first[bounds[0][run.start]], pieces.first[bounds[1][run.start] + 1]
            _, feet = nearest(points[run], pieces.points[first:last], pieces.points[first + 1:last + 1])
            self.executed.add(points[run], feet, block[run])
        self._cover(machine.poses(plan.joints[1:], tool_length, weight), points, bounds)
        self._times(plan, moving, block)

    def _cover(self, ends, points, bounds):
        """Finds for every block end of the plan the nearest executed pose near that block."""
        for index, end in enumerate(ends):
            first = int(np.searchsorted(bounds[1], index))
            last = int(np.searchsorted(bounds[0], index, side="right"))
            first = max(0, min(first - 1, len(points) - 2))
            last = min(len(points), max(last + 1, first + 2))
            part = points[first:last]
            _, foot = nearest(end[None, :], part[:-1], part[1:])
            self.covered.add(end[None, :], foot, [index])

    def _times(self, plan, moving, block):
        feed = ~plan.rapid
        self.planned = float(np.sum(plan.durations[feed]))
        self.executed_time = 0.001 * int(np.count_nonzero(feed[block]))
        self.total_time = 0.001 * (moving.stop - moving.start)


def report(comparison, plan, tolerance):
    """Prints the comparison; true when it is within the tolerances."""
    ok = True
    for name, deviation in (("executed to plan", comparison.executed),
                            ("plan to executed", comparison.covered)):
        ok = ok and deviation.tip <= tolerance[0] and deviation.axis <= tolerance[1]
        places = [f" (line {plan.lines[label]})" if label is not None else ""
                  for label in (deviation.tip_at, deviation.axis_at)]
        print(f"{name}: tip {deviation.tip:.5f} mm{places[0]}, "
              f"axis {deviation.axis:.5f} deg{places[1]}")
    ratio = comparison.executed_time / comparison.planned if comparison.planned else math.nan
    print(f"samples {comparison.samples}, blocks {len(plan.joints) - 1}, feed time"
          f" {comparison.executed_time:.3f} s of {comparison.planned:.3f} s planned"
          f" (ratio {ratio:.3f}), whole motion {comparison.total_time:.3f} s")
    print(f"{'within' if ok else 'OVER'} tip {tolerance[0]} mm, axis {tolerance[1]} deg")
    return ok


def first_within(points, start, row, reach):
    """The first segment of the executed path from `start` on that comes within `reach` of `row`.

    From there on to the nearest one as long as it comes nearer. Returns (segment, foot) or None.
    """
    length = 64
    while True:
        stop = min(len(points) - 1, start + length)
        along = points[start + 1:stop + 1] - points[start:stop]
        length2 = np.maximum(np.einsum("ij,ij->i", along, along), 1e-300)
        share = np.clip(np.einsum("ij,ij->i", row - points[start:stop], along) / length2, 0.0, 1.0)
        feet = points[start:stop] + share[:, None] * along
        distance = np.linalg.norm(feet - row, axis=1)
        near = np.flatnonzero(distance <= reach)
        if len(near) and (near[0] + 32 < len(distance) or stop == len(points) - 1):
            at = int(near[0])
            while at + 1 < len(distance) and distance[at + 1] < distance[at]:
                at += 1
            return start + at, feet[at]
        if stop == len(points) - 1:
            return None
        length *= 2


def compare_trajectory(log, machine, trajectory, tolerance, tool_length=0.0):
    """Whether the rows of a trajectory CSV were executed, in their order; printed.

    Rows lie on the path, lines between them cut its corners: so rows are looked for in the executed
    path, each not before the one in front of it, and not the other way round.
    """
    weight = tolerance[0] / math.radians(tolerance[1])
    points = machine.poses(log.joints[log.moving()], tool_length, weight)
    rows = machine.poses(trajectory.joints, tool_length, weight)
    deviation, at = Deviation(weight), 0
    for index, row in enumerate(rows):
        found = first_within(points, at, row, tolerance[0])
        if found is None:
            print(f"row {index} (t = {trajectory.time[index]:.4f} s) was not executed after the others")
            return False
        at, foot = found
        deviation.add(row[None, :], foot[None, :], [index])
    print(f"{len(rows)} rows to executed: tip {deviation.tip:.5f} mm, axis {deviation.axis:.5f} deg")
    return deviation.tip <= tolerance[0] and deviation.axis <= tolerance[1]


def compare(log_path, machine, program, tolerance=(0.01, 0.05), tool_length=0.0):
    """(within, comparison), printed. Raises ValueError for input that cannot be compared."""
    log = Log(log_path, machine)
    if log.moving().stop == 0:
        raise ValueError(f"{log_path}: no motion was made")
    plan = Plan.of_program(program, machine, log.joints[0])
    comparison = Comparison(log, machine, plan, tolerance, tool_length)
    return report(comparison, plan, tolerance), comparison


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("log")
    parser.add_argument("machine")
    parser.add_argument("plan")
    parser.add_argument("--tip", type=float, default=0.01, help="mm")
    parser.add_argument("--axis", type=float, default=0.05, help="deg")
    parser.add_argument("--tool-length", type=float, default=0.0, help="mm")
    arguments = parser.parse_args()
    try:
        machine, tolerance = Machine(arguments.machine), (arguments.tip, arguments.axis)
        if arguments.plan.endswith(".csv"):
            ok = compare_trajectory(Log(arguments.log, machine), machine,
                                    Trajectory(arguments.plan, machine), tolerance,
                                    arguments.tool_length)
        else:
            ok, _ = compare(arguments.log, machine, arguments.plan, tolerance,
                            arguments.tool_length)
    except (OSError, ValueError, KeyError) as error:
        fail(f"compare_path.py: {error}")
    sys.exit(0 if ok else 1)


if __name__ == "__main__":
    main()
