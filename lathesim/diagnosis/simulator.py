"""A machine made ready to be held against one recording, many times."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.diagnosis.noise_model import NoiseShapes, noise_shapes
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import FloatArray
from lathesim.engine.batch import Batch
from lathesim.engine.wiring import Plan

LOST = 1e12
"""Residual, in floors, of a run whose numbers grew beyond all bounds."""


@dataclass(frozen=True, eq=False)
class Simulator:
    """A plan, and what was recorded of its channels on its sample grid.

    ``recorded`` has shape (channels, samples) [SI]; NaN where nothing was recorded. ``floors`` is what the recording cannot resolve in
    each channel, one standard deviation [SI].
    """

    plan: Plan
    channels: tuple[str, ...]
    recorded: FloatArray
    floors: FloatArray
    name: str = "the recording"

    @property
    def samples(self) -> int:
        """Number of samples of the recording."""
        return int(self.recorded.shape[1])

    def noise_shapes(self, values: Mapping[str, float], *, coloured: bool = False) -> tuple[NoiseShapes, ...]:
        """Give the shapes of the noise in each channel, with the machine at ``values``.

        Without ``coloured`` sensors and forces are white: what a fit weighs the residual with; with it they may be slow: what a residual is
        judged with. As the weight follows the machine, a round of fitting solves the equations of the instrumental-variable estimate and
        is not drawn towards a machine that answers less.
        """
        kicks, motion = self._kicks(values)
        period = self.plan.assembly.sample_period
        return tuple(noise_shapes(kicks[:, row], motion[row], floor, period, coloured=coloured) for row, floor in enumerate(self.floors))

    def _kicks(self, values: Mapping[str, float]) -> tuple[FloatArray, FloatArray]:
        """Give the response to a kick of each of the machine's own states (states, channels, samples), and the channels themselves."""
        states = [name for name in self.plan.states if not issubclass(self.plan.parts[name.partition(".")[0]].component, Effect)]
        names = list(dict.fromkeys([*values, *states]))
        base = np.array([values[name] if name in values else self._start(name) for name in names])
        rows = np.tile(base, (len(states) + 1, 1))
        for row, state in enumerate(states, start=1):
            rows[row, names.index(state)] += max(1e-3 * abs(base[names.index(state)]), 1e-3)
        runs = self.outputs(names, rows)
        kicks = np.array([run - runs[0] for run in runs[1:]]).reshape(len(states), *runs[0].shape)
        return np.nan_to_num(kicks, nan=0.0, posinf=0.0, neginf=0.0), runs[0]

    def _start(self, state: str) -> float:
        return self.plan.start_states[self.plan.states[state]]

    def outputs(self, names: Sequence[str], values: FloatArray) -> list[FloatArray]:
        """Give the simulated channels, shape (channels, samples), for each row of ``values`` of the names that are set."""
        positions = [self.plan.channels.index(channel) for channel in self.channels]
        pick: Callable[[FloatArray], FloatArray] = lambda record: record[positions].copy()  # noqa: E731 - one expression, named for the reader
        return Batch(self.plan, self.samples, noisy=False).run(list(names), values, pick)

    def residuals(self, names: Sequence[str], values: FloatArray) -> list[FloatArray]:
        """Give recorded minus simulated for each row of ``values``; zero where nothing was recorded."""
        return [self.residual_of(output) for output in self.outputs(names, values)]

    def residual_of(self, output: FloatArray) -> FloatArray:
        """Give recorded minus ``output``; zero where nothing was recorded, very large where the run was lost."""
        bound = LOST * self.floors[:, None]
        residual = np.clip(np.nan_to_num(self.recorded - output, nan=np.inf, posinf=np.inf, neginf=-np.inf), -bound, bound)
        return np.where(np.isfinite(self.recorded), residual, 0.0)

    def one(self, values: Mapping[str, float]) -> FloatArray:
        """Give the residual for one set of values by name."""
        return self.residuals(list(values), np.array([list(values.values())], dtype=float))[0]
