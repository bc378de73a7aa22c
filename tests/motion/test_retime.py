"""The quickest timing: closed forms, two oracles that share no code, and limits that hold at every servo sample and between."""

from __future__ import annotations

import itertools
import time

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline
from scipy.optimize import linprog
from scipy.sparse import csr_matrix, vstack

from lathesim.motion.axis_limits import AxisLimits
from lathesim.motion.joint_path import FloatArray, JointPath
from lathesim.motion.kinematics import CHAINS, Poses, inverse
from lathesim.motion.retime import retime
from lathesim.motion.time_law import Timing, law_of, smoothed

PERIOD = 1e-3


def shares(timing: Timing, limits: AxisLimits) -> tuple[float, float, float]:
    """Return the largest velocity, acceleration and jerk over their limits, at every servo sample and ten times between."""
    _, v, a, j = timing.at(np.arange(0.0, timing.duration + PERIOD, PERIOD / 10.0))
    return tuple(float(np.max(np.abs(x) / y)) for x, y in ((v, limits.velocity), (a, limits.acceleration), (j, limits.jerk)))  # type: ignore[return-value]


def test_a_straight_line_takes_its_textbook_time() -> None:
    assert retime(line(0.1), same_limits(1, 0.02, 0.05)).duration == pytest.approx(5.4, rel=1e-4)


@pytest.mark.parametrize(("length", "expected"), [(1.0, 0.2), (1e-4, 0.002)])
def test_two_points_are_exact_with_fifty_steps(length: float, expected: float) -> None:
    assert retime(line(length), same_limits(1, 100.0, 100.0), grid=50).duration == pytest.approx(expected, rel=1e-4)


def test_the_five_axis_helix_and_the_circle_take_the_times_of_the_linear_program() -> None:
    s = np.linspace(0.0, 2.0 * np.pi, 201)
    circle = path_of(0.02 * np.column_stack([np.cos(s), np.sin(s)]))
    assert retime(helix(), FIVE).duration == pytest.approx(3.4044, rel=5e-4)
    assert retime(circle, same_limits(2, 0.04, 0.2)).duration == pytest.approx(3.02866, rel=5e-4)


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 6))])
def test_a_random_path_takes_the_time_of_a_linear_program(seed: int) -> None:
    path = random_path(seed)
    timing = retime(path, FIVE, retraction=np.pi)
    assert timing.duration == pytest.approx(by_linear_program(path, FIVE), rel=2e-3)
    assert shares(timing, FIVE)[:2] <= (1.001, 1.001)


