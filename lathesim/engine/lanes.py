"""Runs of one plan side by side: their numbers in rows, one lane a run (see :mod:`lathesim.engine.lane_text`)."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np

from lathesim.engine.assembly import FloatArray, Timing
from lathesim.engine.fuse import flat_name, fuse, idle_values
from lathesim.engine.lane_text import LANES, LaneModule, known_module, lane_module
from lathesim.engine.law_text import NotInPlaceError
from lathesim.engine.machine_code import CompiledMachine
from lathesim.engine.module_cache import compile_time, compiled_machine, is_compiled
from lathesim.engine.run_arrays import RunArrays
from lathesim.engine.wiring import Plan
from lathesim.errors import SimulationError

_LINE, _MEET = 8, 64
"""Numbers of a cache line, and a length of which lanes that are a multiple apart push each other out of the cache."""

FEWEST = 3
"""Runs from which lanes pay: sixteen together take as long as two or three alone."""
LEAST = 2
"""Runs from which lanes are thought of."""
_LARGEST_RECORD = 2**25
"""Numbers in the record of sixteen runs (256 MB a thread); longer ones are run one by one."""
_LARGE_RECORD = 2**22
"""Numbers of a record (32 MB) that is not kept for later runs."""
WORTH_A_LOOK = 0.1
"""Seconds of runs one by one before a text is written for lanes, which takes about that long itself."""
_CAUTION = 2.0
"""``compile_time`` is for people, who wait gladly less than they expect; of five lessons it was 1.8 to 2.3 times what their lanes took."""
_NOT_WORTH = 1.5
"""How many times longer than one by one runs may take before lanes are given up: the time of one run says little on a busy machine."""


@dataclass
class _Spent:
    """What is known of a kind of batch: seconds of its runs one by one, of the last, of a group of lanes, of the compiler; what has varied
    in it; whether machine code of its lanes was looked for, and whether lanes are refused."""

    total: float = 0.0
    last: float = 0.0
    group: float = 0.0
    price: float | None = None
    varied: frozenset[str] = frozenset()
    looked: bool = False
    refused: bool = False


_SPENT: dict[tuple[str, frozenset[tuple[str, bool]]], _Spent] = {}
"""By the text of a machine and what idles in it: recordings of one machine have a plan each, and all their runs count. What varies in one
call may be alike in the next: lanes in which it varies serve both."""


def _idling(plan: Plan) -> Mapping[str, Mapping[int, float]]:
    """Return for each part that may idle where its parameters stand, and the values with which it does; worked out once for a plan."""
    if "idling" not in plan.kept:
        values = {part.name: idle_values(plan, part) for part in plan.parts.values()}
        plan.kept["idling"] = {
            name: {plan.parameters[f"{name}.{item}"]: value for item, value in some.items()} for name, some in values.items() if some
        }
    return cast(Mapping[str, Mapping[int, float]], plan.kept["idling"])


class Choice:
    """Whether a batch is run in lanes, which costs the compiler's time once.

    Lanes are compiled once the runs that were made one by one, and those still ahead, would take longer than the compiler; so no batch
    takes more than twice as long as it would with the better of the two.
    """

    def __init__(self, plan: Plan, varied: Sequence[str], parameters: FloatArray, columns: Mapping[int, FloatArray]) -> None:
        self.plan = plan
        self.alike: dict[str, bool] = {}
        for name, values in _idling(plan).items():
            moved = {place for place in values if place in columns}
            rests = all(parameters[place] == value for place, value in values.items() if place not in moved)
            idles = np.all([columns[place] == values[place] for place in moved], axis=0) if rests and moved else np.array(rests)
            if np.all(idles) or not np.any(idles):
                self.alike[name] = bool(np.all(idles))
        self._machine = fuse(plan).digest
        self._spent = _SPENT.setdefault((self._machine, frozenset(self.alike.items())), _Spent())
        if not self._spent.varied.issuperset(varied):
            self._spent.varied, self._spent.price, self._spent.looked = self._spent.varied.union(varied), None, False
        self.varied = self._spent.varied

    @property
    def refused(self) -> bool:
        """Whether lanes cannot be made of this machine, or were no quicker."""
        return self._spent.refused

    def spend(self, seconds: float, runs: int, side_by_side: bool) -> None:
        """Count the time of runs; go back to one by one where lanes took longer, as where most laws are loops.

        Only full groups count: a group that is not full takes as long, which says nothing of one run in sixteen.
        """
        if side_by_side:
            self._spent.group = seconds
            self._spent.refused |= runs == LANES and 0.0 < _NOT_WORTH * self._spent.last < seconds / runs
        else:
            self._spent.total, self._spent.last = self._spent.total + seconds, seconds

    def pays(self, ahead: int) -> bool:
        """Return whether a group of lanes takes less time than so many runs one by one, as far as both are known."""
        spent = self._spent
        return ahead * spent.last > spent.group if spent.last and spent.group else ahead >= FEWEST

    def lanes(self, ahead: int, samples: int) -> Lanes | None:
        """Return the lanes for runs of so many samples where ``ahead`` of them are worth it, compiled."""
        spent = self._spent
        total = spent.total + ahead * spent.last
        too_long = LANES * samples * len(self.plan.channels) > _LARGEST_RECORD
        if spent.refused or ahead < LEAST or too_long:
            return None
        try:
            module = (lane_module if total >= self._worth_a_text else known_module)(self.plan, self.varied, self.alike)
            if module is None:
                return None
            if spent.price is None and not spent.looked:  # once: it goes through all files of a cache, of which there may be thousands
                spent.looked, spent.price = True, 0.0 if is_compiled(module.fused) else None
            if spent.price is None and total >= self._worth_a_text:
                spent.price = compile_time(module.fused) / _CAUTION
            if spent.price is not None and total >= spent.price:
                return Lanes(self.plan, module, compiled_machine(module.fused), samples)
        except (NotInPlaceError, SimulationError):  # the machine itself was compiled: it runs as it is
            spent.refused = True
        return None

    @property
    def _worth_a_text(self) -> float:
        """Seconds of runs one by one before a text is written: what the compiler takes for this machine with something else awake, as far
        as that is known. Most of a diagnosis's candidates are given up before their lanes would pay."""
        spent = list(_SPENT.items())  # at once: another thread may add a kind of batch
        known = (one.price for (machine, _), one in spent if machine == self._machine)
        return min((price for price in known if price), default=WORTH_A_LOOK)


