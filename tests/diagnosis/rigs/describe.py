"""The lessons of a rig, written in several ways: from the table's side, from the motor's side, and as one axis of a whole lathe."""

from __future__ import annotations

from dataclasses import dataclass

from tests.diagnosis.rigs.machines import Rig
from tests.diagnosis.rigs.plant import CASCADE, Physics

SIGMA = {"inertia": 0.05, "viscous": 0.15, "torque_constant": 0.02, "resistance": 0.02}
"""Declared standard deviations, as shares. The inertia of a lathe's axis is that of motor, screw and table together."""
FAR = 0.2
"""Where the axis of a lathe stands [m] that does not move: away from the part."""
MOTOR_SHARE, MOTOR_DRAG = 0.6, 0.2
"""Shares of the inertia and of the friction that stand on the motor's shaft, where a description splits them."""


@dataclass(frozen=True)
class Given:
    """What a lesson says of the machine, after the errors of whoever wrote it down: factors on the true values."""

    inertia: float = 1.0
    viscous: float = 1.0
    torque_constant: float = 1.0
    resistance: float = 1.0

    def of(self, p: Physics) -> Physics:
        """Return the physics that the lesson tells."""
        return p._replace(
            inertia=p.inertia * self.inertia, viscous=p.viscous * self.viscous, torque_constant=p.torque_constant * self.torque_constant,
            resistance=p.resistance * self.resistance,
        )  # fmt: skip


def machine_files(rig: Rig, description: str) -> dict[str, str]:
    """Return the templates that a lesson needs beside it."""
    if description == "motor" and rig.kind == "spindle":
        return {"rig_machine.yaml": _MOTOR_SPINDLE}
    if description == "motor":
        return {"rig_machine.yaml": _MOTOR_AXIS}
    if description == "table" and rig.kind == "spindle":
        return {"rig_machine.yaml": _TABLE_SPINDLE}
    return {"rest.nc": "N10 G90 G94 G71\nN20 G00 X160.0 Z0.0\n"} if description == "lathe" else {}


def lesson(rig: Rig, description: str, given: Given, units: dict[str, str] | None = None) -> str:
    """Return the lesson of a rig in one description; ``units`` replaces the units of columns."""
    p = given.of(rig.physics)
    axis = rig.name.rpartition("_")[2] if description == "lathe" else "x"
    machine = {"lathe": "two_axis_lathe_analytical", "table": "cascade_axis", "motor": "rig_machine"}[description]
    if rig.kind == "spindle":
        machine = "rig_machine"
    lines = [f"lesson: {rig.name}", f"machine: {machine}", f"sample_period: {_ms(p.period)}", f"step: {_ms(_step(rig, p))}"]
    lines += [] if description != "lathe" else ["program: rest.nc"]
    if p.law < CASCADE and description in ("table", "motor") and rig.kind != "spindle":
        lines.append("replace: {x_controller: PositionController}")
    values = _drive(rig, p, description, axis)
    if rig.kind != "spindle":
        values |= _control(p, axis)
    if description == "lathe":
        values |= {f"{_other(axis)}_axis.travel": f"{FAR:g} m"}
    lines += ["set:", *(f"  {name}: {text}" for name, text in values.items())]
    lines += ["recordings:", "  time: {column: t, unit: s}", *_columns(rig, description, axis, units or {})]
    lines += ["uncertain:", *(f"  {name}: {100.0 * share:.3g} %" for name, share in _uncertain(rig, p, description, axis).items())]
    return "\n".join(lines) + "\n"


def _other(axis: str) -> str:
    return "z" if axis == "x" else "x"


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.10g} ms"


def _step(rig: Rig, p: Physics) -> float:
    """Return an integration step that the fastest pole of the rig allows, a whole part of the period."""
    electric = p.torque_constant * (p.amplifier * p.tachometer + p.voltage_constant) / p.resistance
    fastest = (electric + p.viscous) / p.inertia
    parts = max(2, int(p.period * fastest / 0.5) + 1)
    return p.period / parts


