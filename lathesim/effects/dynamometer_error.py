"""What a dynamometer gets wrong by itself."""

from __future__ import annotations

import math

from lathesim.component import Input, Output, Parameter, State
from lathesim.effects.effect import Effect
from lathesim.effects.identification import Identification


class DynamometerDrift(Effect):
    """Charge that leaks away, and a zero that wanders: after the cut the reading does not come back.

    y_out = y_in - s + offset + drift t,   ds/dt = leak (y_in - s)          (leak = 1 / time constant of the charge amplifier)

    ``at: dynamometer`` is its main channel, ``at: dynamometer.thrust`` and ``at: dynamometer.feed`` are the others.
    """

    catalogue, family, site = 50, "slow", "reading"
    neutral = {"leak": 0.0, "drift": 0.0, "offset": 0.0}
    identification = Identification(
        carried=("N",),
        typical={"leak": (0.001, 0.5), "drift": (-5.0, 5.0), "offset": (-20.0, 20.0)},
        nuisance=("offset",),
    )
    fingerprint = "The force decays in the cut, and stands on the other side of zero after it."
    confused_with = ("TemperatureSoftening, after which the zero returns", "WearForceGrowth")
    experiment = "A known static load; the zero before and after."
    source = "Kistler, Multicomponent Dynamometer manuals (time constant of charge amplifiers, drift). Range assumed: 10 to 1000 s."

    incoming = Input("{signal}", doc="force on the dynamometer")
    outgoing = Output("{signal}", doc="reading")
    leaked = State("{signal}", doc="what has leaked away")
    leak = Parameter("1/s", 0.0, low=0.0, high=100.0, doc="1 over the time constant of the leak")
    drift = Parameter("({signal})/s", 0.0, doc="steady wandering of the zero")
    offset = Parameter("{signal}", 0.0, doc="zero at the start")

    @staticmethod
    def derivative(incoming: float, leaked: float, leak: float) -> float:
        return leak * (incoming - leaked)

    @staticmethod
    def output(incoming: float, leaked: float, time: float, leak: float, drift: float, offset: float) -> float:
        if leak == 0.0 and drift == 0.0 and offset == 0.0:
            return incoming
        return incoming - leaked + offset + drift * time


class DynamometerCrosstalk(Effect):
    """A channel that picks up a share of another force.

    y_out = y_in + share other
    """

    catalogue, family, site = 50, "force law", "reading"
    neutral = {"share": 0.0}
    identification = Identification(
        senses_beside="other_force",
        carried=("N",),
        typical={"share": (-0.05, 0.05)},
    )
    fingerprint = "One channel carries a copy of another."
    confused_with = ("a real side force",)
    experiment = "A known static load in one direction."
    source = "Kistler, Multicomponent Dynamometer manuals (crosstalk of 1 to 5 %). Range assumed."

    incoming = Input("{signal}", doc="force of this channel")
    other_force = Input("{signal}", doc="force of the other channel")
    outgoing = Output("{signal}", doc="reading of this channel")
    share = Parameter("1", 0.0, low=-1.0, high=1.0, doc="share of the other force")

    @staticmethod
    def output(incoming: float, other_force: float, share: float) -> float:
        if share == 0.0:
            return incoming
        return incoming + share * other_force


class DynamometerResonance(Effect):
    """A dynamometer that swings on its own stiffness.

    y'' + 2 damping w y' + w^2 y = w^2 x,   y_out = x + coupling (y - x),   w = 2 pi frequency
    """

    catalogue, family, site = 50, "lag", "reading"
    neutral = {"coupling": 0.0}
    identification = Identification(
        carried=("N",),
        typical={"coupling": (0.5, 1.0), "frequency": (300.0, 3000.0), "damping": (0.005, 0.05)},
    )
    fingerprint = "Ringing at one frequency after each entry and exit."
    confused_with = ("SensorFilter", "RegenerativeChatter")
    experiment = "A hammer blow without a cut."
    source = "Kistler, Multicomponent Dynamometer manuals (natural frequency mounted, 1 to 3 kHz). Range assumed."

    incoming = Input("{signal}", doc="force on the dynamometer")
    outgoing = Output("{signal}", doc="reading")
    followed = State("{signal}", doc="force through the spring")
    followed_rate = State("({signal})/s", doc="its rate")
    coupling = Parameter("1", 0.0, low=0.0, high=1.0, doc="1 with the resonance, 0 without")
    frequency = Parameter("Hz", 1000.0, low=0.1, high=20000.0, doc="natural frequency")
    damping = Parameter("1", 0.02, low=0.0, high=2.0, doc="damping ratio")

    @staticmethod
    def derivative(
        incoming: float, followed: float, followed_rate: float, coupling: float, frequency: float, damping: float
    ) -> tuple[float, float]:
        if coupling == 0.0:
            return 0.0, 0.0
        angular = 2.0 * math.pi * frequency
        return followed_rate, angular * (angular * (incoming - followed) - 2.0 * damping * followed_rate)

    @staticmethod
    def output(incoming: float, followed: float, coupling: float) -> float:
        if coupling == 0.0:
            return incoming
        return incoming + coupling * (followed - incoming)
