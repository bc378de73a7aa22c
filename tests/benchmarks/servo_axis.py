"""The servo axis of the diagnosis lessons, 25 s at 1 kHz with four RK4 steps a sample: as a plan, and written by hand in C.

The C has the same additions in the same order, so its numbers are the engine's bit for bit. It is written to a temporary folder and
compiled where it is wanted; its parameters of one run stand in rows of so many lanes, and a loop over the lanes is innermost.
"""

from __future__ import annotations

import ctypes
import dataclasses
import math
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.component import Component, DiscreteState, Input, Output, Parameter
from lathesim.engine.assembly import Assembly, FloatArray, Part, Wire
from lathesim.engine.wiring import Plan, wire

SECONDS = 25.0
VARIED = ("x_axis.mass", "x_axis.viscous", "x_controller.position_gain", "x_controller.velocity_gain", "x_drive.effort_constant")
"""What differs between the runs."""
RECORDED = ("x_encoder.position", "x_scale.position", "x_controller.voltage", "x_drive.current")
FRICTIONS: dict[str, tuple[tuple[str, dict[str, float]], ...]] = {
    "stick-slip": (("CoulombFriction", {"level": 20.0}),),
    "stick-slip with exp": (
        ("CoulombFriction", {"level": 20.0}),
        ("StribeckFriction", {"excess": 10.0, "stribeck_velocity": 0.005, "shape": 1.0}),
    ),
}
"""Effects that are put on the axis."""
FLAGS = ("-O3", "-march=native", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-shared", "-fPIC")
"""No fast mathematics; no errno and no traps, as in what numba makes."""


class BackAndForth(Component):
    """Gives a reference that goes back and forth at one speed:  r = 2 amplitude |p - floor(p + 1/2)|,  p = frequency t."""

    now = DiscreteState("m", doc="reference of this sample")
    reference = Output("m", doc="reference position")
    amplitude = Parameter("m", 0.1, doc="way between the ends")
    frequency = Parameter("Hz", 0.5, doc="times there and back in a second")

    @staticmethod
    def update(time: float, amplitude: float, frequency: float) -> float:
        """The triangle of this instant."""
        phase = frequency * time
        return amplitude * abs(2.0 * (phase - math.floor(phase + 0.5)))

    @staticmethod
    def output(now: float) -> float:
        """Hold over the sample."""
        return now


class SmoothFriction(Component):
    """A friction without sticking, as simple models have it:  F = level tanh(v / smoothing)."""

    flow = Input("m/s", doc="speed of the table")
    force = Output("N", doc="friction")
    level = Parameter("N", 20.0, low=0.0, doc="size of the friction")
    smoothing = Parameter("m/s", 0.002, low=1e-9, doc="speed at which three quarters of it act")

    @staticmethod
    def output(flow: float, level: float, smoothing: float) -> float:
        """The law."""
        return level * math.tanh(flow / smoothing)


def servo_plan(friction: str = "") -> Plan:
    """Return the axis with one of ``FRICTIONS``, with "tanh" a smooth one, or with viscous friction alone."""
    from lathesim.lessons.insertion import insert_effect
    from lathesim.lessons.lesson import load_machine
    from lathesim.lessons.simulate import check_machine
    from lathesim.plugins import load_registry
    from lathesim.shipped import shipped_folder

    registry = load_registry(installed=False)
    assembly = check_machine(load_machine(shipped_folder("lesson_configs") / "machines" / "cascade_axis.yaml"), registry).assembly
    wires = [item for item in assembly.wires if item.target != "x_controller.reference"]
    wires.append(Wire("x_controller.reference", "source.reference"))
    parts = [*assembly.parts, Part("source", BackAndForth)]
    if friction == "tanh":
        parts.append(Part("friction", SmoothFriction))
        wires += [Wire("friction.flow", "x_axis.velocity"), Wire("x_axis.disturbance", "friction.force")]
    machine: Assembly = dataclasses.replace(assembly, parts=tuple(parts), wires=tuple(wires), record=RECORDED)
    for name, values in FRICTIONS.get(friction, ()):
        machine = insert_effect(machine, registry.effects[name], "x_axis", parameters=values)
    return wire(machine)


def samples_of(plan: Plan) -> int:
    """Return how many samples a run has."""
    return round(SECONDS / plan.assembly.sample_period) + 1


def spread(plan: Plan, names: Sequence[str], runs: int) -> FloatArray:
    """Return values (runs, names) within 5 % of those of the plan."""
    given = np.array([plan.values[name] for name in names])
    return np.asarray(given * np.random.default_rng(1).uniform(0.95, 1.05, (runs, len(names))))


_GIVEN = (
    "x_encoder.resolution", "x_scale.resolution", "x_controller.integral_rate", "x_controller.mean_share", "x_controller.limit",
    "x_controller.start_speed", "x_dac.smallest_voltage", "x_dac.largest_voltage", "x_dac.bits", "x_drive.conductance",
    "x_drive.back_emf", "x_axis.disturbance", "source.amplitude", "source.frequency",
)  # fmt: skip
_TEXT = r"""
#include <math.h>
#define EACH for (int l = 0; l < LANES; l++)

void axis(const double *given, const double *varied, long count, double period, double step, int steps, long between, double *record)
{
    const double fine = given[0], scale_fine = given[1], integral_rate = given[2], mean_share = given[3], limit = given[4];
    const double start_speed = given[5], low = given[6], high = given[7], bits = given[8], conductance = given[9], back_emf = given[10];
    const double disturbance = given[11], amplitude = given[12], frequency = given[13];
    const double weights[4] = {1.0, 2.0, 2.0, 1.0}, reaches[4] = {0.5 * step, 0.5 * step, 1.0 * step, 0.5 * step};
    const double share = step / 6.0, quantum = (high - low) / (pow(2.0, bits) - 1.0);
    double mass[LANES], viscous[LANES], position_gain[LANES], velocity_gain[LANES], effort_constant[LANES];
    double speed[LANES], travel[LANES], filtered[LANES], before[LANES], integral[LANES], held[LANES];
    double stage[LANES], speed_sum[LANES], travel_sum[LANES];
    EACH {
        mass[l] = varied[l], viscous[l] = varied[LANES + l], position_gain[l] = varied[2 * LANES + l];
        velocity_gain[l] = varied[3 * LANES + l], effort_constant[l] = varied[4 * LANES + l];
        speed[l] = travel[l] = filtered[l] = before[l] = integral[l] = 0.0;
    }
    for (long sample = 0; sample < count; sample++) {
        const double time = sample * period, phase = frequency * time;
        const double reference = amplitude * fabs(2.0 * (phase - floor(phase + 0.5)));
        EACH {
            const double place = travel[l];
            double counted = fine * floor(place / fine + 0.5), scale = scale_fine * floor(place / scale_fine + 0.5);
            counted = fine <= 0.0 || !(fabs(place) < 1e15 * fine) ? place : counted;
            scale = scale_fine <= 0.0 || !(fabs(place) < 1e15 * scale_fine) ? place : scale;
            const double last = time <= 0.0 ? counted - start_speed * period : before[l];
            const double smooth = time <= 0.0 ? last - mean_share * start_speed * period : filtered[l];
            const double mean = (1.0 - mean_share) * counted + mean_share * last;
            const double speed_error = position_gain[l] * (reference - counted) - (mean - smooth) / period;
            const double summed = integral[l] + velocity_gain[l] * integral_rate * period * speed_error;
            const double command = velocity_gain[l] * speed_error + summed;
            const double voltage = command > limit ? limit : command < -limit ? -limit : command;
            integral[l] = command > limit || command < -limit ? integral[l] : summed;
            filtered[l] = mean;
            before[l] = counted;
            double level = low + floor((voltage - low) / quantum + 0.5) * quantum;
            level = voltage != voltage ? voltage : level;
            level = voltage >= high ? high : level;
            held[l] = voltage <= low || quantum <= 0.0 ? low : level;
            double *row = record + l * between + 4 * sample;
            row[0] = counted, row[1] = scale, row[2] = voltage, row[3] = conductance * (held[l] - back_emf * speed[l]);
        }
        for (int substep = 0; substep < steps; substep++) {
            EACH stage[l] = speed[l], speed_sum[l] = -0.0, travel_sum[l] = -0.0;
            for (int k = 0; k < 4; k++) EACH {
                const double effort = effort_constant[l] * (conductance * (held[l] - back_emf * stage[l]));
                const double rate = (effort - viscous[l] * stage[l] - disturbance) / mass[l];
                speed_sum[l] = speed_sum[l] + weights[k] * rate;
                travel_sum[l] = travel_sum[l] + weights[k] * stage[l];
                stage[l] = speed[l] + reaches[k] * rate;
            }
            EACH {
                speed[l] = speed[l] + share * speed_sum[l];
                travel[l] = travel[l] + share * travel_sum[l];
            }
        }
    }
}
"""


def no_compiler() -> str:
    """Return why the C cannot be measured here; empty where it can."""
    return "" if shutil.which("gcc") else "gcc is not installed"


def servo_in_c(plan: Plan, lanes: int) -> Callable[[FloatArray], FloatArray]:
    """Return the axis in C for so many lanes: values (lanes, VARIED) to a record (lanes, samples, RECORDED), used again by the next call.

    Raises ``subprocess.CalledProcessError`` where the compiler refuses it.
    """
    with tempfile.TemporaryDirectory() as folder:
        source, built = Path(folder) / "axis.c", Path(folder) / "axis.so"
        source.write_text(_TEXT, encoding="utf-8")
        command = ["gcc", f"-DLANES={lanes}", *FLAGS, str(source), "-o", str(built), "-lm"]
        subprocess.run(command, check=True, capture_output=True, text=True)
        library = ctypes.CDLL(str(built))
    samples, assembly = samples_of(plan), plan.assembly
    given = np.array([plan.values[name] for name in _GIVEN])
    between = len(RECORDED) * samples + 8
    record = np.zeros((lanes, between))

    def address(array: FloatArray) -> Any:
        return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))

    def run(values: FloatArray) -> FloatArray:
        varied = np.ascontiguousarray(values.T)
        period, step = (ctypes.c_double(value) for value in (assembly.sample_period, assembly.step))
        count, apart = ctypes.c_long(samples), ctypes.c_long(between)
        library.axis(address(given), address(varied), count, period, step, plan.assembly.steps_per_sample, apart, address(record))
        return np.asarray(record[:, : between - 8].reshape(lanes, samples, len(RECORDED)))

    return run
