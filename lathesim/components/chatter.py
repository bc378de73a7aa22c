"""Cuts that can chatter, the modes that swing, and the hammer that taps them."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from lathesim.component import ON, Component, DiscreteState, Input, Memory, Output, Parameter, State
from lathesim.elementary import hermite

_AROUND = 3
"""Cells beside the last one written that an interpolation may read."""


def on_cubic(cells: list[float], place: float) -> float:
    """Return the value of a ring of cells at a place between two of them, on the cubic through the two on either side."""
    total = len(cells)
    below = math.floor(place)
    s = place - below
    return (
        -s * (s - 1.0) * (s - 2.0) / 6.0 * cells[(below - 1) % total]
        + (s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0 * cells[below % total]
        - (s + 1.0) * s * (s - 2.0) / 2.0 * cells[(below + 1) % total]
        + (s + 1.0) * s * (s - 1.0) / 6.0 * cells[(below + 2) % total]
    )


class CutOverWaves:
    """What cuts share that keep in cells, over two turns, the waves that the tool left."""

    group = "process"

    ports: ClassVar[dict[str, str]] = {"force": "force", "feed": "feed", "depth": "width"}

    angle = Input("rad", doc="angle that the spindle has turned")
    spindle_speed = Input("rad/s", doc="speed of the spindle")

    cell = DiscreteState("1", -1.0, doc="number of the last cell written, counted from the start", shown=False)
    last_angle = DiscreteState("rad", doc="angle of the last sample")
    last_displacement = DiscreteState("m", doc="displacement of the last sample")
    last_velocity = DiscreteState("m/s", doc="velocity of the last sample")


class RegenerativeCut(CutOverWaves, Component):
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

    force = Output("N", doc="cutting force, away from the part")
    drag = Output("N", doc="force of the process damping along the normal, away from the part")
    thickness = Output("m", doc="thickness of the chip")
    wave = Output("m", doc="height of the surface that the tool meets")
    removal_rate = Output("m^3/s", doc="volume cut per time")

    @staticmethod
    def update(
        angle: float, spindle_speed: float, displacement: float, velocity: float, feed: float, run_out: float, always_in_contact: float,
        cell: float, last_angle: float, last_displacement: float, last_velocity: float, surface: Any, time: float,
    ) -> tuple[float, float, float, float]:  # fmt: skip
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
        if last - place + _AROUND > turn:
            # the surface is read before it is written
            for place in range(total):
                surface[place] = math.nan
            return float(last), angle, displacement, velocity
        span = passed / spindle_speed
        while place < last:
            place += 1
            s = (place * per_cell - last_angle) / passed
            height = hermite(s, span, last_displacement, last_velocity, displacement, velocity)
            if run_out != 0.0:
                height -= run_out * math.cos(place * per_cell)
            left = surface[(place - turn) % total] + feed
            if always_in_contact < ON and left < height:
                height = left
            surface[place % total] = height
        return float(last), angle, displacement, velocity

    @staticmethod
    def output(
        angle: float, spindle_speed: float, displacement: float, velocity: float, feed: float, width: float, cutting_stiffness: float,
        exponent: float, process_damping: float, diameter: float, interrupted: float, run_out: float, always_in_contact: float,
        surface: Any, step: float,
    ) -> tuple[float, float, float, float, float]:  # fmt: skip
        turn = len(surface) // 2
        wave = on_cubic(surface, angle / (2.0 * math.pi) * turn - turn)
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
        if always_in_contact < ON and thickness <= 0.0:
            return 0.0, 0.0, 0.0, wave, 0.0
        if exponent == 1.0 or feed <= 0.0:
            force = cutting_stiffness * thickness
        else:
            force = cutting_stiffness * feed / exponent * (max(thickness, 0.0) / feed) ** exponent
        speed = 0.5 * diameter * spindle_speed
        drag = -process_damping * velocity / speed if process_damping > 0.0 and speed > 0.0 else 0.0
        return there * width * force, there * width * drag, there * thickness, wave, there * thickness * width * speed


class MillingCut(CutOverWaves, Component):
    """Gives the force along the feed of teeth that each meet the wave of the tooth before.

        F = -b sum_j g(phi_j) (Kt cos phi_j + Kn sin phi_j) h_j,   h_j = sin(phi_j) (f_z + x(t) - x(t - tau)),   tau = 60/(n N)

    phi_j is the angle of a tooth, g is 1 between ``entry`` and ``leave``, f_z the feed of a tooth and b the axial depth. The displacement
    is kept in cells over two turns, because a single tooth cuts the wave of the whole previous turn. Cells are written by cubic Hermite
    between samples and read by cubic interpolation. Where a tooth passes in less than a sample, the force is no number, and the run names
    it. Source: T. Insperger, G. Stepan, Semi-Discretization for Time-Delay Systems (2011), milling with one degree of freedom. Left out:
    teeth that leave the cut by vibration (with ``always_in_contact`` 0 the force ends there, the memory still is one tooth), helix, run-out
    of teeth.
    """

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

    force = Output("N", doc="force on the tool along the feed")

    @staticmethod
    def update(
        angle: float, spindle_speed: float, displacement: float, velocity: float, teeth: float, cell: float, last_angle: float,
        last_displacement: float, last_velocity: float, kept: Any, time: float,
    ) -> tuple[float, float, float, float]:  # fmt: skip
        total = len(kept)
        per_cell = 4.0 * math.pi / total
        if time <= 0.0:
            return float(math.floor(angle / per_cell)), angle, displacement, velocity
        passed = angle - last_angle
        last = math.floor(angle / per_cell)
        place = int(cell)
        if passed <= 0.0 or spindle_speed <= 0.0:
            return cell, last_angle, last_displacement, last_velocity
        if (last - place + _AROUND) * teeth > total // 2:
            # the wave is read before it is written
            for place in range(total):
                kept[place] = math.nan
            return float(last), angle, displacement, velocity
        span = passed / spindle_speed
        while place < last:
            place += 1
            s = (place * per_cell - last_angle) / passed
            kept[place % total] = hermite(s, span, last_displacement, last_velocity, displacement, velocity)
        return float(last), angle, displacement, velocity

    @staticmethod
    def output(
        angle: float, spindle_speed: float, displacement: float, feed: float, width: float, teeth: float, tangential: float, normal: float,
        entry: float, leave: float, always_in_contact: float, kept: Any, step: float,
    ) -> float:  # fmt: skip
        before = on_cubic(kept, (angle / (4.0 * math.pi) - 0.5 / teeth) * len(kept))
        moved = feed + displacement - before
        ramp = max(spindle_speed * step, 1e-12)
        count = int(teeth)
        force = 0.0
        for tooth in range(count):
            phi = angle + tooth * 2.0 * math.pi / teeth
            phi -= 2.0 * math.pi * math.floor(phi / (2.0 * math.pi))
            there = min(max((phi - entry) / ramp + 0.5, 0.0), 1.0) * min(max((leave - phi) / ramp + 0.5, 0.0), 1.0)
            thickness = math.sin(phi) * moved
            if there > 0.0 and (always_in_contact >= ON or thickness > 0.0):
                force -= there * width * thickness * (tangential * math.cos(phi) + normal * math.sin(phi))
        return force


class ToolMode(Component):
    """Gives the displacement of the tool along the normal of the surface by one of its modes.

        q'' + 2 zeta w q' + w^2 q = (w^2/k) (F cos(beta - alpha) + F_d cos(alpha) + F_a),   x = before + q cos(alpha),   w = 2 pi f

    alpha is the angle of the mode and beta that of the cutting force, both from the normal. Several modes stand in a row: each adds its
    share to the ``before`` of the next. F_d is a force along the normal, as of process damping, and F_a one along the mode, as of a hammer.
    Source: Y. Altintas, Manufacturing Automation (2012), chapter 3. Left out: modes that share their damping.
    """

    group = "tool and part"

    ports = {"effort": "force", "displacement": "displacement", "vibration": "displacement", "flow": "velocity"}

    swing = State("m", doc="displacement along the mode")
    swing_rate = State("m/s", doc="its rate")
    force = Input("N", default=0.0, doc="cutting force")
    drag = Input("N", default=0.0, doc="force along the normal of the surface")
    hammer = Input("N", default=0.0, doc="force along the mode")
    before = Input("m", default=0.0, doc="displacement by the modes before, along the normal")
    before_rate = Input("m/s", default=0.0, doc="its rate")
    before_acceleration = Input("m/s^2", default=0.0, doc="acceleration by the modes before, along the normal")

    frequency = Parameter("Hz", 100.0, low=0.1, high=1e5, doc="natural frequency")
    damping = Parameter("1", 0.03, low=0.0, high=0.999, doc="damping ratio")
    stiffness = Parameter("N/m", 1e7, low=1.0, doc="modal stiffness")
    direction = Parameter("rad", 0.0, doc="angle of the mode from the normal of the surface")
    force_angle = Parameter("rad", 0.0, doc="angle of the cutting force from the normal of the surface")

    displacement = Output("m", doc="displacement out of the part, along the normal")
    velocity = Output("m/s", doc="its rate")
    acceleration = Output("m/s^2", doc="acceleration along the normal")

    @staticmethod
    def derivative(
        swing: float, swing_rate: float, force: float, drag: float, hammer: float, frequency: float, damping: float, stiffness: float,
        direction: float, force_angle: float,
    ) -> tuple[float, float]:  # fmt: skip
        w = 2.0 * math.pi * frequency
        pushed = force * math.cos(force_angle - direction) + drag * math.cos(direction) + hammer
        return swing_rate, w * (w * (pushed / stiffness - swing) - 2.0 * damping * swing_rate)

    @staticmethod
    def output_displacement(swing: float, before: float, direction: float) -> float:
        return before + swing * math.cos(direction)

    @staticmethod
    def output_velocity(swing_rate: float, before_rate: float, direction: float) -> float:
        return before_rate + swing_rate * math.cos(direction)

    @staticmethod
    def output_acceleration(
        swing: float, swing_rate: float, force: float, drag: float, hammer: float, before_acceleration: float, frequency: float,
        damping: float, stiffness: float, direction: float, force_angle: float,
    ) -> float:  # fmt: skip
        w = 2.0 * math.pi * frequency
        pushed = force * math.cos(force_angle - direction) + drag * math.cos(direction) + hammer
        return before_acceleration + math.cos(direction) * w * (w * (pushed / stiffness - swing) - 2.0 * damping * swing_rate)


class ImpactHammer(Component):
    """Gives the force of a hit, a half sine  F = peak sin(pi (t - start)/contact),  and of a second one where the hammer bounces.

    Source: D. J. Ewins, Modal Testing (2000), section 3.6. Left out: the mass of the hammer, which moves with the tool while they touch,
    and the hand.
    """

    group = "tool and part"

    start = Parameter("s", 0.01, low=0.0, doc="when the hammer meets the tool")
    contact = Parameter("s", 4e-4, low=1e-6, doc="how long hammer and tool touch")
    peak = Parameter("N", 800.0, low=0.0, doc="largest force")
    bounce = Parameter("1", 0.0, low=0.0, high=1.0, doc="force of a second hit over that of the first; 0 for none")
    bounce_delay = Parameter("s", 0.01, low=0.0, doc="from the first hit to the second")

    force = Output("N", doc="force on the tool")

    @staticmethod
    def output(time: float, start: float, contact: float, peak: float, bounce: float, bounce_delay: float) -> float:
        force = 0.0
        s = (time - start) / contact
        if 0.0 < s < 1.0:
            force = peak * math.sin(math.pi * s)
        s = (time - start - bounce_delay) / contact
        if bounce > 0.0 and 0.0 < s < 1.0:
            force += bounce * peak * math.sin(math.pi * s)
        return force
