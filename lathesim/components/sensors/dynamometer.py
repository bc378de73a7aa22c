"""A dynamometer under the tool."""

from __future__ import annotations

from lathesim.component import Component, DiscreteState, Input, Noise, Output, Parameter


class Dynamometer(Component):
    """Gives the three forces on the tool as read once a sample:  reading = force + s n,  n a standard normal number.

    Source: Kistler, Multicomponent Dynamometer manuals (a stiff quartz sensor follows the force). Left out: drift, crosstalk, the
    resonance of the mounted dynamometer.
    """

    group = "converters"

    ports = {"measured": "main_force", "reading": "main", "thrust_reading": "thrust", "feed_reading": "feed"}

    main_force = Input("N", doc="force along the cutting speed")
    thrust_force = Input("N", default=0.0, doc="force along the depth")
    feed_force = Input("N", default=0.0, doc="force along the feed")

    noise = Parameter("N", 0.0, low=0.0, doc="standard deviation of the noise of each channel")

    main_chance = Noise(doc="noise of the main force")
    thrust_chance = Noise(doc="noise of the thrust force")
    feed_chance = Noise(doc="noise of the feed force")
    main_held = DiscreteState("N", doc="main force of this sample")
    thrust_held = DiscreteState("N", doc="thrust force of this sample")
    feed_held = DiscreteState("N", doc="feed force of this sample")

    main = Output("N", doc="force along the cutting speed, as read")
    thrust = Output("N", doc="force along the depth, as read")
    feed = Output("N", doc="force along the feed, as read")

    @staticmethod
    def update(
        main_force: float,
        thrust_force: float,
        feed_force: float,
        noise: float,
        main_chance: float,
        thrust_chance: float,
        feed_chance: float,
    ) -> tuple[float, float, float]:
        """Force and noise."""
        return main_force + noise * main_chance, thrust_force + noise * thrust_chance, feed_force + noise * feed_chance

    @staticmethod
    def output(main_held: float, thrust_held: float, feed_held: float) -> tuple[float, float, float]:
        """Hold over the sample."""
        return main_held, thrust_held, feed_held
