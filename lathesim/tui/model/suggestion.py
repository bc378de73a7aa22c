"""Settings that a lesson's "things to try" name in their text, as one can set them with a key."""

from __future__ import annotations

import re
from dataclasses import dataclass

from lathesim.tui.model.setup import Setup

_SET = re.compile(r"--set\s+([A-Za-z_]\w*\.[A-Za-z_]\w*)=('[^']+'|\"[^\"]+\"|[^\s,;]+)")
_VARIANT = re.compile(r"--variant\s+([\w.+-]*\w)")


@dataclass(frozen=True)
class Suggestion:
    """What to try, in words, and the settings named there."""

    text: str
    values: tuple[tuple[str, str], ...] = ()
    variant: str | None = None

    @property
    def can_be_set(self) -> bool:
        """Whether the text names settings."""
        return bool(self.values or self.variant)

    def applied(self, setup: Setup) -> Setup:
        """Return a setup with what the text names."""
        for name, quantity in self.values:
            setup = setup.with_value(name, quantity)
        return setup.with_variant(self.variant) if self.variant is not None else setup


def suggestion(text: str, variants: tuple[str, ...]) -> Suggestion:
    """Return what a line of a lesson's ``try`` suggests: ``--set part.name=value`` and ``--variant NAME`` are understood.

    Of a plain text that names one variant alone, as "Run case I", the variant is taken.
    """
    values = tuple((name, value.strip("'\"").rstrip(".")) for name, value in _SET.findall(text))
    named = [name for name in _VARIANT.findall(text) if name in variants]
    if not values and not named:
        named = [word for word in dict.fromkeys(re.findall(r"[\w+-]+", text)) if word in variants]
        named = named if len(named) == 1 else []
    return Suggestion(text, values, named[0] if named else None)
