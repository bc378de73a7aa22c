"""Effects put on the wires of an assembly.

On an input or a parameter an effect sits between it and what feeds it; on an output, between it and all it feeds. Several on one place
act in the order in which they are inserted, but for frictions: these answer to the sum of all that pushes, so what is inserted after one
acts before it. An effect that is inserted at another one, by the name of that, is put before it. Where a spring is inserted, what is
inserted at the host later acts on the host's side of it; what is inserted at the spring acts behind it, as does what was there before.
What an effect senses of its host (velocity, position, applied force ...) it takes from the host itself, before any effect on that output.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from lathesim.component import Component, Declaration, Input, Output, Parameter
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import Assembly, Part, Place, Rewiring, Wire
from lathesim.errors import WiringError, nearest
from lathesim.lessons.sensor_sides import SeenBeyond, sensors_of

_PUSHED = "effort"
"""Role of the port where forces and frictions act."""
_CUTS, _OTHER_FORCES = "force", ("thrust_force", "feed_force")
"""Roles of the ports that give the main force of a cut and those that go with it."""
_FELT_BY_A_SENSOR = 3
"""Stage from which on an effect is no more of the cut itself."""


@dataclass(frozen=True)
class Machinery(Assembly):
    """An assembly that knows its effects: ``seen_as`` tells which output stands for a part's output once effects sit on it."""

    seen_as: Mapping[str, str] = field(default_factory=dict)


class GoesWithMain(Component):
    """What an effect on the main force of a cut does to a force that goes with it:  F_out = F_in (main force after) / (before)."""

    incoming = Input("N", doc="thrust or feed force")
    before = Input("N", doc="main force before the effect")
    after = Input("N", doc="main force with the effect")
    outgoing = Output("N", doc="the same with its share of the effect")

    @staticmethod
    def output(incoming: float, before: float, after: float) -> float:
        if before == after or before == 0.0:
            return incoming
        return incoming * (after / before)


class _Bench(Rewiring):
    """Parts and wires while effects are put in."""

    def __init__(self, assembly: Assembly) -> None:
        super().__init__(assembly)
        self.seen_as = dict(assembly.seen_as) if isinstance(assembly, Machinery) else {}

    def item(self, name: str) -> Declaration | None:
        part, item = Place.of(name)
        return self.parts[part].component.declarations.get(item) if part in self.parts else None

    def feeding(self, target: str, own: str) -> Wire:
        """Return the wire from what feeds ``target`` now to ``own``."""
        if target in self.wires:
            return replace(self.wires[target], target=own)
        declared = self.item(target)
        if isinstance(declared, Parameter):
            return Wire(own, target)
        if isinstance(declared, Input) and declared.default is not None:
            return Wire(own, constant=declared.default)
        raise WiringError(f"nothing feeds {target}.", remedy="Add a wire before an effect is put on it.")


def insert_effect(
    assembly: Assembly,
    effect: type[Component],
    at: str,
    *,
    name: str = "",
    parameters: Mapping[str, float] | None = None,
    sources: Mapping[str, str | float] | None = None,
    every: int = 1,
) -> Machinery:
    """Return the assembly with ``effect`` inserted at a part, before another inserted effect, or at ``part.name``.

    ``parameters`` are in SI; ``sources`` feeds inputs of the effect that its host does not (``part.name``, or a constant).
    Raises :class:`WiringError`.
    """
    if not issubclass(effect, Effect):
        raise WiringError(f"{effect.__name__} is a component and no effect.", remedy="Put it among the parts of a machine.")
    bench = _Bench(assembly)
    before, host = host_of(assembly, at)
    _refuse_other_side(effect, host)
    places = _places(bench, effect, at, host)
    name = name or effect_part_name(at, effect.__name__)
    if name in bench.parts:
        raise WiringError(f"two parts are called '{name}'.", remedy="Give the effect another name, with 'name: ...'.")
    ports = _ports(bench, host, places)
    sensed = _sensed(bench, effect, host, ports, name, dict(sources or {}))
    placed = effect.with_units(_units(bench, ports, places, sensed))
    values = dict(parameters or {})
    if effect.identification.held_flag:
        values.setdefault(effect.identification.held_flag, float(_is_held(bench, next(iter(places)))))
    bench.add(Part(name, placed, values, every=every))
    along = _goes_along(bench, effect, host, places)
    bench.wires |= {wire.target: wire for wire in sensed}
    for place, (taken, given) in places.items():
        _attach(bench, _on_its_side(bench, effect, place, before, name), f"{name}.{taken}", f"{name}.{given}")
        if taken == "incoming":
            # before whatever else the effect does to the other forces
            for force in along:
                _let_go_along(bench, force, name)
    if effect.beyond:
        _show_beyond(bench, effect, host, name)
    if effect.behind:
        _hold_what_comes_before(bench, name)
    known = {key: getattr(assembly, key) for key in ("sample_period", "step", "finish", "record")}
    return Machinery(tuple(bench.parts.values()), tuple(bench.wires.values()), **known, seen_as=bench.seen_as)


