#!/usr/bin/python3
"""LinuxCNC's interpreter (its Python module `gcode`) on one program, printed as rs274 -g would, in mm with nine decimals.

  canonical_ends.py PROGRAM

Every tool has the length 0. $HOME holds the shared tool table that a run of rs274 leaves there (the interpreter reads it, the module
does not make one). Exit status 1 with the message when the program is refused, 77 when the module is not installed.
"""

import ctypes
import os
import sys
import tempfile

try:
    import gcode
except ImportError:
    sys.exit(77)

INCH = 25.4
LINEAR = (True, True, True, False, False, False)


def show(name, values):
    print(f"{name}({', '.join(f'{value:.9f}' for value in values)})")


def six(values):
    """X Y Z A B C of the module's nine values, in mm and degrees."""
    return [value * INCH if linear else value for value, linear in zip(values[:6], LINEAR)]


class Canon:
    """What the module calls; lengths come in inches whatever the program's unit is."""

    def __init__(self, parameters):
        self.parameter_file = parameters

    def next_line(self, state):
        self.state = state

    def get_axis_mask(self):
        return 0x3F

    def get_external_length_units(self):
        return 1.0 / INCH

    def get_external_angular_units(self):
        return 1.0

    def get_tool(self, pocket):
        return (-1,) + (0.0,) * 12 + (0,)

    def get_block_delete(self):
        return 0

    def check_abort(self):
        return False

    def straight_feed(self, *to):
        show("STRAIGHT_FEED", six(to))

    def straight_probe(self, *to):
        show("STRAIGHT_PROBE", six(to))

    def straight_traverse(self, *to):
        show("STRAIGHT_TRAVERSE", six(to))

    def arc_feed(self, first, second, centre_first, centre_second, turns, along, *rest):
        lengths = [value * INCH for value in (first, second, centre_first, centre_second)]
        show("ARC_FEED", [*lengths, turns, along * INCH, *rest[:3]])

    def rigid_tap(self, x, y, z):
        show("RIGID_TAP", [value * INCH for value in (x, y, z)])

    def set_feed_rate(self, rate):
        show("SET_FEED_RATE", [rate * INCH])

    def set_g5x_offset(self, index, *offset):
        show("SET_G5X_OFFSET", [index, *six(offset)])

    def set_g92_offset(self, *offset):
        show("SET_G92_OFFSET", six(offset))

    def set_xy_rotation(self, degrees):
        show("SET_XY_ROTATION", [degrees])

    def tool_offset(self, *offset):
        show("USE_TOOL_LENGTH_OFFSET", six(offset))

    def set_plane(self, plane):
        print("SELECT_PLANE(CANON_PLANE_%s)" % {1: "XY", 2: "YZ", 3: "XZ"}.get(plane, "?"))

    def __getattr__(self, name):
        if name.startswith(("_", "get_")):
            raise AttributeError(name)
        return lambda *arguments: None


def main():
    program = sys.argv[1]
    ctypes.CDLL("libtooldata.so.0", mode=ctypes.RTLD_GLOBAL)._Z14tool_mmap_userv()
    print("USE_LENGTH_UNITS(CANON_UNITS_MM)")
    with tempfile.TemporaryDirectory() as folder:
        parameters = os.path.join(folder, "v.var")
        with open(parameters, "w", encoding="ascii"):
            pass
        result, line = gcode.parse(program, Canon(parameters), "G21", "")
    sys.stdout.flush()
    if result > gcode.MIN_ERROR:
        sys.exit(f"{program}:{line}: {gcode.strerror(result)}")


if __name__ == "__main__":
    main()
