"""Lags: what comes later and rounder than the model says, and how far a servo stays behind its reference.

Lags: what comes later and rounder than the model says.

Each passes its input unchanged where the time constant is zero. A time constant shorter than two integration steps is followed by mixing
the lagged and the direct signal so that the mean delay is right: the laws stay stable, and smooth in the time constant down to zero.
"""

from __future__ import annotations

import math

from lathesim.component import DiscreteState, Input, Output, Parameter, State
from lathesim.effects.effect import Effect, Identification, OnCommand

_SHORTEST_STEPS = 2.0


def lag_rate(incoming: float, lagged: float, time_constant: float, step: float) -> float:
    """Return the rate of a first-order lag that is never faster than two steps."""
    shortest = _SHORTEST_STEPS * step
    if time_constant > shortest:
        return (incoming - lagged) / time_constant
    return (incoming - lagged) / shortest


def lag_value(incoming: float, lagged: float, time_constant: float, step: float) -> float:
    """Return the lagged signal, mixed with the direct one where the time constant is shorter than two steps."""
    shortest = _SHORTEST_STEPS * step
    if time_constant == 0.0:
        return incoming
    if time_constant >= shortest:
        return lagged
    return incoming + (lagged - incoming) * (time_constant / shortest)


class MotorInductance(Effect):
    """The winding of a motor that is driven by a voltage: current, and with it force, follow late.

    (L/R) di/dt + i = (u - E v) / R,   written on the voltage:   T dy/dt + y = u - E v,   u_out = y + E v

    E is the back EMF of the host, in volts per velocity; zero for an amplifier that controls the current.
    """

    catalogue, family, site = 16, "lag", "drive"
    neutral = {"time_constant": 0.0}
    identification = Identification(typical={"time_constant": (0.1e-3, 10e-3)}, as_simulated=True)
    fingerprint = "A first-order lag between voltage and current: rounded corners of the force, gain falling with frequency."
    confused_with = ("TransportDelay", "CurrentLoopLag", "SensorFilter")
    experiment = "Step the voltage with the rotor locked: inductance gives a slope from the start, a delay gives dead time."
    source = (
        "Krishnan, Electric Motor Drives, Prentice Hall 2001, sec. 2.6; Isermann, Fault-Diagnosis Applications, 2011, ch. 3. Range assumed."
    )

    incoming = Input("{signal}", doc="voltage at the terminals")
    flow = Input("{flow}", doc="velocity of the motor")
    back_emf = Input("{signal}/({flow})", default=0.0, doc="back EMF per velocity")
    outgoing = Output("{signal}", doc="voltage that would drive the same current without inductance")
    lagged = State("{signal}", doc="resistance times current")
    time_constant = Parameter("s", 0.0, low=0.0, high=1.0, doc="inductance over resistance")

    @staticmethod
    def derivative(incoming: float, flow: float, back_emf: float, lagged: float, time_constant: float, step: float) -> float:
        return lag_rate(incoming - back_emf * flow, lagged, time_constant, step)

    @staticmethod
    def output(incoming: float, flow: float, back_emf: float, lagged: float, time_constant: float, step: float) -> float:
        if time_constant == 0.0:
            return incoming
        induced = back_emf * flow
        return lag_value(incoming - induced, lagged, time_constant, step) + induced


class CurrentLoopLag(OnCommand, Effect):
    """A current loop of finite bandwidth: the force follows the command as a damped second-order system.

    y'' / w^2 + 2 damping y' / w + y = u,   w = 1 / time_constant

    The delay at low frequency is 2 damping time_constant; with the usual damping of 0.7 the bandwidth is w.
    """

    catalogue, family, site = 17, "lag", "drive"
    neutral = {"time_constant": 0.0}
    identification = Identification(typical={"time_constant": (0.08e-3, 2e-3), "damping": (0.4, 1.0)})
    fingerprint = "The force lags the command with a phase that is linear at low frequency, and its amplitude drops near the bandwidth."
    confused_with = ("TransportDelay, whose amplitude does not drop", "MotorInductance", "SensorFilter")
    experiment = "A chirp: the amplitude falls for a loop and stays for a delay."
    source = "Altintas, Manufacturing Automation, 2nd ed. 2012, sec. 5.3 (current loops of 200 to 2000 Hz). Range assumed."

    lagged = State("{signal}", doc="what the loop delivers")
    lagged_rate = State("({signal})/s", doc="its rate")
    time_constant = Parameter("s", 0.0, low=0.0, high=1.0, doc="1 over the angular bandwidth")
    damping = Parameter("1", 0.7, low=0.05, high=5.0, doc="damping ratio of the loop")

    @staticmethod
    def derivative(
        incoming: float, lagged: float, lagged_rate: float, time_constant: float, damping: float, step: float
    ) -> tuple[float, float]:
        slowest = max(time_constant, _SHORTEST_STEPS * step)
        return lagged_rate, ((incoming - lagged) / slowest - 2.0 * damping * lagged_rate) / slowest

    @staticmethod
    def output(incoming: float, lagged: float, time_constant: float, step: float) -> float:
        return lag_value(incoming, lagged, time_constant, step)


_SETTLED = 4.6
"""Lags after which a hundredth of a distance is left: a loop that settles within a sample stands at one at which it is asked to."""


_APERIODIC = 1e-12
"""Share of the squared decay within which two poles are one."""


