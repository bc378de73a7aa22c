"""What a metric is, how a set of them is measured on a record, and the stock metrics."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from lathesim.analysis.display_unit import read_as, shown_with_unit
from lathesim.errors import RecordError
from lathesim.record import FloatArray, Record


@dataclass(frozen=True)
class Metric:
    """One number of a record: its name, its SI unit, one sentence about it, and the function that measures it.

    The function raises :class:`MissingChannelError` where the record has not what it needs (use :func:`signal` to get channels), and
    :class:`NoValueError` where the run gives it no value. A metric ``of_cutting`` has none where nothing was cut: no roughness is not a
    fine one.
    """

    name: str
    unit: str
    doc: str
    measure: Callable[[Record], float]
    of_cutting: bool = False


class MissingChannelError(RecordError):
    """A metric needs a channel that the record does not have."""

    def __init__(self, *wanted: str) -> None:
        self.wanted = wanted
        super().__init__(f"not available: needs channel {' or '.join(wanted)}")


class NoValueError(RecordError):
    """A metric's channels are there, and the run gives it no value."""

    def __init__(self, why: str) -> None:
        super().__init__(f"{NO_VALUE}{why}")


NO_VALUE = "no value: "
"""How the reason of a metric without a value begins."""
NOTHING_CUT = "nothing was cut"
CONTACT = ("in_contact", "in_cut")
CUTTING_FORCE = ("cutting_force", "main_force")
CONTOUR_ERROR = ("contour.contour_error", "contour_error")
"""A machine may work out its contour error twice, for the observer and from what its sensors read; the first is called ``contour``."""
SPINDLE_SPEED = ("spindle_speed", "speed")
"""Role of the speed of the spindle, and the usual name of that output where a spindle declares no role."""
_SIGNS_OF_CUTTING = {"removal_rate": 0.0, "engaged": 0.5, "in_cut": 0.5, "in_contact": 0.5}
"""Roles of channels, the surest first, that are above so much while something is cut."""


@dataclass(frozen=True)
class Measured:
    """A metric's value [``unit``]."""

    name: str
    value: float
    unit: str

    def __str__(self) -> str:
        return shown_with_unit(self.value, read_as(self.name, self.unit))


@dataclass(frozen=True)
class Measurements:
    """What could be measured, by name, and for what could not be the reason.

    ``without`` has the unit of those among the skipped whose channels are there and whose value is not.
    """

    values: dict[str, Measured] = field(default_factory=dict)
    skipped: dict[str, str] = field(default_factory=dict)
    without: dict[str, str] = field(default_factory=dict)

    def as_json(self) -> dict[str, dict[str, float | str | None]]:
        """Return ``{name: {"value", "unit"}}``; what is no finite number becomes null, and what has no value too, with the reason."""
        told: dict[str, dict[str, float | str | None]] = {
            name: {"value": item.value if math.isfinite(item.value) else None, "unit": item.unit} for name, item in self.values.items()
        }
        return told | {name: {"value": None, "unit": unit, "reason": self.skipped[name]} for name, unit in self.without.items()}


def measure(record: Record, metrics: Mapping[str, Metric] | Iterable[Metric]) -> Measurements:
    """Measure what can be measured; a metric that lacks channels, has no value or fails is listed under ``skipped`` with the reason."""
    measured = Measurements()
    nothing_cut = sign_of_cutting(record) is not None and not was_cut(record)
    for metric in metrics.values() if isinstance(metrics, Mapping) else metrics:
        try:
            value = float(metric.measure(record))
            if metric.of_cutting and nothing_cut:
                raise NoValueError(NOTHING_CUT)
            measured.values[metric.name] = Measured(metric.name, value, metric.unit)
        except NoValueError as error:
            measured.skipped[metric.name] = f"{NO_VALUE}{NOTHING_CUT}" if nothing_cut else str(error)
            measured.without[metric.name] = metric.unit
        except RecordError as error:
            measured.skipped[metric.name] = str(error)
        except (ArithmeticError, ValueError, TypeError, LookupError) as error:
            measured.skipped[metric.name] = f"the metric failed: {type(error).__name__}: {error}"
    return measured


def sign_of_cutting(record: Record) -> str | None:
    """Return the channel that shows whether something is cut; none where no cutting process was recorded."""
    return find_channel(record, *_SIGNS_OF_CUTTING)


def was_cut(record: Record) -> bool:
    """Return whether something was cut, as far as the record tells."""
    for role, least in _SIGNS_OF_CUTTING.items():
        if found := record.by_role(role):
            return bool((record[found[0]] > least).any())
    return False


def find_channel(record: Record, *wanted: str) -> str | None:
    """Return the first channel that plays a role among ``wanted``, or is called so: ``"contour_error"``, ``"x_axis.position"``.

    A text that begins with a point, as ``".contour_error"``, is the end of a name.
    """
    for name in wanted:
        if name in record:
            return name
        found = record.ending_with(name) if name.startswith(".") else record.by_role(name)
        if found:
            return found[0]
    return None


def signal(record: Record, *wanted: str) -> FloatArray:
    """Return the values of the first channel found, see :func:`find_channel`; :class:`MissingChannelError` where there is none."""
    name = find_channel(record, *wanted)
    if name is None:
        raise MissingChannelError(*wanted)
    if not len(record):
        raise RecordError("not available: the record is empty")
    return record[name]


def stock_metrics() -> dict[str, Metric]:
    """Return the stock metrics by name, in the order in which they are shown."""
    from lathesim.analysis.circular_test import CIRCLE_METRICS
    from lathesim.analysis.turning_metrics import CHATTER_METRICS, COST_METRICS, METRICS, MOTION_METRICS

    return {metric.name: metric for metric in (*METRICS, *COST_METRICS, *CIRCLE_METRICS, *CHATTER_METRICS, *MOTION_METRICS)}
