"""A milling cut with straight teeth and one flexible direction, along the feed."""

from __future__ import annotations

import math
from typing import Any

from lathesim.component import Component, DiscreteState, Input, Memory, Output, Parameter


class MillingCut(Component):
    """Gives the force along the feed of teeth that each meet the wave of the tooth before.

        F = -b sum_j g(phi_j) (Kt cos phi_j + Kn sin phi_j) h_j,   h_j = sin(phi_j) (f_z + x(t) - x(t - tau)),   tau = 60/(n N)

    phi_j is the angle of a tooth, g is 1 between ``entry`` and ``leave``, f_z the feed of a tooth and b the axial depth. The displacement
    is kept in cells over two turns, because a single tooth cuts the wave of the whole previous turn. Cells are written by cubic Hermite
    between samples and read by cubic interpolation. Where a tooth passes in less than a sample, the force is no number, and the run names
    it. Source: T. Insperger, G. Stepan, Semi-Discretization for Time-Delay Systems (2011), milling with one degree of freedom. Left out:
    teeth that leave the cut by vibration (with ``always_in_contact`` 0 the force ends there, the memory still is one tooth), helix, run-out
    of teeth.
    """

    group = "process"

    ports = {"force": "force", "feed": "feed", "depth": "width"}

    angle = Input("rad", doc="angle that the spindle has turned")
    spindle_speed = Input("rad/s", doc="speed of the spindle")
    displacement = Input("m", doc="displacement of the tool along the feed")
    velocity = Input("m/s", doc="its rate")
    feed = Input("m", default=1e-4, doc="feed of a tooth")
    width = Input("m", default=1e-3, doc="axial depth of cut")

    teeth = Parameter("1", 2.0, low=1.0, high=64.0, doc="number of teeth")
    tangential = Parameter("Pa", 6e8, low=0.0, doc="tangential force per chip area")
    normal = Parameter("Pa", 2e8, low=0.0, doc="normal force per chip area")
    entry = Parameter("rad", 0.0, low=0.0, high=6.283185307179586, doc="angle at which a tooth enters the cut")
    leave = Parameter("rad", 3.141592653589793, low=0.0, high=6.283185307179586, doc="angle at which it leaves the cut")
    always_in_contact = Parameter("1", 0.0, low=0.0, high=1.0, doc="1: the linear cut, whose force may pull")

    kept = Memory("m", 16384, doc="displacement over two turns")
    cell = DiscreteState("1", -1.0, doc="number of the last cell written, counted from the start", shown=False)
    last_angle = DiscreteState("rad", doc="angle of the last sample")
    last_displacement = DiscreteState("m", doc="displacement of the last sample")
    last_velocity = DiscreteState("m/s", doc="velocity of the last sample")

    force = Output("N", doc="force on the tool along the feed")

    @staticmethod
    def update(
        angle: float,
        spindle_speed: float,
        displacement: float,
        velocity: float,
        teeth: float,
        cell: float,
        last_angle: float,
        last_displacement: float,
        last_velocity: float,
        kept: Any,
        time: float,
    ) -> tuple[float, float, float, float]:
        total = len(kept)
        per_cell = 4.0 * math.pi / total
        if time <= 0.0:
            return float(math.floor(angle / per_cell)), angle, displacement, velocity
        passed = angle - last_angle
        last = math.floor(angle / per_cell)
        place = int(cell)
        if passed <= 0.0 or spindle_speed <= 0.0:
            return cell, last_angle, last_displacement, last_velocity
        if (last - place + 3) * teeth > total // 2:
            # the wave is read before it is written
            for place in range(total):
                kept[place] = math.nan
            return float(last), angle, displacement, velocity
        span = passed / spindle_speed
        while place < last:
            place += 1
            s = (place * per_cell - last_angle) / passed
            r = 1.0 - s
            kept[place % total] = (
                (1.0 + 2.0 * s) * r * r * last_displacement
                + s * r * r * span * last_velocity
                + s * s * (3.0 - 2.0 * s) * displacement
                - s * s * r * span * velocity
            )
        return float(last), angle, displacement, velocity

    @staticmethod
    def output(
        angle: float,
        spindle_speed: float,
        displacement: float,
        feed: float,
        width: float,
        teeth: float,
        tangential: float,
        normal: float,
        entry: float,
        leave: float,
        always_in_contact: float,
        kept: Any,
        step: float,
    ) -> float:
        total = len(kept)
        place = (angle / (4.0 * math.pi) - 0.5 / teeth) * total
        below = math.floor(place)
        s = place - below
        before = (
            -s * (s - 1.0) * (s - 2.0) / 6.0 * kept[(below - 1) % total]
            + (s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0 * kept[below % total]
            - (s + 1.0) * s * (s - 2.0) / 2.0 * kept[(below + 1) % total]
            + (s + 1.0) * s * (s - 1.0) / 6.0 * kept[(below + 2) % total]
        )
        moved = feed + displacement - before
        ramp = max(spindle_speed * step, 1e-12)
        count = int(teeth)
        force = 0.0
        for tooth in range(count):
            phi = angle + tooth * 2.0 * math.pi / teeth
            phi -= 2.0 * math.pi * math.floor(phi / (2.0 * math.pi))
            there = min(max((phi - entry) / ramp + 0.5, 0.0), 1.0) * min(max((leave - phi) / ramp + 0.5, 0.0), 1.0)
            thickness = math.sin(phi) * moved
            if there > 0.0 and (always_in_contact >= 0.5 or thickness > 0.0):
                force -= there * width * thickness * (tangential * math.cos(phi) + normal * math.sin(phi))
        return force
