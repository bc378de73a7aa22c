"""What recordings tell of the values of a machine, and which combinations of them they cannot tell, in words.

With J the derivatives of all readings by the logarithms of the values, in noise levels, each singular value S of J says how well one
combination is known: its relative standard error is 1/S. Combinations with S = 0 are looked at closely: those that are products of small
powers are run again far away from the given values, and are told as hidden only if no reading moves.

Source: Belsley, Kuh, Welsch, Regression Diagnostics (1980), chapter 3; Brun, Reichert, Kuensch, Water Resour. Res. 37 (2001).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.engine.assembly import FloatArray

KNOWN = 10.0
"""Singular value from which on a combination is known to 10 %."""
_UNSEEN = 1e-3
"""Singular value below which a combination leaves no trace: a change by a factor of e moves the readings by a thousandth of the noise."""
_ROUNDING = 1e-6
"""Share of the largest singular value that the central differences leave where there is nothing."""
_GAP = 5.0
"""Ratio of two singular values from which on there is a gap between them."""
_FAR = 0.2
"""How far along a hidden combination the machine is run again, in units of the logarithm."""
_WHOLE = 0.02
"""A power this near to a whole number is that number."""
_HIGHEST = 3
"""Highest whole power of a combination that is told."""
_STILL = 0.02
"""Noise levels by which readings may move along a combination that is hidden: integration of other numbers, no physics."""


@dataclass(frozen=True)
class HiddenDirection:
    """A combination that leaves no trace: powers by which values may be multiplied together, name -> power, and the sentence about it."""

    powers: dict[str, float]
    sentence: str


@dataclass(frozen=True, eq=False)
class Telling:
    """What recordings tell: singular values, how many combinations are known to 10 %, and what is hidden.

    ``information`` is sum ln(1 + S^2). ``loose`` names the values whose own relative error is above 10 %, with that error.
    """

    names: tuple[str, ...]
    singular: FloatArray
    hidden: tuple[HiddenDirection, ...]
    loose: tuple[tuple[str, float], ...]

    @property
    def known(self) -> int:
        """How many combinations are known to 10 % or better."""
        return int((self.singular > KNOWN).sum())

    @property
    def information(self) -> float:
        """sum ln(1 + S^2)."""
        return float(np.log1p(np.square(self.singular)).sum())


def telling(names: Sequence[str], slopes: FloatArray, moved: Callable[[FloatArray], FloatArray]) -> Telling:
    """Return what readings tell of values.

    ``slopes`` (readings, names) are derivatives by the logarithms of the values, in noise levels. ``moved`` takes directions (members,
    names) on that scale, and returns by how many noise levels the readings move at most (members,).
    """
    square = np.linalg.qr(slopes, mode="r") if len(slopes) > len(names) else slopes
    _, singular, rows = np.linalg.svd(square, full_matrices=True)
    singular = np.concatenate([singular, np.zeros(max(0, len(names) - len(singular)))])[: len(names)]
    hidden = _still(names, singular, rows, moved)
    variance = np.square(rows.T / np.maximum(singular, 1e-9)).sum(axis=1)
    loose = tuple((name, float(np.sqrt(size))) for name, size in zip(names, variance, strict=True) if size > 1.0 / KNOWN**2)
    return Telling(tuple(names), singular, tuple(HiddenDirection(powers, _sentence(powers)) for powers in hidden), loose)


def _still(
    names: Sequence[str], singular: FloatArray, rows: FloatArray, moved: Callable[[FloatArray], FloatArray]
) -> list[dict[str, float]]:
    """Return the combinations along which no reading moves.

    Those that never show and those that hardly show are told apart by a gap between the singular values. Each gap is tried, and the one
    is taken that leaves most combinations of whole powers standing when the machine is run again: physics multiplies by whole powers.
    """
    count = int((singular < max(_UNSEEN, _ROUNDING * float(singular[0]))).sum())
    best: list[dict[str, float]] = []
    for first in range(len(names) - count, len(names)):
        before = singular[first - 1] if first else np.inf
        if singular[first] * _GAP > before:
            continue
        found = _combinations(names, rows[first:])
        directions = np.array([_as_direction(names, item) for item in found])
        still = moved(_FAR * directions) < _STILL
        standing = [item for item, stays in zip(found, still, strict=True) if stays and _is_whole(item)]
        if len(standing) > len(best):
            best = standing
    return best


def _is_whole(powers: dict[str, float]) -> bool:
    return all(power == round(power) and abs(power) <= _HIGHEST for power in powers.values())


def _as_direction(names: Sequence[str], powers: dict[str, float]) -> FloatArray:
    return np.array([powers.get(name, 0.0) for name in names])


def _combinations(names: Sequence[str], small: FloatArray) -> list[dict[str, float]]:
    """Return a sparse basis of the rows: reduced until each has one value of its own, powers made whole where they nearly are."""
    rows = small.copy()
    found: list[dict[str, float]] = []
    used: list[int] = []
    for number in range(len(rows)):
        place, column = divmod(int(np.argmax(_alone(rows[number:], used))), rows.shape[1])
        rows[[number, number + place]] = rows[[number + place, number]].copy()
        rows[number] /= rows[number, column]
        for other in range(len(rows)):
            if other != number:
                rows[other] -= rows[other, column] * rows[number]
        used.append(int(column))
    for row in rows:
        whole = np.where(np.abs(row - np.round(row)) < _WHOLE, np.round(row), row)
        found.append({name: float(power) for name, power in zip(names, whole, strict=True) if abs(power) > _WHOLE})
    return found


def _alone(rows: FloatArray, used: Sequence[int]) -> FloatArray:
    """Return how fit each entry is as the one a row is told by: large, and in a column that few other rows need."""
    size = np.abs(rows)
    fitness = np.asarray(size / (1e-12 + np.sqrt(np.square(rows).sum(axis=0))) * size)
    fitness[:, list(used)] = 0.0
    return fitness


def _sentence(powers: dict[str, float]) -> str:
    """Return a hidden combination in words."""
    if len(powers) == 1:
        return f"{next(iter(powers))} does not show at all."
    up = [name for name, power in powers.items() if power > 0.0]
    down = [name for name, power in powers.items() if power < 0.0]
    if len(down) == 1 and len(up) > 1:
        up, down = down, up
    if all(abs(power) == abs(next(iter(powers.values()))) for power in powers.values()):
        if not down:
            return f"Only the ratio of {_listed(up)} shows." if len(up) == 2 else f"Only the ratios of {_listed(up)} show."
        if len(up) == 1 and len(down) == 1:
            return f"Only the product of {_listed(list(powers))} shows, and neither of them alone."
        if len(up) == 1:
            return f"Only the products of {up[0]} with each of {_listed(down)} show, and none of them alone."
        return f"Only the products of {_listed(up)} with {_listed(down)} show."
    told = " ".join(f"{name}^{power:+.3g}" for name, power in powers.items())
    return f"Nothing moves along {told}: these values may change together by these powers."


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
