"""A small secret motion on a reference, which only the control and its guard know."""

from __future__ import annotations

from lathesim.component import Component, DiscreteState, Input, Noise, Output, Parameter


class Watermark(Component):
    """Gives the reference with a random number added, new every n samples:  out = in + size n_k.

    What the machine reads must then hold the answer to it; a reading that is forged does not.

    Source: B. Satchidanandan, P. R. Kumar, Dynamic Watermarking, Proc. IEEE 105 (2017), 219. Left out: shapes other than white.
    """

    group = "controllers"

    reference = Input("m", doc="reference as asked for")
    size = Parameter("m", 0.0, low=0.0, doc="standard deviation of the watermark; 0: none")

    chance = Noise(doc="the secret number of this sample")
    added = DiscreteState("m", doc="watermark of this sample")

    marked = Output("m", doc="reference with the watermark")
    mark = Output("m", doc="the watermark itself, for the guard only")

    @staticmethod
    def update(chance: float, size: float) -> float:
        """A new number."""
        return size * chance

    @staticmethod
    def output_marked(reference: float, added: float) -> float:
        """Add it."""
        return reference + added

    @staticmethod
    def output_mark(added: float) -> float:
        """Return the mark that is added [m]."""
        return added
