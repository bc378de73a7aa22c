"""Kinematics of machines as data: rotary axes that carry the part, rotary axes that carry the tool, linear axes between them.

The tool tip m + H t (m the linear axes, H the rotations of the head, t the tool) is seen from the part by undoing the rotary axes of the
table one after another, each about its pivot:  p = R2(-b) (R1(-a) (tip - pivot1) - pivot2),  u = R2(-b) R1(-a) H w  with the tool's
direction w. The inverse turns w into u by two rotations (subproblem 2 of B. Paden and W. Kahan; R. Murray, Z. Li, S. Sastry, A Mathematical
Introduction to Robotic Manipulation, 1994, section 3.3): at most two branches, and a singularity where u lies along the outer axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.motion.joint_path import FloatArray, MotionError

SINGULAR = 1e-7
"""Sine of the angle between tool and outer axis below which any angle of that axis would do."""
_REACHED = 1e-9
"""How far a direction may miss what the axes reach; a position [m], likewise, where an axis is missing."""


@dataclass(frozen=True)
class RotaryAxis:
    """A rotary axis: ``name``, unit vector ``about`` it turns, and ``pivot`` [m], seen from the frame that carries it."""

    name: str
    about: tuple[float, float, float]
    pivot: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Chain:
    """A machine: names of its ``linear`` axes by direction (x, y, z; empty where there is none), ``table`` from the machine to the part,
    ``head`` from the machine to the tool, ``tool`` [m] from the last head axis to the tip, and the direction ``tool_axis`` from the tip to
    the holder."""

    name: str
    linear: tuple[str, str, str]
    table: tuple[RotaryAxis, ...] = ()
    head: tuple[RotaryAxis, ...] = ()
    tool: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tool_axis: tuple[float, float, float] = (0.0, 0.0, 1.0)

    @property
    def axes(self) -> tuple[str, ...]:
        """Return the names of all axes: the linear ones, then table and head."""
        return (*(name for name in self.linear if name), *(axis.name for axis in (*self.table, *self.head)))

    @property
    def units(self) -> tuple[str, ...]:
        """Return the SI unit of each axis."""
        return tuple("m" if name in self.linear else "rad" for name in self.axes)


@dataclass(frozen=True, eq=False)
class Poses:
    """Tips ``points`` (poses, 3) [m] and unit vectors ``directions`` (poses, 3) from tip to holder, seen from the part."""

    points: FloatArray
    directions: FloatArray


def forward(chain: Chain, joints: FloatArray) -> Poses:
    """Return the poses of ``joints`` (samples, axes), columns in the order of ``chain.axes``."""
    values = dict(zip(chain.axes, np.atleast_2d(joints).T, strict=True))
    count = len(np.atleast_2d(joints))
    point = np.repeat(np.array(chain.tool)[None], count, axis=0)
    direction = np.repeat(np.array(chain.tool_axis)[None], count, axis=0)
    for axis in reversed(chain.head):
        point = _turned(axis.about, values[axis.name], point) + axis.pivot
        direction = _turned(axis.about, values[axis.name], direction)
    for place, name in enumerate(chain.linear):
        if name:
            point[:, place] += values[name]
    for axis in chain.table:
        point = _turned(axis.about, -values[axis.name], point - axis.pivot)
        direction = _turned(axis.about, -values[axis.name], direction)
    return Poses(point, direction)


@dataclass(frozen=True, eq=False)
class Inverse:
    """Joints (samples, axes) of poses, the samples at which the outer axis was free, and what to tell about them."""

    joints: FloatArray
    singular: np.typing.NDArray[np.int64]
    note: str


def branches(chain: Chain, poses: Poses) -> list[Inverse]:
    """Return every branch of the inverse, each angle in (-pi, pi]; one branch where there is at most one rotary axis.

    At a singularity the outer angle is 0. Raises :class:`MotionError` with the number of the sample that the machine cannot reach.
    """
    directions = _normed(poses.directions)
    turns = [(axis, -1.0) for axis in reversed(chain.table)] + [(axis, 1.0) for axis in chain.head]
    if len(turns) > 2:
        raise MotionError(f"the machine '{chain.name}' has {len(turns)} rotary axes.", remedy="Give at most two.")
    free = np.zeros(len(directions), dtype=bool)
    if len(turns) == 2:
        choices, free = _two_turns(chain, turns, directions)
    elif turns:
        choices = [_one_turn(chain, turns[0], directions)]
    else:
        _check(np.linalg.norm(directions - np.array(chain.tool_axis), axis=1), chain, "direction of the tool")
        choices = [{}]
    singular = np.flatnonzero(free)
    outer = turns[0][0].name if turns else ""
    note = _singular_note(singular, outer)
    return [Inverse(_with_linear(chain, poses.points, angles), singular, note) for angles in choices]


def inverse(chain: Chain, poses: Poses, start: Sequence[float] | None = None) -> Inverse:
    """Return the joints along a path of poses: the branch nearest to ``start`` (or to 0), then always the nearest, without jumps of a turn.

    At a singularity the outer axis keeps its angle, and ``note`` says so.
    """
    found = branches(chain, poses)
    rotary = np.array([name not in chain.linear for name in chain.axes])
    joints = np.empty_like(found[0].joints)
    before = np.zeros(len(rotary)) if start is None else np.asarray(start, dtype=np.float64)
    outer = _outer_column(chain)
    held = np.zeros(len(joints), dtype=bool)
    held[found[0].singular] = True
    turned = [branch.joints for branch in found]
    for at in range(len(joints)):
        best, least = joints[at], np.inf
        for branch in turned:
            trial = branch[at].copy()
            trial[rotary] += 2.0 * np.pi * np.round((before[rotary] - trial[rotary]) / (2.0 * np.pi))
            if held[at] and outer is not None:
                trial[outer] = before[outer]
            distance = float(np.max(np.abs(trial - before)[rotary], initial=0.0))
            if distance < least - 1e-12:
                best, least = trial, distance
        joints[at] = before = best
    if held.any():
        angles = {name: joints[:, column] for column, name in enumerate(chain.axes) if rotary[column]}
        joints = _with_linear(chain, poses.points, angles)
    return Inverse(joints, found[0].singular, found[0].note)


def _outer_column(chain: Chain) -> int | None:
    turns = [axis.name for axis in (*reversed(chain.table), *chain.head)]
    return chain.axes.index(turns[0]) if len(turns) == 2 else None


def _two_turns(
    chain: Chain, turns: Sequence[tuple[RotaryAxis, float]], u: FloatArray
) -> tuple[list[dict[str, FloatArray]], np.typing.NDArray[np.bool_]]:
    """Return the angles of both branches of u = R1(a1) R2(a2) w, and where the first is free."""
    (first, sign1), (second, sign2) = turns
    e1, e2 = np.array(first.about), np.array(second.about)
    w = np.array(chain.tool_axis)
    cosine = float(e1 @ e2)
    across = np.cross(e1, e2)
    size = float(across @ across)
    if size < SINGULAR:
        raise MotionError(f"the axes {first.name} and {second.name} are parallel.", remedy="Give axes about different directions.")
    along1, along2 = u @ e1, float(w @ e2)
    alpha = (along1 - cosine * along2) / size
    beta = (along2 - cosine * along1) / size
    square = (1.0 - alpha**2 - beta**2 - 2.0 * alpha * beta * cosine) / size
    _check(np.sqrt(np.maximum(0.0, -square)) * (square < -_REACHED), chain, "direction of the tool")
    height = np.sqrt(np.maximum(square, 0.0))
    free = np.linalg.norm(np.cross(u, e1), axis=1) < SINGULAR
    choices = []
    for side in (1.0, -1.0):
        c = alpha[:, None] * e1 + beta[:, None] * e2 + side * height[:, None] * across
        inner = _angle(e2, np.broadcast_to(w, c.shape), c)
        outer = np.where(free, 0.0, _angle(e1, c, u))
        choices.append({first.name: sign1 * outer, second.name: sign2 * inner})
    choices.sort(key=lambda angles: float(np.abs(angles[second.name][0])))
    return choices, free


def _one_turn(chain: Chain, turn: tuple[RotaryAxis, float], u: FloatArray) -> dict[str, FloatArray]:
    axis, sign = turn
    w = np.broadcast_to(np.array(chain.tool_axis), u.shape)
    angle = _angle(np.array(axis.about), w, u)
    _check(np.linalg.norm(_turned(axis.about, angle, w) - u, axis=1), chain, "direction of the tool")
    return {axis.name: sign * angle}


def _with_linear(chain: Chain, points: FloatArray, angles: dict[str, FloatArray]) -> FloatArray:
    """Return the joints whose rotary angles are known."""
    tip = np.array(points, dtype=np.float64)
    for axis in reversed(chain.table):
        tip = _turned(axis.about, angles[axis.name], tip) + axis.pivot
    tool = np.repeat(np.array(chain.tool)[None], len(tip), axis=0)
    for axis in reversed(chain.head):
        tool = _turned(axis.about, angles[axis.name], tool) + axis.pivot
    rest = tip - tool
    for place, name in enumerate(chain.linear):
        if not name:
            _check(np.abs(rest[:, place]), chain, f"position along {'xyz'[place]}")
    columns = [rest[:, chain.linear.index(name)] if name in chain.linear else angles[name] for name in chain.axes]
    return np.column_stack(columns)


def _check(missed: FloatArray, chain: Chain, what: str) -> None:
    """Refuse the first sample that misses by more than rounding."""
    wrong = np.flatnonzero(missed > max(_REACHED, 1e-9))
    if len(wrong):
        fact = f"the {what} of sample {wrong[0] + 1} is out of reach of the machine '{chain.name}', by {missed[wrong[0]]:.3g}."
        raise MotionError(fact, remedy="Change the pose, or the machine.")


def _singular_note(singular: np.typing.NDArray[np.int64], outer: str) -> str:
    if not len(singular):
        return ""
    where = f"sample {singular[0] + 1}" if len(singular) == 1 else f"{len(singular)} samples, the first {singular[0] + 1}"
    return f"The tool lies along the axis {outer} at {where}: every angle of {outer} gives the same pose there, and it keeps the last one."


def _normed(vectors: FloatArray) -> FloatArray:
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    wrong = np.flatnonzero(~(lengths[:, 0] > 0.0))
    if len(wrong):
        raise MotionError(f"the direction of the tool of sample {wrong[0] + 1} has no length.", remedy="Give a vector from tip to holder.")
    return np.asarray(vectors / lengths)


def _angle(axis: FloatArray, begin: FloatArray, end: FloatArray) -> FloatArray:
    """Return the angle about ``axis`` from each vector of ``begin`` to that of ``end``."""
    a = begin - (begin @ axis)[:, None] * axis
    b = end - (end @ axis)[:, None] * axis
    return np.asarray(np.arctan2(np.cross(a, b) @ axis, np.sum(a * b, axis=1)))


def _turned(about: Sequence[float], angle: FloatArray, vectors: FloatArray) -> FloatArray:
    """Return vectors (samples, 3) turned about an axis by an angle each [rad]: Rodrigues' formula."""
    axis = np.asarray(about, dtype=np.float64)
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return np.asarray(vectors * cosine + np.cross(axis, vectors) * sine + axis * (vectors @ axis)[:, None] * (1.0 - cosine))


def tip_speed(chain: Chain, joints: FloatArray, slopes: FloatArray) -> FloatArray:
    """Return |dp/ds| [m] of the tip seen from the part, (samples,), from q and q' (samples, axes): central difference of the chain."""
    step = 1e-6 / np.maximum(np.max(np.abs(slopes), axis=1, keepdims=True), 1e-300)
    ahead, behind = forward(chain, joints + step * slopes), forward(chain, joints - step * slopes)
    return np.asarray(np.linalg.norm(ahead.points - behind.points, axis=1) / (2.0 * step[:, 0]))
