#!/usr/bin/env python3
"""Runs the commands that pages print, as they print them, one after the other in one folder a page.

  commands_test.py --tool TOOL --source ROOT --work FOLDER PAGE...
  commands_test.py --self-test

A command block is a fenced block, without a language or sh, whose first line is a command (COMMAND below). A comment in the line
before it says what its reader has, or why it is not run here:

  <!-- run: part.ngc = examples/mill_ac/mill_ac.ngc; <name> = table_table_bc -->
  <!-- run: status 3 -->
  <!-- not run: needs Slurm, acceptance/batch/slurm runs it -->

  <!-- file: jobs.toml -->

A file named so is copied into the folder; a name in angle brackets is replaced in the commands; a block called a
file is that file, for all commands of the page. Without a comment the block has to run
from the root of the repository as it stands; ./dev, which runs this test, is left alone. Every block has to end with status 0, or the one that is said.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

COMMAND = re.compile(r"(smoothpost|build/\S+/smoothpost|\./dev|sbatch|parallel|freecadcmd|prusa-slicer|tail|#!/bin/sh)(\s|$)")
SECONDS = 600


class Block:
    def __init__(self, page, line, comment, text):
        self.where = f"{page}:{line}"
        self.comment = comment
        self.text = text


def blocks_of(page, text):
    """The command blocks of a page, the files that it prints by name, and complaints."""
    blocks, files, problems = [], {}, []
    lines = text.splitlines()
    inside, begin, language = False, 0, ""
    for number, line in enumerate(lines, 1):
        if not line.startswith("```"):
            continue
        if not inside:
            inside, begin, language = True, number, line[3:].strip()
            continue
        inside = False
        body = lines[begin:number - 1]
        comment = lines[begin - 2] if begin >= 2 and lines[begin - 2].startswith("<!--") else ""
        named = re.fullmatch(r"<!-- file: (\S+) -->", comment)
        if named:
            files[named.group(1)] = "\n".join(body) + "\n"
            continue
        first = next((row for row in body if row.strip()), "")
        if language not in ("", "sh") or not COMMAND.match(first):
            if comment.startswith(("<!-- run", "<!-- not run")):
                problems.append(f"{page}:{begin}: the comment is above what is no command: {first!r}")
            continue
        blocks.append(Block(page, begin, comment, "\n".join(body) + "\n"))
    return blocks, files, problems


def settings_of(block):
    """(reason not to run it, expected status, files, replacements)"""
    if block.text.startswith("./dev"):
        return "it sets up the machine; this test is part of it", 0, {}, {}
    if not block.comment:
        return "", 0, {}, {}
    skipped = re.fullmatch(r"<!-- not run: (\S.*) -->", block.comment)
    if skipped:
        return skipped.group(1), 0, {}, {}
    run = re.fullmatch(r"<!-- run: (.*) -->", block.comment)
    if not run:
        raise ValueError(f"{block.where}: {block.comment} is not understood")
    status, files, replaced = 0, {}, {}
    for part in run.group(1).split(";"):
        name, equals, value = (piece.strip() for piece in part.partition("="))
        if name.startswith("status ") and not equals:
            status = int(name[7:])
        elif equals and name.startswith("<"):
            replaced[name] = value
        elif equals:
            files[name] = value
        else:
            raise ValueError(f"{block.where}: {part!r} is not understood")
    return "", status, files, replaced


def prepare(folder, source, tool):
    """A folder that looks like the root of a clone after `./dev demo`."""
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "build/release/bin").mkdir(parents=True)
    for name in ("examples", "machines", "docs", "tests"):
        if (source / name).exists():
            (folder / name).symlink_to(source / name)
    (folder / "build/release/bin/smoothpost").symlink_to(tool)
    return os.environ | {"PATH": f"{folder}/build/release/bin:{os.environ['PATH']}",
                         "SMOOTHPOST_MACHINES": str(folder / "machines")}


def run_page(page, source, tool, work):
    """(blocks run, blocks not run, complaints)"""
    blocks, printed, problems = blocks_of(page, (source / page).read_text(encoding="utf-8"))
    folder = work / page.replace("/", "_")
    environment = prepare(folder, source, tool)
    for name, text in printed.items():
        (folder / name).write_text(text, encoding="utf-8")
    run = left = 0
    for block in blocks:
        try:
            reason, status, files, replaced = settings_of(block)
        except ValueError as error:
            problems.append(str(error))
            continue
        if reason:
            left += 1
            print(f"{block.where}: not run: {reason}", flush=True)
            continue
        text = block.text
        for name, value in replaced.items():
            text = text.replace(name, value)
        for name, origin in files.items():
            shutil.copy(source / origin, folder / name)
        done = subprocess.run(["bash", "-euo", "pipefail", "-c", text], cwd=folder, env=environment, text=True,
                              capture_output=True, timeout=SECONDS, check=False, stdin=subprocess.DEVNULL)
        run += 1
        if done.returncode != status:
            problems.append(f"{block.where}: status {done.returncode}, not {status}\n{text}{done.stdout}{done.stderr}")
        missing = [name for name in re.findall(r"(?:^|\s)-o\s+(\S+)", text) if name != "-" and not (folder / name).exists()]
        if status == 0 and missing:
            problems.append(f"{block.where}: {missing} were not written")
    return run, left, problems


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        tool = root / "tool"
        tool.write_text("#!/bin/sh\necho \"$@\" >> said\n[ \"$1\" != fail ] || exit 3\n[ ! -e \"$2\" ] || echo found >> said\n",
                        encoding="utf-8")
        tool.chmod(0o755)
        (root / "in.txt").write_text("x", encoding="utf-8")
        page = ("```\nsmoothpost one\n```\n```\nsome output\n```\n<!-- run: a.ngc = in.txt; <name> = mine -->\n```sh\n"
                "smoothpost two a.ngc <name>\n```\n<!-- run: status 3 -->\n```\nsmoothpost fail\n```\n"
                "<!-- not run: no host -->\n```\nsbatch x\n```\n```toml\nsmoothpost = 1\n```\n"
                "```\nsmoothpost three printed\n```\n<!-- file: printed -->\n```\nsmoothpost fail\n```\n")
        (root / "page.md").write_text(page, encoding="utf-8")
        run, left, problems = run_page("page.md", root, tool, root / "work")
        assert (run, left, problems) == (4, 1, []), (run, left, problems)
        assert (root / "work/page.md/said").read_text(encoding="utf-8") == "one\ntwo a.ngc mine\nfound\nfail\nthree printed\nfound\n"
        for faulty in ("```\nsmoothpost fail\n```\n", "<!-- run: status 3 -->\n```\nsmoothpost one\n```\n",
                       "```\nsmoothpost one -o out.ngc\n```\n", "<!-- run: nonsense -->\n```\nsmoothpost one\n```\n",
                       "<!-- not run: -->\n```\nsmoothpost one\n```\n", "<!-- run: status 0 -->\n```\noutput\n```\n",
                       "```\nsmoothpost fail | cat\n```\n", "```\nsmoothpost fail\nsmoothpost one\n```\n"):
            (root / "page.md").write_text(faulty, encoding="utf-8")
            assert run_page("page.md", root, tool, root / "work")[2], faulty
    print("self test passed")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--self-test", action="store_true")
    for name in ("tool", "source", "work"):
        parser.add_argument(f"--{name}", type=Path)
    parser.add_argument("page", nargs="*")
    given = parser.parse_args()
    if given.self_test:
        self_test()
        return 0
    total = [0, 0]
    complaints = []
    for page in given.page:
        run, left, problems = run_page(page, given.source.resolve(), given.tool.resolve(), given.work.resolve())
        total = [total[0] + run, total[1] + left]
        complaints += problems
    print("\n".join(complaints))
    print(f"{len(given.page)} pages: {total[0]} blocks run, {total[1]} not, {len(complaints)} problems")
    return 1 if complaints or total[0] == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
