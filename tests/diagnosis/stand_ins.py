"""Stand-ins for effects in tests that look at one decision."""

from types import SimpleNamespace
from typing import Any

from lathesim.effects.effect import FAMILIES, Family, Identification


def effect_of(family: str, **entries: Any) -> Any:
    """Return what stands for an effect of a family, with further entries."""
    traits = FAMILIES.get(family, Family())
    how = Identification(sticks=traits.sticks, periodic=traits.periodic, full_band=traits.full_band)
    return SimpleNamespace(identification=how, family=family, **entries)
