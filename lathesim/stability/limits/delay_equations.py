"""Cuts as delay equations: turning with any modes, turning of a slotted bar, and milling with straight teeth."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from lathesim.errors import LessonError
from lathesim.record import FloatArray
from lathesim.stability.limits.periodic_delay import DelayEquation
from lathesim.stability.tool_point.modes import Mode, ToolPoint


def turning(
    tool: ToolPoint,
    stiffness: float,
    width: float,
    speed: float,
    *,
    process_damping: float = 0.0,
    diameter: float = 0.0,
    share: float = 1.0,
) -> DelayEquation:
    """Return the equation of a turning cut of chip width b [m] at a speed [rpm], Ks [N/m^2].

    With q_i the modes and x = sum q_i the motion along the normal:

        m_i q_i'' + c_i q_i' + k_i q_i = b (mu_i Ks (x(t - tau) - x) - cos^2(alpha_i) C x'/V)

    ``share`` is the part of each turn in which a slotted bar is in the cut; ``process_damping`` C [N/m] acts at ``diameter`` [m].
    """
    if not 0.0 < share <= 1.0:
        raise LessonError(f"the share of a turn in the cut is {share:g}.", remedy="Give one above 0 and at most 1.")
    if not speed > 0.0:
        raise LessonError(f"the speed is {speed:g} rpm.", remedy="Give one above 0.")
    delay, count = 60.0 / speed, len(tool.modes)
    drag = width * process_damping / (math.pi * diameter * speed / 60.0) if process_damping > 0.0 else 0.0
    free = np.zeros((2 * count, 2 * count))
    push, rub = np.zeros((2 * count, 2 * count)), np.zeros((2 * count, 2 * count))
    for place, (mode, factor, along) in enumerate(zip(tool.modes, tool.factors, tool.normal_factors, strict=True)):
        free[2 * place, 2 * place + 1] = 1.0
        free[2 * place + 1, 2 * place] = -mode.stiffness / mode.mass
        free[2 * place + 1, 2 * place + 1] = -mode.viscous / mode.mass
        push[2 * place + 1, 0::2] = factor * stiffness * width / mode.mass
        rub[2 * place + 1, 1::2] = along * drag / mode.mass
    inside = share * delay
    return DelayEquation(
        now=lambda time: free - push - rub if time < inside or share == 1.0 else free,
        before=lambda time: push if time < inside or share == 1.0 else np.zeros_like(push),
        period=delay,
        breaks=(inside,) if share < 1.0 else (),
        frequency=max(mode.frequency for mode in tool.modes),
    )


def milling(
    mode: Mode, tangential: float, normal: float, width: float, speed: float, *, teeth: int, entry: float, leave: float
) -> DelayEquation:
    """Return the equation of milling with straight teeth, one mode along the feed: in the cut from ``entry`` to ``leave`` [rad].

    m x'' + c x' + k x = -w h(t) (x - x(t - tau)),  h = sum over teeth in the cut of sin(phi) (Kt cos(phi) + Kn sin(phi)),  tau the time
    of a tooth.
    Source: T. Insperger, G. Stepan, Semi-Discretization for Time-Delay Systems (2011), milling with one degree of freedom.
    """
    delay = 60.0 / (speed * teeth)
    turn = 2.0 * math.pi * speed / 60.0
    pitch = 2.0 * math.pi / teeth

    def directional(time: float) -> float:
        total = 0.0
        for tooth in range(teeth):
            angle = (turn * time + tooth * pitch) % (2.0 * math.pi)
            if entry <= angle < leave:
                total += math.sin(angle) * (tangential * math.cos(angle) + normal * math.sin(angle))
        return total

    def matrix(value: float) -> FloatArray:
        return np.array([[0.0, 0.0], [value / mode.mass, 0.0]])

    free = np.array([[0.0, 1.0], [-mode.stiffness / mode.mass, -mode.viscous / mode.mass]])
    breaks = tuple(sorted({round((angle % pitch) / turn, 15) for angle in (entry, leave)}))
    now: Callable[[float], FloatArray] = lambda time: free - matrix(width * directional(time))  # noqa: E731
    return DelayEquation(now, lambda time: matrix(width * directional(time)), delay, breaks, mode.frequency)
