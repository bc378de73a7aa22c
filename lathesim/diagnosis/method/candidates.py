"""Limits of which candidates are tried and from where."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.limit import Limit


@dataclass(frozen=True)
class CandidateLimits:
    """Limits of which candidates are tried, and where a search begins."""

    # which waves and limits are effects
    most_lost: Limit = Limit(0.3, "share of speed", "the largest load may cost at most this share of the largest speed")

    # where a search begins: no answer depends on these but by what is found from there
    strongest_lines: int = 1
    """Strongest lines of a periodogram that become starting points."""
    prominent_lines: int = 2
    """Lines that stand out most that become starting points."""
    least_turns: float = 2.0
    """How often the longest wave of a geometry that is looked for repeats within the recording."""
    least_turns_of_force: float = 5.0
    """The same of a force, as other slow forces are there too."""
    longer_geometry: float = 10.0
    """Factor by which the wavelength of a geometry may be longer than typical."""
    beyond_typical: float = 1.3
    """Factor by which a wavelength may lie outside the typical range."""
    slow_steps: float = 0.25
    """Quantile of the ways from one sample to the next that stands for slow motion."""
    most_bins: int = 1 << 18
    """Bins of a periodogram along a place at most."""
    line_spread: int = 8
    """Places of a padded periodogram on each side that belong to one line."""
    shortest_stretch: int = 64
    """Places of the shortest stretch over which the surroundings of a line are taken; they grow with the wave number."""
    stretches: int = 40
    """Such stretches."""
    waves_along_all: tuple[float, ...] = (1.0, 1.5, 2.0, 3.0)
    """Waves in the whole way that are tried besides: so few are no line of a periodogram, and its trend takes a part of them."""
    resonances: int = 10
    """Frequencies of a resonance that are tried within the usual range; as many an octave below it."""
    least_swings: float = 4.0
    """Swings of the slowest resonance that is looked for within a recording."""
    usual_quantiles: tuple[float, ...] = (0.3, 0.85)
    """Quantiles of the usual values of a resonance that are tried: a small one and a large one."""
    limits_reached: tuple[float, ...] = (0.995, 0.98, 0.95, 0.85)
    """Shares of the samples in which a command is below where a limit is looked for ..."""
    limits_of_largest: tuple[float, ...] = (0.9, 0.75, 0.6, 0.45)
    """... and shares of its largest value: a command in steps is at its largest for long."""
    least_driving: float = 0.01
    """Share of the largest voltage beside the back EMF from which on limits of it are tried ..."""
    limits_of_driving: int = 12
    """... and how many of them."""
    null_draws: int = 20
    """Draws of noise from which the null maximum is taken."""
    fastest_resonance: float = 0.2
    """Frequency up to which a resonance is looked for [cycles a sample]."""
    latest_reading: float = 0.1
    """Delay up to which a late reading is looked for [s]."""
