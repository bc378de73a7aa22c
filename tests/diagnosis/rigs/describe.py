"""The lessons of a rig: from the table's side, from the motor's side, and as a whole lathe of which one axis or both move."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from tests.diagnosis.rigs.machines import Rig
from tests.diagnosis.rigs.plant import FEED_FORWARD, PID_MEASURED, SPEED, Physics

SIGMA = {"inertia": 0.05, "viscous": 0.15, "torque_constant": 0.02, "resistance": 0.02}
"""Declared standard deviations, as shares. The inertia of a lathe's axis is that of motor, screw and table together."""
FAR = 0.2
"""Where the axis of a lathe stands [m] that does not move: away from the part."""
MOTOR_SHARE, MOTOR_DRAG = 0.6, 0.2
"""Shares of the inertia and of the friction that stand on the motor's shaft, where a description splits them."""
PARTS = Path(__file__).parent / "parts"
OF_A_CASE = ("FeedforwardCascade", "IntegralProportional", "MeasuredDerivative", "AngleController")
"""Controllers that no lesson finds in the program: a case brings the file of them along."""


class Given(NamedTuple):
    """What a lesson says of the machine, after the errors of whoever wrote it down: factors on the true values."""

    inertia: float = 1.0
    viscous: float = 1.0
    torque_constant: float = 1.0
    resistance: float = 1.0

    def of(self, p: Physics) -> Physics:
        """Return the physics that the lesson tells."""
        return p._replace(**{name: getattr(p, name) * factor for name, factor in self._asdict().items()})


def files(rig: Rig, description: str) -> dict[str, str]:
    """Return what a lesson needs beside it: path in its folder -> text."""
    if description == "lathe":
        return {"rest.nc": "N10 G90 G94 G71\nN20 G00 X160.0 Z0.0\n"}
    made = {"rig_machine.yaml": _template(rig, description)}
    if rig.controller in OF_A_CASE:
        made["parts/controllers.py"] = (PARTS / "controllers.py").read_text(encoding="utf-8")
    return made


def lesson(rig: Rig, description: str, given: Given, given_second: Given) -> str:
    """Return the lesson of a rig in one description."""
    machine = "two_axis_lathe_analytical" if description == "lathe" else "rig_machine"
    period = rig.physics.period
    lines = [f"lesson: {rig.name}", f"machine: {machine}", f"sample_period: {_ms(period)}", f"step: {_ms(period / _parts(rig))}"]
    lines += ["program: rest.nc"] if description == "lathe" else []
    values, shares, driven, compared = _of_axis(rig, rig.physics, given, description, rig.axis, "")
    other = "x" if rig.axis == "z" else "z"
    if description == "lathe" and rig.second:
        more = _of_axis(rig, rig.second, given_second, description, other, "_2")
        values, shares, driven, compared = values | more[0], shares | more[1], driven + more[2], compared + more[3]
    elif description == "lathe":
        values |= {f"{other}_axis.travel": f"{FAR:g} m"}
        driven += [f"    {other}_controller.reference: {{column: other, unit: m}}"]
    lines += ["set:", *(f"  {name}: {text}" for name, text in values.items())]
    lines += ["recordings:", "  time: {column: t, unit: s}", "  drive:", *driven, "  compare:", *compared]
    lines += ["uncertain:", *(f"  {name}: {100.0 * share:.3g} %" for name, share in shares.items())]
    return "\n".join(lines) + "\n"


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.10g} ms"


def _parts(rig: Rig) -> int:
    """Return how many integration steps of a sample the fastest pole allows."""
    fastest = max(
        (p.torque_constant * (p.amplifier * p.tachometer + p.voltage_constant) / p.resistance + p.viscous) / p.inertia
        for p in (rig.physics, rig.second or rig.physics)
    )
    return max(2, int(rig.physics.period * fastest / 0.4) + 1)


def _rotary(rig: Rig) -> bool:
    return rig.kind in ("rotary", "spindle")


_Texts = tuple[dict[str, str], dict[str, float], list[str], list[str]]


