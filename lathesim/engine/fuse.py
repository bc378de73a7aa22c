"""``fuse``: a plan to one readable Python module, which runs plain or compiled, bit for bit the same.

The module holds the laws as they stand in their components and two functions of its own::

    run_block(first, count, period, step, steps, parameters, states, discrete, memories, tables, noise, record) -> (samples, finished)
    rates(time, sample_period, step, parameters, states, discrete, memories, tables, result)

``run_block`` advances ``count`` samples from sample ``first``: outputs and updates in wiring order, recording, then RK4 steps to the next
sample. ``states`` and ``discrete`` are read at the start and written back at the end. ``record[channel][sample]`` is filled. Parameters,
start values, tables and noise are arguments: changing them never makes new source.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

from lathesim.component import BUILT_IN_ARGUMENTS, DiscreteState, Input, Memory, Noise, State, Table
from lathesim.engine.assembly import Part
from lathesim.engine.law_source import LawLibrary
from lathesim.engine.wiring import Plan

_STAGE_POINTS = ((1, "0.0", ""), (2, "half", "half"), (3, "half", "half"), (4, "step", "step"))


@dataclass(frozen=True)
class FusedModule:
    """The source of a fused plan, its functions in the order they must be compiled, and the digest that names it in the cache."""

    source: str
    functions: tuple[str, ...]
    digest: str


def fuse(plan: Plan, *, checked: bool = False) -> FusedModule:
    """Write the module of a plan. With ``checked`` every law's result goes through ``check_law`` (used to find where a run broke)."""
    writer = _Writer(plan, checked)
    source = writer.module()
    digest = hashlib.sha256(source.encode()).hexdigest()[:32]
    return FusedModule(source, (*writer.library.functions, "rates", "run_block"), digest)


