"""What a comparator sees of a case: the numbers of its lesson and the columns of two recordings, all in SI units, and no truth."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from tests.diagnosis.suite import lessons

PERIOD = 1e-3
_SI = {"mm": 1e-3, "m/min": 1.0 / 60.0}


@dataclass(frozen=True)
class Case:
    """A lesson and two recordings.

    ``given`` and ``sigma`` are values [SI] and standard deviations [SI] by this suite's names; ``driven`` and ``channels`` the columns that
    drive and that are compared; ``fitted`` and ``held_out`` hold the columns [SI].
    """

    template: str
    given: dict[str, float]
    sigma: dict[str, float]
    pid: bool
    driven: tuple[str, ...]
    channels: tuple[str, ...]
    fitted: dict[str, np.ndarray]
    held_out: dict[str, np.ndarray]


def read_case(folder: Path, fitted: str = "fit.csv", held_out: str = "validate.csv") -> Case:
    """Read a case."""
    lesson: dict[str, Any] = yaml.safe_load((folder / "lesson.yaml").read_text(encoding="utf-8"))
    template = lesson["machine"]
    names = {place: name for name, (place, _) in lessons.PLACES[template].items()}
    given = {names[place]: _number(text) for place, text in lesson["set"].items()}
    for entry in lesson.get("insert", []):
        given["coulomb"] = _number(entry["level"])
    sigma = {names[place]: 0.01 * _number(text) * abs(given[names[place]]) for place, text in lesson["uncertain"].items()}
    driven = tuple(entry["column"] for entry in lesson["recordings"]["drive"].values())
    channels = tuple(entry["column"] for entry in lesson["recordings"]["compare"].values())
    recordings = [_columns(folder / file) for file in (fitted, held_out)]
    return Case(template, given, sigma, "replace" in lesson, driven, channels, *recordings)


def _number(text: Any) -> float:
    return float(str(text).split()[0])


def _columns(file: Path) -> dict[str, np.ndarray]:
    with file.open(encoding="utf-8") as lines:
        heads = lines.readline().strip().split(",")
        values = np.loadtxt(lines, delimiter=",", ndmin=2)
    found = {}
    for head, column in zip(heads, values.T, strict=True):
        name, _, unit = head.partition(" [")
        found[name] = np.nan_to_num(column) * _SI.get(unit.rstrip("]"), 1.0)
    return found
