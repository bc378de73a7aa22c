"""Cutting force that changes while cutting: the zone grows warm in seconds, the tool wears in minutes.

Whether the tool cuts is told from the force it sits on: anything but zero.
"""

from __future__ import annotations

import math

from lathesim.component import Input, Output, Parameter, State
from lathesim.effects.effect import Effect
from lathesim.effects.force_law import OTHER_FORCES
from lathesim.effects.identification import Identification


def _in_cut(force: float) -> float:
    return 0.0 if force == 0.0 else 1.0


def _worn(force: float, cutting_time: float, growth: float, rate: float, break_in: float, break_in_time: float) -> float:
    if growth == 0.0:
        return force
    land = break_in * (1.0 - math.exp(-cutting_time / break_in_time)) + rate * cutting_time
    return force * (1.0 + growth * land)


class TemperatureSoftening(Effect):
    """Material that softens as the cut warms up, and hardens again when the tool leaves.

    F_out = F_in (1 - softening w),   time_constant dw/dt = 1 - w in the cut, -w outside
    """

    catalogue, family, site = 41, "slow", "force"
    neutral = {"softening": 0.0}
    identification = Identification(
        typical={"softening": (0.02, 0.3), "time_constant": (0.5, 10.0)},
        history=("warmth",),
    )
    fingerprint = "The force decays after each entry, and starts anew with the next."
    confused_with = ("WearForceGrowth, which does not start anew", "DynamometerDrift", "SpeedDependence")
    experiment = "Repeat a cut with interruptions of several lengths."
    source = "Shaw, Metal Cutting Principles, 2nd ed. 2005, ch. 12; 5 to 20 % in 1 to 10 s. Form and range assumed."

    incoming = Input("{signal}", doc="force of the cold cut")
    outgoing = Output("{signal}", doc="force of the warm cut")
    warmth = State("1", doc="1 in a cut that has long been going on")
    softening = Parameter("1", 0.0, low=0.0, high=0.95, doc="share of the force that is lost")
    time_constant = Parameter("s", 3.0, low=1e-3, doc="time to 63 % of the loss")

    @staticmethod
    def derivative(incoming: float, warmth: float, time_constant: float) -> float:
        return (_in_cut(incoming) - warmth) / time_constant

    @staticmethod
    def output(incoming: float, warmth: float, softening: float) -> float:
        if softening == 0.0:
            return incoming
        return incoming * (1.0 - softening * warmth)


