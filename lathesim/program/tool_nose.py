"""Tools as a program or a person gives them: nose radius, orientation 1 to 9, and offsets."""

from __future__ import annotations

from dataclasses import dataclass

LEFT, RIGHT = 1, -1
"""The side of the contour on which the tool goes: left with G41, right with G42, seen along the motion."""

_FROM_CENTRE = {0: (0, 0), 1: (1, 1), 2: (1, -1), 3: (-1, -1), 4: (-1, 1), 5: (0, 1), 6: (1, 0), 7: (0, -1), 8: (-1, 0), 9: (0, 0)}
"""Where the imaginary tool point lies from the centre of the nose, in nose radii along (x, z), by orientation.

Source: Fanuc 0i-T operator's manual, imaginary tool nose; Haas lathe operator's manual, tip direction.
"""
ORIENTATIONS = tuple(_FROM_CENTRE)


@dataclass(frozen=True)
class Tool:
    """A tool: ``radius`` of its nose [m], ``orientation`` of its tool point, offsets [m, X as a radius]."""

    radius: float = 0.0
    orientation: int = 0
    x: float = 0.0
    z: float = 0.0


@dataclass(frozen=True)
class Nose:
    """The compensation in force: ``side`` is LEFT or RIGHT; the tool point lies ``(point_x, point_z)`` [m] from the centre of the nose.

    With ``starts_beside`` the first move ends beside the beginning of the next one, as on Fanuc; else the two meet in an inner corner.
    """

    side: int
    radius: float
    point_x: float
    point_z: float
    starts_beside: bool = False


def nose(side: int, tool: Tool, *, front: bool, starts_beside: bool = False) -> Nose:
    """Return the compensation with a tool; with ``front`` orientations count as on a lathe with its tool in front (X mirrored)."""
    x, z = _FROM_CENTRE[tool.orientation]
    return Nose(side, tool.radius, tool.radius * (-x if front else x), tool.radius * z, starts_beside)
