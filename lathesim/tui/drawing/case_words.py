"""What the detective draws of a comparison: the wiring with the suspect parts, and values in the unit they are shown in."""

from __future__ import annotations

import numpy as np
from rich.text import Text

from lathesim.analysis.display_unit import display_unit
from lathesim.record import FloatArray
from lathesim.tui.model.case_file import CaseFile

_CHANNELS, _PARTS = 4, 6
"""Channels, and parts of each, that are shown."""


def wiring_chain(case: CaseFile) -> Text:
    """Return the parts that make each channel, those in which the mismatch sits in red and with a sign."""
    assert case.comparison is not None
    found = Text.assemble(("Wiring, from the sensor back; ✗ marks where the mismatch sits\n", "dim"))
    for item in case.comparison.replayed[:_CHANNELS]:
        found.append(f"{item.channel}: ")
        for place, part in enumerate(item.parts[:_PARTS]):
            found.append(" <- " if place else "")
            off = part in case.comparison.suspects
            found.append(f"[✗ {part}]" if off else part, style="bold red" if off else "")
        found.append("\n")
    return found


def scaled(unit: str, *values: FloatArray) -> tuple[str, list[FloatArray]]:
    """Return the display unit of values [SI] and the values in it."""
    largest = max((float(np.nanmax(np.abs(item))) for item in values if len(item) and np.isfinite(item).any()), default=0.0)
    factor, name = display_unit(unit, largest)
    return name or "1", [item / factor for item in values]
