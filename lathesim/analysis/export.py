"""Records for other programs: CSV, one row a recorded instant, and MAT files with units. Both are read back as recordings."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from lathesim.errors import RecordError
from lathesim.record import Record
from lathesim.whole_file import whole_file

FORMATS = (".csv", ".mat")
_BLOCK = 20_000
_LONGEST_NAME = 63
_RESERVED = re.compile(
    r"break|case|catch|classdef|continue|else|elseif|end|for|function|global|if|otherwise|parfor|persistent|return|spmd|switch|try|while"
    r"|units|names"
)
"""MATLAB's own words, and the two structs beside the channels."""


def export(record: Record, path: str | Path) -> None:
    """Write a record as CSV or MAT file, by the ending of the name; a file that stood there stays whole until the new one is.

    Raises :class:`RecordError` for another ending, and where the file cannot be written.
    """
    place = Path(path)
    suffix = place.suffix.lower()
    if suffix not in FORMATS:
        raise RecordError(f"a record cannot be exported as '{place.suffix}'.", place=str(place), remedy="Use .csv or .mat.")
    with whole_file(place) as part:
        (_write_csv if suffix == ".csv" else _write_mat)(record, part)


def csv_header(record: Record) -> str:
    """Return the first line: ``time [s],x_axis.position [m],...``."""
    return ",".join(["time [s]", *(f"{name} [{channel.unit}]" for name, channel in record.channels.items())])


def mat_names(names: list[str]) -> dict[str, str]:
    """Return a legal and unique MATLAB name for each channel: ``x_axis_position`` for ``x_axis.position``."""
    found: dict[str, str] = {}
    for name in names:
        legal = re.sub(r"\W", "_", name, flags=re.ASCII)
        if not re.match(r"[A-Za-z]", legal) or _RESERVED.fullmatch(legal):
            legal = f"c_{legal}"
        base, number = legal[:_LONGEST_NAME], 1
        legal = base
        while legal in found.values():
            number += 1
            legal = f"{base[: _LONGEST_NAME - 4]}_{number}"
        found[name] = legal
    return found


def _write_csv(record: Record, path: Path) -> None:
    columns = [record.time, *(channel.values for channel in record.channels.values())]
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(csv_header(record) + "\n")
        for begin in range(0, len(record), _BLOCK):
            rows = np.column_stack([column[begin : begin + _BLOCK] for column in columns]).tolist()
            file.write("".join(",".join(map(repr, row)) + "\n" for row in rows))


def _write_mat(record: Record, path: Path) -> None:
    from scipy.io import savemat

    legal = mat_names(["time", *record.channels])
    values = {legal["time"]: record.time} | {legal[name]: channel.values for name, channel in record.channels.items()}
    units = {legal["time"]: "s"} | {legal[name]: channel.unit for name, channel in record.channels.items()}
    names = {short: name for name, short in legal.items()}
    with path.open("wb") as file:
        savemat(file, {**values, "units": units, "names": names}, long_field_names=True, oned_as="column")
