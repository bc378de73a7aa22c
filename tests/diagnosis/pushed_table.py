"""A table pushed by a recorded force: recordings of it, worked out here and not by the program, and the machine held against them.

    m dv/dt = F - b v - missing(v, q, t) - dry friction,  measured with an encoder of 1 um

The dry friction sticks: while less than its level pushes the resting table it stays where it is (Karnopp 1985). Small fixed steps with a
band of speed that counts as rest; none of the program's laws are used.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lathesim.components.axes import ForceAxis
from lathesim.components.sensors import LinearEncoder
from lathesim.diagnosis.explaining.search import explain
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.method import STANDARD
from lathesim.diagnosis.records.found import Found
from lathesim.effects.drive_errors import TorqueRipple
from lathesim.effects.effect import Effect
from lathesim.effects.friction import CoulombFriction
from lathesim.effects.offset_and_gain import ForceOffset
from lathesim.engine.assembly import Assembly, FloatArray, Part, Wire
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records import Fitted
from lathesim.identification.replay.experiment import Experiment, RecordedMachine, baseline_free, build_experiments
from lathesim.record import Channel, Record

MASS, VISCOUS, PERIOD, RESOLUTION = 40.0, 200.0, 2e-3, 1e-6
EFFECTS = (CoulombFriction, ForceOffset, TorqueRipple)
FORCE, POSITION = "x_axis.force", "x_encoder.position"
_STEPS = 40
_REST = 2e-6
"""Speed below which the table rests [m/s]."""

Law = Callable[[float, float, float], float]
"""The force against the motion [N] at speed v [m/s], place q [m] and time t [s]."""


@dataclass(frozen=True)
class Hidden:
    """What the lesson does not know: dry friction [N], and any other force against the motion."""

    dry: float = 0.0
    law: Law | None = None
    mass: float = MASS
    viscous: float = VISCOUS


def force(count: int, seed: int = 1, size: float = 60.0) -> FloatArray:
    """Return a force that goes both ways at many speeds [N], held over each sample: five waves of random phase."""
    rng = np.random.default_rng(seed)
    time = np.arange(count) * PERIOD
    phases = rng.uniform(-math.pi, math.pi, 5)
    waves = [np.sin(2.0 * math.pi * rate * time + phase) for rate, phase in zip((0.5, 0.9, 1.6, 2.7, 4.6), phases, strict=True)]
    return np.asarray(size * np.sum(waves, axis=0) / math.sqrt(5.0))


@functools.cache
def motion(hidden: Hidden, count: int, seed: int, size: float) -> tuple[FloatArray, FloatArray]:
    """Return a force [N] and the place of the table that it pushes [m]; many tests ask for the same, with noise of their own."""
    pushed = force(count, seed, size)
    return pushed, travel(pushed, hidden)


def travel(pushed: FloatArray, hidden: Hidden) -> FloatArray:
    """Return the place of the table at each sample [m], from rest at 0."""
    step, place, speed = PERIOD / _STEPS, 0.0, 0.0
    law, dry, viscous = hidden.law, hidden.dry, hidden.viscous
    # the viscous force is taken at the middle of the step, which makes the step second order
    inertia = hidden.mass + 0.5 * viscous * step
    found = np.zeros(len(pushed))
    for sample, push in enumerate(pushed.tolist()):
        found[sample] = place
        for substep in range(_STEPS):
            load, before = push - viscous * speed, speed
            if law is not None:
                load -= law(speed, place, (sample + substep / _STEPS) * PERIOD)
            resting = -_REST < speed < _REST
            if resting and abs(load) <= dry:
                speed = 0.0
            else:
                level = -dry if (load if resting else speed) < 0.0 else dry
                speed += (load - level) / inertia * step
                speed = 0.0 if dry and before * speed < 0.0 else speed
            place += 0.5 * (before + speed) * step
    return found


def recording(hidden: Hidden | None = None, *, count: int = 2000, seed: int = 1, noise: float = 0.3e-6, size: float = 60.0) -> Record:
    """Return a recording of a hidden machine: the force as it was and the place as the encoder saw it."""
    pushed, place = motion(hidden or Hidden(), count, seed, size)
    seen = np.round((place + noise * np.random.default_rng(seed + 1000).standard_normal(count)) / RESOLUTION) * RESOLUTION
    return as_record({FORCE: ("N", pushed.copy()), POSITION: ("m", seen)})


def as_record(columns: dict[str, tuple[str, FloatArray]]) -> Record:
    """Return a record of columns on the sample grid."""
    count = len(next(iter(columns.values()))[1])
    channels = {name: Channel(name, unit, values) for name, (unit, values) in columns.items()}
    return Record(np.arange(count) * PERIOD, channels, {"sample_period": PERIOD})


def machine(mass: float = MASS, viscous: float = VISCOUS, sure: float = 0.05) -> RecordedMachine:
    """Return the table as a lesson describes it: values right or wrong, and how sure they are."""
    parts = (
        Part("x_axis", ForceAxis, {"mass": mass, "viscous": viscous}),
        Part("x_encoder", LinearEncoder, {"resolution": RESOLUTION}),
    )
    wires = (Wire("x_axis.force", constant=0.0), Wire("x_encoder.measured", "x_axis.position"))
    uncertain = {"x_axis.mass": sure * mass, "x_axis.viscous": 2.0 * sure * viscous}
    return RecordedMachine(Assembly(parts, wires, PERIOD, 0.5 * PERIOD), (FORCE,), (POSITION,), uncertain, {POSITION: RESOLUTION})


def experiments(*records: Record, effects: Sequence[type[Effect]] = EFFECTS, of: RecordedMachine | None = None) -> list[Experiment]:
    """Return the rigs of recordings, called ``fit``, ``check`` and ``third``."""
    return build_experiments(of or machine(), zip(("fit", "check", "third"), records, strict=False), effects)


@functools.cache
def pair(hidden: Hidden) -> tuple[Experiment, Experiment]:
    """Return the rigs of two recordings of one hidden machine."""
    first, second = experiments(recording(hidden, seed=1), recording(hidden, seed=2))
    return first, second


@functools.cache
def baselines(hidden: Hidden) -> tuple[Fitted, Fitted]:
    """Return the baseline fitted to each recording of a pair."""
    first, second = (fit(experiment.sensed, baseline(experiment)) for experiment in pair(hidden))
    return first, second


def baseline(experiment: Experiment) -> list:  # type: ignore[type-arg]
    """Return what is free without any effect: the uncertain values and the start of the recording."""
    return [*baseline_free(experiment.machine), *experiment.start_states(experiment.sensed.plan)]


def study(estimation: Experiment, validation: Experiment) -> Study:
    """Return what a search takes, with the standard limits and nobody who is told of progress."""
    return Study(estimation, validation, STANDARD, lambda text: None)


def searched(estimation: Experiment, validation: Experiment) -> Found:
    """Return what a search of two recordings finds."""
    return explain(study(estimation, validation))


LESSON = """\
lesson: A table that is pushed
machine: force_axis
sample_period: 2 ms
step: 1 ms
duration: 4 s
set: {x_axis.mass: 40 kg, x_axis.viscous: 200 N*s/m, x_encoder.resolution: 1 um}
recordings:
  time: {column: t, unit: s}
  drive: {x_axis.force: {column: push, unit: N, held: true}}
  compare: {x_encoder.position: {column: seen, unit: mm, resolution: 1 um}}
uncertain: {x_axis.mass: 5 %, x_axis.viscous: 10 %}
"""


def write_case(
    folder: Path, hidden: Hidden | None = None, *, lesson: str = LESSON, count: int = 2000, seeds: tuple[int, int] = (1, 2)
) -> tuple[Path, Path, Path]:
    """Write the lesson and two recordings of a hidden machine, and give the three files."""
    (folder / "table.yaml").write_text(lesson, encoding="utf-8")
    files = []
    for seed, name in zip(seeds, ("fit.csv", "check.csv"), strict=True):
        record = recording(hidden, seed=seed, count=count)
        rows = np.column_stack([record.time, record[FORCE], 1e3 * record[POSITION]])
        np.savetxt(folder / name, rows, delimiter=",", header="t [s],push [N],seen [mm]", comments="", fmt="%.10g")
        files.append(folder / name)
    return folder / "table.yaml", files[0], files[1]
