"""Cutting force that repeats with the spindle, with the chips, or with the swing of the tool."""

from __future__ import annotations

import math

from lathesim.component import DiscreteState, Input, Memory, Output, Parameter, State
from lathesim.effects.effect import Effect, Identification
from lathesim.elementary import cos, hermite, sin

_AROUND = 3.0
"""Cells beside the last one written that an interpolation may read."""
_STANDS = 1e-6
"""Cutting speed [m/s] below which nothing is damped."""

_CELLS = 2048
_SOFT_EDGE = 0.02


def _within(angle: float, middle: float, width: float) -> float:
    """Return 1 inside an arc of ``width`` (share of a turn) about ``middle`` [rad], 0 outside, with edges rounded over about 1 degree."""
    half = math.pi * min(max(width, 0.0), 1.0)
    away = angle - middle
    away = abs(away - 2.0 * math.pi * math.floor(away / (2.0 * math.pi) + 0.5))
    return 0.5 * (1.0 + math.tanh((half - away) / _SOFT_EDGE))


class InterruptedCut(Effect):
    """A slot, keyway or flat in the part: the tool cuts air for a share of each turn.

    F_out = F_in (1 - missing g),   g = 1 within the slot, 0 beside it
    """

    catalogue, family, site = 47, "spindle-synchronous", "force"
    stage = 2
    neutral = {"missing": 0.0}
    identification = Identification(
        typical={"missing": (0.2, 1.0), "width": (0.02, 0.3), "middle": (-math.pi, math.pi)}, nuisance=("middle",)
    )
    fingerprint = "A pulse of missing force once per turn, at one angle of the spindle."
    confused_with = ("Runout", "HardSpot")
    experiment = "Map the force over angle and turns."
    source = "Altintas, Manufacturing Automation, 2nd ed. 2012, sec. 2.5 (entry and exit angles). Form and range assumed."

    incoming = Input("{signal}", doc="force of the full round")
    angle = Input("rad", doc="spindle angle")
    outgoing = Output("{signal}", doc="force of the interrupted cut")
    missing = Parameter("1", 0.0, low=0.0, high=1.0, doc="share of the force that lacks in the slot")
    width = Parameter("1", 0.1, low=0.001, high=0.99, doc="share of the turn the slot takes")
    middle = Parameter("rad", 0.0, doc="angle of the middle of the slot")

    @staticmethod
    def output(incoming: float, angle: float, missing: float, width: float, middle: float) -> float:
        return incoming if missing == 0.0 else incoming * (1.0 - missing * _within(angle, middle, width))


class HardSpot(Effect):
    """A hard place in the part: more force once per turn.

    F_out = F_in (1 + rise exp((cos(angle - middle) - 1) / (2 (pi width)^2)))

    Left out: the end of the spot along the part.
    """

    catalogue, family, site = 47, "spindle-synchronous", "force"
    stage = 2
    neutral = {"rise": 0.0}
    identification = Identification(typical={"rise": (0.1, 0.5), "width": (0.02, 0.2), "middle": (-math.pi, math.pi)}, nuisance=("middle",))
    fingerprint = "A pulse of force once per turn at one angle, on a locus that winds along the part."
    confused_with = ("Runout", "InterruptedCut")
    experiment = "Map the force over angle and turns."
    source = "Form (a von Mises bump) and range assumed."

    incoming = Input("{signal}", doc="force of even material")
    angle = Input("rad", doc="spindle angle")
    outgoing = Output("{signal}", doc="force with the hard spot")
    rise = Parameter("1", 0.0, low=0.0, high=10.0, doc="share of the force gained in the middle of the spot")
    width = Parameter("1", 0.05, low=0.005, high=0.5, doc="half width of the spot at about 1/e, as a share of the turn")
    middle = Parameter("rad", 0.0, doc="angle of the middle of the spot")

    @staticmethod
    def output(incoming: float, angle: float, rise: float, width: float, middle: float) -> float:
        if rise == 0.0:
            return incoming
        spread = math.pi * width
        return incoming * (1.0 + rise * math.exp((cos(angle - middle) - 1.0) / (2.0 * spread * spread)))


