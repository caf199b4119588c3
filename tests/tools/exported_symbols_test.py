#!/usr/bin/env python3
"""Checks that the shared library exports the C interface and nothing else.

  exported_symbols_test.py NM LIBRARY HEADER
"""

import re
import subprocess
import sys
from pathlib import Path

# Names that the linker itself may define in a shared library.
LINKER_NAMES = {"_init", "_fini", "__bss_start", "_edata", "_end"}


def main(nm, library, header):
    listing = subprocess.run([nm, "--dynamic", "--defined-only", "--format=posix", library],
                             check=True, capture_output=True, text=True).stdout
    exported = {line.split()[0].split("@")[0] for line in listing.splitlines() if line} - LINKER_NAMES
    text = re.sub(r"//[^\n]*|/\*.*?\*/", " ", Path(header).read_text(encoding="utf-8"), flags=re.DOTALL)
    declared = set(re.findall(r"\b(smoothpost_\w+)\s*\(", text))
    strangers = sorted(name for name in exported if not name.startswith("smoothpost_"))
    problems = [f"exported, but no part of the C interface: {name}" for name in strangers]
    problems += [f"declared in the header, but not exported: {name}" for name in sorted(declared - exported)]
    problems += [f"exported, but not declared in the header: {name}"
                 for name in sorted(exported - declared) if name.startswith("smoothpost_")]
    if not declared:
        problems.append(f"{header} declares no function")
    for problem in problems[:50]:
        print(problem)
    print(f"{len(exported)} symbols exported, {len(declared)} declared, {len(problems)} problems")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:4]))
