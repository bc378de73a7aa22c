"""``fuse``: a plan to one readable Python module, which runs as it stands and is compiled as it stands.

The module holds the laws as they stand in their components and two functions of its own::

    run_block(first, count, period, step, steps, parameters, states, discrete, memories, tables, noise, record) -> samples
    rates(time, sample_period, step, parameters, states, discrete, memories, tables, result)

``run_block`` advances ``count`` samples from sample ``first``: outputs and updates in wiring order, recording, then RK4 steps to the next
sample. It gives how many it advanced, negative when the machine's ``finish`` output rose in the last of them. ``states`` and ``discrete``
are read at the start and written back at the end. ``record`` is flat, sample after sample, so that the values of one instant lie side by
side. Parameters, start values, tables and noise are arguments: changing them never makes new source. ``vector`` and ``matrix`` take one
array out of many, ``take`` and ``put`` some of its numbers, ``keep`` those of a record.

The stages of the plan's tableau are one loop: a machine of many parts is then compiled in a quarter of the time, and runs as fast. A law
that a stage calls once stands there in place of its call, without what nobody reads, and what is held through the sample is computed before
the steps: plain Python then takes two thirds of the time, and machine code no longer. Sums begin with -0.0, to which adding any number
gives that number.
"""

from __future__ import annotations

import hashlib
import math
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, cast

from lathesim.component import BUILT_IN_ARGUMENTS, DiscreteState, Input, Memory, Noise, State, Table
from lathesim.engine.assembly import Part
from lathesim.engine.fusing.idle_groups import grouped
from lathesim.engine.fusing.law_source import LawLibrary, Piece
from lathesim.engine.fusing.step_text import shortened
from lathesim.engine.wiring import Plan, giving, law_sources

_PORTION = 32
_LONGEST_BODY = 40
"""Lines of a law that may stand in place of its call."""
_HEAD = '"""A fused machine, written by lathesim; change the parts, not this file."""\n'
_ACCESS = """
def take(numbers, first, count):
    return numbers[first:first + count]


def put(numbers, first, given):
    numbers[first:first + len(given)] = given


def keep(record, first, given):
    pack_into(f"{len(given)}d", record, 8 * first, *given)

"""


@dataclass(frozen=True)
class FusedModule:
    """The source of a fused plan, its laws one by one (each after those it calls), and the digest that names it in the cache."""

    source: str
    pieces: tuple[Piece, ...]
    digest: str


def fuse(plan: Plan, *, checked: bool = False) -> FusedModule:
    """Write the module of a plan. With ``checked`` every law's result goes through ``check_law`` (used to find where a run broke)."""
    key = "checked module" if checked else "module"
    if key not in plan.kept:
        writer = _Writer(plan, checked)
        source = writer.module()
        plan.kept[key] = FusedModule(source, tuple(writer.laws.pieces.values()), hashlib.sha256(source.encode()).hexdigest()[:32])
    return cast(FusedModule, plan.kept[key])


