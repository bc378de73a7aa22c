"""The rigs: what each is built of, and to which half it belongs."""

from __future__ import annotations

from dataclasses import dataclass

from tests.diagnosis.rigs.plant import CASCADE, OPEN, PID, P, Physics

MM = 1e-3 / 6.283185307179586
"""Travel per radian [m] of a screw of 1 mm lead."""


@dataclass(frozen=True)
class Rig:
    """A machine: ``kind`` axis, spindle or lathe; ``top`` speed [m/s, V], ``stroke`` [m], ``seconds`` of a recording, ``load`` share."""

    name: str
    kind: str
    physics: Physics
    calibrating: bool
    top: float = 0.1
    stroke: float = 0.08
    acceleration: float = 1.0
    seconds: float = 8.0
    load: float = 0.005
    scale: bool = True

    @property
    def descriptions(self) -> tuple[str, ...]:
        """The ways in which it is written down."""
        return ("table", "motor", "lathe") if self.kind == "lathe" else ("table", "motor")

    @property
    def torque(self) -> float:
        """The torque [N m] that its motion takes: what effects are sized by."""
        p = self.physics
        if self.kind == "spindle":
            return p.torque_constant * p.amplifier * 0.2 * self.top / p.resistance
        return p.inertia * self.acceleration / p.ratio + p.viscous * self.top / p.ratio

    @property
    def voltage(self) -> float:
        """The voltage that its motion takes at the top speed."""
        p = self.physics
        speed = self.top / p.ratio
        back = p.tachometer + p.voltage_constant / p.amplifier
        return self.top if self.kind == "spindle" else back * speed + self.torque * p.resistance / (p.torque_constant * p.amplifier)


def _tachometer(period: float, lead: float, bits: float, encoder: float, gain: float, tachometer: float = 0.03, **more: float) -> Physics:
    return Physics(
        inertia=3.2e-3, viscous=2.6e-3, ratio=lead * MM, resistance=1.0, amplifier=20.0, torque_constant=0.25, voltage_constant=0.25,
        tachometer=tachometer, period=period, law=P, proportional=gain, bits=bits, encoder=encoder, encoder_noise=0.1 * encoder,
        scale=encoder, current_noise=0.02, current_step=0.01, **more,
    )  # fmt: skip


def _cascade(period: float, lead: float, bits: float, encoder: float, velocity_gain: float, rate: float, position_gain: float) -> Physics:
    return Physics(
        inertia=2.0e-3, viscous=4e-3, ratio=lead * MM, resistance=1.0, amplifier=2.0, torque_constant=0.3, voltage_constant=0.0,
        tachometer=0.0, period=period, law=CASCADE, position_gain=position_gain, velocity_gain=velocity_gain, integral_rate=rate, bits=bits,
        encoder=encoder, encoder_noise=0.2 * encoder, scale=encoder, current_noise=0.01, current_step=0.005,
    )  # fmt: skip


def _pid(period: float, ratio: float, bits: float, encoder: float, gains: tuple[float, float, float], tachometer: float) -> Physics:
    return Physics(
        inertia=1.5e-3, viscous=3e-3, ratio=ratio, resistance=1.2, amplifier=12.0, torque_constant=0.2, voltage_constant=0.2,
        tachometer=tachometer, period=period, law=PID, proportional=gains[0], integral=gains[1], derivative=gains[2], bits=bits,
        encoder=encoder, encoder_noise=0.05 * encoder, scale=encoder, current_noise=0.02, current_step=0.02,
    )  # fmt: skip


def _spindle(period: float, inertia: float, encoder: float) -> Physics:
    return Physics(
        inertia=inertia, viscous=0.02, ratio=1.0, resistance=0.4, amplifier=20.0, torque_constant=0.5, voltage_constant=0.5,
        tachometer=0.0122, period=period, law=OPEN, encoder=encoder, encoder_noise=0.1 * encoder, current_noise=0.2, current_step=0.1,
    )  # fmt: skip


RIGS: tuple[Rig, ...] = (
    Rig("screw_tacho_1k", "axis", _tachometer(1e-3, 5.0, 12.0, 1e-6, 800.0), True),
    Rig("screw_cascade_4k", "axis", _cascade(0.25e-3, 10.0, 16.0, 0.05e-6, 12.0, 8.0, 60.0), True, top=0.12, acceleration=1.5, seconds=6.0),
    Rig("belt_pid_500", "axis", _pid(2e-3, 0.012, 10.0, 5e-6, (90.0, 250.0, 0.3), 0.02), True, top=0.5, stroke=0.3, acceleration=2.0,
        seconds=12.0),
    Rig("lathe_z", "lathe", _tachometer(5e-3, 5.0, 8.0, 1e-6, 224.5), True, top=0.06, acceleration=0.4, seconds=20.0),
    Rig("spindle_1k", "spindle", _spindle(1e-3, 0.2, 6.283185307179586e-4), True, top=4.0, load=0.01, scale=False),
    Rig("screw_tacho_2k", "axis", _tachometer(0.5e-3, 4.0, 14.0, 0.5e-6, 1000.0, 0.02), False, acceleration=1.5),
    Rig("screw_cascade_1k", "axis", _cascade(1e-3, 5.0, 12.0, 1e-6, 20.0, 0.0, 50.0), False, top=0.12, acceleration=1.2),
    Rig("gear_pid_1k", "axis", _pid(1e-3, 0.004, 8.0, 10e-6, (200.0, 400.0, 0.5), 0.025), False, top=0.25, stroke=0.15, acceleration=1.5),
    Rig("lathe_x", "lathe", _tachometer(5e-3, 4.0, 10.0, 1e-6, 260.0, 0.025), False, top=0.05, acceleration=0.3, seconds=20.0),
    Rig("rotary_2k", "spindle", _spindle(0.5e-3, 0.05, 1e-4), False, top=2.5, load=0.01, scale=False, seconds=6.0),
)  # fmt: skip
