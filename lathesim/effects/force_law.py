"""The law of the cutting force: what it depends on besides the area of the chip, and how it changes while cutting.

Cutting force that changes while cutting: the zone grows warm in seconds, the tool wears in minutes.

Whether the tool cuts is told from the force it sits on: anything but zero.
"""

from __future__ import annotations

import math

from lathesim.component import DiscreteState, Input, Noise, Output, Parameter, State
from lathesim.effects.effect import Effect, Identification

OTHER_FORCES = {"thrust_force": ("thrust_incoming", "thrust_outgoing"), "feed_force": ("feed_incoming", "feed_outgoing")}
"""Ports of a cut beside that of its main force."""


def _with_edge(force: float, depth: float, feed: float, coefficient: float) -> float:
    if coefficient == 0.0 or depth <= 0.0 or feed <= 0.0:
        return force
    return force + coefficient * depth


class EdgeForce(Effect):
    """Force of the rounded edge that ploughs and rubs, in proportion to the width of the chip and not to its thickness.

    F_out = F_in + coefficient depth,   Fp_out = Fp_in + thrust_coefficient depth,   Ff_out = Ff_in + feed_coefficient depth

    while depth and feed are above zero. Thrust and feed force have their usual shares of the main force with that of the edge in it; an
    edge mostly pushes away more than it cuts, and what they have beyond those shares has coefficients of its own.
    """

    catalogue, family, site = 38, "force law", "force"
    also_at = OTHER_FORCES
    stage = 1
    neutral = {"coefficient": 0.0, "thrust_coefficient": 0.0, "feed_coefficient": 0.0}
    identification = Identification(
        typical={"coefficient": (5e3, 100e3), "thrust_coefficient": (-20e3, 50e3), "feed_coefficient": (-20e3, 50e3)},
        extended=("thrust_coefficient", "feed_coefficient"),
    )
    fingerprint = "The force over the feed has an intercept."
    confused_with = ("ChipThicknessExponent: a line with intercept and a power law are alike above 0.1 mm",)
    experiment = "Steps of feed down to 0.02 mm per turn."
    source = (
        "Altintas, Manufacturing Automation, 2nd ed. 2012, sec. 2.3, edge coefficients; steel 20 to 100 N/mm, aluminium 5 to "
        "30. Range assumed."
    )

    incoming = Input("{signal}", doc="force of the shearing")
    thrust_incoming = Input("{signal}", doc="thrust force as a share of the main force")
    feed_incoming = Input("{signal}", doc="feed force as a share of the main force")
    depth = Input("m", doc="depth of cut")
    feed = Input("m", doc="feed per turn")
    outgoing = Output("{signal}", doc="force with that of the edge")
    thrust_outgoing = Output("{signal}", doc="thrust force with what the edge adds beyond its share")
    feed_outgoing = Output("{signal}", doc="feed force with what the edge adds beyond its share")
    coefficient = Parameter("({signal})/m", 0.0, low=0.0, doc="edge force per width of the chip")
    thrust_coefficient = Parameter("({signal})/m", 0.0, doc="the same along the depth, beyond its share of the main force")
    feed_coefficient = Parameter("({signal})/m", 0.0, doc="the same along the feed, beyond its share of the main force")

    @staticmethod
    def output_outgoing(incoming: float, depth: float, feed: float, coefficient: float) -> float:
        return _with_edge(incoming, depth, feed, coefficient)

    @staticmethod
    def output_thrust_outgoing(thrust_incoming: float, depth: float, feed: float, thrust_coefficient: float) -> float:
        return _with_edge(thrust_incoming, depth, feed, thrust_coefficient)

    @staticmethod
    def output_feed_outgoing(feed_incoming: float, depth: float, feed: float, feed_coefficient: float) -> float:
        return _with_edge(feed_incoming, depth, feed, feed_coefficient)


class ChipThicknessExponent(Effect):
    """Size effect: thin chips need more force per area.

    F_out = F_in (feed / reference)^-exponent          (Kienzle: kc = kc1.1 h^-m, h and reference in the same unit)
    """

    catalogue, family, site = 39, "force law", "force"
    neutral = {"exponent": 0.0}
    identification = Identification(typical={"exponent": (0.1, 0.35)})
    fingerprint = "The force over the feed is a straight line in logarithms, with a slope below one."
    confused_with = ("EdgeForce: a line with intercept and a power law are alike above 0.1 mm",)
    experiment = "Six levels of feed from 0.02 to 0.4 mm per turn."
    source = "Kienzle, Die Bestimmung von Kraeften und Leistungen an spanenden Werkzeugen, VDI-Z 94 (1952); m 0.15 to 0.3. Range assumed."

    incoming = Input("{signal}", doc="force at constant specific cutting force")
    feed = Input("m", doc="feed per turn")
    outgoing = Output("{signal}", doc="force with the size effect")
    exponent = Parameter("1", 0.0, low=0.0, high=0.99, doc="exponent m of the specific cutting force")
    reference = Parameter("m", 1e-3, low=1e-6, doc="feed at which nothing changes")

    @staticmethod
    def output(incoming: float, feed: float, exponent: float, reference: float) -> float:
        return incoming if exponent == 0.0 or feed <= 0.0 else incoming * math.pow(feed / reference, -exponent)


