"""The stock remedies, by class name."""

from __future__ import annotations

import importlib

from lathesim.effects.remedies.remedy import Remedy

STOCK = {
    "command": ("CommandBias", "CommandGain", "InverseDeadZone", "FrictionFeedforward", "MotionFeedforward", "RippleFeedforward"),
    "learned": ("LearnedCorrection",),
    "play": ("BacklashShift", "PlayReading"),
    "error_table": ("PitchTable", "ReadingTable", "AcrossTable"),
    "growth": ("GrowthModel", "SpindleGrowthModel"),
    "structure": ("ComplianceShift", "SwingModel", "InputShaper"),
}
"""File -> the remedies that stand in it."""


def stock_remedies() -> dict[str, type[Remedy]]:
    """Return every stock remedy by its class name."""
    found: dict[str, type[Remedy]] = {}
    for module, names in STOCK.items():
        loaded = importlib.import_module(f"lathesim.effects.remedies.{module}")
        found |= {name: getattr(loaded, name) for name in names}
    return found
