"""A machine made ready to be held against one recording, many times."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from lathesim.effects.effect import Effect
from lathesim.engine.assembly import FloatArray, Place
from lathesim.engine.batch import Batch
from lathesim.engine.lane_text import LANES
from lathesim.engine.wiring import Plan
from lathesim.identification.execution import Remembered
from lathesim.identification.noise import DIFFERENCED, RATE, WHITE, NoiseShapes, differences, noise_shapes, output_error, window_of
from lathesim.identification.replay.early_channels import Shift, ending_as_recorded, shifts_of, without_early
from lathesim.identification.replay.measured_motion import velocity_of
from lathesim.identification.roles import is_sensed_share
from lathesim.identification.signal import BEYOND, LARGER_PART, read_ahead

IMPULSE = 1e-3
"""Size of an impulse of a state, in the state's unit; the response is scaled by the noise that is fitted."""
_REMEMBERED = 8
"""Values whose impulses are kept: a fit, its judge and its error ask for the same ones, in two trials at a time."""
LOST = 1e12
"""Residual, in floors, of a run whose numbers grew beyond all bounds."""

_ImpulseResponses = tuple[list[str], FloatArray, FloatArray]


@dataclass(frozen=True)
class RedundantSensor:
    """A channel (``row``) that shows the same motion as another (``first``): its place, or its speed times ``gain``.

    What is unknown of the motion, the forces that nobody modelled, is the same in both; their difference shows the sensors and what
    lies between them. Source: DIN ISO 230-2 compares scale and motor encoder in this way.
    """

    row: int
    first: int
    gain: float = 1.0
    rate: bool = False

    def expected(self, first: FloatArray, period: float) -> FloatArray:
        """Return what the first sensor (..., samples) makes one expect of this one."""
        if not self.rate:
            return self.gain * first
        return np.asarray(self.gain * velocity_of(_within_bounds(first), period))


def _within_bounds(values: FloatArray) -> FloatArray:
    """Return what a run gave as far as it can be worked with: nothing where it gave no number, the bound beyond it."""
    if np.abs(values).max(initial=0.0) <= BEYOND:  # nearly always
        return values
    return np.clip(np.nan_to_num(values), -BEYOND, BEYOND)


