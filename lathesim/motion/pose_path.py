"""A path given as poses of the tool, the speed of the tip, and how far it is from its path between samples."""

from __future__ import annotations

import numpy as np

from lathesim.errors import nearest
from lathesim.motion.grid import ToolSpeed
from lathesim.motion.joint_path import FloatArray, JointPath, MotionError, PathCurve
from lathesim.motion.kinematics import Chain, Poses, forward, inverse, tip_speed

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
        joints = curve.derivative(0, spans, share * np.diff(curve.knots))
        away = forward(chain, joints).points - tips[:-1]
        along = np.clip(np.sum(away * ways, axis=1) / lengths, 0.0, 1.0)
        worst = np.maximum(worst, np.linalg.norm(away - along[:, None] * ways, axis=1))
    return worst
