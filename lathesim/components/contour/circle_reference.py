"""The reference of a circular test: whole turns at one speed."""

from __future__ import annotations

import math

from lathesim.component import Component, DiscreteState, Output, Parameter

TWO_PI = 2.0 * math.pi


class CircleReference(Component):
    """Gives the point of a circle that a test asks for, sample by sample:  x = X_c + R cos a,  z = Z_c + R sin a,  da/dt = d v/R.

    ``direction`` +1 turns from +X to +Z, -1 the other way. With an ``acceleration`` the speed rises evenly to ``speed`` and falls so at
    the end; at 0 it is there at once. Velocity and acceleration are those of the circle at the sample instant.

    Source: ISO 230-4 (circular tests for numerically controlled machine tools). Left out: the run in and out along a tangent.
    """

    group = "interpolator"

    radius = Parameter("m", 0.02, low=1e-6, doc="radius of the circle")
    speed = Parameter("m/s", 0.02, low=1e-9, doc="path speed")
    acceleration = Parameter("m/s^2", 0.0, low=0.0, doc="path acceleration at start and end; 0: at once")
    turns = Parameter("1", 2.0, low=0.0, doc="turns until it is finished")
    direction = Parameter("1", 1.0, low=-1.0, high=1.0, doc="+1 from +X to +Z, -1 the other way")
    start_angle = Parameter("rad", 0.0, doc="angle of the first point, from +X")
    centre_x_at = Parameter("m", 0.0, doc="centre, radius coordinate")
    centre_z_at = Parameter("m", 0.0, doc="centre, z coordinate")

    now = DiscreteState("s", doc="time of this sample")

    x_reference = Output("m", doc="reference radius of the tool tip")
    z_reference = Output("m", doc="reference z position of the tool tip")
    x_velocity = Output("m/s", doc="reference speed of the x axis")
    z_velocity = Output("m/s", doc="reference speed of the z axis")
    x_acceleration = Output("m/s^2", doc="reference acceleration of the x axis")
    z_acceleration = Output("m/s^2", doc="reference acceleration of the z axis")
    direction_x = Output("1", doc="x part of the unit tangent of the path")
    direction_z = Output("1", doc="z part of the unit tangent of the path")
    normal_x = Output("1", doc="x part of the unit normal left of the path at the reference")
    normal_z = Output("1", doc="z part of that normal")
    centre_x = Output("m", doc="centre of the circle, radius coordinate")
    centre_z = Output("m", doc="centre of the circle, z coordinate")
    circle_radius = Output("m", doc="radius of the circle")
    feed_speed = Output("m/s", doc="reference path speed")
    angle = Output("rad", doc="angle turned since the start")
    finished = Output("1", doc="1 once all turns are done")

    @staticmethod
    def update(time: float) -> float:
        """Hold the time of the sample."""
        return time

    @staticmethod
    def output(
        now: float,
        radius: float,
        speed: float,
        acceleration: float,
        turns: float,
        direction: float,
        start_angle: float,
        centre_x_at: float,
        centre_z_at: float,
    ) -> tuple[float, ...]:
        """Where the circle asks the tool to be."""
        whole = TWO_PI * radius * turns
        ramp = speed / acceleration if acceleration > 0.0 else 0.0
        if acceleration > 0.0 and speed * ramp > whole:
            ramp = math.sqrt(whole / acceleration)
        top = acceleration * ramp if acceleration > 0.0 else speed
        lasting = whole / top + ramp
        way, rate, rise = whole, 0.0, 0.0
        if now < ramp:
            way, rate, rise = 0.5 * acceleration * now * now, acceleration * now, acceleration
        elif now < lasting - ramp:
            way, rate = 0.5 * top * ramp + top * (now - ramp), top
        elif now < lasting:
            left = lasting - now
            way, rate, rise = whole - 0.5 * acceleration * left * left, acceleration * left, -acceleration
        side = 1.0 if direction >= 0.0 else -1.0
        at = start_angle + side * way / radius
        cosine = math.cos(at)
        sine = math.sin(at)
        along_x = -side * sine
        along_z = side * cosine
        inward = rate * rate / radius
        return (
            centre_x_at + radius * cosine,
            centre_z_at + radius * sine,
            rate * along_x,
            rate * along_z,
            rise * along_x - inward * cosine,
            rise * along_z - inward * sine,
            along_x,
            along_z,
            along_z,
            -along_x,
            centre_x_at * 1.0,
            centre_z_at * 1.0,
            radius * 1.0,
            rate * 1.0,
            way / radius,
            1.0 if now >= lasting - 1e-9 else 0.0,
        )
