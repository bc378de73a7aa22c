"""Replicates of a recording: the fitted model, its quantisers and its noise, run again over the same program.

What a loop makes of its own converters and counts shows in a replicate as it does in the recording. So a statistic of what is left can be
held against its distribution over replicates instead of against a constant (posterior predictive check). Source: A. Gelman, X.-L. Meng,
H. Stern, Statistica Sinica 6 (1996), 733-807. All replicates run through one compiled plan; only the drawn numbers differ.
Left out: the uncertainty of the fitted values, and fitting them anew to each replicate.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from lathesim.component import Component, DiscreteState, Input, Noise, Output, Parameter
from lathesim.engine.assembly import Assembly, FloatArray, Part, Wire
from lathesim.engine.running.batch import Batch
from lathesim.engine.wiring import wire
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.replay.experiment import Experiment
from lathesim.lessons.insertion import insert_effect
from lathesim.record import Record

_NOISY = "replicate_"
"""How the names of the parts begin that add noise."""


class DrawnNoise(Component):
    """First-order noise added to a signal:  n_k = a n_(k-1) + s sqrt(1 - a^2) e_k,  a = exp(-2 pi f T), e standard normal.

    Source: L. Ljung, System Identification, 2nd ed. (1999), section 2.3. A corner far above the sample rate makes it white.
    """

    incoming = Input("{signal}", doc="signal without the noise")
    deviation = Parameter("{signal}", 0.0, low=0.0, doc="standard deviation of the noise")
    corner = Parameter("Hz", 1e6, low=0.0, doc="frequency from which on it falls off")
    chance = Noise(doc="what is new in each sample")
    drawn = DiscreteState("{signal}", doc="noise of this sample")
    outgoing = Output("{signal}", doc="signal with the noise")

    @staticmethod
    def update(drawn: float, deviation: float, corner: float, chance: float, sample_period: float) -> float:
        """One step of the noise."""
        kept = math.exp(-2.0 * math.pi * corner * sample_period)
        return kept * drawn + deviation * math.sqrt(1.0 - kept * kept) * chance

    @staticmethod
    def output(incoming: float, drawn: float) -> float:
        """The sum of both."""
        return incoming + drawn


@dataclass(frozen=True)
class Load:
    """A force or torque that nobody measured: where it acts (``part.input``), its standard deviation [SI] and its corner [Hz]."""

    at: str
    deviation: float
    corner: float


@dataclass(frozen=True)
class Replicates:
    """The recording in the machine with the found effects alone, ``own``, and the same for each replicate; ``values`` are set in all."""

    own: Experiment
    drawn: tuple[Experiment, ...]
    values: Mapping[str, float]


def replicates(
    experiment: Experiment,
    candidates: Iterable[Candidate],
    values: Mapping[str, float],
    loads: Iterable[Load],
    number: int,
    seed: int = 0,
    noise: Mapping[str, float] | None = None,
    finer: float = 1.0,
    errors: Mapping[str, float] | None = None,
) -> Replicates:
    """Return so many replicates of a recording from the model with ``candidates`` at ``values`` (``part.parameter`` or ``part.state``).

    Sensors get the ``noise`` (channel -> standard deviation with rounding, by default the floor of the recording) beyond their rounding;
    what acts beside the drive are ``loads``. So many ``finer`` steps make one of the lesson's. Values with ``errors`` (name -> standard
    deviation) are drawn anew in each replicate, alike for every ``seed``: replicates of two recordings are of one machine.
    """
    plain = _with_effects_alone(experiment, candidates)
    beyond = {name: _beyond_rounding(experiment, name, (noise or experiment.floors)[name]) for name in experiment.machine.compare}
    noisy = wire(_noisy(plain, loads, beyond, finer))
    names = [name for name in plain.own.settable(values) if name in noisy.parameters or name in noisy.states]
    row = np.array([values[name] for name in names], dtype=float)
    spread = np.array([(errors or {}).get(name, 0.0) for name in names])
    chances = [np.random.default_rng([place, number, len(names)]).standard_normal(len(names)) for place in range(number)]
    positions = [noisy.channels.index(channel) for channel in plain.own.channels]
    batch = Batch(noisy, (plain.own.samples - 1) * plain.own.every + 1, threads=1)
    simulated = batch.run(
        names,
        np.array([row + spread * chance for chance in chances]),
        lambda record: record[positions, :: plain.own.every].copy(),
        seeds=[1 + place + number * seed for place in range(number)],
    )
    drawn = [
        replace(plain, record=_as_recorded(plain, own, beyond, np.random.default_rng([seed, place])))
        for place, own in enumerate(simulated)
        if np.isfinite(own).all()
    ]
    return Replicates(plain, tuple(drawn), {name: values[name] for name in names})


def _with_effects_alone(experiment: Experiment, candidates: Iterable[Candidate]) -> Experiment:
    """Return the recording in the machine that has the found effects and no other candidate: a small plan, compiled once."""
    order = {candidate.part: place for place, candidate in enumerate(experiment.candidates)}
    chosen = sorted(candidates, key=lambda candidate: order.get(candidate.part, len(order)))
    assembly: Assembly = experiment.machine.assembly
    for candidate in chosen:
        assembly = insert_effect(assembly, candidate.effect, candidate.at, name=candidate.part, sources=dict(candidate.senses))
    return replace(experiment, candidates=tuple(chosen), with_candidates=assembly)


def _noisy(experiment: Experiment, loads: Iterable[Load], noise: Mapping[str, float], finer: float) -> Assembly:
    """Return the assembly of the closed loop with noise before its sensors and beside its drives."""
    assembly = experiment.own.plan.assembly
    known = {part.name: part for part in assembly.parts}
    places = {load.at: (load.deviation, load.corner) for load in loads}
    for name in experiment.machine.compare:
        part = known[name.partition(".")[0]]
        measured = part.component.ports.get("measured", "")
        if part.component.ports.get("reading") == name.partition(".")[2] and measured and "drive" not in part.component.ports:
            places[f"{part.name}.{measured}"] = (noise[name], 1e6)
    parts, wires = list(assembly.parts), {item.target: item for item in assembly.wires}
    for target, (deviation, corner) in places.items():
        host, _, item = target.partition(".")
        declared = known[host].component.declared(Input)[item]
        name = f"{_NOISY}{host}_{item}"
        fed = wires.get(target) or Wire(target, constant=declared.default or 0.0)
        parts.append(Part(name, DrawnNoise.with_units({"signal": declared.unit}), {"deviation": deviation, "corner": corner}))
        wires |= {f"{name}.incoming": replace(fed, target=f"{name}.incoming"), target: Wire(target, f"{name}.outgoing")}
    return replace(assembly, parts=tuple(parts), wires=tuple(wires.values()), step=assembly.step / finer)


def _beyond_rounding(experiment: Experiment, name: str, noise: float) -> float:
    """Return the noise of a channel beyond what its resolution rounds, one standard deviation."""
    rounding = experiment.machine.resolution.get(name, 0.0) / math.sqrt(12.0)
    return math.sqrt(max(noise**2 - rounding**2, 0.0))


def _as_recorded(experiment: Experiment, simulated: FloatArray, noise: Mapping[str, float], rng: np.random.Generator) -> Record:
    """Return a replicate as a logger writes it: what no sensor of the machine reads has the noise and the steps of its channel."""
    record = experiment.record
    parts = {part.name: part.component for part in experiment.machine.assembly.parts}
    for row, name in enumerate(experiment.machine.compare):
        values, step = simulated[row], experiment.machine.resolution.get(name, 0.0)
        ports = parts[name.partition(".")[0]].ports
        if "measured" not in ports:
            values = values + noise[name] * rng.standard_normal(len(values))
            values = step * np.round(values / step) if step > 0.0 else values
        record = record.with_channel(name, record.unit(name), values)
    return record
