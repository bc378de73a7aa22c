"""What kind of variable a mismatch may depend on."""

from __future__ import annotations

from enum import IntEnum


class Kind(IntEnum):
    """A kind of variable: the smaller, the simpler a dependence on it is.

    Of ``TOGETHER`` each of two variables may have any value: what is of another form than anything listed may depend on both.
    ``PARTIAL`` ones have a value only now and then, and what depends on them varies there; so does ``ANGLE``, and faster than a turn.
    """

    SIGN = 0
    VELOCITY = 1
    SPEED = 2
    POSITION = 3
    TIME = 4
    OTHER = 5
    TOGETHER = 6
    PARTIAL = 7
    ANGLE = 8

    @property
    def is_partial(self) -> bool:
        """Whether it has a value only now and then."""
        return self in (Kind.PARTIAL, Kind.ANGLE)

    @property
    def is_motion(self) -> bool:
        """Whether it is the velocity or its sign, which are always named."""
        return self in (Kind.SIGN, Kind.VELOCITY)
