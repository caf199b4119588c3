# SPDX-License-Identifier: Apache-2.0
"""FreeCAD's Path / CAM post that hands a job to smoothpost and gives back the certified program.

Works in FreeCAD 0.20, where the Path workbench calls export(objects, file, arguments) and the post
writes the file, and in 1.x, where the CAM workbench calls it with "-" once for every section and
writes what it returns. One file for both: it writes only where a file name is given, returns the text,
opens no window, and has no class that 1.x could take for a post of the new kind.

The commands of the job become a program in the words of LinuxCNC: millimetres, degrees, FreeCAD's
mm/s as mm/min, and F as it is in inverse-time mode (G93), where it counts blocks per minute. This
program goes to `smoothpost convert`; what smoothpost says of a line is shown with the operation and the
command that the line came from. A refused job gives no program: None for 1.x, an error for 0.20.
"""
import argparse
import json
import math
import os
import re
import shlex
import shutil
import subprocess
import sys

try:
    import FreeCAD
except ImportError:  # outside of FreeCAD, as in tests
    FreeCAD = None

VERSION = "0.1.0"
UNITS = "G21"
MACHINE_NAME = "smoothpost"
TOOLTIP = f"smoothpost {VERSION}: converts the job for the machine of a definition file and certifies the result"
TOOLTIP_ARGS = """Arguments are those of `smoothpost convert`, for example
-m table_table_bc --input-machine table_table_ac --tool 1=60 --work-offset G54=0,0,20
and three of this post:
--smoothpost PATH         the tool; otherwise $SMOOTHPOST, the one it was installed with, or the one on PATH
--nc FILE                 keep the program that smoothpost is given: N words of the result count its lines
--g93-feed minute|second  what F is after G93: blocks per minute (default), or FreeCAD's per-second value
"""

# Words of a command in the order in which they are written. Everything else is refused by name.
WORDS = "XYZABCUVWIJKRQPLHDTSEF"
INTEGER_WORDS = "TLHD"
ARCS = ("G2", "G3", "G02", "G03")
NORMAL_OFFSET = {"G17": "K", "G18": "J", "G19": "I"}  # FreeCAD gives every arc all three, this one as 0
COMMENT = re.compile(r"^\((.*)\)$", re.DOTALL)
NAME = re.compile(r"^([A-Za-z])(\d+(?:\.\d+)?)$")
DIGITS = 9


class Refused(RuntimeError):
    """The job has no program; why is the text."""


# --- messages ---------------------------------------------------------------------------------------

def say(severity, text):
    """To FreeCAD's report view, or to standard error outside of FreeCAD."""
    console = getattr(FreeCAD, "Console", None)
    if console is None:
        print(text, file=sys.stderr)
        return
    show = {"error": console.PrintError, "warning": console.PrintWarning}.get(severity, console.PrintMessage)
    show(text + "\n")


# --- from the job to words --------------------------------------------------------------------------

def number(value, word):
    """A decimal number without exponent or -0."""
    value = float(value)
    if not math.isfinite(value):
        raise ValueError(f"{word} is {value}")
    if word in INTEGER_WORDS:
        if value != int(value):
            raise ValueError(f"{word} is {value}, not a whole number")
        return str(int(value))
    text = f"{value:.{DIGITS}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def plain(text):
    """A text that can stand in a comment: ASCII, one line, no parentheses."""
    text = str(text).encode("ascii", "replace").decode("ascii")
    return re.sub(r"[^ -~]", " ", text).replace("(", "[").replace(")", "]")


