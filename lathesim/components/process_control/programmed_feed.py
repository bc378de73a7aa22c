"""No process control: the feed stays as programmed."""

from __future__ import annotations

from lathesim.component import Component, Input, Output

NO_COMMAND = -1.0
"""Feed [m] that tells the interpolator that nothing is commanded."""


class ProgrammedFeed(Component):
    """Gives no feed command, so the part program's feed holds. It keeps the place of a process controller in a machine.

    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), Example 2, case I.
    """

    group = "controllers"

    measured = Input("{signal}", doc="measured force, torque or power")
    programmed_feed = Input("m", doc="feed per revolution of the interpolator")
    cutting_block = Input("1", doc="1 in blocks run at feed")

    feed_command = Output("m", doc="commanded feed per revolution; below zero: none")

    @staticmethod
    def output() -> float:
        """Nothing, in every block."""
        return NO_COMMAND
