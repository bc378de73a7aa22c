"""The stock machine parts, by class name."""

from __future__ import annotations

import importlib

from lathesim.component import Component

STOCK = {
    "ConstantVelocityInterpolator": "interpolator",
    "ConstantAccelerationInterpolator": "constant_acceleration_interpolator",
    "PositionController": "position_controller",
    "SpindleController": "spindle_controller",
    "CrossCouplingController": "cross_coupling_controller",
    "ContourError": "contour_error",
    "DAConverter": "da_converter",
    "ADConverter": "ad_converter",
    "LinearEncoder": "linear_encoder",
    "Tachometer": "tachometer",
    "EmpiricalAxis": "empirical_axis",
    "AnalyticalAxis": "analytical_axis",
    "ForceAxis": "force_axis",
    "LedAxis": "led_axis",
    "EmpiricalSpindle": "empirical_spindle",
    "AnalyticalSpindle": "analytical_spindle",
    "Stock": "stock",
    "CuttingGeometry": "cutting_geometry",
    "LinearForce": "linear_force",
    "NonlinearForce": "nonlinear_force",
    "CuttingLoad": "cutting_load",
    "SurfaceFinish": "surface_finish",
    "VoltageDrive": "voltage_drive",
    "CascadeController": "cascade_controller",
    "TorqueSpindle": "torque_spindle",
    "AngularEncoder": "angular_encoder",
    "CuttingProcess": "cutting_process",
    "Dynamometer": "dynamometer",
    "RecordedSignal": "recorded_signal",
    "AnalogSensor": "analog_sensor",
    "ProgrammedFeed": "programmed_feed",
    "NonlinearProcessController": "nonlinear_process_controller",
    "LinearizationProcessController": "linearization_process_controller",
    "LogTransformProcessController": "log_transform_process_controller",
    "AdaptiveProcessController": "adaptive_process_controller",
    "TaylorWear": "taylor_wear",
    "LatheDesign": "lathe_design",
    "TurningEconomy": "turning_economy",
    "DelayLine": "closed_controller.delay_line",
    "MultiOscillatoryController": "closed_controller.multi_oscillatory_controller",
    "OscillatoryElement": "closed_controller.multi_oscillatory_controller",
    "SpeedController": "closed_controller.drive_loops",
    "PowerController": "closed_controller.drive_loops",
    "DriveElectronics": "closed_controller.drive_loops",
    "MotorSlide": "closed_controller.drive_loops",
    "Watermark": "watermark",
    "Guard": "guard",
    "JerkLimitedInterpolator": "closed_controller.jerk_limited_interpolator",
    "ScaledValue": "closed_controller.scaled_value",
    "ControllerTuning": "closed_controller.controller_tuning",
    "CircleReference": "contour.circle_reference",
    "FreePathInterpolator": "contour.free_path",
    "FootPoint": "contour.foot_point",
    "FreeFootPoint": "contour.foot_point",
    "FeedforwardController": "contour.feedforward_controller",
    "VariableGainCoupling": "contour.variable_gain_coupling",
    "TaskFrameController": "contour.task_frame_controller",
    "CoordinatedSpeed": "contour.coordinated_speed",
    "NeuralRegulator": "contour.neural_regulator",
    "ZeroPhasePrefilter": "contour.zero_phase_prefilter",
    "PredictiveController": "contour.predictive_controller",
    "RegenerativeCut": "chatter.regenerative_cut",
    "ToolMode": "chatter.tool_mode",
    "MillingCut": "chatter.milling_cut",
    "SteadySpindle": "chatter.steady_spindle",
    "ImpactHammer": "chatter.impact_hammer",
    "Accelerometer": "chatter.accelerometer",
    "SampledSensor": "chatter.sampled_sensor",
}
"""Class name -> the file it stands in."""


def stock_components() -> dict[str, type[Component]]:
    """Return every stock part by its class name."""
    found: dict[str, type[Component]] = {}
    for name, module in STOCK.items():
        found[name] = getattr(importlib.import_module(f"lathesim.components.{module}"), name)
    return found
