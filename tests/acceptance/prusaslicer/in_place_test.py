#!/usr/bin/python3
"""smoothpost as PrusaSlicer's post-processing script: `convert --in-place`, the G-code file behind all options.

    in_place_test.py --smoothpost TOOL --source ROOT --work DIR [--slicer]

Without --slicer the file is written here, in the words of PrusaSlicer's flavour without extrusion. With it,
Debian's PrusaSlicer slices a block headless with the shipped settings and runs the script itself. Either way: a
certified program takes the place of the file, a refused one leaves it as it was, with the reason and a status.
Exit status: 0 all hold, 1 not, 77 PrusaSlicer is not installed.
"""
import argparse
import os
import re
import shlex
import shutil
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
SKIP = 77
TOO_SMALL = ["--set", "axis.X.max_mm=5"]
SLICED = """; walls of 20 x 15 mm
G21 G17 G90 G94
G43 H1
M3 S1000
G0 X0 Y0 Z50
G1 Z1 F7800
G1 X-9 Y-6.5
G1 F1800
G1 X9 Y-6.5
G1 X9 Y6.5
G1 X-9 Y6.5
G1 X-9 Y-6.2
G0 Z50
M5
M2
"""
FAILED = []


def that(holds, text):
    print(f"{'ok    ' if holds else 'FAILED'} {text}", flush=True)
    if not holds:
        FAILED.append(text)


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def write(path, text):
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)


def block_stl(path, size=(20, 15, 4)):
    """A block as text STL."""
    corner = [[size[axis] * (n >> axis & 1) for axis in range(3)] for n in range(8)]
    faces = [(0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6), (0, 1, 4), (1, 5, 4),
             (2, 6, 3), (3, 6, 7), (0, 4, 2), (2, 4, 6), (1, 3, 5), (3, 7, 5)]
    lines = ["solid block"]
    for face in faces:
        lines += ["facet normal 0 0 0", "outer loop", *["vertex {} {} {}".format(*corner[n]) for n in face],
                  "endloop", "endfacet"]
    write(path, "\n".join(lines + ["endsolid block"]) + "\n")


def feeds(program):
    """The feed blocks of a program, without its title: that names the input's date."""
    return re.findall(r"^N\d+ G1 .*$", program, re.MULTILINE)