def _is_held(bench: _Bench, place: str) -> bool:
    """Return whether what a place carries is worked out of what is held between samples, and is no motion."""
    name, item = Place.of(place)
    while name in bench.parts:
        ports = bench.parts[name].component.ports
        if isinstance(bench.item(f"{name}.{item}"), Output):
            if issubclass(bench.parts[name].component, Effect):
                before = f"{name}.incoming"
            elif "measured" in ports:
                before = f"{name}.{ports['measured']}"
            else:
                return item not in (ports.get("flow"), ports.get("displacement"))
        else:
            before = f"{name}.{item}"
        name, item = Place.of(bench.wires[before].source if before in bench.wires else "")
    return False


def effect_part_name(at: str, effect: str) -> str:
    """Return ``x_axis_coulomb_friction`` for ``CoulombFriction`` at ``x_axis``: the part's name where the lesson gives none."""
    snake_case = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", effect).lower()
    return f"{at.replace('.', '_')}_{snake_case}"


def host_of(assembly: Assembly, at: str) -> tuple[str, Part]:
    """Return the inserted effect before which another one is put, empty where ``at`` names none, and the part on which both sit."""
    parts, (before, name) = assembly.by_name, ("", Place.of(at).part)
    # a port that is named is a place of its own, also of an effect
    while not Place.of(at).port and name in parts and issubclass(parts[name].component, Effect):
        before = before or name
        name = Place.of(next((wire.target for wire in assembly.wires if wire.source == f"{name}.outgoing"), "")).part
    if name not in parts:
        raise WiringError(f"there is no part '{name or at}'.", remedy=nearest(name or at, parts))
    return before, parts[name]


def _places(bench: _Bench, effect: type[Effect], at: str, host: Part) -> dict[str, tuple[str, str]]:
    """Return ``part.name`` -> (input, output) of the effect for every place it sits on."""
    places: dict[str, tuple[str, str]] = {}
    for role, pair in effect.pairs().items():
        if role == effect.site and "." in at:
            place = at
        elif role in host.component.ports:
            place = f"{host.name}.{host.component.ports[role]}"
        else:
            having = [part.name for part in bench.parts.values() if role in part.component.ports]
            remedy = f"Here {', '.join(having)} {'has' if len(having) == 1 else 'have'} one. " if having else ""
            remedy += f"{'Or name' if having else 'Name'} the place, as in 'at: {host.name}.<input, parameter or output>'."
            raise WiringError(f"{host.name} ({host.component.__name__}) has no port '{role}', where {effect.__name__} sits.", remedy=remedy)
        if not isinstance(bench.item(place), (Input, Output, Parameter)):
            known = [key for key, other in host.component.declarations.items() if isinstance(other, (Input, Output, Parameter))]
            wrong = Place.of(place).port
            raise WiringError(
                f"{host.name} has no input, output or parameter '{wrong}'.", remedy=nearest(wrong, known) or f"It has {', '.join(known)}."
            )
        places[place] = pair
    return places


def _ports(bench: _Bench, host: Part, places: Mapping[str, tuple[str, str]]) -> dict[str, str]:
    """Return role -> ``part.name`` of what an effect can sense: the ports of its host, and of the part that feeds the place it sits on.

    A scale knows no driving force, but the table it measures does. Where one part of the machine turns, its angle and speed are those of
    the spindle for all others.
    """
    ports = {role: f"{host.name}.{item}" for role, item in host.component.ports.items()}
    ports = _of_the_spindle(bench) | ports
    place = next(place for place, pair in places.items() if pair[0] == "incoming")
    wire = bench.wires.get(place)
    while wire is not None and wire.source:
        feeding = bench.parts.get(Place.of(wire.source).part)
        if feeding is None:
            break
        if not issubclass(feeding.component, (Effect, SeenBeyond)):
            ports = {role: f"{feeding.name}.{item}" for role, item in feeding.component.ports.items()} | ports
            break
        wire = bench.wires.get(f"{feeding.name}.incoming")
    return ports


def _of_the_spindle(bench: _Bench) -> dict[str, str]:
    """Return angle and speed of the only part of the machine that is driven and turns; nothing where there is none, or more than one."""
    found = []
    for part in bench.parts.values():
        ports = part.component.ports
        if {"effort", "flow", "displacement"} <= set(ports) and part.component.declarations[ports["displacement"]].unit == "rad":
            found.append({"angle": f"{part.name}.{ports['displacement']}", "spindle_speed": f"{part.name}.{ports['flow']}"})
    return found[0] if len(found) == 1 else {}


