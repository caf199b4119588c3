#!/usr/bin/env python3
"""Runs one job file by the engines of docs/how_to/cluster.md, with the commands as that page prints them, and compares
with what `smoothpost batch` makes alone: every file byte for byte, and nothing left to run.

  engines_test.py parallel|slurm --smoothpost TOOL --source ROOT --work FOLDER

Exit status 77: the engine is not installed, or may not be started here. Slurm is a cluster of one node whose daemons
this test starts and stops: own configuration, own key, own ports.
"""

import argparse
import os
import re
import shutil
import socket
import subprocess
import sys
import time
from pathlib import Path

SKIPPED = 77
JOBS = 8
NEEDED = {"parallel": ["parallel"], "slurm": ["munged", "slurmctld", "slurmd", "sbatch", "sinfo"]}


def skip(reason):
    print("skipped:", reason)
    sys.exit(SKIPPED)


def expect(holds, what):
    if not holds:
        sys.exit(f"not so: {what}")


def write_jobs(folder):
    """Short milling paths as CSV, one of them unlike the others in its option."""
    folder.mkdir(parents=True)
    text = '[defaults]\nmachine = "table_table_bc"\n'
    for i in range(1, JOBS + 1):
        rows = "".join(f"{10 * k},{i * k},{-k},0,0.0{k},1,900\n" for k in range(5))
        (folder / f"part{i}.csv").write_text("x_mm,y_mm,z_mm,i,j,k,feed_mm_per_min\n" + rows, encoding="utf-8")
        text += f'\n[[job]]\ninput = "part{i}.csv"\n'
    (folder / "jobs.toml").write_text(text + 'tip-tolerance = "0.02"\n', encoding="utf-8")


def results(folder):
    """Bytes of every result by name."""
    root = folder / "jobs_results"
    return {str(file.relative_to(root)): file.read_bytes() for file in sorted(root.rglob("*"))
            if file.is_file()}


def code_blocks(page, heading):
    section = page.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    return re.findall(r"```(?:sh)?\n(.*?)```", section, re.DOTALL)


def run(command, folder, environment, seconds=600):
    done = subprocess.run(["bash", "-euo", "pipefail", "-c", command], cwd=folder, env=environment, text=True,
                          capture_output=True, timeout=seconds)
    if done.returncode != 0:
        sys.exit(f"$ {command}\n{done.stdout}{done.stderr}status {done.returncode}")
    return done.stdout + done.stderr


class Slurm:
    """munged, slurmctld and slurmd of a cluster that is this machine."""

    CONFIG = """ClusterName=one
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmctldPort={port}
SlurmdPort={next_port}
AuthType=auth/munge
AuthInfo=socket={run}/munge.socket
CryptoType=crypto/munge
StateSaveLocation={run}/state
SlurmdSpoolDir={run}/spool
SlurmctldPidFile={run}/slurmctld.pid
SlurmdPidFile={run}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} State=UNKNOWN
PartitionName=all Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""

    def __init__(self, run_folder):
        # A socket's path may not be long.
        self.run = run_folder
        self.started = []

    def __enter__(self):
        for folder in (self.run, self.run / "state", self.run / "spool"):
            folder.mkdir(mode=0o700)
        key = self.run / "key"
        key.write_bytes(os.urandom(128))
        key.chmod(0o400)
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        config = self.run / "slurm.conf"
        config.write_text(self.CONFIG.format(host=socket.gethostname().split(".")[0], port=port, next_port=port + 1,
                                             run=self.run, cpus=os.cpu_count()), encoding="utf-8")
        self.environment = {"SLURM_CONF": str(config)}
        self.start("munged", "--foreground", "--force", f"--key-file={key}", f"--socket={self.run}/munge.socket",
                   f"--pid-file={self.run}/munged.pid", f"--log-file={self.run}/munged.log",
                   f"--seed-file={self.run}/seed")
        time.sleep(1)
        self.start("slurmctld", "-D", "-c")
        self.start("slurmd", "-D")
        return self

    def start(self, *command):
        with open(self.run / f"{command[0]}.out", "wb") as out:
            self.started.append(subprocess.Popen(command, stdout=out, stderr=subprocess.STDOUT,
                                                 stdin=subprocess.DEVNULL, env=os.environ | self.environment))

    def ready(self, environment):
        for _ in range(60):
            said = subprocess.run(["sinfo", "--noheader", "--format=%t"], env=environment, capture_output=True,
                                  text=True, check=False).stdout
            if said.strip() == "idle":
                return True
            if any(process.poll() is not None for process in self.started):
                return False
            time.sleep(0.5)
        return False

    def __exit__(self, *_):
        for process in reversed(self.started):
            process.terminate()
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        shutil.rmtree(self.run, ignore_errors=True)


def by_parallel(page, folder, environment):
    return run(code_blocks(page, "GNU parallel")[0], folder, environment)


def by_slurm(page, folder, environment):
    if os.getuid() != 0:
        skip("slurmd has to be started by root")
    script, commands = code_blocks(page, "Slurm")[:2]
    # The page asks for two processors a task.
    if os.cpu_count() < 2:
        skip("the page's script asks for two processors")
    (folder / "post.sh").write_text(script, encoding="utf-8")
    with Slurm(Path(f"/tmp/smoothpost_slurm_{os.getpid()}")) as slurm:
        environment = environment | slurm.environment
        if not slurm.ready(environment):
            said = "".join(file.read_text(errors="replace")[-2000:] for file in sorted(slurm.run.glob("*.out")))
            skip("the daemons of Slurm do not come up here:\n" + said)
        return run(commands, folder, environment)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("engine", choices=sorted(NEEDED))
    for name in ("smoothpost", "source", "work"):
        parser.add_argument(f"--{name}", required=True, type=Path)
    given = parser.parse_args()
    missing = [program for program in NEEDED[given.engine] if not shutil.which(program)]
    if missing:
        skip("not installed: " + " ".join(missing))
    shutil.rmtree(given.work, ignore_errors=True)
    environment = os.environ | {"PATH": f"{given.smoothpost.parent}:{os.environ['PATH']}"}
    alone, shared = given.work / "alone", given.work / "shared"
    for folder in (alone, shared):
        write_jobs(folder)
    run("smoothpost batch jobs.toml", alone, environment)
    page = (given.source / "docs/how_to/cluster.md").read_text(encoding="utf-8")
    said = {"parallel": by_parallel, "slurm": by_slurm}[given.engine](page, shared, environment)
    expect(f"{JOBS} jobs: {JOBS} certified; {JOBS} finished before" in said,
           "the closing command finds every job finished:\n" + said)
    expected, made = results(alone), results(shared)
    expect(sorted(expected) == sorted(made), f"the same files: {sorted(expected)} and {sorted(made)}")
    different = [name for name in expected if expected[name] != made[name]]
    expect(not different, f"the same bytes: {different}")
    print(f"{given.engine}: {JOBS} jobs, {len(made)} files, the same bytes as batch alone")


if __name__ == "__main__":
    main()
