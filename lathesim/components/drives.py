"""Drives: an amplifier and its motor, and the laws that axes and spindles with a DC motor share."""

from __future__ import annotations

from lathesim.component import Component, Input, Output, Parameter
from lathesim.elementary import within


def motor_current(
    voltage: float, motor_velocity: float, resistance: float, amplifier_gain: float, voltage_constant: float, tachometer_gain: float,
    largest_current: float, smallest_current: float,
) -> float:  # fmt: skip
    """Return the current [A] of a DC motor behind an amplifier with a tachometer loop, kept between the limits.

    I = (Ka (V - Kmtach w) - Kv w)/R.   Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), equations (1) and (6). Left out:
    inductance.
    """
    current = (amplifier_gain * (voltage - tachometer_gain * motor_velocity) - voltage_constant * motor_velocity) / resistance
    return within(current, smallest_current, largest_current)


def at_the_motor(own: float, ratio: float, driven: float) -> float:
    """Return an inertia or a viscous friction as the motor feels it: its own, and what it drives over a gear of ``ratio``."""
    return own + ratio * ratio * driven


def dry_friction(applied: float, speed: float, level: float, inertia: float, step: float) -> float:
    """Return the Coulomb friction that acts against ``speed``, in the unit of ``level``.

    The friction that would bring the motion to rest within one integration step, ``applied + inertia speed/step``, but never more than
    ``level``. Sliding: exactly ``level`` against the motion. Standing and pushed by less than ``level``: exactly the push, so the body
    rests without creeping. Between them a line, as wide as one step can decide, so that RK4 does not chatter as it does with sign().
    """
    return within(applied + inertia * speed / step, -level, level)


class VoltageDrive(Component):
    """Gives current and force (or torque) from the command voltage:  i = G (u - E v),  F = K i.

    For an amplifier that controls the current, G is its gain and E is 0; for one that applies a voltage to the winding, G is its gain over
    the resistance and E the back EMF over that gain. A published drive gain in newtons per volt is G K with G = 1 A/V.

    Source: R. Krishnan, Electric Motor Drives, Prentice Hall (2001), section 2.4. The default K is the drive gain of A. Janot,
    M. Gautier, M. Brunot, Data Set and Reference Models of EMPS (2019). Left out: inductance, current loop, limits, dead zone, ripple.
    """

    group = "axes"

    ports = {"drive": "voltage", "flow": "velocity", "back_emf": "back_emf", "current": "current", "applied": "effort"}

    voltage = Input("V", doc="command voltage")
    velocity = Input("{flow}", default=0.0, doc="velocity of what the motor moves")

    conductance = Parameter("A/V", 1.0, low=0.0, doc="current per volt (amplifier gain, over the resistance for a voltage)")
    back_emf = Parameter("V/({flow})", 0.0, low=0.0, doc="command voltage that a velocity takes up")
    effort_constant = Parameter("({effort})/A", 35.15065, low=0.0, doc="force or torque per current")

    current = Output("A", doc="current of the motor")
    effort = Output("{effort}", doc="force or torque of the drive")

    @staticmethod
    def output(voltage: float, velocity: float, conductance: float, back_emf: float, effort_constant: float) -> tuple[float, float]:
        current = conductance * (voltage - back_emf * velocity)
        return current, effort_constant * current
