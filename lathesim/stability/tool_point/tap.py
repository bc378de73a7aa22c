"""A tap test in the engine: a hammer hits the tool point some times, and force and response are read through filters of a data logger."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lathesim.components.chatter import ImpactHammer, ToolMode
from lathesim.components.sensors import Accelerometer, SampledSensor
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.engine.wiring import Plan, wire
from lathesim.errors import LessonError
from lathesim.record import FloatArray
from lathesim.stability.tool_point.frequency_response import Quantity
from lathesim.stability.tool_point.modes import ToolPoint

_FEWEST_STEPS, _MOST_STEPS = 8, 32
_ANGLE_OF_A_STEP = 0.04
"""Angle [rad] that the fastest mode turns in an RK4 step a: its frequency is then right within a^4/120 = 2e-8, less than noise hides."""
_BAND = 0.2
"""Corner of the filters over the sample rate."""
START = 0.01
"""Silence before a hit [s], from which the noise is known."""


@dataclass(frozen=True)
class TapSettings:
    """How it is tapped: number of hits, mean peak [N] and its scatter, contact [s], sample rate [Hz], length of a record [s], noise of
    force [N] and of the response [SI], chance of a double hit, range of the force [N], and what the response is."""

    hits: int = 5
    peak: float = 800.0
    scatter: float = 0.1
    contact: float = 4e-4
    rate: float = 12800.0
    length: float = 2.0
    force_noise: float = 0.5
    response_noise: float = 2e-9
    double_hits: float = 0.0
    force_range: float = 5000.0
    sensor: Quantity = "receptance"


@dataclass(frozen=True, eq=False)
class TapRecord:
    """Records of hits: force [N] and response [m or m/s^2], both (hits, samples), and the sample rate [Hz].

    ``truth`` says of each hit whether it was a double one, where it was simulated.
    """

    force: FloatArray
    response: FloatArray
    rate: float
    quantity: Quantity
    force_range: float = math.inf
    truth: tuple[bool, ...] = ()


def tap(tool: ToolPoint, settings: TapSettings, seed: int) -> TapRecord:
    """Return the records of a tap test of a tool point along the normal. Each hit is a run; its peak and bounce are drawn by ``seed``."""
    highest = max(mode.frequency for mode in tool.modes)
    if highest > 0.4 * settings.rate:
        fact = f"a mode at {highest:.0f} Hz cannot be seen at {settings.rate:.0f} samples a second."
        raise LessonError(fact, remedy=f"Use a rate of at least {math.ceil(highest / 0.3):d} Hz.")
    from lathesim.engine.running.run import run

    plan = _plan(tool, settings)
    chance = np.random.Generator(np.random.Philox(seed))
    samples = round(settings.length * settings.rate)
    forces, responses, doubled = np.zeros((settings.hits, samples)), np.zeros((settings.hits, samples)), []
    for hit in range(settings.hits):
        double = bool(chance.random() < settings.double_hits)
        values = {
            "hammer.peak": settings.peak * math.exp(settings.scatter * chance.standard_normal()),
            "hammer.start": START + chance.random() / settings.rate,
            "hammer.bounce": chance.uniform(0.1, 0.7) if double else 0.0,
            "hammer.bounce_delay": chance.uniform(4.0, 40.0) * settings.contact,
        }
        doubled.append(double)
        record = run(plan, duration=settings.length, seed=seed * 1009 + hit, overrides=values, engine="compiled")
        forces[hit] = record["load_cell.reading"][:samples]
        responses[hit] = record["sensor.reading"][:samples]
    return TapRecord(forces, responses, settings.rate, settings.sensor, settings.force_range, tuple(doubled))


def _plan(tool: ToolPoint, settings: TapSettings) -> Plan:
    last = f"mode_{len(tool.modes)}"
    parts = [Part("hammer", ImpactHammer, {"contact": settings.contact})]
    wires = []
    for number, (mode, factor) in enumerate(zip(tool.modes, tool.factors, strict=True), 1):
        # the tap goes along the normal: a mode of factor mu answers with mu/k
        values = {"frequency": mode.frequency, "damping": mode.damping, "stiffness": mode.stiffness, "force_angle": math.acos(factor)}
        parts.append(Part(f"mode_{number}", ToolMode, values))
        wires.append(Wire(f"mode_{number}.force", "hammer.force"))
        if number > 1:
            for name, output in (("before", "displacement"), ("before_rate", "velocity"), ("before_acceleration", "acceleration")):
                wires.append(Wire(f"mode_{number}.{name}", f"mode_{number - 1}.{output}"))
    band = {"bandwidth": _BAND * settings.rate}
    force = {**band, "noise": settings.force_noise, "range": settings.force_range}
    parts.append(Part("load_cell", SampledSensor.with_units({"signal": "N"}), force))
    wires.append(Wire("load_cell.measured", "hammer.force"))
    if settings.sensor == "accelerance":
        parts.append(Part("sensor", Accelerometer, {**band, "noise": settings.response_noise}))
        wires.append(Wire("sensor.measured", f"{last}.acceleration"))
    else:
        unit, output = ("m", "displacement") if settings.sensor == "receptance" else ("m/s", "velocity")
        parts.append(Part("sensor", SampledSensor.with_units({"signal": unit}), {**band, "noise": settings.response_noise}))
        wires.append(Wire("sensor.measured", f"{last}.{output}"))
    period = 1.0 / settings.rate
    recorded = ("load_cell.reading", "sensor.reading")
    return wire(Assembly(tuple(parts), tuple(wires), period, period / _steps(tool, settings), record=recorded))


def _steps(tool: ToolPoint, settings: TapSettings) -> int:
    """Return the RK4 steps of a sample."""
    fastest = 2.0 * math.pi * max(mode.frequency for mode in tool.modes) / settings.rate
    return min(max(math.ceil(fastest / _ANGLE_OF_A_STEP), _FEWEST_STEPS), _MOST_STEPS)
