"""Play between motor and table."""

from __future__ import annotations

from lathesim.component import DiscreteState, Input, Output, Parameter
from lathesim.effects.effect import Effect


def _dragged(follower: float, leader: float, half: float) -> float:
    """Give where a follower stands that the leader can only push beyond ``half`` of the play on either side."""
    if follower > leader + half:
        return leader + half
    if follower < leader - half:
        return leader - half
    return follower


class Backlash(Effect):
    """Play of screw, nut or gear: the table stands still until the motor has crossed the gap.

    x_out = x_out, held;  pushed so that  |x_out - x_in| <= width / 2

    The table is taken to rest by its friction while the play is crossed, so the trace is one of geometry and not of force.
    Left out: the impact at the end of the gap, and a table that drifts inside it.
    """

    catalogue, family, site = 8, "reversal", "measured"
    between_sensors = True
    carried = ("m", "rad")
    neutral = {"width": 0.0}
    typical = {"width": (2e-6, 100e-6), "start_in_gap": (-1.0, 1.0)}
    typical_rotary = {"width": (1e-4, 0.02), "start_in_gap": (-1.0, 1.0)}
    nuisance = ("start_in_gap",)
    fingerprint = "Table scale less motor encoder jumps by the width at each reversal; the loop has the same width at every speed."
    confused_with = ("PreslidingFriction", "TorsionalWindUp", "CumulativePitchError", "TransportDelay, whose loop grows with the speed")
    experiment = "Two amplitudes at two speeds, watched with a direct scale."
    source = (
        "Nordin, Gutman, Controlling mechanical systems with backlash: a survey, Automatica 38 (2002), sec. 2 (hysteresis "
        "model). Range assumed."
    )

    incoming = Input("{signal}", doc="position before the play")
    outgoing = Output("{signal}", doc="position after the play")
    follower = DiscreteState("{signal}", doc="position after the play at the sample instant")
    width = Parameter("{signal}", 0.0, low=0.0, doc="whole width of the play")
    start_in_gap = Parameter("1", 0.0, low=-1.0, high=1.0, doc="where the follower starts in the gap: -1 behind, 1 ahead")

    @staticmethod
    def update(incoming: float, follower: float, width: float, start_in_gap: float, time: float) -> float:
        if time > 0.0:
            return _dragged(follower, incoming, 0.5 * width)
        return incoming + 0.5 * width * start_in_gap

    @staticmethod
    def output(incoming: float, follower: float, width: float) -> float:
        if width == 0.0:
            return incoming
        return _dragged(follower, incoming, 0.5 * width)