class ChipSegmentation(Effect):
    """Chips that break or shear in segments, each as long as the last.

    F_out = F_in (1 + share sin(2 pi s / length + phase)),   ds/dt = V in the cut
    """

    catalogue, family, site = 49, "spindle-synchronous", "force"
    neutral = {"share": 0.0}
    identification = Identification(
        typical={"share": (0.02, 0.3), "length": (1e-3, 0.2), "phase": (-math.pi, math.pi)}, nuisance=("phase",), along="cut_length"
    )
    fingerprint = "A line whose frequency is the cutting speed over a chip length, not tied to the spindle."
    confused_with = ("RegenerativeChatter", "mains hum, which does not move with the speed")
    experiment = "Change the cutting speed."
    source = "Shaw, Metal Cutting Principles, 2nd ed. 2005, ch. 15; 5 to 50 Hz for long chips. Form and range assumed."

    incoming = Input("{signal}", doc="force of a flowing chip")
    speed = Input("m/s", doc="cutting speed")
    outgoing = Output("{signal}", doc="force of the breaking chip")
    cut_length = Output("m", doc="length cut since the start")
    slid = State("m", doc="length cut")
    share = Parameter("1", 0.0, low=0.0, high=1.0, doc="amplitude over the force")
    length = Parameter("m", 0.05, low=1e-6, doc="length cut per chip or segment")
    phase = Parameter("rad", 0.0, doc="phase at the start")

    @staticmethod
    def derivative(incoming: float, speed: float) -> float:
        return 0.0 if incoming == 0.0 else abs(speed)

    @staticmethod
    def output_outgoing(incoming: float, slid: float, share: float, length: float, phase: float) -> float:
        return incoming if share == 0.0 else incoming * (1.0 + share * sin(2.0 * math.pi * slid / length + phase))

    @staticmethod
    def output_cut_length(slid: float) -> float:
        return slid