class WearForceGrowth(Effect):
    """A flank that wears: quickly while the new edge breaks in, then steadily with the time of cutting.

    F_out = F_in (1 + growth VB),   VB = break_in (1 - exp(-t / break_in_time)) + rate t,   t the time in the cut
    Fp_out = Fp_in (1 + thrust_growth VB),   Ff_out = Ff_in (1 + feed_growth VB)

    Thrust and feed force, as shares of the main force, have grown with it already; a worn flank mostly pushes away more than it cuts, and
    what they gain beyond that is their own.
    The start value of ``cutting_time`` is the age of the edge at the start of the recording. Forces tell the products growth rate and
    growth break_in and no more: of an inserted one, name the growth from a measured land or take it as it comes.
    Left out: the last phase, in which the edge fails.
    """

    catalogue, family, site = 42, "slow", "force"
    also_at = OTHER_FORCES
    neutral = {"growth": 0.0, "thrust_growth": 0.0, "feed_growth": 0.0}
    identification = Identification(
        typical={
            "growth": (500.0, 3000.0),
            "rate": (1e-8, 1e-6),
            "break_in": (0.0, 1e-4),
            "break_in_time": (5.0, 120.0),
            "thrust_growth": (-500.0, 3000.0),
            "feed_growth": (-500.0, 3000.0),
        },
        extended=("thrust_growth", "feed_growth"),
        products={"growth": ("rate", "break_in"), "thrust_growth": ("rate", "break_in"), "feed_growth": ("rate", "break_in")},
        history=("cutting_time",),
    )
    fingerprint = "The force rises slowly over the time of cutting, the thrust more than the main force, and falls back with a new edge."
    confused_with = ("TemperatureSoftening", "SpindleGrowth", "DynamometerDrift")
    experiment = "Cut again with a new edge."
    source = "ISO 3685 (flank wear VB to 0.3 mm); Altintas, Manufacturing Automation, 2nd ed. 2012, sec. 2.6. Form and range assumed."

    incoming = Input("{signal}", doc="force of a sharp edge")
    thrust_incoming = Input("{signal}", doc="thrust force as a share of the main force")
    feed_incoming = Input("{signal}", doc="feed force as a share of the main force")
    outgoing = Output("{signal}", doc="force of the worn edge")
    thrust_outgoing = Output("{signal}", doc="thrust force of the worn edge")
    feed_outgoing = Output("{signal}", doc="feed force of the worn edge")
    cutting_time = State("s", doc="time the edge has cut")
    growth = Parameter("1/m", 0.0, low=0.0, doc="share of the force gained per width of the worn land")
    rate = Parameter("m/s", 1e-7, low=0.0, doc="growth of the land in steady wear")
    break_in = Parameter("m", 3e-5, low=0.0, doc="width of the land the new edge soon gets")
    break_in_time = Parameter("s", 30.0, low=1e-3, doc="time to 63 % of that")
    thrust_growth = Parameter("1/m", 0.0, doc="growth of the thrust force beyond that of the main force")
    feed_growth = Parameter("1/m", 0.0, doc="growth of the feed force beyond that of the main force")

    @staticmethod
    def derivative(incoming: float) -> float:
        return _in_cut(incoming)

    @staticmethod
    def output_outgoing(incoming: float, cutting_time: float, growth: float, rate: float, break_in: float, break_in_time: float) -> float:
        return _worn(incoming, cutting_time, growth, rate, break_in, break_in_time)

    @staticmethod
    def output_thrust_outgoing(
        thrust_incoming: float, cutting_time: float, thrust_growth: float, rate: float, break_in: float, break_in_time: float
    ) -> float:
        return _worn(thrust_incoming, cutting_time, thrust_growth, rate, break_in, break_in_time)

    @staticmethod
    def output_feed_outgoing(
        feed_incoming: float, cutting_time: float, feed_growth: float, rate: float, break_in: float, break_in_time: float
    ) -> float:
        return _worn(feed_incoming, cutting_time, feed_growth, rate, break_in, break_in_time)


class EntryBuildUp(Effect):
    """A chip that reaches its full thickness only after a turn, and a tool that dips in: the force builds up after entry.

    F_out = F_in (1 - lacking (1 - w)),   time_constant dw/dt = 1 - w in the cut;   w falls to 0 within reset outside
    """

    catalogue, family, site = 0, "slow", "force"
    neutral = {"lacking": 0.0}
    identification = Identification(
        typical={"lacking": (0.1, 1.0), "time_constant": (0.01, 1.0)},
    )
    fingerprint = "The force climbs over the first turns after each entry."
    confused_with = ("TemperatureSoftening, which falls", "SensorFilter")
    experiment = "Enter at several spindle speeds: a build-up of the chip lasts a turn, a filter a time."
    source = "Altintas, Manufacturing Automation, 2nd ed. 2012, sec. 2.3 (chip of the first turn). Form and range assumed."

    incoming = Input("{signal}", doc="force of the full chip")
    outgoing = Output("{signal}", doc="force that builds up")
    built = State("1", doc="1 with the full chip")
    lacking = Parameter("1", 0.0, low=0.0, high=1.0, doc="share of the force that lacks at entry")
    time_constant = Parameter("s", 0.1, low=1e-3, doc="time to 63 % of the build-up")
    reset = Parameter("s", 0.01, low=1e-3, doc="time constant of forgetting outside the cut")

    @staticmethod
    def derivative(incoming: float, built: float, time_constant: float, reset: float) -> float:
        if incoming == 0.0:
            return -built / reset
        return (1.0 - built) / time_constant

    @staticmethod
    def output(incoming: float, built: float, lacking: float) -> float:
        if lacking == 0.0:
            return incoming
        return incoming * (1.0 - lacking * (1.0 - built))
