#!/usr/bin/python3
"""Runs one program through LinuxCNC's interpreter, for interpreter_check.py.

    interpreter_worker.py PROGRAM DIRECTORY AXISMASK

The interpreter is the Python module `gcode` of the Debian package. It gets a process of its own,
because it is one per process and may take it down.
DIRECTORY holds tool.tbl and check.var and becomes $HOME. Prints `motions last_motion_line`, then
a line per error. Exit status: 0 accepted, 1 refused; anything else is the interpreter's own end.
"""
import ctypes
import os
import sys

TOOLS = range(1, 100)


class Canon:
    """What the interpreter calls: counts motions, holds a tool table, changes tools.

    The interpreter reads its tools through get_tool(index) and expects the number of the tool,
    nine offsets (inch and degrees), diameter, front and back angle, orientation. Index 0 is the
    spindle, so change_tool has to put the tool there: with an empty slot T1 M6 and G43 H1 find no
    tool.
    """

    def __init__(self, parameter_file, mask, lengths):
        self.parameter_file = parameter_file
        self.mask = mask
        self.lengths = lengths
        self.spindle = 0
        self.line = 0
        self.motions = 0
        self.last_motion_line = 0
        self.feed = 0.0
        self.feedless_line = 0

    def next_line(self, state):
        self.line = state.sequence_number

    def get_axis_mask(self):
        return self.mask

    def get_external_length_units(self):
        return 1.0 / 25.4  # the module's lengths are inches

    def get_external_angular_units(self):
        return 1.0

    def get_block_delete(self):
        return 0

    def get_tool(self, index):
        number = self.spindle if index == 0 else index if index in TOOLS else -1
        offset = self.lengths.get(number, 0.0) / 25.4
        return (number, 0.0, 0.0, offset) + (0.0,) * 9 + (0,)

    def change_tool(self, index):
        self.spindle = index

    def check_abort(self):
        return False

    def user_defined_function(self, *arguments):
        pass

    def _motion(self, *arguments):
        self.motions += 1
        self.last_motion_line = self.line

    straight_traverse = rigid_tap = _motion

    def _feed_motion(self, *arguments):
        # The module, unlike rs274, lets a feed motion without a feed pass.
        if self.feed <= 0.0 and not self.feedless_line:
            self.feedless_line = self.line
        self._motion(*arguments)

    straight_feed = arc_feed = straight_probe = _feed_motion

    def set_feed_rate(self, feed):
        self.feed = feed

    def __getattr__(self, name):
        if name.startswith("_") or name.startswith("get_"):
            raise AttributeError(name)
        return lambda *arguments: None  # state changes and messages


def load_tool_table(path):
    """Gives the interpreter library the tool data that a running LinuxCNC would share with it.

    Without it the first T word reads memory that is not there. The table is a file in $HOME.
    """
    library = ctypes.CDLL("libtooldata.so.0", mode=ctypes.RTLD_GLOBAL)
    create = library["_Z17tool_mmap_creatorPK13EMC_TOOL_STATi"]
    create.argtypes = [ctypes.c_void_p, ctypes.c_int]
    initialise = library["_Z13tooldata_initb"]
    initialise.argtypes = [ctypes.c_bool]
    load = library["_Z13tooldata_loadPKcPPc"]
    load.argtypes = [ctypes.c_char_p, ctypes.c_void_p]
    create(None, 0)
    initialise(False)
    if load(os.fsencode(path), None) != 0:
        raise OSError(f"{path}: LinuxCNC does not load this tool table")


def run_module(path, directory, mask):
    """Runs the program through the `gcode` module, prints a summary and returns the status."""
    os.environ["HOME"] = directory
    load_tool_table(os.path.join(directory, "tool.tbl"))
    import gcode  # only with linuxcnc-uspace
    lengths = read_lengths(os.path.join(directory, "tool.tbl"))
    canon = Canon(os.path.join(directory, "check.var"), mask, lengths)
    result, line = gcode.parse(path, canon, "G21", "")
    print(f"{canon.motions} {canon.last_motion_line}")
    if result > gcode.MIN_ERROR:
        print(f"near line {line}: {gcode.strerror(result)}")
        return 1
    if canon.feedless_line:
        print(f"line {canon.feedless_line}: feed motion with zero feed rate")
        return 1
    # 1 is INTERP_EXIT (M2 or M30), 3 the end of the file at its second %.
    if result not in (1, 3):
        print(f"near line {line}: stopped without a program end (result {result})")
        return 1
    return 0


def read_lengths(path):
    """Tool number -> length (mm) of the tool table that interpreter_check.py writes."""
    with open(path, encoding="ascii") as file:
        rows = [line.split() for line in file]
    return {int(row[0][1:]): float(row[3][1:]) for row in rows}


def main():
    path, directory, mask = sys.argv[1:4]
    sys.exit(run_module(path, directory, int(mask)))


if __name__ == "__main__":
    main()
