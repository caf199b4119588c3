#!/usr/bin/env python3
"""Runs the tool where something is wrong with disks, streams, paths, inputs or machine files.

  faults_test.py --tool smoothpost --machines FOLDER [--only NAME]

Every function that begins with check_ is one fault. A run ends with an exit status of the documented
five and, unless 0, with a message that has a code; never by a signal that it did not get.
"""

import argparse
import json
import os
import random
import re
import resource
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

TOOL = None
MACHINES = None
CODE = re.compile(r"\[[A-Z]{2,3}\d{3}\]")
LIMIT = 120  # seconds, of one run on a busy computer


def expect(holds, what):
    if not holds:
        raise AssertionError(what)


def run(*arguments, cwd, stdin=None, **options):
    return subprocess.run([TOOL, *map(str, arguments)], cwd=cwd, input=stdin, capture_output=True, timeout=LIMIT,
                          **options)


def refused(done, code=None, status=None, words=""):
    """The run ended with a message that names its code."""
    text = done.stderr.decode(errors="replace")
    expect(done.returncode in (1, 2, 3, 4), f"status {done.returncode}: {text[-400:]}")
    expect(done.returncode != 1, f"internal error: {text[-400:]}")
    expect(CODE.search(text), f"a message with a code: {text[-400:]}")
    expect(code is None or f"[{code}]" in text, f"{code} in: {text[-400:]}")
    expect(status is None or done.returncode == status, f"status {done.returncode}, not {status}: {text[-400:]}")
    expect(words in text, f"{words!r} in: {text[-400:]}")


def certified(done):
    expect(done.returncode == 0, f"status {done.returncode}: {done.stderr.decode(errors='replace')[-600:]}")


PATH_ROWS = "x_mm,y_mm,z_mm,i,j,k,feed_mm_per_min\n0,0,0,0,0,1,600\n20,0,0,0,0.1,0.995,600\n20,15,0,0.1,0,0.995,600\n"


def convert(folder, source="in.csv", output="out.ngc", *more, **options):
    return run("convert", source, "-m", MACHINES / "table_table_bc/machine.toml", "-o", output, *more, cwd=folder,
               **options)


def write_input(folder, name="in.csv", text=PATH_ROWS):
    (folder / name).write_text(text)


def leftovers(folder):
    return sorted(f.name for f in folder.iterdir() if ".new" in f.name)


# --- disks --------------------------------------------------------------------------------------------

def check_disk_full(folder):
    write_input(folder)
    (folder / "out.ngc").write_text("old\n")

    def small_files():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (300, 300))

    refused(convert(folder, preexec_fn=small_files), "US131", 2)
    expect((folder / "out.ngc").read_text() == "old\n", "the old program is whole")
    expect(not leftovers(folder), "no temporary is left")


def check_disk_full_report(folder):
    """A report that does not fit is an error too, and no half report lies about."""
    write_input(folder)

    def small_files():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))

    refused(convert(folder, "in.csv", "-", "--json", "r.json", preexec_fn=small_files), "US131", 2)
    expect(not (folder / "r.json").exists() and not leftovers(folder), "no half report")


def check_dev_full(folder):
    write_input(folder)
    with open("/dev/full", "w") as full:
        done = subprocess.run([TOOL, "convert", "in.csv", "-m", str(MACHINES / "table_table_bc/machine.toml"), "-o", "-"],
                              cwd=folder, stdout=full, stderr=subprocess.PIPE, timeout=LIMIT)
    refused(done, "US132", 2)
    refused(convert(folder, "in.csv", "/dev/full"), "US131", 2)


def check_closed_stdout(folder):
    write_input(folder)
    done = subprocess.run(["sh", "-c", f'"{TOOL}" convert in.csv -m "{MACHINES}/table_table_bc/machine.toml" -o - >&-'],
                          cwd=folder, stderr=subprocess.PIPE, timeout=LIMIT)
    refused(done, "US132", 2)
    # A reader that goes away.
    done = subprocess.run(["sh", "-c", f'{{ "{TOOL}" convert in.csv -m "{MACHINES}/table_table_bc/machine.toml" -o -; '
                                       'echo $? >status; } | true'], cwd=folder, stderr=subprocess.PIPE, timeout=LIMIT)
    expect((folder / "status").read_text().strip() in ("0", "2"), "no signal ends it")


def check_targets_that_cannot_be_written(folder):
    write_input(folder)
    refused(convert(folder, "in.csv", "nowhere/out.ngc"), "US131", 2, "no folder nowhere")
    refused(convert(folder, "in.csv", "."), "US131", 2, "is a folder")
    refused(convert(folder, "in.csv", "in.csv/out.ngc"), "US131", 2)
    refused(convert(folder, "in.csv", "out.ngc", "--json", "nowhere/r.json"), "US131", 2)
    expect(not (folder / "out.ngc").exists(), "nothing is written when a report has no place")
    refused(convert(folder, "in.csv", "/proc/version"), "US131", 2)
    read_only = folder / "locked"
    read_only.mkdir()
    read_only.chmod(0o500)
    if os.geteuid() != 0:
        refused(convert(folder, "in.csv", "locked/out.ngc"), "US131", 2)


