"""``lathesim bench --table1``: the means of Table 1 over small changes of the axes, beside those of an independent simulator.

The 8-bit converters make limit cycles, so that a single result scatters by a percent or two when a parameter moves by one; means over such
changes are what two simulators can be compared by. The reference is a simulator with the same defaults, written apart from this one.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lathesim.cli.speed.bench_rows import Tell
from lathesim.cli.writing import CommandResult

LESSON = "01_contour_error"
JITTERED = tuple(f"{axis}_{name}" for axis in "xz" for name in ("axis.gain", "axis.time_constant", "controller.proportional"))
"""K, tau and Kp of both axes."""
JITTER = 0.01
DRAWS = 60
CHANCE = 2004
METRICS = {"cycle_time": ("s", 1.0), "max_contour_error": ("mm", 1e3), "contour_error_squared_integral": ("mm^2*s", 1e6)}
"""Metric -> unit it is shown in, and what that is times the SI value."""
REFERENCE = {
    "I": (18.480, 0.684, 0.1113),
    "II": (18.480, 0.334, 0.0201),
    "III": (18.480, 0.510, 0.0773),
    "IV": (28.830, 0.430, 0.0791),
    "V": (18.480, 0.684, 0.0398),
    "VI": (18.480, 0.222, 0.0537),
}
"""Case -> cycle time [s], largest contour error [mm], integral of its square [mm^2 s]: means over 60 draws of that simulator."""
LIMITS = {"cycle_time": 0.0, "max_contour_error": 3.0, "contour_error_squared_integral": 6.0}
"""How far the means may be off [%]."""


@dataclass(frozen=True)
class Mean:
    """The mean of a metric of one case [display unit], the reference, and how far off it is [%]."""

    case: str
    metric: str
    unit: str
    mean: float
    reference: float

    @property
    def deviation(self) -> float:
        """How far the mean is from the reference [%]."""
        return 100.0 * (self.mean / self.reference - 1.0)

    @property
    def is_within(self) -> bool:
        """Whether it is within its limit."""
        return abs(self.deviation) <= LIMITS[self.metric] + 1e-6


def measured(quick: bool, save: Path | None, tell: Tell) -> tuple[CommandResult, list[str]]:
    """Return the means of Table 1 beside the reference, and which are too far from it."""
    draws = 10 if quick else DRAWS
    means = table1(draws, tell)
    rows = [{**dataclasses.asdict(mean), "deviation_percent": mean.deviation, "limit_percent": LIMITS[mean.metric]} for mean in means]
    off = [mean for mean in means if not mean.is_within]
    faults = [f"{mean.case}: {mean.metric} is {mean.deviation:+.2f} % off, more than {LIMITS[mean.metric]:g} %." for mean in off]
    return CommandResult("lathesim-table1/1", {"draws": draws, "rows": rows}, _lines(means, draws)), faults


def _lines(means: Sequence[Mean], draws: int) -> Iterator[str]:
    yield f"Means over {draws} draws of gain, time constant and proportional gain of both axes, each within 1 %.\n"
    yield "| case | metric | mean | reference | deviation |\n|---|---|---:|---:|---:|"
    for mean in means:
        shown = f"{mean.mean:.5g} {mean.unit} | {mean.reference:.5g} {mean.unit} | {mean.deviation:+.2f} %"
        yield f"| {mean.case} | {mean.metric} | {shown} |"


def table1(draws: int, tell: Tell) -> list[Mean]:
    """Return the means of all cases over ``draws`` draws, each of six factors between 0.99 and 1.01."""
    from lathesim.lessons.lesson import load_lesson
    from lathesim.lessons.simulate import prepare
    from lathesim.lessons.sweep_runs import Member, Members
    from lathesim.plugins import load_registry

    registry = load_registry(installed=False)
    lesson = load_lesson(LESSON)
    found = []
    for case, reference in REFERENCE.items():
        tell(f"running case {case} ...")
        prepared = prepare(lesson, registry, case)
        plan, chance = prepared.plan, np.random.default_rng(CHANCE)
        given = np.array([plan.values[name] for name in JITTERED])
        drawn = given * chance.uniform(1.0 - JITTER, 1.0 + JITTER, (draws, len(given)))
        members: list[Member] = []
        wanted = {name: registry.metric(name) for name in METRICS}
        Members(prepared, JITTERED, wanted).runs([(number, tuple(row)) for number, row in enumerate(drawn)], members.append)
        means = np.mean([member.metrics for member in members], axis=0) * [factor for _, factor in METRICS.values()]
        found += [
            Mean(case, name, unit, float(mean), expected)
            for (name, (unit, _)), mean, expected in zip(METRICS.items(), means, reference, strict=True)
        ]
    return found
