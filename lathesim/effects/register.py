"""The stock effects, by class name."""

from __future__ import annotations

import importlib

from lathesim.effects.effect import Effect

STOCK = {
    "friction": ("CoulombFriction", "StribeckFriction", "AsymmetricFriction", "PositionDependentFriction", "ViscousWarmUp"),
    "presliding": ("PreslidingFriction",),
    "offset_and_gain": ("ForceOffset", "ConverterOffset", "ConverterResolution", "DriveGainError", "ScaleFactorError"),
    "play": ("Backlash",),
    "screw_error": ("CumulativePitchError", "PeriodicPitchError", "ThermalScrewGrowth", "SquarenessError"),
    "structure": ("AxialResonance", "TorsionalWindUp", "BaseRocking"),
    "drive_lag": ("MotorInductance", "CurrentLoopLag"),
    "sensor_filter": ("SensorFilter",),
    "drive_range": ("AmplifierDeadZone", "DriveSaturation", "CurrentLimit", "SlewLimit"),
    "motor_ripple": ("TorqueRipple", "Cogging"),
    "servo_lag": ("ServoLag",),
    "time_shift": ("TransportDelay", "ChannelTimeShift", "ClockSkew", "SampleJitter"),
    "encoder_error": ("EncoderEccentricity", "EncoderInterpolationError", "LostCounts", "Quantisation"),
    "tachometer_error": ("TachometerRipple",),
    "spindle_error": ("Runout", "Unbalance", "BeltSlip", "SpeedDroop", "SpindleGrowth"),
    "force_law": ("EdgeForce", "ChipThicknessExponent", "SpeedDependence", "BuiltUpEdge"),
    "force_over_time": ("TemperatureSoftening", "WearForceGrowth", "EntryBuildUp"),
    "force_over_turn": ("InterruptedCut", "HardSpot", "ChipSegmentation", "RegenerativeChatter"),
    "compliance": ("WorkpieceDeflection", "ToolCompliance"),
    "attacks": ("ReplayAttack", "OffsetAttack", "ScaleAttack", "DelayAttack", "DriftAttack"),
    "dynamometer_error": ("DynamometerDrift", "DynamometerCrosstalk", "DynamometerResonance"),
}
"""File -> the effects that stand in it."""


def stock_effects() -> dict[str, type[Effect]]:
    """Return every stock effect by its class name."""
    found: dict[str, type[Effect]] = {}
    for module, names in STOCK.items():
        loaded = importlib.import_module(f"lathesim.effects.{module}")
        found |= {name: getattr(loaded, name) for name in names}
    return found
