"""Play between motor and table."""

from __future__ import annotations

import math

from lathesim.component import DiscreteState, Input, Output, Parameter
from lathesim.effects.effect import Effect
from lathesim.effects.identification import Identification


def _dragged(follower: float, leader: float, half: float) -> float:
    """Return where a follower stands that the leader can only push beyond ``half`` of the play on either side."""
    if follower > leader + half:
        return leader + half
    if follower < leader - half:
        return leader - half
    return follower


def _softly_dragged(follower: float, leader: float, leader_before: float, half: float, softness: float) -> float:
    """Return where a follower stands whose gap, ``leader - follower``, closes as du/ds = -u^softness / half with the way s of the leader,
    where u = 1 - gap / half is the part of the gap that is left in the direction of the motion.

    Solved over the way from ``leader_before`` to ``leader``: u^(1 - softness) falls by (1 - softness) s / half.
    """
    way = abs(leader - leader_before)
    direction = 1.0 if leader >= leader_before else -1.0
    left = min(max(1.0 - direction * (leader_before - follower) / half, 0.0), 2.0)
    if softness < 1.0:
        power = 1.0 - softness
        left = max(left**power - power * way / half, 0.0) ** (1.0 / power)
    else:
        left = left * math.exp(-way / half)
    return leader - direction * half * (1.0 - left)


class Backlash(Effect):
    """Play of screw, nut or gear: the table stands still until the motor has crossed the gap.

    x_out = x_out, held;  pushed so that  |x_out - x_in| <= width / 2

    With a ``softness`` the gap closes gradually, as one between skewed flanks or in stiff grease does: the part u of it that is left falls
    with the way s of the motor as du/ds = -2 u^softness / width, so 0 is the sharp edge and 1 an exponential.

    The table is taken to rest by its friction while the play is crossed, so the trace is one of geometry and not of force.
    Left out: the impact at the end of the gap, and a table that drifts inside it.
    """

    catalogue, family, site = 8, "reversal", "measured"
    neutral = {"width": 0.0}
    identification = Identification(
        between_sensors=True,
        carried=("m", "rad"),
        typical={"width": (2e-6, 100e-6), "start_in_gap": (-1.0, 1.0), "softness": (0.0, 1.0)},
        typical_rotary={"width": (1e-4, 0.02), "start_in_gap": (-1.0, 1.0), "softness": (0.0, 1.0)},
        nuisance=("start_in_gap",),
        extended=("softness",),
    )
    fingerprint = "Table scale less motor encoder jumps by the width at each reversal; the loop has the same width at every speed."
    confused_with = ("PreslidingFriction", "TorsionalWindUp", "CumulativePitchError", "TransportDelay, whose loop grows with the speed")
    experiment = "Two amplitudes at two speeds, watched with a direct scale."
    source = (
        "Nordin, Gutman, Controlling mechanical systems with backlash: a survey, Automatica 38 (2002), sec. 2 (hysteresis "
        "model); softness after Dahl, A solid friction model, Aerospace Corp. TOR-0158(3107-18)-1 (1968). Range assumed."
    )

    incoming = Input("{signal}", doc="position before the play")
    outgoing = Output("{signal}", doc="position after the play")
    follower = DiscreteState("{signal}", doc="position after the play at the sample instant")
    leader = DiscreteState("{signal}", doc="position before the play at the sample instant")
    width = Parameter("{signal}", 0.0, low=0.0, doc="whole width of the play")
    start_in_gap = Parameter("1", 0.0, low=-1.0, high=1.0, doc="where the follower starts in the gap: -1 behind, 1 ahead")
    softness = Parameter("1", 0.0, low=0.0, high=1.0, doc="how gradually the gap closes: 0 at once, 1 exponentially")

    @staticmethod
    def update(
        incoming: float, follower: float, leader: float, width: float, start_in_gap: float, softness: float, time: float
    ) -> tuple[float, float]:
        if time <= 0.0:
            return incoming + 0.5 * width * start_in_gap, incoming
        if softness == 0.0 or width == 0.0:
            return _dragged(follower, incoming, 0.5 * width), incoming
        return _softly_dragged(follower, incoming, leader, 0.5 * width, softness), incoming

    @staticmethod
    def output(incoming: float, follower: float, leader: float, width: float, softness: float) -> float:
        if width == 0.0:
            return incoming
        if softness == 0.0:
            return _dragged(follower, incoming, 0.5 * width)
        return _softly_dragged(follower, incoming, leader, 0.5 * width, softness)