def _of_axis(rig: Rig, p: Physics, given: Given, description: str, letter: str, ending: str) -> _Texts:
    """Return values, shares of doubt, driven and compared columns of an axis."""
    believed = given.of(p)
    if description == "table":
        values, shares = _table_side(rig, believed, letter)
    else:
        values, shares = _motor_side(rig, p, believed, letter)
    values |= _control(rig, p, letter)
    place, unit = ("angle", "rad") if _rotary(rig) else ("position", "m")
    wanted = "rad/s" if p.law == SPEED else unit
    driven = [f"    {letter}_controller.reference: {{column: r{ending}, unit: {wanted}}}"]
    driven = [f"    {letter}_dac.command: {{column: u, unit: V}}"] if rig.open else driven
    if rig.kind == "spindle":
        driven += [f"    {letter}_axis.{'disturbance' if description == 'table' else 'torque'}: {{column: load, unit: N*m}}"]
    compared = [] if rig.open else [f"    {letter}_controller.voltage: {{column: u{ending}, unit: V}}"]
    compared += [
        f"    {letter}_encoder.{place}: {{column: q{ending}, unit: {unit}, resolution: {p.encoder:.9g} {unit}}}",
    ]
    if rig.current:
        source = "drive" if description == "table" else "axis"
        compared += [f"    {letter}_{source}.current: {{column: i{ending}, unit: A, resolution: {p.current_step:g} A}}"]
    if rig.scale:
        compared += [f"    {letter}_scale.position: {{column: s, unit: m, resolution: {p.scale:g} m}}"]
    return values, shares, driven, compared


def _table_side(rig: Rig, p: Physics, letter: str) -> tuple[dict[str, str], dict[str, float]]:
    flow, effort = ("V/(rad/s)", "N*m/A") if _rotary(rig) else ("V*s/m", "N/A")
    drive, body = f"{letter}_drive", f"{letter}_axis"
    mass, kilograms, drag = ("inertia", "kg*m^2", "N*m*s/rad") if _rotary(rig) else ("mass", "kg", "N*s/m")
    values = {
        f"{drive}.conductance": f"{p.amplifier / p.resistance:.9g} A/V",
        f"{drive}.back_emf": f"{(p.tachometer + p.voltage_constant / p.amplifier) / p.ratio:.9g} {flow}",
        f"{drive}.effort_constant": f"{p.torque_constant / p.ratio:.9g} {effort}",
        f"{body}.{mass}": f"{p.inertia / p.ratio**2:.9g} {kilograms}",
        f"{body}.viscous": f"{p.viscous / p.ratio**2:.9g} {drag}",
    }
    return values, {
        f"{body}.{mass}": SIGMA["inertia"], f"{body}.viscous": SIGMA["viscous"], f"{drive}.effort_constant": SIGMA["torque_constant"],
        f"{drive}.conductance": SIGMA["resistance"],
    }  # fmt: skip


def _motor_side(rig: Rig, true: Physics, p: Physics, letter: str) -> tuple[dict[str, str], dict[str, float]]:
    """Return what the motor's side is told; what stands behind the motor, and its own friction, are known and right."""
    part = f"{letter}_axis"
    rest, drag = (1.0 - MOTOR_SHARE) * true.inertia, MOTOR_DRAG * true.viscous
    values = {
        f"{part}.resistance": f"{p.resistance:.9g} ohm", f"{part}.amplifier_gain": f"{p.amplifier:.9g}",
        f"{part}.torque_constant": f"{p.torque_constant:.9g} N*m/A", f"{part}.voltage_constant": f"{p.voltage_constant:.9g} V*s/rad",
        f"{part}.tachometer_gain": f"{p.tachometer:.9g} V*s/rad", f"{part}.largest_current": "1000 A",
        f"{part}.smallest_current": "-1000 A", f"{part}.motor_inertia": f"{p.inertia - rest:.9g} kg*m^2",
        f"{part}.motor_viscous": f"{drag:.9g} N*m*s/rad",
    }  # fmt: skip
    behind, held = rest / p.ratio**2, (p.viscous - drag) / p.ratio**2
    if _rotary(rig):
        values |= {f"{part}.gear": f"{p.ratio:.12g}", f"{part}.spindle_inertia": f"{behind:.9g} kg*m^2"}
        values |= {f"{part}.spindle_viscous": f"{held:.9g} N*m*s/rad"}
    else:
        values |= {
            f"{part}.gear": f"{rig.gear:g}", f"{part}.lead": f"{p.ratio / rig.gear:.12g} m/rad", f"{part}.screw_inertia": "0 kg*m^2",
            f"{part}.screw_viscous": "0 N*m*s/rad", f"{part}.mass": f"{behind:.9g} kg", f"{part}.table_viscous": f"{held:.9g} N*s/m",
        }  # fmt: skip
    friction = f"{part}.{'spindle' if _rotary(rig) else 'table'}_viscous"
    return values, {
        f"{part}.motor_inertia": SIGMA["inertia"] * p.inertia / (p.inertia - rest),
        friction: SIGMA["viscous"] * p.viscous / (p.viscous - drag),
        f"{part}.torque_constant": SIGMA["torque_constant"], f"{part}.resistance": SIGMA["resistance"],
    }  # fmt: skip