def _drive(rig: Rig, p: Physics, description: str, axis: str) -> dict[str, str]:
    if description == "table":
        flow, force = ("V/(rad/s)", "N*m/A") if rig.kind == "spindle" else ("V*s/m", "N/A")
        body = "spindle" if rig.kind == "spindle" else "x_axis"
        drive = "spindle_drive" if rig.kind == "spindle" else "x_drive"
        values = {
            f"{drive}.conductance": f"{p.amplifier / p.resistance:.9g} A/V",
            f"{drive}.back_emf": f"{(p.tachometer + p.voltage_constant / p.amplifier) / p.ratio:.9g} {flow}",
            f"{drive}.effort_constant": f"{p.torque_constant / p.ratio:.9g} {force}",
        }
        if rig.kind == "spindle":
            return values | {"spindle.inertia": f"{p.inertia:.9g} kg*m^2", "spindle.viscous": f"{p.viscous:.9g} N*m*s/rad"}
        return values | {f"{body}.mass": f"{p.inertia / p.ratio**2:.9g} kg", f"{body}.viscous": f"{p.viscous / p.ratio**2:.9g} N*s/m"}
    part = "spindle" if rig.kind == "spindle" else f"{axis}_axis"
    # what a description is sure of is right: the error is in the motor's inertia, and in the friction behind it
    rest, drag = (1.0 - MOTOR_SHARE) * rig.physics.inertia, MOTOR_DRAG * rig.physics.viscous
    values = {
        f"{part}.resistance": f"{p.resistance:.9g} ohm", f"{part}.amplifier_gain": f"{p.amplifier:.9g}",
        f"{part}.torque_constant": f"{p.torque_constant:.9g} N*m/A", f"{part}.voltage_constant": f"{p.voltage_constant:.9g} V*s/rad",
        f"{part}.tachometer_gain": f"{p.tachometer:.9g} V*s/rad", f"{part}.largest_current": "1000 A",
        f"{part}.smallest_current": "-1000 A",
        f"{part}.gear": "1", f"{part}.motor_inertia": f"{p.inertia - rest:.9g} kg*m^2",
        f"{part}.motor_viscous": f"{drag:.9g} N*m*s/rad",
    }  # fmt: skip
    if rig.kind == "spindle":
        return values | {
            "spindle.spindle_inertia": f"{rest:.9g} kg*m^2", "spindle.spindle_viscous": f"{p.viscous - drag:.9g} N*m*s/rad",
        }  # fmt: skip
    return values | {
        f"{part}.lead": f"{p.ratio:.12g} m/rad", f"{part}.screw_inertia": "0 kg*m^2", f"{part}.screw_viscous": "0 N*m*s/rad",
        f"{part}.mass": f"{rest / p.ratio**2:.9g} kg", f"{part}.table_viscous": f"{(p.viscous - drag) / p.ratio**2:.9g} N*s/m",
    }  # fmt: skip


def _control(p: Physics, axis: str) -> dict[str, str]:
    values = {f"{axis}_dac.bits": f"{p.bits:g}", f"{axis}_encoder.resolution": f"{p.encoder:.6g} m"}
    if p.law == CASCADE:
        return values | {
            f"{axis}_controller.position_gain": f"{p.position_gain:g} 1/s",
            f"{axis}_controller.velocity_gain": f"{p.velocity_gain:g} V*s/m",
            f"{axis}_controller.integral_rate": f"{p.integral_rate:g} 1/s",
        }  # fmt: skip
    return values | {
        f"{axis}_controller.proportional": f"{p.proportional:g} V/m", f"{axis}_controller.integral": f"{p.integral:g} V/(m*s)",
        f"{axis}_controller.derivative_gain": f"{p.derivative:g} V*s/m",
    }  # fmt: skip


