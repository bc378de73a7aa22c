"""Limits of where something is missing and what it depends on."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.limit import Limit


@dataclass(frozen=True)
class LocationLimits:
    """Limits of where something is missing and what it depends on."""

    answers: int = 20
    """Answers to a command, one after the other, that a recording is taken for ..."""
    shortest_answer: int = 64
    """... of so many samples at least ..."""
    least_answers: int = 4
    """... and so many of them, else coherence is not asked about."""
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
    band_share: Limit = Limit(
        0.2,
        "share of whitened residual",
        "a narrow band must hold this share to be reported, or of the residual as it is where nothing drives it",
    )
    band_below: float = 0.25
    """Share of its frequency up to which the power below a swing is looked at."""
    band_quiet: Limit = Limit(0.2, "share of top power", "below a swing the power stays under this share of its top")
    band_edge: float = 0.1
    """Share of the top power below which a band is said to end."""
    band_least_cycles: Limit = Limit(60, "cycles in a recording", "the strongest band below this is the motion's own or a slow drift")
    band_prominent: Limit = Limit(
        12.0, "times the local median",
        "a hum stands out above this, and a drive that does so at its frequency is what swings there",
    )  # fmt: skip
    wide_band_prominent: Limit = Limit(4.0, "times the local median", "a hum that wanders stands out above this")
    band_widths: tuple[int, int] = (7, 41)
    """Frequencies over which the power is averaged: of a hum, and of one that wanders."""
    band_around: int = 60
    """Widths over which the local median of the power is taken."""
    band_near: int = 6
    """Widths on either side of a peak over which a band is added up."""
    band_of_floor: Limit = Limit(0.5, "resolutions", "a band must move its channel by this much")
    band_of_step: Limit = Limit(
        0.41, "resolutions, rms",
        "a band must move its channel by more than the rounding of a difference",
        "derived",
        "the rounding error of one reading is uniform, 0.29 of a step (rms); of the difference of two readings 0.41",
    )  # fmt: skip
    band_highest: float = 0.9
    """Share of the resolved frequencies up to which bands are looked for: above it a difference of two samples rings by itself."""
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

    @property
    def bands(self) -> tuple[tuple[int, float], ...]:
        """Each width over which the power is averaged, with the prominence that it asks."""
        return tuple(zip(self.band_widths, (self.band_prominent, self.wide_band_prominent), strict=True))
