"""What ``lathesim run`` writes on the screen: measured values, published ones beside, and the goals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.analysis.metric import Measured
from lathesim.lessons.schema import Goal
from lathesim.units import from_si, quantity, split_quantity


@dataclass(frozen=True)
class Outcome:
    """One case as it went: its metrics by name, published values (text), and how it ended."""

    case: str
    metrics: Mapping[str, Measured]
    published: Mapping[str, str] = field(default_factory=dict)
    status: str = "complete"


def case_table(outcome: Outcome) -> str:
    """Give the metrics of one case, one a line, with the published value beside."""
    beside = any(name in outcome.metrics for name in outcome.published)
    rows = [("", outcome.case or "value", *(["published"] if beside else []))]
    for name, measured in outcome.metrics.items():
        published = outcome.published.get(name, "")
        rows.append((_words(name), _like(measured, published), *([published] if beside else [])))
    return _aligned(rows)


def variants_table(outcomes: Sequence[Outcome]) -> str:
    """Give one line a case, each metric with a published value beside it; without any, all metrics."""
    measured = list(dict.fromkeys(name for outcome in outcomes for name in outcome.metrics))
    named = [name for name in measured if any(name in outcome.published for outcome in outcomes)]
    names = named or measured
    head = ["case"]
    for name in names:
        head += [_words(name), "published"] if named else [_words(name)]
    rows = [tuple(head)]
    for outcome in outcomes:
        row = [outcome.case]
        for name in names:
            published = outcome.published.get(name, "")
            row.append(_cell(outcome, name, published))
            if named:
                row.append(published or "-")
        rows.append(tuple(row))
    return _aligned(rows)


def _cell(outcome: Outcome, name: str, published: str) -> str:
    """Give the measured value; a case that broke down has none to be compared."""
    if outcome.status.startswith("failed"):
        return "broke down"
    return _like(outcome.metrics[name], published) if name in outcome.metrics else "-"


def goal_lines(goals: Sequence[Goal], metrics: Mapping[str, Measured]) -> list[str]:
    """Give one line for each goal: met, or missed by how much and the hint."""
    lines = []
    for goal in goals:
        measured = metrics.get(goal.metric)
        if measured is None:
            lines.append(f"Goal {_words(goal.metric)}: not measured in this run.")
            continue
        for word, text, sign in (("at most", goal.at_most, 1.0), ("at least", goal.at_least, -1.0)):
            if text is None:
                continue
            missed = sign * (measured.value - quantity(text, measured.unit)) > 0.0 or measured.value != measured.value
            hint = f" Hint: {goal.hint}" if missed and goal.hint else ""
            lines.append(f"Goal {_words(goal.metric)} {word} {text}: {'missed' if missed else 'met'}, {_like(measured, text)}.{hint}")
    return lines


def _like(measured: Measured, text: str) -> str:
    """Give a value in the unit of a quantity as it was written, else in a unit of handy size."""
    unit = split_quantity(text)[1] if text else ""
    if not unit:
        return shown_with_unit(measured.value, measured.unit, 5)
    return f"{from_si(measured.value, unit):.5g} {unit}"


def _words(name: str) -> str:
    return name.replace("_", " ")


def _aligned(rows: Sequence[Sequence[str]]) -> str:
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    lines.insert(1, "  ".join("-" * width for width in widths))
    return "\n".join(lines)
