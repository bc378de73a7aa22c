"""What ``lathesim run`` writes on the screen: measured values, published ones beside, and the goals."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from lathesim.analysis.display_unit import plain_number, read_as, shown_with_unit, text_table
from lathesim.analysis.metric import NO_VALUE, Measured
from lathesim.lessons.grading import GoalResult
from lathesim.units import from_si, split_quantity


@dataclass(frozen=True)
class Outcome:
    """One case as it went: its metrics by name, published values (text), how it ended, and the goals held against it.

    ``without`` gives the reason of each metric that has no value, ``nothing_cut`` the sentence about a run that cut nothing.
    """

    case: str
    metrics: Mapping[str, Measured]
    published: Mapping[str, str] = field(default_factory=dict)
    status: str = "complete"
    goals: Sequence[GoalResult] = ()
    without: Mapping[str, str] = field(default_factory=dict)
    nothing_cut: str = ""


def case_table(outcome: Outcome) -> str:
    """Return the metrics of one case, one a line, with the published value beside."""
    beside = any(name in outcome.metrics for name in outcome.published)
    rows = [("", outcome.case or "value", *(["published"] if beside else []))]
    for name, measured in outcome.metrics.items():
        published = outcome.published.get(name, "")
        rows.append((words(name), _like(measured, published), *([published] if beside else [])))
    rows += [(words(name), reason, *([outcome.published.get(name, "")] if beside else [])) for name, reason in outcome.without.items()]
    return "\n".join(text_table(rows))


def variants_table(outcomes: Sequence[Outcome], wanted: Collection[str] = ()) -> str:
    """Return one line a case: metrics with a published value, which stands beside, and the ``wanted`` ones; without any, all."""
    measured = list(dict.fromkeys(name for outcome in outcomes for name in (*outcome.metrics, *outcome.without)))
    named = {name for name in measured if any(name in outcome.published for outcome in outcomes)}
    names = [name for name in measured if name in named or name in wanted] or measured
    judged = any(outcome.goals for outcome in outcomes)
    head = ["case"]
    for name in names:
        head += [words(name), "published"] if name in named else [words(name)]
    rows = [(*head, "goals") if judged else tuple(head)]
    for outcome in outcomes:
        row = [outcome.case]
        for name in names:
            published = outcome.published.get(name, "")
            row.append(_cell(outcome, name, published or next((goal.limit for goal in outcome.goals if goal.metric == name), "")))
            if name in named:
                row.append(published or "-")
        if judged:
            row.append(f"{sum(goal.met for goal in outcome.goals)} of {len(outcome.goals)}" if outcome.status == "complete" else "-")
        rows.append(tuple(row))
    return "\n".join(text_table(rows))


def _cell(outcome: Outcome, name: str, published: str) -> str:
    """Return the measured value; a case that broke down has none to be compared."""
    if outcome.status.startswith("failed"):
        return "unstable" if " is unstable " in outcome.status else "broke down"
    if name in outcome.without:
        return "no value"
    return _like(outcome.metrics[name], published) if name in outcome.metrics else "-"


def nothing_cut_text(outcomes: Sequence[Outcome]) -> str:
    """Return the sentences about cases that cut nothing, one a line, each once with the cases it holds for; empty where all cut."""
    cases: dict[str, list[str]] = {}
    for outcome in outcomes:
        if outcome.nothing_cut:
            cases.setdefault(outcome.nothing_cut, []).append(outcome.case)
    return "\n".join(f"{', '.join(names)}: {sentence}" if len(outcomes) > 1 else sentence for sentence, names in cases.items())


def goals_text(results: Sequence[GoalResult]) -> str:
    """Return a table of goals (limit, value reached, by how much it is missed) and below it the hints of those missed by a value."""
    rows = [("goal", "limit", "reached", "")]
    for result in results:
        reached = f"{plain_number(result.value, 5)} {result.unit}".strip() if not math.isnan(result.value) else "-"
        rows.append((words(result.metric), f"{result.sense} {result.limit}", reached, _verdict(result)))
    hints = dict.fromkeys(f"Hint: {result.hint}" for result in results if result.over > 0.0 and result.hint)
    return "\n".join([*text_table(rows), *hints])


def _verdict(result: GoalResult) -> str:
    if result.met:
        return "met"
    if not result.is_judged:
        return f"not met: {result.reason.removeprefix(NO_VALUE)}"
    if math.isnan(result.value):
        return f"not reached: {result.reason.removeprefix(NO_VALUE)}"
    share = "" if math.isnan(result.share) else f" ({plain_number(from_si(result.share, '%'), 2)} %)"
    return f"missed by {result.over:.3g} {result.unit}".strip() + share


def _like(measured: Measured, text: str) -> str:
    """Return a value in the unit of a quantity as it was written, else in a unit of handy size."""
    unit = split_quantity(text)[1] if text else ""
    if not unit:
        return shown_with_unit(measured.value, read_as(measured.name, measured.unit), 5)
    return f"{plain_number(from_si(measured.value, unit), 5)} {unit}"


def words(name: str) -> str:
    """Return the name of a metric as words."""
    return name.replace("_", " ")
