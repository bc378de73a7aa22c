"""Friction over the first micrometres: surfaces that bend like springs before they slide."""

from __future__ import annotations

import math

from lathesim.component import DiscreteState, Input, Output, Parameter
from lathesim.effects.effect import Effect
from lathesim.effects.identification import Identification

_MOVED_BEFORE = 0.05
"""For how long a host that starts in motion has moved already [s]: what creeps has hardly bent the bristles."""


def _sliding_level(flow: float, level: float, excess: float, stribeck_velocity: float) -> float:
    return level + excess * math.exp(-abs(flow) / stribeck_velocity)


def _spring_force(travelled: float, force_before: float, level: float, distance: float) -> float:
    """Return the force of the bristles after ``travelled`` from ``force_before``: the exact solution of Dahl's equation for one stroke."""
    if travelled > 0.0:
        return level + (force_before - level) * math.exp(-travelled / distance)
    if travelled < 0.0:
        return -level + (force_before + level) * math.exp(travelled / distance)
    return force_before


class PreslidingFriction(Effect):
    """LuGre friction: bristles that bend over a few micrometres and then slide.

    dz/dt = v - sigma0 |v| z / g(v),   F_out = F_in + sigma0 z + sigma1 dz/dt,   g(v) = level + excess exp(-|v| / stribeck_velocity)

    with sigma0 = level / distance and sigma1 = bristle_damping. The bristle state is integrated exactly over each sample interval, as a
    function of the distance travelled, so a stiff contact needs no short step; a reversal inside one interval is seen at its end. A host
    that starts in motion has moved for 50 ms.
    Left out: the stiffness of a contact that has rested for long, and the lag of the lubricant film.
    """

    catalogue, family, site = 3, "reversal", "effort"
    neutral = {"level": 0.0}
    identification = Identification(
        generalises=("CoulombFriction",),
        minimal_form=("level", "distance"),
        typical={
            "level": (5.0, 100.0),
            "distance": (1e-6, 30e-6),
            "excess": (0.0, 50.0),
            "stribeck_velocity": (0.001, 0.02),
            "bristle_damping": (0.0, 3000.0),
        },
        typical_rotary={
            "level": (0.005, 5.0),
            "distance": (1e-4, 0.05),
            "excess": (0.0, 2.0),
            "stribeck_velocity": (0.1, 10.0),
            "bristle_damping": (0.0, 0.5),
        },
    )
    fingerprint = (
        "The missing force climbs over the first 1 to 30 um after each reversal and is a spring at standstill: a loop over position."
    )
    confused_with = ("CoulombFriction", "Backlash", "AxialResonance", "StribeckFriction")
    experiment = "A small sine of 1 to 50 um peak to peak at 1 Hz: the force-position loop closes for presliding and is flat for play."
    source = (
        "Canudas de Wit, Olsson, Astrom, Lischinsky, A new model for control of systems with friction, IEEE Trans. Autom. Control 40 "
        "(1995), eq. 1-3; Dahl, A solid friction model, Aerospace Corp. TOR-0158 (1968). Range assumed."
    )

    incoming = Input("{signal}", doc="disturbance before the friction")
    flow = Input("{flow}", doc="velocity of the host")
    displacement = Input("{displacement}", doc="position of the host")
    outgoing = Output("{signal}", doc="disturbance with the friction")
    bristle_force = DiscreteState("{signal}", doc="force of the bent bristles at the sample instant")
    bristle_position = DiscreteState("{displacement}", doc="position at the sample instant")
    level = Parameter("{signal}", 0.0, low=0.0, doc="friction in steady sliding")
    distance = Parameter("{displacement}", 5e-6, low=1e-9, doc="travel over which the friction builds up to 63 %")
    excess = Parameter("{signal}", 0.0, low=0.0, doc="static friction less sliding friction")
    stribeck_velocity = Parameter("{flow}", 0.005, low=1e-9, doc="speed at which the excess has fallen to 1/e")
    bristle_damping = Parameter("{signal}/({flow})", 0.0, low=0.0, doc="damping of the bristles while they bend")

    @staticmethod
    def update(
        bristle_force: float,
        bristle_position: float,
        flow: float,
        displacement: float,
        level: float,
        distance: float,
        excess: float,
        stribeck_velocity: float,
        time: float,
    ) -> tuple[float, float]:
        sliding = _sliding_level(flow, level, excess, stribeck_velocity)
        travelled = displacement - bristle_position if time > 0.0 else _MOVED_BEFORE * flow
        return _spring_force(travelled, bristle_force, sliding, distance), displacement

    @staticmethod
    def output(
        incoming: float,
        bristle_force: float,
        bristle_position: float,
        flow: float,
        displacement: float,
        level: float,
        distance: float,
        excess: float,
        stribeck_velocity: float,
        bristle_damping: float,
    ) -> float:
        if level == 0.0:
            return incoming
        sliding = _sliding_level(flow, level, excess, stribeck_velocity)
        spring = _spring_force(displacement - bristle_position, bristle_force, sliding, distance)
        bending = flow * (1.0 + spring / sliding) if flow < 0.0 else flow * (1.0 - spring / sliding)
        return incoming + spring + bristle_damping * bending
