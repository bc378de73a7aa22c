"""Where a mismatch sits and what it depends on: the missing force or signal of each channel, held against what the machine was doing.

The residual of a replay is turned back into what is missing at the machine's input by dividing its spectrum by the machine's response to a
impulse, in the band of the motion. Its mean over bins of a variable, learned on one recording, is scored on another: the share of the
missing signal explained there is the bar of that variable. A variable that explains nothing on the validation recording did not cause it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.fft import irfft, rfft

from lathesim.component import Parameter
from lathesim.engine.assembly import FloatArray
from lathesim.engine.wiring import Plan
from lathesim.identification.machine.roles import is_of_machine, is_signal
from lathesim.identification.noise.noise_model import taper
from lathesim.identification.records.fit import Fitted
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.replay.initial_state import line_of
from lathesim.identification.replay.measured_motion import measured_output
from lathesim.identification.replay.simulator import IMPULSE
from lathesim.identification.signal.rounding import SLOPE_ROUNDING


@dataclass(frozen=True)
class OffChannel:
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
    mean_is_known: bool = True
    """Not where it was worked out from differences."""


def missing_signal(experiment: Experiment, fitted: Fitted, channel: int) -> Missing:
    """Return what is missing behind a channel, in the band of the motion.

    Behind a moving part that is the force (or torque) on it, positive against positive motion: the residual, differenced, over the
    response to an impulse of the part's velocity, times its inertia. Elsewhere it is the residual itself.
    """
    name = experiment.machine.compare[channel]
    residual = fitted.residual[channel]
    plan = experiment.sensed.plan
    shapes = experiment.sensed.noise_shapes(fitted.by_name)[channel]
    states, impulse_responses, _ = experiment.sensed.impulse_responses(fitted.by_name)
    moved = [
        (row, state)
        for row, state in enumerate(states)
        if (part := _pushed(plan, state))
        and np.any(impulse_responses[row, channel])
        and _speaks_loudest(impulse_responses[row], channel, experiment.sensed.seen_floors, _telling(experiment, part))
    ]
    if not moved or not shapes.differences:
        return Missing(name, plan.unit(experiment.sensed.channels[channel]), residual)
    row, state = max(moved, key=lambda item: float(np.abs(impulse_responses[item[0], channel]).max()))
    period = experiment.sensed.period
    response, error = impulse_responses[row, channel], residual
    for _ in range(shapes.differences):
        response, error = np.diff(response, prepend=0.0), np.diff(error, prepend=error[:1])
    transformed, gain = rfft(error * taper(len(error))), rfft(response) * period / IMPULSE
    rate = np.zeros_like(transformed)
    kept = slice(0, min(shapes.band, len(transformed)))
    answers = np.abs(gain[kept]) > SLOPE_ROUNDING * np.abs(gain).max(initial=0.0)
    rate[kept] = np.divide(transformed[kept], gain[kept], out=np.zeros_like(gain[kept]), where=answers)
    part = state.partition(".")[0]
    inertia, ports = _inertia(plan, part, fitted.by_name), plan.parts[part].component.ports
    effort, flow = f"{part}.{ports['effort']}", f"{part}.{ports['flow']}"
    unit = plan.unit(effort) if inertia else f"{plan.unit(flow)}^2"
    acceleration = _flow_of(plan, state) * irfft(rate, n=len(residual))
    return Missing(effort, unit, np.asarray(-(inertia or 1.0) * acceleration), mean_is_known=False)


def _speaks_loudest(impulse_responses: FloatArray, channel: int, floors: FloatArray, telling: npt.NDArray[np.bool_]) -> bool:
    """Return whether no other channel that can tell of a force (``telling``) shows a state (channels, samples) better."""
    loudness = np.where(telling, np.abs(impulse_responses).max(axis=1) / floors, 0.0)
    return bool(telling[channel] and loudness[channel] >= loudness.max())


def _telling(experiment: Experiment, part: str) -> npt.NDArray[np.bool_]:
    """Return which channels can tell of a force on a part (channels,): those that show its place or speed, any where none does.

    A current answers to the voltage that the motion induces, loudly where a tachometer closes a loop. Beside an encoder, what is off there
    is the channel's own: a drive that gives another force than it says.
    """
    showing = _showing(experiment, part)
    return np.array([not showing or name in showing for name in experiment.machine.compare])


def _showing(experiment: Experiment, part: str) -> list[str]:
    """Return the compared channels that show the place or the speed of a part."""
    parts = {item.name: item for item in experiment.machine.assembly.parts}
    wires = {item.target: item for item in experiment.machine.assembly.wires}
    ports = parts[part].component.ports if part in parts else {}
    motion = {f"{part}.{ports[role]}" for role in ("displacement", "flow") if role in ports}
    return [name for name in experiment.machine.compare if measured_output(parts, wires, name) in motion]


def _pushed(plan: Plan, state: str) -> str:
    """Return the part whose velocity a state tells, where a force can be missing; else an empty text."""
    name = state.partition(".")[0]
    return name if {"effort", "flow"} <= set(plan.parts[name].component.ports) and _flow_of(plan, state) else ""


def _flow_of(plan: Plan, state: str) -> float:
    """Return the velocity of a part for one unit of a state: 1 where the state is that velocity, the way of a screw for a speed of its
    motor, 0 for a state that is none."""
    name, _, item = state.partition(".")
    part = plan.parts[name]
    flow, declared = part.component.ports["flow"], part.component.declarations
    line = line_of(part, flow, item)
    return line[1] if line is not None and not line[0] else float(line is None and declared[flow].unit == declared[item].unit)


def _inertia(plan: Plan, name: str, values: Mapping[str, float]) -> float:
    """Return what a force on a part moves, as a mass or an inertia at its place; 0 where the part has none."""
    item = plan.parts[name].component.ports.get("inertia", "")
    return value_of(plan, name, item, values) if item else 0.0


def value_of(plan: Plan, name: str, item: str, values: Mapping[str, float]) -> float:
    """Return a value of a part, given or in ``values``, or one that follows from its values while it stands."""
    component, given = plan.parts[name].component, plan.parameter_values
    known = {one: values.get(f"{name}.{one}", given[plan.parameters[f"{name}.{one}"]]) for one in component.declared(Parameter)
             if f"{name}.{one}" in plan.parameters}  # fmt: skip
    if item in known:
        return known[item]
    law = component.law_of(item)
    found = component.laws[law](*(known.get(one, 0.0) for one in component.arguments[law]))
    return float(found[component.output_laws()[law].index(item)] if isinstance(found, tuple) else found)


def places(experiment: Experiment, fitted: Fitted) -> list[OffChannel]:
    """Return the channels by how far their replay is over the floor, the worst first."""
    result = []
    for row, channel in enumerate(experiment.machine.compare):
        over = float(np.sqrt(np.mean(fitted.residual[row] ** 2)) / experiment.sensed.replayed_floors[row])
        parts = passed_through(experiment.sensed.plan, experiment.sensed.channels[row])
        result.append(
            OffChannel(
                channel, over, parts, _windows(missing_signal(experiment, fitted, row).values, experiment.machine.assembly.sample_period)
            )
        )
    return sorted(result, key=lambda place: -place.over_floor)


def passed_through(plan: Plan, channel: str) -> tuple[str, ...]:
    """Return the machine's own parts whose laws make a channel of the replay, nearest first: the suspects."""
    queue, seen = [channel.partition(".")[0]], []
    while queue:
        name = queue.pop(0)
        if name in seen or is_signal(name):
            continue
        seen.append(name)
        feeds = plan.feeds.items()
        queue += [source.partition(".")[0] for target, (kind, source) in feeds if kind == "output" and target.partition(".")[0] == name]
    return tuple(name for name in seen if is_of_machine(name))


def _windows(signal: FloatArray, period: float) -> tuple[tuple[float, float], ...]:
    """Return up to five stretches in which the missing signal is largest."""
    width = max(1, len(signal) // 200)
    power = np.convolve(signal * signal, np.ones(width) / width, mode="same")
    limit = float(np.quantile(power, 0.95))
    high = np.flatnonzero(np.diff(np.concatenate([[0], (power > limit).astype(int), [0]])))
    stretches = [(begin, end) for begin, end in zip(high[::2], high[1::2], strict=True)]
    stretches.sort(key=lambda pair: -float(np.sum(power[pair[0] : pair[1]])))
    return tuple(sorted((round(float(begin * period), 4), round(float(end * period), 4)) for begin, end in stretches[:5]))