def _columns(rig: Rig, description: str, axis: str, units: dict[str, str]) -> list[str]:
    p = rig.physics
    if rig.kind == "spindle":
        load = "spindle.disturbance" if description == "table" else "spindle.torque"
        return [
            "  drive:", "    command.command: {column: u, unit: V}", f"    {load}: {{column: load, unit: N*m, held: true}}",
            "  compare:", f"    spindle_encoder.angle: {{column: q, unit: rad, resolution: {p.encoder:.9g} rad}}",
            f"    spindle{'_drive' if description == 'table' else ''}.current: {{column: i, unit: A, resolution: {p.current_step:g} A}}",
        ]  # fmt: skip
    lines = ["  drive:", f"    {axis}_controller.reference: {{column: r, unit: m}}"]
    lines += [f"    {_other(axis)}_controller.reference: {{column: other, unit: m}}"] if description == "lathe" else []
    lines += ["  compare:", f"    {axis}_controller.voltage: {{column: u, unit: V}}"]
    lines += [f"    {axis}_encoder.position: {{column: q, unit: {units.get('q', 'm')}, resolution: {p.encoder:g} m}}"]
    lines += [
        f"    {axis}_{'drive' if description == 'table' else 'axis'}.current: {{column: i, unit: A, resolution: {p.current_step:g} A}}"
    ]
    if rig.scale and description != "lathe":
        lines += [f"    x_scale.position: {{column: s, unit: {units.get('s', 'm')}, resolution: {p.scale:g} m}}"]
    return lines


def _uncertain(rig: Rig, p: Physics, description: str, axis: str) -> dict[str, float]:
    spindle = rig.kind == "spindle"
    if description == "table":
        body, mass = ("spindle", "inertia") if spindle else ("x_axis", "mass")
        drive = "spindle_drive" if spindle else "x_drive"
        return {
            f"{body}.{mass}": SIGMA["inertia"], f"{body}.viscous": SIGMA["viscous"], f"{drive}.effort_constant": SIGMA["torque_constant"],
            f"{drive}.conductance": SIGMA["resistance"],
        }  # fmt: skip
    part = "spindle" if spindle else f"{axis}_axis"
    rest = "spindle_viscous" if spindle else "table_viscous"
    uncertain_inertia = p.inertia - (1.0 - MOTOR_SHARE) * rig.physics.inertia
    uncertain_drag = p.viscous - MOTOR_DRAG * rig.physics.viscous
    return {
        f"{part}.motor_inertia": SIGMA["inertia"] * p.inertia / uncertain_inertia,
        f"{part}.{rest}": SIGMA["viscous"] * p.viscous / uncertain_drag,
        f"{part}.torque_constant": SIGMA["torque_constant"], f"{part}.resistance": SIGMA["resistance"],
    }  # fmt: skip


_MOTOR_AXIS = """\
machine: An axis from its motor
sample_period: 1 ms
step: 0.25 ms
parts:
  x_encoder: {component: LinearEncoder}
  x_controller: {component: CascadeController}
  x_dac: {component: DAConverter, set: {bits: 12, smallest_voltage: -10 V, largest_voltage: 10 V}}
  x_axis: {component: AnalyticalAxis}
  x_scale: {component: LinearEncoder}
wires:
  x_controller.reference: 0 m
  x_controller.measured: x_encoder.position
  x_dac.command: x_controller.voltage
  x_encoder.measured: x_axis.position
  x_scale.measured: x_axis.position
  x_axis.voltage: x_dac.voltage
"""

_MOTOR_SPINDLE = """\
machine: A spindle from its motor
sample_period: 1 ms
step: 0.25 ms
parts:
  command: {component: DAConverter, set: {bits: 24, smallest_voltage: -10 V, largest_voltage: 10 V}}
  spindle: {component: AnalyticalSpindle}
  spindle_encoder: {component: AngularEncoder}
wires:
  command.command: 0 V
  spindle.torque: 0 N*m
  spindle_encoder.measured: spindle.angle
  spindle.voltage: command.voltage
"""

_TABLE_SPINDLE = """\
machine: A spindle behind its drive
sample_period: 1 ms
step: 0.25 ms
parts:
  command: {component: DAConverter, set: {bits: 24, smallest_voltage: -10 V, largest_voltage: 10 V}}
  spindle_drive: {component: VoltageDrive, units: {effort: N*m, flow: rad/s}}
  spindle: {component: TorqueSpindle}
  spindle_encoder: {component: AngularEncoder}
wires:
  command.command: 0 V
  spindle.disturbance: 0 N*m
  spindle_encoder.measured: spindle.angle
  spindle_drive.voltage: command.voltage
  spindle_drive.velocity: spindle.speed
  spindle.torque: spindle_drive.effort
"""
