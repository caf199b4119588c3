#!/usr/bin/env python3
"""What a newcomer tries first, and what the tool answers: status, code and the words that help.

  command_line_test.py --tool smoothpost --source TREE
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

PATH = "x_mm,y_mm,z_mm,i,j,k,feed_mm_per_min\n0,0,0,0,0,1,600\n20,0,0,0,0,1,600\n"
ROTARY = "G21 G90 G94\nT1 M6\nG43 H1\nM3 S2000\nG0 X0 Y0 Z20 A0 C0\nG1 X5 A3 F600\nM2\n"


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--tool", required=True)
    arguments.add_argument("--source", required=True, type=Path)
    given = arguments.parse_args()
    machine = str(given.source / "machines/table_table_bc/machine.toml")
    failed = 0

    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "in.csv").write_text(PATH)
        (folder / "in.ngc").write_text(ROTARY)
        (folder / "in.xyz").write_text(PATH)
        (folder / "empty.ngc").write_text("")
        (folder / "binary.ngc").write_bytes(b"\x00\x01\x02\xff")

        def tries(line, status, *words, stdin=b""):
            nonlocal failed
            command = [given.tool, *(machine if word == "MACHINE" else word for word in line.split())]
            done = subprocess.run(command, cwd=folder, input=stdin, capture_output=True, timeout=120)
            text = (done.stdout + done.stderr).decode(errors="replace")
            missing = [word for word in words if word not in text]
            if done.returncode != status or missing:
                failed += 1
                print(f"FAILED  smoothpost {line}: status {done.returncode}, not {status}; without {missing}:\n{text[:800]}")

        # Help opens with what the command does and a complete example.
        for command in ("convert", "check", "finish", "place", "machines", "formats", "golden"):
            done = subprocess.run([given.tool, command, "--help"], capture_output=True, text=True, timeout=60)
            top = done.stdout.split("Usage:")[0]
            if done.returncode != 0 or "Example" not in top or f"  smoothpost {command}" not in top:
                failed += 1
                print(f"FAILED  {command} --help opens with\n{top}")
        tries("--help", 0, "Example", "smoothpost convert")
        tries("help convert", 0, "Example", "--input-machine")
        tries("--version", 0, "smoothpost ")

        # Commands, options, names.
        tries("", 2, "US106", "convert, check")
        tries("conver in.csv", 2, "US106", "did you mean convert?")
        tries("fly", 2, "US106", "convert, check")
        tries("convert", 2, "US106", "input")
        tries("convert in.csv --inputmachine x -m MACHINE", 2, "US106", "did you mean --input-machine?")
        tries("convert in.csv --tools 1=60 -m MACHINE", 2, "US106", "did you mean --tool?")
        tries("convert in.csv -m", 2, "US106", "--machine")
        tries("convert in.csv other.csv -m MACHINE", 2, "US106", "other.csv")
        tries("convert in.csv", 2, "US101", "machines list")
        tries("convert in.csv -m table_table_bd", 2, "US140", "did you mean table_table_bc?")
        tries("convert in.csv -m nothing_like_it", 2, "US140", "machines list")
        tries("convert in.csv -m gone/machine.toml", 2, "US130", "gone/machine.toml")
        tries("convert in.csv -m in.ngc/", 2, "US130")
        tries(f"machines validate {given.source}/machines/table_table_bc", 0, "valid")
        tries("convert in.csv -m MACHINE --dialect siemens", 2, "US121", "did you mean siemens_840d?")
        tries("convert in.csv -m MACHINE --tip-tolerance 0,1", 2, "US173", "--tip-tolerance")
        tries("convert in.csv -m MACHINE --tip-tolerance -1", 2, "US173")
        tries("convert in.csv -m MACHINE --set tolerance.tip=1", 2, "MF107", "tip_mm")
        tries("convert in.csv -m MACHINE --set tolerance.tip_mm", 2, "US141")
        tries("convert in.csv -m MACHINE --work-offset 1,2,3", 2, "US142", "G54=x,y,z")
        tries("convert in.csv -m MACHINE --tool 60", 2, "US143", "N=length")
        tries("convert in.csv -m MACHINE --cuts first", 2, "US146", "7-40")
        tries("machines show", 2, "US104", "show NAME")
        tries("machines import", 2, "US170", "URDF")
        tries("machines fit", 2, "US171", "MEASURED.csv")
        tries("formats all", 2, "US104")
        tries("golden run nowhere", 2, "US151", "case.toml")

        # Files.
        tries("convert gone.csv -m MACHINE", 4, "US130", "gone.csv")
        tries("convert . -m MACHINE", 4, "US130", "directory")
        tries("convert in.xyz -m MACHINE", 2, "US103", "--input-format")
        tries("convert - -m MACHINE", 2, "US103", "--input-format", stdin=PATH.encode())
        tries("convert - -m MACHINE --input-format csv -o -", 0, "G1 ", "certified", stdin=PATH.encode())
        tries("convert empty.ngc -m MACHINE", 4, "NC311", "no motion")
        tries("convert binary.ngc -m MACHINE", 4, "NC101")
        tries("convert in.csv -m MACHINE -o in.csv", 2, "US105", "another output")
        tries("convert in.csv -m MACHINE -o .", 2, "US131", "is a folder")
        tries("convert in.csv -m MACHINE -o nowhere/out.ngc", 2, "US131", "no folder nowhere")
        tries("convert in.csv -m MACHINE -w gone.stl", 4, "US130", "gone.stl")

        # A program with rotary words needs its machine, and its tool's length.
        tries("convert in.ngc -m MACHINE", 2, "US110", "--input-machine", "no input machine is named", "--tool 1=")
        ac = f"{given.source}/machines/table_table_ac/machine.toml"
        tries(f"convert in.ngc -m MACHINE --input-machine {ac}", 3, "PR102", "--tool 1=")
        if (folder / "in.csv").read_text() != PATH:
            failed += 1
            print("FAILED  the input was written")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