def check_links(folder):
    write_input(folder)
    (folder / "real").mkdir()
    (folder / "real/program.ngc").write_text("old\n")
    (folder / "link.ngc").symlink_to("real/program.ngc")
    certified(convert(folder, "in.csv", "link.ngc"))
    expect((folder / "link.ngc").is_symlink(), "the link stays a link")
    expect((folder / "real/program.ngc").read_text().startswith("%"), "its file is the new program")
    (folder / "dangling.ngc").symlink_to("real/later.ngc")
    certified(convert(folder, "in.csv", "dangling.ngc"))
    expect((folder / "dangling.ngc").is_symlink() and (folder / "real/later.ngc").exists(), "a link to a new file")
    (folder / "a.ngc").symlink_to("b.ngc")
    (folder / "b.ngc").symlink_to("a.ngc")
    refused(convert(folder, "in.csv", "a.ngc"), "US131", 2)
    # The output is the input by another name.
    (folder / "same.csv").symlink_to("in.csv")
    refused(convert(folder, "in.csv", "same.csv"), "US105", 2)
    os.link(folder / "in.csv", folder / "hard.csv")
    refused(convert(folder, "in.csv", "hard.csv"), "US105", 2)
    expect((folder / "in.csv").read_text() == PATH_ROWS, "the input is untouched")


# --- signals ------------------------------------------------------------------------------------------

def long_input(folder):
    rows = ["x_mm,y_mm,z_mm,i,j,k,feed_mm_per_min"]
    rows += [f"{0.5 * k},{(k % 7) * 0.4:.1f},0,0,{0.05 * (k % 3):.2f},1,900" for k in range(30)]
    write_input(folder, "in.csv", "\n".join(rows) + "\n")


def check_killed_at_random_moments(folder):
    long_input(folder)
    begin = time.monotonic()
    certified(convert(folder))
    span = time.monotonic() - begin
    new = (folder / "out.ngc").read_bytes()
    pick = random.Random(8)
    seen = set()
    for k in range(12):
        (folder / "out.ngc").write_bytes(b"old\n")
        process = subprocess.Popen([TOOL, "convert", "in.csv", "-m", str(MACHINES / "table_table_bc/machine.toml"), "-o",
                                    "out.ngc"], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        # Most of the kills where the file is written.
        time.sleep(span * (pick.random() if k % 3 == 0 else pick.uniform(0.8, 1.1)))
        process.kill()
        process.wait()
        now = (folder / "out.ngc").read_bytes()
        seen.add(now == new)
        expect(now in (b"old\n", new), "the old file or the whole new one")
    expect(seen, "the tool was killed at all")


def check_interrupted(folder):
    long_input(folder)
    (folder / "out.ngc").write_bytes(b"old\n")
    statuses = set()
    for wait in (0.02, 0.1, 0.3):
        process = subprocess.Popen([TOOL, "convert", "in.csv", "-m", str(MACHINES / "table_table_bc/machine.toml"), "-o",
                                    "out.ngc"], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        time.sleep(wait)
        process.send_signal(signal.SIGINT)
        text = process.communicate(timeout=LIMIT)[1].decode()
        statuses.add(process.returncode)
        # Before the handler stands the signal's own end is right; later the tool says so itself.
        expect(process.returncode in (0, 2, -signal.SIGINT), f"status {process.returncode}")
        if process.returncode == 2:
            expect("[US190]" in text, text[-300:])
        if process.returncode != 0:
            expect((folder / "out.ngc").read_bytes() == b"old\n", "nothing is written")
    expect(not leftovers(folder), "no temporary is left")


# --- inputs -------------------------------------------------------------------------------------------

def check_inputs_that_are_not_there(folder):
    refused(convert(folder, "gone.csv"), "US130", 4)
    refused(convert(folder, "."), "US130", 4)
    (folder / "dead.csv").symlink_to("nothing")
    refused(convert(folder, "dead.csv"), "US130", 4)
    write_input(folder)
    refused(convert(folder, "in.csv", "out.ngc", "-w", "gone.stl"), "US130", 4)
    # A pipe whose writer goes away in the middle of a row.
    os.mkfifo(folder / "pipe.csv")
    writer = subprocess.Popen(["sh", "-c", "printf 'x_mm,y_mm,z_mm,i,j,k,feed_mm_per_min\\n0,0,0,0,0,1,600\\n5,0' >pipe.csv"],
                              cwd=folder)
    refused(convert(folder, "pipe.csv"), "CSV105", 4)
    writer.wait()


def small_memory():
    resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))


