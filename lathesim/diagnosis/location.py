"""Where a mismatch sits and what it depends on: the missing force or signal of each channel, held against what the machine was doing.

The residual of a replay is turned back into what is missing at the machine's input by dividing its spectrum by the machine's response to a
impulse, in the band of the motion. Its mean over bins of a variable, learned on one recording, is scored on another: the share of the
missing signal explained there is the bar of that variable. A variable that explains nothing on the validation recording did not cause it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.fft import irfft, rfft

from lathesim.component import Parameter
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.diagnosis import ChannelFit, MissingSignal
from lathesim.diagnosis.records.shown import Shown
from lathesim.engine.assembly import FloatArray, Place
from lathesim.engine.wiring import Plan
from lathesim.identification.noise import taper
from lathesim.identification.records import Candidate, Fitted, Model
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.replay.measured_motion import line_of, measured_output
from lathesim.identification.replay.simulator import IMPULSE
from lathesim.identification.roles import acting, is_of_machine, is_signal
from lathesim.identification.signal import LARGER_PART, SETTLING, SLOPE_ROUNDING, root_mean_square
from lathesim.record import stretches


@dataclass(frozen=True)
class OffChannel:
    """A channel whose replay is off: root mean square over the floor, and the parts it passes through."""

    channel: str
    over_floor: float
    parts: tuple[str, ...]


@dataclass(frozen=True)
class Missing:
    """What is missing behind a channel: ``values`` (samples,) [unit] at ``at`` (``part.input``), or in the channel itself."""

    at: str
    unit: str
    values: FloatArray
    mean_is_known: bool = True
    """Not where it was worked out from differences."""


@dataclass(frozen=True, eq=False)
class Pushed:
    """The part on which a missing force shows best in a channel: the force's place and unit, the ``response`` (samples,) of the channel to
    an impulse of a state of the part, the part's velocity for one unit of that state, and the force for one unit of acceleration."""

    effort: str
    unit: str
    response: FloatArray
    flow: float
    inertia: float


def pushed_part(experiment: Experiment, fitted: Fitted, row: int) -> Pushed | None:
    """Return the part on which a force shows best in a channel; none where no other force than that on a part seen better shows in it."""
    sensed, plan = experiment.sensed, experiment.sensed.plan
    states, responses, _ = sensed.impulse_responses(fitted.by_name)
    moved = [
        (place, state)
        for place, state in enumerate(states)
        if (part := pushed_by(plan, state))
        and np.any(responses[place, row])
        and _speaks_loudest(responses[place], row, sensed.seen_floors, _telling(experiment, part))
    ]
    if not moved or not sensed.noise_shapes(fitted.by_name)[row].differences:
        return None
    place, state = max(moved, key=lambda item: float(np.abs(responses[item[0], row]).max()))
    part = Place.of(state).part
    ports = plan.parts[part].component.ports
    # what the force moves, as a mass or an inertia; some parts have none
    inertia = value_of(plan, part, ports["inertia"], fitted.by_name) if "inertia" in ports else 0.0
    effort, flow = f"{part}.{ports['effort']}", f"{part}.{ports['flow']}"
    unit = plan.unit(effort) if inertia else f"{plan.unit(flow)}^2"
    return Pushed(effort, unit, responses[place, row], _flow_of(plan, state), inertia or 1.0)


def missing_signal(experiment: Experiment, fitted: Fitted, channel: int) -> Missing:
    """Return what is missing behind a channel, in the band of the motion.

    Behind a moving part that is the force (or torque) on it, positive against positive motion: the residual, differenced, over the
    response to an impulse of the part's velocity, times its inertia. Elsewhere it is the residual itself.
    """
    residual, sensed = fitted.residual[channel], experiment.sensed
    pushed = pushed_part(experiment, fitted, channel)
    if pushed is None:
        return Missing(experiment.machine.compare[channel], sensed.plan.unit(sensed.channels[channel]), residual)
    shapes = sensed.noise_shapes(fitted.by_name)[channel]
    response, error = pushed.response, residual
    for _ in range(shapes.differences):
        response, error = np.diff(response, prepend=0.0), np.diff(error, prepend=error[:1])
    transformed, gain = rfft(error * taper(len(error))), rfft(response) * sensed.period / IMPULSE
    rate = np.zeros_like(transformed)
    kept = slice(0, min(shapes.band, len(transformed)))
    answers = np.abs(gain[kept]) > SLOPE_ROUNDING * np.abs(gain).max(initial=0.0)
    # what a body has forgotten by the end of the recording leaves no mean in the differences of its speed: that would be noise over nothing
    answers[:1] &= np.abs(gain[:1]) > LARGER_PART * np.abs(gain[1:2])
    rate[kept] = np.divide(transformed[kept], gain[kept], out=np.zeros_like(gain[kept]), where=answers)
    acceleration = pushed.flow * irfft(rate, n=len(residual))
    return Missing(pushed.effort, pushed.unit, np.asarray(-pushed.inertia * acceleration), mean_is_known=False)


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
    ports = experiment.machine.assembly.ports(part)
    motion = {f"{part}.{ports[role]}" for role in ("displacement", "flow") if role in ports}
    return [name for name in experiment.machine.compare if measured_output(experiment.machine.assembly, name) in motion]


