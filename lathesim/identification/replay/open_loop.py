"""Replay: every part is driven by what was recorded of its inputs, so the one whose output comes out wrong is the place of the mismatch.

Two machines are made of the lesson's one: the *lesson's own* simulation, in which only the driven inputs are recorded, and the *replay*,
in which every wire that carries a recorded channel carries the recording instead. In the replay the controller cannot hide a fault, and
a part is not blamed for its neighbour.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from lathesim.component import Component, Input
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import Assembly, FloatArray, Part, Place, Rewiring, Wire
from lathesim.engine.wiring import wire
from lathesim.identification.replay.recorded_parts import CorrectedSight, HeldSignal, LinearSignal, SensedMotion, recorded_signal
from lathesim.identification.roles import SENSED, comes_from_effect, goes_to_effect
from lathesim.lessons.insertion import GoesWithMain, Machinery
from lathesim.lessons.sensor_sides import first_input

ROUNDING, ROUNDED = "rounding_", "rounded_"
"""How the names of parts begin that stand for what was recorded."""


def seen(assembly: Assembly, channel: str) -> str:
    """Return the output that stands for a channel once effects sit on it."""
    return assembly.seen_as.get(channel, channel) if isinstance(assembly, Machinery) else channel


def drive(assembly: Assembly, signals: Mapping[str, FloatArray], moving: Collection[str] = ()) -> Assembly:
    """Return the assembly with inputs (``part.input``) driven by recorded signals, one value a sample [SI]; effects that sense them too.

    Each value is held until the next one, as a command is; those of ``moving`` inputs go there on a straight line, as what is measured.
    """
    bench = Rewiring(assembly)
    for target, values in signals.items():
        name = recorded_part(target)
        bench.add(recorded_signal(name, LinearSignal if target in moving else HeldSignal, assembly.declared(target).unit, values))
        bench.feed(f"{name}.value", *_sensing(assembly, bench, target), first_input(bench.parts, bench.wires, target))
    return bench.made(assembly)


def recorded_part(name: str) -> str:
    """Return the part that gives what was recorded of a driven input or a channel."""
    return f"recorded_{name.replace('.', '_')}"


def _sensing(assembly: Assembly, bench: Rewiring, target: str) -> list[str]:
    """Return the inputs of effects that sense the same input of their host: fed as it was, and called as its role."""
    host, item = Place.of(target)
    component = assembly.by_name[host].component
    roles = {role for role, port in component.ports.items() if port == item}
    head = first_input(assembly.by_name, bench.wires, target)
    default = component.declared(Input)[item].default if head == target else None
    fed = bench.wires.get(head, Wire(head, constant=default or 0.0))
    found = []
    for part in assembly.parts:
        if issubclass(part.component, Effect) and host in _sits_at(assembly, part.name):
            senses = [f"{part.name}.{name}" for name in part.component.declared(Input) if name in roles]
            senses = [own for own in senses if own in bench.wires]
            found += [own for own in senses if replace(bench.wires[own], target=head) == replace(fed, target=head)]
    return found


def _sits_at(assembly: Assembly, effect: str) -> set[str]:
    """Return the parts whose port an effect sits on, past effects beside it."""
    effects = {part.name for part in assembly.parts if issubclass(part.component, Effect)}
    here = effect
    while here in effects:
        here = Place.of(assembly.sources.get(f"{here}.incoming", "")).part
    found, waiting, seen_before = {here}, [effect], {effect}
    while waiting:
        source = f"{waiting.pop()}.outgoing"
        for name in (Place.of(item.target).part for item in assembly.wires if item.source == source):
            if name not in effects:
                found.add(name)
            elif name not in seen_before:
                seen_before.add(name)
                waiting.append(name)
    return found


def cut(assembly: Assembly, recorded: Mapping[str, FloatArray]) -> Assembly:
    """Return the assembly in which each recorded channel feeds its wires as it was recorded; the parts still compute their own."""
    plan, bench = wire(assembly), Rewiring(assembly)
    held = {channel for channel in recorded if not plan.moves_between_samples(seen(assembly, channel))}
    for channel, values in recorded.items():
        targets = [target for target in bench.fed_by(seen(assembly, channel)) if not _senses_own_host(assembly, target)]
        if targets:
            name = recorded_part(channel)
            bench.add(recorded_signal(name, HeldSignal if channel in held else LinearSignal, assembly.declared(channel).unit, values))
            bench.feed(f"{name}.value", *targets)
    return bench.made(assembly)


def follow(assembly: Assembly, motion: Mapping[str, FloatArray]) -> Assembly:
    """Return the assembly in which a process goes on where the machine was: what neither moves nor measures a part, as the stock that a
    tool cuts, takes the recorded ``motion`` of it (output -> values).

    A replayed axis drifts away from its recording by what its controller had held, and a cut there, at that feed, is another one.
    """
    bench = Rewiring(assembly)
    for output, values in motion.items():
        targets = _taken_by_processes(bench, output)
        if targets:
            name = f"followed_{output.replace('.', '_')}"
            bench.add(recorded_signal(name, LinearSignal, assembly.declared(output).unit, values))
            bench.feed(f"{name}.value", *targets)
    return bench.made(assembly)


def _taken_by_processes(bench: Rewiring, output: str) -> list[str]:
    """Return the inputs of processes that an output feeds, past effects that others see as well: what is recorded passed them too."""
    found: list[str] = []
    for target in bench.fed_by(output):
        if _is_of_a_process(bench, target):
            found.append(target)
        elif goes_to_effect(target):
            found += _taken_by_processes(bench, f"{Place.of(target).part}.outgoing")
    return found


def _is_of_a_process(bench: Rewiring, target: str) -> bool:
    """Return whether an input is of parts that neither move nor drive nor measure, as stock, tool and cut, through effects that sit on it
    and what belongs to them."""
    part, item = Place.of(target)
    component = bench.parts[part].component
    if "incoming" not in component.declared(Input):
        return not {"effort", "drive", "measured", "reading"} & set(component.ports)
    fed = bench.fed_by(f"{part}.outgoing")
    return item == "incoming" and bool(fed) and all(_is_of_a_process(bench, end) for end in fed)


def sense(assembly: Assembly, motion: Mapping[str, FloatArray], candidates: Collection[str] | None = None) -> Assembly:
    """Return the assembly in which effects sense the recorded motion of their hosts instead of the simulated one.

    With the names of some ``candidates`` only they do, and how much of it each of their inputs senses is a parameter,
    :func:`sensed_share`: a friction that holds a table still has to feel that it does.
    """
    bench = Rewiring(assembly)
    for output, values in motion.items():
        # target -> the input of an effect for which it senses: itself, or one behind a spring
        sensing = {target: _sensing_for(bench, target) for target in bench.fed_by(output)}
        sensing = {target: own for target, own in sensing.items() if _senses_own_host(assembly, own)}
        targets = [target for target, own in sensing.items() if candidates is None or Place.of(own).part in candidates]
        if not targets:
            continue
        name, unit = f"motion_{output.replace('.', '_')}", assembly.declared(output).unit
        bench.add(recorded_signal(name, LinearSignal, unit, values))
        for target in targets:
            if candidates is None:
                bench.feed(f"{name}.value", target)
                continue
            sensed = Place.of(sensed_share(sensing[target])).part
            bench.add(Part(sensed, SensedMotion.with_units({"signal": unit})))
            bench.feed(f"{name}.value", f"{sensed}.recorded")
            bench.feed(output, f"{sensed}.simulated")
            bench.feed(f"{sensed}.value", target)
    return bench.made(assembly)


def _sensing_for(bench: Rewiring, target: str) -> str:
    """Return the input that is fed with what ``target`` sees, past what is added to it behind springs."""
    part, item = Place.of(target)
    if item == "incoming" and f"{part}.beyond" in bench.wires:
        return next((_sensing_for(bench, fed) for fed in bench.fed_by(f"{part}.outgoing")), target)
    return target


def sensed_share(target: str) -> str:
    """Return the parameter that says how much of the recorded motion an input of a candidate (``part.input``) senses."""
    return f"{SENSED}{target.replace('.', '_')}.share"


def look(assembly: Assembly, channels: Mapping[str, str], motion: Mapping[str, FloatArray]) -> tuple[Assembly, dict[str, str]]:
    """Return the assembly whose motion sensors look at the recorded motion, and the output that now stands for each of their channels.

    ``channels`` gives the output that stood for each channel before. What a sensor gets wrong is then a known function of time, and it is
    added to the simulated motion: see :class:`CorrectedSight`. What makes a reading late acts on that sum at the sensor that the recorded
    motion comes from: it is late already, and made late once more it says that of y - late(y) only what late(y) - late(late(y)) is. So does
    a play: the recorded motion has crossed it already. So does a factor: on the recorded motion alone it would explain all of it with a
    machine that stands. At a second sensor these are errors: how fast the machine was is recorded, and a replay is off by what nobody
    modelled.
    """
    bench = Rewiring(assembly)
    shown: dict[str, str] = {}
    looked_at: set[str] = set()
    for channel, output in channels.items():
        sensor, reading = Place.of(channel)
        if assembly.ports(sensor).get("reading") != reading:
            continue
        target = _eye(bench, sensor)
        source = bench.wires[target].source if target in bench.wires else ""
        if source not in motion:
            continue
        unit = assembly.declared(source).unit
        if assembly.declared(channel).unit != unit:
            continue  # its errors are not lengths or speeds that could be added to the motion
        signal, sight = f"motion_{source.replace('.', '_')}", f"sight_{sensor}"
        if signal not in bench.parts:
            bench.add(recorded_signal(signal, LinearSignal, unit, motion[source]))
        bench.add(Part(sight, CorrectedSight.with_units({"signal": unit})))
        bench.feed(f"{signal}.value", target)
        behind = _between(bench, channel, output)
        after = [] if source in looked_at else [name for name in behind if _is_late(bench.parts[name].component)]
        errors = [name for name in behind if name not in after]
        if source not in looked_at:
            after = [*_taken_out(bench, sensor), *after]
        looked_at.add(source)
        bench.feed(_in_line(bench, channel, errors), f"{sight}.sensed")
        bench.feed(source, f"{sight}.simulated")
        bench.feed(f"{signal}.value", f"{sight}.recorded")
        shown[channel] = _in_line(bench, f"{sight}.reading", after)
    return bench.made(assembly), shown


def _taken_out(bench: Rewiring, sensor: str) -> list[str]:
    """Take the effects that multiply a reading, or hold it where the motion turns round, out of the line before a sensor that resolves
    everything, and give them: behind it they do the same."""
    found = []
    target = f"{sensor}.{bench.parts[sensor].component.ports['measured']}"
    while comes_from_effect(bench.wires[target].source):
        before = Place.of(bench.wires[target].source).part
        component, incoming = bench.parts[before].component, f"{before}.incoming"
        if issubclass(component, Effect) and (component.proportional or component.identification.sticks):
            found.append(before)
            bench.pass_on(incoming, target)
        else:
            target = incoming
    return found


def _between(bench: Rewiring, channel: str, output: str) -> list[str]:
    """Return the effects between a channel and the output that stands for it, in the order in which they act."""
    chain: list[str] = []
    while output != channel:
        chain.insert(0, Place.of(output).part)
        output = bench.wires[f"{chain[0]}.incoming"].source
    return chain


def _in_line(bench: Rewiring, feed: str, effects: Sequence[str]) -> str:
    """Wire effects one behind the other and give the output of the last one, or what feeds them where there is none."""
    for name in effects:
        bench.feed(feed, f"{name}.incoming")
        feed = f"{name}.outgoing"
    return feed


def _eye(bench: Rewiring, sensor: str) -> str:
    """Return the input at which a sensor's chain of effects begins."""
    target = f"{sensor}.{bench.parts[sensor].component.ports['measured']}"
    while target in bench.wires and comes_from_effect(bench.wires[target].source):
        before = Place.of(bench.wires[target].source).part
        if f"{before}.incoming" not in bench.wires:
            break
        target = f"{before}.incoming"
    return target


def _senses_own_host(assembly: Assembly, target: str) -> bool:
    """Return whether a target is an effect's sense of its own host, which must stay simulated (a friction acts on the simulated speed)."""
    part, item = Place.of(target)
    return issubclass(assembly.by_name[part].component, (Effect, GoesWithMain)) and item != "incoming"


def _is_late(component: type[Component]) -> bool:
    """Return whether a part is an effect that makes a reading late."""
    return issubclass(component, Effect) and bool(component.identification.delay)
