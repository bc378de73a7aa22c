"""``fuse``: a plan to one readable Python module, which runs as it stands and is compiled as it stands.

The module holds the laws as they stand in their components and two functions of its own::

    run_block(first, count, period, step, steps, parameters, states, discrete, memories, tables, noise, record) -> samples
    rates(time, sample_period, step, parameters, states, discrete, memories, tables, result)

``run_block`` advances ``count`` samples from sample ``first``: outputs and updates in wiring order, recording, then RK4 steps to the next
sample. It gives how many it advanced, negative when the machine's ``finish`` output rose in the last of them. ``states`` and ``discrete``
are read at the start and written back at the end. ``record`` is flat, sample after sample, so that the values of one instant lie side by
side. Parameters, start values, tables and noise are arguments: changing them never makes new source. ``vector`` and ``matrix`` take one
array out of many, ``take`` and ``put`` some of its numbers, ``keep`` those of a record.

The stages of the plan's tableau are one loop: a machine of many parts is then compiled in a quarter of the time, and runs as fast. Sums
begin with -0.0, to which adding any number gives that number.

``grouped``: what idles together is skipped together.

A part that may idle has a branch beside each of its laws (see :mod:`lathesim.engine.fuse`). A diagnosis puts dozens of them into
a machine, and nearly all of them idle in any one run. Branches that follow each other then have one before them that skips them all::

    if idle_0:                        if a__idle:
        a__outgoing = x                   a__outgoing = x
        b__outgoing = a__outgoing     else:
    else:                                 ...
        if a__idle: ...               if b__idle:
        if b__idle: ...                   ...
"""

from __future__ import annotations

import hashlib
import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import cast

from lathesim.component import BUILT_IN_ARGUMENTS, ON, DiscreteState, Input, Memory, Noise, Output, State, Table
from lathesim.engine.assembly import Part, Place
from lathesim.engine.law_text import LawLibrary, Piece
from lathesim.engine.wiring import Plan, giving, law_sources

_TEST = re.compile(r"( *)if (\w+__idle):")
_FEWEST = 2
_MOST = 6
"""Branches that are skipped together: with more of them it is rarer that all idle."""


def grouped(lines: list[str]) -> tuple[list[str], list[str]]:
    """Return a function's lines with its idle branches in groups, and the lines that define what they ask, ``idle_0 = a and b ...``."""
    made: list[str] = []
    names: dict[tuple[str, ...], str] = {}
    run: list[list[str]] = []
    depth = ""
    place = 0
    while place < len(lines):
        found = _TEST.fullmatch(lines[place])
        if found is None or found[1] != depth:
            made += _together(run, names, depth)
            run, depth = [], found[1] if found else ""
        if found is None:
            made.append(lines[place])
            place += 1
            continue
        end = place + 1
        while end < len(lines) and (_deeper(lines[end], depth) or lines[end].startswith((f"{depth}else:", f"{depth}elif "))):
            end += 1
        run.append(lines[place:end])
        place = end
    made += _together(run, names, depth)
    return made, [f"{name} = {' and '.join(parts)}" for parts, name in names.items()]


def _together(run: list[list[str]], names: dict[tuple[str, ...], str], depth: str) -> list[str]:
    made: list[str] = []
    for first in range(0, len(run), _MOST):
        branches = run[first : first + _MOST]
        parts = tuple(dict.fromkeys(branch[0].strip()[3:-1] for branch in branches))
        if len(branches) < _FEWEST:
            made += [line for branch in branches for line in branch]
            continue
        name = names.setdefault(parts, f"idle_{len(names)}")
        idle = [line for branch in branches for line in _first_body(branch, depth) if line.strip() != "pass"]
        made += [f"{depth}if {name}:", *(idle or [f"{depth}    pass"]), f"{depth}else:"]
        made += [f"    {line}" for branch in branches for line in branch]
    return made


