"""Residuals while the machine runs: what was measured less what the lesson's simulation does under the same reference.

Beside the nominal simulation two run for each uncertain value, a standard deviation above and below: half their difference is what that
value would do to the residual. It does not share the quantisation noise of the nominal run, which would otherwise pass for a change of the
value. A value that is off by what the lesson allows is no change of the machine. The sizes of known effects are followed in the same way,
each on a scale of its own, without bounds but those of the parameter, and, but for frictions, by machines whose sensors resolve everything.

The directions in which a residual may change: what it is multiplied with when a machine changes.

A friction changes a residual with the sign of motion, a delay with the speed, a gain in proportion to the channel itself, an offset at all
times. A block in which a direction is hardly seen tells little about it: accelerating blocks tell gains, cruising ones do not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lathesim.component import Parameter
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import Place
from lathesim.identification.replay.converter_rounding import resolving_everything
from lathesim.identification.replay.loading import uncertainties
from lathesim.identification.replay.open_loop import seen
from lathesim.lessons.simulate import Prepared
from lathesim.live.samples import LiveError
from lathesim.live.stepped_machine import SteppedMachine
from lathesim.live.watching.thresholds import ERRORS
from lathesim.record import FloatArray
from lathesim.units import in_unit

_HALF = 0.5
"""Share of a value by which it is changed at most."""
_UNEVEN = 1e-3
"""Share by which a sample period may differ from a whole number of the machine's: clocks are better by far."""
LARGEST_RATIO = 1000
"""Periods of the machine between two samples of a recording at most."""
FREE = 1e-6
"""Precision of the prior of a followed size [1/scale^2]: so little that the size is free."""


@dataclass(frozen=True, eq=False)
class Residual:
    """Residuals of a stretch: ``values`` (channels, samples), ``sensitivities`` (parameters, channels, samples) per standard deviation,
    the ``speed`` (drives, samples) of each driven input per sample, what was ``simulated`` (channels, samples), and the residuals of the
    ``others`` (2 uncertain values, channels, samples): machines with one value a standard deviation above and below."""

    values: FloatArray
    sensitivities: FloatArray
    speed: FloatArray
    simulated: FloatArray
    others: FloatArray