def pushed_by(plan: Plan, state: str) -> str:
    """Return the part whose velocity a state tells, where a force can be missing; else an empty text."""
    name = Place.of(state).part
    return name if {"effort", "flow"} <= set(plan.parts[name].component.ports) and _flow_of(plan, state) else ""


def _flow_of(plan: Plan, state: str) -> float:
    """Return the velocity of a part for one unit of a state: 1 where the state is that velocity, the way of a screw for a speed of its
    motor, 0 for a state that is none."""
    name, item = Place.of(state)
    part = plan.parts[name]
    flow, declared = part.component.ports["flow"], part.component.declarations
    line = line_of(part, flow, item)
    return line[1] if line is not None and not line[0] else float(line is None and declared[flow].unit == declared[item].unit)


def value_of(plan: Plan, name: str, item: str, values: Mapping[str, float]) -> float:
    """Return a value of a part, given or in ``values``, or one that follows from its values while it stands."""
    component, given = plan.parts[name].component, plan.values
    known = {one: values.get(f"{name}.{one}", given[f"{name}.{one}"]) for one in component.declared(Parameter)
             if f"{name}.{one}" in plan.parameters}  # fmt: skip
    if item in known:
        return known[item]
    return component.value_of(item, dict.fromkeys(component.taken_for(item), 0.0) | known)


def places(experiment: Experiment, fitted: Fitted) -> list[OffChannel]:
    """Return the channels by how far their replay is over the floor, the worst first."""
    result = []
    for row, channel in enumerate(experiment.machine.compare):
        over = float(np.sqrt(np.mean(fitted.residual[row] ** 2)) / experiment.sensed.replayed_floors[row])
        result.append(OffChannel(channel, over, passed_through(experiment.sensed.plan, experiment.sensed.channels[row])))
    return sorted(result, key=lambda place: -place.over_floor)


def passed_through(plan: Plan, channel: str) -> tuple[str, ...]:
    """Return the machine's own parts whose laws make a channel of the replay, nearest first: the suspects."""
    queue, seen = [Place.of(channel).part], []
    while queue:
        name = queue.pop(0)
        if name in seen or is_signal(name):
            continue
        seen.append(name)
        feeds = plan.feeds.items()
        queue += [Place.of(source).part for target, (kind, source) in feeds if kind == "output" and Place.of(target).part == name]
    return tuple(name for name in seen if is_of_machine(name))


