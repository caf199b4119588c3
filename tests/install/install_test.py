#!/usr/bin/env python3
"""Installs the build into a prefix, moves the prefix, and uses it as a stranger would."""

import argparse
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path


def run(*command, **options):
    """Runs a command; its output, or the end of the test with what it said."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, **options)
    if done.returncode != 0:
        print("$", *command)
        print(done.stdout + done.stderr)
        sys.exit(f"failed with status {done.returncode}")
    return done.stdout


def expect(holds, what):
    if not holds:
        sys.exit(f"not so: {what}")


def find(prefix, pattern):
    found = sorted(prefix.glob(pattern))
    expect(found, f"{pattern} is installed")
    return found[0]


def check_layout(prefix):
    """Every kind of file has its place, and nothing private came along."""
    header = prefix / "include/smoothpost/smoothpost.h"
    expect(header.exists(), "the C header is installed")
    installed_headers = list((prefix / "include").rglob("*.h*"))
    expect(all("smoothpost" in file.parts for file in installed_headers), "only smoothpost/ is under include")
    library = find(prefix, "lib/**/libsmoothpost.so").parent
    versioned = [file.name for file in library.glob("libsmoothpost.so.*")]
    expect(len(versioned) >= 2, f"library and soname link are installed, not only {versioned}")
    expect(not list(prefix.rglob("*.a")), "no static library is installed")
    soname = run("objdump", "-p", library / "libsmoothpost.so")
    expect(re.search(r"SONAME\s+libsmoothpost\.so\.\d", soname), "the library has a versioned soname")
    for machine in ("laser_5p1", "table_table_ac", "table_table_bc"):
        expect((prefix / "share/smoothpost/machines" / machine / "machine.toml").exists(), f"{machine} is installed")
    expect(not list((prefix / "share/smoothpost/machines").rglob("*.cpp")), "no source is under share")
    return library


def main():
    parser = argparse.ArgumentParser()
    for name in ("cmake", "compiler", "build", "flags", "stranger"):
        parser.add_argument(f"--{name}", required=name != "flags", default="")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        run(given.cmake, "--install", given.build, "--prefix", folder / "first")
        prefix = folder / "moved prefix"
        (folder / "first").rename(prefix)
        library = check_layout(prefix)
        clean = {key: value for key, value in os.environ.items()
                 if key not in ("LD_LIBRARY_PATH", "CMAKE_PREFIX_PATH", "SMOOTHPOST_MACHINES")}

        # The tool works from the moved prefix, in a folder of its own, with the installed machines.
        listing = run(prefix / "bin/smoothpost", "machines", "list", cwd=folder, env=clean)
        expect("laser_5p1" in listing, "the installed tool finds the installed machines")
        shown = run(prefix / "bin/smoothpost", "machines", "show", "laser_5p1", cwd=folder, env=clean)
        expect("laser_5p1" in shown, "machines show names the machine")

        # FreeCAD's post finds the tool that it was installed with.
        post = prefix / "share/smoothpost/hosts/freecad/posts"
        found = run(sys.executable, "-B", "-c", "import smoothpost_post; print(smoothpost_post.find_tool(None))",
                    cwd=post, env={key: value for key, value in clean.items() if key != "SMOOTHPOST"})
        expect(Path(found.strip()).samefile(prefix / "bin/smoothpost"), f"the post finds {found.strip()}")
        expect((prefix / "share/smoothpost/hosts/freecad/package.xml").exists(), "FreeCAD's addon is installed")
        expect((prefix / "share/smoothpost/hosts/linuxcnc/filter.ini").exists(), "LinuxCNC's filter section is installed")

        # find_package
        build = folder / "stranger_cmake"
        run(given.cmake, "-S", given.stranger, "-B", build, f"-DCMAKE_PREFIX_PATH={prefix}",
            f"-DCMAKE_C_COMPILER={given.compiler}", f"-DCMAKE_C_FLAGS={given.flags}", env=clean)
        run(given.cmake, "--build", build, env=clean)
        by_cmake = run(build / "stranger", env=clean)

        # pkg-config; the prefix has a blank in its name, so each flag keeps its quoting through a shell.
        pc = find(prefix, "lib/**/smoothpost.pc")
        program = folder / "stranger_pkg_config"
        run("sh", "-c", f"""set -e
            flags=$(PKG_CONFIG_PATH='{pc.parent}' pkg-config --cflags --libs smoothpost)
            eval '{given.compiler}' {given.flags} -std=c99 -Wall -Werror -pedantic -o "'{program}'" "'{given.stranger}/main.c'" "$flags"
            """, env=clean)
        by_pkg_config = run(program, env=clean | {"LD_LIBRARY_PATH": str(library)})
        expect(by_cmake == by_pkg_config and by_cmake.startswith("abi "), "both ways run the same library")
        print(f"installed, moved, built both ways: {by_cmake.strip()}")


if __name__ == "__main__":
    main()
