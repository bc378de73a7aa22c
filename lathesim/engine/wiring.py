"""``wire``: parts and wires to a plan, in which every law knows where each of its arguments comes from and when it is called.

Refused here, by name: unknown parts and names, inputs that nothing feeds, units that differ, values out of bounds, and loops of outputs
with no state in them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

from lathesim.component import BUILT_IN_ARGUMENTS, Declaration, DiscreteState, Input, Memory, Noise, Output, Parameter, State, Table
from lathesim.engine.assembly import Assembly, FloatArray, Part, Place, Wire
from lathesim.engine.rk4 import RK4, Tableau
from lathesim.errors import WiringError, nearest
from lathesim.record import Channel
from lathesim.units import same_dimension

Node = tuple[str, str]
"""A law of a part: ``(part name, "output" | "output_<name>" | "update" | "derivative")``."""


@dataclass(frozen=True)
class LawOrder:
    """The laws of a machine in the order in which they are called.

    ``instant`` are the output and update laws at a sample instant, ``stage`` the outputs that every stage of a step needs, ``varying``
    those whose values move between two instants. ``previous`` are the inputs of which an update takes the value of the instant before.
    """

    instant: tuple[Node, ...]
    stage: tuple[Node, ...]
    varying: frozenset[Node]
    previous: tuple[str, ...]


@dataclass(frozen=True)
class ArrayPlaces:
    """The position of each ``part.name`` in the memories, the tables and the noises that a run is given."""

    memories: dict[str, int]
    tables: dict[str, int]
    noises: dict[str, int]


@dataclass(frozen=True)
class Plan:
    """A machine ready to be fused and run.

    ``parameters``, ``states`` and ``discrete`` give the position of each ``part.name`` in the arrays of numbers that a run is given,
    ``values`` what they hold at the start: a run may override it. ``feeds`` says for each input or replaced parameter what feeds it:
    ``("output", name)``, ``("parameter", name)``. ``tableau`` is the integrator between two instants. ``kept`` holds results made from the
    plan for later use (its fused module).
    """

    assembly: Assembly
    parts: dict[str, Part]
    feeds: dict[str, tuple[str, str]]
    laws: LawOrder
    parameters: dict[str, int]
    states: dict[str, int]
    discrete: dict[str, int]
    values: dict[str, float]
    arrays: ArrayPlaces
    channels: tuple[str, ...]
    tableau: Tableau = RK4
    kept: dict[str, object] = field(default_factory=dict, compare=False, repr=False)

    def declaration(self, name: str) -> Declaration:
        """Return how the component of a part declares ``part.name``."""
        part, item = Place.of(name)
        return self.parts[part].component.declarations[item]

    def unit(self, name: str) -> str:
        """Return the unit of ``part.name``."""
        return self.declaration(name).unit

    def doc(self, name: str) -> str:
        """Return the sentence about ``part.name``."""
        return self.declaration(name).doc

    def channel(self, name: str, values: FloatArray) -> Channel:
        """Return the channel of a record that an output ``part.name`` gives, with its values [SI] (samples,) and its roles."""
        part, item = Place.of(name)
        component = self.parts[part].component
        declared = component.declarations[item]
        return Channel(name, declared.unit, values, declared.doc, tuple([role for role, port in component.ports.items() if port == item]))

    def moves_between_samples(self, output: str) -> bool:
        """Return whether an output (``part.name``) changes between two sample instants, rather than being held."""
        return giving(self.parts, output) in self.laws.varying

    def given(self, name: str) -> float:
        """Return the value [SI] of a name that a run may override; raises as :meth:`settable`."""
        self.settable(name)
        return self.values[name]

    def settable(self, name: str) -> tuple[str, int]:
        """Return the array (``parameter``, ``state`` or ``discrete``) and position of a name that a run may override."""
        for kind, positions in (("parameter", self.parameters), ("state", self.states), ("discrete", self.discrete)):
            if name in positions:
                return kind, positions[name]
        names = [*self.parameters, *self.states, *self.discrete]
        raise WiringError(f"nothing that can be set is called '{name}'.", remedy=nearest(name, names))


def wire(assembly: Assembly, tableau: Tableau = RK4) -> Plan:
    """Return the plan of an assembly that steps with a tableau. Raises :class:`WiringError` with the name of the fault."""
    parts = _named_parts(assembly.parts)
    feeds, constants = _feeds(parts, assembly.wires)
    _check_steps(assembly)
    parameters, states, discrete = _parameters(parts, constants), _starts(parts, State), _starts(parts, DiscreteState)
    previous = tuple(
        f"{part.name}.{name}"
        for part in parts.values()
        for name, item in part.component.declared(Input).items()
        if item.previous and name in part.component.arguments.get("update", ())
    )
    for name in previous:
        part, item = Place.of(name)
        default = parts[part].component.declared(Input)[item].default
        discrete[f"{name}@previous"] = constants.get(feeds[name][1], default or 0.0)
    order = _order(parts, feeds)
    varying = _varying(parts, feeds, order)
    return Plan(
        assembly=assembly,
        parts=parts,
        feeds=feeds,
        laws=LawOrder(order, _stage(parts, feeds, order, varying), varying, previous),
        parameters=_numbered(parameters),
        states=_numbered(states),
        discrete=_numbered(discrete),
        values={**parameters, **states, **discrete},
        arrays=ArrayPlaces(*(_numbered(_declared(parts, kind)) for kind in (Memory, Table, Noise))),
        channels=_channels(parts, assembly),
        tableau=tableau,
    )


def _named_parts(given: Iterable[Part]) -> dict[str, Part]:
    parts: dict[str, Part] = {}
    for part in given:
        if not part.name.isidentifier() or "__" in part.name:
            raise WiringError(f"'{part.name}' cannot name a part.", remedy="Use letters, digits and single underscores, no digit first.")
        if part.name in parts:
            raise WiringError(f"two parts are called '{part.name}'.", remedy="Rename one of them.")
        if part.every < 1:
            raise WiringError(f"{part.name} is sampled every {part.every} samples.", remedy="Use 1 or more.")
        opened = part.component.placeholders()
        if opened:
            raise WiringError(
                f"{part.name} ({part.component.__name__}) has no unit for its {', '.join(sorted(opened))}.",
                remedy="Say which unit passes through it.",
            )
        _check_values(part)
        parts[part.name] = part
    return parts


def _check_values(part: Part) -> None:
    names = part.component.declarations
    for group, kinds, word in (
        (part.parameters, (Parameter,), "parameter"),
        (part.start, (State,), "state"),
        (part.tables, (Table,), "table"),
    ):
        for name, value in group.items():
            item = names.get(name)
            if not isinstance(item, kinds):
                known = [key for key, other in names.items() if isinstance(other, kinds)]
                raise WiringError(
                    f"{part.name} has no {word} '{name}'.", remedy=nearest(name, known) or f"It has {', '.join(known) or 'none'}."
                )
            if isinstance(item, Parameter) and not item.low <= float(value) <= item.high:
                raise WiringError(
                    f"{part.name}.{name} is {value:g} {item.unit}, outside {item.low:g} to {item.high:g}.", remedy="Choose a value inside."
                )
    for name in part.component.declared(Table):
        if name not in part.tables:
            raise WiringError(f"{part.name}.{name} is a table and none is given.", remedy="A lesson's program or recording gives it.")


def _feeds(parts: dict[str, Part], wires: Iterable[Wire]) -> tuple[dict[str, tuple[str, str]], dict[str, float]]:
    feeds: dict[str, tuple[str, str]] = {}
    constants: dict[str, float] = {}
    for item in wires:
        target = _find(parts, item.target, (Input, Parameter), f"wire {item.target} <- {item.source or item.constant}")
        if item.target in feeds:
            raise WiringError(f"two wires feed {item.target}.", remedy="Take one of them away.")
        if not item.source:
            feeds[item.target] = ("parameter", item.target)
            constants[item.target] = item.constant
            continue
        place = f"wire {item.target} <- {item.source}"
        source = _find(parts, item.source, (Output, Parameter), place)
        if not same_dimension(target.unit, source.unit):
            raise WiringError(f"units differ, {target.unit} against {source.unit}.", place=place)
        feeds[item.target] = ("output" if isinstance(source, Output) else "parameter", item.source)
    for part in parts.values():
        for name, declared in part.component.declared(Input).items():
            full = f"{part.name}.{name}"
            if full in feeds:
                continue
            if declared.default is None:
                raise WiringError(f"nothing feeds {full} ({declared.doc}).", remedy=f"Add a wire, or a constant in {declared.unit}.")
            feeds[full] = ("parameter", full)
            constants[full] = float(declared.default)
    return feeds, constants


def _find(parts: dict[str, Part], name: str, kinds: tuple[type, ...], place: str) -> Input | Output | Parameter:
    part, item = Place.of(name)
    if part not in parts:
        raise WiringError(f"there is no part '{part}'.", place=place, remedy=nearest(part, parts))
    found = parts[part].component.declarations.get(item)
    if isinstance(found, kinds):
        return found  # type: ignore[return-value]
    known = [key for key, other in parts[part].component.declarations.items() if isinstance(other, kinds)]
    word = "input" if Input in kinds else "output"
    raise WiringError(
        f"{part} has no {word} '{item}'.", place=place, remedy=nearest(item, known) or f"It has {', '.join(known) or 'none'}."
    )


def _check_steps(assembly: Assembly) -> None:
    if not (assembly.sample_period > 0 and assembly.step > 0):
        raise WiringError(f"sample period {assembly.sample_period:g} s and step {assembly.step:g} s must both be above zero.")
    ratio, steps = assembly.sample_period / assembly.step, assembly.steps_per_sample
    if not math.isclose(ratio, steps, rel_tol=1e-9):
        raise WiringError(
            f"the sample period of {assembly.sample_period:g} s is {ratio:g} steps of {assembly.step:g} s.",
            remedy=f"Use a whole number of steps, for example {assembly.sample_period / steps:g} s.",
        )


def _parameters(parts: dict[str, Part], constants: dict[str, float]) -> dict[str, float]:
    values: dict[str, float] = {}
    for part in parts.values():
        for name, item in part.component.declarations.items():
            full = f"{part.name}.{name}"
            if isinstance(item, Parameter) or full in constants:
                default = item.default if isinstance(item, Parameter) else 0.0
                values[full] = float(constants.get(full, part.parameters.get(name, default)))
    return values


def _starts(parts: dict[str, Part], kind: type[State]) -> dict[str, float]:
    declared = [(part, name, item) for part in parts.values() for name, item in part.component.declared(kind).items()]
    return {f"{part.name}.{name}": float(part.start.get(name, item.start)) for part, name, item in declared}


def _declared(parts: dict[str, Part], kind: type[Declaration]) -> list[str]:
    return [f"{part.name}.{name}" for part in parts.values() for name in part.component.declared(kind)]


def _numbered(names: Iterable[str]) -> dict[str, int]:
    return {name: position for position, name in enumerate(names)}


def _channels(parts: dict[str, Part], assembly: Assembly) -> tuple[str, ...]:
    outputs = _declared(parts, Output)
    if assembly.finish and assembly.finish not in outputs:
        raise WiringError(f"the run shall end at '{assembly.finish}', which is no output.", remedy=nearest(assembly.finish, outputs))
    if assembly.record is None:
        return tuple(outputs)
    for name in assembly.record:
        if name not in outputs:
            raise WiringError(f"'{name}' cannot be recorded, it is no output.", remedy=nearest(name, outputs))
    return tuple(dict.fromkeys(assembly.record))


def giving(parts: dict[str, Part], output: str) -> Node:
    """Return the law that gives an output (``part.name``)."""
    part, name = Place.of(output)
    return part, parts[part].component.law_of(name)


def law_sources(part: Part, law: str, feeds: dict[str, tuple[str, str]]) -> list[str]:
    """Return the outputs ``part.name`` that a law reads in the same instant."""
    found = []
    for argument in part.component.arguments.get(law, ()):
        if argument in BUILT_IN_ARGUMENTS:
            continue
        item = part.component.declarations[argument]
        full = f"{part.name}.{argument}"
        delayed = isinstance(item, Input) and item.previous and law == "update"
        if isinstance(item, Output):
            found.append(full)
        elif full in feeds and feeds[full][0] == "output" and not delayed:
            found.append(feeds[full][1])
    return found


def _dependencies(parts: dict[str, Part], feeds: dict[str, tuple[str, str]]) -> dict[Node, list[Node]]:
    needs: dict[Node, list[Node]] = {}
    for part in parts.values():
        for law in ("update", *part.component.output_laws()):
            if law not in part.component.laws:
                continue
            node = (part.name, law)
            needs[node] = [giving(parts, source) for source in law_sources(part, law, feeds)]
            own = [part.component.declarations.get(argument) for argument in part.component.arguments[law]]
            if law != "update" and "update" in part.component.laws and any(isinstance(item, (DiscreteState, Memory)) for item in own):
                needs[node].append((part.name, "update"))
    return needs


def _order(parts: dict[str, Part], feeds: dict[str, tuple[str, str]]) -> tuple[Node, ...]:
    needs = _dependencies(parts, feeds)
    rank = {name: position for position, name in enumerate(parts)}
    done: list[Node] = []
    placed: set[Node] = set()
    waiting = sorted(needs, key=lambda node: (rank[node[0]], node[1] != "update", node[1]))
    while waiting:
        ready = [node for node in waiting if all(other in placed for other in needs[node])]
        if not ready:
            raise _loop_error(waiting, needs)
        for node in ready:
            done.append(node)
            placed.add(node)
        waiting = [node for node in waiting if node not in placed]
    return tuple(done)


def _loop_error(waiting: list[Node], needs: dict[Node, list[Node]]) -> WiringError:
    remaining = set(waiting)
    path = [waiting[0]]
    while True:
        following = next(node for node in needs[path[-1]] if node in remaining)
        if following in path:
            loop = [*path[path.index(following) :], following]
            break
        path.append(following)
    names = list(dict.fromkeys(node[0] for node in reversed(loop)))
    text = " -> ".join([*names, names[0]])
    if any(law == "update" for _, law in loop):
        return WiringError(
            f"Sampled parts wait for one another in a loop: {text}.",
            remedy="Let one of them answer with its value of the instant before: Input(..., previous=True).",
        )
    return WiringError(f"Outputs form a loop with no state in it: {text}.", remedy="Give one of them a state or a sample period.")


def _varying(parts: dict[str, Part], feeds: dict[str, tuple[str, str]], order: tuple[Node, ...]) -> frozenset[Node]:
    """Return the output laws whose values move between two sample instants."""
    varying: set[Node] = set()
    for name, law in order:
        part = parts[name]
        if law == "update" or part.component.outputs_are_held:
            continue
        states = part.component.declared(State)
        moves = any(argument in states or argument == "time" for argument in part.component.arguments[law])
        if moves or any(giving(parts, source) in varying for source in law_sources(part, law, feeds)):
            varying.add((name, law))
    return frozenset(varying)


def _stage(
    parts: dict[str, Part], feeds: dict[str, tuple[str, str]], order: tuple[Node, ...], varying: frozenset[Node]
) -> tuple[Node, ...]:
    """Return, in order, the output laws that every RK4 stage must evaluate anew."""
    needed: set[Node] = set()
    queue = [source for part in parts.values() for source in law_sources(part, "derivative", feeds)]
    while queue:
        node = giving(parts, queue.pop())
        if node in varying and node not in needed:
            needed.add(node)
            queue += law_sources(parts[node[0]], node[1], feeds)
    return tuple(node for node in order if node in needed)
