#!/usr/bin/env python3
"""Makes the Debian package with cpack, installs it with dpkg below a folder, runs it there, and removes it without a
trace. What it depends on has to be installed here, since the tool is run here.

  package_test.py --cpack CPACK --build BUILD --source ROOT --work FOLDER

Exit status 77: no dpkg, or not root, which dpkg has to be to install.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

SKIPPED = 77


def run(*command, **options):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False, **options)
    if done.returncode != 0:
        print("$", *command)
        sys.exit(f"{done.stdout}{done.stderr}status {done.returncode}")
    return done.stdout


def expect(holds, what):
    if not holds:
        sys.exit(f"not so: {what}")


def dpkg(root, *arguments):
    # The folder has no libraries of its own (dependencies are looked at by check_dependencies()) and no shell for the
    # package's script, which calls ldconfig.
    return run("dpkg", f"--root={root}", "--force-depends", "--force-script-chrootless", "--log=/dev/null", *arguments)


def empty_system(root):
    for folder in ("var/lib/dpkg/info", "var/lib/dpkg/updates", "var/lib/dpkg/triggers", "tmp"):
        (root / folder).mkdir(parents=True)
    (root / "var/lib/dpkg/status").touch()


def files_below(root):
    return {str(file.relative_to(root)) for file in root.rglob("*")
            if not file.is_dir() and not str(file.relative_to(root)).startswith("var/lib/dpkg/")}


def check_dependencies(package):
    depends = run("dpkg-deb", "--field", package, "Depends")
    names = [re.split(r"[ (|]", part.strip())[0] for part in depends.split(",")]
    expect("libc6" in names and "libnlopt0" in names, "dependencies were found out: " + depends)
    for name in names:
        state = run("dpkg-query", "--show", "--showformat=${db:Status-Status}", name)
        expect(state == "installed", f"{name}, which the package depends on, is installed here")
    return names


def main():
    parser = argparse.ArgumentParser()
    for name in ("cpack", "build", "source", "work"):
        parser.add_argument(f"--{name}", required=True, type=Path)
    given = parser.parse_args()
    if not shutil.which("dpkg") or not shutil.which("dpkg-shlibdeps"):
        print("skipped: dpkg or dpkg-shlibdeps is not installed")
        sys.exit(SKIPPED)
    if os.getuid() != 0:
        print("skipped: dpkg installs as root only")
        sys.exit(SKIPPED)
    shutil.rmtree(given.work, ignore_errors=True)
    made, root = given.work / "made", given.work / "root"
    made.mkdir(parents=True)
    empty_system(root)

    # This package stays here (docs/licences.md).
    run(given.cpack, "--config", given.build / "CPackConfig.cmake", "-G", "DEB", "-B", made,
        "-D", "CPACK_SMOOTHPOST_FOR_OWN_USE=ON")
    packages = list(made.glob("*.deb"))
    expect(len(packages) == 1, f"one package: {packages}")
    names = check_dependencies(packages[0])

    before = files_below(root)
    dpkg(root, "--install", packages[0])
    installed = files_below(root) - before
    for wanted in ("usr/bin/smoothpost", "usr/share/man/man1/smoothpost.1",
                   "usr/share/bash-completion/completions/smoothpost", "usr/share/zsh/vendor-completions/_smoothpost",
                   "usr/share/fish/vendor_completions.d/smoothpost.fish", "usr/include/smoothpost/smoothpost.h",
                   "usr/share/smoothpost/machines/laser_5p1/machine.toml"):
        expect(wanted in installed, f"{wanted} is in the package")
    expect(all(name.startswith("usr/") for name in installed), "everything is below /usr")
    expect("installed" in run("dpkg-query", f"--admindir={root}/var/lib/dpkg", "--show",
                              "--showformat=${db:Status-Status}", "smoothpost"), "dpkg knows the package")

    clean = {key: value for key, value in os.environ.items() if key not in ("LD_LIBRARY_PATH", "SMOOTHPOST_MACHINES")}
    tool = root / "usr/bin/smoothpost"
    linked = run("ldd", tool, env=clean)
    expect(str(root) in linked and "not found" not in linked, "the tool runs with the package's library:\n" + linked)
    run(tool, "convert", given.source / "examples/mill_ac/mill_ac.ngc", "--input-machine", "table_table_ac",
        "-m", "table_table_bc", "--tool", "1=60", "-o", given.work / "out.ngc", env=clean, cwd=given.work)
    expect((given.work / "out.ngc").stat().st_size > 10000, "the installed tool converts")

    dpkg(root, "--purge", "smoothpost")
    left = files_below(root) - before
    expect(not left, f"nothing is left after removing: {sorted(left)[:5]}")
    expect(not (root / "usr").exists() or not any((root / "usr").rglob("*smoothpost*")), "no folder is left")
    print(f"{packages[0].name}: {packages[0].stat().st_size / 1e6:.1f} MB, {len(installed)} files, "
          f"{len(names)} dependencies; installed, ran, removed")


if __name__ == "__main__":
    main()
