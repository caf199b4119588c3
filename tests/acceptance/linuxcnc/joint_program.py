"""Reads the joint-level programs that the tool emits for LinuxCNC: a second, small parser.

Subset: comments, N words, G0 G1 G4 G17 G20 G21 G40 G49 G53 G54 G61 G64 G80 G90 G91.1 G92.1 G93 G94,
axis words, F, M words with P Q E S, O-words of an offset guard (assumed not to abort), and `%`.
Anything else is an error: a word that this reader does not know cannot be compared.
"""
import re

import numpy as np

WORD = re.compile(r"([A-Z])([+-]?(?:\d+\.?\d*|\.\d+))")
MODES = {"G4", "G17", "G40", "G49", "G53", "G54", "G61", "G64", "G80", "G90", "G91.1", "G92.1"}
OTHER_WORDS = "NPQESTH"


class Move:
    """One block of motion: all joints after it, in mm and degrees."""

    __slots__ = ("line", "joints", "rapid", "duration", "beam")

    def __init__(self, line, joints, rapid, duration, beam):
        self.line, self.joints, self.rapid = line, joints, rapid
        self.duration = duration  # s; 0 for a rapid
        self.beam = beam          # digital output 0 as the program sets it for this move


class JointProgram:
    """Moves of a program; joints that it has not yet set stand at `start`."""

    def __init__(self, path, letters, start):
        self.letters = letters
        self.moves = []
        self.path_mode = None
        self.beam_at_end = False
        self._position = np.array(start, float)
        self._scale = 1.0
        self._motion = None
        self._inverse_time = False
        self._feed = 0.0
        self._beam = False
        self.start = self._position.copy()
        with open(path, encoding="utf-8", errors="replace") as file:
            percent = 0
            for number, text in enumerate(file, 1):
                percent += text.strip() == "%"
                if percent == 2:
                    break
                self._read_line(path, number, text)
        self.beam_at_end = self._beam

    def joints(self):
        """Polyline of joint vectors: the start, then one vertex a move."""
        return np.vstack([self.start] + [move.joints for move in self.moves])

    def _read_line(self, path, number, text):
        code = re.sub(r"\([^()]*\)|;.*", "", text).replace(" ", "").replace("\t", "").strip().upper()
        if code in ("", "%") or code.startswith("O"):
            return
        words = WORD.findall(code)
        if "".join(letter + value for letter, value in words) != code:
            raise ValueError(f"{path}:{number}: not a plain block: {code}")
        axes, codes = {}, []
        for letter, value in words:
            if letter in "GM":
                codes.append(letter + (value.lstrip("0") or "0"))
            elif letter == "F":
                self._feed = float(value)
            elif letter in self.letters:
                axes[letter] = float(value)
            elif letter not in OTHER_WORDS:
                raise ValueError(f"{path}:{number}: no axis {letter} on this machine")
        values = {letter: float(value) for letter, value in words if letter in "PQ"}
        for code in codes:
            self._apply(path, number, code, values)
        if axes:
            self._move(path, number, axes, "F" in {letter for letter, _ in words})

    def _apply(self, path, number, code, values):
        if code in ("G0", "G1"):
            self._motion = code
        elif code in ("G20", "G21"):
            self._scale = 25.4 if code == "G20" else 1.0
        elif code in ("G93", "G94"):
            self._inverse_time = code == "G93"
        elif code in ("M62", "M63", "M64", "M65"):
            if values.get("P") == 0.0:
                self._beam = code in ("M62", "M64")
        elif code in MODES:
            if code in ("G61", "G64"):
                self.path_mode = code
        elif code[0] != "M":
            raise ValueError(f"{path}:{number}: {code} is outside the emitted subset")

    def _move(self, path, number, axes, has_feed):
        if self._motion is None:
            raise ValueError(f"{path}:{number}: axis words without a motion mode")
        for letter, value in axes.items():
            index = self.letters.index(letter)
            self._position[index] = value * (1.0 if letter in "ABC" else self._scale)
        duration = 0.0
        if self._motion == "G1":
            if not self._inverse_time or not has_feed or self._feed <= 0.0:
                raise ValueError(f"{path}:{number}: G1 without an inverse time feed of its own")
            duration = 60.0 / self._feed
        self.moves.append(Move(number, self._position.copy(), self._motion == "G0", duration,
                               self._beam))
