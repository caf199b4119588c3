#!/usr/bin/env python3
"""What the tool does with a terminal, a pipe and signals, and what it says of itself.

  cli_test.py progress|signals|documents|shells --tool TOOL --source ROOT --work FOLDER

`shells` asks zsh and fish, and man for its warnings; exit status 77 when none of them is installed.
"""

import argparse
import os
import pty
import re
import select
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

SKIPPED = 77


def expect(holds, what):
    if not holds:
        sys.exit(f"not so: {what}")


def sheet(given, *more):
    part = given.source / "examples/bent_sheet"
    return [str(given.tool), "convert", str(part / "bent_sheet.ngc"), "-m", "laser_5p1", "--input-machine", "laser_5p1",
            "-w", str(part / "bent_sheet.stl"), "--work-offset", "G54=700,600,1000", *map(str, more)]


# --- progress ----------------------------------------------------------------------------------------

def on_terminal(command):
    """What a terminal gets on standard error, and the exit status."""
    master, slave = pty.openpty()
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=slave)
    os.close(slave)
    said = b""
    while True:
        ready, _, _ = select.select([master], [], [], 120)
        if not ready:
            process.kill()
            sys.exit("the tool hangs on a terminal")
        try:
            part = os.read(master, 65536)
        except OSError:  # the other end is closed
            part = b""
        if not part:
            break
        said += part
    os.close(master)
    return said.decode(), process.wait()


def progress(given):
    out = given.work / "out.ngc"
    said, status = on_terminal(sheet(given, "-o", out))
    expect(status == 0, "certified on a terminal: " + said)
    bars = re.findall(r"\r(\S[^\r\[]*?) +\[([#.]{24})\] +(\d+) %([^\r]*?)\x1b\[K", said)
    expect(len(bars) >= 3, f"bars on a terminal: {said!r}")
    expect(len({stage for stage, _, _, _ in bars}) >= 2, f"with their stages: {bars}")
    expect(all(abs(bar.count("#") / 24 - int(percent) / 100) <= 0.04 for _, bar, percent, _ in bars), f"of length: {bars}")
    timed = [rest for _, _, _, rest in bars if rest]
    expect(timed and all(re.fullmatch(r"  [\d.e+]+ %/s  (\d+:)?\d+:\d\d left", rest) for rest in timed),
           f"rate and time left: {bars}")
    tail = said.rsplit("\x1b[K", 1)
    expect(tail[0].endswith("\r") and "\r" not in tail[1].replace("\r\n", ""), f"the bar is wiped in the end: {said[-300:]!r}")

    piped = subprocess.run(sheet(given, "--cuts", "1", "-o", out), capture_output=True, text=True, check=True)
    expect("%" not in piped.stderr and "\r" not in piped.stderr, "nothing when piped: " + piped.stderr)
    said, status = on_terminal(sheet(given, "--cuts", "1", "-o", out, "--progress", "none"))
    expect(status == 0 and "%" not in said, "nothing with none")

    filtered = subprocess.run(sheet(given, "--cuts", "1", "-o", "-", "--progress", "filter"), capture_output=True, text=True, check=True)
    lines = [line for line in filtered.stderr.splitlines() if line.startswith("FILTER")]
    expect(lines and all(re.fullmatch(r"FILTER_PROGRESS=\d+", line) for line in lines), f"filter lines: {lines}")
    numbers = [int(line.split("=")[1]) for line in lines]
    expect(numbers == sorted(numbers) and numbers[-1] <= 100, f"that never go back: {numbers}")
    expect("FILTER" not in filtered.stdout, "standard output has the program alone")
    print(f"{len(bars)} bars, {len(lines)} filter lines: {numbers}")


# --- signals -----------------------------------------------------------------------------------------

