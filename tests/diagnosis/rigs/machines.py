"""The rigs: what each is built of, to which set and which half it belongs, and what its motion takes."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

from tests.diagnosis.rigs.plant import CASCADE, FEED_FORWARD, INTEGRAL_PROPORTIONAL, OPEN, PID, PID_MEASURED, SPEED, Physics


@dataclass(frozen=True)
class Rig:
    """A machine of the ``first`` or the second set, on whose half limits may be chosen where it is ``calibrating``.

    ``kind`` is axis, rotary, spindle or lathe. ``top`` is the greatest speed of the load [m/s or rad/s], ``stroke`` its way and
    ``acceleration`` its acceleration; ``load`` is the noise of the force as a share of the torque that this takes. ``controller`` is the
    part of the lesson (none drives an open loop), ``program`` names the pieces of its motion, ``turn`` the travel of the load per turn of
    what repeats, ``gear`` the turns of the screw per turn of the motor. The second axis of a lathe moves at the same time, or stands.
    """

    name: str
    kind: str
    physics: Physics
    calibrating: bool
    controller: str
    top: float
    stroke: float
    acceleration: float
    seconds: float
    program: tuple[str, ...]
    turn: float
    load: float = 0.005
    gear: float = 1.0
    current: bool = True
    second: Physics | None = None
    first: bool = False

    @property
    def scale(self) -> bool:
        """Whether a scale is read beside the encoder that the controller reads."""
        return self.physics.scale > 0.0

    @property
    def open(self) -> bool:
        """Whether nothing is fed back to the command."""
        return self.physics.law == OPEN

    @property
    def descriptions(self) -> tuple[str, ...]:
        """The ways in which it is written down."""
        return ("table", "motor", "lathe") if self.kind == "lathe" else ("table", "motor")

    @property
    def axis(self) -> str:
        """The letter of the axis that is asked about."""
        return {"lathe": self.name.rpartition("_")[2], "rotary": "c", "spindle": "s"}.get(self.kind, "x")

    @property
    def torque(self) -> float:
        """The torque [N m] on the shaft that its motion takes: what effects are sized by."""
        p = self.physics
        return (p.inertia * self.acceleration + p.viscous * self.top) / p.ratio

    @property
    def voltage(self) -> float:
        """The voltage that its motion takes."""
        p = self.physics
        back = p.tachometer + p.voltage_constant / p.amplifier
        return back * self.top / p.ratio + self.torque * p.resistance / (p.torque_constant * p.amplifier)


def _tachometer(
    period: float, lead: float, bits: float, encoder: float, gain: float, tachometer: float = 0.03, *, scale: bool = True
) -> Physics:
    return Physics(
        inertia=3.2e-3, viscous=2.6e-3, ratio=lead * 1e-3 / (2 * pi), resistance=1.0, amplifier=20.0, torque_constant=0.25,
        voltage_constant=0.25, tachometer=tachometer, period=period, law=PID, gain=gain, bits=bits, encoder=encoder,
        encoder_noise=0.1 * encoder, scale=encoder if scale else 0.0, current_noise=0.02, current_step=0.01,
    )  # fmt: skip


def _cascade(period: float, lead: float, bits: float, encoder: float, velocity_gain: float, integral: float, gain: float) -> Physics:
    return Physics(
        inertia=2.0e-3, viscous=4e-3, ratio=lead * 1e-3 / (2 * pi), resistance=1.0, amplifier=2.0, torque_constant=0.3,
        voltage_constant=0.0, tachometer=0.0, period=period, law=CASCADE, gain=gain, velocity_gain=velocity_gain, integral=integral,
        bits=bits, encoder=encoder, encoder_noise=0.2 * encoder, scale=encoder, current_noise=0.01, current_step=0.005,
    )  # fmt: skip


def _pid(period: float, ratio: float, bits: float, encoder: float, gains: tuple[float, float, float], tachometer: float) -> Physics:
    return Physics(
        inertia=1.5e-3, viscous=3e-3, ratio=ratio, resistance=1.2, amplifier=12.0, torque_constant=0.2, voltage_constant=0.2,
        tachometer=tachometer, period=period, law=PID, gain=gains[0], integral=gains[1], derivative=gains[2], bits=bits, encoder=encoder,
        encoder_noise=0.05 * encoder, scale=encoder, current_noise=0.02, current_step=0.02,
    )  # fmt: skip


def _open(period: float, inertia: float, encoder: float) -> Physics:
    return Physics(
        inertia=inertia, viscous=0.02, ratio=1.0, resistance=0.4, amplifier=20.0, torque_constant=0.5, voltage_constant=0.5,
        tachometer=0.0122, period=period, law=OPEN, gain=0.0, bits=40.0, encoder=encoder, encoder_noise=0.1 * encoder, current_noise=0.2,
        current_step=0.1,
    )  # fmt: skip


_STROKES, _RAMPS = ("s_curve", "sines"), ("s_curve", "trapezoid")
FIRST = (
    Rig("screw_tacho_1k", "axis", _tachometer(1e-3, 5.0, 12.0, 1e-6, 800.0), True, "PositionController", 0.1, 0.08, 1.0, 8.0, _STROKES,
        5e-3, first=True),
    Rig("screw_cascade_4k", "axis", _cascade(0.25e-3, 10.0, 16.0, 0.05e-6, 12.0, 8.0, 60.0), True, "CascadeController", 0.12, 0.08, 1.5,
        6.0, _RAMPS, 10e-3, first=True),
    Rig("belt_pid_500", "axis", _pid(2e-3, 0.012, 10.0, 5e-6, (90.0, 250.0, 0.3), 0.02), True, "PositionController", 0.5, 0.3, 2.0, 12.0,
        _STROKES, 0.012 * 2 * pi, first=True),
    Rig("lathe_z", "lathe", _tachometer(5e-3, 5.0, 8.0, 1e-6, 224.5, scale=False), True, "PositionController", 0.06, 0.08, 0.4, 20.0,
        _STROKES, 5e-3, first=True),
    Rig("spindle_1k", "spindle", _open(1e-3, 0.2, 2 * pi / 10000), True, "", 107.0, 1.0, 100.0, 8.0, (), 2 * pi, load=0.01, first=True),
    Rig("screw_tacho_2k", "axis", _tachometer(0.5e-3, 4.0, 14.0, 0.5e-6, 1000.0, 0.02), False, "PositionController", 0.1, 0.08, 1.5, 8.0,
        _STROKES, 4e-3, first=True),
    Rig("screw_cascade_1k", "axis", _cascade(1e-3, 5.0, 12.0, 1e-6, 20.0, 0.0, 50.0), False, "CascadeController", 0.12, 0.08, 1.2, 8.0,
        _RAMPS, 5e-3, first=True),
    Rig("gear_pid_1k", "axis", _pid(1e-3, 0.004, 8.0, 10e-6, (200.0, 400.0, 0.5), 0.025), False, "PositionController", 0.25, 0.15, 1.5,
        8.0, _STROKES, 0.004 * 2 * pi, first=True),
    Rig("lathe_x", "lathe", _tachometer(5e-3, 4.0, 10.0, 1e-6, 260.0, 0.025, scale=False), False, "PositionController", 0.05, 0.08, 0.3,
        20.0, _STROKES, 4e-3, first=True),
    Rig("rotary_2k", "spindle", _open(0.5e-3, 0.05, 1e-4), False, "", 67.0, 1.0, 220.0, 6.0, (), 2 * pi, load=0.01, first=True),
)  # fmt: skip
"""The set that was written first."""

_SCREW = Physics(
    inertia=2.4e-3, viscous=4e-3, ratio=8e-3 / (2 * pi), resistance=0.8, amplifier=15.0, torque_constant=0.3, voltage_constant=0.3,
    tachometer=0.025, period=1e-3, law=FEED_FORWARD, gain=600.0, bits=14.0, encoder=0.5e-6, encoder_noise=5e-8, scale=0.5e-6,
    current_noise=0.03, current_step=0.02, feed_forward=33.58,
)  # fmt: skip
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

SECOND = (
    Rig("screw_feed_forward_1k", "axis", _SCREW, True, "FeedforwardController", 0.15, 0.1, 2.0, 8.0, ("trapezoid", "sines"), 8e-3),
    Rig("servo_current_2k", "axis", _SERVO, True, "PositionController", 0.2, 0.15, 3.0, 6.0, ("s_curve", "sines"), 10e-3),
    Rig("vertical_cascade_1k", "axis", _VERTICAL, True, "FeedforwardCascade", 0.08, 0.06, 0.8, 8.0, ("s_curve", "trapezoid"), 6e-3),
    Rig("spindle_speed_500", "spindle", _SPINDLE, True, "SpindleController", 60.0, 1.0, 150.0, 12.0, (), 2 * pi, load=0.01),
    Rig("lathe_both_z", "lathe", _SLIDE, True, "PositionController", 0.05, 0.04, 0.4, 20.0, ("trapezoid", "sines"), 5e-3,
        second=_SLIDE._replace(inertia=2.6e-3, viscous=2e-3, ratio=4e-3 / (2 * pi), gain=300.0)),
    Rig("linear_motor_4k", "axis", _LINEAR, False, "IntegralProportional", 0.4, 0.2, 6.0, 4.0, ("s_curve", "sines"), 30e-3),
    Rig("worm_table_1k", "rotary", _WORM, False, "AngleController", 1.5, 1.2, 15.0, 8.0, ("trapezoid", "sines"), 2 * pi / 72),
    Rig("belt_gear_500", "axis", _BELT, False, "MeasuredDerivative", 0.6, 0.3, 4.0, 12.0, ("steps", "s_curve", "sines"), 50e-3,
        gear=0.4),
    Rig("coarse_200", "axis", _COARSE, False, "PositionController", 0.2, 0.15, 1.5, 20.0, ("trapezoid", "steps", "sines"), 10e-3,
        current=False),
    Rig("lathe_both_x", "lathe", _CROSS, False, "PositionController", 0.05, 0.04, 0.4, 16.0, ("s_curve", "trapezoid"), 4e-3,
        second=_CROSS._replace(inertia=3.6e-3, viscous=4e-3, ratio=6e-3 / (2 * pi), gain=220.0)),
)  # fmt: skip
"""A set of other kinds; its author had no part in the method."""

RIGS = (*FIRST, *SECOND)
