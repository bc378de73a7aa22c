"""What a remedy is: what a control adds so that an effect no longer shows on the part."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from lathesim.component import Input, Output, Parameter
from lathesim.effects.effect import Effect


class Remedy(Effect):
    """Passes on what it is given:  outgoing = incoming. A remedy adds to it what takes an effect away.

    It sits on a wire of the control: on the reference of a controller, on its command, on a reading. ``share`` is how much of it acts: 1
    the whole, 0 nothing, bit for bit. A lesson inserts it as it does an effect, under the key ``remedy:``.
    """

    family = "compensation"
    site = "reading"
    neutral = {"share": 0.0}
    fingerprint = "none: it takes a fingerprint away"
    experiment = "Run the same program with share 0 and with share 1."
    source = "the remedies of common controls; see the class"

    answers: ClassVar[tuple[str, ...]] = ()
    """Effects it compensates."""
    limits: ClassVar[tuple[str, ...]] = ()
    """What bounds it: converter, voltage, sensor, bandwidth."""
    cannot: ClassVar[str] = ""
    """What it cannot do, in one sentence."""
    follows: ClassVar[dict[str, str]] = {}
    """Own parameter -> the value of a diagnosis that it follows from, in words."""

    incoming = Input("{signal}", doc="what the control would send")
    outgoing = Output("{signal}", doc="what it sends instead")
    share = Parameter("1", 1.0, low=0.0, high=3.0, doc="how much of the remedy acts: 1 the whole, 0 nothing")

    if not TYPE_CHECKING:  # the law of a subclass takes other names, which is what laws are for

        @staticmethod
        def output(incoming: float) -> float:
            """Pass on."""
            return incoming