def interrupt(given, folder, number, delay):
    """Interrupts a conversion `delay` seconds after its first progress; exit status and messages."""
    folder.mkdir()
    process = subprocess.Popen(sheet(given, "-o", folder / "out.ngc", "--json", folder / "out.json", "--report",
                                     folder / "out.html", "--progress", "filter"), stderr=subprocess.PIPE, text=True)
    said = process.stderr.readline()
    expect(said.startswith("FILTER_PROGRESS="), "progress comes first: " + said)
    time.sleep(delay)
    process.send_signal(number)
    began = time.monotonic()
    _, rest = process.communicate(timeout=120)
    return process.returncode, rest, time.monotonic() - began


def signals(given):
    stopped, longest = 0, 0.0
    for number in (signal.SIGINT, signal.SIGTERM):
        for delay in (0.0, 0.3, 1.0):
            folder = given.work / f"{number.name}_{delay}"
            status, said, seconds = interrupt(given, folder, number, delay)
            left = sorted(file.name for file in folder.iterdir())
            if status == 0:  # it was faster
                expect(left == ["out.html", "out.json", "out.ngc"], f"all files are there: {left}")
                continue
            stopped += 1
            longest = max(longest, seconds)
            expect(status == 2 and "[US190]" in said, f"{number.name} after {delay} s: status {status}, {said}")
            expect(left == ["out.html", "out.json"], f"no program, no half file: {left}")
            expect('"refused"' in (folder / "out.json").read_text(encoding="utf-8"), "the report says so")
    expect(stopped >= 2, "some runs were interrupted")
    print(f"{stopped} runs interrupted, the slowest stopped after {longest:.2f} s")


# --- what the tool says of itself --------------------------------------------------------------------

def output(*command, **options):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False, **options)
    expect(done.returncode == 0, f"{command} ends with 0: {done.stderr}")
    return done.stdout


def options_of(help_text):
    return set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", help_text.split("Options:")[1]))


def commands_of(help_text):
    return re.findall(r"^  ([a-z]+)  ", help_text.split("Subcommands:")[1], re.MULTILINE)


def complete_in_bash(script, *words):
    """What bash offers for the last of the words."""
    quoted = " ".join(f"'{word}'" for word in words)
    return set(output("bash", "-eu", "-c", f"source '{script}'; COMP_WORDS=({quoted}); COMP_CWORD={len(words) - 1}; "
                      "_smoothpost; printf '%s\\n' \"${COMPREPLY[@]}\"").split())


def documents(given):
    general = output(given.tool, "--help")
    example, usage = general.find("smoothpost convert "), general.find("Usage:")
    expect(0 <= example < usage, "help begins with a complete example")
    page = output(given.tool, "--generate", "man")
    bash = given.work / "completion.bash"
    bash.write_text(output(given.tool, "--generate", "bash"), encoding="utf-8")
    others = {shell: output(given.tool, "--generate", shell) for shell in ("zsh", "fish")}
    commands = commands_of(general)
    expect({"convert", "check", "finish", "place", "batch", "machines", "formats", "golden"} <= set(commands), f"{commands}")
    count = 0
    for command in commands:
        text = output(given.tool, command, "--help")
        expect(0 <= text.find(f"  smoothpost {command}") < text.find("Usage:"), f"help of {command} begins with an example")
        section = page.split(f".SH COMMAND {command}\n")[1].split("\n.SH ")[0].replace("\\-", "-")
        wanted = options_of(text)
        count += len(wanted)
        named = set(re.findall(r"\\fB(--[a-z-]+)\\fR", section))
        expect(named == wanted, f"the manual has the options of {command}: {sorted(named ^ wanted)}")
        completed = complete_in_bash(bash, "smoothpost", command, "--")
        expect(wanted <= completed, f"bash completes the options of {command}: {sorted(wanted - completed)}")
        for shell, script in others.items():
            for option in wanted:
                name = option if shell == "zsh" else f"-l {option[2:]}"
                expect(name in script, f"{shell} knows {option}")
    expect(set(commands) <= complete_in_bash(bash, "smoothpost", ""), "bash completes commands")
    os.environ["PATH"] = f"{given.tool.parent}:{os.environ['PATH']}"
    machines = complete_in_bash(bash, "smoothpost", "convert", "-m", "")
    expect({"laser_5p1", "robot_6r"} <= machines, f"bash completes machines: {sorted(machines)[:9]}")
    values = complete_in_bash(bash, "smoothpost", "convert", "--smoothing", "")
    expect(values == {"acr", "ramp", "none"}, f"bash completes values: {values}")
    print(f"{len(commands)} commands, {count} options in help, manual and three completions")


