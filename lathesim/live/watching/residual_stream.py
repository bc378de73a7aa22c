"""Residuals while the machine runs: what was measured less what the lesson's simulation does under the same reference.

Beside the nominal simulation one runs for each uncertain value, changed by its standard deviation: the difference is what that value would
do to the residual. A value that is off by what the lesson allows is no change of the machine.
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

LARGEST_RATIO = 1000
"""Periods of the machine between two samples of a recording at most."""


@dataclass(frozen=True, eq=False)
class Residual:
    """Residuals of a stretch: ``values`` (channels, samples), ``sensitivities`` (parameters, channels, samples) per standard deviation,
    and the ``speed`` (samples,) of the first driven input per sample."""

    values: FloatArray
    sensitivities: FloatArray
    speed: FloatArray


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
        self.restart()

    @property
    def parameters(self) -> tuple[str, ...]:
        """Return the names of the uncertain values."""
        return tuple(self.uncertain)

    def restart(self) -> None:
        """Begin the simulation anew: the samples before are not those before the next."""
        plan = self._prepared.plan
        changed: list[dict[str, float]] = [{}]
        for name, deviation in self.uncertain.items():
            given = plan.parameter_values[plan.parameters[name]]
            changed.append({name: given + deviation})
        axes = {name: (name,) for name in self.drive}
        self._machines = [
            SteppedMachine(self._prepared, axes, overrides=overrides, record=list(dict.fromkeys(self._outputs))) for overrides in changed
        ]
        self._last = None

    def take(self, values: FloatArray) -> Residual:
        """Return the residual of the next samples; ``values`` (drive and compare, samples)."""
        driven = values[: len(self.drive)].T
        before = driven[:1] if self._last is None else self._last
        speed = np.diff(np.vstack([before, driven]), axis=0)[:, 0]
        fine = driven
        if self.ratio > 1:
            share = np.arange(1, self.ratio + 1)[None, :, None] / self.ratio
            starts = np.vstack([before, driven[:-1]])
            fine = (starts[:, None, :] + share * (driven - starts)[:, None, :]).reshape(-1, driven.shape[1])
        self._last = driven[-1:].copy()
        runs = [self._channels(machine, machine.advance(fine)[:, self.ratio - 1 :: self.ratio]) for machine in self._machines]
        residual = values[len(self.drive) :] - runs[0]
        sensitivities = np.array([run - runs[0] for run in runs[1:]]).reshape(len(runs) - 1, *residual.shape)
        return Residual(residual, sensitivities, speed)

    def _channels(self, machine: SteppedMachine, values: FloatArray) -> FloatArray:
        return values[[machine.plan.channels.index(output) for output in self._outputs]]
