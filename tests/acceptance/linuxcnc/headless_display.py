#!/usr/bin/python3
"""The [DISPLAY] of a headless LinuxCNC: runs one program while every servo cycle is logged.

LinuxCNC starts it as `headless_display.py -ini FILE` and returns its exit status. Environment:
SMOOTHPOST_PROGRAM, SMOOTHPOST_LOG, SMOOTHPOST_TIMEOUT (s). Exit status: 0 ran to its end, 10
LinuxCNC did not come up, 11 homing failed, 12 the program never started, 13 timeout, 14 the
machine switched itself off, 15 operator errors (printed).
"""
import os
import signal
import subprocess
import sys
import time

import linuxcnc

COME_UP, HOMING, NEVER_STARTED, TIMEOUT, SWITCHED_OFF, OPERATOR_ERROR = range(10, 16)


class Controller:
    """NML channels of the running LinuxCNC."""

    def __init__(self):
        self.command = linuxcnc.command()
        self.status = linuxcnc.stat()
        self.errors_channel = linuxcnc.error_channel()
        self.errors = 0

    def poll(self):
        """Refreshes the status and prints new operator messages."""
        self.status.poll()
        while message := self.errors_channel.poll():
            kind, text = message
            is_error = kind in (linuxcnc.NML_ERROR, linuxcnc.OPERATOR_ERROR)
            self.errors += is_error
            print(f"{'operator error' if is_error else 'message'}: {text.strip()}", flush=True)

    def wait(self, condition, seconds):
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self.poll()
            if condition(self.status):
                return True
            time.sleep(0.02)
        return False

    def send(self, method, *arguments):
        method(*arguments)
        self.command.wait_complete(5.0)

    def switch_on(self):
        """E-stop off, machine on, every joint homed where it stands. Returns an exit status."""
        ready = lambda s: (s.axis_mask and s.max_velocity and s.state == linuxcnc.RCS_DONE
                           and s.task_state == linuxcnc.STATE_ESTOP)
        if not self.wait(ready, 20.0):
            return COME_UP
        self.send(self.command.state, linuxcnc.STATE_ESTOP_RESET)
        self.send(self.command.state, linuxcnc.STATE_ON)
        self.send(self.command.mode, linuxcnc.MODE_MANUAL)
        self.send(self.command.home, -1)
        if not self.wait(lambda s: all(s.homed[:s.joints]), 10.0):
            return HOMING
        return 0

    def run(self, program, seconds):
        """Runs `program` in automatic mode. Returns an exit status."""
        self.send(self.command.mode, linuxcnc.MODE_AUTO)
        self.send(self.command.program_open, program)
        self.command.auto(linuxcnc.AUTO_RUN, 0)
        started = self.wait(lambda s: s.interp_state != linuxcnc.INTERP_IDLE or self.errors, 5.0)
        if not started:
            return NEVER_STARTED
        idle = lambda s: s.interp_state == linuxcnc.INTERP_IDLE and s.queue == 0 and s.inpos
        off = lambda s: s.task_state != linuxcnc.STATE_ON
        if not self.wait(lambda s: idle(s) or off(s), seconds):
            self.command.abort()
            return TIMEOUT
        if off(self.status):
            return SWITCHED_OFF
        self.wait(lambda s: False, 0.2)  # the last samples and messages
        return OPERATOR_ERROR if self.errors else 0


def main():
    controller = Controller()
    status = controller.switch_on()
    if status == 0:
        with open(os.environ["SMOOTHPOST_LOG"], "w", encoding="ascii") as log:
            sampler = subprocess.Popen(["halsampler", "-t"], stdout=log)
            subprocess.run(["halcmd", "setp", "sampler.0.enable", "1"], check=True)
            status = controller.run(os.environ["SMOOTHPOST_PROGRAM"],
                                    float(os.environ["SMOOTHPOST_TIMEOUT"]))
            sampler.send_signal(signal.SIGINT)
            sampler.wait()
    controller.poll()
    print(f"display: status {status}, {controller.errors} operator errors", flush=True)
    sys.exit(status)


if __name__ == "__main__":
    main()
