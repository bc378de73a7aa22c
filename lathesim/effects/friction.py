"""Friction: what answers to velocity, and what bends over the first micrometres before it slides.

Friction that answers to velocity: the trace is a step or a peak of the missing force where the motion turns round.

All of these stick exactly and still pass through fixed-step RK4: the friction is the force that would bring the body to rest within two
integration steps, limited to what the surfaces can carry (Karnopp 1985, with the width tied to the step and not to a speed). In sliding
that is level * sgn(v); at rest it balances whatever pushes. What is driven back by more than that is not held: its friction turns round
with its velocity, and not a step before. Place friction after offsets and ripples on the same port, so that it sees them; several
frictions in a row share the load. A host that does not tell its driving force is served too: at rest it then creeps by
(driving force) * 2 step / inertia.
"""

from __future__ import annotations

import math

from lathesim.component import DiscreteState, Input, Output, Parameter
from lathesim.effects.effect import SHAPE, SHAPE_RANGES, Effect, Identification, harmonic_parameters, harmonics
from lathesim.elementary import power, sin

_STEPS_TO_REST = 2.0


def resisting(demand: float, backward: float, forward: float) -> float:
    """Return the demanded friction, limited to -backward .. +forward [same unit as the demand]."""
    if demand > forward:
        return forward
    if demand < -backward:
        return -backward
    return demand


def dry(applied: float, incoming: float, inertia: float, flow: float, step: float, backward: float, forward: float) -> float:
    """Return the dry friction of a body, between -backward and +forward.

    A body that is driven back by more than its friction passes rest and is not held there: its friction turns round with its velocity. The
    force that would bring it to rest within two steps would turn round before it, and drive it.
    """
    demand = demand_to_rest(applied, incoming, inertia, flow, step)
    if driven_back(demand, inertia, flow, step, backward, forward):
        return forward if flow > 0.0 else -backward
    return resisting(demand, backward, forward)


def driven_back(demand: float, inertia: float, flow: float, step: float, backward: float, forward: float) -> bool:
    """Return whether what pushes a moving body back is more than its friction, -backward to +forward, can hold."""
    pushing = demand - inertia * flow / (_STEPS_TO_REST * step)
    return (flow > 0.0 and pushing < -backward) or (flow < 0.0 and pushing > forward)


def demand_to_rest(applied: float, incoming: float, inertia: float, flow: float, step: float) -> float:
    """Return the friction that lets the velocity decay within two steps: applied - incoming + m v / (2 step).

    A driving force that is not a number (a host whose drive force nobody wired) counts as zero.
    """
    if math.isnan(applied):
        applied = 0.0
    return applied - incoming + inertia * flow / (_STEPS_TO_REST * step)


class FrictionAtRest:
    """What a friction takes and gives that can hold its host at rest."""

    incoming = Input("{signal}", doc="disturbance before the friction")
    applied = Input("{signal}", default=0.0, doc="driving force or torque on the host, which friction at rest balances")
    inertia = Input("{signal}*s/({flow})", doc="moving mass or inertia of the host")
    flow = Input("{flow}", doc="velocity of the host")
    outgoing = Output("{signal}", doc="disturbance with the friction")


class CoulombFriction(FrictionAtRest, Effect):
    """Friction of constant size against the motion; at rest it balances any smaller force.

    F_out = F_in + level sgn(v)                              sliding
    F_out = F_in + (applied - F_in), at most level           sticking

    Left out: the rise over the first micrometres (PreslidingFriction) and the peak at low speed (StribeckFriction).
    """

    catalogue, family, site = 1, "reversal", "effort"
    neutral = {"level": 0.0}
    identification = Identification(typical={"level": (5.0, 100.0)}, typical_rotary={"level": (0.005, 5.0)})
    fingerprint = "The missing force steps by twice the level where the velocity changes sign, and is flat in speed elsewhere."
    confused_with = ("viscous friction, at one speed only", "ForceOffset, in one direction only", "PreslidingFriction", "StribeckFriction")
    experiment = "Constant speeds in both directions, three or more of them: Coulomb friction is the intercept, viscous friction the slope."
    source = (
        "Armstrong-Helouvry, Dupont, Canudas de Wit, A survey of models, analysis tools and compensation methods for the control of "
        "machines with friction, Automatica 30 (1994), sec. 2; sticking: Karnopp, J. Dyn. Syst. Meas. Control 107 (1985). Range assumed."
    )

    level = Parameter("{signal}", 0.0, low=0.0, doc="size of the friction")

    @staticmethod
    def output(incoming: float, applied: float, inertia: float, flow: float, level: float, step: float) -> float:
        if level == 0.0:
            return incoming
        return incoming + dry(applied, incoming, inertia, flow, step, level, level)


