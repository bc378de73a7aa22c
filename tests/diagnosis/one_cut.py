"""A recording of one turning cut, worked out here and not by the program: force while the tool cuts, and what may be wrong with it."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import numpy as np

from lathesim.components.cutting_forces import CuttingProcess
from lathesim.components.sensors import Dynamometer
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.identification.replay.experiment import RecordedMachine
from lathesim.record import Record
from tests.diagnosis.pushed_table import PERIOD, as_record

DEPTH, FORCE, FEED, SPEED, RADIUS = "cutting.depth", "dynamometer.main", 0.3e-3, 1.6, 15e-3
SPECIFIC, LEVEL, SAMPLES = 2000e6, 600.0, 2400
CUT = slice(400, 2000)
CHIP = 0.11
"""Length cut for each chip [m]."""
TURN = 2.0 * np.pi * RADIUS / SPEED
"""Duration of a turn of the spindle [s]."""


def cut_force(wrong: Collection[str] = (), noise: float = 3.0) -> np.ndarray:
    """Return the force [N] of one cut; ``wrong`` may hold ``entry`` (0.1 s), ``line`` (20 N once per turn), ``drift`` (20 N in all) and
    ``chips`` (40 N, one chip after 110 mm)."""
    time = np.arange(SAMPLES) * PERIOD
    since = time - time[CUT.start]
    inside = np.zeros(SAMPLES)
    inside[CUT] = 1.0
    force = LEVEL * inside
    if "entry" in wrong:
        force *= 1.0 - 0.7 * np.exp(-np.maximum(since, 0.0) / 0.1)
    if "line" in wrong:
        force += 20.0 * np.cos(2.0 * np.pi * time / TURN + 1.0) * inside
    if "chips" in wrong:
        force += 40.0 * np.cos(2.0 * np.pi * SPEED * time / CHIP) * inside
    if "drift" in wrong:
        force += 20.0 * time / time[-1]
    return np.asarray(force + noise * np.random.default_rng(3).standard_normal(SAMPLES))


def cut_record(wrong: Collection[str] = ()) -> Record:
    """Return the recording as it is mapped: depth of cut and force."""
    depth = np.zeros(SAMPLES)
    depth[CUT] = 1e-3
    return as_record({DEPTH: ("m", depth), FORCE: ("N", cut_force(wrong))})


def cut_machine() -> RecordedMachine:
    """Return the machine of the lesson: a linear force, and how sure it is of it."""
    parts = (
        Part("cutting", CuttingProcess, {"specific_force": SPECIFIC, "radius": RADIUS}),
        Part("dynamometer", Dynamometer, {}),
    )
    constants = {"cutting.feed": FEED, "cutting.depth": 1e-3, "cutting.speed": SPEED}
    wires = [Wire(name, constant=value) for name, value in constants.items()]
    wires += [Wire(target, "cutting.main_force") for target in ("cutting.acting_force", "dynamometer.main_force")]
    assembly = Assembly(parts, tuple(wires), PERIOD, 0.5 * PERIOD)
    return RecordedMachine(assembly, (DEPTH,), (FORCE,), {"cutting.specific_force": 0.1 * SPECIFIC}, {})


LESSON = """\
lesson: One cut
machine: cutting_process
sample_period: 2 ms
step: 1 ms
set: {cutting.specific_force: 2000 N/mm^2, cutting.radius: 15 mm}
wires: {cutting.feed: 0.3 mm, cutting.speed: 1.6 m/s}
recordings:
  time: {column: t, unit: s}
  drive: {cutting.depth: {column: F, unit: N, above: 100 N, value: 1 mm}}
  compare: {dynamometer.main: {column: F, unit: N}}
uncertain: {cutting.specific_force: 10 %}
"""


def write_cut(folder: Path, wrong: Collection[str] = ()) -> tuple[Path, Path]:
    """Write the lesson and a recording in which only the force is logged, and give the files."""
    (folder / "cut.yaml").write_text(LESSON, encoding="utf-8")
    rows = np.column_stack([np.arange(SAMPLES) * PERIOD, cut_force(wrong)])
    np.savetxt(folder / "cut.csv", rows, delimiter=",", header="t [s],F [N]", comments="", fmt="%.8g")
    return folder / "cut.yaml", folder / "cut.csv"
