"""What a wave may be over besides: at one speed a wave over time and one over a position are the same."""

from __future__ import annotations

import numpy as np

from lathesim.diagnosis.explanations.conditions import Conditions, Term, Wave
from lathesim.diagnosis.method import STANDARD, Method

ONE_SPEED = "At one speed a wave over time and one over a position are the same: record other speeds."


def at_one_speed(term: Term, conditions: Conditions, method: Method = STANDARD) -> str:
    """Return what a wave over a position, or over time, is too where parts move at one speed for the larger part of a recording:
    ``" (or time, at 50 Hz)"``; empty where their speeds tell the two apart."""
    wave, others = term.wave, []
    for motion in conditions.motions if wave is not None else ():
        speed = np.abs(motion.velocity)
        usual = float(np.median(speed))
        steady = float(np.mean(np.abs(speed - usual) < method.little * usual)) > method.larger_part
        if wave is not None and steady and wave.of in ("", motion.name):
            other = Wave("", wave.period / usual, "s") if wave.of else Wave(motion.name, wave.period * usual, motion.unit)
            others.append(f"{f'position of {motion.name}' if other.of else 'time'}, {other.often}")
    return f" (or {', or '.join(others)})" if others else ""
