"""Kind 8 of the user-written parts: a process controller. The integrator of fixed gain with which force control of turning began."""

from __future__ import annotations

from lathesim.component import Component, DiscreteState, Input, Output, Parameter
from lathesim.hookspecs import hookimpl


class FixedGainProcessController(Component):
    """Gives the feed by integrating the force error with a fixed gain:  f_{k+1} = f_k + T Kc (F_r - F), within limits.

    The gain of the process changes with the depth of cut, and so does the speed of this loop: too high a Kc is unstable in a deep cut, too
    low a one is slow in a shallow one, which is what variable-gain and adaptive controllers were made for. Below the contact
    threshold the feed stays. It takes the place of the process controller of a lathe.
    Source: O. Masory, Y. Koren, Adaptive Control System for Turning, Annals of the CIRP 29 (1980). Left out: gain scheduling.
    """

    ports = {"measured": "measured"}

    measured = Input("{signal}", doc="measured force, torque or power")
    programmed_feed = Input("m", doc="feed per revolution of the interpolator")
    cutting_block = Input("1", doc="1 in blocks run at feed")

    reference = Parameter("{signal}", 500.0, low=0.0, doc="wanted force, torque or power")
    gain = Parameter("m/(s*({signal}))", 6e-7, low=0.0, doc="Kc: feed per second and unit of error")
    contact_threshold = Parameter("{signal}", 20.0, low=0.0, doc="measured value below which the tool counts as out of the cut")
    smallest_feed = Parameter("m", 1e-6, low=1e-12, high=0.1, doc="smallest commanded feed")
    largest_feed = Parameter("m", 5e-4, low=1e-12, high=0.1, doc="largest commanded feed")

    held_feed = DiscreteState("m", -1.0, doc="commanded feed of this sample; below zero: none")

    feed_command = Output("m", doc="commanded feed per revolution; below zero: none")

    @staticmethod
    def update(
        measured: float,
        programmed_feed: float,
        cutting_block: float,
        reference: float,
        gain: float,
        contact_threshold: float,
        smallest_feed: float,
        largest_feed: float,
        held_feed: float,
        sample_period: float,
    ) -> float:
        """One sample."""
        if cutting_block < 0.5:
            return -1.0
        feed = programmed_feed if held_feed < 0.0 else held_feed
        if held_feed >= 0.0 and measured >= contact_threshold:
            feed += sample_period * gain * (reference - measured)
        if feed > largest_feed:
            return largest_feed
        if feed < smallest_feed:
            return smallest_feed
        return feed

    @staticmethod
    def output(held_feed: float) -> float:
        """Hold over the sample."""
        return held_feed


@hookimpl
def register_components() -> list[type[Component]]:
    """Hand the part to the simulator."""
    return [FixedGainProcessController]
