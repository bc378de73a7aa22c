"""The stock effects and the stock remedies, by class name."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lathesim.effects.effect import Effect
    from lathesim.effects.remedy import Remedy

EFFECTS = {
    "CoulombFriction": "friction", "StribeckFriction": "friction", "AsymmetricFriction": "friction",
    "PositionDependentFriction": "friction", "ViscousWarmUp": "friction", "PreslidingFriction": "friction", "GearLoss": "friction",
    "ForceOffset": "offset_and_gain", "GravityTorque": "offset_and_gain", "ConverterOffset": "offset_and_gain",
    "ConverterResolution": "offset_and_gain", "DriveGainError": "offset_and_gain", "ScaleFactorError": "offset_and_gain",
    "Backlash": "backlash_and_screw",
    "CumulativePitchError": "backlash_and_screw", "PeriodicPitchError": "backlash_and_screw", "ThermalScrewGrowth": "backlash_and_screw",
    "SquarenessError": "backlash_and_screw", "AxialResonance": "structure", "TorsionalWindUp": "structure", "BaseRocking": "structure",
    "MotorInductance": "lag", "CurrentLoopLag": "lag", "SensorFilter": "sensor_errors", "AmplifierDeadZone": "drive_errors",
    "DriveSaturation": "drive_errors", "CurrentLimit": "drive_errors", "SlewLimit": "drive_errors", "TorqueRipple": "drive_errors",
    "Cogging": "drive_errors", "ServoLag": "lag", "TransportDelay": "time_shift", "ChannelTimeShift": "time_shift",
    "ClockSkew": "time_shift", "SampleJitter": "time_shift", "EncoderEccentricity": "sensor_errors",
    "EncoderInterpolationError": "sensor_errors", "LostCounts": "sensor_errors", "Quantisation": "sensor_errors",
    "TachometerRipple": "sensor_errors", "Runout": "spindle_error", "Unbalance": "spindle_error", "BeltSlip": "spindle_error",
    "SpeedDroop": "spindle_error", "SpindleGrowth": "spindle_error", "EdgeForce": "force_law", "ChipThicknessExponent": "force_law",
    "SpeedDependence": "force_law", "BuiltUpEdge": "force_law", "TemperatureSoftening": "force_law", "WearForceGrowth": "force_law",
    "EntryBuildUp": "force_law", "InterruptedCut": "force_over_turn", "HardSpot": "force_over_turn", "ChipSegmentation": "force_over_turn",
    "RegenerativeChatter": "force_over_turn", "WorkpieceDeflection": "structure", "ToolCompliance": "structure", "ReplayAttack": "attacks",
    "OffsetAttack": "attacks", "ScaleAttack": "attacks", "DelayAttack": "attacks", "DriftAttack": "attacks",
    "DynamometerDrift": "sensor_errors", "DynamometerCrosstalk": "sensor_errors", "DynamometerResonance": "sensor_errors",
}  # fmt: skip
"""Effect -> the file it stands in."""

REMEDIES = {
    "CommandBias": "command_remedies", "CommandGain": "command_remedies", "InverseDeadZone": "command_remedies",
    "FrictionFeedforward": "command_remedies", "MotionFeedforward": "command_remedies", "RippleFeedforward": "command_remedies",
    "LearnedCorrection": "position_remedies", "BacklashShift": "position_remedies", "PlayReading": "position_remedies",
    "PitchTable": "position_remedies", "ReadingTable": "position_remedies", "AcrossTable": "position_remedies",
    "GrowthModel": "structure_remedies", "SpindleGrowthModel": "structure_remedies", "ComplianceShift": "structure_remedies",
    "SwingModel": "structure_remedies", "InputShaper": "structure_remedies", "CommandNotch": "structure_remedies",
    "ReversalPulse": "position_remedies",
}  # fmt: skip
"""Remedy -> the file it stands in."""


def stock_effects() -> dict[str, type[Effect]]:
    """Return every stock effect by its class name."""
    return _loaded(EFFECTS)


def stock_remedies() -> dict[str, type[Remedy]]:
    """Return every stock remedy by its class name."""
    return _loaded(REMEDIES)


def _loaded(files: Mapping[str, str]) -> dict[str, type[Any]]:
    """Return the classes of a table of names and files."""
    return {name: getattr(importlib.import_module(f"lathesim.effects.{file}"), name) for name, file in files.items()}
