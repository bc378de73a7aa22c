"""A value that follows another one by a factor."""

from __future__ import annotations

from lathesim.component import Component, Input, Output, Parameter


class ScaledValue(Component):
    """Gives a multiple of a value:  outgoing = factor incoming.

    Where a template feeds one value to two axes, this part between them gives the second axis a value of its own. Source: none needed.
    """

    group = "controllers"

    incoming = Input("{signal}", doc="the value that is followed")
    factor = Parameter("1", 1.0, low=0.0, doc="how many times as large")
    outgoing = Output("{signal}", doc="the multiple")

    @staticmethod
    def output(incoming: float, factor: float) -> float:
        """The multiple."""
        return factor * incoming
