"""The misfit of a replay, ready for least squares: recorded minus simulated of every compared channel, over what the recording resolves.

The parts that can move a compared channel, and only they, are driven by what was recorded. With recorded commands nothing feeds back, so
the misfit is smooth in the parameters even where the machine's converters and encoders are not.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lathesim.component import Parameter
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import Assembly, FloatArray, Part, Place, Rewiring
from lathesim.engine.batch import Batch
from lathesim.engine.wiring import Plan, wire
from lathesim.identification.replay.controller_rate import at_controllers_rate
from lathesim.identification.replay.measured_motion import recorded_motion
from lathesim.identification.replay.open_loop import cut, drive, seen, sense
from lathesim.identification.replay.recorded_parts import LinearSignal, recorded_signal
from lathesim.identification.replay.simulator import LOST
from lathesim.identification.signal import channel_floor
from lathesim.record import Record

_JUMP_FLOORS = 30.0
"""Floors that a step must reach to be a jump."""
_JUMP = 10.0
"""A step of a recording this many times larger than those around it is a jump, whose timing is known to one sample only."""


@dataclass(frozen=True, eq=False)
class Misfit:
    """A plan and the recording it is held against; ``floors`` [SI] and ``weights`` (channels, samples) say what each sample counts.

    ``starts`` are the states whose value at the first sample the recording shows, with that value. The plan is sampled ``every`` so many
    times for each sample of the recording.
    """

    plan: Plan
    compare: tuple[str, ...]
    channels: tuple[str, ...]
    recorded: FloatArray
    floors: FloatArray
    weights: FloatArray
    starts: Mapping[str, float]
    every: int = 1

    @property
    def samples(self) -> int:
        """Number of samples of the recording."""
        return int(self.recorded.shape[1])

    def outputs(self, names: Sequence[str], values: FloatArray) -> list[FloatArray]:
        """Return the simulated channels (channels, samples) for each row of ``values`` [SI]; the rows run at the same time."""
        rows = [self.plan.channels.index(channel) for channel in self.channels]
        batch = Batch(self.plan, (self.samples - 1) * self.every + 1, noisy=False)
        return batch.run(list(names), np.atleast_2d(values), lambda record: record[rows, :: self.every].copy())

    def misfits(self, names: Sequence[str], values: FloatArray) -> FloatArray:
        """Return the misfit in floors, (rows, channels, samples); what was not recorded counts nothing."""
        found = np.empty((len(np.atleast_2d(values)), *self.recorded.shape))
        for row, output in enumerate(self.outputs(names, values)):
            with np.errstate(over="ignore", invalid="ignore"):  # a run that grows beyond all bounds is cut off below
                found[row] = (self.recorded - output) / self.floors[:, None]
        found = np.clip(np.nan_to_num(found, nan=LOST, posinf=LOST, neginf=-LOST), -LOST, LOST)
        return np.where(np.isfinite(self.recorded), found * self.weights, 0.0)


def replay_misfit(
    assembly: Assembly,
    record: Record,
    driven: Sequence[str],
    compared: Sequence[str],
    resolution: Mapping[str, float],
    *,
    closed: bool = False,
    decisions: int = 1,
    moving: Collection[str] = (),
) -> Misfit:
    """Return the misfit of an assembly, sampled as a recording is, against that; its controllers make so many ``decisions`` for each
    sample. Driven inputs that are ``moving`` were measured, and go on straight lines from row to row.

    ``closed`` leaves the machine's own loops closed: only the inputs the lesson calls driven are recorded ones, and sensors round.
    """
    recorded = {name: record[name] for name in compared}
    whole = {name: values for name, values in recorded.items() if np.isfinite(values).all()}
    machine = drive(assembly, {name: record[name] for name in driven}, moving)
    motion = recorded_motion(assembly, whole)
    if not closed:
        machine = _shown_places(sense(cut(_exact_sensors(machine), whole), motion), motion)
    channels = tuple(seen(assembly, name) for name in compared)
    machine = at_controllers_rate(_needed(machine, channels), decisions)
    step = machine.step if closed else max(machine.step, 0.5 * machine.sample_period)
    plan = wire(replace(machine, record=channels, finish="", step=step))
    floors = np.array([channel_floor(values, resolution.get(name, 0.0)) for name, values in recorded.items()])
    rows = np.array(list(recorded.values()))
    weights = np.array([_weights(row, floor) for row, floor in zip(rows, floors, strict=True)])
    return Misfit(plan, tuple(compared), channels, rows, floors, weights, _starts(plan, motion), decisions)


def _needed(assembly: Assembly, channels: Sequence[str]) -> Assembly:
    """Return the assembly without the parts that no compared channel depends on."""
    sources: dict[str, set[str]] = {}
    for item in assembly.wires:
        if item.source:
            sources.setdefault(Place.of(item.target).part, set()).add(Place.of(item.source).part)
    kept: set[str] = set()
    waiting = [Place.of(channel).part for channel in channels]
    while waiting:
        part = waiting.pop()
        if part not in kept:
            kept.add(part)
            waiting.extend(sources.get(part, ()))
    parts = tuple(part for part in assembly.parts if part.name in kept)
    return replace(assembly, parts=parts, wires=tuple(item for item in assembly.wires if Place.of(item.target).part in kept))


def _shown_places(assembly: Assembly, motion: Mapping[str, FloatArray]) -> Assembly:
    """Return the assembly in which other parts see the place of a part where it was recorded to be, so that a cut begins when it did."""
    bench = Rewiring(assembly)
    for output, values in motion.items():
        host, item = Place.of(output)
        targets = [target for target in bench.fed_by(output) if not _measures(assembly, target)]
        if targets and item == assembly.ports(host).get("displacement"):
            name = f"place_of_{host}"
            bench.add(recorded_signal(name, LinearSignal, assembly.declared(output).unit, values))
            bench.feed(f"{name}.value", *targets)
    return bench.made(assembly)


def _measures(assembly: Assembly, target: str) -> bool:
    """Return whether an input is that of a sensor or an effect, which stand for the machine and not for what it does."""
    part, item = Place.of(target)
    component = assembly.by_name[part].component
    return issubclass(component, Effect) or component.ports.get("measured") == item


def _exact_sensors(assembly: Assembly) -> Assembly:
    """Return the assembly whose sensors resolve everything: rounding belongs to the recording's noise, once and not twice."""
    exact = {part.name: _exactly(part) for part in assembly.parts}
    return assembly.with_parameters({f"{part}.{name}": value for part, own in exact.items() for name, value in own.items()})


