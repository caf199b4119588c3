#!/usr/bin/python3
"""Accepts NC programs with LinuxCNC's own interpreter.

    interpreter_check.py [--machine MACHINE.toml] [--tool 1=50] [--g54 X=1] FILES...

Each file goes through the interpreter twice: through the Python module `gcode` of the Debian
package with the axes of the machine (all nine without --machine), and through `rs274 -g` where
its axis words are within X Y Z A B C, the only ones that rs274 knows. Both start from a tool
table with tools 1 to 99 and from zero offsets. A program passes when no block is refused, the
last block with motion was reached and the program end was executed.

Prints a line per file: canonical motions, last line reached, errors. Exit status: 0 all accepted,
1 a refusal, 2 usage, 77 LinuxCNC is not installed.
"""
import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile

from interpreter_worker import TOOLS
from machine_model import Machine, fail
from make_config import AXIS_ORDER, parameter_text, parse_assignments

SKIP = 77
RS274_AXES = "XYZABC"
WORKER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "interpreter_worker.py")
MOTION_CODES = set("0 1 2 3 5 5.1 5.2 33 33.1 38.2 38.3 38.4 38.5 73 76 81 82 83 84 85 86 87 88 89"
                   .split())
NO_MOTION_CODES = ("4", "10", "52", "92", "43.1", "43.2")  # their axis words do not move


def plain_blocks(path):
    """(line number, code without comments and spaces) of the blocks of a program."""
    percent = 0
    with open(path, encoding="utf-8", errors="replace") as file:
        for number, text in enumerate(file, 1):
            code = re.sub(r"\([^()]*\)|;.*", "", text)
            code = re.sub(r"\s", "", code).upper().lstrip("/")
            if code == "%":
                percent += 1
                if percent == 2:
                    return
            elif code:
                yield number, code


def motion_lines(path):
    """Lines with axis words that move, and the axis letters used, by the text alone."""
    lines, letters, motion = [], set(), False
    for number, code in plain_blocks(path):
        if code.startswith("O") or code.startswith("#"):
            continue
        axes = set(re.findall(r"([XYZABCUVW])(?=[-+.\d\[#])", code))
        codes = [c.lstrip("0") or "0" for c in re.findall(r"G(\d+(?:\.\d+)?)", code)]
        letters |= axes
        motion = (motion or any(c in MOTION_CODES for c in codes)) and "80" not in codes
        if axes and motion and not any(c in NO_MOTION_CODES for c in codes):
            lines.append(number)
        if re.search(r"M0*(2|30)(?!\d)", code):
            break
    return lines, letters


class Checker:
    """Settings of one run over many files."""

    def __init__(self, machine, lengths, g54):
        letters = machine.letters if machine else AXIS_ORDER
        self.mask = sum(1 << AXIS_ORDER.index(letter) for letter in letters)
        self.lengths = lengths
        self.g54 = g54

    def files_in(self, directory):
        with open(os.path.join(directory, "tool.tbl"), "w", encoding="ascii") as file:
            file.writelines(f"T{n} P{n} D0 Z{self.lengths.get(n, 0.0)}\n" for n in TOOLS)
        with open(os.path.join(directory, "check.var"), "w", encoding="ascii") as file:
            file.write(parameter_text(self.g54, {}))

    def module(self, path):
        """Through the Python module, in a process of its own: (motions, last line, errors)."""
        with tempfile.TemporaryDirectory() as directory:
            self.files_in(directory)
            run = subprocess.run([sys.executable, "-B", WORKER, path, directory, str(self.mask)],
                                 capture_output=True, text=True, errors="replace", check=False)
        lines = run.stdout.splitlines()
        if run.returncode not in (0, 1) or not lines:
            return 0, 0, [f"gcode module: status {run.returncode}: {run.stderr.strip()[-300:]}"]
        motions, last = lines[0].split()
        return int(motions), int(last), [f"gcode module: {text}" for text in lines[1:]]

    def rs274(self, path):
        with tempfile.TemporaryDirectory() as directory:
            self.files_in(directory)
            run = subprocess.run(["rs274", "-g", "-t", os.path.join(directory, "tool.tbl"), "-v",
                                  os.path.join(directory, "check.var"), path],
                                 capture_output=True, text=True,
                                 errors="replace", check=False, env=dict(os.environ, HOME=directory))
        if run.returncode == 0 and "PROGRAM_END()" in run.stdout:
            return []
        if run.returncode == 0:
            return ["rs274: the program end was not executed"]
        message = [line for line in run.stderr.splitlines() if line.strip() and line != "executing"]
        return [f"rs274: status {run.returncode}: {' | '.join(message)[-300:]}"]

    def check(self, path):
        """True when the program is accepted; prints its line."""
        expected, letters = motion_lines(path)
        motions, last, errors = self.module(path)
        by_rs274 = letters <= set(RS274_AXES)
        if by_rs274:
            errors += self.rs274(path)
        if expected and last != expected[-1]:
            errors.append(f"the last motion is on line {expected[-1]}, "
                          f"the interpreter reached line {last}")
        if not expected:
            errors.append("no motion in the text")
        print(f"{path}: {motions} motions, last on line {last}, gcode{' + rs274' if by_rs274 else ''}: "
              f"{'accepted' if not errors else 'REFUSED'}")
        for error in errors:
            print(f"  {error}")
        return not errors


def reason_to_skip():
    if shutil.which("rs274") is None or not os.path.isdir("/usr/lib/python3/dist-packages/rs274"):
        return "the Debian package linuxcnc-uspace is not installed"
    return ""


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("files", nargs="+")
    parser.add_argument("--machine")
    parser.add_argument("--tool", action="append", default=[], metavar="N=LENGTH")
    parser.add_argument("--g54", default="")
    arguments = parser.parse_args()
    reason = reason_to_skip()
    if reason:
        fail(f"skipped: {reason}", SKIP)
    lengths = {int(n): v for item in arguments.tool for n, v in parse_assignments(item).items()}
    checker = Checker(Machine(arguments.machine) if arguments.machine else None, lengths,
                      parse_assignments(arguments.g54))
    accepted = [checker.check(path) for path in arguments.files]
    sys.exit(0 if all(accepted) else 1)


if __name__ == "__main__":
    main()
