"""The simulated machine, advanced by as many servo periods as there are set-points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from lathesim.component import Input, Output
from lathesim.engine.fuse import fuse
from lathesim.engine.module_cache import compiled_machine
from lathesim.engine.run_arrays import draw_noise, start_arrays
from lathesim.engine.wiring import Plan, wire
from lathesim.errors import SimulationError, nearest
from lathesim.identification.replay.open_loop import drive
from lathesim.lessons.simulate import Prepared
from lathesim.live.samples import LiveError, Signal
from lathesim.record import FloatArray

LARGEST_BLOCK = 1024
"""Servo periods that are computed in one go at most."""


class SteppedMachine:
    """A lesson's machine whose inputs follow set-points. ``advance`` takes the set-points of the next periods and returns what it did.

    ``axes`` maps the name of each axis to the inputs (``part.input``) that follow it. Noise, states and time go on from call to call: how
    the periods are grouped makes no difference. ``overrides`` are other values [SI], ``record`` other channels than the lesson's.
    """

    def __init__(
        self,
        prepared: Prepared,
        axes: Mapping[str, Sequence[str]],
        *,
        seed: int | None = None,
        overrides: Mapping[str, float] | None = None,
        record: Sequence[str] | None = None,
    ) -> None:
        self.name = prepared.name
        self.axes = tuple(axes)
        self._targets = [(column, target) for column, name in enumerate(axes) for target in axes[name]]
        driven = drive(prepared.machinery, {target: np.zeros(LARGEST_BLOCK) for _, target in self._targets})  # a table for each
        driven = replace(driven, finish="", record=driven.record if record is None else tuple(record))
        self.plan: Plan = wire(driven)
        self.period = self.plan.assembly.sample_period
        self.seed = prepared.case.seed if seed is None else seed
        self.periods = 0
        self._arrays = start_arrays(self.plan, overrides)
        self._module: Any = compiled_machine(fuse(self.plan))
        self._rows = [self.plan.settable(f"{_fed_by(target)}.position")[1] for _, target in self._targets]
        names = list(self.plan.arrays.tables)
        self._tables = [self._arrays.tables[names.index(f"{_fed_by(target)}.recorded")] for _, target in self._targets]

    @property
    def signals(self) -> tuple[Signal, ...]:
        """Return the recorded channels of the machine."""
        return tuple(Signal(name, self.plan.unit(name), self.plan.doc(name)) for name in self.plan.channels)

    @property
    def axis_units(self) -> tuple[str, ...]:
        """Return the SI unit of each axis."""
        first = dict(reversed(self._targets))
        return tuple(self.plan.unit(first[column]) for column in range(len(self.axes)))

    @property
    def driven(self) -> list[tuple[str, str]]:
        """Return the inputs ``part.input`` that follow set-points, with their SI units."""
        return [(target, self.axis_units[column]) for column, target in self._targets]

    @property
    def driven_columns(self) -> list[int]:
        """Return which axis each of them follows."""
        return [column for column, _ in self._targets]

    def change(self, values: Mapping[str, float]) -> None:
        """Go on with other parameters ``part.parameter`` [SI]; states stay as they are."""
        for name, value in values.items():
            self._arrays.parameters[self.plan.parameters[name]] = value

    def advance(self, set_points: FloatArray) -> FloatArray:
        """Return the channels (channels, periods) of the next periods under ``set_points`` (periods, axes).

        Raises :class:`SimulationError` where the machine stops being a number.
        """
        parts = [self._few(set_points[begin : begin + LARGEST_BLOCK]) for begin in range(0, len(set_points), LARGEST_BLOCK)]
        return np.concatenate(parts, axis=1) if parts else np.zeros((len(self.plan.channels), 0))

    def _few(self, set_points: FloatArray) -> FloatArray:
        count, channels = len(set_points), len(self.plan.channels)
        for (column, _), row, table in zip(self._targets, self._rows, self._tables, strict=True):
            table[:count, 0] = set_points[:, column]
            self._arrays.discrete[row] = 0.0
        noise = draw_noise(self.plan.arrays.noises, self.seed, self.periods, count)
        record = np.zeros(count * channels)
        self._module.run_block(self.periods, count, *self.plan.assembly.timing, *self._arrays.in_order, noise, record)
        self.periods += count
        values: FloatArray = record.reshape(count, channels).T
        if not np.isfinite(values).all():
            wrong = self.plan.channels[int(np.nonzero(~np.isfinite(values))[0][0])]
            fact = f"{wrong} stopped being a number in the {count} periods before t = {self.periods * self.period:.4g} s."
            raise SimulationError(fact, remedy="Send set-points that the machine can follow.")
        return values


def _fed_by(target: str) -> str:
    return f"recorded_{target.replace('.', '_')}"


def axes_of(prepared: Prepared, names: Sequence[str], given: Mapping[str, str]) -> dict[str, tuple[str, ...]]:
    """Return the inputs that follow each axis.

    ``given`` maps names to an input ``part.input`` or an output ``part.output``. Without an entry an axis is the column of that name under
    ``recordings: drive:``, or else the output called ``NAME_reference``; a single axis may also be the only input that a recording drives.
    Raises :class:`LiveError` with what could be meant.
    """
    assembly = prepared.machinery
    fed: dict[str, list[str]] = {}
    for item in assembly.wires:
        if item.source:
            fed.setdefault(item.source, []).append(item.target)
    inputs = {f"{part.name}.{item}" for part in assembly.parts for item in part.component.declared(Input)}
    references = {f"{part.name}.{item}": item for part in assembly.parts for item in part.component.declared(Output)}
    recordings = prepared.case.lesson.settings.recordings
    driven = dict(recordings.drive) if recordings is not None else {}
    for name in given:
        if name not in names:
            raise LiveError(f"--axis names '{name}', and the set-points have {', '.join(names)}.", remedy=nearest(name, names))
    found: dict[str, tuple[str, ...]] = {}
    for name in names:
        meant = given.get(name, name)
        columns = [target for target, entry in driven.items() if entry.column == meant]
        outputs = [output for output, item in references.items() if item == f"{meant}_reference" and output in fed]
        if meant in inputs:
            found[name] = (meant,)
        elif meant in fed:
            found[name] = tuple(fed[meant])
        elif columns:
            found[name] = tuple(columns)
        elif len(outputs) == 1:
            found[name] = tuple(fed[outputs[0]])
        elif len(names) == 1 and len(driven) == 1:
            found[name] = tuple(driven)
        else:
            known = [*driven, *(output for output, item in references.items() if item.endswith("_reference") and output in fed)]
            remedy = f"Say what follows it with --axis {name}=PART.INPUT; it may be {', '.join(known) or 'an input of a controller'}."
            raise LiveError(f"nothing in {prepared.name} follows the axis '{name}'.", remedy=remedy)
    return found
