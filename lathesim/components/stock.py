"""The part being cut: its radius over z, the cut that the tool takes from it, and the surface that is left."""

from __future__ import annotations

import math
from typing import Any

from lathesim.component import ON, Component, DiscreteState, Input, Memory, Output, Parameter

_FAR = 1e3
"""Distance [m] beyond every machine."""


def radius_at(removed: Any, cell: int, stock_radius: float) -> float:
    """Return the radius [m] of a cell, 0 outside the stock."""
    if cell < 0 or cell >= len(removed):
        return 0.0
    return float(stock_radius - removed[cell])


def carve(removed: Any, cell: int, stock_radius: float, radius: float, width: float) -> float:
    """Cut a cell down to ``radius`` [m] if it stands higher, and give the volume [m^3] taken off."""
    lower = radius if radius > 0.0 else 0.0
    before = float(stock_radius - removed[cell])
    if before <= lower:
        return 0.0
    removed[cell] = stock_radius - lower
    return math.pi * (before * before - lower * lower) * width


class Stock(Component):
    """Gives what the tool meets, and remembers the shape that is left: the radius over z in cells of length ``stock_length``/cells.

    Between two samples the tip runs straight from its former to its present point; every cell whose middle it passes is cut to the
    radius of the tip there, towards +z and -z alike. Feeding towards the axis (facing) the edge takes along what stands between tip and
    free end, at most ``edge_length``. ``removed`` holds how much radius is gone in each cell, so the profile is stock radius - removed.

    Source: geometry; dimensions from J. Liu, R. G. Landers (2004), Example 1 (36 mm by 60 mm, face 15 mm from the tool's start).
    Left out: nose radius and flank of the tool, inner contours, threads; a step is as sharp as one cell.
    """

    group = "tool and part"

    ports = {"displacement": "x_position"}

    x_position = Input("m", doc="actual radius of the tool tip")
    z_position = Input("m", doc="actual z position of the tool tip")

    stock_radius = Parameter("m", 0.018, low=0.0, doc="radius of the raw stock")
    stock_length = Parameter("m", 0.060, low=1e-6, doc="length of the raw stock")
    face = Parameter("m", 0.015, doc="z position of the end of the stock with smaller z")
    free_end = Parameter("1", -1.0, low=-1.0, high=1.0, doc="where the free end lies: -1 at smaller z, +1 at larger z")
    edge_length = Parameter("m", 0.005, low=0.0, doc="largest width the edge takes when it feeds towards the axis")

    removed = Memory("m", 2000, doc="radius taken off in each cell")

    uncut = DiscreteState("m", doc="radius of the material ahead")
    standing = DiscreteState("m", doc="larger radius beside the tip")
    width = DiscreteState("m", doc="width the edge takes when facing")
    within = DiscreteState("1", doc="1 while the tip is inside the raw stock")
    volume = DiscreteState("m^3", doc="volume taken off")
    x_before = DiscreteState("m", doc="tip radius a sample ago")
    z_before = DiscreteState("m", doc="tip z a sample ago")
    started = DiscreteState("1", doc="1 after the first sample")

    uncut_radius = Output("m", doc="radius of the material just ahead of the tool, 0 where there is none")
    material_radius = Output("m", doc="larger radius of the material beside the tool, 0 where there is none")
    facing_width = Output("m", doc="width of the layer the edge takes while feeding towards the axis, else 0")
    inside_stock = Output("1", doc="1 while the tool tip is inside the bounds of the raw stock, cut or not")
    removed_volume = Output("m^3", doc="volume taken off since the start")

    @staticmethod
    def update(
        x_position: float, z_position: float, stock_radius: float, stock_length: float, face: float, free_end: float, edge_length: float,
        removed: Any, volume: float, x_before: float, z_before: float, started: float,
    ) -> tuple[float, ...]:  # fmt: skip
        """Carve from the former to the present point, then look what stands around it."""
        cells = len(removed)
        cell_width = stock_length / cells
        if not (abs(x_position) < _FAR and abs(z_position) < _FAR):
            return 0.0, 0.0, 0.0, 0.0, volume, x_position, z_position, 1.0
        if started < ON:
            x_before = x_position
            z_before = z_position
        here = (z_position - face) / cell_width
        there = (z_before - face) / cell_width
        cell = math.floor(here)
        inside = z_position >= face and z_position <= face + stock_length
        if cell >= cells and inside:
            cell = cells - 1
        low = math.floor(min(here, there) + 0.5)
        high = math.floor(max(here, there) - 0.5)
        if low < 0:
            low = 0
        if high > cells - 1:
            high = cells - 1
        run = here - there
        for passed in range(low, high + 1):
            share = (passed + 0.5 - there) / run if run != 0.0 else 1.0
            volume += carve(removed, passed, stock_radius, x_before + share * (x_position - x_before), cell_width)
        width = 0.0
        if inside and x_position < x_before and abs(x_position - x_before) > abs(z_position - z_before):
            side = -1 if free_end < 0.0 else 1
            edge = int(edge_length / cell_width)
            beside = cell + side
            while 0 <= beside < cells and edge > 0 and stock_radius - removed[beside] > x_position:
                volume += carve(removed, beside, stock_radius, x_position, cell_width)
                width += cell_width
                beside += side
                edge -= 1
        uncut = 0.0
        standing = 0.0
        if inside:
            left = radius_at(removed, cell - 1, stock_radius)
            right = radius_at(removed, cell + 1, stock_radius)
            middle = radius_at(removed, cell, stock_radius)
            standing = max(max(left, right), middle)
            if z_position > z_before:
                uncut = right
            elif z_position < z_before:
                uncut = left
            else:
                uncut = standing
            if uncut == 0.0:
                uncut = middle
        within = 1.0 if inside and x_position < stock_radius else 0.0
        return uncut, standing, width, within, volume, x_position, z_position, 1.0

    @staticmethod
    def output(uncut: float, standing: float, width: float, within: float, volume: float) -> tuple[float, float, float, float, float]:
        return uncut, standing, width, within, volume


