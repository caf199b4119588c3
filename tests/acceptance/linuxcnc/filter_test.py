#!/usr/bin/python3
"""smoothpost as a [FILTER] of LinuxCNC, run by AXIS' own code without its window.

    filter_test.py --smoothpost TOOL --source ROOT

The shipped INI section is read with LinuxCNC's INI reader, and `filter_program` of the installed AXIS, taken out of
its source and given a progress bar that only counts, runs what the section says, as when a user opens a file:
  1. a program whose name has a blank and a quote is converted; the interpreter accepts what AXIS would load,
  2. its N words are lines of the file that was opened, and every feed of that file is among them,
  3. what AXIS takes for progress is progress, and the rest of standard error are whole lines,
  4. a program with a fault ends with a status that is not 0, file:line:column of the fault, and nothing to load,
  5. no key of the section is without its extension in the file dialog.
Exit status: 0 all hold, 1 not, 77 LinuxCNC is not installed.
"""
import argparse
import ast
import os
import re
import select
import shutil
import sys
import tempfile

SKIP = 77
WANTED = ("progress_re", "filter_program", "get_filter")
SAMPLE = "tests/acceptance/linuxcnc/samples/mill_short.ngc"
FEED_LINES = set(range(10, 19)) | {19}  # of the sample: G1 and G3, the last one without a word of its own


def names_of(node):
    if isinstance(node, ast.FunctionDef):
        return {node.name}
    if isinstance(node, ast.Assign):
        return {target.id for target in node.targets if isinstance(target, ast.Name)}
    return set()


class Progress:
    """AXIS' progress bar, counting."""

    seen = []

    def __init__(self, phases, total):
        self.total = total

    def update(self, count, force=0):
        Progress.seen.append(count)

    def set_text(self, text):
        pass

    def done(self):
        pass


def axis_functions(inifile):
    """`filter_program` and `get_filter` of the AXIS that is installed."""
    with open(shutil.which("axis"), encoding="utf-8") as file:
        tree = ast.parse(file.read())
    chosen = [node for node in tree.body if names_of(node) & set(WANTED)]
    found = set().union(*map(names_of, chosen)) if chosen else set()
    if not set(WANTED) <= found:
        sys.exit(f"this AXIS has no {', '.join(sorted(set(WANTED) - found))}: the contract has changed")
    window = type("Window", (), {"update": lambda self: None})()
    scope = {"os": os, "re": re, "select": select, "sys": sys, "Progress": Progress, "t": window, "_": lambda text: text,
             "inifile": inifile}
    exec(compile(ast.Module(chosen, type_ignores=[]), "axis", "exec"), scope)
    return scope


def open_in_axis(axis, path, folder):
    """(exit status, text that AXIS shows when it is not 0, text that it loads when it is)."""
    Progress.seen = []
    loaded = os.path.join(folder, "loaded.ngc")
    status, told = axis["filter_program"](axis["get_filter"](path), path, loaded)
    with open(loaded, encoding="ascii") as file:
        return status, told, file.read(), loaded


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    for name in ("smoothpost", "source"):
        parser.add_argument(f"--{name}", required=True)
    given = parser.parse_args()
    import interpreter_check
    reason = interpreter_check.reason_to_skip() or ("" if shutil.which("axis") else "AXIS is not installed")
    if reason:
        print(f"skipped: {reason}")
        sys.exit(SKIP)
    import linuxcnc
    from machine_model import Machine
    failed = []

    def that(holds, text):
        print(f"{'ok    ' if holds else 'FAILED'} {text}", flush=True)
        if not holds:
            failed.append(text)

    snippet = os.path.join(given.source, "postproc/hosts/linuxcnc/filter.ini")
    inifile = linuxcnc.ini(snippet)
    axis = axis_functions(inifile)
    os.environ["PATH"] = os.path.dirname(os.path.abspath(given.smoothpost)) + ":" + os.environ["PATH"]
    offered = re.findall(r"\.(\w+)", inifile.find("FILTER", "PROGRAM_EXTENSION").split(" ")[0])
    with open(snippet, encoding="ascii") as file:
        keys = re.findall(r"^(\w+) = smoothpost", file.read(), re.MULTILINE)
    that(sorted(keys) == sorted(offered) and keys, f"the file dialog offers what is filtered: {offered}")

    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "it's a part.nc")
        shutil.copy(os.path.join(given.source, SAMPLE), path)
        status, told, program, loaded = open_in_axis(axis, path, folder)
        that(status == 0, f"the program is converted: status {status}")
        machine = Machine(os.path.join(given.source, "machines/table_table_bc/machine.toml"))
        that(interpreter_check.Checker(machine, {}, {}).check(loaded), "the interpreter accepts what AXIS loads")
        numbers = {int(number) for number in re.findall(r"^N(\d+) G[123] ", program, re.MULTILINE)}
        that(numbers == FEED_LINES, f"N words of feeds are the feeds' lines: {sorted(numbers)}")
        that(Progress.seen != [] and all(0 <= value <= 100 for value in Progress.seen),
             f"progress: {Progress.seen}")
        that("FILTER_PROGRESS" not in told and told.endswith("\n"), "what is left of standard error is whole lines")

        bad = os.path.join(folder, "bad.nc")
        with open(path, encoding="ascii") as source, open(bad, "w", encoding="ascii") as file:
            file.write(source.read().replace("X4 Y-11 Z5.2 A-11 C19", "X4 Y-11 Z5.2 A-11 C"))
        status, told, program, _ = open_in_axis(axis, bad, folder)
        that(status == 4 and program == "", f"a program with a fault: status {status}, {len(program)} bytes to load")
        that(re.search(r"bad\.nc:12:\d+: error: ", told) is not None, f"AXIS shows where: {told.splitlines()[:1]}")

        far = os.path.join(folder, "far.nc")
        with open(path, encoding="ascii") as source, open(far, "w", encoding="ascii") as file:
            file.write(source.read().replace("X4 Y-11 Z5.2", "X4000 Y-11 Z5.2"))
        status, told, program, _ = open_in_axis(axis, far, folder)
        that(status == 3 and program == "" and re.search(r"far\.nc:12:\d*:? ?error: ", told) is not None,
             f"a refused program: status {status}, {[line for line in told.splitlines() if 'error' in line][:1]}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
