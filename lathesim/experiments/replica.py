"""The machine of a lesson made ready to be run many times with other values, and read at given times only."""

from __future__ import annotations

import dataclasses
import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.cluster import Cluster
from lathesim.component import Output
from lathesim.components.signals import DelayLine, RecordedSignal
from lathesim.effects.backlash_and_screw import Backlash
from lathesim.engine.assembly import Assembly, FloatArray, Part, Place, Wire
from lathesim.engine.batch import Batch
from lathesim.engine.run import run
from lathesim.engine.wiring import Plan, wire
from lathesim.errors import WiringError

_ROUNDING = 1e-9
_UNHURRIED = (DelayLine, Backlash)
"""Sampled parts that give the same at another sample period, but for its fourth power or the way within a sample."""
_COARSEST = 4
"""Samples of the lesson that one sample of a replica may take, where nothing but delays is sampled."""


Say = Callable[[str], None]


@dataclass(frozen=True)
class Listener:
    """Who hears how a search gets on, ``say``, and may end it: what was found until then is kept."""

    say: Say = lambda sentence: None
    stop: threading.Event | None = None


NOBODY = Listener()


@dataclass(frozen=True)
class Search:
    """How a search went: the runs and the time [s] it took, and whether Ctrl-C ended it.

    ``tried`` are the programs that were tried: title, length [s], and the worth that it was chosen by.
    """

    runs: int
    wall_time: float
    stopped: bool
    tried: tuple[tuple[str, float, float], ...] = ()


@dataclass(frozen=True, eq=False)
class Setting:
    """One program on one machine, read at ``times`` (n,) [s] on ``channels``."""

    assembly: Assembly
    channels: tuple[str, ...]
    times: FloatArray


class Replica:
    """Runs of several settings of one machine with values of ``names``.

    A machine whose sampled parts are delays and an interpolator is run with up to four times the sample period. If nothing feeds the
    interpolator and none of its values is among ``names``, the reference is laid once. ``runs`` counts the simulations made. With
    ``stop`` set a batch raises ``KeyboardInterrupt``. A ``cluster`` runs several settings at the same time.
    """

    def __init__(
        self, settings: Sequence[Setting], names: Sequence[str], stop: threading.Event | None = None, cluster: Cluster | None = None
    ) -> None:
        self.settings = tuple(settings)
        self.names = tuple(names)
        self.stop, self.cluster = stop, cluster
        self.runs = 0
        self._batches = [_batch(setting, self.names) for setting in self.settings]

    @property
    def plan(self) -> Plan:
        """The plan of the first setting, in which the names stand."""
        return self._batches[0].plan

    def readings(
        self, values: FloatArray, only: Sequence[int] | None = None, later: float = 0.0, until: float = math.inf
    ) -> list[FloatArray]:  # fmt: skip
        """Return for each setting the readings (members, channels, times) [SI] for values (members, names) [SI]; NaN where one diverged.

        They are read ``later`` [s] than the setting says, and ``until`` a time [s] only: NaN behind it.
        """
        members = np.atleast_2d(values)
        found: list[FloatArray] = []
        places = range(len(self.settings)) if only is None else only
        if self.cluster is not None and len(places) > 1:
            calls = [(position, members, later, until) for position in places]
            found = self.cluster.in_order(_read_there, _Shared(self.settings, self.names), calls, self.stop)
            self.runs += len(members) * len(places)
            return found
        for position in places:
            if self.stop is not None and self.stop.is_set():
                raise KeyboardInterrupt
            batch, setting = self._batches[position], self.settings[position]
            samples = batch.samples if until >= setting.times[-1] else math.ceil(until / batch.plan.assembly.sample_period) + 2
            rows = batch.run(self.names, members, _reader(setting.times + later, batch), lengths=[samples] * len(members))
            self.runs += len(members)
            found.append(np.array(rows))
        return found


@dataclass(frozen=True, eq=False)
class _Shared:
    """The settings of a replica, of which a worker makes ready those that it is asked for, once."""

    settings: tuple[Setting, ...]
    names: tuple[str, ...]
    ready: dict[int, Replica] = dataclasses.field(default_factory=dict)