class CuttingGeometry(Component):
    """Gives depth of cut, feed per revolution, cutting speed and contact from actual positions and speeds.

        turning:  d = radius of the material ahead - x,     f = min(|v|, sqrt(2) |v_z|) 2 pi/|w|
        facing:   d = width the edge takes,                 f = min(|v|, sqrt(2) |v_x|) 2 pi/|w|      (towards the axis, |v_x| > |v_z|)
        V = |w| x

    The feed is the one along the path; the second term lets it end where the tool moves past the material instead of into it.
    ``in_contact`` is 1 while the tip is inside the bounds of the raw stock in a block run at feed: what contour errors are judged over.
    ``engaged`` is 1 only where material is left there. In rapid blocks no force is computed, but ``rapid_contact`` warns that the tool
    ran into the part: without an in-position check a lagging tool may.
    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), figure 9 and section Force models. Left out: nose radius, chip flow,
    the surface left by the last turn (chatter).
    """

    group = "process"

    ports = {"displacement": "x_position", "feed_per_revolution": "feed"}

    x_position = Input("m", doc="actual radius of the tool tip")
    x_velocity = Input("m/s", doc="actual speed of the x axis")
    z_velocity = Input("m/s", doc="actual speed of the z axis")
    spindle_speed = Input("rad/s", doc="actual spindle speed")
    uncut_radius = Input("m", doc="radius of the material just ahead of the tool")
    material_radius = Input("m", doc="larger radius of the material beside the tool")
    facing_width = Input("m", doc="width of the layer taken while facing")
    inside_stock = Input("1", doc="1 while the tool tip is inside the bounds of the raw stock")
    cutting_block = Input("1", default=1.0, doc="1 in blocks run at feed")

    slowest_spindle = Parameter("rad/s", 0.5, low=1e-6, doc="spindle speed below which nothing is cut")

    depth_of_cut = Output("m", doc="actual depth of cut")
    feed = Output("m", doc="actual feed per revolution")
    cutting_speed = Output("m/s", doc="actual cutting speed")
    part_radius = Output("m", doc="radius at which the tool cuts")
    in_contact = Output("1", doc="1 while the tip is inside the bounds of the raw stock in a block run at feed")
    engaged = Output("1", doc="1 while tool and material touch in a block run at feed")
    rapid_contact = Output("1", doc="1 while the tool stands in the part in a rapid block")
    removal_rate = Output("m^3/s", doc="volume cut per time")

    @staticmethod
    def output(
        x_position: float, x_velocity: float, z_velocity: float, spindle_speed: float, uncut_radius: float, material_radius: float,
        facing_width: float, inside_stock: float, cutting_block: float, slowest_spindle: float,
    ) -> tuple[float, ...]:  # fmt: skip
        radius = x_position if x_position > 0.0 else 0.0
        touching = material_radius > x_position or facing_width > 0.0
        turning = abs(spindle_speed)
        speed = turning * radius
        contact = 1.0 if inside_stock > ON and cutting_block > ON else 0.0
        if not touching or cutting_block < ON:
            return 0.0, 0.0, speed, radius, contact, 0.0, (1.0 if touching else 0.0), 0.0
        if facing_width > 0.0:
            depth = facing_width
            inward = abs(x_velocity)
        else:
            depth = uncut_radius - x_position
            inward = abs(z_velocity)
            if depth < 0.0:
                depth = 0.0
        feed = 0.0
        if turning > slowest_spindle:
            along = math.sqrt(x_velocity * x_velocity + z_velocity * z_velocity)
            bound = 1.4142135623730951 * inward
            feed = 2.0 * math.pi / turning * (along if along < bound else bound)
        return depth, feed, speed, radius, contact, 1.0, 0.0, depth * feed * speed


class SurfaceFinish(Component):
    """Gives the average roughness R_a = f^2/(32 r) of the surface just cut, and keeps it along z.

    f is the feed per revolution, r the nose radius. ``along_z`` holds the roughness of each cell of the part, the last cut counting,
    from ``face`` over ``length``. Out of contact the roughness is 0.
    Source: G. Boothroyd, W. A. Knight, Fundamentals of Machining and Machine Tools (1989); J. Liu, R. G. Landers (2004), equation (33).
    Left out: built-up edge, vibration, tool wear, feeds larger than the nose radius.
    """

    group = "tool and part"

    feed = Input("m", doc="feed per revolution")
    in_contact = Input("1", doc="1 while tool and part touch in a block run at feed")
    z_position = Input("m", doc="actual z position of the tool tip")

    nose_radius = Parameter("m", 0.8e-3, low=1e-6, doc="corner radius of the tool")
    face = Parameter("m", 0.015, doc="z position of the end of the stock with smaller z")
    length = Parameter("m", 0.060, low=1e-6, doc="length of the stock")

    along_z = Memory("m", 600, doc="roughness of each cell")
    held = DiscreteState("m", doc="roughness of this sample")

    roughness = Output("m", doc="average roughness R_a of the surface being cut")

    @staticmethod
    def update(feed: float, in_contact: float, z_position: float, nose_radius: float, face: float, length: float, along_z: Any) -> float:
        """Equation (33), noted down where the tool is."""
        if in_contact < ON:
            return 0.0
        roughness = feed * feed / (32.0 * nose_radius)
        place = (z_position - face) / length * len(along_z)
        if 0.0 <= place < len(along_z):
            along_z[math.floor(place)] = roughness
        return roughness

    @staticmethod
    def output(held: float) -> float:
        return held
