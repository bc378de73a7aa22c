"""Residuals while the machine runs: what was measured less what the lesson's simulation does under the same reference.

Beside the nominal simulation two run for each uncertain value, a standard deviation above and below: half their difference is what that
value would do to the residual. It does not share the quantisation noise of the nominal run, which would otherwise pass for a change of the
value. A value that is off by what the lesson allows is no change of the machine.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.identification.replay.loading import uncertainties
from lathesim.identification.replay.open_loop import seen
from lathesim.lessons.simulate import Prepared
from lathesim.live.servo.stepped_machine import SteppedMachine
from lathesim.live.sources.samples import LiveError
from lathesim.record import FloatArray

_HALF = 0.5
"""Share of a value by which it is changed at most."""
FURTHEST = 4.0
"""Standard deviations from the lesson's values that the simulation goes on with at most."""
LARGEST_RATIO = 1000
"""Periods of the machine between two samples of a recording at most."""


@dataclass(frozen=True, eq=False)
class Residual:
    """Residuals of a stretch: ``values`` (channels, samples), ``sensitivities`` (parameters, channels, samples) per standard deviation,
    the ``speed`` (drives, samples) of each driven input per sample, and what was ``simulated`` (channels, samples)."""

    values: FloatArray
    sensitivities: FloatArray
    speed: FloatArray
    simulated: FloatArray


class ResidualStream:
    """Simulates a lesson beside its recording. ``drive`` and ``compare`` are the channels that a block must hold, in that order."""

    def __init__(self, prepared: Prepared, drive: Sequence[str], compare: Sequence[str], period: float) -> None:
        self._prepared = prepared
        self.drive, self.compare = tuple(drive), tuple(compare)
        self.uncertain: Mapping[str, float] = {
            name: deviation
            for name, deviation in uncertainties(prepared.case.lesson, prepared.plan).items()
            if name in prepared.plan.parameters and deviation > 0.0
        }
        own = prepared.plan.assembly.sample_period
        self.ratio = round(period / own)
        if self.ratio < 1 or self.ratio > LARGEST_RATIO or abs(period / own - self.ratio) > 1e-3 * self.ratio:
            fact = f"the samples come every {1e3 * period:g} ms, and the machine is simulated every {1e3 * own:g} ms."
            raise LiveError(fact, remedy="Record at the machine's rate, or at a whole fraction of it.")
        self._machines: list[SteppedMachine] = []
        self._outputs = [seen(prepared.machinery, channel) for channel in self.compare]
        self._last: FloatArray | None = None
        self.nominal: FloatArray = np.zeros(len(self.uncertain))
        self.restart()

    @property
    def parameters(self) -> tuple[str, ...]:
        """Return the names of the uncertain values."""
        return tuple(self.uncertain)

    def restart(self) -> None:
        """Begin the simulation anew: the samples before are not those before the next."""
        axes = {name: (name,) for name in self.drive}
        outputs = list(dict.fromkeys(self._outputs))
        self._machines = [SteppedMachine(self._prepared, axes, overrides=values, record=outputs) for values in self._values()]
        self._last = None

    def move(self, nominal: FloatArray) -> FloatArray:
        """Go on with the uncertain values at ``nominal`` (parameters,) standard deviations from the lesson's; return how far they moved.

        Sensitivities are differences, so they hold near the nominal values only. No value goes further than what the lesson calls
        uncertain, nor by more than half of itself: a machine far from the lesson's might not be stable.
        """
        plan = self._prepared.plan
        given = np.array([abs(plan.parameter_values[plan.parameters[name]]) for name in self.uncertain])
        deviations = np.array(list(self.uncertain.values()))
        most = np.minimum(FURTHEST, np.where(given > 0.0, _HALF * given / deviations, FURTHEST)) if len(deviations) else deviations
        before, self.nominal = self.nominal, np.clip(np.asarray(nominal, dtype=np.float64), -most, most)
        for machine, values in zip(self._machines, self._values(), strict=True):
            machine.change(values)
        return np.asarray(self.nominal - before)

    def _values(self) -> list[dict[str, float]]:
        """Return the uncertain values [SI] of the nominal machine, and of two for each value: above and below."""
        plan = self._prepared.plan
        given = {name: plan.parameter_values[plan.parameters[name]] for name in self.uncertain}
        nominal = {name: given[name] + at * self.uncertain[name] for name, at in zip(given, self.nominal, strict=True)}
        found = [nominal]
        for name in self.uncertain:
            found += [{**nominal, name: nominal[name] + sign * self._step(name, nominal[name])} for sign in (1.0, -1.0)]
        self._shares = np.array([2.0 * self._step(name, nominal[name]) / self.uncertain[name] for name in self.uncertain])
        return found

    def _step(self, name: str, value: float) -> float:
        deviation = self.uncertain[name]
        return min(deviation, _HALF * abs(value)) if value else deviation

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
        pairs = np.array(runs[1:]).reshape(count, 2, *residual.shape)
        sensitivities = (pairs[:, 0] - pairs[:, 1]) / self._shares.reshape(count, 1, 1)
        return Residual(residual, sensitivities, speed, runs[0])

    def _channels(self, machine: SteppedMachine, values: FloatArray) -> FloatArray:
        return values[[machine.plan.channels.index(output) for output in self._outputs]]