class Program:
    """The words of a job, and for every line the operation and the command that it came from."""

    def __init__(self, g93_per_minute=True):
        self.lines = []
        self.origin = []  # (label, index of the command in the operation or None)
        self.g93_per_minute = g93_per_minute
        self.plane = "G17"
        self.inverse_time = False
        self.inverse_time_seen = False
        self.spindle = False

    def add(self, line, label, index=None):
        self.lines.append(line)
        self.origin.append((label, index))

    def text(self):
        return "\n".join(self.lines) + "\n"

    def place(self, line):
        """Of a line, counted from 1: a text for people, empty for lines of no operation."""
        if not 1 <= line <= len(self.origin):
            return ""
        label, index = self.origin[line - 1]
        if index is None:
            return f"{label}" if label else ""
        return f'{label}, command {index} "{self.lines[line - 1]}"'

    def command(self, command, label, index):
        """One command of FreeCAD as one line."""
        name = command.Name.strip()
        comment = COMMENT.match(name)
        if comment:
            return self.add(f"({plain(comment.group(1))})", label, index)
        if not NAME.match(name):
            raise Refused(f'{label}, command {index}: "{name}" is no G or M word')
        mode = name.upper()
        self.follow(mode)
        parameters = dict(command.Parameters)
        if mode in ARCS and abs(parameters.get(NORMAL_OFFSET[self.plane], 1.0)) < 1e-9:
            del parameters[NORMAL_OFFSET[self.plane]]
        unknown = sorted(set(parameters) - set(WORDS))
        if unknown:
            raise Refused(f"{label}, command {index}: {name} has a parameter {unknown[0]} that has no word")
        words = [mode]
        for word in WORDS:
            if word not in parameters:
                continue
            try:
                if word == "F":
                    words += self.feed(parameters["F"], mode)
                else:
                    words.append(word + number(parameters[word], word))
            except (TypeError, ValueError) as error:
                raise Refused(f"{label}, command {index}: {name}: {error}") from error
        return self.add(" ".join(words), label, index)

    def follow(self, mode):
        """The modes on which the words of later commands depend."""
        if mode in ("G93", "G94", "G95"):
            self.inverse_time = mode == "G93"
            self.inverse_time_seen = self.inverse_time_seen or self.inverse_time
        elif mode in NORMAL_OFFSET:
            self.plane = mode
        elif mode in ("M3", "M03", "M4", "M04", "M5", "M05"):
            self.spindle = not mode.endswith("5")

    def feed(self, value, mode):
        """F in the unit of the feed mode. Rapids have no feed, and 0 is how FreeCAD says "none"."""
        if mode in ("G0", "G00") or float(value) == 0.0:
            return []
        if self.inverse_time and self.g93_per_minute:
            return ["F" + number(value, "F")]
        return ["F" + number(60.0 * float(value), "F")]


def active(operation):
    base = getattr(operation, "Base", None)
    return getattr(operation, "Active", True) and getattr(base, "Active", True)


def coolant_of(operation):
    """The M word of the operation's coolant mode, or None."""
    mode = getattr(operation, "CoolantMode", None) or getattr(getattr(operation, "Base", None), "CoolantMode", None)
    return {"Flood": "M8", "Mist": "M7"}.get(mode)


def leaves(objects):
    """Operations, tool controllers and fixtures in order, groups opened, inactive ones left out."""
    for item in objects:
        if not active(item):
            continue
        if hasattr(item, "Path"):
            yield item
        elif hasattr(item, "Group"):
            yield from leaves(item.Group)


def program_of(objects, g93_per_minute=True):
    """The words of a job. Raises Refused for a command that has none."""
    program = Program(g93_per_minute)
    program.add("(FreeCAD job)", "")
    program.add("G21 G90 G17 G94 G40 G49 G80", "")
    for item in leaves(objects):
        label = str(getattr(item, "Label", getattr(item, "Name", "operation")))
        commands = list(item.Path.Commands)
        coolant = coolant_of(item) if commands else None
        program.add(f"(operation: {plain(label)})", label)
        if coolant:
            program.add(coolant, label)
        for index, command in enumerate(commands):
            program.command(command, label, index)
            if command.Name.strip().upper() in ("M6", "M06") and "T" in command.Parameters:
                program.add(f"G43 H{number(command.Parameters['T'], 'T')}", label, index)
        if coolant:
            program.add("M9", label)
    if program.spindle:
        program.add("M5", "")
    program.add("M2", "")
    return program


# --- the tool ---------------------------------------------------------------------------------------

def find_tool(named):
    """Path of smoothpost: as it is named, $SMOOTHPOST, beside this file's installation, PATH."""
    installed = os.path.join(os.path.dirname(os.path.realpath(__file__)), *[os.pardir] * 5, "bin", "smoothpost")
    for candidate in (named, os.environ.get("SMOOTHPOST"), installed):
        if candidate and (candidate in (named, os.environ.get("SMOOTHPOST")) or os.path.exists(candidate)):
            found = shutil.which(os.path.expanduser(candidate))
            if not found:
                raise Refused(f"{candidate} is no program that can be run")
            return os.path.normpath(found)
    found = shutil.which("smoothpost")
    if not found:
        raise Refused("smoothpost was not found: say --smoothpost PATH in the job's arguments, set SMOOTHPOST, "
                      "or put it on PATH")
    return found


