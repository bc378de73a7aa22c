"""Paths and limits that the tests of motion use, and the quickest timing by a linear program that shares no code with the passes."""

from __future__ import annotations

import itertools

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import linprog
from scipy.sparse import csr_matrix, vstack

from lathesim.motion.axis_limits import AxisLimits
from lathesim.motion.joint_path import FloatArray, JointPath
from lathesim.motion.kinematics import CHAINS, Poses, inverse

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
