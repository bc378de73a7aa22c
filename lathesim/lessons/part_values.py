"""Quantities and tables of a lesson to the SI values of a part, each fault with the place where it was written."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from lathesim.component import Component, Declaration, Input, Parameter, State, Table
from lathesim.engine.assembly import FloatArray, Place
from lathesim.errors import LatheSimError, LessonError, nearest
from lathesim.lessons.case import Given
from lathesim.lessons.yaml_source import Location, YamlFile
from lathesim.shipped import shipped_folder
from lathesim.units import quantity
from lathesim.whole_file import write_text


@contextmanager
def placed_at(place: str) -> Iterator[None]:
    """Return errors from inside the place where their cause was written."""
    try:
        yield
    except LatheSimError as error:
        raise LessonError(f"{error.place}: {error.fact}" if error.place else error.fact, place=place, remedy=error.remedy) from None


def si_value(given: Given, unit: str) -> float:
    """Return the SI value of an entry that must measure the same kind of thing as ``unit``."""
    return si_of(given.value, unit, given.place) if isinstance(given.value, str) else float(given.value)


def si_of(text: str, unit: str, place: str) -> float:
    """Return the SI value of a text that stands at a place and must measure the same kind of thing as ``unit``."""
    with placed_at(place):
        return quantity(text, unit)


def si_in(source: YamlFile, location: Location, text: str, unit: str) -> float:
    """Return the SI value of a text that stands in a file."""
    return si_of(text, unit, source.place(location))


def seconds(given: Given) -> float:
    """Return a duration [s]. Raises :class:`LessonError` if it is not above zero."""
    value = si_value(given, "s")
    if not (value > 0.0 and math.isfinite(value)):
        raise LessonError(f"the time is {value:g} s, and it must be above zero.", place=given.place)
    return value


def take_value(
    part: str, component: type[Component], item: str, given: Given, parameters: dict[str, float], start: dict[str, float]
) -> None:
    """Put the value of a parameter into ``parameters`` and that of a state into ``start``."""
    declared = component.declarations.get(item)
    if isinstance(declared, Parameter):
        value = si_value(given, declared.unit)
        if not declared.low <= value <= declared.high:
            unit = "" if declared.unit == "1" else f" {declared.unit}"
            fact = f"{part}.{item} is {value:g}{unit}, outside {declared.low:g} to {declared.high:g}{unit}."
            raise LessonError(fact, place=given.place, remedy="Choose a value inside.")
        parameters[item] = value
    elif isinstance(declared, State):
        start[item] = si_value(given, declared.unit)
    else:
        raise no_item(part, component, item, (Parameter, State), "parameter", given.key_place)


def declared_item(
    name: str, parts: Mapping[str, type[Component]], kinds: tuple[type[Declaration], ...], word: str, place: str
) -> Declaration:
    """Return what ``part.name`` declares; :class:`LessonError` where there is no such part, or no such ``word`` of it."""
    part, item = Place.of(name)
    if part not in parts:
        raise LessonError(f"there is no part '{part}'.", place=place, remedy=nearest(part, parts) or f"The machine has {', '.join(parts)}.")
    declared = parts[part].declarations.get(item)
    if not isinstance(declared, kinds):
        raise no_item(part, parts[part], item, kinds, word, place)
    return declared


def no_item(part: str, component: type[Component], item: str, kinds: tuple[type[Declaration], ...], word: str, place: str) -> LessonError:
    """Return the error for a name that a part does not have, or has as something else."""
    declared = component.declarations.get(item)
    if declared is not None:
        remedy = "Feed it with a wire, under 'wires:'." if isinstance(declared, Input) else ""
        return LessonError(f"{part}.{item} is {_with_article(declared.kind)}, not {_with_article(word)}.", place=place, remedy=remedy)
    known = [name for name, other in component.declarations.items() if isinstance(other, kinds)]
    remedy = nearest(item, known) or (f"It has {', '.join(known)}." if known else "It has none.")
    return LessonError(f"{part} has no {word} '{item}'.", place=place, remedy=remedy)


def _with_article(word: str) -> str:
    return f"an {word}" if word[0] in "aeiou" else f"a {word}"


LARGEST_TABLE = 200_000
"""Numbers that a table may hold: a lap of some minutes, or a network far larger than a control has time for."""
_LONGEST_NUMBER = 40
"""Bytes of a number in a file at most, with what parts it from the next; assumed."""


def table_of(given: Given, component: type[Component], name: str, beside: Path) -> FloatArray:
    """Return the table of a part, shape (rows, columns) [SI], read from the CSV file that the lesson names.

    A first row of words is the header and must be the columns that the part declares. Raises :class:`LessonError` with file and line
    where the file is missing, has another shape, holds what is no number, or is too large.
    """
    declared = component.declared(Table)[name]
    file = _found(given, beside)
    if file.stat().st_size > _LONGEST_NUMBER * LARGEST_TABLE:
        raise LessonError(f"the table has more than {LARGEST_TABLE} numbers.", place=str(file), remedy="Use fewer rows.")
    try:
        rows = _rows(file, declared)
    except (csv.Error, UnicodeDecodeError) as error:
        raise LessonError(f"the file is no table: {error}.", place=str(file)) from None
    if not rows:
        raise LessonError("the table has no rows.", place=str(file), remedy=f"Its columns are {', '.join(declared.columns)}.")
    if len(rows) * len(declared.columns) > LARGEST_TABLE:
        raise LessonError(f"the table has more than {LARGEST_TABLE} numbers.", place=str(file), remedy="Use fewer rows.")
    table = np.array(rows, dtype=float)
    check = getattr(component, "table_fault", None)
    fault = check(name, rows) if check is not None else ""
    if fault:
        raise LessonError(fault, place=str(file))
    return table


def _rows(file: Path, declared: Table) -> list[list[float]]:
    rows: list[list[float]] = []
    with file.open(encoding="utf-8", newline="") as lines:
        for number, cells in enumerate(csv.reader(lines), start=1):
            if not cells or cells[0].lstrip().startswith("#"):
                continue
            place = f"{file}:{number}"
            if not rows and _is_header(cells):
                _check_header(cells, declared, place)
                continue
            rows.append(_numbers(cells, declared, place))
    return rows


def write_table(file: Path, columns: tuple[str, ...], rows: FloatArray, unit: str = "") -> None:
    """Write a table so that :func:`table_of` reads the same numbers back, bit for bit; ``unit`` is that of all columns."""
    write_text(file, table_text(columns, rows, unit))


def table_text(columns: tuple[str, ...], rows: FloatArray, unit: str = "") -> str:
    """Return the text of a table file: a comment with the common ``unit``, a header and the rows."""
    lines = [
        *([f"# all columns in {unit}"] if unit not in ("", "1") else []),
        ",".join(columns),
        *[",".join(repr(float(value)) for value in row) for row in rows],
    ]
    return "\n".join(lines) + "\n"


def table_file(named: str | float, beside: Path) -> Path | None:
    """Return the file of a table: relative to the lesson's folder, or a shipped one."""
    for path in (beside / str(named), shipped_folder("lesson_configs") / str(named)):
        if path.is_file():
            return path
    return None