def shells(given):
    asked = []
    os.environ["PATH"] = f"{given.tool.parent}:{os.environ['PATH']}"
    if shutil.which("fish"):
        script = given.work / "smoothpost.fish"
        script.write_text(output(given.tool, "--generate", "fish"), encoding="utf-8")
        home = {"HOME": str(given.work), "PATH": os.environ["PATH"], "TERM": "dumb"}

        def fish(line):
            said = output("fish", "--no-config", "-c", f"source {script}; complete -C '{line}'", env=home)
            return {part.split("\t")[0] for part in said.splitlines()}
        expect({"convert", "batch"} <= fish("smoothpost "), "fish completes commands")
        expect({"--json", "--smoothing"} <= fish("smoothpost convert --"), "fish completes options")
        expect(fish("smoothpost convert --smoothing ") == {"acr", "ramp", "none"}, "fish completes values")
        expect("laser_5p1" in fish("smoothpost convert -m las"), "fish completes machines")
        asked.append("fish")
    if shutil.which("zsh"):
        folder = given.work / "zsh"
        folder.mkdir()
        (folder / "_smoothpost").write_text(output(given.tool, "--generate", "zsh"), encoding="utf-8")
        # compadd tells what would be offered.
        test = folder / "test.zsh"
        test.write_text(f"""
zmodload zsh/zpty
zpty -b z 'TERM=vt100 zsh -f -i'
zpty -w z 'fpath=({folder} $fpath); autoload -Uz compinit; compinit -u -d {folder}/dump; LISTMAX=1000; PROMPT="go""on> "'
zpty -r z line '*goon> *'
sleep 2
zpty -n -w z "$1"$'\\t\\t'
sleep 2
while zpty -rt z line; do print -r -- "$line"; done
zpty -d z
""", encoding="utf-8")

        def zsh(line):
            return output("zsh", "-f", test, line).replace("\0", "")
        said = zsh("smoothpost ")
        expect("convert" in said and "batch" in said, "zsh completes commands: " + said)
        said = zsh("smoothpost convert --smoo")
        expect("--smoothing" in said and "acr" in said, "zsh completes options and values: " + said)
        asked.append("zsh")
    if shutil.which("man"):
        page = given.work / "smoothpost.1"
        page.write_text(output(given.tool, "--generate", "man"), encoding="utf-8")
        done = subprocess.run(["man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", "-Z", page], capture_output=True,
                              text=True, check=False, env=os.environ | {"MANROFFSEQ": "", "MANWIDTH": "80"})
        expect(done.returncode == 0 and not done.stderr, "man has nothing to complain of: " + done.stderr[:2000])
        asked.append("man")
    if not asked:
        print("skipped: neither zsh nor fish nor man is installed")
        sys.exit(SKIPPED)
    print("asked:", ", ".join(asked))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("test", choices=["progress", "signals", "documents", "shells"])
    for name in ("tool", "source", "work"):
        parser.add_argument(f"--{name}", required=True, type=Path)
    given = parser.parse_args()
    shutil.rmtree(given.work, ignore_errors=True)
    given.work.mkdir(parents=True)
    {"progress": progress, "signals": signals, "documents": documents, "shells": shells}[given.test](given)


if __name__ == "__main__":
    main()