def check_sparse_ten_gigabytes(folder):
    for name in ("in.csv", "in.ngc", "in.apt"):
        with open(folder / name, "wb") as f:
            f.truncate(10 << 30)
        begin = time.monotonic()
        refused(convert(folder, name, preexec_fn=small_memory), "US130", 4, "larger")
        expect(time.monotonic() - begin < 20, "at once")
    with open(folder / "part.stl", "wb") as f:
        f.truncate(10 << 30)
    write_input(folder, "ok.csv")
    refused(convert(folder, "ok.csv", "out.ngc", "-w", "part.stl", preexec_fn=small_memory), "US130", 4, "larger")
    refused(run("machines", "validate", "./in.ngc", cwd=folder, preexec_fn=small_memory), "US130", words="larger")


NUMBERS = ["NaN", "nan", "inf", "-inf", "1e308", "1e-320", "5e-324", "-0", "1e999", "0x10", "1,5", "1_0", "+-1", "",
           "9" * 400, "0." + "0" * 400 + "1", "-" + "9" * 30]


def check_numbers(folder):
    """Odd numbers in NC words, CSV fields, CL data, options and machine files: read right or refused."""
    zero_like = {"1e-320", "5e-324", "-0"}
    for number in NUMBERS:
        write_input(folder, "n.csv", PATH_ROWS + f"{number},0,0,0,0,1,600\n")
        done = convert(folder, "n.csv")
        certified(done) if number in zero_like else refused(done, status=4)
        if done.returncode == 0:
            text = re.sub(r"\(.*?\)", "", (folder / "out.ngc").read_text())
            expect(not re.search(r"[A-Z]-0(?![.0-9])|nan|inf|[0-9]e[-+0-9]", text), f"{number}: numbers of the program")
        (folder / "n.ngc").write_text(f"G21 G90\nG0 X0 Y0 Z5\nG1 X{number} F600\nM2\n")
        done = convert(folder, "n.ngc")
        certified(done) if number == "-0" else refused(done)
        (folder / "n.apt").write_text(f"UNITS/MM\nFEDRAT/600,MMPM\nGOTO/0,0,0\nGOTO/{number},0,0\nFINI\n")
        done = convert(folder, "n.apt")
        certified(done) if number in zero_like else refused(done)
        write_input(folder)
        if number:
            refused(convert(folder, "in.csv", "out.ngc", f"--tip-tolerance={number}"))
            done = convert(folder, "in.csv", "out.ngc", f"--work-offset=G54={number},0,0")
            if number not in zero_like:
                refused(done)


def check_stl_headers(folder):
    write_input(folder)
    for count in (1, 2, 0x7FFFFFFF, 0xFFFFFFFF):
        (folder / "part.stl").write_bytes(b"binary".ljust(80) + struct.pack("<I", count) + b"\0" * 50 * (count == 2))
        refused(convert(folder, "in.csv", "out.ngc", "-w", "part.stl", preexec_fn=small_memory), status=4)
    (folder / "part.stl").write_text("solid a\nfacet normal 0 0 1\nouter loop\nvertex nan 0 0\n")
    refused(convert(folder, "in.csv", "out.ngc", "-w", "part.stl"), status=4)


def check_deep_expressions_and_calls(folder):
    deep = 200000
    (folder / "n.ngc").write_text("G21 G90\nG1 X" + "[" * deep + "1" + "]" * deep + " F600\nM2\n")
    refused(convert(folder, "n.ngc", preexec_fn=small_memory), status=4)
    (folder / "n.ngc").write_text("o<a> sub\no<a> call\no<a> endsub\no<a> call\nM2\n")
    refused(convert(folder, "n.ngc"), "NC253", 4)
    (folder / "n.ngc").write_text("o1 while [1]\n#1=[#1+1]\no1 endwhile\nM2\n")
    refused(convert(folder, "n.ngc"), "NC252", 4)
    refused(convert(folder, "n.ngc", "out.ngc", "--run-budget", "10"), "NC252", 4, "10")
    refused(convert(folder, "n.ngc", "out.ngc", "--run-budget", "many"), "US172", 2)
    # A loop of 30 moves: within the budget or not.
    (folder / "n.ngc").write_text("G21 G90\nG0 X0 Y0 Z5\no1 repeat [30]\nG91 G1 X0.5 F600\no1 endrepeat\nM2\n")
    refused(convert(folder, "n.ngc", "out.ngc", "--run-budget", "5"), "NC252", 4)
    certified(convert(folder, "n.ngc", "out.ngc", "--run-budget", "100"))
    calls = "".join(f"o<s{k}> sub\n" + (f"o<s{k - 1}> call\n" if k else "G1 X5 F600\n") + f"o<s{k}> endsub\n" for k in range(4))
    (folder / "n.ngc").write_text("G21 G90\n" + calls + "G0 X0 Y0 Z5\no<s3> call\nM2\n")
    refused(convert(folder, "n.ngc", "out.ngc", "--call-depth", "3"), "NC253", 4)
    certified(convert(folder, "n.ngc", "out.ngc", "--call-depth", "4"))


