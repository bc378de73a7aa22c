"""The stability lobes: the limit of the chip width over the spindle speed, by any of three methods."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from lathesim.errors import LessonError
from lathesim.stability.frequency_limit import WidthLimit, between_lines, limit_at, limit_of_response, limits_of_lines, smallest_limit
from lathesim.stability.lesson_cut import Cut, with_modes
from lathesim.stability.periodic_delay import DelayEquation, chatter_frequency, kind_of, milling, smallest_unstable, turning
from lathesim.stability.tool_point import FrequencyResponse, Mode, ToolPoint
from lathesim.units import in_unit

METHODS = ("frequency", "collocation", "time")
_WIDEST = 50.0
"""Times the smallest limit up to which a limit is looked for by collocation and in the time domain, assumed: nobody cuts wider."""
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class LobePoint:
    """The limit at a speed, and how stability is lost there: "Hopf" or "flip"; 95 % bounds of the limit [m] where something is
    uncertain."""

    limit: WidthLimit
    kind: str
    low: float = math.nan
    high: float = math.nan


@dataclass(frozen=True)
class StabilityMap:
    """Limits over speed with the method they come from, the smallest of all speeds, and sentences worth telling."""

    points: tuple[LobePoint, ...]
    method: str
    smallest: WidthLimit
    findings: tuple[str, ...] = field(default=())


def stability_map(cut: Cut, speeds: Sequence[float], method: str, progress: Progress | None = None) -> StabilityMap:
    """Return the limit at each speed [rpm].

    An interrupted cut and milling need the method "collocation" or "time", :class:`LessonError` otherwise. A measured response is taken as
    it is by the method "frequency"; the others fit modes to it, which is said.
    """
    for speed in speeds:
        if not speed > 0.0 or not math.isfinite(speed):
            raise LessonError(f"the speed is {speed:g} rpm.", remedy="Give speeds above 0.")
    if method == "frequency":
        if cut.share < 1.0 or cut.milling is not None:
            word = "An interrupted cut" if cut.milling is None else "Milling"
            raise LessonError(f"{word.lower()} has no limit in the frequency domain.", remedy="Use the method 'collocation'.")
        return _by_frequency(cut, speeds)
    tool, fitted = with_modes(cut)
    # what holds at any speed is known in closed form for an uninterrupted cut only
    whole = cut.milling is None and cut.share == 1.0
    smallest = smallest_limit(tool, cut.stiffness) if whole else WidthLimit(math.nan, math.nan)
    findings = (*(cut.tool.findings if isinstance(cut.tool, FrequencyResponse) else ()), *((fitted,) if fitted else ()))
    points = []
    for place, speed in enumerate(speeds):
        points.append(_by_collocation(cut, tool, speed) if method == "collocation" else _by_time(cut, tool, speed))
        if progress is not None:
            progress(place + 1, len(speeds))
    if isinstance(cut.tool, FrequencyResponse) and any(point.limit.frequency > cut.tool.highest for point in points):
        findings += (f"Limits with chatter above {cut.tool.highest:g} Hz rest on the residual term, beyond the measured response.",)
    if any(math.isinf(point.limit.width) for point in points):
        findings += (f"'stable' means up to {in_unit(_widest(cut, first_guess(cut, tool)), 'mm')}; wider cuts were not tried.",)
    return StabilityMap(tuple(points), method, smallest, findings)


def _by_frequency(cut: Cut, speeds: Sequence[float]) -> StabilityMap:
    tool = cut.tool
    if isinstance(tool, FrequencyResponse):
        lines, values = between_lines(tool.frequency, tool.receptance_values)
        tool = replace(tool, frequency=lines, receptance_values=values, coherence=None, hits=None, forces=None)
        response = cut.factor * tool.receptance_values
        lowest = int(np.argmin(response.real))
        reach = -0.5 / (cut.stiffness * float(response.real[lowest])) if response.real[lowest] < 0.0 else math.inf
        smallest = WidthLimit(math.nan, reach, float(tool.frequency[lowest]))
        if cut.process_damping > 0.0:
            limits = [
                limit_of_response(
                    tool,
                    cut.factor,
                    math.cos(cut.direction) ** 2,
                    cut.stiffness,
                    speed,
                    process_damping=cut.process_damping,
                    diameter=cut.diameter,
                )
                for speed in speeds
            ]
        else:
            limits = limits_of_lines(tool.frequency, response, cut.stiffness, np.asarray(speeds))
        findings = tool.findings
        if tool.window_rate:
            findings += (
                f"the response was weighted by a window of {tool.window_rate:.3g} 1/s and looks more damped than the tool point is",
            )
    else:
        limits = [limit_at(tool, cut.stiffness, speed, process_damping=cut.process_damping, diameter=cut.diameter) for speed in speeds]
        smallest, findings = smallest_limit(tool, cut.stiffness), ()
    points = tuple(LobePoint(limit, "Hopf" if math.isfinite(limit.width) else "") for limit in limits)
    return StabilityMap(points, "frequency", smallest, findings)


def equation_of(cut: Cut, tool: ToolPoint, speed: float) -> Callable[[float], DelayEquation]:
    """Return what makes the delay equation of a cut at a speed [rpm] from a chip width [m]."""
    mill = cut.milling
    if mill is None:
        return lambda width: turning(
            tool, cut.stiffness, width, speed, process_damping=cut.process_damping, diameter=cut.diameter, share=cut.share
        )
    mode = one_mode(tool)
    return lambda width: milling(mode, mill.tangential, mill.normal, width, speed, teeth=mill.teeth, entry=mill.entry, leave=mill.leave)


def one_mode(tool: ToolPoint) -> Mode:
    """Return the mode along the feed that milling takes; :class:`LessonError` where there are several."""
    if len(tool.modes) != 1:
        raise LessonError(f"milling takes one mode, along the feed, and there are {len(tool.modes)}.", remedy="Give one mode.")
    return tool.modes[0]


def first_guess(cut: Cut, tool: ToolPoint) -> float:
    """Return a chip width [m] that is stable or nearly so, from which widths are raised."""
    if cut.milling is None:
        smallest = smallest_limit(tool, cut.stiffness).width
        if math.isfinite(smallest):
            return 0.5 * smallest
        stiff = sum(abs(factor) / mode.stiffness for mode, factor in zip(tool.modes, tool.factors, strict=True))
        return 0.05 / (cut.stiffness * stiff)
    mode = tool.modes[0]
    force = math.hypot(cut.milling.tangential, cut.milling.normal)
    return 0.5 * 2.0 * mode.stiffness * max(mode.damping, 1e-4) * (1.0 + mode.damping) / (force * cut.milling.teeth)


def _widest(cut: Cut, guess: float) -> float:
    """Return the width [m] up to which a limit is looked for; a guess for milling is lower, as its force turns."""
    return (2.0 if cut.milling is None else 10.0) * _WIDEST * guess


def _by_collocation(cut: Cut, tool: ToolPoint, speed: float) -> LobePoint:
    guess = first_guess(cut, tool)
    make = equation_of(cut, tool, speed)
    width, multiplier = smallest_unstable(make, guess, largest=_widest(cut, guess))
    if not math.isfinite(width):
        return LobePoint(WidthLimit(speed, width), "")
    frequency = chatter_frequency(make(width), multiplier)
    delay = make(width).period
    return LobePoint(WidthLimit(speed, width, frequency, int(frequency * delay + 1e-9)), kind_of(multiplier))


def _by_time(cut: Cut, tool: ToolPoint, speed: float) -> LobePoint:
    from lathesim.stability.growth import milling_rig, rig, time_limit, vibration_frequency

    if cut.milling is not None:
        made = milling_rig(one_mode(tool), cut.milling, speed)
    else:
        made = rig(tool, cut.stiffness, speed, process_damping=cut.process_damping, diameter=cut.diameter, share=cut.share)
    guess = first_guess(cut, tool)
    width, multiplier = time_limit(made, guess, _widest(cut, guess))
    if not math.isfinite(width):
        return LobePoint(WidthLimit(speed, width), "")
    frequency = vibration_frequency(made, width, multiplier)
    turn = made.samples_of_a_turn * made.period
    return LobePoint(WidthLimit(speed, width, frequency, int(frequency * turn + 1e-9)), kind_of(multiplier))