class ResidualStream:
    """Simulates a lesson beside its recording. ``drive`` and ``compare`` are the channels that a block must hold, in that order.

    ``followed`` maps sizes of known effects (``part.parameter``) to a scale [SI]: they are free values beside the uncertain ones.
    ``plain`` simulates the machine without sensitivities.
    """

    def __init__(
        self, prepared: Prepared, drive: Sequence[str], compare: Sequence[str], period: float, *,
        followed: Mapping[str, float] | None = None, plain: bool = False,
    ) -> None:  # fmt: skip
        self._prepared, self._plain = prepared, plain
        self.drive, self.compare, self.period = tuple(drive), tuple(compare), period
        allowed = {
            name: deviation
            for name, deviation in uncertainties(prepared.case.lesson, prepared.plan).items()
            if name in prepared.plan.parameters and deviation > 0.0
        }
        self.scales: Mapping[str, float] = {**(followed or {}), **allowed}
        self.free: NDArray[np.bool_] = np.array([name not in allowed for name in self.scales], dtype=np.bool_)
        own = prepared.plan.assembly.sample_period
        self.ratio = round(period / own)
        if self.ratio < 1 or self.ratio > LARGEST_RATIO or abs(period / own - self.ratio) > _UNEVEN * self.ratio:
            fact = f"the samples come every {in_unit(period, 'ms', 'g')}, and the machine is simulated every {in_unit(own, 'ms', 'g')}."
            raise LiveError(fact, remedy="Record at the machine's rate, or at a whole fraction of it.")
        self._exact = _without_steps(prepared)
        self._shares: FloatArray = np.zeros(0)
        self._machines: list[SteppedMachine] = []
        self._outputs = [seen(prepared.machinery, channel) for channel in self.compare]
        self._last: FloatArray | None = None
        self.nominal: FloatArray = np.zeros(len(self.scales))
        self.restart()

    @property
    def parameters(self) -> tuple[str, ...]:
        """Return the names of the values that may move: followed sizes, then uncertain values."""
        return tuple(self.scales)

    def given(self) -> FloatArray:
        """Return the lesson's own values [SI], (parameters,)."""
        plan = self._prepared.plan
        return np.array([plan.values[name] for name in self.scales])

    def restart(self) -> None:
        """Begin the simulation anew: the samples before are not those before the next."""
        axes = {name: (name,) for name in self.drive}
        outputs = list(dict.fromkeys(self._outputs))
        self._machines = [SteppedMachine(self._prepared, axes, overrides=values, record=outputs) for values in self._values()]
        self._last = None

    def move(self, nominal: FloatArray) -> FloatArray:
        """Go on with the values at ``nominal`` (parameters,) scales from the lesson's; return how far they moved.

        Sensitivities are differences, so they hold near the nominal values only. No uncertain value goes further than what the lesson calls
        uncertain, nor by more than half of itself: a machine far from the lesson's might not be stable. A followed size keeps half a
        scale's distance from the bounds of its parameter.
        """
        low, high = self._bounds()
        before, self.nominal = self.nominal, np.clip(np.asarray(nominal, dtype=np.float64), low, high)
        for machine, values in zip(self._machines, self._values(), strict=True):
            machine.change(values)
        return np.asarray(self.nominal - before)

    def follow(self, other: ResidualStream) -> None:
        """Go on with the uncertain values of another simulation; followed sizes stay where the lesson has them."""
        values = dict(zip(other.scales, (other.given() + other.nominal * np.array(list(other.scales.values()))).tolist(), strict=True))
        given = dict(zip(self.scales, self.given().tolist(), strict=True))
        self.move(np.array([
            0.0 if free or name not in values else (values[name] - given[name]) / self.scales[name]
            for name, free in zip(self.scales, self.free, strict=True)
        ]))  # fmt: skip

    def _bounds(self) -> tuple[FloatArray, FloatArray]:
        """Return how far each value may go down and up [scales from the lesson's]."""
        given, scales = self.given(), np.array(list(self.scales.values()))
        if not len(scales):
            return given, given
        most = np.minimum(ERRORS.furthest, np.where(given != 0.0, _HALF * np.abs(given) / scales, ERRORS.furthest))
        declared = [self._declared(name) for name in self.scales]
        low = np.array([item.low for item in declared])
        high = np.array([item.high for item in declared])
        down, up = np.minimum(0.0, (low - given) / scales + _HALF), np.maximum(0.0, (high - given) / scales - _HALF)
        return np.where(self.free, down, -most), np.where(self.free, up, most)

    def _declared(self, name: str) -> Parameter:
        declared = self._prepared.plan.declaration(name)
        assert isinstance(declared, Parameter)
        return declared

    def _sticks(self, name: str) -> bool:
        """Return whether a followed size is that of a friction: it holds a machine still whose sensors have no steps to swing between."""
        component = self._prepared.plan.parts[Place.of(name).part].component
        return issubclass(component, Effect) and component.site == "effort" and bool(component.identification.sticks)

    def _values(self) -> list[dict[str, float]]:
        """Return the values [SI] of the nominal machine, and of two for each value: above and below."""
        given = dict(zip(self.scales, self.given().tolist(), strict=True))
        nominal = {name: given[name] + at * self.scales[name] for name, at in zip(given, self.nominal, strict=True)}
        found = [nominal]
        if self._plain:
            return found
        for name, free in zip(self.scales, self.free, strict=True):
            others = {**nominal, **self._exact} if free and not self._sticks(name) else nominal
            found += [{**others, name: nominal[name] + sign * self._step(name, nominal[name])} for sign in (1.0, -1.0)]
        self._shares = np.array([2.0 * self._step(name, nominal[name]) / self.scales[name] for name in self.scales])
        return found

    def _step(self, name: str, value: float) -> float:
        """Return by how much a value is changed for its sensitivity [SI].

        That of a followed size grows with how far it has moved: of a step of one count of an encoder half is chance.
        """
        scale, at = self.scales[name], list(self.scales).index(name)
        if not self.free[at]:
            return min(scale, _HALF * abs(value)) if value else scale
        declared = self._declared(name)
        return min(_HALF * scale * max(1.0, abs(float(self.nominal[at]))), value - declared.low, declared.high - value)

    def take(self, values: FloatArray) -> Residual:
        """Return the residual of the next samples; ``values`` (drive and compare, samples)."""
        driven = values[: len(self.drive)].T
        before = driven[:1] if self._last is None else self._last
        speed = np.diff(np.vstack([before, driven]), axis=0).T
        fine = driven
        if self.ratio > 1:
            share = np.arange(1, self.ratio + 1)[None, :, None] / self.ratio
            starts = np.vstack([before, driven[:-1]])
            fine = (starts[:, None, :] + share * (driven - starts)[:, None, :]).reshape(-1, driven.shape[1])
        self._last = driven[-1:].copy()
        runs = [self._channels(machine, machine.advance(fine)[:, self.ratio - 1 :: self.ratio]) for machine in self._machines]
        residual = values[len(self.drive) :] - runs[0]
        count = len(self._shares)
        if self._plain:
            return Residual(residual, np.zeros((len(self.scales), *residual.shape)), speed, runs[0], np.zeros((0, *residual.shape)))
        pairs = np.array(runs[1:]).reshape(count, 2, *residual.shape)
        sensitivities = (pairs[:, 0] - pairs[:, 1]) / self._shares.reshape(count, 1, 1)
        others = values[len(self.drive) :] - pairs[~self.free].reshape(-1, *residual.shape)
        return Residual(residual, sensitivities, speed, runs[0], others)

    def _channels(self, machine: SteppedMachine, values: FloatArray) -> FloatArray:
        return values[[machine.plan.channels.index(output) for output in self._outputs]]


