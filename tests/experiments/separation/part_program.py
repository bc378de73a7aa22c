"""A reader of plain part programs of its own: lines, rapids, rests, spindle words; what the commanded machine does, sample by sample."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

PERIOD = 1e-3
RAPID = 0.12
"""Speed of a rapid [m/s], as the lessons have it."""
_WORD = re.compile(r"([A-Z])\s*([-+]?[0-9.]+)")


@dataclass(frozen=True)
class Course:
    """What is commanded at each sample: radius and place along the part [m], spindle speed [rad/s], whether a block is run at feed."""

    x: np.ndarray
    z: np.ndarray
    spindle: np.ndarray
    cuts: np.ndarray


@dataclass
class _Modes:
    motion: int = 1
    per_turn: bool = False
    feed: float = 0.0
    speed: float = 0.0
    sense: float = 0.0

    @property
    def spindle(self) -> float:
        return self.sense * self.speed

    def take(self, words: list[tuple[str, float]]) -> None:
        """Take the words of a block that last."""
        for letter, value in words:
            if letter == "G" and value in (0.0, 1.0):
                self.motion = int(value)
            elif letter == "G" and value in (94.0, 95.0):
                self.per_turn = value == 95.0
            elif letter == "F":
                self.feed = value
            elif letter == "S":
                self.speed = value * math.pi / 30.0
            elif letter == "M" and value in (3.0, 4.0, 5.0):
                self.sense = {3.0: 1.0, 4.0: -1.0, 5.0: 0.0}[value]

    def pace(self) -> float:
        """Return the path speed [m/s]."""
        if self.motion == 0:
            return RAPID
        return 1e-3 * self.feed * abs(self.spindle) / (2.0 * math.pi) if self.per_turn else self.feed / 6e4


def read_course(place: Path, seconds: float = 0.0, x: float = 0.0, z: float = 0.0) -> Course:
    """Return what a program in millimetres, absolute, X as a radius, commands, each block at one speed; at rest after it until ``seconds``.

    A word that this reader does not know raises :class:`ValueError`.
    """
    modes, rows = _Modes(), [np.array([[x, z, 0.0, 0.0]])]
    left = 0.0
    for line in place.read_text(encoding="utf-8").splitlines():
        plain = re.sub(r"\(.*?\)", "", line)
        if plain.strip() in ("", "%"):
            continue
        words = [(letter, float(value)) for letter, value in _WORD.findall(plain)]
        if any(letter not in "GMFSXZN" or (letter == "G" and value in (2.0, 3.0, 4.0)) for letter, value in words):
            raise ValueError(f"{place}: {line}")
        modes.take(words)
        given = {letter: 1e-3 * value for letter, value in words if letter in "XZ"}
        end_x, end_z = given.get("X", x), given.get("Z", z)
        way = math.hypot(end_x - x, end_z - z)
        if way <= 0.0:
            continue
        times = np.arange(PERIOD - left, way / modes.pace(), PERIOD)
        share = times * modes.pace() / way
        left = way / modes.pace() - (times[-1] if len(times) else -left)
        ones = np.ones(len(times))
        rows.append(np.column_stack([x + share * (end_x - x), z + share * (end_z - z), modes.spindle * ones, modes.motion * ones]))
        x, z = end_x, end_z
    table = np.vstack(rows)
    missing = max(0, round(seconds / PERIOD) - len(table))
    table = np.vstack([table, np.tile([[x, z, modes.spindle, 0.0]], (missing + 1, 1))])
    return Course(*table.T)