@dataclass(frozen=True, eq=False)
class Simulator:
    """A plan, and what was recorded of its channels on its sample grid.

    ``recorded`` has shape (channels, samples) [SI]; NaN where nothing was recorded. ``floors`` is what the recording cannot resolve in
    each channel, one standard deviation [SI]. ``weights`` (samples,), 0 to 1, say which samples count; without them all do.
    With ``white`` every residual is taken for white noise, whatever the machine makes of forces that nobody modelled, and with
    ``output_error`` in the band of the motion alone.
    """

    plan: Plan
    channels: tuple[str, ...]
    recorded: FloatArray
    floors: FloatArray
    redundant_sensors: tuple[RedundantSensor, ...] = ()
    weights: FloatArray | None = None
    white: bool = False
    every: int = 1
    """Samples of the plan for each one of the recording."""
    differenced: frozenset[int] = frozenset()
    """Rows of the channels that an encoder makes of its counts as their rate."""
    led: frozenset[int] = frozenset()
    """Rows of the channels that show the position of a part that follows a given position exactly: nothing else determines their zero."""
    output_error: bool = False

    @cached_property
    def _with_impulse(self) -> Remembered[_ImpulseResponses]:
        return Remembered(_REMEMBERED)

    @cached_property
    def _shaped(self) -> Remembered[tuple[NoiseShapes, ...]]:
        return Remembered(_REMEMBERED)

    @cached_property
    def _counting(self) -> dict[tuple[int, ...], np.ndarray]:
        """By rows of channels the samples at which all of them count."""
        return {}

    @cached_property
    def seen(self) -> FloatArray:
        """What was recorded, as the residual takes it: a second sensor of one motion shows its difference from the first."""
        return self.as_seen(self.recorded)

    @cached_property
    def seen_floors(self) -> FloatArray:
        """The floors of :attr:`seen`, (channels,)."""
        floors = np.array(self.floors, dtype=float)
        for sight in self.redundant_sensors:
            if not sight.rate:
                floors[sight.row] = np.hypot(self.floors[sight.row], sight.gain * self.floors[sight.first])
        return floors

    @cached_property
    def seen_spread(self) -> FloatArray:
        """The standard deviation of :attr:`seen`, (channels,)."""
        return np.asarray(np.nanstd(self.seen, axis=1))

    @cached_property
    def replayed_floors(self) -> FloatArray:
        """Return what a replay cannot resolve, (channels,): of a speed held against a place, also what its counts make of the rate."""
        floors = self.seen_floors.copy()
        counts = np.random.Generator(np.random.Philox(0)).standard_normal(self.samples)
        for sight in self.redundant_sensors:
            if sight.rate:
                made = np.std(sight.expected(self.floors[sight.first] * counts, self.period))
                floors[sight.row] = np.hypot(floors[sight.row], made)
        return floors

    def as_seen(self, channels: FloatArray) -> FloatArray:
        """Return channels (..., channels, samples) with the difference in place of a second sensor of one motion, a place without the mean
        of it: each sensor has a zero of its own. So has the first one where what it measures is led along a recorded place."""
        if not (self.redundant_sensors or self.led):
            return channels
        found = np.array(channels)
        for row in self.led:
            with np.errstate(invalid="ignore", over="ignore"):
                found[..., row, :] -= self._mean((row,), found[..., row, :])
        for sight in self.redundant_sensors:
            # a lost run is infinite in both, and their difference no number: residual_of takes it for lost
            with np.errstate(invalid="ignore", over="ignore"):
                found[..., sight.row, :] -= sight.expected(channels[..., sight.first, :], self.period)
                if not sight.rate:
                    found[..., sight.row, :] -= self._mean((sight.row, sight.first), found[..., sight.row, :])
        return found

    def from_zero_of(self, simulated: FloatArray) -> FloatArray:
        """Return simulated channels (channels, samples) in which each sensor with a zero of its own has the zero of the recording."""
        found = np.array(simulated)
        for row in self.led:
            found[row] += self._mean((row,), self.recorded[row] - simulated[row])
        for sight in self.redundant_sensors:
            if not sight.rate:
                rows = sight.row, sight.first
                apart = [self._mean(rows, one[sight.row] - sight.gain * one[sight.first]) for one in (self.recorded, found)]
                found[sight.row] += apart[0] - apart[1]
        return found

    def zeros(self) -> dict[int, tuple[int, float]]:
        """Return for each second sensor of a place (its row) the first one (row) and by how much more it shows on the average."""
        places = [sight for sight in self.redundant_sensors if not sight.rate]
        apart = {sight.row: self.recorded[sight.row] - sight.gain * self.recorded[sight.first] for sight in places}
        return {sight.row: (sight.first, float(self._mean((sight.row, sight.first), apart[sight.row])[0])) for sight in places}

    def _mean(self, rows: Sequence[int], values: FloatArray) -> FloatArray:
        """Return the mean of values (..., samples), shape (..., 1), where the sensors (rows) were recorded and the sample counts."""
        key = tuple(rows)
        if key not in self._counting:
            counts = np.isfinite(self.recorded[list(rows)]).all(axis=0)
            if self.weights is not None:
                counts &= self.weights > LARGER_PART
            self._counting[key] = np.flatnonzero(counts)
        counted = self._counting[key]
        if not len(counted):
            return np.zeros((*values.shape[:-1], 1))
        counting = values if len(counted) == values.shape[-1] else np.take(values, counted, axis=-1)
        return np.asarray(np.mean(counting, axis=-1, keepdims=True))

    @property
    def samples(self) -> int:
        """Number of samples of the recording."""
        return int(self.recorded.shape[1])

    @property
    def period(self) -> float:
        """Time between two samples of the recording [s]."""
        return self.every * self.plan.assembly.sample_period

    @property
    def _simulated(self) -> int:
        return (self.samples - 1) * self.every + 1

    def noise_shapes(self, values: Mapping[str, float], *, coloured: bool = False) -> tuple[NoiseShapes, ...]:
        """Return the shapes of the noise in each channel, with the machine at ``values``.

        Without ``coloured`` sensors and forces are white: what a search weighs the residual with; with it forces may be slow: what values
        are fitted with once nothing is missing any more. As the weight follows the machine, a round of fitting solves the equations of the
        instrumental-variable estimate and is not drawn towards a machine that answers less.
        """
        return self._shaped.get((coloured, *sorted(values.items())), lambda: self._shapes(values, coloured=coloured))

    def _shapes(self, values: Mapping[str, float], *, coloured: bool) -> tuple[NoiseShapes, ...]:
        window = None if self.weights is None else window_of(self.weights)
        if self.white:
            flat = np.ones((1, self.samples // 2 + 1))
            return tuple(NoiseShapes(flat, floor, self.samples, window=window) for floor in self.seen_floors)
        if self.output_error:
            motions = zip(_within_bounds(self._as_given[2]), self.seen_floors, self._times, strict=True)
            return tuple(output_error(motion, floor, times, window) for motion, floor, times in motions)
        _, impulse_responses, motion = self.impulse_responses(values)
        period = self.period
        bounded, rates = _within_bounds(motion), {sight.row for sight in self.redundant_sensors if sight.rate}
        sensors = [RATE if row in rates else DIFFERENCED if row in self.differenced else WHITE for row in range(len(bounded))]
        shapes = [
            noise_shapes(impulse_responses[:, row], bounded[row], floor, period, self._times[row], coloured=coloured, sensor=sensors[row])
            for row, floor in enumerate(self.seen_floors)
        ]
        return tuple(replace(shape, window=window) for shape in shapes)

    def impulse_responses(self, values: Mapping[str, float]) -> _ImpulseResponses:
        """Return the machine's own states, the response to an impulse of each (states, channels, samples), and the channels themselves.

        Effects sense the recorded motion and plays are closed: what an impulse does to a table that a friction holds, or in a gap, says
        nothing of what a load does to one that moves.
        """
        free = {**{name: value for name, value in values.items() if not is_sensed_share(name)}, **self._closed}
        return self._with_impulse.get(tuple(sorted(free.items())), lambda: self._impulse_responses_of(self._simulated_motion, free))

    @cached_property
    def _closed(self) -> dict[str, float]:
        """The sizes with which plays before sensors are none."""
        placed = {name: part.component for name, part in self.plan.parts.items()}
        plays = [(name, it) for name, it in placed.items() if issubclass(it, Effect) and it.site == "measured" and it.identification.sticks]
        return {f"{name}.{size}": value for name, play in plays for size, value in play.neutral.items()}

    @cached_property
    def _as_given(self) -> _ImpulseResponses:
        """The responses and the motion of the machine as the lesson has it."""
        return self._impulse_responses_of(self._simulated_motion, {})

    @cached_property
    def _times(self) -> list[int]:
        """How often each channel is differenced."""
        _, impulse_responses, _ = self._as_given
        return [differences(impulse_responses[:, row], self.period) for row in range(len(self.seen_floors))]

    @cached_property
    def _simulated_motion(self) -> list[str]:
        """The machine's own states that move a channel while no effect is in: an angle that only a runout feels brings in no noise."""
        states = [name for name in self.plan.states if not issubclass(self.plan.parts[Place.of(name).part].component, Effect)]
        _, impulse_responses, _ = self._impulse_responses_of(states, {})
        return [state for state, impulse in zip(states, impulse_responses, strict=True) if np.any(impulse)]

    def _impulse_responses_of(self, states: list[str], values: Mapping[str, float]) -> _ImpulseResponses:
        names = list(dict.fromkeys([*values, *states]))
        base = np.array([values[name] if name in values else self.plan.values[name] for name in names])
        rows = np.tile(base, (len(states) + 1, 1))
        for row, state in enumerate(states, start=1):
            rows[row, names.index(state)] += IMPULSE
        runs = self.outputs(names, rows)
        with np.errstate(invalid="ignore", over="ignore"):
            impulse_responses = np.array([run - runs[0] for run in runs[1:]]).reshape(len(states), *runs[0].shape)
        impulse_responses[:, [sight.row for sight in self.redundant_sensors]] = 0.0
        return states, np.where(np.abs(impulse_responses) < BEYOND, impulse_responses, 0.0), runs[0]

    @property
    def starts(self) -> tuple[str, ...]:
        """The states of the machine."""
        return tuple(self.plan.states)

    def settable(self, names: Iterable[str]) -> list[str]:
        """Return those of some names that this machine has, each once."""
        return [name for name in dict.fromkeys(names) if name in self.plan.parameters or name in self.plan.states]

    def given(self, name: str) -> float:
        """Return the value that the machine has for a parameter or a starting state."""
        return self.plan.values[name]

    def outputs(self, names: Sequence[str], values: FloatArray) -> list[FloatArray]:
        """Return the simulated channels, shape (channels, samples), for each row of ``values`` of the names that are set.

        A second sensor of one motion shows its difference from the first, as in :attr:`seen`.
        """
        return self._each(names, values, lambda output: output)

    def channel(self, names: Sequence[str], values: Sequence[float], position: int) -> FloatArray:
        """Return one recorded output of the plan by its position, shape (samples,)."""
        pick: Callable[[FloatArray], FloatArray] = lambda record: record[position, :: self.every].copy()  # noqa: E731 - one expression, named for the reader
        found: FloatArray = Batch(self.plan, self._simulated, noisy=False).run(list(names), np.array([values], dtype=float), pick)[0]
        return found

    def residuals(self, names: Sequence[str], values: FloatArray) -> list[FloatArray]:
        """Return recorded minus simulated for each row of ``values``; zero where nothing was recorded."""
        return self._each(names, values, self.residual_of)

    def responses(
        self, names: Sequence[str], values: FloatArray, references: Sequence[FloatArray], reduce: Callable[[FloatArray], FloatArray]
    ) -> list[FloatArray | None]:
        """Return what ``reduce`` makes of a reference residual less that of each row of ``values``: made where the run is, on this core.

        The first of two ``references`` is of :meth:`with_long_steps`: one step a sample will do for a difference of two runs, except where
        a lag is so short that the run is lost with it; then it is made with the plan's steps and held against the second. Lost, it is None.
        """
        bound = 0.5 * LOST * self.seen_floors
        found: list[FloatArray | None] = [None] * len(values)
        for steps, reference in zip((1, 0), references, strict=True):
            expected = self.seen - reference

            def response(output: FloatArray, expected: FloatArray = expected) -> FloatArray | None:
                difference = output - expected
                if not self._is_whole:
                    difference[~np.isfinite(self.seen)] = 0.0
                away = np.maximum(difference.max(axis=1), -difference.min(axis=1))
                return reduce(difference) if bool(np.all(away < bound)) else None

            lost = [row for row, one in enumerate(found) if one is None]
            if lost:
                for row, one in zip(lost, self._each(names, values[lost], response, steps, threads=1), strict=True):
                    found[row] = one
        return found

    @cached_property
    def _is_whole(self) -> bool:
        return bool(np.isfinite(self.seen).all())

    def with_long_steps(self, values: Mapping[str, float]) -> FloatArray:
        """Return the residual for one set of values by name, simulated with one step a sample."""
        found: FloatArray = self._each(list(values), np.array([list(values.values())], dtype=float), self.residual_of, 1)[0]
        return found

    def _each(
        self, names: Sequence[str], values: FloatArray, reduce: Callable[[FloatArray], Any], steps: int = 0, threads: int = 0
    ) -> list[Any]:
        positions = [self.plan.channels.index(channel) for channel in self.channels]
        batch = Batch(self.plan, self._simulated, threads=threads, noisy=False, steps_per_sample=steps)
        names, values, early = without_early(self.plan, self._shifts, names, values, self.period, self.samples)
        if not np.any(early) and not any(sight.rate for sight in self.redundant_sensors):
            found: list[Any] = batch.run(names, values, lambda record: reduce(self.as_seen(record[positions, :: self.every])))
            return found
        runs = batch.run(names, values, lambda record: record[positions, :: self.every].copy())
        runs = [self._read_early(run, shifts) if np.any(shifts) else run for run, shifts in zip(runs, early, strict=True)]
        # the rates of some runs are filtered in one pass, which takes little longer than one of them
        return [reduce(run) for first in range(0, len(runs), LANES) for run in self.as_seen(np.array(runs[first : first + LANES]))]

    @cached_property
    def _shifts(self) -> dict[str, Shift]:
        return shifts_of(self.plan, self.channels)

    def _read_early(self, run: FloatArray, early: FloatArray) -> FloatArray:
        """Return the channels of a run (channels, samples) read ahead by what each shift was below zero (shifts,)."""
        seconds, number = {sight.row: sight for sight in self.redundant_sensors}, np.arange(run.shape[1])
        for (row, is_time, of_recorded), shift in zip(self._shifts.values(), early, strict=True):
            ahead = shift / self.period if is_time else shift * number
            if not np.any(ahead):
                continue
            if of_recorded and row in seconds:
                shown = seconds[row].expected(self.recorded[seconds[row].first], self.period)
                run[row] += read_ahead(shown, ahead) - shown
            else:
                run[row] = ending_as_recorded(read_ahead(run[row], ahead), self.recorded[row], ahead)
        return run

    def residual_of(self, output: FloatArray) -> FloatArray:
        """Return recorded minus ``output``; zero where nothing was recorded, very large where the run was lost."""
        bound = LOST * self.seen_floors[:, None]
        if self._is_whole:
            with np.errstate(over="ignore", invalid="ignore"):
                residual = self.seen - output
                if bool(np.all(np.abs(residual) <= bound)):  # nearly always
                    return residual
        residual = np.clip(np.nan_to_num(self.seen - output, nan=np.inf, posinf=np.inf, neginf=-np.inf), -bound, bound)
        return np.where(np.isfinite(self.seen), residual, 0.0)

    def one(self, values: Mapping[str, float]) -> FloatArray:
        """Return the residual for one set of values by name."""
        return self.residuals(list(values), np.array([list(values.values())], dtype=float))[0]
