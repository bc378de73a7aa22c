"""Kinematics of machines as data: rotary axes that carry the part, rotary axes that carry the tool, linear axes between them.

The tool tip m + H t (m the linear axes, H the rotations of the head, t the tool) is seen from the part by undoing the rotary axes of the
table one after another, each about its pivot:  p = R2(-b) (R1(-a) (tip - pivot1) - pivot2),  u = R2(-b) R1(-a) H w  with the tool's
direction w. The inverse turns w into u by two rotations (subproblem 2 of B. Paden and W. Kahan; R. Murray, Z. Li, S. Sastry, A Mathematical
Introduction to Robotic Manipulation, 1994, section 3.3): at most two branches, and a singularity where u lies along the outer axis.

A path may be given as poses of the tool; the speed of the tip, and how far it is from its path between samples, follow from them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.errors import UnitError, nearest
from lathesim.motion.grid import ToolSpeed
from lathesim.motion.joint_path import FloatArray, JointPath, MotionError, PathCurve
from lathesim.units import quantity

_NEARER = 1e-12
"""Angle [rad] by which a solution must be nearer to be taken."""

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
    note = _singular_note(singular, turns[0][0].name if turns else "")
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
            if distance < least - _NEARER:
                best, least = trial, distance
        joints[at] = before = best
    if held.any():
        joints = _with_linear(chain, poses.points, {name: joints[:, column] for column, name in enumerate(chain.axes) if rotary[column]})
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
        choices.append({first.name: sign1 * np.where(free, 0.0, _angle(e1, c, u)), second.name: sign2 * inner})
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
    return np.column_stack([rest[:, chain.linear.index(name)] if name in chain.linear else angles[name] for name in chain.axes])


def _check(missed: FloatArray, chain: Chain, what: str) -> None:
    """Refuse the first sample that misses by more than rounding."""
    wrong = np.flatnonzero(missed > _REACHED)
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


_X, _Y, _Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
_NAMED = {"x": _X, "y": _Y, "z": _Z}
_XYZ = ("x", "y", "z")

CHAINS: dict[str, Chain] = {
    "trunnion": Chain("trunnion", _XYZ, (RotaryAxis("a", _X, (0.0, 0.0, -30e-3)), RotaryAxis("b", _Y, (0.0, 0.0, 10e-3)))),
    "table_table": Chain("table_table", _XYZ, (RotaryAxis("a", _X, (0.0, 0.0, -50e-3)), RotaryAxis("c", _Z, (0.0, 0.0, 20e-3)))),
    "head_table": Chain("head_table", _XYZ, (RotaryAxis("c", _Z),), (RotaryAxis("b", _Y),), tool=(0.0, 0.0, -120e-3)),
    "lathe": Chain("lathe", ("x", "", "z"), tool_axis=_X),
    "lathe_with_c": Chain("lathe_with_c", ("x", "", "z"), (RotaryAxis("c", _Z),), tool_axis=_X),
}
"""Machines by name. Offsets are assumed: a table of a desktop machine, a head with a tool of 120 mm; a lathe's holder lies at larger X."""

_KEYS = ("linear", "table", "head", "tool", "tool_axis")


def chain_from(data: object, place: str) -> Chain:
    """Return the chain a file names, or describes as ``{linear: [x, y, z], table: [{axis: a, about: x, pivot: [0 mm, 0 mm, -30 mm]}]}``.

    Raises :class:`MotionError` with the nearest name.
    """
    if isinstance(data, str):
        if data not in CHAINS:
            remedy = nearest(data, CHAINS) or f"Known are {', '.join(CHAINS)}."
            raise MotionError(f"there is no kinematics '{data}'.", place=place, remedy=remedy)
        return CHAINS[data]
    if not isinstance(data, Mapping):
        raise MotionError("the kinematics are neither a name nor a mapping.", place=place, remedy=f"Known names are {', '.join(CHAINS)}.")
    _known(data, _KEYS, place)
    linear = data.get("linear", list(_XYZ))
    if not isinstance(linear, list) or len(linear) != len(_XYZ) or not all(name is None or isinstance(name, str) for name in linear):
        raise MotionError(
            "'linear' is no list of three names.", place=place, remedy="Write linear: [x, y, z], null where there is no axis."
        )
    table = tuple(_rotary(entry, f"{place}: table") for entry in _listed(data.get("table", []), place))
    head = tuple(_rotary(entry, f"{place}: head") for entry in _listed(data.get("head", []), place))
    tool = _vector(data.get("tool", ["0 m"] * 3), place)
    direction = _direction(data.get("tool_axis", "z"), place)
    chain = Chain("of the file", tuple(name or "" for name in linear), table, head, tool, direction)  # type: ignore[arg-type]
    if len(set(chain.axes)) != len(chain.axes):
        raise MotionError("two axes have the same name.", place=place, remedy="Name each axis once.")
    return chain


