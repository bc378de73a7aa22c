"""The exact foot point on lines, arcs and free paths, and what the estimates of the literature cost."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lathesim.components.contour_error import FootPoint, along_row, distance_at, foot_row
from lathesim.components.free_paths import curvature_at, nearest_on, point_of
from lathesim.components.interpolator import point_on_path
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import simulate
from lathesim.path_columns import PATH_COLUMNS
from lathesim.plugins import load_registry

POINTS = 10_000


def line(start: tuple[float, float], end: tuple[float, float]) -> list[float]:
    row = dict.fromkeys(PATH_COLUMNS, 0.0)
    row |= {"kind": 1.0, "length": math.dist(start, end)}
    row |= {"start_x": start[0], "start_z": start[1], "end_x": end[0], "end_z": end[1]}
    return list(row.values())


def arc(centre: tuple[float, float], radius: float, angle: float, sweep: float) -> list[float]:
    row = dict.fromkeys(PATH_COLUMNS, 0.0)
    row |= {"kind": 2.0, "length": abs(sweep) * radius, "radius": radius, "start_angle": angle, "sweep": sweep}
    row |= {"centre_x": centre[0], "centre_z": centre[1]}
    row |= {"start_x": centre[0] + radius * math.sin(angle), "start_z": centre[1] + radius * math.cos(angle)}
    row |= {"end_x": centre[0] + radius * math.sin(angle + sweep), "end_z": centre[1] + radius * math.cos(angle + sweep)}
    return list(row.values())


def test_the_foot_point_on_lines_and_arcs_is_the_true_one() -> None:
    rng = np.random.default_rng(1)
    for _ in range(POINTS):
        if rng.random() < 0.5:
            start, end = rng.uniform(-0.05, 0.05, (2, 2))
            path, reach = [line(tuple(start), tuple(end))], 0.02
        else:
            radius = rng.uniform(1e-3, 0.05)
            path = [arc(tuple(rng.uniform(-0.05, 0.05, 2)), radius, rng.uniform(-3.0, 3.0), rng.choice([-1, 1]) * rng.uniform(0.2, 6.0))]
            reach = 0.5 * radius
        way = rng.uniform(0.0, path[0][1])
        on = np.array(point_on_path(path, 0, way))
        near = (
            np.array([point_on_path(path, 0, w)[0] for w in (way - 1e-7, way + 1e-7)]),
            np.array([point_on_path(path, 0, w)[1] for w in (way - 1e-7, way + 1e-7)]),
        )
        along = np.array([near[0][1] - near[0][0], near[1][1] - near[1][0]])
        if not 1e-6 < way < path[0][1] - 1e-6:
            continue
        normal = np.array([along[1], -along[0]]) / np.hypot(*along)
        if path[0][0] == 2.0:
            normal = (on - np.array(path[0][6:8])) / path[0][8]
        off = rng.uniform(-reach, reach)
        x, z = on + off * normal
        found = along_row(path, 0, x, z)
        foot = np.array(point_on_path(path, 0, found))
        assert np.hypot(*(foot - on)) < (1e-9 if path[0][0] == 2.0 else 2e-9 + 1e-7 * abs(off))
        assert abs(distance_at(path, 0, found, x, z) - abs(off)) < 1e-9


def test_the_foot_point_on_a_free_path_is_the_true_one_to_a_nanometre() -> None:
    curve = butterfly()
    rng = np.random.default_rng(2)
    for _ in range(POINTS // 5):
        at = rng.uniform(1.0, len(curve) - 2.0)
        tangent = np.array([point_of(curve, at, 0, 1), point_of(curve, at, 1, 1)])
        normal = np.array([tangent[1], -tangent[0]]) / np.hypot(*tangent)
        radius = min(abs(1.0 / (curvature_at(curve, at) or 1e-9)), 0.01)
        point = np.array([point_of(curve, at, 0, 0), point_of(curve, at, 1, 0)])
        x, z = point + rng.uniform(-0.5, 0.5) * radius * normal
        found = nearest_on(curve, x, z, at + rng.uniform(-0.4, 0.4))
        foot = np.array([point_of(curve, found, 0, 0), point_of(curve, found, 1, 0)])
        assert np.hypot(*(foot - point)) < 1e-9


def butterfly() -> list[list[float]]:
    from lathesim.shipped import shipped_folder

    text = (shipped_folder("lesson_configs") / "tables" / "butterfly.csv").read_text(encoding="utf-8")
    return [[float(cell) for cell in row.split(",")] for row in text.splitlines()[1:]]


def test_it_never_leaps_to_another_branch_that_comes_close() -> None:
    there_and_back = [line((0.0, 0.0), (0.0, 0.1)), line((0.0, 0.1), (0.001, 0.1)), line((0.001, 0.1), (0.001, 0.0))]
    # the reference is far along the way back, the tool on the way there, nearer to the way back
    assert foot_row(there_and_back, 0, 2, 0.0007, 0.02) == 0
    # at the turn it goes on
    assert foot_row(there_and_back, 0, 2, 0.0009, 0.0999) > 0


def test_at_an_outer_corner_the_foot_point_is_the_corner() -> None:
    path = [line((0.0, 0.0), (0.0, 0.01)), line((0.0, 0.01), (0.01, 0.01))]
    law = FootPoint.laws["output"]
    deviation, _, normal_x, normal_z, *_, foot_x, foot_z = law(path, 0.0, 0.0, 0.01, 0.0, 1.0, -0.001, 0.011, 0.0, 0.0)
    assert (foot_x, foot_z) == (0.0, 0.01)
    assert abs(deviation) == pytest.approx(math.sqrt(2.0) * 1e-3)
    assert (-0.001 + deviation * normal_x, 0.011 + deviation * normal_z) == pytest.approx((0.0, 0.01), abs=1e-15)


@pytest.mark.slow
def test_cross_coupling_on_the_foot_point_halves_what_the_tangent_leaves() -> None:
    lesson, registry = load_lesson("08_contour_control"), load_registry()
    largest = {}
    for variant in ("tangent", "circle", "two_circles", "foot_point"):
        record = simulate(lesson, registry, variant)
        largest[variant] = float(np.max(np.abs(record["contour.contour_error"])))
    assert largest["foot_point"] < 0.5 * largest["tangent"]
    assert largest["foot_point"] < largest["two_circles"] < largest["circle"] < largest["tangent"]
