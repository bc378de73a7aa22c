"""What is varied in a sweep, and the table that grows a row a run."""

from __future__ import annotations

import csv
import io
import itertools
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lathesim.component import Declaration, Parameter, State
from lathesim.engine.assembly import Place
from lathesim.errors import LessonError, RecordError
from lathesim.lessons.case import Given
from lathesim.lessons.part_values import declared_item, si_of, take_value
from lathesim.lessons.simulate import Prepared
from lathesim.lessons.sweep_runs import Member
from lathesim.units import from_si, split_quantity
from lathesim.whole_file import check_place, make_folder, refusal, write_text

_RANGE = re.compile(r"^(?P<low>\S+?)\s*\.\.\s*(?P<high>[^:\s]+)\s*(?P<unit>[^:]*):\s*(?P<count>\d+)\s*(?P<log>log)?$")
_EXAMPLE = "Write it as --vary x_controller.proportional='0.1..0.5 V/mm:9', with ':9log' for equal ratios, or as a list: '8, 10, 12'."
LARGEST_SWEEP = 1_000_000


@dataclass(frozen=True)
class SweptRange:
    """One ``--vary``: the names that take the same value, the values [SI], and the unit in which they are shown."""

    text: str
    names: tuple[str, ...]
    values: tuple[float, ...]
    unit: str
    logarithmic: bool = False
    remark: str = ""
    """Said where the unit was not written."""

    @property
    def label(self) -> str:
        """The names as they head a column."""
        return "+".join(self.names)

    @property
    def shown(self) -> tuple[float, ...]:
        """The values in ``unit``, rounded to what a person wrote or reads."""
        return tuple(float(f"{from_si(value, self.unit):.12g}") for value in self.values)

    def told(self, place: int) -> str:
        """Return one value with its unit."""
        return f"{self.shown[place]:.6g} {self.unit}".removesuffix(" 1")


def read_range(text: str, prepared: Prepared) -> SweptRange:
    """Read one ``--vary``, and refuse (:class:`LessonError`) what the machine does not have or may not be.

    A number without a unit is right where the unit is 1; elsewhere it is taken in the unit in which the lesson or its machine writes that
    parameter, and ``remark`` says so.
    """
    place = f"--vary {text}"
    named, equals, spread = text.partition("=")
    names = tuple(name.strip() for name in named.split("+"))
    if not equals or not all(re.fullmatch(r"\w+\.\w+", name) for name in names):
        raise LessonError("this names no parameters and values.", place=place, remedy=_EXAMPLE)
    units = [_declared(name, prepared, place).unit for name in names]
    texts, logarithmic = _texts(spread.strip(), place)
    remark = ""
    if not any(split_quantity(item)[1] for item in texts) and units[0] not in ("1", ""):
        unit = written_unit(names[0], prepared)
        if not unit:
            raise LessonError(f"the values have no unit, and {units[0]} is wanted.", place=place, remedy=_EXAMPLE)
        remark = f"{names[0]} is varied in {unit}, the unit in which the lesson gives it."
        texts = [f"{item} {unit}" for item in texts]
    values = [si_of(item, units[0], place) for item in texts]
    if ".." in spread:
        values = _spread(values, int(_matched(spread.strip(), place)["count"]), logarithmic, place)
    for name in names:
        part, item = Place.of(name)
        for value in values:
            take_value(part, prepared.plan.parts[part].component, item, Given(value, place, place), {}, {})
    return SweptRange(text, names, tuple(values), split_quantity(texts[-1])[1] or "1", logarithmic, remark)


def grid(ranges: Sequence[SweptRange]) -> list[tuple[int, ...]]:
    """Return all combinations as positions in the ranges, the last range running fastest."""
    count = math.prod(len(item.values) for item in ranges)
    if count > LARGEST_SWEEP:
        raise LessonError(f"the sweep has {count} runs, and {LARGEST_SWEEP} is the most.", remedy="Give fewer values.")
    names = [name for item in ranges for name in item.names]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise LessonError(f"{twice} is varied twice.", place="--vary", remedy="Join parameters that move together: a.b+c.d=...")
    return list(itertools.product(*(range(len(item.values)) for item in ranges)))


def values_at(ranges: Sequence[SweptRange], point: Sequence[int]) -> tuple[float, ...]:
    """Return the value [SI] of each varied parameter at a point of the grid."""
    return tuple(item.values[place] for item, place in zip(ranges, point, strict=True) for _ in item.names)


def default_metrics(prepared: Prepared) -> list[str]:
    """Return the metrics of the lesson's goals, else those it has published values of."""
    settings = prepared.case.lesson.settings
    published = [*settings.published, *(name for variant in settings.variants.values() for name in variant.published)]
    return list(dict.fromkeys([goal.metric for goal in settings.goals] or published))


def _texts(spread: str, place: str) -> tuple[list[str], bool]:
    """Return the ends of a range, or the members of a list, each with the unit that was written."""
    if ".." in spread:
        match = _matched(spread, place)
        unit = match["unit"].strip()
        return [f"{match[end]} {unit}".strip() for end in ("low", "high")], bool(match["log"])
    items = [item.strip() for item in spread.split(",")]
    if not all(items):
        raise LessonError("a value is missing.", place=place, remedy=_EXAMPLE)
    unit = split_quantity(items[-1])[1]
    return [item if split_quantity(item)[1] else f"{item} {unit}".strip() for item in items], False


