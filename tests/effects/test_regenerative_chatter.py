"""The swing of the tool under its own waves, against the limit in the frequency domain."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lathesim.component import Component, Output, Parameter
from lathesim.effects.force_over_turn import RegenerativeChatter
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.engine.run import run
from lathesim.engine.wiring import wire
from lathesim.stability.frequency_limit import limit_at
from lathesim.stability.tool_point import Mode, ToolPoint

FREQUENCY, DAMPING, STIFFNESS, FEED = 80.0, 0.03, 2e7, 1e-4


class Turning(Component):
    """Gives the angle of a spindle at a constant speed."""

    speed = Parameter("rad/s", 10.0, doc="its speed")
    angle = Output("rad", doc="angle")

    @staticmethod
    def output(speed: float, time: float) -> float:
        return speed * time


def growth(speed: float, share: float, period: float) -> float:
    """Return the growth of a turn at a share of the limit of the chip width."""
    slope = limit_at(ToolPoint((Mode(FREQUENCY, DAMPING, STIFFNESS),), (1.0,)), 1.0, speed).width * share
    values = {"engagement": 1.0, "compliance": 1.0 / STIFFNESS, "frequency": FREQUENCY, "damping": DAMPING}
    chatter = Part("chatter", RegenerativeChatter.with_units({"signal": "N"}), values, {"swing": slope * FEED / STIFFNESS + 1e-8})
    parts = (Part("spindle", Turning, {"speed": speed * math.pi / 30.0}), chatter)
    constants = {"incoming": slope * FEED, "feed": FEED, "depth": 1e-3, "speed": 1.0}
    wires = (*(Wire(f"chatter.{name}", constant=value) for name, value in constants.items()), Wire("chatter.angle", "spindle.angle"))
    turns = 60
    record = run(
        wire(Assembly(parts, wires, period, period / 4, record=("chatter.outgoing",))), duration=turns * 60.0 / speed, engine="plain"
    )
    swing = record["chatter.outgoing"] / (slope * FEED) - 1.0
    samples = 60.0 / speed / period
    sizes = [float(np.std(swing[round(first * samples) : round((first + 10) * samples)])) for first in (25, 50)]
    return (sizes[1] / sizes[0]) ** (1.0 / 25)


@pytest.mark.parametrize("speed", [1000.0, 1500.0])
def test_a_cut_at_the_limit_neither_grows_nor_dies(speed: float) -> None:
    assert growth(speed, 1.0, 1e-3) == pytest.approx(1.0, abs=1e-3)
    assert growth(speed, 1.1, 1e-3) > 1.004
    assert growth(speed, 0.9, 1e-3) < 0.996
