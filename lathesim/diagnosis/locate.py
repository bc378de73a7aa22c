"""Where a mismatch sits and what it depends on: the missing force or signal of each channel, held against what the machine was doing.

The residual of a replay is turned back into what is missing at the machine's input by dividing its spectrum by the machine's response to a
kick, in the band of the motion. Its mean over bins of a variable, learned on one recording, is scored on another: the share of the missing
signal explained there is the bar of that variable. A variable that explains nothing on the held-out recording did not cause it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, rfft

from lathesim.diagnosis.fit import Fitted
from lathesim.diagnosis.motion import recorded_motion, velocity_of
from lathesim.diagnosis.noise_model import taper
from lathesim.diagnosis.problem import Rig
from lathesim.diagnosis.simulator import KICK
from lathesim.engine.assembly import FloatArray
from lathesim.engine.wiring import Plan

_BINS = 14
_STANDSTILL = 0.02
"""Share of the fastest motion below which a part counts as standing still."""


@dataclass(frozen=True)
class Bar:
    """How much of a channel's missing signal a variable explains on the held-out recording (1 all, 0 nothing)."""

    channel: str
    variable: str
    share: float


@dataclass(frozen=True)
class Place:
    """A channel whose replay is off: root mean square over the floor, the parts it passes through, and when it is largest [s]."""

    channel: str
    over_floor: float
    parts: tuple[str, ...]
    windows: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Missing:
    """What is missing behind a channel: ``values`` (samples,) [unit] at ``at`` (``part.input``), or in the channel itself."""

    at: str
    unit: str
    values: FloatArray


def missing_signal(rig: Rig, fitted: Fitted, channel: int) -> Missing:
    """Give what is missing behind a channel, in the band of the motion.

    Behind a moving part that is the force (or torque) on it, positive against positive motion: the residual, differenced, over the
    response to a kick of the part's velocity, times its inertia. Elsewhere it is the residual itself.
    """
    name = rig.machine.compare[channel]
    residual = fitted.residual[channel]
    plan = rig.sensed.plan
    shapes = rig.sensed.noise_shapes(fitted.by_name)[channel]
    states, kicks, _ = rig.sensed.kicks(fitted.by_name)
    moved = [(row, part) for row, state in enumerate(states) if (part := _pushed(plan, state)) and np.any(kicks[row, channel])]
    if not moved or not shapes.differences:
        return Missing(name, plan.unit(rig.sensed.channels[channel]), residual)
    row, part = max(moved, key=lambda item: float(np.abs(kicks[item[0], channel]).max()))
    period = plan.assembly.sample_period
    response, error = kicks[row, channel], residual
    for _ in range(shapes.differences):
        response, error = np.diff(response, prepend=0.0), np.diff(error, prepend=error[:1])
    transformed, gain = rfft(error * taper(len(error))), rfft(response) * period / KICK
    rate = np.zeros_like(transformed)
    kept = slice(0, min(shapes.band, len(transformed)))
    rate[kept] = transformed[kept] / gain[kept]
    ports = plan.parts[part].component.ports
    inertia = fitted.by_name.get(f"{part}.{ports['inertia']}", _value(plan, f"{part}.{ports['inertia']}")) if "inertia" in ports else 1.0
    unit = plan.unit(f"{part}.{ports['effort']}") if "inertia" in ports else "m/s^2"
    return Missing(f"{part}.{ports['effort']}", unit, np.asarray(-inertia * irfft(rate, n=len(residual))))


def _pushed(plan: Plan, state: str) -> str:
    """Give the part whose velocity a state is, where a force can be missing; else an empty text."""
    name, _, item = state.partition(".")
    component = plan.parts[name].component
    ports = component.ports
    if "effort" not in ports or "flow" not in ports:
        return ""
    return name if component.declarations[ports["flow"]].unit == component.declarations[item].unit else ""


def _value(plan: Plan, name: str) -> float:
    return plan.parameter_values[plan.parameters[name]] if name in plan.parameters else 1.0


def variables(rig: Rig) -> dict[str, list[FloatArray]]:
    """Give what the machine was doing, by name: one or two arrays (samples,) whose bins are looked at together."""
    period = rig.machine.assembly.sample_period
    recorded = {name: rig.record[name] for name in rig.machine.compare}
    motion = recorded_motion(rig.with_candidates, recorded)
    found: dict[str, list[FloatArray]] = {"time": [np.asarray(np.arange(len(rig.record.time)) * period, dtype=np.float64)]}
    parts = {part.name: part for part in rig.machine.assembly.parts}
    for host, part in parts.items():
        ports = part.component.ports
        velocity = motion.get(f"{host}.{ports.get('flow', '')}")
        position = motion.get(f"{host}.{ports.get('displacement', '')}")
        if velocity is not None:
            direction = direction_of(velocity)
            found |= {
                f"velocity of {host}": [velocity],
                f"speed of {host}": [np.abs(velocity)],
                f"sign of velocity of {host}": [direction],
                f"acceleration of {host}": [velocity_of(velocity, period)],
            }
            if position is not None:
                found |= {
                    f"position of {host}": [position],
                    f"position and direction of {host}": [position, direction],
                    f"distance since reversal of {host}": [since_reversal(position, direction), direction],
                }
    for name in rig.machine.drive:
        found[name] = [rig.record[name]]
    return found


