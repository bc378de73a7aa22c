"""What the cutting force depends on besides the area of the chip: the edge, the thickness, the speed."""

from __future__ import annotations

import math

from lathesim.component import DiscreteState, Input, Noise, Output, Parameter
from lathesim.effects.effect import Effect
from lathesim.effects.identification import Identification

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
    identification = Identification(
        typical={"exponent": (0.1, 0.35)},
    )
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
        if exponent == 0.0 or feed <= 0.0:
            return incoming
        return incoming * math.pow(feed / reference, -exponent)


class SpeedDependence(Effect):
    """Cutting force that changes with the cutting speed, and a hump of it where an edge builds up.

    F_out = F_in (V / reference)^exponent (1 + hump exp(-((V - hump_speed) / hump_width)^2))
    """

    catalogue, family, site = 40, "force law", "force"
    neutral = {"exponent": 0.0, "hump": 0.0}
    identification = Identification(
        typical={"exponent": (-0.4, 0.0), "hump": (-0.3, 0.5), "hump_speed": (0.3, 1.2), "hump_width": (0.1, 0.5)},
        minimal_form=("exponent",),
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
    identification = Identification(
        typical={"share": (0.1, 0.3), "rate": (1.0, 20.0)},
    )
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