_RECORDS: list[FloatArray] = []
"""Records that no thread writes to now: to be given fresh memory takes a third as long as the runs that are kept in it."""


@dataclass
class Lanes:
    """What one thread needs to run lane by lane: a machine and a record of shape (lanes, numbers), given back with :meth:`end`."""

    plan: Plan
    module: LaneModule
    machine: CompiledMachine
    samples: int

    def __post_init__(self) -> None:
        length = self.samples * len(self.plan.channels)
        shape = LANES, length + _LINE * (length % _MEET == 0)
        with contextlib.suppress(IndexError):
            self.record = _RECORDS.pop()
            if self.record.shape == shape:
                return
        self.record = np.zeros(shape)

    def end(self) -> None:
        """Leave the record to the next thread that needs one; the last two that are not large wait."""
        if self.record.size < _LARGE_RECORD:
            _RECORDS[:] = [*_RECORDS[-1:], self.record]

    def run(self, members: Sequence[RunArrays], count: int, timing: Timing, noises: Sequence[FloatArray]) -> tuple[FloatArray, list[int]]:
        """Return the records of up to 16 members, shape (lanes, samples, channels), and how many samples each was advanced."""
        plan, rows = self.plan, self.module.rows
        spare = LANES - len(members)
        members = [*members, *[members[-1].copy() for _ in range(spare)]]
        space = np.zeros((len(rows), LANES))
        first = [len(plan.parameters), len(plan.states), len(plan.discrete)]
        for lane, member in enumerate(members):
            given = (member.parameters, member.states, member.discrete)
            space[: sum(first), lane] = np.concatenate([item[:size] for item, size in zip(given, first, strict=True)])
        for part in plan.parts.values():
            if (row := rows.get(f"{part.name}__idle")) is not None:
                values = idle_values(plan, part).items()
                space[row] = np.all([space[rows[flat_name(f"{part.name}.{name}")]] == value for name, value in values], axis=0)
        done = np.zeros(LANES)
        between = np.array([float(self.record.shape[1])])
        every = ([member.memories for member in members], [member.tables for member in members], [*noises, *[noises[-1]] * spare])
        memories, tables, noise = (tuple(item for lanes in zip(*each, strict=True) for item in lanes) for each in every)
        advanced = self.machine.run_block(
            0, count, *timing, space.reshape(-1), done, between, memories, tables, noise, self.record.reshape(-1)
        )
        records = self.record[:, : self.samples * len(plan.channels)].reshape(LANES, self.samples, len(plan.channels))
        return records, [int(item) or advanced for item in done]