def largest_windows(signal: FloatArray, period: float) -> tuple[tuple[float, float], ...]:
    """Return up to five stretches of time [s] in which a missing signal is largest."""
    width = max(1, len(signal) // 200)
    power = np.convolve(signal * signal, np.ones(width) / width, mode="same")
    limit = float(np.quantile(power, 0.95))
    high = sorted(zip(*stretches(power > limit), strict=True), key=lambda pair: -float(np.sum(power[pair[0] : pair[1]])))
    return tuple(sorted((round(float(begin * period), 4), round(float(end * period), 4)) for begin, end in high[:5]))


def missing_share(experiment: Experiment, fitted: Fitted, row: int) -> tuple[float, FloatArray]:
    """Return the missing signal's size as a share of what acts there, and what acts there (samples,)."""
    missing = missing_signal(experiment, fitted, row)
    sources = dict(acting(experiment.sensed.plan.assembly))
    part = Place.of(missing.at).part
    source = next((output for target, output in sources.items() if Place.of(target).part == part), "")
    if missing.at == experiment.machine.compare[row] or source not in experiment.sensed.plan.channels:
        total = np.nan_to_num(experiment.sensed.recorded[row])
        total = total - float(np.mean(total))
    else:
        names = list(fitted.by_name)
        position = experiment.sensed.plan.channels.index(source)
        total = experiment.sensed.channel(names, [fitted.by_name[name] for name in names], position)
    size = float(np.sqrt(np.mean(total**2)))
    left = float(np.sqrt(np.mean(missing.values**2)))
    # beside nothing that acts anything is without end, and nothing is no share
    return (left / size if size > 0.0 else math.inf if left > 0.0 else math.nan), total


def missing_signals(validation: Experiment, before: Model, after: Model) -> tuple[MissingSignal, ...]:
    """Return what is missing behind each channel on the validation recording, before and after."""
    result: list[MissingSignal] = []
    for row in range(len(validation.machine.compare)):
        first = missing_signal(validation, before.validation_fit, row)
        second = missing_signal(validation, after.validation_fit, row)
        share_before, total = missing_share(validation, before.validation_fit, row)
        share_after, _ = missing_share(validation, after.validation_fit, row)
        time = validation.record.time
        result.append(MissingSignal(first.at, first.unit, time, first.values, second.values, total, share_before, share_after))
    return tuple(result)


FORCES = ("N", "N*m")
"""Units in which what is missing at a part is a force."""


@dataclass(frozen=True)
class Compared:
    """The lesson's own simulation held against a recording: simulated channels (channels, samples) without and with what was found."""

    before: FloatArray
    after: FloatArray
    fit: dict[str, ChannelFit]


def compared(experiment: Experiment, before: Sequence[Mapping[str, float]], after: Mapping[str, float]) -> Compared:
    """Simulate the lesson with the values after and with those before, and compare both with the recording.

    Of several sets of values before the first counts, unless a later one leaves clearly less.
    """
    names = experiment.own.settable([name for values in (*before, after) for name in values])
    values = {name: experiment.own.given(name) for name in names}
    rows = np.array([[{**values, **chosen}[name] for name in names] for chosen in (*before, after)])
    *firsts, second = (experiment.sensed.from_zero_of(run) for run in experiment.own.outputs(names, rows))
    *alone, last = (_sizes(experiment, simulated) for simulated in (*firsts, second))
    first, sizes = firsts[0], alone[0]
    for run, left in zip(firsts[1:], alone[1:], strict=True):
        if np.prod(Shown.hardly_worse * left) < np.prod(sizes):
            first, sizes = run, left
    fits: dict[str, ChannelFit] = {}
    for row, name in enumerate(experiment.machine.compare):
        unit = experiment.own.plan.unit(experiment.own.channels[row])
        fits[name] = ChannelFit(unit, experiment.floors[name], float(sizes[row]), float(last[row]), experiment.name)
    return Compared(first, second, fits)


def _sizes(experiment: Experiment, simulated: FloatArray) -> FloatArray:
    """Return how far simulated channels (channels, samples) are off, once the recording has settled, one root mean square each."""
    begin = int(SETTLING * experiment.own.samples)
    off = experiment.own.recorded - simulated
    counted = off if experiment.weights is None else np.where(experiment.weights > LARGER_PART, off, np.nan)
    return np.array([root_mean_square(row[begin:]) for row in counted])


def direction_of(velocity: FloatArray, method: Method = STANDARD) -> FloatArray:
    """Return -1, 0 or +1 for each sample, 0 where a part stands still."""
    still = np.abs(velocity) < method.sizes.standstill * float(np.max(np.abs(velocity), initial=0.0))
    return np.where(still, 0.0, np.sign(velocity))


def _direction(experiment: Experiment, host: str, method: Method = STANDARD, *, smoothed: bool = True) -> FloatArray | None:
    """Return which way a part moves at each sample, 0 where it stands still: by its sensor, else as simulated."""
    ports = next(part.component.ports for part in experiment.machine.assembly.parts if part.name == host)
    flow = f"{host}.{ports.get('flow', '')}"
    motion = experiment.motion if smoothed else experiment.unsmoothed
    if flow in motion:
        return direction_of(motion[flow], method=method)
    return direction_of(experiment.doing[flow], method=method) if flow in experiment.doing else None


def resting(experiment: Experiment, candidates: Sequence[Candidate], method: Method = STANDARD) -> list[str]:
    """Return where parts with a dry friction among some candidates stand still, and for how much of the time."""
    hosts = dict.fromkeys(one.at for one in candidates if one.effect.site == "effort" and one.effect.identification.sticks)
    still = {host: float(np.mean(way == 0.0)) for host in hosts if (way := _direction(experiment, host, method=method)) is not None}
    return [
        f"{host} stands still in {100.0 * share:.0f} % of the samples, where dry friction may hold any force below its level."
        for host, share in still.items()
        if share > method.little
    ]


def one_way(experiment: Experiment, host: str, method: Method = STANDARD) -> bool:
    """Return whether a part is known to move in one direction only.

    A part that turns back does so in its filtered motion, which rings past a sudden stop, and from row to row, which shows noise.
    """
    ways = (_direction(experiment, host, method=method, smoothed=smoothed) for smoothed in (True, False))
    return any(way is not None and not (np.any(way > 0.0) and np.any(way < 0.0)) for way in ways)