class SpeedDependence(Effect):
    """Cutting force that changes with the cutting speed, and a hump of it where an edge builds up.

    F_out = F_in (V / reference)^exponent (1 + hump exp(-((V - hump_speed) / hump_width)^2))
    """

    catalogue, family, site = 40, "force law", "force"
    neutral = {"exponent": 0.0, "hump": 0.0}
    identification = Identification(
        typical={"exponent": (-0.4, 0.0), "hump": (-0.3, 0.5), "hump_speed": (0.3, 1.2), "hump_width": (0.1, 0.5)},
        extended=("hump", "hump_speed", "hump_width"),
    )
    # a hump that is not there bends the law of the exponent, from a speed at which nobody cut
    fingerprint = "The force follows the cutting speed and nothing else."
    confused_with = ("TemperatureSoftening",)
    experiment = "Sweep the speed up and down at one feed and depth."
    source = "Shaw, Metal Cutting Principles, 2nd ed. 2005, ch. 12; hump at 20 to 60 m/min. Form of the hump and range assumed."

    incoming = Input("{signal}", doc="force at the reference speed")
    speed = Input("m/s", doc="cutting speed")
    outgoing = Output("{signal}", doc="force at the speed")
    exponent = Parameter("1", 0.0, low=-3.0, high=3.0, doc="exponent of the speed")
    reference = Parameter("m/s", 2.0, low=1e-3, doc="cutting speed at which nothing changes")
    hump = Parameter("1", 0.0, low=-0.9, high=5.0, doc="height of the hump")
    hump_speed = Parameter("m/s", 0.7, low=0.0, doc="cutting speed of the hump")
    hump_width = Parameter("m/s", 0.3, low=1e-3, doc="half width of the hump at 1/e")

    @staticmethod
    def output(
        incoming: float, speed: float, exponent: float, reference: float, hump: float, hump_speed: float, hump_width: float
    ) -> float:
        cutting_speed = abs(speed)
        if (exponent == 0.0 and hump == 0.0) or cutting_speed == 0.0:
            return incoming
        beside = (cutting_speed - hump_speed) / hump_width
        return incoming * math.pow(cutting_speed / reference, exponent) * (1.0 + hump * math.exp(-beside * beside))


class BuiltUpEdge(Effect):
    """An edge that builds up on the tool and breaks away, at irregular intervals, within a band of cutting speeds.

    F_out = F_in (1 + share s exp(-((V - speed_of_band) / width_of_band)^2)),   s a sawtooth from 0 to 1 of about ``rate`` teeth a second
    """

    catalogue, family, site = 48, "chip", "force"
    neutral = {"share": 0.0}
    identification = Identification(typical={"share": (0.1, 0.3), "rate": (1.0, 20.0)})
    fingerprint = "An irregular sawtooth of the force, within a band of speeds only."
    confused_with = ("ChipSegmentation",)
    experiment = "Raise the cutting speed: it goes."
    source = "Shaw, Metal Cutting Principles, 2nd ed. 2005, ch. 12; 10 to 30 %, 1 to 20 Hz. Form and range assumed."

    incoming = Input("{signal}", doc="force with a clean edge")
    speed = Input("m/s", doc="cutting speed")
    outgoing = Output("{signal}", doc="force with the built-up edge")
    built = DiscreteState("1", doc="how far the edge has built up, 0 to 1")
    chance = Noise(doc="irregularity of the growth")
    share = Parameter("1", 0.0, low=-0.9, high=5.0, doc="change of the force by a full edge")
    rate = Parameter("Hz", 5.0, low=0.0, doc="mean rate at which edges break away")
    speed_of_band = Parameter("m/s", 0.7, low=0.0, doc="cutting speed at which it is worst")
    width_of_band = Parameter("m/s", 0.5, low=1e-3, doc="half width of the band at 1/e")

    @staticmethod
    def update(incoming: float, built: float, chance: float, rate: float, sample_period: float) -> float:
        if incoming == 0.0:
            return built
        # a random walk with drift: the spread of one tooth's duration is half its mean
        grown = built + rate * sample_period + 0.5 * math.sqrt(rate * sample_period) * chance
        if grown < 0.0:
            return 0.0
        if grown >= 1.0:
            return 0.0
        return grown

    @staticmethod
    def output(incoming: float, speed: float, built: float, share: float, speed_of_band: float, width_of_band: float) -> float:
        if share == 0.0:
            return incoming
        beside = (abs(speed) - speed_of_band) / width_of_band
        return incoming * (1.0 + share * built * math.exp(-beside * beside))


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
    identification = Identification(typical={"softening": (0.02, 0.3), "time_constant": (0.5, 10.0)}, history=("warmth",))
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
        return incoming if softening == 0.0 else incoming * (1.0 - softening * warmth)


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
    identification = Identification(typical={"lacking": (0.1, 1.0), "time_constant": (0.01, 1.0)})
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
        return incoming if lacking == 0.0 else incoming * (1.0 - lacking * (1.0 - built))
