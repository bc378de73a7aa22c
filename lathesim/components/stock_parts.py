"""The stock machine parts, by class name."""

from __future__ import annotations

import importlib

from lathesim.component import Component

STOCK = {
    "ConstantVelocityInterpolator": "interpolator", "ConstantAccelerationInterpolator": "accelerating_interpolators",
    "PositionController": "servo_controllers", "AngularPositionController": "servo_controllers", "SpindleController": "servo_controllers",
    "CrossCouplingController": "contour_controllers", "ContourError": "contour_error", "DAConverter": "sensors", "ADConverter": "sensors",
    "LinearEncoder": "sensors", "Tachometer": "sensors", "EmpiricalAxis": "axes", "AnalyticalAxis": "axes", "ForceAxis": "axes",
    "LedAxis": "axes", "LedRotaryTable": "axes", "EmpiricalSpindle": "spindles", "AnalyticalSpindle": "spindles", "Stock": "stock",
    "CuttingGeometry": "stock", "LinearForce": "cutting_forces", "NonlinearForce": "cutting_forces", "CuttingLoad": "cutting_forces",
    "SurfaceFinish": "stock", "VoltageDrive": "drives", "CascadeController": "servo_controllers", "TorqueSpindle": "spindles",
    "AngularEncoder": "sensors", "CuttingProcess": "cutting_forces", "Dynamometer": "sensors", "RecordedSignal": "signals",
    "AnalogSensor": "sensors", "ProgrammedFeed": "process_control", "NonlinearProcessController": "process_control",
    "LinearizationProcessController": "process_control", "LogTransformProcessController": "process_control",
    "AdaptiveProcessController": "process_control", "TaylorWear": "tool_wear", "LatheDesign": "economy", "TurningEconomy": "economy",
    "DelayLine": "signals", "MultiOscillatoryController": "closed_controller", "OscillatoryElement": "closed_controller",
    "SpeedController": "closed_controller", "PowerController": "closed_controller", "DriveElectronics": "closed_controller",
    "MotorSlide": "closed_controller", "Watermark": "guarding", "Guard": "guarding",
    "JerkLimitedInterpolator": "accelerating_interpolators", "ScaledValue": "signals", "ControllerTuning": "closed_controller",
    "CircleReference": "free_paths", "FreePathInterpolator": "free_paths", "FootPoint": "contour_error", "FreeFootPoint": "contour_error",
    "FeedforwardController": "predictive_controllers", "VariableGainCoupling": "contour_controllers",
    "TaskFrameController": "contour_controllers", "CoordinatedSpeed": "contour_controllers", "NeuralRegulator": "predictive_controllers",
    "ZeroPhasePrefilter": "predictive_controllers", "PredictiveController": "predictive_controllers", "RegenerativeCut": "chatter",
    "ToolMode": "chatter", "MillingCut": "chatter", "SteadySpindle": "spindles", "ImpactHammer": "chatter", "Accelerometer": "sensors",
    "SampledSensor": "sensors",
}  # fmt: skip
"""Class name -> the file it stands in."""


def stock_components() -> dict[str, type[Component]]:
    """Return every stock part by its class name."""
    found: dict[str, type[Component]] = {}
    for name, module in STOCK.items():
        found[name] = getattr(importlib.import_module(f"lathesim.components.{module}"), name)
    return found
