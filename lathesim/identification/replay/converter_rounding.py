"""What the machine of the lesson does with the recorded inputs, no candidate in it: run once, and taken for what a replay can neither
follow nor see.

A converter between two channels rounds what it is given by steps that a candidate's small change would be lost in, so a replay has
converters without steps; what the steps make of the recorded inputs is known and added:  e_k = level(u_k) - u_k. An integral behind a
converter that always rounds down would run away without it. And the speed of a feed drive that is told steps of voltage swings faster than
counts of its place can show; what the model makes of the same steps does show it:  v = v_model + d/dt (x_counted - x_model).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from lathesim.component import Component, Output, Parameter
from lathesim.engine.assembly import Assembly, FloatArray, Part, Place, Rewiring
from lathesim.engine.batch import Batch
from lathesim.engine.wiring import wire
from lathesim.identification.replay.open_loop import ROUNDED, ROUNDING
from lathesim.identification.replay.recorded_parts import HeldSignal, recorded_signal
from lathesim.lessons.sensor_sides import SeenBeyond

_TWIN = "without_steps_"


def plain_replay(replayed: Assembly, motion: Collection[str], samples: int, compared: Collection[str]) -> dict[str, FloatArray]:
    """Return what converters round (output of a converter -> level less what it stands for) and how parts move (output of ``motion`` ->
    values) in a replay without candidates, one value a sample [SI].

    Nothing is run where no part of a process follows the motion and no converter for sensors rounds between channels that are
    ``compared``; what grows beyond all bounds is left out.
    """
    rounding = _rounded(replayed, compared)
    if not rounding and not motion:
        return {}
    twins = {output: f"{_TWIN}{output}" for output in rounding}
    parts, wires = list(replayed.parts), list(replayed.wires)
    for name in dict.fromkeys(Place.of(output).part for output in rounding):
        part = replayed.by_name[name]
        bits = part.component.ports["bits"]
        most = {bits: part.component.declared(Parameter)[bits].high}
        parts.append(replace(part, name=f"{_TWIN}{name}", parameters={**part.parameters, **most}))
        wires += [replace(item, target=f"{_TWIN}{item.target}") for item in replayed.wires if Place.of(item.target).part == name]
    asked = (*rounding, *twins.values(), *motion)
    plan = wire(replace(replayed, parts=tuple(parts), wires=tuple(wires), record=asked, finish=""))
    (made,) = Batch(plan, samples, noisy=False).run([], np.zeros((1, 0)))
    values = {name: np.asarray(made[plan.channels.index(name)]) for name in asked}
    found = {output: values[output] - values[twin] for output, twin in twins.items()} | {name: values[name] for name in motion}
    return {name: one for name, one in found.items() if np.isfinite(one).all()}


def with_rounding(assembly: Assembly, rounding: Mapping[str, FloatArray]) -> Assembly:
    """Return the assembly whose converters add what they round, as it is known, to all that they feed."""
    bench = Rewiring(assembly)
    for output, values in rounding.items():
        name, unit = output.replace(".", "_"), assembly.declared(output).unit
        bench.add(recorded_signal(f"{ROUNDING}{name}", HeldSignal, unit, values))
        bench.add(Part(f"{ROUNDED}{name}", SeenBeyond.with_units({"signal": unit})))
        bench.feed(f"{ROUNDED}{name}.outgoing", *bench.fed_by(output))
        bench.feed(output, f"{ROUNDED}{name}.incoming")
        bench.feed(f"{ROUNDING}{name}.value", f"{ROUNDED}{name}.beyond")
    return bench.made(assembly)


def resolving_everything(component: type[Component]) -> dict[str, float]:
    """Return the values of a component's parameters with which it resolves everything; empty where it has no steps."""
    ports, declared = component.ports, component.declared(Parameter)
    exact = {ports[role]: 0.0 for role in ("resolution",) if role in ports}
    # steps of a converter hide what small changes of a value do to what it reads
    return exact | {ports[role]: declared[ports[role]].high for role in ("bits",) if role in ports}


def counts_of(assembly: Assembly) -> dict[str, tuple[float, float]]:
    """Return ``part.parameter`` -> (given, exact) for all that counts: what one count of a sensor is worth [SI], and the bits of a
    converter, which has most of them where it is exact."""
    found = {}
    for part in assembly.parts:
        ports, declared = part.component.ports, part.component.declared(Parameter)
        name = ports["resolution"] if {"measured", "resolution"} <= set(ports) else "bits"
        if name in declared and (declared[name].low <= 0.0 or name == "bits"):
            found[f"{part.name}.{name}"] = part.value(name), declared[name].high if name == "bits" else 0.0
    return found


def _rounded(assembly: Assembly, compared: Collection[str]) -> list[str]:
    """Return the outputs of converters that feed something and are not compared, if one of them stands behind a sensor: what a command is
    rounded to is the same in all that is compared."""
    converters = [part for part in assembly.parts if "bits" in part.component.ports]
    if all("drive" in part.component.ports for part in converters):
        return []
    fed = {item.source for item in assembly.wires}
    outputs = [f"{part.name}.{item}" for part in converters for item in part.component.declared(Output)]
    return [output for output in outputs if output in fed and output not in compared]