def _sensed(
    bench: _Bench, effect: type[Effect], host: Part, ports: Mapping[str, str], name: str, sources: dict[str, str | float]
) -> list[Wire]:
    """Return the wires to the inputs of the effect that sit on no place."""
    sitting = {taken for taken, _ in effect.pairs().values()}
    if _is_friction(effect) and "pushing" in ports and "pushing" not in effect.declared(Input):
        # a body that gravity pulls rests where its friction holds drive and weight
        ports = {**ports, "applied": ports["pushing"]}
    wires = []
    for item, declared in effect.declared(Input).items():
        own = f"{name}.{item}"
        if item in sources:
            source = sources[item]
            wires.append(Wire(own, source) if isinstance(source, str) else Wire(own, constant=source))
        elif item in sitting:
            continue
        elif item in ports:
            wires.append(bench.feeding(ports[item], own) if isinstance(bench.item(ports[item]), Input) else Wire(own, ports[item]))
        elif declared.default is None:
            remedy = f"Say what it senses, as in '{item}: part.output'."
            raise WiringError(f"{host.name} has no port '{item}', which {effect.__name__} needs ({declared.doc}).", remedy=remedy)
    return wires


def _units(bench: _Bench, ports: Mapping[str, str], places: Mapping[str, tuple[str, str]], sensed: list[Wire]) -> dict[str, str]:
    units: dict[str, str] = {}
    for role, port in ports.items():
        declared = bench.item(port)
        if declared is not None:
            units[role] = declared.unit
    for wire in sensed:
        declared = bench.item(wire.source) if wire.source else None
        if declared is not None:
            units[Place.of(wire.target).port] = declared.unit
    for place, pair in places.items():
        if pair[0] == "incoming":
            declared = bench.item(place)
            units["signal"] = declared.unit if declared is not None else "1"
    return units


def _on_its_side(bench: _Bench, effect: type[Effect], place: str, before: str, name: str) -> str:
    """Return where on the way to a place effect ``name`` is put: ``before`` another one, as behind a spring, else on the host's side of the
    spring there; before the frictions where it is none. A friction holds what is on its side."""
    if before:
        other = bench.parts[before].component
        if not (issubclass(other, Effect) and other.site == effect.site and "incoming" in other.declared(Input)):
            raise WiringError(
                f"{before} does not sit where {effect.__name__} does.", remedy=f"Name the part, as in 'at: {Place.of(place).part}'."
            )
        place = f"{before}.incoming"
        if other.behind:
            _hold_behind(bench, before, name)
    if effect.site != _PUSHED or effect.behind:
        return place
    if not before and (spring := _spring_before(bench, place)):
        place, of_spring = f"{spring}.motor_side", bench.parts[spring].component
        for sensed, output in of_spring.near_side.items() if issubclass(of_spring, Effect) else ():
            if sensed in effect.declared(Input):
                bench.feed(f"{spring}.{output}", f"{name}.{sensed}")
    while not _is_friction(effect) and (wire := bench.wires.get(place)) is not None and wire.source:
        feeding = bench.parts[Place.of(wire.source).part].component
        if not (issubclass(feeding, Effect) and _is_friction(feeding)):
            break
        place = f"{Place.of(wire.source).part}.incoming"
    return place


def _spring_before(bench: _Bench, place: str) -> str:
    """Return the inserted spring that is next on the way to a place, empty where there is none."""
    while (wire := bench.wires.get(place)) is not None and wire.source:
        feeding = bench.parts[Place.of(wire.source).part]
        if not issubclass(feeding.component, Effect):
            break
        if feeding.component.behind:
            return feeding.name
        place = f"{feeding.name}.incoming"
    return ""


def _is_friction(effect: type[Effect]) -> bool:
    return effect.site == _PUSHED and (effect.family == "reversal" or bool(effect.behind))


def _attach(bench: _Bench, place: str, taken: str, given: str) -> None:
    """Put the pair ``taken`` -> ``given`` of an effect on an input, parameter or output."""
    if not isinstance(bench.item(place), Output):
        bench.wires[taken] = bench.feeding(place, taken)
        bench.feed(given, place)
        return
    source = bench.seen_as.get(place, place)
    bench.feed(given, *(target for target in bench.fed_by(source) if not _senses(bench, target)))
    bench.feed(source, taken)
    bench.seen_as[place] = given


