"""Attacks on what a sensor reports: the machine does one thing and its reading says another.

They are put into lessons by hand; a diagnosis does not look for them, since an honest fault of the same shape comes first.
"""

from __future__ import annotations

import math

from lathesim.component import DiscreteState, Input, Memory, Output, Parameter
from lathesim.effects.effect import Effect, Identification

_CELLS = 8192


def _from_before(
    incoming: float, newest: float, history: list[float], late: float, begin: float, time: float, sample_period: float
) -> tuple[float, float]:
    """Write the newest value into the ring, and return what was read so long ago, with the place of the newest."""
    place = int(newest) + 1 if time > 0.0 else 0
    if place >= len(history):
        place = 0
    history[place] = incoming
    back = int(late / sample_period + 0.5)
    if back == 0 or time < begin or back * sample_period > time:
        return incoming, place * 1.0
    if back > len(history) - 1:
        return math.nan, place * 1.0
    at = place - back
    if at < 0:
        at += len(history)
    return history[at], place * 1.0


class ReportedReading:
    """The reading that an attack takes, and the one that it gives."""

    incoming = Input("{signal}", doc="true reading")
    outgoing = Output("{signal}", doc="reading as reported")


class ReplayAttack(ReportedReading, Effect):
    """A reading that is replaced by what was read one lap before.

    y_out(t) = y_in(t - lap) from ``begin`` on
    """

    catalogue, family, site = 0, "recording", "reading"
    neutral = {"lap": 0.0}
    identification = Identification(typical={"lap": (0.5, 8.0)}, carried=())
    fingerprint = "Readings that repeat to the last digit, and answer to no watermark."
    confused_with = ("a lap that is run again",)
    experiment = "Put a watermark on the reference that is never the same twice."
    source = "Mo, Sinopoli, Secure control against replay attacks, 47th Allerton Conference (2009)."

    reported = DiscreteState("{signal}", doc="reported reading of this sample")
    newest = DiscreteState("1", doc="place of the newest value in the ring")
    history = Memory("{signal}", _CELLS, doc="true readings of the last samples", holds=lambda lap: lap)
    lap = Parameter("s", 0.0, low=0.0, high=60.0, doc="how long ago what is reported was read")
    begin = Parameter("s", 0.0, low=0.0, doc="when the attack begins")

    @staticmethod
    def update(
        incoming: float, newest: float, history: list[float], lap: float, begin: float, time: float, sample_period: float
    ) -> tuple[float, float]:
        return _from_before(incoming, newest, history, lap, begin, time, sample_period)

    @staticmethod
    def output(incoming: float, reported: float, lap: float) -> float:
        return incoming if lap == 0.0 else reported


class OffsetAttack(ReportedReading, Effect):
    """A reading that is shifted by a constant.

    y_out = y_in + offset from ``begin`` on
    """

    catalogue, family, site = 0, "constants", "reading"
    neutral = {"offset": 0.0}
    identification = Identification(typical={"offset": (1e-5, 1e-3)}, typical_rotary={"offset": (1e-3, 0.1)}, carried=())
    fingerprint = "A step of the reading without a command, and the loop's answer to it."
    confused_with = ("LostCounts",)
    experiment = "Watch the innovation when it begins."
    source = "Cardenas et al., Attacks against process control systems, ASIACCS (2011). Range assumed."

    offset = Parameter("{signal}", 0.0, doc="size of the shift")
    begin = Parameter("s", 0.0, low=0.0, doc="when the attack begins")

    @staticmethod
    def output(incoming: float, offset: float, begin: float, time: float) -> float:
        return incoming + offset if offset != 0.0 and time >= begin else incoming


class ScaleAttack(ReportedReading, Effect):
    """A reading that is stretched.

    y_out = (1 + share) y_in from ``begin`` on
    """

    catalogue, family, site = 0, "constants", "reading"
    neutral = {"share": 0.0}
    identification = Identification(typical={"share": (1e-3, 0.05)}, carried=())
    fingerprint = "Parts that are too small or too large by a share; the loop sees nothing."
    confused_with = ("ScaleFactorError",)
    experiment = "Measure a part, or a second scale."
    source = "Cardenas et al., ASIACCS (2011). Range assumed."

    share = Parameter("1", 0.0, low=-0.5, high=0.5, doc="share by which it is stretched")
    begin = Parameter("s", 0.0, low=0.0, doc="when the attack begins")

    @staticmethod
    def output(incoming: float, share: float, begin: float, time: float) -> float:
        return incoming * (1.0 + share) if share != 0.0 and time >= begin else incoming


class DelayAttack(ReportedReading, Effect):
    """A reading that is held back.

    y_out(t) = y_in(t - delay) from ``begin`` on
    """

    catalogue, family, site = 0, "lag", "reading"
    neutral = {"delay": 0.0}
    identification = Identification(typical={"delay": (1e-3, 50e-3)}, carried=())
    fingerprint = "A loop that begins to swing though nothing of it was changed."
    confused_with = ("TransportDelay", "ChannelTimeShift")
    experiment = "Watch the innovation while the axis accelerates."
    source = "Cardenas et al., ASIACCS (2011). Range assumed."

    reported = DiscreteState("{signal}", doc="reported reading of this sample")
    newest = DiscreteState("1", doc="place of the newest value in the ring")
    history = Memory("{signal}", _CELLS, doc="true readings of the last samples", holds=lambda delay: delay)
    delay = Parameter("s", 0.0, low=0.0, high=60.0, doc="how late it is reported")
    begin = Parameter("s", 0.0, low=0.0, doc="when the attack begins")

    @staticmethod
    def update(
        incoming: float, newest: float, history: list[float], delay: float, begin: float, time: float, sample_period: float
    ) -> tuple[float, float]:
        return _from_before(incoming, newest, history, delay, begin, time, sample_period)

    @staticmethod
    def output(incoming: float, reported: float, delay: float) -> float:
        return incoming if delay == 0.0 else reported


class DriftAttack(ReportedReading, Effect):
    """A reading that slides away so slowly that no single sample looks wrong.

    y_out = y_in + rate (t - begin) from ``begin`` on
    """

    catalogue, family, site = 0, "slow", "reading"
    neutral = {"rate": 0.0}
    identification = Identification(typical={"rate": (1e-7, 1e-4)}, typical_rotary={"rate": (1e-5, 1e-2)}, carried=())
    fingerprint = "The machine follows the reading away; only a mean over many samples shows it."
    confused_with = ("ThermalScrewGrowth",)
    experiment = "Add up the innovation: a CUSUM tells what no sample does."
    source = "Cardenas et al., ASIACCS (2011). Range assumed."

    rate = Parameter("{signal}/s", 0.0, doc="how fast it slides")
    begin = Parameter("s", 0.0, low=0.0, doc="when the attack begins")

    @staticmethod
    def output(incoming: float, rate: float, begin: float, time: float) -> float:
        return incoming + rate * (time - begin) if rate != 0.0 and time >= begin else incoming