def followed_running(
    value: float, rate: float, asked: float, slope: float, lag: float, velocity_lag: float, time: float
) -> tuple[float, float]:  # fmt: skip
    """Return ``value`` and its ``rate`` after some ``time`` in which what is asked for runs with ``slope`` from ``asked`` on."""
    off = value - (asked - lag * slope)
    end = asked + slope * (time - lag)
    if velocity_lag <= 0.0:
        rest = off * math.exp(-time / lag)
        return end + rest, slope - rest / lag
    off_rate = rate - slope
    decay = -0.5 / velocity_lag
    inside = decay * decay - 1.0 / (lag * velocity_lag)
    if inside > _APERIODIC * decay * decay:
        slow = decay + math.sqrt(inside)
        fast = decay - math.sqrt(inside)
        first = (off_rate - fast * off) / (slow - fast) * math.exp(slow * time)
        second = (slow * off - off_rate) / (slow - fast) * math.exp(fast * time)
        return end + first + second, slope + slow * first + fast * second
    swing = math.sqrt(max(-inside, _APERIODIC * decay * decay))
    cosine = math.exp(decay * time) * math.cos(swing * time)
    sine = math.exp(decay * time) * math.sin(swing * time) / swing
    rest = off * cosine + (off_rate - decay * off) * sine
    return end + rest, slope + off_rate * cosine + (decay * off_rate - (decay * decay + swing * swing) * off) * sine


class ServoLag(Effect):
    """A position loop without feed forward, which follows at a distance that grows with the speed.

    T T_v d2v/dt2 + T dv/dt + v = v_ref,   x = x_ref - T (v + T_v dv/dt)          (T = ``lag``, T_v = ``velocity_lag``)

    T is 1 / gain of the position loop, T_v the time constant of the velocity loop inside, nothing in the plain shape. The acceleration that
    is reached follows the one asked for in the same way, and with both the current that the motion takes is late.

    Solved exactly for a velocity whose slope, the acceleration asked for, changes in the middle between two samples. The recording begins
    in a steady acceleration; a loop that settles within a sample stands where rest is asked for. Left out: what else happens between
    samples, and what a load does to the distance.
    """

    catalogue, family, site = 0, "lag", "reference"
    also_at = {"reference_rate": ("velocity_in", "velocity_out"), "reference_acceleration": ("acceleration_in", "acceleration_out")}
    neutral = {"lag": 0.0}
    identification = Identification(typical={"lag": (1e-3, 60e-3), "velocity_lag": (0.5e-3, 20e-3)}, extended=("velocity_lag",))
    fingerprint = "The position stays behind the command in proportion to the velocity, at rest by nothing, and the current is late."
    confused_with = (
        "SensorFilter of the position, with which the current is in time",
        "TransportDelay",
        "ChannelTimeShift",
        "Backlash, which does not grow with the speed",
    )
    experiment = "Corners and circles at several feeds: a lag rounds them more the faster they are run, a shift of the channel does not."
    source = "Y. Koren, Computer Control of Manufacturing Systems, McGraw-Hill (1983), chapter 5 (following error v/K). Range assumed."

    incoming = Input("{signal}", doc="commanded position")
    velocity_in = Input("{reference_rate}", doc="commanded velocity")
    acceleration_in = Input("{reference_acceleration}", doc="commanded acceleration")
    outgoing = Output("{signal}", doc="position that is reached")
    velocity_out = Output("{reference_rate}", doc="velocity that is reached")
    acceleration_out = Output("{reference_acceleration}", doc="acceleration that is reached")
    velocity = DiscreteState("{reference_rate}", doc="velocity that is reached")
    velocity_slope = DiscreteState("{reference_acceleration}", doc="its rate of change")
    acceleration = DiscreteState("{reference_acceleration}", doc="acceleration that is reached")
    acceleration_slope = DiscreteState("{reference_acceleration}/s", doc="its rate of change")
    velocity_before = DiscreteState("{reference_rate}", doc="commanded velocity one sample before")
    acceleration_before = DiscreteState("{reference_acceleration}", doc="commanded acceleration one sample before")
    lag = Parameter("s", 0.0, low=0.0, high=10.0, doc="distance behind over velocity")
    velocity_lag = Parameter("s", 0.0, low=0.0, high=10.0, doc="time constant of the velocity loop")

    @staticmethod
    def update(
        velocity_in: float, acceleration_in: float, velocity: float, velocity_slope: float, acceleration: float, acceleration_slope: float,
        velocity_before: float, acceleration_before: float, lag: float, velocity_lag: float, sample_period: float, time: float,
    ) -> tuple[float, float, float, float, float, float]:  # fmt: skip
        if time <= 0.0 or lag == 0.0:
            return velocity_in - lag * acceleration_in, acceleration_in, acceleration_in, 0.0, velocity_in, acceleration_in
        half = 0.5 * sample_period
        # what is asked for runs on with its slope to the middle of the sample, and jumps there to what leads to its end
        reached, slope = followed_running(velocity, velocity_slope, velocity_before, acceleration_before, lag, velocity_lag, half)
        reached, slope = followed_running(reached, slope, velocity_in - acceleration_in * half, acceleration_in, lag, velocity_lag, half)
        if velocity_in == 0.0 and acceleration_in == 0.0 and sample_period > _SETTLED * lag:
            reached, slope = 0.0, 0.0
        later, later_slope = followed_running(acceleration, acceleration_slope, acceleration_before, 0.0, lag, velocity_lag, half)
        later, later_slope = followed_running(later, later_slope, acceleration_in, 0.0, lag, velocity_lag, half)
        return reached, slope, later, later_slope, velocity_in, acceleration_in

    @staticmethod
    def output(
        incoming: float, velocity_in: float, acceleration_in: float, velocity: float, velocity_slope: float, acceleration: float,
        lag: float, velocity_lag: float,
    ) -> tuple[float, float, float]:  # fmt: skip
        if lag == 0.0:
            return incoming, velocity_in, acceleration_in
        return incoming - lag * (velocity + velocity_lag * velocity_slope), velocity, acceleration