def _read_there(shared: _Shared, call: tuple[int, FloatArray, float, float]) -> FloatArray:
    """Return the readings of one setting, on a worker."""
    position, members, later, until = call
    if position not in shared.ready:
        shared.ready[position] = Replica([shared.settings[position]], shared.names)
    return shared.ready[position].readings(members, None, later, until)[0]


class ProgramRuns:
    """Runs of many programs on one machine with values of ``names``, read at ``rate`` [Hz]: all are runs of one plan.

    Where the reference does not depend on ``names``, that of each program is laid once, and the machine may be sampled as in
    :class:`Replica`. ``longest`` [s] is how long a program may be read.
    """

    def __init__(
        self, assembly: Assembly, interpolator: str, channels: Sequence[str], names: Sequence[str], rate: float, longest: float,
    ) -> None:  # fmt: skip
        self.names, self.rate, self.runs = tuple(names), rate, 0
        self.setting = Setting(assembly, tuple(channels), np.arange(0.0, longest, 1.0 / rate))
        self.batch = _batch(self.setting, self.names)
        part = next(item for item in assembly.parts if item.name == interpolator)
        self.path = f"{interpolator}.path"
        self.laid: Batch | None = None
        if self.path not in self.batch.plan.arrays.tables:
            alone, self.wanted = _alone(dataclasses.replace(assembly, record=self.setting.channels), part)
            self.laid = Batch(wire(alone), math.ceil(longest / alone.sample_period) + 3, noisy=False)

    def readings(self, paths: Sequence[FloatArray], seconds: Sequence[float], values: Sequence[FloatArray]) -> list[FloatArray]:
        """Return for each path table the readings (members, channels, times) [SI] of its ``values`` (members, names) [SI].

        ``seconds`` says how long each program is read. A member that diverged is NaN.
        """
        owner = [place for place, rows in enumerate(values) for _ in rows]
        period = self.batch.plan.assembly.sample_period
        lengths = [min(self.batch.samples, math.ceil(seconds[place] / period) + 2) for place in owner]
        found = self.batch.run(self.names, np.vstack(values), _reader(self.setting.times, self.batch), self._tables(paths, owner), lengths)
        self.runs += len(owner)
        return [
            np.array([row[:, : math.ceil(seconds[place] * self.rate)] for row, own in zip(found, owner, strict=True) if own == place])
            for place in range(len(paths))
        ]

    def _tables(self, paths: Sequence[FloatArray], owner: Sequence[int]) -> dict[str, list[FloatArray]]:
        if self.laid is None:
            return {self.path: [paths[place] for place in owner]}
        own = self.laid.plan.assembly.sample_period
        time = np.asarray(own * np.arange(self.laid.samples), dtype=float)
        rows = np.arange(0.0, time[-1], self.batch.plan.assembly.sample_period)

        def tables(record: FloatArray) -> list[FloatArray]:
            return [_table(rows, time, values, own) for values in record]

        laid = self.laid.run((), np.zeros((len(paths), 0)), tables, {self.path: list(paths)})
        return {f"{_laid(name)}.samples": [laid[place][number] for place in owner] for number, name in enumerate(self.wanted)}


def _reader(times: FloatArray, batch: Batch) -> Callable[[FloatArray], FloatArray]:
    """Return what reads a record at these times [s], on straight lines between samples."""
    position = np.clip(times / batch.plan.assembly.sample_period, 0.0, batch.samples - 1.000001)
    before = position.astype(int)
    share = position - before

    def read(record: FloatArray) -> FloatArray:
        return np.asarray(record[:, before] * (1.0 - share) + record[:, before + 1] * share)

    return read


def _batch(setting: Setting, names: Sequence[str]) -> Batch:
    base = dataclasses.replace(setting.assembly, finish="", record=setting.channels)
    duration = float(setting.times[-1])
    interpolators = [part for part in base.parts if "path" in part.tables]
    fixed = len(interpolators) == 1 and _stands_alone(base, interpolators[0], names)
    coarsens = len(interpolators) == 1 and _only_delays(base, interpolators[0])
    factors = range(_COARSEST, 0, -1) if coarsens else (1,)
    for factor in factors:
        period = base.sample_period * factor
        coarse = base if factor == 1 else dataclasses.replace(base, sample_period=period, step=period)
        assembly = _on_reference(base, coarse, interpolators[0], duration) if fixed else coarse
        batch = Batch(wire(assembly), math.ceil(duration / period) + 2, noisy=False)
        try:
            if factor > 1 and _shortest_delay(assembly) < period * (1.0 - _ROUNDING):
                continue
            batch.check_step()
        except WiringError:
            if factor == 1:
                raise
            continue
        return batch
    raise AssertionError("a factor of one is always tried")


