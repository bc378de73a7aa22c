"""What draws have to show, with the interval of each figure.

Source of the ranks: S. Talts, M. Betancourt, D. Simpson, A. Vehtari, A. Gelman, Validating Bayesian Inference Algorithms with
Simulation-Based Calibration (2018); of the sets: V. Vovk, A. Gammerman, G. Shafer, Algorithmic Learning in a Random World (2005).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chisquare

from tests.diagnosis.calibration.draws import Draw, intervals, is_right, tied_set
from tests.diagnosis.scoring import wilson

BINS = 10
CHANCE = 0.01
"""Probability of ranks as uneven as these below which they are not uniform."""


@dataclass(frozen=True)
class Result:
    """A gate: what is asked, what was measured over how many draws, and whether it is met."""

    gate: str
    asked: str
    measured: str
    count: int
    met: bool

    @property
    def row(self) -> str:
        """The line of the table."""
        return f"| {self.gate} | {self.asked} | {self.measured} | {self.count} | {'met' if self.met else 'MISSED'} |"


def gates(draws: Sequence[Draw]) -> list[Result]:
    """Return all gates; one without draws is not met."""
    made: tuple[Callable[[Sequence[Draw]], Result], ...] = (coverage, ranks, tied_sets, size_of_sets, false_alarms)
    return [gate(draws) for gate in made]


def coverage(draws: Sequence[Draw]) -> Result:
    """Return how often intervals hold the truth."""
    held = [one.holds for draw in draws for one in intervals(draw)]
    share = float(np.mean(held)) if held else 0.0
    return Result("intervals hold the truth", "93 to 97 %", _share(sum(held), len(held)), len(held), 0.93 <= share <= 0.97)


def ranks(draws: Sequence[Draw]) -> Result:
    """Return whether the ranks of the truth are uniform: too many at both ends say that intervals are too narrow."""
    found = [one.rank for draw in draws for one in intervals(draw)]
    counts = np.histogram(found, bins=BINS, range=(0.0, 1.0))[0]
    probability = float(chisquare(counts).pvalue) if found else 0.0
    measured = f"p = {probability:.3f}; tenths {' '.join(str(count) for count in counts)}"
    return Result("ranks of the truth are uniform", f"p of at least {CHANCE}", measured, len(found), probability >= CHANCE)


def tied_sets(draws: Sequence[Draw]) -> Result:
    """Return how often the names that an answer leaves open hold the hidden effect, where one is hidden."""
    held = [bool(set(tied_set(draw)) & set(draw.hidden[0])) for draw in draws if len(draw.hidden) == 1]
    share = float(np.mean(held)) if held else 0.0
    return Result("the tied set holds the effect", "at least 95 %", _share(sum(held), len(held)), len(held), share >= 0.95)


def size_of_sets(draws: Sequence[Draw]) -> Result:
    """Return how many names a tied set has in the mean, where it has any."""
    sizes = [len(tied_set(draw)) for draw in draws if len(draw.hidden) == 1 and tied_set(draw)]
    mean = float(np.mean(sizes)) if sizes else float("inf")
    return Result("names in a tied set", "at most 1.5 in the mean", f"{mean:.2f}", len(sizes), mean <= 1.5)


def false_alarms(draws: Sequence[Draw]) -> Result:
    """Return how many sound machines are called sound, over all sources."""
    sound = [is_right(draw) for draw in draws if not draw.hidden and draw.kind != "values"]
    share = float(np.mean(sound)) if sound else 0.0
    return Result("sound machines called sound", "at least 99 %", _share(sum(sound), len(sound)), len(sound), share >= 0.99)


def _share(count: int, of: int) -> str:
    low, high = wilson(count, of)
    return f"{100.0 * count / of:.1f} % ({100 * low:.0f} to {100 * high:.0f} %)" if of else "-"


def table(draws: Sequence[Draw]) -> str:
    """Return the gates as Markdown, over all draws and for each source with its misses."""
    lines = ["| gate | asked | measured (95 % interval) | of | |", "|---|---|---|---|---|", *[one.row for one in gates(draws)]]
    for source in sorted({draw.source for draw in draws}):
        own = [draw for draw in draws if draw.source == source]
        seconds = np.array([draw.seconds for draw in own])
        lines += [
            "",
            f"{source}: {len(own)} draws, {np.median(seconds):.1f} s of processor time at the median, {seconds.max():.0f} s at most",
        ]
        lines += [f"  {one.gate}: {one.measured} of {one.count}" for one in gates(own) if one.count]
        lines += [f"  missed: {_line(draw)}" for draw in own if not is_right(draw)]
    return "\n".join(lines)


def _line(draw: Draw) -> str:
    given = " + ".join(" ~ ".join([one["effect"], *one["tied_with"]]) for one in draw.told["effects"])
    hidden = " + ".join(" or ".join(names) for names in draw.hidden) or draw.kind
    return f"{draw.name}, {hidden}: {draw.told['verdict'] or 'no answer'} {given}"
