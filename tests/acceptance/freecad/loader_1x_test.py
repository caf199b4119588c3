#!/usr/bin/env python3
"""The post under the contract of FreeCAD 1.x, whose package Debian 12 does not have.

    loader_1x_test.py --smoothpost TOOL --source ROOT

`load` and `write` below do what FreeCAD 1.x documents in its code: a post is found by its file name on a
list of folders; a class called as the title-cased name would make it a post of the new kind; otherwise
export(section, "-", arguments) is called once for every section, and FreeCAD writes what it returns: None
means no file, a text that starts with two line ends or has carriage returns keeps its line ends.
Needs no FreeCAD. Exit status: 0 all hold, 1 not.
"""
import argparse
import importlib.util
import os
import re
import sys
import tempfile
import types
import xml.etree.ElementTree as ElementTree

FAILED = []


def that(holds, text):
    print(f"{'ok    ' if holds else 'FAILED'} {text}", flush=True)
    if not holds:
        FAILED.append(text)


class Console:
    """What FreeCAD.Console has, collected."""

    def __init__(self):
        self.lines = []
        self.PrintMessage = self.PrintWarning = self.PrintError = self.lines.append


class Command:
    """Path.Command: a name and parameters, F in mm/s."""

    def __init__(self, Name, **Parameters):
        self.Name, self.Parameters = Name, Parameters


def operation(label, *commands, **properties):
    return types.SimpleNamespace(Label=label, Path=types.SimpleNamespace(Commands=list(commands)), **properties)


def load(folders, name):
    """(module, whether it would be taken for a post of the new kind)."""
    for folder in folders:
        path = os.path.join(folder, f"{name}_post.py")
        if os.path.exists(path):
            spec = importlib.util.spec_from_file_location(f"{name}_post", path)
            module = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(module)
            return module, hasattr(module, name.title())
    raise FileNotFoundError(name)


def write(path, text):
    if text is None:
        return
    keep = text.startswith("\n\n") or "\r" in text
    with open(path, "w", encoding="utf-8", newline="" if keep else None) as file:
        file.write(text[2:] if text.startswith("\n\n") else text)


def sections():
    """Two sections of a job, as with "split output": each with its fixture and tool."""
    tool = operation("TC: ball", Command("M6", T=1.0), Command("M3", S=2000.0))
    fixture = operation("G54", Command("G54"), Command("G0", Z=25.0))
    slot = operation("Slot", Command("(slot)"), Command("G0", X=0.0, Y=0.0), Command("G0", Z=12.0, F=50.0),
                     Command("G1", Z=8.0, F=5.0), Command("G1", X=30.0, F=10.0),
                     Command("G2", X=40.0, Y=10.0, I=0.0, J=10.0, K=0.0, F=10.0), Command("G0", Z=25.0, F=0.0),
                     CoolantMode="Flood")
    off = operation("Inactive", Command("G1", X=9999.0, F=1.0), Active=False)
    group = types.SimpleNamespace(Label="Group", Group=[
        operation("Inner", Command("G0", X=5.0, Y=5.0), Command("G0", Z=12.0), Command("G1", Z=9.0, F=2.5),
                  Command("G1", Y=25.0, F=10.0), Command("G0", Z=25.0))])
    far = operation("Far", Command("G0", X=0.0, Y=0.0), Command("G0", Z=12.0), Command("G1", X=5000.0, F=10.0))
    return [("first", [fixture, tool, slot, off]), ("second", [fixture, tool, group]), ("third", [fixture, tool, far])]


def check_export(module, console, arguments, folder):
    made = {}
    for name, items in sections():
        made[name] = module.export(items, "-", f"{arguments} --nc {os.path.join(folder, name + '_neutral.ngc')}")
        write(os.path.join(folder, name + ".ngc"), made[name])
    that(made["first"] and made["second"], "two sections are certified programs")
    that(made["third"] is None and not os.path.exists(os.path.join(folder, "third.ngc")),
         "a refused section is None, so that no file is written")
    that(any('Far, command 2 "G1 X5000 F600"' in line for line in console.lines), "and the report view says where")
    with open(os.path.join(folder, "first.ngc"), encoding="utf-8") as file:
        that(file.read() == made["first"], "the file has the text as it was returned")
    that("\r" not in made["first"] and not made["first"].startswith("\n\n"), "line ends are FreeCAD's matter")
    with open(os.path.join(folder, "first_neutral.ngc"), encoding="ascii") as file:
        neutral = file.read()
    wanted = ["G0 X0 Y0", "G0 Z12", "G1 Z8 F300", "G1 X30 F600", "G2 X40 Y10 I0 J10 F600", "G0 Z25"]
    that(re.findall(r"^G[012] [XZ].*$", neutral, re.MULTILINE)[1:] == wanted, "words, feeds in mm/min, rapids without")
    that("X9999" not in neutral, "an inactive operation is left out")
    with open(os.path.join(folder, "second_neutral.ngc"), encoding="ascii") as file:
        that("(operation: Inner)" in file.read(), "groups are opened")
    refused = module.export([operation("Bad", Command("G1", X=float("nan")))], "-", arguments)
    that(refused is None and "Bad, command 0: G1: X is nan" in console.lines[-1], "a number that is none is refused")
    that(module.export([], "-", '"') is None and "No closing quotation" in console.lines[-1],
         "arguments that cannot be split are told")


def check_versions(module, addon, tool):
    version = os.popen(f"'{tool}' --version").read().split()[-1]
    tree = ElementTree.parse(os.path.join(addon, "package.xml")).getroot()
    xml = {child.tag.rpartition("}")[2]: child for child in tree}
    that(xml["version"].text == version, f"package.xml is of version {xml['version'].text}, the tool of {version}")
    that(module.VERSION == version, "so is the post")
    sys.path.insert(0, addon)
    import smoothpost_addon
    console = Console()
    smoothpost_addon.start(console)
    that(version in console.lines[0] and smoothpost_addon.POSTS in sys.path, "the addon says its version at the start")
    content = next(child for child in xml["content"] if child.tag.endswith("Postprocessor"))
    folder = next(child.text for child in content if child.tag.endswith("subdirectory"))
    that(os.path.exists(os.path.join(addon, folder, "smoothpost_post.py")), "package.xml names the folder of the post")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    for name in ("smoothpost", "source"):
        parser.add_argument(f"--{name}", required=True)
    given = parser.parse_args()
    console = Console()
    sys.modules["FreeCAD"] = types.SimpleNamespace(Console=console)
    addon = os.path.join(given.source, "postproc/hosts/freecad")
    machine = os.path.join(given.source, "machines/table_table_bc/machine.toml")
    with tempfile.TemporaryDirectory() as folder:
        module, new_kind = load([folder, os.path.join(addon, "posts")], "smoothpost")
        that(not new_kind, "no class has the name that would make it a post of the new kind")
        that(module.UNITS == "G21" and module.TOOLTIP and module.TOOLTIP_ARGS, "what the job's page shows is there")
        check_export(module, console, f"--smoothpost '{given.smoothpost}' -m '{machine}' --input-machine '{machine}' "
                     "--tool 1=60", folder)
    check_versions(module, addon, given.smoothpost)
    sys.exit(1 if FAILED else 0)


if __name__ == "__main__":
    main()