def _stands_alone(assembly: Assembly, part: Part, names: Sequence[str]) -> bool:
    """Return whether nothing of the machine feeds a part, and none of its values is among ``names``."""
    fed = any(Place.of(item.target).part == part.name and item.source for item in assembly.wires)
    return not fed and not any(Place.of(name).part == part.name for name in names)


def _only_delays(assembly: Assembly, interpolator: Part) -> bool:
    """Return whether each sample is one step and no sampled part but the interpolator minds how often it is sampled."""
    sampled = [part for part in assembly.parts if "update" in part.component.laws and part is not interpolator]
    return math.isclose(assembly.step, assembly.sample_period) and all(issubclass(part.component, _UNHURRIED) for part in sampled)


def _shortest_delay(assembly: Assembly) -> float:
    """Return the shortest delay [s] of a machine."""
    plan = wire(assembly)
    found = math.inf
    for name in plan.parameters:
        part, item = Place.of(name)
        if issubclass(plan.parts[part].component, DelayLine) and item == "delay":
            found = min(found, plan.values[name])
    return found


def _on_reference(base: Assembly, coarse: Assembly, interpolator: Part, duration: float) -> Assembly:
    """Return the machine with its interpolator replaced by what it gives, laid with the sample period of ``base``."""
    alone, wanted = _alone(base, interpolator)
    laid = run(wire(alone), duration=duration + 2.0 * coarse.sample_period, engine="auto")
    rows = np.arange(0.0, duration + 2.0 * coarse.sample_period, coarse.sample_period)
    tables = [_table(rows, laid.time, laid.channels[name].values, base.sample_period) for name in wanted]
    return _on_tables(coarse, interpolator, wanted, tables)


def _alone(base: Assembly, interpolator: Part) -> tuple[Assembly, tuple[str, ...]]:
    """Return an interpolator by itself, and which of its outputs the machine reads."""
    prefix = f"{interpolator.name}."
    read = {item.source for item in base.wires if item.source.startswith(prefix)}
    wanted = tuple(sorted(read | {name for name in base.record or () if name.startswith(prefix)}))
    own = tuple(item for item in base.wires if item.target.startswith(prefix))
    return Assembly((interpolator,), own, base.sample_period, base.step, record=wanted), wanted


def _table(rows: FloatArray, time: FloatArray, values: FloatArray, period: float) -> FloatArray:
    """Return a reference as samples (rows, 2). Held over a sample it is, on average, half a sample late; the straight lines between rows
    run through the middles of the holds."""
    return np.column_stack([rows, np.interp(rows - 0.5 * period, time, values)])


def _on_tables(coarse: Assembly, interpolator: Part, wanted: Sequence[str], tables: Sequence[FloatArray]) -> Assembly:
    """Return the machine with tables in the place of its interpolator."""
    prefix = f"{interpolator.name}."
    outputs = interpolator.component.declared(Output)
    parts = [part for part in coarse.parts if part is not interpolator]
    wires = [item for item in coarse.wires if not item.target.startswith(prefix)]
    for name, table in zip(wanted, tables, strict=True):
        item = Place.of(name).port
        unit = outputs[item].unit
        parts.append(Part(_laid(name), RecordedSignal.with_units({"signal": unit}), {"interpolation": 1.0}, tables={"samples": table}))
        wires = [Wire(wire_.target, f"{_laid(name)}.signal") if wire_.source == name else wire_ for wire_ in wires]
    record = tuple(f"{_laid(name)}.signal" if name.startswith(prefix) else name for name in coarse.record or ())
    return dataclasses.replace(coarse, parts=tuple(parts), wires=tuple(wires), record=record)


def _laid(output: str) -> str:
    """Return the name of the part that holds what an output of an interpolator gives."""
    return f"laid_{Place.of(output).port}"


def given_values(plan: Plan, names: Sequence[str]) -> FloatArray:
    """Return the values [SI] of parameters and starts as the machine has them."""
    return np.array([plan.given(name) for name in names])