def _first_body(branch: list[str], depth: str) -> list[str]:
    body = []
    for line in branch[1:]:
        if not _deeper(line, depth):
            break
        body.append(line)
    return body


def _deeper(line: str, depth: str) -> bool:
    return line.startswith(f"{depth}    ")


_PORTION = 32
_LONGEST_BODY, _SHORT_BODY = 40, 8
"""Lines of a law of a stage that may stand in place of its call, which spares plain Python the call: if once, and if at each."""
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
    """The source of a fused plan, its laws one by one (each after those it calls), and the digest that names it in the cache.

    ``foreign`` names the laws that call a library of their own: with one of them the module runs plain only.
    """

    source: str
    pieces: tuple[Piece, ...]
    digest: str
    foreign: tuple[str, ...] = ()


def fuse(plan: Plan, *, checked: bool = False) -> FusedModule:
    """Write the module of a plan. With ``checked`` every law's result goes through ``check_law`` (used to find where a run broke)."""
    key = "checked module" if checked else "module"
    if key not in plan.kept:
        writer = Writer(plan, checked)
        source = writer.module()
        digest = hashlib.sha256(source.encode()).hexdigest()[:32]
        plan.kept[key] = FusedModule(source, tuple(writer.laws.pieces.values()), digest, tuple(writer.laws.foreign))
    return cast(FusedModule, plan.kept[key])


def idle_values(plan: Plan, part: Part) -> dict[str, float]:
    """Return the values with which a part only passes on what it is given; empty where it has none, or where a wire feeds one."""
    values, _ = part.component.idle()
    return {} if any(f"{part.name}.{name}" in plan.feeds for name in values) else values


