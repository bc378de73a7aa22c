"""How far a servo stays behind its reference."""

from __future__ import annotations

from lathesim.component import Input, Output, Parameter
from lathesim.effects.effect import Effect


class ServoLag(Effect):
    """A position loop without feed forward, which follows at a distance that grows with the speed.

    x_out = x_in - lag v          (lag = 1 / gain of the position loop)
    """

    catalogue, family, site = 0, "lag", "reference"
    neutral = {"lag": 0.0}
    typical = {"lag": (1e-3, 60e-3)}
    fingerprint = "The position stays behind the one asked for by an amount proportional to the velocity, at rest by nothing."
    confused_with = ("TransportDelay", "ChannelTimeShift", "Backlash, which does not grow with the speed")
    experiment = "Corners and circles at several feeds: a lag rounds them more the faster they are run, a shift of the channel does not."
    source = "Y. Koren, Computer Control of Manufacturing Systems, McGraw-Hill (1983), chapter 5 (following error v/K). Range assumed."

    incoming = Input("{signal}", doc="position asked for")
    flow = Input("{flow}", doc="velocity of the host")
    outgoing = Output("{signal}", doc="position that is reached")
    lag = Parameter("s", 0.0, low=0.0, high=10.0, doc="distance behind over velocity")

    @staticmethod
    def output(incoming: float, flow: float, lag: float) -> float:
        if lag == 0.0:
            return incoming
        return incoming - lag * flow
