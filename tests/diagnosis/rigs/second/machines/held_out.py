"""The half of the second set that is only asked."""

from __future__ import annotations

from math import pi

from tests.diagnosis.rigs.second.physics import INTEGRAL_PROPORTIONAL, PID, PID_MEASURED, Physics
from tests.diagnosis.rigs.second.rig import Rig

_LINEAR = Physics(
    inertia=35.0, viscous=60.0, ratio=1.0, resistance=1.0, amplifier=2.5, torque_constant=70.0, voltage_constant=0.0, tachometer=0.0,
    period=0.25e-3, law=INTEGRAL_PROPORTIONAL, gain=35.0, velocity_gain=40.0, integral=60.0, bits=16.0, encoder=0.05e-6, encoder_noise=1e-8,
    current_noise=0.01, current_step=0.005,
)  # fmt: skip
_WORM = Physics(
    inertia=8e-4, viscous=1.5e-3, ratio=1 / 72, resistance=1.5, amplifier=10.0, torque_constant=0.2, voltage_constant=0.2, tachometer=0.02,
    period=1e-3, law=PID, gain=57.6, bits=12.0, encoder=2e-5, encoder_noise=2e-6, current_noise=0.02, current_step=0.01,
)  # fmt: skip
_BELT = Physics(
    inertia=2.2e-3, viscous=5e-3, ratio=8e-3, resistance=1.0, amplifier=10.0, torque_constant=0.25, voltage_constant=0.25, tachometer=0.03,
    period=2e-3, law=PID_MEASURED, gain=110.0, integral=200.0, derivative=0.4, bits=12.0, encoder=2e-6, encoder_noise=2e-7, scale=5e-6,
    current_noise=0.03, current_step=0.02,
)  # fmt: skip
_COARSE = Physics(
    inertia=4e-3, viscous=5e-3, ratio=10e-3 / (2 * pi), resistance=1.0, amplifier=20.0, torque_constant=0.25, voltage_constant=0.25,
    tachometer=0.03, period=5e-3, law=PID, gain=320.0, bits=12.0, encoder=10e-6, encoder_noise=1e-6,
)  # fmt: skip
_CROSS = Physics(
    inertia=2.8e-3, viscous=2.5e-3, ratio=4e-3 / (2 * pi), resistance=1.0, amplifier=18.0, torque_constant=0.28, voltage_constant=0.28,
    tachometer=0.028, period=4e-3, law=PID, gain=320.0, bits=12.0, encoder=1e-6, encoder_noise=1e-7, current_noise=0.02, current_step=0.01,
)  # fmt: skip

HELD_OUT: tuple[Rig, ...] = (
    Rig("linear_motor_4k", "axis", _LINEAR, False, "IntegralProportional", 0.4, 0.2, 6.0, 4.0, ("s_curve", "sines"), 30e-3, 2.7),
    Rig("worm_table_1k", "rotary", _WORM, False, "AngleController", 1.5, 1.2, 15.0, 8.0, ("trapezoid", "sines"), 2 * pi / 72, 3.6),
    Rig("belt_gear_500", "axis", _BELT, False, "MeasuredDerivative", 0.6, 0.3, 4.0, 12.0, ("steps", "s_curve", "sines"), 50e-3, 4.8,
        gear=0.4),
    Rig("coarse_200", "axis", _COARSE, False, "PositionController", 0.2, 0.15, 1.5, 20.0, ("trapezoid", "steps", "sines"), 10e-3, 14.0,
        current=False),
    Rig("lathe_both_x", "lathe", _CROSS, False, "PositionController", 0.05, 0.04, 0.4, 16.0, ("s_curve", "trapezoid"), 4e-3, 3.5,
        second=_CROSS._replace(inertia=3.6e-3, viscous=4e-3, ratio=6e-3 / (2 * pi), gain=220.0)),
)  # fmt: skip
