"""The work item of the benchmark: the two-axis lathe on the 18.5 s program, given alike to the engine and to its peers."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.engine.run_arrays import draw_noise
from lathesim.engine.wiring import Plan, wire

LESSON = "01_contour_error"
VARIANT = "V"
SEED = 7
ENCODER_COUNT = 1e-6
"""Length of one encoder count [m]; peers must agree with the engine to one."""
SETTINGS: dict[str, str | float] = {
    "x_dac.bits": 12.0, "z_dac.bits": 12.0, "tachometer.noise": "20 mV", "x_axis.disturbance_gain": "1 um/(s*N)",
    "z_axis.disturbance_gain": "1 um/(s*N)",
}  # fmt: skip
FORCE_CONTROLLER = "NonlinearProcessController"
WANTED_FORCE = 720.0
"""Cutting force [N] that the force controller holds; with it the program takes about as long as without."""
CHANNELS = (
    "interpolator.x_reference", "interpolator.z_reference", "interpolator.feed_speed", "interpolator.spindle_reference",
    "interpolator.segment_number", "interpolator.cutting_block",
    "x_encoder.position", "x_controller.error", "x_dac.voltage", "x_axis.position", "x_axis.velocity",
    "z_encoder.position", "z_controller.error", "z_dac.voltage", "z_axis.position", "z_axis.velocity",
    "cross_coupling.voltage", "contour.contour_error", "tachometer_adc.reading", "spindle_dac.voltage", "spindle.speed",
    "cutting.depth_of_cut", "cutting.feed", "cutting.cutting_speed",
    "cutting_force.cutting_force", "cutting_force.longitudinal_force", "cutting_force.radial_force",
    "load.torque", "tool_wear.flank_wear", "surface_finish.roughness",
)  # fmt: skip


@dataclass(frozen=True)
class Work:
    """What every contestant is given: plan (for the engine), parameters by ``part.name`` and path (for the others), all SI.

    ``noise`` maps ``part.noise`` to its numbers, ``samples`` is the number of sample instants with the first at t = 0.
    """

    plan: Plan
    parameters: Mapping[str, float]
    path: np.ndarray[Any, np.dtype[np.float64]]
    noise: Mapping[str, np.ndarray[Any, np.dtype[np.float64]]]
    samples: int
    period: float
    step: float
    steps: int
    channels: tuple[str, ...]
    seed: int = SEED

    @property
    def duration(self) -> float:
        """Simulated time [s]."""
        return (self.samples - 1) * self.period


def lathe_plan() -> Plan:
    """Return the work item's machine: both axes, spindle, cutting force, wear, contour and force control, noise, 12-bit converters."""
    from lathesim.lessons.assemble import assemble
    from lathesim.lessons.lesson import load_lesson
    from lathesim.plugins import load_registry

    registry = load_registry(installed=False)
    assembly = assemble(load_lesson(LESSON), registry, VARIANT, SETTINGS)
    controller = registry.component(FORCE_CONTROLLER).with_units({"signal": "N"})
    parts = {part.name: part for part in assembly.parts}
    holding = dataclasses.replace(parts["process_controller"], component=controller, parameters={"reference": WANTED_FORCE})
    parts[holding.name] = holding
    return wire(dataclasses.replace(assembly, parts=tuple(parts.values()), record=CHANNELS))


def lathe_work() -> Work:
    """Return the work item, with the number of samples its program takes."""
    from lathesim.engine.run import run

    plan = lathe_plan()
    samples = len(run(plan, seed=SEED))
    names = list(plan.noises)
    noise = dict(zip(names, draw_noise(names, SEED, 0, samples), strict=True))
    parameters = {name: plan.parameter_values[position] for name, position in plan.parameters.items()}
    (path,) = (part.tables["path"] for part in plan.parts.values() if "path" in part.tables)
    return Work(
        plan, parameters, np.ascontiguousarray(path, dtype=float), noise, samples, plan.assembly.sample_period, plan.assembly.step,
        plan.steps_per_sample, plan.channels,
    )  # fmt: skip