def _without_steps(prepared: Prepared) -> dict[str, float]:
    """Return the values of the machine's parameters with which its sensors and converters resolve everything.

    Steps of a sensor hide half of what a small size does, and the noise of a real sensor brings it back.
    """
    plan = prepared.plan
    exact = {f"{name}.{item}": value for name, part in plan.parts.items() for item, value in resolving_everything(part.component).items()}
    return {name: value for name, value in exact.items() if name in plan.parameters}


_RIDGE = 1e-9
"""Share of its own sum by which a regressor is held, so that one that is not seen in a block does no harm."""


LIKE = 0.01
"""Seconds whose samples are averaged: the noise of quantised sensors is quick, and what a changed machine does is slow."""


@dataclass(frozen=True, eq=False)
class BlockSums:
    """Sums over a block that ends at ``time`` [s], for q regressors (directions, then sensitivities) and whitened residuals r.

    ``normal`` (channels, q, q) and ``mixed`` (channels, q) are those of least squares; ``left`` (2 channels,) is the mean square of the
    averaged r that no combination of the regressors explains within the block, and of what averaging took away.
    """

    time: float
    normal: FloatArray
    mixed: FloatArray
    left: FloatArray


def averaged(residual: Residual, samples: int) -> tuple[Residual, FloatArray]:
    """Return means of so many ``samples``, and the mean square of each channel about straight lines through as many, (channels,)."""
    if samples <= 2:
        return residual, np.zeros(len(residual.values))
    values, quick = _averaged(residual.values, samples)
    sensitivities, others = _means(residual.sensitivities, samples), residual.others[:0]
    return Residual(values, sensitivities, _means(residual.speed, samples), _means(residual.simulated, samples), others), quick


def averaged_others(residual: Residual, samples: int) -> list[tuple[FloatArray, FloatArray]]:
    """Return the same of the residuals of the other machines: means (channels, samples) and mean squares (channels,) of each."""
    if samples <= 2:
        return [(values, np.zeros(len(values))) for values in residual.others]
    return [_averaged(values, samples) for values in residual.others]


def _averaged(residual: FloatArray, samples: int) -> tuple[FloatArray, FloatArray]:
    values = _means(residual, samples)
    pieces = residual[:, : values.shape[1] * samples].reshape(-1, values.shape[1], samples)
    ramp = np.arange(samples) - 0.5 * (samples - 1)
    slope = pieces @ ramp / (ramp @ ramp)
    return values, np.asarray(np.mean((pieces - values[:, :, None] - slope[:, :, None] * ramp) ** 2, axis=(1, 2)))


def _means(values: FloatArray, samples: int) -> FloatArray:
    count = values.shape[-1] // samples
    return np.asarray(values[..., : count * samples].reshape(*values.shape[:-1], count, samples).mean(axis=-1))


def block_sums(values: FloatArray, regressors: FloatArray, quick: FloatArray, time: float) -> BlockSums:
    """Return the sums of a block: ``values`` (channels, samples), ``regressors`` (channels, q, samples), ``quick`` (channels,)."""
    normal = regressors @ regressors.transpose(0, 2, 1)
    mixed = np.einsum("cqn,cn->cq", regressors, values)
    held = normal + np.eye(normal.shape[1]) * (_RIDGE * np.einsum("cqq->cq", normal)[:, :, None] + 1e-12)
    explained = np.einsum("cq,cq->c", mixed, np.linalg.solve(held, mixed[:, :, None])[:, :, 0])
    left = np.maximum(np.sum(values * values, axis=1) - explained, 0.0) / values.shape[1]
    return BlockSums(time, normal, mixed, np.concatenate([left, quick]))


def direction_names(drive: Sequence[str]) -> tuple[str, ...]:
    """Return what the directions are called in a sentence, in the order of :func:`directions`."""
    several = len(drive) > 1
    names = ["at all times"]
    for name in drive:
        of = f" of {Place.of(name).part}" if several else ""
        names += [f"moving backwards{of}", f"moving forwards{of}", f"in proportion to the speed{of}"]
    return (*names, "in proportion to its value")


def directions(residual: Residual, still: FloatArray, scale: FloatArray) -> FloatArray:
    """Return the directions (channels, directions, samples): 1, backwards, forwards and speed of each drive, and the channel's own value.

    Slower than ``still`` (drives,) [per sample] a drive stands; ``scale`` (drives + channels,) is what speeds and values are divided by.
    """
    speed = residual.speed
    count = len(speed)
    shared = [np.ones(speed.shape[1])]
    for row, slowest, largest in zip(speed, still, scale[:count], strict=True):
        shared += [(row < -slowest).astype(np.float64), (row > slowest).astype(np.float64), row / largest]
    own = residual.simulated / scale[count:, None]
    return np.concatenate([np.broadcast_to(np.array(shared), (len(own), len(shared), own.shape[1])), own[:, None, :]], axis=1)
