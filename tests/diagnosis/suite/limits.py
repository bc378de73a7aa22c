"""``python -m tests.diagnosis.suite limits``: how near the statistics of right and of wrong answers come to each limit of the method.

They are in what ``run --margins`` keeps beside an answer.
A margin is a statistic over its limit. Of each case that asked the limit the margin nearest to one counts, below it and above it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any

from lathesim.diagnosis.method import STANDARD, Limit
from tests.diagnosis.suite.generate import truth_of
from tests.diagnosis.suite.runner import margins_file, read_answer
from tests.diagnosis.suite.scoring import score


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


def margins_of(answers: Path, case: str) -> dict[str, list[float]]:
    """Return the margins of a case by limit, as they were noted."""
    file = margins_file(answers, case)
    kept = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    return {name: [one for one in pair if one is not None] for name, pair in kept.items()}


def near(folders: Sequence[Path], answers: Path) -> dict[str, Near]:
    """Return how near cases come to each limit."""
    found = {name: Near() for name, _ in every_limit()}
    for folder in folders:
        told = read_answer(answers, folder.name)
        if told is None or not told["answer"]:
            continue
        made = score(folder.name, truth_of(folder), told)
        for name, margins in margins_of(answers, folder.name).items() if made.asked else ():
            if name in found:
                found[name].note(not made.missed, margins)
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


def print_limits(folders: Sequence[Path], answers: Path, markdown: Path | None) -> None:
    """Print the table, and write it where asked."""
    lines = table(near(folders, answers))
    print("\n".join(lines))
    if markdown is not None:
        markdown.write_text("\n".join(lines) + "\n", encoding="utf-8")
