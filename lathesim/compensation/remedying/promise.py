"""What a remedy promises: sizes before and after over draws of what is uncertain, with intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.compensation.remedying.bench import Bench
from lathesim.component import Parameter
from lathesim.engine.assembly import FloatArray
from lathesim.identification.machine.position_loops import level_of, resolution_of

DRAWS = 40
_TO_ONE = 3.919928
"""Width of a 95 % interval over its standard deviation."""
_INSIDE = (2.5, 97.5)
_ALLOWED = 0.1
"""Share by which an interval is widened on either side: another integrator, noise of other samples, few draws (assumed)."""


@dataclass(frozen=True)
class Size:
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


def draws_of(bench: Bench, intervals: Mapping[str, tuple[float, float, float]], count: int, seed: int) -> list[dict[str, float]]:
    """Return values drawn around their estimates, normal with their 95 % intervals, within what may be set."""
    rng = np.random.default_rng([seed, 5])
    declared = {part.name: part.component.declared(Parameter) for part in bench.machinery.parts}
    members = []
    for _ in range(count):
        member = {}
        for name, (value, low, high) in intervals.items():
            part, _, item = name.partition(".")
            bounds = declared.get(part, {}).get(item)
            drawn = value + rng.standard_normal() * (high - low) / _TO_ONE
            member[name] = float(np.clip(drawn, bounds.low, bounds.high)) if bounds is not None else float(drawn)
        members.append(member)
    return members


def sizes(bench: Bench, record: FloatArray, sound: FloatArray) -> dict[str, tuple[float, str]]:
    """Return the sizes of a run: deviation of each table from the sound machine, distance from the path, voltage asked for."""
    found: dict[str, tuple[float, str]] = {}
    off = bench.table(record) - bench.table(sound)
    for loop, row in zip(bench.loops, off, strict=True):
        found[f"rms_deviation of {loop.table}"] = (_rms(row), "m")
        found[f"largest_deviation of {loop.table}"] = (float(np.max(np.abs(row))), "m")
    contour = bench.contour(record)
    if contour is not None:
        found["rms_path_error"] = (_rms(contour), "m")
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
    last = (np.abs(turned - turned[-1]) < 2.0 * np.pi) & (np.gradient(turned) != 0.0)
    if abs(turned[-1] - turned[0]) < 2.0 * np.pi * 0.999:
        return {}
    radial, angle = (np.hypot(x, z) - radius)[last], np.arctan2(z, x)[last]
    found = {"circular_spread": float(np.ptp(radial))}
    for quarter, name in enumerate(("+X", "+Z", "-X", "-Z")):
        off = np.abs(np.angle(np.exp(1j * (angle - 0.5 * np.pi * quarter))))
        found[f"circular_spread at {name}"] = float(np.ptp(radial[off < np.radians(30.0)]))
    return found


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values * values)))


def promised(bench: Bench, members: Sequence[Mapping[str, float]], *, noise: float = 1.0) -> tuple[list[Size], float]:
    """Return the promised sizes, and the share of the draws in which the remedy makes the tables deviate less.

    The sound machine is that of the estimates for all draws, so that a recording can be held against the promise.
    """
    sound = bench.runs([bench.sound])[0]
    before = [sizes(bench, record, sound) for record in bench.runs([bench.bare, *[{**member, **bench.bare} for member in members]])]
    after = [sizes(bench, record, sound) for record in bench.runs([{}, *members])]
    found = []
    for name, (value, unit) in after[0].items():
        floor = _floor(bench, name, noise)
        drawn = np.array([item[name][0] for item in after])
        drawn = drawn[np.isfinite(drawn)]
        low, high = (float(np.percentile(drawn, edge)) for edge in _INSIDE) if len(drawn) else (np.nan, np.nan)
        # a machine whose sound state is that of the estimates is off by the value itself
        low = min(low, value) * (1.0 - _ALLOWED)
        high = float(np.hypot(high * (1.0 + _ALLOWED), floor))
        found.append(Size(name, unit, before[0][name][0], value, low, high))
    better = [_worst(last) < _worst(first) for first, last in zip(before, after, strict=True)]
    return found, float(np.mean(better))


def _worst(found: Mapping[str, tuple[float, str]]) -> float:
    kept = [value for name, (value, _) in found.items() if name.startswith("rms_deviation")]
    total = float(np.sqrt(np.sum(np.square(kept))))
    return total if np.isfinite(total) else np.inf


def _floor(bench: Bench, name: str, noise: float) -> float:
    """Return what rounding and the noise of a step of the sensors may add to a size."""
    if name.startswith("largest_voltage"):
        return max((level_of(bench.machinery, loop.converter) for loop in bench.loops if loop.converter), default=0.0)
    counts = []
    for loop in bench.loops:
        counts += [resolution_of(bench.machinery, loop.sensor), resolution_of(bench.machinery, loop.beyond.partition(".")[0])]
    step = max(counts, default=0.0)
    times = 1.5 if name.startswith("rms") else 6.0
    return times * step * float(np.hypot(noise, np.sqrt(1.0 / 12.0)))
