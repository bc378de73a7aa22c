"""Laws that axes and spindles with a DC motor share: the current of the amplifier, and the dry friction of what turns."""

from __future__ import annotations


def motor_current(
    voltage: float,
    speed: float,
    resistance: float,
    amplifier_gain: float,
    voltage_constant: float,
    tachometer_gain: float,
    largest_current: float,
    smallest_current: float,
) -> float:
    """Return the current [A] of a DC motor behind an amplifier with a tachometer loop, kept between the limits.

    I = (Ka (V - Kmtach w) - Kv w)/R.   Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), equations (1) and (6). Left out:
    inductance.
    """
    current = (amplifier_gain * (voltage - tachometer_gain * speed) - voltage_constant * speed) / resistance
    if current > largest_current:
        current = largest_current
    if current < smallest_current:
        current = smallest_current
    return current


def dry_friction(applied: float, speed: float, level: float, inertia: float, step: float) -> float:
    """Return the Coulomb friction that acts against ``speed``, in the unit of ``level``.

    The friction that would bring the motion to rest within one integration step, ``applied + inertia speed/step``, but never more than
    ``level``. Sliding: exactly ``level`` against the motion. Standing and pushed by less than ``level``: exactly the push, so the body
    rests without creeping. Between them a line, as wide as one step can decide, so that RK4 does not chatter as it does with sign().
    """
    wanted = applied + inertia * speed / step
    if wanted > level:
        return level
    if wanted < -level:
        return -level
    return wanted