@pytest.mark.slow
def test_two_hundred_random_paths_take_the_time_of_a_linear_program() -> None:
    wrong = []
    for seed in range(200):
        path = random_path(seed)
        timing = retime(path, FIVE, retraction=np.pi)
        off = abs(timing.duration / by_linear_program(path, FIVE) - 1.0)
        if off > 2e-3 or max(shares(timing, FIVE)[:2]) > 1.001:
            wrong.append((seed, off))
    assert wrong == []


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::PendingDeprecationWarning")
def test_two_hundred_random_paths_take_the_time_of_toppra_and_cost_no_more() -> None:
    toppra = pytest.importorskip("toppra", reason="toppra is an optional oracle: python -m pip install toppra")
    toppra.setup_logging("ERROR")
    constraint, algorithm = pytest.importorskip("toppra.constraint"), pytest.importorskip("toppra.algorithm")
    bounds = [np.column_stack([-x, x]) for x in (FIVE.velocity, FIVE.acceleration)]
    interpolation = constraint.DiscretizationType.Interpolation
    limits = [
        constraint.JointVelocityConstraint(bounds[0]),
        constraint.JointAccelerationConstraint(bounds[1], discretization_scheme=interpolation),
    ]
    retime(random_path(0), FIVE, retraction=np.pi)
    ours, theirs, wrong = 0.0, 0.0, []
    for seed in range(200):
        path = random_path(seed)
        begun = time.process_time()
        timing = retime(path, FIVE, retraction=np.pi)
        ours += time.process_time() - begun
        knots = timing.curve.knots
        parts = -(-1000 // (len(knots) - 1))
        spans = itertools.pairwise(knots)
        grid = np.append(np.concatenate([np.linspace(a, b, parts, endpoint=False) for a, b in spans]), knots[-1])
        begun = time.process_time()
        problem = algorithm.TOPPRA(limits, toppra.SplineInterpolator(knots, path.positions, "not-a-knot"), gridpoints=grid)
        _, speed, _ = problem.compute_parameterization(0, 0)
        theirs += time.process_time() - begun
        off = timing.duration / float(np.sum(2.0 * np.diff(grid) / (speed[1:] + speed[:-1]))) - 1.0
        if abs(off) > 2e-3:
            wrong.append((seed, off))
    print(f"{ours:.1f} s of processor time, toppra {theirs:.1f} s")
    assert wrong == []
    assert ours < theirs


def test_a_line_with_jerk_takes_its_textbook_time_and_ends_without_acceleration() -> None:
    limits = same_limits(1, 0.02, 0.05, 0.5)
    timing = retime(line(0.1), limits, jerk=True)
    assert timing.duration == pytest.approx(0.1 / 0.02 + 0.02 / 0.05 + 0.05 / 0.5, rel=1e-9)
    assert max(shares(timing, limits)) <= 1.0 + 1e-9
    _, v, a, _ = timing.at(np.array([0.0, timing.duration]))
    assert np.abs(v).max() < 1e-12
    assert np.abs(a).max() < 1e-12


@pytest.mark.parametrize("seed", [None, 0, 1, 2, 3])
def test_with_jerk_every_limit_holds_between_the_servo_samples(seed: int | None) -> None:
    timing = retime(helix() if seed is None else random_path(seed), FIVE, jerk=True, retraction=np.pi)
    velocity, acceleration, jerk = shares(timing, FIVE)
    assert velocity <= 1.001
    assert acceleration <= 1.001
    assert jerk <= 1.01


@pytest.mark.parametrize("jerk", [False, True])
@pytest.mark.parametrize(
    "points",
    [
        [[0.0, 0.0], [1e-7, 0.0]],
        [[0.0, 0.0], [0.0, 0.0], [0.1, 0.0], [0.1, 0.0], [0.1, 0.1]],
        [[0.0, 0.0], [1e-7, 0.0], [0.1, 0.0], [0.1, 1e-7], [0.1, 0.1]],
        [[1e-7 * (at % 2), 0.0] for at in range(40)],
        [[0.05 * u * u, 0.05 * u**3] for u in np.linspace(-1.0, 1.0, 101)],
        [[0.05 * u**3, 0.05 * abs(u) ** 3] for u in np.linspace(-1.0, 1.0, 101)],
    ],
    ids=["stroke", "repeats", "strokes_between", "zigzag", "cusp", "corner"],
)
def test_awkward_paths_are_timed_within_their_limits(points: list[list[float]], jerk: bool) -> None:
    limits = same_limits(2, 0.1, 1.0, 20.0)
    timing = retime(path_of(np.array(points)), limits, jerk=jerk)
    times = np.linspace(0.0, timing.duration, 20_001)
    _, v, a, j = timing.at(times)
    assert np.isfinite(timing.duration)
    assert np.abs(v).max() <= 0.1 * 1.001
    assert np.abs(a).max() <= 1.0 * 1.001
    assert not jerk or np.abs(j).max() <= 20.0 * 1.01
    assert timing.at(times[-1:])[0][0] == pytest.approx(points[-1], abs=1e-12)


def test_a_path_that_stands_takes_no_time() -> None:
    assert retime(path_of(np.zeros((3, 2))), same_limits(2, 1.0, 1.0)).duration == 0.0


def test_the_axes_stand_at_a_retraction() -> None:
    out_and_back = path_of(np.array([[0.0], [0.05], [0.1], [0.05], [0.0]]))
    assert retime(out_and_back, same_limits(1, 0.02, 0.05)).duration == pytest.approx(2 * 5.4, rel=1e-4)


@pytest.mark.slow
@settings(max_examples=20, deadline=None)
@given(
    st.lists(st.tuples(st.floats(-1.0, 1.0), st.floats(-1e-3, 1e-3)), min_size=1, max_size=12),
    st.floats(1e-3, 10.0),
    st.floats(1e-3, 100.0),
)
@example([(0.0, 0.0009999999999999998), (0.01953125, 0.0), (0.0, 0.0)], 1.0, 2.0).via("the sample at the retraction")
@example(
    [(0.0, 0.0), (0.0, 6.28e-4), (0.0, 0.0), (1.0, 0.0), (0.0, 0.0), (1.0, 0.0), (0.0, 9.47e-4), (6e-4, 0.0), (0.0, 0.0)], 1.0, 2.0
).via("a bend within one segment")
def test_any_path_is_timed_within_its_limits(points: list[tuple[float, float]], velocity: float, acceleration: float) -> None:
    timing = retime(path_of(np.array(points)), same_limits(2, velocity, acceleration), grid=100)
    _, v, a, _ = timing.at(np.linspace(0.0, timing.duration, 4001))
    assert np.abs(v).max() <= 1.001 * velocity
    assert np.abs(a).max() <= 1.001 * acceleration


@pytest.mark.slow
def test_the_time_grows_in_proportion_to_the_number_of_samples() -> None:
    rng = np.random.default_rng(0)
    s = np.linspace(0.0, 100.0, 100_000)
    waves = [sum(rng.normal() * np.sin(w * s + rng.uniform(0.0, 6.0)) for w in rng.uniform(0.2, 2.0, 6)) for _ in range(5)]
    positions = 0.1 * np.column_stack(waves)
    limits = same_limits(5, 0.2, 1.0)
    seconds = {}
    for count in (10_000, 100_000):
        path = path_of(positions[:count])
        seconds[count] = min(_cpu(path, limits) for _ in range(3))
    assert seconds[100_000] < 20.0 * seconds[10_000]


def _cpu(path: object, limits: AxisLimits) -> float:
    begun = time.process_time()
    retime(path, limits)  # type: ignore[arg-type]
    return time.process_time() - begun


FIVE = AxisLimits([0.04] * 3 + [np.deg2rad(60.0)] * 2, [0.2] * 3 + [10.0] * 2, [4.0] * 3 + [200.0] * 2)
"""40 mm/s, 200 mm/s2, 4 m/s3; 60 deg/s, 10 rad/s2, 200 rad/s3."""


def path_of(positions: FloatArray) -> JointPath:
    """Return a path of up to five axes."""
    columns = np.atleast_2d(np.asarray(positions, dtype=np.float64))
    count = columns.shape[1]
    return JointPath(tuple("xyzab"[:count]), (("m",) * 3 + ("rad",) * 2)[:count], columns)


def line(length: float) -> JointPath:
    """Return two points of one axis."""
    return path_of(np.array([[0.0], [length]]))


def same_limits(axes: int, velocity: float, acceleration: float, jerk: float = np.inf) -> AxisLimits:
    """Return limits that are alike for all axes."""
    return AxisLimits([velocity] * axes, [acceleration] * axes, [jerk] * axes)


def helix() -> JointPath:
    """Return the five-axis helix of 201 samples on the trunnion machine."""
    s = np.linspace(0.0, 1.0, 201)
    points = np.column_stack([0.02 * np.cos(2 * np.pi * s), 0.02 * np.sin(2 * np.pi * s), 0.005 * s])
    directions = np.column_stack([0.3 * np.cos(4 * np.pi * s), 0.3 * np.sin(4 * np.pi * s), np.ones(201)])
    return path_of(inverse(CHAINS["trunnion"], Poses(points, directions)).joints)


def random_path(seed: int) -> JointPath:
    """Return a smooth random five-axis path (odd seeds), or one through twelve random points (even ones)."""
    rng = np.random.default_rng(seed)
    size = np.array([0.02, 0.02, 0.02, 0.3, 0.3])
    if seed % 2 == 0:
        return path_of(rng.normal(size=(12, 5)) * size)
    s = np.linspace(0.0, 1.0, 201)
    waves = [
        sum(rng.normal() * np.sin(2 * np.pi * turns * s + rng.uniform(0.0, 6.0)) for turns in rng.uniform(0.2, 3.0, 4)) for _ in range(5)
    ]
    return path_of(np.column_stack(waves) * size)


def by_linear_program(path: JointPath, limits: AxisLimits, least: int = 1000) -> float:
    """Return the duration by HiGHS: the largest sum of b = (ds/dt)^2 at the nodes under the same limits at both ends of each segment."""
    knots = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path.positions, axis=0) / limits.velocity, axis=1))])
    spline = CubicSpline(knots, path.positions, bc_type="not-a-knot")
    parts = -(-least // (len(knots) - 1))
    s = np.append(np.concatenate([np.linspace(a, b, parts, endpoint=False) for a, b in itertools.pairwise(knots)]), knots[-1])
    ds = np.diff(s)[:, None]
    slope, bend = spline(s, 1) / limits.acceleration, spline(s, 2) / limits.acceleration
    begins = np.vstack([bend[:-1] - slope[:-1] / (2 * ds), -slope[1:] / (2 * ds)]).ravel()
    ends = np.vstack([slope[:-1] / (2 * ds), slope[1:] / (2 * ds) + bend[1:]]).ravel()
    nodes = np.tile(np.repeat(np.arange(len(s) - 1), path.positions.shape[1]), 2)
    rows = np.arange(len(begins))
    cap = 1.0 / np.max(np.abs(spline(s, 1)) / limits.velocity, axis=1) ** 2
    cap[[0, -1]] = 0.0
    scale = cap.max()
    values, places = np.r_[begins, ends] * scale, (np.r_[rows, rows], np.r_[nodes, nodes + 1])
    matrix = csr_matrix((values, places), shape=(len(rows), len(s)))
    bounds = np.column_stack([np.zeros(len(s)), cap / scale])
    solved = linprog(-np.ones(len(s)), A_ub=vstack([matrix, -matrix]), b_ub=np.ones(2 * len(rows)), bounds=bounds, method="highs")
    speed = np.sqrt(np.maximum(solved.x * scale, 0.0))
    return float(np.sum(2.0 * ds[:, 0] / (speed[1:] + speed[:-1])))


def test_a_smoothed_law_arrives_at_each_knot_where_the_next_piece_begins() -> None:
    """Place, speed and acceleration of a piece reach those of the next: its cubic and the knots are one motion."""
    law = smoothed(law_of(np.array([0.0, 0.1, 0.5, 0.9, 1.0]), np.array([0.0, 0.4, 2.0, 0.4, 0.0])), 0.05)
    assert np.abs(law.jerk).max() > 10.0
    reached = law.at(law.time[1:] * (1.0 - 1e-12))
    for values, knots in zip(reached[:3], (law.place, law.speed, law.acceleration), strict=True):
        assert values == pytest.approx(knots[1:], abs=1e-8)