class _Writer:
    def __init__(self, plan: Plan, checked: bool) -> None:
        self.plan = plan
        self.checked = checked
        self.laws = LawLibrary()
        self.slow = {part.name for part in plan.parts.values() if part.every > 1}
        self.same: dict[str, str] = {}
        """Inside a stage: variable -> the one it is only another name of, which spares the assignment."""
        self.stage_laws = [(plan.parts[name], law) for name, law in plan.stage]
        self.stage_laws += [(part, "derivative") for part in plan.parts.values() if "derivative" in part.component.laws]
        self.alone = Counter(part.component.laws[law] for part, law in self.stage_laws)
        self.staged = set(plan.stage)
        self.read = {self._during_stage(source) for part, law in self.stage_laws for source in law_sources(part, law, plan.feeds)}
        """What a stage reads of what its laws give."""

    # ---- names ----------------------------------------------------------------------------------------------------------------

    def _during_stage(self, output: str) -> str:
        """Return the variable of an output inside a stage: one of its own where it moves between samples, which is quicker to compile."""
        return _flat(output) + ("__stage" if giving(self.plan.parts, output) in self.staged else "")

    def _variable(self, part: Part, name: str, law: str, staged: bool, time: str) -> str:
        """Return the expression by which a law of ``part`` reads one of its arguments."""
        if name in BUILT_IN_ARGUMENTS:
            if name == "time":
                return time
            if name == "sample_period":
                return f"{part.name}__sample_period" if part.name in self.slow else "period"
            return "step"
        full = f"{part.name}.{name}"
        item = part.component.declarations[name]
        if full in self.plan.feeds:
            kind, source = self.plan.feeds[full]
            if kind == "output" and isinstance(item, Input) and item.previous and law == "update":
                return _flat(full) + "__previous"
            found = self._during_stage(source) if staged and kind == "output" else _flat(source)
            return self.same.get(found, found)
        if type(item) is State and staged:
            return _flat(full) + "__stage"
        if isinstance(item, Noise):
            return f"{_flat(full)}__noise[sample]"
        return _flat(full)

    def _idle(self, part: Part) -> dict[str, float]:
        """Return the values with which a part only passes on what it is given; empty where it has none, or where a wire feeds one."""
        values, _ = part.component.idle()
        return {} if self.checked or any(f"{part.name}.{name}" in self.plan.feeds for name in values) else values

    def _assign(self, targets: list[str], part: Part, law: str, staged: bool, time: str) -> list[str]:
        """Write a law. A part that may be idle has a branch beside it: machines with many candidates for what was left out cost little more
        than without them."""
        if not self._idle(part):
            return self._law(targets, part, law, staged, time)
        passed = part.component.idle()[1]
        if law in part.component.output_laws():
            names = [passed.get(item, "") for item in part.component.output_laws()[law]]
            if not all(name in part.component.arguments[law] for name in names):
                return self._law(targets, part, law, staged, time)
            values = [self._variable(part, name, law, staged, time) for name in names]
        else:
            values = ["0.0"] * len(targets) if law == "derivative" else targets
        same, self.same = self.same, dict(self.same)
        busy = self._law(targets, part, law, staged, time)
        aliased = [f"{target} = {self.same[target]}" for target in targets if target in self.same and target not in same]
        self.same = same
        idle = [f"{target} = {value}" for target, value in zip(targets, values, strict=True) if target != value] or ["pass"]
        return [f"if {part.name}__idle:", *[f"    {line}" for line in idle], "else:", *[f"    {line}" for line in [*busy, *aliased]]]

    def _law(self, targets: list[str], part: Part, law: str, staged: bool, time: str) -> list[str]:
        function = part.component.laws[law]
        names = part.component.arguments[law]
        values = {name: self._variable(part, name, law, staged, time) for name in names}
        alone = law != "update" or len(targets) == 1  # of several, the first could be what the second still reads
        short = self.laws.in_place(function, values) if alone and not self.checked else None
        wanted = self.read if staged and law != "derivative" else set(targets)
        if short is not None and len(short) == len(targets):
            pairs = [(target, value) for target, value in zip(targets, short, strict=True) if target in wanted]
            if staged and law != "derivative":
                self.same |= {target: value for target, value in pairs if value.isidentifier()}
            return [f"{target} = {value}" for target, value in pairs if target not in self.same]
        if staged and not self.checked and (lines := self._body(function, part, law, values, targets)) is not None:
            return lines
        call = f"{self.laws.add(function, f'{part.component.__name__}_{law}')}({', '.join(values.values())})"
        if self.checked:
            kinds = part.component.declarations
            given = [f"({name!r}, {value})" for name, value in values.items() if not isinstance(kinds.get(name), (Table, Memory))]
            call = f"check_law({part.name!r}, {law!r}, {time}, {len(targets)}, lambda: {call}, ({', '.join(given)}{',' if given else ''}))"
        if not targets:
            return [call]
        return [f"{', '.join(targets)} = {call}"]

    def _body(self, function: Callable[..., Any], part: Part, law: str, values: dict[str, str], targets: list[str]) -> list[str] | None:
        """Return the body of a longer law of a stage, where it is the only one of its kind that the stage calls."""
        if self.alone[function] > 1:
            return None
        lines = self.laws.body_in_place(function, values, targets, f"{part.name}__{law}__")
        return lines if lines is not None and len(lines) <= _LONGEST_BODY else None

    # ---- pieces ---------------------------------------------------------------------------------------------------------------

    def _unpack(self, discrete: bool = True) -> list[str]:
        lines = _taken("parameters", self.plan.parameters) + _taken("states", self.plan.states) + _taken("discrete", self.plan.discrete)
        lines += [f"{_flat(name)} = vector(memories, {position})" for name, position in self.plan.memories.items()]
        lines += [f"{_flat(name)} = matrix(tables, {position})" for name, position in self.plan.tables.items()]
        for part in self.plan.parts.values():
            if tests := [f"{part.name}__{name} == {_number(value)}" for name, value in self._idle(part).items()]:
                lines.append(f"{part.name}__idle = {' and '.join(tests)}")
        lines += [f"{part.name}__sample_period = period * {part.every}.0" for part in self.plan.parts.values() if part.name in self.slow]
        return lines

    def _outputs(self, name: str, law: str, staged: bool, time: str) -> list[str]:
        part = self.plan.parts[name]
        suffix = "__stage" if staged else ""
        return self._assign([_flat(f"{name}.{item}") + suffix for item in part.component.output_laws()[law]], part, law, staged, time)

    def _sample_instant(self) -> list[str]:
        lines: list[str] = []
        for name, law in self.plan.order:
            part = self.plan.parts[name]
            if law != "update":
                lines += self._outputs(name, law, False, "time")
                continue
            targets = [_flat(f"{name}.{item}") for item in part.component.declared(DiscreteState)]
            update = self._assign(targets, part, "update", False, "time")
            if part.every > 1:
                lines.append(f"if (first + sample) % {part.every} == 0:")
                lines += [f"    {line}" for line in update]
            else:
                lines += update
        return lines

    def _step(self) -> tuple[list[str], list[str]]:
        """Return what the steps of a sample have in common, and one step."""
        moving = [part for part in self.plan.parts.values() if "derivative" in part.component.laws]
        if not moving:
            return [], []
        time = "stage_time" if self._uses_time_in_stage() else "time"
        variables = [_flat(name) for name in self.plan.states]
        laws: list[str] = []
        for name, law in self.plan.stage:
            laws += self._outputs(name, law, True, time)
        for part in moving:
            targets = [_flat(f"{part.name}.{name}") + "__rate" for name in part.component.declared(State)]
            laws += self._assign(targets, part, "derivative", True, time)
        self.same = {}
        rates = _rates(laws, variables)
        sums = [f"{variable}__sum = {variable}__sum + weight * {rates[variable]}" for variable in variables]
        first = [variable for variable in variables if rates[variable] != f"{variable}__rate"]
        stages = [f"{variable}__stage = {variable} + reach * {rates[variable]}" for variable in dict.fromkeys([*first, *variables])]
        body = [*laws, *sums, *stages, *(["stage_time = moment + reach"] if time == "stage_time" else [])]
        after = [f"{variable} = {variable} + share * {variable}__sum" for variable in variables]
        held: list[str] = []
        if not self.checked:
            read_after = [f"{variable}__sum" for variable in variables]
            varying = ["weight", "reach", "stage_time", "moment", *variables]
            held, body = shortened(body, read_after, varying, [_flat(name) for name in self.plan.parameters])
        read = "\n".join(body)
        before = ["moment = time + substep * step"] if "moment" in read else []
        before += [f"{variable}__stage = {variable}" for variable in variables if f"{variable}__stage" in read]
        before += [f"{variable}__sum = -0.0" for variable in variables]
        before += ["stage_time = moment"] if "moment" in read else []
        return held, [*before, "for weight, reach in stages:", *[f"    {line}" for line in body], *after]

    def _uses_time_in_stage(self) -> bool:
        return self.checked or any("time" in part.component.arguments[law] for part, law in self.stage_laws)

    # ---- functions ------------------------------------------------------------------------------------------------------------

    def module(self) -> str:
        head = [_HEAD, "import math", "from operator import getitem as matrix", "from operator import getitem as vector"]
        head += ["from struct import pack_into", "", _ACCESS]
        functions = ["", *self._rates_function(), "", *self._run_function(), ""]
        return "\n".join([*head, *self.laws.blocks, *functions])

    def _rates_function(self) -> list[str]:
        lines = ["def rates(time, period, step, parameters, states, discrete, memories, tables, result):"]
        body = self._unpack()
        for name, law in self.plan.order:
            if law != "update":
                body += self._outputs(name, law, False, "time")
        for part in self.plan.parts.values():
            if "derivative" in part.component.laws:
                names = [f"{part.name}.{name}" for name in part.component.declared(State)]
                body += self._assign([_flat(name) + "__rate" for name in names], part, "derivative", False, "time")
                body += [f"result[{self.plan.states[name]}] = {_flat(name)}__rate" for name in names]
        return [*lines, *[f"    {line}" for line in body], "    return 0"]

    def _run_function(self) -> list[str]:
        plan = self.plan
        lines = ["def run_block(first, count, period, step, steps, parameters, states, discrete, memories, tables, noise, record):"]
        setup = self._unpack()
        setup += [f"{_flat(name)}__noise = vector(noise, {position})" for name, position in plan.noises.items()]
        setup += [*plan.tableau.lines(), "finished = False", "done = 0"]
        body = ["time = (first + sample) * period", *self._sample_instant()]
        body += [f"{_flat(name)}__previous = {_flat(plan.feeds[name][1])}" for name in plan.previous if plan.feeds[name][0] == "output"]
        body += [f"row = sample * {len(plan.channels)}", *_put("record", plan.channels, "row + ", "keep")]
        body += ["done = sample + 1"]
        if plan.assembly.finish:
            body += [f"if {_flat(plan.assembly.finish)} > 0.5:", "    finished = True", "    break"]
        held, step = self._step()
        if step:
            body += [*held, "for substep in range(steps):"]
            body += [f"    {line}" for line in step]
        body, groups = grouped(body)
        inside = [*setup, *groups, "for sample in range(count):", *[f"    {line}" for line in body]]
        inside += [*_put("states", plan.states), *_put("discrete", plan.discrete), "return -done if finished else done"]
        return [*lines, *[f"    {line}" for line in inside]]