def _rotary(entry: Any, place: str) -> RotaryAxis:
    if not isinstance(entry, Mapping) or not isinstance(entry.get("axis"), str):
        raise MotionError("an axis has no name.", place=place, remedy="Write {axis: a, about: x, pivot: [0 mm, 0 mm, -30 mm]}.")
    _known(entry, ("axis", "about", "pivot"), place)
    return RotaryAxis(entry["axis"], _direction(entry.get("about"), place), _vector(entry.get("pivot", ["0 m"] * 3), place))


def _listed(entries: Any, place: str) -> list[Any]:
    if not isinstance(entries, list):
        raise MotionError("'table' and 'head' are lists of axes.", place=place, remedy="Write table: [{axis: a, about: x}].")
    return entries


def _direction(entry: Any, place: str) -> tuple[float, float, float]:
    if isinstance(entry, str) and entry in _NAMED:
        return _NAMED[entry]
    if isinstance(entry, list) and len(entry) == len(_XYZ) and all(isinstance(part, (int, float)) for part in entry):
        length = float(np.linalg.norm(entry))
        if length > 0.0:
            return (entry[0] / length, entry[1] / length, entry[2] / length)
    raise MotionError("a direction is missing.", place=place, remedy="Write about: x, y or z, or three numbers [0, 0.7, 0.7].")


def _vector(entry: Any, place: str) -> tuple[float, float, float]:
    if not isinstance(entry, list) or len(entry) != len(_XYZ):
        raise MotionError("a position is no list of three lengths.", place=place, remedy="Write [0 mm, 0 mm, -30 mm].")
    try:
        first, second, third = (quantity(str(part), "m") for part in entry)
    except UnitError as error:
        raise MotionError(error.fact, place=place, remedy=error.remedy) from None
    return first, second, third


def _known(data: Mapping[str, Any], keys: tuple[str, ...], place: str) -> None:
    for key in data:
        if key not in keys:
            raise MotionError(f"there is no key '{key}'.", place=place, remedy=nearest(str(key), keys) or f"Known are {', '.join(keys)}.")


_POINT = ("x", "y", "z")
_DIRECTION = ("i", "j", "k")


def joints_of(poses: JointPath, chain: Chain) -> tuple[JointPath, str]:
    """Return the axes of a path with the columns x, y, z and, for the direction from tip to holder, i, j, k; and a note on singularities.

    Without i, j, k the tool keeps the direction of the machine. Raises :class:`MotionError` where a column is missing or a pose is out of
    reach.
    """
    missing = [name for name in _POINT if name not in poses.names]
    if missing:
        raise MotionError(f"the poses have no column '{missing[0]}'.", remedy="Name the columns x [mm], y [mm], z [mm], i, j, k.")
    points = poses.positions[:, [poses.names.index(name) for name in _POINT]]
    given = [name for name in _DIRECTION if name in poses.names]
    if given and len(given) < len(_DIRECTION):
        raise MotionError(f"the poses give only {', '.join(given)} of the direction.", remedy="Give i, j and k, or none of them.")
    if given:
        directions = poses.positions[:, [poses.names.index(name) for name in _DIRECTION]]
    else:
        directions = np.repeat(np.array(chain.tool_axis)[None], len(points), axis=0)
    found = inverse(chain, Poses(points, directions))
    return JointPath(chain.axes, chain.units, found.joints), found.note


def tool_speed_of(path: JointPath, chain: Chain | None) -> ToolSpeed:
    """Return the way of the tip per s: by the kinematics, or without any the length of the way of the linear axes."""
    if chain is None:
        linear = np.array([unit == "m" for unit in path.units])

        def along_the_axes(_: FloatArray, slopes: FloatArray) -> FloatArray:
            return np.asarray(np.linalg.norm(slopes[:, linear], axis=1))

        return along_the_axes
    for name in chain.axes:
        if name not in path.names:
            remedy = nearest(name, path.names) or "Name the columns as the kinematics do."
            raise MotionError(f"the kinematics have an axis '{name}' and the path has none.", remedy=remedy)
    order = [path.names.index(name) for name in chain.axes]
    known = chain

    def seen_from_the_part(positions: FloatArray, slopes: FloatArray) -> FloatArray:
        return tip_speed(known, positions[:, order], slopes[:, order])

    return seen_from_the_part


_SHARES = (0.25, 0.5, 0.75)


def path_error(chain: Chain, curve: PathCurve) -> FloatArray:
    """Return the distance [m] of the tip from the straight line between the tips of neighbouring samples, the largest of each span."""
    tips = forward(chain, curve.at(curve.knots)).points
    ways = np.diff(tips, axis=0)
    lengths = np.maximum(np.sum(ways * ways, axis=1), 1e-300)
    spans = np.arange(len(ways))
    worst = np.zeros(len(ways))
    for share in _SHARES:
        away = forward(chain, curve.derivative(0, spans, share * np.diff(curve.knots))).points - tips[:-1]
        along = np.clip(np.sum(away * ways, axis=1) / lengths, 0.0, 1.0)
        worst = np.maximum(worst, np.linalg.norm(away - along[:, None] * ways, axis=1))
    return worst
