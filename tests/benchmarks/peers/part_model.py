"""One machine part as a block of a block-diagram simulator: its laws, bound to what a block is given (inputs, states, time)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from lathesim.component import DiscreteState, Memory, Noise, Output, State, Table
from lathesim.engine.assembly import Part
from lathesim.engine.wiring import Plan

Law = Callable[[Sequence[float], Sequence[float], float], Any]
"""Takes the inputs and the continuous states of a block and the time [s]."""


class PartModel:
    """A part of a plan, as a block diagram sees it.

    ``sources`` are the outputs (``part.output``) that feed its inputs, ``outputs`` its own, ``start`` the continuous states at the start.
    The discrete states live here: ``sample`` gives them their next values.
    """

    def __init__(self, plan: Plan, part: Part, work: Any) -> None:
        component = part.component
        self.name = part.name
        self.period = work.period
        self.step = work.step
        self.outputs = [f"{part.name}.{name}" for name in component.declared(Output)]
        self.sources: list[str] = []
        self.start = [plan.values[f"{part.name}.{name}"] for name in component.declared(State)]
        names = list(component.declared(DiscreteState))
        self.discrete = [plan.values[f"{part.name}.{name}"] for name in names]
        self.instant = 0
        self._plan, self._part, self._work = plan, part, work
        self._stores: dict[str, list[Any]] = {}
        self.derivative = self._bound("derivative") if "derivative" in component.laws else None
        self._update = self._bound("update") if "update" in component.laws else None
        self._output_laws = [(self._bound(law), names) for law, names in component.output_laws().items()]
        used = {name for output in component.declared(Output) for name in component.taken_for(output)}
        self.passes_through = any(self._feeding(name) is not None for name in used)
        self.is_sampled = self._update is not None

    def sample(self, inputs: Sequence[float], states: Sequence[float], time: float) -> None:
        """Take one sample: the discrete states get their next values."""
        assert self._update is not None
        found = self._update(inputs, states, time)
        if self.discrete:
            self.discrete[:] = found if isinstance(found, tuple) else (found,)
        self.instant += 1

    def give(self, inputs: Sequence[float], states: Sequence[float], time: float) -> list[float]:
        """Return all outputs, in the order of declaration."""
        found: dict[str, float] = {}
        for law, names in self._output_laws:
            values = law(inputs, states, time)
            found.update(zip(names, values if isinstance(values, tuple) else (values,), strict=True))
        return [found[name.partition(".")[2]] for name in self.outputs]

    def _feeding(self, name: str) -> str | None:
        kind, source = self._plan.feeds.get(f"{self.name}.{name}", ("", ""))
        return source if kind == "output" else None

    def _bound(self, law: str) -> Law:
        component, work = self._part.component, self._work
        function = component.laws[law]
        states, discretes = list(component.declared(State)), list(component.declared(DiscreteState))
        given: list[Any] = []
        from_inputs, from_states, from_discrete, from_noise, from_time = [], [], [], [], []
        from_outputs: list[tuple[int, Law, int]] = []
        for place, name in enumerate(component.arguments[law]):
            item, full, value = component.declarations.get(name), f"{self.name}.{name}", 0.0
            source = self._feeding(name)
            if source is not None:
                if source not in self.sources:
                    self.sources.append(source)
                from_inputs.append((place, self.sources.index(source)))
            elif type(item) is State:
                from_states.append((place, states.index(name)))
            elif type(item) is DiscreteState:
                from_discrete.append((place, discretes.index(name)))
            elif isinstance(item, Noise):
                from_noise.append((place, work.noise[full].tolist()))
            elif isinstance(item, (Memory, Table)):
                value = self._stores.setdefault(name, self._store(name, item))
            elif isinstance(item, Output):
                giver = component.law_of(name)
                from_outputs.append((place, self._bound(giver), component.output_laws()[giver].index(name)))
            elif name == "time":
                from_time.append(place)
            elif name in ("sample_period", "step"):
                value = self.period if name == "sample_period" else self.step
            else:
                value = float(work.parameters[self._plan.feeds.get(full, ("", full))[1]])
            given.append(value)

        def bound(inputs: Sequence[float], own: Sequence[float], time: float) -> Any:
            arguments = given.copy()
            for place, position in from_inputs:
                arguments[place] = inputs[position]
            for place, position in from_states:
                arguments[place] = own[position]
            for place, position in from_discrete:
                arguments[place] = self.discrete[position]
            for place, numbers in from_noise:
                arguments[place] = numbers[self.instant]
            for place in from_time:
                arguments[place] = time
            for place, answer, position in from_outputs:
                found = answer(inputs, own, time)
                arguments[place] = found[position] if isinstance(found, tuple) else found
            return function(*arguments)

        return bound

    def _store(self, name: str, item: Memory | Table) -> list[Any]:
        if isinstance(item, Table):
            return [list(row) for row in self._part.tables[name].tolist()]
        return [item.start] * int(self._part.memory_lengths.get(name, item.length))


def part_models(work: Any) -> list[PartModel]:
    """Return every part, in the order in which they act at a sample instant."""
    plan = work.plan
    order = dict.fromkeys(name for name, law in plan.laws.instant if law == "update")
    order |= dict.fromkeys(plan.parts)
    return [PartModel(plan, plan.parts[name], work) for name in order]
