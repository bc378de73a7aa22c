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
    fit_share: Limit = Limit(
        0.01, "share of gain",
        "two of the same form that differ by less cannot, as a fit is coarse; a gain that the validation recording has less of is no gain",
    )  # fmt: skip
    significant: Limit = Limit(
        3.0, "standard errors",
        "a parameter is there above this, and has moved by more than its slopes hold for; a reading is beyond its usual spread",
        "derived",
        "a normal deviate exceeds 3 with a probability of 0.27 %",
    )  # fmt: skip

    # what is tried
    hopeless: Limit = Limit(
        0.2, "share of what decides",
        "what scores or gains less is not tried further",
        "assumed", KEPT.format("five", "0.1", "0.3"),
    )  # fmt: skip
    rival: Limit = Limit(
        0.8, "share of the best",
        "what scores, gains or explains this share of the best is its rival; two recordings agree where each gains this share of the other",
        "assumed", KEPT.format("ten", "0.6", "0.9"),
    )  # fmt: skip
    almost_all: Limit = Limit(
        0.95, "share of error",
        "what explains this explains almost all; effects that leave more than this explain nothing",
        "assumed", KEPT.format("six", "0.90", "0.98"),
    )  # fmt: skip
    sizes_tried: tuple[float, ...] = (1.0, 0.5, 0.2, 0.05)
    """Shares of the size that screening gives an effect from which a fit may begin."""
    stiffer_tried: tuple[float, ...] = (2.0, 4.0, 8.0)
    """Times its stiffness from which a fit of a stiff effect may begin."""
    slopes_afresh: int = 2
    """How often slopes are taken afresh in a trial."""
    settled: float = 1.0
    """Gain below which a further round of fitting is not done [nats]."""
    fine: float = 1e-5
    """Share of the cost below which a step of a trial ends it."""
    most_rivals: int = 3
    """Rivals, simpler relatives, restarts and rejections of one model at most: what a search may spend."""

    # what an effect must be
    small_effect: Limit = Limit(
        0.01, "share of error",
        "an effect below this beside others is compared with what acts at its place; an extended shape must explain this",
    )  # fmt: skip
    much_of_all: Limit = Limit(0.3, "share of error", "a periodic effect above this is much of what was missing")
    least_lag: Limit = Limit(0.2, "samples", "a lag below this is how a simulation steps")
    event_start: Limit = Limit(0.01, "share of recording", "a change earlier than this is a sensor offset, not an event")
    wave_surely_there: Limit = Limit(10.0, "margins", "a periodic effect that scores this is fitted whatever its share of the residual")
    whole_order: float = 0.002
    """Standard deviation of a fitted order about its whole number [orders]."""

    # the motion that frictions sense, and the closed loop
    unexplained_power: Limit = Limit(40.0, "whitened power", "above this a channel still has an unexplained residual")
    increase_elsewhere: Limit = Limit(0.1, "share of decrease", "largest increase allowed in other channels")
    simulated_motion_left: Limit = Limit(0.15, "share of error", "frictions sense the simulated motion where it leaves less than this")

    # values of the lesson
    implausible_penalty: Limit = Limit(
        16.0, "penalty",
        "above this the lesson's values, taken together, are implausible",
        "derived",
        "chi-squared: three values that are as the lesson declares exceed it with 0.1 %, four with 0.3 %",
    )  # fmt: skip
    restores_clearly: Limit = Limit(4.0, "1", "an effect restores plausible values where their penalty is this much below the limit")
    value_at_bound: Limit = Limit(
        1e-3, "share of its range",
        "a value this near a bound would go further, and explains nothing",
        "derived",
        "a bounded fit ends within its tolerance, 1e-8 of the range, of an active bound",
    )  # fmt: skip
    value_wider: float = 10.0
    """Times its declared deviation that a value is released."""
