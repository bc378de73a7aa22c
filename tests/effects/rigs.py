"""Rigs to put effects on: the shipped templates, driven by something that moves."""

from __future__ import annotations

import dataclasses
import functools
import math
from pathlib import Path

import numpy as np

from lathesim.effects.effect import Effect
from lathesim.engine.assembly import FloatArray, Part, Wire
from lathesim.engine.run import run
from lathesim.engine.wiring import wire
from lathesim.lessons.assemble import assemble
from lathesim.lessons.insertion import Machinery, insert_effect
from lathesim.lessons.lesson import load_lesson
from lathesim.plugins import Registry, load_registry
from lathesim.record import Record

PERIOD = 1e-3


@functools.cache
def registry() -> Registry:
    return load_registry(installed=False)


def rig(template: str, folder: Path, drive: dict[str, FloatArray] | None = None) -> Machinery:
    """Return a shipped template in which recorded signals (one value each 1 ms) replace what feeds some inputs."""
    lesson = folder / f"{template}_lesson.yaml"
    lesson.write_text(f"lesson: rig\nmachine: {template}\n")
    machinery = assemble(load_lesson(lesson), registry())
    for target, values in (drive or {}).items():
        part, _, item = target.partition(".")
        host = next(known for known in machinery.parts if known.name == part)
        unit = host.component.declarations[item].unit
        player = registry().component("RecordedSignal").with_units({"signal": unit})
        name = f"recorded_{part}_{item}"
        samples = np.column_stack([np.arange(len(values)) * PERIOD, values])
        machinery = dataclasses.replace(
            machinery,
            parts=(Part(name, player, tables={"samples": samples}), *machinery.parts),
            wires=(*(known for known in machinery.wires if known.target != target), Wire(target, f"{name}.signal")),
        )
    return machinery


def time(duration: float) -> FloatArray:
    return np.arange(round(duration / PERIOD) + 1) * PERIOD


def moving_axis(folder: Path, duration: float = 0.2) -> Machinery:
    """Return the cascade axis on its way to and fro, 2 mm each way."""
    reference = 1e-3 * (1.0 - np.cos(2.0 * math.pi * 5.0 * time(duration)))
    return rig("cascade_axis", folder, {"x_controller.reference": reference})


def pushed_axis(folder: Path, force: FloatArray) -> Machinery:
    return rig("force_axis", folder, {"x_axis.force": force})


def led_along(folder: Path, duration: float = 0.2) -> Machinery:
    """Return the axis that is led along its reference, to and fro, 2 mm each way."""
    rate = 2.0 * math.pi * 5.0
    turned = rate * time(duration)
    motion = (1e-3 * (1.0 - np.cos(turned)), 1e-3 * rate * np.sin(turned), 1e-3 * rate**2 * np.cos(turned))
    return rig("led_axis", folder, dict(zip(("x_axis.reference", "x_axis.reference_velocity", "x_axis.acceleration"), motion, strict=True)))


def turning_spindle(folder: Path, duration: float = 0.2) -> Machinery:
    """Return the spindle under a torque that swings about 0.02 N m."""
    return rig("torque_spindle", folder, {"spindle.torque": 0.02 + 0.03 * np.sin(2.0 * math.pi * 8.0 * time(duration))})


def cutting(folder: Path, duration: float = 0.2) -> Machinery:
    """Return the process with two cuts and a pause between them."""
    passed = time(duration)
    depth = np.where((passed > 0.02) & (passed < 0.09) | (passed > 0.12), 1e-3, 0.0)
    return rig("cutting_process", folder, {"cutting.depth": depth})


def with_effect(machinery: Machinery, name: str, at: str, **settings: float | str) -> Machinery:
    """Insert a stock effect; a text is the source of an input, a number a parameter (or a constant for an input)."""
    effect = registry().effect(name)
    assert issubclass(effect, Effect)
    inputs = {key for key, item in effect.declarations.items() if item.kind == "input"}
    sources = {key: value for key, value in settings.items() if key in inputs}
    parameters = {key: float(value) for key, value in settings.items() if key not in inputs}
    return insert_effect(machinery, effect, at, parameters=parameters, sources=sources)


