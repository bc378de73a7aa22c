"""Cuts that were tried, read from a table."""

from __future__ import annotations

import csv
import io
import math
import re
from dataclasses import dataclass
from pathlib import Path

from lathesim.errors import LatheSimError, LessonError, nearest
from lathesim.units import in_unit, quantity

_RPM = 9.549296585513721
_STABLE = {
    "1": True,
    "true": True,
    "yes": True,
    "stable": True,
    "y": True,
    "0": False,
    "false": False,
    "no": False,
    "chatter": False,
    "n": False,
}
_COLUMNS = ("speed", "width", "stable", "frequency", "power")


@dataclass(frozen=True)
class TriedCut:
    """A cut: speed [rpm], chip width [m], whether it was stable, the chatter frequency [Hz] and the power [W] where they were recorded."""

    speed: float
    width: float
    stable: bool
    frequency: float = math.nan
    power: float = math.nan


def read_cuts(path: Path) -> tuple[TriedCut, ...]:
    """Return the cuts of a CSV file with the columns ``speed [rpm], width [mm], stable`` and perhaps ``frequency [Hz], power [W]``.

    ``stable`` is yes or no, 1 or 0, stable or chatter. Raises :class:`LessonError` with the line where a cut cannot be.
    """
    try:
        text = path.read_text(encoding="utf-8-sig", errors="replace")
    except FileNotFoundError:
        raise LessonError(
            "there is no such file.", place=str(path), remedy="Give a table of cuts: speed [rpm],width [mm],stable."
        ) from None
    lines = io.StringIO(text.replace(";", ",").replace("\t", ","))
    try:
        rows = [row for row in csv.reader(lines) if row and any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise LessonError(f"the file is no table: {error}.", place=str(path), remedy="Write one cut a line.") from None
    if not rows:
        return ()
    at, scale = _columns(rows[0], str(path))
    return tuple(_cut(row, at, scale, f"{path}:{number}") for number, row in enumerate(rows[1:], 2))


def _columns(header: list[str], path: str) -> tuple[dict[str, int], dict[str, float]]:
    """Return where each column stands and its factor to rpm, metres, hertz and watts."""
    at: dict[str, int] = {}
    scale: dict[str, float] = {}
    units = {"speed": "rpm", "width": "mm", "frequency": "Hz", "power": "W"}
    for place, cell in enumerate(header):
        match = re.fullmatch(r"\s*([\w ]+?)\s*(?:[\[(]([^\])]*)[\])])?\s*", cell)
        name = match[1].lower().replace("chatter ", "").replace("chip ", "").replace("spindle ", "") if match else cell.strip()
        name, _, suffix = name.partition("_")
        unit = (match[2] if match else None) or {"m": "m", "mm": "mm", "rpm": "rpm", "hz": "Hz", "w": "W"}.get(suffix)
        if name not in _COLUMNS:
            raise LessonError(
                f"there is no column '{cell.strip()}' of a cut.",
                place=f"{path}:1",
                remedy=nearest(name, _COLUMNS) or f"Columns: {', '.join(_COLUMNS)}.",
            )
        at[name] = place
        if name in units:
            try:
                scale[name] = quantity(f"1 {unit or units[name]}", units[name])
            except LatheSimError as error:
                raise LessonError(error.fact, place=f"{path}:1", remedy=error.remedy) from None
    missing = [name for name in _COLUMNS[:3] if name not in at]
    if missing:
        raise LessonError(f"the column '{missing[0]}' is missing.", place=f"{path}:1", remedy="Begin with: speed [rpm],width [mm],stable.")
    scale["speed"] *= _RPM
    return at, scale


def _cut(row: list[str], at: dict[str, int], scale: dict[str, float], place: str) -> TriedCut:
    def number(name: str, *, needed: bool) -> float:
        text = row[at[name]].strip() if name in at and at[name] < len(row) else ""
        if not text and not needed:
            return math.nan
        try:
            return float(text) * scale[name]
        except ValueError:
            raise LessonError(f"the {name} is '{text}'.", place=place, remedy="Give a number.") from None

    word = row[at["stable"]].strip().lower() if at["stable"] < len(row) else ""
    if word not in _STABLE:
        raise LessonError(f"whether the cut was stable is '{word}'.", place=place, remedy="Write yes or no.")
    cut = TriedCut(
        number("speed", needed=True),
        number("width", needed=True),
        _STABLE[word],
        number("frequency", needed=False),
        number("power", needed=False),
    )
    if not (cut.speed > 0.0 and math.isfinite(cut.speed)):
        raise LessonError(f"the speed is {cut.speed:g} rpm.", place=place, remedy="Give one above 0.")
    if not (cut.width > 0.0 and math.isfinite(cut.width)):
        raise LessonError(f"the width is {in_unit(cut.width, 'mm', 'g')}.", place=place, remedy="Give one above 0.")
    return cut
