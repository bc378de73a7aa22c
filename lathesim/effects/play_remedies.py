"""Remedies against play: a shift of the reference, or of the reading that closes the loop."""

from __future__ import annotations

import math

from lathesim.component import DiscreteState, Parameter
from lathesim.effects.remedy import ModelledRemedy, ahead, followed


class BacklashShift(ModelledRemedy):
    """Shifts the reference by half the play in the direction of motion:  out = in + share c,  c = +-width/2.

    The shift turns over as sin^2 over ``spread`` seconds from where the model reverses, and is sent ahead by the model, so that the motor
    has crossed the play when the table is to move. A negative ``width`` takes back what a reading with play makes too much.

    Source: backlash compensation of common controls; M. Nordin, P.-O. Gutman, Automatica 38 (2002), section 4.
    """

    site = "drive"
    answers = ("Backlash",)
    limits = ("voltage", "bandwidth")
    cannot = "A force that pulls the table through the play is not held."
    follows = {"width": "the width of the play"}

    width = Parameter("{signal}", 0.0, doc="whole width of the play")
    spread = Parameter("s", 0.0, low=0.0, doc="time over which the shift turns over")
    still = Parameter("({drive})/s", 1e-6, low=1e-12, doc="speed below which the axis stands")
    side = DiscreteState("1", doc="sign of the direction in which it moves or last moved; 0 before the first motion")
    since = DiscreteState("s", 1e9, doc="time since the last reversal")
    begin = DiscreteState("1", doc="shift at that reversal, of half the width")
    shift = DiscreteState("{signal}", doc="shift at the end of this sample")
    before = DiscreteState("{signal}", doc="shift at its beginning")
    added = DiscreteState("{signal}", doc="what is added in this sample")

    @staticmethod
    def update(
        drive: float, lag: float, inner: float, model_position: float, model_rate: float, width: float, spread: float, still: float,
        side: float, since: float, begin: float, shift: float, before: float, sample_period: float, time: float,
    ) -> tuple[float, float, float, float, float, float, float, float]:  # fmt: skip
        """Find reversals of the model, and where the shift is on its way over."""
        if time <= 0.0:
            return drive, 0.0, 0.0, 1e9, 0.0, 0.0, 0.0, 0.0
        position, rate = followed(model_position, model_rate, drive, lag, inner, sample_period)
        turned = 0.0
        if rate > still:
            turned = 1.0
        elif rate < -still:
            turned = -1.0
        half = 0.5 * width
        if turned != 0.0 and turned != side:
            begin = shift / half if half != 0.0 else 0.0
            side = turned
            since = 0.0
        since = since + sample_period
        share_over = 1.0
        if since < spread:
            wave = math.sin(0.5 * math.pi * since / spread)
            share_over = wave * wave
        wanted = half * (begin + (side - begin) * share_over)
        if side == 0.0:
            wanted = 0.0
        return position, rate, side, since, begin, wanted, shift, ahead(before, shift, wanted, lag, inner, sample_period)

    @staticmethod
    def output(incoming: float, share: float, added: float) -> float:
        """Shift the reference."""
        if share == 0.0:
            return incoming
        return incoming + share * added


class PlayReading(ModelledRemedy):
    """Takes play out of the reading that closes a loop:  out = in - share (f - m),  f follows m, pushed so that |f - m| <= width/2.

    m is the position of the model; what its reading with play would be is worked out as the play itself works.

    Source: M. Nordin, P.-O. Gutman, Controlling mechanical systems with backlash: a survey, Automatica 38 (2002), section 4 (inverse).
    """

    site = "measured"
    answers = ("Backlash",)
    limits = ("sensor", "model")
    cannot = "A force that moves the axis within its play is not read."
    follows = {"width": "the width of the play"}

    width = Parameter("{signal}", 0.0, low=0.0, doc="whole width of the play")
    follower = DiscreteState("{drive}", doc="what is read of the model's position")
    error = DiscreteState("{drive}", doc="error of the reading at this sample")

    @staticmethod
    def update(
        drive: float, lag: float, inner: float, model_position: float, model_rate: float, width: float, follower: float,
        sample_period: float, time: float,
    ) -> tuple[float, float, float, float]:  # fmt: skip
        """Follow the reference, and drag the reading along."""
        if time <= 0.0:
            return drive, 0.0, drive, 0.0
        position, rate = followed(model_position, model_rate, drive, lag, inner, sample_period)
        error = follower - model_position
        half = 0.5 * width
        if follower > position + half:
            follower = position + half
        elif follower < position - half:
            follower = position - half
        return position, rate, follower, error

    @staticmethod
    def output(incoming: float, share: float, error: float) -> float:
        """Take the play out of the reading."""
        if share == 0.0:
            return incoming
        return incoming - share * error