class RegenerativeChatter(Effect):
    """A tool that swings and meets the waves it left a turn before.

    x'' + 2 damping w x' + w^2 x = w^2 compliance F - (process damping),   w = 2 pi frequency
    F_out = F_in (1 + engagement (x(t - T) - x(t)) / feed), not below zero;   process damping: w^2 compliance coefficient depth x' / V

    T is a turn of the spindle. The wave is kept in cells over two turns, written by cubic Hermite between samples and read by cubic
    interpolation at each stage of a step. Where a turn takes less than a sample, the swing is no number, and the run names it. The start
    value of ``swing`` is the seed. Needs samples of a fifth of the period of the mode or finer. Left out: waves of more than one turn
    before, which count when the tool leaves the cut.
    """

    catalogue, family, site = 45, "spindle-synchronous", "force"
    neutral = {"engagement": 0.0}
    identification = Identification(
        resonance="frequency",
        typical={"compliance": (2e-8, 1e-7), "frequency": (80.0, 1500.0), "damping": (0.02, 0.06), "process_damping": (0.0, 1e6)},
    )
    fingerprint = (
        "A line a little above a mode, no whole multiple of the spindle speed, that sets in with the depth, grows, and stays bounded."
    )
    confused_with = ("Runout and other forced vibration, on whole multiples",)
    experiment = "Change the spindle speed by 5 %: forced vibration moves with it, chatter stays or jumps."
    source = (
        "Tobias, Machine-Tool Vibration, 1965; Altintas, Manufacturing Automation, 2nd ed. 2012, sec. 4.2 and 4.4 (process "
        "damping). Range assumed."
    )

    incoming = Input("{signal}", doc="force of the steady chip")
    angle = Input("rad", doc="spindle angle")
    feed = Input("m", doc="feed per turn")
    depth = Input("m", doc="depth of cut")
    speed = Input("m/s", doc="cutting speed")
    outgoing = Output("{signal}", doc="force of the chip the swinging tool takes")
    swing = State("m", 1e-9, doc="tool tip, positive away from the cut")
    swing_rate = State("m/s", doc="its rate")
    cell = DiscreteState("1", doc="number of the last cell written, counted from the angle 0")
    last_angle = DiscreteState("rad", doc="angle of the last sample")
    last_swing = DiscreteState("m", doc="tool tip at the last sample")
    last_rate = DiscreteState("m/s", doc="its rate then")
    surface = Memory("m", _CELLS, doc="tool tip over two turns")
    engagement = Parameter("1", 0.0, low=0.0, high=1.0, doc="1 with the chip modulated, 0 without")
    compliance = Parameter("m/({signal})", 5e-8, low=0.0, doc="static compliance of the tool in the direction of the chip")
    frequency = Parameter("Hz", 150.0, low=1.0, high=20000.0, doc="natural frequency")
    damping = Parameter("1", 0.03, low=0.0, high=2.0, doc="damping ratio")
    process_damping = Parameter("({signal})/m", 0.0, low=0.0, doc="process damping coefficient")

    @staticmethod
    def update(
        angle: float, swing: float, swing_rate: float, cell: float, last_angle: float, last_swing: float, last_rate: float,
        surface: list[float], time: float, sample_period: float,
    ) -> tuple[float, float, float, float]:  # fmt: skip
        total = len(surface)
        per_cell = 4.0 * math.pi / total
        last = math.floor(angle / per_cell)
        passed = angle - last_angle
        if time <= 0.0:
            return last * 1.0, angle, swing, swing_rate
        if passed <= 0.0:
            return cell, last_angle, last_swing, last_rate
        if passed > 2.0 * math.pi - _AROUND * per_cell:
            # the wave is read before it is written
            for place in range(total):
                surface[place] = math.nan
            return last * 1.0, angle, swing, swing_rate
        place = int(cell)
        while place < last:
            place += 1
            s = (place * per_cell - last_angle) / passed
            surface[place % total] = hermite(s, sample_period, last_swing, last_rate, swing, swing_rate)
        return last * 1.0, angle, swing, swing_rate

    @staticmethod
    def derivative(
        incoming: float, angle: float, feed: float, depth: float, speed: float, swing: float, swing_rate: float, surface: list[float],
        engagement: float, compliance: float, frequency: float, damping: float, process_damping: float,
    ) -> tuple[float, float]:  # fmt: skip
        angular = 2.0 * math.pi * frequency
        force = _chip_force(incoming, feed, swing, _wave(surface, angle), engagement)
        if incoming != 0.0 and abs(speed) > _STANDS:
            force -= process_damping * depth * swing_rate / abs(speed)
        return swing_rate, angular * (angular * (compliance * force - swing) - 2.0 * damping * swing_rate)

    @staticmethod
    def output(incoming: float, angle: float, feed: float, swing: float, surface: list[float], engagement: float) -> float:
        return _chip_force(incoming, feed, swing, _wave(surface, angle), engagement)


def _wave(surface: list[float], angle: float) -> float:
    """Return what the tool left a turn before an angle, on the cubic through the two cells on either side."""
    total = len(surface)
    place = (angle / (4.0 * math.pi) - 0.5) * total
    below = math.floor(place)
    s = place - below
    before, here = surface[(below - 1) % total], surface[below % total]
    after, beyond = surface[(below + 1) % total], surface[(below + 2) % total]
    inner = (s + 1.0) * (s - 2.0) * ((s - 1.0) * here - s * after) / 2.0
    return s * (s - 1.0) * ((s + 1.0) * beyond - (s - 2.0) * before) / 6.0 + inner


def _chip_force(incoming: float, feed: float, swing: float, wave: float, engagement: float) -> float:
    return incoming if engagement == 0.0 or feed <= 0.0 else incoming * max(0.0, 1.0 + engagement * (wave - swing) / feed)
