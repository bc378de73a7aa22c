"""A test of what a model leaves: statistics held against limits, and what is said where it fails."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

from lathesim.limit import Limit

Relation = Literal[">", ">=", "<", "<="]
Severity = Literal["weakens", "fails", "discredits"]
"""A failed test may cost a model its adequacy only, speak against its name, or leave its effects credited with nothing."""


@dataclass(frozen=True)
class Condition:
    """A statistic held against a limit [``unit``]; ``name`` is the limit's in the method, ``error`` the statistic's standard error.

    It holds where the relation does, and never for a statistic that is not a number.
    """

    statistic: float
    relation: Relation
    limit: float
    name: str
    unit: str
    error: float = 0.0

    @property
    def holds(self) -> bool:
        """Whether the statistic is on the side of the limit that the relation says."""
        if self.relation == ">":
            return self.statistic > self.limit
        if self.relation == ">=":
            return self.statistic >= self.limit
        return self.statistic < self.limit if self.relation == "<" else self.statistic <= self.limit

    @property
    def excess(self) -> float:
        """How far beyond the limit the statistic is, in logarithms of their ratio where both are positive; negative on the other side."""
        if math.isnan(self.statistic):
            return -math.inf
        both = self.statistic > 0.0 and self.limit > 0.0
        beyond = math.log(self.statistic / self.limit) if both and math.isfinite(self.statistic) else self.statistic - self.limit
        return beyond if self.relation in (">", ">=") else -beyond


def held(statistic: float, relation: Relation, limit: float, error: float = 0.0) -> Condition:
    """Return a statistic held against a limit of the method; ``error`` is the standard error of the statistic, 0 of one without end."""
    name, unit = (limit.name, limit.unit) if isinstance(limit, Limit) else ("", "")
    return Condition(float(statistic), relation, float(limit), name, unit, float(error) if math.isfinite(statistic) else 0.0)


@dataclass(frozen=True)
class Criterion:
    """Conditions that decide together: it holds where of each clause at least one condition does. Without a clause it always holds."""

    clauses: tuple[tuple[Condition, ...], ...] = ()

    @property
    def holds(self) -> bool:
        """Whether each clause holds."""
        return all(any(condition.holds for condition in clause) for clause in self.clauses)

    @property
    def deciding(self) -> Condition | None:
        """The condition that decides: of each clause the one that holds by most, of these the one that holds by least."""
        best = [max(clause, key=lambda condition: condition.excess) for clause in self.clauses if clause]
        return min(best, key=lambda condition: condition.excess, default=None)

    def changed(self, change: Callable[[Condition], Condition]) -> Criterion:
        """Return the criterion with each of its conditions changed."""
        return Criterion(tuple(tuple(change(condition) for condition in clause) for clause in self.clauses))


def all_of(*conditions: Condition) -> Criterion:
    """Return the criterion that holds where all conditions do."""
    return Criterion(tuple((condition,) for condition in conditions))


@dataclass(frozen=True)
class ResidualTest:
    """A test of what is left. It fails where its criterion holds; ``sentence`` then says why, as the rest of a sentence.

    ``channel`` is a channel, a part or a value of the lesson, empty where the test is of the whole model.
    """

    name: str
    channel: str
    fails_where: Criterion
    sentence: str
    severity: Severity = "fails"

    @property
    def passed(self) -> bool:
        """Whether nothing speaks against the model."""
        return not self.fails_where.holds

    @property
    def statistic(self) -> float:
        """The statistic that decides; NaN where a fact decides and no number."""
        return self.fails_where.deciding.statistic if self.fails_where.deciding else math.nan

    @property
    def limit(self) -> float:
        """The limit that it is held against."""
        return self.fails_where.deciding.limit if self.fails_where.deciding else math.nan

    @property
    def unit(self) -> str:
        """What both count."""
        return self.fails_where.deciding.unit if self.fails_where.deciding else ""

    def changed(self, change: Callable[[Condition], Condition]) -> ResidualTest:
        """Return the test with its conditions changed."""
        return replace(self, fails_where=self.fails_where.changed(change))
