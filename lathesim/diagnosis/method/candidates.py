"""Limits of which candidates are tried and from where."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.diagnosis.method.limit import Limit


@dataclass(frozen=True)
class CandidateLimits:
    """Limits of which candidates are tried and from where."""

    whole_ratio: Limit = Limit(0.005, "1", "two periods whose ratio is this near a whole number are harmonics of one effect")
    goes_with_force: Limit = Limit(
        0.3, "1",
        "a ripple whose two sizes have at least this ratio, each over its usual value, goes with the driving force",
    )  # fmt: skip
    beside_line: Limit = Limit(0.1, "share of a period", "a line this near another one lies beside it and is no line of its own")
    side_line: Limit = Limit(
        0.05, "share of amplitude",
        "a line beside a stronger one counts as an effect above this share of its amplitude",
    )  # fmt: skip
    strongest_lines: int = 1
    """Strongest lines of a periodogram that become starting points."""
    prominent_lines: int = 2
    """Lines that stand out most that become starting points."""
    least_turns: Limit = Limit(2.0, "periods", "a periodic error of a geometry must repeat this often within the recording")
    least_turns_of_force: Limit = Limit(5.0, "periods", "a periodic force must repeat this often within the recording")
    longest_wave: Limit = Limit(3.0, "ways of the recording", "a wavelength above this is a constant or a slope")
    longest_wave_of_force: Limit = Limit(
        1.0, "ways of the recording",
        "a wavelength of a force above this is a constant or a slope: a motor ripples at least once on the way",
    )  # fmt: skip
    longer_geometry: Limit = Limit(
        10.0, "times the typical range",
        "the wavelength of a geometry may be longer than typical by this factor",
    )  # fmt: skip
    several_repeat: Limit = Limit(3.0, "periods", "each of several waves tried at once must repeat this often")
    slow_growth: Limit = Limit(0.25, "1", "stretches of the background median grow with the wave number by this share")
    beyond_typical: Limit = Limit(1.3, "times the typical range", "a wavelength may lie outside the typical range by this factor")
    most_lost: Limit = Limit(0.3, "share of speed", "the largest load may cost at most this share of the largest speed")
    limit_far_beyond: Limit = Limit(
        100.0, "times the typical range",
        "a neutral value this far beyond the typical range marks a limit, whose response does not scale",
    )  # fmt: skip
    fastest_resonance: Limit = Limit(0.2, "cycles a sample", "a resonance is looked for up to this frequency")
    latest_reading: Limit = Limit(0.1, "s", "a late reading is looked for up to this delay")