def _found(given: Given, beside: Path) -> Path:
    named = Path(str(given.value))
    found = table_file(str(given.value), beside)
    if found is not None:
        return found
    folder = (beside / named).parent
    known = [path.name for path in folder.glob("*.csv")] if folder.is_dir() else []
    remedy = nearest(named.name, known) or "The path is taken from the lesson's folder."
    raise LessonError(f"there is no table '{given.value}'.", place=given.place, remedy=remedy)


def _is_header(cells: list[str]) -> bool:
    return any(not _is_number(cell) for cell in cells) and all(cell.strip().isidentifier() for cell in cells) and "nan" not in cells


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _check_header(cells: list[str], declared: Table, place: str) -> None:
    written = tuple(cell.strip() for cell in cells)
    if written != declared.columns:
        wanted = ", ".join(declared.columns)
        raise LessonError(f"the columns are {', '.join(written)}, and {declared.name} has {wanted}.", place=place)


def _numbers(cells: list[str], declared: Table, place: str) -> list[float]:
    if len(cells) != len(declared.columns):
        fact = f"the row has {len(cells)} numbers, and {declared.name} has {len(declared.columns)}: {', '.join(declared.columns)}."
        raise LessonError(fact, place=place)
    numbers = [float(cell) if _is_number(cell) else math.nan for cell in cells]
    for cell, number, column in zip(cells, numbers, declared.columns, strict=True):
        if not math.isfinite(number):
            raise LessonError(f"{column} is '{cell.strip()}', and a finite number is expected.", place=place)
    return numbers