def direction_of(velocity: FloatArray) -> FloatArray:
    """Give -1, 0 or +1 for each sample."""
    still = np.abs(velocity) < _STANDSTILL * float(np.max(np.abs(velocity), initial=0.0))
    return np.where(still, 0.0, np.sign(velocity))


def since_reversal(position: FloatArray, direction: FloatArray) -> FloatArray:
    """Give the distance travelled since the direction last changed."""
    moving = direction != 0.0
    last = np.where(moving, direction, 0.0)
    held = _forward_filled(last)
    changed = np.concatenate([[True], held[1:] != held[:-1]])
    start = np.maximum.accumulate(np.where(changed, np.arange(len(position)), 0))
    return np.abs(position - position[start])


def _forward_filled(values: FloatArray) -> FloatArray:
    index = np.maximum.accumulate(np.where(values != 0.0, np.arange(len(values)), 0))
    return values[index]


def bars(rig: Rig, fitted: Fitted, held_out: Rig, judged: Fitted) -> list[Bar]:
    """Give the bars of every channel and variable, the tallest first."""
    here, there = variables(rig), variables(held_out)
    result = []
    for row, channel in enumerate(rig.machine.compare):
        learned, scored = missing_signal(rig, fitted, row).values, missing_signal(held_out, judged, row).values
        for name in here:
            if name in there:
                result.append(Bar(channel, name, explained(here[name], learned, there[name], scored)))
    return sorted(result, key=lambda bar: -bar.share)


def explained(where: list[FloatArray], learned: FloatArray, other: list[FloatArray], scored: FloatArray) -> float:
    """Give the share of ``scored`` explained by the mean of ``learned`` over bins of the variables."""
    edges = [_edges(values) for values in where]
    count = int(np.prod([len(edge) + 1 for edge in edges]))
    bins = _bin(where, edges)
    number = np.bincount(bins, minlength=count)
    mean = np.bincount(bins, weights=learned, minlength=count) / np.maximum(number, 1)
    predicted = mean[_bin(other, edges)]
    power = float(np.sum(scored * scored))
    return max(0.0, 1.0 - float(np.sum((scored - predicted) ** 2)) / power) if power > 0.0 else 0.0


def _edges(values: FloatArray) -> FloatArray:
    """Give the edges between bins of about as many samples each; a variable of few levels has a bin for each."""
    levels = np.unique(values)
    if len(levels) <= _BINS:
        return np.asarray(0.5 * (levels[1:] + levels[:-1]))
    return np.asarray(np.unique(np.quantile(values, np.linspace(0.0, 1.0, _BINS + 1)))[1:-1])


def _bin(values: list[FloatArray], edges: list[FloatArray]) -> np.ndarray:
    index = np.zeros(len(values[0]), dtype=np.int64)
    for array, edge in zip(values, edges, strict=True):
        index = index * (len(edge) + 1) + np.searchsorted(edge, array)
    return index


def places(rig: Rig, fitted: Fitted) -> list[Place]:
    """Give the channels by how far their replay is over the floor, the worst first."""
    result = []
    for row, channel in enumerate(rig.machine.compare):
        over = float(np.sqrt(np.mean(fitted.residual[row] ** 2)) / rig.sensed.seen_floors[row])
        parts = passed_through(rig.sensed.plan, rig.sensed.channels[row])
        result.append(Place(channel, over, parts, _windows(missing_signal(rig, fitted, row).values, rig.machine.assembly.sample_period)))
    return sorted(result, key=lambda place: -place.over_floor)


def passed_through(plan: Plan, channel: str) -> tuple[str, ...]:
    """Give the machine's own parts whose laws make a channel of the replay, nearest first: the suspects."""
    queue, seen = [channel.partition(".")[0]], []
    while queue:
        name = queue.pop(0)
        if name in seen or name.startswith(("recorded_", "motion_")):
            continue
        seen.append(name)
        feeds = plan.feeds.items()
        queue += [source.partition(".")[0] for target, (kind, source) in feeds if kind == "output" and target.startswith(f"{name}.")]
    return tuple(name for name in seen if not name.startswith("try_"))


def _windows(signal: FloatArray, period: float) -> tuple[tuple[float, float], ...]:
    """Give up to five stretches in which the missing signal is largest."""
    width = max(1, len(signal) // 200)
    power = np.convolve(signal * signal, np.ones(width) / width, mode="same")
    limit = float(np.quantile(power, 0.95))
    high = np.flatnonzero(np.diff(np.concatenate([[0], (power > limit).astype(int), [0]])))
    stretches = [(begin, end) for begin, end in zip(high[::2], high[1::2], strict=True)]
    stretches.sort(key=lambda pair: -float(np.sum(power[pair[0] : pair[1]])))
    return tuple(sorted((round(float(begin * period), 4), round(float(end * period), 4)) for begin, end in stretches[:5]))


