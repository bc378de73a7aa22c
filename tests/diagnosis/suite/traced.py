"""A method whose limits note how near the statistics of a diagnosis come to them, and decide as they did.

    margin = statistic / limit

Noted are, for each limit, the nearest margins below and above one, and how often it was asked. A limit that is added to something, or
rounded to a whole number, is not followed further; a share of something (a limit times a number) is.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np

from lathesim.diagnosis.method import Limit, Method

COMPARED: dict[Any, Callable[[Any, Any], Any]] = {
    np.less: operator.lt, np.less_equal: operator.le, np.greater: operator.gt, np.greater_equal: operator.ge,
}  # fmt: skip


@dataclass
class Margins:
    """How near a limit was come to: the largest margin below one, the smallest above it, and the number of questions on either side."""

    below: float = 0.0
    above: float = np.inf
    times_below: int = 0
    times_above: int = 0

    def note(self, statistic: Any, limit: float) -> None:
        """Note some statistics that were held against the limit."""
        values = np.asarray(statistic, dtype=float).ravel()
        margins = values[np.isfinite(values)] / limit if limit else np.empty(0)
        low, high = margins[margins <= 1.0], margins[margins > 1.0]
        self.below, self.above = max(self.below, low.max(initial=0.0)), min(self.above, high.min(initial=np.inf))
        self.times_below, self.times_above = self.times_below + len(low), self.times_above + len(high)


class Traced(Limit):
    """A limit that notes what it is held against; ``factor`` times it still is."""

    margins: Margins

    @classmethod
    def of(cls, limit: Limit, margins: Margins, value: float | None = None) -> Traced:
        """Return a limit, or a multiple of it, that notes in ``margins``."""
        made = cls(float(limit) if value is None else value, limit.unit, limit.meaning, limit.basis, limit.evidence)
        made.name, made.margins = limit.name, margins
        return made

    def _held(self, other: Any, compare: Callable[[Any, Any], Any]) -> Any:
        if not isinstance(other, Limit):
            self.margins.note(other, float(self))
        return compare(float(self), float(other) if isinstance(other, float) else other)

    def __lt__(self, other: Any) -> Any:
        return self._held(other, operator.lt)

    def __le__(self, other: Any) -> Any:
        return self._held(other, operator.le)

    def __gt__(self, other: Any) -> Any:
        return self._held(other, operator.gt)

    def __ge__(self, other: Any) -> Any:
        return self._held(other, operator.ge)

    def __mul__(self, other: Any) -> Any:
        number = isinstance(other, int | float | np.number) and not isinstance(other, Limit)
        return Traced.of(self, self.margins, float(self) * float(other)) if number else float(self) * other

    __rmul__ = __mul__

    def times(self, factor: float) -> Limit:
        return Traced.of(self, self.margins, float(self) * factor)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **more: Any) -> Any:
        plain = [float(one) if isinstance(one, Traced) else one for one in inputs]
        if ufunc in COMPARED and method == "__call__":
            other = inputs[1] if inputs[0] is self else inputs[0]
            if not isinstance(other, Limit):
                self.margins.note(other, float(self))
        if ufunc is np.multiply and method == "__call__" and not more and all(np.ndim(one) == 0 for one in plain):
            return Traced.of(self, self.margins, float(plain[0]) * float(plain[1]))
        return getattr(ufunc, method)(*plain, **more)


def traced(method: Method) -> tuple[Method, dict[str, Margins]]:
    """Return a method whose limits note what they are held against, and what they note, by shelf and name."""
    noted: dict[str, Margins] = {}
    return _traced(method, "", noted), noted


def _traced(table: Any, shelf: str, noted: dict[str, Margins]) -> Any:
    changes: dict[str, Any] = {}
    for item in fields(table):
        value, name = getattr(table, item.name), f"{shelf}{item.name}"
        if is_dataclass(value):
            changes[item.name] = _traced(value, f"{name}.", noted)
        elif isinstance(value, Limit):
            changes[item.name] = Traced.of(value, noted.setdefault(name, Margins()))
    return replace(table, **changes)


@contextmanager
def noting() -> Iterator[dict[str, Margins]]:
    """Let every diagnosis within note how near it came to its limits."""
    from lathesim.diagnosis import diagnose as steps

    asked, noted = steps.diagnose, {}

    def told(question: Any, tell: Any = None) -> Any:
        method, margins = traced(question.method)
        noted.update(margins)
        return asked(replace(question, method=method), tell)

    steps.diagnose = told
    try:
        yield noted
    finally:
        steps.diagnose = asked