class _Writer:
    def __init__(self, plan: Plan, checked: bool) -> None:
        self.plan = plan
        self.checked = checked
        self.library = LawLibrary()
        self.laws = {
            (part.name, law): self.library.add(function, f"{part.component.__name__}_{law}")
            for part in plan.parts.values()
            for law, function in part.component.laws.items()
        }
        self.slow = {part.name for part in plan.parts.values() if part.every > 1}

    # ---- names ----------------------------------------------------------------------------------------------------------------

    def _variable(self, part: Part, name: str, law: str, stage: int, time: str) -> str:
        """Give the expression by which a law of ``part`` reads one of its arguments."""
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
            return _flat(source)
        if type(item) is State and stage:
            return _flat(full) + "__stage" if stage > 1 else _flat(full)
        if isinstance(item, Noise):
            return f"{_flat(full)}__noise[sample]"
        return _flat(full)

    def _call(self, part: Part, law: str, stage: int, time: str) -> tuple[str, list[str]]:
        arguments = [self._variable(part, name, law, stage, time) for name in part.component.arguments[law]]
        return f"{self.laws[part.name, law]}({', '.join(arguments)})", arguments

    def _assign(self, targets: list[str], part: Part, law: str, stage: int, time: str) -> list[str]:
        call, arguments = self._call(part, law, stage, time)
        if self.checked:
            names = part.component.arguments[law]
            kinds = part.component.declarations
            pairs = [
                f"({name!r}, {value})"
                for name, value in zip(names, arguments, strict=True)
                if not isinstance(kinds.get(name), (Table, Memory))
            ]
            call = f"check_law({part.name!r}, {law!r}, {time}, {len(targets)}, lambda: {call}, ({', '.join(pairs)}{',' if pairs else ''}))"
        if not targets:
            return [call]
        return [f"{', '.join(targets)} = {call}"]

    # ---- pieces ---------------------------------------------------------------------------------------------------------------

    def _unpack(self, discrete: bool = True) -> list[str]:
        lines = [f"{_flat(name)} = parameters[{position}]" for name, position in self.plan.parameters.items()]
        lines += [f"{_flat(name)} = states[{position}]" for name, position in self.plan.states.items()]
        lines += [f"{_flat(name)} = discrete[{position}]" for name, position in self.plan.discrete.items()]
        lines += [f"{_flat(name)} = memories[{position}]" for name, position in self.plan.memories.items()]
        lines += [f"{_flat(name)} = tables[{position}]" for name, position in self.plan.tables.items()]
        lines += [f"{part.name}__sample_period = period * {part.every}.0" for part in self.plan.parts.values() if part.name in self.slow]
        return lines

    def _outputs(self, name: str, law: str, stage: int, time: str) -> list[str]:
        part = self.plan.parts[name]
        return self._assign([_flat(f"{name}.{item}") for item in part.component.output_laws()[law]], part, law, stage, time)

    def _sample_instant(self) -> list[str]:
        lines: list[str] = []
        for name, law in self.plan.order:
            part = self.plan.parts[name]
            if law != "update":
                lines += self._outputs(name, law, 0, "time")
                continue
            targets = [_flat(f"{name}.{item}") for item in part.component.declared(DiscreteState)]
            update = self._assign(targets, part, "update", 0, "time")
            if part.every > 1:
                lines.append(f"if (first + sample) % {part.every} == 0:")
                lines += [f"    {line}" for line in update]
            else:
                lines += update
        return lines

    def _step(self) -> list[str]:
        moving = [part for part in self.plan.parts.values() if "derivative" in part.component.laws]
        lines: list[str] = []
        if not moving:
            return lines
        for stage, offset, factor in _STAGE_POINTS:
            time = "moment" if stage == 1 else f"moment + {offset}"
            if stage > 1:
                for part in moving:
                    for name in part.component.declared(State):
                        variable = _flat(f"{part.name}.{name}")
                        lines.append(f"{variable}__stage = {variable} + {factor} * {variable}__rate{stage - 1}")
            if stage > 1 and self._uses_time_in_stage():
                lines.append(f"stage_time = {time}")
                time = "stage_time"
            for name, law in self.plan.stage:
                lines += self._outputs(name, law, stage, time)
            for part in moving:
                targets = [_flat(f"{part.name}.{name}") + f"__rate{stage}" for name in part.component.declared(State)]
                lines += self._assign(targets, part, "derivative", stage, time)
        for part in moving:
            for name in part.component.declared(State):
                variable = _flat(f"{part.name}.{name}")
                rates = f"{variable}__rate1 + 2.0 * ({variable}__rate2 + {variable}__rate3) + {variable}__rate4"
                lines.append(f"{variable} = {variable} + sixth * ({rates})")
        return lines

    def _uses_time_in_stage(self) -> bool:
        laws = [(self.plan.parts[name], law) for name, law in self.plan.stage]
        laws += [(part, "derivative") for part in self.plan.parts.values() if "derivative" in part.component.laws]
        return self.checked or any("time" in part.component.arguments[law] for part, law in laws)

    # ---- functions ------------------------------------------------------------------------------------------------------------

    def module(self) -> str:
        head = ['"""A fused machine, written by lathesim; change the parts, not this file."""', "", "import math", ""]
        body = [*head, *self.library.blocks, "", *self._rates_function(), "", *self._run_function(), ""]
        return "\n".join(body)

    def _rates_function(self) -> list[str]:
        lines = ["def rates(time, period, step, parameters, states, discrete, memories, tables, result):"]
        body = self._unpack()
        for name, law in self.plan.order:
            if law != "update":
                body += self._outputs(name, law, 0, "time")
        for part in self.plan.parts.values():
            if "derivative" in part.component.laws:
                names = [f"{part.name}.{name}" for name in part.component.declared(State)]
                body += self._assign([_flat(name) + "__rate1" for name in names], part, "derivative", 0, "time")
                body += [f"result[{self.plan.states[name]}] = {_flat(name)}__rate1" for name in names]
        return [*lines, *[f"    {line}" for line in body], "    return 0"]

    def _run_function(self) -> list[str]:
        plan = self.plan
        lines = ["def run_block(first, count, period, step, steps, parameters, states, discrete, memories, tables, noise, record):"]
        setup = self._unpack()
        setup += [f"{_flat(name)}__noise = noise[{position}]" for name, position in plan.noises.items()]
        setup += [f"record_{position} = record[{position}]" for position in range(len(plan.channels))]
        setup += ["half = 0.5 * step", "sixth = step / 6.0", "finished = False", "done = 0"]
        lines += [f"    {line}" for line in setup]
        lines.append("    for sample in range(count):")
        body = ["time = (first + sample) * period", *self._sample_instant()]
        body += [f"{_flat(name)}__previous = {_flat(plan.feeds[name][1])}" for name in plan.previous if plan.feeds[name][0] == "output"]
        body += [f"record_{position}[sample] = {_flat(name)}" for position, name in enumerate(plan.channels)]
        body += ["done = sample + 1"]
        if plan.assembly.finish:
            body += [f"if {_flat(plan.assembly.finish)} > 0.5:", "    finished = True", "    break"]
        step = self._step()
        if step:
            uses_time = self._uses_time_in_stage()
            body.append("for substep in range(steps):")
            inner = (["moment = time + substep * step"] if uses_time else []) + step
            body += [f"    {line}" for line in inner]
        lines += [f"        {line}" for line in body]
        after = [f"states[{position}] = {_flat(name)}" for name, position in plan.states.items()]
        after += [f"discrete[{position}] = {_flat(name)}" for name, position in plan.discrete.items()]
        after += ["return done, finished"]
        return [*lines, *[f"    {line}" for line in after]]


def _flat(name: str) -> str:
    if name.endswith("@previous"):
        return _flat(name.removesuffix("@previous")) + "__previous"
    part, _, item = name.partition(".")
    return f"{part}__{item}"
