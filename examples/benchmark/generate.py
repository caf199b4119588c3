#!/usr/bin/env python3
"""Writes the inputs of the benchmark: generate.py FOLDER. All of them are formulas of our own."""

import math
import struct
import sys
from pathlib import Path

COLUMNS = "x_mm,y_mm,z_mm,i,j,k,feed_mm_per_min,beam"


def unit(vector):
    length = math.sqrt(sum(c * c for c in vector))
    return [c / length for c in vector]


def tilted(lean, heading):
    """A tool axis that leans from the vertical by `lean` towards `heading`, both in degrees."""
    lean, heading = math.radians(lean), math.radians(heading)
    return [math.sin(lean) * math.cos(heading), math.sin(lean) * math.sin(heading), math.cos(lean)]


def csv_text(title, rows):
    """Rows of (tip, axis, feed, beam); the digits are more than any tolerance needs."""
    lines = [f"# {title}", COLUMNS]
    for tip, axis, feed, beam in rows:
        numbers = [f"{c:.5f}" for c in tip] + [f"{c:.8f}" for c in axis]
        numbers = [number if float(number) != 0.0 else "0" for number in numbers]
        lines.append(",".join(numbers + [str(feed), str(beam)]))
    return "\n".join(lines) + "\n"


def star():
    """A star of twelve points: long legs, sharp corners, and the tool axis jumps from leg to leg."""
    rows = []
    for k in range(25):
        radius = 40.0 if k % 2 == 0 else 22.0
        angle = math.radians(15.0 * k)
        rows.append(([radius * math.cos(angle), radius * math.sin(angle), 10.0], tilted(5.0 if k % 2 == 0 else 18.0, 40.0 * k),
                     900, 0))
    return rows


def blade():
    """Four passes over a twisted strip, points 0.5 mm apart: what a CAM system makes of a free surface."""
    rows = []
    for strip in range(4):
        along = range(161) if strip % 2 == 0 else reversed(range(161))
        for k in along:
            u, v = k / 160.0, (strip - 1.5) * 4.0
            twist = math.radians(35.0 * (u - 0.5))
            x, y = 80.0 * (u - 0.5), v * math.cos(twist)
            z = 15.0 + v * math.sin(twist) + 6.0 * math.sin(math.pi * u)
            slope = 6.0 * math.pi / 80.0 * math.cos(math.pi * u)
            rows.append(([x, y, z], unit([-slope + 0.12, -math.sin(twist), math.cos(twist)]), 1200, 0))
    return rows


def pole():
    """Past the pole: the tool axis goes from 12 deg on one side of the vertical to 12 deg on the other and passes it at
    0.3 deg. Rotary tables have to turn by half a turn where the axis is nearly upright."""
    rows = []
    for k in range(121):
        u = k / 60.0 - 1.0
        across = math.radians(0.3)
        rows.append(([35.0 * u, 8.0 * u * u, 12.0], unit([math.tan(math.radians(12.0)) * u, math.tan(across), 1.0]), 900, 0))
    return rows


def elbow():
    """A closed contour for a 3D laser around the bend of a sheet, 1 mm apart: flat, over the bend of radius 10 mm, down the
    flank and back. The normal turns by 70 deg within 12 mm, at once from where the flat ends: a beam that keeps it would have to stop."""
    bend, radius, flat, flank, width = math.radians(70.0), 10.0, 50.0, 40.0, 60.0

    def surface(s, y):
        """Tip and normal at arc length s from the middle of the flat."""
        if s <= flat:
            return [s, y, 0.0], [0.0, 0.0, 1.0]
        angle = min((s - flat) / radius, bend)
        rest = max(0.0, s - flat - radius * bend)
        x = flat + radius * math.sin(angle) + rest * math.cos(angle)
        z = radius * (math.cos(angle) - 1.0) - rest * math.sin(angle)
        return [x, y, z], [math.sin(angle), 0.0, math.cos(angle)]

    # A stadium in the unrolled sheet, so that no corner needs a stop.
    length = flat + radius * bend + flank - 20.0
    half, side = 0.5 * width - 5.0, length - 10.0 - (width - 10.0)
    outline = []

    def straight(from_s, from_y, to_s, to_y):
        count = max(1, round(math.hypot(to_s - from_s, to_y - from_y)))
        for k in range(count):
            outline.append((from_s + (to_s - from_s) * k / count, from_y + (to_y - from_y) * k / count))

    def arc(centre, begin):
        count = round(math.pi * half)
        for k in range(count):
            angle = begin + math.pi * k / count
            outline.append((centre + half * math.cos(angle), half * math.sin(angle)))

    first = 5.0 + half
    straight(first, -half, first + side, -half)
    arc(first + side, -0.5 * math.pi)
    straight(first + side, half, first, half)
    arc(first, 0.5 * math.pi)
    outline.append(outline[0])
    rows = [(*surface(*point), 6000, 1) for point in outline]
    # The beam switches where the contour begins and ends.
    return [(rows[0][0], rows[0][1], 6000, 0), *rows]


def vase():
    """A lobed vase as STL, to be finished from the side: r = 22 + 1.5 cos 3a mm, narrower by 1.2 mm at its top, 10 mm high."""
    around, levels, height = 180, 10, 10.0

    def point(i, level):
        angle = 2.0 * math.pi * (i % around) / around
        radius = 22.0 + 1.5 * math.cos(3.0 * angle) - 1.2 * level / levels
        return (radius * math.cos(angle), radius * math.sin(angle), height * level / levels)

    triangles = []
    for level in range(levels):
        for i in range(around):
            a, b, c, d = point(i, level), point(i + 1, level), point(i + 1, level + 1), point(i, level + 1)
            triangles += [(a, b, c), (a, c, d)]
    for level, centre in ((0, (0.0, 0.0, 0.0)), (levels, (0.0, 0.0, height))):
        for i in range(around):
            a, b = point(i, level), point(i + 1, level)
            triangles.append((centre, b, a) if level == 0 else (centre, a, b))
    data = bytearray(b"vase of the smoothpost benchmark, mm".ljust(80)) + struct.pack("<I", len(triangles))
    for corners in triangles:
        data += struct.pack("<12fH", 0.0, 0.0, 0.0, *(c for corner in corners for c in corner), 0)
    return bytes(data)


def main():
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for make in (star, blade, pole, elbow):
        title = " ".join(make.__doc__.split(":")[0].split())
        (folder / f"{make.__name__}.csv").write_text(csv_text(title, make()), encoding="utf-8")
    (folder / "vase.stl").write_bytes(vase())


if __name__ == "__main__":
    main()
