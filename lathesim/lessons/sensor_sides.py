"""On which side of a spring the sensors of a part sit, motor or load: as the lesson says, else as is assumed, and then told.

Noise before the sensors is part of the loops that they close.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from lathesim.component import Component, DiscreteState, Input, Noise, Output, Parameter
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import Assembly, Part, Place, Rewiring, Wire, Wired

_OF_MOTION = ("m", "rad", "m/s", "rad/s")


class SeenBeyond(Component):
    """What is seen behind a spring: place or speed before it, and how far or how fast it gives,  y = x + share d."""

    incoming = Input("{signal}", doc="place or speed before the spring")
    beyond = Input("{signal}", doc="how far or how fast the spring gives")
    outgoing = Output("{signal}", doc="place or speed behind the spring")
    share = Parameter("1", 1.0, low=0.0, high=1.0, doc="of that what is seen: all on the load side, nothing on the motor side")

    @staticmethod
    def output(incoming: float, beyond: float, share: float) -> float:
        return incoming + share * beyond


class SeatedSensor(NamedTuple):
    """A sensor of a part's motion: the input at which its chain of effects begins, the port that it sees, and where it sits."""

    name: str
    head: str
    role: str
    side: str
    assumed: bool


def is_motion_sensor(component: type[Component]) -> bool:
    """Return whether a part measures a place or a speed, and commands nothing."""
    ports = component.ports
    if not {"measured", "reading"} <= set(ports) or "drive" in ports or issubclass(component, Effect):
        return False
    return component.declarations[ports["measured"]].unit in _OF_MOTION


def sensors_of(parts: Mapping[str, Part], wires: Mapping[str, Wire], seen_as: Mapping[str, str], host: str) -> list[SeatedSensor]:
    """Return the sensors of a part's place and speed, each with its side.

    What nobody says is assumed: a sensor of the place that closes no loop sits at the load, where none closes one the first of several at
    the motor, and all others at the motor. ``seen_as`` tells which output stands for a reading once effects sit on it.
    """
    ports = parts[host].component.ports
    seen = {f"{host}.{ports[role]}": role for role in ("displacement", "flow") if role in ports}
    fed = {wire.source for wire in wires.values()}
    found: list[tuple[Part, str, str, bool]] = []
    for part in parts.values():
        measured, reading = part.component.ports.get("measured"), part.component.ports.get("reading")
        if measured is None or reading is None:
            continue
        head = first_input(parts, wires, f"{part.name}.{measured}")
        if head in wires and (role := seen.get(wires[head].source)) is not None:
            output = f"{part.name}.{reading}"
            found.append((part, head, role, seen_as.get(output, output) in fed))
    places = [(part, closes) for part, _, role, closes in found if role == "displacement"]
    at_motor = {part.name for part, closes in places if closes and not part.side}
    if len(places) > 1 and not at_motor and all(part.side != "motor" for part, _ in places):
        at_motor = {part.name for part in [part for part, _ in places if not part.side][:1]}
    return [
        SeatedSensor(
            part.name,
            head,
            role,
            part.side or ("load" if role == "displacement" and part.name not in at_motor else "motor"),
            not part.side and is_motion_sensor(part.component),
        )
        for part, head, role, _ in found
    ]


def assumed_sides(assembly: Assembly, host: str, found: Mapping[str, str] | None = None) -> str:
    """Return a sentence about the sensors of a part whose side of its spring nobody says; empty where there is none.

    A diagnosis has ``found`` the sides of some (sensor -> side).
    """
    every = [one for one in sensors_of(assembly.by_name, assembly.wired, getattr(assembly, "seen_as", {}), host) if one.assumed]
    told = [f"The recordings show {sensor.name} on the {found[sensor.name]} side." for sensor in every if found and sensor.name in found]
    assumed = [sensor for sensor in every if not found or sensor.name not in found]
    if not assumed:
        return " ".join(told)
    sit = ", ".join(f"{sensor.name} on the {sensor.side} side" for sensor in assumed)
    written = ", ".join(f"{sensor.name}: {sensor.side}" for sensor in assumed)
    told += [f"Assumed at the spring of {host}: {sit}. Confirm with 'side: {{{written}}}' in the lesson, or write the other side."]
    return " ".join(told)


def first_input(parts: Mapping[str, Part], wires: Mapping[str, Wire], target: str) -> str:
    """Return the input at which the chain of effects that ends at ``target`` begins: what feeds that one comes before all of them."""
    while target in wires and wires[target].source:
        name, given = Place.of(wires[target].source)
        before = f"{name}.{_taken(parts[name].component, given)}"
        if before not in wires:
            break
        target = before
    return target


def _taken(component: type[Component], given: str) -> str:
    """Return the input that belongs to an output of an effect, or of what stands in its line; empty where there is none."""
    if issubclass(component, Effect):
        return next((taken for taken, output in component.pairs().values() if output == given), "")
    return "incoming" if given == "outgoing" else ""


class SensorNoise(Component):
    """Noise before a sensor, new in each sample and held until the next:  out = in + size n_k."""

    incoming = Input("{signal}", doc="what is measured")
    outgoing = Output("{signal}", doc="what the sensor sees")
    size = Parameter("{signal}", 0.0, low=0.0, doc="one standard deviation of the noise")
    number = Noise(doc="standard normal number of the sample")
    noise = DiscreteState("{signal}", doc="noise of this sample")

    @staticmethod
    def update(number: float, size: float) -> float:
        return size * number

    @staticmethod
    def output(incoming: float, noise: float) -> float:
        return incoming + noise


def with_sensor_noise(assembly: Wired, sizes: Mapping[str, float], naming: str = "{}_noise") -> Wired:
    """Return the assembly with noise before each sensor of ``sizes``, one standard deviation [unit of what it measures]."""
    bench = Rewiring(assembly)
    for sensor, size in sizes.items():
        target, name = f"{sensor}.{assembly.ports(sensor)['measured']}", naming.format(sensor)
        bench.add(Part(name, SensorNoise.with_units({"signal": assembly.declared(target).unit}), {"size": size}))
        bench.pass_on(target, f"{name}.incoming")
        bench.feed(f"{name}.outgoing", target)
    return bench.made(assembly)