def _rates(laws: list[str], variables: list[str]) -> dict[str, str]:
    """Return the variable that holds the rate of each state: its own, or the stage of another whose rate is its own."""
    only = dict(line.split(" = ") for line in laws if line.count(" = ") == 1)
    rates = {variable: f"{variable}__rate" for variable in variables}
    for variable in variables:
        other = only.get(rates[variable], "").removesuffix("__stage")
        if other != variable and rates.get(other) == f"{other}__rate":
            rates[variable] = f"{other}__stage"
    return rates


def _taken(array: str, names: Iterable[str]) -> list[str]:
    """Return the lines that read an array into variables."""
    lines = []
    for first, some in _portions(names):
        lines += ["(", *[f"    {name}," for name in some], f") = take({array}, {first}, {len(some)})"]
    return lines


def _put(array: str, names: Iterable[str], begin: str = "", put: str = "put") -> list[str]:
    """Return the lines that write variables to an array, from the place ``begin`` on."""
    lines = []
    for first, some in _portions(names):
        lines += [f"{put}({array}, {begin}{first}, (", *[f"    {name}," for name in some], "))"]
    return lines


def _portions(names: Iterable[str]) -> list[tuple[int, list[str]]]:
    """Return the variables in portions with the place of the first: one access a number is slow to compile, one for all slower still."""
    variables = [_flat(name) for name in names]
    return [(first, variables[first : first + _PORTION]) for first in range(0, len(variables), _PORTION)]


def _number(value: float) -> str:
    return repr(float(value)) if math.isfinite(value) else f"{'-' if value < 0.0 else ''}math.inf"


def _flat(name: str) -> str:
    if name.endswith("@previous"):
        return _flat(name.removesuffix("@previous")) + "__previous"
    part, _, item = name.partition(".")
    return f"{part}__{item}"