def _control(rig: Rig, p: Physics, letter: str) -> dict[str, str]:
    control, unit = f"{letter}_controller", "rad" if _rotary(rig) else "m"
    values = {f"{letter}_dac.bits": f"{min(p.bits, 24.0):g}", f"{letter}_encoder.resolution": f"{p.encoder:.9g} {unit}"}
    if rig.open:
        return values
    if rig.controller == "AngleController":
        return values | {f"{control}.proportional": f"{p.gain:g} V/rad"}
    if rig.controller == "SpindleController":
        return values | {f"{control}.proportional": f"{p.gain:g} V*s/rad", f"{control}.integral": f"{p.integral:g} V/rad"}
    if rig.controller in ("CascadeController", "FeedforwardCascade", "IntegralProportional"):
        values |= {f"{control}.share": f"{p.feed_forward:g}"} if rig.controller == "FeedforwardCascade" else {}
        return values | {
            f"{control}.position_gain": f"{p.gain:g} 1/s", f"{control}.velocity_gain": f"{p.velocity_gain:g} V*s/m",
            f"{control}.integral_rate": f"{p.integral:g} 1/s",
        }  # fmt: skip
    if p.law == FEED_FORWARD:
        values |= {f"{control}.velocity_feedforward": f"{p.feed_forward:g} V*s/m"}
    if p.law == PID_MEASURED or p.derivative > 0.0 or p.integral > 0.0:
        values |= {f"{control}.integral": f"{p.integral:g} V/(m*s)", f"{control}.derivative_gain": f"{p.derivative:g} V*s/m"}
    return values | {f"{control}.proportional": f"{p.gain:g} V/m"}


def _template(rig: Rig, description: str) -> str:
    """Return the template of one axis: encoder, controller, converter, drive and load, and a scale where there is one."""
    a, rotary, p = rig.axis, _rotary(rig), rig.physics
    place, encoder = ("angle", "AngularEncoder") if rotary else ("position", "LinearEncoder")
    load = ("disturbance" if description == "table" else "torque") if rotary else ("disturbance" if description == "table" else "force")
    weight = f"{p.weight / p.ratio:.9g} {'N*m' if rotary else 'N'}"
    parts = [f"  {a}_encoder: {{component: {encoder}}}",
             f"  {a}_dac: {{component: DAConverter, set: {{bits: 12, smallest_voltage: -10 V, largest_voltage: 10 V}}}}"]  # fmt: skip
    wires = [f"  {a}_encoder.measured: {a}_axis.{place}", f"  {a}_axis.{load}: {weight}"]
    if rig.open:
        wires += [f"  {a}_dac.command: 0 V"]
    else:
        parts += [f"  {a}_controller: {{component: {rig.controller}}}"]
        wires += [f"  {a}_controller.reference: 0 {'rad/s' if p.law == SPEED else 'rad' if rotary else 'm'}",
                  f"  {a}_controller.measured: {a}_encoder.{'rate' if p.law == SPEED else place}",
                  f"  {a}_dac.command: {a}_controller.voltage"]  # fmt: skip
    if description == "table":
        units = "{effort: N*m, flow: rad/s}" if rotary else "{effort: N, flow: m/s}"
        parts += [f"  {a}_drive: {{component: VoltageDrive, units: {units}}}"]
        parts += [f"  {a}_axis: {{component: {'TorqueSpindle' if rotary else 'ForceAxis'}}}"]
        wires += [f"  {a}_drive.voltage: {a}_dac.voltage", f"  {a}_drive.velocity: {a}_axis.{'speed' if rotary else 'velocity'}",
                  f"  {a}_axis.{'torque' if rotary else 'force'}: {a}_drive.effort"]  # fmt: skip
    else:
        parts += [f"  {a}_axis: {{component: {'AnalyticalSpindle' if rotary else 'AnalyticalAxis'}}}"]
        wires += [f"  {a}_axis.voltage: {a}_dac.voltage"]
    if rig.scale:
        parts += [f"  {a}_scale: {{component: LinearEncoder, set: {{resolution: {p.scale:g} m}}}}"]
        wires += [f"  {a}_scale.measured: {a}_axis.{place}"]
    head = [f"machine: {rig.name} from its {description}", "sample_period: 1 ms", "step: 0.25 ms", "parts:"]
    return "\n".join([*head, *parts, "wires:", *wires]) + "\n"