class StribeckFriction(Effect):
    """The part of the friction that dies out with speed: boundary lubrication turning into a film.

    F_out = F_in + excess exp(-(|v| / stribeck_velocity)^shape) sgn(v)

    It stands on top of CoulombFriction: the static friction is level + excess.
    Left out: the lag of the lubricant film behind the speed (frictional memory).
    """

    catalogue, family, site = 2, "reversal", "effort"
    neutral = {"excess": 0.0}
    identification = Identification(
        prerequisites=("CoulombFriction",),
        typical={"excess": (1.0, 100.0), "stribeck_velocity": (0.001, 0.02), "shape": (1.0, 2.0)},
        typical_rotary={"excess": (0.001, 5.0), "stribeck_velocity": (0.1, 10.0), "shape": (1.0, 2.0)},
    )
    fingerprint = "The missing force peaks at low speed and falls as the speed grows; creeping motion sticks and slips."
    confused_with = ("a smoothed sign function in the model", "PreslidingFriction", "viscous friction that is concave in speed")
    experiment = "Creep at constant speeds from 0.2 to 20 mm/s, both ways: only Stribeck friction has a falling branch."
    source = (
        "Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994), eq. 2; sizes on feed drives: Erkorkmaz, Altintas, High speed "
        "CNC system design part II, Int. J. Mach. Tools Manuf. 41 (2001). Range assumed."
    )

    incoming = Input("{signal}", doc="disturbance before this friction")
    applied = Input("{signal}", default=0.0, doc="driving force or torque on the host, which friction at rest balances")
    inertia = Input("{signal}*s/({flow})", doc="moving mass or inertia of the host")
    flow = Input("{flow}", doc="velocity of the host")
    outgoing = Output("{signal}", doc="disturbance with this friction")
    excess = Parameter("{signal}", 0.0, low=0.0, doc="static friction less Coulomb friction")
    stribeck_velocity = Parameter("{flow}", 0.005, low=1e-9, doc="speed at which the excess has fallen to 1/e")
    shape = Parameter("1", 1.0, low=0.5, high=4.0, doc="exponent: 1 exponential, 2 Gaussian")

    @staticmethod
    def output(
        incoming: float, applied: float, inertia: float, flow: float, excess: float, stribeck_velocity: float, shape: float, step: float
    ) -> float:
        if excess == 0.0:
            return incoming
        level = excess * math.exp(-power(abs(flow) / stribeck_velocity, shape))
        return incoming + dry(applied, incoming, inertia, flow, step, level, level)


class GearLoss(Effect):
    """Friction of a gear that grows with the torque it transmits: a worm, a planetary or a cheap spur gear.

    T_out = T_in + loss (|T_drive| + |T_load|) / 2 sgn(v)              (efficiency: 1 - loss)

    The load is what pulls at the output: gravity, and the disturbance before this friction. A gear with a loss above one half holds a load
    by itself. Left out: inertia between drive and gear, and a loss that differs with the direction in which power flows.
    """

    catalogue, family, site = 52, "reversal", "effort"
    neutral = {"loss": 0.0}
    identification = Identification(carried=("N*m",), generalises=("CoulombFriction",), typical={"loss": (0.02, 0.6)})
    fingerprint = "The missing torque steps where the velocity changes sign, by more the more torque acts."
    confused_with = ("CoulombFriction, under one load", "DriveGainError, in one direction")
    experiment = "Turn at one slow speed under several loads, both ways: dry friction is the intercept over the load, gear loss the slope."
    source = (
        "Dohring, Lee, Newman, A load-dependent transmission friction model, IEEE Int. Conf. Robotics and Automation 1993. Range assumed."
    )

    incoming = Input("{signal}", doc="disturbance before this friction")
    applied = Input("{signal}", default=0.0, doc="torque of the drive")
    pushing = Input("{signal}", default=math.nan, doc="torque of drive and gravity; that of the drive where nothing gives it")
    inertia = Input("{signal}*s/({flow})", doc="moving inertia of the host")
    flow = Input("{flow}", doc="velocity of the host")
    outgoing = Output("{signal}", doc="disturbance with this friction")
    loss = Parameter("1", 0.0, low=0.0, high=1.0, doc="torque that is lost over torque that is transmitted")

    @staticmethod
    def output(incoming: float, applied: float, pushing: float, inertia: float, flow: float, loss: float, step: float) -> float:
        if loss == 0.0:
            return incoming
        driving = 0.0 if math.isnan(applied) else applied
        net = driving if math.isnan(pushing) else pushing
        level = 0.5 * loss * (abs(driving) + abs(driving - net + incoming))
        return incoming + dry(net, incoming, inertia, flow, step, level, level)


