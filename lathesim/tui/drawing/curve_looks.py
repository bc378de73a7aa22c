"""How the curves of a plot are told apart: each has a colour and a way its line is broken, so that colour is not the only sign."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Look:
    """``dash``: dots set and dots left out in turn; ``mark``: the same in three characters; the colours on a dark and a light ground."""

    dash: tuple[int, int]
    mark: str
    on_dark: str
    on_light: str

    def colour(self, is_dark: bool) -> str:
        """Return the colour for the ground."""
        return self.on_dark if is_dark else self.on_light


_WHOLE, _DASHED, _DOTTED = ((1, 0), "⠒⠒⠒"), ((5, 4), "⠒⠂⠐"), ((1, 2), "⠂⠐⠂")
LOOKS = (
    Look(*_WHOLE, "#4ade80", "#15803d"),
    Look(*_DASHED, "#fbbf24", "#b45309"),
    Look(*_DOTTED, "#22d3ee", "#0e7490"),
    Look(*_WHOLE, "#e879f9", "#a21caf"),
    Look(*_DASHED, "#f87171", "#b91c1c"),
    Look(*_DOTTED, "#93c5fd", "#1d4ed8"),
)
"""Looks of the first six curves; later ones begin again."""


def look_of(place: int) -> Look:
    """Return the look of a curve by its place among those drawn."""
    return LOOKS[place % len(LOOKS)]
