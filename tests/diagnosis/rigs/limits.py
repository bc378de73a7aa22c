"""``python -m tests.diagnosis.rigs limits``: how near the statistics of right and of wrong answers come to each limit of the method.

    margin = statistic / limit

A diagnosis notes for each limit the nearest margins below and above one, and how often it was asked. A limit that is added to something, or
rounded to a whole number, is not followed further; a share of something (a limit times a number) is. Of each case that asked the limit the
margin nearest to one counts, below it and above it.
"""

from __future__ import annotations

import json
import math
import operator
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.diagnosis.method import STANDARD, Limit, Method
from tests.diagnosis.asking import Answer, ask_here, truth_of, words_of
from tests.diagnosis.scoring import marks

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


@dataclass
class Near:
    """How near right and wrong cases come to a limit: for each the margins nearest to one, below and above, a case each."""

    below: dict[bool, list[float]] = field(default_factory=lambda: {True: [], False: []})
    above: dict[bool, list[float]] = field(default_factory=lambda: {True: [], False: []})

    def note(self, right: bool, margins: Sequence[float]) -> None:
        """Note the margins of one case."""
        low, high = [one for one in margins if one <= 1.0], [one for one in margins if one > 1.0]
        if low:
            self.below[right].append(max(low))
        if high:
            self.above[right].append(min(high))

    @property
    def decides(self) -> bool:
        """Whether some cases were on one side and some on the other."""
        return bool(self.below[True] + self.below[False]) and bool(self.above[True] + self.above[False])


def every_limit(table: Any = STANDARD, shelf: str = "") -> Iterator[tuple[str, Limit]]:
    """Return the limits of the method by shelf and name."""
    for item in fields(table):
        value = getattr(table, item.name)
        if is_dataclass(value):
            yield from every_limit(value, f"{shelf}{item.name}.")
        elif isinstance(value, Limit):
            yield f"{shelf}{item.name}", value


def noted(folder: Path) -> dict[str, Any]:
    """Return the answer to the case in a folder and how near it came to each limit; what is kept there is not asked again."""
    file = folder / "margins.json"
    if not file.is_file():
        with noting() as found:
            told = ask_here(*words_of(folder))
        kept = {name: [one.below if one.times_below else None, one.above if one.times_above else None] for name, one in found.items()}
        file.write_text(json.dumps({"told": told, "margins": kept}), encoding="utf-8")
    return dict(json.loads(file.read_text(encoding="utf-8")))


def near(folders: Sequence[Path]) -> dict[str, Near]:
    """Return how near cases come to each limit."""
    found = {name: Near() for name, _ in every_limit()}
    for folder in folders:
        one = noted(folder)
        made = marks(truth_of(folder), Answer(one["told"]))
        for name, margins in one["margins"].items() if made else ():
            if name in found:
                found[name].note(all(made.values()), [margin for margin in margins if margin is not None])
    return found


def table(found: dict[str, Near]) -> list[str]:
    """Return the table as Markdown: limits that decided first, those that nearly did before others."""
    lines = [
        "| limit | value | basis | right: below | above | wrong: below | above | cases |",
        "|---|---|---|---|---|---|---|---|",
    ]
    known = dict(every_limit())
    rows = sorted(found.items(), key=lambda item: (not item[1].decides, _gap(item[1]), item[0]))
    for name, one in rows:
        cells = [_nearest(one.below[right], max) + "|" + _nearest(one.above[right], min) for right in (True, False)]
        cases = [max(len(one.below[right]), len(one.above[right])) for right in (True, False)]
        right, wrong = (cell.replace("|", " | ") for cell in cells)
        limit = known[name]
        lines.append(
            f"| {name} | {float(limit):.4g} {limit.unit} | {limit.basis} | {right} | {wrong} | {cases[0]} right, {cases[1]} wrong |"
        )
    return lines


def _nearest(margins: list[float], pick: Any) -> str:
    return f"{pick(margins):.3g} ({len(margins)})" if margins else "-"


def _gap(one: Near) -> float:
    """Return how near the right cases come to one, on a logarithmic scale."""
    margins = [*one.below[True], *one.above[True]]
    return min((abs(math.log(margin)) for margin in margins if margin > 0.0), default=math.inf)
