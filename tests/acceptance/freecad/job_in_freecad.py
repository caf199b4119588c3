"""Runs inside freecadcmd 0.20: a real job through the post, as FreeCAD's own loader calls it.

    SMOOTHPOST_TEST_RESULT=RESULT.json SMOOTHPOST_TEST_ARGUMENTS="..." freecadcmd job_in_freecad.py

(freecadcmd takes words with a dash for options of its own, so the post's arguments are in the environment.)
A block with a bore gets a profile with coolant, a drilling operation, and a hand-made operation for each
question that FreeCAD's operations do not ask: inverse-time feeds, and a command that the machine cannot
reach. What came of each is written to RESULT.json; freecadcmd ends with 0 whatever happens, so only that
file says that all was done.
"""
import json
import os

import FreeCAD
import Part  # noqa: F401  (registers the Part objects)
import Path
import PathScripts.PathDrilling as PathDrilling
import PathScripts.PathJob as PathJob
import PathScripts.PathPreferences as PathPreferences
import PathScripts.PathProfile as PathProfile
from PathScripts.PathPostProcessor import PostProcessor


def job_of(document):
    """A job with a profile at 600 mm/min and two bores, as its own operations make them."""
    block = document.addObject("Part::Box", "Block")
    block.Length, block.Width, block.Height = 60, 40, 15
    bore = document.addObject("Part::Cylinder", "Bore")
    bore.Radius, bore.Height = 3, 15
    bore.Placement.Base = FreeCAD.Vector(30, 20, 0)
    part = document.addObject("Part::Cut", "Part")
    part.Base, part.Tool = block, bore
    document.recompute()
    job = PathJob.Create("Job", [part], None)
    tool = job.Tools.Group[0]
    tool.HorizFeed, tool.VertFeed, tool.SpindleSpeed = "600 mm/min", "300 mm/min", 3000
    profile = PathProfile.Create("Profile")
    profile.setExpression("StepDown", None)
    profile.StepDown = 5.0
    profile.CoolantMode = "Flood"
    drilling = PathDrilling.Create("Drilling")
    top = next(f"Face{n}" for n, face in enumerate(part.Shape.Faces, 1)
               if face.Surface.TypeId == "Part::GeomCylinder")
    drilling.Base = [(job.Model.Group[0], [top])]
    document.recompute()
    return job, [tool, profile, drilling]


def operation(document, label, commands):
    made = document.addObject("Path::Feature", "Made")
    made.Label = label
    made.Path = Path.Path([Path.Command(name, words) for name, words in commands])
    return made


class Fixture:
    """The first object of a list that FreeCAD posts: the work offset and a clearance move."""

    Label = "G54"

    def __init__(self, height):
        self.Path = Path.Path([Path.Command("G54"), Path.Command(f"G0 Z{height}")])


def posted(objects, target, arguments):
    """As PathPost does it: loaded by name, then export()."""
    try:
        text = PostProcessor.load("smoothpost").export(objects, target, arguments)
        return {"text": text, "error": None}
    except Exception as error:  # pylint: disable=broad-except
        return {"text": None, "error": str(error)}


def main():
    result, arguments = os.environ["SMOOTHPOST_TEST_RESULT"], os.environ["SMOOTHPOST_TEST_ARGUMENTS"]
    folder = os.path.dirname(result)
    document = FreeCAD.newDocument()
    job, operations = job_of(document)
    fixture = Fixture(job.Stock.Shape.BoundBox.ZMax + job.SetupSheet.ClearanceHeightOffset.Value)
    head = [fixture, operations[0]]
    inverse = operation(document, "Inverse time", [
        ("G0", {"X": 0.0, "Y": 0.0}), ("G0", {"Z": 20.0}), ("G93", {}), ("G1", {"X": 10.0, "F": 12.0}),
        ("G1", {"Y": 10.0, "F": 6.0}), ("G94", {}), ("G0", {"Z": 25.0})])
    far = operation(document, "Too far", [
        ("G0", {"X": 0.0, "Y": 0.0}), ("G0", {"Z": 20.0}), ("G1", {"X": 10.0, "F": 10.0}),
        ("G1", {"X": 5000.0, "F": 10.0}), ("G0", {"Z": 25.0})])
    kept = lambda name: os.path.join(folder, name)
    told = {
        "posts": PathPreferences.allAvailablePostProcessors(),
        "cycles": [c.Name for c in operations[2].Path.Commands if c.Name in ("G81", "G82", "G83")],
        "job": posted(head + operations[1:], kept("job.ngc"), f"{arguments} --nc {kept('job_neutral.ngc')} "
                      f"--json {kept('job.json')}"),
        "dash": posted(head + operations[1:], "-", arguments),
        "inverse": posted(head + [inverse], kept("inverse.ngc"),
                          f"{arguments} --nc {kept('inverse_neutral.ngc')} --json {kept('inverse.json')}"),
        "inverse_second": posted(head + [inverse], kept("inverse_second.ngc"),
                                 f"{arguments} --g93-feed second --nc {kept('inverse_second_neutral.ngc')} "
                                 f"--json {kept('inverse_second.json')}"),
        "far": posted(head + [far], kept("far.ngc"), arguments),
        "far_dash": posted(head + [far], "-", arguments),
        "usage": posted(head + operations[1:], kept("usage.ngc"), arguments + " --no-such-option"),
    }
    with open(result, "w", encoding="utf-8") as file:
        json.dump(told, file)


main()
