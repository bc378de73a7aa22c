"""The calibrating half of the second set."""

from __future__ import annotations

from math import pi

from tests.diagnosis.rigs.second.physics import CASCADE, FEED_FORWARD, PID, SPEED, Physics
from tests.diagnosis.rigs.second.rig import Rig, feed_forward

_SCREW = feed_forward(0.95, Physics(
    inertia=2.4e-3, viscous=4e-3, ratio=8e-3 / (2 * pi), resistance=0.8, amplifier=15.0, torque_constant=0.3, voltage_constant=0.3,
    tachometer=0.025, period=1e-3, law=FEED_FORWARD, gain=600.0, bits=14.0, encoder=0.5e-6, encoder_noise=5e-8, scale=0.5e-6,
    current_noise=0.03, current_step=0.02,
))  # fmt: skip
_SERVO = Physics(
    inertia=1.2e-3, viscous=2e-3, ratio=10e-3 / (2 * pi), resistance=1.0, amplifier=3.0, torque_constant=0.4, voltage_constant=0.0,
    tachometer=0.0, period=0.5e-3, law=PID, gain=9000.0, integral=135e3, derivative=120.0, bits=16.0, encoder=0.1e-6, encoder_noise=1e-8,
    current_noise=0.01, current_step=0.005,
)  # fmt: skip
_VERTICAL = Physics(
    inertia=3e-3, viscous=5e-3, ratio=6e-3 / (2 * pi), resistance=1.0, amplifier=2.5, torque_constant=0.35, voltage_constant=0.0,
    tachometer=0.0, period=1e-3, law=CASCADE, gain=25.0, velocity_gain=350.0, integral=10.0, feed_forward=0.9, bits=12.0, encoder=0.2e-6,
    encoder_noise=4e-8, scale=0.5e-6, current_noise=0.02, current_step=0.01, weight=0.8,
)  # fmt: skip
_SPINDLE = Physics(
    inertia=0.03, viscous=0.01, ratio=0.5, resistance=0.3, amplifier=12.0, torque_constant=0.6, voltage_constant=0.6, tachometer=0.0,
    period=2e-3, law=SPEED, gain=0.15, integral=6.0, bits=12.0, encoder=2 * pi / 10000, encoder_noise=6e-5, current_noise=0.1,
    current_step=0.05,
)  # fmt: skip
_SLIDE = Physics(
    inertia=3.4e-3, viscous=3e-3, ratio=5e-3 / (2 * pi), resistance=1.0, amplifier=20.0, torque_constant=0.25, voltage_constant=0.25,
    tachometer=0.03, period=5e-3, law=PID, gain=240.0, bits=10.0, encoder=2e-6, encoder_noise=2e-7, current_noise=0.02, current_step=0.01,
)  # fmt: skip

CALIBRATING: tuple[Rig, ...] = (
    Rig("screw_feed_forward_1k", "axis", _SCREW, True, "FeedforwardController", 0.15, 0.1, 2.0, 8.0, ("trapezoid", "sines"), 8e-3, 13.6),
    Rig("servo_current_2k", "axis", _SERVO, True, "PositionController", 0.2, 0.15, 3.0, 6.0, ("s_curve", "sines"), 10e-3, 6.0),
    Rig("vertical_cascade_1k", "axis", _VERTICAL, True, "FeedforwardCascade", 0.08, 0.06, 0.8, 8.0, ("s_curve", "trapezoid"), 6e-3, 9.9),
    Rig("spindle_speed_500", "spindle", _SPINDLE, True, "SpindleController", 60.0, 1.0, 150.0, 12.0, (), 2 * pi, 21.4, load=0.01),
    Rig("lathe_both_z", "lathe", _SLIDE, True, "PositionController", 0.05, 0.04, 0.4, 20.0, ("trapezoid", "sines"), 5e-3, 3.3,
        second=_SLIDE._replace(inertia=2.6e-3, viscous=2e-3, ratio=4e-3 / (2 * pi), gain=300.0)),
)  # fmt: skip
