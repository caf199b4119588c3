#!/usr/bin/python3
"""The post in Debian's FreeCAD 0.20: a real job, posted as FreeCAD posts it.

    freecad_test.py --smoothpost TOOL --source ROOT --work DIR

Exit status: 0 all hold, 1 not, 77 FreeCAD is not installed.
"""
import argparse
import json
import os
import re
import shutil
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
SKIP = 77


class Verdicts:
    """Collects what holds and what does not, and says it."""

    def __init__(self):
        self.failed = 0

    def that(self, holds, text):
        print(f"{'ok    ' if holds else 'FAILED'} {text}", flush=True)
        self.failed += not holds


def home_with_addon(work, addon):
    """A home whose FreeCAD has the addon, and the post in its macro folder, where 0.20 lists posts from."""
    data = os.path.join(work, "home/.local/share/FreeCAD")
    os.makedirs(os.path.join(data, "Macro"))
    os.makedirs(os.path.join(data, "Mod"))
    os.symlink(addon, os.path.join(data, "Mod/smoothpost"))
    os.symlink(os.path.join(addon, "posts/smoothpost_post.py"), os.path.join(data, "Macro/smoothpost_post.py"))
    return os.path.join(work, "home")


def run_freecad(arguments, work, home):
    result = os.path.join(work, "result.json")
    environment = dict(os.environ, HOME=home, SMOOTHPOST_TEST_RESULT=result, SMOOTHPOST_TEST_ARGUMENTS=arguments)
    run = subprocess.run(["freecadcmd", os.path.join(HERE, "job_in_freecad.py")], stdin=subprocess.DEVNULL, text=True,
                         stdout=subprocess.PIPE, stderr=subprocess.STDOUT, errors="replace", env=environment,
                         timeout=400, check=False)
    if not os.path.exists(result):
        print(run.stdout)
        sys.exit("FreeCAD did not come to the end of the job")
    with open(result, encoding="utf-8") as file:
        return json.load(file), run.stdout


def read(*parts):
    with open(os.path.join(*parts), encoding="utf-8") as file:
        return file.read()


def feeds_of(neutral):
    """The F words below each operation's name."""
    feeds, label = {}, None
    for line in neutral.splitlines():
        named = re.match(r"\(operation: (.*)\)$", line)
        label = named.group(1) if named else label
        feeds.setdefault(label, []).extend(re.findall(r"F(\S+)", line) if not line.startswith("(") else [])
    return feeds


def check_job(that, told, work):
    job = told["job"]
    that(job["error"] is None, f"the job is posted (error: {job['error']})")
    that("smoothpost" in told["posts"], "FreeCAD lists the post")
    that(job["text"] == read(work, "job.ngc"), "what export() returns is what it has written")
    that(job["text"] == told["dash"]["text"], 'with "-" the same bytes are returned')
    that(json.loads(read(work, "job.json"))["verdict"] == "certified", "the program is certified")
    that(told["cycles"] != [], f"the drilling operation has a cycle: {told['cycles']}")
    neutral = read(work, "job_neutral.ngc")
    feeds = feeds_of(neutral)
    that(set(feeds["Profile"]) == {"300", "600"}, f"600 and 300 mm/min stay so: {sorted(set(feeds['Profile']))}")
    that(set(feeds["Drilling"]) == {"300"}, f"so does the cycle's feed: {sorted(set(feeds['Drilling']))}")
    that("\nG43 H1\n" in neutral and "\nM8\n" in neutral and "\nM9\n" in neutral, "tool length and coolant are said")
    lines = len(neutral.splitlines())
    numbers = [int(n) for n in re.findall(r"^N(\d+)", job["text"], re.MULTILINE)]
    that(numbers != [] and max(numbers) <= lines, f"N words are lines of the neutral program: up to {max(numbers, default=0)} of {lines}")


def check_inverse(that, told, work):
    minutes, seconds = told["inverse"], told["inverse_second"]
    that(minutes["error"] is None and seconds["error"] is None, "a job with G93 is posted")
    that(feeds_of(read(work, "inverse_neutral.ngc"))["Inverse time"] == ["12", "6"], "after G93 F is not scaled")
    that(feeds_of(read(work, "inverse_second_neutral.ngc"))["Inverse time"] == ["720", "360"],
         "--g93-feed second scales it")
    for name, wanted in (("inverse", 60.0 / 12 + 60.0 / 6), ("inverse_second", 60.0 / 720 + 60.0 / 360)):
        time = json.loads(read(work, f"{name}.json"))["time_s"]["programmed"]
        that(abs(time - wanted) < 1e-6, f"{name}: programmed {time} s, from F {wanted:.6f} s")


def check_refusals(that, told, work, output):
    far = told["far"]["error"] or ""
    that(re.search(r'Too far, command 3 "G1 X5000 F600".*axis X would be at 5000', far) is not None,
         "a refusal names operation and command")
    that(not os.path.exists(os.path.join(work, "far.ngc")), "a refused job leaves no file")
    that(told["far_dash"] == {"text": None, "error": None}, 'with "-" a refused job is None')
    that('Too far, command 3' in output, "the report view has it, too")
    that("--no-such-option" in (told["usage"]["error"] or ""), "an unknown argument is told")


def check_interpreter(that, source, program):
    sys.path.insert(0, os.path.join(HERE, os.pardir, "linuxcnc"))
    try:
        import interpreter_check
        from machine_model import Machine
    except ImportError as error:  # numpy
        print(f"not checked with LinuxCNC's interpreter: {error}")
        return
    reason = interpreter_check.reason_to_skip()
    if reason:
        print(f"not checked with LinuxCNC's interpreter: {reason}")
        return
    machine = Machine(os.path.join(source, "machines/table_table_bc/machine.toml"))
    that(interpreter_check.Checker(machine, {}, {}).check(program), "LinuxCNC's interpreter accepts the program")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    for name in ("smoothpost", "source", "work"):
        parser.add_argument(f"--{name}", required=True)
    given = parser.parse_args()
    if shutil.which("freecadcmd") is None:
        print("skipped: the Debian package freecad is not installed")
        sys.exit(SKIP)
    work = os.path.abspath(given.work)
    shutil.rmtree(work, ignore_errors=True)
    os.makedirs(work)
    home = home_with_addon(work, os.path.join(os.path.abspath(given.source), "postproc/hosts/freecad"))
    machine = os.path.join(os.path.abspath(given.source), "machines/table_table_bc/machine.toml")
    told, output = run_freecad(f"--smoothpost {given.smoothpost} -m {machine} --input-machine {machine} --tool 1=60",
                               work, home)
    verdicts = Verdicts()
    version = subprocess.run([given.smoothpost, "--version"], capture_output=True, text=True, check=True).stdout.split()[-1]
    verdicts.that(f"smoothpost addon {version}" in output, f"FreeCAD's start names the addon's version, {version}")
    verdicts.that(f"smoothpost_post {version} with smoothpost {version}" in output, "the post names both versions")
    check_job(verdicts.that, told, work)
    check_inverse(verdicts.that, told, work)
    check_refusals(verdicts.that, told, work, output)
    check_interpreter(verdicts.that, given.source, os.path.join(work, "job.ngc"))
    print(f"{verdicts.failed} checks FAILED" if verdicts.failed else "accepted")
    sys.exit(1 if verdicts.failed else 0)


if __name__ == "__main__":
    main()
