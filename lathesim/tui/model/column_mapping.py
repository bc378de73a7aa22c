"""What the columns of a recording may mean, guessed by name, and the lesson that says so."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lathesim.errors import RecordingError

if TYPE_CHECKING:
    from lathesim.lessons.simulate import Prepared
    from lathesim.plugins import Registry

IGNORE, TIME, COMPARE, DRIVE = "ignore", "time", "compare", "drive"
_LIKE = 0.55
"""Likeness of two names (0 to 1) from which on a guess is proposed, assumed: a person looks at each."""


@dataclass(frozen=True)
class ColumnMeaning:
    """A column, what it is used for, the channel or input it stands for, its unit and scale."""

    column: str
    role: str = IGNORE
    target: str = ""
    unit: str = ""
    scale: float = 1.0


def guessed_columns(file: Path, case: Prepared, registry: Registry) -> list[ColumnMeaning]:
    """Return a guess for each column of a recording, by its name and the unit in its header; raises :class:`RecordingError`."""
    from lathesim.recordings.raw_table import split_unit
    from lathesim.recordings.reading import read_recording

    table = read_recording(file, registry.readers)
    found = []
    for name in table.columns:
        word, unit = split_unit(name)
        given = table.units.get(name, "") or unit
        if word.strip().lower() in ("time", "t", "zeit", "timestamp"):
            found.append(ColumnMeaning(name, TIME, "", given or "s"))
            continue
        target = _nearest_channel(word, case)
        unit = given or (case.plan.unit(target) if target else "")
        found.append(ColumnMeaning(name, COMPARE if target else IGNORE, target, unit))
    return found


def _nearest_channel(word: str, case: Prepared) -> str:
    plain = word.lower().replace(" ", "_")
    best, likeness = "", _LIKE
    for channel in case.plan.channels:
        part, _, item = channel.partition(".")
        for name in (channel.lower(), f"{part}_{item}", item):
            ratio = difflib.SequenceMatcher(None, plain, name).ratio()
            if ratio > likeness:
                best, likeness = channel, ratio
    return best


def recordings_entry(columns: Sequence[ColumnMeaning], rate: str = "") -> dict[str, Any]:
    """Return the ``recordings:`` entry of a lesson; raises :class:`RecordingError` where time or every other column is missing."""
    time = next((item for item in columns if item.role == TIME), None)
    if time is None and not rate:
        raise RecordingError("no column is the time.", remedy="Give one column the role 'time', or a sample rate.")
    used = [item for item in columns if item.role in (COMPARE, DRIVE)]
    if not any(item.role == COMPARE for item in used):
        raise RecordingError("no column is compared with a channel.", remedy="Give at least one column the role 'compare'.")
    for item in used:
        if not item.target or not item.unit:
            raise RecordingError(f"column '{item.column}' needs a channel and a unit.", remedy="Write both, or ignore the column.")
    entry: dict[str, Any] = {"time": {"column": time.column, "unit": time.unit or "s"} if time is not None else {"rate": rate}}
    for role in (DRIVE, COMPARE):
        of_role = {item.target: _signal(item) for item in used if item.role == role}
        if of_role:
            entry[role] = of_role
    return entry


def _signal(item: ColumnMeaning) -> dict[str, Any]:
    found: dict[str, Any] = {"column": item.column, "unit": item.unit}
    return found | ({"scale": item.scale} if item.scale != 1.0 else {})
