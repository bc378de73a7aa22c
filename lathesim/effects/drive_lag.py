"""Lags: what comes later and rounder than the model says.

Each passes its input unchanged where the time constant is zero. A time constant shorter than two integration steps is followed by mixing
the lagged and the direct signal so that the mean delay is right: the laws stay stable, and smooth in the time constant down to zero.
"""

from __future__ import annotations

from lathesim.component import Input, Output, Parameter, State
from lathesim.effects.effect import Effect
from lathesim.effects.identification import Identification

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
    identification = Identification(
        typical={"time_constant": (0.1e-3, 10e-3)},
        typical_rotary={"time_constant": (0.1e-3, 10e-3)},
        as_simulated=True,
    )
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


class CurrentLoopLag(Effect):
    """A current loop of finite bandwidth: the force follows the command as a damped second-order system.

    y'' / w^2 + 2 damping y' / w + y = u,   w = 1 / time_constant

    The delay at low frequency is 2 damping time_constant; with the usual damping of 0.7 the bandwidth is w.
    """

    catalogue, family, site = 17, "lag", "drive"
    neutral = {"time_constant": 0.0}
    identification = Identification(
        typical={"time_constant": (0.08e-3, 2e-3), "damping": (0.4, 1.0)},
        typical_rotary={"time_constant": (0.08e-3, 2e-3), "damping": (0.4, 1.0)},
    )
    fingerprint = "The force lags the command with a phase that is linear at low frequency, and its amplitude drops near the bandwidth."
    confused_with = ("TransportDelay, whose amplitude does not drop", "MotorInductance", "SensorFilter")
    experiment = "A chirp: the amplitude falls for a loop and stays for a delay."
    source = "Altintas, Manufacturing Automation, 2nd ed. 2012, sec. 5.3 (current loops of 200 to 2000 Hz). Range assumed."

    incoming = Input("{signal}", doc="command")
    outgoing = Output("{signal}", doc="command that acts")
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
