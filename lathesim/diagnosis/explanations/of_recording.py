"""The operating conditions of a recording, and what is asked of each of its channels."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.signal import savgol_filter

from lathesim.component import ON
from lathesim.diagnosis.explanations.conditions import Conditions, Motion
from lathesim.diagnosis.explanations.flexible import Flexible, flexible
from lathesim.diagnosis.explanations.lacking_force import Lacking, lacking, quiet_every
from lathesim.engine.assembly import FloatArray, Place
from lathesim.identification.records import Fitted, Free
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.replay.measured_motion import velocity_of
from lathesim.identification.roles import decides


def conditions_of(experiment: Experiment, *, simulated: bool = False) -> Conditions:
    """Return what the machine was doing, as its sensors or its references show it, and as the lesson simulates it where neither does, or in
    all.
    """
    period = experiment.machine.assembly.sample_period
    time = np.asarray(np.arange(len(experiment.record.time)) * period, dtype=np.float64)
    moved = experiment.doing if simulated else {**experiment.doing, **experiment.motion}
    motions, others = [], {}
    for part in experiment.machine.assembly.parts:
        ports = part.component.ports
        place, speed = (moved.get(f"{part.name}.{ports.get(role, '')}") for role in ("displacement", "flow"))
        if place is None and speed is not None:
            place = np.cumsum(speed) * period
        if place is not None and np.ptp(place) > 0.0:
            speed = velocity_of(place, period) if speed is None else speed
            unit = experiment.sensed.plan.unit(f"{part.name}.{ports.get('displacement', ports.get('reference'))}")
            motions.append(Motion(part.name, unit, place, *_steady(speed, period)))
        in_cut = experiment.doing.get(f"{part.name}.{ports.get('in_cut', '')}")
        if in_cut is not None and 0.0 < float(np.mean(in_cut > ON)) < 1.0:
            others[f"cut of {part.name}"] = (in_cut > ON).astype(np.float64)
    return Conditions(time, tuple(motions), others)


def _steady(speed: FloatArray, period: float, longest: float = 0.2, falls: float = 0.7) -> tuple[FloatArray, FloatArray]:
    """Return a velocity and its derivative, smoothed for as long as that takes noise off, which would explain itself.

    Smoothing twice as long, at most ``longest`` [s], takes a usual acceleration down to the share ``falls`` or less where it is noise.
    """
    before, width = math.inf, min(2 * round(1.0 / (period * min(100.0, 0.2 / period))) + 1, 2 * ((len(speed) - 1) // 2) + 1)
    while True:
        velocity, acceleration = (savgol_filter(speed, width, 2, deriv=order, delta=period) for order in (0, 1))
        spread = float(np.median(np.abs(acceleration)))
        if spread > falls * before or 2 * width * period > longest or 2 * width >= len(speed):
            return velocity, acceleration
        before, width = spread, 2 * width - 1


def of_channels(
    experiment: Experiment,
    fitted: Fitted,
    validation: Experiment,
    judged: Fitted,
    asked: Collection[str] | None = None,
    parts: tuple[slice, slice] = (slice(None), slice(None)),
) -> dict[str, tuple[Lacking, Flexible]]:
    """Return by channel what is lacking behind it (a force where it shows a motion), and the flexible explanation of that.

    Commands of controllers are left out: they follow a law exactly. What a wide range of the lesson's uncertain values would explain is no
    finding. Channels that no unknown force reaches are asked for each other too: what is left of both has one cause that nobody recorded.
    With ``asked`` only those channels are looked at, and with ``parts`` only some samples of the recording that is learned from and of the
    one that judges.
    """
    doubted = [one for one in fitted.free if one.name in experiment.machine.uncertain]
    here, there = (_with_doubts(one, fit, doubted) for one, fit in ((experiment, fitted), (validation, judged)))
    recorded, simulated = (tuple(conditions_of(one, simulated=way) for one in (experiment, validation)) for way in (False, True))
    found, rows = {}, _asked(experiment, asked)
    left = [{row: [lacking(one, fit, row) for fit in fits] for row in rows} for one, fits in ((experiment, here), (validation, there))]
    for row in rows:
        missing, other = left[0][row][0], left[1][row][0]
        step = 0.0 if missing.is_force else _step(experiment, row) / math.sqrt(12.0)
        # a recorded speed moves with the forces that nobody measured: what answers to these too would go with it
        moved = simulated if missing.answers_forces else recorded
        others = {name: one for one, name in rows.items() if one != row and missing.is_plain and left[0][one][0].is_plain}
        conditions, held_out = (_beside(*both, row, others) for both in zip(moved, left, strict=True))
        every = quiet_every(missing.values) if missing.is_force else 1
        learned, judging = parts
        judge = (held_out.at(judging), other.values[judging])
        found[rows[row]] = (missing, flexible(conditions.at(learned), missing.values[learned], judge, step, every))
    return found


def _asked(experiment: Experiment, asked: Collection[str] | None) -> dict[int, str]:
    """Return the rows of the compared channels that no controller gives, with their names; with ``asked`` only of those."""
    parts = experiment.machine.assembly.by_name
    compared = [(row, name) for row, name in enumerate(experiment.machine.compare) if asked is None or name in asked]
    return {row: name for row, name in compared if not decides(parts[Place.of(name).part].component)}


def _beside(moved: Conditions, left: Mapping[int, Sequence[Lacking]], row: int, others: Mapping[str, int]) -> Conditions:
    """Return the conditions of a channel with what doubts of values add, and with what is left at others, by their names."""
    missing, *doubts = left[row]
    beside = {f"what is left at {name}": left[one][0].values for name, one in others.items()}
    return replace(moved, absorbed=_absorbed(moved, missing, doubts), rings=missing.is_force, others={**moved.others, **beside})


def _with_doubts(experiment: Experiment, fitted: Fitted, doubted: Sequence[Free], wide: float = 10.0, share: float = 0.01) -> list[Fitted]:
    """Return a fit, and for each value that is ``doubted`` one whose residual is what ``wide`` standard deviations of it add, by a
    difference of a ``share`` of one: what is hidden may have bent a value so far."""
    names, rows = list(fitted.by_name), np.tile(list(fitted.by_name.values()), (len(doubted) + 1, 1))
    for row, one in enumerate(doubted, start=1):
        rows[row, names.index(one.name)] += share * one.scale
    first, *others = experiment.sensed.residuals(names, rows)
    return [fitted, *(replace(fitted, residual=wide * (other - first) / share) for other in others)]


def _absorbed(conditions: Conditions, missing: Lacking, doubts: Sequence[Lacking]) -> FloatArray | None:
    """Return what doubts of values add (values, samples), 0 where nobody knows what is missing. To a force they add what goes with the
    recorded velocity and acceleration: the simulated ones lack what is hidden too."""
    if not doubts:
        return None
    known = np.isfinite(missing.values)
    added = np.stack([np.where(known, one.values, 0.0) for one in doubts])
    part = Place.of(missing.at).part
    moving = [one for one in conditions.motions if one.name == part and missing.is_force]
    if moving:
        motion = np.stack([moving[0].velocity, moving[0].acceleration], axis=1)
        added = (motion @ np.linalg.lstsq(motion[known], added[:, known].T, rcond=None)[0]).T
    return np.asarray(added)


def _step(experiment: Experiment, row: int) -> float:
    """Return the step of a channel, with that of the first sensor of a motion where it shows the difference from that."""
    first = [one.first for one in experiment.sensed.redundant_sensors if one.row == row]
    steps = [experiment.machine.resolution.get(experiment.machine.compare[place], 0.0) for place in (row, *first)]
    return math.hypot(*steps)
