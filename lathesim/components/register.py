"""The stock machine parts, by class name."""

from __future__ import annotations

import importlib

from lathesim.component import Component

STOCK = {
    "ConstantVelocityInterpolator": "references.interpolator",
    "ConstantAccelerationInterpolator": "references.constant_acceleration_interpolator",
    "PositionController": "servo_control.position_controller",
    "AngularPositionController": "servo_control.angular_position_controller",
    "SpindleController": "servo_control.spindle_controller",
    "CrossCouplingController": "servo_control.cross_coupling_controller",
    "ContourError": "servo_control.contour_error",
    "DAConverter": "converters.da_converter",
    "ADConverter": "converters.ad_converter",
    "LinearEncoder": "sensors.linear_encoder",
    "Tachometer": "sensors.tachometer",
    "EmpiricalAxis": "axes.empirical_axis",
    "AnalyticalAxis": "axes.analytical_axis",
    "ForceAxis": "axes.force_axis",
    "LedAxis": "axes.led_axis",
    "LedRotaryTable": "axes.led_rotary_table",
    "EmpiricalSpindle": "spindles.empirical_spindle",
    "AnalyticalSpindle": "spindles.analytical_spindle",
    "Stock": "cutting.stock",
    "CuttingGeometry": "cutting.cutting_geometry",
    "LinearForce": "cutting.linear_force",
    "NonlinearForce": "cutting.nonlinear_force",
    "CuttingLoad": "cutting.cutting_load",
    "SurfaceFinish": "cutting.surface_finish",
    "VoltageDrive": "drives.voltage_drive",
    "CascadeController": "servo_control.cascade_controller",
    "TorqueSpindle": "spindles.torque_spindle",
    "AngularEncoder": "sensors.angular_encoder",
    "CuttingProcess": "cutting.cutting_process",
    "Dynamometer": "sensors.dynamometer",
    "RecordedSignal": "references.recorded_signal",
    "AnalogSensor": "sensors.analog_sensor",
    "ProgrammedFeed": "process_control.programmed_feed",
    "NonlinearProcessController": "process_control.nonlinear_process_controller",
    "LinearizationProcessController": "process_control.linearization_process_controller",
    "LogTransformProcessController": "process_control.log_transform_process_controller",
    "AdaptiveProcessController": "process_control.adaptive_process_controller",
    "TaylorWear": "cutting.taylor_wear",
    "LatheDesign": "economy.lathe_design",
    "TurningEconomy": "economy.turning_economy",
    "DelayLine": "closed_controller.delay_line",
    "MultiOscillatoryController": "closed_controller.multi_oscillatory_controller",
    "OscillatoryElement": "closed_controller.multi_oscillatory_controller",
    "SpeedController": "closed_controller.drive_loops",
    "PowerController": "closed_controller.drive_loops",
    "DriveElectronics": "closed_controller.drive_loops",
    "MotorSlide": "closed_controller.drive_loops",
    "Watermark": "guarding.watermark",
    "Guard": "guarding.guard",
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
