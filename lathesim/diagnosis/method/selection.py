"""Limits of the search and acceptance of effects."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.limit import Limit

KEPT = "in the place of {} limits from {} to {}; of 29 cases asked before and after, 27 have the same answer and all the same names"


@dataclass(frozen=True)
class SelectionLimits:
    """Limits of the search and acceptance of effects. Questions that are the same ask the same limit."""

    # when two models cannot be told apart
    tie_share: Limit = Limit(
        0.03, "share of gain",
        "two explanations that differ by less cannot be distinguished, as a model is never quite right",
        "assumed", KEPT.format("three", "0.02", "0.03"),
    )  # fmt: skip
    significant: Limit = Limit(
        3.0, "standard errors",
        "a parameter is there above this, and has moved by more than its slopes hold for; a reading is beyond its usual spread",
        "derived",
        "a normal deviate exceeds 3 with a probability of 0.27 %",
    )  # fmt: skip

    # what is tried
    almost_all: Limit = Limit(
        0.95, "share of error",
        "what explains this explains almost all; effects that leave more than this explain nothing",
        "assumed", KEPT.format("six", "0.90", "0.98"),
    )  # fmt: skip

    # what an effect must be
    least_lag: Limit = Limit(0.2, "samples", "a lag below this is how a simulation steps")
    event_start: Limit = Limit(0.01, "share of recording", "a change earlier than this is a sensor offset, not an event")

    # values of the lesson
    value_wider: float = 10.0
    """Times its declared deviation that a value is released."""
