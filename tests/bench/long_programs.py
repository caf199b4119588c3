#!/usr/bin/env python3
"""What long five-axis programs cost: a raster over a wavy surface, converted and certified.

  long_programs.py --tool TOOL [--work FOLDER] LINES...

Rows of 100 mm with a point every 0.5 mm, to and fro, a retract after 25 rows; the tool leans 7 to 23 degrees and swings about
the part. Posted for table_table_ac, converted for table_table_bc with the recipe's own smoothing and schedule. Prints one row a
length: lines, processor time, microseconds a line, largest memory, bytes of it a line, blocks, the verdict.
"""

import argparse
import json
import math
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

PER_ROW, ROWS = 201, 25


def raster(lines):
    """The program's text, so many feed blocks."""
    yield "%\nM428\nG21 G90 G94\nG0 X0 Y0 Z60 A0 C0\n"
    for k in range(lines):
        row, place = divmod(k, PER_ROW)
        y = (row % 400) * 0.3 - 60
        x = -50 + 0.5 * (place if row % 2 == 0 else PER_ROW - 1 - place)
        z = 4 * math.sin(x / 15) * math.cos(y / 12)
        a, c = -15 - 8 * math.sin(x / 20) * math.cos(y / 30), 20 * math.sin(x / 40 + y / 50)
        if row % ROWS == 0 and place == 0:
            yield f"G0 Z60\nG0 X{x:.4f} Y{y:.4f} A{a:.4f} C{c:.4f}\nG0 Z{z + 2:.4f}\n"
            yield f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f} A{a:.4f} C{c:.4f} F3000\n"
        else:
            yield f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f} A{a:.4f} C{c:.4f}\n"
    yield "G0 Z60\nM429\nM30\n%\n"


def convert(tool, program, folder):
    """Seconds of processor time, bytes of memory and the report of one conversion."""
    report = folder / "report.json"
    command = [tool, "convert", program, "--input-machine", "table_table_ac", "-m", "table_table_bc",
               "--work-offset", "G54=0,0,40", "-o", folder / "out.ngc", "--json", report]
    child = subprocess.Popen([str(word) for word in command], stderr=subprocess.PIPE)
    _, text = child.communicate()
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    if child.returncode not in (0, 3):
        sys.exit(text.decode())
    return usage, json.loads(report.read_text())


def measure(tool, lines, folder):
    program = folder / f"raster_{lines}.ngc"
    with program.open("w") as out:
        out.writelines(raster(lines))
    # A process of its own, whose children are this one conversion: times and memory of children add up.
    reading, writing = os.pipe()
    if os.fork() == 0:
        usage, report = convert(tool, program, folder)
        row = [usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024, report["output"]["blocks"], report["verdict"]]
        os.write(writing, json.dumps(row).encode())
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as answer:
        seconds, memory, blocks, verdict = json.loads(answer.read())
    os.wait()
    print(f"{lines:9d} lines  {seconds:8.2f} s  {1e6 * seconds / lines:7.0f} us/line  {memory / 1e6:7.0f} MB  "
          f"{memory / lines:7.0f} B/line  {blocks:8d} blocks  {verdict}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tool", required=True)
    parser.add_argument("--work")
    parser.add_argument("lines", nargs="+", type=int)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=options.work) as folder:
        for lines in options.lines:
            measure(options.tool, lines, Path(folder))


if __name__ == "__main__":
    main()
