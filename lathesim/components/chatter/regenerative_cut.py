"""A turning cut whose chip is as thick as the waves that the turns before left on the part allow."""

from __future__ import annotations

import math
from typing import Any

from lathesim.component import Component, DiscreteState, Input, Memory, Output, Parameter


class RegenerativeCut(Component):
    """Gives the cutting force of a chip between the tool and the surface that all turns before left.

        h = h0 + w(angle - 2 pi) - x,   w = min(w(angle - 2 pi) + h0, x)
        F = b Ks h,   F_d = -b C x'/V     while h > 0 and the part is there

    x is the displacement of the tool out of the part, along the normal of the surface, h0 the feed per turn, w the height of the surface
    over the one that a stiff tool would have left. The process damping F_d acts along that normal, whatever the angle of the cutting force,
    so it is an output of its own: wire it to the ``drag`` of each mode. w keeps the deepest of all turns, so the memory outlasts one turn
    when the tool leaves the cut. With an exponent e other than 1 the force is b Ks (h0/e) (h/h0)^e: Ks is the slope at h = h0. The
    surface is kept in cells over two turns, written by cubic Hermite between samples and read by cubic interpolation. Where a turn takes
    less than a sample, the force is no number, and the run names it. Over the edges of a slot the cut fades in and out over one step.
    Source: J. Tlusty, F. Ismail, Ann. CIRP 30 (1981), basic non-linearity in machining chatter; process damping as in Y. Altintas,
    Manufacturing Automation (2012), section 4.4. Left out: rubbing of the flank beyond that drag, the width changing.
    """

    group = "process"

    ports = {"force": "force", "feed": "feed", "depth": "width"}

    angle = Input("rad", doc="angle that the spindle has turned")
    spindle_speed = Input("rad/s", doc="speed of the spindle")
    displacement = Input("m", doc="displacement of the tool out of the part, along the normal of the surface")
    velocity = Input("m/s", doc="its rate")
    feed = Input("m", default=1e-4, doc="feed per turn: thickness of the chip of a stiff tool")
    width = Input("m", default=1e-3, doc="width of the chip")

    cutting_stiffness = Parameter("Pa", 700e6, low=0.0, doc="Ks: slope of the force over the thickness of the chip, per width")
    exponent = Parameter("1", 1.0, low=0.1, high=2.0, doc="exponent of the thickness in the force; Kienzle's 1 - m_c")
    process_damping = Parameter("N/m", 0.0, low=0.0, doc="C: force per width and slope of the surface")
    diameter = Parameter("m", 0.036, low=1e-6, doc="diameter at which it cuts, for the cutting speed")
    interrupted = Parameter("1", 1.0, low=0.0, high=1.0, doc="share of each turn in which a slotted bar is in the cut")
    run_out = Parameter("m", 0.0, low=0.0, doc="eccentricity of the part")
    always_in_contact = Parameter("1", 0.0, low=0.0, high=1.0, doc="1: the linear cut, whose force may pull")

    surface = Memory("m", 8192, doc="height of the surface over two turns")
    cell = DiscreteState("1", -1.0, doc="number of the last cell written, counted from the start", shown=False)
    last_angle = DiscreteState("rad", doc="angle of the last sample")
    last_displacement = DiscreteState("m", doc="displacement of the last sample")
    last_velocity = DiscreteState("m/s", doc="velocity of the last sample")

    force = Output("N", doc="cutting force, away from the part")
    drag = Output("N", doc="force of the process damping along the normal, away from the part")
    thickness = Output("m", doc="thickness of the chip")
    wave = Output("m", doc="height of the surface that the tool meets")
    removal_rate = Output("m^3/s", doc="volume cut per time")

    @staticmethod
    def update(
        angle: float,
        spindle_speed: float,
        displacement: float,
        velocity: float,
        feed: float,
        run_out: float,
        always_in_contact: float,
        cell: float,
        last_angle: float,
        last_displacement: float,
        last_velocity: float,
        surface: Any,
        time: float,
    ) -> tuple[float, float, float, float]:
        total = len(surface)
        turn = total // 2
        per_cell = 2.0 * math.pi / turn
        if time <= 0.0:
            return float(math.floor(angle / per_cell)), angle, displacement, velocity
        passed = angle - last_angle
        last = math.floor(angle / per_cell)
        place = int(cell)
        if passed <= 0.0 or spindle_speed <= 0.0:
            return cell, last_angle, last_displacement, last_velocity
        if last - place + 3 > turn:
            # the surface is read before it is written
            for place in range(total):
                surface[place] = math.nan
            return float(last), angle, displacement, velocity
        span = passed / spindle_speed
        while place < last:
            place += 1
            s = (place * per_cell - last_angle) / passed
            r = 1.0 - s
            height = (
                (1.0 + 2.0 * s) * r * r * last_displacement
                + s * r * r * span * last_velocity
                + s * s * (3.0 - 2.0 * s) * displacement
                - s * s * r * span * velocity
            )
            if run_out != 0.0:
                height -= run_out * math.cos(place * per_cell)
            left = surface[(place - turn) % total] + feed
            if always_in_contact < 0.5 and left < height:
                height = left
            surface[place % total] = height
        return float(last), angle, displacement, velocity

    @staticmethod
    def output(
        angle: float,
        spindle_speed: float,
        displacement: float,
        velocity: float,
        feed: float,
        width: float,
        cutting_stiffness: float,
        exponent: float,
        process_damping: float,
        diameter: float,
        interrupted: float,
        run_out: float,
        always_in_contact: float,
        surface: Any,
        step: float,
    ) -> tuple[float, float, float, float, float]:
        total = len(surface)
        turn = total // 2
        place = angle / (2.0 * math.pi) * turn - turn
        below = math.floor(place)
        s = place - below
        before = surface[(below - 1) % total]
        here = surface[below % total]
        after = surface[(below + 1) % total]
        beyond = surface[(below + 2) % total]
        wave = (
            -s * (s - 1.0) * (s - 2.0) / 6.0 * before
            + (s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0 * here
            - (s + 1.0) * s * (s - 2.0) / 2.0 * after
            + (s + 1.0) * s * (s - 1.0) / 6.0 * beyond
        )
        height = displacement
        if run_out != 0.0:
            height -= run_out * math.cos(angle)
        thickness = feed + wave - height
        there = 1.0
        if interrupted < 1.0:
            turned = angle / (2.0 * math.pi)
            turned -= math.floor(turned)
            ramp = max(spindle_speed * step / (2.0 * math.pi), 1e-12)
            there = min(max((interrupted - turned) / ramp + 0.5, 0.0), 1.0)
            if turned < 0.5 * ramp:
                there = turned / ramp + 0.5
            elif turned > 1.0 - 0.5 * ramp:
                there = (turned - 1.0) / ramp + 0.5
        if always_in_contact < 0.5 and thickness <= 0.0:
            return 0.0, 0.0, 0.0, wave, 0.0
        if exponent == 1.0 or feed <= 0.0:
            force = cutting_stiffness * thickness
        else:
            force = cutting_stiffness * feed / exponent * (max(thickness, 0.0) / feed) ** exponent
        speed = 0.5 * diameter * spindle_speed
        drag = -process_damping * velocity / speed if process_damping > 0.0 and speed > 0.0 else 0.0
        return there * width * force, there * width * drag, there * thickness, wave, there * thickness * width * speed
