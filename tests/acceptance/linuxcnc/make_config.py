#!/usr/bin/python3
"""Writes a headless LinuxCNC configuration for a machine file.

    make_config.py MACHINE.toml OUTDIR [--kins triv|trt|head] [--g54 X=1.5,C=2] [--g92 X=1] [--tool 1=50]

triv: joint i is the i-th axis of the file and the words of a program are joints. trt: the axes go
through LinuxCNC's own xyzac-trt-kins or xyzbc-trt-kins; M428 switches tool-centre-point mode on
and M429 off again. head: they go through its 5axiskins, a head C B with a pivot PIVOT_LENGTH above
the tip, which is on from the start and needs the letters X Y Z B C W. --g54 and --g92 leave a work offset or a G92 shift alive in the controller;
--tool sets the length of a tool (tool table column Z).

In OUTDIR: headless.ini, headless.hal, tool.tbl, headless.var, subroutines/, channels.json (the
columns of the sampler's log, after its index column).
"""
import argparse
import json
import math
import os

from machine_model import Machine, fail

AXIS_ORDER = "XYZABCUVW"
OUTPUTS = 4          # digital outputs logged
SAMPLER_DEPTH = 16384  # samples
PIVOT_LENGTH = 250.0   # mm, of 5axiskins


def parse_assignments(text):
    """"X=1.5,C=2" as a dictionary."""
    values = {}
    for item in filter(None, (text or "").split(",")):
        name, _, value = item.partition("=")
        values[name.strip().upper()] = float(value)
    return values


def trt_module(machine):
    """Kernel module for a table-table machine, or None where LinuxCNC has none for it.

    The modules know two table axes that pass through the machine's zero; offsets between them are
    not used here, so a machine file with other origins is refused.
    """
    tables = [axis for axis in machine.axes if axis.on_workpiece and axis.rotary]
    heads = [axis for axis in machine.axes if not axis.on_workpiece and axis.rotary]
    letters = "".join(axis.letter for axis in tables)
    if heads or letters not in ("AC", "BC"):
        return None
    if any(abs(axis.origin @ axis.origin - (axis.origin @ axis.direction) ** 2) > 1e-12
           for axis in tables):
        return None
    return f"xyz{letters.lower()}-trt-kins"


def fits_head_module(machine):
    """Whether 5axiskins has the axes of the machine; its head turns about C, then B."""
    heads = [axis.letter for axis in machine.axes if axis.rotary and not axis.on_workpiece]
    return heads == ["C", "B"] and sorted(machine.letters) == sorted("XYZBCW")


def kinematics_text(machine, kins):
    coordinates = f"coordinates={machine.letters.lower()}"
    if kins == "trt":
        return f"{trt_module(machine)} {coordinates} sparm=identityfirst"
    if kins == "head":
        return f"5axiskins {coordinates}"
    return f"trivkins {coordinates} kinstype=both"


def ini_text(machine, kins):
    coordinates = "".join(sorted(machine.letters, key=AXIS_ORDER.index))
    linear = [axis for axis in machine.axes if not axis.rotary]
    rotary = [axis for axis in machine.axes if axis.rotary]
    together = lambda values: math.sqrt(sum(value * value for value in values))
    sections = [
        ("EMC", [("VERSION", "1.1"), ("MACHINE", machine.name), ("DEBUG", 0)]),
        ("DISPLAY", [("DISPLAY", "./headless_display.py")]),
        ("RS274NGC", [("PARAMETER_FILE", "headless.var"), ("SUBROUTINE_PATH", "./subroutines"),
                      ("REMAP", "M428 modalgroup=10 ngc=tcp_on"),
                      ("REMAP", "M429 modalgroup=10 ngc=tcp_off")]),
        ("EMCMOT", [("EMCMOT", "motmod"), ("COMM_TIMEOUT", 4.0), ("SERVO_PERIOD", 1000000)]),
        ("TASK", [("TASK", "milltask"), ("CYCLE_TIME", 0.001)]),
        ("HAL", [("HALFILE", "headless.hal")]),
        ("EMCIO", [("EMCIO", "io"), ("CYCLE_TIME", 0.1), ("TOOL_TABLE", "tool.tbl")]),
        ("KINS", [("KINEMATICS", kinematics_text(machine, kins)), ("JOINTS", len(machine.axes))]),
        ("TRAJ", [("COORDINATES", coordinates), ("LINEAR_UNITS", "mm"), ("ANGULAR_UNITS", "degree"),
                  ("DEFAULT_LINEAR_VELOCITY", together(a.velocity for a in linear)),
                  ("MAX_LINEAR_VELOCITY", together(a.velocity for a in linear)),
                  ("DEFAULT_LINEAR_ACCELERATION", together(a.acceleration for a in linear)),
                  ("MAX_LINEAR_ACCELERATION", together(a.acceleration for a in linear)),
                  ("DEFAULT_ANGULAR_VELOCITY", together(a.velocity for a in rotary)),
                  ("MAX_ANGULAR_VELOCITY", together(a.velocity for a in rotary)),
                  ("NO_FORCE_HOMING", 1)]),
    ]
    for index, axis in enumerate(machine.axes):
        limits = [("MIN_LIMIT", axis.minimum), ("MAX_LIMIT", axis.maximum),
                  ("MAX_VELOCITY", axis.velocity), ("MAX_ACCELERATION", axis.acceleration)]
        sections.append((f"AXIS_{axis.letter}", limits))
        home = axis.home_position()
        # Homing in place: no search, so the joint is declared to stand at HOME_OFFSET, which is HOME.
        sections.append((f"JOINT_{index}", limits + [
            ("TYPE", "ANGULAR" if axis.rotary else "LINEAR"), ("HOME", home), ("HOME_OFFSET", home),
            ("HOME_SEARCH_VEL", 0), ("HOME_LATCH_VEL", 0), ("HOME_SEQUENCE", 0), ("FERROR", 10),
            ("MIN_FERROR", 10)]))
    lines = []
    for name, entries in sections:
        lines.append(f"[{name}]")
        lines += [f"{key} = {value!r}" if isinstance(value, float) else f"{key} = {value}"
                  for key, value in entries]
    return "\n".join(lines) + "\n"