class Case:
    """The commands of one run of this test."""

    def __init__(self, given):
        self.given, self.work = given, os.path.abspath(given.work)
        source = os.path.abspath(given.source)
        self.machine = os.path.join(source, "machines/table_table_bc/machine.toml")
        self.settings = os.path.join(source, "postproc/hosts/prusaslicer")
        self.script = [os.path.abspath(given.smoothpost), "convert", "--in-place", *self.options()]

    def options(self):
        return ["--input-format", "nc", "--input-dialect", "linuxcnc", "--process",
                os.path.join(self.settings, "words.toml"), "-m", self.machine, "--tool", "1=60"]

    def file(self, name):
        return os.path.join(self.work, name)

    def in_place(self):
        part = self.file("it's a part.gcode")
        write(part, SLICED)
        done = subprocess.run([*self.script, part], capture_output=True, text=True, check=False)
        that(done.returncode == 0 and len(feeds(read(part))) > 5, f"a certified program replaces the file: {done.stderr[-200:]}")
        beside = self.file("beside.ngc")
        write(part, SLICED)
        subprocess.run([self.script[0], "convert", *self.options(), part, "-o", beside], capture_output=True, check=True)
        kept = read(beside)
        subprocess.run([*self.script, part], capture_output=True, check=True)
        that(read(part) == kept, "with the same bytes that convert writes beside it")
        write(part, SLICED)
        done = subprocess.run([*self.script, *TOO_SMALL, part], capture_output=True, text=True, check=False)
        that(done.returncode == 3 and "axis X" in done.stderr and read(part) == SLICED,
             f"a refused one leaves it: status {done.returncode}")
        extruding = SLICED.replace("G1 X9 Y6.5", "G1 X9 Y6.5 E1.5")
        write(part, extruding)
        done = subprocess.run([*self.script, part], capture_output=True, text=True, check=False)
        that(done.returncode != 0 and "E1.5" in done.stderr and read(part) == extruding,
             f"a word of an extruder is refused: status {done.returncode}")
        write(part, SLICED)
        for wrong in (["--force"], ["-o", self.file("other.ngc")], ["--json", self.file("none/report.json")]):
            done = subprocess.run([*self.script, *wrong, part], capture_output=True, text=True, check=False)
            that(done.returncode == 2 and read(part) == SLICED and (wrong[0] == "--json" or "US195" in done.stderr),
                 f"{wrong[0]} leaves it, too: status {done.returncode}")
        that(sorted(os.listdir(self.work)) == ["beside.ngc", "it's a part.gcode"], "and no other file")

    def slice(self, name, script):
        """Exit status and messages of PrusaSlicer, and the G-code file that it leaves."""
        block_stl(self.file("block.stl"))
        target = self.file(name)
        command = ["prusa-slicer", "--export-gcode", "--load", os.path.join(self.settings, "walls.ini"), "--layer-height", "1",
                   "--first-layer-height", "1", "--nozzle-diameter", "2", "--center", "0,0", "--dont-arrange", "-o", target]
        if script:
            command += ["--post-process", " ".join(map(shlex.quote, script))]
        done = subprocess.run([*command, self.file("block.stl")], capture_output=True, text=True, errors="replace",
                              env=dict(os.environ, HOME=self.work), timeout=300, check=False)
        return done.returncode, done.stdout + done.stderr, read(target) if os.path.exists(target) else ""

    def slicer(self):
        status, told, sliced = self.slice("sliced.gcode", None)
        that(status == 0 and "G1 X" in sliced, f"PrusaSlicer slices without a window: status {status} {told[-200:] if status else ''}")
        # Two runs of PrusaSlicer need not give the same file: keep the one that the script was given.
        keeps = self.file("keeps.sh")
        with open(keeps, "w", encoding="utf-8") as file:
            file.write(f"#!/bin/sh\nfor last; do :; done\ncp \"$last\" {shlex.quote(self.file('given.gcode'))}\nexec \"$@\"\n")
        os.chmod(keeps, 0o755)
        status, told, program = self.slice("posted.gcode", [keeps, *self.script])
        that(status == 0 and len(feeds(program)) > 5, f"its post-processing script makes the program: status {status} {told[-300:] if status else ''}")
        beside = self.file("beside.ngc")
        subprocess.run([self.script[0], "convert", *self.options(), self.file("given.gcode"), "-o", beside],
                       capture_output=True, check=True)
        that(feeds(program) == feeds(read(beside)), "the same as convert makes of the file that it was given")
        self.interpreter(self.file("posted.gcode"))
        status, told, program = self.slice("refused.gcode", [*self.script, *TOO_SMALL])
        # PrusaSlicer 2.5 shows the status and the first line of what the script has said.
        that(status != 0 and "Error code: 3" in told and "G1 X" in program and not program.startswith("%"),
             f"a refusal is PrusaSlicer's error, and its file stays what it has sliced: status {status}")

    def interpreter(self, program):
        sys.path.insert(0, os.path.join(HERE, os.pardir, "linuxcnc"))
        try:
            import interpreter_check
            from machine_model import Machine
        except ImportError as error:
            print(f"not checked with LinuxCNC's interpreter: {error}")
            return
        if interpreter_check.reason_to_skip():
            print("not checked with LinuxCNC's interpreter:", interpreter_check.reason_to_skip())
            return
        that(interpreter_check.Checker(Machine(self.machine), {}, {}).check(program), "LinuxCNC's interpreter accepts it")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    for name in ("smoothpost", "source", "work"):
        parser.add_argument(f"--{name}", required=True)
    parser.add_argument("--slicer", action="store_true")
    given = parser.parse_args()
    if given.slicer and shutil.which("prusa-slicer") is None:
        print("skipped: the Debian package prusa-slicer is not installed")
        sys.exit(SKIP)
    case = Case(given)
    shutil.rmtree(case.work, ignore_errors=True)
    os.makedirs(case.work)
    if given.slicer:
        case.slicer()
    else:
        case.in_place()
    sys.exit(1 if FAILED else 0)


if __name__ == "__main__":
    main()