def _goes_along(bench: _Bench, effect: type[Effect], host: Part, places: Mapping[str, tuple[str, str]]) -> list[str]:
    """Return the forces that go with the main force of a cut that an effect sits on.

    Empty where the host works them out of what arrives of the main force.
    """
    ports = host.component.ports
    main = f"{host.name}.{ports.get(_CUTS, '')}"
    if main not in places or effect.stage >= _FELT_BY_A_SENSOR or not isinstance(bench.item(main), Output):
        return []
    if any(Place.of(target).part == host.name for target in bench.fed_by(bench.seen_as.get(main, main))):
        return []
    return [f"{host.name}.{ports[role]}" for role in _OTHER_FORCES if role in ports]


def _let_go_along(bench: _Bench, place: str, name: str) -> None:
    """Apply to a force its share of what effect ``name`` does to the main force."""
    share = f"{name}_{Place.of(place).port}"
    bench.add(Part(share, GoesWithMain))
    bench.pass_on(f"{name}.incoming", f"{share}.before")
    bench.feed(f"{name}.outgoing", f"{share}.after")
    _attach(bench, place, f"{share}.incoming", f"{share}.outgoing")


def _show_beyond(bench: _Bench, effect: type[Effect], host: Part, name: str) -> None:
    """Let the sensors of the host's motion that sit on the load side see what is beyond the effect too."""
    beyond = {"displacement": effect.beyond, "flow": effect.behind.get("flow", "")}
    for sensor in sensors_of(bench.parts, bench.wires, bench.seen_as, host.name):
        if sensor.side != "load" or not beyond[sensor.role]:
            continue
        adder = f"{name}_beyond_{sensor.name}"
        port = f"{host.name}.{host.component.ports[sensor.role]}"
        unit = host.component.declarations[host.component.ports[sensor.role]].unit
        bench.add(Part(adder, SeenBeyond.with_units({"signal": unit})))
        bench.feed(port, f"{adder}.incoming")
        bench.feed(f"{name}.{beyond[sensor.role]}", f"{adder}.beyond")
        bench.feed(f"{adder}.outgoing", sensor.head)


def beyond_its_spring(assembly: Assembly, name: str, host: str) -> dict[str, str]:
    """Return the only sensor of a host and how much it sees of an inserted spring (sensor -> ``part.parameter``), if nobody says it."""
    sensors = sensors_of(assembly.by_name, assembly.wired, getattr(assembly, "seen_as", {}), host)
    places = [one for one in sensors if one.role == "displacement"]
    seeing = {one.name: f"{name}_beyond_{one.name}" for one in places if len(places) == 1 and one.assumed}
    return {sensor: f"{adder}.share" for sensor, adder in seeing.items() if adder in assembly.by_name}


def _refuse_other_side(effect: type[Effect], host: Part) -> None:
    """Refuse an effect at a sensor that sits on the side of the spring from which it is not seen (:class:`WiringError`)."""
    if effect.seen_from and host.side and host.side != effect.seen_from:
        fact = f"{host.name} sits on the {host.side} side, where {effect.__name__} does not show."
        raise WiringError(fact, remedy=f"Put it at a sensor on the {effect.seen_from} side, or change 'side'.")


def _hold_what_comes_before(bench: _Bench, spring: str) -> None:
    """Let the frictions that come before a spring hold what is behind it."""
    before = Place.of(bench.wires[f"{spring}.incoming"].source).part
    while before in bench.parts and issubclass(bench.parts[before].component, Effect):
        _hold_behind(bench, spring, before)
        before = Place.of(bench.wires[f"{before}.incoming"].source).part


def _hold_behind(bench: _Bench, spring: str, friction: str) -> None:
    """Let a friction hold what is behind a spring, and answer to the speed there; behind a further spring that one drives and weighs it
    still. What is no friction senses none of it."""
    effect = bench.parts[spring].component
    if not (issubclass(effect, Effect) and set(effect.behind) <= set(bench.parts[friction].component.declared(Input))):
        return
    for sensed, output in effect.behind.items():
        target, given = f"{friction}.{sensed}", f"{spring}.{output}"
        further = bench.parts.get(Place.of(bench.wires[target].source).part)
        if sensed != "flow" and further is not None and issubclass(further.component, Effect) and further.component.behind:
            continue
        if sensed == "flow":
            adder = f"{spring}_behind_{friction}"
            bench.add(Part(adder, SeenBeyond.with_units({"signal": effect.declarations[output].unit})))
            bench.pass_on(target, f"{adder}.incoming")
            bench.feed(given, f"{adder}.beyond")
            given = f"{adder}.outgoing"
        bench.feed(given, target)


def _senses(bench: _Bench, target: str) -> bool:
    """Return whether ``target`` is an input with which an effect senses its host, rather than one it sits on."""
    part, item = Place.of(target)
    component = bench.parts[part].component
    if issubclass(component, GoesWithMain):
        return item != "incoming"
    return issubclass(component, Effect) and item not in {taken for taken, _ in component.pairs().values()}