class AsymmetricFriction(FrictionAtRest, Effect):
    """Friction that differs between the two directions.

    F_out = F_in + level (1 + asymmetry sgn(v)) sgn(v) + viscous_difference |v|

    The level is the mean of both directions; the viscous difference adds to the slope going forward and takes from it coming back.
    """

    catalogue, family, site = 4, "reversal", "effort"
    neutral = {"level": 0.0, "viscous_difference": 0.0}
    identification = Identification(
        generalises=("CoulombFriction",),
        needs_both_ways=True,
        typical={"level": (5.0, 100.0), "asymmetry": (-0.4, 0.4), "viscous_difference": (-200.0, 200.0)},
        typical_rotary={"level": (0.005, 5.0), "asymmetry": (-0.4, 0.4), "viscous_difference": (-0.05, 0.05)},
    )
    fingerprint = "The missing force has a part that is even in the velocity, and none of it at rest."
    confused_with = ("ForceOffset", "a drive whose gain differs between the directions", "CoulombFriction")
    experiment = "Equal speeds both ways, then hold still: an offset stays at rest, an asymmetry does not."
    source = (
        "Armstrong-Helouvry, Control of Machines with Friction, Kluwer 1991, ch. 4; Erkorkmaz, Altintas, Int. J. Mach. Tools Manuf. 41 "
        "(2001), part II, sec. 2. Range assumed."
    )

    level = Parameter("{signal}", 0.0, low=0.0, doc="mean size of the friction of both directions")
    asymmetry = Parameter("1", 0.0, low=-0.95, high=0.95, doc="share by which forward exceeds the mean")
    viscous_difference = Parameter("{signal}/({flow})", 0.0, doc="viscous friction forward less mean")

    @staticmethod
    def output(
        incoming: float, applied: float, inertia: float, flow: float, level: float, asymmetry: float, viscous_difference: float,
        step: float,
    ) -> float:  # fmt: skip
        if level == 0.0 and viscous_difference == 0.0:
            return incoming
        viscous = incoming + viscous_difference * abs(flow)
        return viscous + dry(applied, viscous, inertia, flow, step, level * (1.0 - asymmetry), level * (1.0 + asymmetry))


class PositionDependentFriction(FrictionAtRest, Effect):
    """Friction that varies along the travel: a tight spot of the way or a screw running eccentric in its nut.

    F_out = F_in + amplitude (sin a + second and third harmonic) sgn(v),   a = 2 pi q / period + phase

    A harmonic is sine sin(n a) + cosine cos(n a), both given as shares of the amplitude. The effect stands on a CoulombFriction, whose
    level is the mean and which it does not exceed. Left out: a body at rest where the friction is below its mean breaks away only at the
    mean.
    """

    catalogue, family, site = 6, "once per turn", "effort"
    neutral = {"amplitude": 0.0}
    identification = Identification(
        against_motion=True,
        prerequisites=("CoulombFriction",),
        needs_both_ways=True,
        typical={"amplitude": (1.0, 40.0), "period": (0.002, 0.5), "phase": (-math.pi, math.pi), **SHAPE_RANGES},
        typical_rotary={"amplitude": (0.001, 2.0), "period": (0.2, 2.0 * math.pi), "phase": (-math.pi, math.pi), **SHAPE_RANGES},
        nuisance=("phase",),
        extended=SHAPE,
    )
    fingerprint = "The missing force repeats with the position and changes sign with the direction."
    confused_with = ("TorqueRipple and Cogging, which keep their sign", "PeriodicPitchError")
    experiment = "Pass the same positions at the same speed in both directions: friction turns over, ripple does not."
    source = "Erkorkmaz, Altintas, High speed CNC system design part II, Int. J. Mach. Tools Manuf. 41 (2001). Form and range assumed."

    displacement = Input("{displacement}", doc="position of the host")
    amplitude = Parameter("{signal}", 0.0, low=0.0, doc="half of what the friction varies by, at most the level of the friction")
    period = Parameter("{displacement}", 0.01, low=1e-6, doc="travel after which it repeats")
    phase = Parameter("rad", 0.0, doc="phase at position zero")
    second_sine, second_cosine, third_sine, third_cosine = harmonic_parameters()

    @staticmethod
    def output(
        incoming: float, applied: float, inertia: float, flow: float, displacement: float, amplitude: float, period: float, phase: float,
        second_sine: float, second_cosine: float, third_sine: float, third_cosine: float, step: float,
    ) -> float:  # fmt: skip
        if amplitude == 0.0:
            return incoming
        angle = 2.0 * math.pi * displacement / period + phase
        level = amplitude * (sin(angle) + harmonics(angle, second_sine, second_cosine, third_sine, third_cosine))
        if level >= 0.0:
            return incoming + dry(applied, incoming, inertia, flow, step, level, level)
        demand = demand_to_rest(applied, incoming, inertia, flow, step)
        if driven_back(demand, inertia, flow, step, -level, -level):
            return incoming + (level if flow > 0.0 else -level)
        return incoming - resisting(demand - resisting(demand, -level, -level), -level, -level)


