"""Machine definition files and their forward kinematics, in Python.

Written from the definition of the machine file alone (docs/machine_file.md), so that the
acceptance tests do not share code with the tool that they check. Lengths are mm, angles degrees
in the joint vectors and radians inside.

    X_WT(q) = (exp(S_1 q_1) ... exp(S_n q_n) X_MW(0))^-1  exp(T_1 q_1) ... exp(T_m q_m) X_MT(0)

S: axes with chain = "workpiece", T: axes with chain = "tool", each in the order of the file,
which is from the machine base outwards. Screws are taken at the pose where every joint is 0.
"""
import math
import sys
import tomllib

import numpy as np


class Axis:
    """One axis of a machine file."""

    def __init__(self, row):
        self.name = row["name"]
        self.letter = row["letter"].upper()
        self.rotary = row["type"] == "rotary"
        if row["type"] not in ("rotary", "linear"):
            raise ValueError(f"axis {self.name}: type {row['type']}")
        if row["chain"] not in ("tool", "workpiece"):
            raise ValueError(f"axis {self.name}: chain {row['chain']}")
        self.on_workpiece = row["chain"] == "workpiece"
        direction = np.array(row["direction"], float)
        self.direction = direction / np.linalg.norm(direction)
        self.origin = np.array(row.get("origin_mm", (0.0, 0.0, 0.0)), float)
        unit = self.unit
        self.minimum = float(row[f"min_{unit}"])
        self.maximum = float(row[f"max_{unit}"])
        self.velocity = float(row[f"max_velocity_{unit}_per_s"])
        self.acceleration = float(row[f"max_acceleration_{unit}_per_s2"])
        self.home = row.get("home")

    @property
    def unit(self):
        return "deg" if self.rotary else "mm"

    def home_position(self):
        """The `home` of the file; without one 0, or the nearest end of a range that excludes 0."""
        if self.home is not None:
            return float(self.home)
        return min(max(0.0, self.minimum), self.maximum)


class Machine:
    """A machine file, with the forward kinematics of its axes."""

    def __init__(self, path):
        with open(path, "rb") as file:
            data = tomllib.load(file)
        self.name = data["name"]
        self.axes = [Axis(row) for row in data["axis"]]
        tool = data.get("tool", {})
        self.tip = np.array(tool.get("tip_mm", (0.0, 0.0, 0.0)), float)
        axis = np.array(tool.get("axis", (0.0, 0.0, 1.0)), float)
        self.tool_axis = axis / np.linalg.norm(axis)
        frame = data.get("workpiece", {}).get("frame", {})
        self.workpiece_origin = np.array(frame.get("xyz_mm", (0.0, 0.0, 0.0)), float)
        self.workpiece_rotation = rotation_from_rpy(frame.get("rpy_deg", (0.0, 0.0, 0.0)))
        dialect = data.get("dialect", {})
        self.inch = dialect.get("units", "mm") == "inch"
        self.events = data.get("process", {}).get("events", {})

    @property
    def letters(self):
        return "".join(axis.letter for axis in self.axes)

    def home(self):
        return np.array([axis.home_position() for axis in self.axes])

    def forward(self, joints, tool_length=0.0):
        """Tool tip (mm) and tool axis in the workpiece, for joint vectors of shape (n, axes)."""
        joints = np.atleast_2d(np.asarray(joints, float))
        position = np.broadcast_to(self.tip - tool_length * self.tool_axis, (len(joints), 3))
        direction = np.broadcast_to(self.tool_axis, (len(joints), 3))
        # Tool side, from the tool back to the base: every point is moved by the axes before it.
        for index in reversed(range(len(self.axes))):
            axis = self.axes[index]
            if axis.on_workpiece:
                continue
            position, direction = moved(axis, joints[:, index], position, direction)
        # Workpiece side, from the base to the workpiece: the inverse motions in file order.
        for index, axis in enumerate(self.axes):
            if axis.on_workpiece:
                position, direction = moved(axis, -joints[:, index], position, direction)
        return ((position - self.workpiece_origin) @ self.workpiece_rotation,
                direction @ self.workpiece_rotation)

    def poses(self, joints, tool_length, axis_weight):
        """Points (tip, axis_weight * axis) in R^6, whose distances count a rad axis_weight mm."""
        tip, axis = self.forward(joints, tool_length)
        return np.hstack([tip, axis_weight * axis])


def rotation_from_rpy(rpy_deg):
    roll, pitch, yaw = (math.radians(float(v)) for v in rpy_deg)
    cr, sr, cp, sp, cy, sy = (math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch),
                              math.cos(yaw), math.sin(yaw))
    rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return rz @ ry @ rx


def moved(axis, values, position, direction):
    """exp(S q) applied to a point and to a vector (n, 3 each); values in mm or degrees."""
    if not axis.rotary:
        return position + np.outer(values, axis.direction), direction
    angle = np.radians(values)[:, None]
    return (axis.origin + rotated(axis.direction, angle, position - axis.origin),
            rotated(axis.direction, angle, direction))


def rotated(unit, angle, vectors):
    """Rodrigues' rotation of vectors (n, 3) about `unit` by angle (n, 1)."""
    along = np.outer(vectors @ unit, unit)
    across = vectors - along
    return along + across * np.cos(angle) + np.cross(np.broadcast_to(unit, vectors.shape),
                                                     vectors) * np.sin(angle)


def axis_angle_deg(a, b):
    """Angle between unit vectors, row by row, well conditioned near 0."""
    return np.degrees(2.0 * np.arcsin(np.clip(0.5 * np.linalg.norm(a - b, axis=-1), 0.0, 1.0)))


def fail(text, status=2):
    print(text, file=sys.stderr, flush=True)
    sys.exit(status)
