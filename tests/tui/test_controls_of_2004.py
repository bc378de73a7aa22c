"""Every control of figures 3 to 12 of Liu and Landers (2004) is in the app: the table says where, and each row is tried."""

from __future__ import annotations

from lathesim.tui.model.machine_tree import candidates
from lathesim.tui.screens.configure import ConfigureScreen
from tests.tui.driving import opened, press

KEYS = {
    "Fig. 3, RESULTS": "f3",
    "Fig. 3, RUN and STOP": "f5",
    "Fig. 3, the buttons of the components": "f4",
}
"""Control -> function key of the app."""
CONFIGURE_KEYS = {
    "Fig. 3, LOAD": "ctrl+o",
    "Fig. 3, SAVE": "ctrl+s",
    "Fig. 4a, PART PROGRAM, LOAD G&M PROGRAM": "g",
    "Fig. 4a and b, TAPER CUT and STRAIGHT CUT": "n",
    "Fig. 12, USER-DEFINED: choice of a part": "c",
}
"""Control -> key of the screen Configure."""
PARAMETERS = {
    "Fig. 5, spindle gain": "spindle.gain",
    "Fig. 5, spindle time constant": "spindle.time_constant",
    "Fig. 5, tachometer gain": "tachometer.gain",
    "Fig. 5, spindle controller P": "spindle_controller.proportional",
    "Fig. 5, spindle controller I": "spindle_controller.integral",
    "Fig. 5, A/D bits": "tachometer_adc.bits",
    "Fig. 5, D/A bits": "spindle_dac.bits",
    "Fig. 6, axis gain": "x_axis.gain",
    "Fig. 6, axis time constant": "x_axis.time_constant",
    "Fig. 6, encoder resolution": "x_encoder.resolution",
    "Fig. 6, axis controller P": "x_controller.proportional",
    "Fig. 6, axis controller I": "x_controller.integral",
    "Fig. 6, axis controller D": "x_controller.derivative_gain",
    "Fig. 6, D/A smallest voltage": "x_dac.smallest_voltage",
    "Fig. 6, D/A largest voltage": "x_dac.largest_voltage",
    "Fig. 7, cross-coupling P": "cross_coupling.proportional",
    "Fig. 7, cross-coupling I": "cross_coupling.integral",
    "Fig. 10, dynamometer gain": "dynamometer.gain",
    "Fig. 10, A/D bits": "dynamometer_adc.bits",
    "Fig. 11, stock radius": "stock.stock_radius",
    "Fig. 11, stock length": "stock.stock_length",
    "Fig. 11, nose radius": "surface_finish.nose_radius",
    "Fig. 11, Taylor constant": "tool_wear.taylor_constant",
    "Fig. 11, Taylor exponent": "tool_wear.taylor_exponent",
}
"""Control -> parameter that Configure shows."""
COMPONENTS = {
    "Fig. 6, interpolators": ("interpolator", {"ConstantVelocityInterpolator", "ConstantAccelerationInterpolator"}),
    "Fig. 6, axis models": ("x_axis", {"EmpiricalAxis", "AnalyticalAxis"}),
    "Fig. 5, spindle models": ("spindle", {"EmpiricalSpindle", "AnalyticalSpindle"}),
    "Fig. 8, force models": ("cutting_force", {"LinearForce", "NonlinearForce"}),
    "Fig. 10, process controllers": (
        "process_controller",
        {
            "AdaptiveProcessController",
            "LinearizationProcessController",
            "LogTransformProcessController",
            "NonlinearProcessController",
            "ProgrammedFeed",
        },
    ),
}
"""Control -> place, and what may stand there."""
CHANNELS = {
    "radial thrust force": "cutting_force.radial_force",
    "longitudinal thrust force": "cutting_force.longitudinal_force",
    "cutting force": "cutting_force.cutting_force",
    "spindle torque": "load.torque",
    "spindle power": "load.power",
    "feed": "cutting.feed",
    "tool wear": "tool_wear.flank_wear",
    "surface finish": "surface_finish.roughness",
    "spindle velocity": "spindle.speed",
    "spindle velocity error": "spindle_controller.error",
    "spindle voltage": "spindle_dac.voltage",
    "x position": "x_axis.position",
    "z position": "z_axis.position",
    "x velocity": "x_axis.velocity",
    "x position error": "contour.x_error",
    "x voltage": "x_dac.voltage",
    "contour error": "contour.contour_error",
    "CCC command voltage": "cross_coupling.voltage",
}
"""What the RESULTS window of 2004 plots -> channel; currents are of the machines with electrical drives."""


async def test_every_control_of_2004_is_a_key_a_parameter_a_choice_or_a_channel() -> None:
    async with opened() as (app, pilot):
        assert set(KEYS.values()) <= {binding.key for binding in app.keys}  # type: ignore[union-attr]
        (configure,) = (entry for entry in app.entries if entry.name == "configure")
        assert set(CONFIGURE_KEYS.values()) <= {binding.key for binding in app.keys_of(configure)}
        case = app.workbench.prepared()
        for control, (place, wanted) in COMPONENTS.items():
            assert set(candidates(case, app.workbench.registry, case.plan.parts[place])) >= wanted, control
        assert set(CHANNELS.values()) <= set(case.plan.channels)
        await press(pilot, "f4")
        screen = app.screen
        assert isinstance(screen, ConfigureScreen)
        for control, name in PARAMETERS.items():
            screen.show_parameter(name)
            assert screen.entry is not None, control
            assert screen.entry.name == name, control
            assert screen.entry.doc, control
