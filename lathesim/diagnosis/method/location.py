"""Limits of where something is missing and what it depends on."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.limit import Limit


@dataclass(frozen=True)
class LocationLimits:
    """Limits of where something is missing and what it depends on."""

    beyond_chance: Limit = Limit(
        2.0, "times the largest of 19 draws",
        "a dependence score counts above this",
        "derived",
        "with dozens of scores, one of twenty exceeds the largest of 19 draws by chance alone; twice as much leaves room",
    )  # fmt: skip
    chance_draws: int = 19
    """Draws of which the largest is what chance explains."""
    integration_error: Limit = Limit(
        0.002, "share of acting force",
        "a missing force below this share is the error of the integration steps",
        "calibrated",
        "a simulation that steps leaves 0.2 % on the project's own axes",
    )  # fmt: skip
    line_prominent: Limit = Limit(
        6.0, "times the local median", "an amplitude of a residual is a line above this",
        "derived",
        "amplitudes of noise are Rayleigh distributed: one exceeds m medians with 2^(-m^2), of 32,768 frequencies any with 5e-7",
    )  # fmt: skip
    line_share: Limit = Limit(0.02, "share of residual", "a line must hold this much of the mean square")
    line_turns: Limit = Limit(10.0, "repetitions", "what repeats less often within a recording is a trend and no line")
    rhythm: Limit = Limit(
        0.003, "share of motion", "a line is the rhythm of a motion that holds this much of its mean square at that frequency"
    )
    once_a_sample: Limit = Limit(0.05, "repetitions", "a way from sample to sample this near whole repetitions makes them")
    held_speed: Limit = Limit(0.2, "share of way", "a line that repeats once a sample on more than this is noise at a held speed")
    most_lines: int = 4
    """Lines of a residual that are told at most."""
    standstill: Limit = Limit(0.02, "share of top speed", "a part slower than this stands still")
    commanded_standstill: Limit = Limit(0.001, "share of top speed", "a motion without sensor noise stands still below this")
    whole_order: Limit = Limit(
        0.03, "orders",
        "an order this near a whole number is one: a speed that is given, not recorded, is known to a few per cent",
    )  # fmt: skip
