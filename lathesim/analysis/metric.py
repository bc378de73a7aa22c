"""What a metric is, and how a set of them is measured on a record."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.errors import RecordError
from lathesim.record import FloatArray, Record


@dataclass(frozen=True)
class Metric:
    """One number of a record: its name, its SI unit, one sentence about it, and the function that measures it.

    The function raises :class:`MissingChannelError` where the record has not what it needs (use :func:`signal` to get channels).
    """

    name: str
    unit: str
    doc: str
    measure: Callable[[Record], float]


class MissingChannelError(RecordError):
    """A metric needs a channel that the record does not have."""

    def __init__(self, *wanted: str) -> None:
        self.wanted = wanted
        super().__init__(f"not available: needs channel {' or '.join(wanted)}")


@dataclass(frozen=True)
class Measured:
    """A metric's value [``unit``]."""

    name: str
    value: float
    unit: str

    def __str__(self) -> str:
        return shown_with_unit(self.value, self.unit)


@dataclass(frozen=True)
class Measurements:
    """What could be measured, by name, and for what could not be the reason."""

    values: dict[str, Measured] = field(default_factory=dict)
    skipped: dict[str, str] = field(default_factory=dict)

    def as_json(self) -> dict[str, dict[str, float | str | None]]:
        """Give ``{name: {"value", "unit"}}``; a value that is no finite number becomes null."""
        return {name: {"value": item.value if math.isfinite(item.value) else None, "unit": item.unit} for name, item in self.values.items()}


def measure(record: Record, metrics: Mapping[str, Metric] | Iterable[Metric]) -> Measurements:
    """Measure what can be measured. A metric whose channels are missing, or that fails, is listed under ``skipped`` with the reason."""
    measured = Measurements()
    for metric in metrics.values() if isinstance(metrics, Mapping) else metrics:
        try:
            measured.values[metric.name] = Measured(metric.name, float(metric.measure(record)), metric.unit)
        except RecordError as error:
            measured.skipped[metric.name] = str(error)
        except (ArithmeticError, ValueError, TypeError, LookupError) as error:
            measured.skipped[metric.name] = f"the metric failed: {type(error).__name__}: {error}"
    return measured


def find_channel(record: Record, *wanted: str) -> str | None:
    """Give the first channel that is called, or ends, as one of ``wanted``: ``"contour.contour_error"``, ``".contour_error"``."""
    for name in wanted:
        if name.startswith("."):
            found = record.ending_with(name)
            if found:
                return found[0]
        elif name in record:
            return name
    return None


def signal(record: Record, *wanted: str) -> FloatArray:
    """Give the values of the first channel found, see :func:`find_channel`; :class:`MissingChannelError` where there is none."""
    name = find_channel(record, *wanted)
    if name is None:
        raise MissingChannelError(*wanted)
    if not len(record):
        raise RecordError("not available: the record is empty")
    return record[name]
