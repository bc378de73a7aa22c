"""Limits of when one explanation is better than another one, and settings of the search for it."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.limit import Limit


@dataclass(frozen=True)
class ExplainingLimits:
    """Limits of when one explanation is better than another one, and settings of the search for it."""

    errors: Limit = Limit(
        3.0, "standard errors",
        "an explanation is better where its gain is above this",
        "derived",
        "a normal deviate exceeds 3 with a probability of 0.13 %: of fifty candidates, one in fifteen recordings",
    )  # fmt: skip
    tie_errors: Limit = Limit(
        2.0, "standard errors",
        "two explanations whose difference is below this cannot be told apart",
        "derived",
        "95 % of a normal deviate",
    )  # fmt: skip

    # what the search tries: no answer depends on these but by what is found from there
    fitted_at_once: int = 5
    """Candidates that are fitted at once."""
    batches: int = 3
    """Batches of them, until one predicts better."""
    hopeless: float = 0.1
    """Share of the best screening gain below which a candidate is not fitted."""
    rival: float = 0.4
    """Share of the best screening gain from which on a candidate is fitted in the first batch."""
    near: float = 0.6
    """Share of the best gain from which on a trial is fitted until nothing moves."""
    starts: int = 2
    """Fits of a candidate that are begun."""
    sizes: tuple[float, ...] = (1.0, 0.3)
    """Shares of the size that screening gives an effect, from which a fit may begin."""
    points: int = 6
    """Usual values from which a fit may begin."""
    starts_of_simulation: int = 6
    """The same two where the error of the simulation is fitted."""
    points_of_simulation: int = 40
    steps: int = 6
    """Steps of a first fit."""
    steps_of_simulation: int = 25
    moved: float = 1.0
    """Declared deviations from which on values of the lesson may have been drawn away by what an effect explains."""
    clearly: float = 0.7
    """Share of the power that the next start leaves below which a start is the only one."""
    apart: float = 0.3
    """Relative difference of a value by which two starts are different ones."""
    whole_order: float = 0.002
    """Standard deviation of a fitted order about its whole number [orders]."""
    fine: float = 1e-5
    """Share of the cost below which a step of a fit ends it."""
    settled: float = 1.0
    """Gain below which a further round of a fit is not made [nats]."""
