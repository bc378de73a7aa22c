"""The axis of lesson 22 as another integrator makes it: with the lesson's controller and numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import Registry
from tests.experiments.separation.axis_rig import AxisPhysics, simulate_axis
from tests.experiments.separation.concealed import Hidden, coloured_noise, log_uniform
from tests.experiments.separation.hidden_axis import AXIS_EFFECTS

LESSON = "22_what_is_wrong_with_this_machine"
REFERENCE = "exercise.x_reference"
GIVEN = AxisPhysics(
    mass=95.1089, viscous=203.5034, effort_constant=35.15065, position_gain=160.18, velocity_gain=243.45, converter_bits=24.0,
    encoder_resolution=5e-8, scale_resolution=5e-8, encoder_noise=2e-8, scale_noise=5e-8, current_noise=0.005, current_resolution=0.002,
)  # fmt: skip
UNCERTAIN = {"mass": 0.03, "viscous": 0.15, "effort_constant": 0.01}
RIG = {"rated": 351.5, "lead": 0.005, "acceleration": 2.0, "mass": 95.1, "viscous": 203.5, "bandwidth": 90.0}


class AxisTruth:
    """One drawn machine with one thing hidden in it; each recording has noise of its own."""

    lesson = LESSON

    def __init__(self, key: str, seed: int) -> None:
        self.random = np.random.default_rng([seed, 12])
        off = {name: 1.0 + share * float(np.clip(self.random.standard_normal(), -1.8, 1.8)) for name, share in UNCERTAIN.items()}
        self.sound = GIVEN._replace(**{name: getattr(GIVEN, name) * factor for name, factor in off.items()})
        self.hidden: Hidden = AXIS_EFFECTS[key](self.random, RIG)
        self.skew = self.hidden.changes.get("@skew_scale", 0.0)
        self.physics = self.sound._replace(**{name: value for name, value in self.hidden.changes.items() if not name.startswith("@")})
        self.load = 10.0 * 35.0 * log_uniform(self.random, 2e-4, 2e-3), log_uniform(self.random, 1.0, 10.0)

    def record(self, lesson: Path | str, place: Path, registry: Registry) -> float:
        """Run the program of a lesson, write what would be recorded, and return how long it took [s]."""
        run = run_prepared(prepare(load_lesson(str(lesson)), registry), engine="compiled")
        reference = np.asarray(run[REFERENCE], dtype=float)
        samples = len(reference)
        load = coloured_noise(self.random, samples, *self.load)
        signals = simulate_axis(self.physics, reference, self.random.standard_normal((3, samples)), load)
        time = run.time
        table = np.interp(time - self.skew * time, time, signals.scale) if self.skew else signals.scale
        columns = [time, 1e3 * reference, 1e3 * signals.encoder, 1e3 * table, signals.command, signals.current]
        header = "time,reference,motor,table,voltage,current"
        np.savetxt(place, np.column_stack(columns), delimiter=",", header=header, comments="", fmt="%.10g")
        return float(time[-1])
