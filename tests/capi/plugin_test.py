#!/usr/bin/env python3
"""The hosts of examples/plugin, in C and in Python, make what the tool makes, and can cancel.

  plugin_test.py --tool TOOL --host HOST --shared-object LIBRARY --source ROOT --work FOLDER
"""

import argparse
import importlib.util
import shutil
import subprocess
import sys
from pathlib import Path


def expect(holds, what):
    if not holds:
        sys.exit(f"not so: {what}")


def main():
    parser = argparse.ArgumentParser()
    for name in ("tool", "host", "shared-object", "source", "work"):
        parser.add_argument(f"--{name}", required=True, type=Path)
    given = parser.parse_args()
    shutil.rmtree(given.work, ignore_errors=True)
    by_tool, by_host = given.work / "tool", given.work / "host"
    for folder in (by_tool, by_host):
        folder.mkdir(parents=True)
    part = given.source / "examples/benchmark/pole.csv"

    subprocess.run([given.tool, "convert", part, "-m", "table_table_bc", "--input-machine", "table_table_ac", "--tool",
                    "1=60", "-o", by_tool / "out.ngc", "--report", by_tool / "page.html", "--plots", by_tool,
                    "--json", given.work / "tool.json"], check=True, capture_output=True)
    expected = {file.name: file.read_bytes() for file in by_tool.iterdir()}

    call = [given.host, part, "table_table_bc", "table_table_ac", "1=60", by_host]
    said = subprocess.run(call, check=True, capture_output=True, text=True)
    expect(said.stdout.startswith("certified"), "the C host says the summary: " + said.stdout)
    expect("%" in said.stderr, "the C host shows progress")
    made = {file.name: file.read_bytes() for file in by_host.iterdir()}
    expect(made == expected, f"the C host has the tool's files: {sorted(made)} and {sorted(expected)}")

    shutil.rmtree(by_host)
    by_host.mkdir()
    said = subprocess.run([*call, "50"], check=False, capture_output=True, text=True)
    expect(said.returncode == 2 and said.stdout.startswith("cancelled in stage"), "the C host cancels: " + said.stdout)
    expect("[US190]" in said.stderr and not (by_host / "out.ngc").exists(), "a cancelled run has no program")

    spec = importlib.util.spec_from_file_location("convert", given.source / "examples/plugin/convert.py")
    module = importlib.util.module_from_spec(spec)
    sys.dont_write_bytecode = True
    spec.loader.exec_module(module)
    smoothpost = module.Smoothpost(given.shared_object, given.source / "postproc/capi/include/smoothpost/smoothpost.h")
    options = {"command": "convert", "input": str(part), "machine": "table_table_bc", "tool": ["1=60"], "output": "-",
               "input_machine": "table_table_ac", "report": "-", "plots": "-"}
    stages = []
    result = smoothpost.run(progress=lambda stage, share: stages.append((stage, share)) or True, **options)
    expect(result.status == 0 and result.verdict == "certified", "Python converts")
    expect(result.program == expected["out.ngc"] and result.page == expected["page.html"], "Python has the same bytes")
    expect(result.report == (given.work / "tool.json").read_bytes(), "and the same report")
    expect({f"{name}.svg": svg for name, svg in result.plots.items()} ==
           {name: svg for name, svg in expected.items() if name.endswith(".svg")}, "and the same plots")
    expect(len({stage for stage, _ in stages}) > 1 and all(0 <= share <= 1 for _, share in stages), "progress")
    result = smoothpost.run(progress=lambda stage, share: False, **options)
    expect(result.status == 2 and result.diagnostics[-1]["code"] == "US190" and not result.program, "Python cancels")
    result = smoothpost.run(command="convert", input="no such file.ngc", machine="table_table_bc")
    expect(result.status == 4 and result.diagnostics[0]["code"] == "US130", "Python gets diagnostics")
    result = smoothpost.run(command="machines", arguments=["list"])
    expect("laser_5p1" in result.text, "Python gets text")
    print("C and Python hosts: the tool's bytes, progress, cancelling, diagnostics")


if __name__ == "__main__":
    main()