def _matched(spread: str, place: str) -> re.Match[str]:
    match = _RANGE.match(spread)
    if match is None:
        raise LessonError(f"'{spread}' is no range.", place=place, remedy=_EXAMPLE)
    return match


def _spread(ends: Sequence[float], count: int, logarithmic: bool, place: str) -> list[float]:
    low, high = ends
    if count < 2:
        raise LessonError(f"a range has {count} values, and 2 or more are expected.", place=place)
    if not logarithmic:
        return [float(value) for value in np.linspace(low, high, count)]
    if low * high <= 0.0:
        raise LessonError("equal ratios need two ends of one sign, neither of them 0.", place=place)
    return [math.copysign(float(value), low) for value in np.geomspace(abs(low), abs(high), count)]


def _declared(name: str, prepared: Prepared, place: str) -> Declaration:
    """Return the declaration of a parameter or state; refused is what the machine does not have and what a wire feeds."""
    plan = prepared.plan
    declared = declared_item(name, {part.name: part.component for part in plan.parts.values()}, (Parameter, State), "parameter", place)
    source = plan.feeds.get(name, ("", name))[1]
    if source != name:
        raise LessonError(f"{name} is fed by {source}, so varying it changes nothing.", place=place, remedy=f"Vary {source}.")
    return declared


def written_unit(name: str, prepared: Prepared) -> str:
    """Return the unit in which the lesson, else its machine, writes a parameter; empty where neither does."""
    given = prepared.case.changed.set.get(name)
    if given is not None and isinstance(given.value, str):
        return split_quantity(given.value)[1]
    part, item = Place.of(name)
    placed = prepared.case.parts.get(part)
    written = (placed.entry.set.get(item) or placed.entry.start.get(item)) if placed else None
    return split_quantity(written)[1] if written else ""


FORMAT = "# lathesim-sweep/1"


@dataclass(frozen=True)
class SweepTable:
    """The file of a sweep.

    Its first lines are comments (``header``: what was swept, and the fingerprint of the machine); then one heading and one row a run: its
    number, its values (``given``, as text), its metrics, how it ended. Rows come as runs end; :meth:`finish` puts them in order.
    """

    path: Path
    header: tuple[str, ...]
    columns: tuple[str, ...]
    given: tuple[tuple[str, ...], ...]

    def open(self) -> dict[int, Member]:
        """Return the runs that are in the file already; begin the file where there is none.

        A last row that was cut off while it was written is dropped. Raises :class:`RecordError` where the file is of another sweep, is no
        table of a sweep, or cannot be written.
        """
        try:
            make_folder(self.path.parent)
            check_place(self.path)
            if not self.path.exists():
                write_text(self.path, self._head())
                return {}
            written = self.path.read_bytes()
        except OSError as error:
            raise refusal(self.path, error) from None
        whole = written[: written.rfind(b"\n") + 1]
        if self._head().encode().startswith(written):
            write_text(self.path, self._head())
            return {}
        try:
            text = whole.decode("utf-8")
        except UnicodeDecodeError:
            raise self._foreign() from None
        self._check_head(text)
        try:
            found = {member.number: member for member in map(self._member, csv.reader(io.StringIO(text[len(self._head()) :])))}
        except csv.Error:
            raise self._foreign() from None
        if whole != written:
            write_text(self.path, text)
        return found

    def add(self, member: Member) -> None:
        """Write the row of a run, at once and whole."""
        try:
            with self.path.open("ab") as file:
                file.write(self._row(member).encode())
        except OSError as error:
            raise refusal(self.path, error) from error

    def finish(self, members: dict[int, Member]) -> None:
        """Write the whole table anew, in the order given."""
        write_text(self.path, self._head() + "".join(self._row(member) for member in members.values()))

    def _head(self) -> str:
        return "\n".join([FORMAT, *(f"# {line}" for line in self.header), _joined(self.columns)]) + "\n"

    def _row(self, member: Member) -> str:
        metrics = ["" if math.isnan(value) else repr(value) for value in member.metrics]
        return _joined([str(member.number), *self.given[member.number], *metrics, member.status]) + "\n"

    def _member(self, row: Sequence[str]) -> Member:
        first = 1 + len(self.given[0])
        try:
            number = int(row[0])
            if tuple(row[1:first]) != self.given[number] or len(row) != len(self.columns) or number < 0:
                raise ValueError
            return Member(number, tuple(float(cell) if cell else math.nan for cell in row[first:-1]), row[-1])
        except (ValueError, IndexError):
            fact = f"the row '{','.join(row)}' does not belong to this sweep."
            raise RecordError(fact, place=str(self.path), remedy="Choose another --out.") from None

    def _check_head(self, text: str) -> None:
        if not text.startswith(f"{FORMAT}\n"):
            raise self._foreign()
        wanted, there = self._head().splitlines(), text.splitlines()
        for here, line in zip(wanted, [*there, *[""] * len(wanted)], strict=False):
            if here != line:
                fact = f"the table is of another sweep: it has '{line}' where this one has '{here}'."
                raise RecordError(fact, place=str(self.path), remedy="Choose another --out, or delete the file.")

    def _foreign(self) -> RecordError:
        return RecordError("the file is there already and is no table of a sweep.", place=str(self.path), remedy="Choose another --out.")


def _joined(cells: Sequence[str]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="").writerow([cell.replace("\n", " ") for cell in cells])
    return text.getvalue()
