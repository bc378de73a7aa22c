"""Part and tool that give way: the diameter comes out larger than the position says.

The force of the sample before is used, so a force that depends on the depth may close the loop.
"""

from __future__ import annotations

from lathesim.component import DiscreteState, Input, Output, Parameter
from lathesim.effects.effect import Effect
from lathesim.effects.identification import Identification


class WorkpieceDeflection(Effect):
    """A part held in the chuck that bends under the thrust force.

    x_out = x_in + compliance F (distance / length)^3          (compliance = length^3 / (3 E I))

    Left out: the part between centres, and a diameter that varies.
    """

    catalogue, family, site = 43, "deflection", "measured"
    neutral = {"compliance": 0.0}
    identification = Identification(
        carried=("m",),
        typical={"compliance": (1e-8, 2e-6)},
    )
    fingerprint = "The diameter grows with the third power of the distance from the chuck."
    confused_with = ("a taper, which is linear", "ThermalScrewGrowth", "SquarenessError")
    experiment = "A pass without infeed; a tailstock."
    source = "Gere, Goodno, Mechanics of Materials, 8th ed. 2013, ch. 9 (cantilever): steel, 20 mm by 100 mm, 100 N: 20 um. Range assumed."

    incoming = Input("{signal}", doc="position of the tool relative to a stiff part")
    force = Input("N", previous=True, doc="thrust force on the part")
    distance = Input("m", doc="distance of the tool from the chuck")
    outgoing = Output("{signal}", doc="radius that is left")
    bent = DiscreteState("m", doc="deflection of this sample")
    compliance = Parameter("m/N", 0.0, low=0.0, doc="compliance at the free end")
    length = Parameter("m", 0.1, low=1e-3, doc="distance of the free end from the chuck")

    @staticmethod
    def update(force: float, distance: float, compliance: float, length: float) -> float:
        share = distance / length
        return compliance * force * share * share * share

    @staticmethod
    def output(incoming: float, bent: float, compliance: float) -> float:
        if compliance == 0.0:
            return incoming
        return incoming + bent


class ToolCompliance(Effect):
    """Tool and holder that give way under the thrust force.

    x_out = x_in + compliance F
    """

    catalogue, family, site = 44, "deflection", "measured"
    neutral = {"compliance": 0.0}
    identification = Identification(
        carried=("m",),
        typical={"compliance": (2e-8, 1e-7)},
    )
    fingerprint = "The diameter is off by a constant in proportion to the force, with a step at entry."
    confused_with = ("an offset of the tool", "SpindleGrowth")
    experiment = "Two depths of cut."
    source = "Altintas, Manufacturing Automation, 2nd ed. 2012, sec. 3.2; 10 to 50 N/um. Range assumed."

    incoming = Input("{signal}", doc="position of a stiff tool")
    force = Input("N", previous=True, doc="thrust force on the tool")
    outgoing = Output("{signal}", doc="radius that is left")
    bent = DiscreteState("m", doc="deflection of this sample")
    compliance = Parameter("m/N", 0.0, low=0.0, doc="compliance of tool and holder")

    @staticmethod
    def update(force: float, compliance: float) -> float:
        return compliance * force

    @staticmethod
    def output(incoming: float, bent: float, compliance: float) -> float:
        if compliance == 0.0:
            return incoming
        return incoming + bent
