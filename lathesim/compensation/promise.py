"""What a remedy promises: sizes before and after over draws of what is uncertain, with intervals."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.analysis.turning_metrics import rms
from lathesim.compensation.diagnosed_machine import Bench
from lathesim.compensation.laps import CONTOUR
from lathesim.engine.assembly import FloatArray, Place
from lathesim.identification.position_loops import resolution_of
from lathesim.limit import Limit

_TURN = 2.0 * np.pi
_WHOLE = 0.999
"""Share of a turn that counts as one."""
_QUADRANT = np.radians(30.0)
"""Angle on either side of an axis within which its reversal shows (ISO 230-4)."""

FORM_ERROR = Limit(
    0.05, "share of an effect",
    "an effect of the catalogue may be of another form by this, one standard deviation",
    "calibrated",
    "concealed cases: effects in their own form left up to 0.10 of what was missing, others 0.114 and more; counts not recorded",
)  # fmt: skip

DRAWS = 40
"""Machines on which a remedy is tried. One more lies between the least and the largest of n results with probability (n - 1)/(n + 1):
with 40 it is 95 %, whatever their distribution (S. S. Wilks, Ann. Math. Statist. 12 (1941): distribution-free tolerance limits)."""
_AT_ONCE = 16
"""Machines whose runs are made in one batch and kept until they are judged: a multiple of what runs side by side."""
_FINER = 8
"""Integration steps of a promise for one of the lesson: a machine has none, and what friction holds in the simulation lasts two steps."""
RECORDED = "recorded_"
"""How the name of a size begins that a recording shows, its noise and what is not known of the sound machine in it."""


@dataclass(frozen=True)
class PromisedSize:
    """A size before and after [``unit``], with the interval that is promised for it after."""

    name: str
    unit: str
    before: float
    after: float
    low: float
    high: float

    @property
    def removed(self) -> float:
        """Share of the size that the remedy takes away."""
        return 1.0 - self.after / self.before if self.before > 0.0 else 0.0


def sizes(bench: Bench, record: FloatArray, sound: FloatArray) -> dict[str, tuple[float, str]]:
    """Return the sizes of a run: deviation of each table from the sound machine, distance from the path, voltage asked for."""
    found = _deviations(bench, record, sound)
    contour = bench.channel(record, str(CONTOUR))
    if contour is not None:
        found["rms_path_error"] = (rms(contour), "m")
        found["max_path_error"] = (float(np.max(np.abs(contour))), "m")
    found |= {name: (value, "m") for name, value in _circle(bench, record).items()}
    for loop in bench.loops:
        voltage = bench.channel(record, f"{loop.converter}.voltage") if loop.converter else None
        if voltage is not None:
            found[f"largest_voltage of {loop.converter}"] = (float(np.max(np.abs(voltage))), "V")
    return found


def _circle(bench: Bench, record: FloatArray) -> dict[str, float]:
    """Return the spread of the radial deviation over the last whole turn of a circle [m], in all and within 30 degrees of each quadrant."""
    centres = [bench.channel(record, f"interpolator.centre_{axis}") for axis in ("x", "z")]
    radius = bench.channel(record, "interpolator.circle_radius")
    if radius is None or len(bench.loops) != 2 or any(item is None for item in centres):
        return {}
    asked = [bench.channel(record, loop.reference) for loop in bench.loops]
    x, z = (place - centre for place, centre in zip(bench.table(record), centres, strict=True))
    turned = np.unwrap(np.arctan2(asked[1] - centres[1], asked[0] - centres[0]))  # type: ignore[operator]
    # what comes after the last turn, where the reference stands and the tool runs out, is dropped
    last = (np.abs(turned - turned[-1]) < _TURN) & (np.gradient(turned) != 0.0)
    if abs(turned[-1] - turned[0]) < _TURN * _WHOLE:
        return {}
    radial, angle = (np.hypot(x, z) - radius)[last], np.arctan2(z, x)[last]
    found = {"circular_spread": float(np.ptp(radial))}
    for quarter, name in enumerate(("+X", "+Z", "-X", "-Z")):
        off = np.abs(np.angle(np.exp(1j * (angle - 0.5 * np.pi * quarter))))
        found[f"circular_spread at {name}"] = float(np.ptp(radial[off < _QUADRANT]))
    return found


def noise_of(bench: Bench, floors: Mapping[str, float]) -> dict[str, float]:
    """Return the noise before each sensor of a loop [m], from what the diagnosis could not resolve:  sqrt(floor^2 - step^2/12)."""
    found = {}
    for loop in bench.loops:
        for channel, sensor in ((loop.reading, loop.sensor), (loop.table, Place.of(loop.beyond).part)):
            if sensor and channel in floors:
                step = resolution_of(bench.machinery, sensor)
                found[sensor] = float(np.sqrt(max(floors[channel] ** 2 - step * step / 12.0, 0.0)))
    return found


def promised(bench: Bench, members: Sequence[Mapping[str, float]], *, seed: int = 1) -> tuple[list[PromisedSize], float]:
    """Return the promised sizes, and the share of the draws in which the remedy makes the tables deviate less.

    Each draw is a machine with noise of its own, and its deviation is that from itself without effects. The interval reaches from the least
    to the largest result of all draws. Each result is scaled by the error that a diagnosis accepts in the form of an effect (model
    discrepancy: M. C. Kennedy, A. O'Hagan, J. R. Stat. Soc. B 63 (2001), 425-464). The result that a recording shows is promised too;
    its sound machine has the estimated values and sensors without noise.
    """
    nominal = bench.runs([bench.sound])[0]
    firsts, lasts = [], []
    for sound, before, after, target in _runs(bench, ({}, *members), seed):
        firsts.append(sizes(bench, before, sound) | _recorded(bench, before, nominal))
        lasts.append(sizes(bench, after, target) | _recorded(bench, after, nominal))
    found = []
    off = np.exp(float(FORM_ERROR) * np.random.default_rng([seed, 9]).standard_normal((len(lasts[0]), len(lasts))))
    for (name, (value, unit)), shares in zip(lasts[0].items(), off, strict=True):
        known = [share * item[name][0] for share, item in zip(shares, lasts, strict=True) if np.isfinite(item[name][0])]
        found.append(PromisedSize(name, unit, firsts[0][name][0], value, min(known, default=np.nan), max(known, default=np.nan)))
    better = [_worst(bench, last) < _worst(bench, first) for first, last in zip(firsts, lasts, strict=True)]
    return found, float(np.mean(better))


def _runs(bench: Bench, members: Sequence[Mapping[str, float]], seed: int) -> Iterator[tuple[FloatArray, ...]]:
    """Yield the records of each machine, all with the same noise: sound, with effects, with remedies too, and what that is held against."""
    acts: tuple[Mapping[str, float], ...] = (bench.sound, bench.bare, {})
    if bench.target != bench.sound:
        acts = (*acts, bench.target)
    for first in range(0, len(members), _AT_ONCE):
        group = list(enumerate(members[first : first + _AT_ONCE], seed + first))
        runs = [{**member, **act} for _, member in group for act in acts]
        records = bench.runs(runs, seeds=[own for own, _ in group for _ in acts], finer=_FINER)
        for place in range(0, len(records), len(acts)):
            own_records = records[place : place + len(acts)]
            yield *own_records[:3], own_records[3] if bench.target != bench.sound else own_records[0]


def _recorded(bench: Bench, record: FloatArray, sound: FloatArray) -> dict[str, tuple[float, str]]:
    """Return how far each table is seen to be from the sound machine of the estimates."""
    return {f"{RECORDED}{name}": size for name, size in _deviations(bench, record, sound).items()}


def _deviations(bench: Bench, record: FloatArray, sound: FloatArray) -> dict[str, tuple[float, str]]:
    found = {}
    for loop, row in zip(bench.loops, bench.table(record) - bench.table(sound), strict=True):
        found[f"rms_deviation of {loop.table}"] = (rms(row), "m")
        found[f"largest_deviation of {loop.table}"] = (float(np.max(np.abs(row))), "m")
    return found


def _worst(bench: Bench, found: Mapping[str, tuple[float, str]]) -> float:
    kept = [found[f"rms_deviation of {table}"][0] for table in dict.fromkeys(loop.table for loop in bench.loops)]
    total = float(np.sqrt(np.sum(np.square(kept))))
    return total if np.isfinite(total) else np.inf