def _exactly(part: Part) -> dict[str, float]:
    """Return the parameters with which a sensor or its converter does not round: a count of no length, as many bits as it may have."""
    ports = part.component.ports
    if "resolution" in ports:
        return {ports["resolution"]: 0.0}
    bits = part.component.declarations.get("bits")
    return {"bits": bits.high} if "reading" in ports and isinstance(bits, Parameter) else {}


def _weights(values: FloatArray, floor: float, beside: int = 2) -> FloatArray:
    """Return 1 for each sample, and next to nothing beside a jump: there a shift of one sample is as large as the jump."""
    steps = np.abs(np.nan_to_num(np.diff(values, prepend=values[:1])))
    width = min(101, len(steps))
    around = np.convolve(steps, np.ones(width) / width, mode="same")
    jumps = np.flatnonzero((steps > _JUMP * around) & (steps > _JUMP_FLOORS * floor))
    weights = np.ones(len(values))
    for at in jumps:
        near = slice(max(at - beside, 0), at + beside + 1)
        weights[near] = np.minimum(weights[near], floor / steps[at])
    return weights


def _starts(plan: Plan, motion: Mapping[str, FloatArray]) -> dict[str, float]:
    """Return the first recorded value of the states that an output shows as they are."""
    found = {}
    for name in plan.states:
        part, item = Place.of(name)
        component = plan.parts[part].component
        for role in ("displacement", "flow"):
            output = component.ports.get(role)
            if output and component.declarations[output].unit == component.declarations[item].unit and f"{part}.{output}" in motion:
                found[name] = float(motion[f"{part}.{output}"][0])
    return found