def hal_channels(machine):
    """Columns of the log: (name, HAL pin, sampler type)."""
    channels = [("line", "motion.program-line", "s"), ("motion_type", "motion.motion-type", "s")]
    channels += [(f"joint_{axis.name}", f"joint.{index}.pos-cmd", "f")
                 for index, axis in enumerate(machine.axes)]
    channels.append(("velocity", "motion.current-vel", "f"))
    channels += [(f"output_{n}", f"motion.digital-out-{n:02d}", "b") for n in range(OUTPUTS)]
    channels.append(("spindle", "spindle.0.on", "b"))
    return channels


def hal_text(machine, kins):
    channels = hal_channels(machine)
    lines = [
        "loadrt [KINS]KINEMATICS",
        "loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS "
        "num_dio=8 num_aio=8",
        f"loadrt sampler depth={SAMPLER_DEPTH} cfg=" + "".join(kind for _, _, kind in channels),
        "addf motion-command-handler servo-thread",
        "addf motion-controller servo-thread",
        "addf sampler.0 servo-thread",
        "setp sampler.0.enable 0",
    ]
    lines += [f"net loop-{n} joint.{n}.motor-pos-cmd joint.{n}.motor-pos-fb"
              for n in range(len(machine.axes))]
    lines += [f"net log-{n} {pin} sampler.0.pin.{n}" for n, (_, pin, _) in enumerate(channels)]
    lines += [
        "net enable iocontrol.0.user-enable-out iocontrol.0.emc-enable-in",
        "net tool-prepare iocontrol.0.tool-prepare iocontrol.0.tool-prepared",
        "net tool-change iocontrol.0.tool-change iocontrol.0.tool-changed",
    ]
    if kins == "trt":
        lines.append("net kinematics-type motion.analog-out-03 motion.switchkins-type")
        lines.append(f"net tool-length motion.tooloffset.z {trt_module(machine)}.tool-offset")
    if kins == "head":
        lines.append(f"setp 5axiskins.pivot-length {PIVOT_LENGTH}")
    return "\n".join(lines) + "\n"


def parameter_text(g54, g92):
    """Persistent parameters: every offset 0 but those given; #5210 tells of a live G92."""
    values = {number: 0.0 for number in [*range(5161, 5170), *range(5181, 5190), 5210,
                                         *range(5211, 5220)]}
    values[5220] = 1.0
    for system in range(9):
        values.update({5221 + 20 * system + n: 0.0 for n in range(10)})
    for letter, value in g54.items():
        values[5221 + (AXIS_ORDER + "R").index(letter)] = value
    for letter, value in g92.items():
        values[5211 + AXIS_ORDER.index(letter)] = value
        values[5210] = 1.0
    return "".join(f"{number}\t{value:.6f}\n" for number, value in sorted(values.items()))


def subroutine_text(name, kins_type):
    return f"o<{name}> sub\nM68 E3 Q{kins_type}\nM66 E0 L0\no<{name}> endsub\nM2\n"


def tool_text(tools):
    lengths = {1: 0.0, 2: 0.0}
    lengths.update(tools)
    return "".join(f"T{number} P{number} D0 Z{length}\n" for number, length in sorted(lengths.items()))


def write_config(machine, outdir, kins="triv", g54=None, g92=None, tools=None):
    if kins == "trt" and trt_module(machine) is None:
        raise ValueError(f"{machine.name}: LinuxCNC has no table-table kinematics for this chain")
    if kins == "head" and not fits_head_module(machine):
        raise ValueError(f"{machine.name}: 5axiskins has other axes than this machine")
    os.makedirs(os.path.join(outdir, "subroutines"), exist_ok=True)
    files = {
        "headless.ini": ini_text(machine, kins), "headless.hal": hal_text(machine, kins),
        "tool.tbl": tool_text(tools or {}), "headless.var": parameter_text(g54 or {}, g92 or {}),
        "subroutines/tcp_on.ngc": subroutine_text("tcp_on", 1),
        "subroutines/tcp_off.ngc": subroutine_text("tcp_off", 0),
        "channels.json": json.dumps([name for name, _, _ in hal_channels(machine)]) + "\n",
    }
    for name, text in files.items():
        with open(os.path.join(outdir, name), "w", encoding="ascii") as file:
            file.write(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("machine")
    parser.add_argument("outdir")
    parser.add_argument("--kins", choices=("triv", "trt", "head"), default="triv")
    parser.add_argument("--g54", default="")
    parser.add_argument("--g92", default="")
    parser.add_argument("--tool", action="append", default=[], metavar="N=LENGTH")
    arguments = parser.parse_args()
    tools = {int(item.partition("=")[0]): float(item.partition("=")[2]) for item in arguments.tool}
    try:
        write_config(Machine(arguments.machine), arguments.outdir, arguments.kins,
                     parse_assignments(arguments.g54), parse_assignments(arguments.g92), tools)
    except (ValueError, KeyError) as error:
        fail(f"make_config.py: {arguments.machine}: {error}")


if __name__ == "__main__":
    main()
