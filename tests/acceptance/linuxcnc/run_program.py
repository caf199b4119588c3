#!/usr/bin/python3
"""Runs one NC program in a headless LinuxCNC and logs the joints every servo cycle (1 ms).

    run_program.py CONFIGDIR PROGRAM LOG [--timeout S] [--isolation auto|namespaces|none]

CONFIGDIR comes from make_config.py. Where the kernel allows it the instance runs in private IPC,
network, process and mount namespaces with a /tmp of its own, so that it cannot meet another
LinuxCNC on the machine; otherwise runs are serialised by a lock file. LOG starts with a comment
line that names its columns. Exit status: that of the program (headless_display.py), 77 when
LinuxCNC cannot be run here at all, with the reason.
"""
import argparse
import fcntl
import json
import os
import shutil
import socket
import struct
import subprocess
import sys
import tempfile

from machine_model import fail

SKIP = 77
HERE = os.path.dirname(os.path.abspath(__file__))
NAMESPACES = ["unshare", "--ipc", "--net", "--pid", "--mount", "--fork", "--kill-child", "--mount-proc"]
NOBODY = "65534"  # rtapi_app drops to this user when it is started by root


def reason_to_skip():
    """Why LinuxCNC cannot be run here, or an empty text."""
    if shutil.which("linuxcnc") is None or shutil.which("halsampler") is None:
        return "the Debian package linuxcnc-uspace is not installed"
    if not namespaces_allowed() and os.path.exists("/tmp/linuxcnc.lock"):
        return "namespaces are forbidden here and another LinuxCNC is running (/tmp/linuxcnc.lock)"
    if os.geteuid() == 0 and not namespaces_allowed() and not os.access("/dev/shm", os.W_OK):
        return "namespaces are forbidden here and shared memory is not available"
    return ""


def namespaces_allowed():
    if os.geteuid() != 0 or shutil.which("unshare") is None:
        return False
    probe = subprocess.run(NAMESPACES + ["mount", "--bind", "/var/tmp", "/tmp"],
                           stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
    return probe.returncode == 0


def loopback_up():
    """Brings `lo` up in a new network namespace (SIOCSIFFLAGS of IFF_UP)."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        fcntl.ioctl(sock, 0x8914, struct.pack("16sh14x", b"lo", 0x1 | 0x40))


def run_inside(work):
    """In the namespaces: private /tmp, then LinuxCNC in place of this process."""
    loopback_up()
    subprocess.run(["mount", "--bind", os.path.join(work, "tmp"), "/tmp"], check=True)
    os.chdir(work)
    os.environ["RTAPI_FIFO_PATH"] = "/tmp/rtapi_fifo"
    os.execvp("linuxcnc", ["linuxcnc", "-r", "headless.ini"])


def prepare(work, config, program):
    """Copies the configuration, the program and the display to a directory of this run."""
    os.chmod(work, 0o755)
    os.mkdir(os.path.join(work, "tmp"))
    os.chmod(os.path.join(work, "tmp"), 0o1777)
    for name in os.listdir(config):
        source = os.path.join(config, name)
        if os.path.isdir(source):
            shutil.copytree(source, os.path.join(work, name))
        else:
            shutil.copy(source, os.path.join(work, name))
    shutil.copy(os.path.join(HERE, "headless_display.py"), work)
    os.chmod(os.path.join(work, "headless_display.py"), 0o755)
    shutil.copy(program, os.path.join(work, "program.ngc"))


def start(work, isolated, environment, seconds):
    """Runs LinuxCNC, its output to stdout. Returns its exit status."""
    if isolated:
        command = NAMESPACES + [sys.executable, os.path.join(HERE, "run_program.py"), "--inside", work]
        return run_command(command, work, environment, seconds)
    with open(os.path.join(tempfile.gettempdir(), f"smoothpost_linuxcnc.{os.geteuid()}.lock"), "w",
              encoding="ascii") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        environment["RTAPI_FIFO_PATH"] = os.path.join(work, "tmp", "rtapi_fifo")
        return run_command(["linuxcnc", "-r", "headless.ini"], work, environment, seconds)


def run_command(command, work, environment, seconds):
    process = subprocess.Popen(command, cwd=work, env=environment, stdin=subprocess.DEVNULL,
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                               errors="replace")
    try:
        output, _ = process.communicate(timeout=seconds)
    except subprocess.TimeoutExpired:
        process.kill()
        output, _ = process.communicate()
        print(f"run_program.py: no end after {seconds:.0f} s")
        process.returncode = 13
    told = ("operator error:", "message:", "display:")
    expected = process.returncode in (0, 15)
    for line in output.splitlines():
        if line.startswith(told) or (line.strip() and not expected):
            print(f"  linuxcnc: {line}")
    sys.stdout.flush()
    return process.returncode


def write_log(source, config, target):
    with open(os.path.join(config, "channels.json"), encoding="ascii") as file:
        columns = json.load(file)
    with open(target, "w", encoding="ascii") as out:
        out.write("# index " + " ".join(columns) + "\n")
        if os.path.exists(source):
            with open(source, encoding="ascii") as file:
                shutil.copyfileobj(file, out)


def run_program(config, program, log, timeout=60.0, isolation="auto"):
    """Exit status of the run; the log is written whatever it is."""
    isolated = isolation == "namespaces" or (isolation == "auto" and namespaces_allowed())
    work = tempfile.mkdtemp(prefix="smoothpost_linuxcnc.", dir="/var/tmp")
    try:
        prepare(work, config, program)
        samples = os.path.join(work, "samples.txt")
        environment = dict(os.environ, HOME=work, LC_ALL="C", SMOOTHPOST_LOG=samples,
                           SMOOTHPOST_PROGRAM=os.path.join(work, "program.ngc"),
                           SMOOTHPOST_TIMEOUT=str(timeout))
        environment.pop("DISPLAY", None)
        if os.geteuid() == 0:
            environment["RTAPI_UID"] = NOBODY
        status = start(work, isolated, environment, timeout + 40.0)
        write_log(samples, config, log)
        return status
    finally:
        shutil.rmtree(work, ignore_errors=True)


def main():
    if sys.argv[1:2] == ["--inside"]:
        run_inside(sys.argv[2])
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("config")
    parser.add_argument("program")
    parser.add_argument("log")
    parser.add_argument("--timeout", type=float, default=60.0)
    parser.add_argument("--isolation", choices=("auto", "namespaces", "none"), default="auto")
    arguments = parser.parse_args()
    reason = reason_to_skip()
    if reason:
        fail(f"skipped: {reason}", SKIP)
    status = run_program(arguments.config, arguments.program, arguments.log, arguments.timeout,
                         arguments.isolation)
    print(f"run_program.py: {arguments.program}: status {status}")
    sys.exit(status)


if __name__ == "__main__":
    main()