def environment():
    """FreeCAD's own, without the library path that an AppImage sets for itself."""
    clean = dict(os.environ)
    if "APPDIR" in clean or "APPIMAGE" in clean:
        for name in ("LD_LIBRARY_PATH", "PYTHONHOME", "PYTHONPATH"):
            clean.pop(name, None)
    return clean


def run_tool(tool, arguments, text):
    options = {"creationflags": subprocess.CREATE_NO_WINDOW} if os.name == "nt" else {}
    try:
        done = subprocess.run([tool, *arguments], input=text.encode("ascii"), capture_output=True, check=False,
                              env=environment(), **options)
    except OSError as error:
        raise Refused(f"{tool} cannot be run: {error}") from error
    return done.returncode, done.stdout.decode("utf-8", "replace"), done.stderr.decode("utf-8", "replace")


def tell(diagnostics, program):
    """What smoothpost says, each with its place in the job. Returns the errors."""
    errors = []
    for one in diagnostics:
        here = one.get("file") in ("", "<stdin>", "-")
        place = program.place(one.get("line", 0)) if here else f"{one['file']}:{one.get('line', 0)}"
        text = f"{place + ': ' if place else ''}{one['severity']}: {one['text']} [{one['code']}]"
        say(one["severity"], "smoothpost: " + text)
        if one["severity"] == "error":
            errors.append(text)
    return errors


def converted(program, tool, arguments):
    """The certified program. Raises Refused with everything that forbids it."""
    status, output, told = run_tool(tool, ["convert", "-", "--input-format", "nc", "--input-dialect", "linuxcnc",
                                           "-o", "-", "--diagnostics", "json", "--progress", "none", *arguments],
                                    program.text())
    try:
        errors = tell(json.loads(told) if told.strip() else [], program)
    except (ValueError, KeyError, TypeError):  # the command line itself was wrong: plain text
        errors = [told.strip()]
    if status != 0 or not output:
        raise Refused(f"no program (smoothpost ended with status {status}): " + ("; ".join(errors) or "no reason told"))
    return output


# --- what FreeCAD calls ------------------------------------------------------------------------------

class Arguments(argparse.ArgumentParser):
    """A wrong argument is a message, never the end of FreeCAD."""

    def error(self, message):
        raise Refused(message)


def parse(argstring):
    """(our own arguments, those of smoothpost) of the one string that FreeCAD keeps."""
    parser = Arguments(add_help=False, allow_abbrev=False, prog="smoothpost post")
    parser.add_argument("--smoothpost")
    parser.add_argument("--nc")
    parser.add_argument("--g93-feed", choices=("minute", "second"), default="minute")
    try:
        return parser.parse_known_args(shlex.split(argstring or ""))
    except ValueError as error:
        raise Refused(f"arguments {argstring!r}: {error}") from error


def post(objectslist, argstring):
    own, passed = parse(argstring)
    tool = find_tool(own.smoothpost)
    _, version, _ = run_tool(tool, ["--version"], "")
    say("message", f"smoothpost_post {VERSION} with {version.strip() or tool}")
    if version.strip() and version.split()[-1] != VERSION:
        say("warning", f"smoothpost: this post is of version {VERSION}, the tool says {version.strip()}")
    program = program_of(objectslist, own.g93_feed == "minute")
    if own.nc:
        with open(own.nc, "w", encoding="ascii", newline="\n") as file:
            file.write(program.text())
    if program.inverse_time_seen:
        say("warning", "smoothpost: the job has inverse-time feeds (G93): F is taken as "
            + ("blocks per minute" if own.g93_feed == "minute" else "blocks per second")
            + "; --g93-feed minute|second says what it is")
    return converted(program, tool, passed)


def export(objectslist, filename, argstring):
    """What FreeCAD calls: the program of a list of operations.

    With a file name (0.20) the program is written there and a refused job raises an error, so that FreeCAD
    does not take it for done. With "-" (1.x) nothing is written here and a refused job is None, which
    makes FreeCAD write no file.
    """
    try:
        text = post(objectslist, argstring)
    except Refused as refused:
        say("error", f"smoothpost: {refused}")
        if filename == "-":
            return None
        raise
    if filename != "-":
        temporary = f"{filename}.new{os.getpid()}"
        try:
            with open(temporary, "w", encoding="utf-8", newline="\n") as file:
                file.write(text)
            os.replace(temporary, filename)
        except OSError:
            if os.path.exists(temporary):
                os.remove(temporary)
            raise
    return text