class ViscousWarmUp(Effect):
    """Viscous friction that changes as grease and bearings warm up.

    F_out = F_in + change (1 - exp(-(t + warmed_before) / time_constant)) v

    Time counts from the start of the recording; the change is negative for grease that thins.
    """

    catalogue, family, site = 7, "slow", "effort"
    neutral = {"change": 0.0}
    identification = Identification(
        typical={"change": (-500.0, 100.0), "time_constant": (10.0, 3600.0)},
        typical_rotary={"change": (-0.01, 0.01), "time_constant": (10.0, 3600.0)},
        history=("warmed_before",),
    )
    fingerprint = "The missing force scales with the speed and drifts slowly over the recording, the same way in both directions."
    confused_with = ("ThermalScrewGrowth", "WearForceGrowth", "ClockSkew")
    experiment = "Repeat one lap after 0, 10, 30 and 60 minutes; cut and do not cut."
    source = (
        "ISO 230-3 (thermal effects, test procedure); Armstrong-Helouvry, Control of Machines with Friction, 1991, ch. 4. Form "
        "and range assumed."
    )

    incoming = Input("{signal}", doc="disturbance before the warm-up")
    flow = Input("{flow}", doc="velocity of the host")
    outgoing = Output("{signal}", doc="disturbance with the warm-up")
    change = Parameter("{signal}/({flow})", 0.0, doc="change of the viscous friction once warm")
    time_constant = Parameter("s", 600.0, low=1e-3, doc="time to warm up to 63 %")
    warmed_before = Parameter("s", 0.0, low=0.0, doc="how long it had been warming up when the recording began")

    @staticmethod
    def output(incoming: float, flow: float, time: float, change: float, time_constant: float, warmed_before: float) -> float:
        return incoming if change == 0.0 else incoming + change * (1.0 - math.exp(-(time + warmed_before) / time_constant)) * flow


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
        extended=("excess", "stribeck_velocity", "bristle_damping"),
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
        bristle_force: float, bristle_position: float, flow: float, displacement: float, level: float, distance: float, excess: float,
        stribeck_velocity: float, time: float,
    ) -> tuple[float, float]:  # fmt: skip
        sliding = _sliding_level(flow, level, excess, stribeck_velocity)
        travelled = displacement - bristle_position if time > 0.0 else _MOVED_BEFORE * flow
        return _spring_force(travelled, bristle_force, sliding, distance), displacement

    @staticmethod
    def output(
        incoming: float, bristle_force: float, bristle_position: float, flow: float, displacement: float, level: float, distance: float,
        excess: float, stribeck_velocity: float, bristle_damping: float,
    ) -> float:  # fmt: skip
        if level == 0.0:
            return incoming
        sliding = _sliding_level(flow, level, excess, stribeck_velocity)
        spring = _spring_force(displacement - bristle_position, bristle_force, sliding, distance)
        bending = flow * (1.0 + spring / sliding) if flow < 0.0 else flow * (1.0 - spring / sliding)
        return incoming + spring + bristle_damping * bending
