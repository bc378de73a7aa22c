"""Replay: every part is driven by what was recorded of its inputs, so the one whose output comes out wrong is the place of the mismatch.

Two machines are made of the lesson's one: the *lesson's own* simulation, in which only the driven inputs are recorded, and the *replay*,
in which every wire that carries a recorded channel carries the recording instead. In the replay the controller cannot hide a fault, and
a part is not blamed for its neighbour.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from lathesim.diagnosis.signals import HeldSignal, LinearSignal
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import Assembly, FloatArray, Part, Wire
from lathesim.engine.wiring import wire
from lathesim.lessons.insertion import Machinery


def seen(assembly: Assembly, channel: str) -> str:
    """Give the output that stands for a channel once effects sit on it."""
    return assembly.seen_as.get(channel, channel) if isinstance(assembly, Machinery) else channel


def drive(assembly: Assembly, signals: Mapping[str, FloatArray]) -> Assembly:
    """Give the assembly with inputs (``part.input``) driven by recorded signals, one value a sample [SI]."""
    parts = list(assembly.parts)
    wires = {item.target: item for item in assembly.wires}
    units = {f"{part.name}.{name}": item.unit for part in parts for name, item in part.component.declarations.items()}
    for target, values in signals.items():
        name = f"recorded_{target.replace('.', '_')}"
        parts.append(_signal(name, HeldSignal, units[target], values))
        wires[_head(wires, target)] = Wire(_head(wires, target), f"{name}.value")
    return replace(assembly, parts=tuple(parts), wires=tuple(wires.values()))


def _head(wires: Mapping[str, Wire], target: str) -> str:
    """Give the first input of the chain of effects that ends at ``target``: the recording enters before the effects."""
    source = wires[target].source if target in wires else ""
    part, _, item = source.partition(".")
    if item == "outgoing" and f"{part}.incoming" in wires:
        return _head(wires, f"{part}.incoming")
    return target


def cut(assembly: Assembly, recorded: Mapping[str, FloatArray]) -> Assembly:
    """Give the assembly in which each recorded channel feeds its wires as it was recorded; the parts still compute their own."""
    held = _held_channels(assembly, recorded)
    parts = list(assembly.parts)
    by_name = {part.name: part for part in parts}
    wires = {item.target: item for item in assembly.wires}
    for channel, values in recorded.items():
        source = seen(assembly, channel)
        targets = [target for target, item in wires.items() if item.source == source and not _senses_own_host(by_name, target)]
        if not targets:
            continue
        part, _, item = channel.partition(".")
        name = f"recorded_{channel.replace('.', '_')}"
        unit = by_name[part].component.declarations[item].unit
        parts.append(_signal(name, HeldSignal if channel in held else LinearSignal, unit, values))
        for target in targets:
            wires[target] = Wire(target, f"{name}.value")
    return replace(assembly, parts=tuple(parts), wires=tuple(wires.values()))


def sense(assembly: Assembly, motion: Mapping[str, FloatArray]) -> Assembly:
    """Give the assembly in which effects sense the recorded motion of their hosts instead of the simulated one."""
    parts = list(assembly.parts)
    by_name = {part.name: part for part in parts}
    wires = {item.target: item for item in assembly.wires}
    for output, values in motion.items():
        targets = [target for target, item in wires.items() if item.source == output and _senses_own_host(by_name, target)]
        if not targets:
            continue
        part, _, item = output.partition(".")
        name = f"motion_{part}_{item}"
        parts.append(_signal(name, LinearSignal, by_name[part].component.declarations[item].unit, values))
        for target in targets:
            wires[target] = Wire(target, f"{name}.value")
    return replace(assembly, parts=tuple(parts), wires=tuple(wires.values()))


def _senses_own_host(parts: Mapping[str, Part], target: str) -> bool:
    """Say whether a target is an effect's sense of its own host, which must stay simulated (a friction acts on the simulated speed)."""
    part, _, item = target.partition(".")
    component = parts[part].component
    return issubclass(component, Effect) and item != "incoming"


def _held_channels(assembly: Assembly, recorded: Mapping[str, FloatArray]) -> set[str]:
    plan = wire(assembly)
    return {channel for channel in recorded if not plan.moves_between_samples(seen(assembly, channel))}


def _signal(name: str, component: type[HeldSignal] | type[LinearSignal], unit: str, values: FloatArray) -> Part:
    table = np.ascontiguousarray(np.asarray(values, dtype=float).reshape(-1, 1))
    return Part(name, component.with_units({"signal": unit}), tables={"recorded": table})