class Writer:
    """Writes the module of a plan. Of parts in ``idle`` it is known whether they idle."""

    def __init__(self, plan: Plan, checked: bool = False, idle: Mapping[str, bool] | None = None) -> None:
        self.plan = plan
        self.checked = checked
        self.known_idle = idle or {}
        self.laws = LawLibrary()
        self.slow = {part.name for part in plan.parts.values() if part.every > 1}
        self.stage_laws = [(plan.parts[name], law) for name, law in plan.laws.stage]
        self.stage_laws += [(part, "derivative") for part in plan.parts.values() if "derivative" in part.component.laws]
        self.staged = set(plan.laws.stage)
        self.read = {self._during_stage(source) for part, law in self.stage_laws for source in law_sources(part, law, plan.feeds)}
        """What a stage reads of what its laws give."""
        self.alone = Counter(part.component.laws[law] for part, law in self.stage_laws)

    # ---- names ----------------------------------------------------------------------------------------------------------------

    def _during_stage(self, output: str) -> str:
        """Return the variable of an output inside a stage: one of its own where it moves between samples, which is quicker to compile."""
        return flat_name(output) + ("__stage" if giving(self.plan.parts, output) in self.staged else "")

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
                return flat_name(full) + "__previous"
            return self._during_stage(source) if staged and kind == "output" else flat_name(source)
        if isinstance(item, Output) and staged:
            return self._during_stage(full)
        if type(item) is State and staged:
            return flat_name(full) + "__stage"
        if isinstance(item, Noise):
            return f"{flat_name(full)}__noise[sample]"
        return flat_name(full)

    def _idle(self, part: Part) -> dict[str, float]:
        return {} if self.checked else idle_values(self.plan, part)

    def _assign(self, targets: list[str], part: Part, law: str, staged: bool, time: str) -> list[str]:
        """Write a law. A part that may be idle has a branch beside it: many candidates cost little more than none."""
        if not self._idle(part) or self.known_idle.get(part.name) is False:
            return self._law(targets, part, law, staged, time)
        passed = part.component.idle()[1]
        if law in part.component.output_laws():
            names = [passed.get(item, "") for item in part.component.output_laws()[law]]
            if not all(name in part.component.arguments[law] for name in names):
                return self._law(targets, part, law, staged, time)
            values = [self._variable(part, name, law, staged, time) for name in names]
        else:
            values = ["0.0"] * len(targets) if law == "derivative" else targets
        idle = [f"{target} = {value}" for target, value in zip(targets, values, strict=True) if target != value] or ["pass"]
        if part.name in self.known_idle:
            return idle
        busy = self._law(targets, part, law, staged, time)
        return [f"if {part.name}__idle:", *[f"    {line}" for line in idle], "else:", *[f"    {line}" for line in busy]]

    def _law(self, targets: list[str], part: Part, law: str, staged: bool, time: str) -> list[str]:
        function = part.component.laws[law]
        values = {name: self._variable(part, name, law, staged, time) for name in part.component.arguments[law]}
        if staged and not self.checked:
            unread = set(targets) - self.read
            lines = self.laws.lines_in_place(function, list(values.values()), targets, f"{part.name}__{law}__")
            if lines is not None and len(lines) <= (_LONGEST_BODY if self.alone[function] == 1 else _SHORT_BODY):
                return [line for line in lines if law == "derivative" or line.partition(" = ")[0] not in unread]
        call = f"{self.laws.add(function, f'{part.component.__name__}_{law}')}({', '.join(values.values())})"
        if self.checked:
            kinds = part.component.declarations
            given = [f"({name!r}, {value})" for name, value in values.items() if not isinstance(kinds.get(name), (Table, Memory))]
            call = f"check_law({part.name!r}, {law!r}, {time}, {len(targets)}, lambda: {call}, ({', '.join(given)}{',' if given else ''}))"
        if not targets:
            return [call]
        return [f"{', '.join(targets)} = {call}"]

    # ---- pieces ---------------------------------------------------------------------------------------------------------------

    def _unpack(self) -> list[str]:
        lines = _taken("parameters", self.plan.parameters) + _taken("states", self.plan.states) + _taken("discrete", self.plan.discrete)
        lines += [f"{flat_name(name)} = vector(memories, {position})" for name, position in self.plan.arrays.memories.items()]
        lines += [f"{flat_name(name)} = matrix(tables, {position})" for name, position in self.plan.arrays.tables.items()]
        for part in self.plan.parts.values():
            if tests := [f"{part.name}__{name} == {_number(value)}" for name, value in self._idle(part).items()]:
                lines.append(f"{part.name}__idle = {' and '.join(tests)}")
        lines += [f"{part.name}__sample_period = period * {part.every}.0" for part in self.plan.parts.values() if part.name in self.slow]
        return lines

    def _outputs(self, name: str, law: str, staged: bool, time: str) -> list[str]:
        part = self.plan.parts[name]
        suffix = "__stage" if staged else ""
        return self._assign([flat_name(f"{name}.{item}") + suffix for item in part.component.output_laws()[law]], part, law, staged, time)

    def _sample_instant(self) -> list[str]:
        lines: list[str] = []
        for name, law in self.plan.laws.instant:
            part = self.plan.parts[name]
            if law != "update":
                lines += self._outputs(name, law, False, "time")
                continue
            targets = [flat_name(f"{name}.{item}") for item in part.component.declared(DiscreteState)]
            update = self._assign(targets, part, "update", False, "time")
            if part.every > 1:
                lines.append(f"if (first + sample) % {part.every} == 0:")
                lines += [f"    {line}" for line in update]
            else:
                lines += update
        return lines

    def _step(self) -> list[str]:
        """Return one step, empty where nothing moves."""
        moving = [part for part in self.plan.parts.values() if "derivative" in part.component.laws]
        if not moving:
            return []
        time = "stage_time" if self._uses_time_in_stage() else "time"
        variables = [flat_name(name) for name in self.plan.states]
        body: list[str] = []
        for name, law in self.plan.laws.stage:
            body += self._outputs(name, law, True, time)
        for part in moving:
            targets = [flat_name(f"{part.name}.{name}") + "__rate" for name in part.component.declared(State)]
            body += self._assign(targets, part, "derivative", True, time)
        body += [f"{variable}__sum = {variable}__sum + weight * {variable}__rate" for variable in variables]
        body += [f"{variable}__stage = {variable} + reach * {variable}__rate" for variable in variables]
        before = [f"{variable}__stage = {variable}" for variable in variables] + [f"{variable}__sum = -0.0" for variable in variables]
        if time == "stage_time":
            before += ["moment = time + substep * step", "stage_time = moment"]
            body += ["stage_time = moment + reach"]
        after = [f"{variable} = {variable} + share * {variable}__sum" for variable in variables]
        return [*before, "for weight, reach in stages:", *[f"    {line}" for line in body], *after]

    def _uses_time_in_stage(self) -> bool:
        return self.checked or any("time" in part.component.arguments[law] for part, law in self.stage_laws)

    # ---- functions ------------------------------------------------------------------------------------------------------------

    def module(self) -> str:
        """Return the whole text."""
        head = [_HEAD, "import math", "from operator import getitem as matrix", "from operator import getitem as vector"]
        head += ["from struct import pack_into", "", _ACCESS]
        functions = ["", *self._rates_function(), "", *self._run_function(), ""]
        return "\n".join([*head, *self.laws.blocks, *functions])

    def _rates_function(self) -> list[str]:
        lines = ["def rates(time, period, step, parameters, states, discrete, memories, tables, result):"]
        body = self._unpack()
        for name, law in self.plan.laws.instant:
            if law != "update":
                body += self._outputs(name, law, False, "time")
        for part in self.plan.parts.values():
            if "derivative" in part.component.laws:
                names = [f"{part.name}.{name}" for name in part.component.declared(State)]
                body += self._assign([flat_name(name) + "__rate" for name in names], part, "derivative", False, "time")
                body += [f"result[{self.plan.states[name]}] = {flat_name(name)}__rate" for name in names]
        return [*lines, *[f"    {line}" for line in body], "    return 0"]

    def sample(self) -> list[str]:
        """Return the lines of one sample."""
        plan = self.plan
        body = ["time = (first + sample) * period", *self._sample_instant()]
        kept = [(name, plan.feeds[name]) for name in plan.laws.previous]
        body += [f"{flat_name(name)}__previous = {flat_name(source)}" for name, (kind, source) in kept if kind == "output"]
        body += [f"row = sample * {len(plan.channels)}", *_put("record", plan.channels, "row + ", "keep")]
        body += ["done = sample + 1"]
        if plan.assembly.finish:
            body += [f"if {flat_name(plan.assembly.finish)} > {ON}:", "    finished = True", "    break"]
        if step := self._step():
            body += ["for substep in range(steps):", *[f"    {line}" for line in step]]
        return body

    def _run_function(self) -> list[str]:
        plan = self.plan
        lines = ["def run_block(first, count, period, step, steps, parameters, states, discrete, memories, tables, noise, record):"]
        setup = self._unpack()
        setup += [f"{flat_name(name)}__noise = vector(noise, {position})" for name, position in plan.arrays.noises.items()]
        setup += [*plan.tableau.lines(), "finished = False", "done = 0"]
        body = self.sample()
        body, groups = grouped(body)
        inside = [*setup, *groups, "for sample in range(count):", *[f"    {line}" for line in body]]
        inside += [*_put("states", plan.states), *_put("discrete", plan.discrete), "return -done if finished else done"]
        return [*lines, *[f"    {line}" for line in inside]]


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
    variables = [flat_name(name) for name in names]
    return [(first, variables[first : first + _PORTION]) for first in range(0, len(variables), _PORTION)]


def _number(value: float) -> str:
    return repr(float(value)) if math.isfinite(value) else f"{'-' if value < 0.0 else ''}math.inf"


def flat_name(name: str) -> str:
    """Return the variable of ``part.name`` in the text."""
    if name.endswith("@previous"):
        return flat_name(name.removesuffix("@previous")) + "__previous"
    part, item = Place.of(name)
    return f"{part}__{item}"