def record(machinery: Machinery, duration: float = 0.2, **overrides: float) -> Record:
    named = {key.replace("__", "."): value for key, value in overrides.items()}
    return run(wire(machinery), duration=duration, engine="plain", overrides=named)


Setting = dict[str, float | str]
PLACES: dict[str, tuple[str, str, Setting, Setting]] = {
    # effect: (rig, at, sources, setting)
    "CoulombFriction": ("axis", "x_axis", {}, {"level": 20.0}),
    "StribeckFriction": ("axis", "x_axis", {}, {"excess": 10.0}),
    "AsymmetricFriction": ("axis", "x_axis", {}, {"level": 20.0, "asymmetry": 0.3}),
    "PositionDependentFriction": ("axis", "x_axis", {}, {"amplitude": 5.0}),
    "ViscousWarmUp": ("axis", "x_axis", {}, {"change": -100.0}),
    "GearLoss": ("spindle", "spindle", {}, {"loss": 0.3}),
    "PreslidingFriction": ("axis", "x_axis", {}, {"level": 20.0}),
    "ForceOffset": ("axis", "x_axis", {}, {"offset": -3.0}),
    "GravityTorque": ("spindle", "spindle", {}, {"torque": 0.02, "lowest": 0.4}),
    "ConverterOffset": ("axis", "x_drive", {}, {"offset": 0.05}),
    "ConverterResolution": ("axis", "x_drive", {}, {"resolution": 0.005}),
    "DriveGainError": ("axis", "x_drive", {}, {"error": 0.05, "sag": 0.01}),
    "ScaleFactorError": ("axis", "x_scale", {}, {"factor": 2.0}),
    "Backlash": ("axis", "x_scale", {}, {"width": 20e-6}),
    "CumulativePitchError": ("axis", "x_scale", {}, {"slope": 1e-4}),
    "PeriodicPitchError": ("axis", "x_scale", {}, {"amplitude": 2e-6}),
    "ThermalScrewGrowth": ("axis", "x_scale", {}, {"strain": 1e-2, "time_constant": 0.1}),
    "SquarenessError": ("axis", "x_scale", {"other_position": "x_axis.position"}, {"slope": 1e-3}),
    "AxialResonance": ("axis", "x_axis", {}, {"table_share": 0.5}),
    "TorsionalWindUp": ("axis", "x_scale", {}, {"compliance": 20e-9}),
    "BaseRocking": ("axis", "x_scale", {}, {"mobility": 1e-3}),
    "MotorInductance": ("axis", "x_drive", {}, {"time_constant": 2e-3}),
    "CurrentLoopLag": ("axis", "x_drive", {}, {"time_constant": 1e-3}),
    "SensorFilter": ("axis", "x_scale", {}, {"time_constant": 2e-3, "stages": 2.0}),
    "AmplifierDeadZone": ("axis", "x_drive", {}, {"half_width": 0.1}),
    "DriveSaturation": ("axis", "x_drive", {}, {"level": 0.3}),
    "CurrentLimit": ("axis", "x_drive", {}, {"level": 0.1}),
    "SlewLimit": ("axis", "x_drive", {}, {"rate": 10.0}),
    "TorqueRipple": ("axis", "x_axis", {}, {"amplitude": 3.0, "share": 0.02}),
    "Cogging": ("axis", "x_axis", {}, {"amplitude": 3.0, "second": 1.0}),
    "TransportDelay": ("axis", "x_drive", {}, {"delay": 1.3e-3}),
    "ServoLag": ("led", "x_axis", {}, {"lag": 2e-3}),
    "ChannelTimeShift": ("axis", "x_scale", {}, {"shift": 1.3e-3}),
    "ClockSkew": ("axis", "x_scale", {}, {"skew": 1e-2}),
    "SampleJitter": ("axis", "x_scale", {}, {"deviation": 1e-4}),
    "EncoderEccentricity": ("axis", "x_scale", {}, {"amplitude": 2e-6}),
    "EncoderInterpolationError": ("axis", "x_scale", {}, {"amplitude": 2e-7}),
    "LostCounts": ("axis", "x_scale", {}, {"jump": 1e-5, "instant": 0.05}),
    "Quantisation": ("axis", "x_scale", {}, {"count": 5e-6}),
    "ReplayAttack": ("axis", "x_scale", {}, {"lap": 0.02}),
    "OffsetAttack": ("axis", "x_scale", {}, {"offset": 1e-4}),
    "ScaleAttack": ("axis", "x_scale", {}, {"share": 0.01}),
    "DelayAttack": ("axis", "x_scale", {}, {"delay": 5e-3}),
    "DriftAttack": ("axis", "x_scale", {}, {"rate": 1e-3}),
    "TachometerRipple": ("spindle", "tachometer", {}, {"ripple": 0.02, "gain_error": 0.01, "brush_noise": 0.01}),
    "Runout": ("cutting", "cutting", {}, {"eccentricity": 2e-5}),
    "Unbalance": ("cutting", "cutting", {}, {"moment": 1e-3}),
    "BeltSlip": ("spindle", "spindle", {"effort": 0.01}, {"slip": 0.01, "creep": 0.1}),
    "SpeedDroop": ("spindle", "spindle", {"effort": 1.0}, {"droop": 1.0}),
    "SpindleGrowth": ("axis", "x_scale", {"spindle_speed": 100.0}, {"growth": 1e-4, "time_constant": 0.1}),
    "EdgeForce": ("cutting", "cutting", {}, {"coefficient": 4e4}),
    "ChipThicknessExponent": ("cutting", "cutting", {}, {"exponent": 0.25}),
    "SpeedDependence": ("cutting", "cutting", {}, {"exponent": -0.2, "reference": 1.0, "hump": 0.2}),
    "BuiltUpEdge": ("cutting", "cutting", {}, {"share": 0.2, "rate": 20.0}),
    "TemperatureSoftening": ("cutting", "cutting", {}, {"softening": 0.2, "time_constant": 0.05}),
    "WearForceGrowth": ("cutting", "cutting", {}, {"growth": 1500.0, "break_in_time": 0.05}),
    "EntryBuildUp": ("cutting", "cutting", {}, {"lacking": 0.5, "time_constant": 0.02}),
    "InterruptedCut": ("cutting", "cutting", {}, {"missing": 1.0}),
    "HardSpot": ("cutting", "cutting", {}, {"rise": 0.3}),
    "ChipSegmentation": ("cutting", "cutting", {}, {"share": 0.1}),
    "RegenerativeChatter": ("cutting", "cutting", {}, {"engagement": 1.0, "frequency": 80.0}),
    "WorkpieceDeflection": ("axis", "x_scale", {"force": "x_drive.effort", "distance": 0.1}, {"compliance": 2e-7}),
    "ToolCompliance": ("axis", "x_scale", {"force": "x_drive.effort"}, {"compliance": 5e-8}),
    "DynamometerDrift": ("cutting", "dynamometer", {}, {"leak": 0.5, "drift": 1.0, "offset": 2.0}),
    "DynamometerCrosstalk": ("cutting", "dynamometer.main_force", {"other_force": "cutting.thrust_force"}, {"share": 0.03}),
    "DynamometerResonance": ("cutting", "dynamometer.main_force", {}, {"coupling": 1.0, "frequency": 120.0}),
}


def machinery(rig: str, folder: Path) -> Machinery:
    return {"axis": moving_axis, "led": led_along, "spindle": turning_spindle, "cutting": cutting}[rig](folder)
