"""What a diagnosis is judged on where there is only one recording.

Its second half, as a rule: another stretch of time, with other noise and another state of the machine. Where something is switched on or
off in one half only (a tool enters a cut), the other would lack the only transient that there is. Then the whole is simulated and its
samples are dealt out in stretches, one to the fit and the next one to the judge: each a hundredth of the recording long, and shorter
around each switch, so that both see every part of the transient. Such a judge knows the noise and the form of a law; whether another
entry would look the same it cannot know, and slow noise is alike in neighbours. A recording that shows a motion is halved all the same: an
error of a position carries over from each stretch into the next, and the judge would be no other one. Source: Bergmeir, Benitez, On the
use of cross-validation for time series predictor evaluation, Information Sciences 191 (2012) (blocked splits).

One stroke alone, which speeds up in one half and slows down in the other, has no part that could judge: neither half tells a friction from
a mass, as the acceleration hardly changes in it. The whole is fitted then and judges itself, by the error of its simulation.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterable
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from lathesim.effects.effect import Effect
from lathesim.identification.replay.experiment import Experiment, RecordedMachine, build_experiments
from lathesim.identification.replay.measured_motion import recorded_motion
from lathesim.identification.signal import LARGER_PART
from lathesim.record import FloatArray, Record

_STRETCHES = 100
_SHORTEST = 8
"""How many times shorter the stretches beside a switch are."""
_GROWTH = 1.5
_FEWEST_SAMPLES = 4
_EDGE = 8
"""A stretch fades in and out over about one part in so many of the shortest one."""


def parted(
    machine: RecordedMachine, name: str, record: Record, effects: Iterable[type[Effect]]
) -> tuple[Experiment, Experiment, Experiment]:
    """Return the experiments of one recording: of what is fitted, of what judges (its name says how it was chosen), and of the whole."""
    compared = {name: record[name] for name in machine.compare}
    if halves_miss_a_switch(record, machine.drive) and not recorded_motion(machine.assembly, compared):
        whole = build_experiments(machine, [(name, record)], effects)[0]
        to_fit, to_judge = dealt_out(whole.record, machine.drive)
        judge = replace(whole, weights=to_judge, name=f"{name}, every other stretch of one run")
        return replace(whole, weights=to_fit), judge, whole
    if is_one_stroke(machine, record):
        whole = build_experiments(machine, [(name, record)], effects)[0].by_output_error()
        return whole, whole, whole
    first, second = halves(record)
    fitted, judge, whole = build_experiments(machine, [(name, first), (f"{name}, second half", second), (name, record)], effects)
    return fitted, judge, whole


def is_one_stroke(machine: RecordedMachine, record: Record) -> bool:
    """Return whether all that moves moves once, and slows down in the half in which it does not speed up."""
    motion = recorded_motion(machine.assembly, {name: record[name] for name in machine.compare if np.isfinite(record[name]).all()})
    flows = {f"{part.name}.{part.component.ports['flow']}" for part in machine.assembly.parts if "flow" in part.component.ports}
    speeds = [motion[name] for name in motion if name in flows and np.any(motion[name])]
    return bool(speeds) and all(_is_stroke(speed) for speed in speeds)


def _is_stroke(speed: FloatArray) -> bool:
    """Return whether a speed (samples,) is above half its largest once, between slower ends, and rises there for another share of the first
    half of the recording than of the second, larger by more than a half."""
    size = np.abs(speed)
    fast = size > LARGER_PART * size.max()
    if fast[0] or fast[-1] or np.count_nonzero(fast[1:] & ~fast[:-1]) != 1:
        return False
    rises = _smoothed(np.gradient(size), max(1, len(size) // _STRETCHES) | 1) > 0.0
    parts = [slice(0, len(size) // 2), slice(len(size) // 2, None)]
    if not all(fast[part].any() for part in parts):
        return True
    first, second = (float(np.mean(rises[part][fast[part]])) for part in parts)
    return first - second > LARGER_PART


def halves(record: Record) -> tuple[Record, Record]:
    """Return the first and the second half of a recording, each from time 0."""
    middle = len(record) // 2
    period = record.sample_period
    parts = []
    for piece in (slice(0, middle), slice(middle, None)):
        channels = {name: replace(channel, values=channel.values[piece]) for name, channel in record.channels.items()}
        count = len(next(iter(channels.values())).values)
        parts.append(Record(np.asarray(np.arange(count) * period, dtype=np.float64), channels, dict(record.meta)))
    return parts[0], parts[1]


def switches(record: Record, driven: Collection[str]) -> list[npt.NDArray[np.int64]]:
    """Return, for each driven channel that is only on or off, the samples at which it rises, and those at which it falls."""
    found = []
    for name in driven:
        levels = np.unique(record[name])
        if len(levels) == 2 and 0.0 in levels:
            steps = np.diff((record[name] > levels[0]).astype(np.int8))
            found += [np.flatnonzero(steps == direction) + 1 for direction in (1, -1)]
    return [places for places in found if len(places)]


def halves_miss_a_switch(record: Record, driven: Collection[str]) -> bool:
    """Return whether a rise or a fall of a driven channel lies in one half only."""
    middle = len(record) // 2
    return any(len({bool(place >= middle) for place in places.tolist()}) == 1 for places in switches(record, driven))


def dealt_out(record: Record, driven: Collection[str]) -> tuple[FloatArray, FloatArray]:
    """Return the weight (0 to 1) of each sample in the fit and in the judge; no sample counts in both."""
    samples = len(record)
    edges = _edges(samples, sorted({int(place) for places in switches(record, driven) for place in places}))
    turn = np.zeros(samples)
    for begin, end in zip(edges[::2], [*edges[1::2], samples], strict=False):
        turn[begin:end] = 1.0
    width = max(1, samples // (_STRETCHES * _SHORTEST * _EDGE)) | 1
    return tuple(np.clip(2.0 * _smoothed(side, width) - 1.0, 0.0, 1.0) if width > 1 else side for side in (turn, 1.0 - turn))  # type: ignore[return-value]


def _smoothed(values: FloatArray, width: int) -> FloatArray:
    return np.convolve(np.pad(values, width // 2, mode="edge"), np.ones(width) / width, mode="valid")


def _edges(samples: int, at: list[int]) -> list[int]:
    """Return where stretches begin: short ones next to each switch, longer ones away from it."""
    longest = max(_FEWEST_SAMPLES, samples // _STRETCHES)
    ends = [0, *at, samples]
    edges = []
    for begin, end in itertools.pairwise(ends):
        edges.append(begin)
        here = begin
        while True:
            away = min(here - begin if begin else samples, end - here if end < samples else samples)
            length = int(np.clip(away * (_GROWTH - 1.0), longest / _SHORTEST, longest))
            here += max(_FEWEST_SAMPLES, length)
            if here > end - _FEWEST_SAMPLES:
                break
            edges.append(here)
    return edges