def check_subroutines_stay_in_their_folder(folder):
    (folder / "outside.ngc").write_text("o<outside> sub\nG1 X5 F600\no<outside> endsub\n")
    inner = folder / "programs"
    inner.mkdir()
    for name in ("../outside", "/etc/passwd", "..", ".hidden", "sub/outside", "outside"):
        (inner / "n.ngc").write_text(f"G21 G90\nG0 X0 Y0 Z5\no<{name}> call\nM2\n")
        refused(convert(folder, "programs/n.ngc"))
    (inner / "outside.ngc").symlink_to("../outside.ngc")
    refused(convert(folder, "programs/n.ngc"), "NC251", 4)
    (inner / "outside.ngc").unlink()
    shutil.copy(folder / "outside.ngc", inner / "outside.ngc")
    certified(convert(folder, "programs/n.ngc", "out.ngc", "--json", "r.json"))
    files = json.loads((folder / "r.json").read_text())["certificate"]["input_files"]
    expect([f["file"] for f in files] == ["outside.ngc"] and len(files[0]["sha256"]) == 64, "the file is in the certificate")


# --- paths --------------------------------------------------------------------------------------------

def check_paths(folder):
    for name in ("with blank", "quote'\"", "new\nline", "Fräsé ü", "-dash", "a;b|c&d", "back\\slash", "per%cent{}"):
        place = folder / ("d " + name)
        place.mkdir()
        write_input(place, name + ".csv")
        done = convert(folder, place / (name + ".csv"), place / (name + ".ngc"), "--json", place / (name + ".json"),
                       "--report", place / (name + ".html"), "--line-map", place / (name + ".map"))
        certified(done)
        report = json.loads((place / (name + ".json")).read_text())
        expect(report["input"]["file"] == name + ".csv", "the name comes through")
        text = (place / (name + ".ngc")).read_text(errors="strict")
        expect(all(len(line) <= 256 for line in text.splitlines()), "no line grows")
        expect(text.count("\n") == report["output"]["lines"], "no name breaks a line")


# --- machine files ------------------------------------------------------------------------------------

def check_machine_files(folder):
    write_input(folder)
    good = (MACHINES / "table_table_bc/machine.toml").read_text()

    def with_machine(text, **expected):
        (folder / "m.toml").write_text(text)
        refused(run("convert", "in.csv", "-m", "./m.toml", "-o", "out.ngc", cwd=folder, preexec_fn=small_memory), **expected)
        expect(not (folder / "out.ngc").exists(), "nothing is written")

    with_machine("a = " + "[" * 100000, code="MF102")
    with_machine("a." * 100000 + "a = 1", code="MF102")
    with_machine("".join(f"[[axis]]\nname = \"A{k}\"\n" for k in range(20000)), status=4)
    with_machine("a = \"" + "x" * (5 << 20) + "\"", code="MF102")
    with_machine(good.replace("direction = [0, 0, 1]", "direction = [0, 0, 0]"), code="MF111")
    with_machine(good.replace("direction = [0, 1, 0]", "direction = [1, 0, 0]", 1), status=3)  # X and Y are parallel
    parallel = re.sub(r"(name = \"C\"[\s\S]*?direction = )\[0, 0, 1\]", r"\1[0, 1, 0]", good)
    expect(parallel != good, "the file has a C axis")
    with_machine(parallel, status=3)  # both rotaries about Y
    with_machine(good.replace("min_mm = -200", "min_mm = 1e308", 1), status=4)
    with_machine(good.replace("max_velocity_mm_per_s = 20", "max_velocity_mm_per_s = 1e-320", 1))
    with_machine(good.replace("origin_mm = [0, 0, 0]", "origin_mm = [nan, 0, 0]", 1), code="MF109")


def main():
    global TOOL, MACHINES
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--tool", required=True)
    arguments.add_argument("--machines", required=True, type=Path)
    arguments.add_argument("--only", default="")
    given = arguments.parse_args()
    TOOL, MACHINES = given.tool, given.machines
    failed = 0
    for name, check in sorted(globals().items()):
        if not name.startswith("check_") or given.only not in name:
            continue
        with tempfile.TemporaryDirectory() as place:
            begin = time.monotonic()
            try:
                check(Path(place))
                print(f"ok      {name[6:]} ({time.monotonic() - begin:.1f} s)")
            except (AssertionError, subprocess.TimeoutExpired) as error:
                failed += 1
                print(f"FAILED  {name[6:]}: {error}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
