"""What a rig of the second set is, and what its motion takes."""

from __future__ import annotations

from dataclasses import dataclass

from tests.diagnosis.rigs.second.physics import FEED_FORWARD, Physics
from tests.diagnosis.rigs.second.programs import Program


@dataclass(frozen=True)
class Rig:
    """A machine.

    ``kind`` is axis, rotary, spindle or lathe. ``top`` is the greatest speed of the load [m/s or rad/s], ``stroke`` its way and
    ``acceleration`` its acceleration; ``load`` is the noise of the force as a share of the torque that this takes. ``controller`` is the
    part of the lesson, ``turn`` the travel of the load per turn of what repeats, ``gear`` the turns of the screw per turn of the motor,
    ``large_current`` [A] what 1.5 % of the samples of a sound recording exceed. A lathe has a second axis, which moves at the same time.
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
    program: Program
    turn: float
    large_current: float
    load: float = 0.005
    gear: float = 1.0
    current: bool = True
    second: Physics | None = None

    @property
    def scale(self) -> bool:
        """Whether a scale is read beside the encoder that the controller reads."""
        return self.physics.scale > 0.0

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


def feed_forward(share: float, p: Physics) -> Physics:
    """Return the physics with a share of the voltage fed forward that a speed of the load takes up."""
    back = (p.tachometer + p.voltage_constant / p.amplifier) / p.ratio
    return p._replace(law=FEED_FORWARD, feed_forward=round(share * back, 2))
