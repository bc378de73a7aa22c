"""The decision repeated with its limits shaken and its statistics moved by their errors; nothing is simulated anew.

In each repetition every limit is moved up or down by 10 to 20 %, the same limit alike wherever it is asked, and each statistic by a normal
draw of its standard error. The rules then decide again.
Source: B. Yu, Stability, Bernoulli 19 (2013), 1484-1500 (a conclusion is judged by how it stands perturbations of data and of method).
Left out: limits within the search and within the checks of recordings, which would need other simulations; statistics whose error is not
known are not moved.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from lathesim.diagnosis.records.residual_test import Condition
from lathesim.diagnosis.records.stability import Stability
from lathesim.diagnosis.verdict.decision import decide
from lathesim.diagnosis.verdict.grounds import Grounds

OTHER_EFFECTS = "other effects"


def stability(grounds: Grounds, decisions: int = 200, least: float = 0.1, most: float = 0.2, seed: int = 1) -> Stability:
    """Return how often ``decisions`` with limits moved by ``least`` to ``most`` of themselves give the same answer."""
    draws, same = np.random.default_rng(seed), outcome(grounds)
    counts: Counter[str] = Counter()
    for _ in range(decisions):
        factors: dict[str, float] = {}

        def shaken(condition: Condition, factors: dict[str, float] = factors) -> Condition:
            # what has no name is no limit of the method: nothing at all, the end of what a value may be
            if condition.name not in factors:
                factors[condition.name] = 1.0 + bool(condition.name) * float(draws.choice((-1.0, 1.0)) * draws.uniform(least, most))
            moved = condition.statistic + condition.error * float(draws.standard_normal())
            return replace(condition, statistic=moved, limit=condition.limit * factors[condition.name])

        counts[outcome(changed(grounds, shaken))] += 1
    shares = {name: count / decisions for name, count in counts.most_common()}
    return Stability(shares.get(same, 0.0), decisions, shares, hinges_on(grounds, most))


def outcome(grounds: Grounds) -> str:
    """Return the verdict, or that other effects would be accepted."""
    others = any(not criterion.holds for criterion in grounds.accepted) or any(criterion.holds for criterion in grounds.refused)
    return OTHER_EFFECTS if others else decide(grounds).verdict


def hinges_on(grounds: Grounds, by: float) -> tuple[str, ...]:
    """Return the limits of which one alone, moved up or down by a share of itself, changes the answer."""
    names: dict[str, bool] = {}

    def noted(condition: Condition) -> Condition:
        names[condition.name] = bool(condition.name)
        return condition

    changed(grounds, noted)
    same, factors = outcome(grounds), (1.0 - by, 1.0 + by)
    return tuple(
        name for name, known in names.items() if known and any(outcome(changed(grounds, _moved(name, one))) != same for one in factors)
    )


def _moved(name: str, factor: float) -> Callable[[Condition], Condition]:
    return lambda condition: replace(condition, limit=condition.limit * factor) if condition.name == name else condition


def changed(grounds: Grounds, change: Callable[[Condition], Condition]) -> Grounds:
    """Return the grounds with each of their conditions changed."""
    zero = grounds.first_may_be_zero
    return replace(
        grounds,
        tests=tuple(test.changed(change) for test in grounds.tests),
        explains=grounds.explains.changed(change),
        first_may_be_zero=zero.changed(change) if zero else None,
        moved=grounds.moved.changed(change),
        accepted=tuple(one.changed(change) for one in grounds.accepted),
        refused=tuple(one.changed(change) for one in grounds.refused),
        ties=tuple(one.changed(change) for one in grounds.ties),
    )
