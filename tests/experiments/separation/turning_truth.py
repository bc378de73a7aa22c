"""A cut and a spindle as other integrators make them: which read the part program by themselves."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lathesim.lessons.lesson import load_lesson
from lathesim.plugins import Registry
from tests.experiments.separation.concealed import Hidden, coloured_noise, log_uniform
from tests.experiments.separation.cutting_rig import CuttingPhysics, simulate_cutting
from tests.experiments.separation.hidden_turning import CUTTING_EFFECTS, SPINDLE_EFFECTS
from tests.experiments.separation.part_program import PERIOD, Course, read_course
from tests.experiments.separation.spindle_rig import SpindlePhysics, simulate_spindle

LESSONS = Path(__file__).parent / "lessons"
STOCK, FACE, LENGTH = 0.022, 0.015, 0.060
CELLS = 3000
CUT = CuttingPhysics(specific_force=1.8e9, thrust_ratio=0.4, feed_ratio=0.5, radius=0.02)
UNCERTAIN_CUT = {"specific_force": 0.05, "thrust_ratio": 0.05, "feed_ratio": 0.05}
SPINDLE = SpindlePhysics(
    inertia=0.002, viscous=0.0008, gain=0.033, encoder_resolution=2.0 * np.pi / 10000.0, tachometer_noise=2e-3, loop_gain=0.05,
    loop_rate=3.0, torque_limit=1.0,
)  # fmt: skip
UNCERTAIN_SPINDLE = {"inertia": 0.04, "viscous": 0.15, "gain": 0.003}
RIG = {"rated": 1.0, "peak": 1.0}


def course_of(lesson: Path | str) -> Course:
    """Return what the part program of a lesson commands, for as long as the lesson lasts."""
    loaded = load_lesson(str(lesson))
    program = Path(loaded.path).parent / str(loaded.source.data["program"])
    seconds, unit = str(loaded.source.data["duration"]).split()
    assert unit == "s"
    found = read_course(program, float(seconds))
    count = round(float(seconds) / PERIOD)
    return Course(*(column[:count] for column in (found.x, found.z, found.spindle, found.cuts)))


def chip_of(course: Course) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return feed [m a turn], depth [m] and cutting speed [m/s] of a course along a round stock, from which each pass takes its layer."""
    standing = np.full(CELLS, STOCK)
    depth = np.zeros(len(course.x))
    places = np.floor((course.z - FACE) / LENGTH * CELLS).astype(int)
    for k in range(1, len(places)):
        low, high = sorted((places[k - 1], places[k]))
        if 0 <= places[k] < CELLS and course.cuts[k] > 0.5 and course.z[k] > course.z[k - 1]:
            depth[k] = max(0.0, standing[min(places[k] + 1, CELLS - 1)] - course.x[k])
        low, high = max(low, 0), min(high, CELLS - 1)
        if low <= high:
            standing[low : high + 1] = np.minimum(standing[low : high + 1], course.x[k])
    turning = np.abs(course.spindle)
    rate = np.abs(np.gradient(course.z, PERIOD))
    feed = np.where((depth > 0.0) & (turning > 1.0), rate * 2.0 * np.pi / np.maximum(turning, 1.0), 0.0)
    return feed, np.where(feed > 0.0, depth, 0.0), turning * np.maximum(course.x, 0.0)


def _off(random: np.random.Generator, shares: dict[str, float]) -> dict[str, float]:
    return {name: 1.0 + share * float(np.clip(random.standard_normal(), -1.8, 1.8)) for name, share in shares.items()}


class CutTruth:
    """One drawn cut with one thing hidden in it; each recording has noise of its own."""

    lesson = LESSONS / "cut.yaml"

    def __init__(self, key: str, seed: int) -> None:
        self.random = np.random.default_rng([seed, 13])
        sound = CUT._replace(**{name: getattr(CUT, name) * factor for name, factor in _off(self.random, UNCERTAIN_CUT).items()})
        self.hidden: Hidden = CUTTING_EFFECTS[key](self.random, {})
        self.physics = sound._replace(**self.hidden.changes)
        self.noise = float(self.random.uniform(1.0, 4.0)), float(self.random.uniform(0.3, 2.0))

    def record(self, lesson: Path | str, place: Path, registry: Registry) -> float:
        """Run the program of a lesson, write what would be recorded, and return how long it took [s]."""
        feed, depth, speed = chip_of(course_of(lesson))
        samples = len(feed)
        forces = simulate_cutting(self.physics, feed, depth, speed)
        white, slow = self.noise
        read = [row + white * self.random.standard_normal(samples) + coloured_noise(self.random, samples, slow, 3.0) for row in forces]
        columns = [PERIOD * np.arange(samples), 1e3 * feed, 1e3 * depth, 60.0 * speed, *(np.round(row / 0.064) * 0.064 for row in read)]
        header = "time,feed,depth,speed,main,thrust,feed_force"
        np.savetxt(place, np.column_stack(columns), delimiter=",", header=header, comments="", fmt="%.10g")
        return PERIOD * (samples - 1)


class SpindleTruth:
    """One drawn spindle with one thing hidden in it; each recording has noise of its own."""

    lesson = LESSONS / "spindle.yaml"

    def __init__(self, key: str, seed: int) -> None:
        self.random = np.random.default_rng([seed, 14])
        off = _off(self.random, UNCERTAIN_SPINDLE)
        sound = SPINDLE._replace(**{name: getattr(SPINDLE, name) * factor for name, factor in off.items()})
        self.hidden: Hidden = SPINDLE_EFFECTS[key](self.random, RIG)
        self.physics = sound._replace(**self.hidden.changes)
        self.unrest = RIG["rated"] * log_uniform(self.random, 5e-4, 3e-3), log_uniform(self.random, 2.0, 10.0)

    def record(self, lesson: Path | str, place: Path, registry: Registry) -> float:
        """Run the program of a lesson, write what would be recorded, and return how long it took [s]."""
        wanted = np.ascontiguousarray(course_of(lesson).spindle)
        samples = len(wanted)
        noise, nothing = self.random.standard_normal((2, samples)), np.zeros(0)
        unrest = coloured_noise(self.random, samples, *self.unrest)
        asked = simulate_spindle(self.physics, wanted, np.zeros(samples), unrest, noise, nothing)[0]
        step = RIG["peak"] / 32768.0
        torque = np.round(asked / step) * step
        _, encoder, volts = simulate_spindle(self.physics, wanted, np.zeros(samples), unrest, noise, torque)
        columns = [PERIOD * np.arange(samples), torque, encoder, volts]
        np.savetxt(place, np.column_stack(columns), delimiter=",", header="time,torque,encoder,tachometer", comments="", fmt="%.10g")
        return PERIOD * (samples - 1)
